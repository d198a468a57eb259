"""Answers that were given before, in files: each valid while all that it came from is as it was."""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from vrx_mj.errors import VrxError
from vrx_mj.foreign.confinement import LISTED, READ
from vrx_mj.outputs import write_file

LARGEST = 256 << 20
"""Bytes that are kept; the oldest go first."""
_trimmed: list[Path] = []
"""Folders from which this process has removed what was too old."""
_DIGEST = 32
"""Bytes of the digest in front of a file."""


def state(use: str, path: str) -> str:
    """The digest of what was read of a path, or what it is."""
    try:
        found = os.stat(path)  # noqa: PTH116 - a path is a text here
        if use == READ and stat.S_ISREG(found.st_mode):
            return _content(path, (found.st_mtime_ns, found.st_size, found.st_ino))
        if use == LISTED and stat.S_ISDIR(found.st_mode):
            return hashlib.sha256("\0".join(sorted(os.listdir(path))).encode("utf-8", "surrogateescape")).hexdigest()  # noqa: PTH208
        return "folder" if stat.S_ISDIR(found.st_mode) else "file"
    except (OSError, ValueError):
        return "missing"


@lru_cache(maxsize=4096)
def _content(path: str, _stamp: tuple[int, int, int]) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def is_valid(files: Mapping[str, tuple[str, str]]) -> bool:
    """Whether all paths are as they were."""
    return all(state(use, path) == before for path, (use, before) in files.items())


def stored_answer(folder: Path, key: str) -> bytes | None:
    """The answer of a key; None without a whole one."""
    with contextlib.suppress(OSError):
        content = (folder / key).read_bytes()
        if hashlib.blake2b(content[_DIGEST:], digest_size=_DIGEST).digest() == content[:_DIGEST]:
            os.utime(folder / key)
            return content[_DIGEST:]
    return None


def keep(folder: Path, key: str, answer: bytes) -> None:
    """Keep an answer whole, or not at all; a full disk is no error. The first of a process removes the oldest."""
    content = hashlib.blake2b(answer, digest_size=_DIGEST).digest() + answer
    with contextlib.suppress(OSError, VrxError):
        write_file(folder / key, content, "an answer")
        if not _trimmed:
            _trimmed.append(folder)
            _trim(folder)


def _trim(folder: Path) -> None:
    """Remove the oldest files until those that are left are small enough."""
    with os.scandir(folder) as entries:
        found = sorted((entry.stat().st_mtime_ns, entry.stat().st_size, entry.path) for entry in entries)
    total = sum(size for _, size, _ in found)
    for _, size, path in found:
        if total <= LARGEST:
            return
        total -= size
        with contextlib.suppress(OSError):
            Path(path).unlink()
