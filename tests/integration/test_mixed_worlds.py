"""Worlds drawn at random: what is far from all else moves as if it were alone, in any order and in any way it came."""

import random
import warnings

import numpy as np
import pytest

import hydro_boats
import vrx_mj

APART = 400.0
"""Between two things [m]: nothing touches, and no rope reaches another."""
SECONDS = 4.0
ROBOTS = ("wamv", "wamv_stereo", "otter", "heron", "skiff", "blueboat", "barge_4m", "sphere", "cylinder")
FLOATING = ("robotx_light_buoy", "surmark46104", "mb_round_buoy_black", "crocodile_static")
SEAS = (
    {"model": "none"},
    {"model": "regular", "height": 0.4, "period": 5.0},
    {"model": "jonswap", "significant_height": 0.5, "peak_period": 5.0, "components": 12, "spreading": 10.0},
    {"model": "pms", "gain": 0.4, "period": 5.0, "scale": 1.5},
)
CURRENTS = (None, {"speed": 0.4, "direction": 40}, {"speed": 0.2, "direction": 200, "tide": {"speed": 0.3}})
WINDS = (None, {"direction": 120, "mean_velocity": 6.0, "var_gain": 2.0, "var_time": 2.0, "seed": 15})


class Drawn:
    """A world's water and air, and things in it by name, each with its kind and what a file says of it."""

    def __init__(self, seed, folder):
        chance = random.Random(seed)
        self.water = {"name": "mixed", "physics": {"profile": chance.choice(("marine", "marine", "vrx"))}}
        marine = self.water["physics"]["profile"] == "marine"
        settings = {"sea": chance.choice(SEAS), "wind": chance.choice(WINDS)}
        settings["current"] = chance.choice(CURRENTS) if marine else None
        self.water |= {key: value for key, value in settings.items() if value is not None}
        robots = chance.sample(ROBOTS, 2)
        if marine:  # hulls with meshes, memories, tables of diffraction and skegs of their own, and two of one kind
            one, other = chance.sample(range(hydro_boats.KINDS), 2)
            robots += [hydro_boats.barge(folder, kind) for kind in (one, other, other)]
        objects = ("moored", "moored", "adrift", "swimming", "swimming")
        kinds = [*(("boat", robot) for robot in robots), *(("object", how) for how in objects), *[("dock", "dock")] * 2]
        self.things = {}
        for number, (kind, what) in enumerate(kinds):
            place = [APART * (number % 3), APART * (number // 3), 0.0, 0.0, 0.0, chance.uniform(-3, 3)]
            self.things[f"{kind}{number}"] = kind, self._said(chance, kind, what, place, marine=marine)

    @staticmethod
    def _said(chance, kind, what, pose, *, marine):
        if kind == "boat":
            return {"robot": what, "pose": pose}
        if kind == "dock":
            return {"pose": pose, "layout": "X X\nXXX\n", "dynamic": True, "mooring": {"stiffness": 500.0}}
        if what == "swimming":
            return {"model": "crocodile_buoy", "pose": pose, "path": {"circle": {"radius": chance.uniform(3, 9)}}}
        rope = {"length": chance.uniform(0.5, 1.5)} if what == "moored" else None
        return {"model": chance.choice(FLOATING), "pose": pose} | ({"mooring": rope} if marine else {})

    def world(self, names):
        """The compiled world with these of the things, in this order."""
        lists = {"objects": [], "docks": [], "boats": []}
        for name in names:
            kind, said = self.things[name]
            lists[f"{kind}s"].append({"name": name, **said})
        fleet = {"boats": lists.pop("boats"), "sensors": "none"}
        return vrx_mj.compile_world({**self.water, **lists}, fleet=fleet if fleet["boats"] else "none")


def commands(sim):
    """Something for every engine."""
    return {
        boat: {name: 0.3 if name.endswith("angle") else 0.6 for name in sim.command_names(boat)} for boat in sim.boats
    }


def sailed(sim, seconds=SECONDS):
    sim.step(commands(sim), duration=seconds)
    return sim


def motion(sim, name):
    """Positions and velocities of all joints of a thing."""
    model, data = sim.model, sim.data
    bodies = [i for i in range(model.nbody) if model.body(i).name.split("/")[0] == name]
    joints = [j for j in range(model.njnt) if model.jnt_bodyid[j] in bodies]
    assert joints, name
    position, velocity = np.append(model.jnt_qposadr, model.nq), np.append(model.jnt_dofadr, model.nv)
    parts = [data.qpos[position[j] : position[j + 1]] for j in joints]
    return np.concatenate(parts + [data.qvel[velocity[j] : velocity[j + 1]] for j in joints])


def all_motion(sim, names):
    return {name: motion(sim, name).tolist() for name in names}


SEEDS = [0, 5, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3, 4))]
NIGHTLY = (6, 7, 8, 9, 10, 11)


pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.VrxWarning")


@pytest.fixture(scope="module", params=SEEDS)
def seed(request):
    return request.param


@pytest.fixture(scope="module")
def drawn(seed, tmp_path_factory):
    return Drawn(seed, tmp_path_factory.mktemp("barges"))


@pytest.fixture(scope="module")
def world(drawn):
    """All things, which the tests only read."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vrx_mj.VrxWarning)
        return drawn.world(list(drawn.things))


@pytest.fixture(scope="module")
def expected(drawn, world):
    return all_motion(sailed(vrx_mj.Simulation(world)), list(drawn.things))


def test_each_moves_as_if_alone(drawn, expected):
    for name in drawn.things:
        assert motion(sailed(vrx_mj.Simulation(drawn.world([name]))), name).tolist() == expected[name], name


def test_they_move_alike_in_any_order_and_when_they_were_saved(seed, drawn, world, expected, tmp_path):
    names = list(drawn.things)
    shuffled = random.Random(seed).sample(names, len(names))
    assert all_motion(sailed(vrx_mj.Simulation(drawn.world(shuffled))), names) == expected
    world.save(tmp_path / "world")
    assert all_motion(sailed(vrx_mj.Simulation(vrx_mj.World.load(tmp_path / "world"))), names) == expected


def test_who_joins_and_leaves_moves_nobody_else_and_itself_as_in_a_world_of_its_own(seed, drawn, expected):
    names = list(drawn.things)
    random.Random(seed).shuffle(names)
    late = next(name for name in names if drawn.things[name][0] != "object")  # whose ropes are not spawn_object's
    gone = next(name for name in names if name != late)
    sim = vrx_mj.Simulation(drawn.world([name for name in names if name != late]))
    kind, said = drawn.things[late]
    (sim.spawn if kind == "boat" else sim.spawn_dock)(late, **said, **({"sensors": "none"} if kind == "boat" else {}))
    sailed(sim, SECONDS / 2)
    half = motion(sim, gone)
    sim.remove(gone)
    sailed(sim, SECONDS / 2)
    left = [name for name in names if name != gone]
    assert all_motion(sim, left) == {name: expected[name] for name in left}
    assert np.isfinite(half).all()


def test_who_is_put_elsewhere_moves_nobody_else(drawn, world):
    names = list(drawn.things)
    sim = sailed(vrx_mj.Simulation(world), 1.0)
    state = sim.get_state()
    expected = all_motion(sailed(sim, 0.5), names)
    for name in names:
        kind, said = drawn.things[name]
        sim.set_state(state)
        pose = [said["pose"][0] + 3.0, *said["pose"][1:]]
        (sim.set_boat if kind == "boat" else sim.set_object)(name, pose=pose, velocity=[0.0] * 6)
        found = all_motion(sailed(sim, 0.5), names)
        assert found.pop(name) != expected[name], name
        assert found == {other: expected[other] for other in found}, name


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("seed", NIGHTLY)
def test_so_do_the_things_of_others(seed, subtests, tmp_path):
    drawn = Drawn(seed, tmp_path)
    world = drawn.world(list(drawn.things))
    expected = all_motion(sailed(vrx_mj.Simulation(world)), list(drawn.things))
    with subtests.test("alone"):
        test_each_moves_as_if_alone(drawn, expected)
    with subtests.test("in any order"):
        test_they_move_alike_in_any_order_and_when_they_were_saved(seed, drawn, world, expected, tmp_path)
    with subtests.test("joining and leaving"):
        test_who_joins_and_leaves_moves_nobody_else_and_itself_as_in_a_world_of_its_own(seed, drawn, expected)
    with subtests.test("put elsewhere"):
        test_who_is_put_elsewhere_moves_nobody_else(drawn, world)
