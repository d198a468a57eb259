"""Packages that an extra brings, and the command that installs them for this Python."""

import contextlib
import importlib.util
import os
import re
import shlex
import sys
from collections.abc import Iterator

__all__ = ["MissingPackageError", "importing", "install_command", "needs_extra", "shell_word"]

PLAIN = re.compile(r"[\w.:/\\-]+")
"""Words that Windows' shells take without quotes."""


def install_command(*wanted: str) -> str:
    """The command that installs requirements for this Python, as it can be pasted into a shell.

    Environments made by `uv venv` have no pip: for them it is a command of uv.

    Args:
        wanted: requirements, such as "vrx-mj[video]" or "numba>=0.61".
    """
    python, names = shell_word(sys.executable), " ".join(shell_word(name) for name in wanted)
    if importlib.util.find_spec("pip") is None:
        return f"uv pip install --python {python} {names}"
    return f"{python} -m pip install {names}"


def needs_extra(what: str, package: str, extra: str) -> str:
    """The message where a package of an extra is missing: "--ray needs Ray, which is not installed; run: ..."."""
    return f"{what} needs {package}, which is not installed; run: {install_command(f'vrx-mj[{extra}]')}"


class MissingPackageError(ModuleNotFoundError):
    """A package of an extra that is not installed; the message names the command that installs it."""


@contextlib.contextmanager
def importing(what: str, package: str, extra: str) -> Iterator[None]:
    """Around imports: where a package is missing, the error names the extra that brings it.

    Raises:
        MissingPackageError: the package is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != package.lower():
            raise
        raise MissingPackageError(needs_extra(what, package, extra), name=error.name) from None


def _ansi_c(char: str) -> str:
    """A character of a word in $'...', which bash and others expand."""
    plain = char.isprintable() and char not in "'\\"
    return char if plain else "".join(f"\\x{byte:02x}" for byte in os.fsencode(char))


def shell_word(word: str) -> str:
    """A word of a command, as the shell of this system takes it."""
    if os.name != "nt":
        return shlex.quote(word) if word.isprintable() else f"$'{''.join(map(_ansi_c, word))}'"
    return word if PLAIN.fullmatch(word) else f'"{word}"'
