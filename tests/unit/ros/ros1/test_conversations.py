"""Publishers, services, callers and masters of other processes on made-up connections, on a clock that jumps."""

import asyncio
import struct
from types import SimpleNamespace

import pytest

from rosbridge_client import Skipping
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Inbox
from vrx_mj.ros.limits import Intake
from vrx_mj.ros.messages import encode, full_text, md5sum, new, service_md5sum
from vrx_mj.ros.network import Notices
from vrx_mj.ros.ros1 import master, tcpros
from vrx_mj.ros.ros1.connection import decode_header, encode_header, with_length
from vrx_mj.ros.ros1.master import Master, Notifier
from vrx_mj.ros.ros1.tcpros import Client, Publication, Reader, Stream, Subscription, call_service

INT, TRIGGER, URI = "std_msgs/Int8", "std_srvs/Trigger", "http://127.0.0.1:4000/"


def jumping(work):
    """The result of a coroutine on a clock that jumps."""
    with asyncio.Runner(loop_factory=Skipping) as runner:
        return runner.run(work)


class Peer:
    """The other end of a connection: frames that come, at times [s]; after them it ends, or stays silent."""

    def __init__(self, *frames, ends=True):
        self.frames, self.ends, self.sent, self.asked, self.is_open = list(frames), ends, [], [], True
        self.writer, self.reader = SimpleNamespace(write=self.sent.append), self

    async def frame(self, largest, patience=None):
        self.asked.append((largest, patience))
        if not self.frames and (self.ends or patience == 0.0):
            raise EOFError if self.ends else TimeoutError
        async with asyncio.timeout(patience):
            if not self.frames:
                await asyncio.sleep(1e9)
        return self.frames.pop(0)

    async def readexactly(self, count):
        return self.frames.pop(0)[:count]

    def close(self):
        self.is_open = False


def header(**fields):
    return encode_header(fields)[4:]


def numbers(*values):
    return [encode(new(INT, data=value), INT) for value in values]


@pytest.fixture
def scene(monkeypatch):
    one = SimpleNamespace(peers=[], dialled=[], lines=[], taken=[], notices=Notices(), answer=["TCPROS", "h", 7])
    one.notices.listener = lambda level, text: one.lines.append((level, text))

    async def ask(*what, **_):
        one.dialled.append((round(asyncio.get_running_loop().time(), 3), *what))
        if isinstance(one.answer, Exception):
            raise one.answer
        return one.answer

    async def dial(uri, scheme, intake, *, timeout):
        one.dialled.append((uri, scheme, intake.most, timeout))
        if not one.peers:
            raise ConnectionRefusedError("nobody listens")
        return one.peers.pop(0)

    monkeypatch.setattr(tcpros, "ask", ask)
    monkeypatch.setattr(tcpros, "dial", dial)
    return one


def heard(scene, seconds, *peers):
    """A subscription for so long, with the connections that it gets; what it counts at the end."""

    async def run():
        scene.peers = list(peers)
        take = lambda *what: scene.taken.append((what[0], what[1].data, *what[2:]))  # noqa: E731
        topic = Subscription("/gazebo", "/a", INT, take, Intake(99), scene.notices)
        topic.update([URI, URI, "http://" + "x" * 1100])
        (source,) = topic.sources.values()
        await asyncio.sleep(seconds)
        found = source.received, source.messages, source.peer
        await topic.close()
        return found

    return jumping(run())


GREETING = header(callerid="/pub", md5sum=md5sum(INT), type=INT)


def test_a_publishers_messages_are_taken_with_its_name(scene):
    peer = Peer(GREETING, *numbers(1, 2, 3), ends=False)
    assert heard(scene, 1.0, peer) == (3, 3, peer)
    assert scene.taken == [("/a", value, "/pub", False) for value in (1, 2, 3)]
    assert scene.dialled == [
        (0.0, URI, "requestTopic", "/gazebo", "/a", [["TCPROS"]]), ("tcpros://h:7", "tcpros", 99, 10.0)
    ]  # fmt: skip
    assert decode_header(peer.sent[0][4:]) == {
        "callerid": "/gazebo", "md5sum": md5sum(INT), "message_definition": full_text(INT), "tcp_nodelay": "1",
        "topic": "/a", "type": INT,
    }  # fmt: skip
    assert peer.asked[0] == (1 << 18, 10.0)
    assert peer.asked[1] == (1 << 22, None)
    assert not peer.is_open
    assert scene.lines == []


@pytest.mark.parametrize(
    ("greeting", "sender", "latched"),
    [
        ({"md5sum": "*", "latching": "1"}, URI, True),
        ({"md5sum": md5sum(INT), "callerid": "/" + "n" * 2000}, None, False),
        ({"md5sum": "*", "callerid": "/p", "latching": "0"}, "/p", False),
    ],
)  # fmt: skip
def test_a_publisher_is_named_as_its_header_says(scene, greeting, sender, latched):
    heard(scene, 0.1, Peer(header(**greeting), *numbers(1), ends=False))
    assert scene.taken == [("/a", 1, sender or "/" + "n" * 1023, latched)]


def test_latched_messages_up_to_a_megabyte_are_kept(scene, monkeypatch):
    monkeypatch.setattr(tcpros, "decode", lambda frame, _kind: SimpleNamespace(data=len(frame)))
    limit = 1 << 20
    heard(scene, 0.1, Peer(header(md5sum="*", latching="1"), bytes(limit), bytes(limit + 1), ends=False))
    assert scene.taken == [("/a", limit, URI, True), ("/a", limit + 1, URI, False)]


@pytest.mark.parametrize(
    ("greeting", "why"),
    [
        (header(error="go away " * 99), "it reports: " + ("go away " * 99)[:300]),
        (header(md5sum="0", type="a/B"), f"it sends [a/B/0], but this topic is [{INT}/{md5sum(INT)}]"),
        (header(type="a/B"), f"it sends [a/B/], but this topic is [{INT}/{md5sum(INT)}]"),
        (header(md5sum="0"), f"it sends [?/0], but this topic is [{INT}/{md5sum(INT)}]"),
    ],
)
def test_why_nothing_comes_of_a_publisher_is_said_once(scene, greeting, why):
    heard(scene, 20.0, *(Peer(greeting) for _ in range(9)))
    assert scene.lines[0] == ("WARN", f"/a: no messages from its publisher at {URI}: {why}")
    assert len(scene.lines) == 1


@pytest.mark.parametrize("answer", [5, [], ["UDPROS", "h", 7], ["TCPROS", "h", "7"], ["TCPROS", 7, 7]])
def test_an_answer_without_an_address_is_said(scene, answer):
    scene.answer = answer
    heard(scene, 0.1)
    why = f"it answers {str(answer)[:60]!r} instead of its TCPROS address"
    assert scene.lines == [("WARN", f"/a: no messages from its publisher at {URI}: {why}")]


def test_a_publisher_is_tried_again_after_longer_and_longer_pauses_until_it_has_sent_something(scene):
    scene.answer = TimeoutError()
    heard(scene, 33.0)
    assert [one[0] for one in scene.dialled] == [0.0, 1.0, 3.0, 7.0, 15.0, 23.0, 31.0]
    assert scene.lines == [("WARN", f"/a: no messages from its publisher at {URI}: it does not answer")]
    scene.answer, scene.dialled[:] = ["TCPROS", "h", 7], []
    heard(scene, 4.0, Peer(GREETING, *numbers(1)), Peer(GREETING), Peer(GREETING))
    asked = [one[0] for one in scene.dialled if isinstance(one[0], float)]
    assert asked == [0.0, 0.5, 1.5, 3.5]


def test_of_a_flood_the_newest_are_taken_and_then_none_for_a_while(scene):
    peer = Peer(GREETING, *numbers(*[number % 100 for number in range(1200)]), ends=False)
    taken = scene.taken
    assert heard(scene, 0.19, peer)[:2] == (64, 1000)
    assert [one[1] for one in taken] == [number % 100 for number in range(936, 1000)]
    taken.clear()
    peer = Peer(GREETING, *numbers(*[number % 100 for number in range(1200)]), ends=False)
    assert heard(scene, 0.21, peer)[:2] == (128, 1200)


def test_bytes_end_a_bite_too(scene, monkeypatch):
    monkeypatch.setattr(tcpros, "decode", lambda frame, _kind: SimpleNamespace(data=len(frame)))
    peer = Peer(GREETING, *[bytes(1 << 15)] * 70, ends=False)
    heard(scene, 0.1, peer)
    assert [patience for _, patience in peer.asked[1:8]] == [None, 0.0, 0.0, None, 0.0, 0.0, None]


def called(scene, peer, make=lambda kind: new(f"{kind}Request")):
    scene.peers = [peer]
    try:
        return jumping(call_service("rosrpc://h:1", "/me", "/s", make))
    finally:
        assert not peer.is_open


def test_a_service_is_called_by_the_type_that_it_says(scene):
    body = encode(new(f"{TRIGGER}Response", success=True, message="away"), f"{TRIGGER}Response")
    peer = Peer(header(type=TRIGGER, md5sum=service_md5sum(TRIGGER)), b"\x01", body)
    kind, response = called(scene, peer)
    assert (kind, response.success, response.message) == (TRIGGER, True, "away")
    assert decode_header(peer.sent[0][4:]) == {"callerid": "/me", "md5sum": "*", "service": "/s"}
    assert peer.sent[1] == with_length(b"")
    assert [patience for _, patience in peer.asked] == [10.0, None]
    assert scene.dialled == [("rosrpc://h:1", "rosrpc", 1 << 22, 10.0)]
    probe = Peer(header(type=TRIGGER, md5sum="*"))
    assert called(scene, probe, None) == (TRIGGER, None)
    assert decode_header(probe.sent[0][4:])["probe"] == "1"
    assert len(probe.sent) == 1


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ([header(type=TRIGGER, error="e" * 999)], "/s: " + "e" * 300),
        ([header(md5sum="*")], "/s: its type is not known"),
        ([header(type="a/B", md5sum="*")], "/s has the unknown type a/B"),
        ([header(type=TRIGGER, md5sum="0")], f"/s: its {TRIGGER} differs from ours"),
        ([header(type=TRIGGER)], f"/s: its {TRIGGER} differs from ours"),
        ([header(type=TRIGGER, md5sum="*"), b"\x00", b"f" * 1500], "/s: " + "f" * 1000),
    ],
)
def test_why_a_service_cannot_be_called_is_said(scene, frames, message):
    with pytest.raises(CommandError) as caught:
        called(scene, Peer(*frames))
    assert str(caught.value) == message


class Full:
    """A connection that takes all, and holds it until it is drained."""

    def __init__(self):
        self.held, self.got, self.drained = 0, [], asyncio.Event()
        self.writer = SimpleNamespace(transport=self, drain=self.drain)

    async def drain(self):
        await self.drained.wait()
        self.drained.clear()
        self.held = 0

    def set_write_buffer_limits(self, high):
        self.high = high

    def get_write_buffer_size(self):
        return self.held

    def is_closing(self):
        return False

    def write(self, piece):
        self.got.append(len(piece))
        self.held += len(piece)

    async def readexactly(self, count):
        self.expected = count
        await asyncio.sleep(60.0)
        raise EOFError


def test_a_reader_that_is_full_gets_the_rest_later_and_the_oldest_are_dropped():
    async def run():
        topic = Publication(Stream("/gazebo"), "/a", "std_msgs/String")
        peer = Full()
        peer.reader = peer
        reader = Reader(topic, peer, "/x")
        topic.join(reader)
        staying = asyncio.ensure_future(reader.stay())
        large = 3 * (1 << 18)
        topic.send(new("std_msgs/String", data="x" * (large - 8)))
        await asyncio.sleep(1.0)
        assert peer.got == [1 << 18] * 2
        for _ in range(258):
            topic.send(new("std_msgs/String", data="y"))
        assert (topic.stream.counts.dropped, reader.messages) == (2, 1)
        for _ in range(2):
            peer.drained.set()
            await asyncio.sleep(1.0)
        assert peer.got == [1 << 18] * 3 + [9] * 256
        assert (reader.messages, reader.sent) == (257, large + 9 * 256)
        assert topic.stream.counts.sent == reader.sent
        assert peer.high == 1 << 18
        await asyncio.gather(staying, return_exceptions=True)
        assert topic.readers == set()
        assert peer.expected == 1 << 16
        assert topic.stream.counts.waiting == 0

    jumping(run())


def test_messages_with_a_header_are_numbered_by_each_topic():
    topic, peer = Publication(Stream("/gazebo"), "/a", "std_msgs/Header"), Full()
    other, frames = Publication(Stream("/gazebo"), "/b", "sensor_msgs/Imu"), []
    peer.write = lambda piece: frames.append(struct.unpack_from("<I", bytes(piece), 4)[0])
    for one in (topic, other):
        one.join(Reader(one, peer, "/x"))
    for seq in (7, 9):
        topic.send(new("std_msgs/Header", seq=seq))
        other.send(new("sensor_msgs/Imu", header={"seq": seq}))
    assert frames == [7, 0, 9, 1]


def test_so_many_names_of_subscribers_are_remembered():
    topic = Publication(Stream("/gazebo"), "/a", INT)
    for number in range(1001):
        assert topic.refusal({"callerid": f"/{number}", "md5sum": "*"}) is None
        assert len(topic.met) == (number + 1 if number < 1000 else 1)
    assert topic.refusal({"callerid": "/" + "n" * 2000, "md5sum": "*"}) is None
    assert max(map(len, topic.met)) == 1024


class Nodes:
    """Nodes that are called: what each was told, and how it answers."""

    def __init__(self, monkeypatch):
        self.calls, self.answers, self.closed = [], {}, []
        nodes = self

        class Proxy:
            def __init__(self, uri, largest):
                self.uri = uri
                assert largest < 1 << 24

            async def call(self, method, *values, timeout):
                nodes.calls.append((self.uri, method, *values))
                answer = nodes.answers.get(self.uri)
                if isinstance(answer, Exception):
                    raise answer
                await asyncio.sleep(0.0 if answer is None else answer)
                assert timeout == 5.0

            def close(self):
                nodes.closed.append(self.uri)

        monkeypatch.setattr(master, "Proxy", Proxy)


def test_of_calls_about_one_thing_only_the_newest_is_made(monkeypatch):
    nodes, dead = Nodes(monkeypatch), []
    nodes.answers = {"b": ConnectionRefusedError(), "c": TimeoutError()}

    async def run():
        notifier = Notifier(dead.append)
        for number in range(3):
            for api in "abc":
                notifier.notify(api, "publisherUpdate", "/x", [number])
        notifier.notify("a", "paramUpdate", "/x", 5)
        await asyncio.sleep(1.0)
        assert (notifier._waiting, notifier._tasks) == ({}, {})
        notifier.notify("a", "shutdown", "bye")
        await asyncio.sleep(1.0)
        await notifier.close()

    jumping(run())
    of_a = [call for call in nodes.calls if call[0] == "a"]
    assert of_a == [
        ("a", "publisherUpdate", "/master", "/x", [2]), ("a", "paramUpdate", "/master", "/x", 5),
        ("a", "shutdown", "/master", "bye"),
    ]  # fmt: skip
    assert dead == ["b"]
    assert sorted(nodes.closed) == ["a", "a", "b", "c"]


def test_so_many_nodes_and_calls_wait_and_the_slowest_node_goes(monkeypatch):
    nodes = Nodes(monkeypatch)
    nodes.answers = {str(number): 1e6 for number in range(600)}
    monkeypatch.setattr(master, "_MOST_CALLS", 3)

    async def run():
        notifier = Notifier(print)
        for number in range(513):
            notifier.notify(str(number), "shutdown", "bye")
        await asyncio.sleep(0.1)
        assert len(notifier._tasks) == 512
        assert "0" not in notifier._waiting
        for about in "abcdb":
            notifier.notify("512", "paramUpdate", about, 1)
        assert [about for _, about in notifier._waiting["512"]] == ["a", "b", "c"]
        await notifier.close()

    jumping(run())


def test_nodes_that_no_longer_listen_are_forgotten_within_a_sweep(monkeypatch):
    visited = []

    async def open_connection(host, port, family):
        visited.append((round(asyncio.get_running_loop().time(), 2), port))
        if port == 2:
            raise ConnectionRefusedError
        if port == 3:
            raise TimeoutError
        return None, SimpleNamespace(transport=SimpleNamespace(abort=lambda: visited.append("closed")))

    monkeypatch.setattr(master.asyncio, "open_connection", open_connection)

    async def run():
        graph = Graph(None, Inbox())
        graph.open("http://h:9/", "rosrpc://h:8")
        for number in (1, 2, 3):
            graph.register_remote("publisher", "/x", f"/n{number}", f"http://h:{number}/", INT)
        own = Master(graph, "http://h:11311/")
        own._notifier = SimpleNamespace(notify=lambda *_: None, close=lambda: asyncio.sleep(0))
        own.deliver = lambda *_: None
        own.start()
        await asyncio.sleep(4.5)
        assert set(graph.registrations.nodes) == {"/gazebo", "/n1", "/n3"}
        await own.close()
        assert graph.wires == []

    jumping(run())
    assert [one for one in visited if one != "closed"][:3] == [(1.0, 1), (2.0, 2), (3.0, 3)]
    assert visited.count("closed") == 1


@pytest.mark.parametrize(
    ("method", "values", "answer"),
    [
        ("getPublishedTopics", ("", ), (1, "current topics", [["/rosout", "rosgraph_msgs/Log"]])),
        ("getPublishedTopics", ("/", ), (1, "current topics", [["/rosout", "rosgraph_msgs/Log"]])),
        ("getPublishedTopics", ("/r", ), (1, "current topics", [])),
        ("getPublishedTopics", ("b c", ), (-1, "ERROR: parameter [subgraph] is not a name", [])),
        ("searchParam", (5, ), (-1, "ERROR: parameter [key] is not a relative or absolute name", 0)),
        ("searchParam", ("~p", ), (-1, "ERROR: parameter [key] is not a relative or absolute name", 0)),
        ("searchParam", ("", ), (-1, "ERROR: parameter [key] is not a relative or absolute name", 0)),
        ("lookupNode", ("/rosbridge/client_1", ),
         (-1, "[/rosbridge/client_1] is a client of rosbridge, which nobody can call", "")),
        ("shutdown", ("now", ), (0, "this master ends with its simulation", 0)),
        ("getUri", (), (1, "", "http://h:11311/")),
        ("setParam", ("p", 5), (1, "parameter /p set", 0)),
        ("getParamNames", (), (1, "Parameter names", [])),
        ("subscribeParam", ("http://h:1/", "q"), (1, "Subscribed to parameter [/q]", {})),
        ("unsubscribeParam", ("http://h:1/", "q"), (1, "[/t] is not a known provider of [/q]", 0)),
        ("hasParam", ("q",), (1, "/q", False)),
    ],
)  # fmt: skip
def test_answers_of_the_master(method, values, answer):
    graph = Graph(None, Inbox())
    graph.open("http://h:9/", "rosrpc://h:8")
    graph.local.add("/rosbridge/client_1")
    own = Master(graph, "http://h:11311/")
    assert own.call(method, ("/t", *values)) == answer
    assert own.call(method, ("n" * 1025, *values))[0] == -1
    assert own.call(method, ("n" * 1024, *values))[0] == answer[0]


@pytest.fixture
def caller(monkeypatch):
    """A caller of a made-up master, what it asked, and the answers that it gets; time goes on while it sleeps."""
    one = SimpleNamespace(asked=[], now=0.0, answers={})

    class Proxy:
        def __init__(self, uri):
            assert uri == URI

        async def call(self, *what):
            one.asked.append(what)
            return one.answers.get(what[0], [-1, "no", 0])

        def close(self):
            pass

    def sleep(seconds):
        one.now += seconds

    monkeypatch.setattr(tcpros, "Proxy", Proxy)
    monkeypatch.setattr(tcpros, "time", SimpleNamespace(monotonic=lambda: one.now, sleep=sleep))
    monkeypatch.setenv("ROS_NAMESPACE", "/team/")
    one.client = Client("me", URI)
    return one


def test_a_caller_of_a_master_has_its_namespace(caller):
    client = caller.client
    assert (client.name, client.namespace) == ("/team/me", "/team/")
    assert Client("me", URI, "").name == "/me"
    with pytest.raises(CommandError, match=rf"^no parameter /team/p at the master {URI}$"):
        client.parameter("p")
    caller.answers["getParam"] = [1, "", 7]
    assert client.parameter("/p") == 7
    assert caller.asked == [("getParam", "/team/me", "/team/p"), ("getParam", "/team/me", "/p")]
    caller.answers["getParam"] = 5
    with pytest.raises(NetworkError, match=rf"^no answer from a ROS master at {URI}: "):
        client.parameter("p")


def test_a_caller_waits_so_long_for_a_service_and_calls_it_by_its_type(caller, monkeypatch):
    client = caller.client
    with pytest.raises(NetworkError, match=rf"^no service /s within 1 s at the master {URI}$"):
        client.wait("/s", 1.0)
    assert caller.now == pytest.approx(1.2)
    with pytest.raises(NetworkError, match=rf"^no service /s at the master {URI}$"):
        client.call("/s", TRIGGER, None)
    caller.answers["lookupService"] = [1, "", "rosrpc://h:1"]
    client.wait("/s", 1.0)

    async def refused(*_):
        raise ConnectionRefusedError("refused")

    monkeypatch.setattr(tcpros, "call_service", refused)
    with pytest.raises(NetworkError, match=r"^the service /s at rosrpc://h:1: refused$"):
        client.call("/s", TRIGGER, None)

    async def of_its_type(_uri, _name, _service, make):
        return TRIGGER, make("a/B")

    monkeypatch.setattr(tcpros, "call_service", of_its_type)
    with pytest.raises(CommandError, match=rf"^/s is of type a/B, not {TRIGGER}$"):
        client.call("/s", TRIGGER, None)
    assert client.call("/s", "a/B", "asked") == "asked"
