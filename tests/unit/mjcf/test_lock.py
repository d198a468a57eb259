"""The lock that holds a task's boat, in plain MuJoCo."""

import math
import warnings

import mujoco
import numpy as np
import pytest

from vrx_mj import Simulation
from vrx_mj.errors import VrxWarning
from vrx_mj.mjcf.compile import compile_world

HERE = {"type": "stationkeeping", "goal_cart": [1, 2, 0.5]}


@pytest.fixture(scope="module")
def locked():
    return compile_world({"spawn": {"pose": [3, 4, 0.1, 0, 0, 1.0]}, "task": HERE})


def pushed(world, force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0), *, seconds=4.0, free=False, timestep=0.01):
    """Where a boat ends that is pushed at its base link, in plain MuJoCo without gravity: (7,) of its free joint.

    Springs and dampers stand in for the water, in heave, roll and pitch; they do nothing along the surface.
    """
    model = mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets))
    model.opt.timestep, model.opt.gravity[:] = timestep, 0.0
    data, body = mujoco.MjData(model), model.body("wamv/base_link").id
    q, v = int(model.joint("wamv/free").qposadr[0]), int(model.joint("wamv/free").dofadr[0])
    data.eq_active[:] = not free
    for _ in range(round(seconds / timestep)):
        turn = data.xmat[body].reshape(3, 3) if data.time else np.eye(3)
        level = np.cross(turn[:, 2], [0.0, 0.0, 1.0])
        spin = turn @ data.qvel[v + 3 : v + 6] * [1.0, 1.0, 0.0]
        data.xfrc_applied[body, :3] = np.array(force) - [
            0,
            0,
            20_000 * (data.qpos[q + 2] - 0.1) + 4000 * data.qvel[v + 2],
        ]
        data.xfrc_applied[body, 3:] = np.array(torque) + 8000 * level - 3000 * spin
        mujoco.mj_step(model, data)
    return data.qpos[q : q + 7]


def yaw_of(place):
    w, x, y, z = place[3:]
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@pytest.mark.parametrize("timestep", [0.004, 0.01, 0.02])
@pytest.mark.parametrize(
    ("force", "torque"), [((500, 0, 0), (0, 0, 0)), ((0, 500, 0), (0, 0, 0)), ((0, 0, 0), (0, 0, 500))]
)
def test_a_lock_holds_against_500_newtons(locked, force, torque, timestep):
    place = pushed(locked, force, torque, timestep=timestep)
    assert math.hypot(place[0] - 3, place[1] - 4) < 0.01
    assert abs(yaw_of(place) - 1.0) < math.radians(0.5)


def test_a_locked_boat_heaves_rolls_and_pitches(locked):
    heave = pushed(locked, (0, 0, 2000))
    assert heave[2] - 0.1 == pytest.approx(2000 / 20_000, rel=0.02)  # the spring's; the rest is still on its way
    assert math.hypot(heave[0] - 3, heave[1] - 4) < 1e-3
    for torque in ((800, 0, 0), (0, 800, 0)):
        _, x, y, _ = pushed(locked, torque=torque)[3:]
        tilt = math.acos(1 - 2 * (x * x + y * y))
        assert math.sin(tilt) == pytest.approx(800 / 8000, rel=0.05)


def test_a_released_boat_goes(locked):
    place = pushed(locked, (500, 0, 0), free=True)
    assert place[0] - 3 > 5.0


def test_a_lock_is_where_the_boat_is_and_has_the_names_that_runtime_knows(locked):
    model = mujoco.MjModel.from_xml_string(locked.mjcf, dict(locked.assets))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.equality("lock/wamv").active0 == 1
    assert data.body("carrier/wamv").xpos == pytest.approx([3, 4, 0.1])
    assert [model.joint(f"carrier/wamv/{name}").type[0] for name in ("heave", "roll", "pitch")] == [2, 3, 3]


def test_an_unlocked_boat_has_no_lock():
    world = compile_world({"task": {**HERE, "locked": False}})
    assert not any(word in world.mjcf for word in ("carrier", "<weld", "<equality"))


def test_the_lock_changes_no_address_of_a_boat(locked):
    free = compile_world({"spawn": {"pose": [3, 4, 0.1, 0, 0, 1.0]}})
    addresses = [
        mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets)).joint("wamv/free").qposadr[0]
        for world in (free, locked)
    ]
    assert addresses[0] == addresses[1]


MASS = '<inertial><mass value="20"/><inertia ixx="2" iyy="2" izz="2"/></inertial>'
BOX = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
JOINT = '<joint name="j" type="fixed"><parent link="{0}"/><child link="hull"/></joint>'
PILE = f'<robot name="pile"><link name="{{0}}"/><link name="hull">{MASS}{BOX}</link>{JOINT}</robot>'


@pytest.mark.parametrize(("root", "stays"), [("base_link", False), ("world", True)])
def test_what_a_urdf_fixes_to_its_root_link_world_stays(root, stays, tmp_path, monkeypatch):
    """It is put 2 m above the water, far from the origin, and turned."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pile.urdf").write_text(PILE.format(root), encoding="utf-8")
    boat = {"name": "a", "robot": "./pile.urdf", "pose": [-540, 60, 2, 0.3, 0, 0.5]}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        simulation = Simulation(compile_world({}, fleet={"boats": [boat]}))
    simulation.reset(seed=1)
    simulation.step(duration=3.0)
    place = simulation.data.body(f"a/{root}").xpos
    assert bool(np.linalg.norm(place - boat["pose"][:3]) < 1e-3) is stays
