"""VRX 1.6.2's packages as a user's workspace has them, written for tests: names and tags of VRX, contents of our own.

Descriptions of the WAM-V are ours under VRX's names, but for two files that only ours have, which are called otherwise:
one of ours that looks into these packages fails. Meshes are empty.
"""

import csv
from pathlib import Path

from gazebo_files import classic_text
from vrx_mj.packages import root

__all__ = ["LAUNCHES", "write_vrx"]

LISTED = Path(__file__).parent / "golden/launches.csv"
PACKAGES = ("usv_gazebo_plugins", "usv_msgs", "vrx_2019", "vrx_gazebo", "wamv_description", "wamv_gazebo",
            "wave_gazebo", "wave_gazebo_plugins")  # fmt: skip
OURS_ALONE = {"shapes.xacro": "forms.xacro", "defaults.xacro": "names.xacro"}
MODELS = ("polyform_a3", "robotx_light_buoy", "surmark950400")
MODEL = """<sdf version="1.6"><model name="{name}"><link name="link">
  <inertial><mass>20</mass></inertial>
  <visual name="v"><geometry><mesh><uri>model://{name}/mesh/{name}.dae</uri></mesh></geometry></visual>
  <collision name="c"><geometry><sphere><radius>0.3</radius></sphere></geometry></collision>
</link></model></sdf>
"""
LAUNCH = """<?xml version="1.0"?>
<launch>
  <env name="ROSCONSOLE_CONFIG_FILE" value="$(find vrx_gazebo)/config/custom_rosconsole.conf"/>
  <arg name="world" default="$(find {package})/worlds/{world}.world"/>
  <arg name="gui" default="true"/>
  <arg name="verbose" default="false"/>
  <arg name="paused" default="false"/>
  <arg name="extra_gazebo_args" default=""/>
  <arg name="namespace" default="wamv"/>
  <arg name="x" default="{x}"/>
  <arg name="y" default="{y}"/>
  <arg name="z" default="{z}"/>
  <arg name="P" default="0"/>
  <arg name="R" default="0"/>
  <arg name="Y" default="{yaw}"/>
  <arg name="non_competition_mode" default="true"/>
  <arg name="enable_ros_network" value="$(arg non_competition_mode)"/>
  <env name="VRX_DEBUG" value="$(arg non_competition_mode)"/>
  <arg name="thrust_config" default="{thrusters}"/>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(arg world)"/>
    <arg name="verbose" value="$(arg verbose)"/>
    <arg name="paused" value="$(arg paused)"/>
    <arg name="use_sim_time" value="true"/>
    <arg name="gui" value="$(arg gui)"/>
    <arg name="enable_ros_network" value="$(arg enable_ros_network)"/>
    <arg name="extra_gazebo_args" value="$(arg extra_gazebo_args)"/>
  </include>
  <arg name="urdf" default="$(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"/>
  <param name="$(arg namespace)/robot_description"
         command="$(find xacro)/xacro &#x002D;&#x002D;inorder '$(arg urdf)' thruster_config:=$(arg thrust_config)
         {sensors} namespace:=$(arg namespace)"/>
  <node name="spawn_model" pkg="gazebo_ros" type="spawn_model" if="$(arg non_competition_mode)"
        args="-x $(arg x) -y $(arg y) -z $(arg z) -R $(arg R) -P $(arg P) -Y $(arg Y)
              -urdf -param $(arg namespace)/robot_description -model wamv"/>
  <node name="spawn_wamv" pkg="vrx_gazebo" type="spawn_wamv.bash" unless="$(arg non_competition_mode)"
        args="-x $(arg x) -y $(arg y) -z $(arg z) --urdf $(arg urdf) --model wamv"/>
</launch>
"""


def _rows() -> list[dict[str, str]]:
    """Of the golden list, launch files with one boat, each with its package."""
    lines = (line for line in LISTED.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    rows = [row for row in csv.DictReader(lines) if row["boat"] == "wamv"]
    for row in rows:
        older, ocean = row["world"].startswith("vrx2019/"), row["world"].startswith("ocean")
        row["package"] = "vrx_2019" if older else "wave_gazebo" if ocean else "vrx_gazebo"
    return rows


LAUNCHES = {f"{row['package']}/launch/{row['launch']}.launch": row["world"] for row in _rows()}
"""VRX's launch files that are written, and the world of ours that each opens."""


def write_vrx(folder: Path) -> Path:
    """Write the workspace, and return its folder of sources."""
    files = {f"{name}/package.xml": f"<package><name>{name}</name></package>\n" for name in PACKAGES}
    own = root() / "assets/robots/wamv"
    for package in ("wamv_description", "wamv_gazebo"):
        for file in sorted((own / package / "urdf").rglob("*.xacro")):
            text = file.read_text(encoding="utf-8").replace("package://wamv/", "package://wamv_description/")
            for before, after in OURS_ALONE.items():
                text = text.replace(before, after)
            place = file.relative_to(own).parent.as_posix()
            files[f"{place}/{OURS_ALONE.get(file.name, file.name)}"] = text
    files |= {f"wamv_description/meshes/{mesh.name}": "" for mesh in (own / "meshes").glob("*.obj")}
    for row in _rows():
        sensors = "vrx_sensors_enabled:=true" if row["sensors"] == "vrx" else "gps_enabled:=false"
        world = row["world"].removeprefix("vrx2019/")
        text = LAUNCH.format(**{**row, "world": world, "sensors": sensors})
        files[f"{row['package']}/launch/{row['launch']}.launch"] = text
        files[f"{row['package']}/worlds/{world}.world.xacro"] = classic_text(row["world"])
    for name in MODELS:
        config = f"<model><name>{name}</name><sdf version='1.6'>model.sdf</sdf></model>"
        files |= {f"vrx_gazebo/models/{name}/model.config": config, f"vrx_gazebo/models/{name}/mesh/{name}.dae": ""}
        files[f"vrx_gazebo/models/{name}/model.sdf"] = MODEL.format(name=name)
    for name, text in files.items():
        file = folder / "src/vrx" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return folder / "src"
