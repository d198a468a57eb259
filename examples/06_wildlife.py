"""Circle platypus and turtle, and keep away from the crocodile: guidance by a vector field.

Run it with `python examples/06_wildlife.py`, or from this folder as a controller of a run:
`vrx-mj run wildlife_task --control 06_wildlife:Controller`.
"""

import sys
from pathlib import Path

import vrx_mj
from vrx_mj.control import WildlifeCircler as Controller


def main(path: Path = Path("wildlife.rrd"), duration: float | None = None) -> vrx_mj.Summary:
    """Sail, record, and say what the task gave; without a duration, to the task's end."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("wildlife_task"))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=Controller())
    for time, text, _ in summary.task.events:
        print(f"{time:6.1f} s  {text}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
