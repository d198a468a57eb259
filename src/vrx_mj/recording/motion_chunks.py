"""What changes with time, as rerun chunks: poses, arrows, plots, and what sensors measured.

`MovingChunks` holds the little that a chunk must know of the one before it: which samples the slower streams took.

Of every reading there is one row in its sensor's own entity: time and number, and either the picture or the points as
they are shown, or all of its numbers. `reader.RecordedReadings` makes readings of them again.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import BoolArray, Float32Array, FloatArray, Uint32Array
from vrx_mj.config.sensors import CameraConfig, LidarConfig
from vrx_mj.frames import compass, in_world_axes, quaternion_product
from vrx_mj.model.things import Georeference
from vrx_mj.recording.eyes import FLEET, PLAN, PLAN_SLOPE, TEXT_RATE, Places, WeatherChunks, plan_eye
from vrx_mj.recording.parts import EVENTS, Part
from vrx_mj.recording.reader import Event, RecordedReadings
from vrx_mj.recording.record_scene import (
    PARKED_HEIGHT,
    MovingBody,
    RecordedPart,
    RecordedSensor,
    RecordedThruster,
    RecordScene,
)
from vrx_mj.recording.sea_meshes import packed_colors, ramp
from vrx_mj.recording.static_chunks import PLOTTED, UNSEEN_COLOR
from vrx_mj.recording.timeline import Deadband, Ticker, arrow_strips, numbers, static, times
from vrx_mj.recording.water_chunks import WaterChunks
from vrx_mj.sensors import SENSOR_KINDS
from vrx_mj.sensors.readings import Scan
from vrx_mj.sensors.view import CATEGORY_NAMES, focal_length

_SHOWN_RATE, _ARROW_RATE, _PLOT_RATE = 10.0, 10.0, 5.0
"""Poses where nothing moves fast, arrows, and plots, which in a fast sea come with the arrows [Hz]."""
_FAST_VELOCITIES = (2.5, 2.5, 0.2, 0.2, 0.2, 0.5)
"""Velocities of a boat from which every row is shown: linear [m/s], in the world, and angular [rad/s], in its frame."""
_ARROW_PER_NEWTON = 1.0 / 55.0
"""Length of a thrust arrow [m/N]."""
_MIN_ARROW = 0.24
"""Least length of a thrust arrow that is shown [m]: a shorter one is wider than long, a dot."""
_ARROW_HEIGHT = 0.75
"""Height of a thrust arrow over the engine's mount [m], so that the water does not hide it."""
_MIN_RANGES = {
    "speed": 0.25, "steering": 5.0, "heading": 5.0, "course": 5.0, "yaw": 5.0, "roll": 2.0, "pitch": 2.0,
    "wind": 0.5,
}  # fmt: skip
"""Half of the least range of a plot's axis [m/s, N, deg]: noise is no signal."""
_RANGE_STRIDE = 50
"""Number of values of a plot per value of its range: an axis fits what is in view."""
_PLOT_STEP = 1.0 / 1024.0
"""Step to which plots are rounded, in their units."""
POSE_STEP = (*[1.0 / 512.0] * 3, *[1.0 / 2048.0] * 4)
"""Steps to which shown poses are rounded: position [m], and quaternion."""
_TOLERANCE = (*[0.005] * 3, *[0.002] * 4)
"""Largest difference of a shown pose, of something other than a boat, from the actual one: position [m], and
quaternion."""
_MAX_NUMBER = 1e6
"""Largest number that is shown: a run may diverge, a picture of it should not."""
_KEPT_COLUMNS = ("time", "head", "files", "blob", "sequence", "numbers", "intensity", "ring")
"""Columns of parts that are recorded as they are."""
_PICTURE_DISTANCE = 1.2
"""Distance of a picture in front of its camera in the sea view [m]."""
_FRUSTUM_COLOR = (157, 140, 103)
_RANGE_COLORS = (255, 236, 110), (255, 96, 80), (150, 60, 200)
"""Colours of a lidar's points near the boat, halfway on a scale of logarithms, and at the end of the range."""
_SHADES = 64
"""Number of colours of a lidar's points."""
AXIS_COLORS = ((240, 93, 83), (89, 158, 81), (80, 143, 229))
"""Colours of x, y and z in plots."""
SOUND_COLOR = (159, 125, 214)
_SOUND_LENGTH = 8.0
"""Longest arrow to a beacon [m]: it shows the direction, and the plot the distance."""
_SOUND_HEIGHT = 2.2
"""Height of the arrow to a beacon over the boat's origin [m]."""
_OPTICAL_AXES = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Axes of a picture (x right, y down, z forward), in those of its camera (x forward, y left, z up)."""


def event_chunk(events: Sequence[Event]) -> Chunk:
    """Events as a log."""
    text, level = [event.text for event in events], [event.level for event in events]
    touch = [json.dumps(asdict(event.touch)) if event.touch else "" for event in events]
    columns = [*rr.TextLog.columns(text=text, level=level), *rr.AnyValues.columns(touch=touch)]
    return Chunk.from_columns(EVENTS, [times([event.time for event in events])], columns)


class MovingChunks:
    """Turns blocks of rows into chunks."""

    def __init__(self, scene: RecordScene, *, live: bool = False) -> None:
        """Begin with a scene; `live`: the plan follows the fleet."""
        self._pose, self._arrow, self._plotted = Ticker(_SHOWN_RATE), Ticker(_ARROW_RATE), Ticker(_PLOT_RATE)
        self._water = WaterChunks()
        self._weather, self._place_ticker = WeatherChunks(), Ticker(TEXT_RATE)
        self._plan_size = plan_eye(scene)[1] * PLAN_SLOPE if live else None
        self._first = scene.layout()
        self._ranged: set[str] = set()
        self._shown: dict[str, Deadband] = {}
        self.track: FloatArray | None = None
        """Least and greatest x and y (2, 2) [m] of all boats until now."""
        self.places: list[Places] = []
        """Where they were, for their names in a plan of all of the track."""
        self.change_scene(scene)

    def change_scene(self, scene: RecordScene) -> None:
        """Go on in a scene in which boats or objects have come or gone: rows have its columns now."""
        self._scene = scene
        self._layout = scene.layout()
        self._boats = [body for body in self._layout.bodies if body.kind == "boat"]
        self._paths = {body.name: body.path for body in scene.bodies}
        self._shown.clear()  # what has gone and come again is shown
        self._water.keep(scene.boats(), scene.sea_height)

    def __call__(self, rows: FloatArray) -> Iterator[Chunk]:
        """Chunks of what is shown of (n, columns) rows, n > 0; it is finite."""
        if not (rows.min() >= -_MAX_NUMBER and rows.max() <= _MAX_NUMBER):  # as NaN is not
            rows = np.clip(np.nan_to_num(rows), -_MAX_NUMBER, _MAX_NUMBER)
        posed = rows[self._shown_rows(rows)]
        for body in self._layout.bodies:
            path, pose = self._paths[body.name], self._layout.pose(body)
            if body.kind != "ball":
                yield from self._transforms(path, posed, posed[:, pose], 0.0 if body.kind == "boat" else _TOLERANCE)
            elif len(shot := rows[rows[:, pose.start + 2] > PARKED_HEIGHT]):
                yield numbers(path, shot[:, 0], rr.Points3D, positions=shot[:, pose][:, :3])
        for part in self._scene.parts:  # relative to what they hang on
            if part.joints:
                poses = np.hstack(part_poses(part, posed[:, self._layout.qpos]))
                yield from self._transforms(part.path, posed, poses, _TOLERANCE)
        yield from self._displays(rows)
        if self._boats:
            self._widen_track(rows)
            yield from self._sampled_chunks(rows)
        if self._boats and len(posed):
            yield numbers(FLEET, posed[:, 0], rr.Transform3D, translation=self._followed_place(posed))
            names = [boat.name for boat in self._boats]
            yield from self._water(names, posed[:, 0], self._of_boats(posed, self._layout.pose))

    def _shown_rows(self, rows: FloatArray) -> BoolArray:
        """Which rows are shown: some per second, and all where a boat or the sea moves fast, or the run is watched."""
        shown = self._pose(rows[:, 0])
        if self._boats:
            shown |= (np.abs(self._of_boats(rows, self._layout.velocity)) > _FAST_VELOCITIES).any(axis=(1, 2))
        return shown | (self._plan_size is not None or self._water.fast)

    def _transforms(
        self, path: str, rows: FloatArray, pose: FloatArray, near: float | tuple[float, ...]
    ) -> Iterator[Chunk]:
        """Poses (n, 7) of an entity where they are not `near` the last shown one."""
        taken, shown = self._shown.setdefault(path, Deadband(POSE_STEP, within=near))(pose)
        if taken.any():
            yield transforms(path, rows[taken, 0], shown[taken, :3], shown[taken, 3:])

    def _displays(self, rows: FloatArray) -> Iterator[Chunk]:
        """The colours of lights and placards where they have changed."""
        for shown in self._scene.displays:
            codes = shown.display.codes(rows[:, self._layout.marks], rows[:, 0])
            changed, _ = self._shown.setdefault(shown.part_path(""), Deadband(1.0))(codes.astype(np.float64))
            colors = [shown.display.colors(int(code)) for code in codes[changed]]
            for part in (part for part, surfaces in shown.surfaces.items() if surfaces and colors):
                rgba = np.round(255.0 * np.array([color[part] for color in colors])).astype(np.uint8)
                columns = rr.Mesh3D.columns(albedo_factor=rgba)
                yield Chunk.from_columns(shown.part_path(part), [times(rows[changed, 0])], columns)

    def _widen_track(self, rows: FloatArray) -> None:
        """Widen what the plan frames to where the boats are."""
        places = self._of_boats(rows, self._layout.pose)
        ends = [places.min(axis=(0, 1))[:2], places.max(axis=(0, 1))[:2], *([] if self.track is None else self.track)]
        self.track = np.array([np.min(ends, axis=0), np.max(ends, axis=0)])
        if self._plan_size is None and (taken := self._place_ticker(rows[:, 0])).any():
            own = {boat.name: places[taken, i, :2] for i, boat in enumerate(self._boats)}
            self.places.append((rows[taken, 0], own))

    def _followed_place(self, rows: FloatArray) -> FloatArray:
        """Places (n, 3) [m] of what the camera follows, at the mean water level."""
        own = [i for i, boat in enumerate(self._boats) if boat.name == self._scene.follow]
        places = self._of_boats(rows, self._layout.pose)[:, own or slice(None), :3]
        middle: FloatArray = places.mean(axis=1) * (1.0, 1.0, 0.0)
        return middle

    def _sampled_chunks(self, rows: FloatArray) -> Iterator[Chunk]:
        """Plots, the weather, the live plan and thrusts, each at its own rate."""
        seldom, often = self._plotted(rows[:, 0]), self._arrow(rows[:, 0])
        plotted, rows = rows[often if self._water.fast else seldom], rows[often]
        if len(plotted):
            yield from self._plots(plotted)
        if not len(rows):
            return
        yield from self._weather(self._scene, rows)
        if self._plan_size is not None:
            middle, size = self._followed_place(rows), np.full((len(rows), 3), self._plan_size)
            yield numbers(PLAN, rows[:, 0], rr.Transform3D, translation=middle, scale=size)
        for boat in self._boats:
            yield from self._thrust(boat, rows)

    def _plots(self, rows: FloatArray) -> Iterator[Chunk]:
        """One entity per quantity; its series are the boats, or the thrusters."""
        pose, velocity = (self._of_boats(rows, place) for place in (self._layout.pose, self._layout.velocity))
        speed, course, yaw, roll, pitch = motion(pose, velocity)
        x, boats = self._scene.parameters.x_from_east, [(boat.name, "") for boat in self._boats]
        plotted = speed, compass(yaw + x), compass(course + x), *np.degrees([yaw, roll, pitch])
        for name, values in zip(PLOTTED, plotted, strict=True):
            yield from self._lines(name, rows, values, boats)
        if "wind" in self._scene.weather():
            yield from self._plot("wind", rows, rows[:, 1:2])
        if self._layout.thrusters:
            yield from self._lines("thrust", rows, rows[:, self._layout.thrust], self._layout.thrusters)
            steering = np.degrees(rows[:, self._layout.angle])
            yield from self._lines("steering", rows, steering, self._layout.thrusters)

    def _lines(
        self, name: str, rows: FloatArray, values: FloatArray, series: Sequence[tuple[str, str]]
    ) -> Iterator[Chunk]:
        """Values (n, k) of series, each a boat and a thruster, if it is of one.

        Those of the first boat set are in one entity, as a plot's entity has as many series at all times: NaN of who is
        not there. Who joined later has an entity of its own.
        """
        columns = dict(zip(series, values.T, strict=True))
        boats = [(body.name, "") for body in self._first.bodies if body.kind == "boat"]
        if first := self._first.thrusters if series[0][1] else boats:
            gone = np.full(len(rows), np.nan)
            yield from self._plot(name, rows, np.column_stack([columns.pop(key, gone) for key in first]))
        for boat, own in groupby(columns, key=itemgetter(0)):
            yield plot(f"{name}/{boat}", rows, np.column_stack([columns[key] for key in own]))

    def _plot(self, name: str, rows: FloatArray, values: FloatArray) -> Iterator[Chunk]:
        """Values (n, k) of a quantity, and now and then the range around them that its axis has at least."""
        known = np.flatnonzero(np.isfinite(values).any(axis=1))[::_RANGE_STRIDE] if name in _MIN_RANGES else ()
        if len(known):
            if name not in self._ranged:
                looks = rr.SeriesPoints(colors=[UNSEEN_COLOR], marker_sizes=[0.0], names=[" ", " "])
                yield static(f"/plots/{name}/range", looks)
            self._ranged.add(name)
            around = _MIN_RANGES[name] * np.array([-1.0, 1.0])
            ends = np.stack([np.nanmin(values[known], axis=1), np.nanmax(values[known], axis=1)], axis=1) + around
            yield plot(f"{name}/range", rows[known], ends)
        yield plot(name, rows, values)

    def _of_boats(self, rows: FloatArray, place: Callable[[MovingBody], slice]) -> FloatArray:
        """The columns (n, boats, k) that every boat has at its `place`."""
        return np.stack([rows[:, place(boat)] for boat in self._boats], axis=1)

    def _thrust(self, boat: MovingBody, rows: FloatArray) -> Iterator[Chunk]:
        """Arrows of a boat's thrusts, and its engines, each where it has changed."""
        mine = [i for i, (name, _) in enumerate(self._layout.thrusters) if name == boat.name]
        if not mine:
            return
        time, thrusters = rows[:, 0], [self._scene.thrusters[i] for i in mine]
        now = np.stack([rows[:, self._layout.thrust][:, mine], rows[:, self._layout.angle][:, mine]], axis=1)
        path = self._paths[boat.name]
        moved, shown = self._shown.setdefault(f"{path}/thrust", Deadband(_PLOT_STEP))(now)
        if moved.any():
            yield thrust_arrows(path, time[moved], thrusters, shown[moved, 0], shown[moved, 1])
        for thruster, angle in zip(thrusters, np.moveaxis(now[:, 1], 1, 0), strict=True):
            turned, shown = self._shown.setdefault(f"{path}/{thruster.name}", Deadband(_PLOT_STEP))(angle)
            if turned.any():
                yield engine(path, time[turned], thruster, shown[turned])


def kept_columns(parts: Sequence[Part]) -> Iterable[rr.ComponentColumn]:
    """Columns of the parts of one entity as they are."""
    columns: dict[str, Any] = {}
    for name in (name for name in _KEPT_COLUMNS if name in parts[0].columns):
        cells: list[Any] = [cell for part in parts for cell in part.columns[name]]
        columns[name] = np.concatenate(cells) if isinstance(cells[0], np.ndarray) else cells
    kept: Iterable[rr.ComponentColumn] = rr.AnyValues.columns(**columns)
    return kept


def part_chunk(parts: Sequence[Part]) -> Chunk:
    """Parts of one entity as they are."""
    seconds = [time for part in parts if "time" in part.columns for time in part.times("time")]
    return Chunk.from_columns(parts[0].entity, [times(seconds)] if seconds else [], kept_columns(parts))


def transforms(path: str, time: FloatArray, position: FloatArray, quaternion: FloatArray) -> Chunk:
    """Poses of an entity: positions (n, 3) [m] and quaternions (n, 4), (w, x, y, z)."""
    return numbers(path, time, rr.Transform3D, translation=position, quaternion=quaternion[:, [1, 2, 3, 0]])


def plot(name: str, rows: FloatArray, values: FloatArray) -> Chunk:
    """Series (n, k) of one quantity, rounded: they take a third of the space."""
    return numbers(f"/plots/{name}", rows[:, 0], rr.Scalars, scalars=np.round(values / _PLOT_STEP) * _PLOT_STEP)


def motion(pose: FloatArray, velocity: FloatArray) -> tuple[FloatArray, ...]:
    """Speed [m/s] and course over ground, yaw, roll and pitch [rad] of poses (n, k, 7) and velocities (n, k, 6).

    R = Rz(yaw) Ry(pitch) Rx(roll); course and yaw are counter-clockwise from x, from -pi to pi.
    """
    w, x, y, z = np.moveaxis(pose[..., 3:], -1, 0)
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    vx, vy = velocity[..., 0], velocity[..., 1]
    return np.hypot(vx, vy), np.arctan2(vy, vx), yaw, roll, pitch


def thrust_arrows(
    path: str, time: FloatArray, thrusters: Sequence[RecordedThruster], thrust: FloatArray, angle: FloatArray
) -> Chunk:
    """Arrows of thrusts (n, k) [N] at steering angles (n, k) [rad], in the boat's frame."""
    origins = np.tile(np.add([thruster.position for thruster in thrusters], (0.0, 0.0, _ARROW_HEIGHT)), (len(time), 1))
    turns = [_engine_turns(thruster, own) for thruster, own in zip(thrusters, angle.T, strict=True)]
    vectors = in_world_axes(np.stack(turns, axis=1), np.array([thruster.direction for thruster in thrusters]))
    vectors *= (thrust * _ARROW_PER_NEWTON)[..., None]
    strips = arrow_strips(origins, vectors.reshape(-1, 3))
    seen = np.abs(thrust) * _ARROW_PER_NEWTON > _MIN_ARROW
    return numbers(f"{path}/thrust", time, rr.LineStrips3D, seen.sum(axis=1), strips=strips[seen.ravel()])


def _engine_turns(thruster: RecordedThruster, angle: FloatArray) -> FloatArray:
    """Quaternions (n, 4) from an engine at steering angles (n,) [rad] to its boat."""
    spin = np.zeros((len(angle), 4))
    spin[:, 0], spin[:, 3] = np.cos(angle / 2.0), np.sin(angle / 2.0)
    return quaternion_product(np.array(thruster.mount), spin)


def part_poses(part: RecordedPart, qpos: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3) [m] and quaternions (n, 4) (w, x, y, z) in the frame of what the part hangs on.

    `qpos` (n, nq) are all positions of MuJoCo's.
    """
    position, turn = np.hsplit(np.array([part.pose] * len(qpos)), [3])
    for joint in part.joints:
        value, axis = qpos[:, joint.qpos : joint.qpos + 1], np.array(joint.axis)
        if joint.kind == "slide":
            position = position + in_world_axes(turn, axis * value)
            continue
        half = 0.5 * value
        hinge = np.hstack([np.cos(half), np.sin(half) * axis])
        place = position + in_world_axes(turn, np.array(joint.anchor))
        turn = quaternion_product(turn, hinge if joint.kind == "hinge" else qpos[:, joint.qpos : joint.qpos + 4])
        position = place - in_world_axes(turn, np.array(joint.anchor))
    return position, turn


def engine(path: str, time: FloatArray, thruster: RecordedThruster, angle: FloatArray) -> Chunk:
    """An engine turning about its mount."""
    position = np.tile(thruster.position, (len(time), 1))
    return transforms(f"{path}/{thruster.name}", time, position, _engine_turns(thruster, angle))


def sensor_chunks(scene: RecordScene) -> Iterator[Chunk]:
    """Static data of sensors: poses on their boats, looks, and names of their series."""
    colors = scene.colors()
    for sensor in scene.sensors:
        if isinstance(sensor.config, CameraConfig):
            pinhole = rr.Pinhole(
                focal_length=focal_length(sensor.config),
                width=sensor.config.width,
                height=sensor.config.height,  # rerun has the axis go through the middle of the picture
                image_plane_distance=_PICTURE_DISTANCE,
                color=_FRUSTUM_COLOR,
                line_width=0.01,
            )
            yield static(sensor.path, _mount(sensor, _OPTICAL_AXES), pinhole)
            yield static(sensor.path, rr.EncodedImage.from_fields(media_type="image/jpeg"))
        elif sensor.type == "lidar":
            yield static(sensor.path, _mount(sensor), rr.Points3D.from_fields(radii=[rr.Radius.ui_points(2.0)]))
        elif sensor.type == "pinger":
            yield static(sensor.path, rr.LineStrips3D.from_fields(colors=[SOUND_COLOR], radii=[0.08]))
        elif sensor.type == "gps":
            fixes = rr.Points3D.from_fields(colors=[colors[sensor.boat]], radii=[rr.Radius.ui_points(2.2)])
            yield static(track_path(sensor), fixes)
        for plot in SENSOR_KINDS[sensor.type].plots:
            whose = f"{sensor.boat} {sensor.name}"
            names = [f"{whose} {axis}" for axis in "xyz"] if plot.axes else [whose]
            tints = AXIS_COLORS if plot.axes else [colors[sensor.boat]]
            yield static(_plot_path(plot.name, sensor), rr.SeriesLines(names=names, colors=tints, widths=1.5))


def _mount(sensor: RecordedSensor, turn: FloatArray | None = None) -> rr.Transform3D:
    """Where a sensor is on its boat, its axes turned."""
    rotation = np.array(sensor.rotation) @ (np.eye(3) if turn is None else turn)
    return rr.Transform3D(translation=np.array(sensor.position, np.float32), mat3x3=rotation.astype(np.float32))


def sensed_chunks(scene: RecordScene, parts: Sequence[Part]) -> Iterator[Chunk]:
    """Chunks of the parts of one sensor, in the order of time: a few at a time."""
    sensor = next(sensor for sensor in scene.sensors if sensor.readings_path == parts[0].entity)
    readings = RecordedReadings.of(sensor, parts)
    if sensor.type == "camera":
        yield from _pictures(sensor, readings)
        yield from (_boxes(sensor, part) for part in parts if "labels" in part.columns)
        return
    time, data = readings.time, [reading.data for reading in readings]
    if apart := sensor.readings_path != sensor.path:
        yield part_chunk(parts)
    yield from _plots(sensor, time, data)
    if isinstance(sensor.config, LidarConfig):
        yield _points(sensor.path, sensor.config.range, time, data, () if apart else kept_columns(parts))
    elif sensor.type == "gps":
        yield from _fixes(sensor, scene.parameters.georeference, time, data)
    elif sensor.type == "pinger":
        yield sound_chunk(sensor, time, data)


def _fixes(
    sensor: RecordedSensor, georeference: Georeference | None, time: FloatArray, fixes: Sequence[Any]
) -> Iterator[Chunk]:
    """A receiver's fixes as points at the mean water, as trails; and on the Earth."""
    angles = np.array([(fix.latitude, fix.longitude) for fix in fixes])
    yield numbers(f"/earth/{sensor.boat}/{sensor.name}", time, rr.GeoPoints, positions=angles)
    if georeference:
        places = np.array([georeference.to_enu(fix.latitude, fix.longitude, fix.altitude) for fix in fixes])
        places[:, 2] = 0.0
        yield numbers(track_path(sensor), time, rr.Points3D, positions=places)


def _pictures(sensor: RecordedSensor, readings: RecordedReadings) -> Iterator[Chunk]:
    """Pictures of a camera, a chunk each: they are large."""
    for time, sequence, blob in zip(readings.time, readings.sequence, readings.pictures(), strict=True):
        columns = [*rr.AnyValues.columns(time=[time], sequence=[sequence]), *rr.EncodedImage.columns(blob=[blob])]
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


def _points(
    path: str, ends: tuple[float, float], time: FloatArray, met: Sequence[Any], kept: Iterable[rr.ComponentColumn]
) -> Chunk:
    """Chunk of points that a lidar of a range with these ends [m] met, in its own frame, beside what is `kept`."""
    clouds = [_scan_points(one) if isinstance(one, Scan) else one.points for one in met]
    every, counts = np.concatenate(clouds), [len(cloud) for cloud in clouds]
    colors = _range_colors(np.linalg.norm(every, axis=1), *ends)
    return numbers(path, time, rr.Points3D, counts, kept, positions=every, colors=colors)


def _scan_points(scan: Scan) -> Float32Array:
    """The returns of a planar scan (n, 3) [m], in its own frame."""
    met = np.flatnonzero(np.isfinite(scan.ranges))
    angle, away = scan.angle_min + met * scan.angle_increment, scan.ranges[met]
    return np.stack([away * np.cos(angle), away * np.sin(angle), 0.0 * away], axis=1).astype(np.float32)


def _range_colors(distance: FloatArray | Float32Array, near: float, far: float) -> Uint32Array:
    """Colours (n,), 0xRRGGBBAA, on a scale of logarithms from `near` to `far` [m]."""
    first, last = np.log(max(near, 1.0)), np.log(max(far, 2.0))
    share = np.clip((np.log(np.maximum(distance, 1e-3)) - first) / (last - first), 0.0, 1.0)
    shade = np.round(share * (_SHADES - 1)).astype(np.int64)
    colors: Uint32Array = packed_colors(np.floor(ramp(_RANGE_COLORS, np.linspace(0.0, 1.0, _SHADES))))[shade]
    return colors


def sound_chunk(sensor: RecordedSensor, time: FloatArray, heard: Sequence[Any]) -> Chunk:
    """An arrow toward what a receiver hears, over the boat."""
    range_, bearing, elevation = np.array([list(vars(one).values()) for one in heard]).T
    ahead, up = np.cos(elevation), np.sin(elevation)
    way = np.stack([ahead * np.cos(bearing), ahead * np.sin(bearing), up], axis=1)
    vectors = (way * np.clip(range_, 0.0, _SOUND_LENGTH)[:, None]) @ np.array(sensor.rotation).T
    origins = np.tile((*sensor.position[:2], _SOUND_HEIGHT), (len(time), 1))
    return numbers(sensor.path, time, rr.LineStrips3D, strips=arrow_strips(origins, vectors))


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
        yield numbers(_plot_path(plot.name, sensor), time, rr.Scalars, scalars=values)
