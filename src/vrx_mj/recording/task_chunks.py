"""A task in a recording: its gates, bays, circles, paths and beacons, then colours, score, touches and words.

What moves with something hangs on its entity: zones on their dock, circles on their animals.

A second referee looks at the frames as they are written. It sees what the first one saw, so that it comes to the same.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise
from typing import Any

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import FloatArray
from vrx_mj.config.docks import RGB
from vrx_mj.draw.course import Course, course_of, poses_of, zone_corners
from vrx_mj.draw.style import Rgb, shade
from vrx_mj.model import tasks
from vrx_mj.model.tasks import parts_of
from vrx_mj.model.world import Parameters
from vrx_mj.recording.checks import restore_referee
from vrx_mj.recording.eyes import names_apart
from vrx_mj.recording.packing import pack_rows
from vrx_mj.recording.parts import FRAMES
from vrx_mj.recording.reader import RecordedFrame, SavedState
from vrx_mj.recording.timeline import arrow_strips, changes, name_points, numbers, static, thin_lines, times
from vrx_mj.runtime.subscriptions import Touch
from vrx_mj.tasks import TASK_KINDS, make_referee
from vrx_mj.tasks.courses import gate_between
from vrx_mj.tasks.referee import Frame, FrameLayout, Pose, Referee, has_started, score_text

_LIFT = 0.35
"""Height over the mean water of what is drawn [m], so that few waves hide it."""
FATES: Mapping[str, Rgb] = {
    "next": (167, 140, 39),
    "ahead": (96, 148, 190),
    "crossed": (49, 162, 79),
    "missed": (98, 98, 106),
    "backwards": (255, 70, 60),
}
"""Colours of gates by what became of them; `next` is the first that is ahead."""
RIGHT, WRONG, INSIDE, DOCKED = (49, 162, 79), (134, 143, 152), (167, 140, 39), (57, 143, 243)
"""Colours of bays: to dock in, others, with the boat in it, docked in."""
STATUS: Mapping[str, Rgb] = {
    "never_engaged": (96, 148, 190),
    "engaged": (167, 140, 39),
    "not_engaged": (136, 143, 150),
    "circumnavigated": (49, 162, 79),
}
"""Colours of circles by what the boat does with the animal."""
LOST: Rgb = (130, 90, 90)
"""Colour of the circle of an animal to keep away from, once the boat did not."""
AVOID, PATH, BEACON, _SHOWING = (255, 70, 60), (146, 129, 220), (247, 62, 193), (136, 143, 150)
_GATES = "/world/course/gates"
_ARROW_SHARE = 0.35
"""Length of a gate's arrow, as a share of the gate's width."""
_CORNERS = 48
"""Number of corners of a drawn circle."""
STEPS = "/timeline"
"""Phases, scores and touches as states."""
PLOT = "/plots/task"
"""Score and collisions."""
WORDS = "/task"
"""The entity of the task's status in words."""
_PLOT_EVERY, _WORDS_EVERY, _DRIFT_EVERY = 0.5, 1.0, 5.0
"""Least time between two points of the plot, two texts, and two places of gates whose buoys drift [s]."""
_MIN_DRIFT = 0.5
"""Least drift of a buoy for which its gate is drawn again [m]."""
SCORE_COLOR, HITS_COLOR = (167, 140, 39), (252, 83, 47)
_GATE_SIGNS = {"ahead": "·", "crossed": "✓", "missed": "–", "backwards": "✗"}
"""Signs of gates in the text, by what became of them."""
MARKS_PATH = "/marks"
"""Entity of the marks."""
MARK_KINDS: Mapping[str, tuple[tuple[int, int, int], str]] = {
    "contacts": ((255, 70, 60), "cross"),
    "gates passed": ((49, 162, 79), "up"),
    "gates missed": ((98, 98, 106), "down"),
    "score changes": ((167, 140, 39), "diamond"),
}
"""Colour and marker shape of each kind of mark."""
_MARK_SIZE = 5.0
"""Size of a mark [points]."""
TOUCH_WORDS = "/world/forces"
"""Entities of names and forces."""
TOUCH_COLOR = shade((1.0, 0.0, 0.45))
_MAX_ARROW, _HALF_FORCE = 5.0, 1000.0
"""Length of an arrow that no force reaches [m], and the force whose arrow has half of it [N]."""
_MIN_ARROW_TIME = 1.0
"""Least simulated time for which an arrow is shown [s]."""


def _animal_path(name: str) -> str:
    """The entity of an animal's circle."""
    return f"/world/objects/{name}/circle"


def _bays_path(task: tasks.Dock) -> str:
    """The entity of the zones in which a boat stays to dock."""
    return f"/world/docks/{task.anchor}/bays"


def _bay_color(bay: tasks.Bay, progress: Mapping[str, Any]) -> Rgb:
    """The colour of a bay by what the boat has done there."""
    if bay.name in progress.get("docked", ()):
        return DOCKED
    if progress.get("bay") == bay.name:
        return INSIDE
    return RIGHT if bay.dock_allowed else WRONG


def _animal_color(animal: Mapping[str, Any]) -> Rgb:
    """The colour of an animal's circle, by its goal and its status."""
    if animal["goal"] == "avoid" and animal["status"] != "never_engaged":
        return LOST
    return AVOID if animal["goal"] == "avoid" else STATUS[animal["status"]]


def _course_chunks(parameters: Parameters) -> Iterator[Chunk]:
    """Every static chunk of what the task of a world lays out; what changes, as colours do, comes with the frames."""
    course = course_of(parameters)
    if course.gates:
        labels = [str(gate.number) for gate in course.gates]
        yield static(_GATES, thin_lines(2.2))
        yield static(f"{_GATES}/numbers", name_points(labels=labels))
    if isinstance(parameters.task, tasks.Dock):
        yield from _bay_chunks(parameters.task)
    for animal in course.animals:
        yield static(_animal_path(animal.name), thin_lines(1.6, strips=_circle(animal.radius, animal.goal)))
    for light in course.lights:
        spots = [(light.x + 0.6 * (number - 1), light.y, 4.0) for number in range(len(light.colors))]
        tints = [tuple(round(255 * share) for share in RGB[color]) for color in light.colors]
        yield static(f"/world/course/{light.name}", rr.Points3D(spots, colors=tints, radii=[0.22]))
    yield from _places(course)


def _gate_lines(left: Pose, right: Pose) -> list[FloatArray]:
    """A bar between a gate's buoys, and an arrow in the direction in which to cross it."""
    gate = gate_between(left, right)
    vector = _ARROW_SHARE * gate.width * np.array([math.cos(gate.yaw), math.sin(gate.yaw), 0.0])
    bar = np.array([(left.x, left.y, _LIFT), (right.x, right.y, _LIFT)])
    return [bar, *arrow_strips([(gate.x, gate.y, _LIFT)], [vector])]


def _bay_chunks(task: tasks.Dock) -> Iterator[Chunk]:
    """The zones of bays, in the dock's frame: frames to stay in, dashed ones to back out to."""
    path, bays = _bays_path(task), task.bays
    inside, outside = (
        [np.add(zone_corners(getattr(bay, zone)), (0.0, 0.0, _LIFT)) for bay in bays]
        for zone in ("internal", "external")
    )
    yield static(path, thin_lines(1.8, strips=[_ring(ring) for ring in inside]))
    pieces = [_dashes(_ring(ring)) for ring in outside]
    colors = [_bay_color(bay, {}) for bay, ring in zip(bays, pieces, strict=True) for _ in ring]
    yield static(f"{path}/external", thin_lines(1.2, strips=[*chain(*pieces)], colors=colors))
    labels = [f"{bay.name} {bay.symbol.replace('_', ' ')}" + (" ✓" if bay.dock_allowed else "") for bay in bays]
    spots = names_apart([ring.mean(axis=0) for ring in outside])
    yield static(f"{path}/names", name_points(positions=spots, labels=labels))


def _circle(radius: float, goal: str) -> list[FloatArray]:
    """A circle round an animal, dashed where it is to be avoided, else with heads of arrows in the wanted sense."""
    ring = _circle_at((0.0, 0.0, _LIFT), radius)
    if goal == "avoid":
        return [ring[i : i + 2] for i in range(0, _CORNERS, 2)]
    sense = 1.0 if goal == "circumnavigate_counterclockwise" else -1.0
    return [ring, *(_barb(radius, at, sense) for at in np.linspace(0.0, math.tau, 4, endpoint=False))]


def _barb(radius: float, angle: float, sense: float) -> FloatArray:
    """The head of an arrow along a circle."""
    back = angle - sense * 1.2 / radius
    tail = [((radius + side) * math.cos(back), (radius + side) * math.sin(back), _LIFT) for side in (0.7, -0.7)]
    return np.array([tail[0], (radius * math.cos(angle), radius * math.sin(angle), _LIFT), tail[1]])


def _places(course: Course) -> Iterator[Chunk]:
    """Paths of what swims, beacons, and places where things come up."""
    for path in course.paths:
        strip = np.insert(_ring(path.points) if path.closed else path.points, 2, _LIFT, axis=1)
        yield static(f"/world/course/paths/{path.name}", thin_lines(1.0, strips=_dashes(strip), colors=[PATH]))
    for beacon in course.beacons:
        spot = (beacon.x, beacon.y, _LIFT)
        arms = [[np.add(spot, (s, t, 0)), np.subtract(spot, (s, t, 0))] for s, t in ((1, 1), (1, -1))]
        around = [_circle_at(spot, beacon.radius)] if beacon.radius else []
        entity = f"/world/course/{beacon.name.replace(' ', '_')}"
        yield static(entity, thin_lines(2.0, strips=[*arms, *around], colors=[BEACON]))
        yield static(f"{entity}/name", name_points(positions=[spot], labels=[beacon.name]))
    if course.showings:
        spots = [(showing.x, showing.y, _LIFT) for showing in course.showings]
        yield static("/world/course/showings", rr.Points3D(spots, colors=[_SHOWING], radii=[0.25]))


def _circle_at(spot: Sequence[float], radius: float) -> FloatArray:
    """A ring round a place."""
    angle = np.linspace(0.0, math.tau, _CORNERS + 1)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1) + spot


def _ring(points: FloatArray) -> FloatArray:
    """Points, and the first once more."""
    return np.vstack([points, points[:1]])


def _dashes(strip: FloatArray) -> list[FloatArray]:
    """Pieces of a line of points (n, 3), dashes of about 0.6 m, longer where there would be many."""
    pieces: list[FloatArray] = []
    for start, end in pairwise(strip):
        count = min(24, max(1, round(math.dist(start, end))))
        ends = np.arange(count)[:, None] / count + np.array([0.2, 0.8]) / count
        pieces += [*(start + ends[..., None] * (end - start))]
    return pieces


_Ends = Sequence[tuple[Pose, Pose]]
"""Buoys of gates, left and right."""
_Fields = dict[str, Sequence[Any]]
"""Values of fields of an archetype."""


def task_chunks(parameters: Parameters) -> Iterator[Chunk]:
    """Every static chunk of the task of a world: its course, its plot's series, and the marks that it may have."""
    unit = TASK_KINDS[parameters.task.type].unit if parameters.task else ""
    if parameters.task:
        yield from _course_chunks(parameters)
        names, colors = [f"score [{unit}]", "collisions"], [SCORE_COLOR, HITS_COLOR]
        mode = rr.components.InterpolationMode.StepAfter
        yield static(PLOT, rr.SeriesLines(names=names, colors=colors, widths=[2.0] * 2, interpolation_mode=mode))
        yield static(WORDS, rr.TextDocument.from_fields(media_type="text/markdown"))
    gates = any(parts_of(parameters.task, tasks.Gate))
    shown = {"contacts": True, "gates passed": gates, "gates missed": gates, "score changes": unit == "points"}
    for kind, (color, shape) in MARK_KINDS.items():
        if shown[kind]:
            style = rr.SeriesPoints(names=[kind], colors=[color], markers=[shape], marker_sizes=[_MARK_SIZE])
            yield static(_path_of(kind), style)


def frame_chunk(frames: Sequence[RecordedFrame]) -> Chunk:
    """Frames of the boats that sail together as one block, and what was sent with them as JSON."""
    (boat_set, *_), rows = frames[0], np.array([row for _, row, _ in frames])
    messages = [
        [number, [[one.topic, one.content] for one in sent]] for number, (*_, sent) in enumerate(frames) if sent
    ]
    columns = rr.AnyValues.columns(block=[pack_rows(rows)], sent=[json.dumps(messages)], company=[boat_set])
    return Chunk.from_columns(FRAMES, [times(rows[:1, 0])], columns)


class TaskChunks:
    """Turns frames into chunks; nothing where the world has no task."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters, self._task = parameters, parameters.task
        self._begun: float | None = None
        self._now = self._score = 0.0
        self._drawn: tuple[float, list[Any], _Ends] | None = None
        self._rows: dict[str, tuple[Any, list[tuple[float, _Fields]]]] = {}
        if self._task:
            self._referee = make_referee(self._task)
            self._layout = FrameLayout.of(self._task, self._referee.watched)
            self._points = TASK_KINDS[self._task.type].unit == "points"
            self._gates = [*parts_of(self._task, tasks.Gate)]
            self._fates = ["ahead"] * len(self._gates)

    def change_scene(self, parameters: Parameters) -> None:
        """Go on in a world in which boats have come or gone: the scored one can touch others."""
        if self._task:
            self._layout = FrameLayout.of(parameters.task, self._referee.watched)

    def look(self, states: Sequence[SavedState], frames: Sequence[RecordedFrame]) -> None:
        """Take up the states and frames that come next."""
        if not self._task:
            return
        if self._begun is None and (states or frames):
            self._begin(states)
        for _, row, sent in frames:
            if self._begun is not None and row[0] > self._begun + 1e-9:
                self._look(float(row[0]), self._layout.frame(row.tolist(), sent))

    def chunks(self, end: float = 0.0) -> Iterator[Chunk]:
        """Chunks of all that was seen in a run that ended at `end` [s]: many small ones would cost more than these."""
        if self._rows:
            self._write_status(self._now, at_once=True)
            since, score = self._last(PLOT)
            if since < (now := max(self._now, end)):  # a line that does not change goes on
                self._add(PLOT, now, rr.Scalars, score)
        for path, (kind, rows) in self._rows.items():
            at, values = zip(*rows, strict=True)
            yield changes(path, at, kind, **{name: [row[name] for row in values] for name in values[0]})

    @property
    def result(self) -> str:
        """Boat and score of a finished task; empty before."""
        return result_of(self._referee) if self._task else ""

    def _begin(self, states: Sequence[SavedState]) -> None:
        """Go on from the first state, if that is not the beginning of the run."""
        self._begun = -1.0
        if states and states[0].time > 0.0:
            self._begun = self._now = states[0].time
            restore_referee(self._referee, states[0].blob)
            self._fates, self._score = self._referee.progress.get("gates", []), self._referee.status.score
            self._draw(self._begun, poses_of(self._parameters))
            self._write_status(self._begun, at_once=True)

    def _look(self, time: float, frame: Frame) -> None:
        """Pass a frame to the referee, and write the changes."""
        phase = self._referee.status.phase
        self._referee.look(frame)
        self._mark(time)
        self._now = time
        status = self._referee.status
        self._change(f"{STEPS}/task", time, rr.StateChange, state=[status.phase])
        if self._points and has_started(status.phase):
            self._change(f"{STEPS}/score", time, rr.StateChange, state=[f"{status.score:g} points"])
        self._draw(time, frame.poses)
        self._write_status(time, at_once=status.phase != phase)

    def _mark(self, time: float) -> None:
        """Mark what has changed; the referee has no lines of gates missed, and of changes of a score of points."""
        fates, score = self._referee.progress.get("gates", []), self._referee.status.score
        for number, (before, fate) in enumerate(zip(self._fates, fates, strict=True), 1):
            if fate != before:
                self._append(_path_of("gates passed" if fate == "crossed" else "gates missed"), time, rr.Scalars, _MARK)
            if fate != before and fate == "missed":
                self._line(time, f"gate {number} of {len(fates)} missed", "WARN")
        if self._points and score != self._score:
            self._append(_path_of("score changes"), time, rr.Scalars, _MARK)
            self._line(time, f"score {score:g} points, {score - self._score:+g}", "INFO")
        self._fates, self._score = fates, score

    def _line(self, time: float, text: str, level: str) -> None:
        self._append("/events/task", time, rr.TextLog, {"text": [text], "level": [level]})

    def _draw(self, time: float, poses: Mapping[str, Pose]) -> None:
        """Gates, bays and circles where they have changed."""
        progress = self._referee.progress
        if self._gates:
            self._draw_gates(time, poses)
        if isinstance(self._task, tasks.Dock):
            colors = [_bay_color(bay, progress) for bay in self._task.bays]
            self._change(_bays_path(self._task), time, rr.LineStrips3D, colors=colors)
        for animal in progress.get("animals", ()):
            self._change(_animal_path(animal["name"]), time, rr.LineStrips3D, colors=[_animal_color(animal)])

    def _draw_gates(self, time: float, poses: Mapping[str, Pose]) -> None:
        """All gates, if one has another colour, or has drifted."""
        following = self._fates.index("ahead") if "ahead" in self._fates and not self._referee.is_over else -1
        colors = [FATES["next" if number == following else fate] for number, fate in enumerate(self._fates)]
        ends = [(poses[gate.left], poses[gate.right]) for gate in self._gates]
        drawn = self._drawn
        if drawn and drawn[1] == colors and (time - drawn[0] < _DRIFT_EVERY or _drift(drawn[2], ends) < _MIN_DRIFT):
            return
        self._drawn = (time, colors, ends)
        strips = [_gate_lines(*pair) for pair in ends]
        lines: _Fields = {"strips": [*chain(*strips)], "colors": [color for color in colors for _ in strips[0]]}
        self._add(_GATES, time, rr.LineStrips3D, lines)
        self._add(f"{_GATES}/numbers", time, rr.Points3D, {"positions": [arrow[0] for _, arrow in strips]})

    def _write_status(self, time: float, *, at_once: bool) -> None:
        """Score and collisions, and words, unless that was a moment ago."""
        status = self._referee.status
        if at_once or time - self._last(PLOT)[0] > _PLOT_EVERY - 1e-6:
            score = status.score if has_started(status.phase) else math.nan
            self._change(PLOT, time, rr.Scalars, scalars=[score, float(status.collisions)])
        if at_once or time - self._last(WORDS)[0] > _WORDS_EVERY - 1e-6:
            self._change(WORDS, time, rr.TextDocument, text=[words(self._referee)])

    def _last(self, path: str) -> tuple[float, _Fields]:
        """Time [s] and fields of an entity's last row."""
        return self._rows[path][1][-1] if path in self._rows else (-math.inf, {})

    def _change(self, path: str, time: float, kind: Any, **fields: Sequence[Any]) -> None:
        """Write fields of an archetype if they have changed."""
        if self._last(path)[1] != fields:
            self._add(path, time, kind, fields)

    def _add(self, path: str, time: float, kind: Any, fields: _Fields) -> None:
        """Write fields of an archetype; of two rows at one time the later counts."""
        if self._last(path)[0] == time:
            self._rows[path][1].pop()
        self._append(path, time, kind, fields)

    def _append(self, path: str, time: float, kind: Any, fields: _Fields) -> None:
        """Write fields of an archetype, also several rows at one time."""
        self._rows.setdefault(path, (kind, []))[1].append((time, fields))


def result_of(referee: Referee) -> str:
    """Boat and score of a finished task; empty before."""
    status = referee.status
    score = score_text(status.phase, status.score, TASK_KINDS[referee.type].unit)
    return f"{referee.boat}, {score}" if referee.is_over else ""


def _drift(before: _Ends, now: _Ends) -> float:
    """The longest way that a buoy has drifted [m]."""
    pairs = zip(chain.from_iterable(before), chain.from_iterable(now), strict=True)
    return max((math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairs), default=0.0)


def words(referee: Referee) -> str:
    """Phase, score, collisions and parts of a task, in Markdown."""
    status, meaning = referee.status, TASK_KINDS[referee.type]
    clock = {
        "initial": f"ready at {status.ready_time:g} s",
        "ready": f"runs from {status.running_time:g} s",
        "running": f"{status.remaining:.0f} s left",
        "finished": ("time is up" if status.timed_out else "done") + f" after {status.elapsed:.1f} s",
    }[status.phase]
    hits = f"collisions **{status.collisions}**"
    lines = [
        f"**{referee.name}: {status.phase}**, {clock}",
        f"**{score_text(status.phase, status.score, meaning.unit)}**, the {meaning.better} the better; {hits}",
        *_parts(referee.progress),
    ]
    return "  \n".join(lines)


def _parts(progress: Mapping[str, Any]) -> Iterator[str]:
    """How far the parts of a task are."""
    if "gates" in progress:
        yield "gates " + " ".join(f"{number}{_GATE_SIGNS[fate]}" for number, fate in enumerate(progress["gates"], 1))
    if progress.get("waypoints"):
        yield "least errors [m] " + ", ".join(f"{error:.2f}" for error in progress["waypoints"])
    if "animals" in progress:
        yield "\n".join(f"- {_animal(animal)}" for animal in progress["animals"])
    if "bay" in progress:
        yield ", ".join(_in_dock(progress))
    if "up" in progress:
        yield "before the boat: " + (
            ", ".join(name for name, up in zip(progress["objects"], progress["up"], strict=True) if up) or "nothing"
        )


def _animal(animal: Mapping[str, Any]) -> str:
    """Text about an animal: what the boat does with it, and how many of its eight gates it has crossed."""
    status = f"{animal['name']} {animal['status'].replace('_', ' ')}"
    return status if animal["goal"] == "avoid" else f"{status}, {len(animal['circled'])} of 8"


def _in_dock(progress: Mapping[str, Any]) -> Iterator[str]:
    yield f"in {progress['bay']} for {progress['time_in_bay']:.0f} s" if progress["bay"] else "in no bay"
    yield from (f"docked in {bay}" for bay in progress["docked"])
    if progress["hits"]:
        yield f"balls in holes {len(progress['hits'])}"
    if progress["colors"]:
        yield "colours sent " + " ".join(progress["colors"])


_MARK: _Fields = {"scalars": [0.0]}


def _path_of(kind: str) -> str:
    """The entity of marks of a kind."""
    return f"{MARKS_PATH}/{kind.replace(' ', '_')}"


def touch_chunks(touches: Sequence[Touch]) -> Iterator[Chunk]:
    """Touches, each seen from its begin to its end: where the largest force acts, with names and force."""
    if touches:
        at = [touch.time for touch in touches]
        yield numbers(_path_of("contacts"), at, rr.Scalars, scalars=np.zeros(len(at)))
    for touch in touches:
        if touch.point is None or touch.vector is None:
            continue
        path = f"/world/touches/{touch.boat}/{touch.other}"
        time = [touch.time, touch.time + max(touch.duration, _MIN_ARROW_TIME)]
        vector = np.array(touch.vector) * _MAX_ARROW / (touch.force + _HALF_FORCE)
        yield static(path, rr.LineStrips3D.from_fields(colors=[TOUCH_COLOR], radii=[0.16]))
        yield changes(path, time, rr.LineStrips3D, strips=[[*arrow_strips([touch.point], [vector])], []])
        said = f"{TOUCH_WORDS}/{touch.boat}/{touch.other}"
        yield static(said, name_points())
        label = f"{touch.boat} touches {touch.other}, {touch.force:.0f} N"
        yield changes(said, time, rr.Points3D, positions=[[touch.point + vector], []], labels=[[label], []])
        steps = f"{STEPS}/{touch.boat}/{touch.other}"
        yield changes(steps, time, rr.StateChange, state=[[f"{touch.force:.0f} N"], []])
