"""Rays of a lidar against the shapes of a world: how far each goes until it meets one.

Distances are those of MuJoCo's `mj_multiRay`, which tests every ray: here a ray is tested only against what can be
in its way (`windows`), by the functions that `mj_multiRay` is made of, and against single faces of meshes. Rays begin
at the near end of the range, so what is nearer, such as the lidar's own housing, is not in the way, as
with Gazebo's near clip.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt
from numba import types

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.libmujoco import c_function
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import Record

_GRID = np.dtype(
    [
        ("rings", np.int64),
        ("samples", np.int64),
        ("elevation", np.float64, (2,)),  # of ring 0, and the step to the next [rad]
        ("azimuth", np.float64, (2,)),  # of sample 0, and the step to the next [rad]
        ("near", np.float64),  # where rays begin [m]
        ("far", np.float64),  # where they end [m]
    ],
    align=True,
)

_WINDOW_MARGIN = 1e-6
"""How much wider windows are than what is seen [rad]: far more than their rounding, far less than a ray's step."""
_STACK_SIZE = 128
"""Room for the nodes that wait in a descent through a mesh's tree; MuJoCo's trees have at most 50 levels."""
_FEW_RAYS = 16.0
"""Up to this number of rays go down a mesh's tree one by one; more of them go by their window."""
_BOX_MARGIN = 1e-9
"""How much larger boxes are than what is in them [m]: far more than rounding."""
VIEW = np.dtype(
    [
        ("model", np.uint64),  # address of the mjModel
        ("data", np.uint64),  # address of the mjData
        ("origin", np.float64, (3,)),  # of the sensor, world [m]
        ("rotation", np.float64, (3, 3)),  # sensor to world axes
        ("turned", np.float64, (3, 3)),  # the present geom's axes to the sensor's
        ("moved", np.float64, (3,)),  # the present geom's origin in the sensor's frame [m]
        ("eye", np.float64, (3,)),  # the sensor in the present geom's frame [m]
        ("corners", np.float64, (8, 3)),  # of the present box or face, in the sensor's frame [m]
        ("start", np.float64, (3,)),  # where the present ray begins, world [m]
        ("along", np.float64, (3,)),  # where it goes, world axes or the geom's
        ("waiting", np.int32, (_STACK_SIZE,)),  # nodes of a tree to look at
    ],
    align=True,
)
_SEEN, _COLLIDES = 2, 3
"""Groups of geoms: what is looked at, and what collides."""


def grid(config: LidarConfig) -> npt.NDArray[np.void]:
    """A table of one row of `_GRID`: angles from the first to the last ray, both included, as Gazebo has them.

    Elevations are cut at straight down and up.
    """
    rings, samples, quarter = config.rings, config.samples, 0.5 * math.pi
    first, last = (min(max(angle, -quarter), quarter) for angle in config.elevation)
    row = (rings, samples, _steps((first, last), rings), _steps(config.azimuth, samples), *config.range)
    return np.array([row], _GRID)


def _steps(span: tuple[float, float], count: int) -> tuple[float, float]:
    return span[0], (span[1] - span[0]) / (count - 1) if count > 1 else 0.0


def angles(span: FloatArray, count: int) -> FloatArray:
    """The (count,) angles [rad] that `GRID.elevation` or `GRID.azimuth` describes."""
    return np.asarray(span[0] + span[1] * np.arange(count))


@kernel
def _interval(span: FloatArray, count: int, low: float, high: float) -> tuple[int, int]:
    """Return the first and the last of `count` angles, span[0] and on by span[1], that lie in [low, high]."""
    if span[1] == 0.0:
        return 0, count - 1 if low <= span[0] <= high else -1
    a, b = (low - span[0]) / span[1], (high - span[0]) / span[1]
    return max(0, math.ceil(min(a, b))), min(count - 1, math.floor(max(a, b)))


@kernel
def _whole(rays: Record) -> tuple[int, int, float, float]:
    """Return the window of all rays."""
    return 0, rays.rings - 1, 0.0, math.inf


@kernel
def _azimuths(corners: FloatArray) -> tuple[float, float]:
    """Return the middle azimuth of points and half their width [rad]; half a turn or more: they are all round."""
    x, y = corners[0, 0], corners[0, 1]
    right, left = 0.0, 0.0
    for i in range(1, len(corners)):
        angle = math.atan2(x * corners[i, 1] - y * corners[i, 0], x * corners[i, 0] + y * corners[i, 1])
        right, left = min(right, angle), max(left, angle)
    return math.atan2(y, x) + 0.5 * (left + right), 0.5 * (left - right) + _WINDOW_MARGIN


@kernel
def window(rays: Record, corners: FloatArray) -> tuple[int, int, float, float]:
    """Return the window of rings for the convex hull of `corners`, its middle azimuth and half its width [rad].

    The half width is infinite where all samples may hit: where the hull is above, below or about the sensor.

    Args:
        rays: a row of `_GRID`.
        corners: (n, 3) in the sensor's frame [m].
    """
    azimuth, half = _azimuths(corners)
    ux, uy = math.cos(azimuth), math.sin(azimuth)
    nearest, farthest, beyond, low, high = math.inf, 0.0, 0.0, math.inf, -math.inf
    for i in range(len(corners)):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        nearest, farthest = min(nearest, ux * x + uy * y), max(farthest, x * x + y * y)
        beyond = max(beyond, x * x + y * y + z * z)
        low, high = min(low, z), max(high, z)
    farthest = math.sqrt(farthest)
    around = half >= 0.5 * math.pi or nearest <= _WINDOW_MARGIN * farthest
    nearest = 0.0 if around else nearest
    if nearest > rays.far or beyond < rays.near**2:
        return 0, -1, 0.0, 0.0
    bottom = math.atan2(low, nearest if low < 0.0 else farthest) - _WINDOW_MARGIN
    top = math.atan2(high, nearest if high > 0.0 else farthest) + _WINDOW_MARGIN
    first, last = _interval(rays.elevation, rays.rings, bottom, top)
    return first, last, azimuth, math.inf if around else half


@kernel
def _ray_count(rays: Record, seen: Record) -> float:
    """Return about how many rays a window has; it may be one sample more."""
    lowest, highest, _, half = seen
    width = 2.0 * half / abs(rays.azimuth[1]) if rays.azimuth[1] != 0.0 else math.inf
    return float(max(highest - lowest + 1, 0) * min(width, float(rays.samples)))


@kernel
def turns(rays: Record, azimuth: float, half: float) -> tuple[int, int]:
    """Return the first and the last number of full turns by which azimuth +- half [rad] meets the grid."""
    if half == math.inf:
        return 0, 0
    end = rays.azimuth[0] + rays.azimuth[1] * (rays.samples - 1)
    low, high = min(rays.azimuth[0], end), max(rays.azimuth[0], end)
    turn = 2.0 * math.pi
    return math.ceil((low - azimuth - half) / turn), math.floor((high - azimuth + half) / turn)


@kernel
def sample_window(rays: Record, azimuth: float, half: float, turn: int) -> tuple[int, int]:
    """Return the window of samples for azimuth +- half [rad], `turn` full turns further (see `turns`)."""
    if half == math.inf:
        return 0, rays.samples - 1
    centre = azimuth + 2.0 * math.pi * turn
    return _interval(rays.azimuth, rays.samples, centre - half, centre + half)


_Geom = mujoco.mjtGeom
_PLANE, _HFIELD, _MESH = (int(kind) for kind in (_Geom.mjGEOM_PLANE, _Geom.mjGEOM_HFIELD, _Geom.mjGEOM_MESH))

_at = types.uintp
_ray_geom = c_function("mju_rayGeom", types.float64, _at, _at, _at, _at, _at, types.int32, _at)
_ray_hfield = c_function("mj_rayHfield", types.float64, _at, _at, types.int32, _at, _at, _at)


class Shapes(NamedTuple):
    """MuJoCo's arrays of geoms and of the trees of boxes in which it keeps the faces of meshes."""

    kind: IntArray
    mesh: IntArray
    size: FloatArray
    bounds: FloatArray
    """Geoms: centre and half edges of the box about it, in its frame."""
    pos: FloatArray
    mat: FloatArray
    tree: IntArray
    """Meshes: where their nodes start."""
    box: FloatArray
    """Nodes: centre and half edges, in the mesh's frame."""
    child: IntArray
    """Nodes: their halves, counted from the tree's start; negative: none."""
    leaf: IntArray
    """Nodes: their face, counted from the mesh's first; negative: there are halves."""
    face_start: IntArray
    vertex_start: IntArray
    face: IntArray
    vertex: npt.NDArray[np.float32]


def shapes_of(model: mujoco.MjModel, data: mujoco.MjData) -> Shapes:
    """Views of what `cast` reads."""
    return Shapes(
        model.geom_type,
        model.geom_dataid,
        model.geom_size,
        model.geom_aabb,
        data.geom_xpos,
        data.geom_xmat,
        model.mesh_bvhadr,
        model.bvh_aabb,
        model.bvh_child,
        model.bvh_nodeid,
        model.mesh_faceadr,
        model.mesh_vertadr,
        model.mesh_face,
        model.mesh_vert,
    )


def reflecting(model: mujoco.MjModel) -> IntArray:
    """The numbers of the geoms that a lidar sees: what is looked at, and what collides where nothing is.

    Water is in neither group. What is wholly transparent is not seen, nor is a signed distance field.
    """
    visible = (model.geom_rgba[:, 3] > 0.0) & (model.geom_type <= _MESH)
    seen = visible & (model.geom_group == _SEEN)
    drawn = np.zeros(model.nbody, bool)
    drawn[model.geom_bodyid[seen]] = True
    bare = visible & (model.geom_group == _COLLIDES) & ~drawn[model.geom_bodyid]
    return np.asarray(np.flatnonzero(seen | bare), np.int64)


@kernel
def _distance(view: Record, rays: Record, direction: FloatArray, shapes: Shapes, geom: int) -> float:
    """Return how far a ray goes from the near end of the range until it meets a geom [m]; negative: it does not."""
    turned, origin = view.rotation, view.origin
    for i in range(3):
        view.along[i] = turned[i, 0] * direction[0] + turned[i, 1] * direction[1] + turned[i, 2] * direction[2]
        view.start[i] = origin[i] + rays.near * view.along[i]
    start, along = view.start.ctypes.data, view.along.ctypes.data
    kind = shapes.kind[geom]
    if kind == _HFIELD:
        return float(_ray_hfield(view.model, view.data, geom, start, along, 0))
    pos, mat, size = shapes.pos[geom], shapes.mat[geom], shapes.size[geom]
    return float(_ray_geom(pos.ctypes.data, mat.ctypes.data, size.ctypes.data, start, along, kind, 0))


@kernel
def _turn_to(view: Record, shapes: Shapes, geom: int) -> None:
    """Make a geom the present one."""
    pos, mat, turned = shapes.pos[geom], shapes.mat[geom], view.rotation
    x, y, z = pos[0] - view.origin[0], pos[1] - view.origin[1], pos[2] - view.origin[2]
    for i in range(3):
        view.moved[i] = turned[0, i] * x + turned[1, i] * y + turned[2, i] * z
        view.eye[i] = -(mat[i] * x + mat[3 + i] * y + mat[6 + i] * z)
        for j in range(3):
            view.turned[i, j] = turned[0, i] * mat[j] + turned[1, i] * mat[3 + j] + turned[2, i] * mat[6 + j]


@kernel
def _set_corner(view: Record, corner: int, x: float, y: float, z: float) -> None:
    """Set a corner to a point (x, y, z) of the present geom's frame [m]."""
    turned = view.turned
    for i in range(3):
        view.corners[corner, i] = view.moved[i] + turned[i, 0] * x + turned[i, 1] * y + turned[i, 2] * z


@kernel
def _box_window(view: Record, rays: Record, box: FloatArray) -> tuple[int, int, float, float]:
    """Return the window of a box in the present geom's frame: its centre and half edges [m]."""
    for corner in range(8):
        x = box[0] + (box[3] if corner & 1 else -box[3])
        y = box[1] + (box[4] if corner & 2 else -box[4])
        z = box[2] + (box[5] if corner & 4 else -box[5])
        _set_corner(view, corner, x, y, z)
    return window(rays, view.corners)


@kernel
def _meet_shape(
    view: Record, rays: Record, directions: FloatArray, shapes: Shapes, geom: int, seen: Record, found: FloatArray
) -> None:
    """Shorten the rays of a window that meet a geom."""
    lowest, highest, azimuth, half = seen
    first, last = turns(rays, azimuth, half)
    for turn in range(first, last + 1):
        begin, end = sample_window(rays, azimuth, half, turn)
        for sample in range(begin, end + 1):
            for ray in range(sample * rays.rings + lowest, sample * rays.rings + highest + 1):
                beyond = _distance(view, rays, directions[ray], shapes, geom)
                if beyond >= 0.0:
                    found[ray] = min(found[ray], rays.near + beyond)


@kernel
def _to_face(corners: FloatArray, x: float, y: float, z: float) -> float:
    """Return how far a ray along the unit vector (x, y, z) goes until it meets a triangle; negative: it does not.

    From either side; Moeller and Trumbore (1997). The ray begins at the origin of the corners' frame.
    """
    a, b, c = corners[0], corners[1], corners[2]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    px, py, pz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    qx, qy, qz = uy * a[2] - uz * a[1], uz * a[0] - ux * a[2], ux * a[1] - uy * a[0]
    scale = ux * px + uy * py + uz * pz
    s = -(a[0] * px + a[1] * py + a[2] * pz) / scale
    t = (x * qx + y * qy + z * qz) / scale
    if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
        return float((vx * qx + vy * qy + vz * qz) / scale)
    return -1.0


@kernel
def _crosses(view: Record, box: FloatArray, begin: float, end: float) -> bool:
    """Whether the present ray is in a box anywhere between two distances [m]."""
    for i in range(3):
        centre, half, slope = box[i] - view.eye[i], box[3 + i] + _BOX_MARGIN, view.along[i]
        if slope == 0.0:
            if abs(centre) > half:
                return False
            continue
        one, other = (centre - half) / slope, (centre + half) / slope
        begin, end = max(begin, min(one, other)), min(end, max(one, other))
    return begin <= end


@kernel
def _descend(view: Record, rays: Record, shapes: Shapes, mesh: int, node: int, waiting: int, end: float) -> float:
    """Return how far the present ray goes until it meets a face below a node, if nearer than `end` [m], else `end`.

    `waiting` is how much of the room for nodes is taken.
    """
    root, first, count = shapes.tree[mesh], shapes.vertex_start[mesh], waiting + 1
    view.waiting[waiting] = node
    while count > waiting:
        count -= 1
        node = root + view.waiting[count]
        if not _crosses(view, shapes.box[node], rays.near, end):
            continue
        if shapes.leaf[node] >= 0:
            vertices = shapes.face[shapes.face_start[mesh] + shapes.leaf[node]]
            for corner in range(3):
                for i in range(3):
                    view.corners[corner, i] = shapes.vertex[first + vertices[corner], i] - view.eye[i]
            distance = _to_face(view.corners, view.along[0], view.along[1], view.along[2])
            end = distance if rays.near <= distance < end else end
            continue
        for half in shapes.child[node]:
            view.waiting[count] = half
            count += 1
    return end


@kernel
def _meet_part(
    view: Record,
    rays: Record,
    directions: FloatArray,
    shapes: Shapes,
    mesh: int,
    node: int,
    waiting: int,
    seen: Record,
    found: FloatArray,
) -> None:
    """Shorten the rays of a window that meet a part of a mesh: what is below a node of its tree."""
    lowest, highest, azimuth, half = seen
    first, last = turns(rays, azimuth, half)
    turned = view.turned
    for turn in range(first, last + 1):
        begin, end = sample_window(rays, azimuth, half, turn)
        for sample in range(begin, end + 1):
            for ray in range(sample * rays.rings + lowest, sample * rays.rings + highest + 1):
                x, y, z = directions[ray, 0], directions[ray, 1], directions[ray, 2]
                for i in range(3):
                    view.along[i] = turned[0, i] * x + turned[1, i] * y + turned[2, i] * z
                found[ray] = _descend(view, rays, shapes, mesh, node, waiting, found[ray])


@kernel
def _meet_face(
    view: Record, rays: Record, directions: FloatArray, shapes: Shapes, mesh: int, face: int, found: FloatArray
) -> None:
    """Shorten the rays that meet a face of a mesh."""
    vertices = shapes.face[shapes.face_start[mesh] + face]
    for corner in range(3):
        vertex = shapes.vertex[shapes.vertex_start[mesh] + vertices[corner]]
        _set_corner(view, corner, vertex[0], vertex[1], vertex[2])
    corners = view.corners[:3]
    lowest, highest, azimuth, half = window(rays, corners)
    first, last = turns(rays, azimuth, half)
    for turn in range(first, last + 1):
        begin, end = sample_window(rays, azimuth, half, turn)
        for sample in range(begin, end + 1):
            for ray in range(sample * rays.rings + lowest, sample * rays.rings + highest + 1):
                distance = _to_face(corners, directions[ray, 0], directions[ray, 1], directions[ray, 2])
                if rays.near <= distance < found[ray]:
                    found[ray] = distance


@kernel
def _meet_mesh(
    view: Record, rays: Record, directions: FloatArray, shapes: Shapes, mesh: int, found: FloatArray
) -> None:
    """Shorten the rays that meet a mesh: down its tree of boxes, as long as many rays may meet one."""
    root, count = shapes.tree[mesh], 1
    view.waiting[0] = 0
    while count > 0:
        count -= 1
        node = view.waiting[count]
        if shapes.leaf[root + node] >= 0:
            _meet_face(view, rays, directions, shapes, mesh, shapes.leaf[root + node], found)
            continue
        seen = _box_window(view, rays, shapes.box[root + node])
        if _ray_count(rays, seen) <= _FEW_RAYS:
            _meet_part(view, rays, directions, shapes, mesh, node, count, seen, found)
            continue
        for half in shapes.child[root + node]:
            view.waiting[count] = half
            count += 1


@kernel
def cast(
    view: object,
    rays: object,
    directions: FloatArray,
    shapes: Shapes,
    geoms: IntArray,
    found: FloatArray,
) -> None:
    """Write how far each ray goes until it meets one of `geoms`: beyond `rays.near`, else infinity [m].

    Args:
        view: a row of `VIEW`: from where, and in which model.
        rays: a row of `_GRID`.
        directions: (rays, 3) unit vectors in the sensor's frame, sample by sample, in each from ring 0 up.
        shapes: of the model.
        geoms: which of them reflect.
        found: (rays,) distances from the sensor [m].
    """
    found[:] = np.inf
    for geom in geoms:
        kind = shapes.kind[geom]
        _turn_to(view, shapes, geom)
        if kind == _MESH:
            _meet_mesh(view, rays, directions, shapes, shapes.mesh[geom], found)
        elif kind == _PLANE:  # it has no end, and so no box
            _meet_shape(view, rays, directions, shapes, geom, _whole(rays), found)
        else:
            seen = _box_window(view, rays, shapes.bounds[geom])
            _meet_shape(view, rays, directions, shapes, geom, seen, found)
