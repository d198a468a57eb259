"""Navigation: where a boat is and how it moves, from its GPS and its inertial unit, in a local frame of its own.

The frame is level and east-north, its origin where the first fix was. VRX's GPS errs by a millimetre and its velocity
by 2 cm/s, its inertial unit's attitude not at all: nothing needs a filter; a fix is only carried on to the present.
`localization` filters the same measurement for receivers that err more, by the figures of the sensors' files, which an
observation does not have.
"""

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.frames import FLATTENING, SEMI_MAJOR, rotation_matrix

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation
    from vrx_mj.sensors.readings import Reading

_ECCENTRICITY2 = FLATTENING * (2.0 - FLATTENING)
"""Square of the Earth's first eccentricity."""
_ABOVE_WATER = 0.7
"""A first fix higher than this [m] is of the antenna, 1.3 m up; VRX classic's plugin gives the place of `base_link`."""

Point = tuple[float, float]
"""East and north [m], or a vector."""


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


def in_axes(direction: float, east: float, north: float) -> Point:
    """The parts of a vector along a direction [rad] and to port of it."""
    cos, sin = math.cos(direction), math.sin(direction)
    return east * cos + north * sin, north * cos - east * sin


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
    """(3, 3): body to east-north-up."""

    @property
    def surge(self) -> float:
        """Velocity ahead [m/s]."""
        return in_axes(self.heading, self.vx, self.vy)[0]

    @property
    def sway(self) -> float:
        """Velocity to port [m/s]."""
        return in_axes(self.heading, self.vx, self.vy)[1]


class Navigator:
    """Estimates from one boat's sensors, call by call.

    A boat without GPS or inertial unit, and a world without a georeference, where a GPS cannot work, leave no choice
    but ground truth: it is then taken from the observation, with one warning, and the local frame is the world's.
    """

    def __init__(self) -> None:
        self.plane: TangentPlane | None = None
        """The local frame; None before the first estimate, and with ground truth."""
        self._antenna: tuple[float, ...] = (0.0, 0.0, 0.0)
        self._truth = False

    def __call__(self, boat: "BoatObservation", t: float) -> Estimate:
        """Where the boat is at the time `t` [s]."""
        readings = None if self._truth else self._readings(boat)
        if readings is None:
            return true_estimate(boat)
        fix, inertia, age = readings[0].data, readings[1].data, t - readings[0].time
        turned = rotation_matrix(inertia.orientation)
        if self.plane is None:
            self._begin(readings[0])
        north, west, up = fix.velocity
        antenna = np.array([*self._local(fix.latitude, fix.longitude), fix.altitude]), np.array([-west, north, up])
        _, place, velocity = base_link_by(*antenna, self._antenna, turned, inertia.angular_velocity)
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

    def _begin(self, reading: "Reading") -> None:
        """Lay the local frame at the first fix."""
        fix, mount = reading.data, reading.mount
        self.plane = TangentPlane(fix.latitude, fix.longitude)
        if fix.altitude > _ABOVE_WATER and mount is not None:
            self._antenna = tuple(float(value) for value in mount.position)

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
        warnings.warn(f"navigation by ground truth: {why}", VrxWarning, stacklevel=3)
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
