"""The shape and the colour in a mesh file, read by trimesh in the sandboxed process.

Pictures that a mesh names are not opened.
"""

import contextlib
import io
import logging
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import collada  # noqa: F401 - trimesh imports it with the first Collada file, when nothing else may be read
import numpy as np
import PIL.Image
import trimesh

from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.model import Color
from vrx_mj.formats.urdf.reader import MeshData

_MOST_TRIANGLES = 200_000
"""MuJoCo's own limit for STL files."""
_LARGEST = 1e5
"""Largest plausible coordinate in a mesh [m]."""
_UNIT = re.compile(rb"<unit\b[^>]{0,300}?\bmeter\s{0,9}=\s{0,9}[\"']\s{0,9}([0-9.eE+-]{1,99})\s{0,9}[\"']")
_COLORS = re.compile(
    rb"<(library_effects|library_materials|library_images|bind_material)\b[^>]*>.*?</\1\s*>|\bmaterial=\"[^\"]*\"",
    re.DOTALL,
)
logging.getLogger("trimesh").addHandler(logging.NullHandler())


def _no_picture(*_arguments: object, **_options: object) -> None:
    raise OSError("pictures are not opened")


@contextlib.contextmanager
def _without_pictures() -> Iterator[None]:
    opened, PIL.Image.open = PIL.Image.open, _no_picture  # type: ignore[assignment]
    try:
        yield
    finally:
        PIL.Image.open = opened


@_without_pictures()
def mesh(path: str, name: str) -> MeshData:
    """The mesh of a file, which messages call `name`.

    Raises:
        VrxError: it has none, or one that MuJoCo cannot take.
    """
    content, suffix = Path(path).read_bytes(), Path(path).suffix.lower().removeprefix(".")
    unit = _unit(name, content) if suffix == "dae" else 1.0
    parts = _parts(name, content, suffix)
    if not parts and suffix == "dae":  # a part is left out by trimesh if its material is broken
        parts = _parts(name, _COLORS.sub(b"", content), suffix)
    if not parts:
        raise VrxError(f"mesh {name} is empty: it has no triangles")
    count = sum(len(part.faces) for part in parts)
    if count > _MOST_TRIANGLES:
        raise VrxError(f"mesh {name} has {count:,} triangles; at most {_MOST_TRIANGLES:,} are allowed: simplify it, "
                       "for example with Blender's Decimate")  # fmt: skip
    return _check(name, _merge(parts, unit))


def glb(path: str, name: str) -> bytes:
    """The mesh of a file as glTF, whose y axis is up.

    Raises:
        VrxError: as `mesh`.
    """
    found = mesh(path, name)
    upright = found.points[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    return bytes(trimesh.Trimesh(upright, found.triangles).export(file_type="glb"))


def _parts(name: str, content: bytes, suffix: str) -> list[trimesh.Trimesh]:
    """Every mesh of the file that has triangles, once for each place, in the file's unit."""
    if suffix == "ply":
        content = content.replace(b"element edge ", b"element unread ", 1)
    given = {"process": False, "resolver": None, "skip_materials": suffix == "obj"}
    try:
        with np.errstate(all="ignore"):
            scene = trimesh.load_scene(io.BytesIO(content), file_type=suffix, **given)
            for part in filter(_has_triangles, scene.geometry.values()):
                if part.faces.min() < 0 or part.faces.max() >= len(part.vertices):
                    raise VrxError(f"mesh {name} is broken: a triangle refers to a missing point")
            return list(filter(_has_triangles, scene.dump()))
    except (MemoryError, RecursionError, VrxError):
        raise
    except Exception:  # whatever a broken file makes a reader raise
        raise VrxError(f"mesh {name} cannot be read: it is not a {suffix.upper()} file, or is damaged") from None


def _has_triangles(part: object) -> bool:
    return len(getattr(part, "faces", ())) > 0


def _color(geometry: trimesh.Trimesh) -> Color | None:
    """The colour of a part: of its material, or the mean of its faces or points; None if it has none."""
    visual = geometry.visual
    if not getattr(visual, "defined", False):
        return None
    found = visual.material.main_color if visual.kind == "texture" else visual.main_color
    red, green, blue, alpha = (float(value) / 255 for value in np.asarray(found).ravel()[:4])
    return (red, green, blue, alpha or 1.0)


def _merge(parts: Sequence[trimesh.Trimesh], unit: float) -> MeshData:
    """One mesh of several [m], in the colour of most of its area."""
    areas = dict[Color, float]()
    with np.errstate(all="ignore"):
        for part in parts:
            if (color := _color(part)) is not None:
                areas[color] = areas.get(color, 0.0) + float(part.area)
        points, triangles = trimesh.util.append_faces([one.vertices for one in parts], [one.faces for one in parts])
        points = np.asarray(points, dtype=float).reshape(-1, 3) * unit + 0.0
    return MeshData(points, triangles.astype(np.int64), max(areas, key=lambda color: areas[color], default=None))


def _check(name: str, found: MeshData) -> MeshData:
    """The mesh without points that no triangle uses, if it is one that MuJoCo can take."""
    used, places = np.unique(found.triangles, return_inverse=True)
    points = found.points[used]
    if not np.isfinite(points).all():
        raise VrxError(f"mesh {name} is broken: the coordinates of a point are not finite")
    largest = float(np.abs(points).max())
    if largest > _LARGEST:
        raise VrxError(f"mesh {name} reaches {largest:.3g} m from its origin; at most {_LARGEST:g} m: check its unit")
    distinct = len(np.unique(points, axis=0))
    if distinct < 4:
        raise VrxError(f"mesh {name} has {distinct} different points; a shape needs at least 4")
    return MeshData(points, places.reshape(-1, 3).astype(np.int64), found.color)


def _unit(name: str, content: bytes) -> float:
    """Metres per unit of a Collada file."""
    found = _UNIT.search(content)
    written = found[1].decode("ascii", "replace")[:60] if found else "1"
    try:
        unit = float(written)
    except ValueError:
        unit = 0.0
    if not 0 < unit < 1e6:
        raise VrxError(f"mesh {name}: expected a number of metres above 0 as its unit, got '{written}'")
    return unit
