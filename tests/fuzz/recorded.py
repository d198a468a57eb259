"""Recordings of rerun: bytes changed, messages of the file dropped, doubled and swapped."""

import functools
import random
import subprocess
import sys
import tempfile
from pathlib import Path

from fuzz import raw
from fuzz.kind import Files, Kind
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
    """A recording with changes to its bytes or its messages."""
    number = chance.randrange(len(recordings()))
    head, parts = messages(number)
    draw = chance.random()
    if draw < 0.25:
        return {"run.rrd": raw.mutated(recordings()[number], chance)}
    changed = list(parts)
    for _ in range(chance.randint(1, 3)):
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
    return {"run.rrd": head + b"".join(changed)}


def use(folder: Path) -> None:
    """Read a recording, go on from it, and convert it."""
    file = folder / "run.rrd"
    found = read_record(file)
    sim = resume(file, float(found.time[-1]) if len(found.time) else 0.0)
    sim.advance(10)
    convert(file, folder / "out" / "run.bag")


KINDS = (Kind("recording", mutated, use, warm=recordings, names_its_file=False),)
