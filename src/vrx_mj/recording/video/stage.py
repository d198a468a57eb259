"""Draw moments of a recording: where everything was, where the camera is, the sea, and foam behind the boats.

A recording is known as a whole, so a camera's path is smoothed with what comes after as with what was before.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_number, as_numbers
from vrx_mj.arrays import ByteArray, FloatArray, Uint32Array
from vrx_mj.errors import CommandError, RecordError, quote
from vrx_mj.mjcf.scene import add_skin, compiled_spec, drawing_spec
from vrx_mj.physics.surface import EDGE, PLAIN, RINGS, SPOKES, draw_surface, fan_triangles
from vrx_mj.recording.antialiasing import antialias, fill_sky, smooth
from vrx_mj.recording.boat_sets import MAX_NUMBER, BoatSet, columns_in
from vrx_mj.recording.checks import looks_again
from vrx_mj.recording.reader import Record
from vrx_mj.recording.simulation_scene import check_columns, coarser_faces
from vrx_mj.runtime.sensing import display_colors
from vrx_mj.runtime.warmup import compile_notice
from vrx_mj.sensors.canvas import Canvas
from vrx_mj.sensors.displays import check_display_marks, displays_of
from vrx_mj.sensors.sea import SeaSkin, Skin
from vrx_mj.sensors.view import MIN_RADIUS, View
from vrx_mj.tasks import TASK_KINDS
from vrx_mj.tasks.referee import TaskStatus

_SMOOTH = 1.2
"""Standard deviation of the smoothing of a followed path [s]."""
_SMOOTH_TURN = 2.0
"""Standard deviation of the smoothing of a followed heading [s]."""
_PLACE_RATE = 10.0
"""Rate of the places of a smoothed path [Hz]."""
BEHIND, HIGH, AHEAD = 11.0, 3.6, 5.0
"""Distances of the chasing camera behind the boat and over the water, and of its target before the boat [m]."""
LARGE_RADIUS = 4.0
"""Radius of a boat from which these distances grow with it [m]."""
_FOV = 1.15
"""Horizontal field of view [rad]."""
ABOVE_MARGIN = 12.0
"""Width of water around the boats in the view from above [m]."""
_MIN_ABOVE = 22.0
"""Least half height of the view from above [m]."""
_CLIPPING = (0.3, 6000.0)
"""Nearest and farthest distance that is drawn [m]."""
_ABOVE_AXIS = 0.5
"""Height of the view's axis [unit vector], negative, below which a picture is one from above."""
_MIN_RADIUS_ABOVE = 1.0
"""Least radius of a geom that is drawn in a picture from above, which has many [pixels]."""
_RELIEF_ABOVE = 5.0
"""Factor of the shading of waves seen from above, where little of the sky mirrors in the sea."""
_FLAT_SLOPE = 0.025
"""Slope of all waves together below which fewer points of the sea are drawn."""
_SKY_SHARE = 0.14
"""Share of the sky's colour that is added to a sea seen from above."""
LASTS = 14.0
"""Time for which foam is visible [s]."""
_PIECES_PER_SECOND = 5.0
"""Number of pieces of a wake per second."""
MAX_PIECES = math.floor(LASTS * _PIECES_PER_SECOND) + 2
"""Largest number of pieces of a wake."""
_FOAM = "vrx_mj/foam"
"""Name of the skin that is the foam, and of its material and texture."""
FULL_SPEED = 2.0
"""Speed from which foam is as white as it gets [m/s]."""
_SLOWEST = 0.25
"""Speed below which a hull leaves no foam [m/s]."""
WHITE = 0.38
"""Opacity of fresh foam."""
WIDTH, SPREAD = 0.28, 0.09
"""Width of fresh foam [m], and its growth [m/s]."""
FOAM_HEIGHT = 0.05
"""Height of foam over the facets of the drawn sea [m], whose edges it does not follow."""


@dataclass(frozen=True, eq=False)
class Eye:
    """A place and a direction to look."""

    position: FloatArray
    """Position (3,) [m]."""
    rotation: FloatArray
    """Rotation (3, 3) from camera to world axes; x forward, y left, z up."""
    field: float = _FOV
    """Horizontal field of view [rad]."""


def looking(position: Sequence[float], target: Sequence[float], up: Sequence[float], field: float = _FOV) -> Eye:
    """An eye at `position` that looks at `target` [m]; `up` is what is up in the picture.

    Raises:
        CommandError: one of them is not three numbers, the direction is not known, or `field` is no angle [rad].
    """
    given = {"position": position, "target": target, "up": up}
    place, aim, above = (np.array(as_numbers(name, value, 3, MAX_NUMBER)) for name, value in given.items())
    ahead = aim - place
    left = np.cross(above, ahead)
    if not left.any():
        raise CommandError(f"invalid target {quote(target)}: a place away from the position and not along up is needed")
    if not 0.0 < as_number(field) < math.pi:
        raise CommandError(f"invalid field {quote(field)}: an angle from 0 to pi rad is needed")
    ahead /= math.hypot(*ahead)
    left /= math.hypot(*left)
    return Eye(place, np.column_stack([ahead, left, np.cross(ahead, left)]), field)


def view_of(eye: Eye, width: int, height: int) -> View:
    """View of an eye in a picture of a size [pixels]."""
    smallest = _MIN_RADIUS_ABOVE if eye.rotation[2, 0] < -_ABOVE_AXIS else MIN_RADIUS
    return View.of_camera(eye.position, eye.rotation, eye.field, (width, height), _CLIPPING, smallest)


class Chase:
    """An eye behind a boat."""

    def __init__(self, path: FloatArray, level: float) -> None:
        """Follow a path (n, 4): time [s], east, north [m] and heading [rad], over water at `level` [m]."""
        self._level = level
        self._place = smooth_path(path[:, 0], path[:, 1:3], _SMOOTH)
        self._heading = smooth_path(path[:, 0], path[:, 3:4], _SMOOTH_TURN)
        self.radius = 0.0
        """How far the boat reaches from its origin [m]."""

    def eye(self, time: float) -> Eye:
        """Where it is at a time [s]."""
        place, (heading,) = self._place(time), self._heading(time).tolist()
        along = np.array([math.cos(heading), math.sin(heading)])
        scale = max(self.radius / LARGE_RADIUS, 1.0)
        back, front = place - scale * BEHIND * along, place + scale * AHEAD * along
        return looking((*back, self._level + scale * HIGH), (*front, self._level + scale * 0.6), (0.0, 0.0, 1.0))


class Above:
    """An eye above boats, north up."""

    def __init__(self, paths: Sequence[FloatArray], level: float, aspect: float) -> None:
        """Follow paths as `Chase` does one; `aspect` is the picture's width by its height."""
        self._level, self._aspect = level, aspect
        self._paths = [(smooth_path(path[:, 0], path[:, 1:3], _SMOOTH), path[0, 0], path[-1, 0]) for path in paths]
        self._half = _MIN_ABOVE
        for time in np.unique(np.concatenate([path[:, 0] for path in paths]))[::10]:
            width, height = np.subtract(*self._box(time)[::-1]) / 2.0 + ABOVE_MARGIN
            self._half = max(self._half, float(height), float(width) / aspect)

    def eye(self, time: float) -> Eye:
        """Where it is at a time [s]: as high as all boats need over the whole recording."""
        low, high = self._box(time)
        middle = (low + high) / 2.0
        height = self._level + self._half / math.tan(_FOV / 2.0) * self._aspect
        return looking((*middle, height), (*middle, self._level), (0.0, 1.0, 0.0))

    def _box(self, time: float) -> tuple[FloatArray, FloatArray]:
        """The least and the largest east and north of boats that are there."""
        there = [place(time) for place, begin, end in self._paths if begin <= time <= end]
        spots = np.array(there or [place(end) for place, _, end in self._paths])
        return spots.min(axis=0), spots.max(axis=0)


def smooth_path(time: FloatArray, values: FloatArray, calm: float) -> Callable[[float | FloatArray], FloatArray]:
    """A function of time [s] through the values (n, k) of a path at times (n,) [s], smooth.

    They are weighted by a Gaussian of standard deviation `calm` [s]. Beyond its ends the path goes on as a mirror would
    show it, turned by half a turn, so that a straight stays one.
    """
    columns = values.T
    if len(time) > 1:
        count = max(2, math.ceil((time[-1] - time[0]) * _PLACE_RATE) + 1)
        grid = np.linspace(time[0], time[-1], count)
        even = np.array([np.interp(grid, time, column) for column in columns])
        mirrored = np.pad(even, ((0, 0), (count - 1, count - 1)), "reflect", reflect_type="odd")
        deviation = calm * (count - 1) / (time[-1] - time[0])  # in steps of the grid
        reach = min(math.ceil(4.0 * deviation), count - 1)
        weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
        smooth = [np.convolve(column, weights / weights.sum(), "same") for column in mirrored]
        time, columns = grid, np.array(smooth)[:, count - 1 : 2 * count - 1]
    return lambda at: np.stack([np.interp(at, time, column) for column in columns], axis=-1)


@dataclass(frozen=True, eq=False)
class Instant:
    """All that is drawn of one time."""

    time: float
    """Simulated time [s]."""
    boat_set: int
    """Number of the boats that sail together then, and of their world."""
    qpos: FloatArray
    """Positions, as the model of these boats has them."""
    marks: FloatArray
    """Marks of what lights and placards show."""


class Footage:
    """A recording that can be asked for any moment of it."""

    def __init__(self, recorded: Record) -> None:
        """Take a recording.

        Raises:
            RecordError: it has no rows, or no world.
        """
        if "scene.json" not in recorded.files:
            raise RecordError(f"'{recorded.path}' has no world to draw: it was not made by a simulation")
        if not len(recorded.time):
            raise RecordError(f"'{recorded.path}' has no motion to draw: it ends before its first row")
        self.recorded = recorded
        self.start, self.end = map(float, recorded.time[[0, -1]])
        """Times of the first and the last row [s]."""
        self.level = recorded.parameters.sea.level
        """Mean height of the water [m]."""
        self._columns = [columns_in(recorded.layout, boat_set.layout) for boat_set in recorded.companies]
        layouts = [boat_set.layout for boat_set in recorded.companies]
        self._turns = [[layout.pose(body).start + 3 for body in layout.bodies] for layout in layouts]

    def at(self, time: float) -> Instant:
        """Everything at a time [s], between two rows on the straight line from one to the other."""
        rows, numbers = self.recorded.rows, self.recorded.row_companies
        after = bisect_right(self.recorded.time, time)
        before = max(after - 1, 0)
        number = int(numbers[before])
        layout, columns = self.recorded.companies[number].layout, self._columns[number]
        row = first = rows[before, columns]
        if before < after < len(rows) and numbers[after] == number:
            row = between(first, rows[after, columns], time, self._turns[number])
        return Instant(time, number, row[layout.qpos], first[layout.marks])

    def places(self, moment: Instant) -> dict[str, FloatArray]:
        """Where the boats' origins are at a moment, (3,) [m]."""
        boats = (body for body in self.recorded.companies[moment.boat_set].layout.bodies if body.kind == "boat")
        return {boat.name: moment.qpos[boat.qpos : boat.qpos + 3] for boat in boats}

    def path(self, boat: str) -> FloatArray:
        """Where a boat was, (n, 4): time [s], east, north [m] and heading [rad], rows in which it was not left out."""
        track = self.recorded.boats[boat]
        there = np.isfinite(track.position[:, 0])
        w, x, y, z = track.quaternion[there].T
        heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
        return np.column_stack([self.recorded.time[there], track.position[there, :2], heading])

    @cached_property
    def _statuses(self) -> tuple[tuple[float, str, TaskStatus, str], ...]:
        """Time [s], and name, status and unit of the task whenever its referee looked; empty without a task."""
        if self.recorded.parameters.task is None:
            return ()
        referee, looks = looks_again(self.recorded)
        unit = TASK_KINDS[referee.type].unit
        return tuple((frame.time, referee.name, replace(referee.status), unit) for frame, _ in looks)

    def status_at(self, time: float) -> tuple[str, TaskStatus, str] | None:
        """Name, status and unit of the task at a time [s]; None without one, or before its referee first looked."""
        count = bisect_right(self._statuses, time + 1e-9, key=itemgetter(0))
        return self._statuses[count - 1][1:] if count else None


def between(first: FloatArray, second: FloatArray, time: float, turns: list[int]) -> FloatArray:
    """A row at `time` [s] between two rows, whose first number is their time; `turns` are where quaternions begin."""
    share = (time - first[0]) / (second[0] - first[0])
    row: FloatArray = first + share * (second - first)
    places = np.add.outer(turns, range(4))
    begin, end = first[places], second[places]
    near = np.where(np.sum(begin * end, axis=1, keepdims=True) < 0.0, -end, end)
    turn = begin + share * (near - begin)
    length = np.linalg.norm(turn, axis=1, keepdims=True)
    row[places] = np.where(length > 0.0, turn / np.maximum(length, 1e-300), begin)
    return row


class Stage:
    """The world of boats that sail together, with a drawing context."""

    def __init__(
        self,
        boat_set: BoatSet,
        paths: Mapping[str, FloatArray],
        size: tuple[int, int],
        seed: int = 0,
        cell: float = 0.0,
    ) -> None:
        """Compile and open what is needed.

        Args:
            boat_set: the boats and their world.
            paths: by boat, times [s], places [m] and headings [rad], (n, 4), of the whole recording.
            size: of the largest picture: width, height [pixels].
            seed: of the run, from which a random sea has its phases.
            cell: length [m] of details of boats that need not be drawn.

        Raises:
            RenderError: nothing can draw here.
            StateError: the recording holds no world.
            RecordError: its rows are not of that world.
        """
        world = boat_set.world
        parameters = world.parameters
        spec = drawing_spec(world)
        found = ((parameters.boats[engine.hull].name, engine.position[:2]) for engine in parameters.thrusters)
        sterns = dict.fromkeys((boat, place) for boat, place in found if place[0] < 0.0)  # engines behind the middle
        hulls = [(paths[boat], stern) for boat, stern in sterns if boat in paths]
        self._foam = Foam(spec, hulls if spec.skins else ())
        self._model = compiled_spec(spec, world.name)
        check_columns(boat_set, self._model)
        slope = math.hypot(*(wave.amplitude * wave.wavenumber for wave in parameters.sea.waves))
        if self._model.nskin and slope < _FLAT_SLOPE:
            thin_out(self._model)
        if cell > 0.0:
            coarsen(self._model, [hull.body for hull in parameters.hulls], cell)
        self._data = mujoco.MjData(self._model)
        self._sea = SeaSkin(self._model, parameters.sea, seed)
        self._displays = displays_of(parameters)
        width, height = size
        self._sky = _own_sky(self._model, parameters.scene.fog)
        self._canvas = Canvas(self._model, width=width, height=height, fog=parameters.scene.fog, sky=self._sky is None)
        mujoco.mj_kinematics(self._model, self._data)
        places, owner = self._data.geom_xpos, self._model.body_rootid[self._model.geom_bodyid]
        reach = np.linalg.norm(places - self._data.xpos[owner], axis=1) + self._model.geom_rbound
        self.radii = {
            boat.name: float(reach[owner == self._model.body(hull.body).id].max(initial=0.0))
            for boat, hull in zip(parameters.boats, parameters.hulls, strict=True)
        }
        """How far each boat reaches from its origin [m]."""

    def draw(self, moment: Instant, eye: Eye, size: tuple[int, int]) -> ByteArray:
        """The picture (height, width, 3) of what an eye sees at a moment."""
        width, height = size
        model, data = self._model, self._data
        data.qpos[:] = moment.qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        check_display_marks(self._displays, moment.marks[None])
        for geom, rgba in display_colors(model, self._displays, moment.marks, moment.time).items():
            model.geom_rgba[geom] = rgba
        view = view_of(eye, width, height)
        above = view.rotation[2, 0] < -_ABOVE_AXIS
        with compile_notice(draw_surface, "the sea's pictures", 8):
            self._sea.move_into(view, data, moment.time, relief=_RELIEF_ABOVE if above else 1.0)
        if above:  # waves are shaded more, and do not glitter
            mirrored, glitter = self._sea.palette.T
            np.clip(mirrored + _SKY_SHARE, EDGE, 1.0 - EDGE, out=mirrored)
            np.minimum(glitter, PLAIN, out=glitter)
        drawn = np.empty((height, width, 4), np.uint8)
        self._foam.move(moment.time, self._sea.drawn_height)
        self._canvas.draw(data, view, (self._sea, self._foam), drawn)
        with compile_notice(smooth, "the smoothing of edges", 3):
            if self._sky is not None:
                fill_sky(drawn.view(np.uint32)[..., 0], self._sky, view.rotation, view.half_width, view.half_height)
            return antialias(drawn)

    def close(self) -> None:
        """Free the drawing context."""
        self._canvas.close()


def _own_sky(model: mujoco.MjModel, fog: bool) -> Uint32Array | None:
    """A model's sky (6 side, side), which needs not be drawn: nothing that lets light through may be before it."""
    skies = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    painted = np.where(model.geom_matid < 0, 1.0, model.mat_rgba[model.geom_matid, 3])
    opacities = np.stack([model.geom_rgba[:, 3], painted])[:, model.geom_group < 3]
    if fog or not len(skies) or np.any((opacities > 0.0) & (opacities < 1.0)):
        return None
    first, side = int(model.tex_adr[skies[0]]), int(model.tex_width[skies[0]])
    sky = np.full((6 * side, side, 4), 255, np.uint8)
    sky[..., :3] = model.tex_data[first : first + 18 * side * side].reshape(6 * side, side, 3)
    return sky.view(np.uint32)[..., 0]


def thin_out(model: mujoco.MjModel) -> None:
    """Draw the sea with a sixth of the rings and a third of the spokes: of a calm one they show as much."""
    faces = fan_triangles(RINGS // 6, SPOKES // 3 + 1)
    model.skin_face[: len(faces)], model.skin_facenum[0] = faces, len(faces)


def coarsen(model: mujoco.MjModel, bodies: Iterable[str], cell: float) -> None:
    """Draw the meshes of bodies, and of what hangs on them, by `coarser_faces` of cells of a length [m]."""
    ids = [model.body(name).id for name in bodies]
    shown = np.isin(model.body_rootid[model.geom_bodyid], ids) & (model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)
    for mesh in np.unique(model.geom_dataid[shown]):
        first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        tables = model.mesh_face, model.mesh_facenormal, model.mesh_facetexcoord
        corners = [table[first : first + count].reshape(-1).copy() for table in tables]
        points = model.mesh_vert[model.mesh_vertadr[mesh] + corners[0]]
        normals = model.mesh_normal[model.mesh_normaladr[mesh] + corners[1]]
        faces = coarser_faces(points, normals, np.arange(3 * count).reshape(-1, 3), cell)
        for table, own in zip(tables, corners, strict=True):
            table[first : first + len(faces)] = own[faces]
        model.mesh_facenum[mesh] = len(faces)


_Height = Callable[[FloatArray, FloatArray], npt.ArrayLike]


class Foam(Skin):
    """The foam of hulls: a skin of strips, each with as many pieces as a wake can have."""

    def __init__(self, spec: mujoco.MjSpec, hulls: Sequence[tuple[FloatArray, tuple[float, float]]]) -> None:
        """Add the skin to the spec of a drawing model, which stays without it where there are no hulls.

        Each hull is a boat's path (n, 4): time [s], east, north [m], heading [rad], and its end, body axes [m].
        """
        super().__init__(2 * MAX_PIECES * len(hulls))
        self.normals[:, 2] = 1.0
        self.palette[:] = 0.5
        if not hulls:
            return
        # pieces keep their places on the water while the boat goes on: their times are whole steps of a clock
        begin, end = (pick(path[place, 0] for path, _ in hulls) for pick, place in ((min, 0), (max, -1)))
        self._first = math.floor(begin * _PIECES_PER_SECOND)
        clock = np.arange(self._first, math.ceil(end * _PIECES_PER_SECOND) + 1) / _PIECES_PER_SECOND
        self._tracks = np.array([_stern_track(clock, *hull) for hull in hulls])
        left = (np.arange(len(hulls))[:, None] * 2 * MAX_PIECES + 2 * np.arange(MAX_PIECES - 1)).reshape(-1, 1)
        triangles = np.concatenate([left + np.array(corners) for corners in ((0, 1, 2), (1, 3, 2))]).astype(np.int32)
        white = np.full((2, 256, 4), 255, np.uint8)
        white[..., 3] = np.arange(256)
        add_skin(spec, _FOAM, white, self.vertices, self.palette, triangles, opacity=0.99)

    def strips(self, now: float, height: _Height) -> tuple[FloatArray, FloatArray]:
        """Edges (hulls, pieces, 2, 3) [m] and opacities (hulls, pieces) at a time [s] on a sea of a height.

        The freshest come first; the first edge is on the right of the way.
        """
        newest = math.ceil(now * _PIECES_PER_SECOND) - 1
        steps = np.maximum(newest - np.arange(-1, MAX_PIECES - 1), math.ceil((now - LASTS) * _PIECES_PER_SECOND - 1e-6))
        track = self._tracks[:, np.clip(steps - self._first, 0, self._tracks.shape[1] - 1)]
        share = now * _PIECES_PER_SECOND - newest
        track[:, 0] = share * track[:, 0] + (1.0 - share) * track[:, 1]
        age = np.clip(now - steps / _PIECES_PER_SECOND, 0.0, LASTS)
        along = np.gradient(track[..., :2], axis=1)
        along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-6)
        half = 0.5 * (WIDTH + SPREAD * age)[:, None] * (along[..., ::-1] * (-1.0, 1.0))
        edges = np.stack([track[..., :2] + half, track[..., :2] - half], axis=2)
        z = np.asarray(height(edges[..., 0], edges[..., 1])) + FOAM_HEIGHT
        opacity = WHITE * np.clip((track[..., 2] - _SLOWEST) / (FULL_SPEED - _SLOWEST), 0.0, 1.0) * (1.0 - age / LASTS)
        return np.concatenate([edges, z[..., None]], axis=-1), opacity

    def move(self, time: float, height: _Height) -> None:
        """Lay the foam of a time [s] on a sea of a height: that of its facets, which would hide what lies lower."""
        if len(self.vertices):
            edges, opacity = self.strips(time, height)
            self.vertices[:], self.palette[:, 0] = edges.reshape(-1, 3), opacity.repeat(2)


def _stern_track(clock: FloatArray, path: FloatArray, stern: tuple[float, float]) -> FloatArray:
    """East, north [m] and speed [m/s] (n, 3) of a hull's end at times (n,) [s]; no speed where its path has none."""
    time, (x, y), cos, sin = path[:, 0], stern, np.cos(path[:, 3]), np.sin(path[:, 3])
    place = path[:, 1:3] + np.column_stack([cos * x - sin * y, sin * x + cos * y])
    speed = (
        np.hypot(*np.gradient(place, axis=0).T) / np.maximum(np.gradient(time), 1e-9) if len(time) > 1 else 0.0 * time
    )
    columns = [np.interp(clock, time, column) for column in place.T]
    return np.column_stack([*columns, np.interp(clock, time, speed, left=0.0, right=0.0)])
