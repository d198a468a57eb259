"""One graph of ROS: what a client of rosbridge does is seen by ROS 1's nodes, and the other way round."""

import json
import time
from xmlrpc.client import ServerProxy

import pytest

from ros1_peer import ME, dial, frame, frame_of, service_of, stream_of
from ros1_served import Served, free_port, small_table, trigger, until
from rosbridge_client import Talk
from vrx_mj.errors import CommandError
from vrx_mj.ros.interface import Delivery, Input, Output, RosInterface, Service
from vrx_mj.ros.messages import new

pytestmark = pytest.mark.slow

STRING, LEFT = "std_msgs/String", "/wamv/thrusters/left_thrust_cmd"
TALKER, LATCHED, HEARD = "/talker/chatter", "/talker/map", "/client/chatter"


def refuse(_request):
    raise CommandError("the pump is broken")


def talker_table():
    """What another node has: two topics, one of them latched, one that it listens to, and two services."""
    outputs = [Output(TALKER, STRING, lambda: None), Output(LATCHED, STRING, lambda: None, latched=True)]
    inputs = [Input(HEARD, STRING, lambda _: None)]
    services = [
        Service("/talker/trigger", "std_srvs/Trigger", trigger),
        Service("/talker/pump", "std_srvs/Trigger", refuse),
    ]
    return RosInterface(
        *({one.name: one for one in part} for part in (outputs, inputs, services)), {"/talker/gain": 2.5}
    )


@pytest.fixture(scope="module", params=["own master", "another master"])
def served(request):
    """A simulation on ROS 1 and rosbridge, with a master of its own or on that of another process."""
    port = free_port()
    if request.param == "own master":
        with Served(port, small_table("wamv"), rosbridge=True) as one:
            yield one
    else:
        core = RosInterface({"/course": Output("/course", STRING, lambda: None)})
        with Served(port, core, node="/core"), Served(port, small_table("wamv"), rosbridge=True) as one:
            yield one


@pytest.fixture(scope="module")
def talker(served):
    """Another node, with connections of its own."""
    with Served(served.port, small_table(), node="/talker") as one:
        one.offer(talker_table())
        one.wires.publish([Delivery(one.table.outputs[LATCHED], new(STRING, data="shore"), 0.0)])
        yield one


@pytest.fixture
def talk(served):
    with Talk(served) as one:
        yield one


@pytest.fixture
def other(served):
    with Talk(served) as one:
        yield one


@pytest.fixture
def master(served):
    with ServerProxy(served.uri, allow_none=True) as one:
        yield one


def state(master, kind):
    """Nodes by name, of publishers (0), subscribers (1) or services (2)."""
    return dict(master.getSystemState(ME)[2][kind])


def values(talk, name, /, **request):
    return talk.call(f"/rosapi/{name}", request)["values"]


def hear(talk, seconds=10.0):
    """The next message of a topic."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = talk.hear()
        if message["op"] == "publish":
            return message["msg"]
    raise AssertionError(f"no message within {seconds} s")


def test_who_commands_thrusts_is_known_whatever_the_wire(served, talk, master):
    assert served.wires.publishers(LEFT) == []
    talk.say("advertise", topic=LEFT, type="std_msgs/Float32")
    talk.sync()
    (client,) = served.wires.publishers(LEFT)
    assert client.startswith("/rosbridge/client_")
    assert master.registerPublisher("/mixer", LEFT, "std_msgs/Float32", "http://127.0.0.1:4000/")[0] == 1
    until(lambda: set(served.wires.publishers(LEFT)) == {client, "/mixer"}, "/mixer is known")
    master.unregisterPublisher("/mixer", LEFT, "http://127.0.0.1:4000/")
    talk.say("unadvertise", topic=LEFT)
    until(lambda: served.wires.publishers(LEFT) == [], "nobody is left")


def test_a_parameter_is_the_same_for_all(talk, master):
    assert values(talk, "set_param", name="/dock/gains", value='{"p": 1.5, "names": ["a"]}') == {}
    assert master.getParam(ME, "/dock/gains") == [1, "Parameter [/dock/gains]", {"p": 1.5, "names": ["a"]}]
    assert master.setParam(ME, "/dock/gains/p", 2)[0] == 1
    assert json.loads(values(talk, "get_param", name="/dock/gains")["value"]) == {"p": 2, "names": ["a"]}
    assert values(talk, "has_param", name="/dock/gains/p") == {"exists": True}
    assert values(talk, "search_param", name="dock") == {"global_name": "/dock"}
    assert set(values(talk, "get_param_names")["names"]) == set(master.getParamNames(ME)[2])
    assert values(talk, "delete_param", name="/dock") == {}
    assert master.hasParam(ME, "/dock") == [1, "/dock", False]
    assert values(talk, "get_param", name="/dock", default="7") == {"value": "7"}
    assert master.getParam(ME, "/wamv/gains")[2] == {"p": 1.5, "names": ["a", "b"]}
    assert json.loads(values(talk, "get_param", name="/wamv/gains/p")["value"]) == 1.5


def test_a_topic_of_a_client_is_there_for_all(served, talker, talk, other, master):
    talk.say("advertise", topic="/chat", type=STRING, latch=True)
    talk.sync()
    until(lambda: "/chat" in state(master, 0), "the master lists it")
    (node,) = state(master, 0)["/chat"]
    assert node.startswith("/rosbridge/client_")
    assert ["/chat", STRING] in master.getPublishedTopics(ME, "")[2]
    talk.say("publish", topic="/chat", msg={"data": "kept"})
    talk.sync()
    connection, header = dial(stream_of(served.uri, "/chat"), topic="/chat")
    with connection:
        assert (header["type"], header["latching"]) == (STRING, "1")
        assert frame_of(connection) == frame(b"kept")
        other.say("subscribe", topic="/chat")
        assert hear(other) == {"data": "kept"}
        talk.say("publish", topic="/chat", msg={"data": "ahoy"})
        assert frame_of(connection) == frame(b"ahoy")
        assert hear(other) == {"data": "ahoy"}
    talk.say("unadvertise", topic="/chat")
    talk.sync()
    until(lambda: "/chat" not in state(master, 0), "the master has forgotten it")


def test_a_client_is_heard_by_a_node_of_another_process(talker, talk):
    talker.commands.clear()
    talk.say("advertise", topic=HEARD, type=STRING)
    deadline = time.monotonic() + 15.0
    while not talker.commands and time.monotonic() < deadline:
        talk.say("publish", topic=HEARD, msg={"data": "over there"})
        talk.sync()
        time.sleep(0.1)
    assert talker.commands[0].message.data == "over there"


def test_a_topic_of_another_process_is_there_for_clients(talker, talk, other):
    until(lambda: TALKER in values(talk, "topics")["topics"], "rosapi lists it")
    assert values(talk, "topic_type", topic=TALKER) == {"type": STRING}
    assert values(talk, "publishers", topic=TALKER) == {"publishers": ["/talker"]}
    talk.say("subscribe", topic=LATCHED)
    assert hear(talk) == {"data": "shore"}
    other.say("subscribe", topic=LATCHED)
    assert hear(other) == {"data": "shore"}
    talk.say("unsubscribe", topic=LATCHED)
    talk.say("subscribe", topic=TALKER)
    talk.sync()
    until(lambda: TALKER in talker.wires.subscribed_topics, "the connection")
    talker.wires.publish([Delivery(talker.table.outputs[TALKER], new(STRING, data="hello"), 1.0)])
    assert hear(talk) == {"data": "hello"}
    talk.say("unsubscribe", topic=TALKER)
    talk.sync()
    until(lambda: TALKER not in talker.wires.subscribed_topics, "the connection's end")


def test_commands_of_all_wires_come_to_the_simulation(served, talk):
    served.commands.clear()
    talk.say("publish", topic=LEFT, msg={"data": 0.5})
    talk.sync()
    until(lambda: served.commands, "the command")
    assert [(one.topic, one.message.data) for one in served.commands] == [(LEFT, 0.5)]


def test_rosapi_and_the_master_list_the_same(talker, talk, other, master):
    other.say("subscribe", topic="/clock")
    talk.say("advertise_service", service="/lights", type="std_srvs/Trigger")
    other.sync(), talk.sync()

    def listed():
        by_master = [state(master, kind) for kind in range(3)]
        nodes = {node for part in by_master for names in part.values() for node in names}
        topics, services = {*by_master[0], *by_master[1]}, set(by_master[2])
        by_rosapi = [set(values(talk, kind)[kind]) for kind in ("nodes", "topics", "services")]
        return [nodes, topics, services] == by_rosapi and "/lights" in services

    until(listed, "both list the same nodes, topics and services")
    nodes = values(talk, "nodes")["nodes"]
    assert nodes[0] == "/gazebo"
    assert {"/talker", *(node for node in nodes if node.startswith("/rosbridge/client_"))} <= set(nodes)
    assert master.lookupService(ME, "/rosapi/topics")[0] == 1


def test_a_service_of_a_client_is_called_over_tcpros(served, talk, master):
    talk.say("advertise_service", service="/lights", type="std_srvs/Trigger")
    talk.sync()
    until(lambda: master.lookupService(ME, "/lights")[0] == 1, "the master lists it")
    connection, header = dial(service_of(served.uri, "/lights"), service="/lights")
    with connection:
        assert header["type"] == "std_srvs/Trigger"
        connection.sendall(frame(b""))
        asked = talk.hear()
        assert (asked["op"], asked["service"], asked["args"]) == ("call_service", "/lights", {})
        talk.say(
            "service_response",
            id=asked["id"],
            service="/lights",
            values={"success": True, "message": "on"},
            result=True,
        )
        assert connection.recv(1) == b"\1"
        assert frame_of(connection) == b"\1" + frame(b"on")


def test_services_that_only_clients_of_rosbridge_can_call_say_so_to_others(served, talk, master):
    talk.say("advertise_service", service="/strange", type="some_msgs/Unknown")
    talk.sync()
    until(lambda: master.lookupService(ME, "/strange")[0] == 1, "the master lists it")
    for name, kind in (("/strange", "some_msgs/Unknown"), ("/rosapi/topics", "rosapi/Topics")):
        connection, header = dial(service_of(served.uri, name), service=name)
        with connection:
            why = f"[{name}] has the type [{kind}], which only clients of rosbridge can call"
            assert header == {"error": why}


def test_a_service_of_another_process_is_called_by_a_client(talker, talk):
    until(lambda: "/talker/trigger" in values(talk, "services")["services"], "rosapi lists it")
    assert values(talk, "service_type", service="/talker/trigger") == {"type": "std_srvs/Trigger"}
    assert values(talk, "service_node", service="/talker/trigger") == {"node": "/talker"}
    response = talk.call("/talker/trigger")
    assert (response["result"], response["values"]) == (True, {"success": True, "message": "ok"})
    refused = talk.call("/talker/pump")
    assert (refused["result"], refused["values"]) == (False, "/talker/pump: the pump is broken")


def test_a_client_that_goes_takes_its_node_with_it(served, master):
    with Talk(served) as gone:
        gone.say("advertise", topic="/brief", type=STRING)
        gone.sync()
        until(lambda: "/brief" in state(master, 0), "the master lists it")
        (node,) = state(master, 0)["/brief"]
    until(lambda: "/brief" not in state(master, 0), "the master has forgotten it")
    assert master.lookupNode(ME, node)[0] == -1


def test_nobody_can_end_the_simulation_by_the_name_of_a_client(served, talk, master):
    talk.say("advertise", topic="/mine", type=STRING)
    talk.sync()
    until(lambda: "/mine" in state(master, 0), "the master lists it")
    (node,) = state(master, 0)["/mine"]
    if served.ros._access.master is not None:  # another master has the URI of this process
        assert master.lookupNode(ME, node) == [-1, f"[{node}] is a client of rosbridge, which nobody can call", ""]
        refused = [-1, f"ERROR: {node} is the simulation's own node: another name is needed", 0]
        assert master.unregisterPublisher(node, "/mine", "http://127.0.0.1:1/") == refused
