"""A made-up run for tests of recordings: boats in circles on a travelling wave, buoys bobbing on it.

As a script it records in real time until it is killed: `python recorded_run.py FILE`.
"""

import math
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import trimesh

from trees import partial
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.recording.record_scene import MovingBody, RecordedBody, RecordedThruster, RecordScene, Surface
from vrx_mj.recording.session import RecordWriter

RATE = 20.0
RADIUS, SPEED, DRIFT = 14.0, 2.0, 0.7
AMPLITUDE, LENGTH, PERIOD = 0.25, 30.0, 4.4
BUOYS = {"red_0": (16.0, 6.0), "green_0": (-20.0, 9.0), "white_0": (4.0, 34.0)}
COLORS = {"red_0": (0.85, 0.1, 0.1, 1.0), "green_0": (0.1, 0.6, 0.2, 1.0), "white_0": (0.95, 0.95, 0.95, 1.0)}

PARAMETERS = {
    "task": None, "boats": [], "georeference": None,
    "wind": {"mean": 5.0, "gain": 0.0, "direction": [0.0, 1.0]}, "sea": {"waves": [], "period": PERIOD},
    "shoreline": [[[-60.0, 70.0], [0.0, 62.0], [60.0, 75.0], [60.0, 120.0], [-60.0, 120.0]]],
    "waypoints": [[0.0, 30.0, 1.57], [-30.0, 0.0, 0.0]],
}  # fmt: skip


def sea_height(x, y, t):
    """One regular wave running east [m], to the same bits on all processors."""
    cosine = np.vectorize(math.cos, otypes=[float])
    return AMPLITUDE * cosine(2 * math.pi * (np.asarray(x) / LENGTH - t / PERIOD))


def surface(mesh, rgba):
    return Surface(mesh.vertices.astype(np.float32), mesh.faces, mesh.vertex_normals.astype(np.float32), rgba)


def moved(mesh, *where):
    mesh.apply_translation(where)
    return mesh


@cache
def boat_surfaces():
    hulls = [moved(trimesh.creation.capsule(height=3.6, radius=0.21, transform=None), 0, 0, 0) for _ in range(2)]
    turn = trimesh.transformations.rotation_matrix(math.pi / 2, [0, 1, 0])
    for hull, side in zip(hulls, (1.03, -1.03), strict=True):
        hull.apply_transform(turn)
        moved(hull, -1.8, side, 0.15)
    deck = moved(trimesh.creation.box((1.7, 1.2, 0.12)), 0, 0, 1.2)
    legs = [moved(trimesh.creation.box((0.08, 0.08, 1.0)), x, y, 0.7) for x in (-0.7, 0.7) for y in (-1.0, 1.0)]
    return (
        *(surface(hull, (0.92, 0.92, 0.9, 1.0)) for hull in hulls),
        surface(deck, (0.25, 0.27, 0.3, 1.0)),
        *(surface(leg, (0.6, 0.62, 0.65, 1.0)) for leg in legs),
    )


@cache
def buoy_surfaces(rgba):
    return (surface(trimesh.creation.cylinder(0.45, 1.2, sections=24), rgba),)


@cache
def dock_surfaces():
    cells = [moved(trimesh.creation.box((1.96, 1.96, 0.5)), 2.0 * i, 0.0, 0.1) for i in range(6)]
    return tuple(surface(cell, (0.62, 0.6, 0.56, 1.0)) for cell in cells)


def scene(boats=3, seed=7):
    """The scene of the made-up run."""
    names = [f"wamv{i + 1}" for i in range(boats)]
    first = row_at(0.0, boats)
    bodies = []
    for i, name in enumerate([*names, *BUOYS]):
        pose = tuple(float(value) for value in first[2 + 4 * boats + 7 * i :][:7])
        kind, surfaces = ("boat", boat_surfaces()) if i < boats else ("object", buoy_surfaces(COLORS[name]))
        free = MovingBody(name, kind, 7 * i, 6 * i)
        bodies.append(RecordedBody(name, f"/world/{kind}s/{name}", kind, pose, free, surfaces))
    place = (22.0, -10.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    dock = RecordedBody("dock", "/world/docks/dock", "fixed", place, surfaces=dock_surfaces())
    thrusters = tuple(
        RecordedThruster(side, name, (-2.37, y, 0.32), surfaces=engine_surfaces())
        for name in names
        for side, y in (("left", 1.03), ("right", -1.03))
    )
    return RecordScene(
        properties={
            "world": "made_up",
            "fleet": "ring",
            "seed": seed,
            "versions": {"mujoco": "4.0.0"},
            "physics_version": PHYSICS_VERSION,
        },
        timestep=0.01,
        nq=7 * len(bodies),
        nv=6 * len(bodies),
        bodies=(*bodies, dock),
        thrusters=thrusters,
        files={"scene.xml": b"<mujoco/>", "assets/hull.stl": bytes(range(256))},
        parameters=partial(PARAMETERS),
        sea_height=sea_height,
    )


@cache
def engine_surfaces():
    return (surface(moved(trimesh.creation.box((0.3, 0.25, 0.7)), -0.2, 0, 0), (0.1, 0.1, 0.12, 1.0)),)


def row_at(t, boats=3):
    """The row of the made-up run at one time."""
    rate = SPEED / RADIUS
    qpos, qvel = [], []
    for i in range(boats):
        angle = rate * t + 2 * math.pi * i / boats
        x, y = DRIFT * t + RADIUS * math.cos(angle), RADIUS * math.sin(angle)
        qpos += [x, y, float(sea_height(x, y, t)) - 0.05, *turned(angle + math.pi / 2, slope(x, t))]
        qvel += [DRIFT - SPEED * math.sin(angle), SPEED * math.cos(angle), 0.0, 0.0, 0.0, rate]
    for x, y in BUOYS.values():
        qpos += [x, y, float(sea_height(x, y, t)) + 0.2, 1.0, 0.0, 0.0, 0.0]
        qvel += [0.0] * 6
    thrust = [80.0 + 40.0 * math.sin(t + k) for k in range(2 * boats)]
    angle = [0.3 * math.sin(0.5 * t + k) for k in range(2 * boats)]
    return [t, 5.0 + math.sin(0.3 * t), *thrust, *angle, *qpos, *qvel]


def slope(x, t):
    """Slope of the wave toward east."""
    return -AMPLITUDE * 2 * math.pi / LENGTH * math.sin(2 * math.pi * (x / LENGTH - t / PERIOD))


def turned(yaw, steep):
    """The quaternion of a heading `yaw`, leaning with a slope toward east."""
    roll, pitch = math.asin(-steep * math.sin(yaw)), math.asin(-steep * math.cos(yaw))
    cr, sr, cp, sp = math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def blocks(seconds, boats=3, size=20) -> Iterator[np.ndarray]:
    """Rows of the made-up run in blocks, as the runtime hands them over."""
    rows = np.array([row_at(k / RATE, boats) for k in range(round(seconds * RATE) + 1)])
    for start in range(0, len(rows), size):
        yield rows[start : start + size]


def record_run(path, seconds=10.0, boats=3, seed=7):
    """Record the made-up run."""
    with RecordWriter(path, scene(boats, seed)) as writer:
        writer.event(0.0, "the run starts")
        for block in blocks(seconds, boats):
            writer.state(block[0, 0], block[0].tobytes())
            writer.rows(block)
        writer.event(seconds, "wamv1 reached the goal", "WARN")
    return Path(path)


def record_forever(path):
    """Record in real time until killed, saying each second that was handed over."""
    writer = RecordWriter(path, scene())
    for block in blocks(3600.0):
        writer.rows(block)
        sys.stdout.write(f"{block[-1, 0]:.2f} {time.monotonic():.2f}\n")
        sys.stdout.flush()
        time.sleep(0.2)


if __name__ == "__main__":
    record_forever(sys.argv[1])
