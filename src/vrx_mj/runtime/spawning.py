"""What a `Simulation` offers of boats that come and go while it runs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arguments import as_path
from vrx_mj.errors import CommandError
from vrx_mj.mjcf.joining import with_boat, without_boat
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.carrying import carry
from vrx_mj.runtime.crowding import fitting
from vrx_mj.runtime.physics_models import PhysicsModels
from vrx_mj.runtime.rig import Rig
from vrx_mj.runtime.subscriptions import Subscriptions
from vrx_mj.runtime.turns import Turn, in_turn

__all__ = ["Spawning", "rig_of"]


class Spawning:
    """The part of a simulation in which boats join and leave."""

    _world: World
    _rig: Rig
    _physics_models: PhysicsModels
    _seed: int
    _subscriptions: Subscriptions
    _turn: Turn

    @in_turn
    def spawn(
        self,
        name: str,
        *,
        pose: Sequence[float],
        robot: str | Path | None = None,
        thrusters: str | Path | None = None,
        components: str | Path | None = None,
        sensors: str | Sequence[str] | None = None,
        engines: str = "fixed",
        color: Sequence[float] | None = None,
    ) -> None:
        """Add a boat at rest to the run. The others move exactly as without it, until they touch it.

        It stays until it is removed or the run is reset. `sim.model`, `sim.data` and `sim.world` are new objects
        afterwards; `sim.sea`, `sim.wind`, subscriptions and commands are kept. If a removed boat had the same name,
        the sensors of the new boat have different noise.

        Args:
            name: name of the boat; nothing else in the world has it.
            pose: (x, y, z, roll, pitch, yaw) of its `base_link` origin [m, rad, ENU].
            robot: name or path of the robot; by default that of the world's spawn. With an absolute `Path`, the other
                paths are relative to its folder.
            thrusters: name of a layout, or a thruster file of VRX; by default that of the world's spawn.
            components: a component file of VRX.
            sensors: `vrx`, `none`, or names of suites or sensors; by default as in a fleet file.
            engines: `fixed` or `hinged`.
            color: red, green, blue and alpha of the hull, 0 to 1.

        Raises:
            ConfigError: an argument is invalid, or the robot does not exist.
            CommandError: the name or the place is taken, or the simulation is advancing.
            CompileError: the boat cannot be built.
        """
        self._check_standing("spawn")
        folder = robot.parent if isinstance(robot, Path) and robot.is_absolute() else None
        robot = f"./{robot.name}" if folder and isinstance(robot, Path) else robot
        files = {"robot": robot, "thrusters": thrusters, "components": components}
        for key, value in files.items():
            if value is not None:
                as_path(key, value)
        said: dict[str, Any] = {key: str(value) for key, value in files.items() if value is not None}
        said |= {"name": name, "pose": pose, "sensors": sensors, "engines": engines, "color": color}
        world = with_boat(self._world, said, folder)
        rig = self._moved(world)
        _check_place(rig, world, name)
        self._inhabit(world, rig, f"{name} joins")

    @in_turn
    def remove(self, name: str) -> None:
        """Remove a boat from the run. The others move exactly as before; subscriptions to its sensors end.

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the task scores this boat, or the simulation is advancing.
        """
        self._check_standing("remove")
        world = without_boat(self._world, name)
        self._inhabit(world, self._moved(world, left=name), f"{name} leaves")

    def _check_standing(self, what: str) -> None:
        self._turn.check(what)
        self._subscriptions.check_idle(what)
        self._turn.check_own(what)

    def _moved(self, world: World, left: str | None = None) -> Rig:
        """The present moment in another world, without the boat that left."""
        rig = rig_of(world, self._physics_models, known=self._rig)
        rig.reset(self._seed)
        carry(self._world, self._rig, rig, left=left)
        with fitting(rig.data):
            mujoco.mj_forward(rig.model, rig.data)
        return rig

    def _inhabit(self, world: World, rig: Rig, line: str) -> None:
        """Go on in another world; `told` goes into the recordings' logs."""
        raise NotImplementedError


def rig_of(world: World, physics_models: PhysicsModels, known: Rig | None = None) -> Rig:
    """The tables of a world, with models and data of its own; `known` is the rig of one that differs by boats alone."""
    model, quiet = physics_models.models(world)
    return Rig(world, model, quiet, mujoco.MjData(model), known=known)


def _check_place(rig: Rig, world: World, name: str) -> None:
    """Refuse a boat that stands in something."""
    model, data = rig.model, rig.data
    depth, other = 0.0, -1
    for contact in data.contact:
        one, two = (int(model.body_rootid[model.geom_bodyid[geom]]) for geom in contact.geom)
        mine = [model.body(root).name.partition("/")[0] == name for root in (one, two)]
        if mine[0] != mine[1] and contact.dist < depth:
            depth, other = float(contact.dist), two if mine[0] else one
    if other < 0:
        return
    x, y, _ = data.qpos[_start(rig, world, name)]
    what = model.body(other).name.rpartition("/")[0] or "the terrain"
    apart = float(np.hypot(*(data.xpos[other][:2] - (x, y))))
    where = f", whose origin is {apart:.2f} m away" if other else ""
    raise CommandError(f"no place for {name} at ({x:g}, {y:g}): it would be {-depth:.2f} m inside {what}{where}")


def _start(rig: Rig, world: World, name: str) -> slice:
    start = int(rig.hulls["qpos"][world.boats.index(name)])
    return slice(start, start + 3)
