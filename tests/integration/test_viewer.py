"""rerun's viewer sends no statistics, its page talks to this machine alone, and it opens without a display."""

import contextlib
import http.client
import re
import signal
import socket
import subprocess
import sys
import time

import pytest

from browser import browsing
from needs import CHROMIUM, needs
from vrx_command import environment, start, vrx
from vrx_mj import Simulation, compile_world, record
from vrx_mj.errors import RecordError
from vrx_mj.recording import viewer

FRESH = {"XDG_CONFIG_HOME": None, "XDG_DATA_HOME": None, "DISPLAY": None, "WAYLAND_DISPLAY": None, "CI": None}

WINDOW = """
from vrx_mj.recording import open_viewer, session
session.no_window = lambda **_: None
open_viewer("run.rrd")
"""


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    file = tmp_path_factory.mktemp("recorded") / "run.rrd"
    sim = Simulation(compile_world("ocean", seed=7))
    with record(sim, file):
        sim.step({"wamv": {"left": 0.5, "right": 0.5}}, duration=1.0)
    return file


@contextlib.contextmanager
def replayed(recording, home):
    """`vrx-mj replay` without a display; its first lines."""
    process = start("replay", recording, cwd=home, HOME=home, **FRESH)
    try:
        yield process, [process.stdout.readline().strip() for _ in range(4)]
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
    finally:
        process.kill()
        process.communicate()


def test_a_server_that_does_not_start_says_what_rerun_said(monkeypatch):
    monkeypatch.setattr(viewer, "viewer_binary", lambda: sys.executable)  # knows none of rerun's options
    with pytest.raises(RecordError, match=r"^rerun's browser viewer does not start: ") as error:
        viewer.Server()
    assert re.search(r"-c|-h", str(error.value))


def test_a_port_that_is_taken_gives_way_to_a_free_one():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert viewer.free_port(port) not in {port, 0}


@pytest.mark.slow
@pytest.mark.nightly
def test_what_we_start_of_rerun_keeps_no_statistics_in_a_fresh_home(tmp_path):
    home, run = tmp_path / "home", ("run", "ocean", "--duration", "1", "--record", "run.rrd")
    home.mkdir()
    assert vrx(*run, cwd=home, HOME=home, **FRESH)[0] == 0
    assert vrx("doctor", cwd=home, HOME=home, **FRESH)[0] == 0
    with replayed("run.rrd", home):
        pass
    command = [sys.executable, "-c", WINDOW]
    subprocess.run(command, cwd=home, env=environment(HOME=home, **FRESH), check=True, timeout=60)
    assert not [file for file in home.rglob("*") if "analytics" in file.name]


@pytest.mark.slow
def test_replay_without_a_display_says_where_to_look(recording, tmp_path):
    with replayed(recording, tmp_path) as (_, lines):
        assert lines[0] == "Opening in the browser (no display: neither DISPLAY nor WAYLAND_DISPLAY is set)."
        address = re.fullmatch(r"Open (http://127\.0\.0\.1:\d+/\?url=\S+)", lines[1])[1]
        assert lines[3] == "Press Ctrl-C to stop."
        page = http.client.HTTPConnection("127.0.0.1", int(re.search(r":(\d+)/", address)[1]))
        page.request("GET", "/")
        answer = page.getresponse()
        assert "connect-src 'self'" in answer.getheader("Content-Security-Policy")
        assert b"https://fonts" not in answer.read()


@needs(CHROMIUM)
@pytest.mark.slow
def test_the_page_of_a_recording_talks_to_this_machine_alone(recording, tmp_path):
    log = tmp_path / "requests.json"  # of the whole browser, which has some of its own
    flags = (f"--log-net-log={log}", "--enable-unsafe-swiftshader", "--use-angle=swiftshader")
    serving = contextlib.closing(viewer.Server(recording))
    with serving as server, browsing(tmp_path / "profile", server.page_url, *flags) as page:
        page.wait("document.getElementById('the_canvas_id')?.classList.contains('visible')", 60.0)
        time.sleep(5.0)  # it asks for releases and sends statistics once it is drawn
    asked = log.read_text(encoding="utf-8")
    assert f"http://127.0.0.1:{server.data_port}/rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages" in asked
    hosts = set(re.findall(r'"host(?:name)?":"(?:https?://)?([^":/]+)', asked))
    assert not {host for host in hosts if re.search(r"rerun|github|fonts|gstatic", host)}
