"""What hangs on a body of a recording: blocks of a floating dock on their hinges, and its placards on the blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.mjcf.world import World
from vrx_mj.recording.scene import RecordedPart, Surface

__all__ = ["part_paths", "part_poses", "parts_of"]


def part_paths(world: World, model: mujoco.MjModel) -> dict[str, str]:
    """Entities by MuJoCo's bodies: those of floating docks, each under the one that it hangs on."""
    paths: dict[str, str] = {}
    for dock in world.tree["docks"]:
        if not dock["dynamic"]:
            continue
        root, *blocks = dock["bodies"]
        paths[root] = f"/world/docks/{dock['name']}"
        for body in (*blocks, *dock["placards"]):
            parent = model.body(model.body_parentid[model.body(body).id]).name
            own = body.removesuffix("/link").rpartition("/")[2]
            paths[body] = f"{paths[parent]}/{own}"
    return paths


def parts_of(world: World, model: mujoco.MjModel, looks: Mapping[str, Sequence[Surface]]) -> Iterator[RecordedPart]:
    """The blocks, but for the roots, and the placards of all floating docks."""
    paths = part_paths(world, model)
    for dock in (dock for dock in world.tree["docks"] if dock["dynamic"]):
        for name in (*dock["bodies"][1:], *dock["placards"]):
            body = model.body(name).id
            hinged = bool(model.body_jntnum[body])
            joint = int(model.body_jntadr[body])
            yield RecordedPart(
                path=paths[name],
                position=_three(model.body_pos[body]),
                quaternion=tuple(float(value) for value in model.body_quat[body]),
                anchor=_three(model.jnt_pos[joint]) if hinged else (0.0, 0.0, 0.0),
                axis=_three(model.jnt_axis[joint]) if hinged else (0.0, 0.0, 1.0),
                qpos=int(model.jnt_qposadr[joint]) if hinged else None,
                surfaces=tuple(looks.get(name, ())),
            )


def part_poses(part: RecordedPart, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3) [m] and quaternions (n, 4) (w, x, y, z) in the frame of what the part hangs on.

    `angle` (n,) [rad] is the hinge's. A part on a hinge is not turned otherwise.
    """
    axis, anchor = np.array(part.axis), np.array(part.anchor)
    sin, cos = np.sin(angle)[:, None], np.cos(angle)[:, None]
    turned = anchor * cos + np.cross(axis, anchor) * sin + axis * (axis @ anchor) * (1.0 - cos)
    half = 0.5 * angle[:, None]
    return np.array(part.position) + anchor - turned, np.hstack([np.cos(half), np.sin(half) * axis])


def _three(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
