"""The meshes of a robot's links, found and checked; VRX's, which are not ours to ship, have stand-ins."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

from vrx_mj.config.shapes import MESH_SUFFIXES, Shape, Visual
from vrx_mj.config.wording import one_of, shown
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.elements import Findings
from vrx_mj.formats.urdf.meshes import MeshFiles, MissingMeshError, check_mesh
from vrx_mj.formats.urdf.model import ZERO, Color, Link, LinkRow, MeshRow, Scale, chained
from vrx_mj.frames import Pose, inverse
from vrx_mj.resources import root

STAND_INS: dict[str, tuple[Pose, dict[str, Color]]] = {
    "WAM-V-Base.dae": (
        ZERO,
        {
            "hulls": (0.74, 0.75, 0.76, 1.0),
            "trim": (0.23, 0.25, 0.28, 1.0),
            "arches": (0.11, 0.12, 0.13, 1.0),
            "deck": (0.60, 0.62, 0.64, 1.0),
        },
    ),
    "engine.dae": (ZERO, {"engine": (0.16, 0.17, 0.19, 1.0)}),
    "propeller.dae": (ZERO, {"propeller": (0.78, 0.33, 0.12, 1.0)}),
    "battery.dae": ((0, -1.03, -0.45, 0, 0, 0), {"battery": (0.36, 0.38, 0.41, 1.0)}),
    "cpu_cases.dae": (
        (0.073, 0, -1.53, 0, 0, 0),
        {"cpu_cases": (0.17, 0.18, 0.19, 1.0), "cpu_fittings": (0.62, 0.64, 0.66, 1.0)},
    ),
    "gps.dae": (ZERO, {"gps": (0.86, 0.87, 0.85, 1.0)}),
    "3d_lidar.dae": ((0, 0, -0.035, 0, 0, 0), {"lidar": (0.27, 0.28, 0.30, 1.0)}),
    "mono_camera.dae": ((-0.033, 0, 0, 0, 0, math.pi / 2), {"camera": (0.13, 0.14, 0.15, 1.0)}),
    "sensor_post_arm.dae": (
        (-0.038, 0, -0.003, math.radians(-60), 0, -math.pi / 2),
        {"post_arm": (0.06, 0.06, 0.07, 1.0)},
    ),
    "ball_shooter_base.dae": (ZERO, {"shooter_base": (0.35, 0.37, 0.40, 1.0)}),
    "ball_shooter_launcher.dae": ((0, 0, 0, 0, 0.261799, 0), {"shooter_launcher": (0.85, 0.48, 0.10, 1.0)}),
}
"""Place of each of VRX's meshes in its link, and our meshes for it with their colours, by the name of VRX's file."""


def stand_in(name: str, pose: Pose, color: Color | None, scale: Scale = (1.0, 1.0, 1.0)) -> tuple[Visual, ...]:
    """What is drawn where a URDF wants a mesh of VRX, which it names by this path; nothing for other meshes.

    `pose` is where the URDF draws the mesh in its link, `scale` how large; `color` is what it asks for, if it does.
    A scale that is not the same along all axes is only right for a mesh that VRX draws unturned.
    """
    file = PurePosixPath(name).name
    if file not in STAND_INS:
        return ()
    drawn, meshes = STAND_INS[file]
    x, y, z, *turn = inverse(drawn)
    place = chained(pose, (x * scale[0], y * scale[1], z * scale[2], *turn))  # type: ignore[arg-type]
    folder = root() / "assets" / "robots" / "wamv"
    return tuple(
        Visual(folder=folder, type="mesh", file=f"meshes/{mesh}.obj", pose=place, scale=scale, color=color or own)
        for mesh, own in meshes.items()
    )


def with_shapes(row: LinkRow, files: MeshFiles, findings: Findings) -> Link:
    """A link with its shapes, whose meshes are files; what is wrong with them is noted, not raised."""
    return replace(
        row.link,
        collisions=tuple(felt for shape in row.collisions for felt in solid_mesh(shape, files, findings)),
        visuals=tuple(seen for shape in row.visuals for seen in seen_mesh(shape, files, findings)),
    )


def solid_mesh(shape: Shape | MeshRow, files: MeshFiles, findings: Findings) -> Iterator[Shape]:
    """A shape that collides: a mesh must be there, and have a volume."""
    if isinstance(shape, Shape):
        yield shape
        return
    try:
        folder, path, _ = _found(shape, files, collides=True)
    except VrxError as error:
        findings.problems.append(shape.place.problem(shape.key, str(error)))
    else:
        yield Shape.model_validate(_values(shape, folder, path))


def seen_mesh(shape: Visual | MeshRow, files: MeshFiles, findings: Findings) -> Iterator[Visual]:
    """What is seen of a shape; a mesh that is missing is drawn by ours for it, if there are any.

    A mesh that is only looked at refuses no robot: one that cannot be read is left out.
    """
    if isinstance(shape, Visual):
        yield shape
        return
    try:
        folder, path, own = _found(shape, files, collides=False)
    except MissingMeshError:
        instead = stand_in(shape.file, shape.pose, shape.color, shape.scale)
        if not instead:
            findings.note("mesh", shape.file)
        yield from instead
    except VrxError as error:
        findings.note("unread", str(error))
    else:
        color = shape.color or own
        yield Visual.model_validate(_values(shape, folder, path) | ({"color": color} if color else {}))


def _values(mesh: MeshRow, folder: Path, path: str) -> dict[str, Any]:
    """Fields of a shape."""
    values = {"folder": folder, "type": "mesh", "file": path, "pose": mesh.pose, "scale": mesh.scale}
    return values | ({"name": mesh.name} if mesh.name else {})


def _found(mesh: MeshRow, files: MeshFiles, *, collides: bool) -> tuple[Path, str, Color | None]:
    """Folder and path of a mesh that was found and read, and its own colour. Our own are known to be sound.

    Raises:
        VrxError: it cannot be found or read.
    """
    folder, path = files.find(mesh.file)
    if not path.lower().endswith(MESH_SUFFIXES):
        raise VrxError(f"expected a mesh that ends in {one_of(MESH_SUFFIXES)}, got {shown(mesh.file)}")
    if (folder / path).resolve().is_relative_to(root() / "assets"):
        return folder, path, None
    return folder, path, check_mesh(folder / path, mesh.scale, collides=collides).color
