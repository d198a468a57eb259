"""Asks for what cannot be: two publishers of one thrust, wrenches that are no numbers, or on a boat that leaves."""

import math
import subprocess

import rospy
from gazebo_msgs.srv import ApplyBodyWrench, ApplyBodyWrenchRequest, BodyRequest, DeleteModel
from std_msgs.msg import Float32

TOPIC = "/wamv/thrusters/left_thrust_cmd"
LINK, LEAVING = "wamv::wamv/base_link", "other::other/base_link"

rospy.init_node("hostile")
other = subprocess.Popen(["rostopic", "pub", "-r", "10", TOPIC, "std_msgs/Float32", "0.1"])
left = rospy.Publisher(TOPIC, Float32, queue_size=1)
for name in ("apply_body_wrench", "clear_body_wrenches", "delete_model"):
    rospy.wait_for_service(f"/gazebo/{name}")
apply_wrench = rospy.ServiceProxy("/gazebo/apply_body_wrench", ApplyBodyWrench)
clear = rospy.ServiceProxy("/gazebo/clear_body_wrenches", BodyRequest)
delete = rospy.ServiceProxy("/gazebo/delete_model", DeleteModel)
print("ready", flush=True)


def push(force, seconds=1.0, body=LINK):
    """Whether a push was taken, and why not."""
    asked = ApplyBodyWrenchRequest(body_name=body, duration=rospy.Duration(seconds))
    asked.wrench.force.x = force
    try:
        answer = apply_wrench(asked)
    except rospy.ServiceException as error:
        return f"failed: {error}"
    return "taken" if answer.success else answer.status_message


heard = []
rospy.Subscriber(TOPIC, Float32, lambda message: heard.append(round(message.data, 6)))
while heard.count(0.1) < 10 and not rospy.is_shutdown():
    left.publish(0.2)
    left.publish(math.nan)
    rospy.sleep(0.1)
for force in (math.nan, math.inf, 1e300, -1e300):
    print("force", force, push(force), flush=True)
print("lasting", push(100.0, -1.0, LEAVING), flush=True)
print("delete", delete("other").success, flush=True)
print("gone", push(100.0, 1.0, LEAVING), flush=True)
try:
    clear(LEAVING)
except rospy.ServiceException as error:
    print("clear", error, flush=True)
left.publish(0.2)
rospy.sleep(1.0)
other.terminate()
other.wait()
print("done", flush=True)
