"""A small table served over ROS 1 without a simulation, and Debian's tools run against it."""

import itertools
import os
import random
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Self

from needs import ROS1_TOOLS, needs
from vrx_mj.errors import CommandError
from vrx_mj.ros.graph import Graph, Wires
from vrx_mj.ros.interface import Command, Delivery, Inbox, Input, Output, RosInterface, Service, UnknownTopicPublisher
from vrx_mj.ros.messages import new, stamp
from vrx_mj.ros.network import Network
from vrx_mj.ros.ros1 import Ros1
from vrx_mj.ros.rosbridge import Rosbridge

LEFT = "/wamv/thrusters/left_thrust_cmd"
needs_tools = needs(ROS1_TOOLS)


def trigger(_request):
    return {"success": True, "message": "ok"}


def failing(_request):
    raise CommandError("no boat is named wamv9")


def nothing():
    return None


def small_table(*names: str, **parameters) -> RosInterface:
    """A table of `/clock`, a latched topic, the IMU and a thruster of each boat of these names, and three services."""
    outputs = [
        Output("/clock", "rosgraph_msgs/Clock", nothing),
        Output("/course", "std_msgs/String", nothing, latched=True),
    ]
    outputs += [Output(f"/{name}/imu", "sensor_msgs/Imu", nothing) for name in names]
    inputs = [Input(f"/{name}/thrusters/left_thrust_cmd", "std_msgs/Float32", nothing, name) for name in names]
    services = [
        Service("/gazebo/reset_world", "std_srvs/Empty", lambda _: None),
        Service("/trigger", "std_srvs/Trigger", trigger),
        Service("/failing", "std_srvs/Trigger", failing),
    ]
    return RosInterface(
        {one.name: one for one in outputs},
        {one.name: one for one in inputs},
        {one.name: one for one in services},
        parameters or {"/robot_description": "<robot/>", "/wamv/gains": {"p": 1.5, "names": ["a", "b"]}},
    )


PORTS = itertools.cycle(random.Random(os.getpid()).sample(range(16_000, 32_000), 16_000))
"""Below those that Linux gives to whatever asks for any port, as programs beside this one do all the time."""


def free_port() -> int:
    """A port that nobody listens at, and that nobody gets who does not ask for it by number."""
    while True:
        port = next(PORTS)
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port


def until(condition: Callable[[], object], what: str, seconds: float = 10.0) -> None:
    """Wait for a condition that nothing signals."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.01)


class Served:
    """The table on a master, and a thread in the place of the simulation's that publishes at 50 Hz and answers.

    With `rosbridge=True` it is on a rosbridge too.
    """

    def __init__(self, port: int, table: RosInterface, **options) -> None:
        self.port, self.table = port, table
        self.network, self.inbox = Network(), Inbox()
        self.uri = f"http://127.0.0.1:{port}"
        self.graph = Graph(self.network, self.inbox, options.pop("node", "/gazebo"))
        self.bridge = Rosbridge(self.graph, port=0) if options.pop("rosbridge", False) else None
        self.ros = Ros1(self.graph, master_uri=self.uri, **options)
        self.wires = Wires(self.graph, [one for one in (self.ros, self.bridge) if one is not None])
        self.commands: list[Command] = []
        self.unknown_publishers: list[UnknownTopicPublisher] = []
        self.called: list[tuple[str, str]] = []
        self.ended = threading.Event()
        self.reason = ""
        self.ros.on_shutdown = self._end
        self.slowest = 0.0
        """Longest time that a call of publish() took [s]."""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._pump)

    def __enter__(self) -> Self:
        try:
            self.lines = self.wires.start()
        except BaseException:
            self.network.close()
            raise
        self.offer(self.table)
        self.wires.publish([Delivery(self.table.outputs["/course"], new("std_msgs/String", data="gate 3"), 0.0)])
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._stop.set()
        self._thread.join()
        self.wires.close()
        self.network.close()

    @property
    def url(self) -> str:
        """Of the rosbridge, if there is one."""
        return f"ws://127.0.0.1:{self.bridge.port}"

    def offer(self, table: RosInterface) -> None:
        self.table = table
        self.wires.offer(table)
        self.ros.settle(10.0)

    def _end(self, reason: str) -> None:
        self.reason = reason
        self.ended.set()

    def _pump(self) -> None:
        tick = 0
        while not self._stop.wait(0.02):
            tick += 1
            self.wires.publish(self._batch(tick * 0.02))
            commands, calls, unknown_publishers = self.inbox.drain()
            self.commands += commands
            self.unknown_publishers += unknown_publishers
            for call in calls:
                self.called.append((call.service, call.caller))
                try:
                    call.answer(self.table.services[call.service].answer(call.request), "")
                except CommandError as error:
                    call.answer(None, str(error))

    def _batch(self, t: float) -> list[Delivery]:
        wanted = [output for name, output in self.table.outputs.items() if name in self.wires.subscribed_topics]
        batch = []
        for output in wanted:
            if output.type == "sensor_msgs/Imu":
                header = {"stamp": stamp(t), "frame_id": output.name.split("/")[1]}
                batch.append(Delivery(output, new(output.type, header=header), t))
            elif output.type == "rosgraph_msgs/Clock":
                batch.append(Delivery(output, new(output.type, clock=stamp(t)), t))
        return batch


def environment(port: int, home: Path) -> dict[str, str]:
    """As a user of ROS has it, without what a venv adds."""
    return {
        "PATH": "/usr/bin:/bin",
        "HOME": str(home),
        "ROS_HOME": str(home),
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "LC_ALL": "C.UTF-8",
        "PYTHONUNBUFFERED": "1",
    }


def tools(script: str, port: int, home: Path, *, shell: str = "/bin/bash", timeout: float = 60.0) -> str:
    """What a script for a shell or `/usr/bin/python3` prints, errors included."""
    done = subprocess.run(
        [shell, "-c", script],
        env=environment(port, home),
        cwd=home,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        timeout=timeout,
        check=False,
    )
    return done.stdout


@contextmanager
def running(command: list[str], port: int, home: Path, ready: str = "") -> Iterator[subprocess.Popen[str]]:
    """A program beside the test, from the moment on when it has printed a text; ended by SIGINT."""
    process = subprocess.Popen(
        command,
        env=environment(port, home),
        cwd=home,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        start_new_session=True,
    )
    try:
        while ready and process.stdout is not None:
            line = process.stdout.readline()
            assert line, f"{command} ended before it said {ready!r}"
            if ready in line:
                break
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGINT)
        try:
            process.communicate(timeout=10.0)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
