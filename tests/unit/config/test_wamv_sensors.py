"""Sensors, plugins and namespaces of the WAM-V that our xacro macros make, and boats made from the macros by hand."""

import math
import xml.etree.ElementTree as ET

import pytest

from vrx_mj.formats.parts.read import load_parts, wamv_urdf
from vrx_mj.formats.urdf.expand import expand
from wamv_boats import FLAGS, SUITE, local, origin, robot, text_of, values


def plugins(made, stem):
    return [each for each in made.iter("plugin") if each.get("filename") == f"lib{stem}.so"]


@pytest.mark.parametrize(
    ("boat", "cameras", "lidars"), [("H", 0, 0), ("H suite", 3, 1), ("example", 3, 1), ("H singles", 1, 1)]
)
def test_boats_have_their_sensors(boat, cameras, lidars):
    kinds = [sensor.get("type") for sensor in robot(boat).iter("sensor")]
    assert (kinds.count("camera"), kinds.count("gpu_ray"), len(kinds)) == (cameras, lidars, cameras + lidars)


PLUGINS = (
    "hector_gazebo_ros_gps",
    "hector_gazebo_ros_imu",
    "gazebo_ros_p3d",
    "usv_gazebo_acoustic_pinger_plugin",
    "ball_shooter_plugin",
    "usv_gazebo_dynamics_plugin",
    "usv_gazebo_thrust_plugin",
)


@pytest.mark.parametrize(
    ("boat", "counts"),
    [("H", (0, 0, 0, 0, 0, 1, 1)), ("H suite", (1, 1, 0, 1, 1, 1, 1)), ("H singles", (1, 1, 1, 1, 1, 1, 1))],
)
def test_boats_have_their_plugins(boat, counts):
    assert tuple(len(plugins(robot(boat), stem)) for stem in PLUGINS) == counts


def test_a_suite_with_single_sensors_has_each_once():
    made = ET.fromstring(wamv_urdf(arguments={**SUITE, **FLAGS}))
    names = [link.get("name") for link in made.findall("link")]
    suite = len(robot("H suite").findall("link"))
    assert len(names) == len(set(names)) == suite + 4  # the front camera, which the suite lacks
    assert len(plugins(made, "gazebo_ros_p3d")) == 1


def test_a_camera_sees_as_vrxs():
    camera = next(each for each in robot("H suite").iter("sensor") if each.get("name") == "front_left_camera_sensor")
    figures = values(
        camera, "update_rate", "horizontal_fov", "width", "height", "near", "far", "stddev", "hackBaseline"
    )
    assert figures == [30, 1.3962634, 1280, 720, 0.05, 300, 0.007, 0.07]
    assert camera.find("visualize") is None
    assert camera.find(".//cameraName").text == "wamv/sensors/cameras/front_left_camera"
    assert camera.find(".//frameName").text == "wamv/front_left_camera_link_optical"


RAY = (
    "horizontal/resolution",
    "vertical/samples",
    "vertical/min_angle",
    "vertical/max_angle",
    "range/min",
    "range/max",
    "stddev",
)


@pytest.mark.parametrize(
    ("kind", "points", "rings", "low", "high"),
    [("16_beam", 1875, 16, -math.pi / 12, math.pi / 12), ("32_beam", 2187, 32, -0.186, 0.54)],
)
def test_a_lidar_scans_as_vrxs(tmp_path, kind, points, rings, low, high):
    file = tmp_path / "components.yaml"
    file.write_text(f"lidar: [{{name: lidar, type: {kind}}}]", encoding="utf-8")
    made = ET.fromstring(wamv_urdf(components=load_parts(file, "components")))
    lidar = next(made.iter("sensor"))
    assert values(lidar, *RAY) == pytest.approx([0.1, rings, low, high, 0.1, 130, 0.01])
    samples, resolution = values(lidar, "horizontal/samples", "horizontal/resolution")
    assert samples * resolution == pytest.approx(points)
    assert lidar.find(".//topicName").text == "wamv/sensors/lidars/lidar/points"
    assert lidar.find(".//sea_returns") is None


def test_each_engine_has_vrxs_thrust_model():
    made = robot("X suite")
    rows = [{child.tag: child.text for child in thruster} for thruster in made.iter("thruster")]
    assert [row["cmdTopic"] for row in rows] == [
        f"thrusters/{name}_thrust_cmd" for name in ("left_rear", "right_rear", "left_front", "right_front")
    ]
    assert rows[0] == {
        "linkName": "wamv/left_rear_propeller_link",
        "propJointName": "wamv/left_rear_engine_propeller_joint",
        "engineJointName": "wamv/left_rear_chasis_engine_joint",
        "cmdTopic": "thrusters/left_rear_thrust_cmd",
        "angleTopic": "thrusters/left_rear_thrust_angle",
        "enableAngle": "True",
        "mappingType": "1",
        "maxCmd": "1.0",
        "maxForceFwd": "250.0",
        "maxForceRev": "-100.0",
        "maxAngle": str(math.pi / 2),
    }


TUTORIAL = """
wamv_camera:
  - {name: front_left, x: 0.75, y: 0.1, P: "${radians(15)}"}
  - {name: front_right, x: 0.75, y: -0.1, P: "${radians(15)}"}
  - {name: far_left, x: 0.75, y: 0.3, P: "${radians(15)}"}
wamv_gps: [{name: gps_wamv, x: -0.85}]
wamv_imu: [{name: imu_wamv, y: -0.2}]
wamv_p3d: [{name: p3d_wamv}]
lidar: [{name: lidar_wamv, type: 16_beam, P: "${radians(8)}"}]
"""


def test_the_short_form_of_vrxs_tutorial_takes_defaults(tmp_path):
    files = {"components": TUTORIAL, "thrusters": ""}
    for kind, text in files.items():
        (tmp_path / f"{kind}.yaml").write_text(text, encoding="utf-8")
    made = ET.fromstring(wamv_urdf(**{kind: load_parts(tmp_path / f"{kind}.yaml", kind) for kind in files}))
    kinds = [joint.get("type") for joint in made.findall("joint")]
    assert (len(made.findall("link")), kinds.count("fixed"), kinds.count("revolute"), len(kinds)) == (22, 19, 2, 21)
    assert sum(float(mass.get("value")) for mass in made.iter("mass")) == pytest.approx(251.2847)  # as VRX's xacro
    assert plugins(made, "gazebo_ros_p3d")[0].find("topicName").text == "wamv/sensors/position/p3d_wamv"


# Namespaces


def places_of(made):
    """Every attribute and text that is no name of a mesh, a material or a plugin, in the order of the file."""
    for element in made.iter():
        if element.tag not in {"mesh", "material", "plugin", "robot"}:
            yield from element.attrib.values()
            yield (element.text or "").strip()


@pytest.mark.parametrize("boat", ["H singles", "X suite", "example"])
def test_the_namespace_is_everywhere(boat):
    plain, other = robot(boat, locked=True), robot(boat, "boat_7", locked=True)
    changed = 0
    for old, new in zip(places_of(plain), places_of(other), strict=True):
        swapped = "boat_7" + old[4:] if old == "wamv" or old.startswith(("wamv/", "wamv::", "wamv_external")) else old
        assert new == swapped.replace("::wamv/", "::boat_7/")
        changed += new != old
    assert changed > 100
    frames = {each.text for each in other.iter() if each.tag in {"frame", "frameId", "frameName", "robotNamespace"}}
    assert all(frame == "map" or frame.startswith("boat_7") for frame in frames)


def test_a_locked_boat_is_held_as_vrxs():
    assert "external" not in text_of("H")
    held = {joint.get("name"): joint for joint in robot("H", locked=True).findall("gazebo/joint")}
    assert list(held) == ["wamv_external_pivot_joint", "wamv_external_riser"]
    pivot, riser = held.values()
    assert (pivot.get("type"), pivot.find("parent").text) == ("universal", "wamv::wamv/base_link")
    assert [pivot.find(f"{axis}/xyz").text for axis in ("axis", "axis2")] == ["1 0 0", "0 1 0"]
    assert (riser.get("type"), riser.find("parent").text, riser.find("axis/xyz").text) == (
        "prismatic",
        "world",
        "0 0 1",
    )
    assert values(riser, "lower", "upper") == [-3, 3]


# Posts, and boats made by hand


@pytest.mark.parametrize(("part", "height", "least"), [("wamv_camera", 1.3, 1.3235), ("lidar", 1.3, 1.3465)])
def test_a_part_too_low_for_a_post_has_none(tmp_path, part, height, least):
    def post(z):
        file = tmp_path / "components.yaml"
        file.write_text(f"{part}: [{{name: low, z: {z}}}]", encoding="utf-8")
        made = ET.fromstring(wamv_urdf(components=load_parts(file, "components")))
        links = {local(link): link for link in made.findall("link")}
        place = sum(origin(joint)[0][2] for joint in made.findall("joint") if "low_post" in joint.get("name"))
        assert place == pytest.approx(z)  # the part is where it was asked for
        return links["low_post_link"]

    with pytest.warns(match="its post is"):
        assert len(post(height)) == 0
    shape = post(least + 0.1).find("collision/geometry/cylinder")
    assert float(shape.get("length")) == pytest.approx(0.1)


BY_HAND = """
<robot xmlns:xacro="http://ros.org/wiki/xacro" name="WAM-V">
  <xacro:include filename="$(find wamv_gazebo)/urdf/wamv_gazebo.xacro"/>
  <xacro:wamv_gazebo thruster_layout="$(find wamv_gazebo)/urdf/thruster_layouts/wamv_t_thrusters.xacro"/>
  <xacro:include filename="$(find wamv_gazebo)/urdf/{folder}/wamv_camera.xacro"/>
  <xacro:include filename="$(find wamv_gazebo)/urdf/{folder}/{lidar}.xacro"/>
  <xacro:include filename="$(find wamv_gazebo)/urdf/{shooter}/ball_shooter.xacro"/>
  <xacro:property name="stereo_x" value="0.75"/>
  <xacro:wamv_camera name="front_left" x="${{stereo_x}}" y="0.1" P="${{radians(15)}}"/>
  <xacro:wamv_camera name="front_right" x="${{stereo_x}}" y="-0.1" P="${{radians(15)}}" width="640" height="480"/>
  <xacro:wamv_gps name="gps" x="-0.85"/>
  <xacro:wamv_p3d name="p3d"/>
  <xacro:wamv_3d_lidar name="top" samples="900" vertical_lasers="8" sea_returns="true"/>
  <xacro:wamv_multibeam_laser name="planar"/>
  <xacro:wamv_ball_shooter position="0.5 0.2 1.3" pitch="-0.5"/>
</robot>
"""


@pytest.mark.parametrize(
    ("folder", "lidar", "shooter"),
    [
        ("components", "wamv_planar_lidar", "components"),
        ("sensors", "wamv_planar_lidar", "sensors"),
        ("sensors", "wamv_multibeam_laser", "ball_shooter"),
    ],
)
def test_a_boat_made_by_hand_needs_no_namespace(tmp_path, folder, lidar, shooter):
    file = tmp_path / "my_wamv.urdf.xacro"
    file.write_text(BY_HAND.format(folder=folder, lidar=lidar, shooter=shooter), encoding="utf-8")
    made = ET.fromstring(expand(file))
    joints = {local(joint): joint for joint in made.findall("joint")}
    names = {local(link) for link in made.findall("link")}
    assert names >= {"base_link", "lateral_engine_link", "front_left_link", "gps_link", "top_link", "planar_link"}
    assert origin(joints["base_to_front_left_post_joint"])[0] == pytest.approx([0.7, 0.1, 1.38475])
    assert joints["ball_shooter_base_joint"].find("origin").get("xyz") == "0.5 0.2 1.3"
    sensors = {sensor.get("name"): sensor for sensor in made.iter("sensor")}
    assert values(sensors["front_right_sensor"], "width", "height") == [640, 480]
    assert values(sensors["top_sensor"], "horizontal/samples", "vertical/samples") == pytest.approx([9000, 8])
    assert sensors["top_sensor"].find("plugin/sea_returns").text == "true"
    planar = sensors["multibeam_sensor_planar"]
    assert values(planar, "samples", "min_angle", "max_angle", "range/min", "range/max", "range/resolution") == [
        256,
        -1.0472,
        1.0472,
        0.2,
        70,
        0.02,
    ]


NEWER = "wamv_pinger: [{sensor_name: receiver, position: 100 20 -2}]"


def test_a_pinger_of_newer_vrx_sits_at_the_origin(tmp_path):
    file = tmp_path / "components.yaml"
    file.write_text(NEWER, encoding="utf-8")
    with pytest.warns(match="beacon's position"):
        parts = load_parts(file, "components")
    made = ET.fromstring(wamv_urdf(components=parts, namespace="b"))
    joint = next(each for each in made.findall("joint") if each.get("name") == "b/receiver_pinger_joint")
    assert origin(joint) == ([0, 0, 0], [0, 0, 0])
    link = next(each for each in made.findall("link") if each.get("name") == "b/receiver")
    assert link.find("collision") is None
    plugin = plugins(made, "usv_gazebo_acoustic_pinger_plugin")[0]
    assert [plugin.find(tag).text for tag in ("frameId", "topicName")] == [
        "b/pinger",
        "b/sensors/pingers/receiver/range_bearing",
    ]
