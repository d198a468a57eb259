"""What we change in MuJoCo's library for the whole process."""

import subprocess
import sys


def test_a_warning_of_mujocos_is_printed_and_leaves_no_file(tmp_path):
    """A body that is infinitely fast: MuJoCo warns of it, and writes a log into the current folder by default."""
    program = (
        "import vrx_mj.libmujoco, mujoco\n"
        'model = mujoco.MjModel.from_xml_string(\'<mujoco><worldbody><body><freejoint/><geom size="1"/></body>'
        "</worldbody></mujoco>')\n"
        "data = mujoco.MjData(model)\n"
        "data.qvel[:] = float('inf')\n"
        "mujoco.mj_step(model, data)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "WARNING: Nan, Inf or huge value in QVEL" in done.stderr
    assert list(tmp_path.iterdir()) == []
