"""TCPROS byte by byte: what peers are told, slow ones, broken ones, and those who send too much."""

import socket
import struct
import threading
from contextlib import contextmanager
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from ros1_peer import ME, dial, frame, frame_of, service_of, stream_of, taken
from ros1_served import LEFT, Served, free_port, small_table, until
from vrx_mj.ros.interface import Delivery
from vrx_mj.ros.limits import MOST_BYTES
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros1.connection import decode_header, encode_header
from work import calls_at_most

STRING = "992ce8a1687cec8c8bd883ec73ca41d1"  # std_msgs/String, as Debian's genpy has it
FLOAT32 = "73fcbf46b49191e672908e50842a83d4"
TRIGGER = "937c9679a518e3a18d831e57125ea522"
OURS = f"[std_msgs/String/{STRING}]. Dropping connection."
EMPTY = "d41d8cd98f00b204e9800998ecf8427e"


@pytest.fixture(scope="module")
def served():
    with Served(free_port(), small_table("wamv")) as one:
        yield one


@pytest.fixture
def stream(served):
    return stream_of(served.uri, "/course")


def test_a_subscriber_gets_the_header_and_the_latched_message(stream):
    connection, header = dial(stream, topic="/course", type="std_msgs/String", md5sum=STRING, tcp_nodelay="1")
    with connection:
        assert header == {
            "callerid": "/gazebo",
            "latching": "1",
            "md5sum": STRING,
            "message_definition": "string data\n",
            "topic": "/course",
            "type": "std_msgs/String",
        }
        assert frame_of(connection) == frame(b"gate 3")


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"topic": "/none"}, "[/gazebo] is not a publisher of [/none]"),
        (
            {"topic": "/course", "type": "std_msgs/Int8"},
            "topic types do not match: [std_msgs/Int8] vs. [std_msgs/String]",
        ),
        (
            {"topic": "/course", "md5sum": "bad"},
            f"Client [/peer] wants topic [/course] to have datatype/md5sum [*/bad], but our version has {OURS}",
        ),
        ({"service": "/none"}, "[/gazebo] is not a provider of [/none]"),
        (
            {"service": "/trigger", "md5sum": "bad"},
            f"request from [/peer]: md5sums do not match: [bad] vs. [{TRIGGER}]",
        ),
    ],
)
def test_who_asks_for_what_there_is_not_is_told(stream, fields, error):
    connection, header = dial(stream, **fields)
    with connection:
        assert header == {"error": error}
        assert connection.recv(1) == b""


def test_a_header_without_a_name_is_refused(stream):
    with socket.create_connection(stream, timeout=5.0) as connection:
        connection.sendall(encode_header({"topic": "/course", "md5sum": "*"}))
        assert decode_header(frame_of(connection)) == {"error": "Missing required 'callerid' field"}


def test_a_service_is_called_again_and_again_on_one_connection(served):
    connection, header = dial(service_of(served.uri, "/trigger"), service="/trigger", md5sum=TRIGGER, persistent="1")
    with connection:
        assert header == {
            "callerid": "/gazebo",
            "md5sum": TRIGGER,
            "request_type": "std_srvs/TriggerRequest",
            "response_type": "std_srvs/TriggerResponse",
            "service": "/trigger",
            "type": "std_srvs/Trigger",
        }
        connection.sendall(frame(b"") * 3)  # three at once: answered one after the other
        answer = b"\x01" + frame(b"\x01" + frame(b"ok"))
        assert taken(connection, 3 * len(answer)) == 3 * answer
        connection.sendall(frame(b"what is this"))
        assert taken(connection, 1) == b"\x00"
        assert frame_of(connection).startswith(b"12 bytes are not a std_srvs/TriggerRequest: ")
        connection.sendall(frame(b""))
        assert taken(connection, len(answer)) == answer


def test_a_service_called_once_or_probed_ends_the_connection(served):
    place = service_of(served.uri, "/failing")
    connection, _ = dial(place, service="/failing")
    with connection:
        connection.sendall(frame(b""))
        assert taken(connection, 1) == b"\x00"
        assert frame_of(connection) == b"no boat is named wamv9"
        assert connection.recv(1) == b""
    connection, header = dial(place, service="/failing", probe="1")
    with connection:
        assert header["type"] == "std_srvs/Trigger"
        assert connection.recv(1) == b""


def test_too_large_a_request_is_not_waited_for(served):
    connection, _ = dial(service_of(served.uri, "/trigger"), service="/trigger", persistent="1")
    with connection:
        connection.sendall(struct.pack("<I", 0xFFFFFFFF))
        assert connection.recv(1) == b""


def test_who_connects_and_says_nothing_is_put_out(monkeypatch, stream):
    monkeypatch.setattr("vrx_mj.ros.ros1.node.HEADER_TIMEOUT", 0.1)
    with socket.create_connection(stream, timeout=5.0) as silent:
        silent.sendall(b"\x40\x00\x00\x00half")
        assert silent.recv(1) == b""


def test_a_subscriber_that_does_not_read_costs_neither_time_nor_memory():
    count, size = 400, 200_000
    with Served(free_port(), small_table("wamv")) as served:
        place = stream_of(served.uri, "/course")
        slow, _ = dial(place, topic="/course")
        fast, _ = dial(place, topic="/course")
        with slow, fast:
            assert frame_of(fast) == frame(b"gate 3")
            for number in range(count):
                text = f"{number:06d}" + "x" * size
                with calls_at_most(100):
                    message = new("std_msgs/String", data=text)
                    served.wires.publish([Delivery(served.table.outputs["/course"], message, 0.0)])
                assert frame_of(fast)[4:10] == b"%06d" % number  # it gets every one, in order
            readers = {reader._outbox.dropped: reader for reader in served.ros._node.publications["/course"].readers}
            kept = readers[max(readers)]._outbox.bytes
            assert max(readers) == served.wires.traffic.dropped > count / 2
            assert min(readers) == 0
            assert kept <= MOST_BYTES
            last = b""
            while last != b"%06d" % (count - 1):
                last = frame_of(slow)[4:10]


class Publisher:
    """A node that publishes on a topic: its slave API, and a port where it sends."""

    def __init__(self, topic=LEFT, kind="std_msgs/Float32"):
        self.topic, self.kind = topic, kind
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.socket.settimeout(10.0)
        self.api = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        place = self.socket.getsockname()
        self.api.register_function(lambda *_: [1, "", ["TCPROS", *place]], "requestTopic")
        self.api.register_function(lambda *_: [1, "", 4711], "getPid")
        self.uri = f"http://127.0.0.1:{self.api.server_address[1]}/"
        self._thread = threading.Thread(target=self.api.serve_forever, args=(0.01,))

    @contextmanager
    def registered(self, master_uri):
        self._thread.start()
        try:
            with ServerProxy(master_uri) as master:
                master.registerPublisher(ME, self.topic, self.kind, self.uri)
                yield self
                master.unregisterPublisher(ME, self.topic, self.uri)
        finally:
            self.api.shutdown()
            self._thread.join()
            self.api.server_close()
            self.socket.close()

    def accept(self, **fields):
        """The simulation's connection, and the header that it sent."""
        connection, _ = self.socket.accept()
        connection.settimeout(10.0)
        header = decode_header(frame_of(connection))
        connection.sendall(encode_header({"callerid": ME, "md5sum": FLOAT32, "type": self.kind} | fields))
        return connection, header


def float32(value):
    return frame(struct.pack("<f", value))


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.ros1.tcpros.FIRST_PAUSE", 0.01)
    monkeypatch.setattr("vrx_mj.ros.ros1.tcpros.LONGEST_PAUSE", 0.02)


def test_a_publisher_that_drops_the_connection_is_called_again(served, impatient):
    served.commands.clear()
    with Publisher().registered(served.uri) as publisher:
        for value in (0.25, 0.5):
            connection, header = publisher.accept()
            with connection:
                assert (header["callerid"], header["topic"], header["md5sum"]) == ("/gazebo", LEFT, FLOAT32)
                connection.sendall(float32(value))
                until(lambda value=value: served.commands and served.commands[-1].message.data == value, "the command")
    assert [one.sender for one in served.commands] == [ME, ME]


@pytest.mark.parametrize(
    ("fields", "sent", "told"),
    [
        ({"md5sum": EMPTY, "type": "std_msgs/Empty"}, b"", f"it sends [std_msgs/Empty/{EMPTY}], but this topic is "),
        ({"error": "go away"}, b"", "it reports: go away"),
        ({}, b"\xff\xff\xff\xff", "a frame of 4294967295 bytes, where at most 4194304 are allowed"),
        ({}, frame(b"too long for a float"), "20 bytes are not a std_msgs/Float32: "),
    ],
)
def test_a_publisher_that_sends_something_else_is_left(served, impatient, caplog, fields, sent, told):
    with Publisher().registered(served.uri) as publisher:
        connection, _ = publisher.accept(**fields)
        with connection:
            connection.sendall(sent)
            assert connection.recv(1) == b""
        until(lambda: caplog.messages, "it is told")
        uri = publisher.uri
    assert caplog.messages[0].startswith(f"{LEFT}: no messages from its publisher at {uri}: {told}")


@pytest.mark.slow
def test_a_flood_is_read_in_bites_and_only_the_newest_count(served, impatient):
    served.commands.clear()
    count = 15_000
    with Publisher().registered(served.uri) as publisher:
        connection, _ = publisher.accept()
        with connection:
            sender = threading.Thread(target=connection.sendall, args=(float32(0.125) * count + float32(1.0),))
            sender.start()
            until(lambda: served.commands and served.commands[-1].message.data == 1.0, "the last command", 30.0)
            sender.join()
    assert len(served.commands) < count / 5
