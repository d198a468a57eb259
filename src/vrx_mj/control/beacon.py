"""Where a beacon is, from what an acoustic receiver heard: ranges, bearings and elevations, all with noise."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.control.navigation import Estimate

__all__ = ["Heard", "MovingBeacon", "StillBeacon", "heard"]

RANGE_NOISE = 3.0
"""Standard deviation of a range [m]: VRX's wamv_pinger.xacro."""
ANGLE_NOISE = 0.01
"""Standard deviation of a bearing and of an elevation [rad]: as above."""
DEPTH, DEPTH_NOISE = -1.0, 1.5
"""What is known of a still beacon's height [m] before anything is heard: in the upper 3 m of the water."""
HEIGHT = 2.0
"""Of a moving beacon over the water, or under it [m]; VRX 3's swims under it and is heard from over it."""
SWERVE = 0.5
"""Acceleration of a moving beacon [m/s2], as noise of 1 s."""
LEAST_ELEVATION = 4.0 * ANGLE_NOISE
"""Below this [rad] an elevation tells nothing of the distance."""


@dataclass(frozen=True)
class Heard:
    """One sound, in the local frame."""

    position: FloatArray
    """(3,): of the boat, then [m]."""
    direction: FloatArray
    """(3,): unit vector to the beacon."""
    range: float
    """[m]; noise can make it negative."""
    elevation: float
    """[rad], above the horizontal."""


def heard(sound: Any, seen: Estimate, age: float) -> Heard:
    """A receiver's reading, `age` [s] old, by a boat that is now as `seen`."""
    level = math.cos(sound.elevation)
    own = (level * math.cos(sound.bearing), level * math.sin(sound.bearing), math.sin(sound.elevation))
    direction = seen.rotation @ own
    position = np.array([seen.x - seen.vx * age, seen.y - seen.vy * age, seen.z])
    return Heard(position, direction, float(sound.range), math.asin(max(-1.0, min(1.0, float(direction[2])))))


class StillBeacon:
    """Least squares over all that was heard, as an information filter of the beacon's position.

    A sound is a point, at its range in its direction, whose error is 3 m along the direction and 1 % of the distance
    across it. Bearings from two places cross sharply, so the estimate is good long before the boat is there.
    """

    def __init__(self) -> None:
        weight = DEPTH_NOISE**-2
        self._information = np.diag([0.0, 0.0, weight])
        self._sum = np.array([0.0, 0.0, weight * DEPTH])
        self.place: tuple[float, float] | None = None
        """East and north [m]; None before the first sound."""

    def update(self, sound: Heard) -> None:
        """Take a sound in."""
        distance = max(1.0, abs(sound.range))
        if self.place is not None:
            distance = max(1.0, math.dist(self.place, sound.position[:2].tolist()))
        along = np.outer(sound.direction, sound.direction)
        weight = along / RANGE_NOISE**2 + (np.eye(3) - along) / (ANGLE_NOISE * distance) ** 2
        self._information += weight
        self._sum += weight @ (sound.position + sound.range * sound.direction)
        x, y, _ = np.linalg.solve(self._information, self._sum).tolist()
        self.place = (x, y)


class MovingBeacon:
    """A Kalman filter of a beacon's place and velocity on the water, constant but for `SWERVE`.

    Near by, the elevation of a beacon whose height is known tells its distance better than the range does: at 8 m
    within 0.3 m. Both are taken, each with its weight.
    """

    def __init__(self) -> None:
        self._state: FloatArray | None = None
        self._covariance = np.diag([0.0, 0.0, 1.0, 1.0])
        self._time = 0.0

    def update(self, sound: Heard, t: float) -> None:
        """Take a sound of the time `t` [s] in."""
        place, covariance = _on_water(sound)
        if self._state is None:
            self._state = np.array([*place, 0.0, 0.0])
            self._covariance[:2, :2] = covariance
        else:
            self._state = self._carry_on(self._state, t - self._time)
            gain = self._covariance[:, :2] @ np.linalg.inv(self._covariance[:2, :2] + covariance)
            self._state = self._state + gain @ (place - self._state[:2])
            self._covariance = self._covariance - gain @ self._covariance[:2, :]
        self._time = t

    def at(self, t: float) -> tuple[float, float, float, float] | None:
        """Place [m] and velocity [m/s], east and north, at a time [s]; None before the first sound."""
        if self._state is None:
            return None
        x, y, vx, vy = self._state.tolist()
        ahead = t - self._time
        return x + vx * ahead, y + vy * ahead, vx, vy

    def _carry_on(self, state: FloatArray, interval: float) -> FloatArray:
        """Predict; the noise is white acceleration (Bar-Shalom et al., Estimation with Applications, 2001, 6.2.2)."""
        step = np.eye(4)
        step[0, 2] = step[1, 3] = interval
        noise = np.kron(np.array([[interval**3 / 3, interval**2 / 2], [interval**2 / 2, interval]]), np.eye(2))
        self._covariance = step @ self._covariance @ step.T + SWERVE**2 * noise
        return np.asarray(step @ state)


def _on_water(sound: Heard) -> tuple[FloatArray, FloatArray]:
    """Where a sound puts the beacon [m], east and north, and the covariance [m2]."""
    level = math.cos(sound.elevation)
    distance, weight = sound.range * level, RANGE_NOISE**-2
    if abs(sound.elevation) > LEAST_ELEVATION:
        rise = abs(math.copysign(HEIGHT, sound.elevation) - float(sound.position[2]))
        by_angle = rise / math.tan(abs(sound.elevation))
        sharp = (ANGLE_NOISE * (by_angle**2 + rise**2) / rise) ** -2
        distance, weight = (distance * weight + by_angle * sharp) / (weight + sharp), weight + sharp
    ahead = sound.direction[:2] / max(level, 1e-9)
    along = np.outer(ahead, ahead)
    across = ANGLE_NOISE * max(1.0, abs(distance))
    return sound.position[:2] + distance * ahead, along / weight + (np.eye(2) - along) * across**2
