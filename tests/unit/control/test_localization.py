"""A boat that finds itself: against the truth, and its covariances against its errors."""

import numpy as np
import pytest
from scipy.stats import chi2

import vrx_mj
from vrx_mj.control.navigation import Localizer, truly_located
from vrx_mj.frames import matrix_quaternion, rotation_vector

THRUST = {"left": 0.8, "right": 0.3}
SEEDS = 100


def world(*, errors="none", heading=0.0, **physics):
    """A WAM-V with a GPS and an inertial unit on open water, and waves of VRX."""
    place = {"latitude": -33.7, "longitude": 150.7, "elevation": 0.0, "heading": heading}
    robot = {"arguments": {"sensor_errors": errors}} if errors != "none" else {}
    return vrx_mj.compile_world(
        {"extends": "ocean", "physics": {"profile": "vrx", **physics}, "georeference": place},
        fleet={"usv_count": 1, "sensors": ["gps", "imu"], **robot},
    )


def localizer(sim):
    found, parameters = {one.config.type: one for one in sim.mounted(sim.boats[0])}, sim.world.parameters
    antenna = np.zeros(3) if "gps" in parameters.at_base_link else found["gps"].mount.position
    return Localizer(found["gps"], found["imu"], parameters.georeference, antenna)


def sail(sim, find, seconds):
    """What the localizer finds after some time, and the truth."""
    boat, until = sim.boats[0], sim.time + seconds
    while sim.time < until - 1e-6:
        seen = sim.step({boat: THRUST}, duration=0.03)[boat]
        found = find(seen, sim.time)
    return found, truly_located(seen)


def misses(found, true):
    """Errors of position, orientation, velocity and spin, (3,) each."""
    turn = rotation_vector(matrix_quaternion(found.rotation @ true.rotation.T))
    return found.position - true.position, turn, found.velocity - true.velocity, found.spin - true.spin


def parts(found):
    """Their covariances, (3, 3) each."""
    both = (found.pose_covariance, found.twist_covariance)
    return [one[part, part] for one in both for part in (slice(3), slice(3, 6))]


@pytest.mark.parametrize("heading", [0.0, 25.0])
@pytest.mark.parametrize("physics", [{}, {"at_base_link": ["gps", "imu"]}, {"profile": "marine"}])
def test_sensors_without_errors_find_the_boat(physics, heading):
    sim = vrx_mj.Simulation(world(heading=heading, **physics))
    found, true = sail(sim, localizer(sim), 6.0)
    bounds = (2e-3, 2e-3, 0.05, 0.1)
    assert all(np.abs(miss).max() < bound for miss, bound in zip(misses(found, true), bounds, strict=True))
    assert all(np.linalg.eigvalsh(one).min() > 0.0 for one in parts(found))


def test_a_boat_that_is_moved_is_found_at_its_next_readings():
    sim = vrx_mj.Simulation(world(errors="rtk"))
    find = localizer(sim)
    before, _ = sail(sim, find, 2.0)
    sim.set_boat("wamv1", pose=(40.0, 30.0, 0.0, 0.0, 0.0, 1.0))
    found, true = sail(sim, find, 0.15)  # the first rate after the move is that of the jump
    assert np.linalg.norm(before.position - true.position) > 20.0
    assert np.linalg.norm(found.position - true.position) < 0.2


def test_after_a_time_without_looking_it_begins_anew():
    sim = vrx_mj.Simulation(world(errors="rtk"))
    find = localizer(sim)
    sail(sim, find, 1.0)
    sim.step({"wamv1": THRUST}, duration=30.0)
    found, true = sail(sim, find, 0.03)
    assert np.linalg.norm(found.position - true.position) < 0.2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("errors", "profile"),
    [
        ("rtk", "vrx"),
        ("standalone", "marine"),
        pytest.param("rtk", "marine", marks=pytest.mark.nightly),
        pytest.param("standalone", "vrx", marks=pytest.mark.nightly),
    ],
)
def test_covariances_are_those_of_the_errors_of_a_hundred_runs(errors, profile):
    """The errors' squares over their covariances (NEES) are within 99 % of their chi-squared law.

    Those of velocity and spin are not above it: what they do after a reading is bounded, not known.
    """
    sim, moments, found = vrx_mj.Simulation(world(errors=errors, profile=profile)), np.random.default_rng(3), []
    for seed in range(SEEDS):
        sim.reset(seed=seed)
        located, true = sail(sim, localizer(sim), moments.uniform(4.0, 8.0))
        squares = [
            miss @ np.linalg.solve(one, miss) for miss, one in zip(misses(located, true), parts(located), strict=True)
        ]
        found.append(squares)
    total = np.sum(found, axis=0)
    low, high = chi2.ppf((0.005, 0.995), 3 * SEEDS)
    assert total.max() < high, total / SEEDS
    assert total[:2].min() > low, total / SEEDS
    assert total[2:].min() > 0.01 * low, total / SEEDS
