"""ROS: the simulation's topics and services, and the networks on which they are offered."""
