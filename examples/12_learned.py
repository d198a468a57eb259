"""Keep station with a policy that was learned, beside `vrx_mj.control:StationKeeper`, on seeds that neither has seen.

Run it with `python examples/12_learned.py`. `train_station_keeping.py` made `station_keeping_policy.npz`. The policy
sees the boat's true state and the wind, as an anemometer gives it; the controller has GPS and an inertial unit.
"""

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import vrx_mj
from vrx_mj.control import StationKeeper

POLICY = Path(__file__).with_name("station_keeping_policy.npz")
SEEDS = range(1000, 1020)
DURATION = 60.0


class Learned:
    """A policy as a controller of the boat `wamv`."""

    def __init__(self, sim: vrx_mj.Simulation, path: Path = POLICY) -> None:
        weights = np.load(path)
        self.layers = [(weights[f"weight{k}"], weights[f"bias{k}"]) for k in range(len(weights.files) // 2)]
        self.hold = int(weights["hold"])  # calls for which a decision holds
        self.sim, self.last, self.calls = sim, np.zeros(4, np.float32), 0

    def __call__(self, obs: Mapping[str, Any], t: float) -> dict[str, Any]:
        """Commands of the boat, once the task has given its goal."""
        goal = obs["task"].get("goal")
        if goal is None:
            return {}
        if self.calls % self.hold == 0:
            self.last = self.decision(self.observation(obs["wamv"], goal, self.sim.wind.velocity(t)))
        self.calls += 1
        left, right, left_angle, right_angle = self.last.tolist()
        angles = {"left_angle": left_angle * math.pi / 2, "right_angle": right_angle * math.pi / 2}
        return {"wamv": {"left": left, "right": right, **angles}}

    def decision(self, values: np.ndarray) -> np.ndarray:
        """What the network says."""
        for weight, bias in self.layers[:-1]:
            values = np.maximum(weight @ values + bias, 0.0)
        weight, bias = self.layers[-1]
        return np.tanh(weight @ values + bias)

    def observation(self, boat: Any, goal: Mapping[str, float], wind: np.ndarray) -> np.ndarray:
        """What `vrx_mj/StationKeeping-v0` observes (docs/learning.md)."""
        cos, sin = math.cos(boat.heading), math.sin(boat.heading)
        east, north = goal["x"] - boat.position[0], goal["y"] - boat.position[1]
        turn = goal["yaw"] - boat.heading
        (u, v, _), (p, q, r) = boat.velocity, boat.angular_velocity
        own = [u / 3, v / 3, r / 0.5, boat.roll / 0.3, boat.pitch / 0.3, p / 0.5, q / 0.5,
               (cos * wind[0] + sin * wind[1]) / 10, (cos * wind[1] - sin * wind[0]) / 10]  # fmt: skip
        ahead, port = cos * east + sin * north, cos * north - sin * east
        task = [ahead / 10, port / 10, ahead, port, math.sin(turn), math.cos(turn)]
        return np.clip(np.array([*own, *self.last, *task]), -5.0, 5.0).astype(np.float32)


def world(seed: int) -> dict[str, Any]:
    """Open water with a goal within 10 m, wind up to 8 m/s, and waves: drawn from a seed."""
    draw = np.random.default_rng(seed)
    distance, bearing = 10 * math.sqrt(draw.random()), draw.uniform(-math.pi, math.pi)
    goal = [distance * math.cos(bearing), distance * math.sin(bearing), draw.uniform(-math.pi, math.pi)]
    return {
        "extends": "ocean",
        "georeference": {"latitude": -33.72, "longitude": 150.67, "elevation": 0, "heading": 0},
        "sea": {"model": "pms", "number": 3, "scale": 1.5, "gain": 0.2 * draw.random(), "period": 5,
                "direction": [1, 0.5], "angle": 0.4, "tau": 2},
        "wind": {"direction": draw.uniform(0, 360), "mean_velocity": draw.uniform(0, 8), "var_time": 5,
                 "var_gain": draw.uniform(0, 1.5), "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
        "spawn": {"pose": [0, 0, 0.1, 0, 0, draw.uniform(-math.pi, math.pi)]},
        "task": {"type": "stationkeeping", "goal_cart": goal, "initial_state_duration": 0,
                 "ready_state_duration": 0, "running_state_duration": DURATION},
    }  # fmt: skip


def score(seed: int, kind: str, path: Path | None = None, duration: float = DURATION) -> vrx_mj.Summary:
    """Sail one seed with one of both, recorded if there is a path."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world(seed), seed=seed))
    controller = Learned(sim) if kind == "learned" else StationKeeper()
    if path is None:
        return vrx_mj.run(sim, duration, controller=controller)
    with vrx_mj.record(sim, path):
        return vrx_mj.run(sim, duration, controller=controller)


def main(path: Path = Path("learned.rrd"), duration: float = DURATION) -> vrx_mj.Summary:
    """Sail all seeds with both, and record the policy on the first."""
    seeds = SEEDS if duration == DURATION else SEEDS[:2]
    summary = score(seeds[0], "learned", path, duration)
    table = np.array(
        [[score(seed, kind, None, duration).task.score for kind in ("learned", "keeper")] for seed in seeds]
    )
    for seed, (learned, keeper) in zip(seeds, table, strict=True):
        print(f"seed {seed}: mean error {learned:6.3f} m learned, {keeper:6.3f} m StationKeeper")
    better = int((table[:, 0] < table[:, 1]).sum())
    print(f"mean of {len(seeds)}: {table[:, 0].mean():.3f} m learned, {table[:, 1].mean():.3f} m StationKeeper; "
          f"the policy is better in {better}; vrx-mj replay {path}")  # fmt: skip
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
