"""What changes with time, as rerun chunks: poses, trails, arrows, plots, sea, and the exact rows.

`MovingChunks` holds the little that a chunk must know of the one before it: which samples the slower streams
took, and where each trail ended.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import BoolArray, ByteArray, FloatArray, IntArray
from vrx_mj.frames import compass, rotation_matrix
from vrx_mj.recording.packing import pack_rows
from vrx_mj.recording.record_scene import (
    PARKED,
    MovingBody,
    RecordedDisplay,
    RecordedPart,
    RecordedThruster,
    RecordScene,
    SeaHeight,
)

__all__ = [
    "FADES",
    "SIDE",
    "TIMELINE",
    "WAKE_RATE",
    "MovingChunks",
    "Wake",
    "event_chunk",
    "part_poses",
    "sea_patch",
    "sea_triangles",
    "state_chunk",
    "times",
    "wake_path",
]


TIMELINE = "sim_time"
SCALAR_RATE = 10.0
"""Plots, arrows [Hz]."""
TRAIL_RATE = 5.0
"""Pieces of a trail [Hz]."""
SEA_RATE = 5.0
"""Pictures of the sea [Hz]."""
SEA_FRAMES = 64
"""Pictures of the sea in one chunk: 1 MB."""
TRAIL_HEIGHT = 0.6
"""Height of a trail over the mean water [m], so that few waves hide it."""
ARROW_PER_NEWTON = 1.0 / 55.0
"""Length of a thrust arrow [m/N]."""
ARROW_HEIGHT = 0.75
"""Height of a thrust arrow over the engine's mount [m], so that the water does not hide it."""
FARTHEST = 1e6
"""Largest number that is shown: a run may diverge, a picture of it should not."""
WIND_HEIGHT = 6.0
"""Height of the wind arrow over the fleet [m]."""
ARROW_PER_WIND = 0.8
"""Length of the wind arrow [m per m/s]."""


def times(seconds: npt.ArrayLike) -> rr.TimeColumn:
    """The timeline, to a microsecond: readers of finer durations lose what does not fit Python's timedelta."""
    microseconds = np.round(np.asarray(seconds, np.float64) * 1e6).astype("timedelta64[us]")
    return rr.TimeColumn(TIMELINE, duration=microseconds.astype("timedelta64[ns]"))


def event_chunk(events: Sequence[tuple[float, str, str, str]]) -> Chunk:
    """Events (time, text, level, JSON of a touch) as a log."""
    time, text, level, touch = zip(*events, strict=True)
    columns = [*rr.TextLog.columns(text=text, level=level), *rr.AnyValues.columns(touch=list(touch))]
    return Chunk.from_columns("/events", [times(time)], columns)


def state_chunk(states: Sequence[tuple[float, bytes]]) -> Chunk:
    """Saved states (time, bytes); the time once more as float64, because the timeline rounds it."""
    time, blob = zip(*states, strict=True)
    columns = rr.AnyValues.columns(time=np.asarray(time), blob=list(blob))
    return Chunk.from_columns("/record/states", [times(time)], columns)


class Ticker:
    """Picks rows at a lower rate: the first row of each tick of its clock."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._last = -math.inf

    def __call__(self, time: FloatArray) -> BoolArray:
        """Which of the rows at `time` (n,) [s] to take."""
        tick = np.floor(time * self._rate + 1e-6)
        taken: BoolArray = np.diff(tick, prepend=self._last) != 0
        self._last = tick[-1]
        return taken


class MovingChunks:
    """Turns blocks of rows into chunks."""

    def __init__(self, scene: RecordScene) -> None:
        self._scalar, self._trail, self._sea = Ticker(SCALAR_RATE), Ticker(TRAIL_RATE), Ticker(SEA_RATE)
        self._wake, self._wakes = Ticker(WAKE_RATE), dict[str, Wake]()
        self._trail_end: dict[str, FloatArray] = {}
        self._angle: dict[tuple[str, str], float] = {}
        self._codes: dict[str, int] = {}
        self._first = scene.layout()
        self.boat_set = 0
        """Number of the boat set whose rows are to come: how often boats or objects came or went."""
        self._take(scene)

    def go_on(self, scene: RecordScene) -> None:
        """Go on in a scene in which boats or objects have come or gone: rows have its columns now."""
        self.boat_set += 1
        self._take(scene)

    def _take(self, scene: RecordScene) -> None:
        self._scene = scene
        self._layout = scene.layout()
        self._boats = [body for body in self._layout.bodies if body.kind == "boat"]
        self._paths = {body.name: body.path for body in scene.bodies}
        there = {boat.name for boat in self._boats}
        self._trail_end = {boat: end for boat, end in self._trail_end.items() if boat in there}
        self._wakes = {boat: self._wakes.get(boat) or Wake() for boat in there}
        self._angle = {key: last for key, last in self._angle.items() if key[0] in there}
        seen = {shown.display.name for shown in scene.displays}
        self._codes = {name: last for name, last in self._codes.items() if name in seen}

    def __call__(self, rows: FloatArray) -> Iterator[Chunk]:
        """Chunks of (n, columns) rows, n > 0, the exact rows first; what is shown of them is finite."""
        yield exact_rows(rows, self.boat_set)
        rows = np.clip(np.nan_to_num(rows), -FARTHEST, FARTHEST)
        for body in self._layout.bodies:
            pose = rows[:, self._layout.pose(body)]
            if body.kind == "ball":
                yield from flights(self._paths[body.name], rows[:, 0], pose[:, :3])
            else:
                yield transforms(self._paths[body.name], rows[:, 0], pose[:, :3], pose[:, [4, 5, 6, 3]])
        for part in self._scene.parts:  # relative to what they hang on
            if part.joints:
                position, turn = part_poses(part, rows[:, self._layout.qpos])
                yield transforms(part.path, rows[:, 0], position, turn[:, [1, 2, 3, 0]])
        for shown in self._scene.displays:
            name = shown.display.name
            codes = shown.display.codes(rows[:, self._layout.marks], rows[:, 0])
            changed = np.diff(codes, prepend=self._codes.get(name, -1)) != 0
            self._codes[name] = int(codes[-1])
            if changed.any():
                yield from repainted(shown, rows[changed, 0], codes[changed])
        if self._boats:
            yield from self._fleet(rows)
            yield from self._trails(rows[self._trail(rows[:, 0])])
            yield from self._slow(rows[self._scalar(rows[:, 0])])
            if self._scene.sea_height is not None:
                yield from self._seas(rows[self._sea(rows[:, 0])])
                yield from self._foam(rows[self._wake(rows[:, 0])])

    def _fleet(self, rows: FloatArray) -> Iterator[Chunk]:
        """The fleet's middle at the mean water level: what the camera follows."""
        middle = self._boat_positions(rows).mean(axis=1) * (1.0, 1.0, 0.0)
        yield transforms("/world/fleet", rows[:, 0], middle)

    def _boat_positions(self, rows: FloatArray) -> FloatArray:
        """Positions (n, boats, 3) of the boats [m]."""
        start = [self._layout.pose(boat).start for boat in self._boats]
        return rows[:, np.add.outer(start, np.arange(3))]

    def _trails(self, rows: FloatArray) -> Iterator[Chunk]:
        """Each row the piece of the way since the row before."""
        if not len(rows):
            return
        here = self._boat_positions(rows) * (1.0, 1.0, 0.0) + (0.0, 0.0, TRAIL_HEIGHT)
        for i, boat in enumerate(self._boats):
            last = self._trail_end.get(boat.name, here[0, i])
            self._trail_end[boat.name] = here[-1, i]
            before = np.concatenate([last[None], here[:-1, i]])
            strips = np.stack([before, here[:, i]], axis=1).astype(np.float32)
            yield Chunk.from_columns(
                f"/world/trails/{boat.name}", [times(rows[:, 0])], rr.LineStrips3D.columns(strips=strips)
            )

    def _slow(self, rows: FloatArray) -> Iterator[Chunk]:
        """What is written at the rate of the plots."""
        if not len(rows):
            return
        yield from self._plots(rows)
        yield self._wind(rows)
        for boat in self._boats:
            yield from self._thrust(boat, rows)

    def _plots(self, rows: FloatArray) -> Iterator[Chunk]:
        """One entity per quantity; its series are the boats, or the thrusters."""
        speed, course, yaw, roll, pitch = motion(self._layout_poses(rows), self._boat_velocities(rows))
        x = self._scene.parameters.x_from_east if self._scene.parameters else 0.0
        bearings = {"heading": compass(yaw + x), "course": compass(course + x)}
        angles = {"yaw": yaw, "roll": roll, "pitch": pitch}
        degrees = {name: np.degrees(values) for name, values in angles.items()}
        for name, values in ({"speed": speed} | bearings | degrees).items():
            yield from self._lines(name, rows, values, [(boat.name, "") for boat in self._boats])
        yield plot("wind", rows, rows[:, 1:2])
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
        boats = [(body.name, "") for body in self._first.bodies if body.kind == "boat"]
        shared = [*boats, *self._first.thrusters]
        first = [key for key in shared if bool(key[1]) == bool(series[0][1])]
        known = [i for i, key in enumerate(series) if key in first]
        together = np.full((len(rows), len(first)), np.nan)
        together[:, [first.index(series[i]) for i in known]] = values[:, known]
        if first:
            yield plot(name, rows, together)
        for boat in dict.fromkeys(key[0] for i, key in enumerate(series) if i not in known):
            own = [i for i, key in enumerate(series) if key[0] == boat and i not in known]
            yield plot(f"{name}/{boat}", rows, values[:, own])

    def _layout_poses(self, rows: FloatArray) -> FloatArray:
        """Poses (n, boats, 7) of the boats."""
        return np.stack([rows[:, self._layout.pose(boat)] for boat in self._boats], axis=1)

    def _boat_velocities(self, rows: FloatArray) -> FloatArray:
        """Velocities (n, boats, 6) of the boats."""
        return np.stack([rows[:, self._layout.velocity(boat)] for boat in self._boats], axis=1)

    def _wind(self, rows: FloatArray) -> Chunk:
        east, north = self._scene.wind_direction
        turned = rows[:, self._layout.wind_angle].sum(axis=1)  # none, or one
        cos, sin = np.cos(turned), np.sin(turned)
        direction = np.stack([cos * east - sin * north, sin * east + cos * north, np.zeros(len(rows))], axis=1)
        vectors = rows[:, 1:2] * direction * ARROW_PER_WIND
        columns = rr.Arrows3D.columns(vectors=vectors.astype(np.float32))
        return Chunk.from_columns("/world/fleet/wind", [times(rows[:, 0])], columns)

    def _thrust(self, boat: MovingBody, rows: FloatArray) -> Iterator[Chunk]:
        """Arrows of a boat's thrusts, and its engines where they turned since the last block."""
        mine = [i for i, (name, _) in enumerate(self._layout.thrusters) if name == boat.name]
        if not mine:
            return
        thrust, angle = rows[:, self._layout.thrust][:, mine], rows[:, self._layout.angle][:, mine]
        thrusters = [self._scene.thrusters[i] for i in mine]
        yield thrust_arrows(self._paths[boat.name], rows[:, 0], thrusters, thrust, angle)
        for k, thruster in enumerate(thrusters):
            key = boat.name, thruster.name
            if np.any(angle[:, k] != self._angle.get(key, math.nan)):
                yield engine(self._paths[boat.name], rows[:, 0], thruster, angle[:, k])
            self._angle[key] = float(angle[-1, k])

    def _seas(self, rows: FloatArray) -> Iterator[Chunk]:
        height = self._scene.sea_height
        assert height is not None
        fleet = self._boat_positions(rows)[:, :, :2]
        for start in range(0, len(rows), SEA_FRAMES):
            time = rows[start : start + SEA_FRAMES, 0]
            patches = [sea_patch(height, fleet[start + k], float(t)) for k, t in enumerate(time)]
            columns = rr.Mesh3D.columns(
                vertex_positions=np.concatenate([positions for positions, _ in patches]),
                vertex_colors=np.concatenate([colors for _, colors in patches]),
            )
            lengths = [SIDE * SIDE] * len(time)
            yield Chunk.from_columns("/world/sea", [times(time)], columns.partition(lengths))

    def _foam(self, rows: FloatArray) -> Iterator[Chunk]:
        """The wake of every boat."""
        height = self._scene.sea_height
        assert height is not None
        places = self._boat_positions(rows)[:, :, :2]
        for i, boat in enumerate(self._boats if len(rows) else ()):
            wake = self._wakes[boat.name]
            strips = [wake.strips(float(row[0]), place, height) for row, place in zip(rows, places[:, i], strict=True)]
            columns = rr.LineStrips3D.columns(strips=[strip for several in strips for strip in several])
            lengths = [len(FADES)] * len(rows)
            yield Chunk.from_columns(wake_path(boat.name), [times(rows[:, 0])], columns.partition(lengths))


def wake_path(boat: str) -> str:
    """The entity of a boat's wake."""
    return f"/world/wakes/{boat}"


def exact_rows(rows: FloatArray, boat_set: int) -> Chunk:
    """A block of rows as they are, to the last bit, with the number of their boat set."""
    columns = rr.AnyValues.columns(block=[pack_rows(rows)], company=[boat_set])
    return Chunk.from_columns("/record/rows", [times(rows[:1, 0])], columns)


def transforms(path: str, time: FloatArray, position: FloatArray, quaternion: FloatArray | None = None) -> Chunk:
    """Poses of an entity: positions (n, 3) [m] and quaternions (n, 4), here (x, y, z, w)."""
    moved = position.astype(np.float32)
    if quaternion is None:
        columns = rr.Transform3D.columns(translation=moved)
    else:
        columns = rr.Transform3D.columns(translation=moved, quaternion=quaternion.astype(np.float32))
    return Chunk.from_columns(path, [times(time)], columns)


def flights(path: str, time: FloatArray, position: FloatArray) -> Iterator[Chunk]:
    """A ball's positions (n, 3) [m] since it was shot."""
    shot = position[:, 2] > PARKED
    if shot.any():
        columns = rr.Points3D.columns(positions=position[shot].astype(np.float32))
        yield Chunk.from_columns(path, [times(time[shot])], columns)


def repainted(shown: RecordedDisplay, time: FloatArray, codes: IntArray) -> Iterator[Chunk]:
    """The colours of every part of a light or placard that shows `codes` (n,) from times (n,) [s] on."""
    colors = [shown.display.colors(int(code)) for code in codes]
    for part, surfaces in shown.surfaces.items():
        if surfaces:
            rgba = np.round(255.0 * np.array([color[part] for color in colors])).astype(np.uint8)
            yield Chunk.from_columns(shown.part_path(part), [times(time)], rr.Mesh3D.columns(albedo_factor=rgba))


def plot(name: str, rows: FloatArray, values: FloatArray) -> Chunk:
    """Series (n, k) of one quantity."""
    columns: Iterable[rr.ComponentColumn] = rr.Scalars.columns(scalars=values.reshape(-1)).partition(
        [values.shape[1]] * len(rows)
    )
    return Chunk.from_columns(f"/plots/{name}", [times(rows[:, 0])], columns)


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
    mount = np.add([thruster.position for thruster in thrusters], (0.0, 0.0, ARROW_HEIGHT))
    x, y, z = np.array([thruster.direction for thruster in thrusters]).T
    turns = np.array([rotation_matrix(thruster.mount) for thruster in thrusters])
    cos, sin = np.cos(angle), np.sin(angle)
    steered = np.stack([cos * x - sin * y, sin * x + cos * y, 0 * angle + z], axis=-1)
    vectors = np.einsum("kij,nkj->nki", turns, steered) * (thrust * ARROW_PER_NEWTON)[..., None]
    columns = rr.Arrows3D.columns(
        vectors=vectors.reshape(-1, 3).astype(np.float32),
        origins=np.tile(mount, (len(time), 1)).astype(np.float32),
    )
    lengths = [len(thrusters)] * len(time)
    return Chunk.from_columns(f"{path}/thrust", [times(time)], columns.partition(lengths))


def part_poses(part: RecordedPart, qpos: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3) [m] and quaternions (n, 4) (w, x, y, z) in the frame of what the part hangs on.

    `qpos` (n, nq) are all positions of MuJoCo's.
    """
    position, turn = np.array([part.position] * len(qpos)), np.array([part.quaternion] * len(qpos))
    for joint in part.joints:
        value, axis = qpos[:, joint.qpos : joint.qpos + 1], np.array(joint.axis)
        if joint.kind == "slide":
            position = position + _turned(turn, axis * value)
            continue
        half = 0.5 * value
        hinge = np.hstack([np.cos(half), np.sin(half) * axis])
        place = position + _turned(turn, np.array(joint.anchor))
        turn = _product(turn, hinge if joint.kind == "hinge" else qpos[:, joint.qpos : joint.qpos + 4])
        position = place - _turned(turn, np.array(joint.anchor))
    return position, turn


def _turned(quaternion: FloatArray, vector: FloatArray) -> FloatArray:
    """Vectors (3,) or (n, 3) turned by quaternions (n, 4)."""
    w, axis = quaternion[:, :1], quaternion[:, 1:]
    twice = 2.0 * np.cross(axis, vector)
    return vector + w * twice + np.cross(axis, twice)


def _product(one: FloatArray, other: FloatArray) -> FloatArray:
    """Products (n, 4) of quaternions: the rotation `other`, then `one`."""
    v, w = one[:, 1:], other[:, 1:]
    scalar = one[:, :1] * other[:, :1] - (v * w).sum(axis=1, keepdims=True)
    return np.hstack([scalar, one[:, :1] * w + other[:, :1] * v + np.cross(v, w)])


def engine(path: str, time: FloatArray, thruster: RecordedThruster, angle: FloatArray) -> Chunk:
    """An engine turning about its mount."""
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    w, x, y, z = thruster.mount
    quaternion = np.stack([x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s], axis=-1)
    position = np.tile(np.array(thruster.position), (len(time), 1))
    return transforms(f"{path}/{thruster.name}", time, position, quaternion)


SIDE = 32
"""Vertices along one side."""
MARGIN = 22.0
"""Sea around the outermost boat [m]."""
CELLS = (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)
"""Sizes of a cell [m] to choose from, so that vertices keep their places while the fleet moves."""
HORIZON = 2500.0
"""Distance of the outermost ring [m]."""
STEP = 1.0 / 64.0
"""Heights are rounded to this [m]: they compress twice as well, and nobody sees it."""
SUN = (0.55, 0.35)
"""Direction from which the light comes, east and north."""
DEEP, CREST = np.array([9.0, 48.0, 79.0]), np.array([112.0, 178.0, 196.0])


def sea_patch(
    height: SeaHeight, boats: FloatArray, time: float
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Positions (1024, 3) [m] and colours (1024,) of the patch around `boats` (n, 2) [m] at `time` [s]."""
    east, north, cell = _grid(boats)
    x, y = np.meshgrid(east, north)
    z = np.zeros((SIDE, SIDE))
    inner = (slice(1, -1), slice(1, -1))
    z[inner] = np.reshape(height(x[inner], y[inner], time), (SIDE - 2, SIDE - 2))
    z = np.round(z / STEP) * STEP
    positions = np.stack([x, y, z], axis=-1).astype(np.float32).reshape(-1, 3)
    return positions, _palette()[_shade(z, cell)].reshape(-1)


def _grid(boats: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """East and north coordinates of the grid lines [m], and the size of a cell [m]."""
    low, high = boats.min(axis=0), boats.max(axis=0)
    needed = (float((high - low).max()) + 2 * MARGIN) / (SIDE - 3)
    cell = next((size for size in CELLS if size >= needed), CELLS[-1])
    centre = np.round((low + high) / 2 / cell) * cell
    line = (np.arange(SIDE) - (SIDE - 1) / 2) * cell
    line[0], line[-1] = -HORIZON, HORIZON
    return line + centre[0], line + centre[1], cell


def _shade(z: FloatArray, cell: float) -> ByteArray:
    """Shades 0 to 31: slopes toward the sun and crests are light, slopes away from it and troughs dark."""
    toward_north, toward_east = np.gradient(z, cell)
    tilt = SUN[0] * toward_east + SUN[1] * toward_north
    light = 0.38 - 0.36 * np.tanh(12.0 * tilt) + 0.4 * z  # tanh: a calm sea shows, a steep one is not cut off
    light[[0, -1], :] = light[:, [0, -1]] = 0.38
    shades: ByteArray = (np.clip(light, 0.0, 1.0) * 31.0).astype(np.uint8)
    return shades


def _palette() -> npt.NDArray[np.uint32]:
    """Colours (32,) from deep water to crest, 0xRRGGBBAA."""
    share = np.linspace(0.0, 1.0, 32)[:, None]
    red, green, blue = np.round(DEEP + (CREST - DEEP) * share).astype(np.uint32).T
    colors: npt.NDArray[np.uint32] = (red << 24) | (green << 16) | (blue << 8) | np.uint32(255)
    return colors


def sea_triangles() -> npt.NDArray[np.uint32]:
    """Triangles (2 * 31 * 31, 3) of the patch."""
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1, 1)
    first = corner + np.array([0, 1, SIDE + 1])
    second = corner + np.array([0, SIDE + 1, SIDE])
    return np.concatenate([first, second]).astype(np.uint32)


WAKE_RATE = 2.0
"""Wakes drawn, and points that a boat leaves, per second [Hz]."""
LASTS = 20.0
"""How long a point is seen [s]."""
FADES = ((214, 232, 240), (150, 186, 204), (98, 142, 168), (60, 104, 134))
"""Colours of a wake from the boat to its end, each over as long a time: the last is nearly that of the sea."""
OVER = 0.06
"""Height over the water [m], so that the facets of the sea's mesh hide no piece."""


class Wake:
    """The wake of a boat."""

    def __init__(self) -> None:
        self._left = np.zeros((0, 3))

    def strips(self, time: float, place: FloatArray, height: SeaHeight) -> list[npt.NDArray[np.float32]]:
        """Leave a point at `time` [s] at a place (2,) [m]; the wake then, a strip (n, 3) [m] for each colour.

        Every point lies on the sea as it is at `time`. The first is the newest; strips begin where the one before ends.
        """
        self._left = np.concatenate([[(time, *place)], self._left])
        self._left = self._left[time - self._left[:, 0] <= LASTS + 1e-6]
        x, y = self._left[:, 1], self._left[:, 2]
        points = np.column_stack([x, y, np.asarray(height(x, y, time)) + OVER]).astype(np.float32)
        share = np.minimum((time - self._left[:, 0]) / LASTS * len(FADES), len(FADES) - 1e-9).astype(int)
        ends = np.searchsorted(share, np.arange(len(FADES) + 1))
        return [points[max(begin - 1, 0) : end] for begin, end in pairwise(ends)]
