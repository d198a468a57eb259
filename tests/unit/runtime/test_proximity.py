"""How far apart things are: against distances of every two of them, and how long that holds."""

import math

import mujoco
import numpy as np
import pytest

from integration.sailing import AFLOAT, CALM, boats, simulation
from vrx_mj.frames import rotation_matrix
from vrx_mj.runtime.proximity import MAX_DISTANCE, movers

ROCKS = [
    {"name": name, "model": "dock_block_4x4", "pose": [x, y, 0.0, 0.0, 0.0, yaw]}
    for name, x, y, yaw in (("r1", 25.0, 3.0, 0.4), ("r2", -18.0, -9.0, 1.0))
]


@pytest.fixture(scope="module")
def sim():
    made = simulation(boats((0.0, 0.0, 0.3), (20.0, 0.0, 1.0), (0.0, 20.0, 2.0)), sea=CALM, wind=None, objects=ROCKS)
    assert len(made._live.arrays.obstacles) >= len(ROCKS)
    return made


def spheres(sim):
    """Middles (n, 3) and radii (n,) of all that moves, where it is now [m]."""
    movers, qpos = sim._live.arrays.movers, sim.data.qpos
    turns = [rotation_matrix(qpos[one + 3 : one + 7]) for one in movers["qpos"]]
    places = [qpos[one : one + 3] for one in movers["qpos"]]
    middles = [place + turn @ own for place, turn, own in zip(places, turns, movers["middle"], strict=True)]
    return np.array(middles), movers["radius"].copy()


def clearance(sim):
    """The least distance of two spheres, or of one from a box [m]."""
    middles, radii = spheres(sim)
    found = [MAX_DISTANCE]
    for i in range(len(radii)):
        found += [math.dist(middles[i], middles[j]) - radii[i] - radii[j] for j in range(i)]
        for box in sim._live.arrays.obstacles:
            gap = np.maximum(np.abs(box["axes"] @ (middles[i] - box["center"])) - box["half"], 0.0)
            found.append(float(np.linalg.norm(gap)) - radii[i])
    return min(found)


def put(sim, places):
    for boat, place in zip(sim.boats, places, strict=True):
        sim.set_boat(boat, pose=(*place[:2], AFLOAT, 0.0, 0.0, place[2]), velocity=(0,) * 6)
    sim._live.arrays.broadphase["clearance"], sim._live.arrays.broadphase["wait"] = 0.0, 0


@pytest.mark.parametrize("seed", range(12))
def test_the_clearance_is_the_least_of_all_distances(sim, seed):
    sim.reset()
    random = np.random.default_rng(seed)
    put(sim, random.uniform((-40.0, -30.0, -3.0), (40.0, 30.0, 3.0), (3, 3)))
    wanted = clearance(sim)
    sim.advance(1)
    (look,) = sim._live.arrays.broadphase
    if wanted > 0.0:
        assert look["clearance"] == pytest.approx(wanted, abs=1e-9)
        assert look["wait"] == 0
    else:
        assert look["clearance"] <= 0.0
        assert look["wait"] == 25


@pytest.mark.parametrize(("share", "looked"), [(0.49, False), (0.51, True)])
def test_nothing_is_looked_at_again_before_something_has_gone_half_of_the_clearance(sim, share, looked):
    sim.reset()
    put(sim, [(0.0, 0.0, 0.0), (12.0, 0.0, 0.0), (0.0, 300.0, 0.0)])
    sim.advance(1)
    (look,) = sim._live.arrays.broadphase
    first = float(look["clearance"])
    pose = sim.data.qpos[sim._live.arrays.hulls["qpos"][2] :][:3]
    pose[1] += share * first
    assert 1.0 < first < MAX_DISTANCE
    look["clearance"] = np.nextafter(first, 0.0)  # what a new look would change
    sim.advance(1)
    assert (sim._live.arrays.broadphase["clearance"][0] == np.nextafter(first, 0.0)) != looked


def test_while_something_is_near_it_is_looked_at_every_26_steps(sim):
    sim.reset()
    put(sim, [(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 300.0, 0.0)])
    waits = []
    for _ in range(28):
        sim.advance(1)
        waits.append(int(sim._live.arrays.broadphase["wait"][0]))
    assert waits == [25, *range(24, -1, -1), 25, 24]


TREE = """
<mujoco><worldbody><body pos="5 0 0"><freejoint/><inertial pos="0.4 0 0" mass="9" diaginertia="1 1 1"/>
  <body pos="1.4 0 0" euler="0 0 90">{first}<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <body pos="0 -0.7 0" euler="40 0 20">{second}<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom type="sphere" size="0.1" pos="0 0 {far}"/>
    </body></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("first", "second", "radius"),
    [
        ("", "", 1.0 + 0.7 + 0.2),
        ('<joint type="hinge" axis="0 1 0" pos="0 0.3 0"/>', "", math.dist((1.0, 0.0), (0.3, 0.0)) + 0.3 + 0.7 + 0.2),
        ("", '<joint type="slide" range="-0.2 0.5" limited="true"/>', 1.0 + 0.7 + 1.2 * 0.5 + 0.2),
        ('<joint type="slide"/>', "", math.inf),
        ('<joint type="ball" pos="0 0 0.3"/>', '<joint axis="1 0 0" pos="0.1 0 0"/>', None),
    ],
)
def test_a_movers_sphere_holds_its_shapes_wherever_its_joints_are(first, second, radius):
    model = mujoco.MjModel.from_xml_string(TREE.format(first=first, second=second, far=0.2))
    (found,) = movers(model)["radius"]
    if radius is not None:
        assert found == pytest.approx(radius + 0.1 + 0.05)  # the ball, and the margin
    data, random = mujoco.MjData(model), np.random.default_rng(1)
    for _ in range(200):
        data.qpos[7:] = (
            random.uniform(-0.2, 0.5, model.nq - 7) if "slide" in second else random.normal(size=model.nq - 7)
        )
        mujoco.mj_kinematics(model, data)
        assert math.dist(data.geom_xpos[0], data.xipos[1]) + 0.1 <= found
