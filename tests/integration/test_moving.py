"""What moves by itself and what lights up: animals on their paths, light buoys, placards, and a ball through a hole."""

import math
from itertools import pairwise

import numpy as np
import pytest

import vrx_mj
from integration.sailing import AFLOAT, CALM, GUSTY, ROUGH, boats, same_bits, simulation
from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.model.world import tree_of
from vrx_mj.recording.motion_chunks import MovingChunks
from vrx_mj.recording.reader import read_record
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.sensors.displays import displays_of

MASS, RADIUS, CENTRE, BALLAST = 20.0, 0.325, 0.2, -2.0  # of an animal: sphere at CENTRE, centre of mass at BALLAST
LINEAR, ANGULAR, G = 25.0, 2.0, 9.8
WHOLE = 4 / 3 * math.pi * RADIUS**3
ALONE = boats((-100.0, 0.0, 0.0))


def swimming(path, *, sea=CALM, wind=None, yaw=0.0, model="crocodile_buoy", seed=None, **world):
    animal = {"name": "animal", "model": model, "pose": [0, 0, -0.027, 0, 0, yaw], "path": path}
    return simulation(ALONE, sea=sea, wind=wind, objects=[animal], seed=seed, **world)


def cap(volume):
    """Height of a sphere's cap of this volume [m3], by bisection, and its centroid below the sphere's centre [m]."""
    low, high = 0.0, 2 * RADIUS
    for _ in range(80):
        h = (low + high) / 2
        low, high = (h, high) if math.pi * h**2 * (3 * RADIUS - h) / 3 < volume else (low, h)
    return h, 3 * (2 * RADIUS - h) ** 2 / (4 * (3 * RADIUS - h))


def steady_speed(force):
    """Speed [m/s] at which drag takes up the force, with the pitch [rad] at which the ballast takes up their couple.

    The force acts at the origin along the pitched x axis, drag at the centroid of what is under water; a sphere's
    buoyancy goes through its centre. Moments are about the centre of mass; nose down is positive.
    """
    pitch = 0.0
    for _ in range(50):
        lift = MASS * G + force * math.sin(pitch)
        wet = lift / (1000.0 * G)
        _, below = cap(wet)
        drag = force * math.cos(pitch)
        arm = (CENTRE - BALLAST) * math.cos(pitch) - below
        pitch = math.asin((-force * BALLAST - drag * arm) / (lift * (CENTRE - BALLAST)))
    return drag / (LINEAR * MASS * wet / WHOLE), pitch


@pytest.mark.parametrize("force", [10.0, 18.0])
def test_an_animal_swims_as_fast_as_drag_lets_it(force):
    sim = swimming({"waypoints": [[200, 0]], "force": force})
    sim.advance(6000)
    seen = sim.observe_object("animal")
    speed, pitch = steady_speed(force)
    assert seen.position[1] == pytest.approx(0.0, abs=1e-9)
    assert sim.data.qvel[int(sim._live.arrays.floats["dof"][0])] == pytest.approx(speed, rel=1e-6)
    w, x, y, z = seen.quaternion
    assert math.asin(2 * (w * y - z * x)) == pytest.approx(pitch, abs=1e-6)


def test_an_animal_turns_as_fast_as_drag_lets_it():
    sim = swimming({"waypoints": [[-200, 50]], "force": 0.0})
    sim.advance(400)
    wet = MASS / 1000.0
    drag = ANGULAR * MASS * wet / WHOLE * (2 * RADIUS) ** 2
    assert sim.observe_object("animal").angular_velocity[2] == pytest.approx(1.0 / drag, rel=1e-4)  # e^-9 is missing


def test_it_comes_to_look_at_its_waypoint_and_reaches_it():
    sim = swimming({"waypoints": [[-3, 2], [50, 0]], "loop": False})
    sim.advance(1000)
    seen = sim.observe_object("animal")
    wanted = math.atan2(2 - seen.position[1], -3 - seen.position[0])
    assert abs(math.remainder(seen.heading - wanted, math.tau)) < math.radians(15)  # it goes to and fro
    nearest = 9.0
    for _ in range(40):
        sim.advance(100)
        nearest = min(nearest, math.dist(sim.observe_object("animal").position[:2], (-3, 2)))
    assert nearest < 0.5
    assert sim.observe_object("animal").position[0] > -2.0  # on its way to the next


def rounds(sim, count):
    """Targets in the order in which they are swum to, and how far it was from each when it took the next [m]."""
    points = np.array([row["position"] for row in tree_of(sim.world.parameters)["path_points"]])
    state, seen, gaps = sim._live.arrays.follower_state, [0], []
    for _ in range(20_000):
        sim.advance(10)
        target = int(state["target"][0])
        if target != seen[-1]:
            gaps.append(math.dist(sim.observe_object("animal").position[:2], points[seen[-1]]))
            seen.append(target)
        if len(seen) > count:
            break
    return seen, gaps


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
def test_a_circle_is_swum_point_by_point_and_again(profile):
    physics = {"profile": profile, "timestep": 0.01 if profile == "vrx" else 0.004}
    world = {"physics": physics, "sea": CALM, "objects": [
        {"name": "animal", "model": "crocodile_buoy", "pose": [0, 0, 0, 0, 0, 0],
         "path": {"circle": {"radius": 3}, "force": 18, "torque": 1.5}},
    ]}  # fmt: skip
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=ALONE))
    assert tree_of(sim.world.parameters)["followers"][0]["turns_first"] == (profile == "vrx3")
    seen, gaps = rounds(sim, 10)
    assert seen == [0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2]
    assert max(gaps) < 0.52  # 0.5 m, and what it swims in ten steps


def test_the_beacon_of_2023_races_along_and_stays_in_the_water():
    """350 N at its origin; 0.3 m lower, at its centre of mass, they would lift it out and let it fly."""
    path = {"waypoints": [[60, 0], [0, 0]], "force": 350, "torque": 1.5, "turns_first": True}
    sim = swimming(path, model="moving_pinger", timestep=0.004)
    seen = []
    for _ in range(60):
        sim.advance(125)
        seen.append(sim.observe_object("animal"))
    assert 1.3 < max(one.speed for one in seen) < 1.8
    assert max(abs(one.position[2]) for one in seen) < 0.15


def test_a_line_is_swum_to_and_fro():
    sim = swimming({"line": {"length": 4, "direction": math.pi / 2}}, yaw=math.pi / 2)
    assert tree_of(sim.world.parameters)["path_points"][1]["position"] == pytest.approx([-4.0, 0.0])
    assert rounds(sim, 3)[0] == [0, 1, 0, 1]


def test_the_same_seed_gives_the_same_bits_and_a_state_goes_on_from_there():
    path = {"circle": {"radius": 1}}
    one, other = (swimming(path, sea=ROUGH, wind=GUSTY, seed=3) for _ in range(2))
    for sim in (one, other):
        sim.advance(2500)
    state = one.get_state()
    assert state.sha256 == other.get_state().sha256
    assert one._live.arrays.follower_state["target"][0] > 0
    one.advance(2000)
    target, expected = one._live.arrays.follower_state["target"][0], one.get_state().sha256
    one.reset()
    assert one._live.arrays.follower_state["target"][0] == 0
    one.set_state(vrx_mj.State.from_bytes(state.to_bytes()))
    one.advance(2000)
    assert (one._live.arrays.follower_state["target"][0], one.get_state().sha256) == (target, expected)


def test_without_a_path_it_drifts_as_the_static_one():
    ways = []
    for model, path in (("crocodile_buoy", None), ("crocodile_static", None)):
        sim = swimming(path, model=model, sea=ROUGH, wind=GUSTY)
        assert tree_of(sim.world.parameters)["followers"] == []
        sim.advance(500)
        ways.append(sim.data.qpos.copy())
    assert same_bits(*ways)


LIT = {
    "physics": {"profile": "vrx"},
    "sea": CALM,
    "objects": [
        {"name": "buoy", "model": "robotx_light_buoy", "pose": [6.5, -7, 0.37, 0, 0, 0]},
        {"name": "dock", "model": "dock_2022", "pose": [4, -15, 0, 0, 0, 0]},
    ],
}
BOARD = "dock/dock_2022_placard2"


@pytest.fixture(scope="module")
def lit():
    fleet = {"boats": [{"name": "a", "pose": [0, -6, AFLOAT, 0, 0, 0]}], "sensors": "vrx"}
    return vrx_mj.Simulation(vrx_mj.compile_world(LIT, fleet=fleet))


@pytest.fixture
def _afresh(lit):
    lit.reset()


@pytest.mark.usefixtures("_afresh")
def test_a_light_and_a_placard_are_part_of_the_state(lit):
    assert (lit.lights, lit.placards) == (("buoy",), tuple(f"dock/dock_2022_placard{i}" for i in (1, 2, 3)))
    assert [lit.showing(name) for name in (*lit.lights, *lit.placards)] == ["off", *["blue_circle"] * 3]
    lit.set_light("buoy", ["red", "green", "yellow"])
    lit.set_placard(BOARD, "green_cross")
    lit.shuffle(BOARD)
    lit.advance(250)
    state = lit.get_state()
    assert [lit.showing("buoy"), lit.showing(BOARD)] == ["green", "green_triangle"]
    lit.reset()
    assert [lit.showing("buoy"), lit.showing(BOARD)] == ["off", "blue_circle"]
    lit.set_state(state)
    lit.advance(100)
    assert [lit.showing("buoy"), lit.showing(BOARD)] == ["yellow", "green_triangle"]


@pytest.mark.usefixtures("_afresh")
def test_what_cannot_be_shown_is_refused(lit):
    with pytest.raises(UnknownNameError, match=r"^no light named 'boy'; did you mean 'buoy'\?$"):
        lit.set_light("boy", ["red", "red", "red"])
    with pytest.raises(CommandError) as caught:
        lit.set_light("buoy", ["red", "pink", "red"])
    known = "three of red, green, blue, yellow, off are needed"
    assert str(caught.value) == f"invalid colours ['red', 'pink', 'red'] of buoy: {known}"
    with pytest.raises(CommandError):
        lit.set_light("buoy", "red")
    with pytest.raises(UnknownNameError, match=r"^no symbol named 'red_cicle'; did you mean 'red_circle'\?$"):
        lit.set_placard(BOARD, "red_cicle")
    with pytest.raises(UnknownNameError, match=r"^no placard named 'buoy'"):
        lit.set_placard("buoy", "red_circle")
    with pytest.raises(UnknownNameError, match=r"^no light or placard named 'moon'"):
        lit.shuffle("moon")


def looks(picture, color):
    """Number of pixels in which red, green and blue are as bright or as dark as in a pure colour."""
    rgb = picture.astype(np.int64)
    bright, dark = rgb[..., np.array(color) > 0], rgb[..., np.array(color) == 0]
    return int(np.count_nonzero((bright.min(axis=-1) > 60) & (dark.max(axis=-1) < 30)))


@pytest.mark.render
@pytest.mark.usefixtures("_afresh")
def test_cameras_see_lights_and_symbols_in_the_colours_of_the_moment(lit):
    pure = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "yellow": (1, 1, 0)}

    def seen():
        picture = lit.sense("a")["front_left_camera"].data.rgb
        return {name: looks(picture, color) for name, color in pure.items()}

    lit.set_light("buoy", ["red", "green", "yellow"])
    for board in lit.placards:
        lit.set_placard(board, "blue_circle")
    lit.advance(50)
    dark = seen()
    assert dark["blue"] > 200
    for name in ("red", "green", "yellow"):
        lit.advance(100)
        more = {other: count - dark[other] for other, count in seen().items()}
        assert more[name] > 60, name
        assert all(more[other] < 20 for other in {"red", "green", "yellow"} - {name})
    lit.set_placard(BOARD, "green_rectangle")
    lit.advance(200)
    assert lit.showing("buoy") == "off"
    assert seen()["green"] > dark["green"] + 60
    assert seen()["blue"] < dark["blue"]


@pytest.mark.usefixtures("_afresh")
def test_a_recording_tells_what_was_shown_and_holds_changes_alone(lit, tmp_path):
    live = []
    with vrx_mj.record(lit, tmp_path / "run.rrd", sea=False):
        lit.set_light("buoy", ["red", "green", "yellow"])
        for step in range(60):
            if step == 25:
                lit.shuffle("buoy")
                lit.set_placard(BOARD, "red_cross")
            live.append((lit.showing("buoy"), lit.showing(BOARD)))
            lit.advance(20)
    recorded = read_record(tmp_path / "run.rrd")
    rows = recorded.rows[:-1:4]
    displays = {display.name: display for display in displays_of(lit.world.parameters)}
    marks = rows[:, recorded.layout.marks]
    again = [
        tuple(displays[name].shows(mark, time) for name in ("buoy", BOARD))
        for mark, time in zip(marks, rows[:, 0], strict=True)
    ]
    lights = [pair[0] for pair in live] + [lit.showing("buoy")]
    changes = sum(one != other for one, other in pairwise(lights))
    assert [pair for i, pair in enumerate(again) if i != 25] == [pair for i, pair in enumerate(live) if i != 25]
    chunks = [chunk for chunk in MovingChunks(scene_of(lit))(recorded.rows) if chunk.entity_path.endswith("/panels")]
    assert [chunk.num_rows for chunk in chunks] == [changes + 1]


def test_a_world_without_displays_has_rows_as_ever():
    sim = simulation(ALONE, sea=CALM, wind=None)
    assert len(sim.row()) == 2 + 2 * len(sim._live.arrays.thrusters) + sim.model.nq + sim.model.nv
    assert (sim.lights, sim.placards) == ((), ())


HOLE = (5.95, 3.6, 2.83)
"""Middle of the large hole of the first bay of the dock of 2022 [m, dock frame]; it is 0.5 m wide, high and deep."""
SPEED, PITCH = 7.5, 1.04
"""Of a ball at the muzzle [m/s], and how far the launcher looks up [rad]."""


def ballistic(height):
    """Horizontal way [m] of a falling ball when it is `height` [m] over the muzzle."""
    up = SPEED * math.sin(PITCH)
    return SPEED * math.cos(PITCH) * (up + math.sqrt(up * up - 2 * G * height)) / G


@pytest.mark.parametrize(("aside", "through"), [(0.0, True), (-0.5, False)])
def test_a_shot_from_the_bay_flies_a_parabola_into_the_hole_or_hits_the_board(lit, aside, through):
    """A boat in the bay looks at the placard: the ball comes down through the front, 0.17 m over the middle."""
    lit.reset()
    lit.set_boat("a", pose=(0, -6, AFLOAT, 0, 0, 0))
    lit.fire("a")
    ball = "a/ball_shooter"
    muzzle = lit.observe_object(ball).position - (0, -6, AFLOAT)
    front, middle = 4.0 + HOLE[0] - 0.25, -15.0 + HOLE[1] + aside
    drop = HOLE[2] + 0.17 - (muzzle[2] + AFLOAT)
    lit.reset()
    lit.set_boat("a", pose=(front - ballistic(drop) - muzzle[0], middle - muzzle[1], AFLOAT, 0, 0, 0))
    lit.fire("a")
    start, speed = lit.observe_object(ball).position, lit.data.qvel[lit.model.nv - 6 :].copy()
    inside, farthest, step = False, 0.0, 0.01
    for n in range(1, 131):
        lit.advance(1)
        place, time = lit.observe_object(ball).position, n * step
        if place[0] < front - 0.1:
            flown = start + speed[:3] * time - (0.0, 0.0, G / 2 * time * (time + step))  # explicit steps
            assert place == pytest.approx(flown, abs=1e-5)
        centre = np.array((4.0 + HOLE[0], -15.0 + HOLE[1], HOLE[2]))
        inside |= bool(np.all(np.abs(place - centre) < 0.25))
        farthest = max(farthest, place[0])
    assert inside == through
    assert (farthest > front) == through
