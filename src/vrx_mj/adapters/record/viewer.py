"""The rerun executable: joins a recording and its blueprint, and opens recordings."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from vrx_mj.errors import RecordError

__all__ = ["join_blueprint", "open_viewer", "viewer_binary"]

JOIN_SECONDS = 600.0
"""Longest that joining may take."""
MANY_CHUNKS = 4000
"""Recordings of more chunks are compacted when they are closed: a viewer opens those faster."""


def viewer_binary() -> Path:
    """The executable inside the installed rerun package: the script beside Python only wraps it."""
    import rerun_cli

    name = "rerun.exe" if sys.platform == "win32" else "rerun"
    path = Path(rerun_cli.__file__).with_name(name)
    if not path.is_file():
        raise RecordError(f"no rerun viewer at '{path}': install rerun-sdk for this platform")
    return path


def join_blueprint(recording: Path, blueprint: Path, output: Path, *, chunks: int) -> None:
    """Write `recording` with `blueprint` and a table of contents to `output`."""
    how = ["optimize", "--profile", "live"] if chunks > MANY_CHUNKS else ["merge"]
    command = [str(viewer_binary()), "rrd", *how, str(recording), str(blueprint), "-o", str(output)]
    done = subprocess.run(command, capture_output=True, timeout=JOIN_SECONDS, check=False)
    if done.returncode != 0:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise RecordError(f"rerun cannot finish '{recording}': {said[-1] if said else done.returncode}")


def open_viewer(*files: Path) -> int:
    """Open recordings and blueprints in the viewer, listening to this machine only; its exit code."""
    command = [str(viewer_binary()), "--bind", "127.0.0.1", *(str(file) for file in files)]
    return subprocess.run(command, check=False).returncode
