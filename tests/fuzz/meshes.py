"""Meshes: OBJ, STL, PLY, Collada and glTF, as shapes of an object that floats in a world."""

import functools
import json
import random
import re
import struct
from typing import Any

import trimesh
from trimesh.exchange.dae import export_collada
from trimesh.exchange.ply import export_ply

from fuzz import junk, markup, raw, trees
from fuzz.kind import Files, Kind
from fuzz.yaml_files import ASSETS, PLAIN, json_bytes, sail_world

OBJECT = (
    b"mass: 20\ninertia: [1, 1, 1]\ncollisions: [{type: mesh, file: %s}]\nvisuals: [{type: mesh, file: %s}]\n"
    b"buoyancy: {linear_drag: 25, angular_drag: 2, elements: [{type: sphere, radius: 0.3}]}\n"
)
WORLD = b"objects: [{name: thing, model: ./object.yaml, pose: [40, 0, 0.2, 0, 0, 0]}]\n" + PLAIN
GLB, JSON = 0x46546C67, 0x4E4F534A


@functools.cache
def seeds() -> dict[str, list[bytes]]:
    """Small meshes by suffix, in the ways that programs write them."""
    shapes = [
        trimesh.creation.box((1, 2, 0.5)),
        trimesh.creation.icosphere(subdivisions=1),
        trimesh.creation.cylinder(0.3, 1.0, sections=6),
    ]
    shapes[0].visual.face_colors = [200, 20, 20, 255]
    two = trimesh.Scene([shape.copy() for shape in shapes[:2]])
    objs = [file.read_bytes() for file in sorted(ASSETS.rglob("*.obj")) if file.stat().st_size < 40_000]
    return {
        "obj": [*objs[:6], *(export(shape, "obj") for shape in shapes)],
        "stl": [export(shape, kind) for shape in shapes for kind in ("stl", "stl_ascii")],
        "ply": [bytes(export_ply(shape, encoding=how)) for shape in shapes for how in ("binary", "ascii")],
        "dae": [bytes(export_collada(shape)) for shape in shapes],
        "glb": [*(export(shape, "glb") for shape in shapes), export(two, "glb")],
    }  # fmt: skip


def export(shape: Any, kind: str) -> bytes:
    """A shape as a file."""
    done = shape.export(file_type=kind)
    return done.encode() if isinstance(done, str) else bytes(done)


def mutated(chance: random.Random) -> Files:
    """A mesh, and an object and a world around it."""
    suffix = chance.choice(list(seeds()))
    content = MUTATIONS[suffix](chance.choice(seeds()[suffix]), chance)
    named = chance.choice(list(seeds())) if chance.random() < 0.04 else suffix
    file = f"shape.{named}"
    return {file: content, "object.yaml": OBJECT % (file.encode(), file.encode()), "world.yaml": WORLD}


def _text(content: bytes, chance: random.Random) -> bytes:
    """A file of lines with numbers."""
    if chance.random() < 0.4:
        return raw.mutated(content, chance)
    lines = content.decode("latin-1").split("\n")
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(lines))
        words = lines[at].split(" ")
        words[chance.randrange(len(words))] = junk.shown_number(chance)
        lines[at] = " ".join(words)
    text = "\n".join(lines)
    return (raw.mutated_lines(text, chance) if chance.random() < 0.3 else text).encode("latin-1", "replace")


def _stl(content: bytes, chance: random.Random) -> bytes:
    if content.startswith(b"solid") and b"\0" not in content[:300]:
        return _text(content, chance)
    if chance.random() < 0.5:
        return content[:80] + struct.pack("<I", chance.choice([*raw.COUNTS, chance.randrange(100)])) + content[84:]
    return _floats(content, 84, chance)


def _floats(content: bytes, start: int, chance: random.Random) -> bytes:
    """Numbers of four bytes replaced, or bytes mutated."""
    data = bytearray(content)
    if chance.random() < 0.4 or len(data) < start + 8:
        return raw.mutated(content, chance)
    for _ in range(chance.randint(1, 6)):
        at = chance.randrange(start, len(data) - 4)
        data[at : at + 4] = struct.pack(
            "<f", chance.choice([float("nan"), float("inf"), 3e38, -3e38, 1e-40, 0.0, 1e6, 99999.0])
        )
    return bytes(data)


def _ply(content: bytes, chance: random.Random) -> bytes:
    head, end, body = content.partition(b"end_header\n")
    if chance.random() < 0.6:
        return raw.mutated_lines(_numbers(head, chance), chance, most=2).encode("latin-1", "replace") + end + body
    return head + end + (_floats(body, 0, chance) if b"binary" in head else _text(body, chance))


def _numbers(head: bytes, chance: random.Random) -> str:
    """A header in which some numbers are others."""
    return re.sub(
        r"\b\d+\b",
        lambda found: junk.shown_number(chance) if chance.random() < 0.4 else found[0],
        head.decode("latin-1"),
    )


def _dae(content: bytes, chance: random.Random) -> bytes:
    return raw.mutated(content, chance) if chance.random() < 0.2 else markup.mutated(content, chance)


def _glb(content: bytes, chance: random.Random) -> bytes:
    """The header, the tree in JSON, or the numbers in the other chunk."""
    length = struct.unpack("<I", content[12:16])[0]
    text, rest = content[20 : 20 + length], content[20 + length :]
    draw = chance.random()
    if draw < 0.15:
        data = bytearray(content)
        at = chance.choice([0, 4, 8, 12, 16])
        data[at : at + 4] = struct.pack("<I", chance.choice([*raw.COUNTS, len(content)]))
        return bytes(data)
    if draw < 0.3:
        return content[: 20 + length] + _floats(rest, 8, chance)
    if draw < 0.38:
        return raw.mutated(content, chance)
    done = json_bytes(trees.mutated(json.loads(text), chance))
    done += b" " * (-len(done) % 4)
    return struct.pack("<IIIII", GLB, 2, 20 + len(done) + len(rest), len(done), JSON) + done + rest


MUTATIONS = {"obj": _text, "stl": _stl, "ply": _ply, "dae": _dae, "glb": _glb}
KINDS = (Kind("mesh", mutated, sail_world, warm=seeds),)
