"""Controllers of the acoustic tasks: reach a beacon that lies still, or follow one that swims."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.control.buoy_map import Lookout
from vrx_mj.control.guidance import approach_speed, around, clear_of, wrap_angle
from vrx_mj.control.navigation import Estimate, Point, beside, direction_to, sensor_named
from vrx_mj.control.pilot import POSITION_RATE, Commands, Moment, Skipper

if TYPE_CHECKING:
    from vrx_mj.sensors.readings import Sound


_LEGS = ((50.0, 0.0), (100.0, 0.0), (100.0, 0.7), (150.0, 0.35), (100.0, -0.7), (150.0, -0.35))
"""Search legs: distances [m] and angles [rad] from where the search began. A lidar sees things at 60 to 110 m."""
SEARCH_TIME = 40.0
"""Longest time spent on one leg [s]: a shore may lie before its end."""
_ARRIVAL_DISTANCE = 6.0
"""A leg ends within this distance of its end point [m]."""
_COURSE_SECTOR = 1.9
"""Boats begin with the bow toward the course. What lies at a larger angle from it [rad] is taken for shore."""
_ROW_SPACING, _ROW_NEIGHBOURS = 12.0, 1
"""Something with more unknown neighbours than this within this distance [m] is one of the stones of a shore."""

RANGE_NOISE = 3.0
"""Standard deviation of a range [m]: VRX's wamv_pinger.xacro."""
ANGLE_NOISE = 0.01
"""Standard deviation of a bearing and of an elevation [rad]: VRX's wamv_pinger.xacro."""
_DEPTH, _DEPTH_NOISE = -1.0, 1.5
"""Height of a still beacon before anything is heard, mean and standard deviation [m]: in the upper 3 m of the water."""
_MOVING_HEIGHT = 2.0
"""Height or depth of a moving beacon [m]; VRX 3's swims under water and is heard from above."""
_BEACON_ACCELERATION = 0.5
"""Standard deviation of a moving beacon's acceleration [m/s2], as white noise over 1 s."""
_LEAST_ELEVATION = 4.0 * ANGLE_NOISE
"""Smallest elevation from which a distance is computed [rad]."""
_PASSING_SPEED = 1.5
"""Speed above that of an approach which stops at the beacon [m/s]: the boat only has to pass by."""
_HEADING_HOLD_DISTANCE = 3.0
"""Within this distance of its goal the boat keeps its heading [m]: bearings are unreliable there."""
_BUOY_CLEARANCE = 4.2
"""Distance to keep from buoys [m]: half the boat's length, the buoy's radius, and 1.5 m."""
_SPEED_AMONG_BUOYS = 3.0
"""Largest speed among buoys [m/s]."""


def in_a_row(place: Point, others: Iterable[Point]) -> bool:
    """Whether an unknown thing is one of a row: a lidar sees the stones of a shore one by one."""
    return sum(0.0 < math.dist(place, other) < _ROW_SPACING for other in others) > _ROW_NEIGHBOURS


class Roam:
    """A search: places ahead of where it began, one after the other."""

    def __init__(self, place: Point, heading: float, time: float) -> None:
        """Begin at a place [m] with a heading [rad] at a time [s]."""
        self._place, self._heading, self._since = place, heading, time
        self._leg = 0

    def next(self, seen: Estimate, time: float) -> Point:
        """The place to go to now [m]."""
        if seen.to(*self._goal)[0] < _ARRIVAL_DISTANCE or time - self._since > SEARCH_TIME:
            self._leg, self._since = self._leg + 1, time
        return self._goal

    def may_be_course(self, place: Point, reach: float) -> bool:
        """Whether a place may belong to the course: it lies within `reach` [m] ahead of where the search began."""
        bearing = direction_to(self._place, place)
        return math.dist(place, self._place) < reach and abs(wrap_angle(bearing - self._heading)) < _COURSE_SECTOR

    @property
    def _goal(self) -> Point:
        away, angle = _LEGS[self._leg % len(_LEGS)]
        return beside(self._place, self._heading + angle, away)


@dataclass(frozen=True)
class SoundBearing:
    """Direction and range of a beacon from one sound, in the local frame."""

    position: FloatArray
    """Position of the boat at that time, (3,) [m]."""
    direction: FloatArray
    """Unit vector to the beacon, (3,)."""
    range: float
    """Range [m]; noise can make it negative."""
    elevation: float
    """Elevation above the horizontal [rad]."""


def sound_bearing(sound: "Sound", seen: Estimate, age: float) -> SoundBearing:
    """The bearing of a receiver's reading that is `age` [s] old, for a boat whose state now is `seen`."""
    level = math.cos(sound.elevation)
    own = (level * math.cos(sound.bearing), level * math.sin(sound.bearing), math.sin(sound.elevation))
    direction = seen.rotation @ own
    position = np.array([seen.x - seen.vx * age, seen.y - seen.vy * age, seen.z])
    return SoundBearing(position, direction, float(sound.range), math.asin(max(-1.0, min(1.0, float(direction[2])))))


class StillBeacon:
    """Least squares over all sounds, as an information filter of the beacon's position.

    A sound is a point, at its range in its direction, whose error is 3 m along the direction and 1 % of the distance
    across it. Bearings from two places cross sharply, so the estimate is good long before the boat is there.
    """

    def __init__(self) -> None:
        weight = _DEPTH_NOISE**-2
        self._information = np.diag([0.0, 0.0, weight])
        self._sum = np.array([0.0, 0.0, weight * _DEPTH])
        self.place: tuple[float, float] | None = None
        """East and north [m]; None before the first sound."""

    def update(self, sound: SoundBearing) -> None:
        """Add a sound to the estimate."""
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
    """A Kalman filter of a beacon's place and velocity on the water; its acceleration is white noise.

    At short distance the elevation of a beacon whose height is known gives its distance better than the range does: at
    8 m within 0.3 m. Both are used, each with its weight.
    """

    def __init__(self) -> None:
        self._state: FloatArray | None = None
        self._covariance = np.diag([0.0, 0.0, 1.0, 1.0])
        self._time = 0.0

    def update(self, sound: SoundBearing, t: float) -> None:
        """Add a sound heard at the time `t` [s] to the estimate."""
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
        self._covariance = step @ self._covariance @ step.T + _BEACON_ACCELERATION**2 * noise
        return np.asarray(step @ state)


def _on_water(sound: SoundBearing) -> tuple[FloatArray, FloatArray]:
    """The beacon's place from one sound [m], east and north, and its covariance [m2]."""
    level = math.cos(sound.elevation)
    distance, weight = sound.range * level, RANGE_NOISE**-2
    if abs(sound.elevation) > _LEAST_ELEVATION:
        rise = abs(math.copysign(_MOVING_HEIGHT, sound.elevation) - float(sound.position[2]))
        by_angle = rise / math.tan(abs(sound.elevation))
        sharp = (ANGLE_NOISE * (by_angle**2 + rise**2) / rise) ** -2
        distance, weight = (distance * weight + by_angle * sharp) / (weight + sharp), weight + sharp
    ahead = sound.direction[:2] / max(level, 1e-9)
    along = np.outer(ahead, ahead)
    across = ANGLE_NOISE * max(1.0, abs(distance))
    return sound.position[:2] + distance * ahead, along / weight + (np.eye(2) - along) * across**2


class Listener(Skipper):
    """A skipper who hears a beacon through the boat's acoustic receiver."""

    def begin(self) -> None:
        """Forget all sounds."""
        self._count = -1

    def newest_sound(self, now: Moment) -> SoundBearing | None:
        """The newest sound, or None if there is none since the last call."""
        name = sensor_named(now.boat, "pinger") or sensor_named(now.boat, "receiver")
        if name is None:
            return None
        reading = now.boat.sensors[name]
        if reading.sequence == self._count:
            return None
        self._count = reading.sequence
        return sound_bearing(reading.data, now.seen, now.t - reading.time)


class BeaconSeeker(Listener):
    """Goes to the beacon of an acoustic perception task, whose position `StillBeacon` estimates.

    The task ends within 3 m of the beacon, even before it is `running`. So the boat listens while it is held, leaves
    as soon as it is released, goes as fast as it can, and does not stop at the beacon.
    """

    def begin(self) -> None:
        """Forget the beacon, at the start of a run."""
        super().begin()
        self._beacon = StillBeacon()

    def listen(self, now: Moment) -> None:
        """Add a sound to the estimate, also before the boat is released."""
        sound = self.newest_sound(now)
        if sound is not None:
            self._beacon.update(sound)

    def steer(self, now: Moment) -> Commands:
        """Commands that lead to the estimated position of the beacon."""
        if self._beacon.place is None:
            return self.stop(now)
        distance, bearing = now.seen.to(*self._beacon.place)
        speed = min(self.pilot.top_speed, _PASSING_SPEED + approach_speed(distance, POSITION_RATE, self.pilot.braking))
        return self.sail(now, speed, bearing, bearing if distance > _HEADING_HOLD_DISTANCE else now.seen.heading)


class BeaconFollower(Listener):
    """Follows the beacon of an acoustic tracking task, whose position and velocity `MovingBeacon` estimates.

    The commanded velocity is that of the beacon plus one toward the beacon. The beacon moves under the buoys, and the
    boat goes around what its lidar sees: a collision costs as much as one metre of mean distance.
    """

    def begin(self) -> None:
        """Forget the beacon and the buoys, at the start of a run."""
        super().begin()
        self._beacon, self._lookout = MovingBeacon(), Lookout()

    def listen(self, now: Moment) -> None:
        """Add a sound to the estimate once the task runs; before, the beacon is elsewhere."""
        if now.task.get("state", "running") != "running":
            return
        sound = self.newest_sound(now)
        if sound is not None:
            self._beacon.update(sound, now.t)
        self._lookout.look(now, colors=False)

    def steer(self, now: Moment) -> Commands:
        """Commands that follow the beacon around the buoys."""
        beacon, seen = self._beacon.at(now.t), now.seen
        if beacon is None:
            return self.stop(now)
        discs = [(buoy.place, _BUOY_CLEARANCE) for buoy in self._lookout.map.sure]
        goal = clear_of(beacon[:2], discs)
        aim = around(seen.place, goal, discs)
        distance, bearing = seen.to(*goal)[0], seen.to(*aim)[1]
        speed = min(_SPEED_AMONG_BUOYS, approach_speed(distance, POSITION_RATE, self.pilot.braking))
        drift = beacon[2:] if aim == beacon[:2] else (0.0, 0.0)
        velocity = beside(drift, bearing, speed)
        return self.pilot.sail(seen, now.t, *velocity, bearing if distance > _HEADING_HOLD_DISTANCE else seen.heading)
