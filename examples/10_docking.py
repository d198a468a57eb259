"""Read a light buoy, find the dock's bay with the right symbol, dock in it and back out.

Run it with `python examples/10_docking.py`, or from this folder as a controller of a run:
`vrx-mj run vrx2019/phase2/dock1 --control 10_docking:Controller`.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import vrx_mj
from vrx_mj.control import Docking


class Controller(Docking):
    """Says what it reads."""

    def reset(self, seed: int) -> None:
        """Before a new run."""
        super().reset(seed)
        self._printed: set[str] = set()

    def __call__(self, obs: Mapping[str, Any], t: float) -> dict[str, Any]:
        """Steer, and print the lights and placards that were read."""
        commands = super().__call__(obs, t)
        news = [f"lights {', '.join(colors)}" for colors in [commands.get("task", {}).get("color_sequence")] if colors]
        news += [f"placard {face.symbol}" for face in self.lookout.faces if face.symbol]
        for text in news:
            if text not in self._printed:
                print(f"{t:5.1f} s  {text}")
        self._printed.update(news)
        return commands


def main(path: Path = Path("docking.rrd"), duration: float | None = None) -> vrx_mj.Summary:
    """Sail, record, and say what the task gave; without a duration, to the task's end."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("vrx2022/phase2/scan_dock_deliver1"))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=Controller())
    print(f"{summary.task.score:g} {summary.task.unit} after {summary.task.elapsed:.0f} s; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
