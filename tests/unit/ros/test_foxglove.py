"""Foxglove's WebSocket, by a client of its own: what is announced, what is sent, and who does not keep up."""

import asyncio
import json
import signal
import socket
import struct
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
from foxglove import messages as fox
from websockets.asyncio.client import connect

import vrx_mj
from ros_scene import SERVERS
from vrx_mj.errors import NetworkError
from vrx_mj.ros import foxglove
from vrx_mj.ros.foxglove import BACKLOG, Foxglove
from vrx_mj.ros.interface import Inbox
from vrx_mj.ros.messages import decode
from vrx_mj.ros.ros_server import RosServer
from vrx_mj.ros.serve import ServeOptions
from vrx_mj.ros.table.viewers import MARKERS, START

PROTOCOL = "foxglove.sdk.v1"
MESSAGE, TIME = 1, 2
"""Of what the server sends as bytes."""
SOON = 20.0
"""Wall time after which what does not come is missing [s]."""


@pytest.fixture
def wire():
    wire = Foxglove(port=0)
    (line,) = wire.start()
    wire.address = line.removeprefix("Foxglove: ")
    yield wire
    wire.close()


@pytest.fixture
def server(bay, wire):
    server = RosServer(vrx_mj.Simulation(bay), [wire], Inbox(), report=wire.log, truth=True)
    SERVERS.append(server)
    return server


async def received(wire, server, topics, *, then=lambda _socket: None):
    """Channels by topic, and the first message of each of these topics while time goes on."""
    async with connect(wire.address, subprotocols=[PROTOCOL], max_size=None, close_timeout=0.2) as client:
        channels, got, now = {}, {}, 0
        until = time.monotonic() + SOON
        while not (topics <= got.keys() and now) and time.monotonic() < until:
            try:
                content = await asyncio.wait_for(client.recv(), 0.02)
            except TimeoutError:
                await asyncio.to_thread(server.advance, 10)
                continue
            if isinstance(content, bytes) and content[0] == MESSAGE:
                number, moment = struct.unpack_from("<IQ", content, 1)
                got.setdefault(channels[number]["topic"], (moment, content[13:]))
            elif isinstance(content, bytes):
                now = struct.unpack_from("<Q", content, 1)[0] if content[0] == TIME else now
            elif json.loads(content)["op"] == "advertise":
                channels |= {one["id"]: one for one in json.loads(content)["channels"]}
                wanted = [{"id": one, "channelId": one} for one in channels if channels[one]["topic"] in topics]
                await client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            elif json.loads(content)["op"] == "serverInfo":
                info = json.loads(content)
        return info, {one["topic"]: one for one in channels.values()}, got


def test_panels_get_foxgloves_types_and_the_rest_ros_1s(server, wire):
    boats = server.sim.boats
    fixes = next(name for name in server.table.outputs if name.endswith("/fix"))
    topics = {MARKERS, "/tf", "/tf_static", "/gazebo/model_states", f"/{boats[0]}/robot_description", fixes}
    server.announce()
    info, channels, got = asyncio.run(received(wire, server, topics))
    assert info["capabilities"] == ["time"]  # nothing is taken from clients
    assert channels.keys() == {name for name, one in server.table.outputs.items() if one.type != "sensor_msgs/Image"}
    assert {name: channels[name]["schemaName"] for name in topics} == {
        MARKERS: "foxglove.SceneUpdate",
        "/tf": "foxglove.FrameTransforms",
        "/tf_static": "foxglove.FrameTransforms",
        "/gazebo/model_states": "foxglove.PosesInFrame",
        f"/{boats[0]}/robot_description": "std_msgs/String",
        fixes: "foxglove.LocationFix",
    }
    _, text = got[f"/{boats[0]}/robot_description"]
    assert "data:model/gltf-binary" in decode(text, "std_msgs/String").data
    for name in (START, "shore", "objects"):
        assert name.encode() in got[MARKERS][1]
    assert all(f"{boat}/base_link".encode() in got["/tf"][1] for boat in boats)
    assert server.scenery.start.any()
    assert wire.traffic.sent > sum(len(content) for _, content in got.values())


class Open:
    """Foxglove's types with fields that can be read."""

    SceneEntityDeletionType = fox.SceneEntityDeletionType

    def __getattr__(self, name):
        return lambda **given: SimpleNamespace(kind=name, **given)


def test_a_scene_has_the_shapes_places_and_colours_of_the_markers(server, monkeypatch):
    monkeypatch.setattr(foxglove, "fox", Open())
    markers = server.table.outputs[MARKERS].make()
    scene = foxglove._scene(markers, 0.0)
    for number, kind in {1: "cubes", 2: "spheres", 3: "cylinders", 11: "triangles"}.items():
        made = [(one.id, shape) for one in scene.entities for shape in getattr(one, kind, ())]
        there = [one for own in scene.entities for one in markers.markers if (one.ns, one.type) == (own.id, number)]
        assert len(made) == len(there)
        for (space, shape), marker in zip(made, there, strict=True):
            assert space == marker.ns
            at, own, color = shape.pose.position, marker.pose.position, shape.color
            assert (at.x, at.y, at.z) == (own.x, own.y, own.z)
            assert [getattr(color, key) for key in "rgba"] == [getattr(marker.color, key) for key in "rgba"]
            assert len(getattr(shape, "points", marker.points)) == len(marker.points)
    assert {one.frame_id for one in scene.entities} == {START}


def test_only_what_somebody_listens_to_is_wanted(server, wire):
    assert wire.subscribed_topics == frozenset()
    asyncio.run(received(wire, server, {"/tf"}))
    deadline = time.monotonic() + SOON
    while wire.subscribed_topics and time.monotonic() < deadline:
        time.sleep(0.01)
    assert wire.subscribed_topics == frozenset()
    assert wire.traffic.clients == 0


@pytest.mark.slow
def test_a_client_that_does_not_read_holds_nothing_up(server, wire):
    async def silent():
        async with connect(
            wire.address, subprotocols=[PROTOCOL], max_size=None, close_timeout=0.2, max_queue=1
        ) as client:
            topics = [json.loads(await client.recv()) for _ in range(2)][1]["channels"]
            wanted = [
                {"id": one["id"], "channelId": one["id"]} for one in topics if one["topic"] == "/gazebo/link_states"
            ]
            await client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            while not wire.subscribed_topics:
                await asyncio.sleep(0.01)
            for _ in range(10):
                await asyncio.to_thread(server.advance, BACKLOG)
        return server.sim.time

    assert asyncio.run(asyncio.wait_for(silent(), 60)) > 0.0
    assert wire.traffic.sent > 0


def test_a_port_that_is_taken_is_named(wire):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(NetworkError, match=rf"cannot serve Foxglove on 127\.0\.0\.1:{port}: .*in use"):
            Foxglove(port=port).start()


def test_a_boat_that_leaves_takes_its_topics_along(server, wire):
    server.remove(server.sim.boats[0])
    _, channels, _ = asyncio.run(received(wire, server, {"/clock"}))
    assert channels.keys() == {name for name, one in server.table.outputs.items() if one.type != "sensor_msgs/Image"}


def test_a_viewer_alone_gets_the_true_poses_and_beside_ros_only_on_demand():
    assert not ServeOptions(foxglove=8765).for_ros
    assert ServeOptions(foxglove=8765, rosbridge=9090).for_ros


@pytest.mark.slow
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_serve_ends_on_a_signal(ending, tmp_path):
    command = [sys.executable, "-m", "vrx_mj", "serve", "ocean", "--foxglove", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8", cwd=tmp_path)
    seen = ""
    while "Foxglove: ws://127.0.0.1:" not in seen:
        line = process.stderr.readline()
        assert line, seen
        seen += line
    process.send_signal(ending)
    _, rest = process.communicate(timeout=60)
    assert process.returncode == 0, seen + rest
    assert "served " in rest
