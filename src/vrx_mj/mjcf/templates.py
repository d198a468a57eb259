"""MJCF text from the templates, and shapes of the configuration as the geoms and meshes that MJCF wants."""

import hashlib
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from vrx_mj.config.search import contained_file, display
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.errors import CompileError
from vrx_mj.formats.urdf.reader import is_binary_stl, mesh_bytes, obj_text, read_mesh
from vrx_mj.packages import root

_TRIAL_MESH = "vrx_mj/mesh"
"""Name of a mesh that is tried alone."""
_MUJOCO_SUFFIXES = (".obj", ".stl")
"""Suffixes of meshes that MuJoCo reads as they are."""
_PRISM_SIDES = 64
"""Number of sides of the prism that a cylinder collides as."""


@dataclass(frozen=True)
class Geom:
    """A shape in MuJoCo's terms, for the macros of `shapes.xml.j2`."""

    name: str | None
    type: str
    size: tuple[float, ...]
    """Half lengths or radii [m]: MuJoCo's `size`; empty for a mesh."""
    mesh: str | None
    pos: tuple[float, ...]
    euler: tuple[float, ...]
    """Roll, pitch, yaw [rad] about fixed axes, R = Rz Ry Rx: `eulerseq="XYZ"`."""
    rgba: tuple[float, ...] | None
    """Color of a visual shape; None for one that collides."""
    solref: tuple[float, float] | None = None
    """Time constant [s] and damping ratio in contacts of a shape that collides, instead of those of both shapes."""


@dataclass(frozen=True)
class Mesh:
    """A mesh file and the scale that some shape wants it at."""

    name: str
    file: str
    """`mesh_HASH.obj` or `.stl`, after its contents: equal meshes of robots and objects are one file."""
    scale: tuple[float, ...]
    content: bytes


def render(template: str, **values: object) -> str:
    """The text of a template of `templates/`. A name that `values` lacks is an error, not an empty string.

    Floats are written with all their digits, sequences of numbers separated by blanks, text escaped for XML.
    """
    return _environment().get_template(template).render(values)


def geoms(shapes: Iterable[Shape]) -> list[Geom]:
    """Shapes as geoms; a shape with a colour is seen and does not collide, a cylinder that collides is a prism."""
    return [
        Geom(
            name=shape.name,
            type="mesh" if _is_mesh(shape) else shape.type,
            size=() if _is_mesh(shape) else _size(shape),
            mesh=mesh(shape).name if _is_mesh(shape) else None,
            pos=shape.pose[:3],
            euler=shape.pose[3:],
            rgba=getattr(shape, "color", None),
        )
        for shape in shapes
    ]


def meshes(shapes: Iterable[Shape]) -> list[Mesh]:
    """The meshes that these shapes need, each once, in the order of their first use."""
    return list(dict.fromkeys(mesh(shape) for shape in shapes if _is_mesh(shape)))


def _is_mesh(shape: Shape) -> bool:
    """Whether a shape is a mesh in MuJoCo: its cylinders touch differently in 4.0.0 and 4.0.1, its meshes do not."""
    return shape.type == "mesh" or (shape.type == "cylinder" and not isinstance(shape, Visual))


def mesh(shape: Shape) -> Mesh:
    """The mesh of a shape of type `mesh`, read from its file, or a cylinder's; what MuJoCo cannot read becomes OBJ."""
    if shape.type == "cylinder":
        radius, half = _size(shape)
        return _scale_mesh(_prism(), ".obj", (radius, radius, half))
    path = contained_file(str(shape.file), shape.folder)
    if not path.resolve().is_relative_to(root() / "assets"):
        stat = path.stat()
        _check(path, shape.scale, not isinstance(shape, Visual), stat.st_mtime_ns, stat.st_size)
    return mesh_of_file(path, shape.scale)


def mesh_of_file(path: Path, scale: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Mesh:
    """The mesh of a file, named after its content."""
    content, suffix = mesh_bytes(path), path.suffix.lower()
    if suffix not in _MUJOCO_SUFFIXES or (suffix == ".stl" and not is_binary_stl(content)):
        content, suffix = obj_text(read_mesh(path)).encode(), ".obj"
    return _scale_mesh(content, suffix, scale)


def _scale_mesh(content: bytes, suffix: str, scale: tuple[float, ...]) -> Mesh:
    """A mesh at a scale, named after its content and the scale."""
    stem = f"mesh_{hashlib.sha256(content).hexdigest()[:16]}"
    scaled = "" if scale == (1.0, 1.0, 1.0) else "_" + "_".join(map(repr, scale))
    return Mesh(stem + scaled, stem + suffix, scale, content)


@cache
def _prism() -> bytes:
    """OBJ file of a prism inside a cylinder of radius and half length 1: 0.12 % of the radius smaller at most."""
    angles = [2.0 * math.pi * side / _PRISM_SIDES for side in range(_PRISM_SIDES)]
    lines = [f"v {math.cos(angle):.9f} {math.sin(angle):.9f} {z}" for z in (-1, 1) for angle in angles]
    for side in range(1, _PRISM_SIDES + 1):
        after = side % _PRISM_SIDES + 1
        lines += [f"f {side} {after} {after + _PRISM_SIDES}", f"f {side} {after + _PRISM_SIDES} {side + _PRISM_SIDES}"]
    for side in range(2, _PRISM_SIDES):
        lines += [f"f 1 {side + 1} {side}", f"f {_PRISM_SIDES + 1} {_PRISM_SIDES + side} {_PRISM_SIDES + side + 1}"]
    return "\n".join([*lines, ""]).encode()


@lru_cache(maxsize=256)
def _check(path: Path, scale: tuple[float, ...], collides: bool, _modified: int, _bytes: int) -> None:
    """Compile a user's mesh alone in MuJoCo, whose errors would name our file; once for each state of the user's."""
    import mujoco

    read_mesh(path)
    made = mesh_of_file(path, scale)
    try:
        spec = mujoco.MjSpec()
        spec.assets = {made.file: made.content}
        spec.add_mesh(name=_TRIAL_MESH, file=made.file, scale=scale, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
        solid = int(collides)
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=_TRIAL_MESH, contype=solid, conaffinity=solid)
        spec.compile()
    except ValueError as error:
        words = str(error).splitlines()[0].removeprefix("Error: ").replace(f"'{_TRIAL_MESH}'", _TRIAL_MESH)
        words = words.removesuffix(f": {_TRIAL_MESH}").removeprefix(f"mesh {_TRIAL_MESH} ")
        words = re.sub(rf"'?(assets/)?{re.escape(made.file)}'?", "it", words)
        raise CompileError(f"MuJoCo cannot use the mesh {display(path)}: {words}") from error


def _size(shape: Shape) -> tuple[float, ...]:
    if shape.size is not None:
        return tuple(length / 2 for length in shape.size)
    if shape.radius is None:
        return ()
    return (shape.radius,) if shape.length is None else (shape.radius, shape.length / 2)


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(root() / "templates", encoding="utf-8"),
        undefined=StrictUndefined,
        autoescape=True,
        auto_reload=False,
        keep_trailing_newline=True,
        finalize=_text,
    )


def _text(value: object) -> object:
    """Text of a value; MJCF's numbers are separated by blanks."""
    if isinstance(value, tuple | list):
        return " ".join(repr(float(number)) for number in value)
    return repr(float(value)) if isinstance(value, float) else value
