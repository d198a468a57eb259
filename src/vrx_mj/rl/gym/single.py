"""One world as a `gymnasium.Env`."""

from typing import Any, SupportsFloat

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from vrx_mj.arguments import check_name
from vrx_mj.arrays import ByteArray
from vrx_mj.rl.gym.features import Floats32
from vrx_mj.rl.gym.options import as_floats, episode_steps
from vrx_mj.rl.gym.problems import PROBLEMS
from vrx_mj.rl.gym.vector import VectorEnv

__all__ = ["Env", "RegisteredEnv"]


class Env(gymnasium.Env[Floats32, Floats32]):
    """One boat and one problem; actions, observations, rewards and options are those of `VectorEnv`.

    `reset` must be called before the first episode and after each one. After `close` it opens the environment again.
    """

    metadata = VectorEnv.metadata

    def __init__(self, problem: str, *, render_mode: str | None = None, **options: Any) -> None:
        """Compile the world; `options` are those of `VectorEnv` except `num_envs` and `autoreset_mode`."""
        options = {"threads": 1} | options
        self._rows = VectorEnv(problem, 1, render_mode=render_mode, autoreset_mode=AutoresetMode.DISABLED, **options)
        self.render_mode, self._ended = render_mode, False
        self.observation_space = self._rows.single_observation_space
        self.action_space = self._rows.single_action_space

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the features of an observation, with their units."""
        return self._rows.observation_names

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats32, dict[str, Any]]:
        """Begin an episode; `options` are ignored."""
        super().reset(seed=seed, options=options)
        self._rows.closed = False
        self._rows.use(0, self.np_random)
        observation, info = self._rows.reset()
        self._ended = False
        return observation[0], _alone(info)

    def step(self, action: npt.ArrayLike) -> tuple[Floats32, SupportsFloat, bool, bool, dict[str, Any]]:
        """Apply an action for 0.1 s; errors are those of `VectorEnv.step`."""
        if self._ended and not self._rows.closed:
            raise gymnasium.error.ResetNeeded("the episode has ended: call reset()")
        given = as_floats(action)
        if given.shape != self.action_space.shape:
            text = f"invalid action of shape {given.shape}: {self.action_space.shape} is needed"
            raise gymnasium.error.InvalidAction(text)
        observation, reward, done, cut, info = self._rows.step(given[None])
        self._ended = bool(done[0] or cut[0])
        return observation[0], float(reward[0]), bool(done[0]), bool(cut[0]), _alone(info)

    def render(self) -> ByteArray | None:
        """Picture (height, width, 3) from behind and above the boat; None without `render_mode`."""
        pictures = self._rows.render()
        return None if pictures is None else pictures[0]

    def close(self) -> None:
        """Free the renderer; further calls have no effect."""
        self._rows.close()


class RegisteredEnv(Env):
    """An `Env` as `gymnasium.make` makes it: Gymnasium's `TimeLimit` truncates its episodes, at `max_episode_steps`."""

    def __init__(self, problem: str, *, duration: float | None = None, **options: Any) -> None:
        """Compile the world; the arguments are those of `Env`, except that `duration` has no default.

        Raises:
            gymnasium.error.Error: an option is invalid, or `duration` is longer than the registered
                `max_episode_steps`: `gymnasium.make` does not say whether its caller gave others.
        """
        check_name("problem", problem, PROBLEMS)
        most = -1 if duration is None else episode_steps(PROBLEMS[problem].duration)
        super().__init__(problem, duration=duration, max_episode_steps=most, **options)


def _alone(info: dict[str, Any]) -> dict[str, Any]:
    """`info` of the only row: plain numbers, and copies of arrays."""
    own = {name: value[0] for name, value in info.items() if not name.startswith("_")}
    return {name: value.copy() if np.ndim(value) else value.item() for name, value in own.items()}
