"""A sample of every type of task, and a restless boat in it."""

import math
import random
from dataclasses import dataclass

from unit.tasks.streams import buoys, gate_names, pose, task
from vrx_mj.tasks.referee import FRAME_RATE, Frame, Message

GATES = [((x, -4), (x, 4)) for x in (-4, 0, 4)]
POINT = {"x": 3.0, "y": -2.0, "z": -1.0, "yaw": 4.0, "latitude": None, "longitude": None}
RED = "mb_marker_buoy_red"


def box(x, y, length, width):
    return {"center": [x, y, 0.0], "size": [length, width, 4.0]}


BAYS = [
    {
        "name": f"bay{k}",
        "placard": f"dock/placard_{k}",
        "symbol": symbol,
        "dock_allowed": k == 1,
        "internal": box(2.0, y, 4.0, 4.0),
        "external": box(-4.0, y, 4.0, 4.0),
    }
    for k, (symbol, y) in enumerate((("red_circle", 3.0), ("blue_cross", -3.0)))
]
DOCK = {
    "dock": "dock",
    "anchor": "dock",
    "bays": BAYS,
    "holes": [{"bay": "bay1", "size": "big", "points": 5.0, "center": [4.0, -3.0, 1.0], "box": [3.0, 3.0, 3.0]}],
    "balls": ["ball"],
    "light_buoy": "light",
    "color_sequence": ["red", "green", "blue"],
    "color_bonus_points": 10.0,
    "dock_bonus_points": 15.0,
    "correct_dock_bonus_points": 5.0,
    "enable_color_checker": True,
    "min_dock_time": 0.5,
}
SHOWN = [
    {
        "time": k,
        "duration": 2.0,
        "type": RED,
        "name": f"red_{k}",
        "pose": [3, 0, 0, 0, 0, 0],
        "stash": [90, 0, 0, 0, 0, 0],
    }
    for k in (0, 1, 2)
]
ANIMALS = [
    {"name": "red_0", "model": "platypus_buoy", "goal": "circumnavigate_clockwise"},
    {"name": "red_2", "model": "crocodile_buoy", "goal": "avoid"},
]
CHANNEL = {"gates": gate_names(3), "obstacle_penalty": 10.0, "collision_buffer": 2.0}


@dataclass(frozen=True)
class TaskSample:
    """What the tests of all types of tasks need of one."""

    file: dict
    """The least that a file gives."""
    defaults: dict
    """VRX's values where a file gives none, of its worlds of 2019, 2022 and 2023."""
    parameters: dict
    """Parameters of a small compiled task, besides those that all types have."""
    message: tuple | None = None
    """Topic and content of a message that the task takes."""


FILE_PINGER = {"pinger": [1, 2, -2]}
FILE_DOCK = {"dock": "d", "bays": [{"symbol": "red_circle"}]}
SAMPLES = {
    "stationkeeping": TaskSample(
        file={"goal_cart": [1, 2, 0.5]},
        defaults={"collision_buffer": 3.0, "heading": True},
        parameters={"goal": POINT, "heading": True},
    ),
    "wayfinding": TaskSample(
        file={"waypoints_cart": [[1, 2, 0.5]]},
        defaults={"collision_buffer": 3.0},
        parameters={"waypoints": [POINT, {**POINT, "x": -3.0}]},
    ),
    "perception": TaskSample(
        file={"objects": [{"time": 5, "name": "red", "pose": [8, 0, 1, 0, 0, 0]}]},
        defaults={"collision_buffer": 3.0, "loop_forever": False},
        parameters={"objects": SHOWN, "loop_forever": False, "held": True},
        message=("landmark", {"type": RED, "x": 0.0, "y": 0.0}),
    ),
    "navigation_course": TaskSample(
        file={"course": "c"},
        defaults={"collision_buffer": 10.0, "obstacle_penalty": 10.0},
        parameters={"gates": gate_names(3), "obstacle_penalty": 10.0},
    ),
    "follow_path": TaskSample(
        file={"course": "c"},
        defaults={"points_per_gate_crossed": 10.0, "bonus": 1.0, "obstacle_penalty": 3.0, "collision_buffer": 10.0},
        parameters={"gates": gate_names(3), "obstacle_penalty": 3.0, "points_per_gate_crossed": 10.0, "bonus": 1.0},
    ),
    "dock": TaskSample(
        file=FILE_DOCK,
        defaults={
            "color_bonus_points": 10.0,
            "dock_bonus_points": 10.0,
            "correct_dock_bonus_points": 10.0,
            "enable_color_checker": False,
            "min_dock_time": 10.0,
            "light_buoy": None,
            "collision_buffer": 3.0,
        },
        parameters=DOCK,
    ),
    "scan_and_dock": TaskSample(
        file=FILE_DOCK,
        defaults={"dock_bonus_points": 10.0, "correct_dock_bonus_points": 10.0, "enable_color_checker": True},
        parameters=DOCK,
        message=("color_sequence", ["red", "green", "blue"]),
    ),
    "scan_dock_deliver": TaskSample(
        file=FILE_DOCK,
        defaults={"dock_bonus_points": 15.0, "correct_dock_bonus_points": 5.0, "enable_color_checker": True},
        parameters=DOCK,
        message=("color_sequence", ["red", "green", "yellow"]),
    ),
    "wildlife": TaskSample(
        file={},
        defaults={"engagement_distance": 10.0, "time_bonus": 30.0, "collision_buffer": 10.0, "publication_rate": None},
        parameters={"animals": ANIMALS, "engagement_distance": 4.0, "time_bonus": 30.0, "publication_rate": 1.0},
    ),
    "gymkhana": TaskSample(
        file={"channel": {"course": "c"}, **FILE_PINGER},
        defaults={"obstacle_penalty": 1.0, "collision_buffer": 3.0},
        parameters={"channel": CHANNEL, "pinger": POINT, "obstacle_penalty": 1.0},
    ),
    "acoustic_perception": TaskSample(
        file=FILE_PINGER,
        defaults={"goal_tolerance": 3.0, "collision_buffer": 3.0},
        parameters={"pinger": POINT, "goal_tolerance": 1.2},
    ),
    "acoustic_tracking": TaskSample(
        file={"pinger": "beacon"},
        defaults={"pinger_depth": 2.0, "obstacle_penalty": 1.0},
        parameters={"pinger": "red_0", "pinger_depth": 2.0, "obstacle_penalty": 1.0},
    ),
}
"""Of each type one; a new type needs its sample here alone."""


def sample(kind, profile="vrx"):
    """A task of 0.5 s, 0.5 s and 10 s."""
    common = {"profile": profile, "durations": [0.5, 0.5, 10.0], "collision_buffer": 1.0}
    return task(kind, **{**common, **SAMPLES[kind].parameters})


def restless(kind, seed, count=260):
    """Frames of a boat that goes about among gates, touches them, and sends what the task takes."""
    rng = random.Random(seed)
    x, y, touches, frames = -6.0, 0.0, {}, []
    things = buoys(GATES) | {"dock": pose(2, 0, 0.3)}
    for k in range(count):
        x, y = x + rng.gauss(0.05, 0.3), y + rng.gauss(-0.1 * y, 0.3)
        if rng.random() < 0.02:
            touches = {**touches, rng.choice(["red_0", "green_1", "other"]): k / FRAME_RATE}
        messages = ()
        message = SAMPLES[kind].message
        if message is not None and rng.random() < 0.05:
            messages = (Message(*message),)
        ball = pose(rng.gauss(4, 3), rng.gauss(-3, 3), z=1.0)
        poses = things | {"wamv": pose(x, y, math.sin(k)), "other": pose(y, x), "ball": ball}
        frames.append(Frame(k / FRAME_RATE, poses, touches, tuple(messages)))
    return frames
