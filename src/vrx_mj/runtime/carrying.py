"""What moves, carried over to the world with one boat more, or one less.

Who joins comes last in every table and array and who leaves is cut out, so the others keep their order: of each array
the rows that stay fill the beginning of the new one, and the rest of that is the new boat's as it starts.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.loop_arrays import MODEL_ARRAYS, OPTIONS, LoopArrays

__all__ = ["carry"]

WHOLE = ("body_subtreemass",)
"""Arrays of the model in which the new boat counts for the others, too: for the world."""


@dataclass(frozen=True)
class Staying:
    """Which rows of the loop's arrays stay, without those of one boat and its balls."""

    thrusters: BoolArray
    floats: BoolArray
    elements: BoolArray
    touches: BoolArray
    device_state: BoolArray
    bodies: BoolArray
    joints: BoolArray
    dofs: BoolArray
    qpos: BoolArray

    @staticmethod
    def of(world: World, arrays: LoopArrays, name: str | None) -> "Staying":
        """All rows but those of the boat called `name`; None: all of them."""
        model, parameters = arrays.model, world.parameters
        bodies = np.array([name is None or not _is_part(model.body(i).name, name) for i in range(model.nbody)])
        floating = [item for item in parameters.objects if item.kind == "floating"]
        floats = np.array([name is None or not _is_part(item.body, name) for item in floating], np.bool_)
        elements = np.ones(len(arrays.elements), np.bool_)
        for row in arrays.floats[~floats]:
            elements[row["element_start"] : row["element_start"] + row["element_count"]] = False
        devices = np.ones(len(arrays.sample_clocks.device_state), np.bool_)
        for sensor in arrays.sensors:
            devices[sensor.marks] = sensor.boat != name
        rivals = parameters.task.rivals if parameters.task else ()
        joints = bodies[model.jnt_bodyid]
        widths = np.array([_width(kind) for kind in model.jnt_type], np.int64)
        return Staying(
            thrusters=np.array([world.boats[row["hull"]] != name for row in arrays.thrusters], np.bool_),
            floats=floats,
            elements=elements,
            touches=np.array([rival != name for rival in rivals], np.bool_),
            device_state=devices,
            bodies=bodies,
            joints=joints,
            dofs=bodies[model.dof_bodyid],
            qpos=np.repeat(joints, widths),
        )


def carry(world: World, old: LoopArrays, new: LoopArrays, *, left: str | None = None) -> None:
    """Fill a new arrays, which was reset, with what moves in the old one, whose world this is; `left` is who leaves."""
    stay = Staying.of(world, old, left)
    _model(old, new, stay)
    _data(old.data, new.data, stay)
    _tables(old, new, stay)
    _moments(old, new, stay)


def _model(old: LoopArrays, new: LoopArrays, stay: Staying) -> None:
    """What a user set on the model."""
    for name in OPTIONS:
        setattr(new.model.opt, name, getattr(old.model.opt, name))
    rows = {"body": stay.bodies, "jnt": stay.joints, "dof": stay.dofs, "qpos0": stay.qpos}
    for name in MODEL_ARRAYS:
        if name not in WHOLE:
            here = getattr(old.model, name)
            _fill(getattr(new.model, name), here, rows.get(name.split("_")[0], np.ones(len(here), np.bool_)))
    new.refresh()


def _data(old: mujoco.MjData, new: mujoco.MjData, stay: Staying) -> None:
    new.time = old.time
    _fill(new.qpos, old.qpos, stay.qpos)
    for name in ("qvel", "qacc_warmstart", "qfrc_applied"):
        _fill(getattr(new, name), getattr(old, name), stay.dofs)
    _fill(new.xfrc_applied, old.xfrc_applied, stay.bodies)
    _fill(new.eq_active, old.eq_active, np.ones(len(old.eq_active), np.bool_))


def _tables(old: LoopArrays, new: LoopArrays, stay: Staying) -> None:
    new.wind_state[:] = old.wind_state
    _fill(new.thruster_state, old.thruster_state, stay.thrusters)
    _fill(new.float_state, old.float_state, stay.floats)
    _fill(new.element_state, old.element_state, stay.elements)
    new.follower_state[:] = old.follower_state
    new.block_state[:] = old.block_state
    _fill(new.touches, old.touches, stay.touches)


def _moments(old: LoopArrays, new: LoopArrays, stay: Staying) -> None:
    """The devices, and what the clocks latched; until a clock's next moment a new boat is where it starts."""
    shown = len(old.display_marks)
    sensed, now = len(old.sample_clocks.device_state) - shown, new.sample_clocks
    count = len(now.device_state) - shown

    def devices(target: FloatArray, source: FloatArray) -> None:
        _fill_columns(target[..., :count], source[..., :sensed], stay.device_state[:sensed])
        target[..., count:] = source[..., sensed:]

    devices(now.device_state, old.sample_clocks.device_state)
    start = np.concatenate((new.data.qpos, new.data.qvel, now.device_state))
    clocks = old.sample_clocks.clocks
    now.clocks, now.latched = clocks.copy(), np.tile(start, (len(clocks), 2, 1))
    (before, moves), (after, change) = _ends(old), _ends(new)
    _fill_columns(now.latched[..., :after], old.sample_clocks.latched[..., :before], stay.qpos)
    _fill_columns(now.latched[..., after:change], old.sample_clocks.latched[..., before:moves], stay.dofs)
    devices(now.latched[..., change:], old.sample_clocks.latched[..., moves:])


def _ends(arrays: LoopArrays) -> tuple[int, int]:
    """Where in a moment the positions end, and where the velocities do."""
    return arrays.model.nq, arrays.model.nq + arrays.model.nv


def _fill(target: npt.NDArray[np.generic], source: npt.NDArray[np.generic], stay: BoolArray) -> None:
    """Write the rows that stay to the beginning."""
    kept = source[stay]
    target[: len(kept)] = kept


def _fill_columns(target: FloatArray, source: FloatArray, stay: BoolArray) -> None:
    """The same for the last axis."""
    kept = source[..., stay]
    target[..., : kept.shape[-1]] = kept


def _is_part(body: str, boat: str) -> bool:
    return body.startswith(f"{boat}/")


def _width(kind: int) -> int:
    """How many numbers of qpos a joint has."""
    return {int(mujoco.mjtJoint.mjJNT_FREE): 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}.get(int(kind), 1)
