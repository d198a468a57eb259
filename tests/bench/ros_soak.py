"""A soak of `vrx-mj serve`: 20 boats, commanded and heard at 20 Hz, by clients that die, on a master that restarts.

Run by hand: `python tests/bench/ros_soak.py --minutes 10`, with Debian's ROS 1 tools (docs/ros.md). Prints what the
serving process holds each half minute, and at the end whether it kept its pace and leaked. Means something on an idle
machine only.
"""

import argparse
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PYTHON = "/usr/bin/python3"
DRIVER = """
import rospy, time
from std_msgs.msg import Float32
rospy.init_node("driver", anonymous=True)
names = [f"/wamv{n}/thrusters/{side}_thrust_cmd" for n in range(1, %d) for side in ("left", "right")]
outs = [rospy.Publisher(name, Float32, queue_size=1) for name in names]
while not rospy.is_shutdown():
    for out in outs:
        out.publish(0.4)
    time.sleep(0.05)
"""
LISTENER = """
import rospy
from sensor_msgs.msg import Imu, JointState, NavSatFix
rospy.init_node("listener", anonymous=True)
take = lambda message: None
for n in range(1, %d):
    rospy.Subscriber(f"/wamv{n}/sensors/imu/imu/data", Imu, take)
    rospy.Subscriber(f"/wamv{n}/sensors/gps/gps/fix", NavSatFix, take)
    rospy.Subscriber(f"/wamv{n}/joint_states", JointState, take)
rospy.spin()
"""
FLEET = "usv_count: {boats}\nlayout: grid\nspacing: 15\norigin: [-450, 230, 0]\nsensors: [gps, imu]\n"


def main() -> int:
    """Soak; 0 if all is well."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--boats", type=int, default=20)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        return soak(Path(folder), given.minutes * 60.0, given.boats)


class Scene:
    """A master, a served world, and clients, each a process."""

    def __init__(self, folder: Path, boats: int) -> None:
        self.port, self._boats, self._log = free_port(), boats, folder / "serve.log"
        self._environment = {
            "PATH": "/usr/bin:/bin", "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}", "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder), "ROS_LOG_DIR": str(folder), "HOME": os.environ.get("HOME", "/root"),
        }  # fmt: skip
        self._children: dict[str, subprocess.Popen[bytes]] = {}
        self.start_master()
        wait_for(self.port)
        fleet = folder / "fleet.yaml"
        fleet.write_text(FLEET.format(boats=boats), encoding="utf-8")
        command = [
            sys.executable,
            "-m",
            "vrx_mj",
            "serve",
            "sydney_regatta",
            "--fleet",
            str(fleet),
            "--nudge",
            "--ros1",
        ]
        ours = {**os.environ, **{key: self._environment[key] for key in ("ROS_MASTER_URI", "ROS_IP")}}
        with self._log.open("w", encoding="utf-8") as log:
            self.serve = subprocess.Popen(command, env=ours, stdout=log, stderr=log)
        wait_for_text(self._log, "cmd_vel is", 120.0)

    def start_master(self) -> None:
        """Debian's own."""
        self._start("master", PYTHON, "/usr/bin/rosmaster", "--core", "-p", str(self.port))

    def start_client(self, name: str, script: str) -> None:
        """A rospy script for so many boats."""
        self._start(name, PYTHON, "-c", script % (self._boats + 1))

    def kill(self, name: str) -> None:
        """At once, without a farewell."""
        child = self._children.pop(name)
        child.kill()
        child.wait()

    def end(self) -> str:
        """End all; the log of what served."""
        self.serve.send_signal(signal.SIGINT)
        self.serve.wait(20.0)
        for name in list(self._children):
            self.kill(name)
        return self._log.read_text(encoding="utf-8")

    def _start(self, name: str, *command: str) -> None:
        silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._children[name] = subprocess.Popen(command, env=self._environment, start_new_session=True, **silent)


def soak(folder: Path, seconds: float, boats: int) -> int:
    """Run all of it; 0 if pace and resources held."""
    scene = Scene(folder, boats)
    scene.start_client("driver", DRIVER)
    scene.start_client("listener", LISTENER)
    time.sleep(10.0)
    begun, restarted = time.monotonic(), False
    held = [resources(scene.serve.pid)]
    print(f"at the start: {told(held[0])}", flush=True)
    while time.monotonic() - begun < seconds:
        time.sleep(5.0)
        scene.kill("listener")
        scene.start_client("listener", LISTENER)
        if not restarted and time.monotonic() - begun > seconds / 2:
            restarted = True
            scene.kill("master")
            time.sleep(2.0)
            scene.start_master()
            scene.kill("driver")  # rospy does not register again
            scene.start_client("driver", DRIVER)
            print("the master was restarted", flush=True)
        print(f"{time.monotonic() - begun:.0f} s: {told(resources(scene.serve.pid))}", flush=True)
    time.sleep(10.0)
    held.append(resources(scene.serve.pid))
    print(f"at the end: {told(held[1])}", flush=True)
    text = scene.end()
    print(text)
    return judged(float(re.findall(r"pace ([0-9.]+)", text)[-1]), *held)


def judged(pace: float, before: tuple[int, int, int], after: tuple[int, int, int]) -> int:
    """0 if pace and resources held."""
    grown = after[2] - before[2]
    print(f"pace {pace}, threads {before[0]} -> {after[0]}, files {before[1]} -> {after[1]}, {grown / 1e6:+.1f} MB")
    return 0 if pace >= 0.99 and after[0] == before[0] and after[1] <= before[1] + 2 and grown < 10e6 else 1


def resources(pid: int) -> tuple[int, int, int]:
    """Threads, open files and resident memory [bytes] of a process."""
    process = Path(f"/proc/{pid}")
    pages = int((process / "statm").read_text().split()[1])
    return (
        len(list((process / "task").iterdir())),
        len(list((process / "fd").iterdir())),
        pages * os.sysconf("SC_PAGE_SIZE"),
    )


def told(held: tuple[int, int, int]) -> str:
    """In words."""
    return f"{held[0]} threads, {held[1]} open files, {held[2] / 1e6:.1f} MB"


def free_port() -> int:
    """A port that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(port: int) -> None:
    """Until somebody listens there."""
    for _ in range(200):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise TimeoutError(f"nobody listens on port {port}")


def wait_for_text(file: Path, text: str, seconds: float) -> None:
    """Until a file holds a text."""
    end = time.monotonic() + seconds
    while text not in file.read_text(encoding="utf-8"):
        if time.monotonic() > end:
            raise TimeoutError(file.read_text(encoding="utf-8"))
        time.sleep(0.1)


if __name__ == "__main__":
    raise SystemExit(main())
