"""Mutation of bytes and of lines of text."""

import random
import struct

WORDS = (
    b"\xff" * 4, b"\0" * 4, b"\0", b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"9" * 400, b"nan", b"inf", b"-1",
    b"1e308", b"4294967295", b"<value>" * 40, b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"&#0;", b"\r\n", b"\xef\xbb\xbf",
    b"\xc3\x28", b"[" * 3000, b"{" * 300, b"&a [*a]", b"!!python/object:os.system x", b"<<: *a", b"${", b"}",
    b"%YAML 3.0\n", b"---\n", b"\x1b[2J",
)  # fmt: skip
COUNTS = (0, 1, 2, 255, 2**16, 2**24, 2**31 - 1, 2**31, 2**32 - 1)


def few(chance: random.Random, most: int) -> int:
    """How many changes to make: often one, so that what comes after it is reached."""
    return 1 if chance.random() < 0.5 else chance.randint(1, most)


def mutated(raw: bytes, chance: random.Random, *, most: int = 4) -> bytes:
    """Bytes with one to `most` changes: flipped, cut, doubled, put in, or moved."""
    data = bytearray(raw)
    for _ in range(few(chance, most)):
        at = chance.randrange(len(data) + 1)
        to = min(at + chance.randrange(1, 30), len(data))
        match chance.randrange(6):
            case 0 if at < len(data):
                data[at] = chance.randrange(256)
            case 1:
                del data[at:to]
            case 2:
                data[at:at] = data[at:to]
            case 3:
                data[at:at] = chance.choice(WORDS)
            case 4:
                data[at : at + 4] = struct.pack("<I", chance.choice([*COUNTS, len(data)]))
            case 5:
                del data[chance.randrange(1, len(data) + 2) :]
    return bytes(data)


def flipped(raw: bytes, chance: random.Random, *, most: int = 8) -> bytes:
    """Bytes of the same length with one to `most` others."""
    data = bytearray(raw)
    for _ in range(few(chance, most) if data else 0):
        data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def mutated_lines(text: str, chance: random.Random, *, most: int = 4) -> str:
    """Text with lines doubled, dropped, swapped, or with a word of another."""
    lines = text.split("\n")
    for _ in range(few(chance, most)):
        at, other = chance.randrange(len(lines)), chance.randrange(len(lines))
        match chance.randrange(6):
            case 0:
                lines[at:at] = [lines[at]] * chance.choice([1, 1, 3, 200])
            case 1 if len(lines) > 1:
                del lines[at]
            case 2:
                lines[at], lines[other] = lines[other], lines[at]
            case 3:
                lines[at] = chance.choice([" ", "  ", "\t", "", "#", "- "]) + lines[at]
            case 4:
                words = lines[at].split(" ")
                words[chance.randrange(len(words))] = chance.choice(
                    ["nan", "1e999", "-1", "0", "99999999999", "x", "X" * 300, ""]
                )
                lines[at] = " ".join(words)
            case 5:
                lines[at] = lines[at][: chance.randrange(len(lines[at]) + 1)]
    return "\n".join(lines)
