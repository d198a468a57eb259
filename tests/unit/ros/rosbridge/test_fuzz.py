"""Thousands of messages that are nearly right."""

import asyncio
import copy
import itertools
import json
import random
import re
import resource

import pytest
from websockets.sync.client import connect

from bridged import Bridged, imu
from rosbridge_client import Skipping, Talk
from vrx_mj.ros.limits import Pace
from vrx_mj.ros.rosbridge import server
from vrx_mj.ros.rosbridge.codec import png
from vrx_mj.ros.rosbridge.server import CLIENT_BURST, CLIENTS_SHARE

THRUST, TWIST, IMU = "/wamv/thrusters/left_thrust_cmd", "/wamv/cmd_vel", "/wamv/sensors/imu/data"


SEEDS = [
    {"op": "advertise", "id": "a", "topic": "/f", "type": "geometry_msgs/PoseStamped", "latch": True, "queue_size": 10},
    {
        "op": "publish",
        "topic": "/f",
        "msg": {"header": {"stamp": {"secs": 1, "nsecs": 2}}, "pose": {"position": {"x": 1.5}}},
    },
    {"op": "publish", "topic": THRUST, "msg": {"data": 0.5}},
    {"op": "publish", "topic": TWIST, "msg": {"linear": {"x": 1.0, "y": None}}},
    {"op": "unadvertise", "topic": "/f"},
    {
        "op": "subscribe",
        "id": "s",
        "topic": "/f",
        "type": "geometry_msgs/PoseStamped",
        "throttle_rate": 10,
        "queue_length": 1,
        "fragment_size": 100,
        "compression": "png",
    },
    {"op": "subscribe", "topic": IMU, "compression": "cbor-raw"},
    {"op": "unsubscribe", "id": "s", "topic": "/f"},
    {"op": "call_service", "id": "c", "service": "/gazebo/delete_model", "args": {"model_name": "wamv"}, "timeout": 1},
    {"op": "call_service", "service": "rosapi/message_details", "args": ["sensor_msgs/Imu"]},
    {"op": "call_service", "service": "/rosapi/set_param", "args": {"name": "/x/y", "value": "[1, {}]"}},
    {"op": "call_service", "service": "/rosapi/get_param", "args": {"name": "/x", "default": "0"}},
    {"op": "advertise_service", "service": "/lights", "type": "std_srvs/Trigger"},
    {"op": "call_service", "service": "/lights", "args": {}, "id": "l"},
    {
        "op": "service_response",
        "service": "/lights",
        "id": "call_service:/lights:3",
        "values": {"success": True},
        "result": True,
    },
    {"op": "unadvertise_service", "service": "/lights"},
    {"op": "fragment", "id": "f", "num": 0, "total": 2, "data": '{"op":"subscribe",'},
    {"op": "png", "data": png(b'{"op":"unadvertise","topic":"/f"}')},
    {"op": "set_level", "level": "info"},
    {"op": "auth", "mac": "", "client": "", "dest": "", "rand": "", "t": 0, "level": "", "end": 0},
]
VALUES = [
    None,
    True,
    -1,
    0,
    1e308,
    float("nan"),
    2**70,
    "",
    "/",
    "x" * 300,
    "\ud800",
    "\0",
    [],
    {},
    [[]],
    {"op": 1},
    "png",
]


def mutants(count):
    """Operations with values swapped, keys lost, and bytes flipped, the same ones every time."""
    chance = random.Random(1789)
    seeds = itertools.cycle(SEEDS)
    for _ in range(count):
        message = json.loads(json.dumps(next(seeds)))
        for _ in range(chance.randrange(3)):
            place = message
            while isinstance(place, dict) and place:
                key = chance.choice(list(place))
                if isinstance(place[key], dict) and place[key] and chance.random() < 0.7:
                    place = place[key]
                    continue
                if chance.random() < 0.2:
                    del place[key]
                else:
                    place[key] = copy.deepcopy(chance.choice(VALUES))
                break
        data = bytearray(json.dumps(message).encode())
        for _ in range(chance.choice([0, 0, 0, 0, 0, 0, 1, 3])):
            data[chance.randrange(len(data))] = chance.randrange(256)
        yield bytes(data[: chance.randrange(len(data))] if chance.random() < 0.05 else data)


def feed(url, messages):
    """Send messages, and wait until all have been looked at."""
    with connect(url, compression=None, max_size=None) as peer:
        for data in messages:
            peer.send(data)
        peer.send(json.dumps({"op": "call_service", "service": "/rosapi/get_time", "id": "the end"}))
        while '"the end"' not in str(peer.recv(20.0)):
            pass


def test_thousands_of_mutated_messages_leave_the_server_as_it_was(monkeypatch, caplog):
    monkeypatch.setattr(server, "CLIENTS_SHARE", 100.0)  # the brake is tested below
    sent = mutants(5200)
    with Bridged() as bridged:
        feed(bridged.url, itertools.islice(sent, 400))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        while part := list(itertools.islice(sent, 400)):
            feed(bridged.url, part)
        bridged.wait(lambda b: b.wires.traffic.clients == 0)
        with Talk(bridged) as talk:
            assert "/f" not in talk.call("/rosapi/topics")["values"]["topics"]
            assert "/lights" not in talk.call("/rosapi/services")["values"]["services"]
            assert talk.call("/wamv/fire")["values"] == {"success": True, "message": "away"}
            talk.say("subscribe", topic=IMU)
            talk.sync()
            bridged.send(IMU, imu(seq=4))
            assert talk.hear()["msg"]["header"]["seq"] == 4
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 100_000  # kB; on a Mac bytes
    ours = [text for text in caplog.messages if re.search(r": [A-Z][A-Za-z]*(Error|Exception): ", text)]
    assert ours == [], "mistakes of the server's, not of its clients"


async def time_taken(own, spent):
    loop = asyncio.get_running_loop()
    begin = loop.time()
    for seconds in spent:
        await asyncio.sleep(own.wait(seconds, loop.time()))
    return loop.time() - begin


def test_a_flood_gets_its_share_of_time_and_a_burst_goes_at_once():
    with asyncio.Runner(loop_factory=Skipping) as runner:
        flooding = set()
        flood, other = (Pace(CLIENTS_SHARE, CLIENT_BURST, flooding) for _ in range(2))
        assert runner.run(time_taken(flood, [0.01] * 19)) == 0.0  # 0.2 s at once
        assert runner.run(time_taken(flood, [0.05] * 6)) == pytest.approx((0.19 + 6 * 0.05 - 0.2) / 0.5)
        assert runner.run(time_taken(flood, [1.0])) == pytest.approx(1.0 / 0.5)
        assert flooding == {flood}
        assert runner.run(time_taken(other, [0.01] * 19)) == 0.0, "who does not flood is not held up"
        assert runner.run(time_taken(other, [1.0])) == pytest.approx((0.19 + 1.0 - 0.2) / 0.25)  # two share it
        flood.end()
        assert flooding == {other}
