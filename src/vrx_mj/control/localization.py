"""Localization: where a boat is and how it moves, with covariances, from its GPS and its inertial unit.

The position is filtered: it goes on by the receiver's velocities from one fix to the next, which corrects it as the
variances of both have it (a Kalman filter). Attitude, rates and velocity are what the sensors measure. All are carried
on to the present. White noise and drifts have the variances of the sensors' files; offsets are in no covariance.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import STANDARD_GRAVITY
from vrx_mj.control.navigation import base_link_by
from vrx_mj.frames import Geodetic, rotation_matrix
from vrx_mj.sensors.kinds import variances

if TYPE_CHECKING:
    from vrx_mj.runtime.mounted import Mounted
    from vrx_mj.runtime.observation import BoatObservation
    from vrx_mj.sensors.readings import Reading

_ACCELERATIONS = np.full(6, 0.3)
"""Standard deviations of a boat's accelerations along and about three axes, before any are seen [m/s2, rad/s2]."""
_NEW = 0.05
"""Share of a new square in their mean."""
_LEAST = 1e-9 * np.eye(6)
"""Covariance of what has no errors, as robot_localization's: filters need one above 0."""
_FAR = 25.0
"""Squared distance of a fix in standard deviations beyond which the boat was moved: the filter begins anew there."""
_LONGEST = 1.0
"""Time without a fix after which the filter begins anew [s]."""


class Located(NamedTuple):
    """Where a boat's `base_link` is and how it moves."""

    position: FloatArray
    """(3,) [m], along the world's axes."""
    rotation: FloatArray
    """(3, 3): body to world."""
    velocity: FloatArray
    """(3,) [m/s], along the body's axes."""
    spin: FloatArray
    """(3,) angular velocity [rad/s], about the body's axes."""
    pose_covariance: FloatArray = _LEAST
    """(6, 6): of position and orientation, along and about the world's axes."""
    twist_covariance: FloatArray = _LEAST
    """(6, 6): of velocity and spin, along and about the body's axes."""


def truly_located(boat: "BoatObservation") -> Located:
    """Where a boat really is."""
    return Located(boat.position, rotation_matrix(boat.quaternion), boat.velocity, boat.angular_velocity)


class Localizer:
    """Estimates from one boat's sensors, call by call."""

    def __init__(self, gps: "Mounted", imu: "Mounted", earth: Geodetic, antenna: FloatArray) -> None:
        """Use two sensors in a world on the Earth; fixes are of the `antenna`, a place on the boat (3,) [m]."""
        self._gps, self._imu, self._earth, self._antenna = gps.config, imu, earth, antenna
        self._axes = np.array([earth.from_east_north_up(*axis) for axis in np.eye(3)]).T
        self._time = self._turned = -np.inf
        self._position, self._velocity, self._spin = np.zeros((3, 3))
        self._spread = self._unsteady = self._drift = _LEAST[:3, :3]
        """Covariances of the filtered position, of the velocity, and of slow errors of fixes, which no filter finds."""
        self._jolts = np.square(_ACCELERATIONS)
        """(6,) mean squares of accelerations along the world's axes and about the body's."""
        self.fixed = -np.inf, np.zeros(3), _LEAST
        """Time of the last fix, the place of `base_link` by it alone [m], and its covariance, in the world's axes."""

    def __call__(self, boat: "BoatObservation", t: float) -> Located:
        """Where the boat is at the time `t` [s]."""
        fix, inertia = boat.sensors[self._gps.name], boat.sensors[self._imu.name]
        if inertia.time != self._turned:
            self._feel(inertia)
        if fix.time != self._time:
            self._take(fix, inertia)
        turned, slanted, unsure = self._attitude(inertia, t)
        age = t - self._time
        unsteady = self._unsteady + age**2 * np.diag(self._jolts[:3])
        place = self._spread + self._drift + age**2 * unsteady
        motion = turned.T @ (unsteady + _lever(self._velocity, slanted)) @ turned
        position, velocity = self._position + age * self._velocity, turned.T @ self._velocity
        return Located(position, turned, velocity, self._spin, _joint(place, slanted), _joint(motion, unsure))

    def _feel(self, reading: "Reading") -> None:
        """See how the boat shakes."""
        spin, passed = self._imu.mount.rotation @ reading.data.angular_velocity, reading.time - self._turned
        force = self._axes @ rotation_matrix(reading.data.orientation) @ reading.data.linear_acceleration
        if 0.0 < passed <= _LONGEST:
            jolts = np.concatenate([force - (0.0, 0.0, STANDARD_GRAVITY), (spin - self._spin) / passed])
            self._jolts = (1.0 - _NEW) * self._jolts + _NEW * jolts**2
        self._turned, self._spin = reading.time, spin

    def _take(self, reading: "Reading", inertia: "Reading") -> None:
        """Correct by a new fix."""
        fix, dt = reading.data, reading.time - self._time
        turned, slanted, unsure = self._attitude(inertia, reading.time)
        north, west, up = fix.velocity
        place = np.array(self._earth.to_enu(fix.latitude, fix.longitude, fix.altitude))
        antenna = place, self._axes @ (-west, north, up)
        arm, measured, velocity = base_link_by(*antenna, self._antenna, turned, self._spin)
        unsteady = self._in_world(variances(self._gps.velocity)) + _lever(arm, turned @ unsure @ turned.T)
        noise = self._in_world(np.square(self._gps.position.noise)) + _LEAST[:3, :3]
        self._drift = self._in_world(np.square(self._gps.position.drift)) + _lever(arm, slanted)
        self.fixed = reading.time, measured, _joint(noise + self._drift, np.zeros((3, 3)))
        position, spread = measured, noise
        if 0.0 < dt <= _LONGEST:
            expected = self._position + 0.5 * dt * (self._velocity + velocity)
            before = self._spread + dt**2 * unsteady + 0.25 * dt**4 * np.diag(self._jolts[:3])
            weights, miss = before @ np.linalg.inv(before + noise), measured - expected
            if miss @ np.linalg.solve(before + noise + self._drift, miss) < _FAR:
                position, spread = expected + weights @ miss, before - weights @ before
        self._time, self._position, self._spread = reading.time, position, spread
        self._velocity, self._unsteady = velocity, unsteady

    def _attitude(self, reading: "Reading", t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Body to world at a time, its covariance about the world's axes, and that of the spin about the body's.

        The rate that a unit gives is the mean since its last reading, so that it is late by half of the interval.
        """
        inertia, mount, age = reading.data, self._imu.mount.rotation, t - reading.time
        swing = (age + 0.5 / self._imu.config.rate) ** 2 * np.diag(self._jolts[3:])
        unit, half = self._axes @ rotation_matrix(inertia.orientation), np.array([1.0, *(0.5 * age * self._spin)])
        turned = unit @ mount.T @ rotation_matrix(half / np.linalg.norm(half))
        roll, pitch, heading = np.diag(np.reshape(inertia.orientation_covariance, (3, 3)))
        slanted = unit @ np.diag([roll, pitch, 0.0]) @ unit.T + np.diag([0.0, 0.0, heading])
        unsure = mount @ np.reshape(inertia.angular_velocity_covariance, (3, 3)) @ mount.T + swing
        return turned, slanted + age**2 * turned @ swing @ turned.T, unsure

    def _in_world(self, variance: FloatArray) -> FloatArray:
        """(3, 3) covariance in the world's axes of errors along east, north and up."""
        covariance: FloatArray = self._axes * variance @ self._axes.T
        return covariance


def _lever(arm: FloatArray, covariance: FloatArray) -> FloatArray:
    """(3, 3) covariance of the end of a lever whose turns have a covariance."""
    x, y, z = arm
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    moved: FloatArray = across @ covariance @ across.T
    return moved


def _joint(one: FloatArray, other: FloatArray) -> FloatArray:
    """(6, 6): two covariances as one of six errors."""
    return np.block([[one, np.zeros((3, 3))], [np.zeros((3, 3)), other]]) + _LEAST
