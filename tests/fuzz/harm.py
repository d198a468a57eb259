"""Inputs that do what must not be done, to see that the runner finds it; as a program: as JSON."""

import ctypes
import dataclasses
import json
import os
import random
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fuzz.junk import BAIT
from fuzz.kind import Files, Kind
from fuzz.trial import Limits, peak_memory
from fuzz.workers import Pool
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.foreign import asking


def _input(_chance: random.Random) -> Files:
    return {"input.txt": b"x", "deep/other.txt": b"y"}


def _abort(_folder: Path) -> None:
    os.abort()


def _exit(_folder: Path) -> None:
    os._exit(3)


def _segfault(_folder: Path) -> None:
    ctypes.string_at(8)


def _spin(_folder: Path) -> None:
    while True:
        pass


def _spin_in_reader(_folder: Path) -> None:
    asking.PACKAGE = "foreign_jobs"
    asking.ask("tricks:forever", returns=int, about="input.txt", cached=False, seconds=60)


def _slow(_folder: Path) -> None:
    until = time.process_time() + LIMITS.seconds + 0.2
    while time.process_time() < until:
        pass


def _wait(_folder: Path) -> None:
    time.sleep(100.0)


def _eat(_folder: Path) -> None:
    held = [bytearray(b"x" * 10_000_000) for _ in range(100)]
    held.clear()


def _eat_for_a_moment(_folder: Path) -> None:
    bytearray(b"x" * int(LIMITS.memory))


def _raise(_folder: Path) -> None:
    raise KeyError("wamv")


def _leave(_folder: Path) -> None:
    raise SystemExit(0)


def _warn(_folder: Path) -> None:
    warnings.warn("invalid value", RuntimeWarning, stacklevel=1)


def _warn_of_ours(_folder: Path) -> None:
    warnings.warn("stiff", VrxWarning, stacklevel=1)


def _refuse(_folder: Path) -> None:
    raise VrxError("input.txt:1:1: expected a number, got 'x'")


def _refuse_without_file(_folder: Path) -> None:
    raise VrxError("expected a number, got 'x'")


def _refuse_at_length(_folder: Path) -> None:
    error = VrxError()
    error.args = ("input.txt: no model named '" + "x" * 3000,)  # what is given to a VrxError is cut
    raise error


def _write_beside(folder: Path) -> None:
    (folder / ".." / "escaped.txt").write_text("x", encoding="utf-8")


def _write_natively(folder: Path) -> None:
    libc = ctypes.CDLL(None)
    libc.close(libc.creat(bytes(folder.parent / "home" / "escaped.txt"), 0o600))


def _change_input(folder: Path) -> None:
    libc = ctypes.CDLL(None)
    libc.truncate(bytes(folder / "deep" / "other.txt"), 0)


def _write_far(_folder: Path) -> None:
    with open("/tmp/vrx_mj-escaped.txt", "w", encoding="utf-8"):  # noqa: PTH123
        pass
    Path("/tmp/vrx_mj-escaped.txt").unlink()


def _remove_far(_folder: Path) -> None:
    Path("/nowhere/at/all.txt").unlink(missing_ok=True)


def _read_bait(folder: Path) -> None:
    (folder.parent / BAIT / "secret.yaml").read_bytes()


def _start(_folder: Path) -> None:
    subprocess.run(["true"], check=False)


def _use_temporary(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        Path(temporary, "file.txt").write_text("x", encoding="utf-8")
    (folder / "out" / "done.txt").write_text("x", encoding="utf-8")
    (folder / "input.txt").read_bytes()


KINDS: dict[str, tuple[Callable[[Path], None], str]] = {
    "abort": (_abort, "crash"),
    "exit": (_exit, "crash"),
    "segfault": (_segfault, "crash"),
    "spin": (_spin, "hang"),
    "spin in the reader": (_spin_in_reader, "hang"),
    "slow": (_slow, "hang"),
    "wait": (_wait, "hang"),
    "eat": (_eat, "memory"),
    "eat for a moment": (_eat_for_a_moment, "memory"),
    "raise": (_raise, "traceback"),
    "leave": (_leave, "traceback"),
    "warn": (_warn, "traceback"),
    "warn of ours": (_warn_of_ours, "accepted"),
    "refuse": (_refuse, "refused"),
    "refuse without file": (_refuse_without_file, "unclear"),
    "refuse at length": (_refuse_at_length, "unclear"),
    "write beside": (_write_beside, "outside"),
    "write natively": (_write_natively, "outside"),
    "change input": (_change_input, "outside"),
    "write far": (_write_far, "outside"),
    "remove far": (_remove_far, "outside"),
    "read bait": (_read_bait, "outside"),
    "start": (_start, "outside"),
    "use temporary": (_use_temporary, "accepted"),
}
"""What each does, and what it is to be found as."""
LIMITS = Limits(seconds=0.25, memory=peak_memory() + 200e6, wait=4.0)


def main() -> None:
    """Try each once."""
    pool = Pool({name: Kind(name, _input, tried) for name, (tried, _) in KINDS.items()}, jobs=2, limits=LIMITS)
    results = list(pool.results((name, 1, number) for number, name in enumerate(KINDS)))
    print(json.dumps({result.kind: dataclasses.asdict(result) for result in results}))


if __name__ == "__main__":
    main()
