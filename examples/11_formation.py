"""Seven boats go down a course in a wedge and change to a column, which fits through a gate.

It prints how far boats were off their slots, which follow the leader's track (`off`), and off their places in the rigid
shape, which turns with the leader's heading (`off_shape`).

Run it with `python examples/11_formation.py`.
"""

import math
import sys
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

import vrx_mj
from vrx_mj.control.formation import Formation
from vrx_mj.control.navigation import TangentPlane

ORIGIN = {"latitude": -33.724223, "longitude": 150.679736}
GATE = 88.0  # east of the start [m]
WIDTH = 12.0  # of the gate [m]
CALLS = 5.0  # of the controller [Hz]; half of the usual, for reading 14 sensors takes most of the time
PATH = [(0.0, -60.0), (45.0, 0.0), (GATE + 75.0, 0.0)]
CHANGE = 42.0  # when the wedge becomes a column: so far the leader has come [m]
FORMED = {"wedge": (32.0, CHANGE), "column": (112.0, math.inf)}  # from when to when each shall be kept [m]
WORLD = {
    "extends": "ocean",
    "georeference": {**ORIGIN, "elevation": 0, "heading": 0},
    "sea": {"model": "pms", "number": 3, "gain": 0.1, "period": 5, "direction": [1, 0.3], "angle": 0.4, "tau": 2},
    "wind": {
        "direction": 120,
        "mean_velocity": 3,
        "var_gain": 1,
        "var_time": 2,
        "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}],
    },
    "objects": [
        {"name": "red", "model": "mb_marker_buoy_red", "pose": [GATE, -WIDTH / 2, 0, 0, 0, 0]},
        {"name": "green", "model": "mb_marker_buoy_green", "pose": [GATE, WIDTH / 2, 0, 0, 0, 0]},
    ],
    "camera": [GATE - 60, -45, 30, 0, 0.5, 0.7],
}
FLEET = {  # on a line abreast, not in their places yet
    "usv_count": 7,
    "layout": "line",
    "spacing": 9,
    "origin": [-3.6, -64.8, 0.93],
    "thrusters": "H",
    "sensors": ["gps", "imu"],
}


class Controller(Formation):
    """A wedge that becomes a column, and what it was like."""

    def __init__(self) -> None:
        super().__init__(PATH, shape="wedge", spacing=12.0, origin=TangentPlane(**ORIGIN))

    def reset(self, seed: int) -> None:
        """Before a new run."""
        super().reset(seed)
        self.log: list[tuple[float, float, float, np.ndarray]] = []
        """How far the leader had come, the greatest `off` and `off_shape`, and where the boats were (7, 2) [m]."""

    def __call__(self, obs: Mapping[str, Any], t: float) -> dict[str, Any]:
        """Steer, change the shape when it is time, and write the log."""
        if self.shape == "wedge" and self.leader.along > CHANGE:
            self.change("column", 9.0)
        commands = super().__call__(obs, t)
        boats = np.array([boat.position[:2] for boat in obs.values()])
        self.log.append((self.leader.along, max(self.off.values()), max(self.off_shape.values()), boats))
        return commands

    def print_log(self) -> None:
        """Print how well the shapes were kept, how near the boats came, and how they passed the gate."""
        for shape, (start, end) in FORMED.items():
            kept = [entry[1:3] for entry in self.log if start <= entry[0] <= end]
            if kept:
                off, off_shape = np.max(kept, axis=0)
                print(f"{shape}: at most {off:.2f} m off the slots, {off_shape:.2f} m off the rigid shape")
        tracks = np.array([entry[-1] for entry in self.log])
        near = min(np.linalg.norm(tracks[:, i] - tracks[:, j], axis=1).min() for i, j in combinations(range(7), 2))
        print(f"boats kept {near:.1f} m apart, from middle to middle")
        passed = tracks[:, :, 0].max(axis=0) > GATE
        across = [float(np.interp(GATE, way[:, 0], way[:, 1])) for way in tracks.transpose(1, 0, 2)[passed]]
        if across:
            print(f"{len(across)} boats passed the gate, at most {max(map(abs, across)):.2f} m from its middle")


def main(path: Path = Path("formation.rrd"), duration: float = 127.0) -> vrx_mj.Summary:
    """Sail, record, and say how well the shapes were kept."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(WORLD, fleet=FLEET), seed=1)
    controller, touches = Controller(), 0

    def watched(obs: Mapping[str, vrx_mj.BoatObservation], t: float) -> dict[str, Any]:
        nonlocal touches
        touches += sim.data.ncon
        return controller(obs, t)

    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=watched, control_rate=CALLS)
    controller.print_log()
    print(f"{touches or 'no'} contacts of hulls and buoys; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
