"""ROS 1 in pure Python: master, node, topics, services and parameters on asyncio, without rospy."""

from vrx_mj.ros.ros1.node import Ros1

__all__ = ["Ros1"]
