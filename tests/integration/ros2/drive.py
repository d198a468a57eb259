"""Drives a boat that vrx-mj serves, by VRX 3's names: prints how fast it moved and what it saw. Needs rclpy."""

import json
import sys
import time

import rclpy
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, Imu
from std_msgs.msg import Float64, String

LONGEST = 90.0
STEM = "/wamv/sensors"
LOCALIZED = "/wamv/robot_localization/odometry/filtered"


def main():
    rclpy.init(args=[])
    node = rclpy.create_node("driver")
    got = {}

    def listen(kind, topic, qos=10):
        return node.create_subscription(kind, topic, lambda one: got.__setitem__(topic, one), qos)

    listen(Clock, "/clock", qos_profile_sensor_data)
    listen(Imu, f"{STEM}/imu/imu/data")
    listen(Odometry, f"{STEM}/position/ground_truth_odometry")
    listen(String, "/wamv/robot_description", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    listen(Odometry, LOCALIZED)
    camera = listen(Image, f"{STEM}/cameras/front_camera_sensor/image_raw", qos_profile_sensor_data)
    thrusts = [node.create_publisher(Float64, f"/wamv/thrusters/{side}/thrust", 10) for side in ("left", "right")]

    def until(condition, why):
        end = time.monotonic() + LONGEST
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"{why}; came: {sorted(got)}")
            rclpy.spin_once(node, timeout_sec=0.05)

    until(lambda: all(one.get_subscription_count() for one in thrusts), "thrusters")
    until(lambda: len(got) == 6, "sensors")
    node.destroy_subscription(camera)  # drawing slows a machine without a graphics card down
    for one in thrusts:
        one.publish(Float64(data=200.0))  # once: it lasts
    begun = seconds(got)
    until(lambda: seconds(got) > begun + 3.0, "three seconds")
    speed = got[f"{STEM}/position/ground_truth_odometry"].twist.twist.linear.x
    filtered, true = got[LOCALIZED], got[f"{STEM}/position/ground_truth_odometry"].pose.pose.position
    found = filtered.pose.pose.position
    image = got[f"{STEM}/cameras/front_camera_sensor/image_raw"]
    description = got["/wamv/robot_description"].data
    rclpy.shutdown()
    size = [image.width, image.height, len(image.data), image.header.frame_id]
    frames = [filtered.header.frame_id, filtered.child_frame_id, bool(filtered.pose.covariance[0] > 0.0)]
    told = {"speed": speed, "image": size, "robot": description[:200], "frames": frames}
    json.dump(told | {"apart": [found.x - true.x, found.y - true.y, found.z - true.z]}, sys.stdout)


def seconds(got):
    return got["/clock"].clock.sec + 1e-9 * got["/clock"].clock.nanosec


main()
