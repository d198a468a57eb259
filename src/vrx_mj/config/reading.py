"""Files from elsewhere, read up to a limit: no device or pipe is opened, and no more is read than is allowed."""

import os
import stat
from pathlib import Path

from vrx_mj.errors import VrxError

__all__ = ["ReadingError", "read_limited"]

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_WAITS_FOR_NOBODY = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)


class ReadingError(VrxError):
    """A file that cannot be read; the message says why, without its name."""


def read_limited(file: Path, most: int) -> bytes:
    """The bytes of a regular file of at most so many.

    Raises:
        ReadingError: it is not there, may not be read, is not a file, or is larger.
    """
    try:
        _check(file.stat())
        handle = os.open(file, os.O_RDONLY | _WAITS_FOR_NOBODY)
        with os.fdopen(handle, "rb") as stream:
            size = _check(os.fstat(handle))
            data = b"" if size > most else stream.read(most + 1)
    except OSError as error:
        raise ReadingError(f"cannot be read: {error.strerror}") from None
    except ValueError:
        raise ReadingError("cannot be read: its name is not valid") from None
    if size > most or len(data) > most:
        raise ReadingError(f"more than {most / 1e6:g} MB, the largest size that is read")
    return data


def _check(status: os.stat_result) -> int:
    """The size of a regular file; anything else may have no end, or none that comes."""
    for is_kind, words in _KINDS:
        if is_kind(status.st_mode):
            raise ReadingError(f"cannot be read: it is {words}, not a file")
    return status.st_size
