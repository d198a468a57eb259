"""Recordings taken apart, changed and put together again: what is behind the bytes is wrong, not the bytes.

`taken_apart` gives what a recording holds, `mutated` one of its changes as a file.
"""

import copy
import json
import random
import struct
import tempfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.errors import RecordError
from vrx_mj.foreign.plain import pack
from vrx_mj.recording.packing import pack_rows, unpack_rows
from vrx_mj.recording.parts import FRAME, HEAD, MAGIC, VERSION, pack_files, parsed_file, unpack_files
from vrx_mj.recording.reader import READ_COLUMNS, READ_ENTITIES, READING_COLUMNS, read_record

Parts = list[tuple[str, bool, dict[str, list[Any]]]]
"""Chunks of our entities: path, whether it is without time, and columns of cells."""

NUMBERS = (0, -1, 1, 2, 7, 255, 2**31, 2**53 + 1, -(2**63), 10**30, 10**400, 0.5, 1e-9, 1e30, 1e308, -1e308)
NUMBERS_JSON = ("NaN", "Infinity", "-Infinity")
TEXTS = ("", "a", "../x", "/etc/passwd", "a\nb", "\x1b[2J", "x" * 5000, "船", "\ud800", "{}", "NaN", "0" * 64)
NAMES = ("../x", "/tmp/x", "C:\\x", "..\\x", ".", "", "a/../../x", "scene.xml", "assets/../x", "x\0y", "assets/")


def taken_apart(file: Path) -> Parts:
    """What a whole recording holds for us."""
    sensors = [sensor.readings_path for sensor in read_record(file).sensors]
    parsed = parsed_file(file, [*READ_COLUMNS, *READING_COLUMNS], [*READ_ENTITIES, *sensors])
    return [
        (part.entity, part.static, {name: list(cells) for name, cells in part.columns.items()}) for part in parsed.parts
    ]


def put_together(parts: Parts) -> bytes:
    """A file of chunks."""
    from rerun.chunk import LazyChunkStream

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.rrd"
        stream = LazyChunkStream.from_iter(filter(None, (chunk_of(*part) for part in parts)))
        stream.write_rrd(file, application_id="vrx_mj", recording_id="mutant")
        return file.read_bytes()


def as_killed_run(parts: Parts) -> bytes:
    """The file of a run that was not closed, with a block for each row of these parts."""
    blocks = [
        pack((entity, False, {name: cells[row : row + 1] for name, cells in columns.items()}))
        for entity, _, columns in parts
        for row in range(max(map(len, columns.values()), default=0))
    ]
    framed = [FRAME.pack(len(block), zlib.crc32(block)) + block for block in blocks]
    return b"".join((HEAD.pack(MAGIC, VERSION), *framed))


def chunk_of(entity: str, static: bool, columns: dict[str, list[Any]]) -> Any:
    """A chunk; None where nothing is left of it. Its times are those of the column `sim_time`."""
    import pyarrow as pa
    import rerun as rr
    from rerun.chunk import Chunk

    times = [int(cell[0]) if is_numbers(cell) and len(cell) else 0 for cell in columns.get("sim_time", [])]
    cells = {name: values for name, values in columns.items() if name != "sim_time"}
    count = min([*map(len, cells.values()), *([] if static else [len(times)])], default=0)
    if not count or not cells:
        return None
    made = []
    for name, values in cells.items():
        descriptor, rows = rr.ComponentDescriptor(name), [listed(value) for value in values[:count]]
        batch = rr.AnyBatchValue(descriptor, pa.array([item for row in rows for item in row]))
        made.append(rr.ComponentColumn(descriptor, batch, lengths=[len(row) for row in rows]))
    index = [] if static else [rr.TimeColumn("sim_time", duration=np.array(times[:count], "timedelta64[ns]"))]
    return Chunk.from_columns(entity, index, made)


def is_numbers(cell: Any) -> bool:
    return isinstance(cell, np.ndarray)


def listed(cell: Any) -> list[Any]:
    """What a cell holds."""
    return list(cell) if is_numbers(cell) else [] if cell is None else [cell]


def mutated(parts: Parts, chance: random.Random) -> bytes:
    """A recording of which one or two things are wrong, closed or not."""
    wrong = changed(parts, chance)
    return as_killed_run(wrong) if chance.random() < 0.3 else put_together(wrong)


def changed(parts: Parts, chance: random.Random) -> Parts:
    """Parts of which one or two things are wrong."""
    found = copy.deepcopy(parts)
    for _ in range(chance.choice([1, 1, 1, 2])):
        entity, static, columns = part = chance.choice([part for part in found if part[2]])
        name = chance.choice(list(columns))
        match chance.randrange(12):
            case 0:
                found.remove(part)
            case 1:
                found.append(copy.deepcopy(part))
            case 2:
                del columns[name]
            case 3:
                columns[name] = [chance.choice(["text", b"bytes", np.array([1.5]), np.array([7])])] * len(columns[name])
            case 4:
                columns[chance.choice(list(columns))] = columns[name]
            case _ if columns[name]:
                at = chance.randrange(len(columns[name]))
                columns[name][at] = mutated_cell(name, columns[name][at], chance)
        if not found:
            found.append((entity, static, {}))
    return found


def mutated_cell(name: str, cell: Any, chance: random.Random) -> Any:
    """A cell of a column, changed as its meaning is."""
    if is_numbers(cell):
        return mutated_numbers(cell, chance)
    if isinstance(cell, str):
        return mutated_json(cell, chance) if cell[:1] in ("{", "[") else chance.choice(TEXTS).replace("\ud800", "?")
    match name:
        case "files":
            return mutated_archive(cell, chance)
        case "block":
            return mutated_rows(cell, chance)
        case "blob" if b"\n" in cell[:100_000]:
            head, _, body = cell.partition(b"\n")
            return mutated_json(head.decode(), chance).encode("utf-8", "replace") + b"\n" + flipped(body, chance)
    return flipped(cell, chance)


def mutated_numbers(cell: Any, chance: random.Random) -> Any:
    """An array with another number, or of another length."""
    if not len(cell) or chance.random() < 0.2:
        return cell[: len(cell) // 2]
    other = cell.copy()
    wild = chance.choice([0, -1, 1, 7, 1000, 2**31 - 1])
    if cell.dtype.kind == "f":
        wild = chance.choice([wild, np.nan, np.inf, -1e308, 1e308, 1e-300])
    with np.errstate(all="ignore"):
        other[chance.randrange(len(cell))] = np.array(wild).astype(cell.dtype)
    return other


def flipped(cell: bytes, chance: random.Random) -> bytes:
    """Bytes with some others among them, cut off, or too long; or a number in them that is not finite."""
    data = bytearray(cell)
    match chance.randrange(5):
        case 0:
            return cell[: chance.randrange(len(cell) + 1)]
        case 1:
            return cell + cell[:9]
        case 2 if len(data) >= 8:
            at = 8 * chance.randrange(len(data) // 8)
            wild = struct.pack("<d", chance.choice([np.nan, np.inf, 1e308, -1.0, 1e9]))
            data[at : at + 8] = chance.choice([wild, struct.pack("<q", chance.choice([-1, 1 << 40, 1 << 62, 2]))])
        case _:
            for _ in range(chance.randint(1, 4) if data else 0):
                data[chance.randrange(len(data))] = chance.randrange(256)
    return bytes(data)


def mutated_rows(cell: bytes, chance: random.Random) -> bytes:
    """A block of rows with another shape, another number, or other bytes."""
    try:
        unpack_rows(cell)
    except RecordError:  # changed before
        return flipped(cell, chance)
    match chance.randrange(4):
        case 0:
            count, width = struct.unpack_from("<II", cell)
            shape = chance.choice([(width, count), (0, width), (count, 0), (2**32 - 1, 2**32 - 1), (count + 1, width)])
            return struct.pack("<II", *shape) + cell[8:]
        case 1:
            rows = unpack_rows(cell)
            return pack_rows(chance.choice([rows[:, :-1], rows[:0], np.hstack([rows, rows]), rows[::-1]]))
        case 2:
            rows = unpack_rows(cell).copy()
            column = chance.choice([0, 0, 1, chance.randrange(rows.shape[1]), rows.shape[1] - 1])
            rows[chance.randrange(len(rows)), column] = chance.choice([np.nan, np.inf, -1e308, 1e308, 1e30, -1.0, 7.5])
            return pack_rows(rows)
    return flipped(cell, chance)


def mutated_archive(cell: bytes, chance: random.Random) -> bytes:
    """Files with other names, a bomb, more files, or other content."""
    try:
        files = unpack_files(cell, 1 << 30)
    except RecordError:  # changed before
        return flipped(cell, chance)
    name = chance.choice([*files, "scene.xml"])
    match chance.randrange(6):
        case 0:
            return flipped(cell, chance)
        case 1:
            files[chance.choice(NAMES)] = b"somewhere else"
        case 2:
            files[chance.choice(NAMES)] = files.pop(name, b"")
        case 3:
            files["assets/bomb"] = bytes(chance.choice([1 << 20, 1 << 27]))
        case 4:
            files |= {f"assets/{number}": b"" for number in range(chance.choice([100, 300_000]))}
        case _:
            files[name] = mutated_file(name, files.get(name, b""), chance)
    return pack_files(files)


def mutated_file(name: str, content: bytes, chance: random.Random) -> bytes:
    """A file of a saved world, changed."""
    if name.endswith(".json") and chance.random() < 0.8:
        return mutated_json(content.decode(), chance).encode("utf-8", "replace")
    return flipped(content, chance)


def mutated_json(text: str, chance: random.Random) -> str:
    """JSON with another value somewhere, a key less or more, or cut off, or nested deeply."""
    match chance.randrange(8):
        case 0:
            return text[: chance.randrange(len(text) + 1)]
        case 1:
            return chance.choice(["[" * 100_000, '{"a":' * 5000 + "1" + "}" * 5000, "null", "[]", "{}", "1e999", '"x"'])
    try:
        tree = json.loads(text)
    except ValueError:
        return text[::-1]
    spots = list(spots_in(tree))
    if not spots:
        return "[1]"
    for _ in range(chance.choice([1, 1, 2])):
        owner, key = chance.choice(spots)
        if chance.random() < 0.2:
            if isinstance(owner, dict):
                owner.pop(key, None)
            elif key < len(owner):
                del owner[key]
        elif isinstance(owner, dict) or key < len(owner):
            owner[key] = value_of(chance, owner.get(key) if isinstance(owner, dict) else owner[key])
    return chance.choice(NUMBERS_JSON).join(json.dumps(tree).split('"NOT FINITE"'))


def value_of(chance: random.Random, old: Any) -> Any:
    """A value in place of another."""
    if isinstance(old, int | float) and not isinstance(old, bool) and chance.random() < 0.4:
        return chance.choice([old + 1, old - 1, -old, old * 2, old + 0.5])
    return chance.choice([
        chance.choice(NUMBERS), chance.choice(NUMBERS), chance.choice(TEXTS), None, True, [], {}, [old, old], [[old]],
        {"a": old}, "NOT FINITE",
    ])  # fmt: skip


def spots_in(tree: Any) -> Any:
    """Every place in a tree, as its owner and key."""
    keys = list(tree) if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in keys:
        yield tree, key
        yield from spots_in(tree[key])


def sample(file: Path) -> Path:
    """Record a short run with all that a recording can hold but pictures: a task, boats that come and go, sensors."""
    import vrx_mj
    from integration.sailing import AFLOAT, boats
    from integration.sensing import GPS, GUN, IMU, P3D, PINGER, sailing
    from vrx_mj.config.sensors import LidarConfig

    cloud = LidarConfig(name="lidar", link="lidar_link", rings=2, samples=90, pose=(0.7, 0.0, 1.8, 0.0, 0.0, 0.0))
    planar = LidarConfig(name="planar", link="planar", output="scan", rings=1, samples=20, elevation=(0.0, 0.0))
    goal = {"type": "stationkeeping", "goal_cart": [3.0, 0.0, 0.0], "initial_state_duration": 0.5}
    sim = sailing(
        (GPS, IMU, P3D, PINGER, GUN, cloud, planar),
        fleet=boats((0.0, 0.0, 0.0), (15.0, 0.0, 0.0)),
        objects=[{"name": "buoy", "model": "robotx_light_buoy", "pose": [9.0, 1.0, 0.0, 0.0, 0.0, 0.0]}],
        task={**goal, "ready_state_duration": 0.5, "running_state_duration": 5.0},
    )
    with vrx_mj.record(sim, file, sea=False, sensors="a"):
        sim.step({"a": {"left": 0.5, "right": 0.4}}, duration=1.0)
        sim.spawn("late", pose=[0.0, 30.0, AFLOAT, 0.0, 0.0, 0.0], sensors="none")
        sim.step(duration=0.5)
        sim.remove("b")
        sim.step(duration=0.5)
    return file
