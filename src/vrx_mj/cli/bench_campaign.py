"""What of a campaign's processor time is simulation."""

import json
import tempfile
import time
from collections.abc import Iterable, Mapping
from contextlib import chdir
from pathlib import Path

import psutil

from vrx_mj.campaign.engines import ProcessPool, run_trials
from vrx_mj.campaign.manifest import begin
from vrx_mj.campaign.page import LivePage
from vrx_mj.campaign.plan import Plan
from vrx_mj.campaign.results import ResultStore
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.outputs import write_files
from vrx_mj.runtime.run import run
from vrx_mj.runtime.simulation import Simulation

_COMMANDS = {"wamv": {"left": 0.5, "right": 0.4}}
_CONTROLLER = f"def steady(obs, t):\n    return {_COMMANDS}\n"


def campaign_share(world: Mapping[str, object], trials: int = 40) -> float:
    """Share of a campaign's processor time that its runs take: trials of 30 s, of a controller that costs nothing.

    That is what such runs take one after the other in one process, over what all processes of the campaign take for
    them, with its results and its page. The runs are before the campaign and after it.
    """
    sim = Simulation(compile_world(world))

    def runs(seeds: Iterable[int]) -> float:
        begun = time.process_time()
        for seed in seeds:
            sim.reset(seed)
            run(sim, 30.0, controller=lambda _obs, _time: _COMMANDS)
        return time.process_time() - begun

    runs(range(4))
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        write_files(Path(), {"hold.py": _CONTROLLER, "world.yaml": json.dumps(world)}, "the campaign")
        plan = Plan(("hold:steady",), ("world.yaml",), tuple(range(4 * trials)), duration=30.0)
        begun, alone, spent = begin(Path("results"), plan), runs(range(trials)), list[float]()
        page = LivePage(begun)
        with ResultStore(begun.folder, writes=True) as store:
            for result in run_trials([plan.trial(cell) for cell in plan.cells], begun.folder, ProcessPool(1)):
                store.add(result)
                page.refresh()
                if result.cell.seed in (trials, 3 * trials):
                    spent.append(_spent())
        return (alone + runs(range(trials))) / (spent[1] - spent[0])


def _spent() -> float:
    """Processor time of this process and of all that it has started [s]."""
    here = psutil.Process()
    return float(sum(sum(each.cpu_times()[:4]) for each in (here, *here.children(recursive=True))))
