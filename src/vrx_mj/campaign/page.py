"""The page of a campaign: one static file that needs no network. Layout is in `templates/campaign`."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment
from markupsafe import Markup

from vrx_mj.campaign.manifest import Campaign
from vrx_mj.campaign.maps import SHAPES, map_values, path
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import LOG, Result, read_results, read_sketches, write_csv, write_text
from vrx_mj.campaign.scores import Comparison, leaderboard, mean_of, seedless_worlds, task_types, tasks_of_worlds
from vrx_mj.draw.colors import boat_color, hex_color
from vrx_mj.draw.page import page_environment

_BEST, _MIDDLE, _WORST = (94, 181, 166), (246, 236, 205), (231, 135, 98)
"""Colours of a score among those of its world."""
_MOST_CHANGES = 200
_Row = dict[str, Any]


def page(campaign: Campaign, sketches: Mapping[str, _Row], comparison: Comparison | None = None) -> str:
    """The page as HTML. Names, messages and descriptions are escaped, wherever they come from."""
    plan, results = campaign.manifest.plan, list(campaign.results.values())
    return (
        _environment()
        .get_template("page.html.j2")
        .render(
            manifest=campaign.manifest,
            plan=plan,
            colors=[hex_color(boat_color(number)) for number in range(len(plan.controllers))],
            done=sum(not result.has_failed for result in results),
            failed=sum(result.has_failed for result in results),
            hours=sum(result.sim_time for result in results) / 3600.0,
            tasks=task_types(results),
            board=leaderboard(results, plan.controllers),
            rows=list(_rows(campaign)),
            maps=list(_maps(campaign, sketches)),
            seedless=seedless_worlds(results),
            failures=[
                {"cell": result.cell, "error": result.error, "log": f"{result.cell.folder}/{LOG}"}
                for result in results
                if result.has_failed
            ],
            comparison=comparison,
            most_changes=_MOST_CHANGES,
        )
    )


def _rows(campaign: Campaign) -> Iterator[_Row]:
    """Rows of the table of scores: each controller in each world, its cells by seed."""
    plan, tasks = campaign.manifest.plan, tasks_of_worlds(campaign.results.values())
    for number, world in enumerate(plan.worlds):
        task, found = tasks.get(world), _in_world(campaign, world)
        scores = [result.score for result in found if result.score is not None]
        for index, controller in enumerate(plan.controllers):
            mean = mean_of(result for result in found if result.cell.controller == controller)
            cells = [
                _cell(campaign.results.get(Cell(controller, world, seed)), seed, scores, task) for seed in plan.seeds
            ]
            yield {
                "world": world, "number": number, "controller": controller, "index": index, "task": task,
                "mean": mean, "cells": cells,
            }  # fmt: skip


def _in_world(campaign: Campaign, world: str) -> list[Result]:
    return [result for result in campaign.results.values() if result.cell.world == world]


def _cell(result: Result | None, seed: int, scores: Sequence[float], task: Mapping[str, str] | None) -> _Row:
    """What one cell shows: text, colour, and more about it."""
    row = {"seed": seed, "text": "", "value": "", "color": ""}
    if result is None:
        return {**row, "kind": "missing", "title": f"seed {seed}: not run yet"}
    if result.has_failed:
        return {**row, "kind": "failed", "text": "✕", "title": f"seed {seed} failed: {result.error}"}
    if result.score is None or task is None:
        text = "no task" if result.task is None else "not started"
        return {**row, "kind": "none", "text": text, "title": f"seed {seed}: {text}, {result.sim_time:g} s"}
    return {
        **row,
        "kind": "score",
        "text": f"{result.score:.4g}{' ✂' if result.status == 'cut' else ''}",
        "value": f"{result.score:.6g}",
        "color": _color(result.score, scores, task["better"]),
        "title": f"seed {seed}: {result.score:.4g} {task['unit']}{_how(result.task or {})}",
    }


def _how(task: Mapping[str, object]) -> str:
    """How a task ended, in words."""
    hits = task["num_collisions"]
    collided = f", {hits} collision{'s' if hits != 1 else ''}" if hits else ""
    end = "cut while running" if task["state"] == "running" else "finished"
    return f" after {task['elapsed']:.1f} s, {end}{', timed out' if task['timed_out'] else ''}{collided}"


def _color(score: float, scores: Sequence[float], better: str) -> str:
    """Green for the best of a world's scores, red for its worst; nothing where all are about equal."""
    least, most = min(scores), max(scores)
    if most - least <= 1e-3 * max(abs(most), abs(least)):
        return ""
    share = (score - least) / (most - least)
    share = 1.0 - share if better == "higher" else share
    low, high, part = (_BEST, _MIDDLE, 2.0 * share) if share < 0.5 else (_MIDDLE, _WORST, 2.0 * share - 1.0)
    return hex_color(round(a + (b - a) * part) for a, b in zip(low, high, strict=True))


def _maps(campaign: Campaign, sketches: Mapping[str, _Row]) -> Iterator[_Row]:
    plan, tasks = campaign.manifest.plan, tasks_of_worlds(campaign.results.values())
    for number, world in enumerate(plan.worlds):
        if world not in sketches:
            continue
        found = _in_world(campaign, world)
        lines = []
        for index, controller in enumerate(plan.controllers):
            own = [result for result in found if result.cell.controller == controller]
            if own:
                recorded = [result for result in own if result.recording]
                lines.append({"controller": controller, "index": index, "mean": mean_of(own), "recorded": recorded})
        yield {
            "world": world, "number": number, "task": tasks.get(world), "lines": lines,
            "description": sketches[world]["description"],
            "svg": map_svg(world, sketches[world], found, plan.controllers),
        }  # fmt: skip


def map_svg(world: str, sketch: _Row, results: Sequence[Result], controllers: Sequence[str]) -> Markup:
    """A world from above with the tracks of these trials."""
    values = {"world": world, **map_values(sketch, results, controllers)}
    return Markup(_environment().get_template("map.svg.j2").render(map=values, sketch=sketch))


@cache
def _environment() -> Environment:
    """The templates of the page and of its maps, with what they call."""
    environment = page_environment("campaign")
    environment.filters |= {"number": _number, "path": path, "metres": "{:.1f}".format, "size": "{:.2f}".format}
    environment.globals |= SHAPES
    return environment


def _number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits; a dash for none."""
    return "–" if value is None or math.isnan(value) else f"{value:.{digits}g}"


PAGE = "index.html"


def with_new_results(campaign: Campaign) -> Campaign:
    """The campaign with the results that are in its folder now."""
    return replace(campaign, results=read_results(campaign.folder, campaign.manifest.plan.cells))


def write_report(campaign: Campaign, comparison: Comparison | None = None) -> Path:
    """Write `results.csv` and the page into the campaign's folder; the path of the page."""
    plan = campaign.manifest.plan
    write_csv(
        campaign.folder / "results.csv", (campaign.results[cell] for cell in plan.cells if cell in campaign.results)
    )
    text = page(campaign, read_sketches(campaign.folder, plan.worlds), comparison)
    write_text(campaign.folder / PAGE, text)
    return campaign.folder / PAGE
