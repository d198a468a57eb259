"""ArduPilot's own Rover, where there is one: the docs' mission, sailed by a campaign."""

import os
import re
import shutil
import sys
from pathlib import Path

import pytest

from campaigns import results_in
from vrx_command import vrx

ARDUROVER = shutil.which("ardurover", path=f"{os.environ.get('VRX_MJ_SITL', '')}:{os.environ.get('PATH', '')}")
PAGE = Path(__file__).parents[2] / "docs" / "ardupilot.md"
SEA = """
physics: {profile: marine}
sea: {model: jonswap, significant_height: 0.2, peak_period: 3}
georeference: {latitude: -33.7, longitude: 150.6, elevation: 0}
"""

pytestmark = [pytest.mark.slow, pytest.mark.nightly]


@pytest.mark.skipif(ARDUROVER is None, reason="needs ardurover on PATH or in the folder VRX_MJ_SITL")
@pytest.mark.parametrize("robot", ["blueboat", "wamv"])
def test_a_boat_sails_the_mission_of_the_docs(tmp_path, robot):
    pytest.importorskip("pymavlink")
    script = re.search(r'```python title="mission.py"\n(.*?)```', PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "mission.py").write_text(script[1], encoding="utf-8")
    (tmp_path / "sea.yaml").write_text(SEA)
    (tmp_path / "fleet.yaml").write_text(f"boats: [{{name: a, robot: {robot}, pose: [0, 0, 0, 0, 0, 1]}}]")
    program = f'(cd "$VRX_MJ_FOLDER" && exec {ARDUROVER} $VRX_MJ_ARDUPILOT) & exec {sys.executable} mission.py'
    words = ["--ardupilot", "--exec", program, "--worlds", "sea.yaml", "--fleet", "fleet.yaml", "--rate", "max"]
    code, out, err = vrx("campaign", *words, "--duration", "150", "-o", "out", cwd=tmp_path)
    (cell,) = (tmp_path / "out").glob("cells/*/*/*")
    log = (cell / "log.txt").read_text(encoding="utf-8", errors="replace")
    assert code == 0, (out, err, log)
    assert [each.error for each in results_in(tmp_path / "out").values()] == [None]
    assert "reached all" in log, log
    assert "WARN" not in log
