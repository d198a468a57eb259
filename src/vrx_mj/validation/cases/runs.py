"""Runs as a whole: what stays at rest, what is mirrored, what is equal to the last bit, and what must stay finite."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.errors import DivergedError
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Case, Findings, Row, at_most, equal
from vrx_mj.validation.setups import marine_simulation, marine_world, packaged_simulation

_SKIFF: Mapping[str, Any] = {"usv_count": 1, "robot": "skiff"}
_SEA = {"model": "jonswap", "significant_height": 0.4, "peak_period": 4.0, "spreading": 10.0}
_BREAKING = {"model": "regular", "height": 2.2, "period": 3.2}
"""0.14 of its length high: the steepest that a world takes."""

_POWER = ("propeller", "left", "right")
"""Commands of engines that push ahead."""


def _calm_hour() -> Findings:
    """An hour in still water."""
    sim = packaged_simulation("barge")
    (boat,) = sim.boats
    moved = 0.0
    for _ in range(60):
        sim.step(duration=60.0)
        moved = max(moved, float(np.linalg.norm(sim.observe()[boat].position)))
    return Findings((at_most("greatest distance from its place", "m", 1e-6, moved),))


def _track(sim: Simulation, sign: float) -> FloatArray:
    """Places and headings (n, 3) of a turn to one side."""
    rows = []
    for _ in range(240):
        sim.step({"wamv1": {"propeller": 0.7, "rudder_angle": sign * 0.3}}, duration=0.25)
        seen = sim.observe()["wamv1"]
        rows.append((float(seen.position[0]), float(seen.position[1]), seen.heading))
    return np.array(rows)


def _mirrored() -> Findings:
    """Turns to port and to starboard."""
    port, starboard = (_track(marine_simulation(_SKIFF), sign) for sign in (1.0, -1.0))
    apart = np.abs(port[:, :2] - starboard[:, :2] * (1.0, -1.0)).max()
    turned = np.abs(np.sin(port[:, 2] + starboard[:, 2])).max()
    chart = Chart(
        "Tracks, rudder 0.3 rad",
        "x [m]",
        "y [m]",
        (
            Series("to port", port[:, 0], port[:, 1], reference=True),
            Series("to starboard, mirrored", starboard[:, 0], -starboard[:, 1]),
        ),
        equal=True,
    )
    rows = (
        at_most("greatest distance between the one and the mirrored other", "m", 1e-9, float(apart)),
        at_most("greatest difference of heading", "rad", 1e-9, float(turned)),
    )
    return Findings(rows, (chart,))


def _same_bits() -> Findings:
    """One boat alone, among others, and as a row of a batch."""
    sea = {**_SEA, "components": 20}
    places = [{"name": f"boat{i}", "pose": [40.0 * i, 0.0, 0.0, 0.0, 0.0, 0.0]} for i in range(8)]
    few, many = ({"robot": "skiff", "boats": places[:count]} for count in (1, 8))
    alone, among = marine_simulation(few, sea=sea), marine_simulation(many, sea=sea)
    for sim in (alone, among):
        sim.reset(seed=7)
        sim.step({"boat0": {"propeller": 0.5}}, duration=20.0)
    apart = np.array(alone.data.qpos[:7]) != np.array(among.data.qpos[:7])
    world = marine_world(few, sea=sea)
    batch, single, different = Batch(world, 4), Simulation(world), 0
    batch.reset(seed=11)
    batch.step(duration=5.0)
    for row in range(4):
        single.reset(11 + row)
        single.step(duration=5.0)
        different += single.get_state().sha256 != batch.get_state(row).sha256
    return Findings(
        (
            equal("numbers of a boat's pose that differ alone and among 8", "", 0, int(apart.sum())),
            equal("rows of a batch of 4 whose state differs from a single run", "", 0, different),
        )
    )


def _capsize() -> Simulation:
    sim = packaged_simulation("barge")
    sim.set_boat(sim.boats[0], pose=(0.0, 0.0, 0.5, 2.0, 0.4, 0.0), velocity=(0.0, 0.0, 0.0, 3.0, 1.0, 0.0))
    return sim


def _breaking_sea() -> Simulation:
    return packaged_simulation("barge", sea=_BREAKING)


def _drop() -> Simulation:
    sim = packaged_simulation("barge")
    sim.set_boat(sim.boats[0], pose=(0.0, 0.0, 5.0, 0.3, 0.2, 0.0))
    return sim


def _pile_up() -> Simulation:
    """Twenty boats close together, all with the bow to the middle and under full power."""
    angles = [2.0 * math.pi * i / 20 for i in range(20)]
    boats = [
        {"name": f"boat{i}", "pose": [9.0 * math.cos(a), 9.0 * math.sin(a), 0.0, 0.0, 0.0, a - math.pi]}
        for i, a in enumerate(angles)
    ]
    return marine_simulation({"robot": "skiff", "boats": boats}, sea={**_SEA, "components": 20})


def _beaching() -> Simulation:
    """A WAM-V that runs up a shore, in a sea."""
    boat = {"name": "boat", "pose": [150.0, 105.0, 0.0, 0.0, 0.0, 0.4]}
    return marine_simulation({"robot": "wamv", "sensors": "none", "boats": [boat]}, extends="sand_island", sea=_SEA)


def _boat_over() -> Simulation:
    """A WAM-V upside down in a sea."""
    pose = (0.0, 0.0, 1.0, 2.8, 0.3, 0.0)
    boat = {"name": "boat", "pose": list(pose)}
    sim = marine_simulation({"robot": "wamv", "sensors": "none", "boats": [boat]}, sea=_SEA)
    sim.set_boat("boat", pose=pose, velocity=(1.0, 0.0, 0.0, 2.0, 0.5, 0.5))
    return sim


_ROUGH: tuple[tuple[str, Callable[[], Simulation]], ...] = (
    ("a barge that falls in upside down", _capsize),
    ("a barge in waves on the point of breaking", _breaking_sea),
    ("a barge dropped from 5 m", _drop),
    ("20 boats under full power into each other", _pile_up),
    ("a WAM-V that falls in upside down, under full power", _boat_over),
    ("a WAM-V that runs up a shore under full power", _beaching),
)


def _finite() -> Findings:
    """Rough treatment: every state stays finite."""
    rows: list[Row] = []
    for name, made in _ROUGH:
        sim, bad = made(), 0
        commands = {boat: {name: 1.0 for name in sim.command_names(boat) if name in _POWER} for boat in sim.boats}
        try:
            for _ in range(200):
                sim.step(commands, duration=0.1)
                bad += not bool(np.isfinite(sim.data.qpos).all() and np.isfinite(sim.data.qvel).all())
        except DivergedError:
            bad += 1
        rows.append(equal(f"samples of {name} that are not finite", "", 0, bad))
    return Findings(tuple(rows))


CASES = (
    Case(
        name="calm-hour",
        title="An hour in still water",
        setup="assets/validation/worlds/barge.yaml, a barge at rest in still water without damping, for an hour.",
        source="Nothing acts that would move it.",
        files=("physics/panels.py", "physics/vessel.py", "runtime/loop.py"),
        run=_calm_hour,
    ),
    Case(
        name="mirrored",
        title="Mirrored runs",
        setup="The robot skiff with its rudder to port and to starboard, 70 % of power, for 60 s from rest; one "
        "track is mirrored on the x axis.",
        source="The boat is the same on both sides, so the tracks must be.",
        files=("physics/drag.py", "physics/thrust.py", "runtime/loop.py"),
        run=_mirrored,
    ),
    Case(
        name="same-bits",
        title="Equal to the last bit",
        setup="The robot skiff in a sea of 20 components: alone and among 8 boats of which none is near, 20 s; and "
        "four rows of a batch beside single runs of the same seeds, 5 s.",
        source="A boat does not feel how many others there are, nor how its run is computed.",
        files=("runtime/loop.py", "runtime/batch.py"),
        run=_same_bits,
    ),
    Case(
        name="rough-treatment",
        title="Rough treatment",
        setup="The barge of assets/validation/worlds/barge.yaml on its side with 3 rad/s, in waves of 0.14 of their "
        "length, and dropped from 5 m; 20 skiffs at full power into each other in a sea; a WAM-V at full power that "
        "falls in upside down, and one that runs up the shore of Sand Island. 20 s each, looked at ten times a second.",
        source="Numbers stay finite: what breaks, slams or is hit loses energy, and never gains any without bound.",
        files=("runtime/loop.py", "physics/panels.py"),
        run=_finite,
    ),
)
