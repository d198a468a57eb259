"""Who holds a port."""

import os
import re
import shlex
import socket
import subprocess
import sys
import time
from types import SimpleNamespace

import psutil
import pytest

from vrx_mj.ros.network import who_listens

HOLD = "import socket, sys; s = socket.create_server(('127.0.0.1', 0)); print(s.getsockname()[1], flush=True); input()"
TOLD = re.compile(r"process (\d+) \((.*)\), since (\d{4}-\d\d-\d\d \d\d:\d\d:\d\d); to stop it: kill (\d+)", re.DOTALL)


@pytest.mark.parametrize(("family", "host"), [(socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")])
def test_this_process_is_found(family, host):
    try:
        server = socket.create_server((host, 0), family=family)
    except OSError:
        pytest.skip(f"{host} cannot be bound here")
    with server:
        told = TOLD.fullmatch(who_listens(server.getsockname()[1]))
        assert int(told[1]) == int(told[4]) == os.getpid()


def test_another_process_is_told_with_its_command_and_since_when():
    before = time.time()
    command = [sys.executable, "-c", HOLD, "--name", "two words\n", "x" * 200]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            told = TOLD.fullmatch(who_listens(int(process.stdout.readline())))
        finally:
            process.kill()
    assert int(told[1]) == process.pid
    assert told[2].startswith(f"{shlex.quote(sys.executable)} -c 'import socket")
    assert len(told[2]) == 120
    assert told[2].endswith("...")
    started = time.mktime(time.strptime(told[3], "%Y-%m-%d %H:%M:%S"))
    assert before - 2.0 <= started <= time.time() + 1.0  # whole seconds, and the boot's moment to 10 ms


def test_nobody_listens_on_a_port_that_was_let_go():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    assert who_listens(port) is None


def test_who_cannot_be_looked_at_is_told_to_be_of_another_user(monkeypatch):
    other = SimpleNamespace(status=psutil.CONN_LISTEN, laddr=SimpleNamespace(port=9090), pid=None)
    monkeypatch.setattr(psutil, "net_connections", lambda _: [other])
    assert who_listens(9090) == "a process of another user; 'sudo ss -ltnp' shows it"
    assert who_listens(9091) is None


def test_where_only_own_connections_are_shown_own_processes_are_found(monkeypatch):
    """macOS denies the table of all connections."""

    def denied(_kind):
        raise psutil.AccessDenied

    monkeypatch.setattr(psutil, "net_connections", denied)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert int(TOLD.fullmatch(who_listens(port))[1]) == os.getpid()
    assert who_listens(port) is None
