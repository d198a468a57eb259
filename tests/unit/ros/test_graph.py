"""One graph: what each wire is told, and what a change means to the others."""

from xmlrpc.client import dumps, loads

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros.graph import LEVELS, ROSOUT, Graph, Registrations, Service
from vrx_mj.ros.interface import Delivery, Inbox, Input, Output, RosInterface
from vrx_mj.ros.interface import Service as Offered
from vrx_mj.ros.messages import new
from vrx_mj.ros.parameters import plain
from work import calls_at_most

STRING, CLIENT, TALKER = "std_msgs/String", "/rosbridge/client_1", "/talker"
URI = "http://127.0.0.1:4000/"


class Wire:
    """Keeps what it is told."""

    listened = frozenset({"/info", "/elsewhere"})

    def __init__(self):
        self.sent, self.set, self.changed, self.taken = [], [], [], []

    def registration_changed(self, kind, name):
        self.changed.append((kind, name))

    def node_replaced(self, node, uri):
        self.taken.append((node, uri))

    def deliver(self, name, type_name, message):
        self.sent.append((name, message.data if type_name == STRING else message))

    def parameter_changed(self, key, value, setter):
        self.set.append((key, value, setter))


@pytest.fixture
def graph():
    made = Graph(None, Inbox())
    made.wires += [Wire(), Wire()]
    made.offer(table())
    return made


def table(**parameters):
    return RosInterface(
        {"/info": Output("/info", STRING, lambda: None, latched=True)},
        {"/order": Input("/order", STRING, lambda _: None)},
        {"/reset": Offered("/reset", "std_srvs/Empty", lambda _: None)},
        parameters or {"/sim": {"rate": 10, "name": "bay"}, "/use_sim_time": True},
    )


def text(data):
    return new(STRING, data=data)


def test_what_the_simulation_publishes_goes_to_every_wire_and_waits_for_who_comes_late(graph):
    graph.send(Delivery(graph.table.outputs["/info"], text("gate 3"), 2.5))
    assert [wire.sent for wire in graph.wires] == [[("/info", "gate 3")]] * 2
    assert [message.data for message in graph.latched_messages("/info")] == ["gate 3"]
    assert graph.time == 2.5
    assert graph.inbox.drain()[0] == []


def test_a_message_goes_to_the_simulation_and_to_all_wires_but_the_one_that_it_came_by(graph):
    one, other = graph.wires
    graph.publish("/order", STRING, text("go"), TALKER, origin=one)
    assert (one.sent, other.sent) == ([], [("/order", "go")])
    (command,) = graph.inbox.drain()[0]
    assert (command.topic, command.message.data, command.sender) == ("/order", "go", TALKER)


def test_only_outputs_that_somebody_listens_to_are_wanted(graph):
    assert graph.subscribed_topics == {"/info"}


def test_nodes_of_this_process_and_of_others_are_in_one_list(graph):
    graph.open(URI, "rosrpc://127.0.0.1:4001")
    graph.register("publisher", "/chat", CLIENT, STRING)
    graph.register_remote("subscriber", "/chat", TALKER, "http://127.0.0.1:1/", "*")
    assert graph.registrations.state("publisher") == [
        [ROSOUT, ["/gazebo"]],
        ["/info", ["/gazebo"]],
        ["/chat", [CLIENT]],
    ]
    assert graph.registrations.apis("publisher", "/chat") == [URI]
    assert graph.registrations.holders("subscriber", "/chat") == {TALKER: "http://127.0.0.1:1/"}
    assert graph.topics() == {"/chat": STRING, "/info": STRING, "/order": STRING, ROSOUT: "rosgraph_msgs/Log"}
    assert set(graph.registrations.nodes) == {"/gazebo", CLIENT, TALKER}
    graph.forget(CLIENT)
    graph.unregister_remote("subscriber", "/chat", TALKER, "http://127.0.0.1:1/")
    assert graph.type_of("/chat") is None
    assert set(graph.registrations.nodes) == {"/gazebo"}


def test_the_uris_of_what_is_registered_already_are_those_of_the_wire_that_opens(graph):
    graph.open(URI, "rosrpc://127.0.0.1:4001")
    assert graph.registrations.apis("publisher", "/info") == [URI]
    assert graph.registrations.apis("service", "/reset") == ["rosrpc://127.0.0.1:4001"]
    assert graph.registrations.nodes == {"/gazebo": URI}


def test_a_table_takes_the_place_of_the_one_before_and_what_stays_stays(graph):
    graph.send(Delivery(graph.table.outputs["/info"], text("old"), 0.0))
    wire = graph.wires[0]
    wire.changed.clear()
    graph.offer(RosInterface({"/info": Output("/info", "std_msgs/Int8", lambda: None)}, table().inputs, {}, {}))
    assert wire.changed == [("publisher", "/info"), ("service", "/reset"), ("publisher", "/info")]
    assert graph.latched_messages("/info") == []
    assert graph.type_of("/info") == "std_msgs/Int8"
    assert "/reset" not in graph.services
    assert graph.parameters.names() == []


def test_what_a_node_latched_goes_with_it(graph):
    graph.register("publisher", "/map", CLIENT, STRING, latched=True)
    assert graph.is_latched("/map")
    graph.publish("/map", STRING, text("shore"), CLIENT, latched=True)
    assert len(graph.latched_messages("/map")) == 1
    graph.unregister("publisher", "/map", CLIENT)
    assert graph.latched_messages("/map") == []
    assert not graph.is_latched("/map")


def test_a_registration_beyond_the_limit_leaves_nothing_behind(graph, monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.graph.MOST_REGISTRATIONS", 0)
    before = set(graph.local)
    with pytest.raises(CommandError, match=r"^more than 0 registrations$"):
        graph.register("publisher", "/map", CLIENT, STRING, latched=True)
    assert graph.local == before
    assert not graph.is_latched("/map")


def test_a_mirror_has_the_nodes_of_another_master_and_leaves_those_of_this_process(graph):
    state = [{"/scan": [TALKER], "/info": ["/gazebo", TALKER]}, {"/info": [TALKER]}, {"/map": [TALKER]}]
    graph.mirror(state, {"/scan": "sensor_msgs/LaserScan"})
    assert graph.topics()["/scan"] == "sensor_msgs/LaserScan"
    assert list(graph.registrations.holders("publisher", "/info")) == ["/gazebo", TALKER]
    graph.mirror([{}, {}, {}], {})
    assert "/scan" not in graph.topics()
    assert list(graph.registrations.holders("publisher", "/info")) == ["/gazebo"]
    assert set(graph.registrations.nodes) == {"/gazebo"}


def test_a_service_of_a_node_goes_with_it(graph):
    graph.provide("/lights", Service(CLIENT, "std_srvs/Trigger", lambda *_: None))
    assert graph.services["/lights"].node == CLIENT
    graph.forget(CLIENT)
    assert "/lights" not in graph.services
    assert graph.registrations.apis("service", "/lights") == []


def test_a_namespace_is_a_mapping_of_what_is_in_it(graph):
    assert graph.parameters.get("/sim") == {"rate": 10, "name": "bay"}
    assert graph.parameters.get("/sim/rate") == 10
    assert sorted(graph.parameters.names()) == ["/sim/name", "/sim/rate", "/use_sim_time"]
    assert graph.parameters.has("/sim")
    assert not graph.parameters.has("/si")


def test_a_value_gives_way_to_a_namespace_of_its_name_and_the_other_way_round(graph):
    graph.set_parameter("/mine", 2, TALKER)
    graph.set_parameter("/mine/deep", {"er": 3}, TALKER)
    assert graph.parameters.get("/mine") == {"deep": {"er": 3}}
    assert "/mine" not in graph.parameters.names()
    graph.set_parameter("/mine", 4, TALKER)
    assert graph.parameters.get("/mine") == 4
    assert [name for name in graph.parameters.names() if "mine" in name] == ["/mine"]
    assert graph.wires[1].set[-1] == ("/mine", 4, TALKER)


def test_what_others_set_can_go_but_not_the_simulation_s_own(graph):
    graph.set_parameter("/sim/rate", 20, TALKER)
    assert graph.parameters.get("/sim/rate") == 20
    graph.delete_parameter("/sim/rate")
    assert graph.parameters.get("/sim/rate") == 10
    graph.set_parameter("/sim/gain", 1, TALKER)
    graph.delete_parameter("/sim")
    assert graph.parameters.get("/sim") == {"rate": 10, "name": "bay"}
    with pytest.raises(CommandError) as raised:
        graph.delete_parameter("/sim/rate")
    assert str(raised.value) == "/sim/rate: the parameter belongs to the simulation and cannot be deleted"
    with pytest.raises(KeyError):
        graph.delete_parameter("/nothing")


def test_parameters_that_the_simulation_sets_anew_or_no_more(graph):
    graph.set_parameter("/use_sim_time", False, TALKER)
    graph.offer(table(**{"/use_sim_time": True, "/boat": "wamv"}))
    assert graph.parameters.get("/use_sim_time") is False  # nothing is new about it
    assert sorted(graph.parameters.names()) == ["/boat", "/use_sim_time"]


def test_a_search_goes_from_the_inner_namespace_outwards(graph):
    graph.set_parameter("/a/b/gain", 1, TALKER)
    graph.set_parameter("/a/gain", 2, TALKER)
    assert graph.parameters.search("/a/b/c", "gain") == "/a/b/gain"
    assert graph.parameters.search("/a", "gain") == "/a/gain"
    assert graph.parameters.search("/a/b", "use_sim_time") == "/use_sim_time"
    assert graph.parameters.search("/a/b", "none") is None


def test_levels_of_rosout(graph):
    sent, answers = graph.wires[0].sent, []
    graph.clock = 2.5
    graph.log("INFO", "hello")
    request = type("Request", (), {"level": "ERROR"})
    call = graph.services["/gazebo/set_logger_level"].call
    call(request, "/x", lambda *answer: answers.append(answer))
    graph.log("WARN", "not told")
    graph.log("ERROR", "told")
    lines = [message for name, message in sent if name == ROSOUT]
    assert [(one.msg, one.level, one.name, one.header.stamp.nanosec) for one in lines] == [
        ("hello", LEVELS["INFO"], "/gazebo", 500_000_000),
        ("told", LEVELS["ERROR"], "/gazebo", 500_000_000),
    ]
    request.level = "loud"
    call(request, "/x", lambda *answer: answers.append(answer))
    assert answers[1] == (None, "no level 'loud'; known: debug, info, warn, error, fatal")


def test_as_many_registrations_as_there_are_count(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.graph.MOST_REGISTRATIONS", 3)
    registrations = Registrations(lambda *_: None)
    for _ in range(3):  # the same, again and again: removed one by one, all at once, and under another URI
        for kind, name in (("publisher", "/a"), ("publisher", "/b"), ("service", "/c")):
            registrations.add(kind, name, TALKER, URI)
        with pytest.raises(CommandError, match=r"^more than 3 registrations$"):
            registrations.add("publisher", "/d", TALKER, URI)
        registrations.remove("publisher", "/a", TALKER, URI)
        registrations.forget(TALKER)


def test_many_nodes_on_one_topic_take_time_in_proportion():
    registrations = Registrations(lambda *_: None)
    with calls_at_most(400_000):
        for index in range(20_000):
            registrations.add("subscriber", "/scan", f"/node_{index}", URI)
        for index in range(20_000):
            assert registrations.remove("subscriber", "/scan", f"/node_{index}", URI) == 1
    assert registrations.names("subscriber") == []


def test_a_service_over_the_limit_is_not_there(graph, monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.graph.MOST_REGISTRATIONS", 0)
    with pytest.raises(CommandError, match=r"^more than 0 registrations$"):
        graph.provide("/lights", Service(CLIENT, "std_srvs/Trigger", lambda *_: None))
    assert "/lights" not in graph.services


def test_a_topic_has_the_type_of_its_last_publisher_else_of_a_subscriber_else_of_the_master(graph):
    graph.mirror([{}, {"/chat": ["/far"]}, {}], {"/chat": "std_msgs/Bool", "/gone": STRING})
    assert (graph.type_of("/chat"), graph.type_of("/gone")) == ("std_msgs/Bool", None)
    graph.register_remote("subscriber", "/chat", TALKER, URI, "std_msgs/Int32")
    assert graph.type_of("/chat") == "std_msgs/Int32"
    graph.register_remote("publisher", "/chat", "/old", "http://127.0.0.1:1/", "std_msgs/Int8")
    graph.register_remote("publisher", "/chat", "/new", "http://127.0.0.1:2/", "std_msgs/Int16")
    graph.register_remote("publisher", "/chat", "/any", "http://127.0.0.1:3/", "*")
    assert graph.type_of("/chat") == "std_msgs/Int16"
    graph.register("subscriber", "/chat", CLIENT, STRING)
    assert graph.type_of("/chat") == STRING
    graph.forget(CLIENT)
    assert graph.type_of("/chat") == "std_msgs/Int16"


@pytest.mark.parametrize("kind", ["publisher", "subscriber"])
@pytest.mark.parametrize("name", ["/info", "/order"])
def test_the_types_of_our_topics_are_ours(graph, kind, name):
    graph.register_remote(kind, name, TALKER, URI, "std_msgs/Int32")
    assert graph.type_of(name) == STRING
    graph.mirror(({name: [TALKER]}, {}, {}), {name: "std_msgs/Int32"})
    assert graph.type_of(name) == STRING


@pytest.mark.parametrize("kind", ["publisher", "subscriber"])
@pytest.mark.parametrize("name", ["/info", "/order"])
def test_a_type_that_another_node_gave_a_topic_before_gives_way_to_ours(kind, name):
    graph = Graph(None, Inbox())
    graph.register_remote(kind, name, TALKER, URI, "std_msgs/Int32")
    assert graph.type_of(name) == "std_msgs/Int32"
    graph.offer(table())
    assert graph.type_of(name) == STRING


@pytest.mark.parametrize("text", ["\0", "a\x1b", "\ud800", "\ufffe"])
@pytest.mark.parametrize("value", [lambda text: text, lambda text: [{"a": text}], lambda text: {text: 1}])
def test_a_parameter_that_xml_cannot_carry_is_refused(graph, text, value):
    why = rf"^a value has the character U\+{ord(text[-1]):04X}, which XML-RPC cannot carry$"
    with pytest.raises(CommandError, match=why):
        graph.set_parameter("/sim/name", value(text), TALKER)
    assert graph.parameters.get("/sim/name") == "bay"


@given(text=st.text(max_size=20))
def test_parameters_that_are_taken_come_back_from_xml(text):
    try:
        taken = plain(text)
    except CommandError:
        return
    ((back,), _) = loads(dumps((taken,)))
    assert back == text.replace("\r\n", "\n").replace("\r", "\n")


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("/gazebo/set_phisics", "no service named '/gazebo/set_phisics'; did you mean '/gazebo/set_physics'?"),
        ("/vrx/scan_dock/color_sequence", "it belongs to dock tasks; this world has none"),
        ("/gazebo/set_physics", None),
        ("/team/set_phisics", None),
    ],
)
def test_a_service_that_could_be_the_simulations_is_missed_once(name, line):
    said, graph = [], Graph(None, Inbox())
    graph.notices.listener = lambda level, text: said.append((level, text))
    graph.missed_service(name, "/early")  # before there are any services
    services = {"/gazebo/set_physics": Offered("/gazebo/set_physics", "std_srvs/Empty", lambda _: None)}
    elsewhere = {"/vrx/scan_dock/color_sequence": "it belongs to dock tasks; this world has none"}
    graph.offer(RosInterface(services=services, elsewhere=elsewhere))
    for _ in range(3):
        graph.missed_service(name, "/team")
    assert said == ([("WARN", f"/team asks for the service {name}: {line}")] if line else [])
