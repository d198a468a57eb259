"""What perception makes of made-up pictures and returns: names, places and sizes of before."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

from fingerprints import check
from unit.control.test_perception import COLORS, painted, sea
from unit.control.test_placards import blinking, panel, symbol
from vrx_mj.control import buoy_map, perception, placards
from vrx_mj.control.buoy_map import Buoy, BuoyMap, Cluster, banks, standing_free
from vrx_mj.control.channel import gate_of, next_gate, opening, pair_buoys, side_of, wall
from vrx_mj.control.docking import Docking
from vrx_mj.control.guidance import approach_speed, around, best_order, clear_course, clear_of, orbit
from vrx_mj.control.navigation import Estimate
from vrx_mj.control.perception import OLD, SYDNEY, Blob, Sight, View, blobs, catalogue_of
from vrx_mj.control.pilot import Moment
from vrx_mj.control.placards import DockLookout, Face, FaceMap, Tower, lamp_color, sequence, symbol_in

RNG = np.random.default_rng
GREYS = (0, 25, 60, 110, 170, 255)
PIXELS = np.array(list(itertools.product(GREYS, GREYS, GREYS)), np.uint8)
"""Colours all over the cube."""


def estimate(x=0.0, y=0.0, heading=0.0, z=0.0):
    c, s = math.cos(heading), math.sin(heading)
    return Estimate(x, y, z, heading, 0.3, -0.2, 0.1, np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def test_every_colour_has_the_name_that_it_had():
    behind = [(20.0, 55.0, 75.0), (107.0, 138.0, 160.0), (200.0, 200.0, 200.0)]
    found = [perception._kinds(PIXELS.astype(float), np.broadcast_to(water, PIXELS.shape)) for water in behind]
    names = [[buoy_map.color_of([pixel], [water]) for pixel in PIXELS] for water in behind]
    many = [buoy_map.color_of(np.roll(PIXELS, n, axis=0)[:20], [behind[1]] * 20) for n in range(0, len(PIXELS), 5)]
    vivid = [placards._vivid(PIXELS), placards._vivid(PIXELS, lead=0.3)]
    check("perception", "colours", found=found, names=names, many=many, vivid=vivid)


def test_every_look_and_blob_is_of_the_kind_that_it_was():
    sizes = (0.1, 0.2, 0.45, 0.62, 0.66, 0.9, 1.4, 1.6)
    looks = [buoy_map.kind_of(buoy_map.Look(*one)) for one in itertools.product(COLORS, sizes, sizes)]
    kinds, scales = [], (None, 40.0, 75.0, 110.0)
    for color, width, height, pale, year, scale in itertools.product(
        COLORS, (20.0, 48.0, 90.0), (30.0, 60.0), (False, True), (OLD, SYDNEY), scales
    ):
        kinds.append(perception.kind_of(Blob(color, 640.0, 400.0, width, height, pale), year, scale))
    years = [catalogue_of(types) for types in ((), ("red_totem",), ("surmark950410",), ("polyform_a7", "red_totem"))]
    years += [catalogue_of(types) for types in (("mb_round_buoy_orange",), ("red_totem", "mb_marker_buoy_red"))]
    check("perception", "kinds", looks=looks, kinds=kinds, years=years)


def crowded(light=1.0):
    """A sea with things of all colours and sizes, some banded, cut off, beside or below another."""
    picture, random = sea(light), RNG(7)
    for number, color in enumerate(list(COLORS) * 4):
        width, height = random.integers(6, 60, 2)
        left, top = 20 + 43 * number, random.integers(210, 480)
        painted(picture, color, left, top, width, height, light)
        if number % 3 == 0:
            painted(picture, "white", left, top + height // 2, width, max(4, height // 6), light)
        if number % 4 == 1:
            painted(picture, color, left + 3, top + height + 5, width, height // 2, light)
    return picture


@pytest.mark.parametrize("light", [1.0, 0.5])
def test_things_in_a_picture_are_the_blobs_that_they_were(light):
    picture = crowded(light)
    found = [blobs(picture[:, :640], 180.0), blobs(picture[:, 640:], 261.0), blobs(picture[:, ::3], -40.0)]
    assert len(found[0]) > 8
    looks = [
        buoy_map.look_at(picture, 30.0 + 43 * number, row, scale, size=size)
        for number, row in itertools.product(range(28), (250.0, 330.0))
        for scale, size in ((20.0, (1.4, 2.4)), (40.0, (1.4, 1.8)))
    ]
    assert sum(look is not None for look in looks) > 8
    check("perception", f"picture in {light:g}", found=found, looks=looks)


def test_parts_of_things_are_put_together_as_they_were():
    parts = [
        Blob(color, 100.0 + dx, 100.0 + dy, wide, 20.0, False)
        for color, dx, dy, wide in itertools.product(("red", "white"), (0.0, 7.0, 20.0), (0.0, 28.0, 45.0), (8.0, 40.0))
    ]
    found = [perception._merge_parts([one, *parts[number::5]]) for number, one in enumerate(parts)]
    check("perception", "parts", found=found)


def test_a_view_places_things_where_it_did():
    tilt = np.array([[0.97, 0.0, 0.24], [0.0, 1.0, 0.0], [-0.24, 0.0, 0.97]])
    matrix = np.array([[760.0, 0.0, 640.0], [0.0, 760.0, 360.0], [0.0, 0.0, 1.0]])
    found = []
    for seen in (estimate(), estimate(5.0, -3.0, 2.0, 0.2)):
        view = View(np.array([0.75, 0.1, 1.5]), tilt, matrix, seen)
        things = [
            Blob("red", column, row, 40.0, 60.0, False) for column in (200.0, 640.0, 900.0) for row in (300.0, 500.0)
        ]
        found.append([view.horizon(), [(view.place(one, 0.5), view.scale(one)) for one in things]])
        points = np.array([(8.0, 2.0, 0.5), (-8.0, 1.0, 0.0), (0.95, 0.0, 1.4), (1.0, 0.2, 1.7)])
        found += [buoy_map.project(point, (view.position, tilt), seen.rotation, matrix) for point in points]
    check("perception", "views", found=found)


def test_a_thing_is_reported_from_its_second_picture_on_and_forgotten():
    perceiver = perception.Perceiver(SYDNEY)
    perceiver._catalogue = SYDNEY
    view = View(
        np.array([0.75, 0.0, 1.5]), np.eye(3), np.array([[760.0, 0, 640], [0, 760.0, 360], [0, 0, 1]]), estimate()
    )
    found = []
    for t, column, width in itertools.product((1.0, 2.0, 3.0), (500.0, 560.0, 640.0, 648.0), (20.0, 24.0, 60.0)):
        perceiver._take(view, Blob("red", column, 420.0, width, 2.0 * width, False), t)
        found.append([Sight(**vars(sight)) for sight in perceiver._sights])
    check("perception", "sights", found=found)


# Returns


def test_panels_among_returns_are_the_faces_that_they_were():
    random, found = RNG(3), []
    for distance, facing, width, top in itertools.product(
        (8.0, 17.0, 30.0), (2.6, 3.3), (1.3, 1.5, 2.4, 2.6), (1.5, 3.2, 3.9)
    ):
        points = panel(distance, 1.0, facing, width, top - 1.2, top) + random.normal(0.0, 0.05, (126, 3))
        edge = panel(distance + 0.9, 1.6, facing, 0.8, top - 1.2, top) + random.normal(0.0, 0.02, (126, 3))
        found += [placards.faces(points), placards.faces(np.concatenate([points, edge]))]
    assert sum(map(len, found)) > 20
    check("perception", "panels", found=found)


def test_clusters_that_stand_free_are_the_ones_that_did():
    random = RNG(5)
    middles = random.uniform(-30.0, 30.0, (25, 2))
    points = [np.column_stack([middle + random.normal(0.0, 0.1 + 0.05 * number, (9, 2)), random.uniform(-0.7, 3.6, 9)])
              for number, middle in enumerate(middles)]  # fmt: skip
    whole = np.concatenate(points)
    found = [standing_free(whole, widest=widest, apart=apart) for widest in (0.7, 1.4, 2.6) for apart in (1.0, 4.0)]
    found += [banks(whole, (3.0, -2.0)), banks(whole, (0.0, 0.0), reach=8.0, cell=1.0)]
    check("perception", "clusters", found=found)


def test_maps_of_buoys_and_faces_take_and_forget_as_they_did():
    buoys, walls, random, found = BuoyMap(), FaceMap(), RNG(6), []
    places = random.uniform(-25.0, 25.0, (12, 2))
    for look in range(40):
        there = places[look % 5 :: 2 + look % 3] + random.normal(0.0, 0.3, (len(places[look % 5 :: 2 + look % 3]), 2))
        clusters = [Cluster(*place, 0.4 + 0.12 * n, 0.0, 0.5 + 0.2 * n, 5) for n, place in enumerate(there.tolist())]
        buoys.see((0.1 * look, 0.0), clusters, 0.75 * look)
        walls.see((0.1 * look, 0.0), [Face(x, y, 0.8 * n) for n, (x, y) in enumerate(there.tolist())])
        found.append([[vars(each).copy() for each in kept] for kept in (buoys.buoys, buoys.sure, walls.faces)])
    check("perception", "maps", found=[*found[::4], found[-1]])


def test_symbols_lamps_and_sequences_are_read_as_they_were():
    shapes, random = ("circle", "rectangle", "cross", "triangle"), RNG(8)
    sizes = ((9, 1.0, 0.9, 0.0), (14, 0.5, 0.3, 0.2), (30, 0.8, 0.6, 0.45))
    symbols = [
        symbol_in(symbol(color, shape, size, lean=lean, light=light, fog=fog))
        for (color, shape), (size, lean, light, fog) in itertools.product(
            itertools.product(("red", "green", "blue", "yellow"), shapes), sizes
        )
    ]
    for size, shape in itertools.product((7, 8, 9, 12), shapes):
        window = symbol("red", shape, size)
        rows, columns = np.nonzero(window[..., 1] < 60)
        window[rows.min() - 1, columns.min()] = window[rows.max(), columns.max() + 1] = (
            230,
            0,
            0,
        )  # flecks at its sides
        symbols += [symbol_in(window), symbol_in(window[:, : columns.max() - 1]), symbol_in(window[rows.min() + 2 :])]
    lamps, times = [], []
    for number in range(60):
        window = np.full((56, 14, 3), (120, 150, 170), np.uint8)
        window[36:40, 5:9] = (190, 185, 10)
        top, height, wide = random.integers(2, 34), random.integers(1, 8), random.integers(1, 6)
        window[top : top + height, 5 : 5 + wide] = PIXELS[(37 * number) % len(PIXELS)]
        lamps.append(lamp_color(window))
    for start, period in itertools.product((0.0, 0.7, 2.6, 4.9), (0.4, 0.9, 1.4)):
        looks = blinking(["red", "green", "blue"], start=start, period=period)
        times.append([sequence(looks[:count]) for count in range(2, len(looks) + 1, 3)])
    masks = [random.random((12, 9)) < share for share in (0.1, 0.3, 0.5, 0.8)]
    parts = [(buoy_map.middle_part(mask), placards._fill(mask), placards._shape(mask)) for mask in masks]
    check("perception", "symbols", symbols=symbols, lamps=lamps, times=times, parts=parts)


def test_faces_and_towers_are_worth_a_look_where_they_were():
    found, faces = [], []
    for x, y, heading in itertools.product((-3.0, -10.0, -30.0, -47.0, -62.0), (-20.0, 0.0, 15.0), (-0.5, 0.0, 0.7)):
        seen = estimate(x, y, heading)
        face, tower = Face(0.0, 0.0, 2.8), Tower((0.0, 1.0), seen=3)
        found += [placards._legible(face, seen), placards._in_view(tower, seen), tower.far(seen)]
        buoy = Buoy(0.0, 0.0, seen=2)
        found += [buoy_map.Lookout._is_worth_a_look(buoy, seen)]
    for votes, looks in itertools.product(range(3, 7), range(10, 14)):
        face = Face(0.0, 0.0, math.pi, looks=looks)
        face.votes["red_cross"] = votes
        found += [placards._legible(face, estimate(-10.0)), face.symbol]
    others = itertools.product((0.0, 1.1, 1.3), (0.0, 0.9, 1.2))
    faces += [Face(0.0, 0.0, 0.0).is_like(Face(x, 0.0, facing)) for x, facing in others]
    for first, second in itertools.product(range(5), range(5)):
        buoy = Buoy(0.0, 0.0)
        buoy.votes.update({"red": first, "ball": second})
        faces.append(buoy.kind)
    for unseen, looks, away in itertools.product((11.75, 12.0, 12.25), (1, 2, 5, 6), (17.9, 18.0, 18.1)):
        faces.append(BuoyMap._is_gone(Buoy(away, 0.0, seen=looks), (0.0, 0.0), unseen))
    check("perception", "views of placards", found=found, faces=faces)


def test_a_tower_is_watched_until_its_lights_are_known_or_it_is_dark():
    lookout, found = DockLookout(), []
    for lamps in (("red", "green", "blue"), ("red", "red", "red"), ("off",) * 3):
        tower = Tower((12.0, 0.0), seen=9)
        for number in range(80):
            t = 0.3 * number
            picture = np.full((360, 640, 3), (120, 150, 170), np.uint8)
            lamp = [*lamps, "off", "off"][int(t % 5.0)]
            if lamp in COLORS:
                picture[160:176, 316:324] = {"red": (230, 0, 0), "green": (0, 230, 0), "blue": (0, 0, 230)}[lamp]
            mount = SimpleNamespace(position=np.array([0.7, 0.0, 1.5]), rotation=np.eye(3))
            info = SimpleNamespace(K=(380.0, 0.0, 320.0, 0.0, 380.0, 180.0, 0.0, 0.0, 1.0))
            reading = SimpleNamespace(data=SimpleNamespace(rgb=picture, info=info), mount=mount)
            boat = SimpleNamespace(sensors={"camera": reading})
            found.append([lookout.watch(Moment(boat, estimate(), {}, t), tower), tower.rejected, len(tower.shows)])
        found.append([sorted(tower.colors), tower.shows])
    blind = Tower((12.0, 0.0))
    assert lookout.watch(Moment(SimpleNamespace(sensors={}), estimate(), {}, 0.0), blind) is None
    assert blind.rejected
    lookout._map.faces = [Face(12.0, 0.0, math.pi, seen=9)]
    lookout._read_signs(Moment(SimpleNamespace(sensors={}), estimate(), {}, 0.0))
    assert lookout.faces[0].looks == 0
    check("perception", "towers", found=found)


# Ways


def test_ways_past_discs_and_through_gates_are_what_they_were():
    random, found = RNG(9), []
    for number in range(60):
        places = [tuple(place) for place in random.uniform(-20.0, 20.0, (7, 2)).tolist()]
        discs = [(place, 1.5 + 0.7 * n) for n, place in enumerate(places[2:6])]
        here, goal, heading = places[0], places[1], float(random.uniform(-3.0, 3.0))
        before = None if number % 3 else heading + 0.3
        found += [around(here, goal, discs), clear_of(goal, discs), orbit(goal, 5.0, 1.0 - 2.0 * (number % 2), 3.0)]
        found.append(clear_course(here, heading, discs, reach=14.0, before=before))
        found.append(best_order(here, places[: 2 + number % 6]))
        gate = gate_of(here, goal)
        found += [gate, opening(gate, places[2:], 2.7), side_of(gate, places[2]), wall(gate, spacing=1.5)]
        gates = pair_buoys(places[:3], places[3:])
        found += [gates, next_gate(places[6], None if number % 2 else heading, gates)]
    many = [tuple(place) for place in random.uniform(-9.0, 9.0, (9, 2)).tolist()]
    found += [best_order((0.0, 0.0), many[:count]) for count in (0, 1, 7, 8, 9)]
    found += [
        approach_speed(0.2 * n, rate, braking) for n in range(30) for rate in (0.5, 0.9) for braking in (0.3, 1.0)
    ]
    check("perception", "ways", found=found)


def test_a_boat_in_a_dock_moves_on_by_stages_as_it_did():
    """Every stage at places along and beside the axis, and how fast it is told to go there."""
    pilot = SimpleNamespace(sail=lambda seen, t, *velocity_and_heading: velocity_and_heading)
    found = []
    along, across = (4.5, 5.6, 8.9, 9.1, 11.5, 12.6, 13.9, 14.1, 18.5), (0.0, 0.3, 0.4, 1.2, 1.4, 1.9, 2.1)
    for stage, x, y, turned in itertools.product(("line up", "in", "stay", "out"), along, across, (0.0, 0.11)):
        docking = Docking()
        docking._pilot, docking._bay, docking._stage = pilot, Face(0.0, 0.0, 0.0, seen=9), stage
        docking._go = lambda now, place: ("go", *place)
        docking._since = 8.6 if y else 8.4
        found += [docking._dock(Moment(None, estimate(x, y, math.pi + turned), {}, 20.0)), docking._stage]
    check("perception", "stages", found=found)
