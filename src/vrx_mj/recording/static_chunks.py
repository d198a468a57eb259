"""What does not change with time, as static rerun chunks: the run, looks, shore, waypoints, series."""

import json
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import rerun as rr
from rerun.archetypes import RecordingInfo
from rerun.chunk import Chunk

from vrx_mj.draw.style import WIND_COLOR, Rgb, shade
from vrx_mj.recording import eyes
from vrx_mj.recording.record_scene import RecordedBody, RecordScene, Surface
from vrx_mj.recording.timeline import arrow_strips, chunk_at, name_points, static, thin_lines
from vrx_mj.recording.water_chunks import wake_looks, wake_path

WAYPOINT_COLOR = (247, 62, 193)
SHORE_COLOR = (157, 140, 103)
UNSEEN_COLOR = (30, 70, 94, 0)
"""Colour of points of no size, which are specks all the same: that of water."""
PLOTTED = ("speed", "heading", "course", "yaw", "roll", "pitch")
"""Plotted quantities of the motion of boats."""
_WHITE = (1.0, 1.0, 1.0, 1.0)
_DOT_RADIUS = [rr.Radius.ui_points(4.0)]
"""Radius of dots in the colours of boats."""
_BALL_COLOR = (40, 90, 255)
LEGEND_PATH, NAMES, FEW_NAMES = "/boats", 7, 28
"""The entity of the boats' names, how many of them are in a line, and how many are few."""
_SHORT_NAME = 6
"""Number of characters of a name when all names are short."""
_SHORE_HEIGHT = 0.15
"""Height of the shoreline [m], so that the sea does not hide it."""
THRUST_COLOR = (252, 83, 47)
_GONE_PLACE = (0.0, 0.0, -1e4)
"""Where the frames of cameras go with a boat that leaves [m]: a camera without one is a mistake to the viewer."""


def still_chunks(scene: RecordScene) -> Iterator[Chunk]:
    """Static chunks at the beginning of a recording."""
    yield from _run_chunks(scene)
    yield static("/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    yield from _coming_chunks(scene)
    distances = math.hypot(*eyes.sea_eye(eyes.fleet_circle(scene)[1])), eyes.plan_eye(scene)[1]
    for path, distance in zip((eyes.FLEET, eyes.PLANNED), distances, strict=True):  # what the views follow
        yield static(path, rr.Points3D(eyes.around(distance), colors=[UNSEEN_COLOR], radii=[0.0]))
    yield _legend_chunk(scene)
    yield from _place_chunks(scene)
    yield from _named_series(scene, [boat.name for boat in scene.boats()], scene.layout().thrusters)
    if "wind" in scene.weather():
        yield static("/plots/wind", rr.SeriesLines(names=["wind"], colors=[WIND_COLOR], widths=1.5))


def _run_chunks(scene: RecordScene) -> Iterator[Chunk]:
    """The run, for people, as properties."""
    title = " + ".join(str(scene.properties[key]) for key in ("world", "fleet") if scene.properties.get(key))
    yield Chunk.from_property("RecordingInfo", RecordingInfo(name=title or "vrx_mj"))
    run = {key: one if isinstance(one, str | int | float) else json.dumps(one) for key, one in scene.properties.items()}
    yield Chunk.from_property("run", rr.AnyValues(**run))


def looks_chunks(
    path: str, place: Sequence[float] | None, surfaces: Sequence[Surface], begun: float | None
) -> Iterator[Chunk]:
    """The looks of an entity from a time on [s], None: always; and its place, a position and a quaternion, if fixed."""
    if place is not None:
        turn = rr.Quaternion(xyzw=[*place[4:], place[3]])
        yield chunk_at(begun, path, rr.Transform3D(translation=place[:3], quaternion=turn))
    if surfaces:
        yield chunk_at(begun, f"{path}/shape", _mesh(tuple(_paving(path, surfaces))))


def _paving(path: str, surfaces: Sequence[Surface]) -> Iterator[Surface]:
    """Surfaces of a body; of a dock every second cube is darker, so that its top is not blank."""
    if "/docks/" not in path:
        yield from surfaces
        return
    for part in surfaces:
        size, middle = np.ptp(part.vertices, axis=0)[:2].max(), part.vertices.mean(axis=0)
        odd = int(np.round(middle[:2] / size).sum()) % 2
        yield replace(part, rgba=(*(0.84 * share for share in part.rgba[:3]), part.rgba[3])) if odd else part


@lru_cache(maxsize=16)
def _mesh(parts: tuple[Surface, ...]) -> rr.Mesh3D:
    """One mesh of several surfaces, which boats and objects of a kind share: colours go to the vertices."""
    colors = np.round(np.clip([part.rgba for part in parts], 0.0, 1.0) * 255.0).astype(np.uint8)
    start = np.cumsum([0] + [len(part.vertices) for part in parts])
    return rr.Mesh3D(
        vertex_positions=np.concatenate([part.vertices for part in parts]),
        triangle_indices=np.concatenate([part.faces + first for part, first in zip(parts, start, strict=False)]),
        vertex_normals=np.concatenate([part.normals for part in parts]),
        vertex_colors=np.repeat(colors, [len(part.vertices) for part in parts], axis=0),
    )


def name_width(boats: int) -> float:
    """Width of a short name in the legend, in heights of its line: the lines of many are lower."""
    return 2.5 if boats <= FEW_NAMES else 3.4


def legend_spots(names: Collection[str]) -> list[tuple[float, int]]:
    """Where each name is in the legend, and in which line; long names take the place of several."""
    unit, x, line = name_width(len(names)), 0.0, 0
    spots: list[tuple[float, int]] = []
    for name in names:
        width = unit * max(1.0, len(name) / _SHORT_NAME)
        if x > 0.0 and x + width > NAMES * unit:
            x, line = 0.0, line + 1
        spots.append((x + 0.5 * (width - unit), line))
        x += width
    return spots


def _legend_chunk(scene: RecordScene) -> Chunk:
    """The names of all boats in their colours, as a picture."""
    colors = scene.colors()
    looks = {"labels": [*colors], "colors": [*colors.values()], "radii": _DOT_RADIUS, "show_labels": True}
    return static(LEGEND_PATH, rr.Points2D(legend_spots(colors), **looks))


def _place_chunks(scene: RecordScene) -> Iterator[Chunk]:
    """Shore and waypoints, with arrows of 4 m in the headings that are wanted there."""
    if scene.parameters.shoreline:
        strips = [np.insert([*ring, ring[0]], 2, _SHORE_HEIGHT, axis=1) for ring in scene.parameters.shoreline]
        yield static("/world/shore", thin_lines(1.0, strips=strips, colors=[SHORE_COLOR]))
    if scene.parameters.waypoints:
        x, y, yaw = np.array(scene.parameters.waypoints).T
        spots, labels = np.column_stack([x, y, 0.0 * x]), [eyes.waypoint_name(i) for i in range(len(x))]
        yield static("/world/waypoints", rr.Points3D(spots, colors=[WAYPOINT_COLOR], radii=[0.6]))
        yield static("/world/waypoints/names", name_points(positions=spots, labels=labels))
        vectors = 4.0 * np.column_stack([np.cos(yaw), np.sin(yaw), 0.0 * x])
        arrows = rr.LineStrips3D(arrow_strips(spots, vectors), colors=[WAYPOINT_COLOR], radii=[0.15])
        yield static("/world/waypoints/headings", arrows)


def _named_series(
    scene: RecordScene, boats: Sequence[str], thrusters: Sequence[tuple[str, str]], own: str = ""
) -> Iterator[Chunk]:
    """Names and colours of series of boats and (boat, thruster), in the plots' entities or in `own` ones under them."""
    colors = scene.colors()
    if boats:
        for quantity in PLOTTED:
            labels = boats if quantity in ("speed", "heading") else [f"{boat} {quantity}" for boat in boats]
            lines = rr.SeriesLines(names=labels, colors=[colors[boat] for boat in boats], widths=1.5)
            yield static(f"/plots/{quantity}{own}", lines)
    if thrusters:
        labels, shades = [" ".join(pair) for pair in thrusters], series_shades([colors[boat] for boat, _ in thrusters])
        for quantity in ("thrust", "steering"):
            yield static(f"/plots/{quantity}{own}", rr.SeriesLines(names=labels, colors=shades, widths=1.5))


def series_shades(colors: Sequence[Rgb]) -> list[Rgb]:
    """Shades of the series of one boat, each another."""
    tones = [(0.27, 0.12, 0.18)[colors[:number].count(rgb) % 3] for number, rgb in enumerate(colors)]
    return [shade([share / 255.0 for share in rgb], tone) for rgb, tone in zip(colors, tones, strict=True)]


def change_chunks(scene: RecordScene, before: RecordScene, first: RecordScene) -> Iterator[Chunk]:
    """Chunks of boats and objects that have joined since the scene before, and the ends of those that have left."""
    kept = {body.path for body in scene.bodies}
    for body in (body for body in before.bodies if body.path not in kept):
        yield chunk_at(scene.begun, body.path, rr.Clear(recursive=True))
        if body.kind != "ball":
            yield chunk_at(scene.begun, body.path, rr.Transform3D(translation=_GONE_PLACE))
    known = {body.path for body in before.bodies} | {part.path for part in before.parts}
    known |= {one.display.name for one in before.displays}
    yield from _coming_chunks(scene, known)
    for boat in (boat for boat in scene.boats() if boat.path not in known):
        own = [boat.name] if boat.name not in {one.name for one in first.boats()} else []
        mine = [engine for engine in scene.layout().thrusters if engine[0] == boat.name]
        new = [engine for engine in mine if engine not in first.layout().thrusters]
        yield from _named_series(scene, own, new, f"/{boat.name}")
        yield _legend_chunk(scene)


def _coming_chunks(scene: RecordScene, known: Collection[str] = ()) -> Iterator[Chunk]:
    """Looks of a scene's bodies, parts and displays but for known ones, by their paths, of displays by their names."""
    heights = eyes.tag_heights(scene)
    for body in (body for body in scene.bodies if body.path not in known):
        if body.kind == "boat":
            yield from _joining_chunks(body, scene, heights.get(body.name, eyes.TAG_HEIGHT))
        elif body.kind == "ball":
            yield static(body.path, rr.Points3D.from_fields(colors=[_BALL_COLOR], radii=_DOT_RADIUS))
        else:
            still = None if body.free else body.pose  # rows move the others
            yield from looks_chunks(body.path, still, body.surfaces, scene.begun)
    for part in (part for part in scene.parts if part.path not in known):
        yield from looks_chunks(part.path, None if part.joints else part.pose, part.surfaces, scene.begun)
    for one in (one for one in scene.displays if one.display.name not in known):
        for name, surfaces in one.surfaces.items():  # their colours come with the rows
            if surfaces:
                white = tuple(replace(surface, rgba=_WHITE) for surface in surfaces)
                yield chunk_at(scene.begun, one.part_path(name), _mesh(white))


def _joining_chunks(boat: RecordedBody, scene: RecordScene, height: float) -> Iterator[Chunk]:
    """A boat, its name `height` [m] over it and its engines in its frame; its first pose until rows move it."""
    begun, rgb = scene.begun, scene.colors()[boat.name]
    yield from looks_chunks(boat.path, None if begun is None else boat.pose, boat.surfaces, begun)
    for thruster in scene.thrusters:
        if thruster.boat == boat.name and thruster.surfaces:
            yield chunk_at(begun, f"{boat.path}/{thruster.name}/shape", _mesh(thruster.surfaces))
    spots = [[0.0, 0.0, eyes.TAG_HEIGHT], *eyes.around(math.hypot(*eyes.sea_eye(0.0)))]
    dots = rr.Points3D(spots, colors=[rgb, UNSEEN_COLOR, UNSEEN_COLOR], radii=[*_DOT_RADIUS, 0.0, 0.0])
    yield chunk_at(begun, f"{boat.path}/label", dots)
    name = name_points(positions=[(0.0, 0.0, height)], labels=[boat.name])
    yield chunk_at(begun, f"{boat.path}/label/name", name)
    yield static(f"/world/trails/{boat.name}", thin_lines(1.2))
    if scene.sea_height is not None:
        yield static(wake_path(boat.name), wake_looks())
    yield static(f"{boat.path}/thrust", rr.LineStrips3D.from_fields(colors=[THRUST_COLOR], radii=[0.12]))
