"""Recordings: bytes changed, messages dropped, doubled and swapped, and our columns encoded with other contents."""

import functools
import io
import json
import random
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import pyarrow as pa

from fuzz import junk, markup, raw, trees
from fuzz.kind import Files, Kind
from fuzz.yaml_files import json_bytes
from vrx_mj import read_record, resume
from vrx_mj.adapters.record.parsed import FILE_HEADER, MESSAGE_HEADER
from vrx_mj.adapters.ros.convert import convert

MAKE = """
import sys
from vrx_mj import Simulation, compile_world, record
from vrx_mj.adapters.ros.convert import convert
for number, (world, fleet) in enumerate([("my_course", None), ("ocean", "trio")]):
    sim = Simulation(compile_world(world, fleet=fleet))
    with record(sim, f"{sys.argv[1]}/{number}.rrd", sea=False):
        sim.step({boat: {"left": 0.5, "right": 0.4} for boat in sim.boats}, duration=1.5)
    convert(f"{sys.argv[1]}/{number}.rrd", f"{sys.argv[1]}/{number}.bag")  # compiles what a reader needs
"""


@functools.cache
def recordings() -> tuple[bytes, ...]:
    """Short recordings, made by another process: rerun's threads do not survive a fork."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-c", MAKE, folder], check=True, capture_output=True)
        return tuple(file.read_bytes() for file in sorted(Path(folder).glob("*.rrd")))


@functools.cache
def messages(number: int) -> tuple[bytes, tuple[bytes, ...]]:
    """The head of a recording, and its messages with their headers."""
    content, found, at = recordings()[number], [], FILE_HEADER
    while at + MESSAGE_HEADER.size <= len(content):
        _, length = MESSAGE_HEADER.unpack_from(content, at)
        found.append(content[at : at + MESSAGE_HEADER.size + length])
        at += MESSAGE_HEADER.size + length
    return content[:FILE_HEADER], tuple(found)


def mutated(chance: random.Random) -> Files:
    """A recording with changes to its bytes or its messages, to be read, resumed or converted."""
    number = chance.randrange(len(recordings()))
    name = f"{chance.choice(USES)}.rrd"
    head, parts = messages(number)
    draw = chance.random()
    if draw < 0.15:
        return {name: raw.mutated(recordings()[number], chance)}
    if draw < 0.65:
        return {name: encoded_anew(number, chance)}
    changed = list(parts)
    for _ in range(raw.few(chance, 3)):
        at, other = chance.randrange(len(changed)), chance.randrange(len(changed))
        match chance.randrange(5):
            case 0 if len(changed) > 1:
                del changed[at]
            case 1:
                changed.insert(other, changed[at])
            case 2:
                changed[at], changed[other] = changed[other], changed[at]
            case 3:
                size = MESSAGE_HEADER.size
                changed[at] = changed[at][:size] + raw.flipped(changed[at][size:], chance)
            case 4:
                changed[at] = raw.mutated(changed[at], chance)
    return {name: head + b"".join(changed)}


OURS = ("/record/", "/events")
"""How entities begin that are read back; all others are for looking at."""


@functools.cache
def batches(number: int) -> tuple[Any, ...]:
    """The columns of a recording, chunk by chunk; rerun starts threads for it, so only workers call this."""
    from rerun.chunk import RrdReader

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.rrd"
        file.write_bytes(recordings()[number])
        return tuple((chunk.entity_path, chunk.to_record_batch()) for chunk in RrdReader(file).stream())


def encoded_anew(number: int, chance: random.Random) -> bytes:
    """A sound file of rerun's in which some of our columns hold something else."""
    from rerun.chunk import Chunk, ChunkStore

    found = list(batches(number))
    ours = [at for at, (entity, _) in enumerate(found) if entity.startswith(OURS)]
    for _ in range(raw.few(chance, 3)):
        at = chance.choice(ours)
        found[at] = found[at][0], _changed(found[at][1], chance)
    chunks = [chunk for _, batch in found for chunk in Chunk.from_record_batch(batch)]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.rrd"
        ChunkStore.from_chunks(chunks).write_rrd(file, application_id="vrx_mj", recording_id="mutated")
        return file.read_bytes()


def _changed(batch: Any, chance: random.Random) -> Any:
    """One column with another value in a row, or none, or left out."""
    columns = [at for at, field in enumerate(batch.schema) if str(field.type).startswith("list")]
    at = chance.choice(columns)
    if chance.random() < 0.1 and len(columns) > 1:
        return batch.remove_column(at)
    field, rows = batch.schema.field(at), batch.column(at).to_pylist()
    row = chance.randrange(len(rows))
    rows[row] = _values(rows[row], str(field.type.value_type), chance)
    return batch.set_column(at, field, pa.array(rows, field.type))


def _values(old: list[Any] | None, kind: str, chance: random.Random) -> list[Any] | None:
    """Another list of texts, bytes or numbers for a cell."""
    draw = chance.random()
    if draw < 0.08 or not old:
        return chance.choice([None, []])
    if draw < 0.14:
        return [*old, *old]
    first = old[0]
    if kind == "string":
        return [_text(first, chance)]
    if kind == "binary":
        return [_block(first, chance)]
    number = chance.choice([0, -1, 1, 2**31, 2**62, -(2**63), 3]) if kind.startswith("int") else _float(chance)
    return [number]


def _float(chance: random.Random) -> float:
    return chance.choice([float("nan"), float("inf"), -1.0, 0.0, 1e308, 1e9, -1e308, 0.5])


def _text(text: str, chance: random.Random) -> str:
    """JSON with another tree, or another text."""
    try:
        tree = json.loads(text)
    except ValueError:
        return chance.choice([*junk.TEXTS])
    if chance.random() < 0.1:
        return raw.mutated(text.encode(), chance).decode("utf-8", "replace")
    return json_bytes(trees.mutated(tree, chance)).decode("utf-8", "replace")


def _block(content: bytes, chance: random.Random) -> bytes:
    """An archive with other names or contents, a state with another head or body, or numbers."""
    if content.startswith(b"PK"):
        return _archive(content, chance)
    head, newline, body = content.partition(b"\n")
    if newline and head.startswith(b"{") and chance.random() < 0.4:
        try:
            return json_bytes(trees.mutated(json.loads(head), chance)) + newline + body
        except ValueError:
            return raw.mutated(content, chance)
    if chance.random() < 0.3 or len(content) < 16:
        return raw.mutated(content, chance)
    data = bytearray(content)
    for _ in range(raw.few(chance, 6)):
        at = 8 * chance.randrange(len(data) // 8)
        data[at : at + 8] = struct.pack("<d", _float(chance))
    return bytes(data)


NAMES = (
    "../escaped",
    "/tmp/escaped",
    "assets/../../escaped",
    "assets\\..\\x",
    "",
    ".",
    "assets/",
    "scene.json",
    "C:/x",
    "a" * 300,
    "\0",
)


def _archive(content: bytes, chance: random.Random) -> bytes:
    """Files of a saved world under other names, with other contents, or packed very small."""
    if chance.random() < 0.2:
        return raw.mutated(content, chance)
    with zipfile.ZipFile(io.BytesIO(content)) as stored:
        files = {name: stored.read(name) for name in stored.namelist()}
    name = chance.choice([*files, "scene.json", "scene.xml"])
    match chance.randrange(5):
        case 0:
            files[chance.choice(NAMES)] = files.pop(name)
        case 1:
            files["scene.json"] = json_bytes(trees.mutated(json.loads(files["scene.json"]), chance))
        case 2:
            files["scene.xml"] = markup.mutated(files["scene.xml"], chance)
        case 3:
            files[name] = bytes(chance.choice([0, 10**6, 10**8]))
        case 4:
            del files[name]
    packed = io.BytesIO()
    with zipfile.ZipFile(
        packed, "w", chance.choice([zipfile.ZIP_DEFLATED] * 5 + [zipfile.ZIP_STORED, zipfile.ZIP_LZMA])
    ) as target:
        for entry, inside in files.items():
            target.writestr(zipfile.ZipInfo(entry), inside, target.compression)
    return packed.getvalue()


USES = ("read", "resume", "convert")


def use(folder: Path) -> None:
    """Read a recording, or go on from it, or convert it, as the name of its file says."""
    (file,) = folder.glob("*.rrd")
    if file.stem == "read":
        read_record(file)
    elif file.stem == "resume":
        resume(file, 1.0).advance(10)
    else:
        convert(file, folder / "out" / "run.bag")


KINDS = (Kind("recording", mutated, use, warm=recordings, names_its_file=False),)
