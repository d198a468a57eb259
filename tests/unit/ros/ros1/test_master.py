"""The master's methods, without a network."""

from xmlrpc.client import Fault

import pytest

from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Inbox, RosInterface, Service
from vrx_mj.ros.ros1.master import Master

A, B = "http://127.0.0.1:1/", "http://127.0.0.1:2/"

METHODS = """
    registerPublisher registerSubscriber registerService unregisterPublisher unregisterSubscriber unregisterService
    lookupNode lookupService getPublishedTopics getTopicTypes getSystemState getUri getPid shutdown
    setParam getParam hasParam deleteParam searchParam subscribeParam unsubscribeParam getParamNames
    system.listMethods system.multicall
"""


class Told:
    """In place of the notifier."""

    def __init__(self):
        self.calls = []

    def notify(self, api, method, about, *values):
        self.calls.append((api, method, about, *values))


def mastered(graph):
    """A master whose node tells nobody of TCPROS."""
    master = Master(graph, "http://127.0.0.1:11311/")
    master._notifier = Told()
    master.deliver = lambda *_: None
    graph.wires.append(master)
    return master


@pytest.fixture
def master():
    return mastered(Graph(None, Inbox(), "/simulation"))


def call(master, method, *values):
    return master.call(method, values)


def state(master):
    """What other nodes than the simulation's have registered."""
    return [[pair for pair in part if pair[1] != ["/simulation"]] for part in call(master, "getSystemState", "/t")[2]]


def test_topics_come_and_go_and_subscribers_are_told(master):
    assert call(master, "registerSubscriber", "/b", "/x", "std_msgs/Int8", B) == (
        1,
        "Registered [/b] as subscriber of [/x]",
        [],
    )
    assert call(master, "registerPublisher", "/ns/a", "/x", "std_msgs/Int8", A)[2] == [B]
    assert call(master, "registerPublisher", "/ns/a", "y", "*", A)[1] == "Registered [/ns/a] as publisher of [/ns/y]"
    assert call(master, "getTopicTypes", "/t")[2] == [
        ["/ns/y", "*"],
        ["/rosout", "rosgraph_msgs/Log"],
        ["/x", "std_msgs/Int8"],
    ]
    assert call(master, "getPublishedTopics", "/t", "/ns")[2] == [["/ns/y", "*"]]
    assert state(master) == [[["/x", ["/ns/a"]], ["/ns/y", ["/ns/a"]]], [["/x", ["/b"]]], []]
    assert call(master, "unregisterPublisher", "/ns/a", "/x", A)[2] == 1
    assert call(master, "unregisterPublisher", "/ns/a", "/x", A) == (1, "[/ns/a] is not a known provider of [/x]", 0)
    assert master._notifier.calls == [(B, "publisherUpdate", "/x", [A]), (B, "publisherUpdate", "/x", [])]
    assert call(master, "lookupNode", "/t", "/ns/a") == (1, "node api", A)
    call(master, "unregisterPublisher", "/ns/a", "/ns/y", A)
    assert call(master, "lookupNode", "/t", "/ns/a") == (-1, "unknown node [/ns/a]", "")


def test_the_last_to_register_a_service_has_it(master):
    call(master, "registerService", "/a", "/s", "rosrpc://h:1", A)
    call(master, "registerService", "/b", "/s", "rosrpc://h:2", B)
    assert call(master, "lookupService", "/t", "/s")[2] == "rosrpc://h:2"
    assert call(master, "lookupNode", "/t", "/a")[0] == -1
    assert call(master, "unregisterService", "/a", "/s", "rosrpc://h:1")[2] == 0
    assert call(master, "unregisterService", "/b", "/s", "rosrpc://h:2")[2] == 1
    assert call(master, "lookupService", "/t", "/s") == (-1, "no provider", "")


def test_a_new_node_of_a_name_ends_the_old_one_and_its_topics(master):
    call(master, "registerPublisher", "/a", "/x", "std_msgs/Int8", A)
    call(master, "registerSubscriber", "/b", "/x", "std_msgs/Int8", B)
    call(master, "registerPublisher", "/a", "/y", "std_msgs/Int8", "http://127.0.0.1:3/")
    assert master._notifier.calls == [
        (A, "shutdown", "[/a] Reason: new node registered with same name"),
        (B, "publisherUpdate", "/x", []),
    ]
    assert state(master)[0] == [["/y", ["/a"]]]


@pytest.mark.parametrize("name", ["/gazebo", "gazebo", "/gazebo/", "//gazebo"])
@pytest.mark.parametrize(
    ("method", "values"),
    [
        ("registerPublisher", ("/x", "std_msgs/Int8", B)),
        ("registerSubscriber", ("/x", "std_msgs/Int8", B)),
        ("registerService", ("/s", "rosrpc://h:1", B)),
        ("unregisterPublisher", ("/clock", A)),
        ("unregisterSubscriber", ("/cmd", A)),
        ("unregisterService", ("/s", "rosrpc://h:0")),
        ("subscribeParam", (B, "/p")),
        ("unsubscribeParam", (A, "/p")),
    ],
)
def test_nobody_takes_the_name_of_the_simulations_own_node(name, method, values):
    master = mastered(Graph(None, Inbox()))
    master.graph.open(A, "rosrpc://h:0")
    own = [
        ("registerPublisher", "/clock", "rosgraph_msgs/Clock", A),
        ("registerSubscriber", "/cmd", "std_msgs/Int8", A),
        ("registerService", "/s", "rosrpc://h:0", A),
        ("subscribeParam", A, "/p"),
    ]
    for what, *rest in own:
        assert call(master, what, "/gazebo", *rest)[0] == 1
    before = call(master, "getSystemState", "/t")[2]
    answer = master.answer(method, [name, *values], "127.0.0.1")
    assert answer == [-1, "ERROR: /gazebo is the simulation's own node: another name is needed", 0]
    assert call(master, "getSystemState", "/t")[2] == before
    assert call(master, "lookupNode", "/t", "/gazebo")[2] == A
    assert master._notifier.calls == []
    assert master.answer(method, ["/other", *values], "127.0.0.1")[0] == 1


def test_parameters_are_relative_to_the_caller_and_others_are_told(master):
    call(master, "setParam", "/ns/a", "~gain", 2)
    assert call(master, "subscribeParam", "/b", B, "/ns/a")[2] == {"gain": 2}
    call(master, "setParam", "/ns/a", "a/gain", 3)
    call(master, "setParam", "/b", "/ns/a/gain", 4)  # who sets it knows
    call(master, "deleteParam", "/ns/c", "a/gain")
    assert master._notifier.calls == [(B, "paramUpdate", "/ns/a/gain/", 3), (B, "paramUpdate", "/ns/a/gain/", {})]
    assert call(master, "unsubscribeParam", "/b", B, "/ns/a")[2] == 1
    assert call(master, "hasParam", "/b", "/ns/a/gain") == (1, "/ns/a/gain", False)
    assert call(master, "getParam", "/b", "/ns/a/gain") == (-1, "Parameter [/ns/a/gain] is not set", 0)
    assert call(master, "deleteParam", "/b", "/no") == (-1, "parameter [/no] is not set", 0)
    assert call(master, "searchParam", "/ns/a", "none")[:2] == (-1, "Cannot find parameter [none] in an upwards search")


@pytest.mark.parametrize(
    ("method", "values", "text"),
    [
        ("getPid", (), "caller_id must be a string of at most 1024 characters"),
        ("getPid", (5,), "caller_id must be a string of at most 1024 characters"),
        ("getPid", ("/a", 1), "Error: bad call arity"),
        ("lookupNode", ("/a", "b c"), "ERROR: \"'b c'\" is not a name"),
        ("registerPublisher", ("/a", "/x", "Int8", A), "ERROR: \"'Int8'\" is not a type"),
        (
            "registerPublisher",
            ("/a", "/x", "a/B", "ftp://x"),
            "ERROR: \"'ftp://x'\" is not a URI like http://host:port",
        ),
        (
            "registerPublisher",
            ("/a", "/x", "a/B", "std_msgs/String"),
            "ERROR: \"'std_msgs/String'\" is not a URI like http://host:port",
        ),
        ("registerService", ("/a", "/x", A, A), f"ERROR: \"'{A}'\" is not a URI like rosrpc://host:port"),
        ("getParam", ("/a", ""), "ERROR: \"''\" is not a name of a parameter"),
        ("setParam", ("/a", "/x", None), "a NoneType cannot be the value of a parameter"),
        ("setParam", ("/a", "/x", {"deep": [None]}), "a NoneType cannot be the value of a parameter"),
    ],
)
def test_wrong_calls_are_told_what_is_wrong(master, method, values, text):
    assert master.call(method, values)[:2] == (-1, text.replace('"', ""))


def test_a_method_that_there_is_not_is_a_fault(master):
    with pytest.raises(Fault) as caught:
        master.answer("noSuchThing", ["/a"], "127.0.0.1")
    assert caught.value.faultString == 'method "noSuchThing" is not supported'


def test_every_method_of_ros_is_there(master):
    listed = set(master.answer("system.listMethods", [], "127.0.0.1"))
    for method in METHODS.split():
        assert method in listed
    assert len(listed) == len(METHODS.split())


def test_who_waits_for_a_service_of_gazebo_that_is_not_there_is_told_the_nearest(master):
    said = []
    master.graph.notices.listener = lambda level, text: said.append(text)
    master.graph.offer(RosInterface(services={"/gazebo/reset": Service("/gazebo/reset", "std_srvs/Empty", str)}))
    for _ in range(3):
        assert call(master, "lookupService", "/team", "/gazebo/resets") == (-1, "no provider", "")
    nearest = "no service named '/gazebo/resets'; did you mean '/gazebo/reset'?"
    assert said == [f"/team asks for the service /gazebo/resets: {nearest}"]
