"""The slave API, and what is seen in the master's state."""

import asyncio
import os
import re
import struct
from types import SimpleNamespace

import pytest

from vrx_mj.errors import CommandError
from vrx_mj.ros.graph import Graph, Service
from vrx_mj.ros.interface import Inbox, UnknownTopicPublisher
from vrx_mj.ros.limits import Intake
from vrx_mj.ros.messages import new
from vrx_mj.ros.network import Notices, shown_process, who_listens
from vrx_mj.ros.ros1.connection import encode_header, with_length
from vrx_mj.ros.ros1.node import Slave, Watch
from vrx_mj.ros.ros1.registrar import PORTION, Registrar, _portions
from vrx_mj.ros.ros1.tcpros import Publication, ServiceHost, Stream, Subscription, call_service


@pytest.fixture
def notices():
    one = Notices()
    one.lines = []
    one.listener = lambda level, text: one.lines.append((level, text))
    return one


@pytest.fixture
def publications():
    stream = Stream("/gazebo")
    return {name: Publication(stream, name, "std_msgs/Int8", latched=False) for name in ("/a", "/b")}


@pytest.fixture
def slave(publications, notices):
    one = Slave("/gazebo", "http://127.0.0.1:11311", publications, {}, notices, is_masters_own=False)
    one.stream = ("10.0.0.1", 4711)
    one.trusted = lambda host: host == "127.0.0.1"
    one.told = []
    one.on_shutdown = one.told.append
    return one


def call(slave, method, *values, host="127.0.0.1"):
    return slave.answer(method, values, host)


def test_only_this_machine_and_the_masters_may_end_the_node(slave, notices):
    refused = [-1, "shutdown is refused: 10.0.0.7 is neither this machine nor the master's", 0]
    assert call(slave, "shutdown", "/evil", "die", host="10.0.0.7") == refused
    assert call(slave, "publisherUpdate", "/evil", "/a", [], host="10.0.0.7")[0] == -1
    assert slave.told == []
    assert notices.lines == [
        ("WARN", "10.0.0.7 (/evil) called shutdown: only this machine and the master's machine may"),
        ("WARN", "10.0.0.7 (/evil) called publisherUpdate: only this machine and the master's machine may"),
    ]
    assert call(slave, "shutdown", "/rosnode", "user request") == [1, "shutdown", 0]
    assert slave.told == ["/rosnode shut it down: user request"]


def test_a_master_in_the_same_process_does_not_end_the_node_whoever_has_it_say_so(slave):
    """As one would who registers a node with our URI, and then again with another one."""
    slave.is_masters_own = True
    reason = "[/x] Reason: new node registered with same name"
    assert call(slave, "shutdown", "/master", reason) == [
        -1,
        "shutdown is refused: this master does not end this node",
        0,
    ]
    assert slave.told == []
    slave.is_masters_own = False
    assert call(slave, "shutdown", "/master", reason)[0] == 1
    assert slave.told == [f"/master shut it down: {reason}"]


@pytest.mark.parametrize(
    ("method", "values", "answer"),
    [
        ("requestTopic", ("/x", "/a", [["TCPROS"]]), [1, "ready on 10.0.0.1:4711", ["TCPROS", "10.0.0.1", 4711]]),
        (
            "requestTopic",
            ("/x", "a", [["UDPROS"]]),
            [0, "no supported protocol implementations: TCPROS is spoken here", []],
        ),
        ("requestTopic", ("/x", "/c", [["TCPROS"]]), [-1, "Not a publisher of [/c]", []]),
        ("requestTopic", ("/x", 5, 5), [-1, "Not a publisher of [5]", []]),
        ("getPublications", ("/x",), [1, "publications", [["/a", "std_msgs/Int8"], ["/b", "std_msgs/Int8"]]]),
        ("getMasterUri", ("/x",), [1, "http://127.0.0.1:11311", "http://127.0.0.1:11311"]),
        ("getPid", ("/x",), [1, "", os.getpid()]),
        ("getPid", ("/x", 1), [-1, "Error: bad call arity", 0]),
        ("getPid", (), [-1, "caller_id must be a string of at most 1024 characters", 0]),
        ("getBusStats", ("/x",), [1, "", [[["/a", 0, []], ["/b", 0, []]], [], []]]),
        ("getBusInfo", ("/x",), [1, "bus info", []]),
        ("publisherUpdate", ("/x", "/a", "no list"), [-1, "publisherUpdate takes a topic and a list of URIs", 0]),
        ("paramUpdate", ("/x", "/a", 1), [-1, "not subscribed", 0]),
    ],
)
def test_the_slave_api(slave, method, values, answer):
    assert call(slave, method, *values) == answer


class FarAway:
    """A master that knows one node on another machine."""

    async def many(self, requests, timeout=1.0):
        assert {method for method, _ in requests} == {"lookupNode"}
        return ["http://10.0.0.7:4000/" for _ in requests]


def watched(notices, publications, states, monkeypatch, *, alive=True):
    """What is told of states that are 6 s from each other."""

    async def answers(uri):
        return alive

    monkeypatch.setattr("vrx_mj.ros.ros1.node._answers", answers)
    inbox = Inbox()
    graph = Graph(None, inbox)
    graph.notices = notices
    watch = Watch(graph, FarAway(), publications)
    watch.announced = "10.0.0.1"
    times = iter(range(0, 1000, 6))
    watch.clock = lambda: float(next(times))

    async def run():
        for state in states:
            watch.look(state, {"/typo": "std_msgs/Float32"}, {"/in": None})
            await asyncio.gather(*watch._work)

    asyncio.run(run())
    return inbox.drain()[2]


WAITING = [{}, {"/a": ["/x"], "/b": ["/x"]}, {}]
LATE = (
    "subscriber /x on 10.0.0.7 never connected: can it reach 10.0.0.1, "
    "the address set by ROS_HOSTNAME, ROS_IP or --host?"
)


def test_a_subscriber_that_never_connects_is_told_once(notices, publications, monkeypatch):
    watched(notices, publications, [WAITING] * 2, monkeypatch)
    assert notices.lines == []
    watched(notices, publications, [WAITING] * 6, monkeypatch)
    assert notices.lines == [("WARN", LATE)]


def test_one_that_died_or_did_connect_is_not_told(notices, publications, monkeypatch):
    watched(notices, publications, [WAITING] * 4, monkeypatch, alive=False)
    for topic in publications.values():
        topic.refusal({"topic": topic.name, "callerid": "/x", "md5sum": "*"})
    watched(notices, publications, [WAITING] * 4, monkeypatch)
    assert notices.lines == []


def test_publishers_that_nobody_hears_are_unknown(notices, publications, monkeypatch):
    state = [
        {
            "/typo": ["/pub"],
            "/in": ["/pub"],
            "/a": ["/pub"],
            "/clock": ["/pub"],
            "/heard": ["/pub"],
            "/own": ["/gazebo"],
        },
        {"/heard": ["/gazebo", "/other"]},
        {},
    ]
    found = watched(notices, publications, [state, state], monkeypatch)
    assert found == [UnknownTopicPublisher("/typo", "std_msgs/Float32", "/pub")]


def test_a_message_that_is_none_of_its_type_is_told(publications):
    topic = publications["/a"]
    topic.readers.add(object())
    with pytest.raises(AttributeError):
        topic.send(object())


def test_a_process_that_is_gone_is_shown_by_its_number():
    assert shown_process(2**22 + 1) == f"process {2**22 + 1} (already ended); to stop it: kill {2**22 + 1}"
    assert who_listens(0) is None


def test_so_many_publishers_are_connected_and_no_more_and_never_this_process(notices):
    async def run():
        topic = Subscription(
            "/gazebo", "/a", "std_msgs/Int8", None, Intake(1), notices, "http://own:1/", lambda: len(topic.sources) < 2
        )
        topic.update(["http://own:1/", *(f"http://127.0.0.1:{port}/" for port in (1, 2, 3))])
        try:
            return list(topic.sources)
        finally:
            await topic.close()

    assert asyncio.run(run()) == ["http://127.0.0.1:1/", "http://127.0.0.1:2/"]
    assert notices.lines == [("WARN", "/a: too many publishers are connected; no messages from http://127.0.0.1:3/")]


def test_a_caller_is_asked_for_its_next_call_when_it_has_taken_its_answer():
    called, sent = [], []
    network = SimpleNamespace(soon=lambda function, *values: function(*values))
    service = Service("/gazebo", "std_srvs/Empty", lambda _request, _caller, answer: called.append(answer))

    class Peer:
        async def frame(self, _largest, _patience):
            return b""

        async def send(self, data):
            sent.append(data)
            await taking.wait()

    async def run():
        calling = asyncio.ensure_future(provided.answer(Peer(), "/x", persistent=True))
        await asyncio.sleep(0)
        called[0](new("std_srvs/EmptyResponse"), "")
        for _ in range(5):
            await asyncio.sleep(0)
        assert (len(called), sent) == (1, [b"\1\0\0\0\0"])
        taking.set()
        for _ in range(5):
            await asyncio.sleep(0)
        called[1](None, "no")
        for _ in range(5):
            await asyncio.sleep(0)
        assert (len(called), sent[1]) == (3, b"\0" + with_length(b"no"))
        calling.cancel()

    provided, taking = ServiceHost(Graph(network, Inbox()), "/s", service), asyncio.Event()
    asyncio.run(run())


def test_parameters_are_sent_in_portions_that_a_master_can_take():
    given = {f"/{number}": "x" * (PORTION // 3) for number in range(7)} | {"/large": "x" * 2 * PORTION, "/small": 1}
    portions = list(_portions(given))
    assert [len(portion) for portion in portions] == [2, 2, 2, 1, 1, 1]
    assert {name: value for portion in portions for name, value in portion.items()} == given


def test_a_node_whose_name_another_took_registers_nothing_again(notices):
    asked, reasons = [], []

    async def many(requests, _timeout=0.0):
        """Answers of a master that knows another node of the name, and nothing of ours."""
        asked.extend(method for method, _ in requests)
        answers = {"getSystemState": [[], [], []], "getTopicTypes": [], "lookupNode": "http://other:1/"}
        return [answers.get(method, []) for method, _ in requests]

    async def run():
        registrar = Registrar("/gazebo", "http://127.0.0.1:11311", SimpleNamespace(many=many), notices)
        registrar.api, registrar.replaced = "http://here:1/", reasons.append
        registrar.wished = lambda: {("/gazebo", "publisher", "/clock"): ["rosgraph_msgs/Clock", "http://here:1/"]}
        async with asyncio.timeout(5.0):
            await registrar.run()

    asyncio.run(run())
    assert reasons == ["another node /gazebo, at http://other:1/, has taken its place"]
    assert asked.count("registerPublisher") == 1


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ({"error": "not today", "type": "std_srvs/Trigger"}, "not today"),
        ({"error": "not today"}, "not today"),
        ({"md5sum": "*"}, "its type is not known"),
        ({"type": "std_srvs/Unheard"}, None),
    ],
)
def test_a_service_that_refuses_or_does_not_say_its_type_is_not_called(answer, reason):
    async def run():
        async def refuse(reader, writer):
            await reader.readexactly(*struct.unpack("<I", await reader.readexactly(4)))
            writer.write(encode_header(answer))
            writer.close()

        async with await asyncio.start_server(refuse, "127.0.0.1", 0) as server:
            host, port = server.sockets[0].getsockname()
            await call_service(f"rosrpc://{host}:{port}", "/x", "/light", new)

    told = f"/light: {reason}" if reason else "/light has the unknown type std_srvs/Unheard"
    with pytest.raises(CommandError, match=f"^{re.escape(told)}$"):
        asyncio.run(run())
