"""The learning environment: rows of a problem, in the terms of which both Gymnasium's and PettingZoo's are written."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import check_name
from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import DivergedError
from vrx_mj.mjcf.compile import Source, compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.rl.neighbours import Neighbours, NeighbourView
from vrx_mj.rl.options import (
    PERIOD,
    ActionError,
    Generators,
    Range,
    Seeds,
    Variety,
    as_actions,
    as_count,
    episode_steps,
    step_limit,
)
from vrx_mj.rl.picture import Picture
from vrx_mj.rl.problem import (
    OWN,
    Entry,
    Facts,
    Judged,
    Problem,
    RefereedRow,
    RowArrays,
    Rows,
    SeenRows,
    Spot,
    Team,
    mean_of,
    team_of,
)
from vrx_mj.rl.problems import PROBLEMS, SCORE
from vrx_mj.runtime.batch import Batch, Engine

_Random = list[np.random.Generator]
SINKING_DEPTH = 2.0
"""A boat is sunk when it is so much deeper under the surface at its place than where it floats at rest [m]."""
CAPSIZE_ANGLE = np.radians(90.0)
"""A boat has capsized when its mast leans by more than this from the vertical [rad]."""
_ABSENT_DISTANCE, _ABSENT_SPACING = 1e4, 200.0
"""Distance of absent boats north-east of all others, and from each other [m]; waves and wind move them."""
MIN_JOINING_DISTANCE = 8.0
"""A boat joins at a place that no other is nearer to [m]."""
_MAX_TRIES = 20
"""Number of places tried in a step; a boat that finds none waits for the next."""
_NEVER = 1 << 62
"""Step in which a boat leaves that does not."""
MAX_OBSERVATION = 5.0
"""Observations are clipped to this magnitude, in their units."""
MIN_STEPS_LEFT = 100
"""Steps, at least, that a lost boat is taken to have left: 10 s."""
_SPACING = 12.0
"""Distance between boats where a fleet is compiled [m]; problems but `Score` put them elsewhere."""


class LostBoats(RowArrays):
    """Which boats of a batch are lost, (n, boats)."""

    row_arrays = ("_rest",)

    def __init__(self, batch: Rows) -> None:
        self._batch = batch
        self.seen: SeenRows = batch
        self.sea_height: Callable[[FloatArray, FloatArray], FloatArray] = batch.sea_height
        """Height of the sea [m] at x and y of boats, (n, boats) each."""
        self._rest = np.zeros((batch.n, len(batch.boats)))

    def launch(self, boat: int, rows: IntArray, spots: FloatArray) -> None:
        """Put a boat of some rows on the water, at spots, (rows, 4)."""
        name = self._batch.boats[boat]
        poses, velocities = self._batch.afloat(name, spots[:, :3], rows)
        velocities[:, 0] += spots[:, 3]
        self._batch.set_boat(name, pose=poses, velocity=velocities, rows=rows)
        self._rest[rows, boat] = 0.0
        self._rest[rows, boat] = self._heights()[rows, boat]

    def sunk_boats(self) -> BoolArray:
        """Which boats are under water."""
        return self._heights() - self._rest < -SINKING_DEPTH

    def capsized_boats(self) -> BoolArray:
        """Which boats lie upside down, or nearly so."""
        features = self.seen.features
        x, y = features[..., 4], features[..., 5]
        over: BoolArray = 1.0 - 2.0 * (x * x + y * y) < np.cos(CAPSIZE_ANGLE)
        return over

    def _heights(self) -> FloatArray:
        """Heights of the boats' origins over the surface [m]; NaN of those that have diverged."""
        features = self.seen.features
        return features[..., 2] - self.sea_height(features[..., 0], features[..., 1])


class Roster(RowArrays):
    """The boats of `n` worlds: who is present, (n, boats), and when each joins and leaves, in steps."""

    row_arrays = ("present", "_joins", "_leaves")

    def __init__(self, problem: Problem, lost: LostBoats, *, moving: tuple[float, float] | None, most: int) -> None:
        """Take the chances, 0 to 1, that a boat joins late and leaves early, and the steps of an episode.

        Without chances nothing is drawn, and boats whose episodes have ended stay where they are.
        """
        self._problem, self._lost_boats, self._moving, self._most = problem, lost, moving, most
        shape = problem.n, problem.size
        self.present = np.zeros(shape, np.bool_)
        self._joins, self._leaves = np.zeros(shape, np.int64), np.full(shape, _NEVER)

    def begin(self, rows: IntArray, random: _Random, spots: Sequence[Sequence[Spot]]) -> None:
        """Draw who is there from the start of an episode, and put the boats of these rows at their spots.

        A boat that joins does so in the first half of an episode, one that leaves in the second; the anchor stays.
        """
        if self._moving is not None:
            for row, own in zip(rows.tolist(), random, strict=True):
                self._draw(row, own, *self._moving)
        self.present[rows] = self._joins[rows] == 0
        for boat in range(self._problem.size):
            here = self.present[rows, boat]
            if self._problem.placed:
                self._launch(boat, rows[here], np.array([own[boat] for own in spots]).reshape(-1, 4)[here])
            self._park(boat, rows[~here])

    def due(self, steps: IntArray) -> BoolArray:
        """Which boats have to leave now, (n, boats), by the steps of each row."""
        return self.present & (self._leaves <= steps[:, None])

    def join(self, steps: IntArray, going: BoolArray, team: Team, generators: _Random) -> BoolArray:
        """Put boats into the water whose time has come, where there is room; which they are, (n, boats)."""
        joined = np.zeros_like(self.present)
        waiting = going[:, None] & (self._joins > 0) & (self._joins <= steps[:, None]) & ~self.present
        for row, boat in np.argwhere(waiting).tolist():
            spot = self._free(row, boat, team, joined[row], generators[row])
            if spot is not None:
                self._launch(boat, np.array([row]), np.array([spot]))
                team.x[row, boat], team.y[row, boat] = spot[:2]
                joined[row, boat], self._joins[row, boat] = True, 0
        self.present |= joined
        return joined

    def dismiss(self, gone: BoolArray) -> None:
        """Take boats out of the water, for good."""
        self.present &= ~gone
        if self._moving is not None:
            for boat in range(gone.shape[1]):
                self._park(boat, np.flatnonzero(gone[:, boat]))

    def _park(self, boat: int, rows: IntArray) -> None:
        """Put a boat of some rows out of sight."""
        place = _ABSENT_DISTANCE + _ABSENT_SPACING * boat, _ABSENT_DISTANCE, 0.0, 0.0
        self._launch(boat, rows, np.array([place] * len(rows)))

    def _draw(self, row: int, random: np.random.Generator, joining: float, leaving: float) -> None:
        boats, half = self.present.shape[1], max(1, self._most // 2)
        late, early = random.random(boats) < joining, random.random(boats) < leaving
        late[self._problem.anchor] = early[self._problem.anchor] = False
        self._joins[row] = np.where(late, random.integers(1, half + 1, boats), 0)
        self._leaves[row] = np.where(early, random.integers(half, max(self._most, half + 1), boats), self._most + 1)

    def _free(self, row: int, boat: int, team: Team, joined: BoolArray, random: np.random.Generator) -> Spot | None:
        others = self.present[row] | joined
        for _ in range(_MAX_TRIES):
            spot = self._problem.entrance(row, boat, random)
            gaps = np.hypot(team.x[row, others] - spot[0], team.y[row, others] - spot[1])
            if (gaps >= MIN_JOINING_DISTANCE).all():
                return spot
        return None

    def _launch(self, boat: int, rows: IntArray, spots: FloatArray) -> None:
        if len(rows):
            self._lost_boats.launch(boat, rows, spots)


Floats32 = npt.NDArray[np.float32]
Info = dict[str, Any]
"""Facts about a step or an episode, as Gymnasium's `info`."""


class TeamOptions(NamedTuple):
    """Options that only teams have."""

    boats: int | None
    """Number of boats; None: that of the problem or of the fleet."""
    view: NeighbourView
    """How boats observe each other."""
    moving: tuple[float, float]
    """Chances, 0 to 1, that a boat joins late and leaves early."""


class Outcome(NamedTuple):
    """Result of a step, (n, boats) each unless another shape is given."""

    observation: Floats32
    """Observations, (n, boats, features)."""
    own: FloatArray
    """Reward of each boat."""
    shared: FloatArray
    """Reward of the team, (n,)."""
    ended: BoolArray
    """Which boats have solved or lost the problem, or are lost."""
    cut: BoolArray
    """Which boats' time is up."""
    acted: BoolArray
    """Which boats these numbers belong to."""
    idle: BoolArray
    """Rows that began an episode instead, (n,)."""
    losses: Facts
    """`sunk` and `capsized`, which boats are lost, and `diverged`, (n,), rows with a state that is not finite."""
    facts: Facts
    """The problem's facts, (n,) or (n, boats) each."""


class Episodes:
    """Starts episodes of rows: draws their own conditions, and puts their boats into the water."""

    def __init__(
        self, batch: Rows, problem: Problem, roster: Roster, variety: Variety, generators: Generators,
        neighbours: Neighbours | None,
    ) -> None:  # fmt: skip
        """Take the parts of an environment."""
        self._batch, self._problem, self._roster = batch, problem, roster
        self._variety, self._generators, self._neighbours = variety, generators, neighbours

    def begin(self, rows: IntArray) -> None:
        """Begin episodes in rows."""
        random, batch, roster = self._generators.of(rows), self._batch, self._roster
        self._variety.draw(rows, random)
        seeds, company = [int(own.integers(2**31)) for own in random], self._neighbours is not None
        keys = np.array([own.integers(2**64, dtype=np.uint64) for own in random if company], np.uint64)
        spots = [self._problem.start(row, own) for row, own in zip(rows.tolist(), random, strict=True)]
        batch.reset(rows, seed=seeds)
        roster.begin(rows, random, spots)
        team, begun = team_of(batch.features, batch.wind, roster.present.copy()), np.zeros_like(roster.present)
        begun[rows] = True
        self._problem.begin(team.present & begun, team)
        if self._neighbours is not None:
            self._neighbours.begin(rows, keys, team)


class Environment:
    """`n` rows of a problem: their worlds and boats, what the boats observe, and what a step is worth to them."""

    def __init__(
        self,
        problem: str,
        n: int,
        *,
        world: Source | None,
        fleet: Source | None,
        team: TeamOptions | None = None,
        duration: float | None,
        max_episode_steps: int | None = None,
        threads: int | None,
        engine: Engine,
        size: tuple[int, int],
        variety: Mapping[str, Range],
    ) -> None:
        """Compile the world and make its rows; without `team` each has one boat.

        The other arguments are those of `VectorEnv`; `size` is the width and height of the pictures.
        """
        compiled = _world_of(problem, n, world, fleet, team)
        if problem == SCORE:
            check_name("engine of Score", engine, ["mujoco"])
        alone = problem == SCORE
        self.batch = RefereedRow(compiled) if alone else Batch(compiled, n, threads=threads, engine=engine)
        self.seen: SeenRows = self.batch
        self.problem = PROBLEMS[problem](self.batch)
        self.most = step_limit(duration, max_episode_steps, self.problem.duration)
        self._horizon = episode_steps(self.problem.duration if duration is None else duration)
        self.variety, self.lost_boats = Variety(self.batch, problem, variety), LostBoats(self.batch)
        moving = None if team is None else team.moving
        self.roster = Roster(self.problem, self.lost_boats, moving=moving, most=self._horizon)
        self.actions = Actions(self.batch.boats, self.batch.channels, self.batch.largest)
        self.generators, self.picture = Generators(n), Picture(compiled, *size)
        self.steps, self._last = np.zeros(n, np.int64), np.zeros((n, self.problem.size, self.actions.most), np.float32)
        self._neighbours = None if team is None else Neighbours(n, self.problem.size, team.view)
        self.episodes = Episodes(self.batch, self.problem, self.roster, self.variety, self.generators, self._neighbours)
        seen = () if team is None else team.view.entries()
        if team is None:
            previous = [f"previous action: {name}" for _, name in self.batch.channels]
        else:  # the same number may be another channel of another boat
            previous = [f"previous action {k + 1}" for k in range(self.actions.most)]
        entries = (*OWN, *map(Entry, previous), *self.problem.entries, *seen)
        self.observation_names = tuple(entry.label for entry in entries)
        self._scales = np.array([entry.scale or 1.0 for entry in entries])

    def reset(self, rows: BoolArray, seed: Seeds) -> Floats32:
        """Begin an episode in some rows, (n,), and observe all.

        Raises:
            gymnasium.error.Error: the seeds are invalid.
        """
        which = np.flatnonzero(rows)
        self.generators.seed(which, seed)
        self.begin(rows)
        return self.observe()

    def begin(self, begun: BoolArray) -> None:
        """Begin an episode in some rows, (n,)."""
        rows = np.flatnonzero(begun)
        if not len(rows):
            return
        self.episodes.begin(rows)
        self.steps[rows], self._last[rows] = 0, 0.0

    def any_of(self, rows: BoolArray) -> bool:
        """Whether any of these rows, (n,), needs something."""
        return bool(rows.any())

    def final_info(self, facts: Facts, observation: Floats32, ended: BoolArray) -> Info:
        """`info` for the last observations and facts of the rows whose episodes have just ended, (n,); None for others.

        `observation` is (n, features).
        """
        seen = np.full(len(observation), None, object)
        for row in np.flatnonzero(ended).tolist():
            seen[row] = observation[row].copy()
        own = {"final_obs": seen, "final_info": self.info(facts, ended)}
        return own | {f"_{name}": ended.copy() for name in own}

    def info(self, facts: Facts, rows: BoolArray) -> Info:
        """`info` for the facts of some rows, (n, ...): zeros for other rows, a mask `_NAME` for each; {} for no row."""
        info: Info = {}
        if rows.any():
            for name, value in facts.items():
                wide = rows.reshape(-1, *[1] * (value.ndim - 1))
                info[name], info[f"_{name}"] = np.where(wide, value, np.zeros_like(value)), rows.copy()
        return info

    def episode_info(self, rows: BoolArray) -> Info:
        """`info` for the rows whose episodes have just begun: what was drawn for them."""
        return self.info(self.problem.episode_facts() | self.variety.facts(), rows)

    def step(self, actions: Floats32) -> Outcome:
        """Apply checked actions, (n, boats, channels), for 0.1 s; rows without boats begin an episode instead."""
        going: BoolArray = np.any(self.roster.present, axis=1)
        self.begin(~going)
        acted = self.roster.present & going[:, None]
        self._last = np.where(acted[..., None], actions, np.float32(0.0))
        forfeit = self.problem.forfeit(np.maximum(self._horizon - self.steps, MIN_STEPS_LEFT))
        diverged = self._advance(going)
        counts = acted & ~diverged[:, None]
        sunk, capsized = self.lost_boats.sunk_boats() & counts, self.lost_boats.capsized_boats() & counts
        team = self.team()
        judged = self.problem.judge(team, going)
        self.steps += going
        gone = sunk | capsized | (acted & diverged[:, None])
        ended = acted & (judged.ended | gone)
        late = (self.steps >= self.most)[:, None] | self.roster.due(self.steps)
        cut = acted & (late if judged.cut is None else late | judged.cut)
        own = np.where(gone, -forfeit, np.where(acted, judged.own, 0.0))
        shared = own[:, 0] if self._neighbours is None else _team_reward(judged, own, forfeit, gone, acted, diverged)
        over = ended | cut
        if self._neighbours is not None:
            team = self._team_after_joining(team, np.any(acted & ~over, axis=1))
            self._neighbours.note(going, team)
        observation = self._observe(team)
        facts = self.facts()
        self.roster.dismiss(over)
        losses: Facts = {"diverged": diverged, "sunk": sunk, "capsized": capsized}
        return Outcome(observation, own, shared, ended, cut, acted, ~going, losses, facts)

    def facts(self) -> Facts:
        """The problem's facts, (n,) or (n, boats) each."""
        return {name: values.copy() for name, values in self.problem.facts().items()}

    def observe(self) -> Floats32:
        """Observations of all boats now, (n, boats, features)."""
        return self._observe(self.team())

    def team(self) -> Team:
        """The boats now."""
        return team_of(self.seen.features, self.seen.wind, self.roster.present.copy())

    def _observe(self, team: Team) -> Floats32:
        """Observations; absent boats of a team observe zeros, and NaN after divergence becomes 0."""
        parts: tuple[npt.NDArray[np.floating], ...] = team.own, self._last, self.problem.observe(team)
        if self._neighbours is not None:
            parts = (*parts, self._neighbours.observe(team))
        whole = (np.concatenate(parts, axis=-1) / self._scales).clip(-MAX_OBSERVATION, MAX_OBSERVATION)
        whole[np.isnan(whole)] = 0.0
        observed: Floats32 = whole.astype(np.float32)
        return observed if self._neighbours is None else np.where(team.present[..., None], observed, np.float32(0.0))

    def _advance(self, going: BoolArray) -> BoolArray:
        """Advance rows, (n,), under their last actions; which rows have diverged, (n,)."""
        rows = np.flatnonzero(going)
        with contextlib.suppress(DivergedError):
            self.batch.step(self.actions.commands(self._last[rows]), duration=PERIOD, rows=rows)
        return self.seen.diverged.copy()

    def _team_after_joining(self, team: Team, rows: BoolArray) -> Team:
        """The team after boats have joined some rows, (n,)."""
        joined = self.roster.join(self.steps, rows, team, self.generators.of(np.arange(len(rows))))
        if joined.any():
            team = self.team()
            self.problem.begin(joined, team)
        return team


class ProblemRows:
    """Common part of both vector environments."""

    closed = False
    """Whether `close` was called."""
    _core: Environment

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the features of an observation, with their units."""
        return self._core.observation_names

    def _check_open(self) -> None:
        """gymnasium.error.ClosedEnvironmentError: the environment is closed."""
        if self.closed:
            raise gymnasium.error.ClosedEnvironmentError("the environment is closed")

    def _check_going(self, advice: str | None = None) -> None:
        """gymnasium.error.ResetNeeded: no episode has begun, or one has ended where there is advice how to reset it."""
        self._check_open()
        self._core.generators.check_begun()
        if advice is None:
            return
        ended = np.flatnonzero(~self._core.roster.present.any(axis=1))
        if len(ended):
            raise gymnasium.error.ResetNeeded(f"the episodes of rows {ended[:5].tolist()} have ended{advice}")


class Actions:
    """Which channel of which boat is which command of the batch; boats may have unlike numbers of channels."""

    def __init__(self, boats: Sequence[str], channels: Sequence[tuple[str, str]], largest: FloatArray) -> None:
        """Take the boats, and a batch's channels, boat and name of each, with their limits, (channels, 2)."""
        self._boats = tuple(boats)
        self.names = {boat: tuple(name for owner, name in channels if owner == boat) for boat in boats}
        own = np.array([len(self.names[boat]) for boat in boats])
        self.most = int(own.max())
        """Number of channels of the boat that has the most."""
        self._has = np.arange(self.most) < own[:, None]
        places = [self._boats.index(boat) * self.most + self.names[boat].index(name) for boat, name in channels]
        self._places, self._limits = np.array(places, np.int64), np.abs(largest)

    def commands(self, actions: Floats32) -> FloatArray:
        """The batch's commands, (rows, channels), for actions in [-1, 1], (rows, boats, most)."""
        wanted = actions.reshape(-1, self._has.size).take(self._places, axis=1).astype(np.float64)
        return np.where(wanted < 0.0, wanted * self._limits[:, 0], wanted * self._limits[:, 1])

    def array(self, actions: npt.ArrayLike, present: BoolArray, shape: tuple[int, ...] | None = None) -> Floats32:
        """Actions (n, boats, most), zero for absent boats and where a boat has no channel; given so, or in `shape`.

        Raises:
            ActionError: another shape, or a number of a present boat is not within -1 and 1.
        """
        given = as_actions(actions, "actions")
        whole = (*present.shape, self.most)
        shape = whole if shape is None else shape
        if given.shape != shape:
            raise ActionError(f"invalid actions of shape {given.shape}: {shape} is needed")
        given, counts = given.reshape(whole), present[..., None] & self._has
        wrong = counts & ~(np.abs(given) <= 1.0)
        if wrong.any():
            row, boat, channel = (int(index) for index in np.argwhere(wrong)[0])
            owner, value = self._boats[boat], given[row, boat, channel]
            text = f"invalid action {value:.7g} for {self.names[owner][channel]} of {owner}"
            where = f"row {row}: " if len(given) > 1 else ""
            raise ActionError(f"{where}{text}: a number from -1 to 1 is needed")
        return np.where(counts, given, np.float32(0.0))


def _team_reward(
    judged: Judged, own: FloatArray, forfeit: FloatArray, lost: BoolArray, acted: BoolArray, diverged: BoolArray
) -> FloatArray:
    """The team's reward (n,), less what its lost boats forfeit; where all are lost, the mean of that."""
    paid = judged.team_reward(acted) - mean_of(np.where(lost, judged.own + forfeit, 0.0), acted)
    return np.where(acted.any(axis=1), np.where(diverged, mean_of(own, acted), paid), 0.0)


def _world_of(problem: str, n: int, world: Source | None, fleet: Source | None, team: TeamOptions | None) -> World:
    """The world of a problem.

    Raises:
        gymnasium.error.Error: the problem is not for such a world, or not for so many rows or boats.
        VrxError: the world or the fleet is invalid.
    """
    if problem == SCORE and (n != 1 or world is None):
        needs = f"invalid num_envs {n}: a referee scores one world" if n != 1 else "give a world with a task"
        raise gymnasium.error.Error(f"{SCORE}: {needs}")
    kind, boats = PROBLEMS[problem], None if team is None else team.boats
    if fleet is None:
        fleet = {"sensors": "none"} if team is None else _line_of(kind.boats if boats is None else boats)
    compiled = compile_world(kind.world if world is None else world, fleet=fleet)
    size = len(compiled.boats)
    if boats is not None and size != boats:
        raise gymnasium.error.Error(f"invalid boats {boats}: the fleet has {size}; give only one of them")
    if kind.fixed and size != kind.boats:
        raise gymnasium.error.Error(
            f"the fleet has {size} boat{'' if size == 1 else 's'}: {problem} needs {kind.boats}"
        )
    if kind.fixed and team is not None and sum(team.moving) > 0.0:
        text = "joining and leaving must be 0"
        raise gymnasium.error.Error(f"{problem} needs {kind.boats} boats all the time: {text}")
    if problem == SCORE and compiled.parameters.task is None:
        raise gymnasium.error.Error(f"{SCORE}: the world {compiled.name} has no task")
    return compiled


def _line_of(boats: int) -> Source:
    count = as_count("boats", boats)
    return {"usv_count": count, "layout": "line", "spacing": _SPACING, "origin": "spawn", "sensors": "none"}
