"""The tables of the compiled loop for one world: parameters, state, and views of MuJoCo's arrays."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.compiler.drawing import drawing_model
from vrx_mj.compiler.world import World
from vrx_mj.errors import CompileError, StateError
from vrx_mj.physics import tables
from vrx_mj.physics.noise import stream_key
from vrx_mj.runtime.moments import Moments
from vrx_mj.runtime.mounted import mounted, start_marks
from vrx_mj.runtime.proximity import LOOK, movers, obstacles

__all__ = ["Rig", "drawing_model", "stepping_models"]

OPTIONS = ("timestep", "gravity", "wind", "density", "viscosity", "integrator", "solver", "iterations", "tolerance",
           "disableflags", "enableflags")  # fmt: skip
"""Options of the model that a user may change between runs."""
MODEL_ARRAYS = (
    "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_subtreemass", "body_inertia",
    "body_invweight0", "jnt_pos", "jnt_axis", "jnt_range", "jnt_stiffness", "dof_armature", "dof_damping",
    "dof_frictionloss", "dof_invweight0", "dof_M0", "eq_data", "eq_solref", "eq_solimp", "qpos0",
)  # fmt: skip
"""Arrays of the model that a user may change between runs."""

Row = Mapping[str, Any]
NO_JOINT = -1


def stepping_models(world: World) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The model that steps, from the saved form without anything that is only looked at, and its quiet twin.

    The twin has no shapes at all; it steps the same data while nothing can touch anything.
    """
    try:
        text = re.sub(r"<camera [^>]*/>", "", world.mjcf)
        spec = mujoco.MjSpec.from_string(text, assets=dict(world.assets))
        spec.compiler.discardvisual = True
        model = spec.compile()
        for geom in spec.geoms:  # what cannot collide is discarded; deleting them singly takes minutes
            geom.contype = geom.conaffinity = 0
        return model, spec.compile()
    except ValueError as error:
        raise CompileError(f"MuJoCo refuses the saved world {world.name}: {error}") from error


class Rig:
    """Arrays for `advance`, in the order in which it takes them.

    The views belong to one model and data: whoever makes new ones makes a new rig.
    """

    def __init__(self, world: World, model: mujoco.MjModel, quiet: mujoco.MjModel, data: mujoco.MjData) -> None:
        parameters = world.parameters
        sea, wind = parameters["sea"], parameters["wind"]
        self.model, self.data = model, data
        self.timestep = float(model.opt.timestep)
        self.waves = tables.table(tables.WAVE, sea["waves"])
        self.sea = tables.table(tables.SEA, [{"tau": sea["tau"], "level": sea["level"]}])
        known = ("direction", "mean", "gain", "time_constant")
        self.wind = tables.table(tables.WIND, [{**{k: wind[k] for k in known}, "key": 0}])
        self.wind_seed = int(wind["seed"])
        self.hulls = tables.table(tables.HULL, [self._free_body(row) for row in parameters["hulls"]])
        self.thrusters = tables.table(tables.THRUSTER, [self._engine(row) for row in parameters["thrusters"]])
        self.floats = tables.table(tables.FLOAT, [self._free_body(row) for row in parameters["floats"]])
        self.elements = tables.table(tables.ELEMENT, parameters["elements"])
        self.wind_state = np.zeros(1, tables.WIND_STATE)
        self.thruster_state = np.zeros(len(self.thrusters), tables.THRUSTER_STATE)
        self.float_state = np.zeros(len(self.floats), tables.FLOAT_STATE)
        self.quiet = quiet
        self.movers, self.obstacles = movers(model), obstacles(model)
        self.look = np.zeros(1, LOOK)
        self.sensors = mounted(world, model)
        self.moments = Moments(model.nq, model.nv, start_marks(self.sensors))

    @property
    def state_tables(self) -> Sequence[npt.NDArray[Any]]:
        """The tables that change from step to step."""
        return self.wind_state, self.thruster_state, self.float_state

    def reset(self, seed: int) -> None:
        """Bring the state tables to their start and draw the run's noise streams from `seed`."""
        for table in self.state_tables:
            table[:] = np.zeros(1, table.dtype)
        self.key(seed)
        self.wind_state["speed"] = self.wind["mean"]
        self.thruster_state["expires"] = -np.inf
        for sensor in self.sensors:
            if sensor.ball is not None:
                self.float_state["held"][sensor.ball] = 1
        self.moments.reset()

    def refresh(self) -> None:
        """Carry what was changed in the model over to its twin without shapes."""
        for name in OPTIONS:
            setattr(self.quiet.opt, name, getattr(self.model.opt, name))
        for name in MODEL_ARRAYS:
            getattr(self.quiet, name)[:] = getattr(self.model, name)

    def key(self, seed: int) -> None:
        """Set the keys of the noise streams; the wind's own seed is part of its key."""
        self.wind["key"] = stream_key(seed, "wind", str(self.wind_seed))

    def pack(self) -> bytes:
        """The state tables and what the sensors' clocks caught, as bytes."""
        return b"".join(table.tobytes() for table in self.state_tables) + self.moments.pack()

    @property
    def moving(self) -> int:
        """How many of the bytes that `pack` gives bear on the motion; the rest are what sensors saw of it."""
        return sum(table.nbytes for table in self.state_tables) + self.moments.marks.nbytes

    def check(self, block: bytes) -> None:
        """Tell whether `unpack` can take these bytes.

        Raises:
            StateError: it cannot.
        """
        size = sum(table.nbytes for table in self.state_tables)
        if len(block) < size:
            raise StateError(f"the state has {len(block)} bytes of tables instead of {size}")
        self.moments.check(block[size:])

    def unpack(self, block: bytes) -> None:
        """Write back what `pack` gave."""
        offset = 0
        for table in self.state_tables:
            table[:] = np.frombuffer(block, table.dtype, len(table), offset)
            offset += table.nbytes
        self.moments.unpack(block[offset:])

    def row(self, time: float) -> npt.NDArray[np.float64]:
        """The row of this moment, at `time` [s], as `sample` makes them in the loop."""
        engines, now = self.thruster_state, [time, self.wind_state["speed"][0]]
        return np.concatenate((now, engines["thrust"], engines["angle"], self.data.qpos, self.data.qvel))

    def arguments(self, sampling: npt.NDArray[np.int64], samples: npt.NDArray[np.float64]) -> tuple[Any, ...]:
        """What `advance` takes before time and steps."""
        model, data = self.model, self.data
        return (
            model._address,
            self.quiet._address,
            data._address,
            data.qpos,
            data.qvel,
            data.xfrc_applied,
            data.qfrc_applied,
            data.M,
            model.M_rowadr,
            self.sea,
            self.waves,
            self.wind,
            self.wind_state,
            self.hulls,
            self.thrusters,
            self.thruster_state,
            self.floats,
            self.elements,
            self.float_state,
            self.movers,
            self.obstacles,
            self.look,
            self.moments.clocks,
            self.moments.caught,
            self.moments.marks,
            sampling,
            samples,
        )

    def _free_body(self, row: Row) -> Row:
        """Replace a body's name by its id and the addresses of its free joint."""
        row = {key: value for key, value in row.items() if key != "joint"}
        body = self.model.body(row["body"])
        joint = int(body.jntadr[0])
        ids = {
            "body": int(body.id),
            "qpos": int(self.model.jnt_qposadr[joint]),
            "dof": int(self.model.jnt_dofadr[joint]),
        }
        return {**row, **ids}

    def _engine(self, row: Row) -> Row:
        """Replace names by ids in a thruster's row; a fixed engine has no joint."""
        plain = {key: value for key, value in row.items() if key not in ("name", "joint", "body")}
        body = int(self.model.body(row["body"]).id)
        if row["joint"] is None:
            return {**plain, "body": body, "qpos": NO_JOINT, "dof": NO_JOINT}
        joint = int(self.model.joint(row["joint"]).id)
        addresses = {
            "qpos": int(self.model.jnt_qposadr[joint]),
            "dof": int(self.model.jnt_dofadr[joint]),
        }
        return {**plain, "body": body, **addresses}
