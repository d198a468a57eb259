"""Folders, catkin workspaces and packages: which of their files is opened, and what is said of none or several."""

import os
import pickle
from pathlib import Path

import pytest

from vrx_mj.config.search import workspace_packages
from vrx_mj.errors import ChoiceError, UnknownNameError, VrxError, VrxWarning
from vrx_mj.formats.gazebo.launch import launch_of, read_launch
from vrx_mj.formats.gazebo.opening import file_in, file_of_folder, open_source, short_names
from vrx_mj.formats.gazebo.worlds import gazebo_world
from vrx_mj.mjcf.compile import compile_world
from work import calls_at_most
from workspaces import PACKAGES, PRACTICE, TWO_BOATS, write_workspace

BAY = '<sdf version="1.6"><world name="bay"/></sdf>'
EMPTY_WORLD = (
    '<launch><include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" value="%s"/></include>'
    "</launch>"
)


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """The current folder, below one that is no user's home."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


def written(**files):
    """Write files; `__` in a key is a slash, `_dot_` a dot."""
    for key, text in files.items():
        path = Path(key.replace("__", "/").replace("_dot_", "."))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def message(load, *arguments):
    """What an error says."""
    with pytest.raises(VrxError) as raised:
        load(*arguments)
    return str(raised.value)


def test_the_one_launch_file_that_starts_a_world_is_opened():
    write_workspace(Path("ws"), without=(TWO_BOATS,))
    assert file_of_folder(Path("ws")) == Path("ws/src/team_gazebo/launch") / PRACTICE
    with pytest.warns(VrxWarning, match="<node> 'follow' ignored"):
        world, fleet = open_source("ws", None, {})
    assert world == Path("ws/src/team_gazebo/worlds/practice.world.xacro").resolve()
    assert [boat["name"] for boat in fleet["boats"]] == ["team"]


def test_a_launch_file_of_nodes_alone_is_started_beside_a_world():
    written(keys_dot_launch='<launch><node pkg="a" type="b" name="c"/></launch>')
    advice = "start it beside one: vrx-mj serve WORLD --ros1, then roslaunch keys.launch"
    assert message(open_source, "keys.launch", None, {}) == (
        f"keys.launch: opens no Gazebo world and spawns no boat; {advice}"
    )


def test_arguments_reach_the_launch_file_of_a_folder():
    write_workspace(Path("ws"), without=(TWO_BOATS,))
    written(ws__src__team_gazebo__worlds__bay_dot_world=BAY)
    with pytest.warns(VrxWarning, match="follow"):
        world, _ = open_source("ws", None, {"world": "../worlds/bay.world"})
    assert world == Path("ws/src/team_gazebo/worlds/bay.world").resolve()


def test_of_several_launch_files_each_is_listed_with_its_command():
    write_workspace(Path("ws"))
    with pytest.raises(ChoiceError) as raised:
        file_of_folder(Path("ws"))
    assert raised.value.text("serve").splitlines() == [
        "ws has 2 launch files that open a world; type one of these:",
        "  vrx-mj serve ws practice.launch   # practice.world.xacro, 1 boat: team",
        "  vrx-mj serve ws two_boats.launch  # practice.world.xacro, 2 boats: red, blue",
    ]
    assert str(pickle.loads(pickle.dumps(raised.value))) == str(raised.value) == raised.value.text("run")


def test_what_the_list_says_to_type_is_opened():
    write_workspace(Path("ws"))
    for name in (PRACTICE, TWO_BOATS):
        assert Path(file_in("ws", name)) == Path("ws/src/team_gazebo/launch") / name


def test_a_launch_file_that_another_includes_does_not_count():
    written(ws__bay_dot_world=BAY,
            ws__world_dot_launch=EMPTY_WORLD % "$(dirname)/bay.world",
            ws__all_dot_launch='<launch><include file="$(dirname)/world.launch"/></launch>')  # fmt: skip
    assert file_of_folder(Path("ws")) == Path("ws/all.launch")


def test_a_launch_file_that_is_wrong_is_named_beside_the_one_that_is_opened():
    written(ws__bay_dot_world=BAY, ws__a_dot_launch=EMPTY_WORLD % "$(dirname)/bay.world", ws__b_dot_launch="<launch>")
    with pytest.warns(VrxWarning) as caught:
        assert file_of_folder(Path("ws")) == Path("ws/a.launch")
    assert [str(one.message).splitlines() for one in caught] == [
        [
            "ws: launch files that are not read",
            "ws/b.launch:1:9: the file ends before </launch>, which ends the <launch> of line 1",
        ]
    ]


def test_where_all_are_wrong_the_message_is_theirs():
    written(ws__b_dot_launch="<launch>")
    said = "ws/b.launch:1:9: the file ends before </launch>, which ends the <launch> of line 1"
    assert message(file_of_folder, Path("ws")) == said


def test_without_launch_files_the_one_world_is_opened():
    written(ws__worlds__bay_dot_world_dot_xacro=BAY, ws__worlds__bay_dot_world=BAY,
            ws__buoy__model_dot_sdf=PACKAGES["team_models"]["models/team_buoy/model.sdf"])  # fmt: skip
    assert file_of_folder(Path("ws")) == Path("ws/worlds/bay.world.xacro")


def test_of_several_worlds_each_is_listed_by_a_name_of_its_own():
    written(a__bay_dot_world=BAY, b__bay_dot_world=BAY, c__lake_dot_world=BAY)
    assert message(file_of_folder, Path()).splitlines() == [
        "the current folder has 3 worlds; type one of these:",
        "  vrx-mj run . a/bay.world",
        "  vrx-mj run . b/bay.world",
        "  vrx-mj run . lake.world",
    ]


def test_a_world_with_the_name_of_a_folder_is_the_world():
    Path("ocean").mkdir()
    assert open_source("ocean", None, {}) == ("ocean", None)


@pytest.mark.parametrize(("files", "said"), [
    ({}, "'ws': no launch file and no Gazebo world in this folder"),
    ({"ws__notes_dot_txt": "x"}, "'ws': no launch file and no Gazebo world in this folder"),
    ({"ws__buoy__model_dot_config": "<model/>"},
     "'ws': no world, but models: buoy; name one in a world's `objects` as model: model://NAME"),
    ({"ws__boat_dot_urdf": "<robot/>"},
     "'ws': no world, but boats: boat.urdf; sail one: vrx-mj run example_course --fleet FILE"),
    ({"ws__a_dot_launch": "<launch/>"},
     "'ws': its launch files open no world: a.launch; pass one to --fleet, with a world"),
    ({"ws__a_dot_launch_dot_py": ""},
     "'ws': no world; ROS 2 launch files are programs, which are not run: a.launch.py"),
    ({"ws__bay_dot_yaml": "extends: ocean"},
     "'ws': no launch file and no Gazebo world; name one of its YAML files: bay.yaml"),
    ({"ws__build__bay_dot_world": BAY, "ws__dot__x": ""},
     "'ws': no launch file and no Gazebo world in this folder"),
])  # fmt: skip
def test_a_folder_without_a_world_says_what_it_has(files, said):
    Path("ws").mkdir()
    written(**files)
    assert message(file_of_folder, Path("ws")) == said


def test_links_in_circles_and_out_of_the_folder_are_not_followed(tmp_path):
    outside = tmp_path / "outside"
    write_workspace(outside)
    Path("ws/src").mkdir(parents=True)
    Path("ws/src/back").symlink_to("../..")
    Path("ws/src/team_gazebo").symlink_to(outside / "src" / "team_gazebo")
    Path("ws/bay.world").symlink_to(outside / "src" / "team_gazebo" / "worlds" / "practice.world.xacro")
    said = "'ws': no world; symbolic links are not followed: name the folder that 'ws/src/back' points to"
    assert message(file_of_folder, Path("ws")) == said


@pytest.mark.slow
def test_a_folder_of_twenty_thousand_files_takes_a_moment():
    for number in range(100):
        Path(f"ws/{number}").mkdir(parents=True)
        for name in range(200):
            os.close(os.open(f"ws/{number}/{name}.txt", os.O_CREAT))
    with calls_at_most(6_000_000):
        assert message(file_of_folder, Path("ws")) == "'ws': no launch file and no Gazebo world in this folder"


def test_too_many_launch_files_are_not_read():
    for number in range(201):
        written(**{f"ws__a{number}_dot_launch": "<launch/>"})
    assert message(file_of_folder, Path("ws")) == "201 launch files in ws: name one, or a smaller folder"


@pytest.mark.parametrize("given", [
    "ws/src/team_gazebo/launch/practice.launch",
    "ws/src/team_gazebo/launch/two_boats.launch",
])  # fmt: skip
def test_packages_of_the_workspace_are_found_from_a_launch_file(given):
    write_workspace(Path("ws"))
    launch = launch_of(given, {})
    robot = Path("ws/src/team_description/urdf/team_boat.urdf.xacro").resolve()
    assert launch.boats[0].model == robot
    assert launch.included == [Path("ws/src/team_control/launch/follow.launch").resolve()]


def test_models_of_the_workspace_are_found_from_a_world():
    write_workspace(Path("ws"))
    found = gazebo_world(Path("ws/src/team_gazebo/worlds/practice.world.xacro"))
    assert [str(one["model"]) for one in found.section["objects"]] == ["model://team_buoy"] * 2
    assert [one["pose"][1] for one in found.section["objects"]] == [185.0, 195.0]


def test_a_workspace_is_the_folder_src_or_a_checkout_or_what_is_beside_a_package():
    names = {"team_gazebo", "team_models", "team_description", "team_control"}
    write_workspace(Path("ws"))
    assert set(workspace_packages(Path("ws/src/team_gazebo/launch"))) == names
    assert set(workspace_packages(Path("ws/src"))) == names
    assert workspace_packages(Path("ws")) == {}
    Path("ws/src").rename("checkout")
    assert set(workspace_packages(Path("checkout/team_gazebo/launch"))) == names
    assert workspace_packages(Path("checkout")) == {}
    Path("checkout/.git").mkdir()
    assert set(workspace_packages(Path("checkout"))) == names


def test_no_home_is_a_workspace(here, monkeypatch):
    write_workspace(here)
    monkeypatch.setenv("HOME", str(here))
    monkeypatch.setenv("USERPROFILE", str(here))
    Path("mine").mkdir()
    Path("src/team_gazebo").rename("team_gazebo")
    assert workspace_packages(here / "team_gazebo" / "launch") == {}


def test_what_is_beside_the_workspace_is_not_read():
    write_workspace(Path("ws"))
    written(two__boat_dot_urdf="<robot/>")
    file = Path("ws/src/team_control/launch/follow.launch")
    body = '<launch><param name="d" textfile="$(find team_gazebo)/../../../two/boat.urdf"/></launch>'
    file.write_text(body, encoding="utf-8")
    assert message(launch_of, str(file), {}) == (
        f"{file.as_posix()}:1:9: <param> 'd': may not read 'ws/src/team_gazebo/../../../two/boat.urdf': outside "
        f"the folder of the first file and of every package; add its folder with --allow FOLDER or VRX_MJ_PATH"
    )


@pytest.mark.parametrize("place", ["ws", "ws/src", "ws/src/team_control", "ws/src/team_gazebo/launch"])
def test_a_package_is_named_as_for_roslaunch(place, here, monkeypatch):
    write_workspace(Path("ws"))
    monkeypatch.chdir(here / place)
    assert Path(file_in("team_gazebo", TWO_BOATS)).resolve() == here / "ws/src/team_gazebo/launch" / TWO_BOATS


def test_a_package_on_the_path_of_ros_is_found(here, monkeypatch):
    write_workspace(Path("ws"))
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(here / "ws/src"))
    assert Path(file_in("team_gazebo", TWO_BOATS)) == here / "ws/src/team_gazebo/launch" / TWO_BOATS


def test_packages_of_vrx_need_not_be_there():
    for package, world in (("vrx_gazebo", "example_course"), ("vrx_2019", "vrx2019/example_course")):
        launch = launch_of(file_in(package, "vrx.launch"), {"x": "-520"})
        assert (launch.world, launch.boats[0].pose[0]) == (world, -520)
    assert launch_of(file_in("vrx_2019", "sandisland.launch"), {}).world == "vrx2019/example_course"


def test_what_a_folder_has_not_is_said_with_what_it_has():
    write_workspace(Path("ws"))
    said = "no launch file or world in ws named 'two_boat.launch'; did you mean 'two_boats.launch'?"
    assert message(file_in, "ws", "two_boat.launch") == said
    assert message(file_in, "team", "a.launch").startswith("no folder or package named 'team'; ")
    assert (
        message(file_in, "vrx_gazebo", "vrxx.launch")
        == "no launch file named 'vrxx.launch'; did you mean 'vrx.launch'?"
    )
    with pytest.raises(UnknownNameError):
        file_in("ws", "x.launch")


def test_a_name_that_several_files_have_is_listed_with_their_paths():
    written(ws__a__bay_dot_world=BAY, ws__b__bay_dot_world=BAY)
    assert message(file_in, "ws", "bay.world").splitlines() == [
        "ws has 2 files that end in bay.world; type one of these:",
        "  vrx-mj run ws a/bay.world",
        "  vrx-mj run ws b/bay.world",
    ]
    assert file_in("ws", "a/bay.world") == "ws/a/bay.world"


def test_short_names_are_ends_that_no_other_file_has():
    files = [Path("ws") / name for name in ("a/x/bay.world", "b/x/bay.world", "lake.world", "c/lake.sdf")]
    assert short_names(files, Path("ws")) == ["a/x/bay.world", "b/x/bay.world", "lake.world", "lake.sdf"]


def test_a_check_of_arguments_may_be_left_out():
    written(a_dot_launch="<launch/>")
    assert read_launch(Path("a.launch"), {"x": "1"}, strict=False).boats == []
    said = "a.launch: x:=: no argument named 'x'; known: none"
    assert message(read_launch, Path("a.launch"), {"x": "1"}) == said


@pytest.mark.parametrize("arguments", [{}, {"unused": "1"}])
def test_a_world_of_gazebo_without_boats_gets_none(arguments):
    block = "<static>true</static><link name='l'><collision name='c'><geometry><box><size>2 2 2</size></box></geometry>"
    text = f"<world name='bay'><model name='block'>{block}</collision></link></model></world>"
    written(bay_dot_world_dot_xacro=f'<sdf version="1.6">{text}</sdf>')
    with pytest.warns(VrxWarning) as caught:
        found = compile_world("bay.world.xacro", arguments=arguments)
    assert [str(one.message) for one in caught] == [
        "bay.world.xacro: this world has no boats; add some with --fleet FLEET, as in --fleet trio"
    ]
    assert (found.boats, [thing.name for thing in found.parameters.objects]) == ((), ["block"])
    pair = {"usv_count": 2, "layout": "line"}
    assert compile_world("bay.world.xacro", fleet=pair, arguments=arguments).boats == ("wamv1", "wamv2")


def test_a_world_of_gazebo_with_a_terrain_of_vrx_keeps_the_boat_at_its_spawn_pose():
    terrain = "<include><uri>model://sandisland</uri></include>"
    written(bay_dot_world=f'<sdf version="1.6"><world name="bay">{terrain}</world></sdf>')
    with pytest.warns(VrxWarning, match="`extends: sand_island`, which also has post_0"):
        world, fleet = open_source("bay.world", None, {})
    assert (world["name"], world["terrain"], fleet) == ("bay", "sand_island", None)
