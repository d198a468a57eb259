"""What we change in MuJoCo's library for the whole process."""

import os
import signal
import subprocess
import sys

import pytest

from vrx_mj import libmujoco


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


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a system without fork")
def test_a_process_that_is_forked_while_another_thread_takes_the_clock_can_take_it():
    with libmujoco.without_timers._lock:
        child = os.fork()
        if not child:
            signal.alarm(5)  # or it would wait for ever
            with libmujoco.without_timers:
                os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
