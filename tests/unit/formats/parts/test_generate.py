"""From thruster and component files to xacro and URDF."""

import xml.etree.ElementTree as ET

import pytest

from vrx_mj.config.tree import File, Place
from vrx_mj.errors import UnknownNameError, VrxError
from vrx_mj.formats.parts.read import (
    LAYOUTS,
    Instance,
    PartsFile,
    arguments_of_wamv,
    example_file,
    load_parts,
    wamv_urdf,
    xacro_text,
)
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.packages import root

FLAGS = tuple(
    f"{what}_enabled"
    for what in ("vrx_sensors", "camera", "gps", "imu", "lidar", "ground_truth", "pinger", "ball_shooter")
)
MAIN = root() / "assets" / "robots" / "wamv" / "wamv_gazebo" / "urdf" / "wamv_gazebo.urdf.xacro"


def written(folder, text, kind):
    file = folder / f"{kind}.yaml"
    file.write_text(text, encoding="utf-8")
    return load_parts(file, kind)


def parts_of(folder, kind, *instances):
    """Parts as they stand, without a reader that works out their expressions."""
    place = Place(File("parts.yaml", folder))
    made = tuple(Instance(name, i, parameters, place) for i, (name, parameters) in enumerate(instances))
    return PartsFile(folder / "parts.yaml", kind, made)


def names(urdf, kind="link"):
    return [element.get("name") for element in ET.fromstring(urdf).findall(kind)]


def test_components_become_a_macro_in_the_order_of_the_file(tmp_path):
    text = """
wamv_gps: [{name: gps, x: -0.85}]
wamv_camera: [{name: a, visualize: True, P: "${radians(30)}"}, {name: b}]
"""
    assert (
        xacro_text(written(tmp_path, text, "components"))
        == """\
<?xml version="1.0"?>
<robot xmlns:xacro="http://ros.org/wiki/xacro" name="wam-v-components">
  <xacro:macro name="yaml_components">
    <xacro:wamv_gps name="gps" x="-0.85"/>
    <xacro:wamv_camera name="a" visualize="True" P="0.5235987755982988"/>
    <xacro:wamv_camera name="b"/>
  </xacro:macro>
</robot>
"""
    )


def test_thrusters_become_engines_and_a_plugin(tmp_path):
    text = (
        "engine: [{prefix: left, position: '-2 1 0.3', orientation: '0 0 0.5'}, {prefix: right, position: '-2 -1 0.3'}]"
    )
    assert (
        xacro_text(written(tmp_path, text, "thrusters"))
        == """\
<?xml version="1.0"?>
<robot xmlns:xacro="http://ros.org/wiki/xacro" name="wam-v-thrusters">
  <xacro:include filename="$(find wamv_description)/urdf/thrusters/engine.xacro"/>
  <xacro:engine prefix="left" position="-2 1 0.3" orientation="0 0 0.5"/>
  <xacro:engine prefix="right" position="-2 -1 0.3"/>
  <gazebo>
    <plugin name="wamv_gazebo_thrust" filename="libusv_gazebo_thrust_plugin.so">
      <cmdTimeout>1.0</cmdTimeout>
      <robotNamespace>${namespace}</robotNamespace>
      <xacro:include filename="$(find wamv_gazebo)/urdf/thruster_layouts/wamv_gazebo_thruster_config.xacro"/>
      <xacro:wamv_gazebo_thruster_config name="left"/>
      <xacro:wamv_gazebo_thruster_config name="right"/>
    </plugin>
  </gazebo>
</robot>
"""
    )


def test_expressions_reach_xacro(tmp_path):
    parts = parts_of(tmp_path, "components", ("wamv_imu", {"name": "i", "x": "${2 * 0.25}", "Y": "${radians(90)}"}))
    joint = next(
        each for each in ET.fromstring(wamv_urdf(components=parts)).iter("joint") if "i_joint" in each.get("name")
    )
    assert joint.find("origin").attrib == {"xyz": "0.5 0.5 1.3", "rpy": "0 0 1.5707963267948966"}


@pytest.mark.parametrize("odd", ['a"b', "a<b", "a&b", "a'b", "a\nb", "']]>\""])
def test_values_are_escaped(tmp_path, odd):
    made = ET.fromstring(xacro_text(parts_of(tmp_path, "components", ("wamv_gps", {"name": odd}))))
    assert next(each for each in made.iter() if each.tag.endswith("wamv_gps")).get("name") == odd


def test_the_same_files_give_the_same_text():
    thrusters, components = (load_parts(example_file(kind), kind) for kind in ("thrusters", "components"))
    first, second = (wamv_urdf(thrusters=thrusters, components=components) for _ in range(2))
    assert first == second
    assert "/tmp" not in first
    assert "xacro" not in first


def test_example_thrusters_are_layout_h():
    thrusters = load_parts(example_file("thrusters"), "thrusters")
    from_file, from_layout = (ET.fromstring(text) for text in (wamv_urdf(thrusters=thrusters), wamv_urdf()))
    for kind in ("link", "joint"):
        found, expected = (
            {each.get("name"): [piece.attrib for piece in each.iter()] for each in tree.findall(kind)}
            for tree in (from_file, from_layout)
        )
        numbers = {"xyz", "rpy"}
        assert found.keys() == expected.keys()
        for name, pieces in found.items():
            for piece, other in zip(pieces, expected[name], strict=True):
                assert piece.keys() == other.keys()
                for key in piece:
                    same = piece[key].split() == other[key].split()
                    assert same or (
                        key in numbers and [*map(float, piece[key].split())] == [*map(float, other[key].split())]
                    )


def test_empty_files_make_a_boat_without_parts_but_with_cpu_cases(tmp_path):
    thrusters, components = (written(tmp_path, "", kind) for kind in ("thrusters", "components"))
    assert names(wamv_urdf(thrusters=thrusters, components=components)) == [
        "wamv/base_link",
        "wamv/dummy_link",
        "wamv/left_battery_link",
        "wamv/right_battery_link",
        "wamv/cpu_cases_link",
    ]


def test_a_component_file_takes_the_place_of_flags(tmp_path):
    components = written(tmp_path, "wamv_gps: [{name: g}]", "components")
    made = names(wamv_urdf(components=components, arguments=dict.fromkeys(FLAGS, "true")))
    assert [name for name in made if "battery" not in name and "engine" not in name and "propeller" not in name] == [
        "wamv/base_link",
        "wamv/dummy_link",
        "wamv/g_link",
        "wamv/cpu_cases_link",
    ]


@pytest.mark.parametrize("lidar", ["64_beam", "16-beam", "32_Beam"])
def test_an_unknown_lidar_is_none_as_in_vrx(tmp_path, lidar):
    with pytest.warns(match="has no lidar type"):
        components = written(tmp_path, f"lidar: [{{name: l, type: {lidar}}}]", "components")
    assert not any(
        "l_" in name.removeprefix("wamv/") for name in names(wamv_urdf(components=components)) if "/l_" in name
    )


def test_the_xacro_serves_any_namespace(tmp_path):
    components = written(tmp_path, "wamv_gps: [{name: g}]", "components")
    thrusters = written(tmp_path, "engine: [{prefix: e, position: '0 0 0'}]", "thrusters")
    assert "wamv/" not in xacro_text(components) + xacro_text(thrusters)
    made = names(wamv_urdf(thrusters=thrusters, components=components, namespace="b.2-x"))
    assert {"b.2-x/g_link", "b.2-x/e_engine_link"} <= set(made)
    assert all(name.startswith("b.2-x/") for name in made)


def test_topic_segments_can_be_set():
    urdf = wamv_urdf(arguments={"vrx_sensors_enabled": "true", "camera_namespace": "eyes/", "thruster_namespace": "t/"})
    assert "wamv/sensors/eyes/front_left_camera" in urdf
    assert "<cmdTopic>t/left_thrust_cmd</cmdTopic>" in urdf


OLD = """
<robot xmlns:xacro="http://ros.org/wiki/xacro" name="wam-v-sensors">
  <xacro:macro name="yaml_sensors">
    <xacro:wamv_gps name="g"/>
  </xacro:macro>
</robot>
"""


def test_sensor_files_of_earlier_releases_still_expand(tmp_path):
    file = tmp_path / "sensors.xacro"
    file.write_text(OLD, encoding="utf-8")
    given = {"yaml_sensor_generation": "true", "sensor_xacro_file": str(file), "vrx_sensors_enabled": "true"}
    made = names(expand(MAIN, arguments=given, package_paths=(tmp_path,)))
    assert {"wamv/g_link", "wamv/cpu_cases_link"} <= set(made)
    assert not any("camera" in name for name in made)


def test_arguments_are_those_of_the_file_but_for_what_has_parameters_of_its_own():
    spaces = ("thruster", "camera", "sensor", "pinger", "shooter")
    assert list(arguments_of_wamv()) == [
        "thruster_config", *FLAGS, "sensor_errors", "camera_info", "camera_labels", "release",
        *(f"{space}_namespace" for space in spaces),
    ]  # fmt: skip


@pytest.mark.parametrize("layout", ["Q", "h", "", "HT"])
def test_an_unknown_layout_is_an_error(layout):
    with pytest.raises(UnknownNameError) as error:
        wamv_urdf(arguments={"thruster_config": layout})
    hint = "did you mean 'H'?" if layout == "h" else f"known: {', '.join(LAYOUTS)}"
    assert str(error.value) == f"no thruster layout named '{layout}'; {hint}"


def test_an_unknown_argument_is_an_error():
    with pytest.raises(UnknownNameError) as error:
        wamv_urdf(arguments={"gps_enable": "true"})
    assert str(error.value) == "no argument of the WAM-V named 'gps_enable'; did you mean 'gps_enabled'?"


def test_a_flag_that_is_neither_true_nor_false_is_an_error():
    with pytest.raises(VrxError) as error:
        wamv_urdf(arguments={"gps_enabled": "maybe"})
    assert str(error.value) == "argument gps_enabled: expected true or false, got 'maybe'"


@pytest.mark.parametrize("namespace", ["", "a b", "a/b", "/wamv", "ä", "${pi}", "x" * 65, "a\n"])
def test_a_namespace_that_is_no_name_is_an_error(namespace):
    with pytest.raises(VrxError, match=r"^namespace '.*': expected up to 64 letters A-Z, digits, '_', '-' or '\.'$"):
        wamv_urdf(namespace=namespace)
