"""Peers that send slowly, take slowly, or say nothing: others are answered meanwhile, those of the same host too.

Each test has an open loop of peers that come as fast as they can and do not wait for each other, and beside it a
program that must be answered within `SECONDS`, again and again, while they go on.
"""

import contextlib
import json
import random
import socket
import struct
import threading
import time
from xmlrpc.client import ServerProxy, Transport, dumps

import pytest
from websockets.sync.client import connect

from bridged import Bridged
from ros1_peer import ME, dial, frame, frame_of, service_of, stream_of, taken
from ros1_served import Served, free_port, small_table, until
from rosbridge_client import Talk
from vrx_mj.ros.ros1.connection import encode_header

pytestmark = pytest.mark.slow

SECONDS = 15.0
ROUNDS = 10
HEAD = b"POST /R HTTP/1.1\r\nContent-Length: %d\r\n\r\n"
ANNOUNCED = HEAD % (1 << 24)
"""46 bytes."""
BIG = 4 << 20


class Crowd:
    """Threads that open connections, say something on each and keep so many, the oldest closed first."""

    def __init__(self, place, *says, kept=200, pause=0.002):
        self._place, self._says, self._kept, self._pause = place, says, kept, pause
        self._over = threading.Event()
        self._threads = [threading.Thread(target=self._run, args=(number,)) for number in range(2)]
        self.count = 0

    def __enter__(self):
        for thread in self._threads:
            thread.start()
        until(lambda: self.count >= self._kept // 2, "the crowd is there", 60.0)
        return self

    def __exit__(self, *_):
        self._over.set()
        for thread in self._threads:
            thread.join()

    def _run(self, number):
        chance, peers = random.Random(number), []
        while not self._over.wait(self._pause):
            with contextlib.suppress(OSError):
                peers.append(socket.create_connection(self._place, timeout=0.5))
                self.count += 1
                peers[-1].sendall(chance.choice(self._says))
            while len(peers) > self._kept // 2:
                peers.pop(0).close()
        for peer in peers:
            peer.close()


class Patient(Transport):
    """An HTTP connection of `ServerProxy` on which nothing may take longer than that."""

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = SECONDS
        return connection


def answered(uri):
    """A program that keeps its connection, and others that come anew, are answered."""
    with ServerProxy(uri, transport=Patient()) as kept:
        for _ in range(ROUNDS):
            assert kept.getPid(ME)[0] == 1
            with ServerProxy(uri, transport=Patient()) as fresh:
                assert fresh.hasParam(ME, "/robot_description")[2] is True


@pytest.fixture
def served():
    with Served(free_port(), small_table("wamv")) as one:
        yield one


def place_of(uri):
    host, _, port = uri.removeprefix("http://").rstrip("/").partition(":")
    return host, int(port)


def apis(served):
    with ServerProxy(served.uri) as master:
        return served.uri, master.lookupNode(ME, "/gazebo")[2]


def test_bodies_that_are_announced_and_do_not_come_keep_nobody_out(served):
    uri, node = apis(served)
    assert len(ANNOUNCED) == 46
    with Crowd(place_of(uri), ANNOUNCED), Crowd(place_of(node), ANNOUNCED):
        answered(uri)
        with ServerProxy(node, transport=Patient()) as one:
            for _ in range(ROUNDS):
                assert one.getPid(ME)[0] == 1


def test_bodies_that_come_but_for_their_end_hold_no_more_than_there_may_be(served, monkeypatch):
    monkeypatch.setattr(served.ros._access.server.intake, "most", 4 * BIG)
    body = b"x" * (BIG - 1)
    with Crowd(place_of(served.uri), HEAD % BIG + body, HEAD % BIG + body[: BIG // 2], kept=40, pause=0.01):
        answered(served.uri)
        assert served.ros._access.server.intake.used <= 4 * BIG


def test_connections_that_say_nothing_or_half_a_head_make_room(served, monkeypatch):
    monkeypatch.setattr(served.ros._connection_limit, "most", 512)
    stream = stream_of(served.uri, "/course")
    says = (b"", b"P", ANNOUNCED[:30], ANNOUNCED)
    half = encode_header({"callerid": ME, "topic": "/course", "md5sum": "*"})[:-3]
    with Crowd(place_of(served.uri), *says, kept=800), Crowd(stream, b"", b"\x10\0", half, kept=800):
        answered(served.uri)
        for _ in range(ROUNDS):
            connection, _ = dial(stream, topic="/course")
            with connection:
                assert frame_of(connection) == frame(b"gate 3")
        assert served.ros._connection_limit.inside.total() <= 512


def test_answers_that_are_not_taken_hold_no_more_than_there_may_be(served, monkeypatch):
    monkeypatch.setattr(served.ros._access.server.intake, "most", 16 * BIG)
    with ServerProxy(served.uri) as master:
        master.setParam(ME, "/large", "x" * BIG)
    call = dumps((ME, "/large"), "getParam").encode()
    with Crowd(place_of(served.uri), HEAD % len(call) + call, kept=40, pause=0.02):
        answered(served.uri)
        assert served.ros._access.server.intake.used <= 16 * BIG


def test_many_large_calls_do_not_hold_up_small_ones(served):
    call = dumps((ME, "/large", ["x" * 10] * 20_000), "setParam").encode()
    with Crowd(place_of(served.uri), HEAD % len(call) + call, kept=40, pause=0.01):
        answered(served.uri)


def test_many_calls_do_not_hold_up_others(served):
    call = dumps((ME,), "getSystemState").encode()
    with Crowd(place_of(served.uri), HEAD % len(call) + call, kept=40, pause=0.01):
        answered(served.uri)


def test_requests_that_come_but_for_their_end_keep_no_service_from_others(served, monkeypatch):
    monkeypatch.setattr(served.ros._node.tcpros_listener.intake, "most", 4 * BIG)
    place = service_of(served.uri, "/trigger")
    header = encode_header({"callerid": ME, "service": "/trigger", "md5sum": "*", "persistent": "1"})
    halves = [header + struct.pack("<I", BIG) + b"x" * (BIG - 1), header + struct.pack("<I", 1 << 24)]
    with Crowd(place, *halves, kept=40, pause=0.01):
        for _ in range(ROUNDS):
            connection, _ = dial(place, service="/trigger")
            with connection:
                connection.settimeout(SECONDS)
                connection.sendall(frame(b""))
                assert taken(connection, 1) == b"\x01"
        assert served.ros._node.tcpros_listener.intake.used <= 4 * BIG


def test_a_request_that_does_not_go_on_ends_its_connection(served, monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.ros1.connection.STALL_TIMEOUT", 0.2)
    connection, _ = dial(service_of(served.uri, "/trigger"), service="/trigger", persistent="1")
    with connection:
        connection.sendall(frame(b""))
        assert taken(connection, 12)[0] == 1
        time.sleep(0.5)  # between requests it may wait as long as it likes
        connection.sendall(frame(b""))
        assert taken(connection, 12)[0] == 1
        connection.sendall(b"\x09\0\0\0x")
        assert connection.recv(1) == b""


@pytest.mark.parametrize("data", [b"P", ANNOUNCED, ANNOUNCED + b"x" * 1000])
def test_a_request_that_does_not_go_on_is_not_waited_for(served, monkeypatch, data):
    monkeypatch.setattr("vrx_mj.ros.ros1.connection.STALL_TIMEOUT", 0.2)
    with socket.create_connection(place_of(served.uri), timeout=SECONDS) as peer:
        peer.sendall(data)
        with contextlib.suppress(ConnectionResetError):
            assert peer.recv(1) == b""


def test_nodes_that_take_no_calls_keep_no_news_from_others(served, monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.ros1.master.MOST_NODES", 16)
    with contextlib.ExitStack() as stack:
        deaf = [stack.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(64)]
        master = stack.enter_context(ServerProxy(served.uri))
        for number, one in enumerate(deaf):
            api = f"http://127.0.0.1:{one.getsockname()[1]}/"
            master.registerSubscriber(f"/deaf{number}", "/x", "std_msgs/Int8", api)
        listening = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        listening.settimeout(SECONDS)
        master.registerSubscriber(ME, "/y", "std_msgs/Int8", f"http://127.0.0.1:{listening.getsockname()[1]}/")
        for round_ in range(3):
            master.registerPublisher(f"/p{round_}", "/x", "std_msgs/Int8", "http://127.0.0.1:1/")
            master.registerPublisher(f"/p{round_}", "/y", "std_msgs/Int8", "http://127.0.0.1:1/")
            with listening.accept()[0] as call:
                call.settimeout(SECONDS)
                assert b"publisherUpdate" in taken(call, 300)


def test_clients_of_rosbridge_that_do_not_go_on_keep_nobody_out():
    with Bridged() as bridged:
        place = ("127.0.0.1", bridged.bridge.port)
        key = b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        whole = b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n" + key
        with Crowd(place, b"", whole[:60], whole):
            for _ in range(ROUNDS):
                with Talk(bridged) as talk:
                    assert talk.sync() == []


def test_fragments_of_rosbridge_without_an_end_hold_no_more_than_there_may_be(monkeypatch):
    with Bridged() as bridged, contextlib.ExitStack() as stack:
        monkeypatch.setattr(bridged.bridge._hub.fragments, "most", BIG)
        for number in range(8):
            client = stack.enter_context(connect(bridged.url))
            piece = {"op": "fragment", "id": "a", "num": 0, "total": 2, "data": "x" * (BIG // 4)}
            client.send(json.dumps(piece | {"id": str(number)}))
        with Talk(bridged) as talk:
            talk.say("fragment", id="b", num=1, total=2, data='_service", "service": "/rosapi/get_time", "id": "time"}')
            talk.say("fragment", id="b", num=0, total=2, data='{"op": "call')
            assert talk.hear()["op"] == "service_response"
            assert bridged.bridge._hub.fragments.used <= BIG
