"""Gymnasium environments with one boat each, one at a time or thousands; importing this module registers them."""

from typing import Any, SupportsFloat, get_args

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from vrx_mj.arguments import check_name
from vrx_mj.arrays import BoolArray, ByteArray, FloatArray
from vrx_mj.errors import quote
from vrx_mj.mjcf.compile import Source
from vrx_mj.rl.environment import MAX_OBSERVATION, Environment, Floats32, Info, ProblemRows
from vrx_mj.rl.options import (
    PERIOD,
    Device,
    Range,
    Seeds,
    as_actions,
    as_count,
    check_picture,
    episode_steps,
    reset_options,
    row_mask,
)
from vrx_mj.rl.problems import ALONE, PROBLEMS
from vrx_mj.runtime.batch import Engine

_Arrays = tuple[Floats32, FloatArray, BoolArray, BoolArray, Info]


class VectorEnv(ProblemRows, gymnasium.vector.VectorEnv[Floats32, Floats32, npt.NDArray[Any]]):
    """`num_envs` worlds with one boat and one problem each; row i equals an `Env` with the seed of row i exactly.

    Action, (num_envs, channels), float32 in [-1, 1]: every thrust as a share of full power ahead or astern, then every
    steering angle as a share of the largest. An action holds for 0.1 s, 10 physics steps.

    Observation, (num_envs, features), float32, clipped to [-5, 5]: surge and sway velocity [3 m/s], yaw rate
    [0.5 rad/s], roll and pitch [0.3 rad], roll and pitch rate [0.5 rad/s], the air's velocity over ground ahead and to
    port [10 m/s], the previous action, and the problem's entries (`observation_names`). Axes are the boat's: x ahead,
    y to port. The values are exact, without sensor noise.

    An episode begins with the boat afloat at rest. Its sea, and everything else that the options vary, is drawn from
    the row's seed. The drawn values and the problem's goals are in the `info` of `reset`, and of the step that resets
    a row.

    A row ends (terminated) when its boat is lost: 2 m deeper under the water than at rest (`info["sunk"]`), leaning
    more than 90 degrees (`capsized`), or with a state that became NaN or too large (`diverged`). Its last reward is
    the problem's forfeit, which is never less than the cost of continuing.
    """

    metadata = {"render_modes": ["rgb_array", "rgb_array_list"], "render_fps": round(1 / PERIOD)}  # noqa: RUF012

    def __init__(
        self,
        problem: str,
        num_envs: int = 1,
        *,
        world: Source | None = None,
        fleet: Source | None = None,
        duration: float | None = None,
        max_episode_steps: int | None = None,
        threads: int | None = None,
        engine: Engine = "mujoco",
        device: Device = "cpu",
        render_mode: str | None = None,
        width: int = 480,
        height: int = 320,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **variety: Range,
    ) -> None:
        """Compile the world and make its rows.

        Args:
            problem: name of the problem: StationKeeping, Wayfinding, FollowPath or Docking.
            num_envs: number of rows.
            world: world to use instead of the problem's own; without a task, and with a dock for Docking.
            fleet: fleet of one boat; by default that of the world's spawn, in the problem's own a WAM-V of layout H.
            duration: duration of an episode [s], after which it is truncated; by default the problem's.
            max_episode_steps: number of steps, 0.1 s each, after which an episode is truncated at the latest, -1 for
                no such number; where it is given, `duration` has no default. `gymnasium.make_vec` always gives it.
            threads: number of threads, as for `vrx_mj.Batch`.
            engine: what integrates, `mujoco` or `free`, as for `vrx_mj.Batch`.
            device: where rows and arrays are: with `cuda` on a graphics processor, where the engine is `free`; see
                `rl.device.DeviceEnvironment`. Arrays are CuPy's, and `info` has those of all rows, without masks, as
                have `final_obs`, (num_envs, features), and `final_info`. Actions, of any library on the processor, are
                clipped, not checked.
            render_mode: None, rgb_array, or rgb_array_list, which draws in every step, for `render` to return all.
            width: width of the pictures [pixels].
            height: height of the pictures [pixels].
            autoreset_mode: when a row whose episode ended is reset (`gymnasium.vector.AutoresetMode`).
            variety: what differs from episode to episode: a number, or a pair (least, greatest) from which each episode
                draws; None: as in the world. `wind_speed` is the mean wind [m/s], from any direction, `gusts` their
                standard deviation [m/s]; `waves` is a factor of the waves' heights, `wave_period` one of their periods,
                by default (0.8, 1.4), `wave_band` one of the width of the spectrum's band, (0.5, 1.2), `wave_spread`
                one of the angles between the waves, (0, 1.5); `wave_direction` is where the sea travels [rad], and
                `wave_phase` the phase of each wave at the origin at the start [rad], both (-pi, pi); `mass` is a factor
                of the boat's mass and inertia, refused where the boat does not float with it, `thrust` one of all
                thrusters' forces.

        Raises:
            gymnasium.error.Error: an option is invalid.
            VrxError: the world or the fleet is invalid, as for `compile_world`, or there is no memory for the rows.
        """
        check_name("problem", problem, ALONE)
        check_name("device", device, get_args(Device))
        as_count("num_envs", num_envs)
        check_picture(render_mode, self.metadata["render_modes"], width, height)
        self.num_envs, self.render_mode, self._mode = num_envs, render_mode, _reset_mode(autoreset_mode)
        self.metadata = type(self).metadata | {"autoreset_mode": self._mode}
        self._core = self._environment(device)(
            problem, num_envs, world=world, fleet=fleet, duration=duration, max_episode_steps=max_episode_steps,
            threads=threads, engine=engine, size=(width, height), variety=variety,
        )  # fmt: skip
        box = gymnasium.spaces.Box
        self.single_observation_space = box(
            -MAX_OBSERVATION, MAX_OBSERVATION, (len(self.observation_names),), np.float32
        )
        self.single_action_space = box(-1.0, 1.0, (self._core.actions.most,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._films: list[list[ByteArray]] = [[] for _ in range(num_envs)]
        self._all = np.ones((num_envs, 1), np.bool_)

    def _environment(self, device: Device) -> type[Environment]:
        """The kind of environment for a device; gymnasium.error.Error: it has no pictures, or no such mode."""
        if device == "cpu":
            return Environment
        if self.render_mode is not None or self._mode is AutoresetMode.DISABLED:
            text = "use make_vec, without render_mode, with autoreset_mode NextStep or SameStep"
            raise gymnasium.error.Error(f"device cuda: {text}")
        from vrx_mj.rl.device import DeviceEnvironment

        return DeviceEnvironment

    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Floats32, Info]:
        """Begin an episode in every row.

        Args:
            seed: seed of row 0, with seed + i for row i, or one seed for each row; None continues the rows' generators.
            options: `reset_mask` (num_envs,), bool: rows to reset; the others are kept.

        Raises:
            gymnasium.error.Error: the seeds or the mask are invalid.
            UnknownNameError: another option is given.
        """
        self._check_open()
        rows = row_mask("reset_mask", reset_options(options, "reset_mask").get("reset_mask"), self.num_envs)
        observation = self._core.reset(rows, seed)[:, 0]
        self._film(rows, rows)
        return observation, self._core.episode_info(rows)

    def step(self, actions: npt.ArrayLike) -> _Arrays:
        """Apply an action for 0.1 s in every row; with NEXT_STEP, rows whose episodes have ended are reset instead.

        Raises:
            gymnasium.error.InvalidAction: the shape is wrong, or a number is not finite or outside [-1, 1].
            gymnasium.error.ResetNeeded: no episode has begun, or, with DISABLED, one has ended.
        """
        disabled = self._mode is AutoresetMode.DISABLED
        self._check_going(" or have not begun: reset them with options={'reset_mask': ...}" if disabled else None)
        core = self._core
        outcome = core.step(core.actions.array(actions, self._all, self.action_space.shape))
        observation, reward = outcome.observation[:, 0], outcome.own[:, 0]
        done, cut = outcome.ended[:, 0], outcome.cut[:, 0]
        facts = {
            name: value[:, 0] if value.ndim > 1 else value for name, value in (outcome.facts | outcome.losses).items()
        }
        begun, over = outcome.idle, done | cut
        info = core.info(facts, ~begun)
        if self._mode is AutoresetMode.SAME_STEP and core.any_of(over):
            info, begun = core.info(facts, ~over) | core.final_info(facts, observation, over), over
            core.begin(over)
            observation = core.observe()[:, 0]
        self._film(begun)
        return observation, reward, done, cut, info | core.episode_info(begun)

    def render(self) -> tuple[Any, ...] | None:
        """Picture (height, width, 3) of each row, from behind and above its boat; None without `render_mode`.

        With `rgb_array_list` it is a list for each row of its pictures since the last call, or since its episode began.
        """
        self._check_open()
        if self.render_mode is None:
            gymnasium.logger.warn("render() needs render_mode='rgb_array' when the environment is made")
            return None
        self._check_going()
        if self.render_mode == "rgb_array":
            return tuple(map(self._picture, range(self.num_envs)))
        films, self._films = tuple(self._films), [[] for _ in self._films]
        return films

    def close_extras(self, **kwargs: object) -> None:
        """Free the renderer; the rows go with the environment."""
        self._core.picture.close()

    def use(self, row: int, random: np.random.Generator) -> None:
        """Set the generator from which a row draws its episodes."""
        self._core.generators.use(row, random)

    # Inside

    def _picture(self, row: int) -> ByteArray:
        return self._core.picture.from_behind(self._core.batch, row)

    def _film(self, begun: BoolArray, drawn: BoolArray | None = None) -> None:
        """Add to the films of the rows `drawn`, (n,), by default all; those of episodes that have begun start anew."""
        if self.render_mode == "rgb_array_list":
            for row in range(self.num_envs) if drawn is None else np.flatnonzero(drawn).tolist():
                self._films[row] = [] if begun[row] else self._films[row]
                self._films[row].append(self._picture(row))


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

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats32, Info]:
        """Begin an episode; UnknownNameError if `options` are given: an episode is drawn from its seed alone."""
        reset_options(options)
        super().reset(seed=seed, options=options)
        self._rows.closed = False
        self._rows.use(0, self.np_random)
        observation, info = self._rows.reset()
        self._ended = False
        return observation[0], _alone(info)

    def step(self, action: npt.ArrayLike) -> tuple[Floats32, SupportsFloat, bool, bool, Info]:
        """Apply an action for 0.1 s; errors are those of `VectorEnv.step`."""
        if self._ended and not self._rows.closed:
            raise gymnasium.error.ResetNeeded("the episode has ended: call reset()")
        given = as_actions(action)
        if given.shape != self.action_space.shape:
            text = f"invalid action of shape {given.shape}: {self.action_space.shape} is needed"
            raise gymnasium.error.InvalidAction(text)
        observation, reward, done, cut, info = self._rows.step(given[None])
        self._ended = bool(done[0] or cut[0])
        return observation[0], float(reward[0]), bool(done[0]), bool(cut[0]), _alone(info)

    def render(self) -> ByteArray | list[Any] | None:
        """Picture (height, width, 3) from behind and above the boat, or a list of them, as `VectorEnv.render`."""
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
        check_name("problem", problem, ALONE)
        most = -1 if duration is None else episode_steps(PROBLEMS[problem].duration)
        super().__init__(problem, duration=duration, max_episode_steps=most, **options)


def _reset_mode(mode: object) -> AutoresetMode:
    """Gymnasium's mode of a name, which says when rows are reset; gymnasium.error.Error: it has no such mode."""
    try:
        return AutoresetMode(mode)
    except (TypeError, ValueError):
        known = ", ".join(repr(one.value) for one in AutoresetMode)
        raise gymnasium.error.Error(f"invalid autoreset_mode {quote(mode)}: one of {known} is needed") from None


def _alone(info: Info) -> Info:
    """`info` of the only row: plain numbers, and copies of arrays."""
    own = {name: value[0] for name, value in info.items() if not name.startswith("_")}
    return {name: value.copy() if np.ndim(value) else value.item() for name, value in own.items()}


for _name in ALONE:
    gymnasium.register(
        f"vrx_mj/{_name}-v0",
        entry_point="vrx_mj.rl.gym:RegisteredEnv",
        vector_entry_point="vrx_mj.rl.gym:VectorEnv",
        max_episode_steps=episode_steps(PROBLEMS[_name].duration),
        kwargs={"problem": _name},
    )
