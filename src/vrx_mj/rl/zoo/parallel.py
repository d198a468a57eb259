"""One world as a `pettingzoo.ParallelEnv`."""

from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
import pettingzoo
from pettingzoo.utils.env_logger import EnvLogger

from vrx_mj.arguments import check_name
from vrx_mj.arrays import ByteArray
from vrx_mj.rl.gym.features import BOUND, Floats32
from vrx_mj.rl.gym.options import PERIOD, as_floats
from vrx_mj.rl.zoo.actions import ActionError
from vrx_mj.rl.zoo.options import RENDER_MODES
from vrx_mj.rl.zoo.picture import show
from vrx_mj.rl.zoo.vector import TeamVectorEnv

__all__ = ["ParallelEnv"]

Told = dict[str, dict[str, Any]]
Step = tuple[dict[str, Floats32], dict[str, float], dict[str, bool], dict[str, bool], Told]


class ParallelEnv(pettingzoo.ParallelEnv[str, Floats32, Floats32]):  # type: ignore[misc]
    """One team of boats and one problem; actions, observations, rewards and options are those of `TeamVectorEnv`.

    Agents are the boats. A boat that has not joined, has left, or is done is only in `possible_agents`; `step` returns
    a boat that joins from the step in which it joins, with reward 0. `reset` must be called after all have ended.
    """

    metadata: ClassVar[dict[str, Any]] = {
        "name": "vrx_mj", "render_modes": RENDER_MODES, "render_fps": round(1 / PERIOD), "is_parallelizable": True,
    }  # fmt: skip
    """What PettingZoo asks about the environment: its name, ways to draw it, pictures per second."""

    def __init__(self, problem: str, *, render_mode: str | None = None, **options: Any) -> None:
        """Compile the world; `options` are those of `TeamVectorEnv` except `num_envs` and `autoreset`."""
        self._rows = TeamVectorEnv(problem, 1, render_mode=render_mode, autoreset=False, **({"threads": 1} | options))
        self.render_mode = render_mode
        self.possible_agents = list(self._rows.boats)
        self.agents: list[str] = []
        self._begun = False
        size, names = len(self._rows.observation_names), self._rows.action_names
        box = gymnasium.spaces.Box
        self.observation_spaces = {boat: box(-BOUND, BOUND, (size,), np.float32) for boat in self.possible_agents}
        self.action_spaces = {boat: box(-1.0, 1.0, (len(names[boat]),), np.float32) for boat in self.possible_agents}
        self.state_space = box(-BOUND, BOUND, (len(self.possible_agents) * size,), np.float32)
        self._most = max(len(channels) for channels in names.values())
        self._seen = np.zeros((len(self.possible_agents), size), np.float32)

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the features of an observation, with their units."""
        return self._rows.observation_names

    def observation_space(self, agent: str) -> gymnasium.spaces.Space[Floats32]:
        """Space of a boat's observations, of the same size for every boat; UnknownNameError if the boat is unknown."""
        check_name("boat", agent, self.possible_agents)
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Space[Floats32]:
        """Space of a boat's actions, its thrusts and steering angles; UnknownNameError if there is no such boat."""
        check_name("boat", agent, self.possible_agents)
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Floats32], Told]:
        """Begin an episode; `options` are ignored."""
        seen, info = self._rows.reset(seed=seed)
        self._begun = True
        there = self._note(seen, info)
        self._show()
        return {boat: self._observation(boat) for boat in there}, self._facts(there, info)

    def step(self, actions: Mapping[str, npt.ArrayLike]) -> Step:
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
        told = [boat for boat in self.possible_agents if boat in acted or boat in there]
        at = {boat: self.possible_agents.index(boat) for boat in told}
        self._show()
        return (
            {boat: self._observation(boat) for boat in told},
            {boat: float(reward[0, k]) for boat, k in at.items()},
            {boat: bool(ended[0, k]) for boat, k in at.items()},
            {boat: bool(cut[0, k]) for boat, k in at.items()},
            self._facts(told, info),
        )

    def state(self) -> Floats32:
        """Observations of all boats, one after another, with zeros for absent ones, as in `state_space`."""
        self._check_begun(EnvLogger.error_state_before_reset)
        whole: Floats32 = self._seen.ravel().copy()
        return whole

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

    def _note(self, seen: Floats32, info: dict[str, Any]) -> list[str]:
        """Keep what was seen, and who goes on."""
        self._seen = seen[0]
        here = zip(self.possible_agents, info["present"][0].tolist(), strict=True)
        self.agents = [boat for boat, present in here if present]
        return list(self.agents)

    def _observation(self, boat: str) -> Floats32:
        own: Floats32 = self._seen[self.possible_agents.index(boat)].copy()
        return own

    def _facts(self, boats: list[str], info: dict[str, Any]) -> Told:
        """What `info` tells each boat: its own, and what is the whole world's."""
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
            own = self._one(boat, actions[boat])
            whole[0, self.possible_agents.index(boat), : len(own)] = own
        return whole

    def _one(self, boat: str, action: npt.ArrayLike) -> Floats32:
        names = self._rows.action_names[boat]
        try:
            given = as_floats(action)
        except gymnasium.error.InvalidAction:
            raise ActionError(f"invalid action of {boat}: an array of numbers is needed") from None
        if given.shape != (len(names),):
            raise ActionError(f"invalid action of {boat} of shape {given.shape}: {(len(names),)} is needed")
        wrong = np.flatnonzero(~(np.abs(given) <= 1.0))
        if len(wrong):
            name, value = names[wrong[0]], given[wrong[0]]
            why = "step() cannot take in a nan action" if np.isnan(value) else "action is not in action space"
            raise ActionError(f"{why}: {value:g} for {name} of {boat}; a number from -1 to 1 is needed")
        return given

    def _show(self) -> None:
        if self.render_mode == "human":
            self.render()

    def _check_begun(self, complain: Any) -> None:
        if self._rows.closed:
            raise gymnasium.error.ClosedEnvironmentError("the environment is closed")
        if not self._begun:
            complain()


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.copy() if value.ndim else value.item()
    return value.item() if isinstance(value, np.generic) else value
