"""The meshes of a robot's links, found and checked; VRX's, which are not ours to ship, have stand-ins."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import PurePosixPath
from typing import Any

from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.elements import Findings
from vrx_mj.formats.urdf.links import ShapeT
from vrx_mj.formats.urdf.meshes import MeshFiles, MissingMeshError, check_mesh
from vrx_mj.formats.urdf.model import Color, Link, LinkRow, MeshRow, Scale, chain
from vrx_mj.frames import Pose, inverse
from vrx_mj.resources import root

_FOLDER = root() / "assets" / "robots" / "wamv"


@cache
def stand_ins() -> Mapping[str, Mapping[str, Any]]:
    """Place of each of VRX's meshes in its link, and our meshes for it with their colours, by the file's name."""
    table: Mapping[str, Mapping[str, Any]] = json.loads((_FOLDER / "stand_ins.json").read_bytes())
    return table


def _stand_in(name: str, pose: Pose, color: Color | None, scale: Scale = (1.0, 1.0, 1.0)) -> tuple[Visual, ...]:
    """What is drawn where a URDF wants a mesh of VRX, which it names by this path; nothing for other meshes.

    `pose` is where the URDF draws the mesh in its link, `scale` how large; `color` is what it asks for, if it does.
    A scale that is not the same along all axes is only right for a mesh that VRX draws unturned.
    """
    own = stand_ins().get(PurePosixPath(name).name)
    if own is None:
        return ()
    x, y, z, *turn = inverse(own["pose"])
    place = chain(pose, (x * scale[0], y * scale[1], z * scale[2], *turn))  # type: ignore[arg-type]
    return tuple(
        Visual(folder=_FOLDER, type="mesh", file=f"meshes/{mesh}.obj", pose=place, scale=scale, color=color or rgba)
        for mesh, rgba in own["meshes"].items()
    )


def with_shapes(row: LinkRow, files: MeshFiles, findings: Findings) -> Link:
    """A link with its shapes, whose meshes are files; what is wrong with them is noted, not raised."""
    return replace(
        row.link,
        collisions=tuple(felt for shape in row.collisions for felt in solid_mesh(shape, files, findings)),
        visuals=tuple(seen for shape in row.visuals for seen in _seen_mesh(shape, files, findings)),
    )


def solid_mesh(shape: Shape | MeshRow, files: MeshFiles, findings: Findings) -> Iterator[Shape]:
    """A shape that collides: a mesh must be there, and have a volume."""
    if isinstance(shape, Shape):
        yield shape
        return
    try:
        yield _mesh_shape(shape, files, Shape, collides=True)
    except VrxError as error:
        findings.problems.append(shape.place.problem(shape.key, str(error)))


def _seen_mesh(shape: Visual | MeshRow, files: MeshFiles, findings: Findings) -> Iterator[Visual]:
    """What is seen of a shape; a mesh that is missing is drawn by ours for it, if there are any.

    A mesh that is only looked at refuses no robot: one that cannot be read is left out.
    """
    if isinstance(shape, Visual):
        yield shape
        return
    try:
        yield _mesh_shape(shape, files, Visual)
    except MissingMeshError:
        instead = _stand_in(shape.file, shape.pose, shape.color, shape.scale)
        if not instead:
            findings.note("mesh", shape.file)
        yield from instead
    except VrxError as error:
        findings.note("unread", str(error))


def _mesh_shape(mesh: MeshRow, files: MeshFiles, kind: type[ShapeT], *, collides: bool = False) -> ShapeT:
    """The shape of a mesh that was found and read, in its own colour unless one is given. Ours are known to be sound.

    Raises:
        VrxError: it cannot be found or read.
    """
    folder, path = files.find(mesh.file)
    values = {"folder": folder, "type": "mesh", "file": path, "pose": mesh.pose, "scale": mesh.scale}
    values |= {"name": mesh.name} if mesh.name else {}
    own = path.endswith(".obj") and (folder / path).resolve().is_relative_to(root() / "assets")
    read = None if own else check_mesh(folder / path, mesh.scale, collides=collides)
    color = mesh.color or (read and read.color)
    return kind.model_validate(values | ({"color": color} if color and kind is Visual else {}))
