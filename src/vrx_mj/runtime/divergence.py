"""What is told, and kept, when a state has diverged."""

import tempfile
from pathlib import Path

from vrx_mj.runtime.state import State

__all__ = ["told"]


def told(body: str, time: float, timestep: float, good: State) -> str:
    """Save the last good state to a file; tell which body diverged, at which time [s], and where that file is."""
    file = Path(tempfile.mkdtemp(prefix="vrx_mj-")) / "last_good.state"
    good.save(file)
    return (
        f"{body} has a state that is not finite, or huge, at step {round(time / timestep)} (t = {time:g} s). "
        f"The state at t = {good.time:g} s is in {file}: State.load reads it"
    )
