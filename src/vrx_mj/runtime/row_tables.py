"""The rows of a batch: what each has of its own, how its boats float at rest, its parameters, and its free bodies.

Rows of worlds of free bodies alone step without MuJoCo while nothing can touch anything.
"""

import copy
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property, partial
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import check_kind
from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import CommandError, warn
from vrx_mj.mjcf.flotation import MOST_LIFT
from vrx_mj.mjcf.world import World
from vrx_mj.model.numbers import Number, run_numbers, with_numbers
from vrx_mj.model.water import Sea
from vrx_mj.model.world import Parameters
from vrx_mj.physics.drag import has_added_moment
from vrx_mj.physics.equilibrium import settle
from vrx_mj.physics.free_body import FREE_BODY, free_body_row
from vrx_mj.physics.hydrostatics import greatest_lift
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.vessel import HullMeshes
from vrx_mj.physics.waves import surface_height
from vrx_mj.runtime.limits import total_memory
from vrx_mj.runtime.loop_arrays import LoopArrays, mujoco_arrays, point_models
from vrx_mj.runtime.rows import ARGUMENTS, FEATURES, RowSeas, reset_rows, row_values
from vrx_mj.runtime.state import integration_state, set_integration_state
from vrx_mj.runtime.views import ARRAYS, OWN, PARAMETER, RUN, STATE, point, point_rows
from vrx_mj.sensors.sea import wave_table

Values = npt.ArrayLike | None
"""A parameter of rows, or a command: a number, or one for each of them; None: as it is."""
Seeds = int | Sequence[int] | IntArray | None
"""A seed for each row, or a number s for s + i in row i; None: the world's seed."""
_ROW_MEMORY = 455_000
"""Memory of any row [bytes]: MuJoCo's `mjData` itself, mostly statistics of its solver; measured with MuJoCo 4.0."""
_OUT_OF_MEMORY = "Caught an unknown exception!"
"""Words of the RuntimeError by which MuJoCo's bindings of MuJoCo 4.0 may report a failed allocation."""
SEPARATE = tuple(name for name, array in ARRAYS.items() if array.use in {STATE, OWN})
"""Tables of which every row has its own part."""
_KEPT: Mapping[str, tuple[str, ...]] = {
    "wind": ("key", "direction", "mean", "gain"), "current": ("key",), "air": ("key",), "gust_bands": ("phase",),
    "hulls": ("mass",), "thrusters": ("gain",), "sea": (),
}  # fmt: skip
"""Tables of the same size in all rows, and their columns that a row's run and its factors set, not its numbers."""
_STACKED = (*SEPARATE, *_KEPT, "waves", "own_waves")
"""Tables of which rows may have a part in a stack."""
_AFLOAT = "float_state", "element_state", "link_state", "block_state"
"""Tables of what the water last did to objects and docks."""
_CHUNK = 4096
"""Rows whose waves are written at once."""
_DT = 1e-3
"""Time between two moments from which a boat's motion with the water is found [s]."""
_MAX_TILT = 0.5
"""Largest roll and pitch of a boat at rest [rad]; on steeper waves it starts as in calm water."""
_MASS_HALVINGS = 20
"""Halvings of the interval in which the largest mass is sought."""
_NUMBER_ARGUMENTS = {f"{table}.{column}": name for name, (table, column, _) in ARGUMENTS.items() if table == "wind"}
"""Numbers that are arguments, too, by name."""


def check_free(arrays: LoopArrays, name: str) -> None:
    """Check that all that moves in a world are single free bodies.

    Raises:
        CommandError: something is held by joints or to something else.
    """
    model = arrays.contact_free
    driven = model.body_gravcomp.any() or model.opt.density or model.opt.viscosity or model.dof_damping.any()
    known, hinged = 6 * (len(arrays.hulls) + len(arrays.floats)), int((arrays.thrusters["dof"] >= 0).sum())
    jointed = len(arrays.links) or (model.jnt_type != mujoco.mjtJoint.mjJNT_FREE).any()
    held = known != model.nv or driven or not arrays.broadphase["unconstrained"].all()
    for found, why in (
        (hinged, f"{hinged} engines of world {name} turn on hinges; give the fleet `engines: fixed`"),
        (len(arrays.blocks), f"world {name} has a floating dock; make it `dynamic: false`"),
        (jointed, f"things in world {name} have joints; leave them out"),
        (held, f"MuJoCo holds, drives or pushes something in world {name}; leave it out"),
    ):
        if found:
            raise CommandError(f'engine free: {why}, or use engine="mujoco"')


def free_bodies(arrays: LoopArrays, model: mujoco.MjModel, hulls: Table, vessels: Table) -> Table:
    """Everything that moves as a row of FREE_BODY: hulls, then what floats.

    Args:
        arrays: the world's; MuJoCo's addresses are from there.
        model: with the masses.
        hulls: with the added masses.
        vessels: with those of hulls that have a model.
    """
    data = mujoco.MjData(model)
    data.qpos.reshape(-1, 7)[:, 3:] = 1.0, 0.0, 0.0, 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_makeM(model, data)
    whole = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, whole)
    gravity, rows = -float(model.opt.gravity[2]), []
    for number, item in enumerate([*hulls, *arrays.floats]):
        body, dof, row = int(item["body"]), int(item["dof"]), number - len(hulls)
        rigid = whole[dof : dof + 6, dof : dof + 6]
        added = _water_mass(item, vessels) if row < 0 else np.zeros((6, 6))
        columns = {"body": body, "qpos": item["qpos"], "dof": dof, "float": max(row, -1)}
        weight, pushed = gravity * rigid[0, 0], model.body_ipos[body]
        rows.append(free_body_row(rigid, added, weight=weight, pushed=pushed, **columns))
    return np.concatenate([np.zeros(0, FREE_BODY), *rows])


def _water_mass(hull: Record, vessels: Table) -> FloatArray:
    """Added mass of a hull, (6, 6), with the moment -c x A a of VRX's."""
    if hull["vessel"] >= 0:
        return np.array(vessels[hull["vessel"]]["added_mass"])
    added = np.diag(hull["added_mass"])
    if has_added_moment(hull):
        added[3:, :3] = np.cross(hull["link_com"], added[:3, :3], axisb=0, axisc=0)
    return added


def row_bytes(arrays: LoopArrays) -> int:
    """Memory of a row like this run [bytes]."""
    own = 8 * (1 + 2 * len(arrays.waves)) if arrays.random_sea else 0
    if len(arrays.free_bodies):
        return int(RUN.itemsize + own + sum(getattr(arrays, name).nbytes for name in SEPARATE))
    return _ROW_MEMORY + own + int(arrays.data.nbuffer)


def check_memory(n: int, each: int, most: float | None = None) -> None:
    """Check that `n` rows of so many bytes fit into `most`, by default the memory of this machine or container.

    Beyond that the system ends the process.

    Raises:
        CommandError: they do not.
    """
    most = float(total_memory() if most is None else most)
    if n * each > most:
        text = f"{_size(n * each)} are needed, {_size(each)} a row, and at most {_size(most)} are available"
        raise CommandError(f"no memory for {n} rows: {text}; make at most {int(most / each)} rows")


@contextmanager
def allocating(n: int, data: mujoco.MjData) -> Iterator[None]:
    """Context in which the memory of `n` rows like this one is allocated.

    Raises:
        CommandError: the system has refused it, as because of a limit (`ulimit -v`).
    """
    try:
        yield
    except (MemoryError, RuntimeError, mujoco.FatalError) as error:
        if isinstance(error, RuntimeError) and str(error) != _OUT_OF_MEMORY:
            raise
        each = _ROW_MEMORY + int(data.nbuffer) + int(data.narena)
        text = f"{_size(n * each)} of address space are needed, {_size(each)} a row"
        raise CommandError(
            f"no memory for {n} rows: {text}; make fewer rows, or raise the limit (ulimit -v)"
        ) from error


def _size(count: float) -> str:
    unit, scale = ("GB", 1e9) if count >= 1e9 else ("MB", 1e6) if count >= 1e5 else ("kB", 1e3)
    return f"{count / scale:.{1 if unit != 'MB' else 2}f} {unit}"


def _with_scaled_mass(model: mujoco.MjModel, roots: Iterable[int], factor: float) -> mujoco.MjModel:
    """A model like another, with mass and inertia of some bodies, and of all that hangs on them, times a factor."""
    own, chosen = copy.copy(model), set(roots)
    bodies = [body for body in range(model.nbody) if int(model.body_rootid[body]) in chosen]
    own.body_mass[bodies] *= factor
    own.body_inertia[bodies] *= factor
    mujoco.mj_setConst(own, mujoco.MjData(own))
    return own


class RowTables:
    """MuJoCo's data of the rows, and the tables of which each may have its own part.

    Rows of free bodies have data only from when something was near until their next reset.
    """

    def __init__(self, arrays: LoopArrays, n: int, sea: Sea) -> None:
        """All `n` rows have the world of these arrays, and its sea."""
        model = arrays.model
        self.n, self.arrays, self._free = n, arrays, len(arrays.free_bodies) > 0
        self.seas = RowSeas(sea, n)
        self._data: dict[int, mujoco.MjData] = {}
        self.runs = np.zeros(n, RUN)
        shared = arrays.by_name(np.zeros(3, np.int64), np.zeros((0, arrays.columns)))
        self.stacks = {name: array[None] for name, array in shared.items()} | {"waves": self.seas.table.copy()}
        """A table by its name, of all rows, (1, ...), or a part for each, (n, ...)."""
        point_rows(self.runs, **self.stacks)
        self.time, self.done = np.zeros(n), np.zeros(n, np.int64)
        self.qpos, self.qvel = np.zeros((n, model.nq)), np.zeros((n, model.nv))
        self._pushed = np.zeros((n if self._free else 0, model.nbody, 6))
        self.features = np.zeros((n, len(arrays.hulls), FEATURES))
        self.masses = np.ones(n)
        """Factors of the boats' masses."""
        self._models: dict[int, tuple[mujoco.MjModel, mujoco.MjModel]] = {}
        self._own: dict[int, dict[str, Table]] = {}
        for name in (*SEPARATE, "current", "wind", "gust_bands", "air"):
            self.separate(name)
        if self._free:
            self.start_free(np.arange(n))
        else:
            for row in range(n):
                self.give_data(row)

    def give_data(self, row: int) -> None:
        """Give a row data of MuJoCo's, in the state in which the row is."""
        model, contact_free = self._models.get(row, (self.arrays.model, self.arrays.contact_free))
        data, run = mujoco.MjData(model), self.runs[row : row + 1]
        self._write(row, data)
        point_models(run, model, contact_free, data)
        point(run, **mujoco_arrays(data))
        self._data[row] = data

    def _write(self, row: int, data: mujoco.MjData) -> None:
        data.qpos[:], data.qvel[:], data.time = self.qpos[row], self.qvel[row], self.time[row]

    def start_free(self, which: IntArray) -> None:
        """Continue rows of free bodies without data of MuJoCo's."""
        for row in which.tolist():
            self._data.pop(row, None)
        self.runs["data"][which] = 0
        stacks = self.free_stacks()
        for name in mujoco_arrays(self.arrays.data):
            stack = stacks[name]
            step = stack.strides[0] if len(stack) > 1 else 0
            self.runs[name][which, 0] = stack.ctypes.data + which * step

    def free_stacks(self) -> dict[str, Table]:
        """The stacks of rows of free bodies: MuJoCo's part of a row without data, too."""
        return self.stacks | {"qpos": self.qpos, "qvel": self.qvel, "xfrc_applied": self._pushed}

    def own_tables(self) -> list[tuple[str, Table]]:
        """Tables that a row has outside of the stacks, with their names."""
        return [item for tables in self._own.values() for item in tables.items()]

    def separate(self, name: str) -> Table:
        """The stack of a table in which every row has its own part."""
        stack = self.stacks[name]
        if not len(stack) == self.n > 1:
            stack = self.stacks[name] = np.repeat(stack, self.n, axis=0)
            point_rows(self.runs, **{name: stack})
        return stack

    def part(self, name: str, row: int) -> Table:
        """The table of a row; waves with all that is the row's own."""
        stack = self.seas.waves(np.array([row])) if name == "waves" else self.stacks[name]
        part: Table = self._own.get(row, {}).get(name, stack[row if len(stack) > 1 else 0])
        return part

    def take_seas(self, which: IntArray) -> None:
        """Give rows the seas that `seas` has for them now."""
        seas, known = self.seas, self.stacks["own_waves"]
        if seas.shared:
            if known is not seas.own:
                self.stacks["own_waves"] = seas.own
                point_rows(self.runs, own_waves=seas.own)
            return
        if known.size:
            self.stacks["own_waves"] = np.zeros((1, 0))
            point_rows(self.runs, own_waves=self.stacks["own_waves"])
        stack = self.stacks["waves"]
        if len(stack) < self.n:
            stack, which = self.separate("waves"), np.arange(self.n)
        for rows in np.array_split(which, 1 + len(which) // _CHUNK):
            stack[rows] = seas.waves(rows)

    def set_parameters(self, row: int, arrays: LoopArrays) -> None:
        """Give a row the numbers of other arrays of its world, `LoopArrays.with_parameters`, but for its waves."""
        for name, array in ARRAYS.items():
            table: Any = vars(arrays).get(name)
            if array.use != PARAMETER or table is vars(self.arrays).get(name) or name in {"waves", "own_waves"}:
                continue
            if name in _KEPT:
                part = self.separate(name)[row]
                kept = {column: part[column].copy() for column in _KEPT[name]}
                part[:] = table
                for column, values in kept.items():
                    part[column] = values
            else:
                usual = self.stacks[name][0]
                same = table.shape == usual.shape and table.tobytes() == usual.tobytes()
                own = self._own.setdefault(row, {})[name] = usual if same else table
                point(self.runs[row : row + 1], **{name: own})
        self._set_bodies(row)

    def _set_bodies(self, row: int) -> None:
        """Give a row the free bodies of its model and tables."""
        if self._free:
            model = self._models.get(row, (self.arrays.model,))[0]
            parts = self.part("hulls", row), self.part("vessels", row)
            self.separate("free_bodies")[row] = free_bodies(self.arrays, model, *parts)

    def weigh(self, which: IntArray, factors: FloatArray) -> None:
        """Give rows models of their own with all boats' masses and inertias times a factor."""
        arrays, hulls = self.arrays, self.separate("hulls")
        self.masses[which] = factors
        boats = arrays.hulls["body"].tolist()
        for row, factor in zip(which.tolist(), factors.tolist(), strict=True):
            with allocating(self.n, arrays.data):
                stepping, contact_free = (
                    _with_scaled_mass(model, boats, factor) for model in (arrays.model, arrays.contact_free)
                )
            self._models[row] = stepping, contact_free
            if row in self._data:
                point_models(self.runs[row], stepping, contact_free, self._data[row])
            hulls["mass"][row] = arrays.hulls["mass"] * factor
            self._set_bodies(row)

    def start_floating(self, which: IntArray, start: Callable[[Callable[[float, float], float]], None]) -> None:
        """Start something in rows where it is: by `start`, which does so in `arrays`, given the height of the sea."""
        own, data = {table: getattr(self.arrays, table) for table in _AFLOAT}, self.arrays.data
        kept = {table: array.copy() for table, array in own.items()}
        for row in which.tolist():
            sea, waves, time = self.part("sea", row)[0], self.part("waves", row), float(self.time[row])
            for table, array in own.items():
                array[:] = self.stacks[table][row]
            self._write(row, data)
            mujoco.mj_kinematics(self.arrays.model, data)
            start(lambda x, y: surface_height(waves, sea, x, y, time))  # noqa: B023 - called here
            for table, array in own.items():
                self.stacks[table][row] = array
        for table, array in own.items():
            array[:] = kept[table]

    def reset(self, which: IntArray) -> None:
        """Bring MuJoCo's part of some rows back to the start."""
        self.time[which], self.done[which] = 0.0, 0
        if self._free:
            self.start_free(which)
            self.qpos[which], self.qvel[which] = self.arrays.model.qpos0, 0.0
        else:
            reset_rows(which, self.runs, self.qpos, self.qvel)

    def integration_state(self, row: int) -> FloatArray:
        """MuJoCo's state of a row."""
        if row not in self._data:
            self._write(row, self.arrays.data)
        return integration_state(self._model(row), self._data.get(row, self.arrays.data))

    def snapshot(self) -> tuple[Any, ...]:
        """Everything that `restore` takes, for a copy."""
        flats = {row: self.integration_state(row) for row in self._data}
        stacks = {name: self.stacks[name] for name in _STACKED}
        return self.masses, flats, stacks, self.seas, self.time, self.done, self.qpos, self.qvel

    def restore(
        self, masses: FloatArray, flats: Mapping[int, FloatArray], stacks: Mapping[str, Table], seas: RowSeas,
        *moving: Any,
    ) -> None:  # fmt: skip
        """Go on as the rows do of which this is the `snapshot`."""
        heavy = np.flatnonzero(masses != 1.0)
        self.weigh(heavy, masses[heavy])
        self.time, self.done, self.qpos, self.qvel = moving
        self.seas = seas
        self.stacks.update(stacks)
        point_rows(self.runs, **stacks)
        if self._free:
            self.start_free(np.arange(self.n))
        for row, flat in flats.items():
            if row not in self._data:
                self.give_data(row)
            set_integration_state(self._model(row), self._data[row], flat)

    def _model(self, row: int) -> mujoco.MjModel:
        return self._models.get(row, (self.arrays.model,))[0]


class Equilibrium:
    """Boats of the rows of a batch at rest in the water: with engines, without wind and thrust."""

    def __init__(self, rows: RowTables) -> None:
        """Take the boats' weights and centres of mass from the world's model."""
        arrays = rows.arrays
        model, data = arrays.model, mujoco.MjData(arrays.model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        bodies = arrays.hulls["body"].astype(np.int64)
        self._rows, gravity = rows, -float(model.opt.gravity[2])
        self._weights: FloatArray = model.body_subtreemass[bodies] * gravity
        turned = data.xmat[bodies].reshape(-1, 3, 3).transpose(0, 2, 1)
        away = data.subtree_com[bodies] - data.xpos[bodies]
        self._centers = np.ascontiguousarray((turned @ away[:, :, None])[..., 0])

    def largest_masses(self) -> FloatArray:
        """Factors of mass (boats,) up to which boats float at rest on a calm; beyond, an end goes under.

        Found by halving, below the factor with which all that can be under water just carries the weight.
        """
        found, arrays = np.zeros(len(self._weights)), self._rows.arrays
        part, calm = partial(getattr, arrays), arrays.waves[:0]
        for boat, hull in enumerate(arrays.hulls):
            least, most = 0.0, greatest_lift(hull, arrays.stations) / self._weights[boat]
            if hull["vessel"] >= 0:
                most = 1.0
                while most < MOST_LIFT and self._settles(boat, part, calm, most, np.zeros(6), 0.0):
                    most *= 2.0
            for _ in range(_MASS_HALVINGS):
                middle = 0.5 * (least + most)
                floats = self._settles(boat, part, calm, middle, np.zeros(6), 0.0)
                least, most = (middle, most) if floats else (least, middle)
            found[boat] = least
        return found

    def _settles(
        self, boat: int, part: Callable[[str], Any], waves: Table, mass: float, pose: FloatArray, time: float
    ) -> bool:
        """Whether a boat with a factor of its mass floats on waves; its height, roll and pitch go into `pose`, (6,).

        `part` returns a table by its name.
        """
        hull = part("hulls")[boat]
        meshes = HullMeshes(*map(part, HullMeshes._fields)) if hull["vessel"] >= 0 else None
        water = part("stations"), part("vessels"), meshes, waves, part("sea")[0]
        floats = settle(hull, *water, mass * self._weights[boat], self._centers[boat], pose, time)
        return bool(floats and np.abs(pose[3:5]).max() <= _MAX_TILT)

    def pose(self, row: int, boat: int, place: tuple[float, float, float]) -> tuple[FloatArray, FloatArray]:
        """Pose and velocity, (6,) each, with which a boat of a row goes up and down with the water now.

        `place` is x, y [m] and yaw [rad].
        """
        rows, time = self._rows, float(self._rows.time[row])
        part, mass = partial(rows.part, row=row), float(rows.masses[row])
        waves, sea = part("waves"), part("sea")

        def settles(waves: Table, pose: FloatArray, time: float) -> bool:
            return self._settles(boat, part, waves, mass, pose, time)

        x, y, yaw = place
        level, height = sea["level"][0], surface_height(waves, sea[0], x, y, time)
        calm, velocity = np.array([x, y, level, 0.0, 0.0, yaw]), np.zeros(6)
        if not settles(waves[:0], calm, time):
            return np.array([x, y, height, 0.0, 0.0, yaw]), velocity
        calm[2] += height - level  # the water's surface is higher here, and leans a little
        now = calm.copy()
        if not settles(waves, now, time):
            return calm, velocity
        later = now.copy()
        if settles(waves, later, time + _DT):
            velocity[2:5] = (later[2:5] - now[2:5]) / _DT  # tilted by a few degrees, body and world axes are alike
        return now, velocity


class Variation:
    """Parameters of a batch's rows that differ from their world's."""

    def __init__(self, world: World, rows: RowTables) -> None:
        """Start with all rows as the world is."""
        self._world, self._rows = world, rows
        wind = rows.arrays.wind[0]
        self._usual = dict.fromkeys(ARGUMENTS, 1.0) | {
            "wind_speed": float(wind["mean"]), "gusts": float(wind["gain"]), "wave_phases": 0.0,
            "wind_direction": float(np.arctan2(*wind["direction"][::-1])),
            "wave_direction": rows.seas.course,
        }  # fmt: skip
        self._values: dict[str, FloatArray] = {}
        """Arguments that were given, of each row; of phases, the largest."""
        self._own: defaultdict[int, dict[str, float]] = defaultdict(dict)
        """Numbers by name, of the rows that have any."""

    @cached_property
    def _numbers(self) -> dict[str, Number]:
        """Numbers that only the loop's tables have: what MuJoCo's model has too, as masses, rows share."""
        return run_numbers(self._world.numbers)

    def change(
        self,
        which: IntArray,
        given: dict[str, FloatArray],
        phases: Values,
        numbers: Mapping[str, npt.ArrayLike],
    ) -> None:
        """Change rows: `given` are values by argument and `numbers` by name; errors are those of `Batch.vary`."""
        check_kind("parameters", numbers, Mapping, "a mapping of arrays, as {'wamv.hull.drag_linear.surge': [40, 60]}")
        each = {name: row_values(name, value, len(which), -np.inf, np.inf) for name, value in numbers.items()}
        own = [{name: float(values[k]) for name, values in each.items()} for k in range(len(which) if each else 0)]
        worlds = [
            with_numbers(self._world.parameters, self._own.get(row, {}) | more, self._numbers)
            for row, more in zip(which.tolist(), own, strict=False)
        ]
        given = {_NUMBER_ARGUMENTS[name]: each[name] for name in _NUMBER_ARGUMENTS if name in each} | given
        self._warn_of_no_effect(given)
        for row, more, parameters in zip(which.tolist(), own, worlds, strict=False):
            self._own[row] |= {name: value for name, value in more.items() if name not in _NUMBER_ARGUMENTS}
            self._set_tables(row, parameters)
        for name, values in given.items():
            self._values_of(name)[which] = values
        if phases is not None or any(name.startswith("wave") for name in given):
            seas = self._rows.seas
            seas.change(which, given, phases)
            drawn = np.abs(seas.own[which, 1 : 1 + seas.table.shape[1]])
            self._values_of("wave_phases")[which] = drawn.max(axis=1, initial=0.0)
            self._rows.take_seas(which)
        wind = self._rows.stacks["wind"]
        for name in given.keys() & {"wind_speed", "gusts"}:
            wind[ARGUMENTS[name][1]][which, 0] = given[name]
        if "wind_direction" in given:
            toward = given["wind_direction"]
            wind["direction"][which, 0] = np.stack((np.cos(toward), np.sin(toward)), axis=1)
        if "thrust" in given:
            self._rows.separate("thrusters")["gain"][which] = given["thrust"][:, None]
        if "mass" in given:
            self._rows.weigh(which, given["mass"])

    def _values_of(self, name: str) -> FloatArray:
        return self._values.setdefault(name, np.full(self._rows.n, self._usual[name]))

    def draw_phases(self, which: IntArray, seeds: IntArray) -> None:
        """Draw the phases of rows' waves from their seeds, where the sea is random and none were given."""
        if self._rows.seas.drawn.any():
            self._rows.seas.draw(which, seeds)
            self._rows.take_seas(which)

    def snapshot(self) -> tuple[Any, ...]:
        """Everything that `restore` takes, for a copy."""
        return self._values, self._own

    def restore(self, values: dict[str, FloatArray], own: defaultdict[int, dict[str, float]]) -> None:
        """Go on as the variation does of which this is the `snapshot`."""
        self._values, self._own = values, own
        for row, numbers in own.items():
            self._set_tables(row, with_numbers(self._world.parameters, numbers, self._numbers))

    def _set_tables(self, row: int, parameters: Parameters) -> None:
        """Give a row the tables of its world with other numbers."""
        arrays = self._rows.arrays.with_parameters(parameters, self._world.seed)
        self._rows.set_parameters(row, arrays)
        if any(name.startswith(("sea.waves.", "sea.significant_height")) for name in self._own[row]):
            self._rows.seas.set_waves(row, wave_table(parameters.sea))
            self._rows.take_seas(np.array([row]))

    def differences(self, row: int) -> dict[str, tuple[float, float]]:
        """Values of a row and of the world, of each parameter in which they differ."""
        found = {}
        for name, (table, column, _) in ARGUMENTS.items():
            own, common = self._rows.part(table, row)[column], getattr(self._rows.arrays, table)[column]
            usual = self._usual[name]
            value = float(self._values[name][row]) if name in self._values else usual
            if name == "wave_phases" and self._rows.seas.drawn[row]:
                continue
            alone = table != "waves" or column == "phase"  # another argument or a number changes the others' columns
            if own.tobytes() != common.tobytes() and (alone or value != usual):
                found[name] = value, usual
        for name, value in sorted(self._own.get(row, {}).items()):
            if value != self._numbers[name].value:
                found[name] = value, self._numbers[name].value
        return found

    def _warn_of_no_effect(self, given: Mapping[str, FloatArray]) -> None:
        """Warn of parameters that change nothing: wind where it pushes nothing, waves where the sea has none."""
        arrays, name = self._rows.arrays, self._world.name
        pushed = any(table["wind"].any() for table in (arrays.hulls, arrays.floats, arrays.blocks))
        pushed |= len(arrays.windage) > 0 or len(arrays.sail_curves) > 0
        if not pushed and (idle := [key for key in ("wind_speed", "gusts") if key in given and given[key].any()]):
            text = f"no effect of {' and '.join(idle)}: the wind pushes nothing in world {name}"
            warn(f"{text}; give it `wind` with `objects`, or its robot `wind`", 5)
        if not arrays.waves["amplitude"].any() and "waves" in given and given["waves"].any():
            warn(f"no effect of waves: the sea of world {name} has none", 5)
