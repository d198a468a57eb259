"""PettingZoo environments for teams of boats, one world at a time or thousands.

`ParallelEnv("Formation")`, `TeamVectorEnv("Formation", 256)`.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, get_args

import gymnasium
import numpy as np
import numpy.typing as npt

from vrx_mj.arguments import Names, as_flag, check_name
from vrx_mj.arrays import BoolArray, ByteArray, FloatArray
from vrx_mj.errors import UnknownNameError
from vrx_mj.mjcf.compile import Source
from vrx_mj.packages import importing
from vrx_mj.rl.environment import MAX_OBSERVATION, Environment, Floats32, Info, ProblemRows, TeamOptions
from vrx_mj.rl.options import (
    PERIOD,
    ActionError,
    Device,
    Range,
    Seeds,
    as_actions,
    as_count,
    chance,
    check_picture,
    neighbour_view,
    reset_options,
    row_mask,
    team_share,
)
from vrx_mj.rl.picture import show
from vrx_mj.rl.problems import SCORE, TEAMS
from vrx_mj.runtime.batch import Engine

with importing("vrx_mj.rl.zoo", "PettingZoo", "rl"):
    import pettingzoo
    from pettingzoo.utils.env_logger import EnvLogger

_Infos = dict[str, Info]
_Step = tuple[dict[str, Floats32], dict[str, float], dict[str, bool], dict[str, bool], _Infos]
_Arrays = tuple[Floats32, FloatArray, BoolArray, BoolArray, Info]
_RENDER_MODES = ["human", "rgb_array"]
_NOISE = (0.3, 0.1, 0.03)
"""Noise of what boats observe of each other, by default: places [m], velocities [m/s], headings [rad]."""


class TeamVectorEnv(ProblemRows):
    """`num_envs` worlds with a team and a problem each, as arrays; row i equals a `ParallelEnv` with its seed exactly.

    Action, (num_envs, boats, channels), float32 in [-1, 1]: every thrust of a boat as a share of full power ahead or
    astern, then every steering angle as a share of the largest. An action holds for 0.1 s, 10 physics steps. Numbers
    for absent boats, or beyond a boat's own channels where boats differ, are ignored.

    Observation, (num_envs, boats, features), float32, clipped to [-5, 5], in each boat's axes: its own motion, as
    in `VectorEnv`, its previous action, the problem's entries, and its neighbours (`observation_names`). Rows of
    absent boats are zero.

    Reward, terminated and truncated, (num_envs, boats). `info["acted"]` has the boats to which these numbers belong,
    `info["present"]` the boats in the next step, `team_reward` (num_envs,) and `own_reward` the parts of the rewards,
    `sunk` and `capsized` (num_envs, boats) the boats that are lost, and `diverged` (num_envs,) the rows whose state
    became NaN or too large. These end, as in `VectorEnv`, and forfeit what their problem defines. When rows begin,
    `info` contains the values drawn for them (`drawn_names`), with masks.

    A row in which all boats have ended begins another episode in the next step, which gives no rewards there, unless
    `autoreset` is false.
    """

    def __init__(
        self,
        problem: str,
        num_envs: int = 1,
        *,
        boats: int | None = None,
        world: Source | None = None,
        fleet: Source | None = None,
        duration: float | None = None,
        reward: str | float = "individual",
        neighbours: int = 3,
        range: float = 50.0,  # noqa: A002
        noise: Sequence[float] = _NOISE,
        delay: float = 0.5,
        joining: float = 0.0,
        leaving: float = 0.0,
        threads: int | None = None,
        engine: Engine = "mujoco",
        device: Device = "cpu",
        render_mode: str | None = None,
        width: int = 480,
        height: int = 320,
        autoreset: bool = True,
        **variety: Range,
    ) -> None:
        """Compile the world and make its rows.

        Args:
            problem: name of the problem: Formation, Rendezvous, Encounter, or Score, one row of any world with a task.
            num_envs: number of rows.
            boats: number of boats; by default that of the problem or of the fleet.
            world: world to use instead of the problem's own; without a task, except for Score.
            fleet: fleet of the team; by default boats of the world's spawn, in the problem's own WAM-Vs of layout H.
            duration: duration of an episode [s], after which it is truncated.
            reward: `individual`, `team`, or the share of the team's reward in every boat's reward, 0 to 1.
            neighbours: number of other boats that a boat observes, the nearest ones.
            range: greatest distance at which a boat observes others [m].
            noise: standard deviations of their positions [m], velocities [m/s] and headings [rad].
            delay: delay of the observation of neighbours [s].
            joining: share of the boats, except the first, that join in the first half of an episode.
            leaving: share of them that leave in its second half; they are truncated.
            threads: number of threads, as for `vrx_mj.Batch`.
            engine: what integrates, `mujoco` or `free`, as for `vrx_mj.Batch`; Score has `mujoco` alone.
            device: `cpu`; a graphics processor has no contacts, and boats of a team can touch each other.
            render_mode: None, rgb_array, or human, which draws in the terminal.
            width: width of the pictures [pixels].
            height: height of the pictures [pixels].
            autoreset: whether rows begin another episode automatically.
            variety: wind_speed, gusts, waves, wave_period, wave_band, wave_direction, wave_spread, wave_phase, mass and
                thrust, as in `VectorEnv`; not with Score.

        Raises:
            gymnasium.error.Error: an option is invalid.
            VrxError: the world or the fleet is invalid, as for `compile_world`, or there is no memory for the rows.
        """
        as_count("num_envs", num_envs)
        check_picture(render_mode, _RENDER_MODES, width, height)
        view, self._share = neighbour_view(neighbours, range, noise, delay), team_share(reward)
        moving = chance("joining", joining), chance("leaving", leaving)
        check_name("problem", problem, (*TEAMS, SCORE))
        check_name("device", device, get_args(Device))
        if device != "cpu":
            text = "boats of a team may touch each other, which only MuJoCo can step"
            raise gymnasium.error.Error(f'device {device}: {text}; leave out `device`, and take engine="free"')
        self.num_envs, self.render_mode, self.autoreset = num_envs, render_mode, as_flag("autoreset", autoreset)
        self._core = Environment(
            problem, num_envs, world=world, fleet=fleet, team=TeamOptions(boats, view, moving), duration=duration,
            threads=threads, engine=engine, size=(width, height), variety=variety,
        )  # fmt: skip

    @property
    def boats(self) -> Names:
        """Names of the boats, in the order of the second axis of actions and observations."""
        return self._core.batch.boats

    @property
    def action_names(self) -> dict[str, Names]:
        """Names of the channels of each boat's actions."""
        return self._core.actions.names

    @property
    def drawn_names(self) -> frozenset[str]:
        """Names of the values that `info` has for a whole row when its episode begins."""
        return frozenset(self._core.problem.episode_facts()) | frozenset(self._core.variety.facts())

    @property
    def present(self) -> BoolArray:
        """Whether each boat is present, (num_envs, boats)."""
        return self._core.roster.present.copy()

    def reset(self, *, seed: Seeds = None, rows: npt.ArrayLike | None = None) -> tuple[Floats32, Info]:
        """Begin an episode.

        Args:
            seed: seed of row 0, with seed + i for row i, or one seed for each row; None continues the rows' generators.
            rows: mask (num_envs,), bool, of the rows to reset; by default all.

        Raises:
            gymnasium.error.Error: the seeds or the mask are invalid.
        """
        self._check_open()
        mask, core = row_mask("rows", rows, self.num_envs), self._core
        observation, acted = core.reset(mask, seed), np.zeros_like(core.roster.present)
        return observation, core.facts() | {"acted": acted, "present": self.present} | core.episode_info(mask)

    def step(self, actions: npt.ArrayLike) -> _Arrays:
        """Apply the actions for 0.1 s.

        Raises:
            ActionError: the shape is wrong, or a number of a present boat is outside [-1, 1].
            gymnasium.error.ResetNeeded: no episode has begun, or, without `autoreset`, one has ended.
        """
        self._check_going(None if self.autoreset else ": reset them with rows=...")
        outcome = self._core.step(self._core.actions.array(actions, self._core.roster.present))
        mixed = self._share * outcome.shared[:, None] + (1.0 - self._share) * outcome.own
        reward = np.where(outcome.acted, mixed, 0.0)
        info = outcome.facts | {"acted": outcome.acted, "present": self.present}
        info |= {"team_reward": outcome.shared, "own_reward": outcome.own} | outcome.losses
        cut = outcome.cut & ~outcome.ended
        return outcome.observation, reward, outcome.ended, cut, info | self._core.episode_info(outcome.idle)

    def render(self) -> tuple[ByteArray, ...]:
        """Picture (height, width, 3) of each row, from the south, of the whole team."""
        self._check_going()
        picture, batch = self._core.picture, self._core.batch
        return tuple(picture.from_south(batch, row, here) for row, here in enumerate(self._core.roster.present))

    def close(self) -> None:
        """Free the renderer; further calls have no effect."""
        self._core.picture.close()
        self.closed = True


class ParallelEnv(pettingzoo.ParallelEnv[str, Floats32, Floats32]):  # type: ignore[misc]
    """One team of boats and one problem; actions, observations, rewards and options are those of `TeamVectorEnv`.

    Agents are the boats. A boat that has not joined, has left, or is done is only in `possible_agents`; `step` returns
    a boat that joins from the step in which it joins, with reward 0. `reset` must be called after all have ended.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "vrx_mj", "render_modes": _RENDER_MODES, "render_fps": round(1 / PERIOD), "is_parallelizable": True,
    }  # fmt: skip
    """Metadata that PettingZoo reads: name, render modes and frames per second."""

    def __init__(self, problem: str, *, render_mode: str | None = None, **options: Any) -> None:
        """Compile the world; `options` are those of `TeamVectorEnv` except `num_envs` and `autoreset`."""
        self._rows = TeamVectorEnv(problem, 1, render_mode=render_mode, autoreset=False, **({"threads": 1} | options))
        self.render_mode = render_mode
        self.possible_agents = list(self._rows.boats)
        self.agents: list[str] = []
        self._begun = False
        size, names = len(self._rows.observation_names), self._rows.action_names
        box = gymnasium.spaces.Box
        self.observation_spaces = {
            boat: box(-MAX_OBSERVATION, MAX_OBSERVATION, (size,), np.float32) for boat in self.possible_agents
        }
        self.action_spaces = {boat: box(-1.0, 1.0, (len(names[boat]),), np.float32) for boat in self.possible_agents}
        self.state_space = box(-MAX_OBSERVATION, MAX_OBSERVATION, (len(self.possible_agents) * size,), np.float32)
        self._most = max(len(channels) for channels in names.values())
        self._seen = np.zeros((len(self.possible_agents), size), np.float32)

    @property
    def observation_names(self) -> Names:
        """Names of the features of an observation, with their units."""
        return self._rows.observation_names

    @property
    def np_random(self) -> np.random.Generator:
        """Generator from which episodes are drawn, as in Gymnasium; wrappers draw from it too."""
        generators, row = self._rows._core.generators, np.arange(1)
        generators.seed(row, None)  # keeps the one that there is
        return generators.of(row)[0]

    def observation_space(self, agent: str) -> gymnasium.spaces.Space[Floats32]:
        """Space of a boat's observations, of the same size for every boat; UnknownNameError if the boat is unknown."""
        check_name("boat", agent, self.possible_agents)
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Space[Floats32]:
        """Space of a boat's actions, its thrusts and steering angles; UnknownNameError: unknown boat."""
        check_name("boat", agent, self.possible_agents)
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Floats32], _Infos]:
        """Begin an episode. There are no `options`: any given, as by PettingZoo's tests, are logged and ignored."""
        try:
            reset_options(options)
        except UnknownNameError as unknown:
            gymnasium.logger.warn("ignored: %s", unknown)
        seen, info = self._rows.reset(seed=seed)
        self._begun = True
        there = self._note(seen, info)
        self._show()
        return {boat: self._observation(boat) for boat in there}, self._facts(there, info)

    def step(self, actions: Mapping[str, npt.ArrayLike]) -> _Step:
        """Apply one action for each of `agents` for 0.1 s; actions of absent boats are ignored.

        Raises:
            ActionError: an action is missing, names an unknown boat, has the wrong shape, or is not in its space.
            AssertionError: no episode has begun.
            gymnasium.error.ClosedEnvironmentError: after `close`.
        """
        self._check_begun(EnvLogger.error_step_before_reset)
        if not self.agents:
            EnvLogger.warn_step_after_terminated_truncated()
            return {}, {}, {}, {}, {}
        acted = self.agents
        seen, reward, ended, cut, info = self._rows.step(self._array(actions))
        there = self._note(seen, info)
        named = [boat for boat in self.possible_agents if boat in acted or boat in there]
        at = {boat: self.possible_agents.index(boat) for boat in named}
        self._show()
        return (
            {boat: self._observation(boat) for boat in named},
            {boat: float(reward[0, k]) for boat, k in at.items()},
            {boat: bool(ended[0, k]) for boat, k in at.items()},
            {boat: bool(cut[0, k]) for boat, k in at.items()},
            self._facts(named, info),
        )

    def state(self) -> Floats32:
        """Observations of all boats, one after another, with zeros for absent ones, as in `state_space`."""
        self._check_begun(EnvLogger.error_state_before_reset)
        return self._seen.ravel().copy()

    def render(self) -> ByteArray | None:
        """Picture (height, width, 3) of the whole team; with `human` it is drawn in the terminal."""
        self._check_begun(EnvLogger.error_render_before_reset)
        if self.render_mode is None:
            gymnasium.logger.warn("render() needs render_mode='rgb_array' when the environment is made")
            return None
        (picture,) = self._rows.render()
        if self.render_mode == "rgb_array":
            return picture
        show(picture)
        return None

    def close(self) -> None:
        """Close the environment; further calls have no effect."""
        self._rows.close()
        self.agents = []

    # Inside

    def _note(self, seen: Floats32, info: Info) -> list[str]:
        """Keep what was observed, and which boats go on."""
        self._seen = seen[0]
        here = zip(self.possible_agents, info["present"][0].tolist(), strict=True)
        self.agents = [boat for boat, present in here if present]
        return list(self.agents)

    def _observation(self, boat: str) -> Floats32:
        own: Floats32 = self._seen[self.possible_agents.index(boat)].copy()
        return own

    def _facts(self, boats: list[str], info: Info) -> _Infos:
        """`info` of each boat: its own facts, and those of the whole world."""
        own = {name: value[0] for name, value in info.items() if name not in {"acted", "present"} and name[0] != "_"}
        whole = self._rows.drawn_names
        return {
            boat: {
                name: _plain(value if name in whole or not np.ndim(value) else value[k]) for name, value in own.items()
            }
            for boat in boats
            for k in (self.possible_agents.index(boat),)
        }

    def _array(self, actions: Mapping[str, npt.ArrayLike]) -> Floats32:
        """Actions by boat as an array (1, boats, channels)."""
        if not isinstance(actions, Mapping):
            raise ActionError(
                f"invalid actions of type {type(actions).__name__}: a mapping of boats to actions is needed"
            )
        strange, missing = [set(actions) - set(self.possible_agents), set(self.agents) - set(actions)]
        if strange:
            text = f"known: {', '.join(self.possible_agents)}"
            raise ActionError(f"invalid actions: no boat named '{sorted(map(str, strange))[0]}'; {text}")
        if missing:
            raise ActionError(
                f"invalid actions: none for {min(missing, key=self.possible_agents.index)}, which is present"
            )
        whole = np.zeros((1, len(self.possible_agents), self._most), np.float32)
        for boat in self.agents:
            own, shape = as_actions(actions[boat], f"action of {boat}"), self.action_spaces[boat].shape
            if own.shape != shape:
                raise ActionError(f"invalid action of {boat} of shape {own.shape}: {shape} is needed")
            whole[0, self.possible_agents.index(boat), : len(own)] = own
        return whole

    def _show(self) -> None:
        if self.render_mode == "human":
            self.render()

    def _check_begun(self, complain: Callable[[], None]) -> None:
        self._rows._check_open()
        if not self._begun:
            complain()


def _plain(value: object) -> Any:
    if isinstance(value, np.ndarray):
        return value.copy() if value.ndim else value.item()
    return value.item() if isinstance(value, np.generic) else value
