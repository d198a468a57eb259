"""Recorded readings, made again from what a recording holds of them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self, overload

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.errors import RecordError
from vrx_mj.recording.record_scene import RecordedSensor
from vrx_mj.sensors.readings import Image, PointCloud, Reading
from vrx_mj.sensors.registry import SENSOR_KINDS
from vrx_mj.sensors.view import intrinsics

if TYPE_CHECKING:
    from vrx_mj.recording.rrd_file import Part

__all__ = ["READING_COLUMNS", "RecordedReadings", "measured"]


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


class RecordedReadings(Sequence[Reading]):
    """The readings of one sensor in the order of time, each made when it is looked up.

    They equal those of `Simulation.sense` to the last bit, but for pictures, which are JPEG.
    """

    def __init__(self, sensor: RecordedSensor, columns: Mapping[str, Sequence[object]]) -> None:
        """Take arrays for every reading: `time`, `sequence`, and what gives its data.

        That is the bytes `blob`, or the numbers `points` with the bytes `intensity` and `ring`, or the bytes `numbers`.
        """
        self.sensor = sensor
        """What measured."""
        time = np.array(columns["time"], np.float64).reshape(-1)
        self._order = np.argsort(time, kind="stable")
        self.time: FloatArray = time[self._order]
        """Times (n,) of the measurements [s]."""
        self.sequence = np.array(columns["sequence"], np.int64).reshape(-1)[self._order]
        """Sequence numbers (n,) of the readings."""
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
        return Reading(sensor.name, sensor.type, time, sequence, sensor.frame, self._data(row))

    def _data(self, row: Mapping[str, Any]) -> Any:
        """What the sensor measured, from a row of its columns."""
        numbers = SENSOR_KINDS[self.sensor.type].numbers
        if numbers is None:
            camera = self.sensor.config
            assert isinstance(camera, CameraConfig), f"{self.sensor.type}: held as pictures"
            return Image(decoded(row["blob"], (camera.width, camera.height)), intrinsics(camera))
        if "points" in row:
            return PointCloud(row["points"].reshape(-1, 3), row["intensity"].view("<f4"), row["ring"].view("<u2"))
        return numbers.data(row["numbers"].view("<f8"), self.sensor.config)


def add_readings(columns: dict[str, list[object]], sensor: RecordedSensor, part: Part) -> None:
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
    elif sensor.gives_points:
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


def check_numbers(sensor: RecordedSensor, found: Sequence[ByteArray]) -> None:
    """Check that these are the numbers of readings of a sensor.

    Raises:
        RecordError: they are not.
    """
    numbers = SENSOR_KINDS[sensor.type].numbers
    assert numbers is not None, f"{sensor.type}: held as pictures"
    width = numbers.count(sensor.config)
    for one in found:
        if len(one) != 8 * width:
            raise RecordError(f"{sensor.readings_path}: numbers: {len(one)} bytes instead of {8 * width}")
        values = one.view("<f8")
        if problem := numbers.problem(values):
            raise RecordError(f"{sensor.readings_path}: numbers: {problem}")
        if (np.isfinite(values) & (np.abs(values) > np.finfo(np.float32).max)).any():
            raise RecordError(f"{sensor.readings_path}: numbers: beyond those of single precision")


def measured(reading: Reading) -> tuple[Any, ...]:
    """The fields of a reading's data that a recording holds: a unit's covariances follow from its configuration."""
    numbers = SENSOR_KINDS[reading.type].numbers
    return tuple(vars(reading.data).values())[: numbers.fields if numbers else None]


def decoded(blob: ByteArray, size: tuple[int, int]) -> ByteArray:
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
