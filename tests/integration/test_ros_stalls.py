"""A server that stands still for a while, as a machine makes it: what its clients get on both wires."""

import contextlib
import itertools
import re
import signal
import subprocess
import threading
import time
from types import SimpleNamespace

import pytest

from ros1_peer import dial, frame_of, stream_of
from ros1_served import free_port
from rosbridge_client import Talk
from vrx_command import start
from vrx_mj.ros.messages import decode, md5sum
from vrx_mj.ros.serve import BURST, CATCHING_UP, MAX_LAG

pytestmark = pytest.mark.slow

FLEET = "{usv_count: 1, sensors: [gps, imu]}\n"
RATES = {
    "/clock": ("rosgraph_msgs/Clock", 100.0),
    "/wamv1/joint_states": ("sensor_msgs/JointState", 100.0),
    "/wamv1/sensors/imu/imu/data": ("sensor_msgs/Imu", 15.0),
    "/wamv1/sensors/gps/gps/fix": ("sensor_msgs/NavSatFix", 15.0),
}
TICK = 0.01
SECONDS = 60.0


def stamp_of(message):
    """Of a message as an object, or as JSON has it [s]."""
    time = message["clock" if "clock" in message else "header"]
    time = time.get("stamp", time)
    return time.get("sec", time.get("secs")) + 1e-9 * time.get("nanosec", time.get("nsecs"))


class Listener:
    """Stamps of messages by topic, each with the wall time at which it came."""

    def __init__(self):
        self.came = {topic: [] for topic in RATES}
        self._threads = []

    def add(self, topic, stamp):
        self.came[topic].append((time.monotonic(), stamp))

    def ros1(self, uri):
        for topic, (kind, _) in RATES.items():
            connection, _ = dial(stream_of(uri, topic), topic=topic, type=kind, md5sum=md5sum(kind))
            self._begin(self._hear_ros1, connection, topic, kind)
        return self

    def _hear_ros1(self, connection, topic, kind):
        with connection, contextlib.suppress(OSError):
            connection.settimeout(SECONDS)
            while (frame := frame_of(connection)) is not None:
                message = decode(frame, kind)
                moment = message.clock if topic == "/clock" else message.header.stamp
                self.add(topic, moment.sec + 1e-9 * moment.nanosec)

    def rosbridge(self, talk):
        for topic, (kind, _) in RATES.items():
            talk.say("subscribe", topic=topic, type=kind)
        self._begin(self._hear_rosbridge, talk)
        return self

    def _hear_rosbridge(self, talk):
        with contextlib.suppress(Exception):  # the connection ends with the server
            while True:
                message = talk.hear()
                self.add(message["topic"], stamp_of(message["msg"]))

    def _begin(self, hear, *what):
        self._threads.append(threading.Thread(target=hear, args=what, daemon=True))
        self._threads[-1].start()

    def wait(self, count, topic="/clock"):
        """Wait until so many more messages have come."""
        wanted, end = len(self.came[topic]) + count, time.monotonic() + SECONDS
        while len(self.came[topic]) < wanted:
            assert time.monotonic() < end, f"no {topic}"
            time.sleep(0.01)


@contextlib.contextmanager
def serving(folder, *options):
    """A served world, whose process can be stopped, and what listens to it on both wires."""
    (folder / "one.yaml").write_text(FLEET, encoding="utf-8")
    port = free_port()
    words = ("serve", "sydney_regatta", "--fleet", "one.yaml", "--ros1", "--rosbridge", "0", *options)
    process = start(*words, cwd=folder, ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1")
    lines = []
    try:
        url = next(match.group() for line in process.stderr if (match := re.search(r"ws://\S+", line)))
        next(line for line in process.stderr if "topics out" in line)
        reading = threading.Thread(target=lambda: lines.extend(process.stderr))
        reading.start()
        with Talk(SimpleNamespace(url=url)) as talk:
            yield SimpleNamespace(process=process, lines=lines, wires={
                "ROS 1": Listener().ros1(f"http://127.0.0.1:{port}"), "rosbridge": Listener().rosbridge(talk),
            })  # fmt: skip
            process.send_signal(signal.SIGINT)
            process.wait(SECONDS)
        reading.join(SECONDS)
    finally:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.kill()
            process.communicate(timeout=SECONDS)


@pytest.mark.parametrize("rate", [pytest.param(1.0, marks=pytest.mark.nightly), 2.0])
def test_after_a_stall_no_topic_comes_in_a_burst_or_with_a_gap(tmp_path, rate):
    with serving(tmp_path, "--rate", rate) as served:
        for wire in served.wires.values():
            wire.wait(50)
        ends = []
        for stall in (0.02, 0.3, 1.5):
            served.process.send_signal(signal.SIGSTOP)
            seen = None
            while seen != (seen := {name: last(wire) for name, wire in served.wires.items()}):
                time.sleep(stall)  # and again while what was sent before is still read
            ends.append((time.monotonic(), seen))
            served.process.send_signal(signal.SIGCONT)
            for wire in served.wires.values():
                wire.wait(round(100 * rate * min(stall, MAX_LAG) / (CATCHING_UP - 1.0)) + 100)
        for name, wire in served.wires.items():
            for topic, (_, frequency) in RATES.items():
                check(
                    f"{topic} on {name}",
                    wire.came[topic],
                    frequency,
                    rate,
                    [(t, seen[name][topic]) for t, seen in ends],
                )
    behind = [line for line in served.lines if "behind the pace: " in line]
    assert len(behind) == 1, behind


def last(wire):
    """The newest stamp of each topic."""
    return {topic: came[-1][1] for topic, came in wire.came.items()}


def check(what, came, frequency, rate, ends):
    """Stamps follow each other as the topic's rate has them, and none is sooner than what is lost is made up for."""
    stamps = [stamp for _, stamp in came]
    gaps = [later - before for before, later in itertools.pairwise(stamps)]
    assert all(abs(gap - 1.0 / frequency) < TICK - 1e-6 for gap in gaps), f"{what}: {min(gaps)} to {max(gaps)}"
    for begun, before in ends:
        after = [(at - begun, stamp - before) for at, stamp in came if at > begun and stamp > before]
        assert after
        ahead = max(passed - CATCHING_UP * rate * waited for waited, passed in after)
        assert ahead <= (BURST + 3) * TICK * max(1.0, rate) + 1.0 / frequency, f"{what}: {ahead} s ahead"
