"""Trials on a Ray cluster: each task sails one trial in a process of its own, and sends back its files.

The current folder goes along, with controllers and worlds in it; vrx_mj has to be installed on the nodes.
"""

import logging
import os
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from vrx_mj.campaign.plan import Trial
from vrx_mj.campaign.process import LOOK, TrialProcess, keep_sailing, start_server
from vrx_mj.campaign.results import WHAT, Result, read_result, sketch_file, write_result
from vrx_mj.errors import VrxError
from vrx_mj.outputs import write_files
from vrx_mj.packages import needs_extra

_STOP_TIMEOUT = 10.0
"""How long trials may take to stop [s]."""
_EXCLUDED_FILES = ("*.rrd", ".git", ".venv", "__pycache__", "*.pyc")
"""Files of the current folder that no node needs."""
_Files = dict[str, bytes]
_Task = tuple[Any, Trial]
"""Ray's reference to a task, and its trial."""


def sail_on_ray(
    trials: Sequence[Trial],
    root: Path,
    jobs: int | None = None,
    *,
    running: Callable[[int], None] = lambda _count: None,
) -> Generator[Result, None, None]:
    """Sail trials on the cluster that RAY_ADDRESS names, or one that is started on this machine.

    As `sail_all`; without `jobs`, as many at a time as the cluster has processors.

    Raises:
        VrxError: Ray is not installed, or the cluster does not exist.
    """
    if not trials:
        return
    ray = _connection(root)
    most = jobs or max(1, int(ray.cluster_resources().get("CPU", 1)))
    task = ray.remote(num_cpus=1, max_retries=0)(_sail_there)

    def results(under_way: Sequence[_Task]) -> Iterator[tuple[_Task, Result]]:
        ready, _ = ray.wait([reference for reference, _ in under_way], timeout=LOOK)
        for reference, trial in list(under_way):
            if reference in ready:
                yield (reference, trial), _result(ray, reference, trial, root)

    def end(under_way: Sequence[_Task]) -> None:
        references = [reference for reference, _ in under_way]
        for reference in references:
            ray.cancel(reference)
        if references:
            ray.wait(references, num_returns=len(references), timeout=_STOP_TIMEOUT)
        ray.shutdown()

    yield from keep_sailing(
        trials, most, running, begin=lambda trial: (task.remote(trial), trial), results=results, end=end
    )


def _connection(root: Path) -> Any:
    """Ray, connected to a cluster whose workers have this folder's files, without results."""
    try:
        import ray
    except ImportError:
        raise VrxError(needs_extra("--ray", "Ray", "ray")) from None
    excluded = list(_EXCLUDED_FILES)
    with suppress(ValueError):
        excluded.append(f"/{root.resolve().relative_to(Path.cwd()).as_posix()}/")
    named = {name: value for name, value in os.environ.items() if name.startswith("VRX_MJ_")}
    environment = {"working_dir": str(Path.cwd()), "excludes": excluded, "env_vars": named}
    try:
        ray.init(runtime_env=environment, log_to_driver=False, logging_level=logging.ERROR)
    except (ConnectionError, RuntimeError, ValueError, OSError) as error:
        raise VrxError(f"cannot use a Ray cluster: {error}") from error
    return ray


def _sail_there(trial: Trial) -> _Files:
    """What a task does: sail a trial in a folder that is gone afterwards; the files of that folder."""
    with tempfile.TemporaryDirectory(prefix="vrx_mj-") as folder:
        root = Path(folder)
        process = TrialProcess(start_server(), root, trial)
        try:
            while process.result() is None:
                wait([process.sentinel], timeout=LOOK)
        finally:
            process.stop()
        return {file.relative_to(root).as_posix(): file.read_bytes() for file in root.rglob("*") if file.is_file()}


def _result(ray: Any, reference: Any, trial: Trial, root: Path) -> Result:
    """The result of a task that has ended, its files put where a trial on this machine puts them."""
    cell = trial.cell
    try:
        files: _Files = ray.get(reference)
    except ray.exceptions.RayError as error:
        result = Result(cell, error=f"Ray lost the trial: {str(error).strip().splitlines()[0]}")
        write_result(root / cell.folder, result)
        return result
    sketch = sketch_file(root, cell.world)
    for name, content in sorted(files.items(), key=lambda item: item[0].endswith("result.json")):
        if root / name != sketch or not sketch.is_file():
            write_files(root, {name: content}, WHAT)
    return read_result(root / cell.folder) or Result(cell, error="Ray returned no result")
