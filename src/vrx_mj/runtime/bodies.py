"""Boats and floating objects by name: reading and writing the pose and velocity of their links."""

from collections.abc import Sequence

import numpy as np

from vrx_mj.compiler.world import World
from vrx_mj.config.poses import quaternion
from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.physics.motion import rotation_matrix
from vrx_mj.runtime.loop import HUGE
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.rig import Rig


class FreeBodies:
    """Everything in a world that has a free joint."""

    def __init__(self, world: World, rig: Rig) -> None:
        self._data = rig.data
        floating = [item["name"] for item in world.parameters["objects"] if item["kind"] == "floating"]
        self.objects = tuple(floating)
        self._address: dict[str, tuple[int, int]] = {}
        for names, rows in ((world.boats, rig.hulls), (self.objects, rig.floats)):
            for name, row in zip(names, rows, strict=True):
                self._address[name] = (int(row["qpos"]), int(row["dof"]))

    def observe(self, name: str) -> BoatObservation:
        """Pose and velocity of a link's origin."""
        qpos, dof = self._address[name]
        turn = self._data.qpos[qpos + 3 : qpos + 7].copy()
        linear = rotation_matrix(turn).T @ self._data.qvel[dof : dof + 3]
        spin = self._data.qvel[dof + 3 : dof + 6].copy()
        return BoatObservation(self._data.qpos[qpos : qpos + 3].copy(), turn, linear, spin)

    def put(self, name: str, pose: Sequence[float] | None, velocity: Sequence[float] | None) -> None:
        """Set pose [m, rad, ENU] and velocity [m/s, rad/s, body axes] of a link's origin."""
        qpos, dof = self._address[name]
        place = None if pose is None else _six(f"the pose of {name}", pose)
        motion = None if velocity is None else _six(f"the velocity of {name}", velocity)
        if place is not None:
            self._data.qpos[qpos : qpos + 3] = place[:3]
            self._data.qpos[qpos + 3 : qpos + 7] = quaternion(*place[3:])
        if motion is not None:
            turn = rotation_matrix(self._data.qpos[qpos + 3 : qpos + 7])
            self._data.qvel[dof : dof + 3] = turn @ motion[:3]
            self._data.qvel[dof + 3 : dof + 6] = motion[3:]

    def broken(self) -> str:
        """Name of the first body whose state is not finite, or else the fastest."""
        worst, name = -1.0, "the world"
        for candidate, (qpos, dof) in self._address.items():
            values = np.concatenate((self._data.qpos[qpos : qpos + 7], self._data.qvel[dof : dof + 6]))
            if not np.isfinite(values).all():
                return candidate
            if (size := float(np.abs(values).max())) > worst:
                worst, name = size, candidate
        return name


def check_name(kind: str, name: str, known: Sequence[str]) -> None:
    """Raise an UnknownNameError unless the name is known."""
    if name not in known:
        raise UnknownNameError(kind, name, known)


def _six(what: str, values: Sequence[float]) -> tuple[float, ...]:
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != 6 or not all(abs(number) < HUGE for number in numbers):
        raise CommandError(f"{what} is {values!r}: six numbers below {HUGE:g} are needed")
    return numbers
