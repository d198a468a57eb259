"""`vrx-mj` in a process of its own, as a user starts it."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import vrx_mj

SOURCES = Path(vrx_mj.__file__).resolve().parents[1]
SECONDS = 300.0


def environment(python_path=(), **changes):
    """This process's environment with some variables changed; None removes one.

    PYTHONPATH ends with the folder of the vrx_mj under test, which need not be installed.
    """
    found = {**os.environ, "PYTHONIOENCODING": "utf-8", "COLUMNS": "120"}
    found["PYTHONPATH"] = os.pathsep.join(str(entry) for entry in (*python_path, SOURCES))
    found.update({name: str(value) for name, value in changes.items() if value is not None})
    return {name: value for name, value in found.items() if changes.get(name, "") is not None}


@contextlib.contextmanager
def ctrl_c(*, heeded):
    """Have processes that are started here heed Ctrl-C, or ignore it like a background job of a shell script."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.default_int_handler if heeded else signal.SIG_IGN
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def start(*words, cwd, flags=(), program=("-m", "vrx_mj"), python_path=(), heeds_ctrl_c=True, **changes):
    """Start `vrx-mj` with these words; the process. It heeds Ctrl-C even where this one ignores it."""
    with ctrl_c(heeded=heeds_ctrl_c):
        return subprocess.Popen(
            [sys.executable, *flags, *program, *map(str, words)],
            cwd=cwd,
            env=environment(python_path, **changes),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )


def ended(process):
    """The exit code, stdout and stderr of a process that `start` began."""
    out, err = process.communicate(timeout=SECONDS)
    return process.returncode, out, err


def vrx(*words, cwd, **how):
    """Run `vrx-mj` with these words to its end."""
    return ended(start(*words, cwd=cwd, **how))


def state_in(out):
    """The `state_sha256` that a run printed."""
    lines = [line.split() for line in out.splitlines() if line.startswith("state_sha256")]
    assert len(lines) == 1, out
    return lines[0][1]
