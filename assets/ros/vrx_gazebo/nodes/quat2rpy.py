#!/usr/bin/python3
"""Roll, pitch and yaw [rad] on out_topic, a Vector3, of the quaternions on in_topic.

~input_msg_type is Pose, Imu or Odometry. With ~model_name it is gazebo_msgs/ModelStates, of which that model is taken,
and with ~pose_index geometry_msgs/PoseArray, of which that pose is.
"""

import math

import rospy
from geometry_msgs.msg import Pose, PoseArray, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

KINDS = {
    "Pose": (Pose, lambda pose: pose.orientation),
    "Imu": (Imu, lambda imu: imu.orientation),
    "Odometry": (Odometry, lambda odometry: odometry.pose.pose.orientation),
}


def angles(q):
    """Roll, pitch and yaw of a quaternion."""
    roll = math.atan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (q.w * q.y - q.z * q.x))))
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    return roll, pitch, yaw


def wanted():
    """The type of the messages on in_topic, and what gives the quaternion of one, or None."""
    model, index = rospy.get_param("~model_name", None), rospy.get_param("~pose_index", None)
    if model is not None:
        from gazebo_msgs.msg import ModelStates

        def of_model(states):
            if model in states.name:
                return states.pose[states.name.index(model)].orientation
            rospy.logwarn_throttle(10.0, f"no model {model}; known: {', '.join(states.name)}")
            return None

        return ModelStates, of_model
    if index is not None:
        return PoseArray, lambda array: array.poses[index].orientation if index < len(array.poses) else None
    name = rospy.get_param("~input_msg_type", "Pose")
    if name not in KINDS:
        raise SystemExit(f"invalid input_msg_type '{name}'; allowed: {', '.join(KINDS)}")
    return KINDS[name]


def main():
    """Run until it is ended."""
    rospy.init_node("quat2rpy", anonymous=True)
    kind, orientation_of = wanted()
    out = rospy.Publisher("out_topic", Vector3, queue_size=10)

    def convert(message):
        quaternion = orientation_of(message)
        if quaternion is not None:
            out.publish(*angles(quaternion))

    rospy.Subscriber("in_topic", kind, convert)
    rospy.spin()


if __name__ == "__main__":
    main()
