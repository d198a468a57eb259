"""Our node on Debian's roscore; who is told what when a master, or another simulation, is there already."""

import http.server
import os
import re
import socket
import threading
from contextlib import ExitStack, contextmanager, suppress
from xmlrpc.client import ServerProxy

import pytest

from ros1_peer import dial, stream_of
from ros1_served import LEFT, Served, free_port, needs_tools, running, small_table, tools, until
from vrx_mj.errors import NetworkError
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Inbox
from vrx_mj.ros.network import Network, announced_address, is_local
from vrx_mj.ros.ros1 import Ros1

GONE = "127.0.0.9"


def roscore(port, home):
    return running(["/usr/bin/rosmaster", "--core", "-p", str(port)], port, home)


def answers(uri):
    def call():
        try:
            with ServerProxy(uri) as master:
                return master.getPid("/test")[0] == 1
        except OSError:
            return False

    return call


def state(uri):
    """All that the master knows of `/gazebo`: names of topics it publishes, listens to, and of services."""
    with ServerProxy(uri) as master:
        return [{name for name, nodes in part if "/gazebo" in nodes} for part in master.getSystemState("/test")[2]]


def parameters(uri):
    with ServerProxy(uri) as master:
        return set(master.getParamNames("/test")[2])


@pytest.mark.slow
@needs_tools
def test_on_a_roscore_that_is_killed_and_started_again_everything_returns(tmp_path, caplog):
    caplog.set_level("INFO", "vrx_mj.ros")
    port = free_port()
    uri = f"http://127.0.0.1:{port}"
    own = [
        {"/rosout", "/clock", "/course", "/wamv/imu"},
        {LEFT},
        {"/gazebo/reset_world", "/trigger", "/failing", "/gazebo/get_loggers", "/gazebo/set_logger_level"},
    ]
    given = {"/robot_description", "/wamv/gains/p", "/wamv/gains/names"}
    with roscore(port, tmp_path) as first:
        until(answers(uri), "roscore")
        with ExitStack() as stack:
            served = stack.enter_context(Served(port, small_table("wamv")))
            assert re.fullmatch(rf"ROS 1: the master at {uri}, node /gazebo at http://127\.0\.0\.1:\d+/", *served.lines)
            assert state(uri) == own
            assert given <= parameters(uri)
            said = tools(f"rostopic echo -n 1 /course; rostopic pub -1 {LEFT} std_msgs/Float32 0.5", port, tmp_path)
            assert 'data: "gate 3"' in said
            assert [one.message.data for one in served.commands] == [0.5]
            served.offer(small_table("boat"))
            assert state(uri)[0] == own[0] - {"/wamv/imu"} | {"/boat/imu"}
            served.offer(small_table("wamv"))
            first.kill()
            first.wait(5.0)
            until(lambda: "trying again" in caplog.text, "the master is missed")
            with roscore(port, tmp_path):
                until(answers(uri), "roscore again")
                until(lambda: state(uri) == own, "all is registered again")
                until(lambda: given <= parameters(uri), "all parameters are set again")
                stack.close()
                assert state(uri) == [set(), set(), set()]
                assert not given & parameters(uri)
    lines = [message for message in caplog.messages if "the master at" in message]
    assert len(lines) == 2
    assert re.fullmatch(rf"the master at {uri} does not answer \(.*\): trying again", lines[0])
    assert lines[1] == f"the master at {uri} answers again"


def refusal(uri, **options):
    """Why a second one cannot start."""
    network = Network()
    try:
        with pytest.raises(NetworkError) as caught:
            Ros1(Graph(network, Inbox()), master_uri=uri, **options).start()
    finally:
        network.close()
    return str(caught.value)


SINCE = rf"process {os.getpid()} \(.*\), since \d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d; to stop it: kill {os.getpid()}"


def test_a_second_simulation_on_a_master_is_told_who_is_there():
    with Served(free_port(), small_table("wamv")) as served:
        told = refusal(served.uri)
        with Served(served.port, small_table("wamv2"), node="/other") as other:
            assert other.lines[0].startswith(f"ROS 1: the master at {served.uri}, node /other at ")
            assert "/wamv2/imu" in {name for name, _ in other_topics(served.uri)}
    assert re.fullmatch(
        rf"a simulation is already served there: node /gazebo, {SINCE}, or with: rosnode kill /gazebo", told
    )


def other_topics(uri):
    with ServerProxy(uri) as master:
        return master.getPublishedTopics("/test", "")[2]


@contextmanager
def listening(handler):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


class Page(http.server.BaseHTTPRequestHandler):
    """A web server that knows nothing of XML-RPC."""

    def do_POST(self):
        self.send_error(405)

    def log_message(self, *_):
        pass


def test_what_is_no_master_is_named_with_its_process():
    with listening(Page) as port:
        told = refusal(f"http://127.0.0.1:{port}")
    uri = f"http://127.0.0.1:{port}"
    assert re.fullmatch(
        rf"the server at {uri} is not a ROS master: {uri} answers 'HTTP/1\.0 405 Method Not Allowed' instead of "
        rf"XML-RPC; port {port} is held by {SINCE}",
        told,
    )


def test_a_master_that_is_elsewhere_or_nowhere(monkeypatch):
    port = free_port()
    with monkeypatch.context() as patch:
        patch.setattr("vrx_mj.ros.ros1.registrar.is_local", lambda host: False)
        assert refusal(f"http://{GONE}:{port}") == (
            f"no ROS master answers at http://{GONE}:{port}, and {GONE} is another machine: start roscore there, "
            "or unset ROS_MASTER_URI to start a master here"
        )
    assert refusal("roscore") == "ROS_MASTER_URI: invalid URI 'roscore': http://host:port is needed"
    with monkeypatch.context() as patch:
        patch.setattr("vrx_mj.ros.ros1.registrar.addresses", lambda host: ["10.9.8.7"])
        assert refusal(f"http://{GONE}:{port}") == (
            f"no ROS master answers at http://{GONE}:{port}, and this server listens at 127.0.0.1 only: "
            f"give --host {GONE} or --host 0.0.0.0"
        )
    with socket.create_server(("127.0.0.1", 0)) as mute:
        port = mute.getsockname()[1]
        monkeypatch.setattr("vrx_mj.ros.ros1.registrar.MASTER_TIMEOUT", 0.1)
        told = refusal(f"http://127.0.0.1:{port}")
    assert re.fullmatch(
        rf"no ROS master at http://127\.0\.0\.1:{port}: no answer; port {port} is held by {SINCE}", told
    )


@pytest.mark.parametrize("name", ["localhost", GONE])
def test_the_master_is_where_the_uri_says(name):
    network, port = Network(), free_port()
    ros = Ros1(Graph(network, Inbox()), master_uri=f"http://{name}:{port}/")
    try:
        assert ros.start()[0].startswith(f"ROS 1: own master at http://{name}:{port}, node /gazebo at http://127.0")
        with ServerProxy(f"http://{name}:{port}") as master:
            assert master.getUri("/test")[2] == f"http://127.0.0.1:{port}/"
    finally:
        ros.close()
        network.close()


def test_the_address_that_others_are_told_is_that_of_ros_ip(monkeypatch):
    monkeypatch.setenv("ROS_IP", GONE)
    with Served(free_port(), small_table("wamv"), host="0.0.0.0") as served:
        assert served.lines[0].startswith(f"ROS 1: own master at {served.uri}, node /gazebo at http://{GONE}:")
        assert len(served.lines) == 1
        assert stream_of(served.uri, "/course")[0] == GONE
        connection, _ = dial(stream_of(served.uri, "/course"), topic="/course")
        connection.close()
    with Served(free_port(), small_table("wamv")) as served:
        assert served.lines[1] == (
            f"ROS 1: nodes get the address {GONE} (ROS_HOSTNAME or ROS_IP), but this server listens at 127.0.0.1 only: "
            f"give --host {GONE} or --host 0.0.0.0"
        )
    monkeypatch.setenv("ROS_HOSTNAME", "boat.local")
    assert announced_address("0.0.0.0", "localhost") == "boat.local"
    monkeypatch.delenv("ROS_HOSTNAME")
    monkeypatch.delenv("ROS_IP")
    assert announced_address("localhost", "localhost") == "127.0.0.1"
    assert is_local(announced_address("0.0.0.0", "127.0.0.1"))


def test_a_dead_simulations_registration_is_taken_over():
    port = free_port()
    with Served(port, small_table("wamv"), node="/keeper") as keeper, ServerProxy(keeper.uri) as master:
        master.registerPublisher("/gazebo", "/old/topic", "std_msgs/Float32", f"http://127.0.0.1:{free_port()}/")
        with Served(port, small_table("boat")):
            topics = dict(other_topics(keeper.uri))
            assert "/boat/imu" in topics
            assert "/old/topic" not in topics


def test_nodes_that_died_are_forgotten(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.ros1.master.SWEEP_PERIOD", 0.1)
    with Served(free_port(), small_table("wamv")) as served, ServerProxy(served.uri) as master:
        master.registerSubscriber("/dead", "/wamv/imu", "sensor_msgs/Imu", f"http://127.0.0.1:{free_port()}/")
        assert master.lookupNode("/test", "/dead")[0] == 1
        until(lambda: master.lookupNode("/test", "/dead")[0] == -1, "the dead node is forgotten")
        assert master.lookupNode("/test", "/gazebo")[0] == 1


def test_nobody_takes_the_name_of_the_node_whose_master_is_in_the_same_process():
    mute = socket.create_server(("127.0.0.1", 0))
    with mute, Served(free_port(), small_table("wamv")) as served, ServerProxy(served.uri) as master:
        own = master.lookupNode("/test", "/gazebo")[2]
        api = f"http://127.0.0.1:{mute.getsockname()[1]}/"
        refused = [-1, "ERROR: /gazebo is the simulation's own node: another name is needed", 0]
        assert master.registerPublisher("/gazebo", "/other", "std_msgs/Float32", api) == refused
        assert master.unregisterPublisher("/gazebo", "/clock", own) == refused
        for uri in (own, own.replace("127.0.0.1", "localhost"), api):  # nor has the master tell it to end
            assert master.registerPublisher("/other", "/other", "std_msgs/Float32", uri)[0] == 1
        mute.settimeout(5.0)
        with ServerProxy(own) as node:
            until(lambda: not served.ros._access.master._notifier._tasks, "the master has told all")
            assert node.getPid("/test")[0] == 1
        assert not served.ended.is_set()
        assert "/clock" in dict(other_topics(served.uri))


def test_a_new_node_of_the_same_name_ends_the_old_one():
    mute, port = socket.create_server(("127.0.0.1", 0)), free_port()
    with (
        mute,
        Served(port, small_table("boat"), node="/keeper"),
        Served(port, small_table("wamv")) as served,
        ServerProxy(served.uri) as master,
    ):
        api = f"http://127.0.0.1:{mute.getsockname()[1]}/"
        master.registerPublisher("/gazebo", "/other", "std_msgs/Float32", api)
        assert served.ended.wait(5.0)
        assert served.reason in {
            "/master shut it down: [/gazebo] Reason: new node registered with same name",
            f"another node /gazebo, at {api}, has taken its place",
        }
        served.ros.close()
        mute.settimeout(0.0)
        told = b""
        with suppress(BlockingIOError):
            while True:
                peer, _ = mute.accept()
                with peer:
                    told += peer.recv(4096)
        assert b"shutdown" not in told
