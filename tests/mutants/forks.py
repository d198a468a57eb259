"""Runs pytest in forks of one process that has imported the heavy packages, which takes longer than most tests."""

import multiprocessing
import os
import resource
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

HEAVY = [
    "jinja2", "lxml.etree", "matplotlib", "mujoco", "numba", "numpy", "pyarrow", "pydantic", "pygments", "rich.console",
    "scipy.optimize", "scipy.spatial", "shapely", "typer", "yaml",
]  # fmt: skip
"""What tests import through ours; nothing of ours, and no plugin of pytest, which rewrites those itself."""

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(HEAVY)


TIMEOUT_FACTOR = 4.0
"""Wall time over processor time that is waited for: the machine may have other work."""


def run_pytest(arguments: Sequence[str], tree: Path, cache: Path, log: Path, limit: float) -> int | None:
    """The exit code of pytest in a copy of the repository, which writes to `log`.

    None if it takes more than `limit` seconds of processor time, or waits for ever.
    """
    process = _CONTEXT.Process(target=_pytest, args=(list(arguments), tree, cache, log, int(limit)))
    process.start()
    process.join(TIMEOUT_FACTOR * limit)
    if process.exitcode is None and process.pid is not None:
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
        return None
    return None if process.exitcode == -signal.SIGXCPU else process.exitcode


def _pytest(arguments: list[str], tree: Path, cache: Path, log: Path, limit: int) -> None:
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    with log.open("wb") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    source = str(tree / "src")
    os.environ.update({"PYTHONPATH": source, "VRX_MJ_CACHE": str(cache), "PYTHONDONTWRITEBYTECODE": ""})
    sys.dont_write_bytecode = False  # the next run has it
    os.chdir(tree)
    sys.path[:] = [source, *(entry for entry in sys.path if Path(entry).name != "tests")]
    import pytest

    code = int(pytest.main(arguments))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
