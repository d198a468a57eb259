"""What a type of sensor consists of; `sensors.registry` has one record for each."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import Geodetic
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.readings import Image, PointCloud, Scan


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
