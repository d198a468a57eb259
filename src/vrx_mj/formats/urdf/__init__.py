"""Robots as ROS describes them: xacro and URDF, with Gazebo's tags."""
