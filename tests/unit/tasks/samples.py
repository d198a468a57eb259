"""A small task of every type, and a restless boat in it."""

import math
import random

from unit.tasks.streams import buoys, gate_names, pose, task
from vrx_mj.tasks.frame import FRAME_RATE, Frame, Message

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
VALUES = {
    "stationkeeping": {"goal": POINT, "heading": True},
    "wayfinding": {"waypoints": [POINT, {**POINT, "x": -3.0}]},
    "perception": {"objects": SHOWN, "loop_forever": False, "held": True},
    "navigation_course": {"gates": gate_names(3), "obstacle_penalty": 10.0},
    "follow_path": {"gates": gate_names(3), "obstacle_penalty": 3.0, "points_per_gate_crossed": 10.0, "bonus": 1.0},
    "dock": DOCK,
    "scan_and_dock": DOCK,
    "scan_dock_deliver": DOCK,
    "wildlife": {"animals": ANIMALS, "engagement_distance": 4.0, "time_bonus": 30.0, "publication_rate": 1.0},
    "gymkhana": {"channel": CHANNEL, "pinger": POINT, "obstacle_penalty": 1.0},
    "acoustic_perception": {"pinger": POINT, "goal_tolerance": 1.2},
    "acoustic_tracking": {"pinger": "red_0", "pinger_depth": 2.0, "obstacle_penalty": 1.0},
}
"""Of a type, what its parameters have besides those of all."""
MESSAGES = {
    "perception": ("landmark", {"type": RED, "x": 0.0, "y": 0.0}),
    "scan_and_dock": ("color_sequence", ["red", "green", "blue"]),
    "scan_dock_deliver": ("color_sequence", ["red", "green", "yellow"]),
}
"""Of a type, what it takes; nothing of the others."""


def sample(kind, profile="vrx"):
    """A task of 0.5 s, 0.5 s and 10 s."""
    common = {"profile": profile, "durations": [0.5, 0.5, 10.0], "collision_buffer": 1.0}
    return task(kind, **{**common, **VALUES[kind]})


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
        if kind in MESSAGES and rng.random() < 0.05:
            messages = (Message(*MESSAGES[kind]),)
        ball = pose(rng.gauss(4, 3), rng.gauss(-3, 3), z=1.0)
        poses = things | {"wamv": pose(x, y, math.sin(k)), "other": pose(y, x), "ball": ball}
        frames.append(Frame(k / FRAME_RATE, poses, touches, tuple(messages)))
    return frames
