"""Keeps a heading by a PID loop that divides by the time between two messages, by their stamps and by the clock."""

import math

import rospy
from sensor_msgs.msg import Imu
from std_msgs.msg import Float32

GOAL = math.radians(60.0)

rospy.init_node("pid")
left = rospy.Publisher("/wamv/thrusters/left_thrust_cmd", Float32, queue_size=1)
right = rospy.Publisher("/wamv/thrusters/right_thrust_cmd", Float32, queue_size=1)
before, total, faults = None, 0.0, []


def control(imu):
    """One turn of the loop."""
    global before, total  # noqa: PLW0603 - as such nodes are written
    q, stamp = imu.orientation, imu.header.stamp.to_sec()
    now = max(rospy.get_time(), stamp)  # the clock comes on a connection of its own, which may be later
    heading = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    if before is not None:
        error = math.remainder(GOAL - heading, math.tau)
        try:
            rate = math.remainder(heading - before[0], math.tau) / (stamp - before[1])
            total = max(-1.0, min(1.0, total + error * (stamp - before[1]) / (now - before[2]) / 15.0))
        except ZeroDivisionError:
            faults.append(f"stamps {before[1]}, {stamp}, times {before[2]}, {now}")
            return
        moment = 1.2 * error + 0.05 * total - 2.0 * rate
        left.publish(max(-1.0, min(1.0, -moment)))
        right.publish(max(-1.0, min(1.0, moment)))
    before = heading, stamp, now


while not left.get_num_connections() or not right.get_num_connections():
    rospy.sleep(0.1)
rospy.Subscriber("/wamv/sensors/imu/imu/data", Imu, control, queue_size=1)
print("ready", flush=True)
rospy.spin()
print("heading", math.degrees(before[0]), "faults", faults, flush=True)
