"""Find the gates of a buoyed channel with lidar and camera, and cross them, red to starboard.

Run it with `python examples/09_channel.py`, or from this folder as a controller of a run:
`vrx-mj run vrx2019/phase2/nav_challenge1 --control 09_channel:Controller`.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import vrx_mj
from vrx_mj.control import Gymkhana


class Controller(Gymkhana):
    """Says what it has found; in a gymkhana it goes on to the black box."""

    def reset(self, seed: int) -> None:
        """Before a new run."""
        super().reset(seed)
        self._printed = 0

    def __call__(self, obs: Mapping[str, Any], t: float) -> dict[str, Any]:
        """Steer, and print the buoys that are new."""
        commands = super().__call__(obs, t)
        known = [buoy for buoy in self.lookout.map.sure if buoy.kind]
        for buoy in known[self._printed :]:
            print(f"{t:5.1f} s  {buoy.kind} {buoy.x:6.1f} m east, {buoy.y:6.1f} m north of the start")
        self._printed = max(self._printed, len(known))
        return commands


def main(path: Path = Path("channel.rrd"), duration: float | None = None) -> vrx_mj.Summary:
    """Sail, record, and say what the task gave; without a duration, to the task's end."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("vrx2023/phase2/follow_path0"))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=Controller())
    print(f"{summary.task.score:g} {summary.task.unit} after {summary.task.elapsed:.0f} s; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
