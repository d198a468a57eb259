"""Instruments: anemometer, echo sounder, GNSS compass, GPS and IMU; and what a type of sensor consists of.

GPS and IMU are those of Hector's plugins for Gazebo: position on WGS84 and velocity north-west-up, and differences
between one measurement and the next. Hector takes the Earth for flat: degrees are metres over the radii of curvature
at the world's origin, and the height is z. Ours is the ellipsoid. At 1 km from the origin of VRX's Sydney the two
differ by 0.08 m in height (the world's water is a plane, which rises over the ellipsoid) and by at most 0.06 m on the
ground; at 100 m by less than 1 mm.

Errors are Hector's, too: offset, drift and white noise along three axes. Hector scales a drift's increments by the
interval instead of its root, so its size depends on the rate; here a drift has the standard deviation that is
configured. VRX configures none.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import (
    AnemometerConfig,
    EchoSounderConfig,
    ErrorModel,
    GnssCompassConfig,
    GpsConfig,
    ImuConfig,
    LidarConfig,
)
from vrx_mj.frames import Geodetic, compass, conjugate, quaternion_product, rotation_vector
from vrx_mj.physics.noise import axis_error, stream_key
from vrx_mj.sensors.readings import ApparentWind, Echo, Fix, Heading, Image, Inertia, Place, PointCloud, Scan

_POSITION, _VELOCITY = 0, 3
"""First axes of the errors."""
_ACCELERATION, _ANGULAR_VELOCITY, _HEADING, _TILT = 0, 3, 6, 9
"""First axes of the errors."""
_NO_ERRORS = ErrorModel()


class Draw:
    """The random numbers of one measurement of one sensor."""

    def __init__(self, seed: int, boat: str, sensor: str, index: int, rate: float, *, life: int = 0) -> None:
        self.key = _key(seed, boat, sensor, life)
        """Key of the sensor's stream."""
        self.index = index
        """Number of the measurement."""
        self.rate = rate
        """Measurements per second."""

    def error(
        self, axis: int, noise: float, *, offset: float = 0.0, drift: float = 0.0, frequency: float = 0.0
    ) -> float:
        """One error; every `axis` of a sensor is a stream of its own."""
        if noise == drift == 0.0:
            return offset
        return float(axis_error(np.uint64(self.key), axis, self.index, offset, drift, frequency / self.rate, noise))


@lru_cache(maxsize=4096)
def _key(seed: int, boat: str, sensor: str, life: int) -> int:
    """Key of a sensor's stream; a boat with the name of one that left, in its next `life`, has streams of its own."""
    return stream_key(seed, "sensor", boat, sensor, *([life] if life else []))


def errors(model: ErrorModel, draw: Draw, axis: int) -> FloatArray:
    """Errors (3,) along the axes of a model, whose streams are `axis` and the two after it."""
    return np.array([axis_of(model, draw, axis, k) for k in range(3)])


def axis_of(model: ErrorModel, draw: Draw, axis: int, k: int) -> float:
    """The error along axis `k` of a model whose first stream is `axis`."""
    offset, drift, frequency = model.offset[k], model.drift[k], model.drift_frequency[k]
    return draw.error(axis + k, model.noise[k], offset=offset, drift=drift, frequency=frequency)


def variances(model: ErrorModel) -> FloatArray:
    """Variances (3,) of the errors, drift included: what Hector's plugins write into covariances."""
    return np.square(model.drift) + np.square(model.noise)


def covariance(*variance: float) -> tuple[float, ...]:
    """Covariance (9,), row by row, of three errors that have nothing to do with each other."""
    return tuple(float(value) for value in np.diag(variance).flat)


class Measurement(Protocol):
    """Inputs of a reading, each computed on demand."""

    draw: Draw
    """Random numbers of this measurement."""

    @property
    def config(self) -> Any:
        """The sensor's configuration, of the class that its kind names."""

    @property
    def place(self) -> Place:
        """Where the sensor measures, and how that place moves."""

    @property
    def place_before(self) -> Place | None:
        """Place at the sensor's last measurement; None at the first."""

    @property
    def interval(self) -> float:
        """Time since the last measurement [s]; 0 at the first."""

    @property
    def gravity(self) -> FloatArray:
        """Acceleration of gravity, (3,) [m/s2], world axes."""

    @property
    def earth(self) -> Geodetic:
        """The world's place on Earth; SensorError if it has none."""

    @property
    def x_from_east(self) -> float:
        """Direction of the world's x axis [rad], counter-clockwise from east."""

    @property
    def marks(self) -> FloatArray:
        """The sensor's marks at this moment."""

    @property
    def wind(self) -> FloatArray:
        """Velocity of the air past the sensor, (3,) [m/s], its axes."""

    def picture(self) -> Image:
        """Picture of a camera at the sensor's place."""

    def scan(self) -> PointCloud | Scan:
        """Returns of a lidar at the sensor's place."""

    def echo(self) -> float:
        """How far along an echo sounder's beam the bottom is [m]; inf without an echo."""


@dataclass(frozen=True)
class RecordedNumbers:
    """How a recording holds a reading's data: the numbers of its first fields, one after another."""

    count: Callable[[Any], int]
    """How many numbers there are, by the sensor's configuration."""
    data: Callable[[FloatArray, Any], Any]
    """The data of the numbers, with what follows from the sensor's configuration."""
    fields: int | None = None
    """How many fields of the data are held; None for all."""
    problem: Callable[[FloatArray], str] = lambda _numbers: ""
    """Returns what is wrong with numbers of a file; empty if nothing is."""


@dataclass(frozen=True)
class Plot:
    """A plot in recordings."""

    name: str
    """Last part of its path."""
    title: str
    """Heading of the plot, with the unit."""
    values: Callable[[Any], Any]
    """Returns what the plot shows of a reading's data: a number, or three."""
    axes: bool = False
    """Whether there are three numbers, along x, y and z."""


@dataclass(frozen=True)
class SensorKind:
    """A type of sensor: all its parts that are not of ROS. Its topics are in `ros.table.sensing.TOPICS`."""

    config: type[Any]
    """Class of the sensor's configuration in `config.sensors`."""
    measure: Callable[[Measurement], Any]
    """Makes a reading's data."""
    numbers: RecordedNumbers | None = None
    """How a recording holds its data; None for pictures, which are held as they are shown."""
    start_marks: Callable[[Any], tuple[float, ...]] = lambda _config: ()
    """The sensor's part of the run's state at the start, by its configuration, such as the shots left."""
    plots: tuple[Plot, ...] = ()
    """Plots of its readings."""

    @property
    def type(self) -> str:
        """Name of the type in files."""
        return str(self.config.model_fields["type"].default)


def apparent_wind(air: Callable[[float, float], FloatArray], time: float, level: float, place: Place) -> FloatArray:
    """Velocity (3,) of the air past a place that moves [m/s], in its axes.

    Args:
        air: the wind's velocity (3,) [m/s, world] at a time [s] and a height above the water [m].
        time: of the moment [s].
        level: height of the mean water [m].
        place: where, and how it moves.
    """
    height = max(0.0, float(place.position[2]) - level)
    return np.asarray(place.rotation.T @ (air(time, height) - place.velocity))


def wind_reading(config: AnemometerConfig, flow: FloatArray, draw: Draw) -> ApparentWind:
    """Reading of the air that streams past a sensor, (3,) [m/s] in its axes: by the part along its x and y."""
    ahead, port = (draw.error(axis, config.noise) - float(flow[axis]) for axis in (0, 1))
    return ApparentWind(math.hypot(ahead, port), math.atan2(port, ahead))


ANEMOMETER = SensorKind(
    AnemometerConfig,
    lambda now: wind_reading(now.config, now.wind, now.draw),
    RecordedNumbers(lambda _: 2, lambda numbers, _: ApparentWind(*numbers.tolist())),
    plots=(
        Plot("apparent_wind", "Apparent wind [m/s]", lambda data: data.speed),
        Plot("wind_angle", "Apparent wind angle [deg]", lambda data: math.degrees(data.angle)),
    ),
)


def beam(config: EchoSounderConfig) -> LidarConfig:
    """The lidar of one ray that meets what the sounder does."""
    straight = (0.0, 0.0)
    return LidarConfig(
        name=config.name, link=config.link, output="scan", rings=1, samples=1,
        azimuth=straight, elevation=straight, range=config.range,
    )  # fmt: skip


def bottom_distance(place: Place, level: float, depth: float | None) -> float:
    """How far a flat bottom is along the x axis of a place [m]; inf in deep water (None), and for a beam that rises.

    Args:
        place: of the transducer.
        level: height of the mean water [m].
        depth: of the water [m]; None: deep.
    """
    down = -float(place.rotation[2, 0])
    if depth is None or down <= 0.0:
        return math.inf
    return (float(place.position[2]) - level + depth) / down


def echo(config: EchoSounderConfig, distance: float, draw: Draw) -> Echo:
    """Reading of a sounder at a true distance [m]; inf where it is out of range."""
    found, (near, far) = distance + draw.error(0, config.noise), config.range
    return _echo(found if near <= found <= far else math.inf, config)


def _echo(distance: float, config: EchoSounderConfig) -> Echo:
    return Echo(distance, *config.range, config.field_of_view)


ECHO_SOUNDER = SensorKind(
    EchoSounderConfig,
    lambda now: echo(now.config, now.echo(), now.draw),
    RecordedNumbers(
        lambda _: 1,
        lambda numbers, config: _echo(float(numbers[0]), config),
        1,
        lambda numbers: "" if numbers[0] >= 0.0 else f"a range of {numbers[0]:g} m",
    ),
    plots=(
        Plot("depth", "Depth under transducer [m]", lambda data: data.range if data.range < math.inf else math.nan),
    ),
)


def heading(config: GnssCompassConfig, place: Place, x_from_east: float, draw: Draw) -> Heading:
    """Reading of a compass at `place`, in a world whose x axis is `x_from_east` [rad].

    The heading is that of the sensor's x axis seen from above, and the rate of turn its rate. East is that of the
    world's origin: at Sydney true east is 0.006 degrees off at 1 km.
    """
    x, y, z = place.rotation[:, 0].tolist()
    roll, pitch, yaw = place.spin.tolist()
    turn = yaw - z * (x * roll + y * pitch) / max(x * x + y * y, 1e-12)
    angle = math.atan2(y, x) + x_from_east + draw.error(0, config.heading_noise)
    return _with_variances(math.remainder(angle, 2.0 * math.pi), turn + draw.error(1, config.turn_noise), config)


def _with_variances(angle: float, turn: float, config: GnssCompassConfig) -> Heading:
    return Heading(angle, turn, config.heading_noise**2, config.turn_noise**2)


GNSS_COMPASS = SensorKind(
    GnssCompassConfig,
    lambda now: heading(now.config, now.place, now.x_from_east, now.draw),
    RecordedNumbers(
        lambda _: 2, lambda numbers, config: _with_variances(float(numbers[0]), float(numbers[1]), config), fields=2
    ),
    plots=(
        Plot("heading", "Heading [deg]", lambda data: compass(data.heading)),
        Plot("rate_of_turn", "Rate of turn [deg/s]", lambda data: math.degrees(data.rate_of_turn)),
    ),
)


def fix(config: GpsConfig, place: Place, earth: Geodetic, draw: Draw) -> Fix:
    """Reading of a receiver at `place`.

    Errors and their covariance, which has the drift in it, are along east, north and up: Hector's errors are along the
    world's axes. The velocity's axes are level at the world's origin: at 1 km they lean 0.01 degrees.
    """
    position = errors(config.position, draw, _POSITION) + earth.to_east_north_up(*place.position)
    east, north, up = errors(config.velocity, draw, _VELOCITY) + earth.to_east_north_up(*place.velocity)
    spread = covariance(*variances(config.position))
    return Fix(*earth.geodetic(*position), np.array([north, -east, up]), spread)


def _from_numbers(numbers: FloatArray, _config: GpsConfig) -> Fix:
    latitude, longitude, altitude = (float(value) for value in numbers[:3])
    return Fix(latitude, longitude, altitude, numbers[3:6], tuple(float(value) for value in numbers[6:]))


GPS = SensorKind(
    GpsConfig,
    lambda now: fix(now.config, now.place, now.earth, now.draw),
    RecordedNumbers(lambda _: 15, _from_numbers),
    plots=(
        Plot("latitude", "Latitude [deg]", lambda data: data.latitude),
        Plot("longitude", "Longitude [deg]", lambda data: data.longitude),
    ),
)


_Covariances = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Covariances, (9,) each, of the orientation, the angular velocity and the linear acceleration."""


def inertia(
    config: ImuConfig,
    place: Place,
    before: Place | None,
    interval: float,
    gravity: FloatArray,
    draw: Draw,
    x_from_east: float = 0.0,
) -> Inertia:
    """Reading of a unit at `place` that was at the place `before` an `interval` [s] ago.

    The angular rate is the turn since then over the interval, the acceleration the change of velocity over the
    interval less `gravity` [m/s2, world axes]: both are means over the interval, in the sensor's present axes. The
    first measurement has nothing before it: it gives the rate of this moment, and no change of velocity. The
    orientation is in axes east, north and up (REP 103), by the angle of the world's x axis `x_from_east` [rad].
    """
    down = place.rotation.T
    if before is None or interval <= 0.0:
        rate, change = down @ place.spin, np.zeros(3)
    else:
        rate = rotation_vector(quaternion_product(conjugate(before.orientation), place.orientation)) / interval
        change = (place.velocity - before.velocity) / interval
    return Inertia(
        _with_errors(config, place.orientation, draw, x_from_east),
        rate + errors(config.angular_velocity, draw, _ANGULAR_VELOCITY),
        down @ (change - gravity) + errors(config.acceleration, draw, _ACCELERATION),
        *_covariances(config),
    )


@lru_cache(maxsize=256)
def _covariances(config: ImuConfig) -> _Covariances:
    """The covariances of a unit's errors, drifts included; offsets are not in a covariance.

    Roll and pitch are about the unit's axes and yaw about the vertical: for a level unit, those of its x, y and z.
    """
    roll, pitch, _ = variances(config.tilt)
    return (
        covariance(roll, pitch, variances(config.heading)[2]),
        covariance(*variances(config.angular_velocity)),
        covariance(*variances(config.acceleration)),
    )


def _with_errors(config: ImuConfig, orientation: FloatArray, draw: Draw, x_from_east: float) -> FloatArray:
    """Orientation from east, (4,), with the heading's error about the z axis and others about its own x and y."""
    turned = quaternion_product(_turn(axis_of(config.heading, draw, _HEADING, 2) + x_from_east, 3), orientation)
    if config.tilt == _NO_ERRORS:
        return turned
    for axis in (0, 1):
        turned = quaternion_product(turned, _turn(axis_of(config.tilt, draw, _TILT, axis), 1 + axis))
    return turned


def _turn(angle: float, place: int) -> FloatArray:
    """Quaternion (4,) of a turn [rad] about the axis that has this place in it."""
    quaternion = np.array([math.cos(angle / 2.0), 0.0, 0.0, 0.0])
    quaternion[place] = math.sin(angle / 2.0)
    return quaternion


IMU = SensorKind(
    ImuConfig,
    lambda now: inertia(now.config, now.place, now.place_before, now.interval, now.gravity, now.draw, now.x_from_east),
    RecordedNumbers(
        lambda _: 10,
        lambda numbers, config: Inertia(numbers[:4], numbers[4:7], numbers[7:], *_covariances(config)),
        fields=3,
    ),
    plots=(
        Plot("acceleration", "Acceleration [m/s2]", lambda data: data.linear_acceleration, axes=True),
        Plot("turning", "Turning [deg/s]", lambda data: np.degrees(data.angular_velocity), axes=True),
    ),
)
