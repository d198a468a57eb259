"""VRX 3's forms of VRX's messages: what its topics on ROS 2 carry for the same content."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from vrx_mj.ros import cdr
from vrx_mj.ros.cdr import kind
from vrx_mj.ros.interface import VRX3, Output
from vrx_mj.ros.messages import Message, new
from vrx_mj.sensors.labels import CATEGORY_NAMES

PACKAGES = (
    "geometry_msgs",
    "nav_msgs",
    "rcl_interfaces",
    "ros_gz_interfaces",
    "rosgraph_msgs",
    "sensor_msgs",
    "std_msgs",
    "tf2_msgs",
    "vision_msgs",
    "visualization_msgs",
)
"""Packages of the types that VRX 3's topics have."""
_KINDS = {bool: (1, "bool_value"), int: (2, "integer_value"), float: (3, "double_value"), str: (4, "string_value")}
"""Numbers of rcl_interfaces/ParameterType, and the fields that hold the values."""


def parameters(header: Message, values: Mapping[str, str | bool | int | float]) -> Message:
    """ros_gz_interfaces/ParamVec."""
    params = [kind("rcl_interfaces/Parameter")(name, _value(value)) for name, value in values.items()]
    return kind("ros_gz_interfaces/ParamVec")(header, params)


def _value(value: str | float) -> Message:
    number, field = _KINDS[type(value)]
    return cdr.new("rcl_interfaces/ParameterValue", type=number, **{field: value})


def with_vrx3(output: Output, *names: str) -> Iterator[Output]:
    """A topic of VRX, and those of these names by which VRX 3 publishes the same."""
    yield output
    yield from (in_vrx3(output, name) for name in names)


def in_vrx3(output: Output, name: str) -> Output:
    """A topic as VRX 3 has it: by its name, with its type for the same content."""
    kind, convert = CONVERSIONS.get(output.type, (output.type, lambda message: message))
    make = partial(_convert, output.make, convert)
    return replace(output, name=name, type=kind, make=make, dialects=VRX3)


def _convert(
    make: Callable[..., Message | None], convert: Callable[[Message], Message], *reading: object
) -> Message | None:
    message = make(*reading)
    return None if message is None else convert(message)


def _pose(message: Message) -> Message:
    """geometry_msgs/Pose with latitude and longitude [degrees] for x and y, as VRX 3's."""
    where = message.pose.position
    position = {"x": where.latitude, "y": where.longitude, "z": where.altitude}
    return new("geometry_msgs/Pose", position=position, orientation=message.pose.orientation)


def _detections(message: Message) -> Message:
    """vision_msgs/Detection2DArray, whose classes have names here; the id is the number of the pixels in the mask."""
    found = []
    for one in message.detections:
        (result,), center = one.results, one.bbox.center
        hypothesis = kind("vision_msgs/ObjectHypothesis")(CATEGORY_NAMES[result.id], result.score)
        results = [kind("vision_msgs/ObjectHypothesisWithPose")(hypothesis, result.pose)]
        pose = kind("vision_msgs/Pose2D")(kind("vision_msgs/Point2D")(center.x, center.y), center.theta)
        box = kind("vision_msgs/BoundingBox2D")(pose, one.bbox.size_x, one.bbox.size_y)
        found.append(kind("vision_msgs/Detection2D")(one.header, results, box, str(one.header.seq)))
    return kind("vision_msgs/Detection2DArray")(message.header, found)


CONVERSIONS: Mapping[str, tuple[str, Callable[[Message], Message]]] = {
    "std_msgs/Float64": (
        "std_msgs/Float32",
        lambda one: new("std_msgs/Float32", data=float(np.float32(one.data))),
    ),
    "std_msgs/Float64MultiArray": (
        "ros_gz_interfaces/Float32Array",
        lambda one: kind("ros_gz_interfaces/Float32Array")(np.asarray(one.data, np.float32)),
    ),
    "geographic_msgs/GeoPoseStamped": (
        "geometry_msgs/PoseStamped",
        lambda one: new("geometry_msgs/PoseStamped", header=one.header, pose=_pose(one)),
    ),
    "geographic_msgs/GeoPath": (
        "geometry_msgs/PoseArray",
        lambda one: new("geometry_msgs/PoseArray", header=one.header, poses=[_pose(pose) for pose in one.poses]),
    ),
    "usv_msgs/RangeBearing": (
        "ros_gz_interfaces/ParamVec",
        lambda one: parameters(one.header, {name: getattr(one, name) for name in ("range", "bearing", "elevation")}),
    ),
    "vision_msgs/Detection2DArray": ("vision_msgs/Detection2DArray", _detections),
}
"""VRX 3's type for each of VRX's that differs, and the conversion."""
