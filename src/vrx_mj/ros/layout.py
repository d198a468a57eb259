"""A layout of panels for Foxglove and Lichtblick, which their users import: the world in 3D, a map, and a camera."""

import json
from collections.abc import Mapping
from typing import Any

from vrx_mj.ros.table.viewers import MARKERS, START

_CAMERA = {"perspective": True, "distance": 55.0, "phi": 62.0, "thetaOffset": 25.0, "fovy": 45.0, "near": 0.5,
          "far": 5000.0, "target": [0, 0, 0], "targetOffset": [0, 0, 0], "targetOrientation": [0, 0, 0, 1]}  # fmt: skip
"""Of the 3D panel: 55 m from the frame `start`, its north up."""
_SEA = {"layerId": "foxglove.Grid", "instanceId": "sea", "label": "sea level", "frameId": START, "visible": True,
       "size": 400, "divisions": 40, "lineWidth": 1, "color": "#3a7ca566", "position": [0, 0, 0],
       "rotation": [0, 0, 0]}  # fmt: skip
_BOAT = {"layerId": "foxglove.Urdf", "sourceType": "topic", "visible": True, "displayMode": "auto"}


def layout_text(types: Mapping[str, str]) -> str:
    """The layout that shows topics of these types by name, as JSON."""
    by_type: dict[str, list[str]] = {}
    for topic, type_name in types.items():
        by_type.setdefault(type_name, []).append(topic)
    boats = [name for name in by_type.get("std_msgs/String", ()) if name.endswith("/robot_description")]
    panels: dict[str, dict[str, Any]] = {
        "3D!world": {
            "cameraState": _CAMERA,
            "followMode": "follow-none",
            "followTf": START,
            "scene": {"transforms": {"showLabel": False, "axisScale": 0, "lineWidth": 0}},
            "topics": {MARKERS: {"visible": True}},
            "layers": {"sea": _SEA} | {topic: _BOAT | {"instanceId": topic, "topic": topic} for topic in boats},
        }
    }
    side: Any = "map!fixes"
    panels[side] = {"topicConfig": {}, "followTopic": next(iter(by_type.get("sensor_msgs/NavSatFix", ())), "")}
    for topic in by_type.get("sensor_msgs/CompressedImage", ())[:1]:
        panels["Image!camera"] = {"imageMode": {"imageTopic": topic}}
        side = {"direction": "column", "first": "Image!camera", "second": side}
    panes = {"direction": "row", "first": "3D!world", "second": side, "splitPercentage": 70}
    rest = {"globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return json.dumps({"configById": panels, **rest, "layout": panes}, indent=1) + "\n"
