"""How long rosbridge waits for its clients, and how many it lets in, on a made-up server of websockets."""

import asyncio
from types import SimpleNamespace

import pytest

from vrx_mj.errors import NetworkError
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Inbox
from vrx_mj.ros.rosbridge import Rosbridge, server
from vrx_mj.ros.rosbridge.codec import MOST_INCOMING


class Network:
    """Runs what it is given at once, and notes for how long it may take [s]."""

    def __init__(self):
        self.loop, self.timeouts = SimpleNamespace(is_closed=lambda: False), []

    def call(self, work, timeout):
        self.timeouts.append(timeout)
        return asyncio.run(work)


@pytest.fixture
def opened(monkeypatch):
    """A bridge, what its server was opened with, and what became of it."""
    network = Network()
    bridge = Rosbridge(Graph(network, Inbox()), port=0, host="::1")
    scene = SimpleNamespace(bridge=bridge, network=network, options={}, closed=[], stalls=False)

    async def wait_closed():
        await asyncio.sleep(3600.0 if scene.stalls else 0.0)

    async def serve(_serve, host, port, **options):
        scene.options |= options | {"host": host, "port": port}
        sockets = [SimpleNamespace(getsockname=lambda: (host, 4711))]
        return SimpleNamespace(sockets=sockets, close=lambda: scene.closed.append("server"), wait_closed=wait_closed)

    monkeypatch.setattr(server, "serve", serve)
    scene.lines = bridge.start()
    return scene


def test_a_client_is_pinged_every_half_minute_and_has_a_minute_to_answer(opened):
    own = {key: opened.options[key] for key in ("ping_interval", "ping_timeout", "open_timeout", "close_timeout")}
    assert own == {"ping_interval": 30.0, "ping_timeout": 60.0, "open_timeout": 10.0, "close_timeout": 0.5}
    assert (opened.options["max_size"], opened.options["max_queue"]) == (MOST_INCOMING, 2)
    assert opened.options["compression"] is None
    assert opened.lines == ["rosbridge: ws://[::1]:4711"]
    assert (opened.options["host"], opened.options["port"]) == ("::1", 0)


def test_clients_that_do_not_leave_within_a_second_are_cut_off(opened, monkeypatch):
    opened.bridge._hub.clients[1] = SimpleNamespace(abort=lambda: opened.closed.append("client"))
    opened.bridge.close()
    assert opened.closed == ["server"]
    opened.stalls = True
    monkeypatch.setattr(server, "_CLOSE_TIMEOUT", 0.01)
    opened.bridge.close()
    assert opened.closed == ["server", "server", "client"]
    assert opened.network.timeouts == [10.0, 2.0, 0.02]


def test_a_bridge_that_was_not_opened_has_nothing_to_close():
    network = Network()
    bridge = Rosbridge(Graph(network, Inbox()), port=65535)
    bridge.close()
    network.loop.is_closed = lambda: True
    bridge.close()
    assert network.timeouts == [2.0]


@pytest.mark.parametrize("port", [-1, 65536])
def test_ports_are_from_1_to_65535(port):
    with pytest.raises(NetworkError) as caught:
        Rosbridge(Graph(Network(), Inbox()), port=port)
    assert str(caught.value) == f"rosbridge: invalid port {port}; allowed: 1 to 65535, or 0 for any free one"


def test_so_much_is_held_for_a_client_and_an_operation_more_is_refused(monkeypatch):
    hub = server.Hub(Graph(SimpleNamespace(soon=lambda function, *values: function(*values)), Inbox()))
    connection = SimpleNamespace(remote_address=("10.0.0.7", 4000))
    client = server.Client(connection, SimpleNamespace(host="10.0.0.7"), hub)
    for number in range(4096):
        client._topics[f"/{number}"] = server.Advertisement("std_msgs/Int8", latch=False)
        if number == 4094:
            client._check_room({"op": "advertise"})
    with pytest.raises(server.CommandError) as caught:
        client._check_room({"op": "advertise"})
    assert str(caught.value) == "advertise: this client has 4096 topics, services and calls; no more are accepted"


def test_latched_messages_of_a_client_are_kept_up_to_so_many_characters():
    hub = server.Hub(Graph(SimpleNamespace(), Inbox()))
    client = server.Client(SimpleNamespace(remote_address=("h", 1)), SimpleNamespace(host="h"), hub)
    for name in ("/a", "/b"):
        client._topics[name] = server.Advertisement("std_msgs/String", latch=True)
    assert client._keep("/a", MOST_INCOMING - 5)
    assert not client._keep("/b", 6)
    assert client._keep("/b", 5)
    assert client._keep("/a", 7)
    assert [one.kept for one in client._topics.values()] == [7, 5]
    assert not client._keep("/a", MOST_INCOMING - 4)


def test_fragments_of_a_client_have_so_many_characters():
    held = []
    fragments = server.Fragments(SimpleNamespace(hold=lambda _place, size: held.append(size)), None)

    def add(identity, number, data, total=3):
        return fragments.add({"op": "fragment", "id": identity, "total": total, "num": number, "data": data})

    assert add("a", 0, "xyz") is None
    assert add("a", 0, "xy") is None  # it replaces the one before
    assert add("b", 2, "z", 4) is None
    assert add("a", 2, "!") is None
    assert add("a", 1, "-") == "xy-!"
    assert held == [103, 102, 203, 304, 101]
    with pytest.raises(server.CommandError, match=rf"^fragment: more than {MOST_INCOMING} characters of incomplete m"):
        add("c", 0, "x" * (MOST_INCOMING - 200))
    assert held[-1] == 0
    assert add("c", 0, "x" * (MOST_INCOMING - 100)) is None
    assert held[-1] == MOST_INCOMING
