"""The files of a saved world as the one archive that a recording holds, and back: in memory, bounded."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping

from vrx_mj.errors import RecordError

__all__ = ["archive", "unpacked"]

EPOCH = (2020, 1, 1, 0, 0, 0)
"""Time of the files in the archive: one world, one archive."""
FILES = 20_000
"""Files in an archive, at most."""
ENTRY = b"PK\x01\x02"
"""Before each file in the archive's table of contents."""
DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, ValueError, OverflowError, OSError, RuntimeError)
"""What `zipfile` raises at an archive that is damaged."""
ENCRYPTED = 0x1
"""A bit of a file's flags."""


def archive(files: Mapping[str, bytes]) -> bytes:
    """A zip archive of files, the same bytes for the same files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as out:
        for name in sorted(files):
            out.writestr(zipfile.ZipInfo(name, EPOCH), files[name], zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def unpacked(blob: bytes, most: int) -> dict[str, bytes]:
    """Files of an archive, by their names, which are no paths on any disk; `most`: their bytes.

    What comes out is counted, whatever the archive says of itself.

    Raises:
        RecordError: it is damaged, or holds more, or what `archive` does not write.
    """
    if (count := blob.count(ENTRY)) > FILES:  # before an object is made for each
        raise RecordError(f"files: {count} files: at most {FILES}")
    try:
        with zipfile.ZipFile(io.BytesIO(blob)) as stored:
            return _bounded(stored, most)
    except DAMAGE as error:
        raise RecordError(f"files: the archive is damaged: {error}") from None


def _bounded(stored: zipfile.ZipFile, most: int) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    left = most
    for member in stored.infolist():
        if member.compress_type != zipfile.ZIP_DEFLATED or member.flag_bits & ENCRYPTED:
            raise RecordError("files: the archive is damaged: it is compressed in another way, or encrypted")
        if member.filename in files:
            raise RecordError("files: two of one name")
        with stored.open(member) as content:
            files[member.filename] = content.read(left + 1)
        left -= len(files[member.filename])
        if left < 0:
            raise RecordError(f"files: more than {most >> 20} MiB")
    return files
