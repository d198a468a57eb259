"""Views in a rerun file: after what was recorded, with a table of contents of both.

The form of the file is that of https://rerun.io/docs/concepts/rrd-format: messages, of which the last is the table of
contents, and a trailer that says where that is. The table is a protobuf message, which has for each store an Arrow
table with the places of its chunks.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa

from vrx_mj.recording.rrd_file import FILE_HEADER, MAGIC, MESSAGE_HEADER

__all__ = ["add_views"]

TRAILER, MARK = struct.Struct("<QQI4s4sI"), b"FOOT"
"""End of a file: where its table of contents begins, its length [bytes] and checksum, and that it is the only one."""
STORE, ACTIVATION = 1, 3
"""Field of the name of a store; kind of the message that has a blueprint used."""
TABLE, PAYLOAD, SIZE = 4, 2, 4
"""Fields of a store's table of contents: the Arrow table; and of that: its bytes, as LZ4, and their number before."""
OFFSETS = "chunk_byte_offset"
"""Column of the places of chunks [bytes]."""


def add_views(file: Path, views: bytes) -> None:
    """Add a blueprint, the bytes of an `.rbl` file, to a complete file without one.

    Raises:
        OSError: it cannot be written.
    """
    with file.open("r+b") as stream:
        contents, end = footer_of(stream)
        own, own_end = footer_of(io.BytesIO(views))
        contents += moved(own, end - FILE_HEADER)
        (store,) = (dict(fields(part))[STORE] for _, part in fields(own) if isinstance(part, bytes))
        used = message([(STORE, store), (2, 1), (3, 1)])  # by this recording, and by all of its application
        stream.seek(end)
        stream.write(views[FILE_HEADER:own_end] + MESSAGE_HEADER.pack(ACTIVATION, len(used)) + used)
        stream.write(MESSAGE_HEADER.pack(0, len(contents)))
        start = stream.tell()
        stream.write(contents + TRAILER.pack(start, len(contents), xxh32(contents), MAGIC, MARK, 1))
        stream.truncate()


def footer_of(stream: BinaryIO) -> tuple[bytes, int]:
    """The table of contents of a file, and where its message begins."""
    stream.seek(-TRAILER.size, io.SEEK_END)
    start, length, _, mark, identifier, count = TRAILER.unpack(stream.read(TRAILER.size))
    assert (mark, identifier, count) == (MAGIC, MARK, 1), "rerun has just written it"
    stream.seek(start)
    return stream.read(length), start - MESSAGE_HEADER.size


def moved(contents: bytes, by: int) -> bytes:
    """A table of contents whose chunks are so many bytes later."""
    out = b""
    for number, store in fields(contents):
        assert isinstance(store, bytes), "a message"
        parts = [(key, moved_table(part, by) if key == TABLE else part) for key, part in fields(store)]
        out += message([(number, message(parts))])
    return out


def moved_table(table: int | bytes, by: int) -> bytes:
    """The places of a store's chunks, so many bytes later."""
    assert isinstance(table, bytes), "a message"
    found, codec = dict(fields(table)), pa.Codec("lz4_raw")
    rows = pa.ipc.open_stream(codec.decompress(found[PAYLOAD], decompressed_size=found[SIZE])).read_all()
    offsets = pa.array(rows[OFFSETS].to_numpy() + np.uint64(by))
    column = rows.schema.get_field_index(OFFSETS)
    rows = rows.set_column(column, rows.schema.field(column), offsets)
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, rows.schema) as writer:
        writer.write_table(rows)
    plain = sink.getvalue()
    return message({**found, PAYLOAD: codec.compress(plain, asbytes=True), SIZE: len(plain)}.items())


def fields(text: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Numbers and values of the fields of a protobuf message: whole numbers, or bytes."""
    place = 0
    while place < len(text):
        key, place = varint(text, place)
        value, place = varint(text, place)
        if key % 8 == 0:
            yield key // 8, value
        else:
            yield key // 8, text[place : place + value]
            place += value


def varint(text: bytes, place: int) -> tuple[int, int]:
    """A number of seven bits in a byte, the lowest first, and the place after it."""
    value = shift = 0
    while True:
        value |= (text[place] & 127) << shift
        place, shift = place + 1, shift + 7
        if text[place - 1] < 128:
            return value, place


def message(found: Iterable[tuple[int, int | bytes]]) -> bytes:
    """A protobuf message of some fields."""
    out = b""
    for number, value in found:
        if isinstance(value, int):
            out += packed(8 * number) + packed(value)
        else:
            out += packed(8 * number + 2) + packed(len(value)) + value
    return out


def packed(value: int) -> bytes:
    """A number of seven bits in a byte, the lowest first."""
    return bytes([value]) if value < 128 else bytes([value & 127 | 128]) + packed(value >> 7)


PRIMES = 0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D, 0x27D4EB2F, 0x165667B1
MASK = 0xFFFFFFFF


def xxh32(text: bytes, seed: int = 7850921) -> int:
    """XXH32, by the specification of xxHash; the seed is rerun's."""
    one, two, three, four, five = PRIMES
    words = struct.unpack_from(f"<{len(text) // 4}I", text)
    whole = len(words) // 4 * 4
    if whole:
        lanes = [(seed + one + two) & MASK, (seed + two) & MASK, seed, (seed - one) & MASK]
        for lane in range(4):
            value = lanes[lane]
            for word in words[lane:whole:4]:
                value = (value + word * two) & MASK
                value = ((value << 13 | value >> 19) & MASK) * one & MASK  # not by `rotated`, which takes twice as long
            lanes[lane] = value
        total = sum(rotated(value, turn) for value, turn in zip(lanes, (1, 7, 12, 18), strict=True))
    else:
        total = seed + five
    total += len(text)
    for word in words[whole:]:
        total = rotated((total + word * three) & MASK, 17) * four & MASK
    for byte in text[4 * len(words) :]:
        total = rotated((total + byte * five) & MASK, 11) * one & MASK
    total &= MASK
    total = (total ^ total >> 15) * two & MASK
    total = (total ^ total >> 13) * three & MASK
    return total ^ total >> 16


def rotated(value: int, by: int) -> int:
    """A number of 32 bits turned to the left."""
    return (value << by | value >> 32 - by) & MASK
