"""`serve --nmea` as a process: alone, beside rosbridge and beside an autopilot."""

import contextlib
import socket
import subprocess
import sys
import time

import pynmea2
import pytest

from fake_sitl import FakeSitl
from ros1_served import free_port
from vrx_command import environment

FLEET = "{boats: [{name: a, pose: [0, 0, 0, 0, 0, 0]}, {name: b, pose: [20, 0, 0, 0, 0, 0]}], sensors: [gps, imu]}"
AHEAD = (1900, 1500, 1900, *(1500,) * 13)


def connected(port, process):
    """A client of the TCP port, once that is open."""
    while process.poll() is None:
        with contextlib.suppress(OSError):
            return socket.create_connection(("127.0.0.1", port), timeout=60.0)
        time.sleep(0.1)
    pytest.fail(process.stderr.read())


@contextlib.contextmanager
def serving(folder, *options):
    """A world that is served to plotters for three seconds, and a connected client of boat b."""
    (folder / "fleet.yaml").write_text(FLEET)
    port = free_port()
    command = [sys.executable, "-m", "vrx_mj", "serve", "example_course", "--fleet", "fleet.yaml", "--duration", "3"]
    command += ["--nmea", f"b:{port}", *options]
    with subprocess.Popen(command, cwd=folder, env=environment(), stderr=subprocess.PIPE, text=True) as process:
        with connected(port, process) as client:
            yield client
        _, lines = process.communicate(timeout=60.0)
    assert process.returncode == 0, lines
    assert f"NMEA of b: TCP port {port} of 127.0.0.1" in lines


def heard(client):
    """The sentences by their kinds, until the run ends."""
    text = b""
    with contextlib.suppress(ConnectionResetError):
        while part := client.recv(1 << 16):
            text += part
    whole = text.decode().split("\r\n")[:-1]
    return [line for line in whole if line[0] == "!" or pynmea2.parse(line, check=True)]


@pytest.mark.slow
@pytest.mark.parametrize("beside", [(), ("--rosbridge",)])
def test_a_plotter_reads_a_served_boat(tmp_path, beside):
    with serving(tmp_path, *beside, *([str(free_port())] if beside else ())) as client:
        kinds = {line[3:6] for line in heard(client)}
    assert kinds >= {"GGA", "RMC", "VTG", "HDT", "ROT", "XDR"}


@pytest.mark.slow
def test_a_plotter_sees_a_boat_that_an_autopilot_sails(tmp_path):
    port = free_port()
    with serving(tmp_path, "--ardupilot", f"b:{port}") as client:
        with FakeSitl(("127.0.0.1", port)) as sitl:
            for _ in range(150):
                sitl.asked(AHEAD)
        lines = heard(client)
    speeds = [pynmea2.parse(line).spd_over_grnd for line in lines if "RMC" in line]
    assert len(speeds) == 4
    assert speeds[-1] > 1.0 > speeds[0]
