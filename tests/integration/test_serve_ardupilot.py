"""`serve --ardupilot` as a process, alone and beside rosbridge."""

import re
import subprocess
import sys

import pytest

import vrx_mj
from fake_sitl import FakeSitl
from ros1_served import free_port
from vrx_command import environment

FLEET = "boats: [{name: a, pose: [0, 0, 0, 0, 0, 0]}]\n"
AHEAD = (1900, 1500, 1900, *(1500,) * 13)


def served(folder, name, *options):
    """The last answer, and what `serve` wrote, of a run of two seconds."""
    port = free_port()
    command = [sys.executable, "-m", "vrx_mj", "serve", "example_course", "--fleet", "fleet.yaml", "--duration", "2"]
    command += ["--ardupilot", f"a:{port}", "--record", name, *options]
    with subprocess.Popen(command, cwd=folder, env=environment(), stderr=subprocess.PIPE, text=True) as process:
        with FakeSitl(("127.0.0.1", port)) as sitl:
            for _ in range(100):
                answer = sitl.asked(AHEAD)
        _, lines = process.communicate(timeout=60.0)
    assert process.returncode == 0, lines
    return answer, lines


@pytest.mark.slow
def test_a_served_boat_sails_by_its_autopilot_and_twice_alike(tmp_path):
    (tmp_path / "fleet.yaml").write_text(FLEET)
    first, lines = served(tmp_path, "first.rrd")
    second, _ = served(tmp_path, "second.rrd", "--rosbridge", str(free_port()))
    assert first == second
    assert first["timestamp"] == [pytest.approx(2.0)]
    assert first["velocity"][1] > 0.3  # the bow is to the east
    assert re.search(r"a: channels 1 left, 3 right; waiting for ardurover --(sim-port-out|instance) \d+ ", lines)
    assert "wamv/ardurover.parm" in lines
    runs = [vrx_mj.read_record(tmp_path / name).boats["a"].position for name in ("first.rrd", "second.rrd")]
    assert runs[0].tobytes() == runs[1].tobytes()
