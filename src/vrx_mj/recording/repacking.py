"""The messages of a file as rerun wrote it, and the file with smaller ones: rerun packs by a quick LZ4.

They are in the form of protocol buffers. The last one has a table of where the chunks are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa

from vrx_mj.recording.rrd_file import FILE_HEADER, MESSAGE_HEADER

END, CHUNK = 0, 2
"""Kinds of messages."""
PACKED, SIZE, CONTENT = 2, 3, 5
"""Fields of a chunk: how it is packed, the length of what is in it [bytes], and what is in it."""
MANIFEST, TABLE, TABLE_CONTENT, TABLE_PACKED, TABLE_SIZE = 1, 4, 2, 3, 4
"""A field of the last message, one of what is in it, and likewise those of the table that is in that."""
LZ4, LEVEL = 2, 4
"""The number of this kind of packing, and how thorough ours is: more takes twice the time for a hundredth less."""
LOOSE, SMALL = 3, 4096
"""Chunks that rerun made smaller by less are left, as nothing makes them much smaller, and those of few bytes."""

Fields = dict[int, Any]
"""A message by the numbers of its fields: whole numbers and bytes."""


def messages(file: Path) -> Iterator[tuple[int, int, bytes]]:
    """Kind, place in the file and content of every message of a file that was completed."""
    with file.open("rb") as stream:
        stream.seek(FILE_HEADER)
        kind = CHUNK
        while kind != END:
            kind, length = MESSAGE_HEADER.unpack(stream.read(MESSAGE_HEADER.size))
            yield kind, stream.tell(), stream.read(length)


def repacked(source: Path, target: Path) -> Path:
    """`target`, to which a file just written by rerun is copied with smaller chunks, for rerun to join it with others.

    What is not as we know it from this version of rerun stays in `source`, which is returned instead.

    Raises:
        OSError: it cannot be written.
    """
    moved: dict[int, tuple[int, int]] = {}
    with source.open("rb") as old, target.open("wb") as new:
        new.write(old.read(FILE_HEADER))
        try:
            for kind, begin, content in messages(source):
                packed = _smaller(content) if kind == CHUNK else _moved(content, moved) if kind == END else content
                new.write(MESSAGE_HEADER.pack(kind, len(packed)))
                moved[begin] = new.tell(), len(packed)
                new.write(packed)
        except (LookupError, ValueError):
            return source
    return target


def fields_of(message: bytes) -> Fields:
    """The fields of a message that has each of them once.

    Raises:
        LookupError, ValueError: it has others.
    """
    found: Fields = {}
    at = 0
    while at < len(message):
        tag, at = _number(message, at)
        value, at = _number(message, at)
        if tag % 8 not in (0, 2) or tag // 8 in found:
            raise ValueError(f"field {tag // 8}: of another kind, or twice")
        found[tag // 8] = message[at : at + value] if tag % 8 else value
        at += value if tag % 8 else 0
    return found


def unpacked(block: bytes, size: int) -> bytes:
    """What is in a block of LZ4, of a size [bytes]."""
    content: bytes = pa.Codec("lz4_raw").decompress(block, size, asbytes=True)
    return content


def _smaller(message: bytes) -> bytes:
    """A chunk, packed better."""
    if len(message) < SMALL:
        return message
    fields = fields_of(message)
    if fields.get(PACKED) != LZ4 or fields[SIZE] < LOOSE * len(message):
        return message
    return _message(fields | {CONTENT: _packed(unpacked(fields[CONTENT], fields[SIZE]))})


def _moved(message: bytes, moved: Mapping[int, tuple[int, int]]) -> bytes:
    """The last message, for chunks that were at these places and now are at others, of other lengths [bytes]."""
    manifest = fields_of(fields_of(message)[MANIFEST])
    table = fields_of(manifest[TABLE])
    if table[TABLE_PACKED] != LZ4:
        raise ValueError("a table that is packed in another way")
    batch = pa.ipc.open_stream(unpacked(table[TABLE_CONTENT], table[TABLE_SIZE])).read_next_batch()
    places = zip(*(moved[begin] for begin in batch["chunk_byte_offset"].to_pylist()), strict=True)
    for name, numbers in zip(("chunk_byte_offset", "chunk_byte_size"), places, strict=True):
        index = batch.schema.get_field_index(name)
        batch = batch.set_column(index, batch.schema.field(index), pa.array(numbers, pa.uint64()))
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema) as stream:
        stream.write_batch(batch)
    table |= {TABLE_CONTENT: _packed(sink.getvalue()), TABLE_SIZE: sink.getvalue().size}
    return _message({MANIFEST: _message(manifest | {TABLE: _message(table)})})


def _packed(content: Any) -> bytes:
    block: bytes = pa.Codec("lz4_raw", LEVEL).compress(content, asbytes=True)
    return block


def _message(fields: Fields) -> bytes:
    """The message with these fields."""
    return b"".join(
        _varint(8 * number) + _varint(value)
        if isinstance(value, int)
        else _varint(8 * number + 2) + _varint(len(value)) + value
        for number, value in fields.items()
    )


def _number(message: bytes, at: int) -> tuple[int, int]:
    """The whole number that begins at a byte, and where it ends."""
    value = shift = 0
    while (byte := message[at]) > 127:
        value |= (byte & 127) << shift
        at, shift = at + 1, shift + 7
    return value | byte << shift, at + 1


def _varint(number: int) -> bytes:
    """A whole number as bytes, seven bits in each."""
    bits = [number >> shift & 127 for shift in range(0, max(number.bit_length(), 1), 7)]
    return bytes([*(part | 128 for part in bits[:-1]), bits[-1]])
