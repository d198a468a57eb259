"""A whole conversation of two clients with rosbridge, without a network and on a clock that jumps: every reply of it.

`tests/golden/ros/conversation.json` has what was said and all that came back. After a change that is meant, write it
again with VRX_MJ_WRITE_FINGERPRINTS=1, and read what has changed.
"""

import asyncio
import base64
import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import cbor2
import numpy as np

from bridged import fire, imu, nothing, table
from fingerprints import WRITING
from rosbridge_client import Skipping
from vrx_mj.ros import messages
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Delivery, Inbox, Output, RosInterface, Service
from vrx_mj.ros.limits import Place
from vrx_mj.ros.rosbridge import server
from vrx_mj.ros.rosbridge.codec import from_png, message_of, png
from vrx_mj.ros.rosbridge.server import Client, Hub

GOLDEN = Path(__file__).parents[3] / "golden" / "ros" / "conversation.json"
IMU, INFO, THRUST = "/wamv/sensors/imu/data", "/vrx/task/info", "/wamv/thrusters/left_thrust_cmd"
POSE = {"position": {"x": 1, "y": 2.5}, "orientation": {"w": 1}}
FRAMES = {
    "source_frames": ["b", "/c", "d"], "target_frame": "/a", "angular_thres": 0.01, "trans_thres": 0.1, "rate": 10.0,
}  # fmt: skip


class Connection:
    """The end of a websocket that a client holds."""

    def __init__(self, number):
        self.remote_address, self.transport = ("10.0.0.7", 4000 + number), self
        self.came, self.sent, self.is_open = asyncio.Queue(), [], True

    async def recv(self):
        return await self.came.get()

    async def send(self, data, text):
        whole = data if isinstance(data, bytes) else b"".join(data)
        self.sent.append(plain(json.loads(whole) if text else cbor2.loads(whole)))

    def abort(self):
        self.is_open = False


def plain(value):
    """What CBOR holds, as JSON has it; of a picture the text in it."""
    if isinstance(value, Mapping) and value.get("op") == "png" and len(str(value.get("data"))) > 9:
        return {"op": "png", "text": from_png(value["data"], 1 << 20)}  # its bytes are those of a version of zlib
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, cbor2.CBORTag):
        return {"tag": value.tag, "value": plain(value.value)}
    return base64.b64encode(value).decode() if isinstance(value, bytes) else value


class Desk:
    """A hub and two clients of it; the simulation answers calls at once."""

    def __init__(self):
        self.inbox, self.table, self.lines, self.last = Inbox(), table(), [], {}
        self.graph = Graph(SimpleNamespace(soon=lambda function, *values: function(*values)), self.inbox)
        self.graph.notices.listener = lambda *line: self.lines.append(list(line))
        self.hub = Hub(self.graph)
        self.hub._notices.listener = self.graph.notices.listener
        self.hub.open()
        self.offer()
        self.connections = [Connection(number) for number in range(2)]
        places = [Place("10.0.0.7", one.abort) for one in self.connections]
        assert all(map(self.hub.connections.enter, places))
        clients = [Client(*of_it, self.hub) for of_it in zip(self.connections, places, strict=True)]
        self.tasks = [asyncio.ensure_future(client.serve()) for client in clients]

    def offer(self, *outputs):
        odd = Output("/odd", "team_msgs/Odd", nothing)
        services = {"/wamv/fire": Service("/wamv/fire", "std_srvs/Trigger", fire)}
        known = self.table.outputs | {one.name: one for one in (odd, *outputs)}
        self.graph.offer(RosInterface(known, self.table.inputs, self.table.services | services, self.table.parameters))

    def publish(self, name, message, time=1.5):
        self.graph.send(Delivery(self.graph.table.outputs[name], message, time))

    async def hear(self, number, said, seconds=0.1):
        """What follows from a message, or from a moment of time: replies to each client, lines and commands."""
        if said is not None:
            said = json.loads(json.dumps(said).replace("LAST", self.last.get(number, "")))
            self.connections[number].came.put_nowait(json.dumps(said))
        for _ in range(20):
            await asyncio.sleep(seconds / 20)
            commands, calls, unknown = self.inbox.drain()
            self.lines += [["command", one.topic, repr(one.message)[:200], one.sender] for one in commands]
            self.lines += [["unknown", *one] for one in unknown]
            for call in calls:
                try:
                    call.answer(self.graph.table.services[call.service].answer(call.request), "")
                except Exception as error:
                    call.answer(None, str(error))
        heard = {str(index): one.sent[:] for index, one in enumerate(self.connections) if one.sent}
        for index, one in enumerate(self.connections):
            asked = [message["id"] for message in one.sent if message.get("op") == "call_service"]
            self.last[index] = asked[-1] if asked else self.last.get(index, "")
            one.sent.clear()
        if self.lines:
            heard["lines"], self.lines[:] = list(self.lines), []
        return heard


def api(name, args=None, **what):
    return {"op": "call_service", "service": f"/rosapi/{name}", "args": args, "id": name, **what}


def call(service, args=None, **what):
    return {"op": "call_service", "service": service, "args": args, "id": "call", **what}


def subscribe(topic, **what):
    return {"op": "subscribe", "topic": topic, **what}


def fragment(total, number, data, **what):
    return {"op": "fragment", "id": "f", "total": total, "num": number, "data": data, **what}


def in_png(what, depth=1):
    """An operation in pictures in each other."""
    inner = {"op": "png", "data": png(json.dumps(what).encode())}
    return inner if depth == 1 else in_png(inner, depth - 1)


LEVEL = {"op": "set_level", "level": "warning"}
SAID = {
    "what is no operation": [5, [], {}, {"op": 7}, {"op": "none"}, {"op": "n" * 60, "id": "x"}, {"op": "auth"},
                             {"op": "status"}, {"op": "set_level", "level": "loud"}, {"op": "set_level"}],
    "publishing": [
        {"op": "publish", "topic": "/new", "msg": {}}, {"op": "publish", "topic": "/new", "type": "a/B", "msg": {}},
        {"op": "advertise", "topic": "/new", "type": "std_msgs/Int8"}, {"op": "advertise", "topic": "/new"},
        {"op": "publish", "topic": "/new", "msg": {"data": 5}, "id": "p"},
        {"op": "publish", "topic": "/new", "msg": {"data": 128}}, {"op": "publish", "topic": "/new", "msg": {"d": 5}},
        {"op": "publish", "topic": "new/", "msg": {"data": -128}}, {"op": "publish", "topic": "/new", "msg": []},
        {"op": "advertise", "topic": "/new", "type": "std_msgs/String"},
        {"op": "publish", "topic": THRUST, "msg": {"data": 0.5}},
        {"op": "publish", "topic": THRUST, "msg": {"data": "x"}},
        {"op": "publish", "topic": "/wamv/cmd_vel", "type": "geometry_msgs/Twist", "msg": {"linear": {"x": 1}}},
        {"op": "unadvertise", "topic": "/new"}, {"op": "unadvertise", "topic": "/new"}, {"op": "unadvertise"},
        {"op": "advertise", "topic": "/5", "type": "std_msgs/Int8"},
        {"op": "advertise", "topic": "/ok", "type": "std_msgs/Int8", "latch": 5},
        {"op": "advertise", "topic": "/" + "n" * 256, "type": "std_msgs/Int8"},
    ],
    "latched messages": [
        {"op": "publish", "topic": "/late", "type": "std_msgs/String", "latch": True, "msg": {"data": "kept"}},
        subscribe("/late", id="a"), subscribe("/late", id="b"), {"op": "unsubscribe", "topic": "/late", "id": "a"},
        {"op": "publish", "topic": "/late", "msg": {"data": "seen"}}, {"op": "unsubscribe", "topic": "/late"},
        {"op": "publish", "topic": "/late", "msg": {"data": "unseen"}}, LEVEL,
        {"op": "unsubscribe", "topic": "/late", "id": "u"},
    ],
    "subscribing": [
        subscribe("/nothing"), subscribe("/nothing", type="a/B"), subscribe(IMU, type="std_msgs/Int8"),
        subscribe(IMU, compression="zip"), subscribe(IMU, throttle_rate=-1), subscribe(IMU, throttle_rate=True),
        subscribe(IMU, queue_length="x"), subscribe(INFO, fragment_size=30), subscribe(INFO, compression="cbor"),
    ],
    "services": [
        call("/wamv/fire"), call("wamv/fire", []), call("/wamv/fire", [1]), call("/wamv/fire", {"x": 1}),
        call("/gazebo/delete_model", ["wamv"]), call("/gazebo/delete_model", {"model_name": "w"}),
        call("/gazebo/delete_model", {"model_name": 5}), call("/gazebo/nothing"), call("/wamv/fire", timeout=-1),
        call("/wamv/fire", fragment_size=40), call("/wamv/fire", compression="cbor"), call("/wamv/fire", id=None),
        call("/gazebo/get_loggers"), call("/gazebo/set_logger_level", ["x", "loud"]),
        call("/gazebo/set_logger_level", ["x", "warn"]), call("/gazebo/get_loggers"),
    ],
    "fragments": [
        fragment(2, 1, '"/x", "type": "std_msgs/Int8"}'), fragment(2, 0, '{"op": "advertise", "topic": '),
        fragment(2, 2, ""), fragment(0, 0, ""), fragment(2, -1, ""), fragment(2, True, ""), fragment(1, 0, 5),
        fragment(1, 0, json.dumps(fragment(1, 0, json.dumps(LEVEL)))), in_png(LEVEL), in_png({"op": "none"}, 2),
        in_png(LEVEL, 3), {"op": "png", "data": "!"}, {"op": "png"},
    ],
    "parameters": [
        api("get_param_names"), api("get_param", {"name": "/use_sim_time"}), api("get_param", ["wamv/gains"]),
        api("get_param", {"name": "/none", "default": "7"}), api("get_param", {"name": "/none"}), api("get_param"),
        api("set_param", {"name": "/p", "value": "[1, {\"a\": 2}]"}), api("get_param", {"name": "p"}),
        api("set_param", {"name": "/p", "value": "{"}), api("set_param", {"name": "/p", "value": "null"}),
        api("has_param", {"name": "/p"}), api("has_param", {"name": "/q"}), api("search_param", {"name": "p"}),
        api("search_param", {"name": "q"}), api("delete_param", {"name": "/p"}), api("delete_param", {"name": "/p"}),
        api("delete_param", {"name": "/use_sim_time"}), api("get_param", {"name": "/"}),
    ],
    "the graph": [
        api("topics"), api("topics_for_type", {"type": "sensor_msgs/msg/Imu"}), api("topics_and_raw_types"),
        api("topic_type", {"topic": IMU}), api("topic_type", {"topic": "/none"}), api("services"),
        api("services_for_type", {"type": "std_srvs/Trigger"}), api("service_type", {"service": "/wamv/fire"}),
        api("service_type", {"service": "/none"}), api("service_node", {"service": "/wamv/fire"}),
        api("service_node", {"service": "/none"}), api("service_host", {"service": "/wamv/fire"}), api("nodes"),
        api("node_details", {"node": "/gazebo"}), api("node_details", {"node": "/none"}),
        api("publishers", {"topic": IMU}), api("subscribers", {"topic": THRUST}), api("action_servers"),
        api("get_action_servers"), api("get_time"), api("message_details", {"type": "sensor_msgs/Imu"}),
        api("message_details", {"type": "a/B"}), api("service_request_details", {"type": "gazebo_msgs/SetModelState"}),
        api("service_response_details", {"type": "std_srvs/Trigger"}), api("message_details", {"type": 5}),
        api("nothing"), api("topics", compression="cbor", fragment_size=100),
    ],
}  # fmt: skip
"""What the first client says, by what it is about."""
OFFERED = {"op": "advertise_service", "service": "/light", "type": "std_srvs/SetBool"}
BETWEEN = [
    (1, OFFERED), (0, OFFERED), (1, {"op": "advertise_service", "service": "/free", "type": "team_msgs/Free"}),
    (0, call("/light", {"data": True})), (0, {"op": "service_response", "id": "x", "service": "/light"}),
    (1, {"op": "service_response", "id": "LAST", "service": "/light", "values": {"success": True, "message": "on"}}),
    (0, call("/light", [False])),
    (1, {"op": "service_response", "id": "LAST", "service": "/light", "values": "no bulb", "result": False}),
    (0, call("/light")),
    (1, {"op": "service_response", "id": "LAST", "service": "/light", "values": {"success": 5}, "result": True}),
    (0, call("/light")), (1, {"op": "service_response", "id": "LAST", "service": "/light", "result": False}),
    (0, call("/free", {"any": [1, "x"]})), (1, {"op": "service_response", "id": "LAST", "values": [1], "result": True}),
    (0, api("service_host", {"service": "/light"})), (0, api("service_type", {"service": "/free"})), (0, api("nodes")),
    (0, {"op": "unadvertise_service", "service": "/light"}), (1, {"op": "unadvertise_service", "service": "/free"}),
    (0, call("/light", id="late", timeout=3)), (0, call("/light", id="never")),
]  # fmt: skip
"""A service of the second client, which the first one calls."""


async def play():
    """All that is said and heard."""
    desk, found = Desk(), []
    for about, said in SAID.items():
        found += [[about, plain(one), await desk.hear(0, one)] for one in said]
    found += await topics(desk)
    found += [[number, one, await desk.hear(number, one)] for number, one in BETWEEN]
    found += [[f"{seconds} s later", await desk.hear(0, None, seconds)] for seconds in (2.8, 0.2, 596.0, 2.0)]
    found += await frames(desk)
    desk.tasks[1].cancel()
    found.append(["the second one leaves", await desk.hear(0, api("nodes")), await desk.hear(0, None, 3.0)])
    assert all(one.is_open for one in desk.connections)
    desk.tasks[0].cancel()
    await asyncio.gather(*desk.tasks, return_exceptions=True)
    return found


async def topics(desk):
    """Messages in every compression, and of a topic that is throttled."""
    desk.publish(INFO, messages.new("std_msgs/String", data="ready for all that comes"), 2.5)
    found = [["a message in fragments and in CBOR", await desk.hear(0, None)]]
    for compression in ("none", "png", "cbor", "cbor-raw"):
        await desk.hear(1, subscribe(IMU, compression=compression, id=compression))
        for seconds in (1.5, 2.25):
            desk.publish(IMU, imu(time=seconds), seconds)
        found.append([compression, await desk.hear(1, None)])
        await desk.hear(1, {"op": "unsubscribe", "topic": IMU})
    scan = messages.new("sensor_msgs/LaserScan", ranges=np.arange(3.0, dtype=np.float32), intensities=[np.inf])
    desk.offer(Output("/scan", "sensor_msgs/LaserScan", nothing))
    for compression in ("none", "cbor"):
        await desk.hear(1, subscribe("/scan", compression=compression, throttle_rate=500, queue_length=2))
        for _ in range(5):
            desk.publish("/scan", scan)
        found.append([f"five scans in {compression}", await desk.hear(1, None), await desk.hear(1, None, 0.45)])
        found.append([await desk.hear(1, None, 0.5), await desk.hear(1, {"op": "unsubscribe", "topic": "/scan"})])
    return found


async def frames(desk):
    """Frames that a page asks for: those that have moved, until nobody listens."""
    desk.offer(Output("/tf", "tf2_msgs/TFMessage", nothing))
    found = [["frames", await desk.hear(0, call("/republish_tfs", FRAMES))]]
    found.append(["too often", await desk.hear(0, call("/republish_tfs", FRAMES | {"rate": 101.0}))])
    await desk.hear(0, subscribe("/tf2_web_republisher/tf_repub_0"))
    for shift in (0.0, 0.05, 0.2):
        moved = [
            {"header": {"frame_id": parent}, "child_frame_id": child,
             "transform": {"translation": {"x": 1.0 + shift}, "rotation": {"z": 0.6, "w": 0.8}}}
            for parent, child in (("a", "b"), ("/b", "c"), ("x", "d"))
        ]  # fmt: skip
        desk.publish("/tf", message_of({"transforms": moved}, "tf2_msgs/TFMessage", 0.0, "/tf"))
        found.append(["frames that have moved", shift, await desk.hear(0, None, 0.25)])
    await desk.hear(0, {"op": "unsubscribe", "topic": "/tf2_web_republisher/tf_repub_0"})
    asked = api("subscribers", ["/tf"])
    return found + [["nobody listens", seconds, await desk.hear(0, asked, seconds)] for seconds in (0.9, 0.3)]


def test_every_reply_is_what_it_was(monkeypatch):
    monkeypatch.setattr(server, "time", SimpleNamespace(perf_counter=lambda: 0.0))  # no message takes time
    with asyncio.Runner(loop_factory=Skipping) as runner:
        found = runner.run(play())
    rows = [json.dumps(row, ensure_ascii=False) for row in found]
    if os.environ.get(WRITING):
        GOLDEN.write_text("[\n" + ",\n".join(rows) + "\n]\n", encoding="utf-8")
        return
    kept = json.loads(GOLDEN.read_text(encoding="utf-8"))
    for row, expected in zip(rows, kept, strict=True):
        assert json.loads(row) == expected
