"""The page of a campaign: one static file that needs no network. Layout is in `templates/campaign`.

Maps of a campaign's page: what is in a world, and the numbers of the template that draws it with all tracks.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment
from markupsafe import Markup
from shapely import LinearRing, MultiPoint, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from vrx_mj.campaign.manifest import Campaign
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import LOG, Result, read_results, read_sketches, write_csv, write_text
from vrx_mj.campaign.scores import Comparison, leaderboard, mean_of, seedless_worlds, task_types, tasks_of_worlds
from vrx_mj.draw.chart import page_environment
from vrx_mj.draw.course import Bay, Course, ground_of, map_of, nice_length, object_color, rounded
from vrx_mj.draw.style import boat_color, hex_color
from vrx_mj.mjcf.world import World

_SHAPE = 1.5
"""Width by height of a map."""
_PIXELS = 720.0
"""Width of a map when it is shown large [px]: sizes that must stay visible go by it."""
_MOST_POINTS = 1500
"""Points of all tracks of a map together, at most."""
_BEND = 1.0
"""Details of the shore that are smaller than this are left out [m]."""
_NEAR = 40.0
"""An object that is farther from everything that matters [m] does not widen a map."""
_Box = tuple[float, float, float, float]
_Spot = tuple[float, float]
_Line = Sequence[Sequence[float]]
_Values = dict[str, Any]


def map_values(sketch: _Values, results: Sequence[Result], controllers: Sequence[str]) -> _Values:
    """What the template of a map takes: the frame, the land in it, a scale bar, and the tracks of these trials."""
    tracks = [(result, line) for result in results for line in result.tracks.values() if line]
    west, south, east, north = view = _view(sketch, [line for _, line in tracks])
    pixel, stride = (east - west) / _PIXELS, 1 + sum(len(line) for _, line in tracks) // _MOST_POINTS
    length = nice_length((east - west) / 4.0)
    x, y = west + 14.0 * pixel, south + 16.0 * pixel
    return {
        "west": west, "north": north, "width": east - west, "height": north - south, "pixel": pixel,
        "land": _land(sketch["shore"], view),
        "bar": [(x, y + 4.0 * pixel), (x, y), (x + length, y), (x + length, y + 4.0 * pixel)],
        "bar_label": (x + length / 2, y + 5.0 * pixel),
        "bar_length": length,
        "tracks": [_track(result, line, stride, controllers) for result, line in tracks],
    }  # fmt: skip


def _track(result: Result, line: _Line, stride: int, controllers: Sequence[str]) -> _Values:
    """A boat's way; the template ends it with a dot, or a cross where the trial failed."""
    cell, number = result.cell, controllers.index(result.cell.controller)
    points = [*line[:-1:stride], line[-1]]
    return {
        "controller": cell.controller, "seed": cell.seed, "failed": result.has_failed, "points": points,
        "index": number,
    }  # fmt: skip


def _view(sketch: _Values, tracks: Iterable[_Line]) -> _Box:
    """What matters: the boats, the task, where they went, and objects not far from these."""
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
    return _frame([*spots, *(spot for spot in things if center.distance(Point(spot)) < _NEAR)])


def _frame(spots: Sequence[Sequence[float]]) -> _Box:
    """West, south, east and north of a frame of the right shape round these places, with a margin."""
    xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
    width, height = max(1.12 * (max(xs) - min(xs)) + 6.0, 30.0), max(1.12 * (max(ys) - min(ys)) + 6.0, 20.0)
    width, height = max(width, _SHAPE * height), max(height, width / _SHAPE)
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
    return "" if land.is_empty else _outline(land.simplify(_BEND))


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
            rounded([path.start, *path.points, *(path.points[:1] if path.closed else ())]) for path in course.paths
        ],
        "circles": [_circle(*row) for row in animals + beacons if row[2] > 0.0],
        "beacons": [[item.x, item.y] for item in course.beacons],
    }


def _bay(bay: Bay) -> _Values:
    title = f"{bay.name}: {bay.symbol or 'no symbol'}".replace("_", " ")
    return {"corners": rounded(bay.internal[:, :2]), "allowed": bay.right, "title": title}


def _circle(x: float, y: float, radius: float, title: str) -> _Values:
    return {"x": x, "y": y, "radius": radius, "title": title.replace("_", " ")}


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
        "text": f"{result.score:.4g}{' ✂' if result.state == 'cut' else ''}",
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
