"""Packages: what an extra brings, the command that installs it for this Python, PyTorch's triton; and our assets."""

import contextlib
import ctypes
import importlib.util
import os
import re
import shlex
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_PLAIN = re.compile(r"[\w.:/\\-]+")
"""Words that Windows' shells take without quotes."""


def install_command(*wanted: str) -> str:
    """The command that installs requirements for this Python, as it can be pasted into a shell.

    Environments made by `uv venv` have no pip: for them it is a command of uv.

    Args:
        wanted: requirements, such as "numba>=0.61".
    """
    python, names = shell_word(sys.executable), " ".join(shell_word(name) for name in wanted)
    if importlib.util.find_spec("pip") is None:
        return f"uv pip install --python {python} {names}"
    return f"{python} -m pip install {names}"


def install_extra(extra: str) -> str:
    """How to install a missing extra: "run in the clone of vrx_mj: ..."; no registry of packages has ours."""
    return f"run in the clone of vrx_mj: {install_command(f'.[{extra}]')}"


def needs_extra(what: str, package: str, extra: str) -> str:
    """The message where a package of an extra is missing: "--ray needs Ray, which is not installed; run ..."."""
    return f"{what} needs {package}, which is not installed; {install_extra(extra)}"


class MissingPackageError(ModuleNotFoundError):
    """A package of an extra that is not installed; the message names the command that installs it."""


@contextlib.contextmanager
def importing(what: str, package: str, extra: str) -> Iterator[None]:
    """Make imports of a missing package name the extra that brings it.

    Raises:
        MissingPackageError: the package is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != package.lower():
            raise
        raise MissingPackageError(needs_extra(what, package, extra), name=error.name) from None


def load_triton() -> None:
    """Load the LLVM of PyTorch's triton, if it is installed, before Mesa's: later it would call Mesa's, and crash."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        triton = importlib.util.find_spec("triton")
        for folder in (triton and triton.submodule_search_locations) or ():
            ctypes.CDLL(f"{folder}/_C/libtriton.so")


def _ansi_c(char: str) -> str:
    """A character of a word in $'...', which bash and others expand."""
    plain = char.isprintable() and char not in "'\\"
    return char if plain else "".join(f"\\x{byte:02x}" for byte in os.fsencode(char))


def shell_word(word: str) -> str:
    """A word of a command, as the shell of this system takes it."""
    if os.name != "nt":
        return shlex.quote(word) if word.isprintable() else f"$'{''.join(map(_ansi_c, word))}'"
    return word if _PLAIN.fullmatch(word) else f'"{word}"'


@cache
def root() -> Path:
    """The folder that holds `assets`, `templates` and `fleets`.

    The package's own folder when it was installed from a wheel, the repository in an editable install.
    """
    package = Path(__file__).resolve().parent
    return package if (package / "assets").is_dir() else package.parents[1]
