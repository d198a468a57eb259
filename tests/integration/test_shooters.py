"""Ball shooters: where balls fly, how many there are, and that those that wait are no burden."""

import math

import numpy as np
import pytest

import vrx_mj
from integration.sailing import AFLOAT, CALM, GUSTY, boats, same_bits
from integration.sensing import GUN, GUN_AT, P3D, equipped, sailing
from vrx_mj.errors import SensorError
from vrx_mj.mjcf.objects import SPACING, parked_balls

SPEED = 0.3 / 0.04
"""Of a ball at the muzzle [m/s]: 300 N for 1 ms on 40 g."""
PITCH = 1.04
MUZZLE = np.add(GUN_AT, (0.14 * math.cos(PITCH), 0.0, 0.14 * math.sin(PITCH)))
"""In the boat's axes [m]."""
TWO = boats((0.0, 0.0, 0.0), (40.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def sim():
    return sailing((GUN, P3D), sea=CALM, wind=None, fleet=boats((0.0, 0.0, 0.0)))


@pytest.fixture(autouse=True)
def _at_the_start(sim):
    sim.reset()


def test_a_ball_leaves_the_muzzle_along_the_launchers_axis(sim):
    assert sim.fire("a")
    ball = sim.observe_object("a/gun")
    assert ball.position == pytest.approx(np.add(MUZZLE, (0.0, 0.0, AFLOAT)), abs=1e-5)
    half_a_step = 0.5 * 0.01 * 9.8
    assert sim.data.qvel[:3] == pytest.approx((SPEED * math.cos(PITCH), 0.0, SPEED * math.sin(PITCH) + half_a_step))
    expected = SPEED + half_a_step * math.sin(PITCH), 0.0, half_a_step * math.cos(PITCH)
    assert ball.velocity == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("timestep", [0.02, 0.01, 0.002])
def test_a_ball_flies_a_parabola(timestep):
    """No drag in air. A ball that started at its exact speed would fall short by g t dt / 2: 39 mm at 10 ms."""
    world = {"sea": CALM, "wind": None, "physics": {"profile": "vrx", "timestep": timestep}}
    sim = sailing((GUN,), fleet=boats((0.0, 0.0, 0.0)), **world)
    sim.fire("a")
    sim.step(duration=0.8)
    x = MUZZLE[0] + SPEED * math.cos(PITCH) * 0.8
    z = MUZZLE[2] + AFLOAT + SPEED * math.sin(PITCH) * 0.8 - 9.8 / 2.0 * 0.8**2
    assert sim.observe_object("a/gun").position == pytest.approx((x, 0.3, z), abs=1e-5)


def test_a_ball_floats_where_it_falls(sim):
    sim.fire("a")
    sim.advance(1500)
    ball = sim.observe_object("a/gun")
    assert 5.0 < ball.position[0] < 8.0
    assert abs(ball.position[2]) < 0.03
    assert np.linalg.norm(ball.velocity) < 1e-3


def test_there_are_as_many_shots_as_configured_and_one_ball(sim):
    left = [sim.sense("a")["gun"].data.shots_left]
    fired = []
    for _ in range(6):
        fired.append(sim.fire("a"))
        left.append(sim.sense("a")["gun"].data.shots_left)
        sim.advance(30)
    assert fired == [True] * 4 + [False] * 2
    assert left == [4, 3, 2, 1, 0, 0, 0]


def test_a_shot_without_a_ball_left_moves_nothing(sim):
    for _ in range(4):
        sim.fire("a")
    sim.advance(30)
    before = sim.get_state().sha256
    assert not sim.fire("a")
    assert sim.get_state().sha256 == before


def test_by_the_vrx_profile_a_ball_starts_at_rest_and_else_with_the_boat():
    speeds = []
    for profile in ("vrx", "marine"):
        sim = sailing((GUN,), profile=profile, sea=CALM, wind=None, fleet=boats((0.0, 0.0, 0.0)))
        sim.set_boat("a", velocity=(3.0, 0.0, 0.0, 0.0, 0.0, 0.5))
        sim.fire("a")
        speeds.append(sim.data.qvel[:3].copy())
    rest = np.array([SPEED * math.cos(PITCH), 0.0, SPEED * math.sin(PITCH) + 0.5 * 0.01 * 9.8])
    assert speeds[0] == pytest.approx(rest)
    assert speeds[1] == pytest.approx(np.array([3.0, 0.0, 0.0]) + rest + np.cross((0.0, 0.0, 0.5), MUZZLE))


def test_a_ball_that_waits_does_not_move(sim):
    start = sim.data.qpos[:7].copy()
    sim.advance(2000)
    assert same_bits(sim.data.qpos[:7], start)
    assert sim.data.ntree_awake == 1


def test_a_ball_waits_again_after_a_reset_and_in_a_state_from_before_the_shot(sim):
    sim.advance(10)
    state = sim.get_state()
    sim.fire("a")
    sim.advance(50)
    later = sim.get_state()
    sim.set_state(state)
    assert sim.data.ntree_awake == 1
    assert sim.sense("a")["gun"].data.shots_left == 4
    sim.fire("a")
    sim.advance(50)
    assert sim.get_state().mujoco.tobytes() == later.mujoco.tobytes()
    sim.reset()
    assert sim.observe_object("a/gun").position[2] == -200.0
    assert sim.data.ntree_awake == 1


def test_a_state_in_mid_flight_goes_on_bit_by_bit(sim):
    sim.fire("a")
    sim.advance(20)
    state = sim.get_state()
    sim.advance(200)
    expected = sim.get_state().sha256
    sim.reset()
    sim.set_state(state)
    sim.advance(200)
    assert sim.get_state().sha256 == expected


def test_balls_that_wait_change_no_boats_motion():
    world = {"wind": GUSTY, "fleet": TWO}
    with_balls, without = sailing({"a": (GUN,), "b": (GUN,)}, **world), sailing({}, **world)
    for sim in (with_balls, without):
        sim.step({"a": {"left": 1.0, "right": 0.5}, "b": {"left": -0.5, "right": 0.2}}, duration=20.0)
    for boat in "ab":
        one, other = with_balls.observe()[boat], without.observe()[boat]
        assert same_bits(one.position, other.position)
        assert same_bits(one.velocity, other.velocity)


def test_balls_wait_apart_from_each_other():
    places = np.array([ball.pose[:3] for ball in parked_balls([(f"wamv{k}", "gun") for k in range(100)])])
    apart = np.linalg.norm(places[:, None] - places[None, :], axis=2) + 1e9 * np.eye(100)
    assert apart.min() == SPACING
    assert set(places[:, 2]) == {-200.0}


def test_a_ball_that_is_put_somewhere_is_let_go(sim):
    sim.set_object("a/gun", pose=(20.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    sim.advance(1000)
    assert abs(sim.observe_object("a/gun").position[2]) < 0.03


def test_a_shooter_without_a_ball_says_so():
    world = equipped(sailing({}).world, {"a": (GUN,)})
    with pytest.raises(SensorError, match=r"^gun of a has no ball: the world was compiled without one$"):
        vrx_mj.Simulation(world).fire("a")


def test_vrxs_own_boat_shoots_its_own_ball():
    """Muzzle of the suite's shooter in boat axes: base (0.54, 0.30, 1.296), launcher (-0.0204, 0, 0.107877) on it."""
    world = vrx_mj.compile_world({"sea": CALM}, fleet={**boats((0.0, 0.0, 0.0)), "sensors": "vrx"})
    sim = vrx_mj.Simulation(world)
    assert sim.data.ntree_awake == 1
    assert sim.sense("a")["ball_shooter"].data.shots_left == 4
    base = sim.observe()["a"].position
    assert sim.fire("a")
    muzzle = np.add((0.54 - 0.0204, 0.30, 1.296 + 0.107877), (0.14 * math.cos(PITCH), 0.0, 0.14 * math.sin(PITCH)))
    assert sim.observe_object("a/ball_shooter").position == pytest.approx(base + muzzle, abs=1e-4)
    sim.advance(50)
    flown = sim.observe_object("a/ball_shooter").position - base - muzzle
    assert flown[0] == pytest.approx(SPEED * math.cos(PITCH) * 0.5, abs=1e-3)
