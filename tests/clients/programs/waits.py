"""Waits for a service that no world has, as a typing mistake makes it, and goes on without it."""

import rospy
from std_msgs.msg import Float32

rospy.init_node("waits")
left = rospy.Publisher("/wamv/thrusters/left_thrust_cmd", Float32, queue_size=1)
right = rospy.Publisher("/wamv/thrusters/right_thrust_cmd", Float32, queue_size=1)
rate = rospy.Rate(10)
while not left.get_num_connections() or not right.get_num_connections():
    rate.sleep()
print("ready", flush=True)
for service in ("/gazebo/get_model_stat", "/vrx/reset_task", "/team/own_service"):
    try:
        rospy.wait_for_service(service, timeout=0.5)
        print("there is", service, flush=True)
    except rospy.ROSException as error:
        print("without", service, error, flush=True)
while not rospy.is_shutdown():
    left.publish(0.2)
    right.publish(0.2)
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
