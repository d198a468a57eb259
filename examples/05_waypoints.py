"""Visit waypoints in an order of your own: a controller of `vrx_mj.control`, with one of its decisions taken anew.

Run it with `python examples/05_waypoints.py`, or from this folder as a controller of a run:
`vrx-mj run wayfinding_task --control 05_waypoints:Controller`. `vrx_mj.control:WaypointFollower` takes the shortest
way.
"""

import sys
from pathlib import Path

import vrx_mj
from vrx_mj.control import WaypointFollower
from vrx_mj.control.navigation import Estimate


class Controller(WaypointFollower):
    """Takes the waypoints as the task gives them."""

    def order(self, seen: Estimate, places: list[tuple[float, float]]) -> list[int]:
        """The first first."""
        return list(range(len(places)))


def main(path: Path = Path("waypoints.rrd"), duration: float | None = None) -> vrx_mj.Summary:
    """Sail, record, and say what the task gave; without a duration, to the task's end."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("wayfinding_task"))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=Controller())
    print(f"mean of the smallest errors {summary.task.score:.3f} {summary.task.unit} so far; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
