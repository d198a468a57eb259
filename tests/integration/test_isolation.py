"""What a boat does depends on itself, the sea, the wind and what it touches: to the last bit."""

import itertools

import numpy as np
import pytest

import vrx_mj
from integration.sailing import AFLOAT, AHEAD, boats, same_bits, simulation
from vrx_mj.runtime import proximity

FIRST = {"name": "first", "pose": [0, 0, AFLOAT, 0, 0, 0.3]}
FAR = {"name": "far", "pose": [200, 50, AFLOAT, 0, 0, 1.0]}
COLLIDING = [
    {"name": "ram", "pose": [40, 0, AFLOAT, 0, 0, 0.0]},
    {"name": "rammed", "pose": [46, 0.9, AFLOAT, 0, 0, 3.14]},
]
AGROUND = {"name": "aground", "pose": [-40, 30, AFLOAT, 0, 0, 0]}
BUOY = {"name": "buoy", "model": "robotx_light_buoy", "pose": [30, 20, 0.5, 0, 0, 0]}
TOUCHED = [BUOY, {"name": "post", "model": "post", "pose": [-37.6, 30, 0.3, 0, 0, 0]}]


def motion(others, *, engines, objects=(), before=False, steps=600):
    """The first boat's poses and velocities, and how many steps had contacts."""
    entries = [*others, FIRST] if before else [FIRST, *others]
    sim = simulation({"boats": entries, "thrusters": "T", "engines": engines}, objects=list(objects))
    for boat in sim.boats:
        sim.command(boat, **AHEAD, left_angle=0.5)
    rows, touched = [], 0
    for _ in range(steps):
        if sim.time % 1.0 < 0.005:
            for boat in sim.boats:
                sim.command(boat, **AHEAD)
        sim.advance(1)
        seen = sim.observe()["first"]
        rows.append([*seen.position, *seen.quaternion, *seen.velocity, *seen.angular_velocity])
        touched += sim.data.ncon > 0
    return np.array(rows), touched


@pytest.fixture(scope="module")
def alone():
    return {engines: motion([], engines=engines)[0] for engines in ("fixed", "hinged")}


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
@pytest.mark.parametrize("before", [False, True], ids=["after", "before"])
@pytest.mark.parametrize(
    ("others", "objects", "touch"),
    [([FAR], [], False), (COLLIDING, [], True), ([AGROUND], TOUCHED, True), ([FAR, *COLLIDING], [BUOY], True)],
    ids=["a far boat", "a collision", "a boat against a post", "all of them"],
)
def test_others_do_not_change_a_boats_motion(alone, engines, before, others, objects, touch):
    rows, touched = motion(others, engines=engines, objects=objects, before=before)
    assert bool(touched) == touch
    assert same_bits(rows, alone[engines])


def forced(sim):
    """Make a simulation step with all its shapes, always."""
    sim._live.arrays.broadphase["wait"] = np.iinfo(np.int64).max
    return sim


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
@pytest.mark.parametrize(
    "fleet",
    [boats((0.0, 0.0, 0.3)), boats((0.0, 0.0, 0.0), (14.0, 0.9, 3.1)), boats((0.0, 0.0, 0.0), (3.0, 4.0, 0.0))],
    ids=["alone", "meeting", "beside each other"],
)
def test_a_step_without_shapes_is_the_step_with_them(engines, fleet):
    fleet = {**fleet, "engines": engines}
    quick, full = simulation(fleet, objects=[BUOY]), forced(simulation(fleet, objects=[BUOY]))
    for boat, sim in itertools.product(quick.boats, (quick, full)):
        sim.command(boat, **AHEAD)
    for _ in range(120):
        for sim in (quick, full):
            sim.step(dict.fromkeys(sim.boats, AHEAD), duration=0.05)
        assert same_bits(quick.data.qpos, full.data.qpos)
        assert same_bits(quick.data.qvel, full.data.qvel)
    assert quick.get_state().sha256 == full.get_state().sha256


def test_a_boat_that_is_alone_never_steps_with_shapes():
    sim = simulation()
    sim.step({"a": AHEAD}, duration=20.0)
    assert sim._live.arrays.broadphase["wait"][0] == 0
    assert 0.0 < sim._live.arrays.broadphase["clearance"][0] <= proximity.MAX_DISTANCE


def test_a_boat_that_is_put_beside_another_is_seen_at_once():
    sim = simulation(boats((0.0, 0.0, 0.0), (100.0, 0.0, 0.0)))
    sim.advance(10)
    sim.set_boat("b", pose=(0.0, 1.5, AFLOAT, 0, 0, 0))
    sim.advance(1)
    assert sim.data.ncon > 0


def test_boats_of_one_kind_do_the_same_in_a_flat_sea():
    """Index and name of a boat are no part of its motion; its coordinates are, by rounding."""
    fleet = boats(*((0.0, 50.0 * k, 0.0) for k in range(4)))
    sim = simulation(fleet, sea={"model": "none"})
    sim.step(dict.fromkeys(sim.boats, AHEAD), duration=10.0)
    seen = list(sim.observe().values())
    for boat in seen[1:]:
        assert boat.quaternion == pytest.approx(seen[0].quaternion, abs=1e-9)
        assert boat.velocity == pytest.approx(seen[0].velocity, abs=1e-9)


def test_commands_of_one_boat_are_not_anothers():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean", fleet="trio"))
    sim.step({"wamv2": AHEAD}, duration=2.0)
    speeds = {name: boat.speed for name, boat in sim.observe().items()}
    assert speeds["wamv2"] > 1.0 > 10.0 * max(speeds["wamv1"], speeds["wamv3"])
