import os
import re
import socket
import subprocess
import sys
import time

import pytest

from vrx_command import environment
from vrx_mj.campaign import program
from vrx_mj.campaign.program import Program
from vrx_mj.campaign.program_trial import PORTS, claimed_port, surroundings
from vrx_mj.errors import NetworkError

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="process groups of other systems")

QUICK = {"SIGINT": 0.1, "SIGTERM": 0.1, "SIGKILL": 10.0}
POLITE = {"SIGINT": 10.0}
STUBBORN = """
import os, signal, time
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_IGN)
if os.fork() == 0:
    os.setsid()
    if os.fork():
        os._exit(0)
print("pid", os.getpid(), flush=True)
time.sleep(60)
"""
ENDS_A_STUBBORN_ONE = f"""
import os, shlex, sys, time
from io import BytesIO
from vrx_mj.campaign.program import Program, become_subreaper
become_subreaper()
said = BytesIO()
program = Program(shlex.quote(sys.executable) + " stubborn.py; echo it went on", os.environ, said)
deadline = time.monotonic() + 30.0
while said.getvalue().count(b"pid") < 2 and time.monotonic() < deadline:
    time.sleep(0.01)
program.end({QUICK})
print(said.getvalue().decode())
"""


class Log:
    """What a program printed so far."""

    def __init__(self):
        self.text = b""

    def write(self, data):
        self.text += data

    def flush(self):
        pass


def run(line, **changes):
    """A program and its log."""
    log = Log()
    return Program(line, {"PATH": os.environ["PATH"], **changes}, log), log


def until(condition, what):
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.01)


def test_it_is_heard_and_its_code_is_told():
    program, log = run("echo one; echo two >&2; echo $SIDE; exit 3", SIDE="port")
    until(lambda: program.code is not None, "the end")
    program.end(QUICK)
    assert (program.code, log.text) == (3, b"one\ntwo\nport\n")
    assert program.last_lines == "one | two | port"


def test_only_the_last_lines_are_told_and_none_without_end():
    program, _ = run("for i in 1 2 3 4 5; do echo line $i; echo; done; head -c 500 /dev/zero | tr '\\0' x")
    until(lambda: program.code is not None, "the end")
    program.end(QUICK)
    assert program.last_lines == f"line 4 | line 5 | {'x' * 200}"


def test_what_it_prints_is_kept_up_to_a_bound(monkeypatch):
    monkeypatch.setattr(program, "MOST_OUTPUT", 1000)
    running, log = run("head -c 300000 /dev/zero | tr '\\0' x; echo; echo last words")
    until(lambda: running.code is not None, "the end: a full pipe would have held it")
    running.end(QUICK)
    assert log.text == b"x" * 1000 + b"\n[the program printed more than is kept]\n"
    assert running.last_lines.endswith(" | last words")


@pytest.mark.slow
def test_sigint_ends_one_that_ends_by_it_with_its_whole_group():
    program, log = run("trap 'echo tidy; exit 0' INT; sleep 60 & echo ready; wait")
    until(lambda: b"ready" in log.text, "its start")
    program.end({"SIGINT": 0.3, "SIGTERM": 10.0})  # a shell's `&` ignores SIGINT
    assert (program.code, log.text) == (0, b"ready\ntidy\n")
    with pytest.raises(ProcessLookupError):
        os.killpg(program.group, 0)


def test_ending_it_again_does_nothing(monkeypatch):
    program, _ = run("true")
    program.end(POLITE)
    killpg = os.killpg
    monkeypatch.setattr(
        os, "killpg", lambda group, number: killpg(group, 0) if number == 0 else pytest.fail("a signal")
    )
    program.end({"SIGINT": 60.0})


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux gives back who has left the group")
def test_one_that_ignores_signals_and_forks_out_of_its_group_is_killed(tmp_path):
    (tmp_path / "stubborn.py").write_text(STUBBORN, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", ENDS_A_STUBBORN_ONE], cwd=tmp_path, env=environment(), capture_output=True, timeout=60,
        check=True, encoding="utf-8",
    )  # fmt: skip
    pids = [int(pid) for pid in re.findall(r"pid (\d+)", done.stdout)]
    assert len(pids) == 2
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_ports_of_trials_are_free_and_apart():
    with claimed_port() as first, claimed_port() as second, socket.socket() as server:
        assert len({first, second, *PORTS}) == len(PORTS)
        server.bind(("127.0.0.1", second))
        server.listen()
        with claimed_port() as third:
            assert third not in {first, second}


def test_without_a_free_port_it_says_so(monkeypatch):
    with claimed_port() as taken:
        monkeypatch.setattr("vrx_mj.campaign.program_trial.PORTS", range(taken, taken + 1))
        message = rf"^no port of {taken} to {taken} is free on 127\.0\.0\.1$"
        with pytest.raises(NetworkError, match=message), claimed_port():
            pass


def test_surroundings_are_of_the_trial(tmp_path):
    home = tmp_path.resolve() / "ros"
    found = surroundings(tmp_path, 21400, 21401)
    assert found == {
        "ROS_MASTER_URI": "http://127.0.0.1:21400",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(home),
        "ROS_LOG_DIR": str(home / "log"),
        "VRX_MJ_ROSBRIDGE_PORT": "21401",
        "VRX_MJ_ROSBRIDGE_URL": "ws://127.0.0.1:21401",
    }
    assert (home / "log").is_dir()
