"""The page that a browser is given, and the ports of it."""

import http.client
import socket
import threading
from contextlib import contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace

import pytest

from vrx_mj.errors import RecordError
from vrx_mj.recording import viewer
from vrx_mj.recording.viewer import LOOPBACK, _answers, _Page, free_port, where_to_look

HTML = b'<head><link rel="x" href="https://fonts.example/a"><link href="./own.css"></head>'


class Inner(BaseHTTPRequestHandler):
    """Stands for rerun's server."""

    def do_GET(self):
        known = {"/": (200, "text/html; charset=utf-8", HTML), "/a.wasm?b=1": (200, "application/wasm", HTML)}
        status, kind, content = known.get(self.path, (404, None, b"none"))
        self.send_response(status)
        if kind:
            self.send_header("Content-Type", kind)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_):
        """Nothing."""


@contextmanager
def served(handler):
    """The port of a server."""
    server = ThreadingHTTPServer((LOOPBACK, 0), handler)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        server.server_close()


def got(port, path):
    """Status, content and headers of an answer."""
    connection = http.client.HTTPConnection(LOOPBACK, port, timeout=10.0)
    connection.request("GET", path)
    answer = connection.getresponse()
    found = answer.status, answer.read(), dict(answer.getheaders())
    connection.close()
    return found


def test_a_page_is_what_rerun_serves_without_links_to_elsewhere_and_under_a_policy(capfd):
    with served(Inner) as inner, served(partial(_Page, inner, "default-src 'self'")) as page:
        own = HTML.replace(b'<link rel="x" href="https://fonts.example/a">', b"")
        for path, status, kind, content in (
            ("/", 200, "text/html; charset=utf-8", own),
            ("/a.wasm?b=1", 200, "application/wasm", HTML),
            ("/other", 404, "application/octet-stream", b"none"),
        ):
            found, body, headers = got(page, path)
            assert (found, body) == (status, content)
            assert headers["Content-Type"] == kind
            assert headers["Content-Length"] == str(len(content))
            assert headers["Content-Security-Policy"] == "default-src 'self'"
    assert capfd.readouterr().err == ""


def test_a_port_is_the_wanted_one_where_that_is_free_and_else_another():
    with socket.socket() as taken:
        taken.bind((LOOPBACK, 0))
        wanted = taken.getsockname()[1]
        assert free_port(wanted) not in {wanted, 0}
        assert not _answers(wanted)
        taken.listen()
        assert _answers(wanted)
    assert free_port(wanted) == wanted


def test_no_free_port_is_told(monkeypatch):
    class Full(socket.socket):
        def bind(self, _):
            raise OSError

    monkeypatch.setattr(viewer.socket, "socket", Full)
    with pytest.raises(RecordError) as refused:
        free_port(9090)
    assert str(refused.value) == f"no free port on {LOOPBACK}"


def test_who_watches_is_told_why_where_and_how():
    server = SimpleNamespace(page_url="http://here:1/", ports=(1, 2))
    tunnel = f"ssh -L 1:{LOOPBACK}:1 -L 2:{LOOPBACK}:2 this-machine"
    assert [*where_to_look(server, "no display")] == [
        "Opening in the browser (no display).",
        "Open http://here:1/",
        f"It listens on this machine only; from another machine, first run: {tunnel}",
    ]
