"""Hold a pose in the wind: the task of station-keeping, with the parts of `vrx_mj.control` put together by hand.

Run it with `python examples/04_station_keeping.py`, or from this folder as a controller of a run:
`vrx-mj run stationkeeping_task --control 04_station_keeping:Controller`. The package's own, which also goes far, is
`vrx_mj.control:StationKeeper`.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import vrx_mj
from vrx_mj.control.navigation import Navigator
from vrx_mj.control.pilot import Pilot
from vrx_mj.control.velocity import craft_of

WORLD = "vrx2022/phase2/stationkeeping2"  # a wind of 7 m/s, gusts of 1.5 m/s


class Controller:
    """Dynamic positioning: sensors to an estimate, the goal to a velocity, that to forces, and those to thrusters."""

    def reset(self, seed: int) -> None:
        """Before a run."""
        self.navigator, self.pilot = Navigator(), None

    def __call__(self, obs: Mapping[str, Any], t: float) -> dict[str, Any]:
        """Commands of the boat, once the task has given its goal."""
        boat, goal = obs["wamv"], obs["task"].get("goal")
        self.pilot = self.pilot or Pilot(boat.thrusters, craft_of(boat))
        seen = self.navigator(boat, t)  # GPS and inertial unit
        if goal is None:
            return {}
        x, y = self.navigator.place(goal)  # latitude and longitude to metres
        return {"wamv": self.pilot.hold(seen, t, x, y, goal["yaw"])}


def main(path: Path = Path("station_keeping.rrd"), duration: float | None = None) -> vrx_mj.Summary:
    """Sail, record, and say what the task gave; without a duration, to the task's end."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(WORLD))
    controller = Controller()
    controller.reset(sim.seed)
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=controller)
    print(f"mean error {summary.task.score:.3f} {summary.task.unit} so far; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
