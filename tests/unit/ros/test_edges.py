"""Limits of networks, parameters and answers at N and at one more, and messages word for word."""

import asyncio
import errno
import logging
import socket
from datetime import datetime
from types import SimpleNamespace
from xmlrpc.client import Binary, Fault

import numpy as np
import psutil
import pytest

from vrx_mj.errors import CommandError
from vrx_mj.ros import limits, network, parameters
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Command, Delivery, Inbox, Output, RosInterface, Traffic
from vrx_mj.ros.limits import ConnectionLimit, Counts, Intake, Mailbox, Outbox, Pace, Place
from vrx_mj.ros.messages import new
from vrx_mj.ros.network import Notices, announced_address, own_names, refusal, shown_process, unreachable
from vrx_mj.ros.parameters import Parameters, plain, value_size
from vrx_mj.ros.ros1 import Ros1, connection
from vrx_mj.ros.ros1.connection import HttpServer, Listener, decode_header, encode_header
from vrx_mj.ros.ros_server import Lockstep

FAR = "203.0.113.7"
SET = "other machines cannot reach {0}, the address set by {1}: set {1} to this machine's address, or unset it"


# Connections, bytes and time


@pytest.mark.parametrize(
    ("soft", "hard", "asked", "given", "most"),
    [
        (1024, 1 << 20, 4696, 4696, 4096), (1024, 4096, 4096, 4096, 3496), (1024, -1, 4696, 4696, 4096),
        (1024, 4096, 4096, 1024, 512), (1024, 2048, 2048, 1300, 700), (4696, 5000, None, 4696, 4096),
        (4695, 5000, 4696, 4695, 4095), (1 << 20, 1 << 20, None, 1 << 20, 4096), (-1, -1, None, -1, 4096),
        (1024, 4096, 4096, -1, 4096), (0, 100, 100, 0, 0),
    ],
)  # fmt: skip
def test_a_process_with_few_files_asks_for_more_and_keeps_some_to_spare(monkeypatch, soft, hard, asked, given, most):
    found = [(soft, hard), (given, hard)]
    calls = []
    monkeypatch.setattr(limits, "resource", SimpleNamespace(
        RLIMIT_NOFILE=7, getrlimit=lambda _: found.pop(0), setrlimit=lambda *what: calls.append(what)))  # fmt: skip
    assert ConnectionLimit().most == most
    assert calls == ([] if asked is None else [(7, (asked, hard))])


def test_without_limits_of_files_there_are_as_many_as_there_may_be(monkeypatch):
    monkeypatch.setattr(limits, "resource", None)
    assert ConnectionLimit().most == 4096

    def denied(*_):
        raise ValueError

    monkeypatch.setattr(limits, "resource", SimpleNamespace(
        RLIMIT_NOFILE=7, getrlimit=lambda _: (1024, 2048), setrlimit=denied))  # fmt: skip
    assert ConnectionLimit().most == 512


def test_a_connection_that_has_gone_or_is_in_use_is_neither_settled_nor_left_again():
    limit, place = ConnectionLimit(most=4), Place("127.0.0.1", list)
    assert not limit.settle(place)
    assert limit.enter(place)
    assert limit.settle(place)
    assert not limit.settle(place)
    for _ in range(2):
        limit.leave(place)
        assert limit.inside == {}


@pytest.mark.parametrize(
    ("spent", "waits"),
    [
        ([(0.0, 0.1), (0.0, 0.1)], [0.0, 0.0]), ([(0.0, 0.3)], [0.4]), ([(0.0, 0.3), (0.4, 0.0)], [0.4, 0.0]),
        ([(0.0, 0.3), (0.2, 0.1)], [0.4, 0.6]), ([(0.0, 0.1), (9.0, 0.2)], [0.0, 0.0]),
    ],
)  # fmt: skip
def test_a_burst_is_free_and_more_has_to_wait_for_its_share(spent, waits):
    """A quarter of the time, and 0.2 s at once: debts are paid by a quarter of what passes."""
    pace = Pace(0.25, 0.2)
    assert [pace.wait(cost, now) for now, cost in spent] == pytest.approx(waits)


def test_those_that_flood_share_and_one_that_ends_gives_its_part_back():
    flooding = set()
    one, two = (Pace(0.5, 0.1, flooding) for _ in range(2))
    assert one.wait(0.6, 0.0) == pytest.approx(0.5 / 0.5)
    assert two.wait(0.6, 0.0) == pytest.approx(0.5 / 0.25)
    assert one.wait(0.0, 0.0) == pytest.approx(0.5 / 0.25)
    two.end()
    assert flooding == {one}
    assert one.wait(0.0, 0.0) == pytest.approx(0.5 / 0.5)
    assert one.wait(0.0, 9.0) == 0.0
    assert flooding == set()


def test_a_mailbox_has_so_many_topics(monkeypatch):
    monkeypatch.setattr(limits, "_MOST_KEYS", 2)
    box = Mailbox(lambda item: item[0])
    assert box.put(["a1", "b1"])
    assert not box.put(["c1", "a2"])
    assert box.dropped == 1
    assert box.take() == ["a1", "b1", "a2"]
    assert not box.put([])
    assert box.take() == []


def test_an_outbox_is_full_at_its_count_and_its_bytes(monkeypatch):
    monkeypatch.setattr(limits, "MOST_BYTES", 10)
    monkeypatch.setattr(limits, "MOST_BYTES_OF_ALL", 15)
    counts, filled = Counts(), []
    box, other = (Outbox(counts, 3, lambda: filled.append(1)) for _ in range(2))
    for size in (4, 4, 2):
        assert box.has_room(size)
        box.push(str(size), size)
    assert (box.bytes, counts.waiting, box.dropped, len(box)) == (10, 10, 0, 3)
    assert not box.has_room(0)
    assert box.pop() == "4"
    assert box.has_room(4)
    assert not box.has_room(5)
    assert other.has_room(99)
    other.push("x", 9, "source")
    assert (counts.waiting, other.dropped) == (15, 0)
    other.push("y", 1, "source")
    assert (counts.waiting, other.dropped, counts.dropped) == (7, 1, 1)
    other.push("z", 1, "source", 1)
    assert [other.pop(), other.pop(), counts.dropped] == ["z", None, 2]
    other.push("a", 1, "gone")
    other.push("b", 2)
    other.forget("gone")
    assert (other.bytes, len(other), counts.waiting, counts.dropped) == (2, 1, 8, 2)
    assert len(filled) == 8


# Parameters


@pytest.mark.parametrize(
    ("value", "size"),
    [
        (5, 64), ("abc", 67), ([], 64), ([1, "ab"], 64 + 64 + 66), ({"ab": 1, "c": {}}, 64 + 2 + 64 + 1 + 64),
        (Binary(b"abcd"), 68), ((1,), 128),
    ],
)  # fmt: skip
def test_sizes_are_about_what_xml_takes(value, size):
    assert value_size(value) == size


def nested(depth, inner=1):
    return inner if depth == 0 else [nested(depth - 1, inner)]


def test_values_are_nested_so_deep_and_no_deeper():
    deepest = parameters._MAX_DEPTH
    assert plain(nested(deepest)) == nested(deepest)
    mapping = 1
    for _ in range(deepest):
        mapping = {"a": mapping}
    assert plain(mapping) == mapping
    for wrong in (nested(deepest + 1), {"a": mapping}, {"a": nested(deepest)}):
        with pytest.raises(CommandError, match=rf"^a value is nested more than {deepest} levels deep$"):
            plain(wrong)


@pytest.mark.parametrize(
    ("value", "carried"),
    [
        (2**31 - 1, 2**31 - 1), (2**31, 2.0**31), (-(2**31), -(2**31)), (-(2**31) - 1, -(2.0**31) - 1.0), (True, True),
        (np.float32(0.5), 0.5), (np.arange(3), [0, 1, 2]), ((1, "a"), [1, "a"]), ({5: np.int64(2)}, {"5": 2}),
    ],
)  # fmt: skip
def test_values_are_what_xml_can_carry(value, carried):
    found = plain(value)
    assert (found, type(found)) == (carried, type(carried))


def test_characters_that_xml_lacks_are_named():
    with pytest.raises(CommandError) as caught:
        plain({"a": ["x\0"]})
    assert str(caught.value) == "a value has the character U+0000, which XML-RPC cannot carry"
    with pytest.raises(CommandError, match=r"^a value has the character U\+0001, "):
        plain({"\1": 1})


def test_parameters_have_so_many_bytes_and_levels(monkeypatch):
    monkeypatch.setattr(parameters, "MOST_BYTES", 64 + 1 + 67)
    tree = Parameters()
    tree.set("/a", "xyz")
    tree.delete("/a")
    tree.set("/b", "xyz")
    with pytest.raises(CommandError):
        tree.set("/c", 1)
    monkeypatch.setattr(parameters, "MOST_BYTES", 1 << 20)
    tree.set("a/" * 32, 1)
    assert tree.search("/a/b", "") is None
    assert tree.search("/a", "/none") is None
    assert tree.get("/" + "a/" * 32) == 1
    with pytest.raises(CommandError):
        tree.set("a/" * 33, 1)


# Who is where


def test_so_many_notices_are_remembered_and_each_is_logged_at_its_level(caplog):
    caplog.set_level(logging.INFO)
    notices, lines = Notices(), []
    notices.write("INFO", "kind", "nobody", "heard by nobody but the log")
    notices.listener = lambda *line: lines.append(line)
    for level in ("INFO", "WARN", "ERROR", "FATAL"):
        notices.write(level, "kind", level, level)
        notices.write(level, "kind", level, "again")
    assert [record.levelname for record in caplog.records] == ["INFO", "INFO", "WARNING", "ERROR", "CRITICAL"]
    notices.forget("kind", "WARN")
    notices.write("WARN", "kind", "WARN", "and again")
    assert lines[-1] == ("WARN", "and again")
    for number in range(1000):
        notices.write("INFO", "number", str(number), "x")
    assert len(lines) == 1000 - 5 + 5
    notices.write("INFO", "kind", "long", "x")
    assert len(lines) == 1000


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (OSError(errno.EADDRINUSE, "used"), "rosbridge: port 90 of here is taken by X"),
        (OSError(errno.EACCES, "no"), "rosbridge: port 90 of here cannot be opened: Permission denied"),
        (OSError("odd"), "rosbridge: port 90 of here cannot be opened: odd"),
        (TimeoutError(), "rosbridge: port 90 of here cannot be opened: it timed out"),
        (OverflowError("too large"), "rosbridge: port 90 of here cannot be opened: too large"),
    ],
)
def test_why_a_port_cannot_be_opened_is_said(monkeypatch, error, text):
    monkeypatch.setattr(network, "who_listens", lambda port: "X" if port == 90 else None)
    assert refusal("rosbridge", "here", 90, error) == text
    monkeypatch.setattr(network, "who_listens", lambda _: None)
    assert refusal("rosbridge", "here", 90, error) == text.replace("X", "an unknown program")


@pytest.mark.parametrize(("length", "end"), [(118, "x"), (119, "..."), (400, "...")])
def test_commands_of_processes_are_shown_in_one_line_of_so_many_characters(monkeypatch, length, end):
    known = {"cmdline": ["a", "x" * length], "create_time": 1.5e9}
    monkeypatch.setattr(psutil, "Process", lambda _: SimpleNamespace(as_dict=lambda _: known))
    shown = "a " + ("x" * length if end == "x" else "x" * 115 + "...")
    since = datetime.fromtimestamp(1.5e9).strftime("%Y-%m-%d %H:%M:%S")  # noqa: DTZ006  # as people here have it
    assert shown_process(7) == f"process 7 ({shown}), since {since}; to stop it: kill 7"
    known["cmdline"] = ["a\tb\n"]
    assert shown_process(7).startswith("process 7 ('a?b?'), since ")
    known["cmdline"] = None
    assert shown_process(7).startswith("process 7 (), since ")


@pytest.mark.parametrize(
    ("host", "variables", "address", "why"),
    [
        ("127.0.0.1", {}, "127.0.0.1", None), ("localhost", {}, "127.0.0.1", None), (FAR, {}, FAR, None),
        (FAR, {"ROS_IP": "10.0.0.9"}, "10.0.0.9", None),
        (FAR, {"ROS_IP": "127.0.0.1"}, "127.0.0.1",
         SET.format("127.0.0.1", "ROS_IP")),
        (FAR, {"ROS_IP": "10.0.0.9", "ROS_HOSTNAME": "localhost"}, "localhost",
         SET.format("localhost", "ROS_HOSTNAME")),
        ("loop", {}, "loop",
         "other machines cannot reach loop, the address of --host loop: set ROS_IP to this machine's address"),
        ("nowhere", {}, "nowhere", None),
    ],
)  # fmt: skip
def test_the_address_for_others_is_that_of_the_environment_or_the_host(monkeypatch, host, variables, address, why):
    known = {"loop": ["127.0.1.1"], "localhost": ["127.0.0.1"], "nowhere": []}
    monkeypatch.setattr(network, "addresses", lambda name: known.get(name, [name]))
    for name in ("ROS_HOSTNAME", "ROS_IP"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert announced_address(host, "localhost") == address
    assert unreachable(host, "localhost") == why


def test_this_machine_has_the_names_of_the_environment_of_its_host_and_of_the_masters(monkeypatch):
    monkeypatch.setattr(socket, "getfqdn", lambda: "learnt")
    monkeypatch.setenv("ROS_HOSTNAME", "Boat.")
    monkeypatch.setenv("ROS_IP", "")
    names = own_names("dock", "http://Shore:11311/x")
    assert [names.has(name, FAR) for name in ("boat", "dock", "shore", "x", "other")] == [True] * 3 + [False] * 2
    assert not own_names("0.0.0.0", "").has("0.0.0.0", FAR)


# The graph, answers in lockstep, and ROS 1 before it begins


def test_log_lines_below_the_level_are_not_published_and_have_the_simulations_time():
    graph, sent = Graph(SimpleNamespace(), Inbox()), []
    graph.wires.append(SimpleNamespace(
        deliver=lambda name, _kind, message: sent.append((name, message)), registration_changed=lambda *_: None,
        parameter_changed=lambda *_: None))  # fmt: skip
    graph.log("INFO", "before time")
    assert sent[0][1].header.stamp.sec > 1_000_000_000
    output = Output("/clock", "std_msgs/Int8", lambda: None)
    graph.send(Delivery(output, new("std_msgs/Int8"), 7.25))
    for level in ("INFO", "WARN", "ERROR", "odd"):
        graph.log(level, level)
    answers = []
    request = new("roscpp/SetLoggerLevelRequest", level="error")
    graph._set_logger_level(request, "/x", lambda *what: answers.append(what))
    for level in ("WARN", "ERROR", "FATAL"):
        graph.log(level, level)
    lines = [message for name, message in sent if name == "/rosout"][1:]
    assert [(one.level, one.msg) for one in lines] == [
        (2, "INFO"), (4, "WARN"), (8, "ERROR"), (8, "odd"), (8, "ERROR"), (16, "FATAL"),
    ]  # fmt: skip
    assert {(one.header.stamp.sec, one.header.stamp.nanosec, one.name) for one in lines} == {
        (7, 250_000_000, "/gazebo")
    }
    assert answers[0][1] == ""


def test_what_a_table_has_of_unknown_types_and_values_is_left_out_and_said():
    graph, lines = Graph(SimpleNamespace(), Inbox()), []
    graph.notices.listener = lambda *line: lines.append(line)
    odd = Output("/odd", "team_msgs/Odd", lambda: None)
    for value in (None, 5):
        graph.offer(RosInterface({"/odd": odd}, parameters={"/p": value, "/q": 1}))
    assert lines == [
        ("ERROR", "/odd: unknown type team_msgs/Odd"),
        ("ERROR", "parameter /p: a NoneType cannot be the value of a parameter"),
    ]
    assert (graph.parameters.get("/p"), graph.parameters.get("/q")) == (5, 1)
    assert "/odd" not in graph.topics()
    graph.offer(RosInterface())
    assert not graph.parameters.has("/p")


def test_so_many_answers_of_a_topic_wait_for_their_clock():
    lockstep = Lockstep(["/a", "/b"])
    assert lockstep.missing == ("/a", "/b")
    assert not lockstep.keep(Command("/c", 0, "/me"))
    for number in range(1025):
        assert lockstep.keep(Command("/a", number, "/me"))
    assert lockstep.answers() is None
    lockstep.keep(Command("/b", 7, "/me"))
    assert lockstep.missing == ()
    assert [one.message for one in lockstep.answers()] == [1, 7]
    assert lockstep.missing == ("/b",)
    lockstep.begin()
    assert lockstep.missing == ("/a", "/b")
    assert Lockstep([]).missing == ("/vrx_mj/step",)
    assert Lockstep([]).answers() is None


def test_before_it_begins_ros_1_has_no_traffic_and_nothing_to_close(monkeypatch):
    graph = Graph(SimpleNamespace(call=None), Inbox())
    monkeypatch.delenv("ROS_MASTER_URI", raising=False)
    ros = Ros1(graph)
    assert ros.traffic == Traffic(0, 0, 0)
    assert ros.master_uri == "http://localhost:11311"
    ros.settle()
    ros.close()
    ros._shut_down("nobody is told")
    monkeypatch.setenv("ROS_MASTER_URI", "http://far:1/")
    assert Ros1(graph).master_uri == "http://far:1"
    assert Ros1(graph, master_uri="http://near:2").master_uri == "http://near:2"


# A caller's many calls, and connections that are too many


def test_so_many_calls_may_come_in_one():
    assert len(connection._calls([[0] * 1000])) == 1000
    for wrong in ([[0] * 1001], [], [[], []], ["calls"]):
        with pytest.raises(CommandError, match=r"^system\.multicall needs one list of at most 1000 calls$"):
            connection._calls(wrong)


def test_calls_in_one_are_answered_each_for_itself_and_up_to_so_many_bytes(monkeypatch):
    def answer(method, values, host):
        if method == "no":
            raise Fault(1, "no such method")
        return [1, host, values]

    async def asked(*calls):
        server = HttpServer("master", answer, ConnectionLimit(8), Notices())
        return await server._call_method("system.multicall", [list(calls)], "h")

    good, bad = {"methodName": "yes", "params": ["x" * 99]}, {"methodName": "no", "params": []}
    found = asyncio.run(asked(good, bad, {"methodName": 5, "params": []}, {"methodName": "yes"}, "call"))
    wrong = {"faultCode": 1, "faultString": "a call needs a name and a list of values"}
    assert found[0] == [[1, "h", ["x" * 99]]]
    assert found[1] == {"faultCode": 1, "faultString": "no such method"}
    assert [found[2], found[4]] == [wrong] * 2
    assert found[3]["faultString"] == "'params'"
    size = value_size(found[0])
    monkeypatch.setattr(connection, "_LARGEST_ANSWER", 2 * size)
    assert len(asyncio.run(asked(good, good))) == 2
    with pytest.raises(CommandError) as caught:
        asyncio.run(asked(good, good, good))
    assert str(caught.value) == f"system.multicall: answers of more than {2 * size} bytes"
    with pytest.raises(CommandError, match=r"^an answer instead of a call$"):
        asyncio.run(HttpServer("x", answer, ConnectionLimit(8), Notices())._call_method(None, [], "h"))


class Wire:
    """Both ends' streams of a connection from some host."""

    def __init__(self, host="10.0.0.7"):
        self.host, self.aborted, self.transport, self.options = host, 0, self, []
        self.setsockopt = lambda *option: self.options.append(option)

    def abort(self):
        self.aborted += 1

    def set_write_buffer_limits(self, high):
        self.high = high

    def get_extra_info(self, what):
        return self if what == "socket" else (self.host, 4000)


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (CommandError("too long"), "node: refused a request from 10.0.0.7: too long"),
        (Fault(1, "odd"), "node: refused a request from 10.0.0.7: <Fault 1: 'odd'>"),
        (TimeoutError(), None), (EOFError(), None), (OSError(), None), (None, None),
    ],
)  # fmt: skip
def test_a_listener_says_why_a_peer_had_to_leave_and_gives_its_place_up(error, line):
    notices, lines, seen = Notices(), [], []
    notices.listener = lambda *what: lines.append(what)

    async def serve(peer):
        seen.append((peer.address("peername"), len(listener.tasks), dict(limit.inside)))
        if error is not None:
            raise error

    async def run():
        for one in wires:
            await listener._serve_client(None, one)

    limit = ConnectionLimit(8)
    listener, wires = Listener("node", serve, limit, Intake(9), notices), [Wire(), Wire()]
    asyncio.run(run())
    assert seen == [(("10.0.0.7", 4000), 1, {"10.0.0.7": 1})] * 2
    assert lines == ([("WARN", line)] if line else [])
    assert (limit.inside, listener.tasks) == ({}, set())
    assert [one.aborted for one in wires] == [1, 1]
    assert wires[0].high == 0
    values = {name: value for _, name, value in wires[0].options}
    assert values[socket.SO_KEEPALIVE] == 1
    if hasattr(socket, "TCP_KEEPIDLE"):  # who is gone without a word is missed within a minute
        idle, period, count = (values[getattr(socket, f"TCP_KEEP{name}")] for name in ("IDLE", "INTVL", "CNT"))
        assert (idle, idle + period * count) == (30, 60)


def test_a_listener_refuses_what_is_too_much_and_says_nothing_once_it_is_closed():
    notices, lines, seen = Notices(), [], []
    notices.listener = lambda *what: lines.append(what)

    async def serve(peer):
        seen.append(peer)

    async def run():
        await listener._serve_client(None, wire)
        listener._is_open = False
        listener.connection_limit = ConnectionLimit(8)
        await listener._serve_client(None, wire)
        await listener.close()

    listener, wire = Listener("node", serve, ConnectionLimit(0), Intake(9), notices), Wire("127.0.0.1")
    asyncio.run(run())
    assert (seen, wire.aborted) == ([], 2)
    assert lines == [("WARN", "node: too many connections: refused one from 127.0.0.1")]


def test_headers_are_read_to_their_last_byte():
    whole = encode_header({"a": "1", "b": "x=y"})[4:]
    assert decode_header(whole) == {"a": "1", "b": "x=y"}
    for end, why in (
        (len(whole) - 1, "a header's field has 5 bytes where 4 are left"),
        (10, "truncated header: it ends inside the length of a field, at byte 7"),
        (8, "truncated header: it ends inside the length of a field, at byte 7"),
    ):
        with pytest.raises(CommandError) as caught:
            decode_header(whole[:end])
        assert str(caught.value) == why
    with pytest.raises(CommandError, match=r"^a header's field has no '='$"):
        decode_header(b"\3\0\0\0abc")


def test_a_node_that_is_forgotten_is_no_longer_this_processs_but_for_the_simulation():
    graph = Graph(SimpleNamespace(), Inbox())
    for node in ("/rosbridge/client_1", "/gazebo"):
        graph.register("publisher", "/x", node, "std_msgs/Int8", latched=True)
    graph.publish("/x", "std_msgs/Int8", new("std_msgs/Int8", data=5), "/rosbridge/client_1", latched=True)
    assert graph.is_latched("/x")
    graph.forget("/rosbridge/client_1")
    assert (graph.local, graph.is_latched("/x")) == ({"/gazebo"}, False)
    graph.forget("/gazebo")
    assert graph.local == {"/gazebo"}
    assert graph.topics() == {}
