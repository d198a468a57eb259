"""Drive the boats of a served world in circles, by roslibpy: no ROS on either side.

First `vrx-mj serve example_course --fleet usv_config --rosbridge`, then `python examples/13_roslibpy_circle.py`.
"""

import argparse
import time
from collections.abc import Sequence
from typing import Any

import roslibpy

BOATS = ("wamv1", "wamv2", "wamv3")
CIRCLE = {"linear": {"x": 0.7}, "angular": {"z": 0.2}}  # of full thrust: left 0.5, right 0.9
PERIOD = 0.2  # of commands [s]; a thrust lasts 1 s


def main(host: str = "127.0.0.1", port: int = 9090, seconds: float = 60.0, boats: Sequence[str] = BOATS) -> None:
    """Drive, and say how far each boat has got around."""
    ros = roslibpy.Ros(host, port)
    ros.run()
    seen: dict[str, list[tuple[float, float]]] = {boat: [] for boat in boats}
    states = roslibpy.Topic(ros, "/gazebo/model_states", "gazebo_msgs/ModelStates", throttle_rate=500)

    def note(message: dict[str, Any]) -> None:
        for name, pose in zip(message["name"], message["pose"], strict=True):
            if name in seen:
                seen[name].append((pose["position"]["x"], pose["position"]["y"]))

    states.subscribe(note)
    topics = [roslibpy.Topic(ros, f"/{boat}/cmd_vel", "geometry_msgs/Twist") for boat in boats]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for topic in topics:
            topic.publish(roslibpy.Message(CIRCLE))
        time.sleep(PERIOD)
    ros.terminate()
    for boat, places in seen.items():
        across = max(max(axis) - min(axis) for axis in zip(*places, strict=True))
        print(f"{boat}: {len(places)} places, {across:.1f} m across")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9090)
    parser.add_argument("--seconds", type=float, default=60.0)
    main(**vars(parser.parse_args()))
