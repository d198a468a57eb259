"""The steps of VRX's first tutorial with its kinds of file: parameters, world, course, dock, WAM-V, more boats.

The files are our own writing; each step is measured in what the simulator makes of them.
"""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from vrx_command import vrx
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning

WORLD = """<?xml version="1.0"?>
<sdf version="1.6" xmlns:xacro="http://ros.org/wiki/xacro">
<world name="robotx_example_course">
  <xacro:include filename="$(find vrx_gazebo)/worlds/xacros/include_all_xacros.xacro"/>
  <xacro:include_all_xacros/>
  <xacro:sydneyregatta_minus_scene/>
  <xacro:scene_macro>
    <fog><type>linear</type><color>0.8 0.8 0.8 1</color><density>0.1</density><start>5</start><end>60</end></fog>
    <ambient>0.3 0.3 0.3 1</ambient>
  </xacro:scene_macro>
  <xacro:ocean_waves gain="0.1" period="6" scale="2.5"/>
  <xacro:usv_wind_gazebo direction="240" mean_vel="6" seed="10">
    <wind_objs>
      <wind_obj><name>wamv</name><link_name>wamv/base_link</link_name><coeff_vector>.5 .5 .33</coeff_vector></wind_obj>
    </wind_objs>
  </xacro:usv_wind_gazebo>
  <!-- own objects -->
</world>
</sdf>
"""
BUOY = "<include><name>my_buoy</name><uri>model://robotx_light_buoy</uri><pose>-520 190 0 0 0 0</pose></include>"
DOCK = "<include><name>my_dock</name><uri>model://my_dock</uri><pose>-505 175 0 0 0 0.5</pose></include>"
TEMPLATE = """<?xml version="1.0"?>
<%
  layout = ['XXX',
            'X X',
            'X X', true]
%>
<sdf version="1.6"><model name="my_dock"></model></sdf>
"""
LAUNCH = """<launch>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(dirname)/my.world.xacro"/></include>
{boats}</launch>
"""
THRUSTERS = """engine:
  - {prefix: left, position: "-2.373776 1.027135 0.318237", orientation: "0 0 0"}
  - {prefix: right, position: "-2.373776 -1.027135 0.318237", orientation: "0 0 0"}
  - {prefix: bow, position: "1.0 0.0 0.318237", orientation: "0 0 1.5708"}
"""
COMPONENTS = """wamv_camera:
  - {name: mid, x: 0.75, y: 0.0, z: 1.5, P: "${radians(15)}"}
wamv_gps:
  - {name: aft, x: -0.85}
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def world(*changes, objects=""):
    """The world of the tutorial with some of its text changed."""
    text = WORLD
    for before, after in (*changes, ("<!-- own objects -->", objects)):
        assert before in text
        text = text.replace(before, after)
    Path("my.world.xacro").write_text(text, encoding="utf-8")
    return "my.world.xacro"


def boat(name, x, y, thrusters, *, spawned=""):
    """What a launch file has for each boat."""
    xacro = "$(find xacro)/xacro '$(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro'"
    return f"""  <group ns="{name}">
    <param name="robot_description" command="{xacro} thruster_config:={thrusters} namespace:={name}"/>
    <node pkg="gazebo_ros" type="spawn_model" name="spawn_{name}"
          args="-x {x} -y {y} -Y 1 -urdf -param robot_description -model {spawned or name}"/>
  </group>
"""


def launch(*boats):
    """A launch file with these boats."""
    Path("my.launch").write_text(LAUNCH.format(boats="".join(boats)), encoding="utf-8")
    return "my.launch"


def simulated(name, fleet=None):
    """A simulation of a file, reset."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        sim = vrx_mj.Simulation(vrx_mj.compile_world(name, fleet=fleet))
    sim.reset(seed=1)
    return sim


def heights(sim):
    """Heights of the water over a minute at one place [m], once the sea has risen."""
    return np.array([float(sim.sea.height(-532.0, 162.0, t)) for t in np.arange(20.0, 80.0, 0.5)])


def test_1_waves_are_as_high_as_the_gain_says():
    """All components of the sea are proportional to the gain."""
    low = heights(simulated(world()))
    high = heights(simulated(world(('gain="0.1"', 'gain="0.3"'))))
    flat = heights(simulated(world(('gain="0.1"', 'gain="0"'))))
    assert low.std() > 0.02
    assert high == pytest.approx(3 * low, abs=1e-9)
    assert not flat.any()


def test_2_wind_blows_where_the_file_says():
    sim = simulated(world())
    sim.step(duration=1.0)
    assert sim.wind.velocity(sim.time)[:2] == pytest.approx(
        [6 * math.cos(math.radians(240)), 6 * math.sin(math.radians(240))]
    )


def test_3_fog_and_light_are_those_of_the_file():
    scene = load_world(world()).scene
    assert (scene.fog.start, scene.fog.end, scene.fog.density) == (5.0, 60.0, 0.1)
    assert scene.ambient[:3] == (0.3, 0.3, 0.3)
    assert load_world(world(("<end>60</end>", "<end>30</end>"))).scene.fog.end == 30.0


def test_4_a_buoy_of_ones_own_floats_where_it_is_included():
    sim = simulated(world(objects=BUOY))
    sim.step(duration=5.0)
    x, y, z = sim.observe_object("my_buoy").position
    assert (x, y) == pytest.approx((-520, 190), abs=1.0)
    assert abs(z) < 0.6


def test_5_a_dock_has_a_block_for_each_x_of_its_template():
    folder = Path("models/my_dock")
    folder.mkdir(parents=True)
    config = "<model><name>my_dock</name><version>1.0</version><sdf version='1.6'>model.sdf</sdf></model>"
    (folder / "model.config").write_text(config, encoding="utf-8")
    (folder / "model.sdf.erb").write_text(TEMPLATE, encoding="utf-8")
    sim = simulated(world(objects=DOCK))
    blocks = [sim.model.geom(geom).name for geom in range(sim.model.ngeom)]
    cells = {name.rpartition("block_")[2] for name in blocks if name.startswith("my_dock/")}
    rows = ["XXX", "X X", "X X"]
    assert cells == {f"{row}_{at}" for row, line in enumerate(rows) for at, one in enumerate(line) if one == "X"}
    assert sim.model.body("my_dock/base/dock").pos[:2] == pytest.approx([-505, 175])


def test_6_a_wamv_of_ones_own_has_its_thrusters_and_sensors():
    Path("thrusters.yaml").write_text(THRUSTERS, encoding="utf-8")
    Path("components.yaml").write_text(COMPONENTS, encoding="utf-8")
    parts = ["--thrusters", "thrusters.yaml", "--components", "components.yaml"]
    vrx("robot", "build", *parts, "-o", "my_wamv.urdf", cwd=".")
    assert Path("my_wamv.urdf").is_file()
    sim = simulated("ocean", "my_wamv.urdf")
    assert sorted(sim.command_names("wamv")) == ["bow", "bow_angle", "left", "left_angle", "right", "right_angle"]
    end = sim.step({"wamv": {"bow": 1.0}}, duration=1.0)["wamv"]
    ahead, port, _ = end.velocity
    assert port > 2 * abs(ahead)
    assert end.heading > 0.1


def test_7_more_boats_are_where_the_launch_file_spawns_them_with_their_own_thrusters():
    world()
    sim = simulated(launch(boat("one", -532, 162, "H"), boat("two", -542, 164, "X")))
    assert sim.boats == ("one", "two")
    start = sim.step(duration=0.01)
    places = {name: start[name].position[:2].copy() for name in sim.boats}
    assert places["one"] == pytest.approx([-532, 162], abs=0.05)
    assert places["two"] == pytest.approx([-542, 164], abs=0.05)
    assert [len(sim.command_names(name)) for name in sim.boats] == [4, 8]


def test_two_boats_of_one_name_are_refused_with_the_line_of_the_first():
    """The wrong example of VRX's guide to several boats."""
    world()
    wrong = launch(boat("one", -532, 162, "H"), boat("two", -542, 164, "X", spawned="one"))
    with pytest.raises(ConfigError) as caught:
        simulated(wrong)
    assert str(caught.value) == (
        "my.launch:11:5: <node> 'spawn_two' / args: a model named 'one' is spawned on line 6 already: "
        "each needs -model NAME of its own"
    )


def test_two_objects_of_one_name_are_refused():
    name = world(objects=BUOY + "\n" + BUOY)
    with pytest.raises(ConfigError) as caught:
        load_world(name)
    assert str(caught.value) == "my.world.xacro:18:1: objects[1].name: duplicate name 'my_buoy'"
