"""What sensors measured, as rerun chunks: pictures, points, tracks and plots, with what gives the readings back.

Of every reading there is one row in its sensor's own entity: time and number, and either the picture or the points as
they are shown, or all of its numbers. `reader.RecordedReadings` makes readings of them again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import CameraConfig, LidarConfig
from vrx_mj.recording.motion_chunks import part_chunk
from vrx_mj.recording.parts import Part
from vrx_mj.recording.reader import RecordedReadings
from vrx_mj.recording.record_scene import RecordedSensor, RecordScene
from vrx_mj.recording.timeline import arrow_strips, static, times
from vrx_mj.sensors.labels import CATEGORY_NAMES
from vrx_mj.sensors.readings import Reading, Scan
from vrx_mj.sensors.registry import SENSOR_KINDS
from vrx_mj.sensors.view import focal_length

Readings = Sequence[Reading]
Columns = Iterable[rr.ComponentColumn]

PICTURE_AT = 1.2
"""How far before a camera its picture hangs in the sea view [m]."""
FRUSTUM_COLOR = (157, 140, 103)
NEAR_COLOR, MIDDLE_COLOR, FAR_COLOR = (255, 236, 110), (255, 96, 80), (150, 60, 200)
"""Colours of a lidar's points near the boat, halfway on a scale of logarithms, and at the end of the range."""
SHADES = 64
AXIS_COLORS = ((240, 93, 83), (89, 158, 81), (80, 143, 229))
"""Colours of x, y and z in plots."""
SOUND_COLOR = (159, 125, 214)
SOUND_LENGTH = 8.0
"""Longest arrow to a beacon [m]: it shows the direction, and the plot the distance."""
SOUND_HEIGHT = 2.2
"""Height of the arrow to a beacon over the boat's origin [m]."""
OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Axes of a picture (x right, y down, z forward), in those of its camera (x forward, y left, z up)."""


def sensor_chunks(scene: RecordScene) -> Iterator[Chunk]:
    """What of the sensors does not change: where they are on their boats, how they are drawn, their series' names."""
    colors = scene.colors()
    for sensor in scene.sensors:
        if sensor.type == "camera":
            yield static(sensor.path, mount(sensor, OPTICAL), pinhole(sensor))
            yield static(sensor.path, rr.EncodedImage.from_fields(media_type="image/jpeg"))
        elif sensor.type == "lidar":
            yield static(sensor.path, mount(sensor), rr.Points3D.from_fields(radii=[rr.Radius.ui_points(2.0)]))
        elif sensor.type == "pinger":
            yield static(sensor.path, rr.LineStrips3D.from_fields(colors=[SOUND_COLOR], radii=[0.08]))
        elif sensor.type == "gps":
            fixes = rr.Points3D.from_fields(colors=[colors[sensor.boat]], radii=[rr.Radius.ui_points(2.2)])
            yield static(track_path(sensor), fixes)
        yield from sensor_series(sensor, colors[sensor.boat])


def sensor_series(sensor: RecordedSensor, rgb: tuple[int, int, int]) -> Iterator[Chunk]:
    """Names and colours of a sensor's plots."""
    for plot in SENSOR_KINDS[sensor.type].plots:
        whose = f"{sensor.boat} {sensor.name}"
        names = [f"{whose} {axis}" for axis in "xyz"] if plot.axes else [whose]
        colors = AXIS_COLORS if plot.axes else [rgb]
        yield static(plot_path(plot.name, sensor), rr.SeriesLines(names=names, colors=colors, widths=1.5))


def mount(sensor: RecordedSensor, turn: FloatArray | None = None) -> rr.Transform3D:
    """Where a sensor is on its boat, its axes turned."""
    rotation = np.array(sensor.rotation) @ (np.eye(3) if turn is None else turn)
    return rr.Transform3D(translation=np.array(sensor.position, np.float32), mat3x3=rotation.astype(np.float32))


def pinhole(sensor: RecordedSensor) -> rr.Pinhole:
    """A camera's view: the axis goes through the middle of the picture."""
    config = sensor.config
    assert isinstance(config, CameraConfig), f"{sensor.name} is a {sensor.type}"
    return rr.Pinhole(
        focal_length=focal_length(config),
        principal_point=[config.width / 2.0, config.height / 2.0],
        width=config.width,
        height=config.height,
        image_plane_distance=PICTURE_AT,
        color=FRUSTUM_COLOR,
        line_width=0.01,
    )


class SensedChunks:
    """Turns readings into chunks, a few for every sensor at a time."""

    def __init__(self, scene: RecordScene) -> None:
        self._scene = scene
        self._sensors = {sensor.readings_path: sensor for sensor in scene.sensors}
        self._makers: dict[str, Callable[[RecordedSensor, Readings], Iterator[Chunk]]] = {
            "lidar": points,
            "gps": self._fixes,
            "pinger": sounds,
        }

    def __call__(self, parts: Sequence[Part]) -> Iterator[Chunk]:
        """Chunks of the parts of one sensor, in the order of time."""
        sensor = self._sensors[parts[0].entity]
        readings = RecordedReadings.of(sensor, parts)
        if sensor.type == "camera":
            yield from pictures(sensor, readings)
            yield from (boxes(sensor, part) for part in parts if "labels" in part.columns)
            return
        if sensor.readings_path != sensor.path:
            yield part_chunk(parts)
        yield from self._makers.get(sensor.type, plots)(sensor, list(readings))

    def _fixes(self, sensor: RecordedSensor, readings: Readings) -> Iterator[Chunk]:
        """A receiver's fixes as points at the mean water, as trails; on the Earth; and as plots."""
        yield from plots(sensor, readings)
        fixes = [reading.data for reading in readings]
        angles = np.array([(fix.latitude, fix.longitude) for fix in fixes])
        yield chunk(f"/earth/{sensor.boat}/{sensor.name}", readings, rr.GeoPoints.columns(positions=angles))
        if georeference := self._scene.parameters.georeference:
            places = np.array([georeference.to_enu(fix.latitude, fix.longitude, fix.altitude) for fix in fixes])
            places[:, 2] = 0.0
            columns = rr.Points3D.columns(positions=places.astype(np.float32))
            yield chunk(track_path(sensor), readings, columns)


def chunk(path: str, readings: Readings, *columns: Columns) -> Chunk:
    """A row for each reading."""
    every = [column for group in columns for column in group]
    return Chunk.from_columns(path, [times([reading.time for reading in readings])], every)


def stamps(readings: Readings) -> Columns:
    """Times [s], which the timeline rounds, and numbers of readings."""
    columns: Columns = rr.AnyValues.columns(
        time=np.array([reading.time for reading in readings]),
        sequence=np.array([reading.sequence for reading in readings], np.int64),
    )
    return columns


def pictures(sensor: RecordedSensor, readings: RecordedReadings) -> Iterator[Chunk]:
    """Pictures of a camera, a chunk each: they are large."""
    for time, sequence, blob in zip(readings.time, readings.sequence, readings.pictures(), strict=True):
        stamp = rr.AnyValues.columns(time=[time], sequence=[sequence])
        columns = [*stamp, *rr.EncodedImage.columns(blob=[blob])]
        yield Chunk.from_columns(sensor.path, [times([time])], columns)


def boxes(sensor: RecordedSensor, part: Part) -> Chunk:
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


def points(sensor: RecordedSensor, readings: Readings) -> Iterator[Chunk]:
    """What a lidar met, as points in its own frame."""
    if isinstance(readings[0].data, Scan):
        yield chunk(sensor.path, readings, *shown_points(sensor, [scan_points(one.data) for one in readings]))
        return
    clouds = [reading.data for reading in readings]
    extra = rr.AnyValues.columns(  # as bytes: rerun takes numbers one by one
        intensity=[cloud.intensity.astype("<f4").tobytes() for cloud in clouds],
        ring=[cloud.ring.astype("<u2").tobytes() for cloud in clouds],
    )
    shown = shown_points(sensor, [cloud.points for cloud in clouds])
    yield chunk(sensor.path, readings, stamps(readings), extra, *shown)


def shown_points(sensor: RecordedSensor, clouds: Sequence[npt.NDArray[np.float32]]) -> Iterator[Columns]:
    """Columns of points (n, 3) [m], coloured by their distance."""
    every, lidar = np.concatenate(clouds), sensor.config
    assert isinstance(lidar, LidarConfig), f"{sensor.name} is a {sensor.type}"
    colors = range_colors(np.linalg.norm(every, axis=1), *lidar.range)
    yield rr.Points3D.columns(positions=every, colors=colors).partition([len(cloud) for cloud in clouds])


def scan_points(scan: Scan) -> npt.NDArray[np.float32]:
    """The returns of a planar scan (n, 3) [m], in its own frame."""
    met = np.flatnonzero(np.isfinite(scan.ranges))
    angle, away = scan.angle_min + met * scan.angle_increment, scan.ranges[met]
    return np.stack([away * np.cos(angle), away * np.sin(angle), 0.0 * away], axis=1).astype(np.float32)


def range_colors(distance: npt.NDArray[np.float32 | np.float64], near: float, far: float) -> npt.NDArray[np.uint32]:
    """Colours (n,), 0xRRGGBBAA, on a scale of logarithms from `near` to `far` [m]."""
    first, last = np.log(max(near, 1.0)), np.log(max(far, 2.0))
    share = np.clip((np.log(np.maximum(distance, 1e-3)) - first) / (last - first), 0.0, 1.0)
    shade = np.round(share * (SHADES - 1)).astype(np.int64)
    scale = np.linspace(0.0, 2.0, SHADES)
    anchors = np.array([NEAR_COLOR, MIDDLE_COLOR, FAR_COLOR], np.float64)
    red, green, blue = (np.interp(scale, [0.0, 1.0, 2.0], anchor).astype(np.uint32) for anchor in anchors.T)
    palette: npt.NDArray[np.uint32] = (red << 24) | (green << 16) | (blue << 8) | np.uint32(255)
    colors: npt.NDArray[np.uint32] = palette[shade]
    return colors


def sounds(sensor: RecordedSensor, readings: Readings) -> Iterator[Chunk]:
    """Plots of what a receiver hears, and an arrow toward it, over the boat."""
    yield from plots(sensor, readings)
    range_, bearing, elevation = np.array([list(vars(reading.data).values()) for reading in readings]).T
    way = np.stack(
        [np.cos(elevation) * np.cos(bearing), np.cos(elevation) * np.sin(bearing), np.sin(elevation)], axis=1
    )
    vectors = (way * np.clip(range_, 0.0, SOUND_LENGTH)[:, None]) @ np.array(sensor.rotation).T
    origins = np.tile((*sensor.position[:2], SOUND_HEIGHT), (len(readings), 1))
    columns = rr.LineStrips3D.columns(strips=arrow_strips(origins, vectors).astype(np.float32))
    yield chunk(sensor.path, readings, columns)


def track_path(sensor: RecordedSensor) -> str:
    """Entity of a receiver's fixes in the world."""
    return f"/world/tracks/{sensor.boat}/{sensor.name}"


def plot_path(quantity: str, sensor: RecordedSensor) -> str:
    """Entity of a sensor's series in the plot of a quantity."""
    return f"/plots/{quantity}/{sensor.boat}/{sensor.name}"


def plots(sensor: RecordedSensor, readings: Readings) -> Iterator[Chunk]:
    """A sensor's series, each in the plot of its quantity."""
    for plot in SENSOR_KINDS[sensor.type].plots:
        values = np.array([np.ravel(plot.values(reading.data)) for reading in readings], np.float64)
        columns = rr.Scalars.columns(scalars=values.reshape(-1)).partition([values.shape[1]] * len(readings))
        yield chunk(plot_path(plot.name, sensor), readings, columns)
