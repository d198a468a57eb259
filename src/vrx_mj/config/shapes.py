"""Shapes that collide, are seen or displace water, and the closed surfaces that they make.

Meshes may be inside out or open: they are repaired, with a note.
"""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.base import Config, InFolder, Only
from vrx_mj.config.kinds import function_of
from vrx_mj.config.loading import loads
from vrx_mj.config.search import contained_file
from vrx_mj.config.tree import one_of
from vrx_mj.config.values import Color, Name, NotEmpty, Number, NumberOf, Pose, Positive, demand, numbers
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.frames import IDENTITY, rotation
from vrx_mj.model.things import Float

MESH_SUFFIXES = (".obj", ".stl", ".dae", ".ply", ".glb")


Size = Annotated[tuple[Positive, Positive, Positive], numbers("x y z")]

Factor = Annotated[Number, demand(bool, "must not be 0")]
_Scale = Annotated[tuple[Factor, Factor, Factor], numbers("x y z")]
_ENDS = one_of(MESH_SUFFIXES)
_SEGMENTS = 64
"""Sides of the prism that replaces a cylinder; it has the cylinder's volume."""
_MOST_PIECES = 100
"""Loose pieces of a mesh that are looked at one by one; those of more are one."""
_SEAM = 1e-6
"""Share of a mesh's extent [m] within which two points are one."""


def _three(value: object) -> object:
    return (value,) * 3 if isinstance(value, int | float) and not isinstance(value, bool) else value


_Mesh = Annotated[
    str,
    demand(lambda file: file.lower().endswith(MESH_SUFFIXES), f"expected a mesh that ends in {_ENDS}, got {{}}"),
    loads(contained_file),
]


class Shape(InFolder):
    """A primitive or a mesh, centred on its pose. Cylinders and capsules are aligned with their z axis."""

    name: Name | None = None
    """Name of the shape, for references to it."""
    type: Literal["box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"]
    """Kind of shape."""
    size: Annotated[Size | None, Only("type", ("box", "ellipsoid"), required=True)] = None
    """Full edge lengths of a box, full axes of an ellipsoid [m]."""
    radius: Annotated[Positive | None, Only("type", ("sphere", "cylinder", "capsule"), required=True)] = None
    """Radius [m]."""
    length: Annotated[Positive | None, Only("type", ("cylinder", "capsule"), required=True)] = None
    """Length along z [m]; for a capsule without its two caps."""
    file: Annotated[_Mesh | None, Only("type", ("mesh",), required=True)] = None
    """A mesh (.obj, .stl, .dae, .ply or .glb), relative to the folder of the file that names it."""
    scale: Annotated[_Scale, BeforeValidator(_three), Only("type", ("mesh",))] = (1.0, 1.0, 1.0)
    """Scale of a mesh along x, y and z. A negative factor mirrors it. A file may give one number for all three."""
    pose: Pose = IDENTITY
    """Pose in the link's frame [m, rad]."""


class Visual(Shape):
    """A visible shape."""

    color: Color = (0.5, 0.5, 0.5, 1.0)
    """Colour of the shape."""


class BuoyancyElement(Config):
    """A shape that displaces water, centred on its pose. Cylinders are aligned with their z axis."""

    name: Name | None = None
    """Name of the shape, for references to it."""
    type: Literal["box", "sphere", "cylinder"]
    """Kind of shape."""
    size: Annotated[Size | None, Only("type", ("box",), required=True)] = None
    """Full edge lengths of a box [m]."""
    radius: Annotated[Positive | None, Only("type", ("sphere", "cylinder"), required=True)] = None
    """Radius [m]."""
    length: Annotated[Positive | None, Only("type", ("cylinder",), required=True)] = None
    """Length along z [m]."""
    pose: Pose = IDENTITY
    """Pose in the link's frame [m, rad]."""

    @property
    def volume(self) -> float:
        """Volume [m3]."""
        if self.type == "box":
            return math.prod(self.size or ())
        radius, length = self.radius or 0.0, self.length or 0.0
        return 4 / 3 * math.pi * radius**3 if self.type == "sphere" else math.pi * radius * radius * length


class BuoyancyConfig(Config):
    """Displacement and drag of an object in water, as in VRX's buoyancy_gazebo_plugin."""

    fluid_density: Annotated[Positive, NumberOf(Float, "density")] = WATER_DENSITY
    fluid_level: Annotated[float, NumberOf(Float, "level")] = 0.0
    linear_drag: Annotated[float, NumberOf(Float, "linear_drag")]
    """Drag of each element over the link's mass and linear velocity [1/s], scaled by its submerged fraction."""
    angular_drag: Annotated[float, NumberOf(Float, "angular_drag")]
    """Drag torque of each element over mass, mean extent squared and angular velocity [1/s], scaled by its submerged
    fraction."""
    elements: Annotated[tuple[BuoyancyElement, ...], NotEmpty]
    """Shapes that displace water. The whole volume of each counts, even if shapes overlap."""


@dataclass(frozen=True)
class Solid:
    """Closed surfaces as triangles, counter-clockwise seen from outside."""

    corners: FloatArray
    """Corners of the triangles, (n, 3, 3) [m]."""
    notes: tuple[str, ...] = ()
    """Notes about repairs."""

    def at(self, pose: Pose) -> FloatArray:
        """Corners (n, 3, 3) at a pose [m, rad]."""
        placed: FloatArray = self.corners @ np.array(rotation(*pose[3:])).T + np.array(pose[:3])
        return placed


def solid(shape: Shape) -> Solid:
    """The volume of a shape in its own frame.

    Raises:
        VrxError: its mesh cannot be read.
    """
    if shape.type != "mesh":
        return Solid(_hull(_outline(shape)))
    file = contained_file(str(shape.file), shape.folder)
    read = function_of("meshes", file)
    assert read is not None, "any file may be a mesh"
    mesh = read(file, shape.scale)
    return solid_of_mesh(str(shape.file).rpartition("/")[2], mesh.points, mesh.triangles)


def solid_of_mesh(name: str, points: FloatArray, triangles: IntArray) -> Solid:
    """The volume inside a mesh. What is inside out is turned; of what is open the convex hull is taken."""
    pieces = _pieces(points, triangles)
    notes = []
    gaps = sum(own for _, own in pieces)
    if gaps:
        notes.append(f"mesh {name} is open ({gaps} edges without a second triangle): its convex hull is used")
    whole = _convex_hulls([corners for corners, own in pieces if own]) + [corners for corners, own in pieces if not own]
    volumes = [enclosed_volume(corners) for corners in whole]
    total = math.fsum(volumes)
    if total < 0.0:
        notes.append(f"mesh {name} is inside out (a volume of {total:.3g} m3): its triangles are reversed")
        whole, volumes = [corners[:, ::-1] for corners in whole], [-volume for volume in volumes]
    sized = list(zip(whole, volumes, strict=True))
    kept = [corners if volume > 0.0 else corners[:, ::-1] for corners, volume in sized
            if volume > 0.0 or not _is_cavity(corners, volume, sized)]  # fmt: skip
    return Solid(np.concatenate(kept) if kept else np.empty((0, 3, 3)), tuple(notes))


def _pieces(points: FloatArray, triangles: IntArray) -> list[tuple[FloatArray, int]]:
    """The parts of a mesh that share no point: corners of triangles (n, 3, 3), and edges without a second triangle."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    grain = _SEAM * float(np.ptp(points, axis=0).max()) or 1.0
    _, first, names = np.unique(np.round(points / grain), axis=0, return_index=True, return_inverse=True)
    faces = names.ravel()[triangles]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count, labels = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(len(first),) * 2), directed=False)
    edges, places = np.unique(np.minimum(a, b) * len(first) + np.maximum(a, b), return_inverse=True)
    uneven = np.bincount(places.ravel(), weights=np.where(a < b, 1.0, -1.0), minlength=len(edges)) != 0.0
    label = np.zeros(len(first), dtype=np.int64) if count > _MOST_PIECES else labels
    corners, owner = points[first][faces], label[faces[:, 0]]
    gaps = np.bincount(label[edges[uneven] // len(first)], minlength=count)
    return [(corners[owner == number], int(gaps[number])) for number in np.unique(owner)]


def enclosed_volume(corners: FloatArray) -> float:
    """Volume [m3] inside closed triangles, by the divergence theorem about their middle."""
    a, b, c = np.moveaxis(corners - corners.reshape(-1, 3).mean(axis=0), 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _box(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    points = corners.reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


def _is_cavity(piece: FloatArray, volume: float, others: Iterable[tuple[FloatArray, float]]) -> bool:
    """Whether this is the inner wall of a hollow piece, which keeps the water out as a full one does."""
    low, high = _box(piece)
    larger = (_box(corners) for corners, own in others if own > -volume)
    return any((lower <= low).all() and (high <= upper).all() for lower, upper in larger)


def _convex_hulls(pieces: Iterable[FloatArray]) -> list[FloatArray]:
    """The convex hulls of open pieces; those whose boxes touch are one."""
    groups: list[FloatArray] = []
    for piece in pieces:
        low, high = _box(piece)
        near = [(lower <= high).all() and (low <= upper).all() for lower, upper in map(_box, groups)]
        joined = np.concatenate([piece.reshape(-1, 3), *itertools.compress(groups, near)])
        groups = [*itertools.compress(groups, np.logical_not(near)), joined]
    return [hull for hull in map(_hull, groups) if len(hull)]


def normals_of(triangles: FloatArray) -> FloatArray:
    """Normals (n, 3) of triangles (n, 3, 3), as long as twice their areas."""
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def _hull(points: FloatArray) -> FloatArray:
    """Triangles (n, 3, 3) of the convex hull of points; none if these lie in a plane."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull: Any = ConvexHull(points)
    except QhullError:
        return np.empty((0, 3, 3))
    corners: FloatArray = points[hull.simplices]
    inward = np.einsum("ij,ij->i", normals_of(corners), hull.equations[:, :3]) < 0.0
    corners[inward] = corners[inward, ::-1]
    return corners


def _outline(shape: Shape) -> FloatArray:
    """Points whose convex hull is a box, a ball, a cylinder or a capsule."""
    if shape.type in {"box", "ellipsoid"}:
        assert shape.size is not None
        half = np.array(shape.size) / 2
        if shape.type == "box":
            return np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * half
        return _round(1.0, 0.0) * half
    assert shape.radius is not None
    radius, length = shape.radius, shape.length or 0.0
    if shape.type == "cylinder":
        return _rings([radius, radius], [-length / 2, length / 2])
    return _round(radius, length)


def _round(radius: float, length: float) -> FloatArray:
    """A ball whose halves are `length` [m] apart along z."""
    angles = np.linspace(-math.pi / 2, math.pi / 2, _SEGMENTS // 2)
    return _rings(radius * np.cos(angles), radius * np.sin(angles) + np.where(angles < 0, -length / 2, length / 2))


def _rings(radii: object, heights: object) -> FloatArray:
    """Regular polygons about the z axis, each of the area of a circle of its radius [m], at these heights [m]."""
    step = 2 * math.pi / _SEGMENTS
    turn = np.arange(_SEGMENTS) * step
    out = math.sqrt(step / math.sin(step)) * np.asarray(radii, dtype=float)[:, None]
    x, y = out * np.cos(turn), out * np.sin(turn)
    return np.stack([x, y, np.broadcast_to(np.asarray(heights, dtype=float)[:, None], x.shape)], axis=-1).reshape(-1, 3)
