"""Where the views of a recording look from, and what is written there: wind, waves and current, names in the plan."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import ComplexArray, FloatArray
from vrx_mj.draw.course import Course, course_of
from vrx_mj.draw.style import CURRENT_COLOR, WAVE_COLOR, WIND_COLOR
from vrx_mj.frames import compass
from vrx_mj.recording.record_scene import RecordScene
from vrx_mj.recording.timeline import Deadband, Ticker, arrow_strips, changes, name_points, numbers, static, thin_lines

FLEET, PLANNED, PLAN = "/world/fleet", "/world/fleet/plan", "/world/plan"
"""Entities: in the middle of what the camera follows, what a plan follows there, and one that frames a track."""
PLAN_MARGIN = 8.0
"""Water around the outermost body in the plan [m]."""
_PLAN_REACH = 40.0
"""How far from the outermost boat a body may be and still be fitted into the plan [m]."""
PLAN_SLOPE = 0.5
"""Half the height of what the plan shows, per height of its eye: the viewer's lens."""
PLAN_ASPECT = 1.3
"""Width of the plan's view, in its heights, about."""
PLAN_LINE = 0.09
"""Height of a line of figures at the upper edge of the plan, in heights of the plan."""
TEXT_RATE = 2.0
"""Rate of arrows, figures, and names in the plan [Hz]."""
_ARROW_TEXTS = {
    "wind": (WIND_COLOR, "wind {0:.1f} m/s from {1:.0f} deg"),
    "waves": (WAVE_COLOR, "waves Hs {0:.2g} m, Tp {2:.2g} s from {1:.0f} deg"),
    "current": (CURRENT_COLOR, "current {0:.2g} m/s toward {1:.0f} deg"),
}
"""Colours, and texts of speed or significant height, compass direction and period."""
PLAN_LINES, LETTER_WIDTH = 18.0, 0.62
"""Lines of text as high as the plan in a window of 1280 pixels, and the width of a letter in lines."""
_SEA_LINES = 33.0
"""Lines of text in the sea's view there as high as what is as high as it is away."""
PLATE_HEIGHT = 1.5
"""Height of a name with what a viewer writes it on, in lines."""
_NAME_RISES = PLATE_HEIGHT * np.array([0.0, 1.05, -1.0, 2.05, -2.0])
"""How far a name may be over its place just under the boat, in lines, the best first."""
_HIDDEN_PLACE = 1e4
"""Where a name is that is not shown, in halves of the plan's height."""
TAG_HEIGHT, _TAG_STEP = 2.9, 1.9
"""Height of a boat's name over its origin, and how much higher every other one is: boats may touch [m]."""
_TAG_LIFTS = np.array([[0, 1, 2], [1, 0, 2]])
"""How many times higher names of even and of odd boats may be, the best first."""


def around(distance: float) -> list[list[float]]:
    """Points on either side of a followed entity, from which a viewer looks at it from `distance` [m].

    A viewer that meets the entity in its first picture goes to 1.5 times the length of what the entity holds.
    """
    return [[distance / 3.0, 0.0, 0.0], [-distance / 3.0, 0.0, 0.0]]


def sea_eye(reach: float) -> FloatArray:
    """The way (3,) [m] from what the sea's view follows to its eye; `reach` [m] holds it all, and grows by a third."""
    return (9.0 + 2.0 * reach) * np.array([-0.72, -0.72, 0.42])


def sea_axes() -> FloatArray:
    """Unit vectors (3, 3) to the right, upward and toward the eye in the sea's view."""
    back = sea_eye(0.0) / np.linalg.norm(sea_eye(0.0))
    right = np.cross((0.0, 0.0, 1.0), back) / math.hypot(*back[:2])
    return np.array([right, np.cross(back, right), back])


def plan_eye(scene: RecordScene, track: FloatArray | None = None) -> tuple[FloatArray, float]:
    """Place (2,) [m] and height [m] of the plan's eye: figures of the weather have room over a track."""
    middle, radius = _plan_circle(scene, track)
    half = (radius + PLAN_MARGIN) / (1.0 if track is None else 1.0 - PLAN_LINE * len(scene.weather()))
    return middle + (half - radius - PLAN_MARGIN) * east_and_north(scene)[1], half / PLAN_SLOPE


def east_and_north(scene: RecordScene) -> FloatArray:
    """Unit vectors (2, 2) to the east and to the north, along x and y."""
    x = scene.parameters.x_from_east
    return np.array([[math.cos(x), -math.sin(x)], [math.sin(x), math.cos(x)]])


def _plan_circle(scene: RecordScene, track: FloatArray | None) -> tuple[FloatArray, float]:
    """Middle (2,) and radius [m] of the plan: of the whole track and what it starts from, or around the fleet."""
    middle, reach = fleet_circle(scene)
    places = _plan_places(scene, middle, reach)
    if track is None:
        return middle, max([reach, *(math.dist(place, middle) for place in places)])
    axes = east_and_north(scene)
    places = np.vstack([places, [(x, y) for x in track[:, 0] for y in track[:, 1]]]) @ axes.T
    low, high = places.min(axis=0), places.max(axis=0)
    width, height = high - low
    return (low + high) / 2.0 @ axes, max(10.0, float(height) / 2.0, float(width) / 2.0 / PLAN_ASPECT)


def _plan_places(scene: RecordScene, middle: FloatArray, reach: float) -> FloatArray:
    """Places (n, 2) [m] that the plan holds: the fleet, and all that a task lays out or else what is near."""
    boats = [boat.pose[:2] for boat in scene.boats()]
    if scene.parameters.task:
        laid = [*course_of(scene.parameters).spots(), *(place[:2] for place in scene.parameters.waypoints)]
        return np.reshape([*laid, *boats], (-1, 2))
    others = (body.pose[:2] for body in scene.bodies if body.kind != "ball")
    near = (place for place in others if math.dist(place, middle) < reach + _PLAN_REACH)
    return np.reshape([*boats, *near], (-1, 2))


def followed_circle(scene: RecordScene) -> tuple[FloatArray, float]:
    """Middle (2,) and radius [m] of what is followed when recording starts."""
    own = [boat.pose[:2] for boat in scene.boats() if boat.name == scene.follow]
    return (np.array(own[0]), 0.0) if own else fleet_circle(scene)


def fleet_circle(scene: RecordScene) -> tuple[FloatArray, float]:
    """Middle (2,) and radius [m] of the fleet when recording starts."""
    places = np.array([boat.pose[:2] for boat in scene.boats() or scene.bodies])
    if not len(places):
        return np.zeros(2), 10.0
    middle = places.mean(axis=0)
    return middle, math.sqrt(float(((places - middle) ** 2).sum(axis=1).max()))


class Corner(NamedTuple):
    """Where arrows and figures are in a view; lengths in units of the view."""

    path: str
    axes: FloatArray
    """Unit vectors (2, 3) to the right and upward in the view."""
    arrow: float
    """Middle of the arrows, to the right of the view's middle."""
    text: float
    """Middle of the figures."""
    top: float
    """The first line, over the view's middle."""
    line: float
    """From one line to the next."""
    length: float
    """Length of an arrow."""
    rise: float
    """How far an arrow is over its figures."""

    def spots(self, across: float, count: int) -> FloatArray:
        """Places (count, 3) of lines."""
        return np.column_stack([[across] * count, self.top - self.line * np.arange(count)]) @ self.axes


def _corners_of(scene: RecordScene) -> tuple[Corner, Corner]:
    """Corners of the sea's view, in units of the distance of its eye, and of the plan, in units of half its height."""
    plan = np.hstack([east_and_north(scene), np.zeros((2, 1))])
    return (
        Corner(f"{FLEET}/weather", sea_axes()[:2], -0.56, -0.56, 0.2, 0.11, 0.16, 0.035),
        Corner(f"{PLAN}/weather", plan, -1.18, 0.3, 0.88, 2.0 * PLAN_LINE, 0.2, 0.0),
    )


def _flows(scene: RecordScene, rows: FloatArray) -> dict[str, ComplexArray]:
    """Flows of the weather at (n, columns) rows: speed [m/s] or significant height [m] along x + i y, (n,)."""
    turned = np.exp(1j * rows[:, scene.layout().wind_angle].sum(axis=1))
    found = {"wind": rows[:, 1] * turned * complex(*scene.parameters.wind.direction)}
    if (sea := scene.parameters.sea).waves:
        toward = complex(*sea.direction)
        found["waves"] = np.full(len(rows), sea.significant_height * toward / abs(toward))
    if flow := scene.parameters.current:
        tide = flow.tide_frequency * rows[:, 0] + flow.tide_phase
        turn = np.cos(tide) * complex(*flow.tide_major) + np.sin(tide) * complex(*flow.tide_minor)
        found["current"] = complex(*flow.mean) + turn
    return {name: found[name] for name in scene.weather()}


def _figures(scene: RecordScene, name: str, flow: ComplexArray) -> list[str]:
    """Texts for the values of a flow (n,)."""
    text, turned = _ARROW_TEXTS[name][1], scene.parameters.x_from_east
    bearings = np.round(compass(np.angle(-flow if " from " in text else flow) + turned)) % 360.0
    return [text.format(*pair, scene.parameters.sea.period) for pair in zip(np.abs(flow), bearings, strict=True)]


class WeatherChunks:
    """Turns rows into chunks; it knows what was shown last."""

    def __init__(self) -> None:
        self._ticker = Ticker(TEXT_RATE)
        self._texts: tuple[str, ...] = ()

    def __call__(self, scene: RecordScene, rows: FloatArray) -> Iterator[Chunk]:
        """Chunks of (n, columns) rows, where a figure changes."""
        rows = rows[self._ticker(rows[:, 0])]
        found = _flows(scene, rows)
        texts = list(zip(*(_figures(scene, *item) for item in found.items()), strict=True))
        news = [i for i, line in enumerate(texts) if line != (texts[i - 1] if i else self._texts)]
        if not news:
            return
        if not self._texts:
            yield from _still_weather(scene)
        self._texts = texts[-1]
        toward = np.angle(np.stack(list(found.values()), axis=1)[news])
        along = np.stack([np.cos(toward), np.sin(toward), 0.0 * toward], axis=-1)
        for corner in _corners_of(scene):
            spots = corner.spots(corner.arrow, len(found)) + corner.rise * corner.axes[1]
            vectors = corner.length * along
            begins = (spots - 0.5 * vectors).reshape(-1, 3)
            strips = arrow_strips(begins, vectors.reshape(-1, 3), np.cross(*corner.axes))
            yield numbers(corner.path, rows[news, 0], rr.LineStrips3D, strips=strips)
            yield changes(f"{corner.path}/figures", rows[news, 0], rr.Points3D, labels=[texts[i] for i in news])


def _still_weather(scene: RecordScene) -> Iterator[Chunk]:
    """Colours and places of arrows and figures, and the size of those beside the boats."""
    colors = [_ARROW_TEXTS[name][0] for name in scene.weather()]
    for corner in _corners_of(scene):
        yield static(corner.path, thin_lines(1.8, colors=colors))
        spots = corner.spots(corner.text, len(colors))
        points = name_points(positions=spots)
        yield static(f"{corner.path}/figures", points)
    distance = float(np.linalg.norm(sea_eye(followed_circle(scene)[1])))
    yield static(f"{FLEET}/weather", rr.Transform3D(scale=distance))


Places = tuple[FloatArray, Mapping[str, FloatArray]]
"""Simulated times (n,) [s], and by boat where it was then (n, 2) [m]."""


def plan_chunks(scene: RecordScene, track: FloatArray, parts: Sequence[Places]) -> Iterator[Chunk]:
    """Where the plan is that frames a track (2, 2) [m], and the names in it of boats at places, part after part."""
    middle, height = plan_eye(scene, track)
    yield static(PLAN, rr.Transform3D(translation=(*middle, 0.0), scale=height * PLAN_SLOPE))
    boats = list(dict.fromkeys(boat for _, own in parts for boat in own))
    columns = [[own.get(boat, np.full((len(time), 2), np.nan)) for time, own in parts] for boat in boats]
    time, places = np.concatenate([time for time, _ in parts]), np.stack([*map(np.concatenate, columns)], axis=1)
    spots = np.nan_to_num(name_spots(scene, boats, places, middle, height), nan=_HIDDEN_PLACE)
    taken, spots = Deadband(1.0 / 512.0, within=1.0 / PLAN_LINES / 3.0)(spots)
    points = np.insert(spots[taken], 2, 0.0, axis=2).astype(np.float32)
    yield static(f"{PLAN}/names", name_points(labels=boats))
    yield changes(f"{PLAN}/names", time[taken], rr.Points3D, positions=list(points))


def name_spots(
    scene: RecordScene, boats: Sequence[str], places: FloatArray, middle: FloatArray, height: float
) -> FloatArray:
    """Where names of boats at places (n, boats, 2) [m] are in a plan, in halves of its height along x and y.

    A name is inside of the plan and covers no other one, no figures of the weather and no other boat; where there is no
    such place it is not shown, NaN. `middle` (2,) and `height` [m] are those of the plan's eye.
    """
    axes, line, still, (_, corner) = east_and_north(scene), 2.0 / PLAN_LINES, _still_names(scene), _corners_of(scene)
    texts = [*still, *(_ARROW_TEXTS[name][1] for name in scene.weather())]
    half = line * LETTER_WIDTH * (0.5 * np.array([len(text) for text in (*texts, *boats)]) + 1.0)
    there, known = (
        (each - middle) @ axes.T / (height * PLAN_SLOPE) for each in (places, np.reshape([*still.values()], (-1, 2)))
    )
    known = np.concatenate([known, corner.spots(corner.text, len(scene.weather())) @ corner.axes.T])
    taken = np.concatenate([np.broadcast_to(known, (len(there), *known.shape)), np.full_like(there, np.nan)], axis=1)
    for i in range(len(boats)):
        own = len(texts) + i
        for rise in _NAME_RISES:
            spot = there[:, i] + (0.0, line * rise)
            beside, above = np.moveaxis(np.abs(taken - spot[:, None]), -1, 0)
            covered = (beside < half + half[own]) & (above < PLATE_HEIGHT * line)
            beside, above = np.moveaxis(there - spot[:, None], -1, 0)
            boated = (np.abs(beside) < half[own]) & (above < -0.1 * line) & (above > -PLATE_HEIGHT * line)
            inside = (spot[:, 1] < 1.0) & (spot[:, 1] > PLATE_HEIGHT * line - 1.0)
            free = np.isnan(taken[:, own, 0]) & inside & ~covered.any(axis=1) & ~boated.any(axis=1)
            taken[free, own] = spot[free]
    return taken[:, len(texts) :] @ axes


def tag_heights(scene: RecordScene) -> dict[str, float]:
    """Heights of boats' names over their boats [m], of those alone that cover no other one as the fleet starts."""
    circle, reach = fleet_circle(scene)
    eye, heights = np.array([*circle, 0.0]) + sea_eye(reach), dict[str, float]()
    taken: list[tuple[float, float, float]] = []
    for number, boat in enumerate(scene.boats()):
        half = LETTER_WIDTH * (0.5 * len(boat.name) + 0.5)
        for height in TAG_HEIGHT + _TAG_STEP * _TAG_LIFTS[number % 2]:
            right, up, back = sea_axes() @ (np.add(boat.pose[:3], (0.0, 0.0, height)) - eye)
            x, y = -_SEA_LINES * right / back, -_SEA_LINES * up / back
            if not any(abs(x - u) < half + other and abs(y - v) < PLATE_HEIGHT for u, v, other in taken):
                taken.append((x, y, half))
                heights[boat.name] = float(height)
                break
    return heights


def waypoint_name(index: int) -> str:
    """Name of the waypoint of an index, from 0."""
    return f"waypoint {index + 1}"


def _still_names(scene: RecordScene) -> dict[str, Sequence[float] | FloatArray]:
    """Names in the plan that stay, and their places (2,) [m]."""
    waypoints, course = scene.parameters.waypoints, course_of(scene.parameters) if scene.parameters.task else Course()
    names: dict[str, Sequence[float] | FloatArray] = {waypoint_name(i): place[:2] for i, place in enumerate(waypoints)}
    names |= {beacon.name: (beacon.x, beacon.y) for beacon in course.beacons}
    spots = names_apart([bay.external.mean(axis=0)[:2] for bay in course.bays])
    names |= {f"{bay.name} {bay.symbol}": spot for bay, spot in zip(course.bays, spots, strict=True)}
    return names


def names_apart(spots: Sequence[FloatArray]) -> list[FloatArray]:
    """Places of bays' names, further from each other than their bays are: these are narrower than a line is high."""
    middle = np.mean(spots, axis=0) if spots else 0.0
    return [middle + 1.5 * (spot - middle) for spot in spots]
