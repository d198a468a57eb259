#!/usr/bin/python3
"""Thrusts for two engines of the twist on cmd_vel, by VRX's names and rules: left_cmd and right_cmd.

Without an option a twist is two sticks, as of a gamepad: left = linear.x, right = angular.z. With --keyboard it is one:
left = linear.x - angular.z, right = linear.x + angular.z. The service ball_shooter fires, where the simulation does not
offer it by the same name. While this node runs, the simulation leaves cmd_vel of the boat to it.
"""

import sys

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Empty, Float32

FIRE = "/wamv/shooters/ball_shooter/fire"


def main():
    """Run until it is ended."""
    rospy.init_node("twist2drive", anonymous=True)
    left, right = (rospy.Publisher(name, Float32, queue_size=10) for name in ("left_cmd", "right_cmd"))
    is_one_stick = "--keyboard" in sys.argv

    def mix(twist):
        ahead, around = twist.linear.x, twist.angular.z
        left.publish(ahead - around if is_one_stick else ahead)
        right.publish(ahead + around if is_one_stick else around)

    rospy.Subscriber("cmd_vel", Twist, mix)
    if rospy.resolve_name("ball_shooter") != "/ball_shooter":
        offer_ball_shooter()
    rospy.spin()


def offer_ball_shooter():
    """Offer the service in the node's namespace, if its type is there."""
    try:
        from vrx_gazebo.srv import BallShooter
    except ImportError:
        rospy.loginfo("no service ball_shooter: vrx-mj ros messages writes the messages of vrx_gazebo")
        return
    fire = rospy.Publisher(FIRE, Empty, queue_size=1)

    def shoot(_request):
        fire.publish()
        return True

    rospy.Service("ball_shooter", BallShooter, shoot)


if __name__ == "__main__":
    main()
