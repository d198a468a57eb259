"""What a learning problem consists of, and what it sees of its boats: arrays of rows x boats.

A world with a referee is a batch of one row, run by a `Simulation`.
"""

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray, IntArray, read_only
from vrx_mj.errors import DivergedError
from vrx_mj.mjcf.world import World
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.commands import channels_of
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.sea import wave_table

_JOINING_HEIGHT = 0.1
"""Height of a boat's origin over the water where it joins [m]."""
MIN_CLEARANCE = 6.0
"""Distance between two boats' origins below which they are too near [m]; a WAM-V is 4.9 m long."""
MIN_LOSS = 20.0
"""Reward that a boat forfeits by sinking or capsizing, at least."""
Pair = tuple[FloatArray, FloatArray]
"""Two arrays of one shape: along x and y, or ahead and to port."""


class RefereedRow:
    """A row whose boats are scored. Names and meanings are those of `vrx_mj.Batch`; there is no row but 0."""

    n = 1

    def __init__(self, world: World) -> None:
        self.world, self.sim = world, Simulation(world)
        self.diverged: BoolArray = np.zeros(1, np.bool_)
        channels = channels_of(world)
        self.channels = tuple((channel.boat, channel.name) for channel in channels)
        self.largest = np.array([channel.limits for channel in channels])

    @property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats."""
        return self.sim.boats

    @property
    def features(self) -> FloatArray:
        """Position, quaternion, velocity and angular velocity of every boat, (1, boats, 13)."""
        seen = self.sim.observe()
        parts = (
            (seen[boat].position, seen[boat].quaternion, seen[boat].velocity, seen[boat].angular_velocity)
            for boat in self.boats
        )
        return np.array([[np.concatenate(part) for part in parts]])

    @property
    def wind(self) -> FloatArray:
        """The wind's velocity along x and y, (1, 2) [m/s]."""
        return np.asarray(self.sim.wind.velocity(self.sim.time))[None, :2]

    @property
    def time(self) -> FloatArray:
        """Simulated time, (1,) [s]."""
        return np.array([self.sim.time])

    @property
    def qpos(self) -> FloatArray:
        """Positions of MuJoCo's model, (1, nq), a read-only view."""
        return read_only(np.asarray(self.sim.data.qpos)[None])

    def waves(self, row: int) -> Table:
        """Waves of the world's sea, `tables.WAVE`."""
        return wave_table(self.world.parameters.sea, self.sim.seed)

    def sea_height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height [m] of the sea at points x, y, (1, points) [m], now."""
        return np.asarray(self.sim.sea.height(x, y, self.sim.time))

    def afloat(self, boat: str, places: FloatArray, rows: IntArray) -> Pair:
        """Poses and velocities, (rows, 6), of a boat at x, y and yaw, (rows, 3), as high as VRX spawns it."""
        x, y, yaw = places.T
        none, height = np.zeros_like(x), self.sim.sea.height(x, y, self.sim.time) + _JOINING_HEIGHT
        return np.stack((x, y, height, none, none, yaw), axis=1), np.zeros((len(x), 6))

    def reset(self, rows: IntArray, *, seed: list[int]) -> None:
        """Go back to the start."""
        if len(rows):
            self.diverged[:] = False
            self.sim.reset(seed[0])

    def step(self, values: FloatArray, *, duration: float, rows: IntArray) -> None:
        """Advance under commands (rows, channels)."""
        if not len(rows):
            return
        commands: dict[str, dict[str, float]] = {boat: {} for boat in self.boats}
        for (boat, name), value in zip(self.channels, values[0].tolist(), strict=True):
            commands[boat][name] = value
        try:
            self.sim.step(commands, duration=duration)
        except DivergedError:
            self.diverged[:] = True
            raise

    def set_boat(self, boat: str, *, pose: FloatArray, velocity: FloatArray, rows: IntArray) -> None:
        """Put a boat somewhere, moving."""
        if len(rows):
            self.sim.set_boat(boat, pose=pose[0].tolist(), velocity=velocity[0].tolist())


Rows = Batch | RefereedRow
"""Rows that an environment advances."""


class SeenRows(Protocol):
    """Arrays of rows that a step reads, under the names of `vrx_mj.Batch`."""

    @property
    def features(self) -> FloatArray:
        """Features of boats, (n, boats, 13)."""

    @property
    def wind(self) -> FloatArray:
        """Velocity of the wind, (n, 2) [m/s]."""

    @property
    def diverged(self) -> BoolArray:
        """Whether rows have diverged, (n,)."""


class RowArrays:
    """Something whose state is in arrays with a row for each world."""

    row_arrays: ClassVar[tuple[str, ...]] = ()
    """Their attributes' names."""

    def with_arrays(self, convert: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> Self:
        """A copy with what `convert` makes of these arrays."""
        made = copy.copy(self)
        for name in self.row_arrays:
            setattr(made, name, convert(getattr(self, name)))
        return made


Facts = dict[str, npt.NDArray[np.generic]]
"""Arrays by their names in `info`."""
Spot = tuple[float, float, float, float]
"""Where a boat starts: x, y [m], heading [rad], and surge velocity [m/s]."""


class Entry(NamedTuple):
    """A number that is observed."""

    name: str
    scale: float | None = None
    """Unit in which it is observed; None: as it is."""

    @property
    def label(self) -> str:
        """Name with the unit."""
        return self.name if self.scale is None else f"{self.name} in units of {self.scale:g}"


def point(name: str, unit: float) -> tuple[Entry, Entry]:
    """Where a point is from a boat, [m] in a unit."""
    return Entry(f"{name} ahead [m]", unit), Entry(f"{name} to port [m]", unit)


def turn_to(name: str) -> tuple[Entry, Entry]:
    """How far a boat has to turn to a direction."""
    return Entry(f"sine of the turn to {name}", 1.0), Entry(f"cosine of the turn to {name}", 1.0)


OWN = (
    Entry("surge velocity [m/s]", 3.0), Entry("sway velocity [m/s]", 3.0), Entry("yaw rate [rad/s]", 0.5),
    Entry("roll [rad]", 0.3), Entry("pitch [rad]", 0.3), Entry("roll rate [rad/s]", 0.5),
    Entry("pitch rate [rad/s]", 0.5), Entry("wind ahead [m/s]", 10.0), Entry("wind to port [m/s]", 10.0),
)  # fmt: skip
"""What a boat observes of its own motion; the wind's velocity is that of the air over ground, where it blows toward."""


class Team(NamedTuple):
    """The boats of all rows at a moment, (n, boats) each unless another shape is given."""

    x: FloatArray
    """x in the world [m]."""
    y: FloatArray
    """y in the world [m]."""
    yaw: FloatArray
    """Heading, counter-clockwise from x [rad]."""
    motion: FloatArray
    """Quaternion (w, x, y, z), and velocity in the boat's axes [m/s], (n, boats, 7)."""
    own: FloatArray
    """The entries `OWN`, (n, boats, 9), in SI units."""
    present: BoolArray
    """Which boats are in the water; the others' numbers mean nothing."""

    def velocity(self) -> Pair:
        """Velocity over ground, along x and along y [m/s]; one boat alone needs it for nothing."""
        qw, qx, qy, qz, u, v, w = self.motion.transpose(2, 0, 1)
        ahead_east, ahead_north = _bow(qw, qx, qy, qz)
        east = ahead_east * u + 2 * (qx * qy - qw * qz) * v + 2 * (qx * qz + qw * qy) * w
        north = ahead_north * u + (1 - 2 * (qx * qx + qz * qz)) * v + 2 * (qy * qz - qw * qx) * w
        return east, north

    def toward(self, x: FloatArray, y: FloatArray) -> Pair:
        """Where points are, ahead and to port [m] of each boat; they broadcast with (n, boats)."""
        return self.body_axes(x - self.x, y - self.y)

    def body_axes(self, east: FloatArray, north: FloatArray) -> Pair:
        """Vectors of the world in each boat's axes, ahead and to port."""
        return _along(east, north, self.yaw)

    def beyond(self, x: FloatArray, y: FloatArray, course: FloatArray) -> Pair:
        """How far the boats are from points [m]: along a course [rad] through them, and to port of it."""
        return _along(self.x - x, self.y - y, course)


class Judged(NamedTuple):
    """Rewards of a step, and which episodes it ends."""

    own: FloatArray
    """Reward of each boat, (n, boats)."""
    ended: BoolArray
    """Boats that have solved, or lost, the problem, (n, boats): their episodes terminate."""
    team: FloatArray | None = None
    """Reward of the team, (n,); None is the mean of the boats' rewards."""
    cut: BoolArray | None = None
    """Boats whose episodes are truncated before their time is up, (n, boats); None: none."""

    def team_reward(self, who: BoolArray) -> FloatArray:
        """The reward of the team, (n,), of which these boats, (n, boats), are present."""
        return mean_of(self.own, who) if self.team is None else self.team


def open_water(**more: object) -> dict[str, Any]:
    """A world without a shore, with gusts and waves, grown at the start already; the wind acts on boats."""
    return {
        "extends": "ocean",
        "description": "open water with waves and wind",
        "sea": {"model": "pms", "number": 3, "scale": 1.5, "gain": 0.2, "period": 5, "direction": [1, 0.5],
                "angle": 0.4, "tau": 0},
        "wind": {"direction": 0, "mean_velocity": 0, "var_gain": 1, "var_time": 5,
                 "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
    } | more  # fmt: skip


class Problem(RowArrays, ABC):
    """A task for the boats of `n` worlds; each boat also observes its own motion and its neighbours."""

    world: ClassVar[Mapping[str, Any]] = open_water()
    """What is compiled, unless the environment's options name another world."""
    duration: float
    """Duration of an episode [s], after which it is truncated."""
    entries: ClassVar[tuple[Entry, ...]]
    """What a boat observes of the task, in its own axes."""
    boats: ClassVar[int] = 1
    """Number of boats by default."""
    step_facts: ClassVar[tuple[str, ...]] = ()
    """Facts of a step for `info`: names of attributes without their underscore."""
    start_facts: ClassVar[tuple[str, ...]] = ()
    """What `start` draws for `info`, named likewise."""
    fixed: ClassVar[bool] = True
    """Whether there must be exactly so many boats, all the time."""
    placed: ClassVar[bool] = True
    """Whether boats start where `start` has them, and not where the fleet has them."""
    anchor: int = 0
    """The boat that neither joins late nor leaves early."""

    def __init__(self, rows: Rows) -> None:
        self.n, self.size = rows.n, len(rows.boats)

    @abstractmethod
    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """Draw an episode of a row, and where its boats start; the row is reset afterwards, with a seed of its own."""

    def entrance(self, row: int, boat: int, random: np.random.Generator) -> Spot:
        """Draw where a boat joins an episode under way; a problem of a fixed number of boats has no such place."""
        raise NotImplementedError

    @abstractmethod
    def begin(self, who: BoolArray, team: Team) -> None:
        """Note the state in which the parts of these boats, (n, boats), begin."""

    @abstractmethod
    def observe(self, team: Team) -> FloatArray:
        """Observation of the task, (n, boats, len(entries)), in SI units."""

    @abstractmethod
    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Judge a step, once; only the rows that were `going`, (n,), count, and the boats that were present."""

    def facts(self) -> Facts:
        """Facts of a step for `info`, (n,) or (n, boats) each; who keeps them copies them."""
        return {name: getattr(self, f"_{name}") for name in self.step_facts}

    def episode_facts(self) -> Facts:
        """Values that `start` drew, (n, ...) each, which `info` has a copy of when an episode begins."""
        return {name: getattr(self, f"_{name}") for name in self.start_facts}

    def forfeit(self, left: IntArray) -> FloatArray:
        """Penalty of a lost boat, (n, boats), with so many steps of its episode left, (n,).

        At least as much as the rest of the episode could cost a boat that stays where it is: to end an episode by
        sinking is never better than to go on. Here: nothing is charged for time, and `MIN_LOSS` is a drift of 200 m.
        """
        return np.repeat(np.where(left > 0, MIN_LOSS, 0.0)[:, None], self.size, axis=1)


def team_of(features: FloatArray, wind: FloatArray, present: BoolArray) -> Team:
    """The boats of a batch, by its features, (n, boats, 13), and its wind, (n, 2) [m/s]."""
    x, y, _, qw, qx, qy, qz, u, v, _, p, q, r = features.transpose(2, 0, 1)
    ahead_east, ahead_north = _bow(qw, qx, qy, qz)
    yaw = np.arctan2(ahead_north, ahead_east)
    roll = np.arctan2(2 * (qw * qx + qy * qz), 1 - 2 * (qx * qx + qy * qy))
    pitch = np.arcsin(np.clip(2 * (qw * qy - qz * qx), -1.0, 1.0))
    ahead, port = _along(wind[:, :1], wind[:, 1:], yaw)
    own = np.stack((u, v, r, roll, pitch, p, q, ahead, port), axis=-1)
    return Team(x.copy(), y.copy(), yaw, features[:, :, 3:10].copy(), own, present)


def _bow(qw: FloatArray, qx: FloatArray, qy: FloatArray, qz: FloatArray) -> Pair:
    """East and north of the unit vector along the bow."""
    return 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qw * qz)


def wrap_angle(angle: FloatArray) -> FloatArray:
    """Angles [rad] within half a turn either way."""
    return angle - 2 * np.pi * np.round(angle / (2 * np.pi))


def pose_error(team: Team, x: FloatArray, y: FloatArray, yaw: FloatArray) -> FloatArray:
    """VRX's error of a pose [m]: d + 0.75^d h, with d the distance [m] and h the difference of headings [rad]."""
    distance = np.hypot(x - team.x, y - team.y)
    return distance + 0.75**distance * np.abs(wrap_angle(yaw - team.yaw))


def mean_of(values: FloatArray, who: BoolArray) -> FloatArray:
    """The mean over these boats, (n,); 0 without boats."""
    mean: FloatArray = np.where(who, values, 0.0).sum(axis=1) / np.maximum(who.sum(axis=1), 1)
    return mean


def boats_too_near(team: Team, distance: float = MIN_CLEARANCE) -> BoolArray:
    """Boats that are nearer than `distance` [m] to another one, (n, boats)."""
    gaps = np.hypot(team.x[:, :, None] - team.x[:, None], team.y[:, :, None] - team.y[:, None])
    both = team.present[:, :, None] & team.present[:, None] & ~np.eye(team.x.shape[1], dtype=np.bool_)
    return np.asarray(((gaps < distance) & both).any(axis=2))


def _along(east: FloatArray, north: FloatArray, course: FloatArray) -> Pair:
    """Vectors along directions [rad], and to port of them."""
    cos, sin = np.cos(course), np.sin(course)
    return cos * east + sin * north, cos * north - sin * east
