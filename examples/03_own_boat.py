"""A boat of your own: a plain URDF and the YAML beside it. Here the skiff, which has one propeller and a rudder.

Run it with `python examples/03_own_boat.py`.
"""

import math
import sys
from collections.abc import Mapping
from pathlib import Path

import vrx_mj

COURSE = math.radians(60.0)
GAIN = 1.0  # rudder per rad off the course: full rudder, 0.6 rad, at 35 degrees
DAMPING = 1.2  # rudder per rad/s of turning: no overshoot

LAKE = {"physics": {"profile": "marine"}, "sea": {"gain": 0.1}}
FLEET = {"robot": "skiff", "boats": [{"name": "skiff", "pose": [0, 0, 0, 0, 0, 0]}]}


def controller(obs: Mapping[str, vrx_mj.BoatObservation], t: float) -> dict[str, dict[str, float]]:
    """A PD law on the heading. A positive rudder turns the bow to starboard, so its signs are those of the error."""
    boat = obs["skiff"]
    off = math.remainder(boat.heading - COURSE, math.tau)
    rudder = GAIN * off + DAMPING * float(boat.angular_velocity[2])
    return {"skiff": {"propeller": 0.7, "rudder_angle": max(-0.6, min(0.6, rudder))}}


def main(path: Path = Path("own_boat.rrd"), duration: float = 60.0) -> vrx_mj.Summary:
    """Sail a course, record, and say how it ended."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(LAKE, fleet=FLEET))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=controller)
    boat = summary.boats["skiff"]
    print(f"course {math.degrees(boat.heading):.1f} degrees after {boat.distance:.0f} m; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
