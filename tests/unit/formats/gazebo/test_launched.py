"""Objects that a launch file spawns: they join its world, as it is and imported, with their names and poses."""

import math
import warnings
from itertools import count
from pathlib import Path

import pytest

from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.gazebo.importing import import_files
from vrx_mj.formats.gazebo.launch import launch_of
from vrx_mj.formats.gazebo.opening import open_source
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.simulation import Simulation

CRATE = """<sdf version="1.6"><model name="crate">{pose}<link name="l"><inertial><mass>50</mass></inertial>
<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link>{plugin}</model></sdf>"""
THRUSTER = '<plugin name="t" filename="libgz-sim-thruster-system.so"/>'
OPENS = (
    '<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" value="{world}"/></include>'
)


NUMBERS = count()


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for key in ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH"):
        monkeypatch.delenv(key, raising=False)
    crate("crate")


def crate(folder, pose="", plugin=""):
    """Write a model."""
    file = Path(folder) / "model.sdf"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(CRATE.format(pose=pose, plugin=plugin), encoding="utf-8")


def node(options, name=""):
    """A node that spawns a model; without a name it has one of its own."""
    name = name or f"spawn_{next(NUMBERS)}"
    return f'<node pkg="gazebo_ros" type="spawn_model" name="{name}" args="{options}"/>'


def write(*nodes, world="$(find wave_gazebo)/worlds/ocean.world", head=""):
    """Write a launch file that opens a world and spawns models."""
    text = "\n".join(["<launch>", head, *([OPENS.format(world=world)] if world else []), *nodes, "</launch>"])
    Path("bay.launch").write_text(text, encoding="utf-8")


def notes():
    """What became of each node."""
    return [(one.what, one.fate, one.ours) for one in launch_of("bay.launch", {}).report.notes[1:]]


def world_of():
    """The world that the launch file opens."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        return load_world(open_source("bay.launch", None, {})[0])


def things(world):
    """Names, models and poses of the objects of a world."""
    return [(thing.name, thing.model, thing.pose) for thing in world.objects]


def test_an_object_joins_the_world_with_its_name_and_pose():
    write(node("-sdf -file $(dirname)/crate/model.sdf -model box_1 -x 4 -y -2 -z 0.5 -R 0.1 -P 0.2 -Y 1"))
    assert things(world_of()) == [("box_1", "./crate/model.sdf", (4.0, -2.0, 0.5, 0.1, 0.2, 1.0))]
    assert notes() == [("<node> 'box_1'", "imported", "`objects` of the world")]


def test_a_pose_of_the_model_itself_is_in_the_frame_of_the_spawned_one():
    crate("turned", "<pose>1 0 0 0 0 0.5</pose>")
    write(node(f"-sdf -file turned/model.sdf -model a -x 10 -Y {math.pi / 2}"))
    (thing,) = launch_of("bay.launch", {}).objects
    assert thing.pose == pytest.approx((10, 1, 0, 0, 0, math.pi / 2 + 0.5))


@pytest.mark.parametrize(
    ("options", "model"),
    [
        ("-database mb_marker_buoy_red", "mb_marker_buoy_red"),
        ("-database crate", "./crate/model.sdf"),
        ("-sdf -file $(find vrx_gazebo)/models/mb_marker_buoy_red/model.sdf", "mb_marker_buoy_red"),
        ("-sdf -param text", "./crate/model.sdf"),
        ("-sdf -param command", "./crate/model.sdf"),
    ],
)
def test_a_model_is_named_in_each_way_of_spawn_model(options, model):
    head = '<param name="text" textfile="$(dirname)/crate/model.sdf"/>'
    head += '<param name="command" command="cat $(dirname)/crate/model.sdf"/>'
    write(node(f"{options} -model a"), head=head)
    assert [one[:2] for one in things(world_of())] == [("a", model)]


def test_a_template_is_read_where_catkin_would_have_made_the_model():
    Path("dock").mkdir()
    Path("dock/model.sdf.erb").write_text("<%\nlayout = ['X X', 'XXX']\n%>\n<sdf/>", encoding="utf-8")
    write(node("-sdf -file dock/model.sdf -model pier"))
    assert [one[:2] for one in things(world_of())] == [("pier", "./dock/model.sdf.erb")]


def test_objects_join_those_of_the_world():
    own = "<include><uri>model://crate</uri><name>first</name><pose>9 9 0 0 0 0</pose></include>"
    Path("bay.world").write_text(f'<sdf version="1.6"><world name="bay">{own}</world></sdf>', encoding="utf-8")
    write(node("-sdf -file crate/model.sdf -model second"), world="$(dirname)/bay.world")
    world = world_of()
    assert (world.name, [thing.name for thing in world.objects]) == ("bay", ["first", "second"])
    Path("bay.yaml").write_text("objects: [{name: first, model: ./crate/model.sdf}]\n", encoding="utf-8")
    write(node("-sdf -file crate/model.sdf -model second"), world="$(dirname)/bay.yaml")
    assert [thing.name for thing in world_of().objects] == ["first", "second"]


def test_a_model_with_thrusters_is_a_boat():
    crate("tug", plugin=THRUSTER)
    write(node("-sdf -file tug/model.sdf -model a"), node("-database tug -model b -x 9"))
    launch = launch_of("bay.launch", {})
    assert [boat.name for boat in launch.boats] == ["a", "b"]
    assert not launch.objects


@pytest.mark.parametrize("thing", ["crate", "tug"])
def test_a_boat_has_the_pose_of_its_own_file_as_an_object_has(thing):
    crate(thing, pose="<pose>1 0 0.25 0 0 0.5</pose>", plugin=THRUSTER if thing == "tug" else "")
    write(node(f"-sdf -file {thing}/model.sdf -model a -x 10 -Y 1.5707963267948966"))
    launch = launch_of("bay.launch", {})
    (found,) = launch.boats or launch.objects
    assert bool(launch.boats) == (thing == "tug")
    assert found.pose == pytest.approx((10.0, 1.0, 0.25, 0.0, 0.0, math.pi / 2 + 0.5), abs=1e-12)


def test_two_nodes_of_one_name_are_refused_as_roslaunch_refuses_them():
    write(node("-database mb_marker_buoy_red -model a", "s"), node("-database mb_marker_buoy_red -model b", "s"))
    with pytest.raises(ConfigError) as error:
        launch_of("bay.launch", {})
    said = "duplicate node name '/s', first on line 4: roslaunch refuses to start; rename one of them"
    assert str(error.value) == f"bay.launch:5:1: <node> 's' / name: {said}"


@pytest.mark.parametrize("other", ['<group ns="red">{}</group>', '<group ns="/red/">{}</group>'])
def test_nodes_of_one_name_may_be_in_two_namespaces(other):
    first, second = (node(f"-database mb_marker_buoy_red -model {name}", "s") for name in "ab")
    write(first, other.format(second))
    assert [one.name for one in launch_of("bay.launch", {}).objects] == ["a", "b"]


def test_a_node_of_that_name_in_another_file_is_named_with_it():
    one = node("-database mb_marker_buoy_red -model b", "s").replace("<node", '<node ns="red"')
    Path("other.launch").write_text(f"<launch>\n{one}\n</launch>\n", encoding="utf-8")
    write(
        '<include file="$(dirname)/other.launch"/>', '<group ns="red">', node("-database x -model a", "s"), "</group>"
    )
    with pytest.raises(
        ConfigError, match=r"^bay\.launch:6:1: .* duplicate node name '/red/s', first on other\.launch:2"
    ):
        launch_of("bay.launch", {})


def test_models_that_are_not_there_are_noted():
    write(node("-sdf -file buoy/model.sdf -model a"), node("-database no_such_buoy -model b"))
    first, second = notes()
    assert first == ("<node> 'a'", "ignored", "no file 'buoy/model.sdf'; there is no folder 'buoy'")
    advice = "no model named 'no_such_buoy'; is its folder on GAZEBO_MODEL_PATH?"
    assert second == ("<node> 'b'", "ignored", advice)


def test_arguments_of_the_xacro_of_an_object_are_noted():
    Path("crate/model.sdf").rename("crate/model.sdf.xacro")
    head = '<param name="text" command="xacro $(dirname)/crate/model.sdf.xacro size:=3"/>'
    write(node("-sdf -param text -model a"), head=head)
    assert notes()[0] == ("<node> 'a'", "ignored", "an SDF takes no xacro arguments: size")
    assert [one[0] for one in things(world_of())] == ["a"]


def test_two_models_of_one_name_are_refused():
    write(node("-sdf -file crate/model.sdf -model a"), node("-database mb_marker_buoy_red -model a", "s"))
    with pytest.raises(ConfigError) as error:
        launch_of("bay.launch", {})
    said = "duplicate model name 'a', first spawned on line 4: give each its own -model NAME"
    assert str(error.value) == f"bay.launch:5:1: <node> 's' / args: {said}"


@pytest.mark.parametrize("read", [world_of, lambda: import_files(Path("bay.launch"))])
def test_a_name_that_the_world_has_already_is_refused(read):
    own = "<include><uri>model://crate</uri><name>a</name></include>"
    Path("bay.world").write_text(f'<sdf version="1.6"><world name="bay">\n{own}</world></sdf>', encoding="utf-8")
    write(node("-sdf -file crate/model.sdf -model a"), world="bay.world")
    with pytest.raises(ConfigError) as error:
        read()
    said = "the world already has a model named 'a' (bay.world:2): give each its own -model NAME"
    assert str(error.value) == f"bay.launch:4:1: <node> 'a' / args: {said}"


def test_without_a_world_an_object_has_none_to_join():
    write(node("-sdf -file crate/model.sdf -model a"), world="")
    (note,) = launch_of("bay.launch", {}).report.notes
    assert (note.fate, note.ours) == ("ignored", "this launch file opens no world to add it to")


def test_a_fleet_says_that_it_has_the_boats_alone():
    crate("tug", plugin=THRUSTER)
    write(node("-sdf -file crate/model.sdf -model a"), node("-sdf -file tug/model.sdf -model b"))
    text = "bay.launch: a fleet takes only its boats; it also spawns a; vrx-mj run bay.launch includes them "
    with pytest.warns(VrxWarning) as said:
        load_fleet("bay.launch", load_world("sydney_regatta"))
    assert str(said[0].message) == f"{text}if it opens a world"


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_what_is_imported_compiles_and_sails_alike():
    buoy = node("-database mb_marker_buoy_red -model b -y 5")
    write(node("-sdf -file crate/model.sdf -model a -x 3 -z 1 -Y 1"), buoy)
    made = import_files(Path("bay.launch"))
    assert made.sails == [("bay_world.yaml", "none")]
    for path, text in made.texts.items():
        file = Path("out") / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    ends = []
    for source, fleet in (("bay.launch", None), ("out/bay_world.yaml", "none")):
        simulation = Simulation(compile_world(source, fleet=fleet))
        assert not simulation.world.boats
        simulation.reset(seed=3)
        simulation.step({}, duration=2.0)
        ends.append(simulation.data.qpos.tobytes())
        assert {"a", "b"} <= {thing.name for thing in load_world(open_source(source, None, {})[0]).objects}
    assert ends[0] == ends[1]


@pytest.mark.parametrize("path", ["../../secret/model.sdf", "/etc/hostname/model.sdf"])
def test_no_model_outside_the_folder_is_read(path, tmp_path):
    crate(tmp_path.parent / "secret")
    write(node(f"-sdf -file {path} -model a"))
    launch = launch_of("bay.launch", {})
    assert not launch.objects
    assert launch.report.notes[-1].fate == "ignored"
    assert launch.report.notes[-1].ours.startswith(f"may not read '{path}': outside the folder")
