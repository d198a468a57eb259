"""A node that keeps a station by a message of the team's own."""

import math

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32
from team.msg import Effort

rospy.init_node("keeper")
left = rospy.Publisher("/wamv/thrusters/left_thrust_cmd", Float32, queue_size=1)
right = rospy.Publisher("/wamv/thrusters/right_thrust_cmd", Float32, queue_size=1)
effort = rospy.Publisher("/team/effort", Effort, queue_size=1)
start = []


def on_odometry(odometry):
    at = odometry.pose.pose.position
    if not start:
        start.extend((at.x, at.y))
        rospy.loginfo("the boat is at %.1f, %.1f in %s", at.x, at.y, odometry.header.frame_id)
    away = math.hypot(at.x - start[0], at.y - start[1])
    thrust = 0.4 if away < 4.0 else 0.0
    left.publish(thrust)
    right.publish(thrust)
    effort.publish(Effort(left=thrust, right=thrust))
    if away >= 4.0:
        rospy.loginfo_throttle(1.0, "4 m are behind us")


rospy.Subscriber("/wamv/robot_localization/odometry/filtered", Odometry, on_odometry, queue_size=1)
rospy.spin()
