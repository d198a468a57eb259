"""Pictures of boats from above, from the side and from astern: a verdict on its parts, and a hull that floats."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from vrx_mj.arrays import FloatArray
from vrx_mj.config.shapes import normals_of
from vrx_mj.draw.map import FORMATS
from vrx_mj.draw.style import INK, Thing, font_warnings_hidden, label, write
from vrx_mj.errors import VrxError
from vrx_mj.formats.parts.compliance import Box, PartVerdict, Verdict
from vrx_mj.formats.parts.read import Kind, triple_of
from vrx_mj.packages import root

_SIZE = (1600, 1000)
"""Width and height [px]."""
DPI = 100
GOOD_COLOR, BAD_COLOR = "#2a8f3c", "#c8242b"
"""Colours of parts in their places, and of others."""
_BOX = {"components": "#2f6db5", "thrusters": "#8a5a00"}
_SOFT = "#5b6b76"
_COLUMNS, _ROWS = 95, 40
"""Letters in a line of the list, and its lines at most."""
_FEW_PARTS = 20
"""Up to this number all parts have their names beside them; of more parts, those that fit."""
BOAT = (np.array([-3.0, -1.7, -0.85]), np.array([2.8, 1.7, 2.45]))
"""Corners [m] of the box that is always shown: the WAM-V with its engines and its boxes."""
REACH = 3.0
"""How far beyond that the picture grows for parts; any that is farther is drawn at its edge [m]."""
_HULL = (
    ("hulls", 0.88, (0.0, 0.0, 0.0)),
    ("trim", 0.74, (0.0, 0.0, 0.0)),
    ("arches", 0.68, (0.0, 0.0, 0.0)),
    ("deck", 0.80, (0.0, 0.0, 0.0)),
    ("battery", 0.72, (0.0, 1.0, 0.45)),
    ("battery", 0.72, (0.0, -1.0, 0.45)),
)
_ENGINE = (("engine", 0.62, (0.0, 0.0, 0.0)), ("propeller", 0.55, (-0.278156, 0.0, -0.509371)))
"""Meshes, how light they are drawn (1 for white), and where they are in base_link or in the engine's frame [m]."""


_Shaded = Sequence[tuple[FloatArray, float]]
"""Triangles (n, 3, 3) [m] of a part, and how light it is, 0 to 1."""


@dataclass(frozen=True)
class View:
    """A way to look at the boat: which axes go right and up, and from where."""

    title: str
    right: int
    up: int
    depth: int
    side: float
    """+1 for a viewer at the positive end of the third axis, -1 for one at the other."""
    flip: bool = False
    """Whether the axis that goes right points left: y, seen from ahead, does not; from astern it does."""


TOP = View("from above", 0, 1, 2, 1.0)
SIDE = View("from starboard", 0, 2, 1, -1.0)
ASTERN = View("from astern", 1, 2, 0, -1.0, flip=True)


def draw_verdict(verdict: Verdict, path: str | Path) -> None:
    """Draw boxes and parts as PNG, PDF or SVG, by the path's suffix. A PNG is the same bytes every time.

    Raises:
        VrxError: the suffix is another one.
    """
    file = Path(path)
    if file.suffix.lower() not in FORMATS:
        raise VrxError(f"invalid file name '{file.name}' for a picture: it must end in {', '.join(FORMATS)}")
    with font_warnings_hidden():
        _figure(verdict).savefig(file, metadata=FORMATS[file.suffix.lower()])


def _figure(verdict: Verdict) -> Figure:
    """The views on one scale, side under top and front beside it, and the list of parts in the corner."""
    figure = Figure(figsize=(_SIZE[0] / DPI, _SIZE[1] / DPI), dpi=DPI, facecolor="white")
    low, high = _extent(verdict)
    across, wide, tall = high - low
    left, gap, bottom, head = 70.0, 80.0, 60.0, 90.0  # [px]
    scale = min(
        (_SIZE[0] - left - gap - 40.0) / (across + wide),
        (_SIZE[1] - bottom - gap - head) / (wide + tall),
        (_SIZE[0] - left - 620.0) / across,
    )
    above = bottom + tall * scale + gap
    triangles = [(_mesh(name) + place, light) for name, light, place in _HULL]
    triangles += _engines(verdict)
    spots = ((TOP, left, above), (SIDE, left, bottom), (ASTERN, left + across * scale + gap, bottom))
    for view, x, y in spots:
        size = (high - low)[[view.right, view.up]] * scale
        axes = figure.add_axes((x / _SIZE[0], y / _SIZE[1], size[0] / _SIZE[0], size[1] / _SIZE[1]))
        _draw(axes, view, (low, high), verdict, triangles)
    word = "compliant" if verdict.compliant else "not compliant"
    title = f"{word} by the rules of {verdict.rules.description}"
    write(figure, left / _SIZE[0], 1.0 - 48.0 / _SIZE[1], title, size=17, weight="bold", va="bottom")
    corner = left + across * scale + 40.0
    _list(
        figure.add_axes((corner / _SIZE[0], above / _SIZE[1], 1.0 - corner / _SIZE[0], wide * scale / _SIZE[1])),
        verdict,
    )

    return figure


def _extent(verdict: Verdict) -> tuple[FloatArray, FloatArray]:
    """Least and greatest x, y, z of the picture [m]."""
    points = [part.point for part in verdict.parts if part.point]
    points += [part.legal.point for part in verdict.parts if part.legal]
    low, high = (bound.copy() for bound in BOAT)
    if points:
        low = np.minimum(low, np.maximum(np.min(points, axis=0) - 0.3, low - REACH))
        high = np.maximum(high, np.minimum(np.max(points, axis=0) + 0.3, high + REACH))
    return low, high


def _engines(verdict: Verdict) -> Iterator[tuple[FloatArray, float]]:
    """Triangles of the engines where they are mounted."""
    from trimesh.transformations import euler_matrix

    for part in verdict.parts:
        if part.kind != "thrusters" or part.point is None:
            continue
        turn = euler_matrix(*triple_of(str(part.instance.parameters.get("orientation", "0 0 0"))))[:3, :3]
        for name, light, place in _ENGINE:
            yield (_mesh(name) + place) @ turn.T + np.asarray(part.point), light


def _mesh(name: str) -> FloatArray:
    """Triangles (n, 3, 3) of one of the WAM-V's meshes [m]."""
    import trimesh

    file = root() / "assets" / "robots" / "wamv" / "meshes" / f"{name}.obj"
    return np.asarray(trimesh.load_mesh(file, process=False).triangles, dtype=np.float64)


def _draw(axes: Axes, view: View, bounds: tuple[FloatArray, FloatArray], verdict: Verdict, boat: _Shaded) -> None:
    low, high = bounds
    names = "x forward [m]", "y to port [m]", "z up [m]"
    axes.set_xlim(*(bound[view.right] for bound in ((high, low) if view.flip else (low, high))))
    axes.set_ylim(low[view.up], high[view.up])
    axes.set_xlabel(names[view.right], fontsize=9, color=_SOFT)
    axes.set_ylabel(names[view.up], fontsize=9, color=_SOFT)
    axes.set_title(view.title, fontsize=10, color=_SOFT, loc="left")
    axes.tick_params(labelsize=8, colors=_SOFT, length=3)
    axes.grid(color="#8fa8b4", linewidth=0.5, alpha=0.35)
    axes.set_axisbelow(True)
    draw_surfaces(axes, view, boat)
    kinds: tuple[Kind, ...] = ("components", "thrusters")
    for kind in kinds:
        _boxes(axes, view, verdict.rules.of(kind).boxes, kind)
    _parts(axes, view, bounds, verdict.parts)


def draw_surfaces(axes: Axes, view: View, boat: _Shaded) -> None:
    """The boat's triangles, the nearest last, each lighter the more it faces the viewer."""
    triangles = np.concatenate([triangles for triangles, _ in boat])
    light = np.concatenate([np.full(len(triangles), light) for triangles, light in boat])
    normal = normals_of(triangles)
    facing = view.side * normal[:, view.depth] / np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    light = np.clip(light + 0.12 * facing, 0.0, 1.0)
    order = np.argsort(view.side * triangles[:, :, view.depth].mean(axis=1), kind="stable")
    order = order[facing[order] > 0.0]
    color = np.repeat(light[order, None], 3, axis=1)
    flat = triangles[order][:, :, [view.right, view.up]]
    axes.add_collection(
        PolyCollection(list(flat), facecolor=color, edgecolor=color, linewidth=0.3, zorder=1, rasterized=True)
    )


def _boxes(axes: Axes, view: View, boxes: Sequence[Box], kind: Kind) -> None:
    """Rectangles, those that look the same as one; names at the top, those for thrusters at the bottom."""
    across, up = view.right, view.up
    groups: dict[tuple[float, float, float, float], list[Box]] = {}
    for box in boxes:
        edges = (box.low[across], box.low[up], box.high[across], box.high[up])
        groups.setdefault(edges, []).append(box)
    color, below = _BOX[kind], kind == "thrusters"
    for (left, low, right, high), same in groups.items():
        for face, alpha in ((True, 0.10), (False, 1.0)):
            frame = Rectangle((left, low), right - left, high - low, color=color, fill=face, alpha=alpha)
            frame.set(linewidth=1.2, zorder=2)
            axes.add_patch(frame)
        x = right - 0.03 if view.flip else left + 0.03
        y, align = (low + 0.03, "bottom") if below else (high - 0.03, "top")
        rooms = ("" if box.capacity is None else f" (room for {box.capacity})" for box in same)
        names = "\n".join(_short(box) + room for box, room in zip(same, rooms, strict=True))
        write(axes, x, y, names, size=7, color=color, va=align, linespacing=1.1, zorder=3)


def _short(box: Box) -> str:
    return box.name.split("_compliance_")[-1]


def _parts(axes: Axes, view: View, bounds: tuple[FloatArray, FloatArray], parts: Sequence[PartVerdict]) -> None:
    """Parts as numbered dots, with a line from each outside its boxes to where it may go."""
    pixel = (bounds[1] - bounds[0])[view.right] / axes.get_window_extent().width  # [m]
    groups: dict[tuple[int, int], list[str]] = {}
    spots: dict[tuple[int, int], tuple[float, float]] = {}
    for number, part in enumerate(parts, start=1):
        if part.point is None:
            continue
        x, y = np.clip(part.point, *bounds)[[view.right, view.up]]
        if part.legal is not None:
            there = np.array(part.legal.point)[[view.right, view.up]]
            axes.plot([x, there[0]], [y, there[1]], color=BAD_COLOR, linewidth=1.2, linestyle=(0, (3, 2)), zorder=4)
            axes.plot(*there, marker="o", markersize=7, markerfacecolor="none", markeredgecolor=BAD_COLOR, zorder=4)
        inside = part.box is not None
        marker, size, color = ("o", 6, GOOD_COLOR) if inside else ("X", 8, BAD_COLOR)
        axes.plot(x, y, marker=marker, markersize=size, color=color, mec="white", mew=0.6, zorder=5)
        cell = (round(x / (5.0 * pixel)), round(y / (5.0 * pixel)))
        groups.setdefault(cell, []).append(str(number))
        spots.setdefault(cell, (float(x), float(y)))
    few = len(parts) <= _FEW_PARTS
    things = [Thing(",".join(names), *spots[cell], 5.0 * pixel, must=few) for cell, names in groups.items()]
    label(axes, things, pixel)


def _list(axes: Axes, verdict: Verdict) -> None:
    """The parts by number and name, and what each comes to."""
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    lines = list(_lines(verdict))
    if len(lines) > _ROWS:
        lines = [*lines[: _ROWS - 1], (f"... and {len(lines) - _ROWS + 1} more lines", INK)]
    step = min(0.058, 1.0 / len(lines))
    for row, (text, color) in enumerate(lines):
        size = 9.5 if step > 0.04 else 8.0 if step > 0.025 else 6.0
        write(axes, 0.02, 1.0 - (row + 0.5) * step, text, size=size, color=color, va="center")


def _lines(verdict: Verdict) -> Iterator[tuple[str, str]]:
    for number, part in enumerate(verdict.parts, start=1):
        where = f", in {_short(part.box)}" if part.box else "" if part.point else ", needs no box"
        yield f"{number}  {part.name}  ({part.instance.type}{where})", GOOD_COLOR if part.compliant else BAD_COLOR
        for breach in part.breaches:
            yield from ((f"      {line}", BAD_COLOR) for line in textwrap.wrap(breach.message, _COLUMNS))
    if not verdict.parts:
        yield "no parts", INK
    yield "", INK
    yield "dots: inside a box; crosses: outside every box; circles: the nearest legal place", _SOFT


def draw_hull(corners: FloatArray, center: Sequence[float], engines: Sequence[Sequence[float]], path: Path) -> None:
    """Draw triangles (n, 3, 3) [m] whose water is at z = 0, with the centre of mass and engines [m], as PNG."""
    figure = Figure(figsize=(15, 5), dpi=DPI, layout="constrained")
    figure.suptitle("cross: centre of mass; dots: engines; blue: waterline", y=0.02, va="bottom", fontsize=10)
    for axes, view in zip(figure.subplots(1, 3), (TOP, SIDE, ASTERN), strict=True):
        draw_surfaces(axes, view, [(corners, 0.8)])
        axes.plot(*np.take(center, [view.right, view.up]), "+", color="#c8242b", markersize=12)
        axes.plot(*np.take(engines, [view.right, view.up], axis=1).T, "o", color="#16181c", markersize=5)
        if view.up == 2:
            axes.axhline(0.0, color="#2f6db5", linewidth=1.0)
        axes.set(aspect="equal", title=f"{view.title} [m]")
        axes.xaxis.set_inverted(view.flip)
    with font_warnings_hidden():
        figure.savefig(path, metadata={"Software": None})
