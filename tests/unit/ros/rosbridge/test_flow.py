"""How much goes to whom: throttles, queues, clients that do not keep up, and the end."""

import asyncio
import contextlib
import functools
import itertools
import json
import re
import socket
import time
import tracemalloc
import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from bridged import Bridged, image, imu
from rosbridge_client import Skipping, Talk
from vrx_mj.ros import messages
from vrx_mj.ros.interface import Delivery, Output, RosInterface
from vrx_mj.ros.limits import MOST_BYTES_OF_ALL, Counts, Intake, Place
from vrx_mj.ros.rosbridge import codec
from vrx_mj.ros.rosbridge.codec import Options, Parcel
from vrx_mj.ros.rosbridge.server import PIECE, Client
from vrx_mj.ros.rosbridge.topics import Subscription

CLIENTS = 64
IMU, CAMERA, INFO = "/wamv/sensors/imu/data", "/wamv/sensors/camera/image_raw", "/vrx/task/info"


@pytest.fixture
def bridged():
    with Bridged() as made:
        yield made


class Taken:
    """What a subscription sends, and when [s]."""

    def __init__(self):
        self.sent = []

    def push(self, written, size, source, most):
        make, _ = written
        number = int(b"".join(*make()).split(b'"data":')[1].rstrip(b"}"))
        self.sent.append((number, round(asyncio.get_running_loop().time(), 6)))

    def forget(self, source):
        pass


async def taken(wishes, times):
    outbox = Taken()
    subscription = Subscription("/n", outbox)
    for number, wish in enumerate(wishes):
        subscription.add(str(number), wish)
    for number, moment in enumerate(times):
        await asyncio.sleep(moment - asyncio.get_running_loop().time())
        subscription.take(Parcel(messages.new("std_msgs/Int32", data=number), "std_msgs/Int32", 0.0))
    await asyncio.sleep(10.0)
    subscription.end()
    return outbox.sent


AT_ONCE = [0.0] * 5
TEN_HERTZ = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]


@pytest.mark.parametrize(
    ("wishes", "times", "sent"),
    [
        ([Options()], AT_ONCE, [(0, 0.0), (1, 0.0), (2, 0.0), (3, 0.0), (4, 0.0)]),
        ([Options(throttle=0.25)], AT_ONCE, [(0, 0.0)]),
        ([Options(throttle=0.25)], TEN_HERTZ, [(0, 0.0), (3, 0.3)]),
        ([Options(throttle=0.25), Options(throttle=0.15)], TEN_HERTZ, [(0, 0.0), (2, 0.2), (4, 0.4)]),
        ([Options(throttle=0.5, queue=2)], AT_ONCE, [(0, 0.0), (3, 0.5), (4, 1.0)]),
        ([Options(throttle=0.5, queue=9)], AT_ONCE, [(0, 0.0), (1, 0.5), (2, 1.0), (3, 1.5), (4, 2.0)]),
        ([Options(throttle=0.25, queue=1)], TEN_HERTZ, [(0, 0.0), (2, 0.25), (4, 0.5), (5, 0.75)]),
        ([Options(throttle=0.5, queue=9), Options(throttle=0.25)], AT_ONCE, [(0, 0.0)]),
    ],
)
def test_a_throttle_lets_through_what_rosbridge_server_does(wishes, times, sent):
    with asyncio.Runner(loop_factory=Skipping) as runner:
        assert runner.run(taken(wishes, times)) == sent


def test_a_throttle_is_kept_in_wall_time(bridged):
    with Talk(bridged) as talk:
        talk.say("subscribe", topic=IMU, throttle_rate=60, queue_length=2)
        talk.sync()
        begin = time.monotonic()
        for seq in range(3):
            bridged.send(IMU, imu(seq=seq))
        assert [talk.hear()["msg"]["header"]["seq"] for _ in range(3)] == [0, 1, 2]
        assert time.monotonic() - begin >= 0.12


def test_a_message_is_written_once_for_all_clients(bridged, monkeypatch):
    written = []
    monkeypatch.setattr(codec, "plain", lambda *given, write=codec.plain: written.append(given) or write(*given))
    with Talk(bridged) as one, Talk(bridged) as two, Talk(bridged) as three:
        for talk, compression in ((one, "none"), (two, "none"), (three, "cbor")):
            talk.say("subscribe", topic=IMU, compression=compression)
            talk.sync()
        bridged.send(IMU, imu())
        assert one.hear() == two.hear()
        three.hear()
    assert len(written) == 1


class Peer:
    """A connection that takes what it is sent, or waits."""

    remote_address = "127.0.0.1", 1

    def __init__(self):
        self.sent = []

    async def send(self, frame, text):
        await asyncio.sleep(0)
        self.sent.append(frame)


def client(counts, peer=None):
    """A client of a hub that only counts."""
    hub = SimpleNamespace(counts=counts, numbers=itertools.count(1), flooding=set(), fragments=Intake(1))
    return Client(peer or Peer(), Place("127.0.0.1", list), hub)


def put(client, source, frames, most=0):
    client._messages.push((lambda: [(frame,) for frame in frames], False), sum(map(len, frames)), source, most)


def queued(client):
    """What would be sent, in order."""

    async def run():
        task = asyncio.create_task(client._write())
        await asyncio.sleep(0.05)
        task.cancel()

    asyncio.run(run())
    return client._connection.sent


def test_a_full_queue_loses_the_oldest_and_counts_them(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.rosbridge.server.MOST_MESSAGES", 3)
    monkeypatch.setattr("vrx_mj.ros.limits.MOST_BYTES", 10)
    counts = Counts()
    one = client(counts)
    for number in range(5):
        put(one, "a", [b"%d" % number])
    one.send("first")
    assert counts.dropped == 2
    put(one, "a", [b"123456", b"78"])  # ten bytes: 3, 4 and it
    assert counts.dropped == 3
    put(one, "a", [b"12345678901"])  # more than there is room for, alone
    assert counts.dropped == 6
    assert queued(one) == [b'"first"', b"12345678901"]
    assert counts.sent == 18
    assert counts.waiting == 0


def test_all_queues_together_are_bounded(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.limits.MOST_BYTES_OF_ALL", 10)
    counts = Counts()
    one, two = client(counts), client(counts)
    for number in range(8):
        put(one, "a", [b"%d" % number])
    for number in range(4):
        put(two, "a", [b"%d" % number])
    assert (counts.waiting, counts.dropped) == (10, 2)
    assert queued(two) == [b"2", b"3"]
    one._messages.forget("a")
    assert counts.waiting == 0


def test_a_queue_length_bounds_what_waits_of_one_topic():
    counts = Counts()
    one = client(counts)
    for number in range(4):
        put(one, "a", [b"a%d" % number], 2)
        put(one, "b", [b"b%d" % number])
    one._messages.forget("c")
    assert queued(one) == [b"b0", b"b1", b"a2", b"b2", b"a3", b"b3"]
    assert counts.dropped == 2


def test_a_client_that_does_not_read_loses_messages_and_others_do_not(bridged):
    pixels = np.zeros(3_000_000, np.uint8)
    lazy = connect(bridged.url, max_queue=1, compression=None, max_size=None, close_timeout=0.1)
    with lazy as unread, Talk(bridged) as talk:
        unread.send(json.dumps({"op": "subscribe", "topic": CAMERA, "compression": "cbor"}))
        talk.say("subscribe", topic=IMU)
        talk.sync()
        bridged.wait(lambda b: b.wires.subscribed_topics == {CAMERA, IMU})
        for seq in range(40):  # 120 MB: the server keeps 16 MiB, the sockets and the client's queue some more
            bridged.send(CAMERA, image(pixels, 1000))
            bridged.send(IMU, imu(seq=seq))
            assert talk.hear()["msg"]["header"]["seq"] == seq
        traffic = bridged.wires.traffic
        assert traffic.clients == 2
        assert 20 <= traffic.dropped < 40
        bridged.bridge.close()
        with pytest.raises(ConnectionRefusedError):
            connect(bridged.url)


HELLO = (
    b"GET / HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


def framed(message):
    """A frame of a client, masked with nothing."""
    text = json.dumps(message, separators=(",", ":")).encode()
    return bytes([0x81, 0x80 | len(text), 0, 0, 0, 0]) + text


@pytest.mark.slow
def test_clients_that_do_not_read_hold_a_piece_each(bridged):
    pixels = np.zeros(1_000_000 // 12 * 12, np.uint8)
    with contextlib.ExitStack() as stack:
        for number in range(CLIENTS):
            reader = stack.enter_context(socket.socket())
            reader.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            reader.connect(("127.0.0.1", bridged.bridge.port))
            wish = {"topic": CAMERA, "fragment_size": (0, 200_000 + number)[number % 2]}
            reader.sendall(HELLO + framed({"op": "subscribe", **wish}))
        subscribers = lambda b: len(b.graph.registrations.holders("subscriber", CAMERA))  # noqa: E731
        bridged.wait(lambda b: subscribers(b) == CLIENTS, 30.0)
        for _ in range(40):
            bridged.send(CAMERA, image(pixels, 4))
            bridged.network.call(asyncio.sleep(0.0), 30.0)
        bridged.wait(lambda b: b.bridge.traffic.dropped > 0, 30.0)
        clients = list(bridged.bridge._hub.clients.values())
        held = [client._connection.transport.get_write_buffer_size() for client in clients]
        assert len(held) == CLIENTS
        assert 0 < max(held) < 2 * PIECE
        assert bridged.bridge._hub.counts.waiting <= MOST_BYTES_OF_ALL
    bridged.wait(lambda b: subscribers(b) == 0, 30.0)
    assert bridged.bridge._hub.counts.waiting == 0


def test_clients_with_wishes_of_their_own_share_what_a_message_is_written_as():
    parcel = Parcel(image(np.zeros(1_200_000, np.uint8)), "sensor_msgs/Image", 0.0)
    tracemalloc.start()
    begun = [iter(parcel.frames(f"t{number}", Options(fragment_size=50_000 + number))) for number in range(CLIENTS)]
    sizes = [len(next(frames)[0]) + len(next(frames)[0]) for frames in begun]
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert min(sizes) > 50_000
    assert held < 1_600_000 + CLIENTS * 4 * 50_000  # in JSON, and what each is about to send


def test_of_what_is_being_sent_the_message_is_not_kept():
    kept, seen = [], []

    class Slow(Peer):
        async def send(self, frame, text):
            seen.append(kept[0]())
            await asyncio.sleep(10.0)

    async def run():
        one = client(Counts(), Slow())
        parcel = Parcel(imu(), "sensor_msgs/Imu", 0.0)
        kept.append(weakref.ref(parcel))
        one._messages.push((functools.partial(parcel.frames, "a", Options()), False), 1)
        del parcel
        task = asyncio.create_task(one._write())
        await asyncio.sleep(0.01)
        task.cancel()

    asyncio.run(run())
    assert seen == [None]


def test_a_client_that_reads_no_answers_is_disconnected(bridged, monkeypatch, caplog):
    monkeypatch.setattr("vrx_mj.ros.rosbridge.server.MOST_ANSWERS", 50)
    with socket.create_connection(("127.0.0.1", bridged.bridge.port)) as peer:
        peer.sendall(HELLO)
        peer.recv(1000)
        frame = framed({"op": "call_service", "service": "/rosapi/topics_and_raw_types"})
        peer.settimeout(5.0)
        with pytest.raises(OSError, match=r"reset|[Pp]ipe"):
            peer.sendall(frame * 100_000)
    bridged.wait(lambda b: b.wires.traffic.clients == 0)
    (told,) = caplog.messages
    assert re.fullmatch(
        r"rosbridge: 127\.0\.0\.1: 127\.0\.0\.1:\d+ did not read its replies, and was disconnected", told
    )


def test_a_table_takes_the_place_of_the_one_before(bridged):
    with Talk(bridged) as talk:
        talk.say("subscribe", topic=IMU)
        talk.say("subscribe", topic="/wamv2/info", type="std_msgs/String")
        talk.sync()
        assert bridged.wires.subscribed_topics == {IMU}
        added = Output("/wamv2/info", "std_msgs/String", lambda: None, latched=True)
        bridged.wires.offer(RosInterface({added.name: added}))
        bridged.wires.publish([Delivery(added, messages.new("std_msgs/String", data="new"), 3.0)])
        assert talk.hear()["msg"] == {"data": "new"}
        assert bridged.wires.subscribed_topics == {"/wamv2/info"}
        assert talk.call("/rosapi/services_for_type", ["std_srvs/Trigger"])["values"] == {"services": []}
        assert talk.call("/wamv/fire")["result"] is False
        assert talk.call("/rosapi/get_param_names")["values"] == {"names": []}
        assert talk.call("/rosapi/get_time")["values"] == {"time": {"secs": 3, "nsecs": 0}}


def test_a_latched_message_of_a_new_table_is_kept_though_others_wait(bridged):
    before, added = bridged.table.outputs[INFO], Output("/new", "std_msgs/String", lambda: None, latched=True)
    bridged.network.soon(time.sleep, 0.1)  # so that all three wait for the loop
    bridged.wires.publish([Delivery(before, messages.new("std_msgs/String", data="old"), 1.0)])
    bridged.wires.offer(RosInterface({added.name: added}))
    bridged.wires.publish([Delivery(added, messages.new("std_msgs/String", data="new"), 1.0)])
    with Talk(bridged) as talk:
        talk.say("subscribe", topic="/new")
        assert talk.hear()["msg"] == {"data": "new"}
        talk.say("subscribe", topic=INFO, type="std_msgs/String")
        assert talk.sync() == []


def test_messages_wait_within_bounds_for_a_loop_that_is_busy(bridged):
    with Talk(bridged) as talk:
        talk.say("subscribe", topic=IMU)
        talk.say("subscribe", topic="/wind/speed")
        talk.sync()
        bridged.network.soon(time.sleep, 0.2)
        for seq in range(100):
            bridged.send(IMU, imu(seq=seq))
        bridged.send("/wind/speed", messages.new("std_msgs/Float64", data=1.0))
        assert [talk.hear()["msg"]["header"]["seq"] for _ in range(64)] == list(range(36, 100))
        assert talk.hear()["msg"] == {"data": 1.0}
        assert bridged.wires.traffic.dropped == 36


def test_a_message_of_the_wrong_type_harms_no_other(bridged, caplog):
    with Talk(bridged) as talk:
        talk.say("subscribe", topic=IMU)
        talk.sync()
        bridged.send(IMU, messages.new("std_msgs/Float32"))
        bridged.send(IMU, imu(seq=2))
        assert talk.hear()["msg"]["header"]["seq"] == 2
        talk.say("subscribe", topic="/wind/speed", compression="cbor-raw")
        talk.sync()
        bridged.send("/wind/speed", messages.new("std_msgs/Float64", data="x"))
        bridged.send(IMU, imu(seq=3))
        assert talk.hear()["msg"]["header"]["seq"] == 3
    assert "a message cannot be written: error: required argument is not a float" in caplog.text
    assert "/wamv/sensors/imu/data: a message is not a sensor_msgs/Imu: AttributeError" in caplog.text


def test_the_end_disconnects_everybody_and_frees_the_port():
    with Bridged() as bridged, Talk(bridged) as talk:
        talk.sync()
        port = bridged.bridge.port
        bridged.bridge.close()
        with pytest.raises(ConnectionClosed):
            talk.hear()
        bridged.bridge.close()
        bridged.send(IMU, imu())
        bridged.network.close()
        bridged.bridge.close()
    with Bridged(port=port) as bridged:
        assert bridged.lines == [f"rosbridge: ws://127.0.0.1:{port}"]


def test_the_traffic_counts_what_was_sent(bridged):
    with Talk(bridged) as talk:
        talk.say("subscribe", topic="/wind/speed")
        talk.say("call_service", service="/rosapi/get_time")
        sent = len(talk.socket.recv(5.0))
        bridged.send("/wind/speed", messages.new("std_msgs/Float64", data=1.0))
        sent += len(talk.socket.recv(5.0))
        bridged.wait(lambda b: b.wires.traffic.sent >= sent)
        assert bridged.wires.traffic == (1, sent, 0)
