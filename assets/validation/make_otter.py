"""Make the rows of otter_turn.csv: `pip install numpy`, `python make_otter.py`.

The equations of Fossen's otter.py (Python Vehicle Simulator, commit 61a8f41), worked out a second time: mass, added
mass, damping and stiffness by its formulas, its cross-flow drag and its thrust, without the payload's weight as an
external force and without the lag of propellers; Runge and Kutta's method of order 4, steps of 0.02 s.
"""

import math
import sys
from typing import NamedTuple

import numpy as np

GRAVITY = 9.81
THRUST = 0.02216 / 2.0
"""k of the thrust k n^2 of a propeller [N s2/rad2]."""
HULL_MASS, PAYLOAD = 55.0, 25.0
ASIDE = 0.395
"""Distance of a propeller and of a hull from the middle [m]."""
CROSS_FLOW = 1.004184471
"""Hoerner's coefficient for a hull 0.25 m wide with this draft."""
SURGE_DAMPING = 24.4 * GRAVITY / (6.0 * 0.5144)
"""|X_u| [N s/m]: 24.4 kg of bollard pull at 6 knots."""
SETTLING = 1.0
"""Time constants of sway and yaw [s]."""


def cross(r: np.ndarray) -> np.ndarray:
    """The matrix S(r) of r x."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def transform(r: np.ndarray) -> np.ndarray:
    """The matrix H(r) that moves velocities to a point."""
    found = np.eye(6)
    found[:3, 3:] = cross(r).T
    return found


class Published(NamedTuple):
    """The Otter about its origin, in axes forward, right, down."""

    rigid: np.ndarray
    """Mass (6, 6)."""
    added: np.ndarray
    """Added mass (6, 6)."""
    damping: np.ndarray
    """Linear damping (6, 6)."""
    stiffness: np.ndarray
    """(6, 6)"""
    center: np.ndarray
    """Centre of mass (3,) [m]."""
    inertia: np.ndarray
    """Moments of inertia about it (3, 3) [kg m2]."""
    draft: float
    """Draft of a hull [m]."""


def published_otter() -> Published:
    """The matrices, by their formulas."""
    density, length, beam, pontoon, aside, fullness, block = 1025.0, 2.0, 1.08, 0.25, ASIDE, 0.75, 0.4
    mass = HULL_MASS + PAYLOAD
    payload = np.array([0.05, 0.0, -0.35])
    center = (HULL_MASS * np.array([0.2, 0.0, -0.2]) + PAYLOAD * payload) / mass
    radii = np.diag([(0.4 * beam) ** 2, (0.25 * length) ** 2, (0.25 * length) ** 2])
    shift, extra = cross(center), cross(payload)
    inertia = HULL_MASS * radii - HULL_MASS * shift @ shift - PAYLOAD * extra @ extra
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, 3:] = mass * np.eye(3), inertia
    about = transform(center)
    rigid = about.T @ rigid @ about
    added = np.diag([0.1 * HULL_MASS, 1.5 * HULL_MASS, HULL_MASS, *(np.array([0.2, 0.8, 1.7]) * np.diag(inertia))])
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
    flotation = transform(np.array([-0.2, 0.0, 0.0]))
    relative = [2.0 * ratio * math.sqrt(stiff[i, i] * whole[i, i]) for ratio, i in ((0.3, 2), (0.2, 3), (0.4, 4))]
    sway, yaw = whole[1, 1] / SETTLING, whole[5, 5] / SETTLING
    damping = np.diag([SURGE_DAMPING, sway, *relative, yaw])
    return Published(rigid, added, damping, flotation.T @ stiff @ flotation, center, inertia, draft)


def acceleration(otter: Published, pose: np.ndarray, velocity: np.ndarray, push: np.ndarray) -> np.ndarray:
    """Accelerations (6,) of his equations: all coefficients, but for the payload's weight as an external force."""
    momentum = otter.added @ velocity
    coupling = np.block([[np.zeros((3, 3)), -cross(momentum[:3])], [-cross(momentum[:3]), -cross(momentum[3:])]])
    spin, about, mass = velocity[3:], transform(otter.center), HULL_MASS + PAYLOAD
    rigid = np.block([[mass * cross(spin), np.zeros((3, 3))], [np.zeros((3, 3)), -cross(otter.inertia @ spin)]])
    places = np.linspace(-1.0, 1.0, 21)
    across = velocity[1] + places * velocity[5]
    drag = -0.5 * 1026.0 * otter.draft * CROSS_FLOW * 0.1 * np.abs(across) * across
    load = push - otter.damping @ velocity - (about.T @ rigid @ about + coupling) @ velocity - otter.stiffness @ pose
    load[1] += drag.sum()
    load[5] += (places * drag).sum() - 10.0 * otter.damping[5, 5] * abs(velocity[5]) * velocity[5]
    found: np.ndarray = np.linalg.solve(otter.rigid + otter.added, load)
    return found


def rates(pose: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Rates (6,) of the position and of roll, pitch and yaw."""
    (roll, pitch, yaw), spin = pose[3:], velocity[3:]
    sine, cosine = math.sin(roll), math.cos(roll)
    x = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
    s, c = math.sin(pitch), math.cos(pitch)
    y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    s, c = math.sin(yaw), math.cos(yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ y @ x @ velocity[:3]
    across = sine * spin[1] + cosine * spin[2]
    angles = spin[0] + across * math.tan(pitch), cosine * spin[1] - sine * spin[2], across / math.cos(pitch)
    return np.array([*turn, *angles])


def runge_kutta(otter: Published, push: np.ndarray, steps: int, dt: float) -> np.ndarray:
    """The motion from rest under a constant push, (steps + 1, 12): pose and velocity."""

    def rate(x: np.ndarray) -> np.ndarray:
        return np.concatenate((rates(x[:6], x[6:]), acceleration(otter, x[:6], x[6:], push)))

    found = [np.zeros(12)]
    for _ in range(steps):
        x = found[-1]
        a = rate(x)
        b = rate(x + 0.5 * dt * a)
        c = rate(x + 0.5 * dt * b)
        found.append(x + dt / 6.0 * (a + 2.0 * b + 2.0 * c + rate(x + dt * c)))
    return np.array(found)


def rows() -> np.ndarray:
    """Time, place ahead and to starboard, speeds ahead and to starboard, and rate of turn to starboard, each second."""
    left, right = THRUST * 100.0**2, THRUST * 80.0**2
    push = np.array([left + right, 0.0, 0.0, 0.0, 0.0, ASIDE * (left - right)])
    found = runge_kutta(published_otter(), push, 3000, 0.02)[::50]
    return np.column_stack([np.arange(len(found)), found[:, [0, 1, 6, 7, 11]]])


if __name__ == "__main__":
    for row in rows():
        sys.stdout.write(",".join(f"{value:.10g}" for value in row) + "\n")
