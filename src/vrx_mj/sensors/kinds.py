"""What a type of sensor consists of; `sensors.registry` has one record for each.

Errors of sensors as Hector's plugins model them: offset, drift and white noise along three axes.

Hector scales a drift's increments by the interval instead of its root, so that its size depends on the rate; here a
drift has the standard deviation that is configured. VRX configures none.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import ErrorModel
from vrx_mj.frames import Geodetic
from vrx_mj.physics.noise import axis_error, stream_key
from vrx_mj.sensors.readings import Image, Place, PointCloud, Scan


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
    """(3,) errors along the axes of a model, whose streams are `axis` and the two after it."""
    return np.array([axis_of(model, draw, axis, k) for k in range(3)])


def axis_of(model: ErrorModel, draw: Draw, axis: int, k: int) -> float:
    """The error along axis `k` of a model whose first stream is `axis`."""
    offset, drift, frequency = model.offset[k], model.drift[k], model.drift_frequency[k]
    return draw.error(axis + k, model.noise[k], offset=offset, drift=drift, frequency=frequency)


def variances(model: ErrorModel) -> FloatArray:
    """(3,) variances of the errors, drift included: what Hector's plugins write into covariances."""
    return np.square(model.drift) + np.square(model.noise)


def covariance(*variance: float) -> tuple[float, ...]:
    """(9,) row by row: the covariance of three errors that have nothing to do with each other."""
    return tuple(float(value) for value in np.diag(variance).flat)


class Measurement(Protocol):
    """What a reading is made from, each part worked out when it is asked for."""

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
        """What a camera at the sensor's place sees."""

    def scan(self) -> PointCloud | Scan:
        """What a lidar at the sensor's place meets."""

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
    """What is wrong with numbers of a file; empty if nothing is."""


@dataclass(frozen=True)
class Plot:
    """A plot in recordings."""

    name: str
    """Last part of its path."""
    title: str
    """Heading of the plot, with the unit."""
    values: Callable[[Any], Any]
    """What it shows of a reading's data: a number, or three."""
    axes: bool = False
    """Whether there are three numbers, along x, y and z."""


@dataclass(frozen=True)
class SensorKind:
    """A type of sensor: all its parts that are not of ROS. Its topics are in `ros.table.sensing.TOPICS`."""

    config: type[Any]
    """Class of the sensor's configuration in `config.sensors`."""
    measure: Callable[[Measurement], Any]
    """What makes a reading's data."""
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
