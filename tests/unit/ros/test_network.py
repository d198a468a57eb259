"""Who holds a port."""

import os
import re
import shlex
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from vrx_mj.ros.network import who_listens

pytestmark = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="reads Linux's /proc")
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


def test_who_cannot_be_looked_at_is_told_by_the_user(tmp_path):
    (tmp_path / "net").mkdir()
    line = "0: 0100007F:2382 00000000:0000 0A 00000000:00000000 00:00000000 00000000 {} 0 4711 1 0 100 0 0 10 0\n"
    (tmp_path / "net" / "tcp").write_text(f"header\n{line.format(4294900000)}", encoding="ascii")
    (tmp_path / "7").mkdir()
    assert who_listens(0x2382, tmp_path) == (
        "a process of the user 4294900000 that this user may not inspect; 'sudo ss -ltnp' shows it"
    )
    assert who_listens(0x2383, tmp_path) is None


def test_where_there_is_no_proc_nobody_is_found(tmp_path):
    assert who_listens(9090, tmp_path) is None
