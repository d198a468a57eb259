"""States that have diverged: the message, and the last good state, which is saved."""

import contextlib
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.errors import VrxError
from vrx_mj.runtime.state import State

__all__ = ["KEPT", "divergence_message", "rows_divergence_message", "save_last_good_state"]

PREFIX = "vrx_mj-diverged-"
FILE = "last_good.state"
KEPT = 10
"""Folders with states of diverged runs that one user keeps in the temporary folder; the oldest go first."""
KEPT_BYTES = 100_000_000
"""What these may hold together [bytes]; the newest is kept whatever its size."""


def divergence_message(body: str, time: float, timestep: float, good: State, kept: str) -> str:
    """Say which body diverged, at which time [s], and what became of the last good state: `save_last_good_state`."""
    return (
        f"{body} has a state that is not finite, or huge, at step {round(time / timestep)} (t = {time:g} s). "
        f"The state at t = {good.time:g} s {kept}"
    )


def rows_divergence_message(rows: npt.NDArray[np.integer[Any]], time: float) -> str:
    """Say which rows of a batch diverged, the first at about this time [s]."""
    more = f" and {len(rows) - 5} more" if len(rows) > 5 else ""
    return (
        f"rows {', '.join(map(str, rows[:5]))}{more} have a state that is not finite, or huge, at about t = "
        f"{time:g} s; they do not move until reset(rows)"
    )


def save_last_good_state(good: State) -> str:
    """Save a state to a new folder for this user alone, and say where; older ones make room for it."""
    try:
        file = Path(tempfile.mkdtemp(prefix=PREFIX)) / FILE
        good.save(file)
    except (OSError, VrxError) as error:
        return f"could not be saved: {getattr(error, 'strerror', None) or error}"
    others = sorted(_folders(file.parent), reverse=True)
    room, kept = KEPT_BYTES - file.stat().st_size, 1
    for _, size, folder in others:
        room -= size
        if kept < KEPT and room >= 0:
            kept += 1
        else:
            shutil.rmtree(folder, ignore_errors=True)
    return f"is in {file}: State.load reads it; the last {KEPT} such states are kept"


def _folders(newest: Path) -> Iterator[tuple[float, int, Path]]:
    """The other folders that diverged runs of this user have left: time of change [s], size [bytes] and path.

    Those of others, and symbolic links, are left alone.
    """
    getuid = getattr(os, "getuid", None)
    for folder in newest.parent.glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):
            status = folder.lstat()
            ours = stat.S_ISDIR(status.st_mode) and (getuid is None or status.st_uid == getuid())
            if ours and folder != newest and re.fullmatch(rf"{PREFIX}[a-z0-9_]+", folder.name):
                size = sum(file.lstat().st_size for file in folder.iterdir())
                yield status.st_mtime, size, folder
