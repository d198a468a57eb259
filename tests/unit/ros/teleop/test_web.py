import contextlib
import http.client
import json
import re
import socket
import threading

import pytest

from vrx_mj.cli.options import with_default_port
from vrx_mj.errors import NetworkError
from vrx_mj.ros.teleop.web import FILES, MOST_CONNECTIONS, PageServer

URL = "ws://127.0.0.1:9090"


@contextlib.contextmanager
def answering(url=URL, boat=None):
    with PageServer(0, url, boat) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join(5.0)


@pytest.fixture(scope="module")
def server():
    with answering() as made:
        yield made


def asked(server, path, method="GET", **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=5.0)
    with contextlib.closing(connection):
        connection.request(method, path, headers=headers)
        response = connection.getresponse()
        return response.status, response.headers, response.read().decode()


@pytest.mark.parametrize("path", FILES)
def test_its_files_come_with_their_types_and_a_policy(server, path):
    status, headers, text = asked(server, path)
    assert (status, headers["Content-Type"]) == (200, f"{FILES[path][1]}; charset=utf-8")
    assert len(text) > 500
    assert headers["Content-Security-Policy"] == (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
        "connect-src 'self' ws://127.0.0.1:9090; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    assert (headers["X-Content-Type-Options"], headers["Cache-Control"]) == ("nosniff", "no-store")
    assert asked(server, path, "HEAD")[2] == ""


def test_nothing_is_loaded_from_elsewhere(server):
    texts = {path: asked(server, path)[2] for path in FILES}
    wanted = {
        match for text in texts.values() for match in re.findall(r"(?:src|href)=\"(/[^\"]*)\"|from \"(/[^\"]*)\"", text)
    }
    assert {one or other for one, other in wanted} == set(FILES) - {"/"}
    assert [path for path, text in texts.items() if re.search(r"https?://|url\(|@import", text)] == []


def test_the_page_is_told_where_the_rosbridge_is():
    with answering("ws://127.0.0.1:7", "wamv2") as server:
        status, headers, text = asked(server, "/settings.json")
    assert (status, headers["Content-Type"], json.loads(text)) == (
        200, "application/json; charset=utf-8", {"url": "ws://127.0.0.1:7", "boat": "wamv2"},
    )  # fmt: skip


@pytest.mark.parametrize("path", ["/page", "/../web.py", "/page/../../web.py", "/%2e%2e/web.py", "/page.js/"])
def test_nothing_else_is_there(server, path):
    status, _, text = asked(server, path)
    assert status == 404
    assert text == f"no file {path}; known: {', '.join(FILES)}\n"


@pytest.mark.parametrize("host", ["127.0.0.1:8090", "localhost", "localhost:1", "[::1]:8090", "127.0.0.1"])
def test_this_machine_may_ask_by_each_of_its_names_and_any_port(server, host):
    assert asked(server, "/", Host=host)[0] == 200


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8090", "127.0.0.1.evil.example", "10.0.0.1", "[", ""])
def test_a_name_that_is_not_of_this_machine_is_refused(server, host):
    status, headers, text = asked(server, "/settings.json", Host=host)
    assert status == 421
    assert text == f"only for this machine, as {server.page}; not under the name {host or 'none'}\n"
    assert "Content-Security-Policy" in headers


def test_other_methods_are_refused(server):
    assert asked(server, "/", "POST")[0] == 501


def test_it_listens_on_loopback_alone(server):
    assert server.server_address[0] == "127.0.0.1"


def test_a_port_that_is_taken_is_told_with_who_has_it():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(NetworkError, match=rf"^--web: port {port} of 127\.0\.0\.1 is taken by "):
            PageServer(port, URL)


@pytest.mark.parametrize(
    "url",
    ["http://127.0.0.1:9090", "ws://", "ws://a b", "ws://a;script-src *", "ws://127.0.0.1:port", "9090", "ws://a,b"],
)
def test_an_address_that_is_none_or_would_loosen_the_policy_is_refused(url):
    with pytest.raises(NetworkError) as caught:
        PageServer(0, url)
    assert (
        str(caught.value) == f"invalid rosbridge address '{url}': ws://HOST:PORT is needed, as in ws://127.0.0.1:9090"
    )


def test_a_port_beyond_all_ports_is_told():
    with pytest.raises(NetworkError) as caught:
        PageServer(70000, URL)
    assert str(caught.value) == "invalid --web 70000: a port from 1 to 65535, or 0 for any free one, is needed"


def test_the_port_of_the_page_may_be_left_out():
    assert with_default_port(["teleop", "--web"]) == ["teleop", "--web=8090"]
    assert with_default_port(["teleop", "--web", "8000", "--boat", "a"]) == ["teleop", "--web", "8000", "--boat", "a"]
    assert with_default_port(["serve", "w", "--rosbridge"]) == ["serve", "w", "--rosbridge=9090"]


def test_browsers_that_say_nothing_or_half_of_it_make_room(server):
    before = threading.active_count()
    with contextlib.ExitStack() as stack:
        for number in range(3 * MOST_CONNECTIONS):
            peer = stack.enter_context(socket.create_connection(("127.0.0.1", server.server_address[1]), timeout=5.0))
            peer.sendall(b"GET / HTTP/1.1\r\nHost: local"[: 30 * (number % 2)])
        assert asked(server, "/")[0] == 200
        assert threading.active_count() <= before + MOST_CONNECTIONS + 16  # some are just ending
