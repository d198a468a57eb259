"""What a registrar asks of a master, and what it says when the master goes and comes; time jumps."""

import asyncio
import re
from types import SimpleNamespace
from xmlrpc.client import Fault

import pytest

from rosbridge_client import Skipping
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.network import Notices
from vrx_mj.ros.ros1 import registrar as module
from vrx_mj.ros.ros1.registrar import Link, MasterAccess, Registrar

URI, API, RPC = "http://127.0.0.1:11311", "http://here:1/", "rosrpc://here:2"
CLOCK, CMD, RESET = ("/gazebo", "publisher", "/clock"), ("/gazebo", "subscriber", "/cmd"), ("/gazebo", "service", "/r")
NONSENSE = 5
WISHED = {CLOCK: ["rosgraph_msgs/Clock", API], CMD: ["std_msgs/Int8", API], RESET: [RPC, API]}


class MasterOfOthers:
    """A master behind a link: it can be away, started anew, or answer nonsense."""

    def __init__(self):
        self.calls, self.state, self.away, self.closed = [], [{}, {}, {}], None, False
        self.types, self.publishers, self.refused = [["/clock", "rosgraph_msgs/Clock"]], ["http://a:1/", 5], ()

    async def many(self, requests, timeout=0.0):
        if self.away:
            raise self.away
        self.calls += [(method, *values) for method, values in requests]
        return [self.answer(method, *values[1:]) for method, values in requests]

    def answer(self, method, *values):
        if method == "getSystemState" and self.state != NONSENSE:
            return [[list(pair) for pair in part.items()] for part in self.state]
        known = {"getSystemState": self.state, "getTopicTypes": self.types, "lookupNode": API}
        verb, _, kind = re.fullmatch("(register|unregister|)(.*?)(Publisher|Subscriber|Service|)", method).groups()
        if not kind or values[0] in self.refused:
            return None if kind else known.get(method, 0)
        nodes = self.state[("Publisher", "Subscriber", "Service").index(kind)] if self.state != NONSENSE else {}
        nodes.pop(values[0], None)
        if verb == "register":
            nodes[values[0]] = ["/gazebo"]
        return self.publishers if kind == "Subscriber" else 1

    def close(self):
        self.closed = True

    def taken(self):
        """The calls since the last time that change something."""
        calls, self.calls = self.calls, []
        return [call for call in calls if not call[0].startswith(("get", "lookup"))]


@pytest.fixture
def scene():
    notices = Notices()
    one = SimpleNamespace(master=MasterOfOthers(), lines=[], seen=[], found=[], wished=dict(WISHED), parameters={})
    notices.listener = lambda level, text: one.lines.append((level, text))
    one.registrar = Registrar("/gazebo", URI, one.master, notices)
    one.registrar.api = API
    one.registrar.wished, one.registrar.parameters = lambda: dict(one.wished), lambda: one.parameters
    one.registrar.publishers = lambda topic, uris: one.found.append((topic, uris))
    one.registrar.seen = lambda state, types: one.seen.append((state, types))
    return one


def played(scene, *acts):
    """Run the registrar on a clock that jumps, with something done after each wait [s]; what is returned by each."""

    async def play():
        running, results = asyncio.ensure_future(scene.registrar.run()), []
        for seconds, act in acts:
            await asyncio.sleep(seconds)
            results.append(act())
        running.cancel()
        return results

    with asyncio.Runner(loop_factory=Skipping) as runner:
        return runner.run(play())


def test_what_is_wished_is_registered_and_what_is_not_is_taken_back(scene):
    scene.parameters["/gain"] = 2.0

    def change():
        del scene.wished[CMD]
        scene.wished[RESET] = ["rosrpc://here:3", API]
        scene.parameters = {"/name": "x"}
        scene.registrar.wake.set()
        return scene.master.taken()

    first, second = played(scene, (0.1, change), (0.1, scene.master.taken))
    assert first == [
        ("setParam", "/gazebo", "/gain", 2.0),
        ("registerPublisher", "/gazebo", "/clock", "rosgraph_msgs/Clock", API),
        ("registerSubscriber", "/gazebo", "/cmd", "std_msgs/Int8", API),
        ("registerService", "/gazebo", "/r", RPC, API),
    ]
    assert second == [
        ("unregisterSubscriber", "/gazebo", "/cmd", API),
        ("unregisterService", "/gazebo", "/r", RPC),
        ("deleteParam", "/gazebo", "/gain"),
        ("setParam", "/gazebo", "/name", "x"),
        ("registerService", "/gazebo", "/r", "rosrpc://here:3", API),
    ]
    assert scene.found == [("/cmd", ["http://a:1/"])]
    assert scene.registrar.settled.is_set()
    assert scene.seen[0][1] == {"/clock": "rosgraph_msgs/Clock"}
    assert scene.seen[0][0][0] == {"/clock": ["/gazebo"]}
    assert scene.lines == []


def test_the_state_is_asked_for_every_two_seconds_and_after_news_at_most_four_times_a_second(scene):
    scene.parameters = {"/gain": 1}
    counts = []

    def look():
        counts.append(len(scene.seen))

    def wake():
        scene.registrar.wake.set()

    played(scene, (0.1, look), (1.8, look), (0.2, look), (0.05, wake), (0.05, look), (0.4, look), (1.5, look))
    assert counts == [1, 1, 2, 2, 3, 3]


def test_a_master_started_anew_gets_all_again_and_one_that_is_away_is_said_once(scene):
    scene.parameters = {"/gain": 1}

    def restart():
        scene.master.state = [{}, {}, {}]
        return scene.master.taken()

    def leave(error):
        scene.master.away = error
        return scene.master.taken()

    acts = [(0.1, restart), (4.0, lambda: leave(ConnectionResetError())), (9.0, lambda: leave(None))]
    acts += [(4.0, lambda: leave(CommandError("no master"))), (4.0, lambda: leave(None)), (4.0, scene.master.taken)]
    results = played(scene, *acts)
    assert [len(calls) for calls in results] == [4, 4, 0, 0, 0, 0]
    away = f"the master at {URI} does not answer (%s): trying again"
    again = ("INFO", f"the master at {URI} answers again")
    assert scene.lines == [("ERROR", away % "ConnectionResetError"), again, ("ERROR", away % "no master"), again]


def test_a_master_that_does_not_register_something_or_reports_no_state_is_said(scene):
    scene.master.refused = {"/cmd"}
    scene.master.state = NONSENSE
    scene.wished = {CMD: WISHED[CMD]}
    played(scene, (0.1, lambda: None))
    text = f"the master at {URI} does not register subscriber /cmd"
    lost = f"the master at {URI} does not answer (the master does not report its state): trying again"
    assert scene.lines == [("ERROR", text), ("ERROR", lost)]
    assert scene.found == []


def test_all_is_withdrawn_and_the_publishers_of_a_topic_are_asked_for_again(scene):
    scene.parameters = {"/gain": 1}

    def forget():
        calls = scene.master.taken()
        scene.registrar.forget("/clock")
        scene.registrar.forget("/cmd")
        return calls

    _, again = played(scene, (0.1, forget), (0.5, scene.master.taken))
    assert again == [("registerSubscriber", "/gazebo", "/cmd", "std_msgs/Int8", API)]
    asyncio.run(scene.registrar.withdraw())
    assert scene.master.taken() == [
        ("unregisterPublisher", "/gazebo", "/clock", API),
        ("unregisterSubscriber", "/gazebo", "/cmd", API),
        ("unregisterService", "/gazebo", "/r", RPC),
        ("deleteParam", "/gazebo", "/gain"),
    ]
    assert scene.master.closed
    asyncio.run(scene.registrar.withdraw())
    assert scene.master.taken() == []


def test_a_master_that_is_away_does_not_keep_the_end_from_coming(scene):
    scene.master.away = ConnectionRefusedError()
    asyncio.run(scene.registrar.withdraw())
    assert scene.master.closed


def linked(monkeypatch, answer):
    """A link, and the calls that its proxy makes, which `answer` answers."""
    calls = []

    async def call(_proxy, method, *values, timeout):
        calls.append((method, *values, timeout))
        return answer(method, *values)

    monkeypatch.setattr(module.Proxy, "call", call)
    return Link(URI), calls


def test_calls_are_sent_together_a_hundred_at_a_time(monkeypatch):
    link, calls = linked(monkeypatch, lambda method, *values: [[[1, "", 7]]] * len(values[0]) if values else [1, "", 8])
    assert asyncio.run(link.many([("getPid", ())])) == [8]
    assert asyncio.run(link.many([("getPid", ("/a", number)) for number in range(201)], 4.0)) == [7] * 200 + [None]
    assert [(call[0], len(call[1]) if call[0] == "system.multicall" else 0, call[-1]) for call in calls[1:]] == [
        ("system.multicall", 100, 4.0), ("system.multicall", 100, 4.0), ("getPid", 0, 4.0),
    ]  # fmt: skip
    assert calls[1][1][3] == {"methodName": "getPid", "params": ["/a", 3]}


def test_a_master_without_multicall_is_asked_one_by_one_from_then_on(monkeypatch):
    def answer(method, *_):
        if method in {"system.multicall", "bad"}:
            raise Fault(1, "no such method")
        return [0, "failed", 3] if method == "no" else [1, "", 9]

    link, calls = linked(monkeypatch, answer)
    for _ in range(2):
        assert asyncio.run(link.many([("yes", ()), ("no", ()), ("bad", ())])) == [9, None, None]
    assert [call[0] for call in calls] == ["system.multicall", *["yes", "no", "bad"] * 2]


@pytest.mark.parametrize("answers", [5, [[[1, "", 7]]]])
def test_an_answer_to_other_calls_is_an_error(monkeypatch, answers):
    link, _ = linked(monkeypatch, lambda *_: answers)
    with pytest.raises(CommandError, match=r"^the master does not answer system\.multicall as ROS does$"):
        asyncio.run(link.many([("a", ()), ("b", ())]))


def test_answers_that_are_none_of_ros_have_no_value(monkeypatch):
    link, _ = linked(monkeypatch, lambda *_: [[[1, "", 7]], 5, [], [[1, ""]], [[0, "", 7]]])
    assert asyncio.run(link.many([("a", ())] * 5)) == [7, None, None, None, None]


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (TimeoutError(), f"no ROS master at {URI}: no answer; port 11311 is held by X"),
        (ConnectionResetError("reset"), f"no ROS master at {URI}: reset; port 11311 is held by X"),
        (Fault(1, "no"), f"the server at {URI} is not a ROS master: <Fault 1: 'no'>; port 11311 is held by X"),
    ],
)
def test_what_is_no_master_is_named_with_who_holds_its_port(monkeypatch, error, message):
    async def ask(*_values, timeout):
        raise error

    monkeypatch.setattr(module, "ask", ask)
    monkeypatch.setattr(module, "who_listens", lambda port: "X" if port == 11311 else None)
    with pytest.raises(NetworkError) as caught:
        asyncio.run(module.open_master(SimpleNamespace(node="/gazebo"), URI, "127.0.0.1", None, None))
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("answers", "message"),
    [
        ({"hasParam": True, "lookupNode": API, "getPid": 7}, "pid 7 on here"),
        ({"hasParam": True, "lookupNode": "http://127.0.0.1:1/", "getPid": 7}, "process 7 (X)"),
        ({"hasParam": True, "lookupNode": "http://127.0.0.1:1/", "getPid": "x"}, "pid x on 127.0.0.1"),
        ({"hasParam": True, "lookupNode": API}, None),
        ({"hasParam": True}, None),
    ],
)
def test_a_second_simulation_of_the_name_is_refused_while_the_first_is_alive(monkeypatch, answers, message):
    async def ask(_uri, method, *_values, timeout):
        if method not in answers:
            raise CommandError("unknown")
        return answers[method]

    monkeypatch.setattr(module, "ask", ask)
    monkeypatch.setattr(module, "is_local", lambda host: host == "127.0.0.1")
    monkeypatch.setattr(module, "shown_process", lambda pid: f"process {pid} (X)")
    opening = module.open_master(SimpleNamespace(node="/gazebo"), URI, "127.0.0.1", None, None)
    if message is None:
        access = asyncio.run(opening)
        assert (access.host, access.master, access.server) == ("127.0.0.1", None, None)
        return
    with pytest.raises(NetworkError) as caught:
        asyncio.run(opening)
    assert str(caught.value) == (
        f"a simulation is already served there: node /gazebo, {message}, or with: rosnode kill /gazebo"
    )


@pytest.mark.parametrize("own", [True, False])
def test_who_leaves_closes_the_connection_and_ends_its_own_master(own):
    closed = []

    async def close(what):
        closed.append(what)

    link = SimpleNamespace(close=lambda: closed.append("link"))
    master, server = (SimpleNamespace(close=lambda what=what: close(what)) for what in ("master", "server"))
    access = MasterAccess("127.0.0.1", link, None, *(master, server) if own else ())
    asyncio.run(access.close())
    assert closed == ["link", "master", "server"][: 3 if own else 1]
