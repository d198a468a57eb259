"""The user's cache folder: compiled kernels and answers of readers, which are made again if they are lost."""

import contextlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

_WRITE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
"""Bits of a mode that let others write."""
_MAX_LINKS = 40
"""Largest number of symbolic links on one path: as many as Linux follows."""


class Choice(NamedTuple):
    """A folder for compiled kernels."""

    folder: Path | None
    """The folder, if any."""
    refused: tuple[str, ...]
    """Why the candidates before it are not used, a sentence for each."""


class _Candidate(NamedTuple):
    """A folder that may be used."""

    path: Path
    is_named: bool = False
    """Whether the user has named it."""
    is_ours: bool = False
    """Whether it holds our files alone, inside a folder of the user's."""


def chosen_folder(name: str) -> Choice:
    """Make a folder `name` in the first place where this user alone can write to it.

    The places, in order: `VRX_MJ_CACHE`, the user's cache folder, the temporary folder.
    """
    refused: list[str] = []
    for candidate in _candidates():
        folder = candidate.path / name
        if candidate.is_ours:
            _make_private(candidate.path, name)
        reason = insecure(folder)
        if reason is None and not _make_writable(folder):
            reason = "it cannot be written" if candidate.is_named else ""
        reason = insecure(folder) if reason is None else reason  # of what has just been made, too
        if reason is None:
            return Choice(folder, tuple(refused))
        if reason:
            refused.append(f"no compiled kernels are read from {candidate.path} or kept there: {reason}")
    return Choice(None, tuple(refused))


def insecure(folder: Path) -> str | None:
    """Why somebody else could put files into a folder, or the folder into the place of another; None: nobody could.

    Trusted are this user, root, and the owner of the root folder, who in a container may have another number.
    """
    getuid = getattr(os, "getuid", None)
    if getuid is None:
        return None
    try:
        trusted, last = {0, getuid(), Path(folder.absolute().anchor).stat().st_uid}, Path(os.path.realpath(folder))
        for step in _steps(folder.absolute()):
            mode, owner = step.lstat().st_mode, step.lstat().st_uid
            if owner not in trusted:
                return f"{step} belongs to another user"
            is_sticky = mode & stat.S_ISVTX and step != last  # in /tmp each keeps what it made
            if mode & _WRITE_BY_OTHERS and not (stat.S_ISLNK(mode) or is_sticky):
                return f"others can write to {step}"
    except OSError:  # from here on there is nothing yet
        return None
    return None


def _steps(path: Path) -> Iterator[Path]:
    """All folders and symbolic links that are passed on the way along an absolute path, from the root on."""
    here, left, links = Path(path.anchor), list(path.parts[:0:-1]), 0
    yield here
    while left:
        step = here / left.pop()
        yield step
        if step.name == "..":
            here = here.parent
        elif step.is_symlink() and links < _MAX_LINKS:
            target, links = step.readlink(), links + 1
            left += target.parts[:0:-1] if target.is_absolute() else target.parts[::-1]
            here = Path(target.anchor) if target.is_absolute() else here
        else:
            here = step


def _candidates() -> Iterator[_Candidate]:
    named = os.environ.get("VRX_MJ_CACHE")
    if named:
        with contextlib.suppress(OSError):  # the current folder is gone
            yield _Candidate(Path(named).absolute(), is_named=True)
    with contextlib.suppress(RuntimeError, KeyError):  # no home folder is known
        yield _Candidate(_user_cache(Path.home()), is_ours=True)
    with contextlib.suppress(OSError):  # there is no usable temporary folder
        yield _Candidate(Path(tempfile.gettempdir()) / f"vrx_mj-{_user_name()}")


def _user_cache(home: Path) -> Path:
    """Return the platform's folder for caches of one user."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "vrx_mj"


def _user_name() -> str:
    """Return a name that is different for each user of the temporary folder."""
    getuid = getattr(os, "getuid", None)
    return str(getuid()) if getuid else os.environ.get("USERNAME", "user")


def _make_private(path: Path, name: str) -> None:
    """Take the right to write from others, if a folder of ours was made under a umask of 002.

    What they may have put there under `name` meanwhile is removed.
    """
    getuid = getattr(os, "getuid", None)
    with contextlib.suppress(OSError):
        status = path.lstat()
        if getuid and stat.S_ISDIR(status.st_mode) and status.st_uid == getuid() and status.st_mode & _WRITE_BY_OTHERS:
            path.chmod(stat.S_IMODE(status.st_mode) & ~_WRITE_BY_OTHERS)
            shutil.rmtree(path / name, ignore_errors=True)


def _make_writable(folder: Path) -> bool:
    """Make a folder, with those above it, for this user alone; whether files can be made in it."""
    try:
        for missing in [*reversed(folder.parents), folder]:
            with contextlib.suppress(FileExistsError):
                missing.mkdir(mode=0o700)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
