"""The page of a campaign, with its maps: one static file that needs no network. Layout is in `templates/campaign`."""

import math
import re
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from typing import Any

import numpy as np
from jinja2 import Environment
from markupsafe import Markup, escape
from shapely import LinearRing, MultiPoint, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from vrx_mj.campaign.manifest import Campaign
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import LOG, Result, ResultStore, read_results, read_sketches, write_csv, write_text
from vrx_mj.campaign.scores import (
    Comparison,
    compare,
    dependence,
    failure_classes,
    group_by,
    leaderboard,
    mean_of,
    remarkable_trials,
    seedless_worlds,
    task_types,
    tasks_of_worlds,
)
from vrx_mj.draw.chart import Chart, Series, chart_svg, page_environment
from vrx_mj.draw.course import Bay, Course, ground_of, map_of, nice_length, object_color, to_centimetres
from vrx_mj.draw.style import boat_color, hex_color
from vrx_mj.mjcf.world import World

_MAP_ASPECT = 1.5
"""Width by height of a map."""
_MAP_WIDTH = 720.0
"""Width of a map when it is shown large [px]: sizes that must stay visible go by it."""
_MAX_TRACKS, _MAX_TRACK_POINTS = 50, 30
"""Tracks of a map, and points of each, at most: more hide each other."""
_MAX_MAPS_SIZE = 900_000
"""Characters of all maps together, 500 of them for a track: no more maps are drawn beyond."""
_MAX_SEED_COLUMNS = 30
"""Seeds up to which each has a column of its own."""
_MAX_CELLS = 3000
"""Trials up to which each has a cell of its own, and rows of the table of scores, at most."""
_MAX_LISTED = 200
"""Kinds of failures, changes, and points of a controller in a chart that are shown, at most."""
_SHORE_TOLERANCE = 1.0
"""Details of the shore that are smaller than this are left out [m]."""
_MAX_OBJECT_DISTANCE = 40.0
"""An object that is farther from everything that matters [m] does not widen a map."""
_Box = tuple[float, float, float, float]
_Spot = tuple[float, float]
_Line = Sequence[Sequence[float]]
_Values = dict[str, Any]
_BEST_COLOR, _MIDDLE_COLOR, _WORST_COLOR = (94, 181, 166), (246, 236, 205), (231, 135, 98)
"""Colours of a score among those of its world."""
PAGE = "index.html"
_REFRESH_INTERVAL = 5.0
"""Least time between two writings of the page while trials run [s]."""
_MAX_TIME_SHARE = 0.01
"""Share of the time that writing it may take."""


def map_values(sketch: _Values, results: Sequence[Result], controllers: Sequence[str]) -> _Values:
    """Values for the template of a map: the frame, the land in it, a scale bar, and the tracks of these trials."""
    tracks = [(result, line) for result in results for line in result.tracks.values() if line]
    west, south, east, north = view = _view(sketch, [line for _, line in tracks])
    pixel, length = (east - west) / _MAP_WIDTH, nice_length((east - west) / 4.0)
    x, y = west + 14.0 * pixel, south + 16.0 * pixel
    return {
        "west": west, "north": north, "width": east - west, "height": north - south, "pixel": pixel,
        "land": _land(sketch["shore"], view),
        "bar": [(x, y + 4.0 * pixel), (x, y), (x + length, y), (x + length, y + 4.0 * pixel)],
        "bar_label": (x + length / 2, y + 5.0 * pixel),
        "bar_length": length,
        "tracks": [_track(result, line, controllers) for result, line in tracks],
    }  # fmt: skip


def _track(result: Result, line: _Line, controllers: Sequence[str]) -> _Values:
    """A boat's way; the template ends it with a dot, or a cross where the trial failed."""
    cell, number = result.cell, controllers.index(result.cell.controller)
    points = [*line[: -1 : 1 + len(line) // _MAX_TRACK_POINTS], line[-1]]
    return {
        "controller": cell.controller, "seed": cell.seed, "failed": result.has_failed, "points": points,
        "index": number,
    }  # fmt: skip


def _view(sketch: _Values, tracks: Iterable[_Line]) -> _Box:
    """Frame of a map around the boats, the task, the tracks, and objects not far from these."""
    spots: list[Sequence[float]] = [(boat["x"], boat["y"]) for boat in sketch["boats"]]
    spots += [place[:2] for place in sketch["waypoints"]] + sketch["beacons"]
    spots += [spot for gate in sketch["gates"] for spot in (gate["left"], gate["right"])]
    spots += [spot for bay in sketch["bays"] for spot in bay["corners"]]
    for circle in sketch["circles"]:
        x, y, radius = circle["x"], circle["y"], circle["radius"]
        spots += [(x - radius, y - radius), (x + radius, y + radius)]
    spots += [spot for line in tracks for spot in line]
    things: list[Sequence[float]] = [item["spot"] for item in sketch["objects"]]
    things += [cell for dock in sketch["docks"] for cell in dock["cells"]]
    if not spots:
        return _frame(things or [(0.0, 0.0)])
    center = MultiPoint(spots)
    return _frame([*spots, *(spot for spot in things if center.distance(Point(spot)) < _MAX_OBJECT_DISTANCE)])


def _frame(spots: Sequence[Sequence[float]]) -> _Box:
    """West, south, east and north of a frame of the right shape round these places, with a margin."""
    xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
    width, height = max(1.12 * (max(xs) - min(xs)) + 6.0, 30.0), max(1.12 * (max(ys) - min(ys)) + 6.0, 20.0)
    width, height = max(width, _MAP_ASPECT * height), max(height, width / _MAP_ASPECT)
    x, y = (min(xs) + max(xs)) / 2.0, (min(ys) + max(ys)) / 2.0
    return (x - width / 2, y - height / 2, x + width / 2, y + height / 2)


def _land(rings: Sequence[_Line], view: _Box) -> str:
    """The land inside the frame as the path of an SVG; rings have it on their left."""
    frame = box(*view)
    ordered = sorted(rings, key=lambda ring: -float(Polygon(ring).area))
    land: BaseGeometry = frame if ordered and _clockwise(ordered[0]) else Polygon()
    for ring in ordered:
        inside = Polygon(ring).buffer(0).intersection(frame)
        land = land.difference(inside) if _clockwise(ring) else land.union(inside)
    return "" if land.is_empty else _outline(land.simplify(_SHORE_TOLERANCE))


def _clockwise(ring: _Line) -> bool:
    return not LinearRing(ring).is_ccw


def _outline(shape: BaseGeometry) -> str:
    parts = getattr(shape, "geoms", [shape])
    rings = [ring for part in parts if part.geom_type == "Polygon" for ring in (part.exterior, *part.interiors)]
    return "".join(f"{path(ring.coords)}Z" for ring in rings)


def path(points: Iterable[Sequence[float]]) -> str:
    """Places as the path of an SVG."""
    return "M" + "L".join(f"{point[0]:.1f} {-point[1]:.1f}" for point in points)


def _square(x: float, y: float, half: float, yaw: float) -> list[_Spot]:
    """Corners of a square, whose edges are twice `half`."""
    c, s = half * math.cos(yaw), half * math.sin(yaw)
    return [(x - c + s, y - s - c), (x + c + s, y + s - c), (x + c - s, y + s + c), (x - c - s, y - s + c)]


def _arrow(x: float, y: float, yaw: float, reach: float) -> list[_Spot]:
    """Corners of the head of an arrow round a place."""
    return [_ahead(x, y, yaw + turn, share * reach) for turn, share in ((0.0, 1.0), (2.55, 0.8), (-2.55, 0.8))]


def _ahead(x: float, y: float, yaw: float, distance: float) -> _Spot:
    """The place at a distance in a direction."""
    return x + distance * math.cos(yaw), y + distance * math.sin(yaw)


def _cross(x: float, y: float, reach: float) -> str:
    """Two strokes through a place as the path of an SVG."""
    return path([(x - reach, y - reach), (x + reach, y + reach)]) + path(
        [(x - reach, y + reach), (x + reach, y - reach)]
    )


SHAPES = {"square": _square, "arrow": _arrow, "ahead": _ahead, "cross": _cross}
"""Functions of the template of a map."""


def sketch_of(world: World) -> _Values:
    """Shore, docks, objects, boats at their start, and what the task lays out."""
    scene = map_of(world)
    task = world.parameters.task
    shown = {showing.name: (showing.x, showing.y) for showing in scene.course.showings}
    spots = {item.name: shown.get(item.name, (item.x, item.y)) for item in scene.objects}
    return {
        "name": world.name,
        "description": world.parameters.description,
        "task": None if task is None else {"type": task.type, "name": task.name},
        **ground_of(scene),
        "objects": [
            {"name": item.name, "spot": list(spots[item.name]), "color": object_color(item), "size": item.size}
            for item in scene.objects
        ],
        "boats": [{"name": boat.name, "x": boat.x, "y": boat.y, "yaw": boat.yaw} for boat in scene.boats],
        "waypoints": [list(place) for place in scene.waypoints],
        **_laid_out(scene.course),
    }


def _laid_out(course: Course) -> _Values:
    animals = [(item.x, item.y, item.radius, f"{item.name}: {item.goal}") for item in course.animals]
    beacons = [(item.x, item.y, item.radius, item.name) for item in course.beacons]
    return {
        "gates": [{"left": list(gate.left), "right": list(gate.right), "yaw": gate.yaw} for gate in course.gates],
        "bays": [_bay(bay) for bay in course.bays],
        "paths": [
            to_centimetres([path.start, *path.points, *(path.points[:1] if path.closed else ())])
            for path in course.paths
        ],
        "circles": [_circle(*row) for row in animals + beacons if row[2] > 0.0],
        "beacons": [[item.x, item.y] for item in course.beacons],
    }


def _bay(bay: Bay) -> _Values:
    title = f"{bay.name}: {bay.symbol or 'no symbol'}".replace("_", " ")
    return {"corners": to_centimetres(bay.internal[:, :2]), "allowed": bay.right, "title": title}


def _circle(x: float, y: float, radius: float, title: str) -> _Values:
    return {"x": x, "y": y, "radius": radius, "title": title.replace("_", " ")}


_Row = dict[str, Any]


def page(
    campaign: Campaign, sketches: Mapping[str, _Row], comparison: Comparison | None = None, *, running: bool = False
) -> str:
    """The page as HTML. Names, messages and descriptions are escaped, wherever they come from."""
    plan, results = campaign.manifest.plan, list(campaign.results.values())
    rows = list(_rows(campaign))
    maps = list(_maps(campaign, sketches))
    return (
        _environment()
        .get_template("page.html.j2")
        .render(
            manifest=campaign.manifest,
            plan=plan,
            running=running,
            written=datetime.now(UTC).isoformat(" ", "seconds").removesuffix("+00:00"),
            colors=[hex_color(boat_color(number)) for number in range(len(plan.controllers))],
            total=len(plan.worlds) * len(plan.seeds) * len(plan.controllers),
            counts=mean_of(results),
            done=sum(not result.has_failed for result in results),
            hours=sum(result.sim_time for result in results) / 3600.0,
            tasks=task_types(results),
            board=leaderboard(results, plan.controllers),
            detailed=_is_detailed(campaign),
            rows=rows[:_MAX_CELLS],
            row_count=len(rows),
            maps=maps,
            charts=list(_charts(campaign)),
            seedless=seedless_worlds(results),
            remarkable=remarkable_trials(results),
            failures=failure_classes(results),
            listed=_MAX_LISTED,
            log=LOG,
            comparison=comparison,
        )
    )


def _is_detailed(campaign: Campaign) -> bool:
    """Whether each trial has a cell of its own on the page, and its recording a link."""
    plan = campaign.manifest.plan
    return len(plan.seeds) <= _MAX_SEED_COLUMNS and len(campaign.results) <= _MAX_CELLS


def _rows(campaign: Campaign) -> Iterator[_Row]:
    """Rows of the table of scores: each controller in each world, with its cells by seed where they are few."""
    plan, tasks = campaign.manifest.plan, tasks_of_worlds(campaign.results.values())
    groups = group_by(campaign.results.values(), lambda result: (result.cell.world, result.cell.controller))
    seeds = plan.seeds if _is_detailed(campaign) else ()
    for number, world in enumerate(plan.worlds):
        task = tasks.get(world)
        scores = [
            result.score
            for who in plan.controllers
            for result in groups.get((world, who), ())
            if result.score is not None
        ]
        for index, controller in enumerate(plan.controllers):
            own = groups.get((world, controller), [])
            cells = [_cell(campaign.results.get(Cell(controller, world, seed)), seed, scores, task) for seed in seeds]
            yield {
                "world": world, "number": number, "controller": controller, "index": index, "task": task,
                "mean": mean_of(own), "count": len(own), "cells": cells,
            }  # fmt: skip


def _charts(campaign: Campaign) -> Iterator[Markup]:
    """Scores over each quantity that was varied, a chart for each type of task."""
    plan, results = campaign.manifest.plan, campaign.results.values()
    groups = group_by(results, lambda result: (result.cell.controller, (result.task or {}).get("type")))
    for quantity in plan.vary:
        for kind, task in task_types(results).items():
            found = [dependence(groups.get((who, kind), []), quantity, who) for who in plan.controllers]
            points, curves = [], []
            for color, own in enumerate(found):
                if not own.x:
                    continue
                stride = 1 + len(own.x) // _MAX_LISTED
                rank = "" if math.isnan(own.correlation) else f", rank correlation {own.correlation:+.2f}"
                ends = np.array([mean.interval or (math.nan, math.nan) for mean in own.means])
                points.append(Series("", own.x[::stride], own.scores[::stride], kind="points", color=color))
                curves.append(
                    Series(f"{own.controller}{rank}", own.centers, [mean.mean for mean in own.means], color=color,
                           low=ends[:, 0], high=ends[:, 1])
                )  # fmt: skip
            unit = f"{quantity.name} [{quantity.unit}]" if quantity.unit else quantity.name
            better = f"{task['unit']}, {task['better']} is better"
            yield chart_svg(Chart(kind.replace("_", " "), unit, f"score [{better}]", [*points, *curves]))


def _cell(result: Result | None, seed: int, scores: Sequence[float], task: Mapping[str, str] | None) -> _Row:
    """Text, colour and tooltip of one cell."""
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
        "text": f"{result.score:.4g}{' ✂' if result.state == 'cut' else ''}",
        "value": f"{result.score:.6g}",
        "color": _color(result.score, scores, task["better"]),
        "title": f"seed {seed}: {result.score:.4g} {task['unit']}{_how(result)}",
    }


def _how(result: Result) -> str:
    """How a task ended, in words."""
    task = result.task or {}
    hits = task["num_collisions"]
    collided = f", {hits} collision{'s' if hits != 1 else ''}" if hits else ""
    end = "cut while running" if result.state == "cut" else "finished"
    return f" after {task['elapsed']:.1f} s, {end}{', timed out' if task['timed_out'] else ''}{collided}"


def _color(score: float, scores: Sequence[float], better: str) -> str:
    """Green for the best of a world's scores, red for its worst; nothing where all are about equal."""
    least, most = min(scores), max(scores)
    if most - least <= 1e-3 * max(abs(most), abs(least)):
        return ""
    share = (score - least) / (most - least)
    share = 1.0 - share if better == "higher" else share
    low, high, part = (
        (_BEST_COLOR, _MIDDLE_COLOR, 2.0 * share) if share < 0.5 else (_MIDDLE_COLOR, _WORST_COLOR, 2.0 * share - 1.0)
    )
    return hex_color(round(a + (b - a) * part) for a, b in zip(low, high, strict=True))


def _maps(campaign: Campaign, sketches: Mapping[str, _Row]) -> Iterator[_Row]:
    plan, tasks = campaign.manifest.plan, tasks_of_worlds(campaign.results.values())
    groups, detailed = group_by(campaign.results.values(), lambda result: result.cell.world), _is_detailed(campaign)
    left = _MAX_MAPS_SIZE
    for number, world in enumerate(plan.worlds):
        if world not in sketches or left < 0:
            continue
        found = groups.get(world, [])
        lines = []
        for index, controller in enumerate(plan.controllers):
            own = [result for result in found if result.cell.controller == controller]
            if own:
                recorded = [result for result in own if result.recording and detailed]
                lines.append({"controller": controller, "index": index, "mean": mean_of(own), "recorded": recorded})
        svg = map_svg(world, sketches[world], found, plan.controllers)
        left -= len(svg)
        yield {
            "world": world, "number": number, "task": tasks.get(world), "lines": lines,
            "description": sketches[world]["description"], "svg": svg,
            "tracks": sum(bool(result.tracks) for result in found), "count": len(found),
        }  # fmt: skip


def _with_tracks(campaign: Campaign) -> Campaign:
    """The campaign with the tracks that the maps show: of each world some trials from the best to the worst."""
    most = max(3, min(_MAX_TRACKS, _MAX_MAPS_SIZE // 500 // len(campaign.manifest.plan.worlds)))
    chosen = []
    for own in group_by(campaign.results.values(), lambda result: result.cell.world).values():
        order = sorted(own, key=lambda result: (result.has_failed, result.score or 0.0))
        chosen += [order[k].cell for k in np.linspace(0, len(order) - 1, min(most, len(order)), dtype=int)]
    with ResultStore(campaign.folder) as store:
        tracks = store.tracks(chosen)
    return replace(
        campaign,
        results={
            cell: replace(result, tracks=tracks[cell]) if cell in tracks else result
            for cell, result in campaign.results.items()
        },
    )


def map_svg(world: str, sketch: _Row, results: Sequence[Result], controllers: Sequence[str]) -> Markup:
    """A world from above with the tracks of these trials."""
    values = {"world": world, **map_values(sketch, results, controllers)}
    return Markup(_environment().get_template("map.svg.j2").render(map=values, sketch=sketch))


@cache
def _environment() -> Environment:
    """The templates of the page and of its maps, with what they call."""
    environment = page_environment("campaign")
    environment.filters |= {"number": _number, "path": path, "metres": "{:.1f}".format, "size": "{:.2f}".format,
                            "breakable": _breakable}  # fmt: skip
    environment.globals |= SHAPES
    return environment


def _breakable(name: str) -> Markup:
    """A name that may go on in the next line after each sign."""
    return Markup(re.sub(r"([/_.:])", r"\1<wbr>", str(escape(name))))


def _number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits; a dash for none."""
    return "–" if value is None or math.isnan(value) else f"{value:.{digits}g}"


class LivePage:
    """The page of a campaign in its folder, written again while trials run."""

    def __init__(self, campaign: Campaign, earlier: Campaign | None = None) -> None:
        """`earlier`: a campaign to compare with."""
        self._campaign, self._earlier, self._due = campaign, earlier, 0.0
        self._results = dict(campaign.results)
        self.file = campaign.folder / PAGE

    def refresh(self, *results: Result) -> None:
        """Take results that were stored, and write the page if that is due."""
        self._results |= {each.cell: each.outline() for each in results}
        begun = time.monotonic()
        if begun >= self._due:
            self.write(running=True)
            now = time.monotonic()
            self._due = now + max(_REFRESH_INTERVAL, (now - begun) / _MAX_TIME_SHARE)

    def write(self, *, running: bool = False) -> tuple[Campaign, Comparison | None]:
        """Write the page, and `results.csv` unless trials are running; what it shows."""
        folder, plan = self._campaign.folder, self._campaign.manifest.plan
        now = replace(self._campaign, results=self._results if running else read_results(folder, plan.cells))
        comparison = compare(now, self._earlier) if self._earlier is not None else None
        if not running:
            write_csv(folder / "results.csv", now.results.values())
        write_text(self.file, page(_with_tracks(now), read_sketches(folder, plan.worlds), comparison, running=running))
        return now, comparison
