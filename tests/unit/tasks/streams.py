"""Hand-made streams of frames for the tasks' referees: a boat `wamv` and what is around it."""

import csv
import math
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

from trees import task_of
from vrx_mj.tasks.referee import FRAME_RATE, Frame, Message, Pose

GOLDEN = Path(__file__).parents[2] / "golden"


def pose(x=0.0, y=0.0, yaw=0.0, z=0.0):
    return Pose(x, y, z, (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)))


def task(kind, **values):
    """A task that runs from the second frame on."""
    common = {
        "type": kind,
        "name": kind,
        "boat": "wamv",
        "profile": "vrx",
        "durations": [0.0, 0.0, 300.0],
        "collision_buffer": 3.0,
        "locked": True,
        "held": False,
        "fixed": {},
        "rivals": [],
    }
    return task_of(common | values)


def frame(time, boat=None, touches=None, messages=(), **others):
    """A frame; `boat` is a pose or (x, y), as are the others."""
    poses = {name: place if isinstance(place, Pose) else pose(*place) for name, place in others.items()}
    poses["wamv"] = pose() if boat is None else boat if isinstance(boat, Pose) else pose(*boat)
    return Frame(time, poses, touches or {}, tuple(Message(topic, content) for topic, content in messages))


def begin(referee, **others):
    """The two frames after which a task without delays runs."""
    referee.look(frame(0.0, **others))
    referee.look(frame(1 / FRAME_RATE, **others))
    assert referee.status.phase == "running"


def look(referee, *args, **others):
    """The lines of a frame's verdict, phases left out."""
    verdict = referee.look(frame(*args, **others))
    return [text for text, _ in verdict.lines if not text.startswith(f"{referee.name}: ")]


def track(points, spacing):
    """Points along straight legs, at most `spacing` [m] apart, from the first to the last."""
    yield points[0]
    for (x, y), (to_x, to_y) in pairwise(points):
        count = math.ceil(math.hypot(to_x - x, to_y - y) / spacing)
        yield from ((x + (to_x - x) * k / count, y + (to_y - y) * k / count) for k in range(1, count + 1))


def courses():
    """Of each navigation course the gates as ((red x, y), (partner x, y))."""
    found = defaultdict(list)
    with (GOLDEN / "gates.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            red, partner = (float(row["red_x"]), float(row["red_y"])), (float(row["x"]), float(row["y"]))
            found[row["course"]].append((red, partner))
    return dict(found)


def gate_names(count):
    return [{"left": f"red_{k}", "right": f"green_{k}"} for k in range(count)]


def buoys(gates):
    """The poses of gates given as ((red x, y), (partner x, y))."""
    return {
        f"{side}_{k}": pose(*place)
        for k, gate in enumerate(gates)
        for side, place in zip(("red", "green"), gate, strict=True)
    }


def through(gate, before=4.0, after=4.0):
    """Two points: before a gate's middle and after it, red to starboard, worked out with complex numbers."""
    red, green = (complex(*place) for place in gate)
    along = (red - green) / abs(red - green) * 1j
    middle = (red + green) / 2
    return [((middle + along * way).real, (middle + along * way).imag) for way in (-before, after)]
