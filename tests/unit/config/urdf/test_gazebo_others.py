"""Thrusters in the tags of the UUV simulator and of freefloating_gazebo, as the forces that they give."""

import pytest

from urdf_boats import assemble, joint, link
from vrx_mj.frames import apply, rotation

UUV, FREE = "libuuv_thruster_ros_plugin.so", "libfreefloating_gazebo_control.so"
NAMES = "<linkName>thruster_0</linkName><jointName>thruster_0_joint</jointName><thrusterID>0</thrusterID>"


def plugin(filename, content):
    return f'<gazebo><plugin name="p" filename="{filename}">{content}</plugin></gazebo>'


def boat_with(filename, content, kind="continuous", axis="1 0 0", rpy="0 0 0", limits=None):
    shaft = joint("thruster_0_joint", "thruster_0", xyz="-0.5 -0.4 -0.2", kind=kind, axis=axis, rpy=rpy, limits=limits)
    return assemble(link("thruster_0", 0.1), shaft, plugin(filename, content))


@pytest.mark.parametrize(
    ("content", "forward", "reverse"),
    [
        ("<thrustMax>60</thrustMax><thrustMin>-35</thrustMin>", 60, -35),
        ("<thrustMax>60</thrustMax>", 60, -60),
        ("<clampMax>100</clampMax><conversion><rotorConstant>0.004</rotorConstant></conversion>", 40, -40),
        ("<conversion><inputValues>-9 0 9</inputValues><outputValues>-5 0 7</outputValues></conversion>", 7, -7),
        ("<thrustMax>0</thrustMax><thrustMin>0</thrustMin>", 250, -250),
    ],
)
def test_the_largest_thrust_of_the_uuv_simulator(content, forward, reverse):
    (thruster,) = boat_with(UUV, NAMES + content).thrusters
    assert (thruster.name, thruster.link, thruster.joint) == ("thruster_0", "thruster_0", None)
    assert (thruster.drive.max_force_forward, thruster.drive.max_force_reverse) == (forward, reverse)
    assert thruster.pose[:3] == (-0.5, -0.4, -0.2)


@pytest.mark.parametrize(("axis", "direction"), [("1 0 0", (1, 0, 0)), ("0 0 2", (0, 0, 1)), ("-1 0 0", (-1, 0, 0))])
def test_the_uuv_simulators_thrust_is_along_the_axis_of_the_joint(axis, direction):
    (thruster,) = boat_with(UUV, NAMES, axis=axis).thrusters
    assert thruster.direction == direction


def test_a_thruster_of_freefloating_pushes_against_its_z_axis_and_steers_on_its_joint():
    """usv_sim's airboat: its z axis points aft, and its joint's axis, x, upward."""
    content = "<thruster><name>thruster_0</name><effortUnderWater>80</effortUnderWater></thruster>"
    boat = boat_with(FREE, content, kind="revolute", rpy=f"0 {-1.5707963267948966} 0", limits=(-0.7, 0.7))
    (thruster,) = boat.thrusters
    assert (thruster.name, thruster.joint, thruster.drive.max_angle) == ("thruster_0", "thruster_0_joint", 0.7)
    assert (thruster.drive.max_force_forward, thruster.drive.max_force_reverse) == (80, -80)
    assert apply(rotation(*thruster.pose[3:]), thruster.direction) == pytest.approx((1, 0, 0))
    assert apply(rotation(*thruster.pose[3:]), (0, 0, 1)) == pytest.approx((0, 0, 1))


@pytest.mark.parametrize(
    ("filename", "content", "note"),
    [
        (
            UUV,
            "<linkName>screw</linkName>",
            "no link named 'screw'; known: base_link, thruster_0; this thruster is not ",
        ),
        (FREE, "<thruster><name>screw</name></thruster>", "no link named 'screw'; known: base_link, thruster_0; this "),
        (
            FREE,
            "<thruster><map>1 0 0 0 0 0</map></thruster>",
            "a thruster with a <map> has no link and is not simulated",
        ),
        (UUV, NAMES, "no thrustMax and no largest input; the largest thrust is 250 N"),
        (UUV, NAMES, "commands are shares of the largest thrust, -1 to 1"),
    ],
)
def test_what_a_file_does_not_say_is_said(filename, content, note):
    assert any(note in line for line in boat_with(filename, content).warnings)
