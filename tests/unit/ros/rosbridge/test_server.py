"""Who may connect, and where the server cannot be opened."""

import re
import socket

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from bridged import Bridged
from rosbridge_client import Talk
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.interface import Inbox
from vrx_mj.ros.network import Network
from vrx_mj.ros.rosbridge import Rosbridge


@pytest.fixture(scope="module")
def bridged():
    with Bridged() as made:
        yield made


@pytest.mark.parametrize(
    ("host", "origin", "welcome"),
    [
        ("127.0.0.1", None, True),
        ("127.0.0.1", "null", False),
        ("127.0.0.1", "file://", False),
        ("127.0.0.1", "http://localhost:8000", True),
        ("127.0.0.1", "http://127.0.0.1", True),
        ("127.0.0.1", "http://[::1]:80", True),
        ("127.0.0.1", "https://example.com", False),
        ("127.0.0.1", "http://localhost.example.com", False),
        ("127.0.0.1", "http://127.0.0.1.example.com", False),
        ("127.0.0.1", "http://[", False),
        ("127.0.0.1", "chrome-extension://abc", False),
        ("localhost", "http://localhost:8000", True),
        ("localhost", "https://example.com", False),
    ],
)
def test_pages_of_other_sites_may_not_connect(bridged, host, origin, welcome):
    url = f"ws://{host}:{bridged.bridge.port}"
    if welcome:
        with connect(url, origin=origin):
            return
    status, text = refusal(url, origin=origin)
    how = "" if origin == "http://[" else f"; to allow them: --allow-origin {origin}"
    assert (status, text) == (403, f"pages of {origin} may not connect{how}\n")


def refusal(url, **options):
    """Status and text by which a handshake is refused."""
    with pytest.raises(InvalidStatus) as raised, connect(url, **options):
        pass
    return raised.value.response.status_code, raised.value.response.body.decode()


@pytest.mark.parametrize(
    ("allowed", "origin"),
    [
        ("https://app.foxglove.dev", "https://app.foxglove.dev"),
        ("HTTPS://App.Foxglove.dev:443/", "https://app.foxglove.dev"),
        ("http://10.0.0.7:8000", "http://10.0.0.7:8000"),
        ("chrome-extension://abc", "chrome-extension://abc"),
        ("null", "null"),
        ("*", "https://example.com"),
        ("*", "null"),
    ],
)
def test_pages_of_origins_that_are_allowed_may_connect_and_no_others(allowed, origin):
    with Bridged(origins=(allowed,)) as bridged:
        with connect(bridged.url, origin=origin):
            pass
        if allowed != "*":
            for other in ("https://example.com", "http://10.0.0.7:8001", "https://app.foxglove.dev.example.com"):
                assert refusal(bridged.url, origin=other)[0] == 403


@pytest.mark.parametrize(
    "word", ["app.foxglove.dev", "https://", "https://a/b", "https://a b", "https://[", "", "https://a:x", "a://b c"]
)
def test_an_origin_that_is_none_is_refused(word):
    with pytest.raises(CommandError) as raised:
        Rosbridge(Graph(None, Inbox()), origins=(word,))
    assert str(raised.value) == (
        f"invalid --allow-origin '{word}': SCHEME://HOST or SCHEME://HOST:PORT is needed, as in "
        "https://app.foxglove.dev; or null, file://, or * for all"
    )


@pytest.mark.parametrize("host", ["evil.example", "evil.example:9090", "localhost.evil.example", "a@[::1]", "", "["])
def test_a_page_may_not_ask_for_a_name_that_is_not_this_machines(bridged, host):
    """Its owner has that name lead here (DNS rebinding), so that both its origin and the server's are that name."""
    for origin in ("http://localhost", f"http://{host}"):
        status, text = shaken(bridged.bridge.port, f"Host: {host}\r\nOrigin: {origin}\r\n")
        assert status == 421
        assert text == f"{host!r} is not a name of this machine; to give it that name, set ROS_HOSTNAME\n"


def test_a_program_may_call_this_machine_as_it_likes(bridged):
    assert shaken(bridged.bridge.port, "Host: dock-3.example\r\n")[0] == 101


def test_a_page_that_this_machine_serves_to_others_may_connect(bridged):
    assert shaken(bridged.bridge.port, "Host: 192.0.2.5:9090\r\nOrigin: http://192.0.2.5:8000\r\n")[0] == 101
    assert shaken(bridged.bridge.port, "Host: 192.0.2.5:9090\r\nOrigin: http://192.0.2.6:8000\r\n")[0] == 403
    own = socket.gethostname().lower()
    assert shaken(bridged.bridge.port, f"Host: {own}\r\nOrigin: http://{own}:8000\r\n")[0] == 101


def shaken(port, fields):
    """Status and body of the answer to a handshake with these fields besides."""
    with socket.create_connection(("127.0.0.1", port), timeout=5.0) as peer:
        peer.sendall(
            f"GET / HTTP/1.1\r\n{fields}Upgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        head, _, body = peer.recv(4000).decode().partition("\r\n\r\n")
        return int(head.split()[1]), body


def test_a_port_that_is_taken_says_by_whom(bridged):
    network = Network()
    try:
        with pytest.raises(NetworkError) as raised:
            Rosbridge(Graph(network, Inbox()), port=bridged.bridge.port).start()
    finally:
        network.close()
    port = bridged.bridge.port
    holder = r"process \d+ \(.*\), since .*; to stop it: kill \d+"
    assert re.fullmatch(rf"rosbridge: port {port} of 127\.0\.0\.1 is taken by {holder}", str(raised.value))


@pytest.mark.parametrize("port", [-1, 65536])
def test_a_port_is_a_port(port):
    with pytest.raises(NetworkError) as raised:
        Rosbridge(Graph(None, Inbox()), port=port)
    assert str(raised.value) == f"rosbridge: invalid port {port}; allowed: 1 to 65535, or 0 for any free one"


def test_a_host_that_is_not_this_machine_is_refused():
    with pytest.raises(NetworkError) as raised, Bridged(host="192.0.2.1"):  # RFC 5737: nobody's
        pass
    assert str(raised.value) == "rosbridge: port 0 of 192.0.2.1 cannot be opened: Cannot assign requested address"


FULL = "too many clients are connected; no more from 127.0.0.1 are accepted\n"


def test_so_many_clients_are_taken_and_no_more(bridged, monkeypatch):
    monkeypatch.setattr(bridged.bridge._hub.connections, "most", 2)
    with Talk(bridged) as talk:
        talk.sync()
        assert refusal(bridged.url) == (503, FULL)
    bridged.wait(lambda b: b.wires.traffic.clients == 0)


def test_one_host_leaves_room_for_others(bridged, monkeypatch):
    monkeypatch.setattr(bridged.bridge._hub.connections, "most", 8)
    monkeypatch.setattr("vrx_mj.ros.limits.is_loopback", lambda host: False)
    with Talk(bridged) as talk:
        talk.sync()
        assert refusal(bridged.url) == (503, FULL)


def test_clients_that_say_nothing_make_room(bridged, monkeypatch):
    monkeypatch.setattr(bridged.bridge._hub.connections, "most", 4)
    with Talk(bridged) as first, connect(bridged.url) as silent:
        first.sync()
        with Talk(bridged) as second, Talk(bridged) as third:
            second.sync()
            third.sync()  # in place of the silent one
            assert first.sync() == second.sync() == []
            assert refusal(bridged.url)[0] == 503
            with pytest.raises(ConnectionClosed):
                silent.recv(5.0)


@pytest.mark.slow
def test_handshakes_that_do_not_end_leave_room_for_others(bridged):
    peers = [socket.create_connection(("127.0.0.1", bridged.bridge.port)) for _ in range(300)]
    try:
        peers[0].sendall(b"\x00\xff" * 1000)
        with Talk(bridged) as talk:
            assert talk.sync() == []
    finally:
        for peer in peers:
            peer.close()
