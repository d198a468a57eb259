"""Boats that come and go while a simulation runs."""

from collections.abc import Mapping
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
from vrx_mj.runtime.live_world import LiveWorld, loop_arrays_of
from vrx_mj.runtime.loop_arrays import LoopArrays

__all__ = ["Spawning"]


class Spawning:
    """Boats that join and leave a run; errors are those of `Simulation.spawn` and `Simulation.remove`."""

    def __init__(self, live: LiveWorld) -> None:
        self._live = live

    def spawn(
        self, name: str, *, robot: str | Path | None, files: Mapping[str, str | Path | None], **other: object
    ) -> None:
        """Add a boat at rest; `files` are the layout of thrusters and the components, `other` is as in a fleet file."""
        self._live.check_idle("spawn")
        folder = robot.parent if isinstance(robot, Path) and robot.is_absolute() else None
        files = {"robot": f"./{robot.name}" if folder and isinstance(robot, Path) else robot, **files}
        for key, value in files.items():
            if value is not None:
                as_path(key, value)
        given: dict[str, Any] = {key: str(value) for key, value in files.items() if value is not None}
        world = with_boat(self._live.world, given | {"name": name, **other}, folder)
        arrays = self._moved(world)
        _check_place(arrays, world, name)
        self._live.enter(world, arrays, f"{name} joins")

    def remove(self, name: str) -> None:
        """Remove a boat."""
        self._live.check_idle("remove")
        world = without_boat(self._live.world, name)
        self._live.enter(world, self._moved(world, left=name), f"{name} leaves")

    def _moved(self, world: World, left: str | None = None) -> LoopArrays:
        """The present moment in another world, without the boat that left."""
        live = self._live
        arrays = loop_arrays_of(world, live.physics_models, known=live.arrays)
        arrays.reset(live.seed)
        carry(live.world, live.arrays, arrays, left=left)
        with fitting(arrays.data):
            mujoco.mj_forward(arrays.model, arrays.data)
        return arrays


def _check_place(arrays: LoopArrays, world: World, name: str) -> None:
    """Refuse a boat that stands in something."""
    model, data = arrays.model, arrays.data
    depth, other = 0.0, -1
    for contact in data.contact:
        one, two = (int(model.body_rootid[model.geom_bodyid[geom]]) for geom in contact.geom)
        mine = [model.body(root).name.partition("/")[0] == name for root in (one, two)]
        if mine[0] != mine[1] and contact.dist < depth:
            depth, other = float(contact.dist), two if mine[0] else one
    if other < 0:
        return
    x, y, _ = data.qpos[_start(arrays, world, name)]
    what = model.body(other).name.rpartition("/")[0] or "the terrain"
    apart = float(np.hypot(*(data.xpos[other][:2] - (x, y))))
    where = f", whose origin is {apart:.2f} m away" if other else ""
    raise CommandError(f"no place for {name} at ({x:g}, {y:g}): it would be {-depth:.2f} m inside {what}{where}")


def _start(arrays: LoopArrays, world: World, name: str) -> slice:
    start = int(arrays.hulls["qpos"][world.boats.index(name)])
    return slice(start, start + 3)
