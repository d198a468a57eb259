"""What is seen of a body as triangles: MuJoCo's geoms, and coarser copies for fleets of many boats."""

import functools
import math
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.recording.record_scene import Surface

_Triangles = tuple[FloatArray, npt.NDArray[np.int32], FloatArray]
"""Vertices (n, 3) [m], faces (m, 3) as indices of them, counter-clockwise from outside, and the vertices' normals."""

_SHARP = math.cos(math.radians(40.0))
"""Cosine between a face and MuJoCo's normal at its corner below which the face has an edge there."""
_CYLINDER, _ROUND, _RINGS = 24, 16, 9
"""Facets around cylinders, around spheres and capsules, and rings of vertices from pole to pole."""
_COARSER = 1.1
"""Factor by which cells grow until a surface has few enough triangles."""


def geom_surface(model: mujoco.MjModel, geom: int) -> Surface:
    """A geom that is no plane in the frame of its body; flat faces keep their edges."""
    kind, size = int(model.geom_type[geom]), tuple(float(edge) for edge in model.geom_size[geom])
    mesh = kind == mujoco.mjtGeom.mjGEOM_MESH
    vertices, faces, normals = _mesh(model, int(model.geom_dataid[geom])) if mesh else _primitive(kind, size)
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    turn = matrix.reshape(3, 3).T
    return Surface(
        np.asarray(vertices @ turn + model.geom_pos[geom], np.float32),
        faces,
        np.asarray(normals @ turn, np.float32),
        tuple(float(value) for value in model.geom_rgba[geom]),
    )


@functools.lru_cache(maxsize=256)
def _primitive(kind: int, size: tuple[float, float, float]) -> _Triangles:
    shapes, (x, y, _) = mujoco.mjtGeom, size
    if kind == shapes.mjGEOM_BOX:
        return _box(size)
    if kind == shapes.mjGEOM_CYLINDER:
        flat = np.array([[0.0, -1.0], [0.0, -1.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
        return _revolved(np.array([[0.0, -y], [x, -y], [x, -y], [x, y], [x, y], [0.0, y]]), flat, _CYLINDER)
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _RINGS)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    arc[[0, -1], 0] = 0.0
    if kind == shapes.mjGEOM_CAPSULE:
        halves = np.concatenate([arc[: _RINGS // 2 + 1], arc[_RINGS // 2 :]])
        lift = np.outer(np.repeat([-y, y], len(halves) // 2), [0.0, 1.0])
        return _revolved(x * halves + lift, halves, _ROUND)
    scale = np.array(size if kind == shapes.mjGEOM_ELLIPSOID else (x, x, x))
    vertices, faces, normals = _revolved(arc, arc, _ROUND)
    normals = normals / scale
    return vertices * scale, faces, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _box(size: Sequence[float]) -> _Triangles:
    """A box of half edges [m]: four corners for each face."""
    outward = np.concatenate([np.eye(3), -np.eye(3)])[:, None]
    along = np.roll(outward, 1, axis=-1)
    across = np.cross(outward, along)
    corners = outward + np.array([[-1], [1], [1], [-1]]) * along + np.array([[-1], [-1], [1], [1]]) * across
    faces = 4 * np.arange(6, dtype=np.int32)[:, None] + np.array([0, 1, 2, 0, 2, 3], np.int32)
    return corners.reshape(-1, 3) * size, faces.reshape(-1, 3), np.repeat(outward[:, 0], 4, axis=0)


def _revolved(profile: FloatArray, normals: FloatArray, facets: int) -> _Triangles:
    """A profile (n, 2) of radius and height from bottom to top, and its normals likewise, turned around z."""
    angle = np.linspace(0.0, 2.0 * np.pi, facets, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.ones(facets)], axis=-1)
    index = np.arange(len(profile) * facets, dtype=np.int32).reshape(-1, facets)
    a, b = index[:-1], index[1:]
    c, d = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    apart = np.any(profile[:-1] != profile[1:], axis=1)
    lower = np.stack([a, c, b], axis=-1)[apart & (profile[:-1, 0] > 0.0)]
    upper = np.stack([c, d, b], axis=-1)[apart & (profile[1:, 0] > 0.0)]
    vertices, directions = (ring * line[:, None, [0, 0, 1]] for line in (profile, normals))
    return vertices.reshape(-1, 3), np.concatenate([lower, upper]).reshape(-1, 3), directions.reshape(-1, 3)


def _mesh(model: mujoco.MjModel, mesh: int) -> _Triangles:
    """A mesh with MuJoCo's normals, but for corners where these lie far from the face's own: there it has an edge."""
    points, normals, faces, index = (
        table[start : start + count]
        for table, start, count in (
            (model.mesh_vert, model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]),
            (model.mesh_normal, model.mesh_normaladr[mesh], model.mesh_normalnum[mesh]),
            (model.mesh_face, model.mesh_faceadr[mesh], model.mesh_facenum[mesh]),
            (model.mesh_facenormal, model.mesh_faceadr[mesh], model.mesh_facenum[mesh]),
        )
    )
    a, b, c = (points[faces[:, corner]].astype(np.float64) for corner in range(3))
    own = np.cross(b - a, c - a)
    own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-12)
    sharp = np.einsum("fi,fci->fc", own, normals[index]) < _SHARP
    index = np.where(sharp, len(normals) + np.arange(len(faces))[:, None], index)
    pairs = faces.astype(np.int64) * (len(normals) + len(faces)) + index
    kept, corners = np.unique(pairs, return_inverse=True)
    vertex, normal = np.divmod(kept, len(normals) + len(faces))
    return points[vertex], corners.reshape(-1, 3).astype(np.int32), np.concatenate([normals, own])[normal]


def coarser(surfaces: Sequence[Surface], most: int) -> tuple[Surface, ...]:
    """The surfaces with at most so many faces in all, their vertices gathered in cells; each stays two cells thick.

    What is too much even so is left empty, the smallest surfaces first.
    """
    sizes = [float(np.max(np.ptp(surface.vertices, axis=0))) for surface in surfaces]
    cell, coarse = max(sizes, default=0.0) / 64.0, tuple(surfaces)
    while sum(len(surface.faces) for surface in coarse) > most and cell < 2.0 * max(sizes):
        coarse = tuple(_gathered(surface, cell) for surface in surfaces)
        cell *= _COARSER
    for index in np.argsort(sizes, kind="stable"):
        if sum(len(surface.faces) for surface in coarse) <= most:
            break
        empty = replace(coarse[index], faces=np.empty((0, 3), np.int32))
        coarse = (*coarse[:index], empty, *coarse[index + 1 :])
    return coarse


def _gathered(surface: Surface, cell: float) -> Surface:
    """A surface whose vertices that face one way in one cell [m] are one, the outermost of them."""
    points, normals, faces = surface.vertices.astype(np.float64), surface.normals, surface.faces
    size = np.maximum(np.ptp(points, axis=0), 1e-9)
    place = (points - points.min(axis=0)) / size
    count = np.maximum(np.ceil(size / cell), 2.0)
    index = np.minimum(place * count, count - 1.0).astype(np.int64) @ [1, int(count[0]), int(count[0] * count[1])]
    axis = np.argmax(np.abs(normals), axis=1)
    below = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0.0
    _, owner = np.unique(6 * index + 2 * axis + below, return_inverse=True)
    outward = np.argsort(np.linalg.norm(place - 0.5, axis=1), kind="stable")
    outermost = np.empty(owner.max() + 1, np.int64)
    outermost[owner[outward]] = outward  # the last one stays
    ordered = np.sort(owner[faces], axis=1)
    wide = np.flatnonzero((ordered[:, 0] < ordered[:, 1]) & (ordered[:, 1] < ordered[:, 2]))
    _, once = np.unique(ordered[wide], axis=0, return_index=True)
    used, corners = np.unique(outermost[owner[faces[np.sort(wide[once])]]], return_inverse=True)
    return replace(
        surface, vertices=surface.vertices[used], faces=corners.reshape(-1, 3).astype(np.int32), normals=normals[used]
    )
