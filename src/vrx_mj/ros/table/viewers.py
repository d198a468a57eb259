"""What viewers draw: shore, docks and objects as markers, meshes of boats inside URDFs, and a layout of panels."""

import base64
import json
import re
from collections.abc import Collection, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.sax.saxutils import unescape

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.reader import mesh_glb
from vrx_mj.mjcf.templates import mesh_of_file
from vrx_mj.mjcf.world import World
from vrx_mj.ros.interface import BOTH, Output
from vrx_mj.ros.messages import Message, kind, new
from vrx_mj.ros.table.host import Host, header
from vrx_mj.sensors.displays import displays_of

MARKERS, START = "/vrx_mj/markers", "start"
"""Topic of markers, and the frame at the start of the boats."""
CUBE, SPHERE, CYLINDER, TRIANGLES, DELETE_ALL = 1, 2, 3, 11, 3
"""Types of visualization_msgs/Marker, and an action."""
_SHAPES: Mapping[int, int] = {
    mujoco.mjtGeom.mjGEOM_BOX: CUBE,
    mujoco.mjtGeom.mjGEOM_SPHERE: SPHERE,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: SPHERE,
    mujoco.mjtGeom.mjGEOM_CYLINDER: CYLINDER,
    mujoco.mjtGeom.mjGEOM_CAPSULE: CYLINDER,
    mujoco.mjtGeom.mjGEOM_MESH: TRIANGLES,
}
"""Types of markers, by type of geom."""
_FILE = re.compile(r'"file://(/[^"<]*)"')
"""A path to a file in a URDF."""
_CAMERA = {"perspective": True, "distance": 55.0, "phi": 62.0, "thetaOffset": 25.0, "fovy": 45.0, "near": 0.5,
          "far": 5000.0, "target": [0, 0, 0], "targetOffset": [0, 0, 0], "targetOrientation": [0, 0, 0, 1]}  # fmt: skip
"""Camera of the 3D panel: 55 m from the frame `start`, north up."""
_SEA = {"layerId": "foxglove.Grid", "instanceId": "sea", "label": "sea level", "frameId": START, "visible": True,
       "size": 400, "divisions": 40, "lineWidth": 1, "color": "#3a7ca566", "position": [0, 0, 0],
       "rotation": [0, 0, 0]}  # fmt: skip
"""Layer of the 3D panel that shows the sea's level."""
_BOAT = {"layerId": "foxglove.Urdf", "sourceType": "topic", "visible": True, "displayMode": "auto"}
"""Layer of the 3D panel that shows a boat."""


def marker_output(host: Host) -> Output:
    """`/vrx_mj/markers`: shore, docks and objects where they start, in the frame `start`.

    Published again when objects or docks come or go. What lights and placards show is for cameras, and not in it.
    """

    def make() -> Message:
        values = host.sim.world.parameters
        there = [*(item.name for item in values.objects), *(dock.name for dock in values.docks)]
        drawn = host.scenery.markers
        if drawn is None or drawn[0] != there:
            clear = new("visualization_msgs/Marker", action=DELETE_ALL)
            shapes = _markers(host.sim.world, host.scenery.start)
            drawn = there, new("visualization_msgs/MarkerArray", markers=[clear, *shapes])
            host.scenery.markers = drawn
        return drawn[1]

    return Output(MARKERS, "visualization_msgs/MarkerArray", make, latched=True, dialects=BOTH)


def _markers(world: World, start: FloatArray) -> Iterator[Message]:
    model = mujoco.MjModel.from_xml_string(world.mjcf, assets=dict(world.assets))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    shown = {name for one in displays_of(world.parameters) for names in one.parts.values() for name in names}
    docks, boats = tuple(f"{dock.name}/" for dock in world.parameters.docks), tuple(f"{boat}/" for boat in world.boats)
    for geom in range(model.ngeom):
        name, body = model.geom(geom).name, model.body(model.geom_bodyid[geom]).name
        touches = model.geom_contype[geom] or model.geom_conaffinity[geom]
        if touches or name in shown or body.startswith(boats) or int(model.geom_type[geom]) not in _SHAPES:
            continue
        space = "docks" if body.startswith(docks) else "objects" if model.geom_bodyid[geom] else "shore"
        shape, quaternion = _SHAPES[int(model.geom_type[geom])], np.empty(4)
        mujoco.mju_mat2Quat(quaternion, data.geom_xmat[geom])
        x, y, z = (2.0 * float(value) for value in model.geom_size[geom])
        sizes = {TRIANGLES: (1.0, 1.0, 1.0), CYLINDER: (x, x, y)}
        yield new(
            "visualization_msgs/Marker",
            header=header(0.0, START),
            ns=space,
            id=geom,
            type=shape,
            pose={"position": data.geom_xpos[geom] - start, "orientation": quaternion},
            scale=sizes.get(shape, (x, y or x, z or x)),
            color=dict(zip("rgba", map(float, model.geom_rgba[geom]), strict=True)),
            points=_corners(model, int(model.geom_dataid[geom])) if shape == TRIANGLES else [],
            frame_locked=True,
        )


def _corners(model: mujoco.MjModel, number: int) -> list[Message]:
    """Three points for each triangle of a mesh, in its own frame."""
    mesh, point = model.mesh(number), kind("geometry_msgs/Point")
    faces = model.mesh_face[int(mesh.faceadr[0]) :][: int(mesh.facenum[0])]
    return [point(*xyz) for xyz in model.mesh_vert[faces.ravel() + int(mesh.vertadr[0])].tolist()]


def with_meshes_inside(text: str, assets: Collection[str]) -> str:
    """A URDF's text with meshes in it in the place of their `file://`, as `data:` URLs of glTF.

    Only those that are among a world's `assets`, names of files: a URDF from a stranger can name any file.
    """

    def inside(found: re.Match[str]) -> str:
        try:
            asset, url = _embedded_mesh(Path(unquote(unescape(found[1]))))
        except VrxError:
            return found[0]
        return f'"{url}"' if asset in assets else found[0]

    return _FILE.sub(inside, text)


@lru_cache(maxsize=256)
def _embedded_mesh(file: Path) -> tuple[str, str]:
    """The name of a mesh among the assets of a world, and its URL."""
    url = f"data:model/gltf-binary;base64,{base64.b64encode(mesh_glb(file)).decode()}"
    return mesh_of_file(file).file, url


def layout_text(types: Mapping[str, str]) -> str:
    """A layout of panels for Foxglove and Lichtblick, as JSON: the world in 3D, a map, and a camera.

    `types` are those of the topics to show, by name.
    """
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
