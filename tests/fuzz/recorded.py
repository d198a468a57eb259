"""Recordings: bytes changed, messages dropped, doubled and swapped, what is behind the bytes changed by its meaning."""

import functools
import random
import subprocess
import sys
import tempfile
from pathlib import Path

from fuzz import raw, recordings
from fuzz.kind import Files, Kind
from vrx_mj import compare, read_record, resume
from vrx_mj.recording.checks import rescore
from vrx_mj.recording.parts import FILE_HEADER, MESSAGE_HEADER
from vrx_mj.ros.convert import convert

TESTS = Path(__file__).resolve().parents[1]
MAKE = """
import sys
from pathlib import Path

sys.path.insert(0, sys.argv[2])

from fuzz.recordings import sample
from vrx_mj import Simulation, compile_world, record
from vrx_mj.ros.convert import convert

folder = Path(sys.argv[1])
sample(folder / "0.rrd")
sim = Simulation(compile_world("my_course"))
with record(sim, folder / "1.rrd", sea=False):
    sim.step({boat: {"left": 0.5, "right": 0.4} for boat in sim.boats}, duration=1.5)
for number in range(2):
    convert(folder / f"{number}.rrd", folder / f"{number}.bag")  # compiles what a reader needs
"""


@functools.cache
def files() -> tuple[bytes, ...]:
    """Short recordings, made by another process: rerun's threads do not survive a fork."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-c", MAKE, folder, str(TESTS)], check=True, capture_output=True)
        return tuple(file.read_bytes() for file in sorted(Path(folder).glob("*.rrd")))


@functools.cache
def messages(number: int) -> tuple[bytes, tuple[bytes, ...]]:
    """The head of a recording, and its messages with their headers."""
    content, found, at = files()[number], [], FILE_HEADER
    while at + MESSAGE_HEADER.size <= len(content):
        _, length = MESSAGE_HEADER.unpack_from(content, at)
        found.append(content[at : at + MESSAGE_HEADER.size + length])
        at += MESSAGE_HEADER.size + length
    return content[:FILE_HEADER], tuple(found)


@functools.cache
def parts() -> tuple[recordings.Parts, ...]:
    """What the recordings hold."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.rrd"
        return tuple(recordings.taken_apart(file) for content in files() if file.write_bytes(content))


def mutated(chance: random.Random) -> Files:
    """A recording with changes to its bytes, its messages or its meaning, to be used in one of the ways."""
    number = chance.randrange(len(files()))
    name = f"{chance.choice(USES)}.rrd"
    draw = chance.random()
    if draw < 0.15:
        return {name: raw.mutated(files()[number], chance)}
    if draw < 0.75:
        return {name: recordings.mutated(parts()[number], chance)}
    head, old = messages(number)
    changed = list(old)
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


USES = ("read", "resume", "convert", "compare", "score")


def use(folder: Path) -> None:
    """Read a recording with all readings, go on from it, convert, compare or score it, as the name of its file says."""
    (file,) = folder.glob("*.rrd")
    if file.stem == "read":
        found = read_record(file)
        for sensor in found.sensors:
            found.readings(sensor.boat, sensor.name)
    elif file.stem == "resume":
        resume(file, 1.0).advance(10)
    elif file.stem == "compare":
        compare(file, file)
    elif file.stem == "score":
        rescore(file)
    else:
        convert(file, folder / "out" / "run.bag")


KINDS = (Kind("recording", mutated, use, warm=parts, names_its_file=False),)
