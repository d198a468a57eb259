"""What a boat senses: where it is, how it moves, and what its lidar sees ahead.

Run it with `python examples/02_sensors.py`.
"""

import sys
from pathlib import Path

import numpy as np

import vrx_mj


def nearest_ahead(cloud: vrx_mj.PointCloud) -> float:
    """Distance [m] to the nearest return within 30 degrees of the bow; nearer than 4 m is the boat itself."""
    x, y = cloud.points[:, 0], cloud.points[:, 1]
    away = np.hypot(x, y)
    ahead = away[(away > 4.0) & (np.abs(np.arctan2(y, x)) < np.radians(30.0))]
    return float(ahead.min()) if len(ahead) else np.inf


def main(path: Path = Path("sensors.rrd"), duration: float = 60.0) -> float:
    """Sail ahead and look around once a second; returns the least distance to anything ahead [m]."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world("example_course"))
    sim.reset(seed=7)
    least = np.inf
    with vrx_mj.record(sim, path):
        for second in range(1, round(duration) + 1):
            sim.step({"wamv": {"left": 0.4, "right": 0.4}}, duration=1.0)
            readings = sim.sense("wamv")  # each is made when it is looked up, and only then
            fix, inertia, cloud = (readings[name].data for name in ("gps_wamv", "imu_wamv", "lidar_wamv"))
            seen = nearest_ahead(cloud)
            least = min(least, seen)
            print(
                f"{second:3d} s  {fix.latitude:.6f} {fix.longitude:.6f}  {np.hypot(*fix.velocity[:2]):.2f} m/s  "
                f"yaw rate {inertia.angular_velocity[2]:+.3f} rad/s  nearest ahead {seen:.1f} m"
            )
    return float(least)


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:2]))
