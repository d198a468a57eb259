"""How VRX 3's boat moves: against a second, slow implementation, and against the momentum that MuJoCo has."""

import functools
import math

import numpy as np
import pytest
from scipy.optimize import fsolve

from integration.sailing import boats
from integration.test_newton import momentum_rate
from integration.vrx3_worlds import BREEZE, MOST, sailing
from unit.physics.rows import rotation
from vrx_mj.model.world import tree_of

SWELL = {"gain": 0.8, "period": 6.0, "direction": [0.5, 0.8]}
POINTS = np.array([(-1.4, -1.03, 0.0), (0.6, -1.03, 0.0), (-1.4, 1.03, 0.0), (0.6, 1.03, 0.0)])
PROPELLERS = np.array([(-2.651932, 1.027135, -0.191134), (-2.651932, -1.027135, -0.191134)])
LINK_COM = np.array([0.0, 0.0, 0.12422907])
COM = np.array([-0.28629927, 0.0, 0.14556580])
INERTIA = np.array([[217.03174, 0.0, 11.403578], [0.0, 566.0832, 0.0], [11.403578, 0.0, 682.85647]])
MASS, GRAVITY, DENSITY = 258.0, 9.8, 997.7735
LINEAR = np.array([100.0, 100.0, 500.0, 300.0, 900.0, 800.0])
QUADRATIC = np.array([150.0, 100.0, 0.0, 600.0, 900.0, 800.0])
ADDED = np.array([0.0, 0.0, 0.1, 0.1, 0.1, 0.0])


def surface(waves, x, y, t):
    """Height [m] of VRX's sea, which grows for 2 s."""
    total = 0.0
    for wave in waves:
        (dx, dy), k = wave["direction"], wave["wavenumber"]
        total += wave["amplitude"] * math.cos(k * (dx * x + dy * y) - wave["frequency"] * t)
    return (1.0 - math.exp(-t / 2.0)) * total


def lift_of_points(position, turn, height):
    """Force and torque about the whole boat's centre of mass of the four points; `height(x, y)` is the water's."""
    force, torque = np.zeros(3), np.zeros(3)
    for point in POINTS:
        x, y, z = position + turn @ point
        h = min(max(height(x, y) - z, 0.0), 0.213)
        area = 0.213**2 * math.acos((0.213 - h) / 0.213) - (0.213 - h) * math.sqrt(2 * 0.213 * h - h * h)
        lift = np.array([0.0, 0.0, area * 4.9 / 2 * GRAVITY * DENSITY])
        lever = turn @ (LINK_COM + point - COM)  # VRX 3's quirk: the point's way from the centre of mass of the link
        force, torque = force + lift, torque + np.cross(lever, lift)
    return force, torque


def wrench(position, turn, speed, spin, thrusts, height, air):
    """All forces but weight, about the centre of mass; `speed` of the origin in world axes, `spin` in body axes."""
    force, torque = lift_of_points(position, turn, height)
    nu = np.concatenate((turn.T @ speed, spin))
    drag = -(LINEAR + QUADRATIC * np.abs(nu)) * nu
    r = np.asarray(air) - speed[:2]
    blown = np.array([0.5 * r[0] * abs(r[0]), 0.5 * r[1] * abs(r[1]), 0.0])
    origin = turn @ -COM
    for push, turning in ((turn @ drag[:3], turn @ drag[3:]), (blown, np.array([0.0, 0.0, -2 * 0.33 * r[0] * r[1]]))):
        force, torque = force + push, torque + np.cross(origin, push) + turning
    for thrust, propeller in zip(thrusts, PROPELLERS, strict=True):
        push = turn @ (thrust, 0.0, 0.0)
        force, torque = force + push, torque + np.cross(turn @ (propeller - COM), push)
    return force, torque


def marched(position, angles, thrusts, height, air, steps, dt=0.004):
    """Newton's and Euler's equations, written out, in steps of velocity and then position."""
    turn, position, speed, spin = rotation(*angles), np.array(position), np.zeros(3), np.zeros(3)
    arm = np.array([[0, -COM[2], COM[1]], [COM[2], 0, -COM[0]], [-COM[1], COM[0], 0]])
    for step in range(1, steps + 1):
        force, torque = wrench(position, turn, speed, spin, thrusts, lambda x, y, t=step * dt: height(x, y, t), air)
        force = turn.T @ (force - (0.0, 0.0, MASS * GRAVITY))
        torque = turn.T @ torque
        # unknown: a of the origin and alpha, body axes; a + alpha x c + omega x (omega x c) is the centre's
        lhs = np.zeros((6, 6))
        lhs[:3, :3] = MASS * np.eye(3) + np.diag(ADDED[:3])
        lhs[:3, 3:] = -MASS * arm
        lhs[3:, :3] = -arm @ np.diag(ADDED[:3])  # the added mass pulls at the origin
        lhs[3:, 3:] = INERTIA + np.diag(ADDED[3:])
        rhs = np.concatenate((
            force - MASS * np.cross(spin, np.cross(spin, COM)),
            torque - np.cross(spin, INERTIA @ spin),
        ))  # fmt: skip
        found = np.linalg.solve(lhs, rhs)
        speed, spin = speed + dt * turn @ found[:3], spin + dt * found[3:]
        position, turn = position + dt * speed, turn @ turned(dt * spin)
    return position, turn, turn.T @ speed, spin


def turned(vector):
    """Rodrigues' rotation by a vector [rad]."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle if angle > 0 else vector
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def test_the_boat_moves_as_newton_and_euler_say():
    """Heeled, trimmed, in swell and wind, with unequal thrusts, for 6 s."""
    sim = sailing(SWELL, BREEZE)
    start, angles = (3.0, -2.0, 0.05), (0.2, -0.12, 0.4)
    sim.set_boat("a", pose=(*start, *angles), velocity=(0.0,) * 6)
    sim.command("a", left=700.0, right=350.0)
    sim.advance(1500)
    air = (7 * math.cos(math.radians(120)), 7 * math.sin(math.radians(120)))
    height = functools.partial(surface, tree_of(sim.world.parameters)["sea"]["waves"])
    position, turn, speed, spin = marched(start, angles, (700.0, 350.0), height, air, 1500)
    seen = sim.observe()["a"]
    # the figures of mass and inertia have 8 digits, and the roll is nearly undamped
    assert seen.position == pytest.approx(position, abs=2e-6)
    assert [seen.roll, seen.pitch, seen.heading] == pytest.approx(
        [math.atan2(turn[2, 1], turn[2, 2]), -math.asin(turn[2, 0]), math.atan2(turn[1, 0], turn[0, 0])], abs=2e-6
    )
    assert seen.velocity == pytest.approx(speed, abs=1e-5)
    assert seen.angular_velocity == pytest.approx(spin, abs=1e-5)
    assert np.hypot(*(seen.position[:2] - start[:2])) > 5.0


@functools.cache
def steady(thrust):
    """Speed, height and pitch at which thrust on both sides, drag, lift and weight balance."""

    def unbalanced(unknown):
        speed, z, pitch = unknown
        force, torque = wrench(
            np.array([0.0, 0.0, z]), rotation(0, pitch, 0), np.array([speed, 0.0, 0.0]), np.zeros(3), (thrust, thrust),
            lambda x, y: 0.0, (speed, 0.0),
        )  # fmt: skip
        return force[0], force[2] - MASS * GRAVITY, torque[1]

    return fsolve(unbalanced, (1.0, -0.1, 0.0), xtol=1e-13)


@pytest.mark.parametrize("thrust", [0.0, 200.0, MOST])
def test_the_boat_settles_at_its_balance(thrust):
    sim = sailing(fleet=boats((0.0, 0.0, 0.0)))
    sim.command("a", left=thrust, right=thrust)
    sim.advance(250 * 120)
    speed, z, pitch = steady(thrust)
    seen = sim.observe()["a"]
    assert seen.speed == pytest.approx(speed, abs=1e-7)
    assert (seen.position[2], seen.pitch) == pytest.approx((z, pitch), abs=1e-7)
    assert abs(seen.roll) < 1e-9


def test_the_top_speed_is_that_of_level_surge_but_for_the_trim():
    assert steady(MOST)[0] == pytest.approx(5.27840100, rel=3e-4)


def test_forces_are_the_rate_of_momentum_with_added_mass_and_all():
    """At the link's origin nothing of the added mass is left out, as it is in classic worlds."""

    def heavy(parameters):
        for hull in parameters["hulls"]:
            hull["added_mass"] = [20.0, 60.0, 40.0, 20.0, 40.0, 60.0]

    sim = sailing(SWELL, BREEZE, boats((0.0, 0.0, 0.3), engines="hinged"), heavy)
    sim.set_boat("a", velocity=(1.5, 0.5, 0.3, 0.2, -0.3, 0.4))
    for _ in range(20):
        sim.step({"a": {"left": 400.0, "right": 100.0, "left_angle": 0.4}}, duration=0.1)
        before = sim.data.qpos.copy(), sim.data.qvel.copy()
        state, forces = sim.get_state(), sim.forces("a")
        sim.advance(1)
        found = sim.data.qacc.copy()
        rate = momentum_rate(sim, before, found, "a")
        sim.set_state(state)
        sim.data.qacc[:] = found
        added = sim.forces("a").inertial["added_mass"]
        np.testing.assert_allclose(forces.total + added, rate, rtol=1e-9, atol=1e-6)
