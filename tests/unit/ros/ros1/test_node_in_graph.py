"""The nodes of this process on TCPROS, without a network: what is registered, refused, passed on, said and counted."""

import asyncio
from functools import cached_property
from types import SimpleNamespace

import pytest

from vrx_mj.errors import CommandError
from vrx_mj.ros.graph import Graph, Service
from vrx_mj.ros.interface import Inbox
from vrx_mj.ros.limits import ConnectionLimit
from vrx_mj.ros.messages import md5sum, new, service_md5sum
from vrx_mj.ros.ros1 import node as module
from vrx_mj.ros.ros1.node import Node

URI = "http://127.0.0.1:11311"
INT = "std_msgs/Int8"


class Elsewhere:
    """A link to a master of another process: what it was asked, and what it answers."""

    def __init__(self):
        self.asked, self.answer = [], None

    async def many(self, requests, _timeout=0.0):
        self.asked += requests
        return [self.answer for _ in requests]


class Peer:
    """A connection from 10.0.0.7."""

    def __init__(self):
        self.reader = self
        self.writer = SimpleNamespace(transport=SimpleNamespace(
            set_write_buffer_limits=lambda high: None, is_closing=lambda: False, get_write_buffer_size=lambda: 0,
            write=lambda piece: self.got.append(bytes(piece)),
        ))  # fmt: skip
        self.got, self.is_open = [], True

    def address(self, end):
        return {"peername": ("10.0.0.7", 4000), "sockname": ("10.0.0.1", 4711)}[end]

    def close(self):
        self.is_open = False


class Source:
    """A connection to a publisher elsewhere."""

    def __init__(self, topic, uri, number):
        self.topic, self.uri, self.number, self.received, self.peer = topic, uri, number, 0, None

    @cached_property
    def task(self):
        return asyncio.get_running_loop().create_task(asyncio.sleep(60.0))


@pytest.fixture
def scene(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.ros1.tcpros.Source", Source)
    graph = Graph(None, Inbox())
    link = Elsewhere()
    node = Node(graph, SimpleNamespace(master=None, link=link, names=None), URI, ConnectionLimit())
    node.slave.stream, node.slave.uri = ("10.0.0.1", 4711), "http://10.0.0.1:4712/"
    node._join()
    lines = []
    graph.notices.listener = lambda level, text: lines.append((level, text))
    return SimpleNamespace(graph=graph, node=node, link=link, lines=lines)


def test_what_the_graph_has_is_published_heard_and_provided(scene):
    graph, node = scene.graph, scene.node
    assert set(node.publications) == {"/rosout"}
    assert set(node.provided) == {"/gazebo/get_loggers", "/gazebo/set_logger_level"}
    node.registrar.wake.clear()
    node.registrar.settled.set()
    graph.register("publisher", "/a", "/gazebo", INT)
    assert node.registrar.wake.is_set()
    assert not node.registrar.settled.is_set()
    assert (node.publications["/a"].type, node.publications["/a"].latched) == (INT, False)
    graph.register("subscriber", "/b", "/gazebo", INT)
    assert node.subscriptions["/b"].type == INT
    assert (graph.uri, graph.service_uri) == ("http://10.0.0.1:4712/", "rosrpc://10.0.0.1:4711")
    wished = node.registrar.wished()
    assert wished["/gazebo", "publisher", "/a"] == [INT, graph.uri]
    assert wished["/gazebo", "subscriber", "/b"] == [INT, graph.uri]
    assert wished["/gazebo", "service", "/gazebo/get_loggers"] == [graph.service_uri, graph.uri]
    assert len(wished) == 5
    graph.registrations.add("publisher", "/a", "/other", "http://other:1/")
    assert node.registrar.wished() == wished
    held = node.publications["/a"]
    graph.unregister("publisher", "/a", "/gazebo")
    assert "/a" not in node.publications
    graph.register("publisher", "/a", "/gazebo", "std_msgs/String", latched=True)
    assert node.publications["/a"] is not held
    assert (node.publications["/a"].type, node.publications["/a"].latched) == ("std_msgs/String", True)


def test_a_topic_of_another_type_and_a_service_of_another_node_begin_anew(scene):
    graph, node = scene.graph, scene.node

    async def change():
        graph.register("subscriber", "/b", "/gazebo", INT)
        first = node.subscriptions["/b"]
        first.update(["http://x:1/"])
        (source,) = first.sources.values()
        graph.unregister("subscriber", "/b", "/gazebo")
        assert "/b" not in node.subscriptions
        assert len(node._closing) == 1
        await asyncio.gather(*node._closing)
        await asyncio.sleep(0)
        assert not node._closing
        return source

    assert asyncio.run(change()).task.cancelled()
    held, peer = node.provided["/gazebo/get_loggers"], Peer()
    held.callers.add(peer)
    graph.provide("/gazebo/get_loggers", Service("/gazebo", "std_srvs/Empty", lambda *_: None))
    assert node.provided["/gazebo/get_loggers"] is not held
    assert not peer.is_open


def test_readers_get_what_is_sent_and_are_listed_with_what_they_got(scene):
    graph, node = scene.graph, scene.node
    graph.register("publisher", "/a", "/gazebo", INT)
    graph.register("subscriber", "/b", "/gazebo", INT)
    topic, peer = node.publications["/a"], Peer()
    reader = module.Reader(topic, peer, "/x")
    topic.join(reader)
    node._note_readers()
    assert node.listened == {"/a"}
    node.deliver("/a", INT, new(INT, data=5))
    node.deliver("/a", "std_msgs/String", new("std_msgs/String", data="no"))
    node.deliver("/nowhere", INT, new(INT, data=5))
    assert peer.got == [b"\1\0\0\0\5"]
    node.deliver("/a", INT, object())
    assert len(scene.lines) == 1
    assert scene.lines[0][1].startswith("/a: a message cannot be written: ")
    topic_b = node.subscriptions["/b"]
    topic_b.update(["http://x:1/", "http://y:2/"])
    topic_b.sources["http://y:2/"].received, topic_b.sources["http://y:2/"].peer = 30, Peer()
    call = node.slave.answer
    sent, got, _ = call("getBusStats", ["/t"], "127.0.0.1")[2]
    assert ["/a", 5, [[1, 5, 1, True]]] in sent
    assert got == [["/b", [[1, 0, -1, False], [2, 30, -1, True]]]]
    about = "TCPROS connection on port 4711 to [10.0.0.7:4000 on socket %d]"
    assert call("getBusInfo", ["/t"], "127.0.0.1") == [1, "bus info", [
        [1, "/x", "o", "TCPROS", "/a", True, about % 1],
        [1, "http://x:1/", "i", "TCPROS", "/b", False, "TCPROS connection on port 0 to [?:0 on socket 1]"],
        [2, "http://y:2/", "i", "TCPROS", "/b", True, about % 2],
    ]]  # fmt: skip
    assert node.clients == 1
    node.publications["/a"].readers.discard(reader)
    node._note_readers()
    assert node.listened == set()


def test_news_of_publishers_reach_the_topic_and_text_of_others_is_cut(scene):
    scene.graph.register("subscriber", "/b", "/gazebo", INT)
    slave = scene.node.slave
    slave.trusted = lambda _host: True
    assert slave.answer("publisherUpdate", ["/master", "/b", ["http://x:1/", 7]], "h") == [1, "", 0]
    assert slave.answer("publisherUpdate", ["/master", "/c", ["http://x:1/"]], "h") == [1, "", 0]
    assert list(scene.node.subscriptions["/b"].sources) == ["http://x:1/"]
    assert slave.answer("publisherUpdate", ["/master", 7, []], "h")[0] == -1
    reasons = []
    slave.on_shutdown = reasons.append
    slave.answer("shutdown", ["/x" * 60, "r" * 300], "h")
    slave.answer("shutdown", ["/y"], "h")
    assert reasons == ["/x" * 50 + " shut it down: " + "r" * 200, "/y shut it down: no reason given"]
    assert scene.lines[1] == ("WARN", "node /gazebo: /y shut it down: no reason given")
    slave.on_shutdown = None
    slave.answer("shutdown", ["/z", "bye"], "h")
    assert slave.answer("requestTopic", ["/x", "/" + "n" * 200, [["TCPROS"]]], "h")[1] == (
        f"Not a publisher of [/{'n' * 99}]"
    )
    assert slave.answer("requestTopic", ["/x", "/rosout", [["UDPROS"], [], "TCPROS", ["TCPROS", 1]]], "h")[0] == 1
    assert slave.answer("requestTopic", ["/x", "/rosout", "TCPROS"], "h")[0] == 0


def test_who_connects_is_told_what_is_wrong_with_its_header(scene):
    node = scene.node
    scene.graph.register("publisher", "/a", "/gazebo", INT)
    scene.graph.provide("/odd", Service("/gazebo", "team_msgs/Odd", lambda *_: None))
    loggers, kind = "/gazebo/get_loggers", "roscpp/GetLoggers"
    client = {"callerid": "/x", "md5sum": "*"}
    told = "topic [/a] to have datatype/md5sum [*/0], but our version has"
    wrong = [
        ({}, "[/gazebo] is not a provider of []"),
        ({"topic": "/" + "n" * 200}, f"[/gazebo] is not a publisher of [/{'n' * 99}]"),
        ({"service": "/a"}, "[/gazebo] is not a provider of [/a]"),
        ({"topic": "/a", "callerid": "/x"}, "Missing required 'md5sum' field"),
        ({"topic": "/a", "md5sum": "*"}, "Missing required 'callerid' field"),
        (
            client | {"topic": "/a", "type": "std_msgs/String"},
            f"topic types do not match: [std_msgs/String] vs. [{INT}]",
        ),
        (
            client | {"topic": "/a", "md5sum": "0"},
            f"Client [/x] wants {told} [{INT}/{md5sum(INT)}]. Dropping connection.",
        ),
        (client | {"service": "/odd"}, "[/odd] has the type [team_msgs/Odd], which only clients of rosbridge can call"),
        (
            client | {"service": loggers, "md5sum": "0"},
            f"request from [/x]: md5sums do not match: [0] vs. [{service_md5sum(kind)}]",
        ),
    ]
    for header, message in wrong:
        with pytest.raises(CommandError) as caught:
            node._destination(header)
        assert str(caught.value) == message
    topic = client | {"topic": "/a", "type": "*"}
    assert node._destination(topic) is node._destination(topic | {"md5sum": md5sum(INT), "type": INT})
    for header in (client | {"service": loggers}, client | {"service": loggers, "md5sum": service_md5sum(kind)}):
        assert node._destination(header).reply() == {
            "callerid": "/gazebo", "md5sum": service_md5sum(kind), "request_type": f"{kind}Request",
            "response_type": f"{kind}Response", "service": loggers, "type": kind,
        }  # fmt: skip


def test_latched_messages_of_others_are_kept_for_so_many_publishers_until_they_leave(scene, monkeypatch):
    monkeypatch.setattr(module, "_MOST_LATCHED", 2)
    graph, node, kept = scene.graph, scene.node, []
    graph.register("subscriber", "/b", "/gazebo", INT)
    monkeypatch.setattr(graph, "publish", lambda *what, latched, origin: kept.append((what[0], what[3], latched)))
    came = [("/x", True), ("/y", False), ("/z", True), ("/w", True), ("/x", True)]
    for sender, latched in came:
        node._take_remote("/b", new(INT), sender, latched)
    assert kept == [("/b", sender, latched and sender != "/w") for sender, latched in came]
    monkeypatch.setattr(node.watch, "look", lambda *_: None)
    forgotten = []
    monkeypatch.setattr(node.registrar, "forget", forgotten.append)
    node._take_state([{"/b": ["/x", "/gazebo"]}, {}, {}], {})
    node._take_remote("/b", new(INT), "/w", True)
    assert kept[-1] == ("/b", "/w", True)
    assert forgotten == ["/b"]  # one publisher is known there, and none here
    node.subscriptions["/b"].update(["http://x:1/"])
    node._take_state([{"/b": ["/x", "/gazebo"]}, {}, {}], {})
    node._take_state([{"/b": [f"/{number}" for number in range(65)]}, {}, {}], {})
    assert forgotten == ["/b"]
    node._take_state([{"/b": [f"/{number}" for number in range(64)]}, {}, {}], {})
    assert forgotten == ["/b"] * 2


def test_the_masters_parameters_and_services_are_asked_for_by_our_name(scene, monkeypatch):
    called = []

    async def call_service(*what):
        called.append(what)
        return "std_srvs/Empty", None

    monkeypatch.setattr(module, "call_service", call_service)
    scene.link.answer = 7
    assert asyncio.run(scene.graph.remote_master("getParam", ["/gain"])) == 7
    assert scene.link.asked == [("getParam", ("/gazebo", "/gain"))]
    with pytest.raises(CommandError, match=r"^no service named '/light'$"):
        asyncio.run(scene.graph.remote_call("/light", None))
    scene.link.answer = "rosrpc://x:1"
    assert asyncio.run(scene.graph.remote_call("/light", None)) == ("std_srvs/Empty", None)
    assert called == [("rosrpc://x:1", "/gazebo", "/light", None)]
    assert scene.link.asked[-1] == ("lookupService", ("/gazebo", "/light"))


def test_only_our_own_parameters_wake_the_registrar(scene):
    node = scene.node
    for setter, is_awake in (("/other", False), ("/gazebo", True)):
        node.registrar.wake.clear()
        node.parameter_changed("/gain", 1, setter)
        assert node.registrar.wake.is_set() is is_awake


def test_closing_leaves_the_graph(scene):
    scene.link.close = lambda: None
    asyncio.run(scene.node.close())
    assert scene.graph.wires == []
    assert (scene.graph.remote_master, scene.graph.remote_call) == (None, None)


def test_a_node_that_does_not_answer_a_call_is_dead(monkeypatch):
    calls = []

    async def ask(*what, timeout):
        calls.append((*what, timeout))
        if len(calls) > 1:
            raise ConnectionRefusedError

    monkeypatch.setattr(module, "ask", ask)
    assert asyncio.run(module._answers("http://x:1/"))
    assert not asyncio.run(module._answers("http://x:1/"))
    assert calls[0] == ("http://x:1/", "getPid", "/vrx_mj", 2.0)


def test_so_many_late_subscribers_are_watched_and_each_node_is_told_of_once(scene, monkeypatch):
    monkeypatch.setattr(module, "_MOST_WAITING", 3)
    watch, now = scene.node.watch, [0.0]
    watch.clock = lambda: now[0]
    for name in "abc":
        scene.graph.register("publisher", f"/{name}", "/gazebo", INT)
    scene.node.publications["/a"].met.add("/met")
    subscribers = {"/a": ["/x", "/met", "/gazebo"], "/b": ["/x", "/y"], "/c": ["/z"]}
    assert watch._silent(subscribers) == []
    now[0] = 10.0
    assert watch._silent(subscribers) == []
    now[0] = 10.1
    assert watch._silent(subscribers) == [("/b", "/x"), ("/b", "/y")]
    now[0] = 20.2
    assert watch._silent(subscribers) == []  # these begin again
    now[0] = 20.4
    assert len(watch._silent({"/c": ["/z"]})) == 0
