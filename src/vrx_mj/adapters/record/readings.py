"""Recorded readings, made again from what a recording holds of them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from vrx_mj.adapters.record.scene import RecordedSensor
from vrx_mj.config.sensors import sensor_config
from vrx_mj.sensors.intrinsics import intrinsics
from vrx_mj.sensors.readings import Fix, Image, Inertia, PointCloud, Reading, Scan, Shooter, Sound, Truth

__all__ = ["RecordedReadings"]

FloatArray = npt.NDArray[np.float64]


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


def data_of(sensor: RecordedSensor, row: Mapping[str, Any]) -> Any:
    """What a sensor measured, from a row of its columns."""
    if sensor.type == "camera":
        return Image(decoded(row["blob"]), intrinsics(sensor_config({"config": sensor.config})))
    if "points" in row:
        return PointCloud(row["points"].reshape(-1, 3), row["intensity"].view("<f4"), row["ring"].view("<u2"))
    return MAKERS[sensor.type](row["numbers"].view("<f8"))


def decoded(blob: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """The pixels (height, width, 3) of a JPEG file."""
    from matplotlib.image import imread

    return np.array(imread(io.BytesIO(blob.tobytes()), format="jpeg"), np.uint8)


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
    "imu": lambda numbers: Inertia(numbers[:4], numbers[4:7], numbers[7:]),
    "p3d": lambda numbers: Truth(numbers[:3], numbers[3:7], numbers[7:10], numbers[10:]),
    "pinger": lambda numbers: Sound(*(float(value) for value in numbers)),
    "ball_shooter": lambda numbers: Shooter(round(float(numbers[0]))),
}
"""By type of sensor, its data from the numbers of a recording: the fields of its class, one after another."""
