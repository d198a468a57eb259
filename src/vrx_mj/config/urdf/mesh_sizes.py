"""How large a mesh file makes a mesh, from its headers: looked at before any library reads it.

What a file says of itself is compared with the bytes that it has, and what it would become with the limits. What is
handed on is the part of a file that is a mesh.
"""

import re
import struct
from collections.abc import Mapping
from typing import NoReturn

from vrx_mj.errors import VrxError

__all__ = [
    "MAX_PARTS",
    "MAX_POINTS",
    "MAX_TRIANGLES",
    "check_counts",
    "checked_text",
    "is_binary_stl",
    "refuse",
    "sized_obj",
    "sized_ply",
    "sized_stl",
]

MAX_TRIANGLES = 200_000
"""Most triangles of a mesh; MuJoCo's own limit for STL files."""
MAX_POINTS = 600_000
"""Most points of a mesh: three for each triangle."""
MAX_PARTS = 1000
"""Most parts of a mesh, each place of one that is repeated counted."""

_STL_HEAD, _STL_TRIANGLE = 84, 50
_CORNERS = re.compile(r"^[ \t]*f([^\n]*)", re.MULTILINE)
_MATERIAL = re.compile(r"^[ \t]*usemtl\b([^\n]*)", re.MULTILINE)
_PLY_HEAD = 20_000
_PLY_END = re.compile(rb"end_header[ \t]*\r?\n")
_PLY_SIZES = {"char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2,
              "float16": 2, "int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4, "int64": 8,
              "uint64": 8, "double": 8, "float64": 8}  # fmt: skip
_LINE_ENDS = tuple(end.encode() for end in ("\n", "\r", "\v", "\f", "\x1c", "\x1d", "\x1e", "\x85", "\u2028", "\u2029"))


def refuse(name: str, reason: str) -> NoReturn:
    """Tell what is wrong with a mesh."""
    raise VrxError(f"mesh {name} {reason}")


def check_counts(name: str, points: int = 0, triangles: int = 0, parts: int = 0) -> None:
    """Refuse a mesh of more than is allowed of anything."""
    if triangles > MAX_TRIANGLES:
        refuse(name, f"has {triangles:,} triangles; at most {MAX_TRIANGLES:,} are allowed: "
                     "simplify it, for example with Blender's Decimate")  # fmt: skip
    if points > MAX_POINTS:
        refuse(name, f"has {points:,} points; at most {MAX_POINTS:,} are allowed: simplify it")
    if parts > MAX_PARTS:
        refuse(name, f"has {parts:,} parts, those that are repeated counted each time; at most {MAX_PARTS:,} are "
                     "allowed: export it as one mesh")  # fmt: skip


def checked_text(name: str, content: bytes, kind: str) -> str:
    """The text of a file that has no other encoding than UTF-8: guessing one takes long."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        refuse(name, f"cannot be read: byte 0x{content[error.start]:02X} of its {kind} text is not UTF-8")


def is_binary_stl(content: bytes) -> bool:
    """Whether an STL file is a binary one, and whole: the other kind is text."""
    return len(content) >= _STL_HEAD and len(content) == _STL_HEAD + _STL_TRIANGLE * _stl_count(content)


def _stl_count(content: bytes) -> int:
    """Triangles of a binary STL, as its header says."""
    count: int = struct.unpack_from("<I", content, _STL_HEAD - 4)[0] if len(content) >= _STL_HEAD else 0
    return count


def sized_stl(name: str, content: bytes) -> bytes:
    """An STL file whose triangles are few enough and all there."""
    count = _stl_count(content)
    if is_binary_stl(content):
        check_counts(name, triangles=count)
        return content
    if content[:_STL_HEAD].lstrip()[:5].lower() != b"solid" or b"\0" in content[:_STL_HEAD]:
        if len(content) < _STL_HEAD:
            refuse(name, "is empty: it has no triangles")
        refuse(name, f"cannot be read: its header says {count:,} triangles, which take "
                     f"{_STL_HEAD + _STL_TRIANGLE * count:,} bytes; the file has {len(content):,}")  # fmt: skip
    text = checked_text(name, content, "STL").lower()
    check_counts(name, triangles=text.count("vertex") // 3, parts=text.count("endsolid"))
    return text.encode()


def sized_obj(name: str, content: bytes) -> bytes:
    """A Wavefront OBJ whose points and corners are few enough."""
    text = checked_text(name, content, "OBJ").replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", "")
    triangles = sum(max(len(found[1].split()) - 2, 1) for found in _CORNERS.finditer(text))
    points = max(text.count(f"\n{mark} ") for mark in ("v", "vn", "vt"))
    check_counts(name, points, triangles, parts=len({found[1] for found in _MATERIAL.finditer(text)}))
    return text.encode()


def sized_ply(name: str, content: bytes) -> bytes:
    """A PLY file whose points and faces are few enough and all there; edges become something that nobody reads."""
    end = _PLY_END.search(content, 0, _PLY_HEAD)
    head = content[: end.start()].decode("ascii", "replace").split("\n") if end else []
    if end is None or head[0].strip().lower() != "ply" or len(head) < 2:
        refuse(name, "cannot be read: it is not a PLY file, or is damaged")
    counts, sizes = _ply_elements(name, head)
    check_counts(name, points=counts.get("vertex", 0), triangles=counts.get("face", 0))
    left = len(content) - end.end()
    if "ascii" in head[1]:
        lines = sum(content.count(mark, end.end()) for mark in _LINE_ENDS)
        needed, has = sum(counts.values()), f"{lines:,} lines"
        fits = needed - 1 <= lines <= needed + MAX_PARTS
    else:
        needed = sum(count * sizes[element] for element, count in counts.items())
        fits, has = needed <= left, f"{left:,} bytes"
    if not fits:
        refuse(name, f"cannot be read: its header says {needed:,} {has.split()[1]} of data; the file has {has}")
    return content[: end.end()].replace(b"element edge ", b"element unread ") + content[end.end() :]


def _ply_elements(name: str, head: list[str]) -> tuple[Mapping[str, int], Mapping[str, int]]:
    """How many there are of each element, and how many bytes one has at least."""
    counts: dict[str, int] = {}
    sizes: dict[str, int] = {}
    for line in head:
        words = line.split()
        if words[:1] == ["element"]:
            if len(words) != 3 or not re.fullmatch("[0-9]{1,9}", words[2]) or words[1] in counts:
                refuse(name, f"cannot be read: '{line.strip()[:60]}' in its header is not an element with a count")
            element = words[1]
            counts[element], sizes[element] = int(words[2]), 0
        elif words[:1] == ["property"] and counts:
            kind = words[2] if words[1:2] == ["list"] and len(words) == 5 else words[1] if len(words) == 3 else ""
            if kind not in _PLY_SIZES:
                refuse(name, f"cannot be read: '{line.strip()[:60]}' in its header is not a property")
            sizes[element] += _PLY_SIZES[kind]
    for element, count in counts.items():
        if count and not sizes[element]:
            refuse(name, f"cannot be read: its element '{element[:60]}' has no properties")
    return counts, sizes
