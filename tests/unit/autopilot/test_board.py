"""Signs of what a board measures, in closed form: axes forward-right-down in a world north-east-down."""

from math import cos, pi, radians, sin, sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from integration.sensing import SONAR, WIND, sailing
from vrx_mj import Simulation, compile_world
from vrx_mj.autopilot.ardupilot import answer
from vrx_mj.autopilot.board import Board
from vrx_mj.frames import quaternion, quaternion_product, rotation, rotation_matrix
from vrx_mj.runtime.observation import BoatObservation

G, DT = 9.81, 0.02
HEEL = radians(20.0)
NORTH = pi / 2
"""Yaw of a bow to the north, counter-clockwise from east."""


def moved(*, position=(0, 0, 0), roll=0.0, pitch=0.0, yaw=NORTH, velocity=(0, 0, 0), spin=(0, 0, 0), time=0.0):
    """A boat at a pose, east-north-up and forward-left-up, with velocities along its own axes."""
    as_array = [np.array(each, float) for each in (position, quaternion(roll, pitch, yaw), velocity, spin)]
    return time, BoatObservation(*as_array)


def measured(*moments, mounted=(0.0, 0.0, 0.0), wind=(0.0, 0.0, 0.0), x_from_east=0.0):
    """What a board measures at the last of some moments."""
    boats = [SimpleNamespace(name="a", battery=None)]
    parameters = SimpleNamespace(x_from_east=x_from_east, sea=SimpleNamespace(level=0.0), boats=boats)
    sim = SimpleNamespace(
        model=SimpleNamespace(opt=SimpleNamespace(gravity=(0.0, 0.0, -G))),
        world=SimpleNamespace(parameters=parameters),
        wind=SimpleNamespace(velocity=lambda _t, _z: np.array(wind)),
        mounted=lambda _boat: [],
    )
    board = Board(sim, "a", mounted)
    for time, seen in moments:
        sim.time, sim.observe = time, lambda seen=seen: {"a": seen}
        found = board.measure()
    return found


def force(*moments, **more):
    return pytest.approx(measured(*moments, **more)["imu"]["accel_body"], abs=1e-9)


def about(axis, angle):
    """Quaternion (w, x, y, z) of a turn about one of the axes north, east, down."""
    return [cos(angle / 2), *(sin(angle / 2) * (axis == each) for each in range(3))]


def attitude(**pose):
    """The quaternion of a pose, with w not negative."""
    found = np.array(measured(moved(**pose))["quaternion"])
    return pytest.approx(found * np.sign(found[np.argmax(np.abs(found) > 1e-9)]), abs=1e-9)


def test_held_still_it_feels_what_holds_it_up():
    assert force(moved()) == [0.0, 0.0, -G]


def test_heeled_to_starboard_it_feels_to_port_and_rolls_positively():
    assert force(moved(roll=HEEL)) == [0.0, -G * sin(HEEL), -G * cos(HEEL)]
    assert attitude(roll=HEEL) == about(0, HEEL)


def test_with_the_bow_up_it_feels_ahead_and_pitches_positively():
    assert force(moved(pitch=-HEEL)) == [G * sin(HEEL), 0.0, -G * cos(HEEL)]
    assert attitude(pitch=-HEEL) == about(1, HEEL)


def test_a_bow_to_the_east_is_a_yaw_of_90_degrees():
    assert attitude(yaw=0.0) == about(2, pi / 2)
    assert attitude(yaw=NORTH + 0.3) == [cos(0.15), 0.0, 0.0, -sin(0.15)]


@pytest.mark.parametrize(("change", "felt"), [((1, 0, 0), (1, 0, 0)), ((0, 1, 0), (0, -1, 0)), ((0, 0, 1), (0, 0, -1))])
def test_accelerated_ahead_to_port_or_up(change, felt):
    begin, end = (moved(time=t, velocity=np.array(change) * t, yaw=1.1) for t in (0.0, DT))
    assert force(begin, end) == [felt[0], felt[1], felt[2] - G]


@pytest.mark.parametrize(("axis", "rates"), [("roll", (0.5, 0, 0)), ("pitch", (0, -0.5, 0)), ("yaw", (0, 0, -0.5))])
def test_turned_to_starboard_bow_down_or_to_port(axis, rates):
    """Roll is positive to starboard in both frames, pitch and yaw change their signs."""
    begin, end = (moved(time=t, **{axis: 0.5 * t + (NORTH if axis == "yaw" else 0.0)}) for t in (0.0, DT))
    assert measured(begin, end)["imu"]["gyro"] == pytest.approx(rates, abs=1e-9)
    spin = {"roll": (0.5, 0, 0), "pitch": (0, 0.5, 0), "yaw": (0, 0, 0.5)}[axis]
    assert measured(moved(spin=spin))["imu"]["gyro"] == pytest.approx(rates, abs=1e-12)


@pytest.mark.parametrize(("arm", "pull"), [((2.0, 0.0, 0.0), (-1, 0, 0)), ((0.0, 2.0, 0.0), (0, 1, 0))])
def test_on_a_lever_arm_a_turn_pulls_to_its_middle(arm, pull):
    """An arm ahead is pulled astern, one to port to starboard: w^2 r, to the second order of the interval."""
    rate, dt = 0.8, 1e-4
    begin, end = (moved(time=t, yaw=rate * t, spin=(0, 0, rate)) for t in (0.0, dt))
    found = measured(begin, end, mounted=arm)
    assert found["imu"]["accel_body"] == pytest.approx([pull[0] * rate**2 * 2.0, pull[1] * rate**2 * 2.0, -G], abs=2e-4)
    swept = [1.6, 0.0, 0.0] if arm[0] else [0.0, -1.6, 0.0]  # the bow is to the east
    assert found["velocity"] == pytest.approx(swept, abs=1e-3)


def test_places_and_velocities_are_north_east_down():
    found = measured(moved(position=(3, 5, 7), velocity=(2, 0, 0), yaw=0.0))
    assert found["position"] == [5.0, 3.0, -7.0]
    assert found["velocity"] == pytest.approx([0.0, 2.0, 0.0], abs=1e-12)


def test_in_a_turned_world_north_is_that_of_the_earth():
    """The world's x axis points 90 degrees from east, to the north: so does a boat with yaw 0."""
    found = measured(moved(position=(3, 5, 0), velocity=(2, 0, 0), yaw=0.0), x_from_east=NORTH)
    assert found["position"] == pytest.approx([3.0, -5.0, 0.0], abs=1e-12)
    assert found["velocity"] == pytest.approx([2.0, 0.0, 0.0], abs=1e-12)
    assert np.abs(found["quaternion"]) == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ("blows", "direction"), [((0, -4, 0), 0.0), ((-4, 0, 0), pi / 2), ((4, 0, 0), -pi / 2), ((0, 4, 0), pi)]
)
def test_the_wind_vane_points_to_where_the_apparent_wind_comes_from(blows, direction):
    """The bow is to the north: wind from there is ahead, from the east to starboard."""
    found = measured(moved(), wind=blows)["windvane"]
    assert cos(found["direction"] - direction) == pytest.approx(1.0)
    assert found["speed"] == pytest.approx(4.0)


def test_a_boats_own_way_makes_wind_from_ahead():
    found = measured(moved(velocity=(3, 0, 0)), wind=(4.0, 0.0, 0.0))["windvane"]  # a beam wind to starboard
    assert (found["speed"], found["direction"]) == pytest.approx((5.0, -np.arctan2(4.0, 3.0)))


def test_echo_sounders_are_its_range_finders_in_their_order():
    """Six of them at most; what hears no echo is beyond its range, and none is a boat without."""
    down = [SONAR.model_copy(update={"name": f"sonar{number}", "noise": 0.0}) for number in range(7)]
    down[1] = down[1].model_copy(update={"pose": (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), "range": (0.3, 40.0)})
    down[2] = down[2].model_copy(update={"pose": (0.0, 0.0, -0.6, 0.0, pi / 2, 0.0)})
    sim = sailing((WIND, *down), sea={"model": "none", "depth": 6.0}, wind=None)
    found = Board(sim, "a").measure()
    depth = 6.0 + sim.observe()["a"].position[2]
    expected = [depth - 0.1, 80.0, depth - 0.6, *[depth - 0.1] * 3]
    assert [found[f"rng_{number}"] for number in range(1, 7)] == pytest.approx(expected)
    assert "rng_7" not in found
    assert f'"rng_2":80.0,"rng_3":{found["rng_3"]},' in answer(found).decode()
    assert not [key for key in measured(moved()) if key.startswith("rng")]


def test_its_wind_vane_is_an_anemometer_without_noise():
    quiet = WIND.model_copy(update={"noise": 0.0})
    sim = sailing((quiet,), profile="marine", seed=3)
    board = Board(sim, "a", quiet.pose[:3])
    sim.sense("a")["wind"]
    sim.step({"a": {"left": 1.0, "right": 0.2}}, duration=2.0)
    vane, wind = board.measure()["windvane"], sim.sense("a")["wind"].data
    assert (vane["speed"], vane["direction"]) == pytest.approx((wind.speed, -wind.angle), abs=1e-9)


def test_who_integrates_it_sails_along():
    """A strapdown integration of rates and specific forces gives attitude, velocity and place of a run in waves."""
    sea = {"model": "jonswap", "significant_height": 0.4, "peak_period": 3.0}
    fleet = {"boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]}
    world = compile_world({"physics": {"profile": "marine"}, "sea": sea}, fleet=fleet)
    sim = Simulation(world)
    down = -sim.model.opt.gravity
    board = Board(sim, "a", (1.0, 0.5, 0.8))
    first = board.measure()
    turn, velocity = np.array(first["quaternion"]), np.array(first["velocity"])
    for _ in range(100):
        sim.step({"a": {"left": 0.9, "right": 0.3}}, duration=DT)
        now = board.measure()
        half = 0.5 * DT * np.array(now["imu"]["gyro"])
        size = sqrt(half @ half)
        turn = quaternion_product(turn, np.array([cos(size), *(sin(size) / size * half)]))
        velocity = velocity + DT * (rotation_matrix(turn) @ now["imu"]["accel_body"] + down)
    assert abs(turn @ now["quaternion"]) == pytest.approx(1.0, abs=1e-12)
    assert velocity == pytest.approx(now["velocity"], abs=1e-9)


def test_the_attitude_is_that_of_the_matrix_of_aircraft():
    """A second way to it: rows of the rotation, turned one by one."""
    pose = {"roll": 0.2, "pitch": -0.3, "yaw": 0.5}
    east_north_up = np.array(rotation(**pose))
    expected = east_north_up[[1, 0, 2]] * [[1], [1], [-1]] * [1, -1, -1]
    assert rotation_matrix(measured(moved(**pose))["quaternion"]) == pytest.approx(expected, abs=1e-12)
