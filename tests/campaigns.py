"""Results and campaigns made by hand."""

from dataclasses import replace

from vrx_mj.campaign.manifest import Campaign, Manifest
from vrx_mj.campaign.plan import Cell, Plan
from vrx_mj.campaign.results import Result, ResultStore
from vrx_mj.errors import RecordError

UNITS = {"stationkeeping": ("m", "lower"), "dock": ("points", "higher")}


def scored(controller, world, seed, score, *, kind="stationkeeping", state=None, tracks=None, phase="finished"):
    """A trial that ended with a score, in a phase of its task."""
    unit, better = UNITS[kind]
    task = {
        "type": kind, "name": kind, "state": phase, "score": score, "unit": unit, "better": better,
        "elapsed": 300.0, "timed_out": phase == "finished", "num_collisions": 0, "events": [],
    }  # fmt: skip
    cell = Cell(controller, world, seed)
    ended = {"finished": "finished", "running": "cut"}.get(phase, "not started")
    return Result(cell, ended, task=task, sim_time=320.0, state_sha256=state or f"{cell} {score}", tracks=tracks or {})


def failed(controller, world, seed, error="it sank"):
    """A trial that failed."""
    return Result(Cell(controller, world, seed), "failed", error=error)


def campaign_of(folder, results, *, code="0.1.0 abc", platform="here", physics=2, hashes=None, **options):
    """The campaign of these results: of every controller, world and seed that is among them."""
    cells = [result.cell for result in results]
    controllers = tuple(dict.fromkeys(cell.controller for cell in cells))
    worlds = tuple(dict.fromkeys(cell.world for cell in cells))
    plan = Plan(controllers, worlds, tuple(sorted({cell.seed for cell in cells})), **options)
    digests = hashes or dict.fromkeys(controllers, "1")
    manifest = Manifest(plan, digests, code, platform, "2030-01-02T03:04:05+00:00", physics)
    return Campaign(folder, manifest, {result.cell: result for result in results})


def results_in(folder):
    """Results in a campaign's folder by controller and seed, with tracks; none before it has begun."""
    try:
        with ResultStore(folder) as store:
            found = list(store.results())
            tracks = store.tracks(result.cell for result in found)
    except RecordError:
        return {}
    return {(each.cell.controller, each.cell.seed): replace(each, tracks=tracks[each.cell]) for each in found}
