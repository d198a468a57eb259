"""The tables of the compiled loop for one world: parameters, state, and views of MuJoCo's arrays."""

import copy
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.sensors import BallShooterConfig
from vrx_mj.errors import CompileError, StateError
from vrx_mj.mjcf.world import World
from vrx_mj.model import tables
from vrx_mj.model.boats import Hull, Propeller, Station, Thruster, Vessel, Windage
from vrx_mj.model.tables import flat, hull_tables, starts
from vrx_mj.model.things import Block, Float
from vrx_mj.model.world import Parameters
from vrx_mj.physics.free_body import FREE_BODY, SOLVE_WORK
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.physics.noise import stream_key
from vrx_mj.physics.raft import RAFT_WORK
from vrx_mj.physics.tables import MARINE, VRX3, Record, Table
from vrx_mj.physics.waves import random_phases
from vrx_mj.physics.wind import Areas, WindageRow, blendermann_curve, three_number_curve, windage_rows
from vrx_mj.runtime.loop import MAX_STATE
from vrx_mj.runtime.mounted import Mounted, mounted_sensors, start_marks
from vrx_mj.runtime.proximity import BROADPHASE, is_unconstrained, movers, obstacles
from vrx_mj.runtime.timing import SampleClocks
from vrx_mj.runtime.views import ARRAYS, RUN, STATE, point
from vrx_mj.sensors.displays import check_display_marks, display_marks, displays_of
from vrx_mj.sensors.sea import sea_table, wave_table

OPTIONS = ("timestep", "gravity", "wind", "density", "viscosity", "integrator", "solver", "iterations", "tolerance",
           "disableflags", "enableflags")  # fmt: skip
"""Options of the model that a user may change between runs."""
MODEL_ARRAYS = (
    "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_subtreemass", "body_inertia",
    "body_invweight0", "jnt_pos", "jnt_axis", "jnt_range", "jnt_stiffness", "dof_armature", "dof_damping",
    "dof_frictionloss", "dof_invweight0", "dof_M0", "eq_data", "eq_solref", "eq_solimp", "qpos0",
)  # fmt: skip
"""Arrays of the model that a user may change between runs."""

_T = TypeVar("_T")
_NO_JOINT, _NO_ROW = -1, -1
"""Rows of a part without a joint, and without a row."""
_SWITCHES = ("held", "fresh")
"""Columns of the tables of state that are 0 or 1."""
_LOCK = "lock"
"""First word of the name of the equality constraint that holds a boat; the boat's name follows."""
STATE_TABLES = tuple(name for name, array in ARRAYS.items() if array.use == STATE)
"""Names of the tables that change from step to step, in the order of a state's bytes."""
_CUT = "; it is damaged, or another version of vrx_mj made it: make it again"
"""Advice on a state that has more or less than its world's states."""
_NEVER = -1.0
"""Time of a touch that did not happen [s]."""


def is_valid_column(name: str, values: npt.NDArray[Any], waypoints: IntArray) -> bool:
    """Whether a column of a table of state can be so; `waypoints` (n,) are how many each follower has."""
    if name == "target":
        return bool(((values >= 0) & (values < np.maximum(waypoints, 1))).all())
    if name in _SWITCHES:
        return bool(np.isin(values, (0, 1)).all())
    if values.dtype.kind != "f":
        return True
    return not np.isnan(values).any() if name == "expires" else bool(np.isfinite(values).all())


def mujoco_arrays(data: mujoco.MjData) -> dict[str, FloatArray]:
    """The arrays of MuJoCo's data that the loop reads and writes."""
    names = ("qpos", "qvel", "xfrc_applied", "qfrc_applied", "qfrc_constraint", "qacc_smooth", "sensordata", "xpos",
             "xmat", "subtree_com", "cdof")  # fmt: skip
    return {**{name: getattr(data, name) for name in names}, "inertia": data.M}


def _windage(own: Windage) -> list[WindageRow]:
    """Coefficients of the wind on a hull, by its angle."""
    areas = Areas(own.frontal_area, own.lateral_area, own.length, own.height)
    if own.vessel:
        return windage_rows(blendermann_curve(own.vessel, areas), areas)
    if own.coefficients:
        return windage_rows(three_number_curve(*own.coefficients), areas)
    return windage_rows([(angle, cx, cy, 1.0, cn) for angle, cx, cy, cn in own.curve], areas)


def _kinds(owned: Iterable[_T | None]) -> list[_T]:
    """Values of rows, each once: equal ones share it."""
    return list(dict.fromkeys(own for own in owned if own is not None))


def _even_quadrants(own: Propeller) -> list[tuple[float, ...]]:
    """C_T* and C_Q* of a propeller at every half degree all around."""
    angles, *columns = zip(*own.four_quadrant, strict=True) if own.four_quadrant else ((),)
    even = np.linspace(-180.0, 180.0, 721)
    return list(zip(*(np.interp(even, angles, column).tolist() for column in columns), strict=True))


def _second_moments(stations: Sequence[Station], hull: Hull) -> tuple[float, float]:
    """Second moments over the area, along and across [m2], of stations as rectangles of their floats' beam."""
    own = stations[hull.station_start : hull.station_start + hull.station_count]
    sides = np.array([(row.length, 2.0 * row.radius) for row in own]).reshape(-1, 2)
    areas = sides.prod(axis=1)
    if not areas.sum() > 0.0:
        return 0.0, 0.0
    places = np.array([row.position[:2] for row in own])
    places = places - np.average(places, axis=0, weights=areas)
    along, across = np.average(places**2 + sides**2 / 12.0, axis=0, weights=areas).tolist()
    return along, across


def memories_of(hulls: Sequence[Hull]) -> list[int]:
    """How many rows of `tables.MEMORY_STATE` each hull has."""
    return [len(hull.vessel.memory) if hull.vessel else 0 for hull in hulls]


class Run:
    """A table of one run, and the arrays to which it leads."""

    def __init__(self, model: mujoco.MjModel, contact_free: mujoco.MjModel, data: mujoco.MjData) -> None:
        self.table = np.zeros(1, RUN)
        self.models = model, contact_free, data
        self._arrays: dict[str, npt.NDArray[np.generic]] = {}
        point_models(self.table, model, contact_free, data)

    def lead_to(self, arrays: dict[str, npt.NDArray[np.generic]]) -> "Run":
        """Lead to these arrays, by name; the run itself."""
        point(self.table, **{name: array for name, array in arrays.items() if array is not self._arrays.get(name)})
        self._arrays = arrays
        return self


def point_models(run: Table, model: mujoco.MjModel, contact_free: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Write where MuJoCo's objects are into a row of `RUN`, or into a table of one."""
    run["model"], run["contact_free"], run["data"] = model._address, contact_free._address, data._address


class LoopArrays:
    """The arrays of one run of the compiled loop: tables of a world, state, and views of MuJoCo's arrays.

    The views belong to one model and data: new ones need new arrays.
    """

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Table: ...

    def __init__(
        self,
        world: World,
        model: mujoco.MjModel,
        contact_free: mujoco.MjModel,
        data: mujoco.MjData,
        *,
        known: "LoopArrays | None" = None,
    ) -> None:
        """Tables of a world; `known` are those of one that differs by what came or went."""
        parameters = world.parameters
        self.model, self.data, self.contact_free = model, data, contact_free
        self.timestep = float(model.opt.timestep)
        self._numbers(parameters, world.seed)
        self.floats = tables.table_of(tables.FLOAT, parameters.floats, **self._free_joints(parameters.floats))
        self.links = tables.table_of(tables.FLOAT, parameters.links, **self._links(parameters.links))
        self.waypoints = tables.table_of(tables.WAYPOINT, parameters.path_points)
        self._take(parameters, ("followers", "elements"))
        self.blocks = tables.table_of(tables.BLOCK, parameters.blocks, **self._whole_bodies(parameters.blocks))
        self.memory_state = np.zeros(sum(memories_of(parameters.hulls)), tables.MEMORY_STATE)
        self.drift_state = np.zeros(np.count_nonzero(self.hulls["drift_state"] >= 0), tables.DRIFT_STATE)
        self.raft_work = np.zeros(len(self.blocks), RAFT_WORK)
        self.free_bodies, self.solve_work = np.zeros(0, FREE_BODY), np.zeros(0, SOLVE_WORK)
        for name, array in ARRAYS.items():
            if array.rows:
                setattr(self, name, np.zeros(len(getattr(self, array.rows)), array.dtype))
        self.movers = movers(model)
        self.broadphase = np.array([(0.0, 0, is_unconstrained(contact_free), 0)], BROADPHASE)
        static = [item.name for item in parameters.objects if item.kind == "static"]
        self.fixed = (*static, *(dock.name for dock in parameters.docks if not dock.dynamic))
        """Names of the objects and docks that never move."""
        self.obstacles: Table = known.obstacles if known and known.fixed == self.fixed else obstacles(model)
        self.touches = np.empty(len(parameters.task.rivals) if parameters.task else 0)
        self._mount(world, known)

    def with_parameters(self, parameters: Parameters, seed: int) -> "LoopArrays":
        """Arrays of the same world with other numbers, `model.numbers`; all other arrays are the same objects."""
        own = copy.copy(self)
        own._numbers(parameters, seed)
        return own

    def _numbers(self, parameters: Parameters, seed: int) -> None:
        """Tables of what has numbers: weather, boats, moorings and ropes."""
        self._weather(parameters, seed)
        self._hulls(parameters.hulls, parameters.stations)
        self._thrusters(parameters.thrusters)
        self._take(parameters, ("stations", "moorings", "ropes"))

    def _take(self, parameters: Parameters, names: Sequence[str]) -> None:
        """Tables whose rows are those of the world's parameters."""
        for name in names:
            setattr(self, name, tables.table_of(ARRAYS[name].dtype, getattr(parameters, name)))

    def _weather(self, parameters: Parameters, seed: int) -> None:
        """Tables of sea, current and wind."""
        sea, current = parameters.sea, parameters.current
        self.waves, self.sea, self.own_waves = wave_table(sea, seed), sea_table(sea), np.zeros(0)
        self.random_sea = sea if sea.random else None
        self.wind_seed, self.current_seed = parameters.wind.seed, current.seed if current else 0
        currents, airs = [current] if current else [], [parameters.air] if parameters.air else []
        self.current = tables.table_of(tables.CURRENT, currents, key=[0])
        self.layers = tables.table_of(tables.LAYER, current.layers if current else ())
        self.wind = tables.table_of(tables.WIND, [parameters.wind], key=[0])
        self.gust_bands = np.zeros(sum(len(air.gust_frequencies) for air in airs), tables.GUST_BAND)
        for air in airs:
            self.gust_bands["frequency"] = air.gust_frequencies
        self.air = tables.table_of(tables.AIR, airs, key=[0])

    def _hulls(self, hulls: Sequence[Hull], stations: Sequence[Station]) -> None:
        """Tables of hulls, and of their coefficients in the wind and models, which hulls of a kind share."""
        shown = _kinds(hull.windage for hull in hulls)
        curves = [_windage(own) for own in shown]
        found = dict(zip(shown, zip(starts(curves), map(len, curves), strict=False), strict=True))
        kinds = _kinds(hull.vessel for hull in hulls)
        *remembered, _ = itertools.accumulate(memories_of(hulls), initial=0)
        drifts = itertools.count()
        windage = [found[hull.windage] if hull.windage else (0, 0) for hull in hulls]
        self.hulls = tables.table_of(
            tables.HULL,
            hulls,
            **self._whole_bodies(hulls),
            windage_start=[start for start, _ in windage],
            windage_count=[count for _, count in windage],
            windage_height=[hull.windage.height if hull.windage else 0.0 for hull in hulls],
            windage_offset=[hull.windage.offset if hull.windage else 0.0 for hull in hulls],
            spread=[hull.vessel.spread if hull.vessel else _second_moments(stations, hull) for hull in hulls],
            vessel=[kinds.index(hull.vessel) if hull.vessel else _NO_ROW for hull in hulls],
            memory_start=remembered,
            drift_state=[next(drifts) if hull.vessel and hull.vessel.drift else _NO_ROW for hull in hulls],
        )
        self.windage = tables.table_of(tables.WINDAGE, flat(curves))
        self._vessels(kinds)

    def _thrusters(self, thrusters: Sequence[Thruster]) -> None:
        """Tables of thrusters, and of measured propellers and sails, whose curves those of a kind share."""
        measured = [own.measured for own in thrusters if own.measured]
        kinds, sails = _kinds(measured), _kinds(own.sail for own in thrusters)
        points = dict(zip(kinds, starts(own.thrust for own in kinds), strict=False))
        curves = dict(zip(sails, starts(own.curve for own in sails), strict=False))
        turned = {own: _even_quadrants(own) for own in kinds}
        quadrants = dict(zip(kinds, starts(turned.values()), strict=False))
        numbers = itertools.count()
        self.thrusters = tables.table_of(
            tables.THRUSTER,
            thrusters,
            **self._engines(thrusters),
            gain=np.ones(len(thrusters)),
            measured=[next(numbers) if own.measured else _NO_ROW for own in thrusters],
            curve_start=[curves[own.sail] if own.sail else 0 for own in thrusters],
            curve_count=[len(own.sail.curve) if own.sail else 0 for own in thrusters],
            sheeted=[bool(own.sail and own.sail.sheet) for own in thrusters],
        )
        self.sail_curves = np.array(flat(own.curve for own in sails), tables.SAIL_CURVE)
        self.propellers = tables.table_of(
            tables.PROPELLER,
            measured,
            vanishing_speed=[math.inf if own.vanishing_speed is None else own.vanishing_speed for own in measured],
            point_start=[points[own] for own in measured],
            point_count=[len(own.thrust) for own in measured],
            quadrant_start=[quadrants[own] for own in measured],
            quadrant_count=[len(turned[own]) for own in measured],
        )
        self.quadrants = np.array(flat(turned.values()), tables.QUADRANT)
        self.propeller_points = np.array(flat(own.thrust for own in kinds), tables.PROPELLER_POINT)

    def _vessels(self, kinds: Sequence[Vessel]) -> None:
        """Tables of the models of hulls in profile `marine`."""
        found = hull_tables(kinds)
        self.vessels, self.strips, self.memory, self.resistances, self.diffraction, self.drift, self.meshes = found
        self.parts, self.points, self.shares, self.pairs, self.corner_shares = self.meshes

    def _mount(self, world: World, known: "LoopArrays | None") -> None:
        """Sensors, lights and placards, and what the sensors' clocks keep."""
        self.sensors: tuple[Mounted, ...] = mounted_sensors(world, self.model, known.sensors if known else ())
        self.displays = displays_of(world.parameters)
        self.sample_clocks = SampleClocks(
            self.model.nq, self.model.nv, [*start_marks(self.sensors), *display_marks(self.displays)]
        )

    @property
    def state_tables(self) -> Sequence[Table]:
        """The tables that change from step to step."""
        return [getattr(self, name) for name in STATE_TABLES]

    @property
    def vrx_only(self) -> bool:
        """Whether the world has nothing that VRX's have not: no profile `marine`, no links on joints."""
        marine = self.sea["moving"].any() or (self.hulls["profile"] == MARINE).any()
        return not (marine or len(self.links) or len(self.ropes))

    @property
    def loop(self) -> int:
        """Which of `LOOPS` advances the world: any, VRX's, or VRX's in more waves than one takes at a time."""
        return 1 + (len(self.waves) > WIDTH) if self.vrx_only else 0

    def reset(self, seed: int) -> None:
        """Bring the state tables to their start and draw the run's noise streams from `seed`."""
        for table in self.state_tables:
            table[:] = np.zeros(1, table.dtype)
        self.touches[:] = _NEVER
        self.broadphase["clearance"], self.broadphase["wait"] = 0.0, 0
        self.key(seed)
        self.wind_state["speed"] = self.wind["mean"]
        self.thruster_state["expires"] = -np.inf
        for sensor in self.sensors:
            if sensor.ball is not None:
                self.float_state["held"][sensor.ball] = 1
        self.sample_clocks.reset()

    @property
    def display_marks(self) -> FloatArray:
        """Marks of what lights and placards show now."""
        return self.display_part(self.sample_clocks.device_state)

    def display_part(self, device_state: FloatArray) -> FloatArray:
        """The part of a device state that is lights and placards: a view of the last numbers."""
        return device_state[len(device_state) - sum(len(display.start) for display in self.displays) :]

    @property
    def columns(self) -> int:
        """How many numbers a row has."""
        moving = len(self.data.qpos) + len(self.data.qvel)
        return 2 + 2 * len(self.thrusters) + moving + len(self.display_marks) + len(self.air_state)

    def contact_load(self, number: int) -> tuple[FloatArray, FloatArray]:
        """Force [N] and torque [N m] of a contact in the last step on its second geom, (3,) each, world axes."""
        local, contact = np.zeros(6), self.data.contact[number]
        mujoco.mj_contactForce(self.model, self.data, number, local)
        axes = contact.frame.reshape(3, 3).T
        return axes @ local[:3], axes @ local[3:]

    def release(self, boat: str) -> None:
        """Release a boat that is held by a weld."""
        for index in range(self.model.neq):
            if self.model.equality(index).name == f"{_LOCK}/{boat}":
                self.data.eq_active[index] = 0

    def state_of_waves(self, row: int) -> Mapping[str, slice]:
        """Rows of a hull in tables of state of waves that it made and that push it: 0 for one that is put elsewhere."""
        hull = self.hulls[row]
        first, own = int(hull["memory_start"]), int(hull["drift_state"])
        memories = int(self.vessels[hull["vessel"]]["memory_count"]) if hull["vessel"] >= 0 else 0
        return {"memory_state": slice(first, first + memories), "drift_state": slice(max(own, 0), own + 1)}

    def start_floating(self, row: int, height: float) -> None:
        """Start the floating object of a row where it is now, with the surface at `height` [m] there."""
        item = self.floats[row]
        self.float_state[row] = (height, 0)
        if item["profile"] == VRX3:
            self._start_elements(item, height)

    def start_links_floating(self, body: int, height: Callable[[float, float], float]) -> None:
        """Start the links of the tree of a body where they are now, with the surface at `height(x, y)` [m]."""
        root = self.model.body_rootid[body]
        for row in np.flatnonzero(self.model.body_rootid[self.links["body"]] == root):
            x, y, _ = self.data.xpos[self.links[row]["body"]]
            self.link_state[row] = (height(x, y), 0)
            self._start_elements(self.links[row], height(x, y))

    def _start_elements(self, item: Record, height: float) -> None:
        self.element_state[item["element_start"] :][: item["element_count"]] = (height, 0.0)

    def tree_rows(self, qpos: int) -> range:
        """Rows of the blocks of the floating dock whose free joint is at `qpos`."""
        roots = [*np.flatnonzero(self.blocks["parent"] < 0), len(self.blocks)]
        first = next(index for index, row in enumerate(roots[:-1]) if self.blocks["qpos"][row] == qpos)
        return range(roots[first], roots[first + 1])

    def refresh(self) -> None:
        """Carry what was changed in the model over to its twin without shapes."""
        for name in OPTIONS:
            setattr(self.contact_free.opt, name, getattr(self.model.opt, name))
        for name in MODEL_ARRAYS:
            getattr(self.contact_free, name)[:] = getattr(self.model, name)
        self.broadphase["unconstrained"] = is_unconstrained(self.contact_free)

    def key(self, seed: int) -> None:
        """Set the keys of the noise streams, of which the wind's own seed is a part, and the phases of a random sea."""
        for (table, column), drawn in self.streams(seed).items():
            getattr(self, table)[column] = drawn
        if self.random_sea:
            self.waves[:] = wave_table(self.random_sea, seed)

    def streams(self, seed: int) -> Mapping[tuple[str, str], int | FloatArray]:
        """Keys and phases of the noise in the run of a seed, by table and column."""
        wind = str(self.wind_seed)
        found: dict[tuple[str, str], int | FloatArray] = {("wind", "key"): stream_key(seed, "wind", wind)}
        if len(self.current):
            found["current", "key"] = stream_key(seed, "current", str(self.current_seed))
        if len(self.air):
            found["air", "key"] = stream_key(seed, "wind direction", wind)
            found["gust_bands", "phase"] = random_phases(seed, len(self.gust_bands), "gusts", wind)
        return found

    def pack(self) -> bytes:
        """The state tables and what the sensors' clocks latched, as bytes."""
        return b"".join(table.tobytes() for table in self.state_tables) + self.sample_clocks.pack()

    @property
    def moving(self) -> int:
        """How many of the bytes that `pack` gives bear on the motion; the rest are what sensors saw of it."""
        return sum(table.nbytes for table in self.state_tables) + self.sample_clocks.device_state.nbytes

    def check(self, flat: FloatArray, block: bytes) -> None:
        """Check that MuJoCo can take the numbers of a state, and `unpack` its bytes: kernels trust them.

        Raises:
            StateError: they cannot.
        """
        needed = mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_INTEGRATION)
        if len(flat) != needed:
            raise StateError(f"the state has {len(flat)} numbers of MuJoCo instead of {needed}{_CUT}")
        moving = flat[1 : 1 + self.model.nq + self.model.nv]  # after the time
        if (np.abs(moving) >= MAX_STATE).any():
            raise StateError(f"the state has a position or velocity beyond {MAX_STATE:g}")
        size = sum(table.nbytes for table in self.state_tables)
        if len(block) < size:
            ends = itertools.accumulate(table.nbytes for table in self.state_tables)
            name = next(name for name, end in zip(STATE_TABLES, ends, strict=True) if end > len(block))
            raise StateError(
                f"the state has {len(block)} bytes of tables instead of {size}: it ends in or before {name}{_CUT}"
            )
        for table, (_, given) in zip(STATE_TABLES, self._tables_in(block), strict=True):
            for name in given.dtype.names or ():
                if not is_valid_column(name, given[name], self.followers["waypoint_count"]):
                    raise StateError(f"the state has an invalid {name} in {table}")
        if not all(np.isfinite(given).all() for _, given in self._tables_in(block) if not given.dtype.names):
            raise StateError("the state has a touch time that is not finite")
        self.sample_clocks.check(block[size:])
        self._check_moments(block[size:])

    def _tables_in(self, block: bytes) -> Iterator[tuple[Table, Table]]:
        """The state tables, and what the bytes of a state have for each."""
        offset = 0
        for table in self.state_tables:
            yield table, np.frombuffer(block, table.dtype, len(table), offset)
            offset += table.nbytes

    def _check_moments(self, block: bytes) -> None:
        """Check that what sensors latched is not huge, and that shots and marks of displays are in their range."""
        devices, _, latched = self.sample_clocks.parts(block)
        place = self.model.nq + self.model.nv
        if (np.abs(latched[..., :place]) >= MAX_STATE).any():
            raise StateError(f"the state has a sensor time beyond {MAX_STATE:g}")
        then = latched[..., place:].reshape(2 * len(latched), len(devices))  # a clock keeps two moments
        rows = np.concatenate((devices[None], then))
        for sensor in self.sensors:
            if isinstance(sensor.config, BallShooterConfig):
                shots = rows[:, sensor.mark]
                if not ((shots >= 0.0) & (shots <= sensor.config.shots) & (shots == np.floor(shots))).all():
                    raise StateError(f"the state has an invalid number of shots of {sensor.boat}'s {sensor.name}")
        check_display_marks(self.displays, rows[:, rows.shape[1] - sum(len(one.start) for one in self.displays) :])

    def unpack(self, block: bytes) -> None:
        """Write back what `pack` gave."""
        for table, values in self._tables_in(block):
            table[:] = values
        self.sample_clocks.unpack(block[sum(table.nbytes for table in self.state_tables) :])

    def row(self, time: float) -> FloatArray:
        """The row of this moment, at `time` [s], as `sample` makes them in the loop."""
        engines, now = self.thruster_state, [time, self.wind_state["speed"][0]]
        moving = self.data.qpos, self.data.qvel
        shown = self.display_marks, self.air_state["angle"]
        return np.concatenate((now, engines["thrust"], engines["angle"], *moving, *shown))

    def by_name(self, sampling: IntArray, samples: FloatArray) -> dict[str, npt.NDArray[Any]]:
        """All arrays of a run, with those that a recorder has filled."""
        clocks = self.sample_clocks
        found = {
            **mujoco_arrays(self.data), "inertia_row": self.model.M_rowadr,
            "dof_parent": self.model.dof_parentid, "body_root": self.model.body_rootid, "clocks": clocks.clocks,
            "latched": clocks.latched, "device_state": clocks.device_state, "sampling": sampling, "samples": samples,
        }  # fmt: skip
        return {name: found[name] if name in found else getattr(self, name) for name in ARRAYS}

    def run(self, sampling: IntArray, samples: FloatArray, last: Run | None = None) -> Run:
        """The run that `advance` takes: the last one, where it is of the same models."""
        models = self.model, self.contact_free, self.data
        own = last if last and last.models == models else Run(*models)
        return own.lead_to(self.by_name(sampling, samples))

    def _free_joints(self, rows: Sequence[Float | Hull | Block]) -> Mapping[str, IntArray]:
        """Ids of bodies by their names, and the addresses of their free joints."""
        body = np.array([self.model.body(row.body).id for row in rows], np.int64)
        joint = self.model.body_jntadr[body]
        return {"body": body, "qpos": self.model.jnt_qposadr[joint], "dof": self.model.jnt_dofadr[joint]}

    def _links(self, rows: Sequence[Float]) -> Mapping[str, IntArray]:
        """Ids of links, the addresses of their free joints, if they have one, and their last dofs."""
        own, model = self._free_joints(rows), self.model
        body = own["body"]
        free = model.jnt_type[model.body_jntadr[body]] == mujoco.mjtJoint.mjJNT_FREE
        last = model.body_dofadr[body] + model.body_dofnum[body] - 1
        return {"body": body, "qpos": np.where(free, own["qpos"], _NO_JOINT), "dof": last}

    def _whole_bodies(self, rows: Sequence[Hull | Block]) -> Mapping[str, IntArray]:
        """`_free_joints` of bodies of which MuJoCo keeps the whole inertia, as what is added to that needs.

        Raises:
            CompileError: the frame of one is the principal one, of which MuJoCo keeps the diagonal.
        """
        own = self._free_joints(rows)
        for k in np.flatnonzero(self.model.dof_simplenum[own["dof"]]).tolist():
            raise CompileError(
                f"body {rows[k].body}: invalid inertia: MuJoCo keeps only its diagonal; turn its `inertial` by a `quat`"
            )
        return own

    def _engines(self, rows: Sequence[Thruster]) -> Mapping[str, IntArray]:
        """Ids of the bodies of engines, and the addresses of their hinges; a fixed engine has none."""
        body = np.array([self.model.body(row.body).id for row in rows], np.int64)
        joint = np.array([self.model.joint(row.joint).id if row.joint else _NO_JOINT for row in rows], np.int64)
        addresses = {"qpos": self.model.jnt_qposadr, "dof": self.model.jnt_dofadr}
        return {"body": body} | {
            name: np.where(joint == _NO_JOINT, _NO_JOINT, of[joint]) for name, of in addresses.items()
        }
