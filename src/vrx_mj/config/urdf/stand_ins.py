"""Meshes of ours in place of VRX's, which are not ours to give away.

Ours are drawn in the frame of the link that carries them, VRX's at a pose of their own in it.
"""

import math
from pathlib import PurePosixPath

from vrx_mj.config.poses import inverse
from vrx_mj.config.shapes import Visual
from vrx_mj.config.urdf.model import Pose
from vrx_mj.config.urdf.poses import chained
from vrx_mj.resources import root

__all__ = ["stand_in"]

Color = tuple[float, float, float, float]
Scale = tuple[float, float, float]

IDENTITY: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

STAND_INS: dict[str, tuple[Pose, dict[str, Color]]] = {
    "WAM-V-Base.dae": (
        IDENTITY,
        {
            "hulls": (0.74, 0.75, 0.76, 1.0),
            "trim": (0.23, 0.25, 0.28, 1.0),
            "arches": (0.11, 0.12, 0.13, 1.0),
            "deck": (0.60, 0.62, 0.64, 1.0),
        },
    ),
    "engine.dae": (IDENTITY, {"engine": (0.16, 0.17, 0.19, 1.0)}),
    "propeller.dae": (IDENTITY, {"propeller": (0.78, 0.33, 0.12, 1.0)}),
    "battery.dae": ((0, -1.03, -0.45, 0, 0, 0), {"battery": (0.36, 0.38, 0.41, 1.0)}),
    "cpu_cases.dae": (
        (0.073, 0, -1.53, 0, 0, 0),
        {"cpu_cases": (0.17, 0.18, 0.19, 1.0), "cpu_fittings": (0.62, 0.64, 0.66, 1.0)},
    ),
    "gps.dae": (IDENTITY, {"gps": (0.86, 0.87, 0.85, 1.0)}),
    "3d_lidar.dae": ((0, 0, -0.035, 0, 0, 0), {"lidar": (0.27, 0.28, 0.30, 1.0)}),
    "mono_camera.dae": ((-0.033, 0, 0, 0, 0, math.pi / 2), {"camera": (0.13, 0.14, 0.15, 1.0)}),
    "sensor_post_arm.dae": (
        (-0.038, 0, -0.003, math.radians(-60), 0, -math.pi / 2),
        {"post_arm": (0.06, 0.06, 0.07, 1.0)},
    ),
    "ball_shooter_base.dae": (IDENTITY, {"shooter_base": (0.35, 0.37, 0.40, 1.0)}),
    "ball_shooter_launcher.dae": ((0, 0, 0, 0, 0.261799, 0), {"shooter_launcher": (0.85, 0.48, 0.10, 1.0)}),
}
"""By the name of VRX's file: where VRX draws it in its link, and our meshes with their colours."""


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
