"""Foxglove's WebSocket, for Foxglove and Lichtblick: the table's topics to look at; nothing is taken from clients.

What their panels draw has their own types, the rest ROS 1's. Needs foxglove-sdk, and no ROS.
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import foxglove
from foxglove import messages as fox
from foxglove.websocket import Capability, ChannelView, Client, ServerListener, StatusLevel, WebSocketServer

from vrx_mj.errors import NetworkError
from vrx_mj.ros.interface import Delivery, RosInterface, Traffic
from vrx_mj.ros.messages import Message, definition, encode, full_name, is_known
from vrx_mj.ros.table.viewers import CUBE, CYLINDER, SPHERE, START, TRIANGLES

BACKLOG = 256
"""Largest number of messages that wait for a slow client: the oldest are dropped first."""
_RAW_IMAGE = "sensor_msgs/Image"
"""Type that is left out: the same pictures are published compressed."""
_STATIC_FRAMES = "/tf_static"
"""Topic that is repeated every simulated second: panels of a layout that is opened later miss the first message."""
_LEVELS = {"INFO": StatusLevel.Info, "WARN": StatusLevel.Warning}
"""Levels of status messages."""
_PRIMITIVES: Mapping[int, tuple[str, str, Mapping[str, Any]]] = {
    CUBE: ("cubes", "CubePrimitive", {}),
    SPHERE: ("spheres", "SpherePrimitive", {}),
    CYLINDER: ("cylinders", "CylinderPrimitive", {"bottom_scale": 1.0, "top_scale": 1.0}),
    TRIANGLES: ("triangles", "TriangleListPrimitive", {}),
}
"""Primitives by the type of a marker: the field of an entity, the primitive's type, and further fields."""


class Foxglove(ServerListener):
    """A `Transport` (see `vrx_mj.ros.interface`) of one server, whose threads call what begins with `on_`."""

    def __init__(self, *, port: int, host: str = "127.0.0.1") -> None:
        """A server on that address; `start` opens it."""
        self._address, self._sent, self._repeated = (host, port), 0, -1
        self._server: WebSocketServer | None = None
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._latched: dict[str, Delivery] = {}
        self._listened: frozenset[tuple[str, int]] = frozenset()
        """Topics and clients."""
        self._lock = threading.Lock()

    def start(self) -> Sequence[str]:
        """Open it; returns a line with its address. NetworkError: it cannot be opened, and why."""
        host, port = self._address
        try:
            self._server = foxglove.start_server(
                name="vrx_mj", host=host, port=port, capabilities=[Capability.Time], context=self._context,
                server_listener=self, message_backlog_size=BACKLOG,
            )  # fmt: skip
        except RuntimeError as error:
            raise NetworkError(f"cannot serve Foxglove on {host}:{port}: {error}") from error
        return [f"Foxglove: ws://{host}:{self._server.port}"]

    def offer(self, table: RosInterface) -> None:
        """Offer this table from now on, and nothing else."""
        types = {name: one.type for name, one in table.outputs.items() if one.type != _RAW_IMAGE and is_known(one.type)}
        for name in self._channels.keys() - types.keys():
            self._latched.pop(name, None)
            self._channels.pop(name).close()
        for name in types.keys() - self._channels.keys():
            self._channels[name] = _channel(name, types[name], self._context)

    @property
    def subscribed_topics(self) -> frozenset[str]:
        """Names of the outputs that somebody listens to now."""
        return frozenset(topic for topic, _ in self._listened if topic in self._channels)

    def publish(self, batch: Sequence[Delivery]) -> None:
        """Send messages of one moment to who listens; one that is latched is kept."""
        wanted = self.subscribed_topics
        for sent in batch:
            name = sent.output.name
            if sent.output.latched and name in self._channels:
                self._latched[name] = sent
            if name in wanted:
                self._log(sent)
        if not (wanted and batch) or self._server is None:
            return
        now = batch[-1].time
        self._server.broadcast_time(round(now * 1e9))
        if _STATIC_FRAMES in wanted & self._latched.keys() and int(now) != self._repeated:
            self._log(self._latched[_STATIC_FRAMES])
            self._repeated = int(now)

    def log(self, level: str, text: str) -> None:
        """Show people a line among the viewer's problems."""
        if self._server is not None:
            self._server.publish_status(text, _LEVELS.get(level, StatusLevel.Error))

    @property
    def traffic(self) -> Traffic:
        """Traffic since the start; messages that a client missed are not counted."""
        return Traffic(len({client for _, client in self._listened}), self._sent, 0)

    def close(self) -> None:
        """Close every connection."""
        if self._server is not None:
            self._server.stop()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """A client listens: it gets what is latched."""
        with self._lock:
            self._listened |= {(channel.topic, client.id)}
        if channel.topic in self._latched:
            self._log(self._latched[channel.topic], client.id)

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """A client does not listen any more, or has gone."""
        with self._lock:
            self._listened -= {(channel.topic, client.id)}

    def _log(self, sent: Delivery, client: int | None = None) -> None:
        name, (_, convert) = sent.output.name, _CONVERSIONS.get(sent.output.type, (None, None))
        content = convert(sent.message, sent.time).encode() if convert else encode(sent.message, sent.output.type)
        self._sent += len(content) * (sum(topic == name for topic, _ in self._listened) if client is None else 1)
        self._channels[name].log(content, log_time=round(sent.time * 1e9), sink_id=client)


def _channel(topic: str, type_name: str, context: foxglove.Context) -> foxglove.Channel:
    if type_name in _CONVERSIONS:
        schema, encoding = _CONVERSIONS[type_name][0].get_schema(), "protobuf"
    else:
        name, text = full_name(type_name).replace("/msg/", "/"), definition(type_name)
        schema, encoding = foxglove.Schema(name=name, encoding="ros1msg", data=text.encode()), "ros1"
    return foxglove.Channel(topic, schema=schema, message_encoding=encoding, context=context)


def _copy(kind: str, message: Message, names: Sequence[str]) -> Any:
    """A message of Foxglove's with fields of ROS's."""
    return getattr(fox, kind)(**{name: getattr(message, name) for name in names})


def _pose(pose: Message) -> Any:
    turn = _copy("Quaternion", pose.orientation, "xyzw")
    return fox.Pose(position=_copy("Vector3", pose.position, "xyz"), orientation=turn)


def _head(header: Message) -> dict[str, Any]:
    return {"timestamp": fox.Timestamp(header.stamp.sec, header.stamp.nanosec), "frame_id": header.frame_id}


def _fix(fix: Message, _time: float) -> Any:
    place = {name: getattr(fix, name) for name in ("latitude", "longitude", "altitude")}
    return fox.LocationFix(**_head(fix.header), **place)


def _image(image: Message, _time: float) -> Any:
    kind = "png" if "png" in image.format else "jpeg"
    return fox.CompressedImage(**_head(image.header), data=bytes(image.data), format=kind)


def _transform(one: Message) -> Any:
    shift, turn = (getattr(one.transform, name) for name in ("translation", "rotation"))
    return fox.FrameTransform(
        timestamp=_head(one.header)["timestamp"], parent_frame_id=one.header.frame_id,
        child_frame_id=one.child_frame_id, translation=_copy("Vector3", shift, "xyz"),
        rotation=_copy("Quaternion", turn, "xyzw"),
    )  # fmt: skip


def _poses(states: Message, time: float) -> Any:
    poses = [_pose(pose) for pose in states.pose]
    return fox.PosesInFrame(timestamp=fox.Timestamp.from_epoch_secs(time), frame_id="map", poses=poses)


def _scene(markers: Message, _time: float) -> Any:
    """An entity for each namespace; what was there before goes."""
    entities: dict[str, dict[str, Any]] = {}
    for one in markers.markers:
        if not one.ns:
            continue
        field, kind, rest = _PRIMITIVES[one.type]
        points = [_copy("Point3", point, "xyz") for point in one.points]
        size = {"points": points} if points else {"size": _copy("Vector3", one.scale, "xyz")}
        shape = getattr(fox, kind)(pose=_pose(one.pose), color=_copy("Color", one.color, "rgba"), **size, **rest)
        entities.setdefault(one.ns, {}).setdefault(field, []).append(shape)
    return fox.SceneUpdate(
        deletions=[fox.SceneEntityDeletion(type=fox.SceneEntityDeletionType.All)],
        entities=[
            fox.SceneEntity(id=name, frame_id=START, frame_locked=True, **shapes) for name, shapes in entities.items()
        ],
    )


_CONVERSIONS: Mapping[str, tuple[Any, Callable[[Message, float], Any]]] = {
    "gazebo_msgs/ModelStates": (fox.PosesInFrame, _poses),
    "sensor_msgs/CompressedImage": (fox.CompressedImage, _image),
    "sensor_msgs/NavSatFix": (fox.LocationFix, _fix),
    "tf2_msgs/TFMessage": (
        fox.FrameTransforms,
        lambda frames, _time: fox.FrameTransforms(transforms=[_transform(one) for one in frames.transforms]),
    ),
    "visualization_msgs/MarkerArray": (fox.SceneUpdate, _scene),
}
"""Foxglove's type for each converted type of ROS 1, and the conversion."""
