"""Files of Gazebo and of VRX read as they are: worlds, models and launch files become documents of ours."""
