"""What sensors measured, as rerun chunks: pictures, points, tracks and plots, with what gives the readings back.

Of every reading there is one row in its sensor's own entity: time and number, and either the picture or the points as
they are shown, or all of its numbers. `reader.RecordedReadings` makes readings of them again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import CameraConfig, LidarConfig
from vrx_mj.recording.motion_chunks import kept_columns, part_chunk
from vrx_mj.recording.parts import Part
from vrx_mj.recording.reader import RecordedReadings
from vrx_mj.recording.record_scene import RecordedSensor, RecordScene
from vrx_mj.recording.sea_meshes import packed_colors, ramp
from vrx_mj.recording.timeline import arrow_strips, numbers, static, times
from vrx_mj.sensors.labels import CATEGORY_NAMES
from vrx_mj.sensors.readings import Scan
from vrx_mj.sensors.registry import SENSOR_KINDS
from vrx_mj.sensors.view import focal_length

_PICTURE_AT = 1.2
"""How far before a camera its picture hangs in the sea view [m]."""
_FRUSTUM_COLOR = (157, 140, 103)
_RANGE_COLORS = (255, 236, 110), (255, 96, 80), (150, 60, 200)
"""Colours of a lidar's points near the boat, halfway on a scale of logarithms, and at the end of the range."""
_SHADES = 64
AXIS_COLORS = ((240, 93, 83), (89, 158, 81), (80, 143, 229))
"""Colours of x, y and z in plots."""
SOUND_COLOR = (159, 125, 214)
_SOUND_LENGTH = 8.0
"""Longest arrow to a beacon [m]: it shows the direction, and the plot the distance."""
_SOUND_HEIGHT = 2.2
"""Height of the arrow to a beacon over the boat's origin [m]."""
_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Axes of a picture (x right, y down, z forward), in those of its camera (x forward, y left, z up)."""


def sensor_chunks(scene: RecordScene) -> Iterator[Chunk]:
    """What of the sensors does not change: where they are on their boats, how they are drawn, their series' names."""
    colors = scene.colors()
    for sensor in scene.sensors:
        if sensor.type == "camera":
            yield static(sensor.path, _mount(sensor, _OPTICAL), _pinhole(sensor))
            yield static(sensor.path, rr.EncodedImage.from_fields(media_type="image/jpeg"))
        elif sensor.type == "lidar":
            yield static(sensor.path, _mount(sensor), rr.Points3D.from_fields(radii=[rr.Radius.ui_points(2.0)]))
        elif sensor.type == "pinger":
            yield static(sensor.path, rr.LineStrips3D.from_fields(colors=[SOUND_COLOR], radii=[0.08]))
        elif sensor.type == "gps":
            fixes = rr.Points3D.from_fields(colors=[colors[sensor.boat]], radii=[rr.Radius.ui_points(2.2)])
            yield static(track_path(sensor), fixes)
        yield from _sensor_series(sensor, colors[sensor.boat])


def _sensor_series(sensor: RecordedSensor, rgb: tuple[int, int, int]) -> Iterator[Chunk]:
    """Names and colours of a sensor's plots."""
    for plot in SENSOR_KINDS[sensor.type].plots:
        whose = f"{sensor.boat} {sensor.name}"
        names = [f"{whose} {axis}" for axis in "xyz"] if plot.axes else [whose]
        colors = AXIS_COLORS if plot.axes else [rgb]
        yield static(_plot_path(plot.name, sensor), rr.SeriesLines(names=names, colors=colors, widths=1.5))


def _mount(sensor: RecordedSensor, turn: FloatArray | None = None) -> rr.Transform3D:
    """Where a sensor is on its boat, its axes turned."""
    rotation = np.array(sensor.rotation) @ (np.eye(3) if turn is None else turn)
    return rr.Transform3D(translation=np.array(sensor.position, np.float32), mat3x3=rotation.astype(np.float32))


def _pinhole(sensor: RecordedSensor) -> rr.Pinhole:
    """A camera's view: the axis goes through the middle of the picture."""
    config = sensor.config
    assert isinstance(config, CameraConfig), f"{sensor.name} is a {sensor.type}"
    return rr.Pinhole(
        focal_length=focal_length(config),
        principal_point=[config.width / 2.0, config.height / 2.0],
        width=config.width,
        height=config.height,
        image_plane_distance=_PICTURE_AT,
        color=_FRUSTUM_COLOR,
        line_width=0.01,
    )


class SensedChunks:
    """Turns readings into chunks, a few for every sensor at a time."""

    def __init__(self, scene: RecordScene) -> None:
        self._scene = scene
        self._sensors = {sensor.readings_path: sensor for sensor in scene.sensors}

    def __call__(self, parts: Sequence[Part]) -> Iterator[Chunk]:
        """Chunks of the parts of one sensor, in the order of time."""
        sensor = self._sensors[parts[0].entity]
        readings = RecordedReadings.of(sensor, parts)
        if sensor.type == "camera":
            yield from _pictures(sensor, readings)
            yield from (_boxes(sensor, part) for part in parts if "labels" in part.columns)
            return
        time, data, kept = readings.time, [reading.data for reading in readings], kept_columns(parts)
        if sensor.readings_path != sensor.path:
            yield part_chunk(parts)
            kept = ()
        yield from _plots(sensor, time, data)
        if sensor.type == "lidar":
            yield _points(sensor, time, data, kept)
        elif sensor.type == "gps":
            yield from self._fixes(sensor, time, data)
        elif sensor.type == "pinger":
            yield sound(sensor, time, data)

    def _fixes(self, sensor: RecordedSensor, time: FloatArray, fixes: Sequence[Any]) -> Iterator[Chunk]:
        """A receiver's fixes as points at the mean water, as trails; and on the Earth."""
        angles = np.array([(fix.latitude, fix.longitude) for fix in fixes])
        yield numbers(f"/earth/{sensor.boat}/{sensor.name}", time, rr.GeoPoints, positions=angles)
        if georeference := self._scene.parameters.georeference:
            places = np.array([georeference.to_enu(fix.latitude, fix.longitude, fix.altitude) for fix in fixes])
            places[:, 2] = 0.0
            yield numbers(track_path(sensor), time, rr.Points3D, positions=places.astype(np.float32))


def _pictures(sensor: RecordedSensor, readings: RecordedReadings) -> Iterator[Chunk]:
    """Pictures of a camera, a chunk each: they are large."""
    for time, sequence, blob in zip(readings.time, readings.sequence, readings.pictures(), strict=True):
        stamp = rr.AnyValues.columns(time=[time], sequence=[sequence])
        columns = [*stamp, *rr.EncodedImage.columns(blob=[blob])]
        yield Chunk.from_columns(sensor.path, [times([time])], columns)


def _boxes(sensor: RecordedSensor, part: Part) -> Chunk:
    """The boxes of a camera's labels, over its pictures."""
    seen = [cell.reshape(-1, 5) for cell in part.arrays("labels", "<i4")]
    every = np.concatenate(seen)
    columns = rr.Boxes2D.columns(
        centers=(every[:, 1:3] + 0.5 * every[:, 3:]).astype(np.float32),
        half_sizes=(0.5 * every[:, 3:]).astype(np.float32),
        labels=[CATEGORY_NAMES[number] for number in every[:, 0].tolist()],
        class_ids=every[:, 0].astype(np.uint16),
    )
    return Chunk.from_columns(sensor.path, [times(part.times("time"))], columns.partition([len(each) for each in seen]))


def _points(sensor: RecordedSensor, time: FloatArray, met: Sequence[Any], kept: Iterable[rr.ComponentColumn]) -> Chunk:
    """What a lidar met, as points in its own frame, coloured by their distance, beside what is `kept` of it."""
    clouds = [_scan_points(one) if isinstance(one, Scan) else one.points for one in met]
    every, lidar = np.concatenate(clouds), sensor.config
    assert isinstance(lidar, LidarConfig), f"{sensor.name} is a {sensor.type}"
    colors = _range_colors(np.linalg.norm(every, axis=1), *lidar.range)
    counts = [len(cloud) for cloud in clouds]
    return numbers(sensor.path, time, rr.Points3D, counts, kept, positions=every, colors=colors)


def _scan_points(scan: Scan) -> npt.NDArray[np.float32]:
    """The returns of a planar scan (n, 3) [m], in its own frame."""
    met = np.flatnonzero(np.isfinite(scan.ranges))
    angle, away = scan.angle_min + met * scan.angle_increment, scan.ranges[met]
    return np.stack([away * np.cos(angle), away * np.sin(angle), 0.0 * away], axis=1).astype(np.float32)


def _range_colors(distance: npt.NDArray[np.float32 | np.float64], near: float, far: float) -> npt.NDArray[np.uint32]:
    """Colours (n,), 0xRRGGBBAA, on a scale of logarithms from `near` to `far` [m]."""
    first, last = np.log(max(near, 1.0)), np.log(max(far, 2.0))
    share = np.clip((np.log(np.maximum(distance, 1e-3)) - first) / (last - first), 0.0, 1.0)
    shade = np.round(share * (_SHADES - 1)).astype(np.int64)
    colors: npt.NDArray[np.uint32] = packed_colors(np.floor(ramp(_RANGE_COLORS, np.linspace(0.0, 1.0, _SHADES))))[shade]
    return colors


def sound(sensor: RecordedSensor, time: FloatArray, heard: Sequence[Any]) -> Chunk:
    """An arrow toward what a receiver hears, over the boat."""
    range_, bearing, elevation = np.array([list(vars(one).values()) for one in heard]).T
    way = np.stack(
        [np.cos(elevation) * np.cos(bearing), np.cos(elevation) * np.sin(bearing), np.sin(elevation)], axis=1
    )
    vectors = (way * np.clip(range_, 0.0, _SOUND_LENGTH)[:, None]) @ np.array(sensor.rotation).T
    origins = np.tile((*sensor.position[:2], _SOUND_HEIGHT), (len(time), 1))
    return numbers(sensor.path, time, rr.LineStrips3D, strips=arrow_strips(origins, vectors).astype(np.float32))


def track_path(sensor: RecordedSensor) -> str:
    """Entity of a receiver's fixes in the world."""
    return f"/world/tracks/{sensor.boat}/{sensor.name}"


def _plot_path(quantity: str, sensor: RecordedSensor) -> str:
    """Entity of a sensor's series in the plot of a quantity."""
    return f"/plots/{quantity}/{sensor.boat}/{sensor.name}"


def _plots(sensor: RecordedSensor, time: FloatArray, data: Sequence[Any]) -> Iterator[Chunk]:
    """A sensor's series, each in the plot of its quantity."""
    for plot in SENSOR_KINDS[sensor.type].plots:
        values = np.array([np.ravel(plot.values(one)) for one in data], np.float64)
        path = _plot_path(plot.name, sensor)
        yield numbers(path, time, rr.Scalars, values.shape[1], scalars=values.reshape(-1))
