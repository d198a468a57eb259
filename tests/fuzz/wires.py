"""What comes through ROS's wires: calls of XML-RPC, streams of TCPROS, operations of rosbridge."""

import functools
import json
import logging
import random
import socket
from pathlib import Path
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy, dumps

from websockets.sync.client import connect

from bridged import Bridged
from fuzz import markup, raw, trees
from fuzz.kind import Files, Kind
from fuzz.ros1_messages import CALLS, HEADERS
from fuzz.yaml_files import json_bytes
from ros1_peer import ME, frame, stream_of
from ros1_served import Served, free_port, small_table
from vrx_mj.errors import NetworkError
from vrx_mj.ros.ros1.connection import encode_header

PORT = b"@PORT@"
"""Stands in a head for the port of the server."""
HEAD = b"POST /RPC2 HTTP/1.1\r\nHost: 127.0.0.1:" + PORT + b"\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n"
REPLY = 0.01
"""Wall time [s] in which an answer is waited for; none may come."""
LIVES = 10.0
"""Wall time [s] within which a good call must be answered afterwards."""
OPERATIONS = [
    {
        "op": "subscribe",
        "topic": "/wamv/sensors/imu/data",
        "type": "sensor_msgs/Imu",
        "throttle_rate": 100,
        "queue_length": 2,
        "id": "s",
    },
    {"op": "subscribe", "topic": "/vrx/task/info", "compression": "cbor"},
    {"op": "subscribe", "topic": "/wind/speed", "compression": "png", "fragment_size": 40},
    {"op": "unsubscribe", "topic": "/wamv/sensors/imu/data", "id": "s"},
    {"op": "advertise", "topic": "/wamv/cmd_vel", "type": "geometry_msgs/Twist", "latch": False},
    {"op": "publish", "topic": "/wamv/cmd_vel", "msg": {"linear": {"x": 1.0, "y": 0, "z": 0}, "angular": {"z": 0.2}}},
    {"op": "publish", "topic": "/wamv/thrusters/left_thrust_cmd", "msg": {"data": 0.5}},
    {"op": "unadvertise", "topic": "/wamv/cmd_vel"},
    {
        "op": "call_service",
        "service": "/gazebo/delete_model",
        "args": {"model_name": "wamv"},
        "id": "c",
        "fragment_size": 100,
    },
    {"op": "call_service", "service": "/rosapi/topics", "args": {}, "compression": "png"},
    {"op": "call_service", "service": "/rosapi/set_param", "args": {"name": "/wamv/gains", "value": '[1, {"p": 2}]'}},
    {"op": "call_service", "service": "/rosapi/message_details", "args": {"type": "sensor_msgs/Imu"}},
    {"op": "fragment", "id": "f", "data": '{"op": "subscribe"', "num": 0, "total": 2},
    {"op": "png", "data": "iVBORw0KGgo="},
    {"op": "status", "level": "error", "msg": "x"},
    {"op": "set_level", "level": "warning"},
    {"op": "auth", "mac": "a", "client": "b", "dest": "c", "rand": "d", "t": 1, "level": "e", "end": 2},
]


class Complaints(logging.Handler):
    """Keeps what the loop's library says of errors that nobody has caught, and what is logged with a traceback."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record that tells of a traceback."""
        if record.exc_info or (record.name == "asyncio" and record.levelno >= logging.ERROR):
            self.texts.append(self.format(record))

    def check(self) -> None:
        """Raise what was said since the last time."""
        texts, self.texts = self.texts, []
        assert not texts, "\n".join(texts)


@functools.cache
def complaints() -> Complaints:
    """Of this process."""
    handler = Complaints()
    logging.getLogger().addHandler(handler)
    return handler


@functools.cache
def served() -> tuple[Served, dict[str, tuple[str, int]]]:
    """The server of this process, and the addresses of its master, its node and its streams."""
    complaints()
    server = Served(free_port(), small_table("wamv")).__enter__()
    with ServerProxy(server.uri) as master:
        node = urlsplit(master.lookupNode(ME, "/gazebo")[2])
    doors = {"master": ("127.0.0.1", server.port), "node": (str(node.hostname), int(node.port or 0))}
    return server, {**doors, "stream": stream_of(server.uri, "/course")}


@functools.cache
def bridged() -> Bridged:
    """The rosbridge server of this process."""
    complaints()
    return Bridged().__enter__()


def mutated_call(chance: random.Random) -> Files:
    """A call to the master or the node, with a mutated body or head."""
    door = chance.choice(list(CALLS))
    method, values = chance.choice(CALLS[door])
    body = dumps(values, method).encode()
    draw = chance.random()
    if draw < 0.2:
        return {f"{door}.http": raw.mutated(HEAD % len(body) + body, chance)}
    body = markup.mutated(body, chance) if draw < 0.6 else raw.mutated(body, chance)
    return {f"{door}.http": HEAD % len(body) + body}


def mutated_stream(chance: random.Random) -> Files:
    """A header, and in half of the draws what follows one that is good."""
    good = encode_header(chance.choice(HEADERS))
    follows = frame(b"") * chance.randint(0, 3)
    is_good = chance.random() < 0.5
    return {"stream.tcp": good + raw.mutated(follows + b"\0", chance) if is_good else raw.mutated(good, chance)}


def mutated_operation(chance: random.Random) -> Files:
    """An operation of rosbridge with another tree, or other bytes."""
    operation = chance.choice(OPERATIONS)
    if chance.random() < 0.15:
        return {"operation.json": raw.mutated(json.dumps(operation).encode(), chance)}
    return {"operation.json": json_bytes(trees.mutated(operation, chance))}


def say(folder: Path) -> None:
    """Send bytes to a door of ROS 1; afterwards the server answers, and nothing was raised in it."""
    (file,) = [path for path in folder.iterdir() if path.is_file()]
    server, doors = served()
    host, port = doors[file.stem]
    heard = b""
    with socket.create_connection((host, port), timeout=LIVES) as connection:
        connection.sendall(file.read_bytes().replace(PORT, str(port).encode()))
        connection.settimeout(REPLY)
        try:
            heard = connection.recv(1 << 16)
        except OSError:
            heard = b""
    with ServerProxy(server.uri) as master:
        assert master.getPid("/fuzz")[0] == 1
    complaints().check()
    if (
        not heard
        or (file.suffix == ".http" and (not heard.startswith(b"HTTP/1.1 200") or b"<fault>" in heard))
        or b"error" in heard[:30]
    ):
        raise NetworkError("the server answers with an error, or not at all")


def operate(folder: Path) -> None:
    """Send an operation to rosbridge; afterwards a call is answered, and nothing was raised in the server."""
    content = (folder / "operation.json").read_bytes()
    with connect(bridged().url, max_size=None, compression=None, open_timeout=LIVES) as socket_:
        try:
            text: str | bytes = content.decode()
        except UnicodeDecodeError:
            text = content
        socket_.send(text)
    with connect(bridged().url, max_size=None, compression=None, open_timeout=LIVES) as socket_:
        socket_.send(json.dumps({"op": "call_service", "service": "/rosapi/get_time", "id": "call"}))
        heard = json.loads(socket_.recv(LIVES))
    complaints().check()
    assert heard["op"] == "service_response", heard


KINDS = (
    Kind("ros1 call", mutated_call, say, names_its_file=False, calls=True),
    Kind("ros1 stream", mutated_stream, say, names_its_file=False, calls=True),
    Kind("rosbridge", mutated_operation, operate, names_its_file=False, calls=True),
)
