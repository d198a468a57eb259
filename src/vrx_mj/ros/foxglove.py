"""Foxglove's WebSocket, for Foxglove and Lichtblick: the table's topics to look at; nothing is taken from clients.

What their panels draw has their own types, the rest ROS 1's. Needs foxglove-sdk, and no ROS.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import foxglove
from foxglove import messages as fox
from foxglove.websocket import Capability, ChannelView, Client, ServerListener, StatusLevel, WebSocketServer

from vrx_mj.errors import NetworkError
from vrx_mj.ros.interface import Output, RosInterface, Sent, Traffic
from vrx_mj.ros.messages import Message, definition, encode, full_name, is_known
from vrx_mj.ros.table.viewers import CUBE, CYLINDER, SPHERE, TRIANGLES

__all__ = ["Foxglove"]

BACKLOG = 256
"""Messages that wait for a client that does not keep up, at most: the oldest go first."""
RAW = "sensor_msgs/Image"
"""Left out: the same pictures are there compressed."""
STILL = "/tf_static"
"""Repeated every simulated second."""
LEVELS = {"INFO": StatusLevel.Info, "WARN": StatusLevel.Warning}

STRAIGHT: Mapping[str, Any] = {"bottom_scale": 1.0, "top_scale": 1.0}
"""Of a cylinder that is no cone."""


class Foxglove:
    """A `Transport` (see `vrx_mj.ros.interface`) of one server."""

    title = "Foxglove"

    def __init__(self, *, port: int, host: str = "127.0.0.1") -> None:
        """A server on that address; `start` opens it."""
        self._address, self._sent = (host, port), 0
        self._server: WebSocketServer | None = None
        self._context = foxglove.Context()
        self._channels: dict[str, tuple[Output, foxglove.Channel]] = {}
        self._latched: dict[str, Sent] = {}
        self._repeated = -1
        self._listener = _Listener(self._repeat)

    def start(self) -> Sequence[str]:
        """Open it; returns a line with its address. NetworkError: it cannot be opened, and why."""
        host, port = self._address
        try:
            self._server = foxglove.start_server(
                name="vrx_mj", host=host, port=port, capabilities=[Capability.Time], context=self._context,
                server_listener=self._listener, message_backlog_size=BACKLOG,
            )  # fmt: skip
        except RuntimeError as error:
            raise NetworkError(f"cannot serve Foxglove on {host}:{port}: {error}") from error
        return [f"Foxglove: ws://{host}:{self._server.port}"]

    def offer(self, table: RosInterface) -> None:
        """Offer this table from now on, and nothing else."""
        outputs = {name: one for name, one in table.outputs.items() if one.type != RAW and is_known(one.type)}
        for name in self._channels.keys() - outputs.keys():
            self._channels.pop(name)[1].close()
            self._latched.pop(name, None)
        for name, output in outputs.items():
            known = self._channels.get(name)
            channel = known[1] if known is not None else _channel(output, self._context)
            self._channels[name] = output, channel

    @property
    def wanted(self) -> frozenset[str]:
        """Names of the outputs that somebody listens to now."""
        return self._listener.topics & self._channels.keys()

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send messages of one moment to who listens; one that is latched is kept."""
        wanted = self.wanted
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
        if STILL in wanted & self._latched.keys() and int(now) != self._repeated:
            self._log(self._latched[STILL])  # panels of a layout that is opened later miss the first one
            self._repeated = int(now)

    def log(self, level: str, text: str) -> None:
        """Show people a line among the viewer's problems."""
        if self._server is not None:
            self._server.publish_status(text, LEVELS.get(level, StatusLevel.Error))

    @property
    def traffic(self) -> Traffic:
        """What it has carried; what a client missed is not known."""
        return Traffic(self._listener.clients, self._sent, 0)

    def close(self) -> None:
        """Close every connection."""
        if self._server is not None:
            self._server.stop()

    def _repeat(self, topic: str, client: int) -> None:
        if topic in self._latched:
            self._log(self._latched[topic], client)

    def _log(self, sent: Sent, client: int | None = None) -> None:
        content = _encoded(sent.message, sent.output.type)
        self._sent += len(content) * (self._listener.count(sent.output.name) if client is None else 1)
        self._channels[sent.output.name][1].log(content, log_time=round(sent.time * 1e9), sink_id=client)


class _Listener(ServerListener):
    """Who listens to what; called by the server's threads."""

    def __init__(self, repeat: Callable[[str, int], None]) -> None:
        self._repeat = repeat
        self._pairs: frozenset[tuple[str, int]] = frozenset()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self._pairs |= {(channel.topic, client.id)}
        self._repeat(channel.topic, client.id)

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        self._pairs -= {(channel.topic, client.id)}

    @property
    def topics(self) -> frozenset[str]:
        return frozenset(topic for topic, _ in self._pairs)

    @property
    def clients(self) -> int:
        return len({client for _, client in self._pairs})

    def count(self, topic: str) -> int:
        return sum(one == topic for one, _ in self._pairs)


def _channel(output: Output, context: foxglove.Context) -> foxglove.Channel:
    if output.type in CONVERSIONS:
        schema, encoding = CONVERSIONS[output.type][0].get_schema(), "protobuf"
    else:
        name = full_name(output.type).replace("/msg/", "/")
        schema, encoding = foxglove.Schema(name=name, encoding="ros1msg", data=definition(output.type).encode()), "ros1"
    return foxglove.Channel(output.name, schema=schema, message_encoding=encoding, context=context)


def _encoded(message: Message, type_name: str) -> bytes:
    conversion = CONVERSIONS.get(type_name)
    return encode(message, type_name) if conversion is None else bytes(conversion[1](message).encode())


# Foxglove's types


def _stamp(header: Message) -> Any:
    return fox.Timestamp(header.stamp.sec, header.stamp.nanosec)


def _vector(xyz: Message) -> Any:
    return fox.Vector3(x=xyz.x, y=xyz.y, z=xyz.z)


def _turn(one: Message) -> Any:
    return fox.Quaternion(x=one.x, y=one.y, z=one.z, w=one.w)


def _pose(pose: Message) -> Any:
    return fox.Pose(position=_vector(pose.position), orientation=_turn(pose.orientation))


def _fix(fix: Message) -> Any:
    return fox.LocationFix(
        timestamp=_stamp(fix.header), frame_id=fix.header.frame_id, latitude=fix.latitude, longitude=fix.longitude,
        altitude=fix.altitude,
    )  # fmt: skip


def _image(image: Message) -> Any:
    kind = "png" if "png" in image.format else "jpeg"
    return fox.CompressedImage(
        timestamp=_stamp(image.header), frame_id=image.header.frame_id, data=bytes(image.data), format=kind
    )


def _transforms(frames: Message) -> Any:
    return fox.FrameTransforms(
        transforms=[
            fox.FrameTransform(
                timestamp=_stamp(one.header),
                parent_frame_id=one.header.frame_id,
                child_frame_id=one.child_frame_id,
                translation=_vector(one.transform.translation),
                rotation=_turn(one.transform.rotation),
            )
            for one in frames.transforms
        ]
    )


def _poses(states: Message) -> Any:
    return fox.PosesInFrame(frame_id="map", poses=[_pose(pose) for pose in states.pose])


def _scene(markers: Message) -> Any:
    """An entity for each namespace; what was there before goes."""
    entities: dict[str, dict[int, list[dict[str, Any]]]] = {}
    shown = [one for one in markers.markers if one.ns]
    for one in shown:
        rgba = {channel: getattr(one.color, channel) for channel in "rgba"}
        points = [fox.Point3(x=point.x, y=point.y, z=point.z) for point in one.points]
        size = {"points": points} if one.type == TRIANGLES else {"size": _vector(one.scale)}
        shape = {"pose": _pose(one.pose), "color": fox.Color(**rgba), **size}
        entities.setdefault(one.ns, {}).setdefault(one.type, []).append(shape)
    return fox.SceneUpdate(
        deletions=[fox.SceneEntityDeletion(type=fox.SceneEntityDeletionType.All)],
        entities=[
            fox.SceneEntity(
                frame_id=shown[0].header.frame_id, id=name, frame_locked=True,
                cubes=[fox.CubePrimitive(**shape) for shape in shapes.get(CUBE, ())],
                spheres=[fox.SpherePrimitive(**shape) for shape in shapes.get(SPHERE, ())],
                cylinders=[fox.CylinderPrimitive(**shape, **STRAIGHT) for shape in shapes.get(CYLINDER, ())],
                triangles=[fox.TriangleListPrimitive(**shape) for shape in shapes.get(TRIANGLES, ())],
            )
            for name, shapes in entities.items()
        ],
    )  # fmt: skip


CONVERSIONS: Mapping[str, tuple[Any, Callable[[Message], Any]]] = {
    "gazebo_msgs/ModelStates": (fox.PosesInFrame, _poses),
    "sensor_msgs/CompressedImage": (fox.CompressedImage, _image),
    "sensor_msgs/NavSatFix": (fox.LocationFix, _fix),
    "tf2_msgs/TFMessage": (fox.FrameTransforms, _transforms),
    "visualization_msgs/MarkerArray": (fox.SceneUpdate, _scene),
}
"""By type of ROS 1, Foxglove's and how it is made."""
