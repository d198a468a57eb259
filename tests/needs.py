"""What some tests need beyond the README's test command: one record each, with the line that installs it.

A test that needs one carries `needs(ROS1_TOOLS)` as a mark, or calls `require(CHROMIUM)` where a mark comes too early.
tests/conftest.py lists at the end of a run what was missing.
"""

import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from vrx_mj.errors import RenderError
from vrx_mj.sensors.canvas import choose_backend

DEBIAN_PYTHON = "/usr/bin/python3"
"""The interpreter that Debian's ROS packages are installed for."""
ROS2_HOME = Path(os.environ.get("VRX_MJ_ROS2") or Path.home() / ".cache/vrx_mj_ros2")
"""The virtual environment with ROS 2's wheels."""
ROS2_SITE = ROS2_HOME / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
_ROS2_WHEELS = "ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-common-interfaces"

DRAKE_HOME = Path(os.environ.get("VRX_MJ_DRAKE") or Path.home() / ".cache/vrx_mj_drake")
"""The virtual environment with Drake's wheel."""
DRAKE_PYTHON = DRAKE_HOME / "bin" / "python"


@dataclass(frozen=True)
class Need:
    """A program or package that a machine may lack."""

    name: str
    install: str
    is_here: Callable[[], bool]

    @property
    def reason(self) -> str:
        """One line: what is missing, and what installs it."""
        return f"needs {self.name}: {self.install}"


def needs(need: Need) -> pytest.MarkDecorator:
    """The mark of a test that is skipped where `need` is missing."""
    return pytest.mark.skipif(not need.is_here(), reason=need.reason)


def require(need: Need) -> None:
    """Skip the running test, or the tests of the running fixture, where `need` is missing."""
    if not need.is_here():
        pytest.skip(need.reason)


def _debian_package(*names: str) -> Callable[[], bool]:
    """Whether Debian's Python imports these."""

    @cache
    def is_here() -> bool:
        if not Path(DEBIAN_PYTHON).exists():
            return False
        command = [DEBIAN_PYTHON, "-c", f"import {', '.join(names)}"]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    return is_here


def _chromium() -> str | None:
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


CHROMIUM_PROGRAM = _chromium()


@cache
def _can_draw() -> bool:
    try:
        choose_backend()
    except RenderError:
        return False
    return True


ROS1_TOOLS = Need(
    "the tools of ROS 1",
    "apt-get install -y --no-install-recommends python3-rostopic python3-rosservice python3-rosnode python3-rosparam "
    "python3-roslaunch python3-rosmaster python3-rosbag python3-rospy python3-rosmsg python3-std-srvs "
    "python3-sensor-msgs",
    lambda: shutil.which("rostopic", path="/usr/bin") is not None,
)
ROS1_MESSAGES = Need(
    "the message classes of ROS 1",
    "apt-get install -y --no-install-recommends python3-genpy python3-rospy python3-std-msgs python3-sensor-msgs "
    "python3-geometry-msgs python3-rosmsg",
    _debian_package("genpy", "std_msgs.msg", "sensor_msgs.msg", "geometry_msgs.msg"),
)
TF2 = Need("tf2_ros", "apt-get install -y --no-install-recommends python3-tf2-ros", _debian_package("tf2_ros"))
ROSBAG = Need("rosbag", "apt-get install -y python3-rosbag", lambda: Path("/usr/bin/rosbag").exists())
CATKIN = Need("catkin_pkg", "apt-get install -y python3-catkin-pkg", _debian_package("catkin_pkg"))
CATKIN_MAKE = Need(
    "catkin_make and roscpp",
    "apt-get install -y --no-install-recommends catkin g++ make libroscpp-dev libgeometry-msgs-dev libsensor-msgs-dev "
    "ros-message-generation",
    lambda: all(
        map(
            Path.exists,
            (Path("/usr/bin/catkin_make"), Path("/usr/share/roscpp/cmake"), Path("/usr/share/sensor_msgs/cmake")),
        )
    ),
)
RCLPY = Need(
    "rclpy",
    f"{shlex.quote(sys.executable)} -m venv {ROS2_HOME} && {ROS2_HOME}/bin/pip install {_ROS2_WHEELS}",
    (ROS2_SITE / "rclpy").is_dir,
)
DRAKE = Need(
    "Drake",
    f"{shlex.quote(sys.executable)} -m venv {DRAKE_HOME} && {DRAKE_HOME}/bin/pip install drake==1.51.1",
    lambda: any(DRAKE_HOME.glob("lib/*/site-packages/pydrake")),
)
RAY = Need("Ray", "pip install -e '.[ray]'", lambda: importlib.util.find_spec("ray") is not None)
STABLE_BASELINES3 = Need(
    "stable-baselines3",
    "pip install stable-baselines3",
    lambda: importlib.util.find_spec("stable_baselines3") is not None,
)
TORCH = Need("PyTorch", "pip install torch", lambda: importlib.util.find_spec("torch") is not None)
WARP = Need("MuJoCo Warp", "pip install -e '.[warp]'", lambda: importlib.util.find_spec("mujoco_warp") is not None)
NUMBA_CUDA = Need("numba-cuda", "pip install -e '.[cuda]'", lambda: importlib.util.find_spec("numba_cuda") is not None)
CAPYTAINE = Need("Capytaine", "pip install -e '.[hydro]'", lambda: importlib.util.find_spec("capytaine") is not None)
PYCOCOTOOLS = Need(
    "pycocotools", "pip install -e '.[test]'", lambda: importlib.util.find_spec("pycocotools") is not None
)
MKDOCS = Need("mkdocs", "pip install -e '.[docs]'", lambda: importlib.util.find_spec("mkdocs") is not None)
CHROMIUM = Need("Chromium", "apt-get install -y chromium", lambda: CHROMIUM_PROGRAM is not None)
GPSDECODE = Need("gpsdecode", "apt-get install -y gpsd-clients", lambda: shutil.which("gpsdecode") is not None)
NODE = Need("Node.js", "apt-get install -y nodejs npm", lambda: None not in {shutil.which("node"), shutil.which("npm")})
EGL = Need("EGL or OSMesa", "apt-get install -y libegl1 libgl1-mesa-dri libopengl0", _can_draw)
