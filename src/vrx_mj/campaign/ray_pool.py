"""The same trials on a Ray cluster: every task of it sails one trial in a process of its own, and sends back its files.

The current folder goes along, with controllers and worlds in it; vrx_mj has to be installed on the nodes.
"""

import logging
import os
import tempfile
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from vrx_mj.campaign.process import TrialProcess, start_server
from vrx_mj.campaign.results import WHAT, Result, read_result, sketch_file, write_result
from vrx_mj.campaign.trial import Trial
from vrx_mj.errors import VrxError
from vrx_mj.outputs import write_files
from vrx_mj.packages import needs_extra

_LOOK = 0.5
"""How often trials are looked after [s]."""
_STOP_TIMEOUT = 10.0
"""How long trials may take to stop [s]."""
_EXCLUDED_FILES = ("*.rrd", ".git", ".venv", "__pycache__", "*.pyc")
"""Files of the current folder that no node needs."""
_Files = dict[str, bytes]


def sail_on_ray(
    trials: Sequence[Trial],
    root: Path,
    jobs: int | None = None,
    *,
    running: Callable[[int], None] = lambda _count: None,
) -> Generator[Result, None, None]:
    """Sail trials on the cluster that RAY_ADDRESS names, or one that is started on this machine.

    As `pool.sail_all`; without `jobs`, as many at a time as the cluster has processors.

    Raises:
        VrxError: Ray is not installed, or the cluster does not exist.
    """
    if not trials:
        return
    ray = _connected(root)
    under_way: dict[Any, Trial] = {}
    try:
        most = jobs or max(1, int(ray.cluster_resources().get("CPU", 1)))
        task = ray.remote(num_cpus=1, max_retries=0)(_sail_there)
        waiting = list(reversed(trials))
        while waiting or under_way:
            while waiting and len(under_way) < most:
                trial = waiting.pop()
                under_way[task.remote(trial)] = trial
            running(len(under_way))
            ready, _ = ray.wait(list(under_way), timeout=_LOOK)
            for reference in ready:
                yield _brought(ray, reference, under_way.pop(reference), root)
    finally:
        for reference in under_way:
            ray.cancel(reference)
        if under_way:
            ray.wait(list(under_way), num_returns=len(under_way), timeout=_STOP_TIMEOUT)
        ray.shutdown()


def _connected(root: Path) -> Any:
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
        process = TrialProcess(start_server(), trial, root)
        try:
            while process.result() is None:
                wait([process.sentinel], timeout=_LOOK)
        finally:
            process.stop()
        return {file.relative_to(root).as_posix(): file.read_bytes() for file in root.rglob("*") if file.is_file()}


def _brought(ray: Any, reference: Any, trial: Trial, root: Path) -> Result:
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
