#!/usr/bin/python3
"""A beacon that is somewhere else every 10 s: one of the places ~position_1, ~position_2, ... [m], or the origin.

The simulation shows the place by a marker.
"""

import itertools
import random

import rospy
from geometry_msgs.msg import Vector3

TOPIC = "/wamv/sensors/pingers/pinger/set_pinger_position"
PERIOD = 10.0


def main():
    """Run until it is ended."""
    rospy.init_node("set_pinger_position")
    names = (f"~position_{number}" for number in itertools.count(1))
    places = [rospy.get_param(name) for name in itertools.takewhile(rospy.has_param, names)] or [[0, 0, 0]]
    topic = rospy.Publisher(TOPIC, Vector3, queue_size=10, latch=True)
    while not rospy.is_shutdown():
        topic.publish(*random.choice(places))
        try:
            rospy.sleep(PERIOD)
        except rospy.ROSInterruptException:
            return


if __name__ == "__main__":
    main()
