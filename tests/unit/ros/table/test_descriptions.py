"""`robot_description`: of every boat what its world was compiled from, from whatever folder it is asked for."""

import shutil
import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import sdf_boats
import vrx_mj
import workspaces
from ros_scene import served
from urdf_boats import joint, link, robot, thruster
from vrx_mj.config.fleet import Order
from vrx_mj.config.search import catalogue
from vrx_mj.errors import StateError
from vrx_mj.formats.gazebo.opening import open_source
from vrx_mj.mjcf import robots
from vrx_mj.mjcf.build import boat_urdf
from vrx_mj.mjcf.world import World
from vrx_mj.model.kinds import LONGEST_DESCRIPTION
from vrx_mj.ros.table.boats import description

PARTS = (
    link("left_propeller"),
    joint("left_joint", "left_propeller", kind="continuous", xyz="-1.8 0.4 -0.2", axis="1 0 0", limits=None),
    thruster("left"),
)
MESH = link("sign", shapes='<visual><geometry><mesh filename="sign.stl"/></geometry></visual>')
URDF = robot(*PARTS, MESH, joint("sign_joint", "sign", kind="fixed", limits=None))
XACRO = """<robot name="mine" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:arg name="namespace" default="wamv"/>
  <xacro:arg name="mast" default="1"/>
  <xacro:include filename="hull.xacro"/>
  <xacro:hull name="$(arg namespace)/base_link" mass="${100 * $(arg mast)}"/>
</robot>
"""
HULL = """<robot xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="hull" params="name mass">
    <link name="${name}">
      <inertial><mass value="${mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
      <collision><geometry><box size="4 1 0.5"/></geometry></collision>
    </link>
  </xacro:macro>
</robot>
"""
LAUNCH = """<launch>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(find wave_gazebo)/worlds/ocean.world"/>
  </include>
  <param name="red" command="$(find xacro)/xacro boats/boat.urdf.xacro mast:=2"/>
  <node name="red" pkg="gazebo_ros" type="spawn_model" args="-y 20 -urdf -param red -model red"/>
  <param name="blue" command="$(find xacro)/xacro boats/boat.urdf.xacro mast:=3"/>
  <node name="blue" pkg="gazebo_ros" type="spawn_model" args="-urdf -param blue -model blue"/>
</launch>
"""


@pytest.fixture
def boats(tmp_path, monkeypatch):
    """A folder of boats, which is not the current one: there lie others, by the same names."""
    folder, other = tmp_path / "boats", tmp_path / "elsewhere"
    (folder / "ship").mkdir(parents=True)
    (folder / "boat.urdf").write_text(URDF, encoding="utf-8")
    (folder / "sign.stl").write_text(workspaces.MESH, encoding="utf-8")
    (folder / "boat.urdf.xacro").write_text(XACRO, encoding="utf-8")
    (folder / "hull.xacro").write_text(HULL, encoding="utf-8")
    hull = sdf_boats.link("base_link", 20, (1, 3, 3), sdf_boats.hulls())
    prop = sdf_boats.link("prop", 0.1, (1e-3, 1e-3, 1e-3), pose="-0.6 0 -0.1 0 0 0")
    parts = (hull, prop, sdf_boats.spinning("prop_joint", "base_link", "prop"), sdf_boats.thruster("prop_joint"))
    (folder / "ship" / "model.sdf").write_text(sdf_boats.sdf("ship", *parts), encoding="utf-8")
    (tmp_path / "two.launch").write_text(LAUNCH, encoding="utf-8")
    other.mkdir()
    for name in ("boat.urdf", "boat.urdf.xacro", "model.sdf"):
        (other / name).write_text("<robot name='another'/>", encoding="utf-8")
    monkeypatch.chdir(other)
    return folder


def compiled(world, fleet):
    source, boats = open_source(world, fleet, {})
    return vrx_mj.compile_world(source, fleet=boats)


def links(world, boat):
    return [one.get("name") for one in ET.fromstring(description(world, boat)).iter("link")]


def masses(world):
    texts = (ET.fromstring(description(world, boat)) for boat in world.boats)
    return [float(text.find("link/inertial/mass").get("value")) for text in texts]


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
@pytest.mark.parametrize(
    ("file", "names"),
    [
        ("boat.urdf", ["base_link", "left_propeller", "sign"]),
        ("boat.urdf.xacro", ["wamv/base_link"]),
        ("ship/model.sdf", ["base_link", "prop"]),
    ],
)
def test_a_file_named_from_another_folder(boats, tmp_path, file, names):
    world = compiled("ocean", str(boats / file))
    (boat,) = world.boats
    assert links(world, boat) == names
    world.save(tmp_path / "saved")
    shutil.rmtree(boats)
    loaded = World.load(tmp_path / "saved")
    assert description(loaded, boat) == description(world, boat)
    scene = served(loaded)
    assert scene.network.table.parameters[f"/{boat}/robot_description"] == description(world, boat)


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_each_boat_of_a_launch_file_has_its_own(boats, tmp_path):
    world = compiled(str(tmp_path / "two.launch"), None)
    assert world.boats == ("red", "blue")
    assert masses(world) == [200.0, 300.0]
    assert links(world, "red") + links(world, "blue") == ["red/base_link", "blue/base_link"]
    sim = vrx_mj.Simulation(world)
    sim.spawn("green", robot=boats / "boat.urdf.xacro", pose=(30, 0, 0, 0, 0, 0))
    sim.remove("red")
    assert masses(sim.world) == [300.0, 100.0]


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_a_worlds_hash_is_the_same_wherever_its_boats_lie(boats, tmp_path):
    first = compiled("ocean", str(boats / "boat.urdf"))
    moved = Path(shutil.move(boats, tmp_path / "moved"))
    second = compiled("ocean", str(moved / "boat.urdf"))
    assert first.sha256 == second.sha256
    assert (boats / "sign.stl").as_uri() in description(first, "wamv")
    assert (moved / "sign.stl").as_uri() in description(second, "wamv")


def test_boats_of_ours_are_saved_without(tmp_path):
    world = vrx_mj.compile_world("ocean", fleet={"usv_count": 1})
    scene = world.save(tmp_path / "saved")
    assert '"description"' not in scene.with_suffix(".json").read_text(encoding="utf-8").partition('"boats"')[2]
    assert links(World.load(scene), "wamv1")[0] == "wamv1/base_link"


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_a_description_beyond_the_limit_is_left_out(boats, monkeypatch):
    monkeypatch.setattr(robots, "LONGEST_DESCRIPTION", 100)
    world = compiled("ocean", str(boats / "boat.urdf"))
    assert world.parameters.boats[0].description == ""


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_a_saved_description_beyond_the_limit_is_refused(boats, tmp_path):
    parameters = compiled("ocean", str(boats / "boat.urdf")).save(tmp_path / "saved").with_suffix(".json")
    text = parameters.read_text(encoding="utf-8").replace("<robot name", f"{'x' * LONGEST_DESCRIPTION}<robot name")
    parameters.write_text(text, encoding="utf-8")
    with pytest.raises(
        StateError, match=rf"boats\[0\]\.description: string should have at most {LONGEST_DESCRIPTION} characters"
    ):
        World.load(tmp_path / "saved")


def rgb(rgba):
    return [float(value) for value in rgba.split()[:3]]


@pytest.mark.parametrize("robot", sorted(catalogue("robots")))
def test_meshes_have_the_colours_of_the_description(robot):
    """RViz takes those of an OBJ file from its MTL file, and none from the URDF."""
    text = ET.fromstring(boat_urdf(Order(robot), "wamv"))
    named = {one.get("name"): one.find("color").get("rgba") for one in text.iter("material") if len(one)}
    for visual in text.iter("visual"):
        if visual.find("geometry/mesh") is None:
            continue
        file = Path(unquote(urlsplit(visual.find("geometry/mesh").get("filename")).path))
        library, used = (line.split()[1] for line in file.read_text(encoding="utf-8").splitlines()[:2])
        materials = (file.parent / library).read_text(encoding="utf-8").split("newmtl ")
        colours = dict(one.split("\nKd ") for one in materials if one)
        assert rgb(colours[used]) == rgb(named[visual.find("material").get("name")]), file
