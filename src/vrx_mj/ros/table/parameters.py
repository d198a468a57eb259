"""Named values in a message of ROS 2, as VRX 3 tells of its tasks and of beacons."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vrx_mj.ros.cdr import kind
from vrx_mj.ros.messages import Message

__all__ = ["parameters"]

KINDS = {bool: (1, "bool_value"), int: (2, "integer_value"), float: (3, "double_value"), str: (4, "string_value")}
"""Of rcl_interfaces/ParameterType, and the field that has the value."""


def parameters(header: Message, values: Mapping[str, str | bool | int | float]) -> Message:
    """ros_gz_interfaces/ParamVec."""
    params = [kind("rcl_interfaces/Parameter")(name, _value(value)) for name, value in values.items()]
    return kind("ros_gz_interfaces/ParamVec")(header, params)


def _value(value: str | float) -> Message:
    number, field = KINDS[type(value)]
    empty: dict[str, Any] = {
        "bool_value": False,
        "integer_value": 0,
        "double_value": 0.0,
        "string_value": "",
        "byte_array_value": np.zeros(0, np.uint8),
        "bool_array_value": np.zeros(0, np.bool_),
        "integer_array_value": np.zeros(0, np.int64),
        "double_array_value": np.zeros(0, np.float64),
        "string_array_value": [],
    }
    return kind("rcl_interfaces/ParameterValue")(type=number, **(empty | {field: value}))
