"""Sensors of a boat: what they measure, how often, how well, and where they sit."""

import math
import operator
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.base import Config, Faults
from vrx_mj.config.values import Name, NonNegative, Number, Pose, Positive, Switch, Vec3, numbers, rising
from vrx_mj.frames import IDENTITY, ZERO

_Rate = Annotated[float, Field(gt=0, le=10_000)]
_RAYS = 1_000_000
"""Most rays of a lidar: so many take 24 MB."""
_Spread = Annotated[tuple[NonNegative, NonNegative, NonNegative], numbers("x y z")]
_Range = Annotated[tuple[NonNegative, Number], numbers("nearest farthest"), rising("the nearest", "the farthest")]


class ErrorModel(Config):
    """Hector's model of a measurement's error, along three axes: offset + drift + white noise."""

    offset: Vec3 = ZERO
    """Constant error, in the unit of the measurement."""
    drift: _Spread = ZERO
    """Standard deviation of the slow drift, a Gauss-Markov process, in the unit of the measurement."""
    drift_frequency: _Spread = (0.00027, 0.00027, 0.00027)
    """Reciprocal of the drift's time constant [1/s]."""
    noise: _Spread = ZERO
    """Standard deviation of the white noise, in the unit of the measurement."""


class _Sensor(Config):
    """Keys of all sensors."""

    name: Name
    """Name of the sensor on its boat."""
    link: str
    """Link that carries it, without the boat's namespace."""
    frame: str = ""
    """Frame of its readings, without the boat's namespace; by default the link."""
    pose: Pose = IDENTITY
    """Pose of the measuring frame (x forward, y left, z up) in the boat's `base_link` [m, rad]."""
    topic: str = ""
    """ROS topic or stem of topics, without the boat's namespace."""


class CameraConfig(_Sensor):
    """A pinhole camera without distortion, looking along x of its pose. `frame` is its optical frame."""

    type: Literal["camera"] = "camera"
    """Type of the sensor."""
    rate: _Rate = 30.0
    """Images per second [Hz]."""
    width: Annotated[int, Field(ge=1, le=8192)] = 1280
    """Columns of an image [pixels]."""
    height: Annotated[int, Field(ge=1, le=8192)] = 720
    """Rows of an image [pixels]."""
    horizontal_fov: Annotated[float, Field(gt=0, lt=3.1415)] = 1.3962634
    """Horizontal field of view [rad]."""
    near: Positive = 0.05
    """Nearest visible distance [m]."""
    far: Positive = 300.0
    """Farthest visible distance [m]."""
    noise: NonNegative = 0.007
    """Standard deviation of each pixel, as a fraction of full scale, the same in the three channels."""
    baseline: Number = 0.07
    """`hackBaseline` of Gazebo's plugin [m]: P[3] of the camera's info is -f times this."""
    info: Literal["vrx", "vrx3", "centered"] = "vrx"
    """Principal point in the camera's info: `vrx`, ((w + 1) / 2, (h + 1) / 2), for pixels counted from 1; `vrx3`,
    (w / 2, h / 2), for their edges; or `centered`, ((w - 1) / 2, (h - 1) / 2), for pixels counted from 0."""
    antialiasing: Annotated[Literal[0, 2, 4], Field(exclude_if=operator.not_)] = 0
    """Samples per pixel for smooth edges, which take two to three times as long; 0 for none."""
    labels: Annotated[Switch, Field(exclude_if=operator.not_)] = False
    """Whether its images come with the names, boxes and masks of the objects they show."""

    def _faults(self) -> Faults:
        if self.near >= self.far:
            yield (), f"invalid near {self.near:g} m and far {self.far:g} m: near must be below far"


class LidarConfig(_Sensor):
    """A lidar: `points` from several rings, or a planar `scan` from one."""

    type: Literal["lidar"] = "lidar"
    """Type of the sensor."""
    output: Literal["points", "scan"] = "points"
    """Output: a point cloud, or the ranges of one planar ring."""
    rate: _Rate = 10.0
    """Scans per second [Hz]."""
    rings: Annotated[int, Field(ge=1, le=256)] = 16
    """Number of rings."""
    samples: Annotated[int, Field(ge=1, le=100_000)] = 1875
    """Rays per ring."""
    azimuth: tuple[Number, Number] = (-3.14159265358979, 3.14159265358979)
    """First and last ray [rad], counter-clockwise from x."""
    elevation: tuple[Number, Number] = (-0.2617993877991494, 0.2617993877991494)
    """Lowest and highest ring [rad], positive up."""
    range: _Range = (0.1, 130.0)
    """Nearest and farthest return [m]."""
    resolution: NonNegative = 0.0
    """Resolution of the range [m]; 0 for none."""
    noise: NonNegative = 0.01
    """Standard deviation of the range [m]."""
    sea_returns: Switch = False
    """Whether water reflects; in VRX it does not."""

    def _faults(self) -> Faults:
        if max(abs(angle) for angle in self.azimuth) > 2.0 * math.pi:
            yield (), f"invalid azimuth {list(self.azimuth)} rad: at most a full turn, 2 pi, either way"
        if max(abs(angle) for angle in self.elevation) > 1.571:
            yield (), f"invalid elevation {list(self.elevation)} rad: from -pi/2 to pi/2 is needed"
        if self.output == "scan" and self.rings != 1:
            yield (), f"a scan has one ring, got {self.rings}; write `output: points` for several"
        if self.rings * self.samples > _RAYS:
            yield (), f"{self.rings} rings of {self.samples} samples: at most {_RAYS} rays"


class GpsConfig(_Sensor):
    """A satellite receiver: fix and velocity."""

    type: Literal["gps"] = "gps"
    """Type of the sensor."""
    rate: _Rate = 15.0
    """Fixes per second [Hz]."""
    position: ErrorModel = ErrorModel()
    """Errors along the world's x, y and z axes [m], in Hector's model."""
    velocity: ErrorModel = ErrorModel()
    """Errors along the world's x, y and z axes [m/s]."""


class ImuConfig(_Sensor):
    """An inertial measurement unit: orientation, angular rates, and accelerations including gravity."""

    type: Literal["imu"] = "imu"
    """Type of the sensor."""
    rate: _Rate = 15.0
    """Readings per second [Hz]."""
    acceleration: ErrorModel = ErrorModel()
    """Errors along the sensor's axes [m/s2]."""
    angular_velocity: ErrorModel = ErrorModel()
    """Errors about the sensor's axes [rad/s]."""
    heading: ErrorModel = ErrorModel()
    """Errors of the yaw [rad]; only the last of the three is used."""
    tilt: ErrorModel = ErrorModel()
    """Errors of roll and pitch [rad]; the last of the three is ignored."""


class P3dConfig(_Sensor):
    """Ground truth: pose and twist of a link in the world, optionally with noise."""

    type: Literal["p3d"] = "p3d"
    """Type of the sensor."""
    rate: _Rate = 10.0
    """Readings per second [Hz]."""
    noise: NonNegative = 0.0
    """Standard deviation of each component of the velocities [m/s, rad/s]."""


class PingerConfig(_Sensor):
    """A receiver of an acoustic beacon: range, bearing and elevation."""

    type: Literal["pinger"] = "pinger"
    """Type of the sensor."""
    rate: _Rate = 1.0
    """Readings per second [Hz]."""
    range_noise: NonNegative = 3.0
    """Standard deviation of the range [m]."""
    bearing_noise: NonNegative = 0.01
    """Standard deviation of the bearing [rad]."""
    elevation_noise: NonNegative = 0.01
    """Standard deviation of the elevation [rad]."""
    beacon: Annotated[Vec3, Field(exclude_if=lambda place: not any(place))] = ZERO
    """Initial position of the beacon in the world [m]."""


class BallShooterConfig(_Sensor):
    """A launcher that fires balls along x of its pose. Its reading is the number of shots left."""

    type: Literal["ball_shooter"] = "ball_shooter"
    """Type of the sensor."""
    rate: _Rate = 10.0
    """Readings per second [Hz]."""
    shots: Annotated[int, Field(ge=0, le=1000)] = 4
    """Number of balls at the start."""
    impulse: NonNegative = 0.3
    """Impulse of a shot [N s]; in VRX 300 N for 1 ms."""
    muzzle: Vec3 = (0.14, 0.0, 0.0)
    """Initial position of the ball in the launcher's frame [m]."""


class AnemometerConfig(_Sensor):
    """A wind sensor, usually at the masthead: the apparent wind in the plane of its x and y."""

    type: Literal["anemometer"] = "anemometer"
    """Type of the sensor."""
    rate: _Rate = 10.0
    """Readings per second [Hz]."""
    noise: NonNegative = 0.1
    """Standard deviation of the wind's velocity along x and y [m/s]."""


class GnssCompassConfig(_Sensor):
    """Two satellite antennas, the second one along x from the first: true heading and rate of turn."""

    type: Literal["gnss_compass"] = "gnss_compass"
    """Type of the sensor."""
    rate: _Rate = 10.0
    """Readings per second [Hz]."""
    heading_noise: NonNegative = 0.007
    """Standard deviation of the heading [rad]; 0.007 is typical for antennas 1 m apart."""
    turn_noise: NonNegative = 0.0035
    """Standard deviation of the rate of turn [rad/s]."""


class EchoSounderConfig(_Sensor):
    """An echo sounder: the distance to the bottom along x of its pose, which must point down."""

    type: Literal["echo_sounder"] = "echo_sounder"
    """Type of the sensor."""
    rate: _Rate = 10.0
    """Readings per second [Hz]."""
    range: _Range = (0.3, 100.0)
    """Nearest and farthest echo [m]."""
    noise: NonNegative = 0.02
    """Standard deviation of the distance [m]."""
    field_of_view: Annotated[float, Field(ge=0, lt=3.1415)] = 0.436
    """Width of the beam [rad], as stated in its messages. The measurement is along the middle of the beam."""


SensorConfig = Annotated[
    CameraConfig
    | LidarConfig
    | GpsConfig
    | ImuConfig
    | P3dConfig
    | PingerConfig
    | BallShooterConfig
    | AnemometerConfig
    | GnssCompassConfig
    | EchoSounderConfig,
    Field(discriminator="type"),
]
"""A sensor of any type."""
