"""Objects and docks that are spawned, moved and removed while a simulation runs: all else goes on to the last bit."""

import gc
import resource

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vrx_mj
from integration.sailing import AFLOAT, AHEAD, CALM, same_bits, simulation
from vrx_mj.errors import CommandError, ConfigError, StateError, UnknownNameError

HERE = {"name": "here", "pose": [0, 0, AFLOAT, 0, 0, 0.3], "sensors": ["gps_wamv", "imu_wamv", "pinger"]}
FLEET = {"boats": [HERE, {"name": "there", "pose": [0, 40, AFLOAT, 0, 0, 1.0]}], "thrusters": "T", "sensors": "none"}
EARTH = {"georeference": {"latitude": -33.72, "longitude": 150.67}}
OBJECTS = [
    {"name": "lamp", "model": "robotx_light_buoy", "pose": [30, 20, 0.5, 0, 0, 0]},
    {"name": "swimmer", "model": "crocodile_buoy", "pose": [-30, 20, 0, 0, 0, 0], "path": {"circle": {"radius": 5}}},
    {"name": "course", "model": "short_navigation_course0", "pose": [-80, -80, 0, 0, 0, 0]},
    {"name": "wharf", "model": "dock_2022", "pose": [60, 60, 0, 0, 0, 0]},
]
DOCKS = [
    {"name": "raft", "layout": "X X\nXXX", "dynamic": True, "mooring": {}, "bays": [{}], "pose": [-60, 60, 0, 0, 0, 0]}
]
STAYING = ("lamp", "swimmer", "raft")
PIER = {"layout": "XX", "pose": [90, -90, 0, 0, 0, 0]}
FLOATING = {**PIER, "dynamic": True, "mooring": {}, "bays": [{}], "layout": "X X\nXXX"}
CHANGES = {
    "a buoy": lambda sim, name: sim.spawn_object(name, model="mb_marker_buoy_red", pose=PIER["pose"]),
    "a light": lambda sim, name: sim.spawn_object(name, model="robotx_light_buoy", pose=PIER["pose"]),
    "a swimmer": lambda sim, name: sim.spawn_object(name, model="turtle_buoy", pose=PIER["pose"]),
    "a course": lambda sim, name: sim.spawn_object(name, model="short_navigation_course1", pose=PIER["pose"]),
    "a post": lambda sim, name: sim.spawn_object(name, model="post", pose=PIER["pose"]),
    "a dock of the catalogue": lambda sim, name: sim.spawn_object(name, model="dock_2018", pose=PIER["pose"]),
    "a fixed dock": lambda sim, name: sim.spawn_dock(name, **PIER),
    "a floating dock": lambda sim, name: sim.spawn_dock(name, **FLOATING),
    "a boat": lambda sim, name: sim.spawn(name, pose=[90, -90, AFLOAT, 0, 0, 0], sensors="vrx"),
}


def made(**more):
    return simulation(FLEET, objects=OBJECTS, docks=DOCKS, seed=5, **EARTH, **more)


def moving(sim):
    """All that is seen of what stays: boats, objects and the wind, as one row."""
    boats = sim.observe()
    seen = [boats["here"], boats["there"], *(sim.observe_object(name) for name in STAYING)]
    rows = [np.concatenate((one.position, one.quaternion, one.velocity, one.angular_velocity)) for one in seen]
    return np.concatenate((*rows, [sim.row()[1], sim.time]))


def sailed(changes, steps=400):
    """The motion of a run in which changes happen at some steps, and the readings of a boat."""
    sim, rows, heard = made(), [], []
    for sensor in HERE["sensors"]:
        sim.subscribe("here", sensor, heard.append)
    sim.set_light("lamp", ("red", "green", "blue"))
    for step in range(0, steps, 10):
        for change in changes.get(step, ()):
            change(sim)
        sim.step({"here": AHEAD}, duration=0.1)
        rows.append(moving(sim))
    return np.array(rows), [(one.time, one.name, repr(one.data)) for one in heard], sim


@pytest.fixture(scope="module")
def undisturbed():
    return sailed({})


@pytest.mark.parametrize("kind", CHANGES)
def test_what_stays_moves_measures_and_shows_the_same(undisturbed, kind):
    changes = {
        50: [lambda sim: CHANGES[kind](sim, "guest")],
        100: [lambda sim: sim.remove("course")],
        150: [lambda sim: sim.remove("guest")],
        200: [lambda sim: CHANGES[kind](sim, "guest"), lambda sim: sim.remove("wharf")],
    }
    rows, heard, sim = sailed(changes)
    assert same_bits(rows, undisturbed[0])
    assert heard == undisturbed[1]
    assert len(heard) > 100
    assert sim.showing("lamp") == undisturbed[2].showing("lamp")
    assert "guest" in {item.partition("/")[0] for item in (*sim.boats, *names_of(sim))}


def names_of(sim):
    there = sim.world.parameters
    return [*(item.name for item in there.objects), *(dock.name for dock in there.docks)]


@settings(max_examples=5)
@given(plan=st.lists(st.sampled_from([*CHANGES, "remove"]), min_size=3, max_size=6))
@pytest.mark.slow
def test_any_sequence_leaves_the_others_bit_equal(undisturbed, plan):
    def changed(kind, number):
        def change(sim):
            if kind == "remove":
                guests = [name for name in (*names_of(sim), *sim.boats) if name.startswith("guest")]
                if guests:
                    sim.remove(guests[0].partition("/")[0])
            else:
                sim.spawn_object(f"mark{number}", model="mb_round_buoy_orange", pose=[200 + 9 * number, 0, 0, 0, 0, 0])
                if not any(name.startswith("guest") for name in (*names_of(sim), *sim.boats)):
                    CHANGES[kind](sim, f"guest{number}")

        return change

    rows, heard, _ = sailed({40 * (number + 1): [changed(kind, number)] for number, kind in enumerate(plan)})
    assert same_bits(rows, undisturbed[0])
    assert heard == undisturbed[1]


def test_an_object_that_joins_at_the_start_is_as_one_of_the_file():
    late = {"model": "robotx_light_buoy", "pose": [90, -90, 0.3, 0.1, 0, 1.0]}
    there = simulation(FLEET, objects=[{"name": "more", **late}], seed=5)
    joined = simulation(FLEET, seed=5)
    joined.spawn_object("more", **late)
    for sim in (there, joined):
        sim.step({"here": AHEAD}, duration=3.0)
    for field in ("position", "quaternion", "velocity", "angular_velocity"):
        assert same_bits(*(getattr(sim.observe_object("more"), field) for sim in (there, joined)))


@pytest.mark.parametrize("dynamic", [False, True])
def test_what_joins_later_is_where_it_was_put_and_floats_there(dynamic):
    sim = made()
    sim.step(duration=5.0)
    sim.spawn_object("buoy", model="mb_marker_buoy_red", pose=[90, -90, 0.3, 0, 0, 1.0])
    assert sim.observe_object("buoy").position == pytest.approx([90, -90, 0.3])
    assert sim.observe_object("buoy").heading == pytest.approx(1.0)
    sim.spawn_dock("pier", layout="XX", pose=[120, -90, 0, 0, 0, 0], dynamic=dynamic)
    sim.step(duration=10.0)
    assert abs(sim.observe_object("buoy").position[2] - sim.sea.height(90, -90, sim.time)) < 1.0
    if dynamic:
        assert abs(sim.observe_object("pier").position[2]) < 1.5


def test_what_was_spawned_is_moved_as_what_was_there():
    sim = made(sea=CALM, wind=None)
    sim.spawn_object("buoy", model="mb_marker_buoy_red", pose=[90, -90, 0.3, 0, 0, 0])
    sim.set_object("buoy", pose=(95, -95, 0.3, 0, 0, 0.5), velocity=(1, 0, 0, 0, 0, 0))
    assert sim.observe_object("buoy").position == pytest.approx([95, -95, 0.3])
    sim.step(duration=0.1)
    assert sim.observe_object("buoy").position[0] > 95.0
    sim.spawn_object("post", model="post", pose=[100, -90, 0, 0, 0, 0])
    with pytest.raises(CommandError) as raised:
        sim.set_object("post", pose=(95, -90, 0, 0, 0, 0))
    assert str(raised.value) == "post cannot be moved: it is fixed; remove it, and spawn it elsewhere"


def test_a_boat_runs_into_what_was_spawned():
    sim = made(sea=CALM, wind=None)
    sim.spawn_object("post", model="post", pose=[12, 3.7, 0, 0, 0, 0])
    touched = []
    sim.watch_contacts(lambda touch: touched.append(str(touch)))
    for _ in range(100):
        sim.step({"here": AHEAD}, duration=0.1)
    sim.spawn_object("wall", model="ground_station", pose=[300, 300, 0, 0, 0, 0])
    assert sim.observe()["here"].position[0] < 12.5 or touched


def test_the_last_object_leaves_and_another_comes():
    sim = simulation(FLEET, objects=OBJECTS[:1], seed=5)
    sim.step(duration=0.1)
    sim.remove("lamp")
    assert names_of(sim) == []
    assert sim.lights == ()
    sim.step(duration=0.1)
    sim.spawn_object("lamp", model="robotx_light_buoy", pose=[30, 20, 0.5, 0, 0, 0])
    assert sim.lights == ("lamp",)
    sim.set_light("lamp", ("red", "off", "blue"))
    sim.step(duration=1.0)
    assert sim.showing("lamp") == "red"


def test_reset_brings_back_what_the_run_began_with():
    sim = made()
    sim.step(duration=1.0)
    expected, before = sim.get_state().sha256, names_of(sim)
    sim.spawn_dock("pier", **PIER)
    sim.remove("lamp")
    sim.reset(5)
    assert names_of(sim) == before
    sim.step(duration=1.0)
    assert sim.get_state().sha256 == expected


def test_a_state_belongs_to_the_objects_that_were_there(tmp_path):
    sim = made()
    before = sim.get_state()
    sim.spawn_object("more", model="robotx_light_buoy", pose=PIER["pose"])
    sim.spawn_dock("pier", **{**FLOATING, "pose": [120, -120, 0, 0, 0, 0]})
    sim.step(duration=0.5)
    after = sim.get_state()
    with pytest.raises(StateError) as raised:
        sim.set_state(before)
    assert str(raised.value) == (
        "the state at t = 0 s has other objects or docks than the simulation: call reset(), which restores those of "
        "the world, then set_state"
    )
    sim.world.save(tmp_path)
    loaded = vrx_mj.Simulation.load(tmp_path)
    loaded.set_state(after)
    for one in (sim, loaded):
        one.step({"here": AHEAD}, duration=1.0)
    assert loaded.get_state().sha256 == sim.get_state().sha256
    assert vrx_mj.Batch(sim.world, 2).boats == sim.boats


def test_copies_go_on_alike():
    import copy

    sim = made()
    sim.spawn_object("more", model="short_navigation_course1", pose=PIER["pose"])
    other = copy.deepcopy(sim)
    for one in (sim, other):
        one.step({"here": AHEAD}, duration=0.5)
    assert sim.get_state().sha256 == other.get_state().sha256


@pytest.fixture(scope="module")
def course():
    return vrx_mj.Simulation(vrx_mj.compile_world("example_course", fleet="trio"))


PLACE = [-500, 200, 0.1, 0, 0, 0]


@pytest.mark.parametrize(
    ("call", "given", "kind", "text"),
    [
        ("spawn_object", {"name": "x", "model": "mb_marker_buoy_red", "pose": [-524, 210, 0.1, 0, 0, 0]}, CommandError,
         "no place for x at (-524, 210): it would be"),
        ("spawn_object", {"name": "x", "model": "mb_marker_buoy_red", "pose": [-554, 233, 0.1, 0, 0, 0]}, CommandError,
         "no place for x at (-554, 233): it would be"),
        ("spawn_object", {"name": "wamv1", "model": "post", "pose": PLACE}, CommandError,
         "invalid object name 'wamv1': a boat of world example_course has this name"),
        ("spawn_object", {"name": "buoys", "model": "post", "pose": PLACE}, CommandError,
         "invalid object name 'buoys': an object of world example_course has this name"),
        ("spawn_dock", {"name": "robotx_dock_2022", "layout": "X", "pose": PLACE}, CommandError,
         "invalid dock name 'robotx_dock_2022': a dock of world example_course has this name"),
        ("spawn_object", {"name": "world", "model": "post", "pose": PLACE}, CommandError,
         "invalid object name 'world': a part of world example_course has this name"),
        ("spawn_object", {"name": "x", "model": "nope_at_all", "pose": PLACE}, ConfigError,
         "<object>: model: no object model named 'nope_at_all'"),
        ("spawn_object", {"name": "x", "model": "model://nope_at_all", "pose": PLACE}, ConfigError,
         "<object>: model: no model 'nope_at_all' beside the file, nor on GAZEBO_MODEL_PATH or GZ_SIM_RESOURCE_PATH"),
        ("spawn_object", {"name": "x", "model": "post", "pose": [1, 2]}, ConfigError,
         "<object>: pose: expected 6 numbers [x, y, z, roll, pitch, yaw], got [1, 2]"),
        ("spawn_object", {"name": "x", "model": "post", "pose": PLACE, "path": {"circle": {"radius": 5}}}, ConfigError,
         "<object>: path: 'post' does not float, so it cannot follow a path"),
        ("spawn_dock", {"name": "x", "layout": "X X", "pose": PLACE, "dynamic": True}, ConfigError,
         "<dock>: dynamic: the block in row 1, column 3 is not connected to the first one; the blocks of a floating"),
        ("spawn_dock", {"name": "x", "layout": "XX", "pose": [-554, 233, 0, 0, 0, 0]}, CommandError,
         "no place for x: it would be on the dock 'robotx_dock_2022/base'"),
        ("spawn_dock", {"name": "x", "layout": "XX", "pose": [-524, 210, 0.1, 0, 0, 0]}, CommandError,
         "no place for x at (-524, 210): it would be"),
        ("remove", {"name": "nobody"}, UnknownNameError,
         "no boat, object or dock named 'nobody'; known: wamv1, wamv2, wamv3"),
        ("remove", {"name": "buoys/mb_round_buoy_black_0"}, CommandError,
         "buoys/mb_round_buoy_black_0 cannot be removed: it is a part of buoys, which can only be removed as a whole"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_refused_in_words_and_changes_nothing(course, call, given, kind, text):
    before, model = course.get_state().sha256, course.model
    with pytest.raises(kind) as raised:
        getattr(course, call)(**given)
    assert str(raised.value).startswith(text)
    assert course.model is model
    assert course.get_state().sha256 == before


@pytest.mark.parametrize(
    ("world", "name", "task"),
    [
        ("gymkhana", "short_navigation_course_0", "gymkhana"),
        ("scan_dock_deliver", "robotx_dock_2022", "scan_dock_deliver"),
        ("scan_dock_deliver", "robotx_light_buoy", "scan_dock_deliver"),
        ("wildlife_task", "crocodile_buoy", "wildlife"),
    ],
)
def test_what_a_task_needs_cannot_be_removed(world, name, task):
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world))
    name = next((item for item in names_of(sim) if item.partition("/")[0].startswith(name[:9])), name).partition("/")[0]
    with pytest.raises(CommandError) as raised:
        sim.remove(name)
    assert str(raised.value) == f"{name} cannot be removed: the task '{sim.world.parameters.task.name}' needs it"


@pytest.mark.slow
def test_a_task_goes_on_while_objects_come_and_go():
    def scored(join):
        sim = vrx_mj.Simulation(vrx_mj.compile_world("gymkhana"), seed=2)
        for second in range(12):
            if join and second == 3:
                sim.spawn_object("extra", model="mb_round_buoy_orange", pose=[-500, 230, 0.3, 0, 0, 0])
            if join and second == 8:
                sim.remove("buoys")
            sim.step({"wamv": AHEAD}, duration=1.0)
        return sim.task, sim.task_events, sim.observe()["wamv"].position.tolist()

    assert scored(join=True) == scored(join=False)


@pytest.mark.slow
def test_the_scored_boat_can_touch_a_spawned_object():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("stationkeeping_task"), seed=2)
    sim.step(duration=11.0)
    x, y, _ = sim.observe()["wamv"].position
    sim.spawn_object("buoy", model="mb_round_buoy_black", pose=[x + 8.0, y, 0.1, 0, 0, 0])
    sim.set_object("buoy", velocity=(-6.0, 0, 0, 0, 0, 0))
    sim.set_boat("wamv", pose=(x, y, AFLOAT, 0, 0, 0), velocity=(4.0, 0, 0, 0, 0, 0))
    sim.step(duration=5.0)
    assert sim.task["num_collisions"] > 0


@pytest.mark.slow
@pytest.mark.nightly
def test_hundreds_of_objects_come_and_go_without_growth():
    sim = simulation(FLEET, objects=OBJECTS[:1], seed=5)

    def cycle(count):
        for number in range(count):
            sim.spawn_object(f"guest{number % 7}", model="mb_marker_buoy_red", pose=PIER["pose"])
            sim.remove(f"guest{number % 7}")
        gc.collect()
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    before = cycle(60)
    after = cycle(150)
    assert after < before + 3_600, f"{after - before} KiB more"
    assert names_of(sim) == ["lamp"]
