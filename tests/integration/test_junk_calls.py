"""Every public function, with every argument in turn replaced by junk: it works, or says in a line what is wrong.

No other exception than ours comes out, no warning, and what follows is as if nothing had been asked.
"""

import contextlib
import inspect
import pathlib
import signal

import numpy as np
import pytest

import vrx_mj
from junk import JUNK, Junk, hung
from vrx_mj import control
from vrx_mj import recording as recordings
from vrx_mj.draw.course import map_of
from vrx_mj.draw.map import draw_map, map_png
from vrx_mj.errors import DivergedError, VrxError
from vrx_mj.recording.video import looking
from vrx_mj.rl import Env, ParallelEnv, TeamVectorEnv, VectorEnv

WORLD = {
    "extends": "ocean",
    "sea": {"model": "pms", "gain": 0.2},
    "wind": {"mean_velocity": 3.0, "var_gain": 1.0},
    "georeference": {"latitude": 1.0, "longitude": 2.0},
    "objects": [
        {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [20, 5, 0, 0, 0, 0]},
        {"name": "lamp", "model": "robotx_light_buoy", "pose": [30, 5, 0.25, 0, 0, 0]},
    ],
}
TASK = {"task": {"type": "stationkeeping", "goal": [10.0, 0.0, 0.0]}}
FLEET = {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0], "thrusters": "T", "sensors": ["gps_wamv", "imu_wamv"]}]}


LANDMARK = "landmark"


@pytest.fixture
def junk(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    before = signal.signal(signal.SIGPROF, hung)
    found = Junk()
    yield found
    signal.signal(signal.SIGPROF, before)
    print(f"{found.calls} calls, {len(found.wrong)} wrong")
    assert not found.wrong, "\n".join(found.wrong)


@pytest.fixture(scope="module")
def world():
    return vrx_mj.compile_world(WORLD, fleet=FLEET)


@pytest.fixture(scope="module")
def sim(world):
    return vrx_mj.Simulation(world)


def assert_all_tried(known, function):
    """No argument of a function is left out."""
    assert set(known) == set(inspect.signature(function).parameters)


def dropped(made):
    """Close what can be closed."""
    with contextlib.suppress(AttributeError):
        made.close()


@pytest.mark.slow
def test_worlds(junk, world):
    known = {
        "world": "ocean",
        "fleet": FLEET,
        "seed": 1,
        "nudge": False,
        "arguments": None,
        "parameters": {"wind.mean": 2.0},
    }
    assert_all_tried(known, vrx_mj.compile_world)
    junk.try_all("compile_world", vrx_mj.compile_world, known)
    junk.try_all("World.save", world.save, {"target": "saved"})
    junk.try_all("World.load", vrx_mj.World.load, {"source": "saved"})
    junk.try_all("Simulation.load", vrx_mj.Simulation.load, {"source": "saved"})
    junk.try_all("Simulation", vrx_mj.Simulation, {"world": world, "seed": 3})


SIMULATED = {
    "command_names": {"boat": "a"},
    "reset": {"seed": 1},
    "command": {"boat": "a", "left": 0.5},
    "command_all": {"commands": {"a": {"left": 0.5}}},
    "step": {"commands": {"a": {"left": 0.5}}, "duration": 0.1},
    "steps_in": {"duration": 0.1},
    "advance": {"steps": 1},
    "event": {"text": "a", "level": "INFO"},
    "sensors": {"boat": "a"},
    "mounted": {"boat": "a"},
    "sense": {"boat": "a"},
    "steering": {"boat": "a"},
    "thrust": {"boat": "a"},
    "receivers": {"boat": "a"},
    "forces": {"boat": "a"},
    "release": {"boat": "a"},
    "set_boat": {"name": "a", "pose": (0, 0, 0, 0, 0, 0), "velocity": (0, 0, 0, 0, 0, 0)},
    "set_object": {"name": "buoy", "pose": (20, 0, 0, 0, 0, 0), "velocity": (0, 0, 0, 0, 0, 0)},
    "observe_object": {"name": "buoy"},
    "showing": {"name": "lamp"},
    "set_light": {"name": "lamp", "colors": ("red", "off", "blue")},
    "shuffle": {"name": "lamp"},
    "subscribe": {"boat": "a", "sensor": "gps_wamv", "callback": print, "rate": 1.0},
    "watch_contacts": {"tell": print, "ended": True},
}
NEEDING_MORE = {"attach", "detach", "energy", "fire", "labelled", "paint", "pinger", "set_pinger", "set_placard",
                "set_state", "send", "spawn", "spawn_object", "spawn_dock", "remove", "unsubscribe",
                "unwatch_contacts", "load"}  # fmt: skip
"""Methods of a simulation that other tests here call."""


@pytest.mark.parametrize("method", SIMULATED)
def test_simulations(junk, sim, method):
    def mend():
        sim._subscriptions._all, sim._subscriptions._watches = (), ()
        sim.reset()

    junk.try_all(method, getattr(sim, method), SIMULATED[method], mend)
    mend()


def test_all_methods_of_a_simulation_are_called():
    methods = {
        name
        for name, one in inspect.getmembers(vrx_mj.Simulation, inspect.isroutine)
        if not name.startswith("_") and len(inspect.signature(one).parameters) > (name != "load")
    }
    assert methods == {*SIMULATED, *NEEDING_MORE}


def test_energy(junk, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    screw = "{thrust: [[0, 0], [1, 9]], diameter: 0.2, power: 90}"
    pathlib.Path("electric.yaml").write_text(f"extends: skiff\npropellers: {{propeller: {screw}}}\n", encoding="utf-8")
    world = {"name": "bay", "physics": {"profile": "marine"}, "spawn": {"robot": "./electric.yaml"}}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world))
    for each in (sim, vrx_mj.Batch(sim.world, 2, threads=1)):
        junk.try_all("energy", each.energy, {"boat": sim.boats[0]})


def test_what_a_simulation_holds(junk, sim):
    class Quiet:
        def __getattr__(self, _):
            return lambda *_: None

    def attached(**known):
        sim.attach(**known)
        sim.detach(known["listener"])

    junk.try_all("attach", attached, {"listener": Quiet(), "rate": 10.0})
    assert sim._sampler.listeners == ()
    for value in JUNK.values():
        with pytest.raises(VrxError):
            sim.detach(value)
    junk.try_all("unsubscribe", sim.unsubscribe, {"subscription": None})
    junk.try_all("unwatch_contacts", sim.unwatch_contacts, {"watch": sim.watch_contacts(print)})
    junk.try_all("paint", sim.paint, {"model": sim.visual_model})
    junk.try_all("set_state", sim.set_state, {"state": sim.get_state()})
    junk.try_all("Sea.height", sim.sea.height, {"x": 1.0, "y": 2.0, "t": 3.0})
    junk.try_all("Wind.velocity", sim.wind.velocity, {"t": 1.0})


@pytest.mark.slow
def test_boats_that_come_and_go(junk, world):
    sim = vrx_mj.Simulation(world)
    known = {"name": "b", "pose": (0, 20, 0.1, 0, 0, 0), "robot": "wamv", "thrusters": "H", "components": None,
             "sensors": "none", "engines": "fixed", "color": (1, 0, 0, 1)}  # fmt: skip

    junk.try_all("spawn", sim.spawn, known, sim.reset)

    def removed(name):
        sim.spawn("b", pose=(0, 20, 0.1, 0, 0, 0), sensors="none")
        sim.remove(name)

    junk.try_all("remove", removed, {"name": "b"}, sim.reset)


@pytest.mark.slow
def test_objects_and_docks_that_come_and_go(junk, world):
    sim = vrx_mj.Simulation(world)
    path = {"circle": {"radius": 5}}
    thing = {"name": "b", "model": "turtle_buoy", "pose": (0, 20, 0.1, 0, 0, 0), "path": path, "symbols": ()}
    junk.try_all("spawn_object", sim.spawn_object, thing, sim.reset)
    dock = {"name": "b", "layout": "X X\nXXX", "pose": (0, 20, 0.1, 0, 0, 0), "dynamic": True, "block": 2.0,
            "mooring": {}, "bays": [{}], "symbols": ()}  # fmt: skip
    junk.try_all("spawn_dock", sim.spawn_dock, dock, sim.reset)


@pytest.mark.slow
def test_instruments_and_tasks(junk):
    fleet = {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0], "sensors": "vrx"}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world({**WORLD, **TASK}, fleet=fleet))
    receiver = sim.receivers("a")[0]
    junk.try_all("pinger", sim.pinger, {"boat": "a", "sensor": receiver})
    junk.try_all("set_pinger", sim.set_pinger, {"boat": "a", "sensor": receiver, "position": (1.0, 2.0, -3.0)})
    junk.try_all("fire", sim.fire, {"boat": "a", "sensor": None})
    junk.try_all("labelled", sim.labelled, {"boat": "a", "camera": "front_left_camera"})
    with recordings.CocoWriter("data") as coco:
        junk.try_all("add", coco.add, {"reading": sim.labelled("a", "front_left_camera")})
    with vrx_mj.record(sim, "run.rrd", sea=False):
        sim.advance(1)
    junk.every = 6
    asked = {"source": "run.rrd", "folder": "data", "boat": "a", "begin": 0.0, "end": 0.0}
    junk.try_all("write_coco", recordings.write_coco, asked)
    junk.every = 1
    junk.try_all("sense", lambda sensor: sim.sense("a")[sensor], {"sensor": "gps_wamv"})
    junk.try_all("send", lambda topic: None if topic is LANDMARK else sim.send(topic, {}), {"topic": LANDMARK})
    docked = vrx_mj.Simulation(vrx_mj.compile_world("scan_dock_deliver"))
    name = docked.placards[0]
    junk.try_all("set_placard", docked.set_placard, {"name": name, "symbol": "red_circle"})
    junk.try_all("send", lambda content: docked.send("color_sequence", content), {"content": ["red", "green", "blue"]})


def test_states(junk, sim):
    state = sim.get_state()
    junk.try_all("State.save", state.save, {"path": "some.state"})
    junk.try_all("State.load", vrx_mj.State.load, {"path": "some.state"})
    junk.try_all("State.from_bytes", vrx_mj.State.from_bytes, {"block": state.to_bytes()})
    junk.try_all("State.check", state.check, {"world": state.world})


def test_runs(junk, sim):
    known = {"duration": 0.2, "control_rate": 10.0, "controller": lambda obs, t: None, "progress": lambda t: None}
    junk.try_all("run", lambda **known: vrx_mj.run(sim, **{"duration": 0.2} | known), known, sim.reset)
    junk.try_all("run", lambda **known: vrx_mj.run(sim, 0.2, **known), {"advance": sim.advance}, sim.reset)
    junk.try_all("run", lambda sim: vrx_mj.run(sim, 0.2), {"sim": sim}, sim.reset)
    junk.try_all("run", lambda returned: vrx_mj.run(sim, 0.2, controller=lambda *_: returned), {"returned": None})

    def shown(**known):
        with vrx_mj.progress(**known) as tick:
            tick(0.1)

    junk.try_all("progress", shown, {"sim": sim, "duration": 1.0})


@pytest.mark.slow
def test_recordings(junk, sim):
    def recorded(**known):
        with vrx_mj.record(**{"sim": sim, "path": "run.rrd", "sea": False} | known):
            sim.advance(1)

    recorded()
    junk.every = 6
    known = {"sim": sim, "path": "run.rrd", "sea": False}
    junk.try_all("record", recorded, known, sim.reset)
    assert_all_tried({*known, "sensors", "follow"}, vrx_mj.record)
    junk.try_all("record", recorded, {"sensors": "a:gps_wamv", "follow": "a"}, sim.reset)
    junk.try_all("read_record", vrx_mj.read_record, {"path": "run.rrd", "whole": False})
    junk.try_all("resume", vrx_mj.resume, {"path": "run.rrd", "time": 0.0})
    junk.try_all("compare", vrx_mj.compare, {"first": "run.rrd", "second": "run.rrd"})
    read = vrx_mj.read_record("run.rrd")
    junk.try_all("Record.state_at", read.state_at, {"time": 1.0})
    with contextlib.suppress(VrxError):
        junk.try_all("Record.readings", read.readings, {"boat": "a", "sensor": "gps_wamv"})
    for value in (one for one in JUNK.values() if not isinstance(one, str | pathlib.Path)):  # written above
        with pytest.raises(VrxError):
            vrx_mj.show(value)
        with pytest.raises(VrxError):
            recordings.open_viewer(value)


@pytest.mark.slow
def test_batches(junk, world):
    made = vrx_mj.Batch(world, 3, threads=1)
    junk.try_all("Batch", vrx_mj.Batch, {"world": world, "n": 2, "seed": 1, "threads": 1})
    junk.try_all("advance", made.advance, {"steps": 1, "rows": [0, 1]}, made.reset)
    values = np.zeros((3, len(made.channels)))
    junk.try_all("command", made.command, {"values": values, "rows": None}, made.reset)
    junk.try_all("step", made.step, {"values": values, "duration": 0.1, "rows": None}, made.reset)
    junk.try_all("reset", made.reset, {"rows": [0, 1], "seed": 3})
    junk.try_all("get_state", made.get_state, {"row": 1})
    known = {"boat": "a", "pose": np.zeros(6), "velocity": np.zeros(6), "rows": [0]}
    junk.try_all("set_boat", made.set_boat, known, made.reset)
    junk.try_all("set_object", made.set_object, {"name": "buoy", **dict([*known.items()][1:])}, made.reset)
    junk.try_all("observe_object", made.observe_object, {"name": "buoy", "rows": [0]})
    varied = dict.fromkeys(("wind_speed", "wind_direction", "gusts", "waves", "mass", "thrust"), 1.0)

    def vary(**known):
        made.vary(**known)
        made.reset()
        with contextlib.suppress(DivergedError):
            made.advance(2)

    junk.try_all("vary", vary, {"rows": None, **varied}, lambda: made.vary(**{**varied, "wind_direction": 0.0}))


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Env, VectorEnv])
def test_gymnasium(junk, kind):
    options = {"world": None, "fleet": None, "duration": 10.0, "wind_speed": 1.0, "gusts": (0.0, 1.0), "waves": 1.0,
               "mass": 1.0, "thrust": 1.0, "threads": 1, "width": 64, "height": 64}  # fmt: skip
    more = {} if kind is Env else {"num_envs": 2, "autoreset_mode": "NextStep"}
    junk.every = 4

    def made(**known):
        env = kind(**{"problem": "StationKeeping", "threads": 1} | known)
        env.reset(seed=1)
        env.close()

    junk.try_all(kind.__name__, made, {"problem": "StationKeeping", "render_mode": None, **options, **more})
    env = kind("StationKeeping", threads=1)
    junk.try_all("reset", env.reset, {"seed": 1, "options": None}, env.reset)
    junk.try_all("step", env.step, {"action": env.action_space.sample()} if kind is Env else
                 {"actions": env.action_space.sample()}, env.reset)  # fmt: skip
    env.close()


@pytest.mark.slow
@pytest.mark.parametrize("kind", [ParallelEnv, TeamVectorEnv])
def test_teams(junk, kind):
    options = {"boats": 2, "duration": 10.0, "reward": "team", "neighbours": 1, "range": 20.0, "noise": (0, 0, 0),
               "delay": 0.1, "joining": 0.0, "leaving": 0.0, "threads": 1, "width": 64, "height": 64,
               "render_mode": None, "world": None, "fleet": None, "mass": 1.0, "waves": (0.5, 1.0)}  # fmt: skip
    more = {} if kind is ParallelEnv else {"num_envs": 1, "autoreset": True}
    junk.every = 4

    def made(**known):
        env = kind(**{"problem": "Formation", "threads": 1} | known)
        env.reset(seed=1)
        env.close()

    junk.try_all(kind.__name__, made, {"problem": "Formation", **options, **more})
    env = kind("Formation", boats=2, threads=1)
    env.reset()
    if kind is ParallelEnv:
        junk.try_all("reset", env.reset, {"seed": 1, "options": None}, env.reset)
        known = {boat: env.action_space(boat).sample() for boat in env.agents}
        junk.try_all("step", env.step, {"actions": known}, env.reset)
        junk.try_all("step", lambda action: env.step(known | {env.agents[0]: action}),
                     {"action": known[env.agents[0]]}, env.reset)  # fmt: skip
        junk.try_all("action_space", env.action_space, {"agent": env.agents[0]})
        junk.try_all("observation_space", env.observation_space, {"agent": env.agents[0]})
    else:
        junk.try_all("reset", env.reset, {"seed": 1, "rows": None}, env.reset)
        actions = np.zeros((1, 2, env._most_channels if hasattr(env, "_most_channels") else 4), np.float32)
        junk.try_all("step", env.step, {"actions": actions}, env.reset)
    env.close()


def test_eyes(junk):
    known = {"position": (0, 0, 2), "target": (10, 0, 2), "up": (0, 0, 1), "field": 1}
    assert_all_tried(known, looking)
    junk.try_all("looking", looking, known)
    assert looking(**known).rotation[:, 0].tolist() == [1.0, 0.0, 0.0]
    with pytest.raises(VrxError, match=r"^invalid target \(0, 0, 5\): a place away from the position"):
        looking(**{**known, "target": (0, 0, 5)})


def test_maps(junk, world):
    scene = map_of(world)
    junk.try_all("map_of", map_of, {"world": world})
    junk.try_all("map_png", map_png, {"scene": scene, "size": (300, 200)})
    junk.try_all("draw_map", draw_map, {"scene": scene, "path": "map.png", "size": (300, 200)})


@pytest.mark.parametrize("name", control.__all__)
def test_controllers(junk, name):
    kind = getattr(control, name)
    known = {"Channel": {"chart": None}, "Gymkhana": {"chart": None}, "Perceiver": {"catalogue": None}}.get(name, {})
    junk.try_all(name, kind, known)
    made = kind()
    junk.try_all("reset", made.reset, {"seed": 1})
