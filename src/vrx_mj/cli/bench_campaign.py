"""What of a campaign's processor time is simulation."""

import itertools
import json
import tempfile
from collections.abc import Mapping
from contextlib import chdir, closing
from pathlib import Path

import psutil

from vrx_mj.campaign.engines import ProcessPool, run_trials
from vrx_mj.campaign.manifest import begin
from vrx_mj.campaign.page import LivePage
from vrx_mj.campaign.plan import Plan
from vrx_mj.campaign.results import LOG, ResultStore
from vrx_mj.outputs import write_files

_CONTROLLER = """
import time

def steady(obs, t):
    if t < 0.05 or t > 29.85:
        print(time.process_time())
    return {"wamv": {"left": 0.5, "right": 0.4}}
"""
"""Its 300 calls cost next to nothing; the first and the last tell the processor time."""
_WARM_UP = 10
"""Trials that do not count."""


def campaign_times(world: Mapping[str, object], controllers: int = 1, trials: int = 100) -> tuple[float, float]:
    """Processor time [s] in which trials of 30 s step, observe, and keep the score, and what the campaign takes in all.

    The first is what a trial takes from the first call of its controller to the last, and a 299th more; the second what
    all processes take, with the database and the page. Of each controller there are `trials`, and some of a warm-up,
    which do not count.
    """
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        names = [f"hold_{number}" for number in range(controllers)]
        files = {f"{name}.py": _CONTROLLER for name in names}
        write_files(Path(), {**files, "world.yaml": json.dumps(world)}, "the campaign")
        seeds, last = tuple(range(4 * trials)), _WARM_UP + trials * controllers
        plan = Plan(tuple(f"{name}:steady" for name in names), ("world.yaml",), seeds, duration=30.0)
        begun = begin(Path("results"), plan)  # workers get many at a time until there are few
        planned = [plan.trial(cell) for cell in plan.cells]
        page, simulated, marks = LivePage(begun), 0.0, list[float]()
        sailed = run_trials(planned, begun.folder, ProcessPool(1))
        with ResultStore(begun.folder, writes=True) as store, closing(sailed):
            for number, result in enumerate(itertools.islice(sailed, last), start=1):
                store.add(result)
                page.refresh(result)
                if number in (_WARM_UP, last):
                    marks.append(_cpu_time())
                if number > _WARM_UP:
                    log = begun.folder / result.cell.folder / LOG
                    first, final = map(float, log.read_text(encoding="utf-8").split())
                    simulated += (final - first) * 300 / 299
        return simulated, marks[1] - marks[0]


def _cpu_time() -> float:
    """Processor time of this process and of all that it has started [s]."""
    here = psutil.Process()
    return float(sum(sum(each.cpu_times()[:4]) for each in (here, *here.children(recursive=True))))
