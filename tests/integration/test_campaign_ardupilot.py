"""Campaigns of ArduPilot's SITL: each trial has its own, at ports of its own."""

from pathlib import Path

import pytest

from campaigns import results_in
from vrx_command import vrx

pytestmark = pytest.mark.slow

WORLD = """
physics: {profile: marine}
sea: {model: jonswap, significant_height: 0.2, peak_period: 3}
georeference: {latitude: -33.7, longitude: 150.6, elevation: 0}
"""
FLEET = "boats: [{name: a, pose: [0, 0, 0, 0, 0, 0]}, {name: b, pose: [0, 20, 0, 0, 0, 0]}]"
PROGRAM = """
import os, sys
sys.path.insert(0, sys.argv[1])
from fake_sitl import FakeSitl

sitls, ports = [], []
for end in ("", "_1"):
    words = os.environ["VRX_MJ_ARDUPILOT" + end].split()
    given = dict(zip(words[::2], words[1::2]))
    port = 9002 + 10 * int(given["--instance"])
    assert given["--model"] == "JSON:127.0.0.1"
    assert given["--home"] == "-33.7000000,150.6000000,0,0"
    assert os.environ["VRX_MJ_MAVLINK" + end] == f"tcp:127.0.0.1:{port - 9002 + 5760}"
    sitls.append(FakeSitl(("127.0.0.1", port)))
assert os.path.isdir(os.environ["VRX_MJ_FOLDER"])
print("sails", os.environ["VRX_MJ_WORLD"], os.environ["VRX_MJ_SEED"], flush=True)
pulses = (1900, 1500, 1700, *(1500,) * 13)
while True:
    for sitl in sitls:
        sitl.send(pulses)
    for sitl in sitls:
        sitl.receive()
"""


@pytest.mark.nightly
def test_a_campaign_of_autopilots_sails_the_same_bits_twice(tmp_path):
    (tmp_path / "sea.yaml").write_text(WORLD)
    (tmp_path / "two.yaml").write_text(FLEET)
    (tmp_path / "sitl.py").write_text(PROGRAM)
    tests = Path(__file__).parents[1]
    words = ["--ardupilot", "--exec", f"python sitl.py '{tests}'", "--worlds", "sea.yaml", "--fleet", "two.yaml"]
    words += ["--seeds", "0,1", "--duration", "3", "--rate", "max", "--jobs", "2"]
    runs = []
    for name in ("first", "second"):
        code, out, err = vrx("campaign", *words, "-o", name, cwd=tmp_path)
        assert code == 0, (out, err)
        runs.append([each.state_sha256 for _, each in sorted(results_in(tmp_path / name).items())])
    assert runs[0] == runs[1]
    assert len(set(runs[0])) == 2


@pytest.mark.nightly
def test_an_autopilot_that_ends_fails_its_trial_with_its_last_lines(tmp_path):
    (tmp_path / "sea.yaml").write_text(WORLD)
    words = ["--ardupilot", "--exec", "echo no ardurover; exit 3", "--worlds", "sea.yaml", "--duration", "3"]
    code, out, _ = vrx("campaign", *words, "-o", "out", cwd=tmp_path)
    assert code == 1
    assert "the program ended with exit code 3; its last lines: no ardurover" in out
