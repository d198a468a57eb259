"""Keep a heading with two engines, and record it.

Run it with `python examples/01_heading.py`, or from this folder as a controller of a run:
`vrx-mj run my_course --control 01_heading:controller`.
"""

import math
import sys
from collections.abc import Mapping
from pathlib import Path

import vrx_mj

HEADING = math.radians(45.0)
AHEAD = 0.5  # of full power
GAIN = 0.8  # power per rad: a quarter turn off, and the inner engine nearly stops
DAMPING = 0.6  # power per rad/s: about critical with the WAM-V's yaw inertia


def controller(obs: Mapping[str, vrx_mj.BoatObservation], t: float) -> dict[str, dict[str, float]]:
    """A PD law on the heading, for every boat."""
    commands = {}
    for name, boat in obs.items():
        off = math.remainder(HEADING - boat.heading, math.tau)
        turn = GAIN * off - DAMPING * float(boat.angular_velocity[2])
        turn = max(-AHEAD, min(AHEAD, turn))
        commands[name] = {"left": AHEAD - turn, "right": AHEAD + turn}
    return commands


def main(path: Path = Path("heading.rrd"), duration: float = 60.0) -> vrx_mj.Summary:
    """Sail, record, and say how it ended."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("my_course"))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=controller)
    boat = summary.boats["wamv"]
    print(f"heading {math.degrees(boat.heading):.1f} degrees after {boat.distance:.0f} m; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
