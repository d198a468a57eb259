"""Runs as a whole: what stays at rest, what is mirrored, what is equal to the last bit, and what must stay finite."""

import contextlib
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from vrx_mj.draw.chart import Chart, Series
from vrx_mj.errors import DivergedError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.run import run
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Comparison, Outcome, case, folder
from vrx_mj.validation.setups import (
    marine_simulation,
    marine_world,
    only_boat,
    packaged_simulation,
    record,
    with_boat_at,
)

_SKIFF: Mapping[str, Any] = {"usv_count": 1, "robot": "skiff"}
_SEA = {"model": "jonswap", "significant_height": 0.4, "peak_period": 4.0, "spreading": 10.0}
_BREAKING = {"model": "regular", "height": 2.2, "period": 3.2}
"""0.14 of its length high: the steepest that a world takes."""

_POWER = ("propeller", "left", "right")
"""Commands of engines that push ahead."""


_SWING = (0.0002914, -0.01), (0.0530641 - 2.505674 * 0.01, -0.000204)
"""Height [m] and pitch [rad] of a barge at 2.51 m/s, and their rates in body axes: the motion that grows most."""
_WARNED = (
    "waves shorter than its waterline of 4 m",
    "a sea that is there from the start makes it swing, which does not fade",
    "at 2.51 m/s, a Froude number of 0.4, steps of 0.01 s add 118 % a minute",
    "makes 7.5 m/s on a waterline of 4 m, a Froude number of 1.2",
)
"""What is said of the barge, in short waves that are there from the start, and at 7.5 m/s."""


@case("mjcf/hulls.py", "runtime/run.py", "runtime/loop.py")
def limits_said() -> Outcome:
    """Warnings of what is beyond the model.

    assets/validation/worlds/barge.yaml, whose hull has no damping, in a regular wave of 1.4 s without a ramp, and for a
    step at 7.5 m/s: four warnings are expected with their figures. Then in still water at 2.51 m/s, a Froude
    number of 0.4, oscillating in heave and pitch: the growth of the squares of its pitch in 25 s, as a share a minute.

    Reference: Each warning once. The gain is that of the warning: 118 % a minute, by the eigenvalues of the integrator
    v' = v + dt a(v, s), s' = s + dt v' with the linear forces of added mass at that speed.
    """
    with warnings.catch_warnings(record=True) as caught, contextlib.chdir(folder() / "worlds"):
        warnings.simplefilter("always", VrxWarning)
        wave = {"model": "regular", "height": 0.05, "period": 1.4}
        sim = Simulation(compile_world({"extends": "./barge.yaml", "name": "barge", "sea": wave}))
        sim.set_boat(sim.boats[0], velocity=(7.5, 0.0, 0.0, 0.0, 0.0, 0.0))
        run(sim, sim.timestep)
    said = " ".join(str(item.message) for item in caught)
    yield from (Comparison(f"times that it says: {text}", "", 1.0, said.count(text)) for text in _WARNED)
    sim, ((z, pitch), (w, q)) = packaged_simulation("barge"), _SWING
    sim.set_boat(sim.boats[0], pose=(0.0, 0.0, z, 0.0, pitch, 0.0), velocity=(2.505674, 0.0, w, 0.0, q, 0.0))
    _, found = record(sim, lambda sim: only_boat(sim).pitch, 3500, sim.timestep)
    growth = np.square(found[2500:]).mean() / np.square(found[:1001]).mean()
    yield Comparison("gain of the run", "% a minute", 118.0, 100.0 * (growth ** (60.0 / 25.0) - 1.0))


@case("physics/panels.py", "physics/vessel.py", "runtime/loop.py")
def calm_hour() -> Outcome:
    """An hour in still water.

    assets/validation/worlds/barge.yaml, a barge at rest in still water without damping, for an hour.

    Reference: No force acts that could move it.
    """
    _, places = record(packaged_simulation("barge"), lambda sim: only_boat(sim).position, 60, 60.0)
    yield Comparison("greatest distance from its place", "m", None, np.linalg.norm(places[1:], axis=1).max())


@case("physics/drag.py", "physics/thrust.py", "runtime/loop.py")
def mirrored() -> Outcome:
    """Mirrored runs.

    The robot skiff with its rudder to port and to starboard, 70 % of power, for 60 s from rest; one track is
    mirrored on the x axis.

    Reference: The boat is the same on both sides, so the tracks must be.
    """
    port, starboard = (
        record(marine_simulation(_SKIFF), _place, 240, 0.25, propeller=0.7, rudder_angle=angle)[1][1:]
        for angle in (0.3, -0.3)
    )
    apart = np.abs(port[:, :2] - starboard[:, :2] * (1.0, -1.0)).max()
    turned = np.abs(np.sin(port[:, 2] + starboard[:, 2])).max()
    yield Comparison("greatest distance between the one and the mirrored other", "m", None, apart)
    yield Comparison("greatest difference of heading", "rad", None, turned)
    lines = (
        Series("to port", port[:, 0], port[:, 1], reference=True),
        Series("to starboard, mirrored", starboard[:, 0], -starboard[:, 1]),
    )
    yield Chart("Tracks, rudder 0.3 rad", "x [m]", "y [m]", lines, equal=True)


def _place(sim: Simulation) -> tuple[float, float, float]:
    """Place [m] and heading [rad] of the only boat."""
    seen = only_boat(sim)
    return float(seen.position[0]), float(seen.position[1]), seen.heading


@case("runtime/loop.py", "runtime/batch.py")
def same_bits() -> Outcome:
    """Equal to the last bit.

    The robot skiff in a sea of 20 components: alone and among 8 boats of which none is near, 20 s; and four rows of
    a batch compared with single runs of the same seeds, 5 s.

    Reference: The motion of a boat does not depend on the number of other boats, nor on how its run is computed.
    """
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
    yield Comparison("numbers of a boat's pose that differ alone and among 8", "", 0, apart.sum())
    yield Comparison("rows of a batch of 4 whose state differs from a single run", "", 0, different)


def _pile_up() -> Simulation:
    """Twenty boats close together, all with the bow to the middle and under full power."""
    angles = [2.0 * math.pi * i / 20 for i in range(20)]
    boats = [
        {"name": f"boat{i}", "pose": [9.0 * math.cos(a), 9.0 * math.sin(a), 0.0, 0.0, 0.0, a - math.pi]}
        for i, a in enumerate(angles)
    ]
    return marine_simulation({"robot": "skiff", "boats": boats}, sea={**_SEA, "components": 20})


def _wamv(pose: Sequence[float], **keys: object) -> Simulation:
    """A WAM-V in a sea."""
    boat = {"name": "boat", "pose": list(pose)}
    return marine_simulation({"robot": "wamv", "sensors": "none", "boats": [boat]}, sea=_SEA, **keys)


_ON_ITS_SIDE, _OVER = (0.0, 0.0, 0.5, 2.0, 0.4, 0.0), (0.0, 0.0, 1.0, 2.8, 0.3, 0.0)
"""Poses of the barge and of the WAM-V that fall in."""
_ROUGH: Mapping[str, Callable[[], Simulation]] = {
    "a barge that falls in upside down": lambda: with_boat_at(
        packaged_simulation("barge"), _ON_ITS_SIDE, (0.0, 0.0, 0.0, 3.0, 1.0, 0.0)
    ),
    "a barge in waves on the point of breaking": lambda: packaged_simulation("barge", sea=_BREAKING),
    "a barge dropped from 5 m": lambda: with_boat_at(packaged_simulation("barge"), (0.0, 0.0, 5.0, 0.3, 0.2, 0.0)),
    "20 boats under full power into each other": _pile_up,
    "a WAM-V that falls in upside down, under full power": lambda: with_boat_at(
        _wamv(_OVER), _OVER, (1.0, 0.0, 0.0, 2.0, 0.5, 0.5)
    ),
    "a WAM-V that runs up a shore under full power": lambda: _wamv(
        (150.0, 105.0, 0.0, 0.0, 0.0, 0.4), extends="sand_island"
    ),
}


@case("runtime/loop.py", "physics/panels.py")
def rough_treatment() -> Outcome:
    """Rough treatment.

    The barge of assets/validation/worlds/barge.yaml on its side with 3 rad/s, in waves of 0.14 of their length, and
    dropped from 5 m; 20 skiffs that collide at full power in a sea; a WAM-V at full power that falls in upside
    down, and one that runs up the shore of Sand Island. 20 s each, checked ten times a second.

    Reference: Numbers stay finite: impacts dissipate energy, and no motion grows without bound.
    """
    for name, made in _ROUGH.items():
        sim, bad = made(), 0
        commands = {boat: {name: 1.0 for name in sim.command_names(boat) if name in _POWER} for boat in sim.boats}
        try:
            for _ in range(200):
                sim.step(commands, duration=0.1)
                bad += not bool(np.isfinite(sim.data.qpos).all() and np.isfinite(sim.data.qvel).all())
        except DivergedError:
            bad += 1
        yield Comparison(f"samples of {name} that are not finite", "", 0, bad)
