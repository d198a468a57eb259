"""Rows on a graphics processor, without one: everything up to the launch, and what numba makes of the functions."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from needs import NUMBA_CUDA, needs

pytestmark = [needs(NUMBA_CUDA), pytest.mark.slow]
HERE = Path(__file__).parent
TESTS = HERE.parents[1]


def run(*command, **environment):
    """What a program prints; numba decides in its first import whether it simulates a processor."""
    own = {**os.environ, "PYTHONPATH": str(TESTS), "PYTHONWARNINGS": "ignore", **environment}
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False, env=own)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.nightly
def test_rows_in_the_simulator_are_those_of_the_cpu_to_the_bit():
    """Addresses, indices and flags, in profiles vrx and marine; a row that stops or diverges is named."""
    diverged, near, shape, text = run(str(HERE / "simulated_rows.py"), "vrx", "marine", NUMBA_ENABLE_CUDASIM="1")
    assert diverged.startswith("rows 2 have a state that is not finite")
    assert near.startswith("something is near rows 1 (1 in all): they stop until they are reset, or moved by host()")
    assert shape == "invalid commands of shape (3, 1), float64: (3, 4), float64 or float32, is needed"
    assert text == "invalid commands 'x': an array of numbers is needed"


def test_threads_that_share_a_row_of_marine_may_run_in_any_order():
    """All come to the numbers of the CPU, in whatever order they run between the places where they wait."""
    lines = run(str(HERE / "simulated_lanes.py"), NUMBA_ENABLE_CUDASIM="1")
    assert [line.partition(":")[0] for line in lines] == ["up", "down", "mixed"]


@pytest.mark.nightly
def test_environments_in_the_simulator_are_those_of_the_cpu_to_the_bit():
    """Steps, rewards, facts and episodes of every problem in open water, and nothing waits for the device."""
    lines = run(str(HERE / "simulated_environment.py"), NUMBA_ENABLE_CUDASIM="1")
    touch, picture, mode, unknown, dock, team, some, shape = lines
    assert touch.startswith("device cuda: boats may touch something in world world")
    assert dock == touch
    assert team.endswith('which only MuJoCo can step; leave out `device`, and take engine="free"')
    assert picture == mode == "device cuda: use make_vec, without render_mode, with autoreset_mode NextStep or SameStep"
    assert unknown == "no device named 'tpu'; known: cpu, cuda"
    assert some.startswith("device cuda: rows reset by themselves; leave out `reset_mask`")
    assert shape == "invalid actions of shape (3,): (2, 4) is needed"


def test_the_check_runs_through_in_the_simulator():
    """Every line of it but the driver's: comparisons, speeds, environments with tensors, a graph, and verdicts."""
    lines = run(str(HERE / "simulated_check.py"), NUMBA_ENABLE_CUDASIM="1")
    verdicts = lines[next(number for number, line in enumerate(lines) if line.startswith("verdicts")) + 1 :]
    assert len(verdicts) == 14
    assert all(line.startswith("numba's simulator: ") for line in verdicts)
    assert sum(line.endswith(": yes") for line in verdicts) == 9
    wanted = [line.split("wanted ")[1].split(":")[0] for line in verdicts if "wanted" in line]
    assert wanted == ["1000", "100", "400", "317", "20"]


@pytest.mark.parametrize(
    "kernels",
    [
        ("advance_vrx", "command", "observe", "copy_rows"),
        pytest.param(("advance_marine",), marks=pytest.mark.nightly),
    ],
)
def test_what_a_thread_does_compiles_for_the_processor(kernels):
    """In float64, with fused products, and without calls of functions that are not there."""
    counts = run(str(HERE / "ptx.py"), *kernels)
    assert len(counts) == len(kernels)
    assert all(int(count) > 0 for count in counts)


@pytest.mark.parametrize(
    ("command", "remedy"),
    [
        (("-c", "import vrx_mj, vrx_mj.cuda; vrx_mj.cuda.Batch(vrx_mj.compile_world('vrx2019/ocean'), 2)"),
         'take vrx_mj.Batch(engine="free"), or device="cpu"'),
        (("-m", "vrx_mj.cuda.check"), "run this on a machine with an NVIDIA card"),
    ],
)  # fmt: skip
def test_without_a_driver_the_message_says_what_to_do(command, remedy):
    done = subprocess.run([sys.executable, "-Wignore", *command], capture_output=True, text=True, check=False)
    *before, last = done.stderr.splitlines()
    assert last.endswith(f"no graphics processor: numba-cuda finds no driver or no NVVM (numba -s); {remedy}")
    assert (done.returncode, bool(before)) == (1, command[0] == "-c")  # the program's line is alone
