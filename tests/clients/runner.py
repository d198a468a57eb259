"""A program of a user beside a served world with a task: at a rate, through a stall of the server, to a score.

The program prints `ready` once it has what it needs. From then on it runs for some simulated seconds, amid which the
server stands still; it may end before, else SIGINT ends it.
"""

import contextlib
import math
import os
import re
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

from needs import DEBIAN_PYTHON
from ros1_peer import ME, dial, frame_of, service_of, stream_of, taken
from ros1_served import environment, free_port, until
from vrx_command import start
from vrx_mj.ros.messages import decode, encode, md5sum, new, service_md5sum
from vrx_mj.ros.packages import write_packages

PROGRAMS = Path(__file__).parent / "programs"
WORLD = """
extends: sydney_regatta
sea: {model: none}
task:
  {type: stationkeeping, goal: [-33.7227, 150.67402, 0.0], initial_state_duration: 1, ready_state_duration: 1}
"""
FLEET = """
boats: [{name: wamv, pose: [-532, 162, 0.1, 0, 0, 0]}]
thrusters: H
sensors: [gps, imu]
"""
RATES = [pytest.param(1.0, marks=pytest.mark.nightly), 2.0]
"""Simulated over wall time: the harder one every day, the usual one every night."""
WAIT = 90.0
"""Wall time for what comes at once on a machine without load [s]."""


@dataclass
class Served:
    """A world that `vrx-mj serve` serves to a client."""

    process: subprocess.Popen[str]
    port: int
    """Of the master."""
    bridge: int
    """Of the rosbridge."""
    lines: list[str] = field(default_factory=list)
    """What it has printed."""
    last: dict[str, Any] = field(default_factory=dict)
    """The newest message of topics that are listened to."""

    def listen(self, topic: str, kind: str) -> None:
        """Keep the newest message of a topic from now on."""
        connection, _ = dial(stream_of(self.uri, topic), topic=topic, type=kind, md5sum=md5sum(kind))
        connection.settimeout(None)

        def hear() -> None:
            with connection, contextlib.suppress(OSError):
                while (frame := frame_of(connection)) is not None:
                    self.last[topic] = decode(frame, kind)

        threading.Thread(target=hear, daemon=True).start()

    def call(self, service: str, kind: str, **request: Any) -> Any:
        """The response of a service."""
        raw = encode(new(f"{kind}Request", **request), f"{kind}Request")
        connection, _ = dial(service_of(self.uri, service), service=service, md5sum=service_md5sum(kind))
        with connection:
            connection.sendall(len(raw).to_bytes(4, "little") + raw)
            ok, body = taken(connection, 1), frame_of(connection) or b""
        assert ok == b"\1", body
        return decode(body, f"{kind}Response")

    def place(self, model: str = "wamv") -> tuple[float, float]:
        """Where a model is, x and y [m]."""
        at = self.call("/gazebo/get_model_state", "gazebo_msgs/GetModelState", model_name=model).pose.position
        return at.x, at.y

    @property
    def uri(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        now = self.last["/clock"].clock
        return now.sec + 1e-9 * now.nanosec

    def boats(self) -> set[str]:
        """Names of boats."""
        with ServerProxy(self.uri) as master:
            _, _, (_, subscribers, _) = master.getSystemState(ME)
        return {topic.split("/")[1] for topic, _ in subscribers if "/thrusters/" in topic}

    def stall(self, seconds: float) -> None:
        """Stand still for a while, as on a machine that does something else [s]."""
        self.process.send_signal(signal.SIGSTOP)
        time.sleep(seconds)
        self.process.send_signal(signal.SIGCONT)


@contextlib.contextmanager
def serving(folder: Path, *options: object, world: str = WORLD, fleet: str = FLEET) -> Iterator[Served]:
    """Serve a world over ROS 1 and rosbridge; it must end well, without a traceback."""
    for name, text in (("world", world), ("fleet", fleet)):
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    port, bridge = free_port(), free_port()
    words = ("serve", "world.yaml", "--fleet", "fleet.yaml", "--ros1", "--rosbridge", bridge, *options)
    process = start(*words, cwd=folder, ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1")
    served = Served(process, port, bridge)
    reading = _reading(process.stderr, served.lines)
    try:
        until(lambda: any("topics out" in line for line in served.lines), f"served: {served.lines}", WAIT)
        served.listen("/clock", "rosgraph_msgs/Clock")
        served.listen("/vrx/task/info", "vrx_gazebo/Task")
        until(lambda: len(served.last) == 2, f"time and task: {served.lines}", WAIT)
        yield served
        process.send_signal(signal.SIGINT)
        process.wait(WAIT)
    finally:
        process.kill()
        process.wait()
        reading.join()
        if process.stdout is not None:
            process.stdout.close()
    said = "".join(served.lines)
    assert process.returncode == 0, said
    assert "Traceback" not in said, said


@dataclass(frozen=True)
class Outcome:
    """What became of a client, and of the boat."""

    code: int
    """The client's exit code; -2 for a program that SIGINT has ended."""
    text: str
    """What the client printed, errors included."""
    lines: Sequence[str]
    """What `vrx-mj serve` printed."""
    task: Any
    """The last vrx_gazebo/Task."""
    way: float
    """Distance between the places of the boat at `ready` and at the end [m]."""

    def said(self, pattern: str) -> list[str]:
        """Lines of `vrx-mj serve` that a regular expression is found in."""
        return [line for line in self.lines if re.search(pattern, line)]


def outcome(
    command: Sequence[object], folder: Path, *options: object,
    rate: float, seconds: float = 12.0, stall: float = 0.5, during: Callable[[Served], object] = lambda _: None,
    variables: Mapping[str, str] | None = None, world: str = WORLD, fleet: str = FLEET,
) -> Outcome:  # fmt: skip
    """Run a client beside a server.

    Args:
        command: words of a command line; it runs in `folder` with Debian's ROS, our messages and `ROSBRIDGE_PORT`.
        folder: an empty one.
        options: of `vrx-mj serve`.
        rate: simulated seconds per second.
        seconds: simulated time from `ready` on [s].
        stall: wall time for which the server stands still after a third of that [s]; the process is stopped.
        during: called after the stall.
        variables: of the client's environment, besides.
        world: YAML of the world; it has a task.
        fleet: YAML of the fleet; it has a boat `wamv`.
    """
    with serving(folder, "--rate", rate, *options, world=world, fleet=fleet) as served:
        own = {**environment(served.port, folder), **messages(), "ROSBRIDGE_PORT": str(served.bridge)}
        with running(command, folder, own | dict(variables or {})) as (client, printed):

            def reaches(time: float) -> Callable[[], bool]:
                return lambda: served.time >= time or client.poll() is not None

            until(lambda: "ready\n" in printed or client.poll() is not None, f"ready: {printed}", WAIT)
            begun, before = served.time, served.place()
            until(reaches(begun + seconds / 3.0), f"a third of {seconds} s: {printed}", WAIT)
            served.stall(stall)
            during(served)
            until(reaches(begun + seconds), f"{seconds} s: {printed}", WAIT)
            after = served.place() if "wamv" in served.boats() else before
            task = served.last["/vrx/task/info"]
    return Outcome(client.returncode, "".join(printed), served.lines, task, math.dist(before, after))


@contextlib.contextmanager
def running(
    command: Sequence[object], folder: Path, variables: Mapping[str, str]
) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """A program and the lines that it has printed; SIGINT ends it if it has not ended."""
    client = subprocess.Popen(
        [str(word) for word in command], cwd=folder, env=variables, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, encoding="utf-8", start_new_session=True,
    )  # fmt: skip
    printed: list[str] = []
    reading = _reading(client.stdout, printed)
    try:
        yield client, printed
        client.send_signal(signal.SIGINT)
        client.wait(WAIT)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(client.pid, signal.SIGKILL)
        client.wait()
        reading.join()


def program(name: str) -> list[object]:
    """The command line of a program of the folder `programs`, in Debian's Python."""
    return [DEBIAN_PYTHON, "-B", PROGRAMS / name]


@cache
def messages() -> Mapping[str, str]:
    """Variables with which Debian's programs find all message packages; those that Debian lacks are written once."""
    folder = Path(os.environ["TMPDIR"]) / f"messages {os.getpid()}"
    write_packages(folder)
    return {"PYTHONPATH": str(folder / "python"), "ROS_PACKAGE_PATH": f"{folder / 'share'}:/usr/share"}


def _reading(stream: Any, lines: list[str]) -> threading.Thread:
    """A thread that reads lines until the stream ends."""

    def read() -> None:
        with stream:
            lines.extend(stream)

    thread = threading.Thread(target=read)
    thread.start()
    return thread
