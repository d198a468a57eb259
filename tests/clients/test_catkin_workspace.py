"""A team's catkin workspace on VRX's packages, beside ours: catkin_make builds and installs it, and it sails."""

import shutil
import subprocess

import pytest

from clients.runner import PROGRAMS, RATES, WORLD, outcome
from needs import CATKIN_MAKE, needs
from vrx_mj.ros.packages import PACKAGE_NAMES, write_launch_packages, write_packages

pytestmark = [pytest.mark.slow, pytest.mark.nightly, needs(CATKIN_MAKE)]

MANIFEST = """<package format="2">
  <name>team</name>
  <version>0.1.0</version>
  <description>A team's own.</description>
  <maintainer email="nobody@example.org">x</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>catkin</buildtool_depend>
  {depends}
</package>
"""
NAMED = (
    "roscpp", "std_msgs", "sensor_msgs", "geometry_msgs", "geographic_msgs", "usv_msgs", "xacro", "vrx_gazebo",
    "wamv_gazebo", "gazebo_ros",
)  # fmt: skip
BUILD = f"""cmake_minimum_required(VERSION 3.5)
project(team)
find_package(catkin REQUIRED COMPONENTS {" ".join(NAMED)})
catkin_package(CATKIN_DEPENDS xacro vrx_gazebo wamv_gazebo gazebo_ros)
include_directories(${{catkin_INCLUDE_DIRS}})
add_executable(allocator src/allocator.cpp)
target_link_libraries(allocator ${{catkin_LIBRARIES}})
add_dependencies(allocator ${{catkin_EXPORTED_TARGETS}})
xacro_add_files(worlds/bay.world.xacro INORDER INSTALL DESTINATION worlds)
install(TARGETS allocator RUNTIME DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})
"""
BAY = """<?xml version="1.0"?>
<sdf version="1.6" xmlns:xacro="http://ros.org/wiki/xacro">
  <world name="bay">
    <xacro:include filename="$(find vrx_gazebo)/worlds/xacros/include_all_xacros.xacro"/>
    <xacro:include_all_xacros/>
    <xacro:sydneyregatta/>
  </world>
</sdf>
"""
BARE = {"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "ROS_LANG_DISABLE": "genlisp"}
LOOK = """
. {space}/setup.bash
roslaunch --files vrx_gazebo station_keeping.launch
rosmsg md5 vrx_gazebo/Task
python3 -c 'import vrx_gazebo.msg as one; print(one.__file__)'
find {space} -name bay.world
find -L {share}/xacro -name xacro -perm /111 -type f
catkin_find --first-only --libexec team allocator
"""


def shell(script, home, **variables):
    """What a script prints in a shell that knows nothing yet."""
    done = subprocess.run(
        ["bash", "-ec", script], cwd=home, env={**BARE, "HOME": str(home), **variables},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8", timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    """The workspace, built and installed."""
    folder = tmp_path_factory.mktemp("catkin_ws")
    team = folder / "src/team"
    depends = "\n  ".join(f"<depend>{name}</depend>" for name in NAMED)
    for name, text in (
        ("package.xml", MANIFEST.format(depends=depends)),
        ("CMakeLists.txt", BUILD),
        ("worlds/bay.world.xacro", BAY),
        ("src/allocator.cpp", (PROGRAMS / "allocator.cpp").read_text(encoding="utf-8")),
    ):
        (team / name).parent.mkdir(parents=True, exist_ok=True)
        (team / name).write_text(text, encoding="utf-8")
    write_packages(folder / "src/vrx_messages")
    write_launch_packages(folder / "src/vrx_packages")
    shell("catkin_make install", folder)
    return folder


def test_catkin_installs_every_package(workspace):
    assert {file.parent.name for file in workspace.glob("install/share/*/package.xml")} >= {*PACKAGE_NAMES, *NAMED[4:]}


@pytest.mark.parametrize("space", ["devel", "install"])
def test_a_space_has_launch_files_messages_programs_and_worlds(workspace, tmp_path, space):
    top = workspace / space
    share = workspace / "src/vrx_packages" if space == "devel" else top / "share"
    launch, md5, python, world, xacro, allocator = shell(LOOK.format(space=top, share=share), tmp_path).splitlines()
    assert launch == f"{share}/vrx_gazebo/launch/station_keeping.launch"
    assert md5 == "8b3267cadc02a4d8846adeb79baa09a1"
    assert python == f"{top}/lib/python3/dist-packages/vrx_gazebo/msg/__init__.py"
    assert world == f"{top}/share/team/worlds/bay.world"
    assert xacro == f"{share}/xacro/xacro"
    assert allocator == f"{top}/lib/team/allocator"


@pytest.mark.parametrize("first", ["messages", "packages"])
def test_a_workspace_has_one_vrx_gazebo_whichever_came_first(tmp_path, first):
    messages, packages = tmp_path / "src/messages", tmp_path / "src/packages"
    write = {"messages": lambda: write_packages(messages), "packages": lambda: write_launch_packages(packages)}
    for name in sorted(write, key=first.__eq__, reverse=True):
        write[name]()
    hidden = messages / "share/vrx_gazebo/CATKIN_IGNORE"
    assert hidden.is_file()
    assert not (packages / "vrx_gazebo/CATKIN_IGNORE").exists()
    shutil.rmtree(packages)
    write_packages(messages)
    assert not hidden.exists()


@pytest.mark.parametrize("rate", RATES)
def test_an_allocator_in_cpp_keeps_a_pose_with_engines_that_turn(workspace, tmp_path, rate):
    world = WORLD.replace("goal: [-33.7227, 150.67402, 0.0]", "goal_cart: [-532, 166, 0.0]")
    done = outcome([workspace / "devel/lib/team/allocator"], tmp_path, rate=rate, seconds=20.0, world=world)
    assert done.code == 0, done.text
    assert "FATAL" not in done.text
    assert done.way == pytest.approx(4.0, abs=0.5)  # straight to the left, all of it; the GPS is noisy
    assert done.task.score < 2.0  # the mean, with the way there; adrift it is 4 m
