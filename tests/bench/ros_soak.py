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
FLEET = "usv_count: {boats}\nlayout: grid\nspacing: 15\norigin: spawn\nsensors: [gps, imu]\n"


def main() -> int:
    """Soak; 0 if all is well."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--boats", type=int, default=20)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        return soak(Path(folder), given.minutes * 60.0, given.boats)


def soak(folder: Path, seconds: float, boats: int) -> int:
    """Run all of it; 0 if pace and resources held."""
    port = free_port()
    environment = {
        "PATH": "/usr/bin:/bin", "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(folder), "ROS_LOG_DIR": str(folder), "HOME": os.environ.get("HOME", "/root"),
    }  # fmt: skip
    (folder / "fleet.yaml").write_text(FLEET.format(boats=boats), encoding="utf-8")
    children = {}

    def start(name: str, *command: str) -> None:
        children[name] = subprocess.Popen(
            command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )

    start("master", PYTHON, "/usr/bin/rosmaster", "--core", "-p", str(port))
    wait_for(port)
    log = (folder / "serve.log").open("w+", encoding="utf-8")
    serve = subprocess.Popen(
        [sys.executable, "-m", "vrx_mj", "serve", "sydney_regatta", "--fleet", str(folder / "fleet.yaml"), "--ros1"],
        env={**os.environ, **{key: environment[key] for key in ("ROS_MASTER_URI", "ROS_IP")}}, stdout=log, stderr=log,
    )  # fmt: skip
    try:
        wait_for_text(folder / "serve.log", "cmd_vel is", 240.0)
        start("driver", PYTHON, "-c", DRIVER % (boats + 1))
        start("listener", PYTHON, "-c", LISTENER % (boats + 1))
        time.sleep(8.0)
        held = [resources(serve.pid)]
        print(f"at the start: {told(held[0])}", flush=True)
        begun, restarted, looked = time.monotonic(), False, time.monotonic()
        while time.monotonic() - begun < seconds:
            time.sleep(5.0)
            kill(children["listener"])
            start("listener", PYTHON, "-c", LISTENER % (boats + 1))
            if not restarted and time.monotonic() - begun > seconds / 2:
                restarted = True
                kill(children["master"])
                time.sleep(2.0)
                start("master", PYTHON, "/usr/bin/rosmaster", "--core", "-p", str(port))
                print("the master was restarted", flush=True)
            if time.monotonic() - looked > 30.0:
                looked = time.monotonic()
                print(f"{looked - begun:.0f} s: {told(resources(serve.pid))}", flush=True)
        kill(children.pop("listener"))
        time.sleep(3.0)
        start("listener", PYTHON, "-c", LISTENER % (boats + 1))
        time.sleep(8.0)
        held.append(resources(serve.pid))
        print(f"at the end: {told(held[1])}", flush=True)
    finally:
        serve.send_signal(signal.SIGINT)
        serve.wait(20.0)
        for child in children.values():
            kill(child)
    text = (folder / "serve.log").read_text(encoding="utf-8")
    print(text)
    pace = float(re.findall(r"pace ([0-9.]+)", text)[-1])
    (threads, files, before), (threads_now, files_now, now) = held
    print(
        f"pace {pace}, threads {threads} -> {threads_now}, files {files} -> {files_now}, {(now - before) / 1e6:+.1f} MB"
    )
    fine = pace >= 0.99 and threads_now == threads and files_now <= files + 2 and now - before < 10e6
    return 0 if fine else 1


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


def kill(child: subprocess.Popen[bytes]) -> None:
    """At once, without a farewell."""
    child.kill()
    child.wait()


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
