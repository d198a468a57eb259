"""The page that a browser is given, and the ports of it."""

import http.client
import io
import socket
import subprocess
import threading
from contextlib import closing, contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace

import pytest

from vrx_mj.errors import RecordError
from vrx_mj.recording import session, viewer
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
        assert free_port(wanted) not in {wanted, *range(1024)}
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


@pytest.fixture
def opened(monkeypatch):
    """A recording that is opened without being read, and what became of it."""
    found = []

    def viewable(_record, follow, folder):
        found.append((follow, folder.is_dir()))
        return "f.rrd"

    record = SimpleNamespace(warn_of_physics=lambda: found.append("physics"))
    monkeypatch.setattr(session, "read_record", lambda path, *, whole: record if whole else None)
    monkeypatch.setattr(
        session, "viewable", lambda _record, follow, folder: found.append((follow, folder.is_dir())) or "f.rrd"
    )
    monkeypatch.setattr(session, "viewer_binary", lambda: "rerun")
    return found


def test_with_a_display_the_viewer_is_started_and_its_code_is_returned(opened, monkeypatch):
    def run(command, **options):
        opened.append((command, options["env"]["CI"], options["check"]))
        return SimpleNamespace(returncode=5)

    monkeypatch.setattr(session, "no_window", lambda *, mujoco: "always" if mujoco else None)
    monkeypatch.setattr(session.subprocess, "run", run)
    assert session.open_viewer("run.rrd", follow="a") == 5
    command = ["rerun", "f.rrd", "--bind", LOOPBACK, "--hide-welcome-screen"]
    assert opened == ["physics", ("a", True), (command, "true", False)]


@pytest.mark.parametrize("interrupted", [False, True])
def test_without_a_display_it_is_served_until_it_ends_or_ctrl_c(opened, monkeypatch, interrupted):
    class Server:
        page_url, ports = "http://here:1/", (1, 2)

        def __init__(self, file):
            opened.append(file)

        def wait(self):
            if interrupted:
                raise KeyboardInterrupt
            return 3

        def close(self):
            opened.append("closed")

    monkeypatch.setattr(session, "no_window", lambda **_: "no display")
    monkeypatch.setattr(viewer, "Server", Server)
    lines = []
    assert session.open_viewer("run.rrd", write=lines.append) == (0 if interrupted else 3)
    assert opened == ["physics", (None, True), "f.rrd", "closed"]
    assert lines == [*where_to_look(Server(""), "no display"), "Press Ctrl-C to stop."]


def test_a_viewer_that_does_not_end_by_itself_is_killed():
    called = []

    def wait(seconds=None):
        called.append(f"wait {seconds}")
        if seconds:
            raise subprocess.TimeoutExpired("rerun", seconds)

    server = object.__new__(viewer.Server)
    pages = SimpleNamespace(shutdown=lambda: called.append("shutdown"), server_close=lambda: called.append("close"))
    process = {name: lambda name=name: called.append(name) for name in ("terminate", "kill")}
    server._pages, server._process = pages, SimpleNamespace(wait=wait, **process)
    server._output = SimpleNamespace(close=lambda: called.append("output"))
    server.close()
    assert called == ["shutdown", "close", "terminate", "wait 5.0", "kill", "wait None", "output"]


def test_the_last_line_of_a_viewer_is_told():
    server = object.__new__(viewer.Server)
    server._output = io.BytesIO(b"one\ntwo: wrong\n\n")
    assert server._last_line() == "two: wrong"
    server._output = io.BytesIO()
    assert server._last_line() == "nothing after 20 s"


def test_a_page_asks_for_the_data_of_this_machine():
    server = object.__new__(viewer.Server)
    server.page_port, server.data_port, server.data_url = 1, 2, "rerun+http://here:2/proxy"
    assert server.page_url == f"http://{LOOPBACK}:1/?url=rerun%2Bhttp%3A%2F%2Fhere%3A2%2Fproxy&hide_welcome_screen=1"
    assert server.ports == (1, 2)


class Process:
    """Stands for a viewer that runs until it is ended."""

    def __init__(self, command, **options):
        self.command, self.options = command, options

    def poll(self):
        return None

    def wait(self, _seconds=None):
        return 0

    def terminate(self):
        """Nothing."""


def test_a_server_keeps_three_times_the_size_of_its_files_and_half_a_gigabyte(tmp_path, monkeypatch):
    files = [tmp_path / "a.rrd", tmp_path / "b.rrd"]
    for file, size in zip(files, (3_000_000, 1_000_000), strict=True):
        file.write_bytes(bytes(size))
    monkeypatch.setattr(viewer.subprocess, "Popen", Process)
    monkeypatch.setattr(viewer, "viewer_binary", lambda: "rerun")
    monkeypatch.setattr(viewer, "_answers", lambda _: True)
    with closing(viewer.Server(*files)) as server:
        command, options = server._process.command, server._process.options
        assert command == [
            "rerun", *map(str, files), "--serve-web", "--bind", LOOPBACK, "--port", str(server.data_port),
            "--web-viewer-port", str(server._hidden_port), "--server-memory-limit", "512MB",
        ]  # fmt: skip
        assert options["start_new_session"]
        assert options["env"]["CI"] == "true"
        assert server.is_running()
        assert server.data_url == f"rerun+http://{LOOPBACK}:{server.data_port}/proxy"
        assert len({server.page_port, server.data_port, server._hidden_port}) == 3


def test_a_server_is_waited_for_20_s(monkeypatch):
    clock = SimpleNamespace(now=100.0, naps=[])

    def sleep(seconds):
        clock.naps.append(seconds)
        clock.now += 1.0

    monkeypatch.setattr(viewer, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=sleep))
    monkeypatch.setattr(viewer.subprocess, "Popen", Process)
    monkeypatch.setattr(viewer, "viewer_binary", lambda: "rerun")
    monkeypatch.setattr(viewer, "_answers", lambda _: False)
    with pytest.raises(RecordError) as refused:
        viewer.Server()
    assert str(refused.value) == "rerun's browser viewer does not start: nothing after 20 s"
    assert clock.naps == [0.05] * 21
