"""Boats that come and go while a simulation runs.

Who joins comes last in every table and array and who leaves is cut out, so the others keep their order: of each array
the rows that stay fill the beginning of the new one, and the rest of that is the new boat's as it starts.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_path
from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.mjcf.joining import staying, with_boat, without_boat
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.crowding import fitting
from vrx_mj.runtime.live_world import LiveWorld, loop_arrays_of
from vrx_mj.runtime.loop_arrays import MODEL_ARRAYS, OPTIONS, LoopArrays
from vrx_mj.runtime.views import ARRAYS, STATE

__all__ = ["Spawning"]

MODEL_ROWS = {"body": "bodies", "jnt": "joints", "dof": "dofs", "qpos0": "qpos"}
"""What the rows of the model's arrays are of, by the first word of their names."""
ROWS = {
    "qacc_warmstart": "dofs", "qfrc_applied": "dofs", "xfrc_applied": "bodies", "thruster_state": "thrusters",
    "float_state": "floats", "element_state": "elements", "touches": "rivals",
}  # fmt: skip
"""The same for other arrays; no row of those that are not listed belongs to a boat."""
DATA_ARRAYS = ("qacc_warmstart", "qfrc_applied", "xfrc_applied", "eq_active")
"""Arrays of MuJoCo's data that are kept beside positions and velocities."""
STATE_TABLES = tuple(name for name, array in ARRAYS.items() if array.use == STATE)
"""The tables that change."""
WHOLE = ("body_subtreemass",)
"""Arrays of the model in which the new boat counts for the others, too: for the world."""


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
        _carry(live.arrays, arrays, _rows_staying(live.world, live.arrays, left) if left else {})
        with fitting(arrays.data):
            mujoco.mj_forward(arrays.model, arrays.data)
        return arrays


def _rows_staying(world: World, arrays: LoopArrays, left: str) -> dict[str, BoolArray]:
    """Which rows stay when a boat leaves; of what is not listed all do."""
    model = arrays.model
    bodies = np.array([model.body(i).name.partition("/")[0] != left for i in range(model.nbody)])
    joints = bodies[model.jnt_bodyid]
    sensed = np.ones(len(arrays.sample_clocks.device_state) - len(arrays.display_marks), np.bool_)
    for sensor in arrays.sensors:
        sensed[sensor.marks] = sensor.boat != left
    return {
        **staying(world.parameters, left),
        "bodies": bodies,
        "joints": joints,
        "dofs": bodies[model.dof_bodyid],
        "qpos": np.repeat(joints, np.diff(model.jnt_qposadr, append=model.nq)),
        "sensed": sensed,
    }


def _carry(old: LoopArrays, new: LoopArrays, stay: Mapping[str, BoolArray]) -> None:
    """Fill new arrays, which were reset, with what a user set on the old model and with what moves."""
    for name in OPTIONS:
        setattr(new.model.opt, name, getattr(old.model.opt, name))
    for name in MODEL_ARRAYS:
        if name not in WHOLE:
            _fill(getattr(new.model, name), getattr(old.model, name), stay.get(MODEL_ROWS.get(name.split("_")[0], "")))
    for name in DATA_ARRAYS:
        _fill(getattr(new.data, name), getattr(old.data, name), stay.get(ROWS.get(name, "")))
    for name in STATE_TABLES:
        _fill(getattr(new, name), getattr(old, name), stay.get(ROWS.get(name, "")))
    new.refresh()
    new.data.time = old.data.time
    _carry_moments(old, new, stay)


def _carry_moments(old: LoopArrays, new: LoopArrays, stay: Mapping[str, BoolArray]) -> None:
    """The present moment and those that the clocks latched: in all of them a new boat is where it starts."""
    before, after = old.sample_clocks, new.sample_clocks
    clocks, ends, length = before.latched.shape
    latched = before.latched.reshape(clocks * ends, length)
    moments = np.vstack((latched, _moment(old))).T
    moved = np.tile(_moment(new), (len(latched) + 1, 1)).T
    kinds = "qpos", "dofs", "sensed", "displays"
    for target, source, rows in zip(_parts(new, moved), _parts(old, moments), kinds, strict=True):
        _fill(target, source, stay.get(rows))
    *then, now = moved.T
    new.data.qpos[:], new.data.qvel[:], after.device_state[:] = np.split(
        now, [new.model.nq, new.model.nq + new.model.nv]
    )
    after.clocks, after.latched = before.clocks.copy(), np.reshape(then, (clocks, ends, len(now)))


def _moment(arrays: LoopArrays) -> FloatArray:
    """All that sensors see now."""
    return np.concatenate((arrays.data.qpos, arrays.data.qvel, arrays.sample_clocks.device_state))


def _parts(arrays: LoopArrays, moments: FloatArray) -> list[FloatArray]:
    """Views of the positions, velocities, sensors' devices and displays of moments, a column each."""
    ends = arrays.model.nq, arrays.model.nq + arrays.model.nv, len(moments) - len(arrays.display_marks)
    return np.split(moments, ends)


def _fill(target: npt.NDArray[np.generic], source: npt.NDArray[np.generic], stay: BoolArray | None) -> None:
    """Write the rows that stay, None for all, to the beginning."""
    kept = source if stay is None else source[stay]
    target[: len(kept)] = kept


def _check_place(arrays: LoopArrays, world: World, name: str) -> None:
    """Refuse a boat that would be inside of something."""
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
