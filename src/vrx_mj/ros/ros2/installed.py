"""What the user's ROS 2 has: rclpy, and packages of messages."""

import importlib
import os
import platform
import re
import sys
from functools import cache
from typing import Any

from vrx_mj.errors import NetworkError
from vrx_mj.packages import install_command
from vrx_mj.ros.cdr import fields

__all__ = ["has_package", "load_rclpy", "message_class"]

WHEELS = ("ros-jazzy-rclpy", "ros-jazzy-rmw-fastrtps-cpp", "ros-jazzy-common-interfaces")


def load_rclpy() -> Any:
    """The module rclpy.

    Raises:
        NetworkError: it is not there, or for another Python; and what to do.
    """
    try:
        return importlib.import_module("rclpy")
    except ImportError as error:
        raise NetworkError(_advice(error)) from error


def _advice(error: ImportError) -> str:
    own = ".".join(platform.python_version_tuple()[:2])
    found = [re.search(r"/ros/.*python(3\.\d+)/", f"{path}/") for path in sys.path]
    versions = sorted({match[1] for match in found if match} - {own})
    if versions:
        distro = os.environ.get("ROS_DISTRO", "here").title()
        return (
            f"ROS 2 {distro} is for Python {' or '.join(versions)}, and this is Python {own}: install vrx_mj with "
            "that Python, 3.11 or newer; Jazzy has 3.12"
        )
    what = "is not installed" if error.name == "rclpy" else f"cannot be imported ({str(error).partition(chr(10))[0]})"
    return (
        f"ROS 2's rclpy {what}: source ROS 2, as '. /opt/ros/jazzy/setup.bash', and run vrx-mj with the same Python "
        f"(Jazzy's is 3.12, this is {own}); without ROS on this machine: {install_command(*WHEELS)}"
    )


def has_package(package: str) -> bool:
    """Whether there are messages of a package."""
    try:
        importlib.import_module(f"{package}.msg")
    except ImportError:
        return False
    return True


@cache
def message_class(type_name: str) -> Any | None:
    """The user's class of a type, `sensor_msgs/Imu`; None where there is none, or one with other fields than ours."""
    package, _, name = type_name.partition("/")
    try:
        found = getattr(importlib.import_module(f"{package}.msg"), name, None)
    except ImportError:
        return None
    known = fields(type_name)
    if found is None or list(found.get_fields_and_field_types()) != [field for field, _ in known]:
        return None
    return found if all(inner is None or message_class(inner) for _, inner in known) else None
