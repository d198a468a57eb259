"""The command line, `vrx-mj`."""

import gc
import sys
from pathlib import Path

from vrx_mj.cli.environment import installed_first, intruder

__all__ = ["main"]


def main() -> None:
    """Run the command line on the packages that are installed, whatever PYTHONPATH names."""
    gc.set_threshold(10_000)  # packages make much and drop little: Python's 700 cost a twentieth of a short run
    try:
        Path.cwd()
    except OSError as error:
        sys.stderr.write(f"the current folder cannot be used: {error.strerror}; change to another\n")
        raise SystemExit(2) from None
    installed_first()
    try:
        from vrx_mj.cli.program import main as start

        start()
    except KeyboardInterrupt:  # while packages were loaded; from then on commands report it
        raise SystemExit(130) from None
    except Exception as error:
        if _is_interrupt(error):
            raise SystemExit(130) from None
        line = intruder(error)
        if line is None:
            raise
        sys.stderr.write(f"{line}\n")
        raise SystemExit(2) from None


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: a package that it hits while it loads may raise another one in its place."""
    return error is not None and (
        isinstance(error, KeyboardInterrupt) or _is_interrupt(error.__cause__ or error.__context__)
    )
