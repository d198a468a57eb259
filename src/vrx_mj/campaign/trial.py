"""One trial: have the world, load the controller, sail until the task is over, return the score."""

import errno
import math
import sys
import time
import traceback
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.campaign.plan import Cell, State, Trial
from vrx_mj.campaign.results import Result, Stopwatch, Tracks
from vrx_mj.campaign.vary import numbers_by_name
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.model.numbers import run_numbers, with_numbers
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.run import (
    Controller,
    Summary,
    fingerprint,
    harmless_speeds,
    is_unusual,
    load_controller,
    planned_duration,
    run,
    steps_of_calls,
)
from vrx_mj.runtime.simulation import Simulation

_RECORDING = "run.rrd"
COMPILE_TIMEOUT = 120.0
"""Wall time for compiling a world [s]."""
_EXTRA_TIME = 60.0
"""Wall time that a trial gets on top of its simulated time [s]."""
INTERRUPTED = "interrupted"
"""The error of a trial that was interrupted."""
_STATES: Mapping[str, State] = {"initial": "not started", "ready": "not started", "running": "cut"}
"""The states of trials that end in these phases of a task."""
_MACHINE_ERRORS = {errno.EDQUOT, errno.EIO, errno.ENOMEM, errno.ENOSPC, errno.ENOTCONN, errno.EROFS, errno.ESTALE}
"""Errors of files that say nothing of a controller."""
_MAX_EVENTS = 200
"""Lines of the referee that are kept, at most."""


class RaisedError(VrxError):
    """An error that a controller raised, in words; the error itself is its cause."""


class _TrackedController:
    """A controller whose boats are tracked, and whose errors are kept apart from ours."""

    def __init__(self, cell: Cell, sim: Simulation, tracks: Tracks, stopwatch: Stopwatch) -> None:
        self._boats, self._tracks, self._stopwatch = sim.boats, tracks, stopwatch
        self._controller = load_own_controller(cell.controller, cell.seed, sim)

    def __call__(self, obs: Any, moment: float) -> Any:
        """Call it, at simulated time `moment` [s]."""
        self._stopwatch.reach(moment)
        for boat in self._boats:
            self._tracks.add(boat, obs[boat].position)
        try:
            return self._controller(obs, moment)
        except VrxError:
            raise
        except (Exception, SystemExit) as error:
            raise RaisedError(f"at t = {moment:g} s the controller raised {_in_words(error)}") from error


def load_own_controller(name: str, seed: int | Sequence[int], sim: Simulation | None = None) -> Controller:
    """A controller as `load_controller` returns it, looked for in the current folder first.

    Raises:
        VrxError: it does not exist, or takes other arguments; a `RaisedError` if loading it raised something else.
    """
    sys.path.insert(0, str(Path.cwd()))
    try:
        return load_controller(name, seed, sim)
    except VrxError:
        raise
    except (Exception, SystemExit) as error:
        raise RaisedError(f"loading the controller raised {_in_words(error)}") from error


def sail(trial: Trial, folder: Path, stopwatch: Stopwatch, warm: Simulation | None) -> Result:
    """Sail a trial; its result, failed or not.

    Args:
        trial: what to sail.
        folder: where its recording goes, if there is to be one; a traceback goes to stderr.
        stopwatch: takes how far it is.
        warm: a simulation of its world as the files have it, of any seed; None: compile it.
    """
    begun, tracks, sim = time.perf_counter(), Tracks(), None
    stopwatch.allow(COMPILE_TIMEOUT)
    try:
        warm = warm or Simulation(compile_world(trial.cell.world, fleet=trial.fleet))
        base = warm.world
        numbers = numbers_by_name(base, trial.parameters)
        if numbers and not numbers.keys() <= run_numbers(base.numbers).keys():
            warm = Simulation(compile_world(trial.cell.world, fleet=trial.fleet, parameters=numbers))
            numbers = {}
        warm.reset(trial.cell.seed, parameters=numbers)
        sim = warm
        with _recording(sim, folder / _RECORDING if trial.record else None):
            summary = _summary(trial, sim, folder, tracks, stopwatch)
        return _result_of(trial, summary, tracks, world_sha256=base.sha256, qpos=sim.data.qpos)
    except Exception as error:
        state = "lost" if _is_the_machines(error) else "failed"
        times = {"sim_time": sim.time if sim else 0.0, "wall_time": time.perf_counter() - begun}
        return _result(trial, tracks, state=state, error=_error_text(error, sim), **times)


def sail_rows(trials: Sequence[Trial], stopwatch: Stopwatch, warm: Simulation | None) -> list[Result]:
    """Sail trials of one controller that takes rows, in one world, as the rows of a batch; their results.

    Trials of which a run may warn, as boats capsize, have none: their logs are written when they are sailed alone.
    There are none where each must be sailed alone: with a task; with quantities that a batch cannot vary; after an
    error, of which each trial then has its own; and where the first or the last one comes out otherwise alone, as by
    numpy's `@`, which rounds by the number of rows. `warm` is as in `sail`.
    """
    try:
        sim = warm or Simulation(compile_world(trials[0].cell.world, fleet=trials[0].fleet))
        (results, unusual), *alone = (_row_results(own, stopwatch, sim) for own in (trials, trials[:1], trials[-1:]))
    except Exception:
        traceback.print_exc()
        return []
    ends = zip(alone, (results[0], results[-1]), strict=True)
    same = all(own.state_sha256 == row.state_sha256 for ((own,), _), row in ends)
    return [result for result, odd in zip(results, unusual, strict=True) if same and not odd]


def _row_results(trials: Sequence[Trial], stopwatch: Stopwatch, warm: Simulation) -> tuple[list[Result], BoolArray]:
    """Results of trials without a task, which end with their time; of which of them a run may warn."""
    begun, world, first = time.perf_counter(), warm.world, trials[0]
    steps = warm.steps_in(first.duration or planned_duration(warm))
    stopwatch.allow(COMPILE_TIMEOUT)
    seeds, numbers = [trial.cell.seed for trial in trials], [numbers_by_name(world, own.parameters) for own in trials]
    batch = Batch(world, len(trials), seed=seeds, threads=1)
    batch.vary(parameters={name: [own[name] for own in numbers] for name in numbers[0]})
    batch.reset(seed=seeds)
    controller: Any = load_own_controller(first.cell.controller, seeds)
    worlds = [with_numbers(world.parameters, own, run_numbers(world.numbers)) for own in numbers]
    speeds, unusual = np.array([*map(harmless_speeds, worlds)]), np.zeros(batch.n, bool)
    seen, tracks = batch.features[..., :2].copy(), [Tracks() for _ in trials]
    way = np.zeros(seen.shape[:2])
    stopwatch.allow(first.timeout or _EXTRA_TIME + steps * batch.timestep)  # if it is not enough, each has so much
    for count in steps_of_calls(steps, batch.timestep):
        stopwatch.reach(moment := float(batch.time[0]))
        for own, boats in zip(tracks, seen.tolist(), strict=True):
            for boat, place in zip(batch.boats, boats, strict=True):
                own.add(boat, place)
        batch.command(controller(batch.features.copy(), moment))
        batch.advance(count)
        now = batch.features[..., :2].copy()
        way += np.hypot(*np.moveaxis(now - seen, -1, 0))
        seen = now
        unusual |= is_unusual(batch.features, speeds)
    common = {
        "sim_time": steps * batch.timestep, "wall_time": (time.perf_counter() - begun) / batch.n,
        "platform": fingerprint(), "world_sha256": world.sha256,
    }  # fmt: skip
    motions = [_motion_sha256(*own) for own in zip(way, batch.qpos, strict=True)]
    return [
        _result(trial, own, state_sha256=batch.get_state(row).sha256, poses_sha256=motions[row], **common)
        for row, (trial, own) in enumerate(zip(trials, tracks, strict=True))
    ], unusual


def _result(trial: Trial, tracks: Tracks, **own: Any) -> Result:
    """The result of a trial, with what it has of its own."""
    return Result(trial.cell, tracks=tracks.lines(), parameters=trial.parameters, **own)


def _motion_sha256(way: npt.ArrayLike, qpos: FloatArray) -> str:
    """Fingerprint of how far boats went [m] and of where all is, MuJoCo's `qpos`."""
    return sha256(np.asarray(way).tobytes() + qpos.tobytes()).hexdigest()


def _summary(trial: Trial, sim: Simulation, folder: Path, tracks: Tracks, stopwatch: Stopwatch) -> Summary:
    simulated = trial.duration or planned_duration(sim)
    if trial.serving is None:
        stopwatch.allow(trial.timeout or _EXTRA_TIME + simulated)
        return run(sim, trial.duration, controller=_TrackedController(trial.cell, sim, tracks, stopwatch))
    from vrx_mj.campaign.program_trial import sail_by_program  # needs the extra ros1

    slower = min(trial.serving.rate or 1.0, 1.0)
    wall = trial.timeout or _EXTRA_TIME + simulated / slower
    return sail_by_program(trial.cell, trial.serving, sim, folder, trial.duration, wall, tracks, stopwatch)


def _recording(sim: Simulation, file: Path | None) -> AbstractContextManager[object]:
    if file is None:
        return nullcontext()
    from vrx_mj.recording import record

    return record(sim, file)


def _result_of(trial: Trial, summary: Summary, tracks: Tracks, *, world_sha256: str, qpos: FloatArray) -> Result:
    """The result of a run."""
    task = asdict(summary.task) if summary.task else None
    if task is not None and not math.isfinite(task["score"] or 0.0):
        raise VrxError(f"the score of {task['name']} is {task['score']}: a finite number is needed")
    if task is not None:
        task["events"] = [list(event) for event in task["events"][-_MAX_EVENTS:]]
    return _result(
        trial, tracks, task=task, world_sha256=world_sha256, recording=_RECORDING if trial.record else None,
        state="failed" if summary.interrupted else _STATES.get(summary.task.state if summary.task else "", "finished"),
        error=INTERRUPTED if summary.interrupted else None,
        poses_sha256=_motion_sha256([boat.distance for boat in summary.boats.values()], qpos),
        **{name: getattr(summary, name) for name in ("sim_time", "wall_time", "state_sha256", "platform")},
    )  # fmt: skip


def _is_the_machines(error: Exception) -> bool:
    """Whether an error is of a machine without memory, or with a folder that is full or gone."""
    source = error.__cause__ if isinstance(error, RaisedError) else error
    return isinstance(source, MemoryError) or (isinstance(source, OSError) and source.errno in _MACHINE_ERRORS)


def _error_text(error: Exception, sim: Simulation | None) -> str:
    """An error in words; its traceback goes to stderr unless the words are enough."""
    if isinstance(error, RaisedError):
        traceback.print_exception(error.__cause__)
        return str(error)
    if isinstance(error, VrxError):
        return f"at t = {sim.time:g} s: {error}" if sim is not None and sim.time > 0.0 else str(error)
    traceback.print_exception(error)
    return f"an error inside vrx_mj: {_in_words(error)}"


def _in_words(error: BaseException) -> str:
    """An error's type, text and place: the innermost in the current folder, or the innermost of all."""
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).is_relative_to(Path.cwd())]
    place = next(reversed(own or frames), None)
    return text if place is None else f"{text} ({Path(place.filename).name}, line {place.lineno})"
