"""Recorded readings, made again from what a recording holds of them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np
import numpy.typing as npt

from vrx_mj.config.sensors import sensor_config
from vrx_mj.errors import RecordError
from vrx_mj.recording.record_scene import RecordedSensor
from vrx_mj.sensors.imu import covariances
from vrx_mj.sensors.intrinsics import intrinsics
from vrx_mj.sensors.readings import Fix, Image, Inertia, PointCloud, Reading, Scan, Shooter, Sound, Truth

if TYPE_CHECKING:
    from vrx_mj.recording.rrd_file import Part

__all__ = ["READING_COLUMNS", "RecordedReadings", "measured"]

FloatArray = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

READING_COLUMNS: Mapping[str, str] = {
    "time": "time",
    "sequence": "sequence",
    "numbers": "numbers",
    "intensity": "intensity",
    "ring": "ring",
    "EncodedImage:blob": "blob",
    "Points3D:positions": "points",
}
"""Columns of a recording that give readings back, and what they hold."""
WIDTHS = {"gps": 15, "imu": 10, "p3d": 13, "pinger": 3, "ball_shooter": 1}
"""Numbers of a reading, by type of sensor."""
MOST_SHOTS = 1000.0


class RecordedReadings(Sequence[Reading]):
    """The readings of one sensor in the order of time, each made when it is looked up.

    They equal those of `Simulation.sense` to the last bit, but for pictures, which are JPEG.
    """

    def __init__(self, sensor: RecordedSensor, columns: Mapping[str, Sequence[Any]]) -> None:
        """Take arrays for every reading: `time`, `sequence`, and what gives its data.

        That is the bytes `blob`, or the numbers `points` with the bytes `intensity` and `ring`, or the bytes `numbers`.
        """
        self.sensor = sensor
        """What measured."""
        time = np.array(columns["time"], np.float64).reshape(-1)
        self._order = np.argsort(time, kind="stable")
        self.time: FloatArray = time[self._order]
        """(n,) when they were measured [s]."""
        self.sequence = np.array(columns["sequence"], np.int64).reshape(-1)[self._order]
        """(n,) their numbers."""
        self._columns = columns

    @classmethod
    def of(cls, sensor: RecordedSensor, parts: Sequence[Part]) -> Self:
        """Of the chunks of a sensor's entity.

        Raises:
            RecordError: they do not hold readings of such a sensor.
        """
        columns: dict[str, list[Any]] = {"time": [], "sequence": []}
        for part in (part for part in parts if not part.static):
            if "time" in part.columns:  # others are what is shown of the readings
                add_readings(columns, sensor, part)
        return cls(sensor, columns)

    def __len__(self) -> int:
        return len(self.time)

    @overload
    def __getitem__(self, index: int) -> Reading: ...

    @overload
    def __getitem__(self, index: slice) -> list[Reading]: ...

    def __getitem__(self, index: int | slice) -> Reading | list[Reading]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        row = {name: values[self._order[index]] for name, values in self._columns.items()}
        time, sequence, sensor = float(self.time[index]), int(self.sequence[index]), self.sensor
        return Reading(sensor.name, sensor.type, time, sequence, sensor.frame, data_of(sensor, row))


def add_readings(columns: dict[str, list[Any]], sensor: RecordedSensor, part: Part) -> None:
    """Add the readings of a chunk to the columns of a sensor.

    Raises:
        RecordError: they are not those of such a sensor.
    """
    times, numbers = part.times("time"), part.numbers("sequence", "i")
    if len(numbers) != len(times) or not all(0 <= number < 1 << 32 for number in numbers):
        raise RecordError(f"{part.entity}: sequence: a whole number for each time is needed")
    columns["time"] += times
    columns["sequence"] += numbers
    if sensor.type == "camera":
        found = {"blob": part.arrays("EncodedImage:blob", "|u1")}
    elif sensor.config.get("output") == "points":
        found = points_of(part)
    else:
        found = {"numbers": part.arrays("numbers", "|u1")}
        check_numbers(sensor, found["numbers"])
    if {len(values) for values in found.values()} != {len(times)}:
        raise RecordError(f"{part.entity}: columns of unequal length")
    for name, values in found.items():
        columns.setdefault(name, []).extend(values)


def points_of(part: Part) -> dict[str, list[npt.NDArray[Any]]]:
    """Columns of a chunk of clouds.

    Raises:
        RecordError: a cloud has not one intensity and one ring for each of its points.
    """
    points, intensity, ring = (
        part.arrays(name, kind) for name, kind in (("Points3D:positions", "<f4"), ("intensity", "|u1"), ("ring", "|u1"))
    )
    for one, other, third in zip(points, intensity, ring, strict=True):
        if not 4 * len(one) == 3 * len(other) == 6 * len(third):
            raise RecordError(f"{part.entity}: {len(one)} coordinates, {len(other)} bytes of intensities")
    return {"points": points, "intensity": intensity, "ring": ring}


def check_numbers(sensor: RecordedSensor, found: Sequence[Bytes]) -> None:
    """Check that these are the numbers of readings of a sensor.

    Raises:
        RecordError: they are not.
    """
    width = WIDTHS.get(sensor.type) or 5 + sensor_config({"config": sensor.config}).samples
    for one in found:
        if len(one) != 8 * width:
            raise RecordError(f"{sensor.readings_path}: numbers: {len(one)} bytes instead of {8 * width}")
        values = one.view("<f8")
        if sensor.type == "ball_shooter" and not 0.0 <= values[0] <= MOST_SHOTS:
            raise RecordError(f"{sensor.readings_path}: numbers: {values[0]:g} shots")
        if (np.isfinite(values) & (np.abs(values) > np.finfo(np.float32).max)).any():
            raise RecordError(f"{sensor.readings_path}: numbers: beyond those of single precision")


def measured(reading: Reading) -> tuple[Any, ...]:
    """The fields of a reading's data that a recording holds: a unit's covariances follow from its configuration."""
    fields = tuple(vars(reading.data).values())
    return fields[:3] if reading.type == "imu" else fields


def data_of(sensor: RecordedSensor, row: Mapping[str, Any]) -> Any:
    """What a sensor measured, from a row of its columns."""
    if sensor.type == "camera":
        config = sensor_config({"config": sensor.config})
        return Image(decoded(row["blob"], (config.width, config.height)), intrinsics(config))
    if "points" in row:
        return PointCloud(row["points"].reshape(-1, 3), row["intensity"].view("<f4"), row["ring"].view("<u2"))
    if sensor.type == "imu":
        found = row["numbers"].view("<f8")
        return Inertia(found[:4], found[4:7], found[7:], *covariances(sensor_config({"config": sensor.config})))
    return MAKERS[sensor.type](row["numbers"].view("<f8"))


def decoded(blob: Bytes, size: tuple[int, int]) -> Bytes:
    """The pixels (height, width, 3) of a JPEG file of a size: width and height.

    Raises:
        RecordError: it is damaged, or of another size.
    """
    from PIL import Image as Pictures

    try:
        with Pictures.open(io.BytesIO(blob.tobytes()), formats=["JPEG"]) as picture:
            if picture.size != size or picture.mode != "RGB":  # before its pixels are made
                raise RecordError(f"a picture of {picture.size[0]}x{picture.size[1]} instead of {size[0]}x{size[1]}")
            return np.array(picture)
    except (OSError, ValueError, SyntaxError, Pictures.DecompressionBombError) as error:
        raise RecordError(f"a picture is damaged: {str(error).splitlines()[0]}") from None


def scan(numbers: FloatArray) -> Scan:
    """From the ranges and five numbers after them."""
    return Scan(numbers[:-5].astype(np.float32), *(float(value) for value in numbers[-5:]))


def fix(numbers: FloatArray) -> Fix:
    """From 15 numbers."""
    latitude, longitude, altitude = (float(value) for value in numbers[:3])
    return Fix(latitude, longitude, altitude, numbers[3:6], tuple(float(value) for value in numbers[6:]))


MAKERS: Mapping[str, Any] = {
    "lidar": scan,
    "gps": fix,
    "p3d": lambda numbers: Truth(numbers[:3], numbers[3:7], numbers[7:10], numbers[10:]),
    "pinger": lambda numbers: Sound(*(float(value) for value in numbers)),
    "ball_shooter": lambda numbers: Shooter(round(float(numbers[0]))),
}
"""By type of sensor, its data from the numbers of a recording: the fields that `measured` lists, one after another."""
