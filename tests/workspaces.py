"""A catkin workspace as teams have them, written for tests: worlds, models, launch files, boats and programs."""

from pathlib import Path

from urdf_boats import INERTIA, joint, link, thruster

__all__ = ["PRACTICE", "TWO_BOATS", "write_workspace"]

PRACTICE, TWO_BOATS = "practice.launch", "two_boats.launch"
"""The launch files of the workspace that open a world."""
MESH = (
    "solid hull\n"
    + "".join(
        f"facet normal 0 0 0\nouter loop\n{a}\n{b}\n{c}\nendloop\nendfacet\n"
        for a, b, c in [
            ("vertex -2 -0.5 0", "vertex 2 -0.5 0", "vertex 2 0.5 0"),
            ("vertex -2 -0.5 0", "vertex 2 0.5 0", "vertex 0 0 0.5"),
            ("vertex 2 0.5 0", "vertex 2 -0.5 0", "vertex 0 0 0.5"),
            ("vertex 2 -0.5 0", "vertex -2 -0.5 0", "vertex 0 0 0.5"),
        ]
    )
    + "endsolid hull\n"
)
WORLD = """<?xml version="1.0" ?>
<sdf version="1.6" xmlns:xacro="http://ros.org/wiki/xacro">
  <world name="practice">
    <xacro:include filename="$(find vrx_gazebo)/worlds/xacros/include_all_xacros.xacro"/>
    <xacro:include filename="$(find team_gazebo)/worlds/team_buoys.xacro"/>
    <xacro:include_all_xacros/>
    <xacro:sydneyregatta/>
    <xacro:ocean_waves gain="0.2" period="5"/>
    <xacro:usv_wind_gazebo direction="90" mean_vel="3" var_gain="1" var_time="5"><wind_objs/></xacro:usv_wind_gazebo>
    <xacro:team_gate x="-500" y="190"/>
  </world>
</sdf>
"""
GATE = """<root xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="team_gate" params="x y">
    <include><name>gate_left</name><uri>model://team_buoy</uri><pose>${x} ${y - 5} 0 0 0 0</pose></include>
    <include><name>gate_right</name><uri>model://team_buoy</uri><pose>${x} ${y + 5} 0 0 0 0</pose></include>
  </xacro:macro>
</root>
"""
BUOY = """<sdf version="1.6">
  <model name="team_buoy">
    <static>true</static>
    <link name="link">
      <collision name="c"><geometry><sphere><radius>0.4</radius></sphere></geometry></collision>
      <visual name="v"><geometry><sphere><radius>0.4</radius></sphere></geometry></visual>
    </link>
  </model>
</sdf>
"""
CONFIG = "<model><name>team_buoy</name><version>1.0</version><sdf version='1.6'>model.sdf</sdf></model>\n"
LAUNCHED = """<launch>
  <arg name="world" default="$(find team_gazebo)/worlds/practice.world"/>
  <arg name="gui" default="true"/>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(arg world)"/>
    <arg name="gui" value="$(arg gui)"/>
  </include>
%s
  <include file="$(find team_control)/launch/follow.launch"/>
</launch>
"""
FOLLOW = '<launch>\n  <node pkg="team_control" type="follow.py" name="follow" output="screen"/>\n</launch>\n'
FOLLOWER = """#!/usr/bin/env python
import rospy
from std_msgs.msg import Float32

open("owned", "w").write("this program must not run")
"""
THRUSTERS = """engine:
  - prefix: "left"
    position: "-2.37 1.02 0.31"
    orientation: "0.0 0.0 0.0"
  - prefix: "right"
    position: "-2.37 -1.02 0.31"
    orientation: "0.0 0.0 0.0"
"""
COMPONENTS = """wamv_gps:
  - name: gps_wamv
    x: -0.85
wamv_imu:
  - name: imu_wamv
    y: -0.2
"""
HULL = f"""<robot xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="team_hull" params="mass">
    <link name="base_link">
      <inertial><mass value="${{mass}}"/>{INERTIA}</inertial>
      <visual><geometry><mesh filename="package://team_description/meshes/hull.stl"/></geometry></visual>
      <collision><geometry><box size="4 1 0.5"/></geometry></collision>
    </link>
  </xacro:macro>
</robot>
"""
ROBOT = f"""<robot name="team_boat" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="namespace" default="team"/>
  <xacro:include filename="$(find team_description)/urdf/hull.xacro"/>
  <xacro:team_hull mass="180"/>
  {link("left_propeller")}
  {link("right_propeller")}
  {joint("left_joint", "left_propeller", kind="continuous", xyz="-1.8 0.4 -0.2", axis="1 0 0", limits=None)}
  {joint("right_joint", "right_propeller", kind="continuous", xyz="-1.8 -0.4 -0.2", axis="1 0 0", limits=None)}
  {thruster("left")}
  {thruster("right")}
</robot>
"""


def spawned(name, x, command):
    """What describes and spawns a boat."""
    return (
        f'  <group ns="{name}">\n'
        f'    <param name="robot_description" command="$(find xacro)/xacro {command} namespace:={name}"/>\n'
        f'    <node pkg="gazebo_ros" type="spawn_model" name="spawn_{name}"\n'
        f'          args="-x {x} -y 162 -z 0.1 -Y 1 -urdf -param robot_description -model {name}"/>\n'
        "  </group>"
    )


OURS = "$(find team_description)/urdf/team_boat.urdf.xacro"
STOCK = "$(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"
PACKAGES = {
    "team_gazebo": {
        f"launch/{PRACTICE}": LAUNCHED % spawned("team", -532, OURS),
        f"launch/{TWO_BOATS}": LAUNCHED % "\n".join((spawned("red", -532, OURS), spawned("blue", -512, STOCK))),
        "worlds/practice.world.xacro": WORLD,
        "worlds/team_buoys.xacro": GATE,
    },
    "team_models": {"models/team_buoy/model.sdf": BUOY, "models/team_buoy/model.config": CONFIG},
    "team_description": {
        "urdf/team_boat.urdf.xacro": ROBOT,
        "urdf/hull.xacro": HULL,
        "meshes/hull.stl": MESH,
        "config/thruster_config.yaml": THRUSTERS,
        "config/component_config.yaml": COMPONENTS,
    },
    "team_control": {"launch/follow.launch": FOLLOW, "nodes/follow.py": FOLLOWER},
}


def write_workspace(folder: Path, *, without: tuple[str, ...] = ()) -> Path:
    """Write the workspace to a folder, without some of its files, and return the folder."""
    for package, files in PACKAGES.items():
        place = folder / "src" / package
        texts = {"package.xml": f'<package format="2"><name>{package}</name></package>\n', **files}
        for name, text in texts.items():
            if Path(name).name not in without:
                (place / name).parent.mkdir(parents=True, exist_ok=True)
                (place / name).write_text(text, encoding="utf-8", newline="\n")
    return folder
