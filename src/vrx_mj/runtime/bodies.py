"""Boats, floating objects and floating docks by name: reading and writing the pose and velocity of their links."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arguments import as_numbers
from vrx_mj.arrays import FloatArray
from vrx_mj.frames import in_world_axes, quaternion, rotation_matrix
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.hull import Hull, hull_of
from vrx_mj.runtime.loop import HUGE
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.observation import BoatObservation


class FreeBodies:
    """Everything in a world that has a free joint."""

    def __init__(self, world: World, arrays: LoopArrays) -> None:
        self._data, self._arrays = arrays.data, arrays
        self._boats, self._thrusters = world.boats, world.parameters.thrusters
        self._hulls: dict[str, Hull] = {}
        floating = [item.name for item in world.parameters.objects if item.kind == "floating"]
        self.objects = tuple(floating)
        docks = [dock.name for dock in world.parameters.docks if dock.dynamic]
        self.floating = (*self.objects, *docks)
        self._address: dict[str, tuple[int, int]] = {}
        linked = [item for item in world.parameters.objects if item.links]
        body = {item.name: int(arrays.model.body(item.body).id) for item in linked}
        self.anchored = {item.name: body[item.name] for item in linked if item.kind == "static"}
        self._rates = {name: _joint_rates(arrays.model, own) for name, own in body.items()}
        roots = arrays.blocks[arrays.blocks["parent"] < 0]
        for names, rows in ((world.boats, arrays.hulls), (self.objects, arrays.floats), (docks, roots)):
            for name, row in zip(names, rows, strict=True):
                self._address[name] = (int(row["qpos"]), int(row["dof"]))
        fixed = world.parameters.task.fixed if world.parameters.task else {}
        self._fixed = {name: np.array([*pose[:3], *quaternion(*pose[3:])]) for name, pose in fixed.items()}

    def pose(self, name: str) -> FloatArray:
        """(7,): position [m] and quaternion (w, x, y, z) of a link's origin, or of a dock's frame."""
        if name in self._fixed:
            return self._fixed[name]
        qpos, _ = self._address[name]
        return self._data.qpos[qpos : qpos + 7]  # type: ignore[no-any-return]

    def observe(self, name: str, **known: Mapping[str, Any]) -> BoatObservation:
        """Pose and velocity of a link's origin, with what else is known of a boat."""
        qpos, dof = self._address[name]
        pose, motion = self._data.qpos[qpos : qpos + 7].copy(), self._data.qvel[dof : dof + 6].copy()
        linear = rotation_matrix(pose[3:]).T @ motion[:3]
        return BoatObservation(pose[:3], pose[3:], linear, motion[3:], hull=self._hull(name), **known)

    def _hull(self, name: str) -> Hull | None:
        """The figures of a boat, which do not change; nothing else has any."""
        if name in self._boats and name not in self._hulls:
            number = self._boats.index(name)
            names = {item.name: row for row, item in enumerate(self._thrusters) if item.hull == number}
            self._hulls[name] = hull_of(self._arrays, self._arrays.hulls[number], names)
        return self._hulls.get(name)

    def set_motion(self, name: str, pose: Sequence[float] | None, velocity: Sequence[float] | None) -> None:
        """Set pose [m, rad, ENU] and velocity [m/s, rad/s, body axes] of a link's origin."""
        qpos, dof = self._address[name]
        motion = None if velocity is None else as_numbers(f"velocity of {name}", velocity, 6, HUGE)
        if pose is not None:
            write_pose(self._data.qpos, qpos, as_numbers(f"pose of {name}", pose, 6, HUGE))
        if motion is not None:
            turn = self._data.qpos[qpos + 3 : qpos + 7]
            self._data.qvel[dof : dof + 3] = in_world_axes(turn, np.array(motion[:3]))
            self._data.qvel[dof + 3 : dof + 6] = motion[3:]
            self._data.qvel[self._rates.get(name, slice(0))] = 0.0  # as in Gazebo: all links get the velocity

    def start_floating(self, name: str, height: Callable[[float, float], float]) -> None:
        """Start an object or a dock where it is now, with the surface at `height(x, y)` [m]."""
        if name in self.anchored:
            self._arrays.start_links_floating(self.anchored[name], height)
            return
        qpos, _ = self._address[name]
        if name in self.objects:
            row = self.objects.index(name)
            self._arrays.start_floating(row, height(*self._data.qpos[qpos : qpos + 2]))
            self._arrays.start_links_floating(self._arrays.floats["body"][row], height)
            return
        for row in self._arrays.tree_rows(qpos):
            x, y, _ = self._data.xipos[self._arrays.blocks["body"][row]]
            self._arrays.block_state[row] = (height(x, y), 0)

    def worst(self) -> str:
        """Name of the first body whose state is not finite, or else the fastest."""
        worst, name = -1.0, "the world"
        for candidate, (qpos, dof) in self._address.items():
            values = np.concatenate((self._data.qpos[qpos : qpos + 7], self._data.qvel[dof : dof + 6]))
            if not np.isfinite(values).all():
                return candidate
            if (size := float(np.abs(values).max())) > worst:
                worst, name = size, candidate
        return name


def _joint_rates(model: mujoco.MjModel, body: int) -> slice:
    """Where in `qvel` the rates of the joints are by which others hang on a body, after those of its free joint."""
    dofs = np.flatnonzero(model.body_rootid[model.dof_bodyid] == model.body_rootid[body])
    return slice(int(dofs[0]) + int(model.body_dofnum[body]), int(dofs[-1]) + 1)


def write_pose(qpos: FloatArray, at: int, pose: Sequence[float]) -> None:
    """Write x, y, z [m], roll, pitch and yaw [rad] as the position and quaternion of a free joint."""
    qpos[at : at + 3] = pose[:3]
    qpos[at + 3 : at + 7] = quaternion(*pose[3:])
