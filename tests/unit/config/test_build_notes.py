"""What is said of files of other people's robots: libraries of macros, and names that ROS refuses."""

import pytest

from urdf_boats import joint, link, robot, thruster
from vrx_mj.config.fleet import Order
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.mjcf.build import build_boat

WATER = '<gazebo><plugin name="water" filename="libusv_gazebo_dynamics_plugin.so"/></gazebo>'
GPS = '<gazebo reference="base_link"><sensor type="gps" name="top.gps"><update_rate>5</update_rate></sensor></gazebo>'
ALLOWED = "a letter, then letters, digits and '_' are allowed"


def test_a_library_of_macros_is_no_robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    macros = "".join(f'<xacro:macro name="{name}" params="x"><link name="${{x}}"/></xacro:macro>' for name in "ab")
    text = f'<robot name="parts" xmlns:xacro="http://www.ros.org/wiki/xacro">{macros}</robot>'
    (tmp_path / "parts.xacro").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        build_boat(Order("parts.xacro", tmp_path))
    assert str(caught.value) == ("parts.xacro: robot: only defines macros: 'a', 'b'; name the file that uses them")


def test_names_that_ros_refuses_are_said(tmp_path):
    shaft = joint("shaft", "back-left_propeller", kind="continuous")
    text = robot(link("back-left_propeller"), shaft, thruster("back-left"), WATER, GPS)
    (tmp_path / "boat.urdf").write_text(text, encoding="utf-8")
    with pytest.warns(VrxWarning) as said:
        build_boat(Order("boat.urdf", tmp_path))
    (text,) = [str(item.message) for item in said]
    assert text == (
        "robot boat.urdf:\n"
        f"ROS refuses topics with the name of thruster 'back-left': {ALLOWED}\n"
        f"ROS refuses topics with the name of sensor 'top.gps': {ALLOWED}"
    )
