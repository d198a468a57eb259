"""The steps of VRX's first tutorial with its kinds of file: parameters, world, course, dock, WAM-V, more boats.

The files are our own writing, with the tags, names and mistakes of those that the tutorials print; each step is
measured in what the simulator makes of them. The steps, in their order:

1. the gain of `ocean_waves` in the world file; 2. the wind in it; 3. fog and ambient light in its scene;
4. objects of the course, as `<include>` without names; 5. a dock by the layout of its `model.sdf.erb`;
6. a WAM-V from `thruster_config.yaml` and `component_config.yaml`, by `sandisland.launch urdf:=`;
7. more boats, each by a copy of `param` and `spawn_model` with a namespace of its own.
"""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from vrx_command import vrx
from vrx_layout import LAUNCHES, write_vrx
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.gazebo.launch import read_launch

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
COURSE = """
    <include>
      <!-- a small buoy -->
      <uri>model://polyform_a3</uri>
      <pose>-522 158 0 0 0 0</pose>
    </include>
    <include><uri>model://polyform_a7</uri><pose>-524 172 0 0 0 0</pose></include>
    <include><uri>model://surmark950400</uri><pose>-526.5 166 0 0 0 0</pose></include>
"""
SCENE = """<scene>
    <sky><clouds><speed>12</speed></clouds></sky>
    <grid>0</grid>
    <fog>
      <type> linear</type>
      <color> 0.7 0.7 0.7 1 </color>
      <density> 0.0 </density>
    </fog>
    <ambient> 1.0 1.0 1.0 1 </ambient>
  </scene>"""
DOCK = "<include><name>my_dock</name><uri>model://my_dock</uri><pose>-505 175 0 0 0 0.5</pose></include>"
TEMPLATE = """<?xml version="1.0"?>
<%
  layout = ['XXX',
            'X X',
            'X X', true]
%>
<sdf version="1.6"><model name="my_dock"></model></sdf>
"""
PRINTED = """<?xml version="1.0" ?>
<sdf version="1.6">

  <!-- generated: change the template -->

  <model name="robotx_dock_2016_base">
<%
layout = [
'X  X',
'XXXXXXX',
'XXXX',
]
%>
<%= ERB.new(File.read('dock_generator.erb'),
                  nil, '-', 'dock').result(binding) %>
  </model>
</sdf>
"""
LAUNCH = """<launch>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(dirname)/my.world.xacro"/></include>
{boats}</launch>
"""
MULTI = """<launch>
  <arg name="world" default="$(find vrx_gazebo)/worlds/example_course.world" />
  <arg name="verbose" default="true"/>
  <arg name="namespace_a" default="defender_a"/>
  <arg name="namespace_b" default="defender_b"/>
  <arg name="x" default="-532" />
  <arg name="y" default="162" />
  <arg name="thrust_config" default="T" />
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(arg world)"/>
    <arg name="verbose" value="$(arg verbose)"/>
  </include>
  <arg name="t_config" value="$(eval int((thrust_config)=='T'))"/>
  <arg if="$(arg t_config)" name="urdf" default="$(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"/>
  <param name="$(arg namespace_a)/robot_description"
         command="$(find xacro)/xacro &#x002D;&#x002D;inorder '$(arg urdf)'
         thruster_config:=$(arg thrust_config) vrx_sensors_enabled:=true namespace:=$(arg namespace_a) "/>
  <node name="spawn_model" pkg="gazebo_ros" type="spawn_model"
        args="-x $(arg x) -y $(arg y) -z 0.1 -R 0 -P 0 -Y 1
              -urdf -param $(arg namespace_a)/robot_description -model defender_a"/>
  <param name="$(arg namespace_b)/robot_description"
         command="$(find xacro)/xacro &#x002D;&#x002D;inorder '$(arg urdf)'
         thruster_config:=$(arg thrust_config) vrx_sensors_enabled:=true namespace:=$(arg namespace_b) "/>
  <node name="spawn_model_b" pkg="gazebo_ros" type="spawn_model"
        args="-x -522 -y 172 -z 0.1 -R 0 -P 0 -Y 2.5708
              -urdf -param $(arg namespace_b)/robot_description -model defender_b"/>
</launch>
"""
THRUSTERS = """engine:
  - prefix: "left"
    position: "-2.373776 1.027135 0.318237"
    orientation: "0.0 0.0 0.0"
  - prefix: "right"
    position: "-2.373776 -1.027135 0.318237"
    orientation: "0.0 0.0 0.0"
  - prefix: "bow"
    position: "1.0 0.0 0.318237"
    orientation: "0.0 0.0 1.5708"
"""
COMPONENTS = """wamv_camera:
    - name: front_left_camera
      x: 0.75
      y: 0.1
      P: ${radians(15)}
wamv_gps:
    - name: gps_wamv
      x: -0.85
wamv_imu:
    - name: imu_wamv
      y: -0.2
wamv_p3d:
    - name: p3d_wamv
lidar:
    - name: lidar_wamv
      type: 16_beam
      P: ${radians(8)}
"""


@pytest.fixture(scope="module")
def vrx_sources(tmp_path_factory):
    """The sources of a workspace with VRX's packages."""
    return write_vrx(tmp_path_factory.mktemp("vrx_ws"))


BESIDE = pytest.param("beside VRX", marks=[pytest.mark.slow, pytest.mark.nightly])


@pytest.fixture(autouse=True, params=["alone", BESIDE])
def _elsewhere(tmp_path, monkeypatch, vrx_sources, request):
    """A folder of a user who has no ROS, or who has sourced VRX's workspace."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", "" if request.param == "alone" else str(vrx_sources))


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


def compile_launch(name, *arguments):
    """The world of a launch file with arguments, as `roslaunch` takes them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        return vrx_mj.compile_world(name, arguments=dict(one.split(":=", 1) for one in arguments))


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
    assert (scene.fog.type, scene.fog.start, scene.fog.end) == ("linear", 5.0, 60.0)
    assert scene.ambient[:3] == (0.3, 0.3, 0.3)
    assert load_world(world(("<end>60</end>", "<end>30</end>"))).scene.fog.end == 30.0


def test_3_a_scene_as_printed_replaces_that_of_the_place():
    """Spaces around the words, and no start and end of the fog: SDF has 1 m and 100 m."""
    before, after = WORLD.index("<xacro:scene_macro>"), WORLD.index("</xacro:scene_macro>")
    macro = WORLD[before : after + len("</xacro:scene_macro>")]
    with pytest.warns(VrxWarning, match="<clouds> ignored: clouds are not drawn"):
        scene = load_world(world((macro, SCENE))).scene
    assert (scene.fog.start, scene.fog.end, scene.fog.color[:3]) == (1.0, 100.0, (0.7, 0.7, 0.7))
    assert scene.ambient[:3] == (1.0, 1.0, 1.0)


@pytest.mark.slow
def test_3_a_camera_sees_the_fog():
    """Past the fog's end only its colour is left."""

    def horizon(name):
        sim = simulated(name, {"sensors": "vrx"})
        sim.step(duration=0.1)
        rows = sim.sense("wamv")["front_left_camera"].data.rgb
        return rows[rows.shape[0] // 4].astype(float)

    thick = horizon(world(("<end>60</end>", "<end>20</end>")))
    clear = horizon(world(("<end>60</end>", "<end>100000</end>"), ("<start>5<", "<start>99999<")))
    assert np.abs(thick - 0.8 * 255).max() < 12
    assert np.abs(clear - 0.8 * 255).max() > 30


def test_4_a_buoy_of_ones_own_floats_where_it_is_included():
    sim = simulated(world(objects=BUOY))
    sim.step(duration=5.0)
    x, y, z = sim.observe_object("my_buoy").position
    assert (x, y) == pytest.approx((-520, 190), abs=1.0)
    assert abs(z) < 0.6


def test_4_objects_without_names_are_called_as_their_models():
    sim = simulated(world(objects=COURSE))
    sim.step(duration=5.0)
    places = {"polyform_a3": (-522, 158), "polyform_a7": (-524, 172), "surmark950400": (-526.5, 166)}
    for name, place in places.items():
        assert sim.observe_object(name).position[:2] == pytest.approx(place, abs=1.0)


def test_4_the_world_is_that_of_the_argument():
    """`sydneyregatta.launch world:=FILE`: one boat at the start of the launch file."""
    source = compile_launch("sydneyregatta.launch", f"world:={Path(world(objects=BUOY)).absolute()}")
    assert source.boats == ("wamv",)
    sim = vrx_mj.Simulation(source)
    sim.reset(seed=1)
    assert sim.observe()["wamv"].position[:2] == pytest.approx([-532, 162], abs=0.05)
    assert sim.observe_object("my_buoy").position[:2] == pytest.approx([-520, 190], abs=0.05)


@pytest.mark.parametrize(
    ("template", "rows"),
    [(TEMPLATE, ["XXX", "X X", "X X"]), (PRINTED, ["X  X", "XXXXXXX", "XXXX"])],
    ids=["with_its_last_entry", "as_printed"],
)
def test_5_a_dock_has_a_block_for_each_x_of_its_template(template, rows):
    """As printed: rows of unequal length, the name of another model, and no `true` or `false` at the end."""
    folder = Path("models/my_dock")
    folder.mkdir(parents=True)
    config = "<model><name>robotx_dock_2016</name><version>1.0</version><sdf version='1.6'>model.sdf</sdf></model>"
    (folder / "model.config").write_text(config, encoding="utf-8")
    (folder / "model.sdf.erb").write_text(template, encoding="utf-8")
    sim = simulated(world(objects=DOCK))
    blocks = [sim.model.geom(geom).name for geom in range(sim.model.ngeom)]
    cells = {name.rpartition("block_")[2] for name in blocks if name.startswith("my_dock/")}
    assert cells == {f"{row}_{at}" for row, line in enumerate(rows) for at, one in enumerate(line) if one == "X"}
    assert sim.model.body("my_dock/base/dock").pos[:2] == pytest.approx([-505, 175])


@pytest.mark.slow
def test_6_a_wamv_of_ones_own_has_its_thrusters_and_sensors():
    Path("thruster_config.yaml").write_text(THRUSTERS, encoding="utf-8")
    Path("component_config.yaml").write_text(COMPONENTS, encoding="utf-8")
    parts = ["--thrusters", "thruster_config.yaml", "--components", "component_config.yaml"]
    vrx("robot", "build", *parts, "-o", "my_wamv.urdf", cwd=".")
    sim = vrx_mj.Simulation(compile_launch("sandisland.launch", f"urdf:={Path('my_wamv.urdf').absolute()}"))
    start = sim.reset(seed=1)["wamv"]
    assert start.position[:2] == pytest.approx([158, 108], abs=0.05)
    assert sorted(sim.command_names("wamv")) == ["bow", "bow_angle", "left", "left_angle", "right", "right_angle"]
    assert sorted(sim.sensors("wamv")) == ["front_left_camera", "gps_wamv", "imu_wamv", "lidar_wamv", "p3d_wamv"]
    end = sim.step({"wamv": {"bow": 1.0}}, duration=1.0)["wamv"]
    ahead, port, _ = end.velocity
    assert port > 2 * abs(ahead)
    assert end.heading - start.heading > 0.1
    fix = sim.sense("wamv")["gps_wamv"].data
    assert (fix.latitude, fix.longitude) == pytest.approx((21.3109, -157.8885), abs=2e-4)


def test_7_more_boats_are_where_the_launch_file_spawns_them_with_their_own_thrusters():
    world()
    sim = simulated(launch(boat("one", -532, 162, "H"), boat("two", -542, 164, "X")))
    assert sim.boats == ("one", "two")
    start = sim.step(duration=0.01)
    places = {name: start[name].position[:2].copy() for name in sim.boats}
    assert places["one"] == pytest.approx([-532, 162], abs=0.05)
    assert places["two"] == pytest.approx([-542, 164], abs=0.05)
    assert [len(sim.command_names(name)) for name in sim.boats] == [4, 8]


def test_7_the_second_boat_of_the_guide_is_ten_metres_off_and_turned():
    Path("rxi_multi.launch").write_text(MULTI, encoding="utf-8")
    source = compile_launch("rxi_multi.launch", "verbose:=true")
    assert source.boats == ("defender_a", "defender_b")
    start = vrx_mj.Simulation(source).reset(seed=1)
    first, second = (start[name] for name in source.boats)
    assert second.position[:2] - first.position[:2] == pytest.approx([10, 10], abs=0.05)
    assert second.heading - first.heading == pytest.approx(math.pi / 2, abs=0.01)


def test_two_boats_of_one_name_in_the_guides_file_are_refused():
    Path("rxi_multi.launch").write_text(MULTI.replace("-model defender_b", "-model defender_a"), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        compile_launch("rxi_multi.launch")
    assert str(caught.value) == (
        "rxi_multi.launch:24:3: <node> 'spawn_model_b' / args: duplicate model name 'defender_a', first spawned "
        "on line 18: give each its own -model NAME"
    )


def test_two_boats_of_one_name_are_refused_with_the_line_of_the_first():
    """The wrong example of VRX's guide to several boats."""
    world()
    wrong = launch(boat("one", -532, 162, "H"), boat("two", -542, 164, "X", spawned="one"))
    with pytest.raises(ConfigError) as caught:
        simulated(wrong)
    assert str(caught.value) == (
        "my.launch:11:5: <node> 'spawn_two' / args: duplicate model name 'one', first spawned on line 6: give "
        "each its own -model NAME"
    )


def test_of_two_objects_of_one_name_the_second_is_left_out():
    with pytest.warns(VrxWarning) as told:
        load_world(world(objects=BUOY + "\n" + BUOY))
    line = (
        "my.world.xacro:18: <include> 'my_buoy' not read: a model named 'my_buoy' is included on line 17 "
        "already: change one <name>"
    )
    assert [line in str(one.message) for one in told].count(True) == 1


@pytest.mark.slow
def test_the_launch_files_of_vrx_itself_open_their_own_worlds_and_boats(vrx_sources):
    """As the user's workspace has them; without packages beside it ours stand for them."""
    for name, world in LAUNCHES.items():
        launch = read_launch(vrx_sources / "vrx" / name, {})
        assert [boat.name for boat in launch.boats] == ["wamv"]
        package = vrx_sources / "vrx" / name.partition("/")[0]
        assert launch.world == package / f"worlds/{world.rpartition('/')[2]}.world.xacro"


@pytest.mark.slow
def test_a_launch_file_of_vrx_itself_sails(vrx_sources):
    sim = simulated(str(vrx_sources / "vrx/vrx_gazebo/launch/vrx.launch"))
    start = sim.step({"wamv": {"left": 1.0, "right": 1.0}}, duration=5.0)["wamv"]
    assert len(sim.command_names("wamv")) == 6
    assert start.velocity[0] > 1.0
