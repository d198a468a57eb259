"""Sensors on boats that sail: physics seen through them, and the same bits whenever they are read."""

import hashlib
import math
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from integration.sailing import AFLOAT, AHEAD, CALM, ROUGH, boats, same_bits
from integration.sensing import COMPASS, GPS, IMU, P3D, PINGER, QUIET_PINGER, SONAR, SUITE, WIND, sailing
from vrx_mj.config.sensors import ErrorModel
from vrx_mj.config.world import Georeference
from vrx_mj.frames import rotation_matrix
from vrx_mj.model.world import tree_of
from vrx_mj.sensors import SENSOR_KINDS

ONE = boats((0.0, 0.0, 0.3))
TWO = boats((0.0, 0.0, 0.3), (60.0, 0.0, 0.0))
NOISE = ErrorModel(noise=(0.5, 0.5, 0.5), drift=(0.2, 0.2, 0.2))
NOISY = (
    GPS.model_copy(update={"position": NOISE, "velocity": NOISE}),
    IMU.model_copy(update={"acceleration": NOISE, "angular_velocity": NOISE, "heading": NOISE}),
    P3D.model_copy(update={"noise": 0.1}),
    PINGER,
    WIND,
    COMPASS,
    SONAR,
)
NAMES = tuple(config.name for config in NOISY)


def bits(reading):
    """A reading as bytes."""
    return pickle.dumps((reading.time, reading.sequence, reading.frame, vars(reading.data)))


def log(sim, steps, names=NAMES, every=1, boat="a"):
    """Readings of a boat under way, as bytes: all of them, `steps` steps long."""
    kept = []
    for _ in range(0, steps, every):
        sim.command(boat, **AHEAD)
        sim.advance(every)
        kept += [bits(sim.sense(boat)[name]) for name in names]
    return kept


@pytest.fixture(scope="module")
def sim():
    return sailing(NOISY)


@pytest.fixture(autouse=True)
def _at_the_start(sim):
    sim.reset(5)


def test_afloat_at_rest_an_imu_feels_gravity_alone():
    sim = sailing((IMU,), sea=CALM, wind=None)
    sim.advance(20_000)
    sim.sense("a")["imu"]
    sim.advance(100)
    found = sim.sense("a")["imu"].data
    assert rotation_matrix(found.orientation) @ found.linear_acceleration == pytest.approx((0, 0, 9.8), abs=1e-5)
    assert found.angular_velocity == pytest.approx((0, 0, 0), abs=1e-5)


def test_a_boat_that_turns_steadily_feels_the_centripetal_acceleration():
    """In the horizontal plane it is u r, across the way to port; 1 % for what is left of the spin-up."""
    sim = sailing((IMU, P3D), sea=CALM, wind=None)
    sim.step({"a": {"left": 0.6, "right": 1.0}}, duration=60.0)
    sim.sense("a")["imu"]
    sim.step({"a": {"left": 0.6, "right": 1.0}}, duration=1.0)
    inertia, truth = sim.sense("a")["imu"].data, sim.sense("a")["p3d"].data
    turn, speed = truth.angular_velocity[2], np.hypot(*truth.velocity[:2])
    assert turn > 0.05
    felt = rotation_matrix(inertia.orientation) @ inertia.linear_acceleration
    to_port = np.array([-truth.velocity[1], truth.velocity[0]]) / speed
    assert felt[:2] @ to_port == pytest.approx(speed * turn, rel=0.01)
    assert np.linalg.norm(felt[:2]) == pytest.approx(speed * turn, rel=0.01)
    assert inertia.angular_velocity[2] == pytest.approx(turn, rel=0.01)


def test_gps_and_truth_agree():
    sim = sailing((GPS, P3D), physics={"at_base_link": []}, fleet=boats((100.0, -50.0, 1.0)))
    earth = Georeference(**tree_of(sim.world.parameters)["georeference"])
    sim.sense("a")["gps"], sim.sense("a")["p3d"]
    sim.step({"a": AHEAD}, duration=10.0)
    fix, truth = sim.sense("a")["gps"].data, sim.sense("a")["p3d"].data
    w, x, y, z = truth.orientation
    forward = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    up = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    lever = -0.85 * forward + 1.3 * up
    assert earth.to_enu(fix.latitude, fix.longitude, fix.altitude) == pytest.approx(truth.position + lever, abs=1e-6)
    east, north, rise = truth.velocity + np.cross(truth.angular_velocity, lever)
    assert fix.velocity == pytest.approx((north, -east, rise), abs=1e-9)


@pytest.mark.filterwarnings("ignore:.*has the waves of deep water")
def test_wind_heading_and_depth_are_those_of_the_truth_in_gusts_and_waves():
    """Without noise, from pose and twist of the boat's origin: the wind at the mast, its heading, a slanting beam."""
    quiet = WIND.model_copy(update={"noise": 0.0}), SONAR.model_copy(update={"noise": 0.0})
    compass = COMPASS.model_copy(update={"heading_noise": 0.0, "turn_noise": 0.0})
    gusts = {"direction": 120, "mean_velocity": 6.0, "spectrum": "npd", "height": 10, "exponent": 0.12}
    marine = {"physics": {"profile": "marine"}, "profile": "marine"}
    sim = sailing((*quiet, compass, P3D), sea={**ROUGH, "depth": 5.0}, wind=gusts, seed=3, **marine)
    dict(sim.sense("a"))
    sim.step({"a": {"left": 1.0, "right": 0.3}}, duration=20.0)
    wind, sonar, bow, truth = (sim.sense("a")[name] for name in ("wind", "echo", "compass", "p3d"))
    turned, spin = rotation_matrix(truth.data.orientation), truth.data.angular_velocity
    assert np.linalg.norm(spin) > 0.02  # the lever counts

    mast = turned @ WIND.pose[:3]
    air = sim.wind.velocity(truth.time, truth.data.position[2] + mast[2])
    ahead, port, _ = turned.T @ (truth.data.velocity + np.cross(spin, mast) - air)
    assert (wind.data.speed, wind.data.angle) == pytest.approx((np.hypot(ahead, port), np.arctan2(port, ahead)))

    place = truth.data.position + turned @ SONAR.pose[:3]
    assert sonar.data.range == pytest.approx((place[2] + 5.0) / turned[2, 2], abs=1e-9)
    assert bow.data.heading == pytest.approx(np.arctan2(turned[1, 0], turned[0, 0]))
    assert wind.time == sonar.time == bow.time == truth.time == pytest.approx(20.0)


@pytest.mark.filterwarnings("ignore:.*has the waves of deep water")
def test_a_depth_changes_nothing_of_how_boats_sail_in_vrxs_waves():
    deep, shallow = (sailing((SONAR,), sea={**ROUGH, **depth}, seed=3) for depth in ({}, {"depth": 3.0}))
    for sim in (deep, shallow):
        sim.step({"a": AHEAD}, duration=3.0)
    assert deep.get_state().sha256 == shallow.get_state().sha256
    assert deep.sense("a")["echo"].data.range == math.inf
    assert shallow.sense("a")["echo"].data.range == pytest.approx(2.8, abs=0.5)


def test_the_truth_is_what_is_observed(sim):
    quiet = sailing((P3D,))
    quiet.step({"a": AHEAD}, duration=3.0)
    truth, seen = quiet.sense("a")["p3d"].data, quiet.observe()["a"]
    assert truth.position == pytest.approx(seen.position, abs=1e-12)
    assert truth.orientation == pytest.approx(seen.quaternion, abs=1e-12)
    assert np.linalg.norm(truth.velocity) == pytest.approx(np.linalg.norm(seen.velocity))


def test_every_sensor_has_its_rate(sim):
    sequences = {name: [sim.sense("a")[name].sequence] for name in NAMES}
    for _ in range(1000):
        sim.advance(1)
        for name in NAMES:
            number = sim.sense("a")[name].sequence
            if number != sequences[name][-1]:
                sequences[name].append(number)
    rates = {"gps": 15, "imu": 15, "p3d": 10, "pinger": 1, "wind": 10, "compass": 10, "echo": 10}
    assert {name: numbers[1:] for name, numbers in sequences.items()} == {
        name: list(range(1, 10 * rate + 1)) for name, rate in rates.items()
    }


def test_reading_now_and_then_gives_what_reading_always_gives(sim):
    dict(sim.sense("a"))
    often = log(sim, 200)
    sim.reset(5)
    dict(sim.sense("a"))
    seldom = log(sim, 200, every=40)
    assert seldom == [reading for k in (39, 79, 119, 159, 199) for reading in often[len(NAMES) * k :][: len(NAMES)]]


def test_a_reading_does_not_depend_on_when_it_is_requested():
    """Nor on what was commanded since its moment; also of sensors that have no other test here."""
    known = {config.type: config.model_copy(update={"rate": 10.0}) for config in NOISY}
    made = {name: kind.config for name, kind in SENSOR_KINDS.items() if kind.numbers is not None}
    sensors = [known.get(name) or config(name=name, link="mast", rate=10.0) for name, config in made.items()]
    early, late = (sailing(sensors, fleet=TWO, seed=5) for _ in range(2))
    for sim in (early, late):
        dict(sim.sense("a"))
        for boat in sim.boats:
            sim.command(boat, **AHEAD)
        sim.advance(100)
    expected = {name: bits(reading) for name, reading in early.sense("a").items()}
    for boat in late.boats:
        late.command(boat, **dict.fromkeys(AHEAD, -1.0))
    late.advance(8)
    assert {name: bits(reading) for name, reading in late.sense("a").items()} == expected
    assert len(expected) == len(sensors) >= 7


def test_the_same_seed_gives_the_same_bits(sim):
    one = log(sim, 150)
    sim.reset(5)
    assert log(sim, 150) == one
    assert log(sailing(NOISY, seed=5), 150) == one
    sim.reset(6)
    assert log(sim, 150) != one


@pytest.mark.parametrize("steps", [33, 50])
def test_a_saved_state_goes_on_with_the_same_readings(sim, steps):
    """Also from the middle of a period, and where no sample is due."""
    log(sim, steps)
    state = sim.get_state()
    expected = log(sim, 60)
    sim.set_state(state)
    assert log(sim, 60) == expected
    twin = sailing(NOISY)
    twin.set_state(state)
    assert [bits(twin.sense("a")[name]) for name in NAMES] == [bits_at(sim, state, name) for name in NAMES]


def bits_at(sim, state, name):
    sim.set_state(state)
    return bits(sim.sense("a")[name])


ELSEWHERE = """
import sys; sys.path.insert(0, sys.argv[1])
import hashlib, vrx_mj
from integration.test_sensors import log
sim = vrx_mj.Simulation.load(sys.argv[2])
sim.set_state(vrx_mj.State.load(sys.argv[3]))
print(hashlib.sha256(b"".join(log(sim, 60))).hexdigest())
"""


@pytest.mark.slow
def test_another_process_goes_on_with_the_same_readings(sim, tmp_path):
    log(sim, 47)
    sim.world.save(tmp_path / "world")
    sim.get_state().save(tmp_path / "now.state")
    expected = hashlib.sha256(b"".join(log(sim, 60))).hexdigest()
    command = [
        sys.executable,
        "-c",
        ELSEWHERE,
        str(Path(__file__).parents[1]),
        tmp_path / "world",
        tmp_path / "now.state",
    ]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=True)
    assert done.stdout.strip() == expected


def test_sensing_moves_nothing(sim):
    log(sim, 300)
    watched = sim.data.qpos.copy(), sim.data.qvel.copy()
    sim.reset(5)
    log(sim, 300, names=())
    assert same_bits(watched[0], sim.data.qpos)
    assert same_bits(watched[1], sim.data.qvel)


def test_other_boats_and_sensors_change_no_reading(sim):
    dict(sim.sense("a"))
    alone = log(sim, 150)
    both = sailing({"a": (P3D.model_copy(update={"name": "more"}), *NOISY), "b": NOISY}, fleet=TWO, seed=5)
    for name in both.sensors("b"):
        both.sense("b")[name]
    assert log(both, 150) == alone


def test_two_boats_have_noise_of_their_own():
    sim = sailing({"a": NOISY, "b": NOISY}, fleet=TWO, sea=CALM, wind=None)
    one, other = (sim.sense(boat)["imu"].data.linear_acceleration for boat in "ab")
    assert np.abs(one - other).min() > 1e-3


def test_readings_follow_a_boat_that_is_put_elsewhere(sim):
    quiet = sailing((P3D, GPS))
    quiet.advance(20)
    before = quiet.sense("a")["p3d"]
    quiet.set_boat("a", pose=(50.0, 60.0, AFLOAT, 0.0, 0.0, 1.0))
    after = quiet.sense("a")["p3d"]
    assert (before.time, before.sequence) == (after.time, after.sequence)
    assert after.data.position == pytest.approx((50.0, 60.0, AFLOAT))
    quiet.advance(5)
    quiet.set_boat("a", pose=(0.0, 0.0, AFLOAT, 0.0, 0.0, 1.0))
    assert quiet.sense("a")["p3d"].data.position == pytest.approx((50.0, 60.0, AFLOAT))


def test_a_beacon_is_at_the_origin_until_it_is_set():
    sim = sailing((QUIET_PINGER,), fleet=boats((30.0, 40.0, 0.0)), sea=CALM, wind=None)
    assert sim.sense("a")["pinger"].data.range == pytest.approx(math.hypot(50.0, AFLOAT), abs=1e-5)
    sim.set_pinger("a", "pinger", (30.0, 140.0, AFLOAT))
    expected = {"range": 100.0, "bearing": math.pi / 2, "elevation": 0.0}
    assert vars(sim.sense("a")["pinger"].data) == pytest.approx(expected, abs=1e-6)


def test_a_beacon_that_moves_is_heard_at_the_next_ping():
    sim = sailing((QUIET_PINGER,), sea=CALM, wind=None)
    sim.sense("a")["pinger"]
    sim.advance(50)
    sim.set_pinger("a", "pinger", (0.0, 0.0, 80.0))
    assert sim.sense("a")["pinger"].data.range == pytest.approx(-AFLOAT, abs=1e-5)
    state = sim.get_state()
    sim.advance(50)
    assert sim.sense("a")["pinger"].data.range == pytest.approx(80.0, abs=1.0)
    sim.reset()
    assert sim.sense("a")["pinger"].data.range == pytest.approx(-AFLOAT, abs=1e-5)
    sim.set_state(state)
    sim.advance(50)
    assert sim.sense("a")["pinger"].data.range == pytest.approx(80.0, abs=1.0)


def test_a_run_with_the_whole_suite_and_no_noise_is_what_it_was():
    """The defaults are VRX's: only the pinger has noise."""
    sim = sailing(SUITE)
    assert sim.sense("a")["imu"].data.linear_acceleration == pytest.approx((0.0, 0.0, 9.8))
    assert sim.sense("a")["pinger"].data.range != pytest.approx(-AFLOAT)
