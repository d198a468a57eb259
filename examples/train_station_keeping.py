"""Train a policy to keep station, with SAC of stable-baselines3: a quarter of an hour on two cores.

In a clone: `pip install '.[rl]' stable-baselines3`, then
`python examples/train_station_keeping.py [minutes] [policy.npz]`. `12_learned.py` sails what was
learned, and compares it with `vrx_mj.control:StationKeeper`; it needs neither package.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from vrx_mj.rl import VectorEnv

POLICY = Path(__file__).with_name("station_keeping_policy.npz")
MINUTES = 14.0
ROWS = 96
HOLD = 4
"""Steps of the environment for which a decision holds, 0.4 s: an episode is 150 decisions."""
GRADIENTS = 8
"""Steps of learning for each decision of all rows."""
RATE = 1e-3
"""Of learning; it falls with the time that is left."""
WEIGHT = 0.3
"""Of the root of the error [m] in what a step is worth: the environment's own reward goes with the error itself, which
is nearly all of the way there, and leaves little to gain in holding the last decimetres."""
VARIED = {"wind_speed": (0, 8), "gusts": (0, 1.5), "waves": (0, 1), "mass": (0.95, 1.05), "thrust": (0.9, 1.1)}


class Rows(VecEnv):
    """The rows of a `VectorEnv` as stable-baselines3 wants them."""

    def __init__(self, rows: VectorEnv) -> None:
        self.rows = rows
        super().__init__(rows.num_envs, rows.single_observation_space, rows.single_action_space)

    def reset(self) -> np.ndarray:
        """Begin an episode in every row."""
        return self.rows.reset(seed=1)[0]

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the decisions."""
        self.decisions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Act on the decisions. A row whose episode ends within a hold begins the next one under the same decision."""
        total, over = np.zeros(self.num_envs), np.zeros(self.num_envs, np.bool_)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for _ in range(HOLD):
            observation, reward, done, cut, info = self.rows.step(self.decisions)
            last = info.get("final_info", {})  # zeros where rows go on, as `info` has for those that ended
            errors = info.get("pose_error", 0.0) + last.get("pose_error", 0.0)
            total += np.where(over, 0.0, np.where(done, reward, -WEIGHT * np.sqrt(errors)))  # a lost boat forfeits
            for row in np.flatnonzero((done | cut) & ~over):
                infos[row] = {"terminal_observation": info["final_obs"][row], "TimeLimit.truncated": not done[row],
                              "error": float(last["mean_pose_error"][row])}  # fmt: skip
            over |= done | cut
        return observation, total / HOLD, over, infos

    def close(self) -> None:
        """Let go."""
        self.rows.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """What all rows have in common."""
        return [getattr(self.rows, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Nothing can be set."""
        raise NotImplementedError

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Rows have no methods of their own."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Nothing is wrapped."""
        return [False] * self.num_envs


class Clock(BaseCallback):
    """Ends when time is up, lets the rate of learning fall until then, and prints the mean error every 20 s."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self.seconds, self.begun, self.printed = seconds, time.perf_counter(), 0.0
        self.errors: list[float] = []

    @property
    def spent(self) -> float:
        """Time since the start [s]."""
        return time.perf_counter() - self.begun

    def rate(self, _progress: float = 0.0) -> float:
        """Of learning, now."""
        return RATE * max(0.01, 1.0 - self.spent / self.seconds)

    def _on_step(self) -> bool:
        self.errors += [info["error"] for info in self.locals["infos"] if "error" in info]
        if self.spent > self.printed + 20.0 and self.errors:
            self.printed = self.spent
            recent = np.mean(self.errors[-100:])
            print(f"{self.spent:4.0f} s, {self.num_timesteps:6} decisions, mean error {recent:.2f} m", flush=True)
        return self.spent < self.seconds


def keep(model: SAC, path: Path) -> None:
    """Write the weights of the policy alone, layer by layer: ReLU between them, tanh at the end."""
    layers = [layer for layer in model.policy.actor.latent_pi if hasattr(layer, "weight")]
    weights = {"hold": np.array(HOLD)}
    for number, layer in enumerate([*layers, model.policy.actor.mu]):
        weights[f"weight{number}"] = layer.weight.detach().numpy().astype(np.float32)
        weights[f"bias{number}"] = layer.bias.detach().numpy().astype(np.float32)
    np.savez(path, **weights)


def main(minutes: float = MINUTES, path: Path = POLICY) -> None:
    """Train for so long, and keep the policy."""
    torch.set_num_threads(1)  # networks as small as these are not worth sharing out
    rows = Rows(VectorEnv("StationKeeping", ROWS, autoreset_mode="SameStep", **VARIED))
    clock = Clock(60.0 * minutes)
    model = SAC("MlpPolicy", rows, learning_rate=clock.rate, batch_size=256, gamma=0.98, train_freq=1,
                gradient_steps=GRADIENTS, learning_starts=5000, buffer_size=500_000, seed=1,
                device="cpu", policy_kwargs={"net_arch": {"pi": [64, 64], "qf": [128, 128]},
                                               "optimizer_kwargs": {"fused": True}})  # fmt: skip
    model.learn(10**9, callback=clock)
    keep(model, path)
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


def arguments(texts: Sequence[str]) -> tuple[float, Path]:
    """Minutes and path that a command line says."""
    return float(texts[0]) if texts else MINUTES, Path(texts[1]) if texts[1:] else POLICY


if __name__ == "__main__":
    main(*arguments(sys.argv[1:]))
