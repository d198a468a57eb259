"""One input, tried in this process: its files are written to a sandbox, used, and what happened is classified."""

import os
import re
import shutil
import tempfile
import time
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fuzz.junk import BAIT
from fuzz.kind import Files, Kind, chance_of, write
from fuzz.watch import Watch, listing
from vrx_mj.errors import DivergedError, VrxError, VrxWarning
from vrx_mj.foreign import asking

ACCEPTED, REFUSED, UNCLEAR, TRACEBACK, CRASH, HANG, MEMORY, OUTSIDE = (
    "accepted", "refused", "unclear", "traceback", "crash", "hang", "memory", "outside",
)  # fmt: skip
OUTCOMES = (ACCEPTED, REFUSED, UNCLEAR, TRACEBACK, CRASH, HANG, MEMORY, OUTSIDE)
"""Used; refused with a message; refused with one that is too long or names no file; and what must not be."""
GOOD = (ACCEPTED, REFUSED)
LONGEST, MOST_LINES = 2000, 60
"""Letters of a line of a refusal, and its lines: a file with many mistakes has one line for each."""
QUIET = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)
"""Warnings that Python does not show."""
HERE = str(Path(__file__).parent)


@dataclass(frozen=True)
class Limits:
    """What an input may take."""

    seconds: float = 5.0
    """Processor time [s]."""
    memory: float = 1e9
    """Resident memory of the whole process [bytes]."""
    wait: float = 600.0
    """Wall time [s]: what waits for something takes no processor time."""


@dataclass(frozen=True)
class Result:
    """What became of an input."""

    kind: str
    seed: int
    number: int
    outcome: str
    place: str = ""
    """Kind of exception and where it was raised: results with one place are of one cause."""
    text: str = ""
    """Message, or the end of the traceback."""
    seconds: float = 0.0
    """Processor time [s]."""
    peak: int = 0
    """Largest resident memory of the process while it was tried [bytes]."""

    @property
    def id(self) -> str:
        """What `--again` takes."""
        return f"{self.kind}:{self.seed}:{self.number}"


@dataclass
class Sandbox:
    """A folder with a home, a temporary folder, a bait, and the folder of the input, which is the current one."""

    root: Path
    work: Path = field(init=False)

    def __post_init__(self) -> None:
        self.work = self.root / "work"
        bait = self.root / BAIT
        for folder in (self.work, bait, self.root / "home", self.root / "tmp"):
            folder.mkdir(parents=True, exist_ok=True)
        (bait / "secret.obj").write_text(
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n", "utf-8"
        )
        (bait / "secret.yaml").write_text("mass: 1\nstatic: true\ncollisions: [{type: sphere, radius: 1}]\n", "utf-8")

    @property
    def writable(self) -> tuple[Path, ...]:
        """Folders that may be written to."""
        kept = filter(None, [asking._folder()])  # what was read of files
        return self.root / "tmp", self.work / "out", self.root / "home" / ".cache", *kept

    def enter(self) -> None:
        """Make it this process's."""
        os.environ.update(HOME=str(self.root / "home"), TMPDIR=str(self.root / "tmp"))
        tempfile.tempdir = None
        asking._folder.cache_clear()
        asking._folder()  # is made
        os.chdir(self.work)

    def fill(self, files: Files) -> None:
        """Put an input in the place of the last one."""
        for folder in (self.work, self.root / "tmp"):
            for entry in folder.iterdir():
                shutil.rmtree(entry, ignore_errors=True) if entry.is_dir() else entry.unlink()
        (self.work / "out").mkdir()
        write(files, self.work)


class Trials:
    """Tries inputs of some kinds one after another."""

    def __init__(self, kinds: dict[str, Kind], root: Path, limits: Limits) -> None:
        self.kinds, self.watch, self.sandbox, self.limits = kinds, Watch(), Sandbox(root), limits
        self.sandbox.enter()

    def try_one(self, name: str, seed: int, number: int) -> Result:
        """Make an input and try it."""
        kind = self.kinds[name]
        files = kind.mutated(chance_of(name, seed, number))
        self.sandbox.fill(files)
        before = listing(self.sandbox.root, self.sandbox.writable)
        forget_peak()
        begun = time.process_time()
        outcome, place, text, seen = self._watched(kind, [*files] if kind.names_its_file else [])
        seconds, peak = time.process_time() - begun, peak_memory()
        os.chdir(self.sandbox.work)
        seen += changes(before, listing(self.sandbox.root, self.sandbox.writable))
        if seen:
            outcome, place, text = OUTSIDE, f"outside: {seen[0].split(' ')[0]}", "\n".join(seen[:20])
        elif peak > self.limits.memory:
            outcome, place, text = MEMORY, f"memory {place}", f"{peak / 1e6:.0f} MB; {text}"
        elif seconds > self.limits.seconds:
            outcome, place, text = HANG, f"hang {place}", f"{seconds:.1f} s; {text}"
        return Result(name, seed, number, outcome, place, text[-6000:], seconds, peak)

    def _watched(self, kind: Kind, names: Sequence[str]) -> tuple[str, str, str, list[str]]:
        """Outcome, place and text of an input, and what it did outside."""
        box = self.sandbox
        watched = self.watch.over(box.root, box.writable, calls=kind.calls)
        with watched as seen, warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            for quiet in QUIET:
                warnings.simplefilter("ignore", quiet)
            outcome, place, text = _used(kind, box.work, names)
        foreign = [one for one in warned if not issubclass(one.category, VrxWarning)]
        if outcome in GOOD and foreign:
            place = f"{foreign[0].category.__name__} at {short(foreign[0].filename)}:{foreign[0].lineno}"
            return TRACEBACK, place, str(foreign[0].message), seen
        return outcome, place, text, seen


def _used(kind: Kind, folder: Path, names: Sequence[str]) -> tuple[str, str, str]:
    """Outcome, place and text of using the files."""
    try:
        kind.tried(folder)
    except VrxError as error:
        if what := complaint(error, names):
            return UNCLEAR, f"{what}: {place_of(error)}", str(error)
        return REFUSED, "", str(error)
    except BaseException as error:
        return TRACEBACK, place_of(error), "".join(traceback.format_exception(error, limit=-12))
    return ACCEPTED, "", ""


def complaint(error: VrxError, names: Sequence[str]) -> str:
    """What is wrong with a refusal's message, which is to name one of these files; empty if nothing is."""
    text = str(error)
    lines = text.split("\n")
    if not text.strip():
        return "an empty message"
    if max(map(len, lines)) > LONGEST or len(lines) > MOST_LINES:
        return "a long message"
    if names and not isinstance(error, DivergedError) and not any(Path(name).name in text for name in names):
        return "a message without its file"
    return ""


def place_of(error: BaseException) -> str:
    """The exception's kind, the last line of ours that it went through, and where it was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if "vrx_mj" in frame.filename and not frame.filename.startswith(HERE)]
    places = [f"{short(frame.filename)}:{frame.lineno} {frame.name}" for frame in (ours[-1:] + frames[-1:])]
    return f"{type(error).__name__} at {' <- '.join(dict.fromkeys(places))}"


def short(filename: str) -> str:
    """A source file as a package shows it."""
    return re.sub(r".*/(site-packages|src|python3\.\d+)/", "", filename)


def changes(before: dict[str, tuple[int, int]], after: dict[str, tuple[int, int]]) -> list[str]:
    """What came, went or changed between two listings."""
    came = [f"made {path}" for path in after if path not in before]
    went = [f"removed {path}" for path in before if path not in after]
    return came + went + [f"changed {path}" for path in after if before.get(path, after[path]) != after[path]]


def forget_peak() -> None:
    """Have the peak of this process's memory begin anew; Linux alone can."""
    try:
        with open("/proc/self/clear_refs", "w", encoding="ascii") as file:  # noqa: PTH123
            file.write("5")
    except OSError:
        return


def peak_memory(process: int | str = "self") -> int:
    """Largest resident memory of a process since `forget_peak` [bytes]; 0 where it is not told."""
    try:
        with open(f"/proc/{process}/status", encoding="ascii", errors="replace") as file:  # noqa: PTH123
            found = re.search(r"VmHWM:\s+(\d+) kB", file.read())
    except OSError:
        return 0
    return int(found[1]) * 1024 if found else 0
