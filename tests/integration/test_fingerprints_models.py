"""What files may say, and what docks, surfaces, objects and scenes are made of: the numbers that they had before."""

import itertools
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest

import vrx_mj
from axes_files import SAMPLES, WORLDS
from fingerprints import NUMBER, check, numbers_in
from gazebo_files import classic_text, newer_text
from integration.test_fingerprints_files import CLASSIC, NEWER
from integration.test_fingerprints_worlds import compiled, model_numbers
from vrx_mj.config.docks import board_holes, find_bays, load_dock
from vrx_mj.config.fleet import FleetConfig
from vrx_mj.config.layouts import Layout, headings, spots
from vrx_mj.config.measured import MeasuredCaseConfig
from vrx_mj.config.objects import ObjectConfig, load_object
from vrx_mj.config.robots import RobotConfig
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import WorldConfig, load_world
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.docks import block_tree, docks_overlap
from vrx_mj.mjcf.flotation import below, flotation, flotation_at, hull_sheet, outline
from vrx_mj.mjcf.objects import object_piece, place_docks
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.mjcf.surfaces import checked_surface, crossings, overlap, panels_of
from vrx_mj.model.world import tree_of

KINDS = (WorldConfig, FleetConfig, ObjectConfig, RobotConfig, MeasuredCaseConfig)
LIMITS = {"minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "minItems", "maxItems", "default", "enum",
          "const", "required", "additionalProperties"}  # fmt: skip
DRAWINGS = {
    "one": "X", "row": "XXXX", "bay": "XXX\nX X\nX X", "through": "X X\nX X\nX X", "pond": "XXX\nX X\nXXX",
    "comb": "XXXXXXX\nX X X X\nX X X X\nX   X", "sides": "XXXX\nX\nX\nXXXX\n  X\n XX",
}  # fmt: skip
SKIES = {
    "clear": {},
    "evening": {"sky": {"time": 19.2, "sunrise": 5.5, "sunset": 20.5}, "ambient": [0.2, 0.3, 0.4]},
    "before dawn": {"sky": {"time": 5.0}, "shadows": False, "background": [0.1, 0.2, 0.3]},
    "no sky": {"sky": False, "background": "orange"},
    "linear fog": {"fog": {"type": "linear", "color": [0.6, 0.7, 0.8], "start": 20, "end": 300}},
    "exp fog": {"fog": {"type": "exp", "color": "grey", "density": 0.02}},
    "quadratic fog": {"fog": {"type": "quadratic", "density": 0.01}},
}  # fmt: skip


def plain(value):
    """A value of a file, its texts each as one word."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items() if key not in {"description", "folder"}}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return value if isinstance(value, int | float) else str(value).replace(" ", "_")


def limits(schema, place=""):
    """Bounds, choices and defaults of a schema, each with its place in it."""
    for key, value in sorted(schema.items()) if isinstance(schema, dict) else enumerate(schema):
        if key in LIMITS:
            yield [f"{place}/{key}", plain(value)]
        elif isinstance(value, dict | list):
            yield from limits(value, f"{place}/{key}")


def words_and_numbers(text):
    """The words of a file of MuJoCo, and the numbers, which another machine may round."""
    return [NUMBER.sub("", text).split(), numbers_in(text)]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_files_have_the_keys_bounds_and_defaults_that_they_had(kind):
    parts = kind.model_json_schema()
    inner = parts.pop("$defs", {})
    check(
        "models", f"keys of {kind.__name__}", own=limits(parts), **{name: limits(inner[name]) for name in sorted(inner)}
    )


def check_read(source, key):
    """What a world's file says, with its defaults."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vrx_mj.VrxWarning)
        read = load_world(source).model_dump(mode="json")
    check("models", f"world {key}", **plain(read))


def test_worlds_read_as_they_did():
    for name in catalogue("worlds"):
        if not name.startswith("vrx2"):
            check_read(name, name)


def test_worlds_of_gazebo_read_as_they_did(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in (CLASSIC[1], NEWER[0]):
        Path("bay.sdf").write_text((classic_text if name in CLASSIC else newer_text)(name), encoding="utf-8")
        check_read("bay.sdf", f"{name} of Gazebo")


def test_series_read_as_they_did():
    for name, count in WORLDS.items():
        check_read(f"{SAMPLES / name}.yaml#{count - 1}", name)


@pytest.mark.parametrize("block", [0.5, 2.0])
@pytest.mark.parametrize("name", DRAWINGS)
def test_a_drawing_has_the_bays_boards_and_holes_that_it_had(name, block):
    cells = load_dock(DRAWINGS[name])
    bays = find_bays(cells)
    boards = [bay.board(block, "board", model) for bay in bays for model in ("placard", "placard_2022")]
    holes = [hole.model_dump() for number, board in enumerate(boards, 1) for hole in board_holes(number, board)]
    zones = [[zone.center, zone.size] for bay in bays for zone in bay.zones(block)]
    check("models", f"drawing {name} of {block}", cells=cells, bays=bays, zones=zones,
          tree=name != "through" and block_tree(cells), holes=holes,
          boards=[board.model_dump() for board in boards])  # fmt: skip


def scenery_of(world):
    """A compiled world without its boats' hulls, whose mean forces of waves differ a little between processors."""
    return {name: rows for name, rows in tree_of(world.parameters).items() if name != "hulls"}


@pytest.mark.parametrize("dynamic", [False, True])
@pytest.mark.parametrize("name", ["sides", "pond"])
def test_a_dock_is_the_model_that_it_was(name, dynamic):
    dock = {"name": "pier", "layout": DRAWINGS[name], "dynamic": dynamic, "pose": [12, -7, 0.1, 0, 0, 0.6]}
    for profile, block in (("vrx", 2.0), ("marine", 1.0)):
        moored = {"mooring": {}} if dynamic and profile == "marine" else {}
        world = compiled({"physics": {"profile": profile}, "docks": [dock | {"block": block} | moored],
                          "wind": {"mean_velocity": 4}}, fleet={"boats": []})  # fmt: skip
        model = mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets))
        check("models", f"dock {name}, {profile}, {dynamic}", mjcf=words_and_numbers(world.mjcf),
              tree=scenery_of(world), model=model_numbers(model))  # fmt: skip


def test_docks_overlap_where_they_did():
    corner = {"layout": DRAWINGS["bay"], "block": 1.0}
    places = [(x, y, yaw) for x in (0.9, 2.4, 3.1, 3.9) for y in (0.0, 1.1, 3.2) for yaw in (0.0, 0.5, 2.0)]
    docks = [{"name": "first", **corner}] + [
        {"name": f"d{i}", **corner, "pose": [x, y, 0, 0, 0, yaw]} for i, (x, y, yaw) in enumerate(places)
    ]
    config = load_world({"docks": docks})
    first, *others = place_docks(config.docks, config.objects)
    check("models", "overlaps", found=[docks_overlap(first, other) for other in others])


def ball(turns, rng):
    """A closed surface of an octahedron, divided and pushed about."""
    ends = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = [(i, (i + 1) % 4, 4) for i in range(4)] + [((i + 1) % 4, i, 5) for i in range(4)]
    corners = ends[np.array(faces)]
    for _ in range(turns):
        middle = 0.5 * (corners + np.roll(corners, -1, axis=1))
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = middle.transpose(1, 0, 2)
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
        corners /= np.linalg.norm(corners, axis=2, keepdims=True)
    return corners * rng.uniform(0.5, 2.0, 3) + rng.uniform(-0.4, 0.4, 3)


def remarks(corners, **named):
    """What is said of a surface, or why it is refused."""
    try:
        return [said.replace(" ", "_") for said in checked_surface(corners, **named)]
    except VrxError as error:
        return [str(error).replace(" ", "_")]


@pytest.mark.parametrize("seed", range(2))
def test_surfaces_cross_overlap_and_are_divided_as_before(seed):
    rng = np.random.default_rng(seed)
    shapes = [ball(turns, rng) for turns in (0, 1, 2)]
    two = [np.concatenate(pair) for pair in itertools.pairwise(shapes)]
    inside_out = np.concatenate([shapes[0], shapes[1][:, ::-1]])
    check("models", f"surfaces {seed}",
          overlap=[overlap(each) for each in (*shapes, *two, inside_out)],
          crossings=[crossings(each) for each in (*shapes, *two)],
          panels=[panels_of(each) for each in (*shapes, shapes[0] * (9.0, 1.0, 0.3))],
          remarks=[*map(remarks, (*shapes, inside_out)),
                   remarks(two[0], names=("bow", "stern"), starts=(0, len(shapes[0])))])  # fmt: skip


@pytest.mark.parametrize("share", [0.004, 0.006, 0.009, 0.011])
def test_parts_that_overlap_by_half_a_percent_are_remarked_upon(share):
    box = ball(0, np.random.default_rng(0))
    box -= box.mean(axis=(0, 1))
    apart = np.array([np.ptp(box[..., 0]) * (1.0 - share ** (1 / 3)), 0.0, 0.0])
    check("models", f"overlap {share}", said=remarks(np.concatenate([box, box + apart])))


@pytest.mark.parametrize("name", SKIES)
def test_a_scene_is_made_as_it_was(name):
    world = compiled(
        {"scene": SKIES[name], "georeference": {"latitude": 21.3, "longitude": -157.9}}, fleet={"boats": []}
    )
    check("models", f"scene {name}", mjcf=words_and_numbers(world.mjcf), tree=scenery_of(world))
    if name == "evening":
        model = drawing_model(world)
        drawn = {key: getattr(model, key) for key in dir(model) if key.startswith(("tex_", "skin_"))}
        check("models", f"scene {name}, drawn", model=model_numbers(model),
              textures=[value for value in drawn.values() if isinstance(value, np.ndarray)])  # fmt: skip


@pytest.mark.parametrize("seed", range(2))
def test_hulls_float_as_they_did(seed):
    rng = np.random.default_rng(seed)
    for number, hull in enumerate(ball(turns, rng) for turns in (0, 1, 2)):
        levels = np.linspace(hull[..., 2].min(), hull[..., 2].max(), 7)[1:-1]
        volume = flotation_at(hull, 9.0).volume
        check("models", f"hull {seed}.{number}", cut=[[below(hull, level), outline(hull, level)] for level in levels],
              afloat=[flotation_at(hull, level) for level in (-9.0, *levels, 9.0)],
              displacing=[flotation(hull, share * volume) for share in (0.1, 0.45, 0.9)],
              sheet=hull_sheet(hull, 400.0 * volume, (0.1, -0.05, -0.2)))  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 5, 9])
def test_boats_stand_where_they_did(count):
    own = {"circle": {"radius": 12.0, "start_angle": 25.0}, "random": {"spacing": 4.0, "size": 30.0}}
    for name in ("circle", "line", "column", "wedge", "grid", "random"):
        layouts = [Layout(layout=name), Layout(layout=name, headings="compass", heading=30.0,
                                               **own.get(name, {"spacing": 7.0}))]  # fmt: skip
        layouts += [Layout(layout=name, heading=way) for way in ("outward", "inward", "tangent")]
        places = [spots(layout, count, seed=4) for layout in layouts]
        turns = [headings(layout, there, seed=4) for layout, there in zip(layouts, places, strict=True)]
        check("models", f"{count} boats in a {name}", places=places, turns=turns)


def test_objects_are_made_as_they_were():
    for name in catalogue("objects"):
        thing = load_object(name)
        if thing.kind != "composite":
            pieces = [object_piece(thing, asleep=asleep) for asleep in (False, True)]
            check("models", f"object {name}", made=[words_and_numbers(piece.text) for piece in pieces],
                  files=sorted(pieces[0].files))  # fmt: skip
