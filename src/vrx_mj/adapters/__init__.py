"""Translations to other worlds: rerun, maps, gymnasium, ROS."""
