"""Debian's roslaunch with the packages of `vrx-mj ros packages`: VRX's own command lines, word by word."""

import os
import signal
import subprocess
from contextlib import contextmanager
from pathlib import Path

import pytest

from needs import ROS1_TOOLS, needs
from ros1_served import environment, free_port, tools, until
from vrx_mj.ros.launch_packages import write_launch_packages

pytestmark = [pytest.mark.slow, needs(ROS1_TOOLS)]


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("packages")
    write_launch_packages(folder)
    return folder


@contextmanager
def launched(line, home, packages, *, seconds=60.0):
    """The master's address and the lines so far of a command line of roslaunch that runs in a folder."""
    port, log = free_port(), home / "roslaunch.txt"
    more = {name: os.environ[name] for name in ("VRX_MJ_CACHE",) if name in os.environ}
    path = f"{packages}:{home}"
    variables = {**environment(port, home / "ros"), **more, "ROS_PACKAGE_PATH": path, "BRIDGE": str(free_port())}
    with log.open("w", encoding="utf-8") as out:
        process = subprocess.Popen(["/bin/bash", "-c", f"exec {line}"], cwd=home, env=variables, stdout=out,
                                   stderr=subprocess.STDOUT, start_new_session=True)  # fmt: skip
    try:
        yield Launched(process, log, port, home)
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.wait(seconds)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


class Launched:
    """A roslaunch that runs."""

    def __init__(self, process, log, port, home):
        self.process, self._log, self.port, self._home = process, log, port, home

    @property
    def text(self):
        """What it has printed."""
        return self._log.read_text(encoding="utf-8")

    def topics(self, *wanted):
        """All topics, once there are some."""
        found = set()

        def are_there():
            assert self.process.poll() is None, self.text
            found.update(tools("rostopic list", self.port, self._home).split())
            return set(wanted) <= found

        until(are_there, f"{wanted} in {self.text}", 90.0)
        return found

    def boats(self):
        """Names of the boats that the master knows topics of."""
        return {topic.split("/")[1] for topic in self.topics("/clock") if topic.endswith("_thrust_cmd")}


WORLD = '<sdf version="1.6"><world name="bay"></world></sdf>'
EXTRA = "extra_gazebo_args:='--ros1 --rosbridge '$BRIDGE"


def children(pid):
    """Processes that a process has started, and theirs."""
    listed = subprocess.run(["/bin/ps", "-eo", "pid,ppid"], capture_output=True, text=True, check=True).stdout
    pairs = [tuple(map(int, line.split())) for line in listed.splitlines()[1:]]
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
    with launched(f"roslaunch vrx_gazebo sandisland.launch urdf:=my_wamv.urdf {EXTRA}", tmp_path, packages) as one:
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
