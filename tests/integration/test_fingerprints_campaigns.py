"""What pages, maps, tables and scores of campaigns show: the numbers that they showed before."""

import json
import re
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from campaigns import campaign_of, failed, scored
from fingerprints import check
from vrx_mj.campaign import page as pages
from vrx_mj.campaign.page import LivePage, map_values, page
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import Result, ResultStore, sketch_file, write_json
from vrx_mj.campaign.scores import (
    compare,
    dependence,
    failure_classes,
    leaderboard,
    mean_of,
    remarkable_trials,
    seedless_worlds,
)
from vrx_mj.campaign.vary import Quantity
from vrx_mj.cli.campaign import print_tables

GUSTS, CURRENT = Quantity("wind.mean", 1.0, 8.0, "m/s"), Quantity("current.speed", 0.0, 2.0)
WHO = ("a:f", "b.c:f", "d:f")
BAY = {
    "name": "bay", "description": "a bay", "task": {"type": "dock", "name": "dock"},
    "shore": [
        [[-90.0, -90.0], [150.0, -80.0], [160.0, 90.0], [-70.0, 95.0]],
        [[-60.0, -40.0], [-50.0, 60.0], [90.0, 50.0], [95.5, -45.0]],
        [[10.0, 12.0], [20.0, 12.0], [20.0, 25.0], [15.0, 25.4], [10.0, 25.0]],
    ],
    "docks": [{"name": "pier", "cells": [[10.0, 10.0], [12.0, 10.0], [70.0, 0.0]], "yaw": 0.5, "cell": 2.0}],
    "objects": [
        {"name": "near", "spot": [-12.0, 8.0], "color": "#ff0000", "size": 1.0},
        {"name": "far", "spot": [-50.0, 4.0], "color": "#00ff00", "size": 0.25},
    ],
    "boats": [{"name": "wamv", "x": 0.0, "y": 1.0, "yaw": 1.0}], "waypoints": [[20.0, 5.0, 0.3], [22.0, 9.0, 2.0]],
    "gates": [{"left": [1.0, 2.0], "right": [3.0, 5.0], "yaw": 0.7}],
    "circles": [{"x": 9.0, "y": -9.0, "radius": 11.0, "title": "keep off"}],
    "bays": [
        {"corners": [[1.0, 1.0], [2.0, 1.0], [2.0, 3.0]], "allowed": True, "title": "in"},
        {"corners": [[4.0, 1.0], [5.0, 1.0], [5.0, 3.0]], "allowed": False, "title": "out"},
    ],
    "beacons": [[3.0, -33.0]], "paths": [[[0.0, 0.0], [1.0, 1.0], [4.0, 1.5]]],
}  # fmt: skip
SEA = {key: [] for key in BAY} | {"name": "sea", "description": "", "task": None}


def results(shift=0.0, seeds=7):
    """Scores of three controllers in two worlds of two kinds of tasks, with all ways to end, and what was varied."""
    random = np.random.default_rng(5)
    for place, (who, world) in enumerate((who, where) for who in WHO for where in ("v", "w")):
        for seed in range(seeds):
            way = {"wamv": np.cumsum(random.normal(0.0, 3.0, (70, 2)), axis=0).tolist()}
            phase = {2: "running", 3: "ready"}.get((seed + place) % 5, "finished")
            kind = "dock" if world == "v" else "stationkeeping"
            score = float(random.normal(place + shift, 1.0 + seed / 6))
            result = scored(who, world, seed, score, kind=kind, tracks=way, phase=phase)
            drawn = {"wind.mean": GUSTS.value(seed), "current.speed": float(random.uniform(0.0, 2.0))}
            task = {**result.task, "num_collisions": (seed + place) % 3, "elapsed": 100.0 + seed}
            recording = "run.rrd" if seed % 2 else None
            yield replace(result, parameters=drawn, task=task, recording=recording, wall_time=1.5 * seed)
        yield failed(who, world, seeds, f"it sank in {place % 2}.5 m")
        yield Result(Cell(who, world, seeds + 1), "lost", error="its worker is gone")


def campaign(shift=0.0, **options):
    return campaign_of("results", [*results(shift)], vary=(GUSTS, CURRENT), **options)


@pytest.fixture(scope="module")
def now():
    return campaign(0.3, code="0.2", platform="there", physics=3, hashes=dict.fromkeys(WHO, "2"))


@pytest.fixture(scope="module")
def then():
    return campaign()


def shown(html):
    """The lines of a page, without when it was written."""
    return re.sub(r"20\d\d-\d\d-\d\d \d\d:\d\d:\d\d", "", html).splitlines()


@pytest.fixture(autouse=True)
def charts(monkeypatch):
    """The charts of pages, which are not drawn."""
    found = []
    monkeypatch.setattr(pages, "chart_svg", lambda chart: found.append(chart) or "")
    return found


@pytest.mark.parametrize("running", [False, True])
def test_a_page_shows_what_it_showed(now, then, charts, running):
    found = page(now, {"v": BAY, "w": SEA}, None if running else compare(now, then), running=running)
    check("campaigns", f"page {running}", page=shown(found), charts=charts)


def test_a_large_campaign_has_no_cell_for_each_trial(monkeypatch):
    few = [replace(result, cell=replace(result.cell, controller="a:f")) for result in results(seeds=28)]
    found = page(campaign_of("results", [*few[:30], *(scored("a:f", "w", seed, 2.0) for seed in range(31))]), {})
    check("campaigns", "page of 31 seeds", page=shown(found))
    sizes = ((30, 3000), (31, 3000), (30, 3001))
    plans = [SimpleNamespace(manifest=SimpleNamespace(plan=SimpleNamespace(seeds=range(seeds))), results=range(cells))
             for seeds, cells in sizes]  # fmt: skip
    assert [pages._is_detailed(plan) for plan in plans] == [True, False, False]


@pytest.mark.parametrize("count", [199, 200, 400])
def test_charts_have_two_hundred_points_of_a_controller_at_most(charts, count):
    own = [
        replace(scored("a:f", "w", seed, seed % 7), parameters={"wind.mean": 1.0 + seed / 60}) for seed in range(count)
    ]
    list(pages._charts(campaign_of("results", own, vary=(GUSTS,))))
    check("campaigns", f"charts of {count}", charts=charts)


def test_maps_show_what_they_showed(now):
    own = [*now.results.values()]
    check("campaigns", "maps", bay=map_values(BAY, own[:4], WHO), sea=map_values(SEA, [], WHO),
          far=map_values({**SEA, "objects": BAY["objects"]}, own[6:9], WHO))  # fmt: skip


def test_maps_end_where_a_page_would_be_too_large(now, monkeypatch):
    own = replace(now, results={cell: replace(result, tracks={}) for cell, result in now.results.items()})
    size = len(pages.map_svg("v", BAY, [*own.results.values()], WHO))
    for most, maps in ((size, 2), (size - 1, 1)):
        monkeypatch.setattr(pages, "_MAX_MAPS_SIZE", most)
        assert [one["tracks"] for one in pages._maps(own, {"v": BAY, "w": BAY})] == [0] * maps


@pytest.mark.parametrize(("worlds", "trials", "each"), [(1, 60, 50), (1, 4, 4), (45, 41, 40), (900, 4, 3)])
def test_maps_show_fifty_tracks_or_as_many_as_a_page_has_room_for_but_three(monkeypatch, worlds, trials, each):
    """From the best trial to the worst, evenly: room is for 1800 tracks."""
    own, chosen = [scored("a:f", f"w{world}", seed, -seed) for world in range(worlds) for seed in range(trials)], []
    store = nullcontext(SimpleNamespace(tracks=lambda cells: chosen.extend(cells) or {}))
    monkeypatch.setattr(pages, "ResultStore", lambda _folder: store)
    pages._with_tracks(campaign_of("results", own))
    assert len(chosen) == worlds * each
    assert (chosen[0].seed, chosen[each - 1].seed) == (trials - 1, 0)


def test_files_of_a_campaign_have_what_they_had(now, then, tmp_path, monkeypatch):
    """The tracks of some trials of each world, from the best to the worst."""
    monkeypatch.setattr(pages, "_MAX_TRACKS", 9)
    own = replace(now, folder=tmp_path)
    with ResultStore(tmp_path, writes=True) as store:
        store.add(*now.results.values())
    write_json(sketch_file(tmp_path, "v"), {"format": 1, **BAY})
    found, comparison = LivePage(own, then).write()
    assert comparison == compare(found, then)
    html, table = ((tmp_path / name).read_text(encoding="utf-8") for name in ("index.html", "results.csv"))
    assert html.count('class="track') == 7  # two of the nine trials failed
    check("campaigns", "files", page=shown(html), table=table.splitlines())
    (tmp_path / "results.csv").unlink()
    LivePage(own).write(running=True)
    assert not (tmp_path / "results.csv").exists()


def test_scores_are_what_they_were(now, then):
    own = list(now.results.values())
    check(
        "campaigns", "scores", compared=compare(now, then), board=leaderboard(own, WHO), mean=mean_of(own),
        text=str(mean_of(own)), interval=mean_of(own).interval, failures=failure_classes(own),
        remarkable=remarkable_trials(own), seedless=seedless_worlds(own),
        bare=remarkable_trials([replace(result, recording=None) for result in own]),
        gusts=[dependence(own, GUSTS, who) for who in WHO], current=dependence(own, CURRENT, "a:f"),
    )  # fmt: skip


def test_rows_of_the_store_are_what_they_were(now, tmp_path):
    with ResultStore(tmp_path, writes=True) as store:
        store.add(*now.results.values())
        rows = [store._base.execute(f"select * from {name}").fetchall() for name in ("trials", "details")]
    check("campaigns", "store", rows=rows, first=json.dumps(rows[0][0]), events=rows[1][0][-1])


def test_tables_on_the_screen_are_what_they_were(now, then, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "200")
    print_tables(now, compare(now, then))
    print_tables(campaign_of("results", [scored("a:f", "w", 0, 1.0)]), None)
    check("campaigns", "tables", words=[line.split() for line in capsys.readouterr().out.splitlines()])
