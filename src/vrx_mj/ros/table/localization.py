"""What robot_localization gives, as VRX's example of it: a boat in a frame of its own, by its sensors or as it is."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.control.localization import Localizer, Located, truly_located
from vrx_mj.errors import CommandError
from vrx_mj.frames import matrix_quaternion, rotation
from vrx_mj.ros.interface import BOTH, Output, Service
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.table.boats import BASE, WORLD_FRAME, transform
from vrx_mj.ros.table.host import Host, header
from vrx_mj.runtime.observation import Observation

Source = Literal["truth", "navigator"]
"""What a boat is localized by: as it is, or its GPS and inertial unit."""
_ODOMETRY = "nav_msgs/Odometry"
_UNTURNED = np.eye(4)[0]
_RATE = 30.0
"""[Hz], as robot_localization's."""
_HIGHEST = 1e5
"""Altitude of a place that is asked about [m]."""
_KNOWN, _AUGMENTED = 3, 2
"""COVARIANCE_TYPE_KNOWN of sensor_msgs/NavSatFix, and STATUS_GBAS_FIX of NavSatStatus, as robot_localization's."""


class Localization:
    """One boat's. Its frame `BOAT/odom` is east-north-up at the world's origin, until it is given another datum."""

    def __init__(self, host: Host, boat: str, source: Source) -> None:
        """CommandError: the boat has no GPS or no inertial unit, and is to be found by these."""
        parameters, self._stem = host.sim.world.parameters, f"/{boat}/robot_localization"
        self._host, self._boat, self._earth = host, boat, parameters.georeference
        self._east, self._sent = parameters.x_from_east, -math.inf
        self._origin, self._axes = np.zeros(3), np.array(rotation(0.0, 0.0, -self._east))
        """Position of the frame in `map` [m], and rotation matrix, frame to `map`."""
        self._located: tuple[Observation, Located] | None = None
        self._localizer: Localizer | None = None
        if source == "navigator":
            first = {one.config.type: one for one in reversed(host.sim.mounted(boat))}
            missing = [f"{boat} has no {name.upper()}" for name in ("gps", "imu") if name not in first]
            if missing or self._earth is None:
                why = (*missing, "the world has no georeference")[0]
                raise CommandError(f"{why}: {boat} is not localized by its sensors; use --localization truth")
            antenna = np.zeros(3) if "gps" in parameters.at_base_link else first["gps"].mount.position
            self._localizer = Localizer(first["gps"], first["imu"], self._earth, antenna)

    @property
    def now(self) -> Located:
        """Where the boat is at the present moment, in the world's axes."""
        seen = self._host.observation
        if self._located is None or self._located[0] is not seen:
            by_sensors = self._localizer and self._localizer(seen[self._boat], self._host.sim.time)
            self._located = seen, by_sensors or truly_located(seen[self._boat])
        return self._located[1]

    def frames(self) -> list[Message]:
        """geometry_msgs/TransformStamped of `BOAT/odom` in `map`, and of the boat in that."""
        time, odom, located = self._host.sim.time, f"{self._boat}/odom", self.now
        place, turn = self._in_odom(located.position), matrix_quaternion(self._axes.T @ located.rotation)
        return [
            transform(time, WORLD_FRAME, odom, self._origin, matrix_quaternion(self._axes)),
            transform(time, odom, f"{self._boat}/{BASE}", place, turn),
        ]

    def outputs(self) -> Iterator[Output]:
        """Where it is, by all and by the fix alone, and the first as a fix."""
        output = partial(Output, rate=_RATE, dialects=BOTH, recorded="nowhere")
        yield output(f"{self._stem}/odometry/filtered", _ODOMETRY, self._filtered_odometry)
        if self._earth is not None:
            yield output(f"{self._stem}/odometry/gps", _ODOMETRY, self._by_gps)
            yield output(f"{self._stem}/gps/filtered", "sensor_msgs/NavSatFix", self._as_fix)

    def services(self) -> Iterator[Service]:
        """`fromLL`, `toLL` and `datum`, without a namespace, too, where there is one boat."""
        if self._earth is None:
            return
        service = partial(Service, dialects=BOTH)
        for stem in (self._stem, "")[: 2 if len(self._host.sim.boats) == 1 else 1]:
            yield service(
                f"{stem}/fromLL",
                "robot_localization/FromLL",
                lambda asked: {"map_point": self._in_odom(self._place(asked.ll_point))},
            )
            yield service(f"{stem}/toLL", "robot_localization/ToLL", self._to_geodetic)
            yield service(f"{stem}/datum", "robot_localization/SetDatum", self._set_datum)

    def _filtered_odometry(self) -> Message:
        located = self.now
        turn = matrix_quaternion(self._axes.T @ located.rotation)
        twist = {"linear": located.velocity, "angular": located.spin}
        return new(
            _ODOMETRY,
            header=header(self._host.sim.time, f"{self._boat}/odom"),
            child_frame_id=f"{self._boat}/{BASE}",
            pose=self._pose(located.position, located.pose_covariance, turn),
            twist={"twist": twist, "covariance": located.twist_covariance},
        )

    def _by_gps(self) -> Message | None:
        """Odometry of a new fix, without orientation."""
        located = self.now
        time, place, covariance = self._host.sim.time, located.position, located.pose_covariance
        if self._localizer is not None:
            time, place, covariance = self._localizer.fixed
        if time == self._sent:
            return None
        self._sent = time
        return new(_ODOMETRY, header=header(time, f"{self._boat}/odom"), pose=self._pose(place, covariance))

    def _pose(self, place: FloatArray, covariance: FloatArray, turn: FloatArray = _UNTURNED) -> dict[str, object]:
        """geometry_msgs/PoseWithCovariance in the boat's frame; position and covariance are in the world's axes."""
        axes = np.kron(np.eye(2), self._axes)
        pose = {"position": self._in_odom(place), "orientation": turn}
        return {"pose": pose, "covariance": axes.T @ covariance @ axes}

    def _as_fix(self) -> Message:
        located, turn = self.now, np.array(rotation(0.0, 0.0, self._east))
        return new(
            "sensor_msgs/NavSatFix",
            header=header(self._host.sim.time, f"{self._boat}/{BASE}"),
            status={"status": _AUGMENTED},
            position_covariance=turn @ located.pose_covariance[:3, :3] @ turn.T,
            position_covariance_type=_KNOWN,
            **self._geodetic(located.position),
        )

    def _to_geodetic(self, request: Message) -> dict[str, object]:
        point = np.array([request.map_point.x, request.map_point.y, request.map_point.z])
        if not np.isfinite(point).all():
            raise CommandError(f"invalid point {point.tolist()}: finite numbers are needed")
        return {"ll_point": self._geodetic(self._origin + self._axes @ point)}

    def _set_datum(self, request: Message) -> None:
        """Have the frame begin at another place, its x axis along the heading that is given, from east."""
        place, turn = self._place(request.geo_pose.position), request.geo_pose.orientation
        if not math.isfinite(turn.x + turn.y + turn.z + turn.w):
            raise CommandError(f"invalid orientation of the datum of {self._boat}: finite numbers are needed")
        self._axes = np.array(rotation(0.0, 0.0, 2.0 * math.atan2(turn.z, turn.w) - self._east))
        apart, self._origin = math.dist(self._origin, place), place
        if apart > 0.0:
            what = f"{self._boat}/odom moves by {apart:.4g} m in map, to the datum that it was given"
            self._host.warn_once(f"datum of {self._boat}", f"{what}: all in that frame jumps")

    def _place(self, point: Message) -> FloatArray:
        """(3,) of a geographic_msgs/GeoPoint in `map` [m]."""
        latitude, longitude = point.latitude, point.longitude
        altitude = None if math.isnan(point.altitude) else point.altitude  # geographic_msgs: it is not specified
        if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and abs(altitude or 0.0) <= _HIGHEST):
            allowed = f"latitudes to 90 degrees, longitudes to 180 degrees, altitudes to {_HIGHEST:g} m"
            raise CommandError(f"invalid place {latitude}, {longitude}, {altitude}; allowed: {allowed}, either way")
        assert self._earth is not None, "services are offered where there is one"
        return np.array(self._earth.to_enu(latitude, longitude, altitude))

    def _geodetic(self, position: FloatArray) -> dict[str, float]:
        """The fields of a place in `map` [m]."""
        assert self._earth is not None, "as there"
        return dict(zip(("latitude", "longitude", "altitude"), self._earth.to_geodetic(*position), strict=True))

    def _in_odom(self, position: FloatArray) -> FloatArray:
        place: FloatArray = self._axes.T @ (position - self._origin)
        return place
