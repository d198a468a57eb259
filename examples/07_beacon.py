"""Find an acoustic beacon by noisy ranges and bearings; VRX 3's boat, whose commands are newtons.

Run it with `python examples/07_beacon.py`, or from this folder as a controller of a run:
`vrx-mj run vrx2023/acoustic_perception_task --control 07_beacon:Controller`. `vrx_mj.control:BeaconFollower` stays with
one that swims.
"""

import sys
from pathlib import Path

import vrx_mj
from vrx_mj.control import BeaconSeeker as Controller


def main(path: Path = Path("beacon.rrd"), duration: float | None = None) -> vrx_mj.Summary:
    """Sail, record, and say what the task gave; without a duration, to the task's end."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("vrx2023/acoustic_perception_task"))
    with vrx_mj.record(sim, path):
        summary = vrx_mj.run(sim, duration, controller=Controller())
    print(f"{summary.task.state} after {summary.task.elapsed:.1f} s; vrx-mj replay {path}")
    return summary


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
