"""Name and locate what shows up before the boat, by its camera.

Run it with `python examples/08_landmarks.py`, or from this folder as a controller of a run:
`vrx-mj run perception_task --control 08_landmarks:Controller`.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import vrx_mj
from vrx_mj.control import Perceiver


class Controller(Perceiver):
    """Says what it reports."""

    def __call__(self, obs: Mapping[str, Any], t: float) -> dict[str, Any]:
        """Look, and report."""
        sent = super().__call__(obs, t)
        for landmark in sent.get("task", {}).get("landmark", ()):
            print(f"{t:5.1f} s  {landmark['type']}  {landmark['latitude']:.6f} {landmark['longitude']:.6f}")
        return sent


def main(path: Path = Path("landmarks.rrd"), duration: float | None = None) -> vrx_mj.Summary:
    """Look, record, and say what the task gave; without a duration, to the task's end."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("perception_task"))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=Controller())
    print(f"error {summary.task.score:.2f} {summary.task.unit} so far; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
