"""Navigation: where a boat is and how it moves, from its GPS and IMU, in a local frame; with covariances or without.

The frame is level and east-north, and its origin is the first fix. For `Navigator` a fix is only carried on to the
present: VRX's GPS errs by a millimetre and its velocity by 2 cm/s, and its inertial unit's attitude has no error, so
nothing needs a filter.

`Localizer` filters the same measurements for receivers with larger errors, by the figures of the sensors' files, which
an observation does not contain. It carries the position on by the receiver's velocities from one fix to the next,
which corrects it by the variances of both (a Kalman filter). Attitude, rates and velocity are what the sensors
measure. White noise and drifts have the variances of the sensors' files; offsets are in no covariance.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import STANDARD_GRAVITY
from vrx_mj.errors import VrxError, warn
from vrx_mj.frames import FLATTENING, SEMI_MAJOR, Geodetic, rotation_matrix
from vrx_mj.sensors.instruments import variances

if TYPE_CHECKING:
    from vrx_mj.runtime.mounted import Mounted
    from vrx_mj.runtime.observation import BoatObservation
    from vrx_mj.sensors.readings import Reading

_ECCENTRICITY2 = FLATTENING * (2.0 - FLATTENING)
"""Square of the Earth's first eccentricity."""
_ANTENNA_SHARE = 0.5
"""Share of the antenna's height above which a first fix is of the antenna; a world may let the GPS give the place of
`base_link`."""

Point = tuple[float, float]
"""East and north [m], or a vector."""
_FIRST_ACCELERATIONS = np.full(6, 0.3)
"""Standard deviations of a boat's accelerations along and about three axes before any are measured [m/s2, rad/s2]."""
_ACCELERATION_WEIGHT = 0.05
"""Weight of a new square in the mean square of the accelerations."""
_NO_COVARIANCE = 1e-9 * np.eye(6)
"""Covariance of something without errors, as robot_localization's: filters need one above 0."""
_GATE_DISTANCE2 = 25.0
"""Squared Mahalanobis distance of a fix beyond which the boat was moved: the filter starts again there."""
_MAX_FIX_GAP = 1.0
"""Time without a fix after which the filter starts again [s]."""


@dataclass(frozen=True)
class TangentPlane:
    """East and north [m] of an origin on WGS84.

    Arcs of the meridian and of the parallel at the mean latitude, over the radii of curvature there (Fossen, Handbook
    of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 2.5): within 5 cm at 1 km, below 60 degrees.
    """

    latitude: float
    """Latitude of the origin [degrees]."""
    longitude: float
    """Longitude of the origin [degrees]."""

    def local(self, latitude: float, longitude: float) -> tuple[float, float]:
        """East and north [m] of a place [degrees]."""
        meridian, parallel = self._radii(0.5 * (latitude + self.latitude))
        apart = math.remainder(longitude - self.longitude, 360.0)
        return parallel * math.radians(apart), meridian * math.radians(latitude - self.latitude)

    def geodetic(self, east: float, north: float) -> tuple[float, float]:
        """Latitude and longitude [degrees] of a place [m]."""
        middle = self.latitude
        for _ in range(2):  # the mean latitude is that of the answer
            meridian, _ = self._radii(middle)
            latitude = self.latitude + math.degrees(north / meridian)
            middle = 0.5 * (latitude + self.latitude)
        longitude = self.longitude + math.degrees(east / self._radii(middle)[1])
        return latitude, math.remainder(longitude, 360.0)

    @staticmethod
    def _radii(latitude: float) -> tuple[float, float]:
        """Radii of the meridian's curvature and of the parallel at a latitude [degrees], in m."""
        angle = math.radians(latitude)
        root = math.sqrt(1.0 - _ECCENTRICITY2 * math.sin(angle) ** 2)
        return SEMI_MAJOR * (1.0 - _ECCENTRICITY2) / root**3, SEMI_MAJOR / root * math.cos(angle)


def polar(length: float, direction: float) -> Point:
    """The vector of a length in a direction [rad]."""
    return length * math.cos(direction), length * math.sin(direction)


def direction_to(origin: Point, place: Point) -> float:
    """The direction [rad] of a place as seen from an origin."""
    return math.atan2(place[1] - origin[1], place[0] - origin[0])


def in_axes(direction: float, east: float, north: float) -> Point:
    """The parts of a vector along a direction [rad] and to port of it."""
    return from_axes(-direction, east, north)


def from_axes(direction: float, ahead: float, left: float) -> Point:
    """The vector, east and north, with these parts along a direction [rad] and to port of it."""
    cos, sin = math.cos(direction), math.sin(direction)
    return ahead * cos - left * sin, ahead * sin + left * cos


def beside(origin: Point, direction: float, ahead: float, left: float = 0.0) -> Point:
    """The place that is so far [m] from an origin along a direction [rad] and to port of it."""
    cos, sin = math.cos(direction), math.sin(direction)
    return origin[0] + ahead * cos - left * sin, origin[1] + ahead * sin + left * cos


class Place:
    """Something at a place on the water."""

    x: float
    y: float

    @property
    def place(self) -> Point:
        """Where it is [m]."""
        return self.x, self.y

    def to(self, x: float, y: float) -> tuple[float, float]:
        """Distance [m] and direction [rad] of a place from here."""
        return math.hypot(x - self.x, y - self.y), math.atan2(y - self.y, x - self.x)


_Placed = TypeVar("_Placed", bound=Place)


def nearest(things: Iterable[_Placed], here: Point) -> _Placed | None:
    """The nearest of some things; None of none."""
    return min(things, key=lambda thing: math.dist(thing.place, here), default=None)


@dataclass(frozen=True)
class Estimate(Place):
    """Where a boat's `base_link` is and how it moves, now."""

    x: float
    """East of the local origin [m]."""
    y: float
    """North of the local origin [m]."""
    z: float
    """Above the water at rest [m]."""
    heading: float
    """Heading [rad], counter-clockwise from east."""
    vx: float
    """Velocity to the east [m/s]."""
    vy: float
    """Velocity to the north [m/s]."""
    turn: float
    """Turning rate [rad/s], positive to port."""
    rotation: FloatArray = field(repr=False)
    """Rotation (3, 3), body to east-north-up."""

    @property
    def surge(self) -> float:
        """Velocity ahead [m/s]."""
        return in_axes(self.heading, self.vx, self.vy)[0]

    @property
    def sway(self) -> float:
        """Velocity to port [m/s]."""
        return in_axes(self.heading, self.vx, self.vy)[1]


class Spin:
    """Angular velocity at the last reading of a unit whose rates are means since the one before, seen or not."""

    def __init__(self) -> None:
        self._time, self._interval, self._mean, self._now = -math.inf, math.inf, np.zeros(3), np.zeros(3)

    def __call__(self, time: float, mean: FloatArray) -> FloatArray:
        """The rate at the time of a reading [s] by its mean rate [rad/s], (3,): half an interval further on."""
        if time != self._time:
            passed = time - self._time
            self._interval = min(self._interval, passed)  # who looks less often than the unit measures misses some
            known = passed <= _MAX_FIX_GAP
            self._now = mean + 0.5 * self._interval / passed * (mean - self._mean) if known else mean
            self._time, self._mean = time, mean
        return self._now


class Navigator:
    """Estimates from one boat's sensors, call by call.

    A boat without GPS or inertial unit, and a world without a georeference, where a GPS cannot work, leave no choice
    but ground truth: it is then taken from the observation, with one warning, and the local frame is the world's.
    """

    def __init__(self) -> None:
        self.plane: TangentPlane | None = None
        """The local frame; None before the first estimate, and with ground truth."""
        self._antenna: tuple[float, ...] = (0.0, 0.0, 0.0)
        self._spin = Spin()
        self._truth = False

    def __call__(self, boat: "BoatObservation", t: float) -> Estimate:
        """Where the boat is at the time `t` [s]."""
        readings = None if self._truth else self._readings(boat)
        if readings is None:
            return true_estimate(boat)
        fix, inertia, age = readings[0].data, readings[1].data, t - readings[0].time
        turned = rotation_matrix(inertia.orientation)
        if self.plane is None:
            self._begin(readings[0], turned)
        north, west, up = fix.velocity
        antenna = np.array([*self._local(fix.latitude, fix.longitude), fix.altitude]), np.array([-west, north, up])
        spin = self._spin(readings[1].time, inertia.angular_velocity)
        _, place, velocity = base_link_by(*antenna, self._antenna, turned, spin)
        (x, y, z), (vx, vy, _), turn = place.tolist(), velocity.tolist(), float((turned @ inertia.angular_velocity)[2])
        return Estimate(
            x=x + vx * age,
            y=y + vy * age,
            z=z,
            heading=_heading(turned) + turn * (t - readings[1].time),
            vx=vx,
            vy=vy,
            turn=turn,
            rotation=turned,
        )

    def place(self, place: Mapping[str, Any]) -> tuple[float, float]:
        """A place of a task, {latitude, longitude} or {x, y}, in the local frame [m]."""
        if self.plane is not None and place.get("latitude") is not None:
            return self._local(float(place["latitude"]), float(place["longitude"]))
        return float(place["x"]), float(place["y"])

    def direction(self, place: Mapping[str, Any]) -> float:
        """The yaw of a task's place in the local frame [rad], from -pi to pi; 0 if it has none."""
        yaw = place.get("yaw") or 0.0
        return math.remainder(yaw if self.plane is None else place.get("yaw_from_east", yaw), math.tau)

    def report(self, x: float, y: float) -> dict[str, float]:
        """A place of the local frame [m] in the form that tasks take: by latitude and longitude, if there are."""
        if self.plane is None:
            return {"x": x, "y": y}
        latitude, longitude = self.plane.geodetic(x, y)
        return {"latitude": latitude, "longitude": longitude}

    def _local(self, latitude: float, longitude: float) -> tuple[float, float]:
        assert self.plane is not None, "before the first fix"
        return self.plane.local(latitude, longitude)

    def _begin(self, reading: "Reading", turned: FloatArray) -> None:
        """Lay the local frame where the boat is at the first fix."""
        fix, mount = reading.data, reading.mount
        self.plane = TangentPlane(fix.latitude, fix.longitude)
        if mount is not None and fix.altitude > _ANTENNA_SHARE * mount.position[2]:
            self._antenna = tuple(float(value) for value in mount.position)
            east, north, _ = turned @ self._antenna
            self.plane = TangentPlane(*self.plane.geodetic(-float(east), -float(north)))

    def _readings(self, boat: "BoatObservation") -> "tuple[Reading, Reading] | None":
        """Readings of GPS and inertial unit; None without a GPS."""
        try:
            gps, imu = sensor_named(boat, "gps"), sensor_named(boat, "imu")
            if gps and imu:
                return boat.sensors[gps], boat.sensors[imu]
            missing = "GPS" if not gps else "IMU"
            why = f"the boat has no {missing}"
        except VrxError as error:
            why = str(error)
        self._truth = True
        warn(f"navigation by ground truth: {why}", 3)
        return None


def base_link_by(
    place: FloatArray,
    velocity: FloatArray,
    antenna: Sequence[float] | FloatArray,
    rotation: FloatArray,
    spin: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Arm of the antenna, and place and velocity of `base_link` by those of the antenna, (3,) each, along local axes.

    Args:
        place: of the antenna [m].
        velocity: of the antenna [m/s].
        antenna: its place on the body [m].
        rotation: (3, 3), body to local axes.
        spin: angular velocity about the body's axes [rad/s].
    """
    arm, (p, q, r) = rotation @ antenna, rotation @ spin
    x, y, z = arm
    return arm, place - arm, velocity - np.array([q * z - r * y, r * x - p * z, p * y - q * x])


def sensor_named(boat: "BoatObservation", kind: str) -> str | None:
    """The first of a boat's sensors whose name has `kind` in it."""
    return next((name for name in boat.sensors if kind in name.lower()), None)


def _heading(turned: FloatArray) -> float:
    return math.atan2(float(turned[1, 0]), float(turned[0, 0]))


def true_estimate(boat: "BoatObservation") -> Estimate:
    """Where a boat really is, in the world frame."""
    turned = rotation_matrix(boat.quaternion)
    vx, vy, _ = (float(value) for value in turned @ boat.velocity)
    x, y, z = (float(value) for value in boat.position)
    turn = float((turned @ boat.angular_velocity)[2])
    return Estimate(x, y, z, _heading(turned), vx, vy, turn, turned)


class Odometry(NamedTuple):
    """Where a boat's `base_link` is and how it moves."""

    position: FloatArray
    """Position of `base_link`, (3,) [m], along the world's axes."""
    rotation: FloatArray
    """Rotation (3, 3), body to world."""
    velocity: FloatArray
    """Velocity, (3,) [m/s], along the body's axes."""
    spin: FloatArray
    """(3,) angular velocity [rad/s], about the body's axes."""
    pose_covariance: FloatArray = _NO_COVARIANCE
    """Covariance (6, 6) of position and orientation, along and about the world's axes."""
    twist_covariance: FloatArray = _NO_COVARIANCE
    """Covariance (6, 6) of velocity and spin, along and about the body's axes."""


def true_odometry(boat: "BoatObservation") -> Odometry:
    """Where a boat really is."""
    return Odometry(boat.position, rotation_matrix(boat.quaternion), boat.velocity, boat.angular_velocity)


class Localizer:
    """Estimates from one boat's sensors, call by call."""

    def __init__(self, gps: "Mounted", imu: "Mounted", earth: Geodetic, antenna: FloatArray) -> None:
        """Use two sensors in a world on the Earth; fixes are of the `antenna`, a place on the boat (3,) [m]."""
        self._gps, self._imu, self._earth, self._antenna = gps.config, imu, earth, antenna
        self._axes = np.array([earth.from_east_north_up(*axis) for axis in np.eye(3)]).T
        self._time = self._turned = -np.inf
        self._position, self._velocity, self._spin = np.zeros((3, 3))
        self._present_spin = Spin()
        self._spread = self._unsteady = self._drift = _NO_COVARIANCE[:3, :3]
        """Covariances of the filtered position, of the velocity, and of slow errors of fixes, which no filter finds."""
        self._jolts = np.square(_FIRST_ACCELERATIONS)
        """(6,) mean squares of accelerations along the world's axes and about the body's."""
        self.fixed = -np.inf, np.zeros(3), _NO_COVARIANCE
        """Time of the last fix, the place of `base_link` by it alone [m], and its covariance, in the world's axes."""

    def __call__(self, boat: "BoatObservation", t: float) -> Odometry:
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
        return Odometry(position, turned, velocity, self._spin, _joint(place, slanted), _joint(motion, unsure))

    def _feel(self, reading: "Reading") -> None:
        """See how the boat shakes."""
        spin, passed = self._imu.mount.rotation @ reading.data.angular_velocity, reading.time - self._turned
        force = self._axes @ rotation_matrix(reading.data.orientation) @ reading.data.linear_acceleration
        if 0.0 < passed <= _MAX_FIX_GAP:
            jolts = np.concatenate([force - (0.0, 0.0, STANDARD_GRAVITY), (spin - self._spin) / passed])
            self._jolts = (1.0 - _ACCELERATION_WEIGHT) * self._jolts + _ACCELERATION_WEIGHT * jolts**2
        self._turned, self._spin = reading.time, spin

    def _take(self, reading: "Reading", inertia: "Reading") -> None:
        """Correct by a new fix."""
        fix, dt = reading.data, reading.time - self._time
        turned, slanted, unsure = self._attitude(inertia, reading.time)
        north, west, up = fix.velocity
        place = np.array(self._earth.to_enu(fix.latitude, fix.longitude, fix.altitude))
        antenna = place, self._axes @ (-west, north, up)
        arm, measured, velocity = base_link_by(
            *antenna, self._antenna, turned, self._present_spin(self._turned, self._spin)
        )
        unsteady = self._in_world(variances(self._gps.velocity)) + _lever(arm, turned @ unsure @ turned.T)
        noise = self._in_world(np.square(self._gps.position.noise)) + _NO_COVARIANCE[:3, :3]
        self._drift = self._in_world(np.square(self._gps.position.drift)) + _lever(arm, slanted)
        self.fixed = reading.time, measured, _joint(noise + self._drift, np.zeros((3, 3)))
        position, spread = measured, noise
        if 0.0 < dt <= _MAX_FIX_GAP:
            expected = self._position + 0.5 * dt * (self._velocity + velocity)
            before = self._spread + dt**2 * unsteady + 0.25 * dt**4 * np.diag(self._jolts[:3])
            weights, miss = before @ np.linalg.inv(before + noise), measured - expected
            if miss @ np.linalg.solve(before + noise + self._drift, miss) < _GATE_DISTANCE2:
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
        """Covariance (3, 3) in the world's axes of errors along east, north and up."""
        covariance: FloatArray = self._axes * variance @ self._axes.T
        return covariance


def _lever(arm: FloatArray, covariance: FloatArray) -> FloatArray:
    """Covariance (3, 3) of the end of a lever whose turns have a covariance."""
    across = np.cross(arm, np.eye(3))
    moved: FloatArray = across @ covariance @ across.T
    return moved


def _joint(one: FloatArray, other: FloatArray) -> FloatArray:
    """Two covariances as one (6, 6) of six errors."""
    return np.block([[one, np.zeros((3, 3))], [np.zeros((3, 3)), other]]) + _NO_COVARIANCE
