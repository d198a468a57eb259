"""Boats, objects and docks that join or leave a running `Simulation`.

What joins comes last in every table and array, and what leaves is cut out, so the others keep their order: of each
array the rows that stay fill the beginning of the new one, and the rest holds the newcomer's initial values.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import as_path
from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.mjcf.compile import staying, with_boat, with_dock, with_object, without
from vrx_mj.mjcf.objects import ball_names
from vrx_mj.mjcf.pieces import owner_of
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.loop_arrays import MODEL_ARRAYS, OPTIONS, STATE_TABLES, LoopArrays, memories_of
from vrx_mj.runtime.run_lock import RunLock, with_run_lock
from vrx_mj.runtime.running_world import FreeBodies, RunningWorld, loop_arrays_of
from vrx_mj.runtime.stepping_models import fitting
from vrx_mj.runtime.views import ARRAYS
from vrx_mj.sensors.displays import MARK_COUNTS

_MODEL_ROWS = {"body": "bodies", "jnt": "joints", "dof": "dofs", "qpos0": "qpos", "eq": "equalities"}
"""What the rows of the model's arrays are of, by the first word of their names."""
_ROWS = {name: array.rows for name, array in ARRAYS.items() if array.rows} | {
    "qacc_warmstart": "dofs", "qfrc_applied": "dofs", "xfrc_applied": "bodies", "eq_active": "equalities",
    "touches": "rivals", "memory_state": "memories", "drift_state": "drifts",
}  # fmt: skip
"""What the rows of other arrays are of; no row of an array that is not listed belongs to anything that can leave."""
_DATA_ARRAYS = ("qacc_warmstart", "qfrc_applied", "xfrc_applied", "eq_active")
"""Arrays of MuJoCo's data that are kept beside positions and velocities."""
_WORLD_SUMS = ("body_subtreemass",)
"""Arrays of the model in which a new part also counts for the world."""


class Spawning:
    """Boats, objects and docks that join and leave a run; errors are those of the methods of `Simulation`."""

    def __init__(self, live: RunningWorld) -> None:
        self._live = live

    def add(
        self, call: str, grow: Callable[[World, dict[str, Any]], World], files: Mapping[str, str | Path], **entry: Any
    ) -> None:
        """Add something at rest, by a method of `Simulation`: `files` and `entry` are what files have of it."""
        self._live.check_idle(call)
        for key, path in files.items():
            as_path(key, path)
            entry[key] = path.as_posix() if isinstance(path, Path) else str(path)
        world, name = grow(self._live.world, entry), entry["name"]
        arrays, live = self._arrays_in(world), self._live
        _check_place(arrays, name)
        bodies = FreeBodies(world, arrays)
        wet = (*bodies.floating, *bodies.anchored)
        for own in wet if live.time > 0.0 else ():  # at the start no float has met the water yet
            if owner_of(own) == name and own not in live.bodies.floating and own not in ball_names(world.parameters):
                bodies.start_floating(own, lambda x, y: float(live.sea.height(x, y, live.time)))
        live.enter(world, arrays, f"{name} joins")

    def remove(self, name: str) -> None:
        """Remove a boat, an object or a dock."""
        self._live.check_idle("remove")
        world = without(self._live.world, name)
        self._live.enter(world, self._arrays_in(world, left=name), f"{name} leaves")

    def _arrays_in(self, world: World, left: str | None = None) -> LoopArrays:
        """The present moment in another world, without what left."""
        live = self._live
        arrays = loop_arrays_of(world, live.physics_models, known=live.arrays)
        arrays.reset(live.seed)
        _carry(live.arrays, arrays, _rows_staying(live.world, live.arrays, left) if left else {})
        with fitting(arrays.data):
            mujoco.mj_forward(arrays.model, arrays.data)
        return arrays


def _rows_staying(world: World, arrays: LoopArrays, left: str) -> dict[str, BoolArray]:
    """Which rows stay when a boat, an object or a dock leaves; of what is not listed all do."""
    model, stay = arrays.model, staying(world.parameters, left)
    bodies = np.array([not i or owner_of(model.body(i).name) != left for i in range(model.nbody)])
    joints = bodies[model.jnt_bodyid]
    sensed = np.ones(len(arrays.sample_clocks.device_state) - len(arrays.display_marks), np.bool_)
    for sensor in arrays.sensors:
        sensed[sensor.marks] = sensor.boat != left
    return {
        **stay,
        "bodies": bodies,
        "joints": joints,
        "dofs": bodies[model.dof_bodyid],
        "qpos": np.repeat(joints, np.diff(model.jnt_qposadr, append=model.nq)),
        "equalities": bodies[model.eq_obj1id],
        "memories": np.repeat(stay["hulls"], memories_of(world.parameters.hulls)),
        "drifts": stay["hulls"][arrays.hulls["drift_state"] >= 0],
        "propellers": stay["thrusters"][arrays.thrusters["measured"] >= 0],
        "sensed": sensed,
        "light_marks": np.repeat(stay["lights"], MARK_COUNTS["light"]),
        "placard_marks": np.repeat(stay["placards"], MARK_COUNTS["placard"]),
    }


def _carry(old: LoopArrays, new: LoopArrays, stay: Mapping[str, BoolArray]) -> None:
    """Fill new arrays, which were reset, with what a user set on the old model and with what moves."""
    for name in OPTIONS:
        setattr(new.model.opt, name, getattr(old.model.opt, name))
    for name in MODEL_ARRAYS:
        if name not in _WORLD_SUMS:
            _fill(getattr(new.model, name), getattr(old.model, name), stay.get(_MODEL_ROWS.get(name.split("_")[0], "")))
    for name in _DATA_ARRAYS:
        _fill(getattr(new.data, name), getattr(old.data, name), stay.get(_ROWS.get(name, "")))
    for name in STATE_TABLES:
        _fill(getattr(new, name), getattr(old, name), stay.get(_ROWS.get(name, "")))
    new.refresh()
    new.data.time = old.data.time
    _carry_moments(old, new, stay)


def _carry_moments(old: LoopArrays, new: LoopArrays, stay: Mapping[str, BoolArray]) -> None:
    """The present moment and those that the clocks latched: in all of them a newcomer is where it starts."""
    before, after = old.sample_clocks, new.sample_clocks
    clocks, ends, length = before.latched.shape
    latched = before.latched.reshape(clocks * ends, length)
    moments = np.vstack((latched, _moment(old))).T
    moved = np.tile(_moment(new), (len(latched) + 1, 1)).T
    kinds = "qpos", "dofs", "sensed", "light_marks", "placard_marks"
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
    """Views of the positions, velocities, sensors' devices, lights and placards of moments, a column each."""
    placards = sum(len(one.start) for one in arrays.displays if one.kind == "placard")
    ends = arrays.model.nq, arrays.model.nq + arrays.model.nv, len(moments) - len(arrays.display_marks)
    return np.split(moments, (*ends, len(moments) - placards))


def _fill(target: npt.NDArray[np.generic], source: npt.NDArray[np.generic], stay: BoolArray | None) -> None:
    """Write the rows that stay, None for all, to the beginning."""
    kept = source if stay is None else source[stay]
    target[: len(kept)] = kept


def _check_place(arrays: LoopArrays, name: str) -> None:
    """Refuse a newcomer that would be inside of something."""
    model, data = arrays.model, arrays.data
    depth, own, other = 0.0, -1, -1
    for contact in data.contact:
        roots = [int(model.body_rootid[model.geom_bodyid[geom]]) for geom in contact.geom]
        mine = [owner_of(model.body(root).name) == name for root in roots]
        if mine[0] != mine[1] and contact.dist < depth:
            depth = float(contact.dist)
            own, other = roots if mine[0] else reversed(roots)
    if other < 0:
        return
    x, y, _ = data.xpos[own]
    what = model.body(other).name.rpartition("/")[0] or "the terrain"
    apart = float(np.hypot(*(data.xpos[other][:2] - (x, y))))
    where = f", whose origin is {apart:.2f} m away" if other else ""
    raise CommandError(f"no place for {name} at ({x:g}, {y:g}): it would be {-depth:.2f} m inside {what}{where}")


class Roster:
    """Boats, objects and docks of a running world."""

    _spawning: Spawning
    _run_lock: RunLock

    @with_run_lock
    def spawn(
        self,
        /,
        name: str,
        *,
        pose: Sequence[float],
        robot: str | Path | None = None,
        thrusters: str | Path | None = None,
        components: str | Path | None = None,
        sensors: str | Sequence[str] | None = None,
        engines: str = "fixed",
        color: Sequence[float] | None = None,
        **settings: object,
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
            **settings: other keys of a fleet file's `boats`, such as `arguments` or `ais`.

        Raises:
            ConfigError: an argument is invalid, or the robot does not exist.
            CommandError: the name or the place is taken, or the simulation is advancing.
            CompileError: the boat cannot be built.
        """
        paths = {"robot": robot, "thrusters": thrusters, "components": components}
        files = {key: path for key, path in paths.items() if path is not None}
        entry = {"name": name, "pose": pose, "sensors": sensors, "engines": engines, "color": color, **settings}
        self._spawning.add("spawn", with_boat, files, **entry)

    @with_run_lock
    def spawn_object(
        self,
        name: str,
        *,
        model: str | Path,
        pose: Sequence[float],
        path: Mapping[str, object] | None = None,
        symbols: Sequence[str] | None = None,
    ) -> None:
        """Add an object at rest to the run, as one of a world file's `objects`. All else moves exactly as without it.

        It stays until it is removed or the run is reset; `sim.model`, `sim.data` and `sim.world` are new objects
        afterwards, as after `spawn`. It floats where the water is now. One that is made of others joins with all of
        them, as `name/red_0`.

        Args:
            name: name of the object; nothing else in the world has it.
            model: name from `vrx-mj list objects`, `model://NAME` of Gazebo, or the path of a YAML or SDF file, from
                the current folder.
            pose: (x, y, z, roll, pitch, yaw) of its link's origin [m, rad, ENU].
            path: along which it swims, with the keys of `path` in an object's file; by default its model's own.
            symbols: that the placards of its docks show at the start.

        Raises:
            ConfigError: an argument is invalid, or the model does not exist.
            CommandError: the name or the place is taken, or the simulation is advancing.
        """
        entry = {"name": name, "pose": pose, "path": path, "symbols": symbols}
        self._spawning.add("spawn_object", with_object, {"model": model}, **entry)

    @with_run_lock
    def spawn_dock(
        self,
        name: str,
        *,
        layout: str | Path | Sequence[str],
        pose: Sequence[float],
        dynamic: bool = False,
        block: float = 2.0,
        mooring: Mapping[str, object] | None = None,
        bays: Sequence[Mapping[str, object]] | None = None,
        symbols: Sequence[str] | None = None,
    ) -> None:
        """Add a dock at rest to the run, as one of a world file's `docks`; else as `spawn_object`.

        Args:
            name: name of the dock; nothing else in the world has it.
            layout: rows of X and blanks, as text or a list; a name from `vrx-mj list docks`; or the path of a file.
            pose: (x, y, z, roll, pitch, yaw) of the middle of the drawing's first cell [m, rad, ENU].
            dynamic: whether it floats.
            block: edge of a block [m], from 0.5 to 2.
            mooring: what holds a floating dock, with the keys of `mooring` in a world file.
            bays: what is known of its bays, with the keys of `bays` in a world file.
            symbols: that its placards show at the start.

        Raises:
            ConfigError: an argument is invalid, or the layout does not exist.
            CommandError: the name or the place is taken, or the simulation is advancing.
        """
        rows = layout.as_posix() if isinstance(layout, Path) else layout
        entry = {"name": name, "layout": rows, "pose": pose, "dynamic": dynamic, "block": block}
        self._spawning.add("spawn_dock", with_dock, {}, mooring=mooring, bays=bays, symbols=symbols, **entry)

    @with_run_lock
    def remove(self, name: str) -> None:
        """Remove a boat, an object or a dock from the run. All else moves exactly as before.

        Subscriptions to the sensors of a boat that is removed end. An object goes with all that it is made of.

        Raises:
            UnknownNameError: nothing has that name.
            CommandError: the task scores this boat or refers to this object or dock, it is a part of another object,
                or the simulation is advancing.
        """
        self._spawning.remove(name)
