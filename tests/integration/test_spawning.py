"""Boats that join and leave while a simulation runs: all others go on to the last bit."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from integration.sailing import AFLOAT, AHEAD, same_bits, simulation, water
from vrx_mj.config.search import catalogue
from vrx_mj.errors import CommandError, ConfigError, StateError, UnknownNameError

HERE = {"name": "here", "pose": [0, 0, AFLOAT, 0, 0, 0.3], "sensors": ["gps_wamv", "imu_wamv", "pinger"]}
FIRST = {"name": "first", "pose": [-200, 50, AFLOAT, 0, 0, 1.0]}
COLLIDING = [
    {"name": "ram", "pose": [40, 0, AFLOAT, 0, 0, 0.0]},
    {"name": "rammed", "pose": [46, 0.9, AFLOAT, 0, 0, 3.14]},
]
FLEET = {"boats": [FIRST, HERE, *COLLIDING], "thrusters": "T", "sensors": "none"}
EARTH = {"georeference": {"latitude": -33.72, "longitude": 150.67}}
BUOY = {"name": "buoy", "model": "robotx_light_buoy", "pose": [30, 20, 0.5, 0, 0, 0]}
LATE = [100.0, -60.0, AFLOAT, 0.0, 0.0, 0.5]
STAYING = ("here", "ram", "rammed")


def motion(sim, names=STAYING):
    """Poses and velocities of boats, and the wind."""
    seen = sim.observe()
    parts = [
        [*boat.position, *boat.quaternion, *boat.velocity, *boat.angular_velocity] for boat in map(seen.get, names)
    ]
    return np.array([*np.ravel(parts), sim.row()[1]])


def sailed(changes, *, engines):
    """What those who stay do and measure in a run of 1000 steps, in which changes happen at some of them."""
    sim = simulation({**FLEET, "engines": engines}, objects=[BUOY], seed=5, **EARTH)
    heard, rows = [], []
    for sensor in ("gps_wamv", "imu_wamv", "pinger"):  # the pinger has noise
        sim.subscribe("here", sensor, heard.append)
    for step in range(1000):
        changes.get(step, lambda sim: None)(sim)
        if step % 50 == 0:
            for boat in STAYING:
                sim.command(boat, **AHEAD)
        sim.advance(1)
        rows.append([*motion(sim), *sim.observe_object("buoy").position])
    numbers = [[reading.time, *np.concatenate([np.ravel(part) for part in numbers_of(reading)])] for reading in heard]
    return np.array(rows), numbers, sim


def numbers_of(reading):
    return [part for part in vars(reading.data).values() if not isinstance(part, str)]


@pytest.fixture(scope="module")
def undisturbed():
    return {engines: sailed({}, engines=engines)[:2] for engines in ("fixed", "hinged")}


JOINING_BOATS = {
    "alike": {},
    "with all sensors and engines on hinges": {"sensors": "vrx", "engines": "hinged"},
    "of another kind": {"robot": "skiff"},
}


@pytest.mark.parametrize(
    ("engines", "joining_boat"),
    [
        pytest.param("fixed", "with all sensors and engines on hinges", marks=pytest.mark.slow),
        ("hinged", "alike"),
        ("hinged", "of another kind"),
    ],
)
def test_another_boat_joins_and_leaves(undisturbed, engines, joining_boat):
    rows, readings, sim = sailed(
        {
            200: lambda sim: sim.spawn("late", pose=LATE, **({"sensors": "none"} | JOINING_BOATS[joining_boat])),
            450: lambda sim: sim.remove("first"),
            700: lambda sim: sim.remove("late"),
            800: lambda sim: sim.spawn("late", pose=LATE, sensors="none"),
        },
        engines=engines,
    )
    assert sim.boats == ("here", "ram", "rammed", "late")
    assert sim.time == pytest.approx(10.0)
    assert same_bits(rows, undisturbed[engines][0])
    assert readings == undisturbed[engines][1]
    assert len(readings) > 150


def test_the_ram_did_meet_the_rammed_one(undisturbed):
    """So the test above is also of boats in contact."""
    rows = undisturbed["hinged"][0]
    assert np.abs(np.diff(rows[:, 2 * 13 + 7 : 2 * 13 + 10], axis=0)).max() > 0.01


def test_a_newcomer_moves_as_a_boat_that_was_there_from_the_start():
    there = simulation({"boats": [{**HERE, "sensors": []}, {"name": "late", "pose": LATE}], "sensors": "none"})
    joined = simulation({"boats": [{**HERE, "sensors": []}], "sensors": "none"})
    joined.spawn("late", pose=LATE, sensors="none")
    for sim in (there, joined):
        sim.step({"late": AHEAD}, duration=3.0)
    assert same_bits(motion(there, ("here", "late")), motion(joined, ("here", "late")))
    assert joined.forces("late").keys() == there.forces("late").keys()


def test_commands_and_shots_of_others_stay():
    sims = [simulation({"boats": [{**HERE, "sensors": "vrx"}], "sensors": "none"}) for _ in range(2)]
    for sim in sims:
        sim.command("here", **AHEAD)
        assert sim.fire("here")
        sim.advance(20)
    sims[1].spawn("late", pose=LATE, sensors="vrx")
    assert sims[1].fire("late")
    for sim in sims:
        sim.advance(50)
    shots = [sim.observe_object("here/ball_shooter").position for sim in sims]
    assert same_bits(*shots)
    assert shots[0][2] > -50.0
    assert same_bits(*(motion(sim, ("here",)) for sim in sims))


def test_a_name_begins_a_new_life_with_its_own_noise():
    def heard(spawns):
        sim = simulation({"boats": [FIRST], "sensors": "none"}, seed=1)
        sim.advance(100)
        for number in range(spawns):
            if number:
                sim.remove("late")
            sim.spawn("late", pose=LATE, sensors=["pinger"])
        return sim.sense("late")["pinger"].data.range

    assert heard(2) == heard(2)
    assert len({heard(1), heard(2), heard(3)}) == 3


def test_a_task_goes_on():
    def stationkeeping(join):
        sim = vrx_mj.Simulation(vrx_mj.compile_world("stationkeeping_task"), seed=2)
        x, y, *_ = sim.observe()["wamv"].position
        for second in range(25):
            if join and second == 12:
                sim.spawn("late", pose=[x + 30, y, AFLOAT, 0, 0, 0], sensors="none")
            if join and second == 20:
                sim.remove("late")
            sim.step({"wamv": AHEAD}, duration=1.0)
        return sim.task, sim.task_events, motion(sim, ("wamv",))

    (told, events, moved), (same, others, again) = stationkeeping(join=False), stationkeeping(join=True)
    assert told == same
    assert told["score"] > 0.0
    assert events == others
    assert same_bits(moved, again)


def test_the_scored_boat_can_touch_a_newcomer():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("stationkeeping_task"), seed=2)
    sim.step(duration=11.0)
    x, y, _ = sim.observe()["wamv"].position
    sim.spawn("late", pose=[x + 7.0, y, AFLOAT, 0, 0, math.pi], sensors="none")
    sim.set_boat("late", velocity=(4.0, 0, 0, 0, 0, 0))
    sim.step(duration=4.0)
    assert sim.task["num_collisions"] > 0


def test_reset_brings_back_the_boats_that_the_run_began_with():
    sim = simulation({"boats": [FIRST, HERE], "sensors": "none"}, seed=4)
    sim.step({"first": AHEAD}, duration=1.0)
    expected = sim.get_state().sha256
    sim.remove("first")
    sim.spawn("first", pose=LATE, robot="skiff")
    sim.reset(4)
    assert sim.boats == ("first", "here")
    sim.step({"first": AHEAD}, duration=1.0)
    assert sim.get_state().sha256 == expected


def test_a_state_belongs_to_the_boats_that_were_there():
    sim = simulation({"boats": [FIRST], "sensors": "none"})
    sim.advance(10)
    before = sim.get_state()
    sim.spawn("late", pose=LATE)
    sim.advance(10)
    after = sim.get_state()
    sim.step({"late": AHEAD}, duration=1.0)
    end = sim.get_state().sha256
    sim.set_state(after)
    sim.step({"late": AHEAD}, duration=1.0)
    assert sim.get_state().sha256 == end
    with pytest.raises(StateError) as raised:
        sim.set_state(before)
    assert str(raised.value) == (
        "the state at t = 0.1 s has other boats than the simulation: call reset(), which restores first, then set_state"
    )
    assert sim.get_state().sha256 == end
    sim.reset()
    sim.set_state(before)
    with pytest.raises(StateError) as raised:
        sim.set_state(after)
    belongs = f"the state belongs to the world {after.world[:12]}, not to this one, {sim.world.sha256[:12]}, and has "
    assert str(raised.value).startswith(belongs)


def test_the_world_with_a_newcomer_can_be_saved(tmp_path):
    sim = simulation({"boats": [FIRST, HERE], "sensors": "none"})
    sim.spawn("late", pose=LATE, sensors="vrx")
    sim.remove("first")
    sim.advance(10)
    state = sim.get_state()
    sim.world.save(tmp_path)
    loaded = vrx_mj.Simulation.load(tmp_path)
    assert loaded.boats == ("here", "late")
    loaded.set_state(state)
    for one in (sim, loaded):
        one.step({"late": AHEAD}, duration=1.0)
    assert loaded.get_state().sha256 == sim.get_state().sha256


@pytest.fixture(scope="module")
def course():
    return vrx_mj.Simulation(vrx_mj.compile_world("example_course", fleet="trio"))


PLACE = [-500, 200, 0.1, 0, 0, 0]
DOCKED = "no place for x at (-554, 233): it would be 0.54 m inside robotx_dock_2022/base, whose origin is 0.00 m away"


@pytest.mark.parametrize(
    ("name", "said", "kind", "text"),
    [
        ("x", {"pose": [-524, 210, 0.1, 0, 0, 0]}, CommandError,
         "no place for x at (-524, 210): it would be 0.40 m inside wamv1, whose origin is 0.85 m away"),
        ("x", {"pose": [-554, 233, 0.1, 0, 0, 0]}, CommandError,
         DOCKED),
        ("x", {"pose": [-533, 142, 0.1, 0, 0, 0]}, CommandError,
         "no place for x at (-533, 142): it would be on land, 15.53 m inside the shore of sydney_regatta"),
        ("wamv1", {"pose": PLACE}, CommandError,
         "invalid boat name 'wamv1': a boat of world example_course has this name"),
        ("post_0", {"pose": PLACE}, CommandError,
         "invalid boat name 'post_0': an object of world example_course has this name"),
        ("terrain", {"pose": PLACE}, CommandError,
         "invalid boat name 'terrain': a part of world example_course has this name"),
        ("x", {"pose": PLACE, "robot": "nope"}, ConfigError,
         f"<boat>: robot: {UnknownNameError('robot', 'nope', sorted(catalogue('robots')))}"),
        ("x", {"pose": [1, 2, 3]}, ConfigError,
         "<boat>: pose: expected 6 numbers [x, y, z, roll, pitch, yaw], got [1, 2, 3]"),
        ("a b", {"pose": PLACE}, ConfigError,
         "<boat>: name: expected a name of up to 64 letters A-Z, digits, '_', '-' or '.', got 'a b'"),
        ("x", {"pose": PLACE, "engines": "loose"}, ConfigError,
         "<boat>: engines: expected fixed or hinged, got 'loose'"),
    ],
)  # fmt: skip
def test_what_cannot_be_spawned_is_told_and_changes_nothing(course, name, said, kind, text):
    before, model = course.get_state(), course.model
    with pytest.raises(kind) as raised:
        course.spawn(name, **said)
    assert str(raised.value) == text
    assert course.model is model
    assert course.get_state() is not before
    assert course.get_state().sha256 == before.sha256


def test_who_cannot_be_removed_is_told(course):
    with pytest.raises(UnknownNameError) as raised:
        course.remove("nobody")
    assert str(raised.value) == (
        "no boat, object or dock named 'nobody'; known: wamv1, wamv2, wamv3, post_0, post_1, post_2, antenna, "
        "ground_station_0, ground_station_1, ground_station_2, blue_projectile, robotx_light_buoy and 6 more"
    )
    scored = vrx_mj.Simulation(vrx_mj.compile_world("stationkeeping_task"))
    with pytest.raises(CommandError) as raised:
        scored.remove("wamv")
    assert str(raised.value) == "wamv cannot be removed: it is the boat that the task 'station_keeping' scores"
    assert scored.boats == ("wamv",)


def test_the_last_boat_may_leave_and_another_come():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean", fleet={"usv_count": 2, "layout": "line", "sensors": "vrx"}))
    sim.advance(5)
    for boat in ("wamv1", "wamv2"):
        sim.remove(boat)
        sim.advance(5)
    assert sim.boats == ()
    sim.spawn("late", pose=(0, 0, 0.1, 0, 0, 0))
    sim.advance(5)
    assert sim.boats == ("late",)
    assert sim.time == pytest.approx(0.2)


def test_nobody_joins_from_within_a_step():
    sim = simulation({"boats": [HERE], "sensors": "none"}, **EARTH)
    told = []

    def join(_):
        with pytest.raises(CommandError) as raised:
            sim.spawn("late", pose=LATE)
        told.append(str(raised.value))

    class Recorder:
        rows = state = event = frame = lambda self, *_: join(None) if sim.time > 0.05 else None

    sim.subscribe("here", "imu_wamv", join)
    sim.attach(Recorder(), rate=10.0)
    sim.advance(100)
    assert set(told) == {
        "spawn cannot be called from the callback of a subscription: call it afterwards",
        "spawn cannot be called while the run advances, as from a recorder: call it afterwards",
    }
    assert sim.boats == ("here",)


def test_subscriptions_to_a_boat_end_with_it():
    sim = simulation({"boats": [FIRST, HERE], "sensors": "none"}, **EARTH)
    heard = []
    sim.subscribe("here", "imu_wamv", heard.append)
    sim.step(duration=0.5)
    sim.remove("here")
    count = len(heard)
    sim.step(duration=0.5)
    assert len(heard) == count > 0
    with pytest.raises(UnknownNameError):
        sim.sense("here")


def test_what_a_user_holds_goes_on():
    sim = simulation({"boats": [FIRST], "sensors": "none"})
    sea, wind = sim.sea, sim.wind
    sim.model.opt.gravity[2] = -9.0
    sim.advance(10)
    expected = sea.height(3.0, 4.0, 7.0), wind.velocity(0.05).tolist()
    sim.spawn("late", pose=LATE)
    assert (sea.height(3.0, 4.0, 7.0), wind.velocity(0.05).tolist()) == expected
    assert sim.model.opt.gravity[2] == -9.0
    assert sim.sea is sea


def test_a_boat_joins_a_loaded_world(tmp_path):
    vrx_mj.compile_world(water(), fleet={"boats": [FIRST], "sensors": "none"}).save(tmp_path)
    sim = vrx_mj.Simulation.load(tmp_path)
    sim.spawn("late", pose=LATE)
    assert list(sim.step({"late": AHEAD}, duration=0.1)) == ["first", "late"]


def test_the_example_of_the_docs_runs(tmp_path, monkeypatch, capsys):
    text = (Path(__file__).resolve().parents[2] / "docs" / "spawning.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    boats, objects = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(boats, {})  # noqa: S102
    assert capsys.readouterr().out == "['wamv1', 'wamv3', 'guest']\n"
    exec(objects, {})  # noqa: S102
    assert capsys.readouterr().out.startswith("('lamp',) [30. 10. ")
