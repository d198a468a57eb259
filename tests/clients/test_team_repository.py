"""The page of five commands, followed to the letter in an empty home, on a repository of the shape that teams have."""

import contextlib
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clients.runner import PROGRAMS
from needs import Need, needs
from page_blocks import blocks
from ros1_served import free_port

REPO = Path(__file__).resolve().parents[2]
WORKSPACES = Need(
    "catkin_make and roscpp",
    "apt-get install -y --no-install-recommends catkin g++ make rosbash libroscpp-dev libgeometry-msgs-dev "
    "libsensor-msgs-dev ros-message-generation python3-roslaunch",
    lambda: all(
        Path(place).exists()
        for place in ("/usr/bin/catkin_make", "/usr/share/roscpp/cmake", REPO / "assets/ros/xacro/cmake")
    ),
)
NAMED = "roscpp rospy std_msgs geographic_msgs usv_msgs message_generation xacro vrx_gazebo wamv_gazebo"
MANIFEST = f"""<package format="2">
  <name>team</name>
  <version>0.1.0</version>
  <description>A team's own.</description>
  <maintainer email="nobody@example.org">x</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>catkin</buildtool_depend>
  {" ".join(f"<depend>{name}</depend>" for name in NAMED.split())}
  <exec_depend>message_runtime</exec_depend>
</package>
"""
BUILD = f"""cmake_minimum_required(VERSION 3.5)
project(team)
find_package(catkin REQUIRED COMPONENTS {NAMED})
add_message_files(FILES Effort.msg)
generate_messages(DEPENDENCIES std_msgs)
catkin_package(CATKIN_DEPENDS message_runtime vrx_gazebo wamv_gazebo)
include_directories(${{catkin_INCLUDE_DIRS}})
add_executable(watcher src/watcher.cpp)
add_dependencies(watcher ${{PROJECT_NAME}}_generate_messages_cpp ${{catkin_EXPORTED_TARGETS}})
target_link_libraries(watcher ${{catkin_LIBRARIES}})
catkin_install_python(PROGRAMS scripts/keeper.py DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})
"""
WATCHER = """#include <ros/ros.h>
#include <team/Effort.h>
#include <vrx_gazebo/Task.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "watcher");
  ros::NodeHandle node;
  boost::function<void(const vrx_gazebo::Task&)> onTask = [](const vrx_gazebo::Task& task) {
    ROS_INFO("%s is %s, score %.2f", task.name.c_str(), task.state.c_str(), task.score);
  };
  boost::function<void(const team::Effort&)> onEffort = [](const team::Effort& effort) {
    ROS_INFO_ONCE("effort %.1f", effort.left);
  };
  ros::Subscriber task = node.subscribe<vrx_gazebo::Task>("/vrx/task/info", 1, onTask);
  ros::Subscriber effort = node.subscribe<team::Effort>("/team/effort", 1, onEffort);
  ros::spin();
}
"""
START = """<launch>
  <include file="$(find vrx_gazebo)/launch/station_keeping.launch">
    <arg name="gui" value="false"/>
    <arg name="extra_gazebo_args" value="--localization --ros1 --rosbridge $(optenv ROSBRIDGE_PORT 9090)"/>
  </include>
  <node pkg="team" type="keeper.py" name="keeper" output="screen"/>
  <node pkg="team" type="watcher" name="watcher" output="screen"/>
</launch>
"""
SECONDS = 900.0


@pytest.fixture
def home(tmp_path):
    """An empty home, but for the repository that is cloned, and `vrx-mj` on the path."""
    team = tmp_path / "home/team.git"
    for name, text in {
        "package.xml": MANIFEST,
        "CMakeLists.txt": BUILD,
        "msg/Effort.msg": "float32 left\nfloat32 right\n",
        "src/watcher.cpp": WATCHER,
        "scripts/keeper.py": "#!/usr/bin/env python3\n" + (PROGRAMS / "keeper.py").read_text(encoding="utf-8"),
        "launch/start.launch": START,
    }.items():
        (team / name).parent.mkdir(parents=True, exist_ok=True)
        (team / name).write_text(text, encoding="utf-8")
    (team / "scripts/keeper.py").chmod(0o755)
    who = ("-c", "user.name=team", "-c", "user.email=nobody@example.org")
    for words in (("init", "-q"), ("add", "-A"), (*who, "commit", "-q", "-m", "Ours")):
        subprocess.run(["git", "-C", team, *words], check=True)
    program = tmp_path / "bin/vrx-mj"
    program.parent.mkdir()
    python = f"PYTHONPATH={shlex.quote(str(REPO / 'src'))} exec {shlex.quote(sys.executable)}"
    program.write_text(f'#!/bin/sh\n{python} -m vrx_mj "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    return tmp_path / "home"


@pytest.mark.slow
@pytest.mark.nightly
@needs(WORKSPACES)
def test_a_teams_repository_sails_after_the_five_commands_of_the_page(home, tmp_path):
    page = REPO / "docs/team_repository.md"
    (block,) = (one for one in blocks(page) if one.kind == "bash" and one.note("not run") is None)
    written, meant = block.note("tested with").split(" -> ")
    text = block.text.replace(written, meant)
    assert len(text.splitlines()) == 5
    kept = {name: os.environ[name] for name in ("VRX_MJ_CACHE", "NUMBA_CACHE_DIR") if name in os.environ}
    own = {
        "HOME": str(home), "PATH": f"{tmp_path / 'bin'}:/usr/bin:/bin", "LC_ALL": "C.UTF-8", "ROS_IP": "127.0.0.1",
        "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}", "PYTHONUNBUFFERED": "1", **kept,
        "ROSBRIDGE_PORT": str(free_port()), "ROS_LANG_DISABLE": "genlisp",
    }  # fmt: skip
    said = tmp_path / "said.txt"
    with said.open("w", encoding="utf-8") as log:
        process = subprocess.Popen(
            ["bash", "-ec", text], env=own, cwd=home, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
        )
    try:
        end = time.monotonic() + SECONDS
        while not all(
            re.search(one, said.read_text(encoding="utf-8")) for one in ("4 m are behind", "is running, score")
        ):
            assert process.poll() is None, said.read_text(encoding="utf-8")[-4000:]
            assert time.monotonic() < end, said.read_text(encoding="utf-8")[-4000:]
            time.sleep(0.2)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGINT)
        process.wait(60.0)
    told = said.read_text(encoding="utf-8")
    assert re.search(r"the boat is at -?\d+\.\d, -?\d+\.\d in wamv/odom", told)
    assert "effort 0.4" in told
    assert "Traceback" not in told
