"""Memory of a batch's rows: as much as their shapes can need, and an error of ours where it is not there."""

import re
import subprocess
import sys
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

import vrx_mj
from vrx_mj.errors import CommandError
from vrx_mj.rl.problems import PROBLEMS
from vrx_mj.runtime import row_tables
from vrx_mj.runtime.row_tables import allocating, check_free, check_memory
from vrx_mj.runtime.stepping_models import IDLE, PER_CONTACT, PER_DOF_PAIR, row_arena_bytes, stepping_models

TWO = {"thrusters": "H", "sensors": "none",
       "boats": [{"name": name, "pose": [0, 12 * k, 0.1, 0, 0, 0]} for k, name in enumerate("ab")]}  # fmt: skip
ONE_BOAT = IDLE + PER_DOF_PAIR * 6**2


def compiled(name):
    """A world of one boat, or of two in open water."""
    world = PROBLEMS["Docking" if name == "Docking" else "StationKeeping"].world
    return vrx_mj.compile_world(world, fleet=TWO if name == "two" else {"sensors": "none"})


@pytest.fixture(scope="module", params=["Docking", "two"])
def world(request):
    return compiled(request.param)


def test_rows_without_contacts_take_little():
    solid, quiet = stepping_models(compiled("StationKeeping"))
    assert (solid.narena, quiet.narena) == (ONE_BOAT, ONE_BOAT)


def body(place, *geoms, joint="<freejoint/>"):
    return f"<body pos='{place}'>{joint}{''.join(geoms)}</body>"


BOX, BALL, MESH = "<geom size='1 1 1' type='box'/>", "<geom size='1'/>", "<geom type='mesh' mesh='m'/>"
GHOST, ODD = "<geom size='1' contype='0' conaffinity='0'/>", "<geom size='1' contype='2' conaffinity='2'/>"
PART = body("0 0 2", BOX, joint="<joint type='hinge'/>")


@pytest.mark.parametrize(
    ("bodies", "contacts"),
    [
        (body("0 0 0", BOX) + body("9 0 0", BOX), 8),
        (body("0 0 0", *[BOX] * 5) + body("9 0 0", *[BALL] * 7), 16 * 12),
        (body("0 0 0", BOX) + body("9 0 0", BOX) + body("9 9 0", BOX), 3 * 8),
        (body("0 0 0", BOX, GHOST) + body("9 0 0", GHOST), 0),
        (body("0 0 0", BOX) + body("9 0 0", ODD), 0),
        (BOX + body("0 0 9", BOX), 8),
        (BOX + body("0 0 9", BOX, joint=""), 0),
        (body("0 0 0", BOX, PART), 8 * 2 * 2),
        (body("0 0 0", MESH) + body("9 0 0", BOX), 8),
        ("<geom type='plane' size='1 1 1'/>" + body("0 0 9", BOX), None),
    ],
)
def test_room_is_for_the_contacts_of_each_two_things_that_may_touch(bodies, contacts):
    mesh = "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset>"
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{mesh}<worldbody>{bodies}</worldbody></mujoco>")
    wanted = None if contacts is None else IDLE + PER_DOF_PAIR * model.nv**2 + PER_CONTACT * contacts
    assert row_arena_bytes(model) == (wanted or model.narena)


def test_more_than_mujoco_chooses_is_never_taken():
    four = {"usv_count": 4, "layout": "line", "spacing": 12, "sensors": "none"}
    solid, _ = stepping_models(vrx_mj.compile_world("ocean", fleet=four))
    assert solid.narena == 14 << 20


def heap(model, random):
    """A position in which bodies overlap."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    places = [*data.geom_xpos[model.body_weldid[model.geom_bodyid] == 0, :2]] or [np.zeros(2)]
    at, near = places[random.integers(len(places))], random.choice([0.0, 0.1, 0.5, 1.5])
    qpos = np.array(model.qpos0)
    for start in model.jnt_qposadr:
        qpos[start : start + 3] = [*at, 0.0] + random.normal(0.0, 1.0, 3) * near
        turn = np.array([1.0, 0.0, 0.0, 0.0]) + random.normal(0.0, 1.0, 4) * random.choice([0.0, 0.1, 1.0])
        qpos[start + 3 : start + 7] = turn / np.linalg.norm(turn)
    return qpos


def test_bodies_within_each_other_take_a_fifth_of_the_room_at_most(world):
    (model, _), random, contacts = stepping_models(world), np.random.default_rng(2), []
    data = mujoco.MjData(model)
    for _ in range(300):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = heap(model, random)
        mujoco.mj_step(model, data)
        contacts.append(data.ncon)
        assert not any(warning.number for warning in data.warning)
    assert max(contacts) > 40
    assert data.maxuse_arena < model.narena / 5


def test_a_row_that_touches_moves_as_a_simulation_does(world):
    batch = vrx_mj.Batch(world, 2, seed=3, threads=1)
    qpos = heap(batch._arrays.model, np.random.default_rng(4))
    for k, boat in enumerate(batch.boats):
        x, y = qpos[7 * k : 7 * k + 2]
        batch.set_boat(boat, pose=(x + k, y, 0.1, 0.1, 0.2, 0.3), rows=[1])
    sim = vrx_mj.Simulation(world)
    sim.set_state(batch.get_state(1))
    for _ in range(10):
        batch.advance(10)
        sim.advance(10)
        assert sim.get_state().sha256 == batch.get_state(1).sha256
    assert sim.data.ncon > 0


# Where there is none


@pytest.fixture(scope="module")
def data():
    return mujoco.MjData(stepping_models(compiled("StationKeeping"))[0])


def test_more_rows_than_the_machine_has_memory_for_are_refused(data, monkeypatch):
    monkeypatch.setattr(row_tables, "total_memory", lambda: 8e9)
    each = 455_000 + data.nbuffer
    check_memory(17_000, each)
    with pytest.raises(CommandError) as raised:
        check_memory(18_000, each)
    assert re.fullmatch(
        r"no memory for 18000 rows: 8.5 GB are needed, 0.47 MB a row, and at most 8.0 GB are available; "
        r"make at most 17\d{3} rows",
        str(raised.value),
    )


def test_rows_of_free_bodies_take_little_and_the_message_says_how_many_fit(monkeypatch):
    monkeypatch.setattr(row_tables, "total_memory", lambda: 1e8)
    batch = vrx_mj.Batch(compiled("StationKeeping"), 1000, threads=1, engine="free")
    assert 1e3 < row_tables.row_bytes(batch._arrays) < 2.5e3
    with pytest.raises(CommandError, match=r"no memory for 100000 rows: .* kB a row.* make at most \d{5} rows"):
        vrx_mj.Batch(batch.world, 100_000, engine="free")


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("could not allocate"),
        mujoco.FatalError("could not allocate"),
        RuntimeError("Caught an unknown exception!"),
    ],
)
def test_memory_that_the_system_refuses_is_an_error_with_the_rows_and_the_memory(data, error):
    with pytest.raises(CommandError) as raised, allocating(2048, data):
        raise error
    assert str(raised.value) == (
        "no memory for 2048 rows: 1.5 GB of address space are needed, 0.74 MB a row; make fewer rows, or raise the "
        "limit (ulimit -v)"
    )


def test_another_error_of_what_allocates_is_left_as_it_is(data):
    with pytest.raises(RuntimeError, match=r"^a bug$"), allocating(2048, data):
        raise RuntimeError("a bug")


LIMIT = """
import resource
from pathlib import Path
from vrx_mj.rl import VectorEnv
VectorEnv("StationKeeping", 4, mass=(0.9, 1.1), threads=1).reset(seed=1)
before = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
def limit(more):
    resource.setrlimit(resource.RLIMIT_AS, (before + more, resource.RLIM_INFINITY))
"""
MANY = """
limit(1_200_000_000)
env = VectorEnv("StationKeeping", 600, mass=(0.9, 1.1), threads=1)
env.reset(seed=1)
env.step(env.action_space.sample())
"""
TOO_MANY = """
for part in range(1, 9):  # which of its allocations fails first is chance: a few amounts that are left
    limit(part * 50_000_000)
    try:
        VectorEnv("StationKeeping", 5000, threads=1)
    except Exception as error:
        print(type(error).__name__, error)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="address space is limited on Linux")
@pytest.mark.parametrize(
    ("script", "printed"),
    [
        pytest.param(MANY, "", id="rows_take_two_megabytes_at_most"),
        pytest.param(
            TOO_MANY,
            r"(CommandError no memory for 5000 rows: 3\.\d GB of address space are needed, .*\n){8}",
            id="too_many_are_refused",
        ),
    ],
)
def test_under_a_limit_of_address_space(script, printed):
    done = subprocess.run(
        [sys.executable, "-c", LIMIT + script], capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(printed, done.stdout)


def free_world(**changes):
    """Tables of a world of one hull that the free engine takes, but for changes."""
    model = {"body_gravcomp": np.zeros(2), "dof_damping": np.zeros(6), "jnt_type": np.zeros(1, int), "nv": 6}
    model["opt"] = SimpleNamespace(density=0.0, viscosity=0.0)
    own = {"thrusters": {"dof": np.array([-1, -1])}, "blocks": [], "links": [], "hulls": [0], "floats": [],
           "broadphase": {"unconstrained": np.array([1])}}  # fmt: skip
    model |= {name: value for name, value in changes.items() if name in model}
    own |= {name: value for name, value in changes.items() if name in own}
    return SimpleNamespace(contact_free=SimpleNamespace(**model), **own)


HELD = "MuJoCo holds, drives or pushes something in world bay; leave it out"


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"thrusters": {"dof": np.array([-1, 0, 7])}},
         "2 engines of world bay turn on hinges; give the fleet `engines: fixed`"),
        ({"blocks": [0]}, "world bay has a floating dock; make it `dynamic: false`"),
        ({"links": [0]}, "things in world bay have joints; leave them out"),
        ({"jnt_type": np.array([0, 3])}, "things in world bay have joints; leave them out"),
        ({"nv": 7}, HELD),
        ({"floats": [0]}, HELD),
        ({"body_gravcomp": np.array([0.0, 0.5])}, HELD),
        ({"dof_damping": np.ones(6)}, HELD),
        ({"opt": SimpleNamespace(density=1.0, viscosity=0.0)}, HELD),
        ({"opt": SimpleNamespace(density=0.0, viscosity=1.0)}, HELD),
        ({"broadphase": {"unconstrained": np.array([0])}}, HELD),
    ],
)  # fmt: skip
def test_what_the_free_engine_cannot_step_is_named(changes, why):
    check_free(free_world(), "bay")
    with pytest.raises(CommandError) as refused:
        check_free(free_world(**changes), "bay")
    assert str(refused.value) == f'engine free: {why}, or use engine="mujoco"'


@pytest.mark.parametrize(
    ("count", "shown"),
    [(500.0, "0.5 kB"), (99_999.0, "100.0 kB"), (1e5, "0.10 MB"), (9.99e8, "999.00 MB"), (1e9, "1.0 GB")],
)
def test_sizes_of_memory(count, shown):
    assert row_tables._size(count) == shown


def test_rows_that_just_fit_are_made():
    check_memory(10, 100, 1000)
    with pytest.raises(CommandError, match=r"make at most 9 rows$"):
        check_memory(10, 100, 999.9)
