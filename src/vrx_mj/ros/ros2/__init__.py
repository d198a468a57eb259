"""A table on ROS 2, by the rclpy that the user has."""

from vrx_mj.ros.ros2.node import Ros2

__all__ = ["Ros2"]
