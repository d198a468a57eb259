"""The Otter of published coefficients: top speeds, and periods of its free motions."""

import math
from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Comparison, Outcome, case
from vrx_mj.validation.setups import GRAVITY, only_boat, packaged_simulation, record

_THRUST = 0.02216 / 2.0
"""k of the thrust k n^2 of a propeller [N s2/rad2]."""
_HULL_MASS, _PAYLOAD = 55.0, 25.0
_ASIDE = 0.395
"""Distance of a propeller and of a hull from the middle [m]."""
_CROSS_FLOW = 1.004184471
"""Hoerner's coefficient for a hull 0.25 m wide with this draft."""
_FULL_THRUST = 119.682
"""Thrust of a propeller at full command [N], in assets/robots/otter/robot.yaml."""
_TANK = "otter_tank"
_FILES = ("mjcf/hulls.py", "physics/drag.py", "physics/vessel.py", "runtime/loop.py")
_SURGE_DAMPING = 24.4 * GRAVITY / (6.0 * 0.5144)
"""|X_u| [N s/m]: 24.4 kg of bollard pull at 6 knots."""
_SETTLING = 1.0
"""Time constants of sway and yaw [s]."""
_PERIODS = {"heave": 0.680, "roll": 0.975, "pitch": 1.149}
"""Damped periods [s] of his M, D and G, the shortest first; the matrices below have 0.6798, 0.9750 and 1.1486."""


def _cross(r: FloatArray) -> FloatArray:
    """The matrix S(r) of r x."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def _transform(r: FloatArray) -> FloatArray:
    """The matrix H(r) that moves velocities to a point."""
    found = np.eye(6)
    found[:3, 3:] = _cross(r).T
    return found


class Published(NamedTuple):
    """The Otter about its origin, in axes forward, right, down."""

    rigid: FloatArray
    """Mass (6, 6)."""
    added: FloatArray
    """Added mass (6, 6)."""
    damping: FloatArray
    """Linear damping (6, 6)."""
    stiffness: FloatArray
    """(6, 6)"""
    center: FloatArray
    """Centre of mass (3,) [m]."""
    inertia: FloatArray
    """Moments of inertia about it (3, 3) [kg m2]."""
    draft: float
    """Draft of a hull [m]."""


def _published_otter() -> Published:
    """The matrices, by their formulas."""
    density, length, beam, pontoon, aside, fullness, block = 1025.0, 2.0, 1.08, 0.25, _ASIDE, 0.75, 0.4
    mass = _HULL_MASS + _PAYLOAD
    payload = np.array([0.05, 0.0, -0.35])
    center = (_HULL_MASS * np.array([0.2, 0.0, -0.2]) + _PAYLOAD * payload) / mass
    radii = np.diag([(0.4 * beam) ** 2, (0.25 * length) ** 2, (0.25 * length) ** 2])
    shift, extra = _cross(center), _cross(payload)
    inertia = _HULL_MASS * radii - _HULL_MASS * shift @ shift - _PAYLOAD * extra @ extra
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, 3:] = mass * np.eye(3), inertia
    about = _transform(center)
    rigid = about.T @ rigid @ about
    added = np.diag([0.1 * _HULL_MASS, 1.5 * _HULL_MASS, _HULL_MASS, *(np.array([0.2, 0.8, 1.7]) * np.diag(inertia))])
    whole = rigid + added
    volume, plane = mass / density, fullness * length * pontoon
    draft = volume / (2.0 * block * pontoon * length)
    shape = 6.0 * fullness**3 / ((1.0 + fullness) * (1.0 + 2.0 * fullness))
    across = length * pontoon**3 / 6.0 * shape + 2.0 * plane * aside**2
    along = 0.8 * pontoon * length**3 / 6.0
    lever = (2.5 * draft - 0.5 * volume / (length * pontoon)) / 3.0 - (draft - center[2])  # KB - KG
    weight = density * GRAVITY
    restoring = [2.0 * weight * plane, weight * (across + volume * lever), weight * (along + volume * lever)]
    stiff = np.diag([0.0, 0.0, *restoring, 0.0])
    flotation = _transform(np.array([-0.2, 0.0, 0.0]))
    relative = [2.0 * ratio * math.sqrt(stiff[i, i] * whole[i, i]) for ratio, i in ((0.3, 2), (0.2, 3), (0.4, 4))]
    sway, yaw = whole[1, 1] / _SETTLING, whole[5, 5] / _SETTLING
    damping = np.diag([_SURGE_DAMPING, sway, *relative, yaw])
    return Published(rigid, added, damping, flotation.T @ stiff @ flotation, center, inertia, draft)


def _periods(stiffness: FloatArray, damping: FloatArray) -> list[float]:
    """Damped periods [s] of accelerations by pose (6, 6) and by velocity (6, 6), the shortest first."""
    system = np.block([[np.zeros((6, 6)), np.eye(6)], [stiffness, damping]])
    return sorted(2.0 * math.pi / value.imag for value in np.linalg.eigvals(system) if value.imag > 1e-3)


def _accelerations(sim: Simulation, pose: FloatArray, velocity: FloatArray) -> FloatArray:
    """Accelerations (6,) of the boat's own velocities in one step."""
    sim.reset()
    sim.set_boat(sim.boats[0], pose=pose.tolist(), velocity=velocity.tolist())
    sim.advance(1)
    seen = only_boat(sim)
    return (np.concatenate((seen.velocity, seen.angular_velocity)) - velocity) / sim.timestep


@case(*_FILES)
def otter_periods() -> Outcome:
    """Free motions of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml, a hull of matrices (hydrostatics: matrix) at rest.
    Accelerations in one step from poses 0.1 mm or mrad aside and from velocities of 0.1 mm/s or mrad/s make the
    linear system; its damped periods are those of its eigenvalues: of heave and pitch coupled with surge, and of
    roll coupled with sway and yaw.

    Reference: Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the
    Python Vehicle Simulator (commit 61a8f41): mass, added mass, damping and stiffness by its formulas, worked out a
    second time. Eigenvalues of M, D and G about rest without trim, with the payload 0.05 m ahead of midships and a
    time constant of 1 s in sway. Earlier versions of it have the payload amidships and no damping in sway: 0.681,
    0.975 and 1.136 s.
    """
    sim, step, still = packaged_simulation(_TANK), 1e-4, np.zeros(6)
    by_pose, by_velocity = np.zeros((6, 6)), np.zeros((6, 6))
    for axis in range(6):
        aside = step * np.eye(6)[axis]
        by_pose[:, axis] = (_accelerations(sim, aside, still) - _accelerations(sim, -aside, still)) / (2.0 * step)
        by_velocity[:, axis] = (_accelerations(sim, still, aside) - _accelerations(sim, still, -aside)) / (2.0 * step)
    ours = _periods(by_pose, by_velocity)
    ours += [math.nan] * (len(_PERIODS) - len(ours))
    yield from (
        Comparison(f"damped period of {motion}", "s", reference, value)
        for (motion, reference), value in zip(_PERIODS.items(), ours, strict=False)
    )


def _command(rate: float) -> float:
    """The command of the shipped robot that has the thrust k n^2 of a propeller at a rate n [rad/s]."""
    return _THRUST * rate**2 / _FULL_THRUST


@case(*_FILES)
def otter_surge() -> Outcome:
    """Speeds of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml with both propellers at 60, 80 and 100 rad/s, 20 s from
    rest. The weight of the payload as an external force, with which the file trims the boat and pushes it ahead
    (1.118 m/s instead of 1.029), is left out: mass and stiffness have it already.

    Reference: Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the
    Python Vehicle Simulator (commit 61a8f41): mass, added mass, damping and stiffness by its formulas, worked out a
    second time. 2 k n^2 = |X_u| u.
    """
    sim, series = packaged_simulation(_TANK), []
    for rate in (60.0, 80.0, 100.0):
        sim.reset()
        command = _command(rate)
        times, speeds = record(sim, lambda sim: only_boat(sim).velocity[0], 100, 0.2, left=command, right=command)
        reference = 2.0 * _THRUST * rate**2 / _SURGE_DAMPING
        yield Comparison(f"speed at {rate:g} rad/s", "m/s", reference, speeds[-1])
        series.append(Series("closed form", times[[0, -1]], [reference] * 2, reference=True))
        series.append(Series(f"{rate:g} rad/s", times, speeds))
    yield Chart("Speed of the Otter", "time [s]", "speed [m/s]", series)


def _acceleration(otter: Published, pose: FloatArray, velocity: FloatArray, push: FloatArray) -> FloatArray:
    """Accelerations (6,) of his equations: all coefficients, but for the payload's weight as an external force."""
    momentum = otter.added @ velocity
    coupling = np.block([[np.zeros((3, 3)), -_cross(momentum[:3])], [-_cross(momentum[:3]), -_cross(momentum[3:])]])
    spin, about, mass = velocity[3:], _transform(otter.center), _HULL_MASS + _PAYLOAD
    rigid = np.block([[mass * _cross(spin), np.zeros((3, 3))], [np.zeros((3, 3)), -_cross(otter.inertia @ spin)]])
    places = np.linspace(-1.0, 1.0, 21)
    across = velocity[1] + places * velocity[5]
    drag = -0.5 * 1026.0 * otter.draft * _CROSS_FLOW * 0.1 * np.abs(across) * across
    load = push - otter.damping @ velocity - (about.T @ rigid @ about + coupling) @ velocity - otter.stiffness @ pose
    load[1] += drag.sum()
    load[5] += (places * drag).sum() - 10.0 * otter.damping[5, 5] * abs(velocity[5]) * velocity[5]
    found: FloatArray = np.linalg.solve(otter.rigid + otter.added, load)
    return found


def _rates(pose: FloatArray, velocity: FloatArray) -> FloatArray:
    """Rates (6,) of the position and of roll, pitch and yaw."""
    (roll, pitch, yaw), spin = pose[3:], velocity[3:]
    turn = np.array(rotation(roll, pitch, yaw)) @ velocity[:3]
    sine, cosine = math.sin(roll), math.cos(roll)
    across = sine * spin[1] + cosine * spin[2]
    angles = spin[0] + across * math.tan(pitch), cosine * spin[1] - sine * spin[2], across / math.cos(pitch)
    return np.array([*turn, *angles])


def _runge_kutta(otter: Published, push: FloatArray, steps: int, dt: float) -> FloatArray:
    """The motion from rest under a constant push, (steps + 1, 12): pose and velocity."""

    def rate(x: FloatArray) -> FloatArray:
        return np.concatenate((_rates(x[:6], x[6:]), _acceleration(otter, x[:6], x[6:], push)))

    found = [np.zeros(12)]
    for _ in range(steps):
        x = found[-1]
        a = rate(x)
        b = rate(x + 0.5 * dt * a)
        c = rate(x + 0.5 * dt * b)
        found.append(x + dt / 6.0 * (a + 2.0 * b + 2.0 * c + rate(x + dt * c)))
    return np.array(found)


@case("physics/drag.py", *_FILES)
def otter_turn() -> Outcome:
    """Turn of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml from rest with its left propeller at 100 rad/s and its
    right one at 80, 60 s, without that external force and without the lag of propellers.

    Reference: Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the
    Python Vehicle Simulator (commit 61a8f41): mass, added mass, damping and stiffness by its formulas, worked out a
    second time. His equations of six degrees of freedom with cross-flow drag, by Runge and Kutta's method of order
    4, steps of 0.02 s.
    """
    left, right = _THRUST * 100.0**2, _THRUST * 80.0**2
    push = np.array([left + right, 0.0, 0.0, 0.0, 0.0, _ASIDE * (left - right)])
    theirs = _runge_kutta(_published_otter(), push, 3000, 0.02)
    sim = packaged_simulation(_TANK)
    commands = {"left": _command(100.0), "right": _command(80.0)}
    _, path = record(sim, lambda sim: only_boat(sim).position * (1.0, -1.0, 1.0), 300, 0.2, **commands)
    seen, (u, v, *_, r) = only_boat(sim), theirs[-1, 6:]
    ours = seen.velocity[0], -seen.velocity[1], -seen.angular_velocity[2]
    yield Comparison("speed ahead", "m/s", u, ours[0])
    yield Comparison("speed to starboard", "m/s", v, ours[1])
    yield Comparison("rate of turn to starboard", "rad/s", r, ours[2])
    yield Comparison("radius", "m", math.hypot(u, v) / r, math.hypot(*ours[:2]) / ours[2])
    yield Comparison("farthest ahead", "m", theirs[:, 0].max(), path[:, 0].max())
    yield Comparison("farthest to starboard", "m", theirs[:, 1].max(), path[:, 1].max())
    lines = (
        Series("his equations", theirs[::10, 1], theirs[::10, 0], reference=True),
        Series("ours", path[:, 1], path[:, 0]),
    )
    yield Chart("Turn of the Otter", "transfer to starboard [m]", "advance [m]", lines)
