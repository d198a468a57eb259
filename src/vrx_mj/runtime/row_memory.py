"""Memory that the rows of a batch take, and the errors where there is not so much."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from vrx_mj.errors import CommandError
from vrx_mj.runtime.limits import total_memory

__all__ = ["allocating", "check_memory"]

FIXED = 455_000
"""Memory of any row [bytes]: MuJoCo's `mjData` itself, mostly statistics of its solver; measured with MuJoCo 4.0."""


def check_memory(n: int, data: mujoco.MjData) -> None:
    """Check that `n` rows like this one fit into the memory of this machine or container: else it ends the process.

    Raises:
        CommandError: they do not.
    """
    each, most = FIXED + int(data.nbuffer), total_memory()
    if most is not None and n * each > most:
        text = f"{_size(n * each)} are needed, {_size(each)} a row, and at most {_size(most)} can be had"
        raise CommandError(f"no memory for {n} rows: {text}; make fewer rows")


@contextmanager
def allocating(n: int, data: mujoco.MjData) -> Iterator[None]:
    """Around what allocates the memory of `n` rows like this one.

    Raises:
        CommandError: the system has refused it, say because of a limit (`ulimit -v`).
    """
    try:
        yield
    except (MemoryError, mujoco.FatalError) as error:
        each = FIXED + int(data.nbuffer) + int(data.narena)
        text = f"{_size(n * each)} of address space are needed, {_size(each)} a row"
        raise CommandError(
            f"no memory for {n} rows: {text}; make fewer rows, or raise the limit (ulimit -v)"
        ) from error


def _size(count: float) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{count / 1e6:.2f} MB"
