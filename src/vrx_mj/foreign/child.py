"""The process in which strangers' files are read, run by its path: `vrx_mj.foreign.asking` starts it and talks to it.

Where the system can fork it waits for jobs, imports what each needs, and has a copy of itself do it; else it does one.
Standard input has blocks: first the folders of modules, then jobs. Standard output has pieces of an answer, an empty
one at its end, and how the copy ended: its status and processor time.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import struct
import sys
import time
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import IO, TYPE_CHECKING, BinaryIO

if TYPE_CHECKING:
    from vrx_mj.foreign.plain import Job

LENGTH, STATUS = struct.Struct("<Q"), struct.Struct("<qd")
"""Length of a block or a piece, and how a job ended: exit status and processor time [s]."""
_IDLE_TIMEOUT = 60.0
"""Wall time without a job after which the process ends [s]."""


def block_from(stream: IO[bytes]) -> bytes:
    """The next block; empty at the end of the stream."""
    head = _whole(stream, LENGTH.size)
    return _whole(stream, LENGTH.unpack(head)[0]) if len(head) == LENGTH.size else b""


def _whole(stream: IO[bytes], size: int) -> bytes:
    """Read `size` bytes, of which a pipe gives a part at a time; fewer at the end of the stream."""
    found = bytearray()
    while len(found) < size and (piece := stream.read(size - len(found))):
        found += piece
    return bytes(found)


def _main() -> None:
    """Take jobs until the stream of them ends."""
    jobs, answers = os.fdopen(os.dup(0), "rb", buffering=0), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for handle in (0, 1, 2):  # whatever is printed stays out of the answers
        os.dup2(nothing, handle)
    settings = json.loads(block_from(jobs))
    sys.path[:] = settings["modules"]
    warnings.simplefilter("ignore")
    if settings["forks"]:
        while select.select([jobs], [], [], _IDLE_TIMEOUT)[0] and (job := block_from(jobs)):
            _relay(*_start_job(job, (jobs, answers), settings["libraries"]), answers)
    else:
        _prepare(job := json.loads(block_from(jobs)))
        answer = _job_answer(job, settings["libraries"])
        answers.write(LENGTH.pack(len(answer)) + answer + LENGTH.pack(0) + STATUS.pack(0, time.process_time()))
        answers.flush()
        os._exit(0)  # no thread of a library is waited for


def _start_job(text: bytes, streams: Sequence[BinaryIO], libraries: list[str]) -> tuple[int, int]:
    """Start a copy of this process that does a job; its process number, and the pipe of its answer."""
    job = json.loads(text)
    _prepare(job)
    source, target = os.pipe()
    if pid := os.fork():
        os.close(target)
        return pid, source
    try:
        for stream in streams:
            os.close(stream.fileno())
        os.close(source)
        with os.fdopen(target, "wb") as output:
            output.write(_job_answer(job, libraries))
    finally:
        os._exit(0)


def _prepare(job: Job) -> None:
    """Import what a job needs, unless that starts threads, which a copy would lack; the job reports what fails."""
    with contextlib.suppress(Exception):
        import_module("vrx_mj.foreign.confinement")
        if not job["limits"]["threads"]:
            import_module(job["module"])


def _relay(pid: int, source: int, answers: BinaryIO) -> None:
    """Write what comes from a pipe, and how the process at its other end ended."""
    while piece := os.read(source, 1 << 20):
        answers.write(LENGTH.pack(len(piece)) + piece)
        answers.flush()
    os.close(source)
    _, status, usage = os.wait4(pid, 0)
    answers.write(LENGTH.pack(0) + STATUS.pack(os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime))
    answers.flush()


def _job_answer(job: Job, libraries: list[str]) -> bytes:
    """The answer to a job."""
    from vrx_mj.foreign.confinement import answer

    return answer(job, libraries)


if __name__ == "__main__":
    _main()
