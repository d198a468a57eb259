"""Who may connect, and where the server cannot be opened."""

import re
import socket

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from bridged import Bridged
from rosbridge_client import Talk
from vrx_mj.adapters.ros.inbox import Inbox
from vrx_mj.adapters.ros.network import Network
from vrx_mj.adapters.ros.rosbridge import Rosbridge
from vrx_mj.errors import NetworkError


@pytest.fixture(scope="module")
def bridged():
    with Bridged() as made:
        yield made


@pytest.mark.parametrize(
    ("host", "origin", "welcome"),
    [
        ("127.0.0.1", None, True),
        ("127.0.0.1", "null", False),
        ("127.0.0.1", "file://", True),
        ("127.0.0.1", "http://localhost:8000", True),
        ("127.0.0.1", "http://127.0.0.1", True),
        ("127.0.0.1", "http://[::1]:80", True),
        ("127.0.0.1", "https://example.com", False),
        ("127.0.0.1", "http://localhost.example.com", False),
        ("127.0.0.1", "http://127.0.0.1.example.com", False),
        ("127.0.0.1", "http://[", False),
        ("0.0.0.0", "https://example.com", True),
    ],
)
def test_pages_of_other_sites_may_not_connect(bridged, monkeypatch, host, origin, welcome):
    monkeypatch.setattr(bridged.bridge, "host", host)
    if welcome:
        with connect(bridged.url, origin=origin):
            return
    with pytest.raises(InvalidStatus) as raised, connect(bridged.url, origin=origin):
        pass
    response = raised.value.response
    assert response.status_code == 403
    assert response.body.decode() == f"pages of {origin} may not connect: only pages of this machine may\n"


def test_a_port_that_is_taken_says_by_whom(bridged):
    network = Network()
    try:
        with pytest.raises(NetworkError) as raised:
            Rosbridge(network, Inbox(), port=bridged.bridge.port).start()
    finally:
        network.close()
    port = bridged.bridge.port
    holder = r"process \d+ \(.*\), since .*; to stop it: kill \d+"
    assert re.fullmatch(rf"rosbridge: port {port} of 127\.0\.0\.1 is taken by {holder}", str(raised.value))


@pytest.mark.parametrize("port", [-1, 65536])
def test_a_port_is_a_port(port):
    with pytest.raises(NetworkError) as raised:
        Rosbridge(None, Inbox(), port=port)
    assert str(raised.value) == f"rosbridge: invalid port {port}; allowed: 1 to 65535, or 0 for any free one"


def test_a_host_that_is_not_this_machine_is_refused():
    with pytest.raises(NetworkError) as raised, Bridged(host="192.0.2.1"):  # RFC 5737: nobody's
        pass
    assert str(raised.value) == "rosbridge: port 0 of 192.0.2.1 cannot be opened: Cannot assign requested address"


def test_so_many_clients_are_taken_and_no_more(bridged, monkeypatch):
    monkeypatch.setattr("vrx_mj.adapters.ros.rosbridge.server.MOST_CLIENTS", 1)
    with Talk(bridged) as talk:
        talk.sync()
        with pytest.raises(InvalidStatus) as raised, connect(bridged.url):
            pass
    assert raised.value.response.status_code == 503
    bridged.wait(lambda b: b.bridge.traffic.clients == 0)


def test_handshakes_that_do_not_end_leave_room_for_others(bridged):
    peers = [socket.create_connection(("127.0.0.1", bridged.bridge.port)) for _ in range(100)]
    try:
        peers[0].sendall(b"\x00\xff" * 1000)
        with Talk(bridged) as talk:
            assert talk.sync() == []
    finally:
        for peer in peers:
            peer.close()
