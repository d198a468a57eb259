"""A run that is stopped half-way keeps what it did."""

import json
import signal
import sys
import time

import pytest

from vrx_command import ended, start
from vrx_mj import read_record
from vrx_mj.errors import RecordError

FOREVER = ("run", "ocean", "--duration", "1000000", "--record", "run.rrd", "--summary", "s.json")
PACE = """
import time

def controller(obs, t):
    time.sleep(0.05)  # twice real time
    return {"wamv": {"left": 0.6, "right": 0.4}}
"""


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "测试 boats"
    place.mkdir()
    (place / "pace.py").write_text(PACE, encoding="utf-8")
    return place


@pytest.fixture
def sailing(folder, request):
    """A run that has recorded some seconds and goes on."""
    process = start(*FOREVER, "--control", "pace:controller", cwd=folder, heeds_ctrl_c=getattr(request, "param", True))
    give_up = time.monotonic() + 120.0
    while seconds_in(folder / "run.rrd") < 3.0:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < give_up
        time.sleep(0.2)
    yield process
    process.kill()
    process.communicate()


def seconds_in(file):
    """Simulated seconds in a recording; none where it cannot be read yet."""
    try:
        rows = read_record(file).time
    except RecordError:
        return 0.0
    return float(rows[-1]) if len(rows) else 0.0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends Ctrl-C to a whole console")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_sigterm_leave_a_whole_recording_and_the_summary(sailing, folder, number):
    sailing.send_signal(number)
    code, out, err = ended(sailing)
    summary = json.loads((folder / "s.json").read_text(encoding="utf-8"))
    record = read_record(folder / "run.rrd")
    assert (code, "Traceback" in err) == (1, False)
    assert "ocean, fleet single, seed 0 (interrupted)" in out
    assert summary["interrupted"] is True
    assert f"state_sha256 {summary['state_sha256']}" in out
    assert record.complete
    assert record.time[-1] == pytest.approx(summary["sim_time"], abs=0.06)  # a row is 0.05 s
    assert record.events[-1].text == "interrupted"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends Ctrl-C to a whole console")
@pytest.mark.parametrize("sailing", [False], indirect=True)
def test_a_background_job_ignores_ctrl_c_and_sigterm_ends_it(sailing, folder):
    reached = seconds_in(folder / "run.rrd")
    sailing.send_signal(signal.SIGINT)
    give_up = time.monotonic() + 60.0
    while seconds_in(folder / "run.rrd") < reached + 2.0:
        assert sailing.poll() is None, sailing.stderr.read()
        assert time.monotonic() < give_up
        time.sleep(0.2)
    sailing.send_signal(signal.SIGTERM)
    code, out, err = ended(sailing)
    assert (code, "Traceback" in err, "(interrupted)" in out) == (1, False, True)
    assert read_record(folder / "run.rrd").complete


@pytest.mark.slow
def test_a_killed_run_leaves_a_readable_recording(sailing, folder):
    seconds = 2.0
    time.sleep(seconds)
    sailing.kill()
    assert ended(sailing)[0] != 0
    record = read_record(folder / "run.rrd")
    assert not record.complete
    # At twice real time, and with a flush a second, of what was sailed meanwhile at most two seconds' worth is lost.
    assert record.time[-1] >= 3.0 + 0.5 * seconds
    assert record.states[-1].time == pytest.approx(record.time[-1], abs=1.1)  # a state a second


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends Ctrl-C to a whole console")
@pytest.mark.parametrize("module", ["typer", "pydantic", "mujoco", "numba"])
def test_ctrl_c_before_the_first_step_needs_no_traceback(folder, module):
    """While a package is imported, of which the program says so."""
    code = (
        f"import sys; sys.addaudithook(lambda event, given: event == 'import' and given[0] == {module!r} "
        "and print('ready', flush=True)); from vrx_mj.cli import main; sys.exit(main())"
    )
    process = start(*FOREVER, cwd=folder, program=("-c", code))
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    code, _, err = ended(process)
    assert "Traceback" not in err, err
    assert code in {130, -signal.SIGINT}  # as shells have it; the signal itself where Python had not begun to listen


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends Ctrl-C to a whole console")
def test_ctrl_c_that_a_package_catches_while_it_is_imported_ends_the_run(folder):
    code = """
import contextlib, signal, sys

class Catching:
    def find_spec(self, name, *_):
        if name == "numba":
            with contextlib.suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Catching())
from vrx_mj.cli import main
main()
"""
    code, _, err = ended(start(*FOREVER, cwd=folder, program=("-c", code)))
    assert (code, err, (folder / "run.rrd").exists()) == (130, "", False)
