"""A guidance that commands a twist, and the team's own mixer of it, on the name between them: /wamv/cmd_vel."""

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Float32

rospy.init_node("mixer")
left = rospy.Publisher("/wamv/thrusters/left_thrust_cmd", Float32, queue_size=1)
right = rospy.Publisher("/wamv/thrusters/right_thrust_cmd", Float32, queue_size=1)


def mix(twist):
    left.publish(0.2 * twist.linear.x - 0.1 * twist.angular.z)
    right.publish(0.2 * twist.linear.x + 0.1 * twist.angular.z)


guidance = rospy.Publisher(rospy.get_param("~topic", "/wamv/cmd_vel"), Twist, queue_size=1)
rospy.Subscriber(rospy.get_param("~topic", "/wamv/cmd_vel"), Twist, mix, queue_size=1)
rate = rospy.Rate(10)
while not left.get_num_connections() or not guidance.get_num_connections():
    rate.sleep()
print("ready", flush=True)
twist = Twist()
twist.linear.x = 1.0
while not rospy.is_shutdown():
    guidance.publish(twist)
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
