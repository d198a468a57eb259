"""A boat that finds itself: against the truth, and its covariances against its errors."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

import vrx_mj
from vrx_mj.config.sensors import ErrorModel, GpsConfig, ImuConfig
from vrx_mj.control.navigation import Localizer, true_odometry
from vrx_mj.frames import matrix_quaternion, rotation_vector
from vrx_mj.model.things import Georeference
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.sensors.readings import Mount

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
    return found, true_odometry(seen)


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


ACCELERATION, SPIN_UP, INTERVAL, READINGS = 0.8, 0.4, 0.1, 20
GPS_NOISE, GPS_DRIFT, GPS_VELOCITY = (0.5, 0.4, 0.9), (0.3, 0.2, 0.6), (0.1, 0.2, 0.3)


def shaken(offsets=(0.0,), gap=0.5):
    """A localizer that has felt a boat, heading north, shake along x and roll, and has fixes so far off; what it sees.

    The boat is at rest at each fix, and its attitude is known.
    """
    earth = Georeference(latitude=-33.7, longitude=150.7, elevation=0.0, heading=0.0)
    config = GpsConfig(
        name="gps", link="l", position=ErrorModel(noise=GPS_NOISE, drift=GPS_DRIFT),
        velocity=ErrorModel(noise=GPS_VELOCITY),
    )  # fmt: skip
    unit = Mounted(
        "b",
        0,
        ImuConfig(name="imu", link="l", rate=1.0 / INTERVAL),
        "",
        Mount.of((0, 0, 0), np.eye(3)),
        "",
        0,
        0,
        0,
        None,
    )
    find, boat = Localizer(replace(unit, config=config), unit, earth, np.zeros(3)), SimpleNamespace(sensors={})
    north, none = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]), np.zeros(9)

    def measure(time, spin, fix, offset):
        latitude, longitude, altitude = earth.to_geodetic(offset, 0.0, 0.0)
        data = SimpleNamespace(latitude=latitude, longitude=longitude, altitude=altitude, velocity=np.zeros(3))
        inertia = SimpleNamespace(
            orientation=north, angular_velocity=np.array([spin, 0.0, 0.0]), orientation_covariance=none,
            linear_acceleration=np.array([0.0, -ACCELERATION, 9.80665]), angular_velocity_covariance=none,
        )  # fmt: skip
        boat.sensors = {"gps": SimpleNamespace(data=data, time=fix), "imu": SimpleNamespace(data=inertia, time=time)}
        return find(boat, time)

    for number in range(READINGS + 1):
        measure(INTERVAL * number, SPIN_UP * INTERVAL * (number - READINGS), INTERVAL * READINGS, offsets[0])
    time = INTERVAL * READINGS
    found = [find(boat, time)]
    for offset in offsets[1:]:
        time += gap
        found.append(measure(time, 0.0, time, offset))
    return find, boat, time, found


def test_covariances_grow_by_the_accelerations_that_were_felt():
    """Closed form: twentieths of each square enter a mean that begins with 0.3 along and about every axis."""
    find, boat, time, _ = shaken()
    age, kept = 0.2, 0.95**READINGS
    along, about = (
        kept * 0.09 + (1.0 - kept) * np.array([felt**2, 0.0, 0.0]) for felt in (ACCELERATION, SPIN_UP)
    )  # in the world's axes, and in the body's: it heads north
    velocity, swing = np.square(GPS_VELOCITY) + age**2 * along, (age + 0.5 * INTERVAL) ** 2 * about
    place = np.square(GPS_NOISE) + np.square(GPS_DRIFT) + age**2 * velocity
    expected = [place, age**2 * swing[[1, 0, 2]], velocity[[1, 0, 2]], swing]
    for own, wanted in zip(parts(find(boat, time + age)), expected, strict=True):
        np.testing.assert_allclose(own, np.diag(wanted), atol=1e-7)


@pytest.mark.parametrize(("gap", "followed"), [(0.5, True), (1.0, True), (1.01, False)])
def test_a_fix_corrects_by_the_variances_of_both_up_to_five_deviations_and_a_second(gap, followed):
    """A Kalman filter of one number: along x, of what is carried on and of a new fix."""
    felt = (1.0 - 0.95**READINGS) * ACCELERATION**2 + 0.95**READINGS * 0.09
    noise, drift, velocity = (one[0] ** 2 for one in (GPS_NOISE, GPS_DRIFT, GPS_VELOCITY))
    jolts = 0.95 * felt + 0.05 * ACCELERATION**2 if followed else felt
    before = noise + gap**2 * velocity + 0.25 * gap**4 * jolts
    reach = 5.0 * np.sqrt(before + noise + drift)
    weight = before / (before + noise) if followed else 1.0
    for share, taken in ((0.99, weight), (1.01, 1.0)):
        *_, (_, found) = shaken((0.0, share * reach), gap)
        assert found.position[0] == pytest.approx(taken * share * reach, rel=1e-6)
        assert found.pose_covariance[0, 0] == pytest.approx(taken * noise + drift, rel=1e-6)


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
