"""What of a campaign's processor time is simulation."""

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


def campaign_share(world: Mapping[str, object], trials: int = 100) -> float:
    """Share of a campaign's processor time in which trials of 30 s step, observe, and keep the score.

    That is what a trial takes from the first call of its controller to the last, and a 299th more, over what all
    processes take, with the database and the page. Trials of a warm-up do not count.
    """
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        write_files(Path(), {"hold.py": _CONTROLLER, "world.yaml": json.dumps(world)}, "the campaign")
        seeds, last = tuple(range(4 * trials)), _WARM_UP + trials - 1  # workers get many at a time until there are few
        begun = begin(Path("results"), Plan(("hold:steady",), ("world.yaml",), seeds, duration=30.0))
        planned = [begun.manifest.plan.trial(cell) for cell in begun.manifest.plan.cells]
        page, simulated, marks = LivePage(begun), 0.0, list[float]()
        sailed = run_trials(planned, begun.folder, ProcessPool(1))
        with ResultStore(begun.folder, writes=True) as store, closing(sailed):
            for result in sailed:
                store.add(result)
                page.refresh()
                if result.cell.seed in (_WARM_UP - 1, last):
                    marks.append(_spent())
                if result.cell.seed >= _WARM_UP:
                    log = begun.folder / result.cell.folder / LOG
                    first, final = map(float, log.read_text(encoding="utf-8").split())
                    simulated += (final - first) * 300 / 299
                if result.cell.seed == last:
                    break
        return simulated / (marks[1] - marks[0])


def _spent() -> float:
    """Processor time of this process and of all that it has started [s]."""
    here = psutil.Process()
    return float(sum(sum(each.cpu_times()[:4]) for each in (here, *here.children(recursive=True))))
