"""Debian's roslaunch with the packages of `vrx-mj ros packages`: VRX's own command lines, word by word."""

import os
import pty
import re
import select
import signal
import subprocess
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest

from needs import ROS1_TOOLS, needs
from ros1_served import environment, free_port, tools, until
from vrx_layout import write_vrx
from vrx_mj.ros.packages import write_launch_packages

pytestmark = [pytest.mark.slow, needs(ROS1_TOOLS)]


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("packages")
    write_launch_packages(folder)
    return folder


def surroundings(home, packages):
    """The environment of a user of ROS with the packages, and a free port for a rosbridge."""
    more = {name: os.environ[name] for name in ("VRX_MJ_CACHE",) if name in os.environ}
    own = {"ROS_PACKAGE_PATH": f"{packages}:{home}", "BRIDGE": str(free_port()), "PWD": str(home)}
    return {**environment(free_port(), home / "ros"), **more, **own}


@contextmanager
def launched(line, home, packages, *, seconds=60.0):
    """The master's address and the lines so far of a command line of roslaunch that runs in a folder."""
    log = home / f"roslaunch_{free_port()}.txt"
    variables = surroundings(home, packages)
    with log.open("w", encoding="utf-8") as out:
        process = subprocess.Popen(["/bin/bash", "-c", f"exec {line}"], cwd=home, env=variables, stdout=out,
                                   stderr=subprocess.STDOUT, start_new_session=True)  # fmt: skip
    try:
        yield Launched(process, log, variables, home)
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait(seconds)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


class Launched:
    """A roslaunch that runs."""

    def __init__(self, process, log, variables, home):
        self.process, self._log, self.variables, self._home = process, log, variables, home
        self.port = int(variables["ROS_MASTER_URI"].rpartition(":")[2])

    @property
    def text(self):
        """What it has printed."""
        return self._log.read_text(encoding="utf-8")

    def topics(self, *wanted):
        """All topics by the tool, which takes a process half a second, once the master knows some."""

        def are_there():
            assert self.process.poll() is None, self.text
            with suppress(OSError), ServerProxy(self.variables["ROS_MASTER_URI"]) as master:  # or there is none yet
                published, subscribed, _ = master.getSystemState("/test")[2]
                return set(wanted) <= {name for name, _ in (*published, *subscribed)}

        until(are_there, f"{wanted} in {self.text}", 90.0)
        found = set(tools("rostopic list", self.port, self._home).split())
        assert set(wanted) <= found
        return found

    def boats(self):
        """Names of the boats that the master knows topics of."""
        return {topic.split("/")[1] for topic in self.topics("/clock") if topic.endswith("_thrust_cmd")}


WORLD = '<sdf version="1.6"><world name="bay"></world></sdf>'
OPTIONS = "--ros1 --rosbridge $BRIDGE"
EXTRA = f'extra_gazebo_args:="{OPTIONS}"'


def children(pid):
    """Processes that a process has started, and theirs."""
    pairs = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended
            pairs.append((int(stat.parent.name), int(stat.read_text(encoding="utf-8").rpartition(")")[2].split()[1])))
    found, waiting = set(), [pid]
    while waiting:
        one = waiting.pop()
        mine = {child for child, parent in pairs if parent == one} - found
        found |= mine
        waiting += mine
    return found


def test_sandisland_with_a_urdf_of_ones_own_and_ctrl_c(packages, tmp_path):
    with launched("roslaunch vrx_gazebo generate_wamv.launch wamv_target:=my_wamv.urdf", tmp_path, packages) as one:
        one.process.wait(60.0)
        said = one.text
    assert "my_wamv.urdf: wamv, built from" in said
    assert "compliant: all parts pass" in said
    line = "roslaunch vrx_gazebo sandisland.launch urdf:=my_wamv.urdf "
    with launched(line + EXTRA.replace(OPTIONS, f"{OPTIONS} --record run.rrd"), tmp_path, packages) as one:
        topics = one.topics("/wamv/thrusters/left_thrust_cmd", "/gazebo/model_states")
        assert "/wamv/sensors/cameras/front_left_camera/image_raw" in topics
        assert "vrx2019/example_course: 1 boat, wamv" in one.text
        assert tools("rosparam get /use_sim_time", one.port, tmp_path).strip() == "true"
        assert "/gazebo" in tools("rosnode list", one.port, tmp_path)
        begun = children(one.process.pid)
        one.process.send_signal(signal.SIGINT)
        assert one.process.wait(30.0) == 0
        assert "served " in one.text
        assert "escalating" not in one.text
    assert (tmp_path / "run.rrd").is_file()
    assert not [pid for pid in begun if Path(f"/proc/{pid}").exists()]


@pytest.mark.parametrize(
    ("line", "world", "boats"),
    [
        ("vrx_gazebo vrx.launch namespace:=cat x:=-520 thrust_config:=X", "example_course", {"cat"}),
        ("vrx_2019 vrx.launch", "vrx2019/example_course", {"wamv"}),
        ("vrx_gazebo sandisland.launch world:=`pwd`/my_world.world x:=-520 y:=170", "bay", {"wamv"}),
        ("vrx_gazebo demo_thrusterconfigs.launch", "example_course", {"wamvH", "wamvT", "wamvX"}),
    ],
)  # fmt: skip
def test_launch_files_of_vrx(packages, tmp_path, line, world, boats):
    (tmp_path / "my_world.world").write_text(WORLD, encoding="utf-8")
    with launched(f"roslaunch {line} {EXTRA}", tmp_path, packages) as one:
        one.topics("/gazebo/model_states", *(f"/{boat}/cmd_vel" for boat in boats))
        assert one.boats() == boats
        count = f"{len(boats)} boat{'s' * (len(boats) > 1)}"
        assert f"{world}: {count}, {', '.join(sorted(boats))}" in one.text
        assert ("paused" in one.text) == ("demo" in line)


BOAT = """
  <group ns="{name}">
    <param name="robot_description" command="$(find xacro)/xacro '$(arg urdf)' thruster_config:={layout}
           {sensors} namespace:={name}"/>
    <node name="spawn_model" pkg="gazebo_ros" type="spawn_model" respawn="false" output="screen"
          args="-x {x} -y {y} -z 0.1 -R 0 -P 0 -Y {yaw} -urdf -param robot_description -model {name}"/>
  </group>"""
MULTI = """<?xml version="1.0"?>
<launch>
  <arg name="world" default="$(find vrx_gazebo)/worlds/sandisland.world"/>
  <arg name="gui" default="true"/>
  <arg name="verbose" default="false"/>
  <arg name="paused" default="false"/>
  <arg name="extra" default=""/>
  <arg name="urdf" default="$(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"/>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="world_name" value="$(arg world)"/>
    <arg name="verbose" value="$(arg verbose)"/>
    <arg name="paused" value="$(arg paused)"/>
    <arg name="use_sim_time" value="true"/>
    <arg name="gui" value="$(arg gui)"/>
    <arg name="enable_ros_network" value="true"/>
    <arg name="extra_gazebo_args" value="$(arg extra)"/>
  </include>{boats}
</launch>
"""
FLEET = [
    {"name": "defender_a", "layout": "T", "sensors": "vrx_sensors_enabled:=true", "x": 158, "y": 108, "yaw": -2.76},
    {"name": "defender_b", "layout": "H", "sensors": "gps_enabled:=true", "x": 148, "y": 98, "yaw": -1.19},
    {"name": "wamv", "layout": "X", "sensors": "", "x": 138, "y": 108, "yaw": 0.4},
]
"""Boats as the guide of VRX spawns them, and a third one."""


@pytest.fixture
def team(tmp_path):
    """A package of a team's own."""
    folder = tmp_path / "rxi"
    (folder / "launch").mkdir(parents=True)
    head = "<package><name>rxi</name><version>0.1.0</version><description>x</description>"
    tail = '<maintainer email="a@example.org">x</maintainer><license>x</license></package>'
    (folder / "package.xml").write_text(head + tail, encoding="utf-8")
    return folder


@pytest.mark.nightly
def test_boats_of_the_guide_join_a_world_without_boats(packages, tmp_path, team):
    boats = "".join(BOAT.format(**boat) for boat in FLEET)
    text = MULTI.replace("{boats}", boats)
    (team / "launch" / "rxi_multi.launch").write_text(text, encoding="utf-8")
    line = f"roslaunch rxi rxi_multi.launch verbose:=true {EXTRA.replace('extra_gazebo_args', 'extra')}"
    with launched(line, tmp_path, packages) as one:
        topics = one.topics(*(f"/{boat['name']}/cmd_vel" for boat in FLEET))
        assert "sand_island: no boats" in one.text
        assert one.boats() == {boat["name"] for boat in FLEET}
        assert {"/defender_a/thrusters/lateral_thrust_cmd", "/defender_a/sensors/imu/imu/data"} <= topics
        assert "/defender_b/sensors/gps/gps/fix" in topics
        assert not {topic for topic in topics if topic.startswith("/defender_b/sensors/imu")}
        assert "/wamv/thrusters/left_front_thrust_cmd" in topics
        assert '"<?xml' in tools("rosparam get /defender_b/robot_description", one.port, tmp_path)[:10]
        north = tools("rostopic echo -n 1 /defender_b/sensors/gps/gps/fix/latitude", one.port, tmp_path)
        assert re.search(r"^21\.3[01]\d*$", north, re.MULTILINE), north  # after a warning where the topic comes late
        assert "warning" not in one.text
        again = (
            f"{packages}/gazebo_ros/scripts/spawn_model -urdf -param /defender_a/robot_description -model defender_a"
        )
        assert tools(again, one.port, tmp_path) == (
            "defender_a cannot join: spawn_urdf_model: invalid boat name 'defender_a': a boat of world sand_island has "
            "this name\n"
        )


TALKER = "#!/bin/sh\nexec rostopic pub -l /talk std_msgs/String hello\n"
TALKS = '<node pkg="rxi" type="talker.sh" name="talker"/>'


@pytest.fixture
def edited(packages, team):
    """A copy of `station_keeping.launch` with a world of its own, a second boat and another node, as teams edit it."""
    text = (packages / "vrx_gazebo/launch/station_keeping.launch").read_text(encoding="utf-8")
    world = "$(find vrx_gazebo)/worlds/stationkeeping_task.world"
    assert world in text
    boat = BOAT.format(**FLEET[0] | {"x": -512, "y": 170})
    text = text.replace(world, "$(find vrx_gazebo)/worlds/wayfinding_task.world")
    (team / "launch" / "mine.launch").write_text(
        text.replace("</launch>", f"{boat.replace('$(arg urdf)', '$(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro')}\n"
                     f"{TALKS}\n</launch>"), encoding="utf-8",
    )  # fmt: skip
    (team / "scripts").mkdir()
    (team / "scripts" / "talker.sh").write_text(TALKER, encoding="utf-8")
    (team / "scripts" / "talker.sh").chmod(0o755)
    return team / "launch" / "mine.launch"


def test_a_copy_of_a_launch_file_is_edited_as_in_the_tutorials(packages, tmp_path, edited):
    with launched(f"roslaunch rxi mine.launch x:=-530 {EXTRA}", tmp_path, packages) as one:
        topics = one.topics("/wamv/cmd_vel", "/defender_a/cmd_vel", "/talk", "/vrx/wayfinding/waypoints")
        assert one.boats() == {"wamv", "defender_a"}
        assert "wayfinding_task: 1 boat, wamv" in one.text
        assert "/defender_a/thrusters/lateral_thrust_cmd" in topics
        assert "warning" not in one.text


@pytest.mark.nightly
def test_a_launch_file_that_includes_one_of_vrx_adds_to_it(packages, tmp_path, team):
    include = (
        '<include file="$(find vrx_gazebo)/launch/station_keeping.launch"><arg name="namespace" value="cat"/>'
        f'<arg name="extra_gazebo_args" value="{OPTIONS.replace("$BRIDGE", "$(env BRIDGE)")}"/></include>'
    )
    urdf = '<arg name="urdf" default="$(find wamv_gazebo)/urdf/wamv_gazebo.urdf.xacro"/>'
    boat = BOAT.format(**FLEET[1] | {"x": -512, "y": 170})
    text = f"<launch>{urdf}{include}{boat}</launch>"
    (team / "launch" / "more.launch").write_text(text, encoding="utf-8")
    with launched("roslaunch rxi more.launch", tmp_path, packages) as one:
        one.topics("/cat/cmd_vel", "/defender_b/cmd_vel", "/vrx/station_keeping/goal")
        assert one.boats() == {"cat", "defender_b"}


def test_a_launch_file_that_a_user_put_into_vrxs_own_package(tmp_path):
    """Beside VRX's workspace, in which `ros packages --over` finds the launch file, its world and its boat."""
    sources = write_vrx(tmp_path / "vrx_ws")
    theirs = sources / "vrx/vrx_gazebo"
    (theirs / "worlds/my_bay.world").write_text(WORLD, encoding="utf-8")
    text = (theirs / "launch/vrx.launch").read_text(encoding="utf-8")
    (theirs / "launch/mine.launch").write_text(text.replace("example_course", "my_bay"), encoding="utf-8")
    before = {file: file.read_bytes() for file in sources.rglob("*") if file.is_file()}
    write_launch_packages(tmp_path / "packages", tmp_path / "vrx_ws")
    with launched(f"roslaunch vrx_gazebo mine.launch {EXTRA}", tmp_path, f"{tmp_path / 'packages'}:{sources}") as one:
        one.topics("/wamv/cmd_vel", "/wamv/thrusters/lateral_thrust_cmd")
        assert "bay: no boats" in one.text
        assert one.boats() == {"wamv"}
    assert {file: file.read_bytes() for file in sources.rglob("*") if file.is_file()} == before


def pressed(line, home, variables, keys, seconds):
    """What a command line prints on a terminal on which keys are pressed, and at last Ctrl-C."""
    own, others = pty.openpty()
    shell = f"exec setsid --ctty {line}"
    said = []
    with subprocess.Popen(["/bin/bash", "-c", shell], cwd=home, env=variables, stdin=others, stdout=others,
                          stderr=others) as process:  # fmt: skip
        os.close(others)

        def heard(text, within, pressing=b""):
            end = time.monotonic() + within
            while time.monotonic() < end and (not text or text not in b"".join(said).decode("utf-8", "replace")):
                if select.select([own], [], [], 0.1)[0]:
                    try:
                        said.append(os.read(own, 65536))
                    except OSError:
                        return  # the terminal is gone
                else:
                    os.write(own, pressing)

        heard("quits.", 60.0)
        heard("", seconds, keys)
        os.write(own, b"\x03")
        heard("shutting down processing monitor complete", 30.0)
        process.wait(30.0)
    os.close(own)
    return b"".join(said).decode("utf-8", "replace")


KEYDRIVE = """<launch>
  <arg name="namespace" default="wamv"/>
  <group ns="$(arg namespace)">
    <include file="$(find vrx_gazebo)/launch/usv_keydrive.launch">
      <arg name="namespace" value="$(arg namespace)"/>
      <arg name="url" value="ws://127.0.0.1:$(env BRIDGE)"/>
    </include>
    <node pkg="vrx_gazebo" type="twist2thrust.py" name="twist2thrust" output="screen" args="--keyboard">
      <remap from="left_cmd" to="thrusters/left_thrust_cmd"/>
    </node>
  </group>
</launch>
"""


@pytest.mark.nightly
def test_keys_in_the_terminal_of_roslaunch_drive(packages, tmp_path, team):
    (team / "launch" / "defender_keydrive.launch").write_text(KEYDRIVE, encoding="utf-8")
    with launched(f"roslaunch vrx_gazebo vrx.launch namespace:=defender_a {EXTRA}", tmp_path, packages) as one:
        one.topics("/defender_a/cmd_vel")
        line = "roslaunch rxi defender_keydrive.launch namespace:=defender_a"
        said = pressed(line, tmp_path, one.variables, b"i", 4.0)
    assert "boat defender_a  power +0.50" in said, said
    assert max(float(speed) for speed in re.findall(r"speed ([\d.]+) m/s", said)) > 0.4
    assert "escalating" not in said
