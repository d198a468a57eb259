"""ROS 2's wheels in a virtual environment of their own, and programs that see them beside vrx_mj."""

import os
import subprocess
import sys
from pathlib import Path

from needs import ROS2_HOME, ROS2_SITE

BEGIN = f"import sys; sys.path.append({str(ROS2_SITE)!r}); "
"""At the end: numpy stays our own."""


def environment(tmp_path):
    """Of a program: this machine alone, a domain of this test process, and logs in a folder of the test's own."""
    libraries = [ROS2_HOME / "lib", *sorted(ROS2_SITE.glob("ros_*.libs"))]
    return os.environ | {
        "LD_LIBRARY_PATH": os.pathsep.join(map(str, libraries)),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(1 + os.getpid() % 100),
        "ROS_LOG_DIR": str(tmp_path),
        "PYTHONPATH": str(Path(__file__).parent),
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }


def started(tmp_path, code, *arguments, **how):
    """A program of Python that may import rclpy and vrx_mj."""
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN + code, *map(str, arguments)], env=environment(tmp_path), text=True, **how
    )
