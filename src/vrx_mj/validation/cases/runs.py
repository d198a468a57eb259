"""Runs as a whole: what stays at rest, is mirrored, equal to the last bit or finite; and VRX's own code beside ours."""

import contextlib
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.errors import DivergedError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.run import run
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import (
    Comparison,
    Outcome,
    TableRow,
    case,
    folder,
    marine_simulation,
    marine_world,
    only_boat,
    packaged_simulation,
    record,
    rows,
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
"""Warnings about the barge, in short waves that are there from the start, and at 7.5 m/s."""
_ON_ITS_SIDE, _OVER = (0.0, 0.0, 0.5, 2.0, 0.4, 0.0), (0.0, 0.0, 1.0, 2.8, 0.3, 0.0)
"""Poses of the barge and of the WAM-V that fall in."""
_TABLES = "oracle"
"""Folder of the tables that VRX's code has made; its README says how."""
_RUNS = (
    "straight_100", "turn_L100_R50", "reverse_100", "decay_heave_p30", "decay_roll_p15", "decay_pitch_p8",
    "drift_wind6_beam", "head_seas_W01", "head_seas_W02", "head_seas_W02_thrust70", "waves_wind_thrust", "zigzag_20",
    "turn_added_mass", "decay_roll_added_mass",
)  # fmt: skip
_ROBOTS = {"wamv": "wamv", "wamv_am1": "wamv_added_mass/robot.yaml"}
"""Robots by the set of coefficients that a run has."""
_STRAIGHT, _TURNED = 20.0, math.radians(20.0)
"""Time before the first turn of the zig-zag [s], and the yaw at which it turns to the other side [rad]."""
_COLUMNS = (
    ("x_m", "x", "m"), ("y_m", "y", "m"), ("z_m", "z", "m"),
    ("roll_rad", "roll", "rad"), ("pitch_rad", "pitch", "rad"), ("yaw_rad", "yaw", "rad"),
)  # fmt: skip
"""Columns of a run, names and units."""
_CHARTS = {
    "zigzag_20": ("Yaw in a zig-zag of 20 degrees", "yaw [degrees]", 5),
    "decay_roll_added_mass": ("Roll let go at 15 degrees, with added mass", "roll [degrees]", 3),
    "head_seas_W02": ("Height of the boat in head seas", "height [m]", 2),
}
"""Charts of runs: title, ordinate, and its column."""
_DESCRIBED = {
    "scale": "scale", "angle": "angle_rad", "steepness": "steepness", "amplitude": "amplitude_m",
    "period": "period_s", "tau": "tau_s", "gain": "gain",
}  # fmt: skip


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
    for text in _WARNED:
        yield Comparison(f"times that it says: {text}", "", 1.0, said.count(text))
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
    angles = [math.tau * i / 20 for i in range(20)]
    boats = [
        {"name": f"boat{i}", "pose": [9.0 * math.cos(a), 9.0 * math.sin(a), 0.0, 0.0, 0.0, a - math.pi]}
        for i, a in enumerate(angles)
    ]
    return marine_simulation({"robot": "skiff", "boats": boats}, sea={**_SEA, "components": 20})


def _wamv(pose: Sequence[float], **keys: object) -> Simulation:
    """A WAM-V in a sea."""
    boat = {"name": "boat", "pose": list(pose)}
    return marine_simulation({"robot": "wamv", "sensors": "none", "boats": [boat]}, sea=_SEA, **keys)


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


_Pilot = Callable[[Simulation, float], None]
"""Sails a run on for a time [s]."""


@cache
def _cases() -> dict[str, TableRow]:
    return {row["case"]: row for row in rows(f"{_TABLES}/trajectories/trajectory_cases")}


def _sea(name: str) -> dict[str, object]:
    """The keys of a sea of VRX's table."""
    if name in {"calm", "none"}:
        return {"model": "none"}
    (row,) = (row for row in rows(f"{_TABLES}/wave_sets") if row["wave_set"] == name)
    other = "amplitude" if row["model"] == "PMS" else "gain"
    numbers: dict[str, object] = {key: row[column] for key, column in _DESCRIBED.items() if key != other}
    direction = [row["dir_x"], row["dir_y"]]
    return {"model": row["model"].lower(), "number": int(row["number"]), "direction": direction, **numbers}


@case("physics/waves.py")
def vrx_seas() -> Outcome:
    """Profile vrx: heights of VRX's seas.

    Worlds of profile vrx with eight seas of VRX's two models, at 60 places and times each.

    Reference: VRX's own C++ (osrf/vrx, gazebo_classic, commit c9b9388), compiled unmodified:
    assets/validation/oracle, whose README says how.
    """
    table = rows(f"{_TABLES}/wave_heights")
    for name in dict.fromkeys(row["wave_set"] for row in table):
        points = [row for row in table if row["wave_set"] == name]
        sim = Simulation(compile_world({"physics": {"profile": "vrx"}, "sea": _sea(name)}))
        x, y, t, theirs = (np.array([row[key] for row in points]) for key in ("x_m", "y_m", "t_s", "h_simple_m"))
        apart = np.abs(sim.sea.height(x, y, t) - theirs).max()
        yield Comparison(f"greatest difference of {len(points)} heights, sea {name}", "m", None, apart)


def _simulation(case: TableRow) -> Simulation:
    wind = {
        "direction": case["wind_dir_deg"],
        "mean_velocity": case["wind_mean_m_s"],
        "var_gain": case["wind_gain"],
        "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}],
    }
    pose = [case[key] for key in ("x0", "y0", "z0", "roll0", "pitch0", "yaw0")]
    spawn = {"robot": _ROBOTS[case["dyn_set"]], "pose": pose, "thrusters": "H", "sensors": "none"}
    return packaged_simulation("vrx_run", sea=_sea(case["wave_set"]), wind=wind, spawn=spawn)


def _steady(case: TableRow) -> _Pilot:
    """Commands that stay the same, as `t>=0:L=1 R=0.5` of the table."""
    sides = dict(part.split("=") for part in case["commands"].partition(":")[2].split())
    commands = {"wamv": {"left": float(sides["L"]), "right": float(sides["R"])}}

    def sail(sim: Simulation, duration: float) -> None:
        sim.step(commands, duration=duration)

    return sail


def _zigzag() -> _Pilot:
    """80 % for 20 s, then to starboard until the yaw passes -20 degrees, to port until +20 degrees, and so on."""
    turns = {0: (0.8, 0.8), -1: (1.0, 0.4), 1: (0.4, 1.0)}
    side = 0

    def sail(sim: Simulation, duration: float) -> None:
        nonlocal side
        for _ in range(sim.steps_in(duration)):
            if side == 0 and sim.time + sim.timestep > _STRAIGHT - 1e-9:
                side = -1
            elif side * sim.observe()["wamv"].heading >= _TURNED:
                side = -side
            left, right = turns[side]
            sim.step({"wamv": {"left": left, "right": right}}, duration=sim.timestep)

    return sail


def _poses_of(case: TableRow) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times (n,), VRX's poses and ours (n, 6) of a case."""
    file = f"{_TABLES}/trajectories/{case['case']}"
    golden = rows(f"{file}__implicit" if case["dyn_set"] == "wamv_am1" else file)
    theirs = np.array([[row[column] for column, *_ in _COLUMNS] for row in golden])
    times = [row["t_s"] for row in golden]
    sail = _zigzag() if case["case"].startswith("zigzag") else _steady(case)
    sim, ours = _simulation(case), []
    for time in times:
        if time > sim.time:
            sail(sim, time - sim.time)
        seen = sim.observe()["wamv"]
        ours.append([*map(float, seen.position), seen.roll, seen.pitch, seen.heading])
    found = np.array(ours)
    found[:, 5] -= math.tau * np.round((found[:, 5] - theirs[:, 5]) / math.tau)  # whole turns are none
    return np.array(times), theirs, found


@case("physics/hydrostatics.py", "physics/drag.py", "physics/thrust.py", "physics/wind.py", "runtime/loop.py")
def vrx_runs() -> Outcome:
    """Profile vrx: runs of VRX's boat.

    assets/validation/worlds/vrx_run.yaml: a WAM-V in a world of profile vrx with a step of 10 ms, ahead, astern, in
    a turn, a zig-zag, free decays, in wind and in waves, 30 to 120 s; a turn and a decay of one with added mass in
    all motions.

    Reference: VRX's own C++ (osrf/vrx, gazebo_classic, commit c9b9388), compiled unmodified:
    assets/validation/oracle, whose README says how. It was integrated with Gazebo's scheme at 1 ms. Runs with added
    mass have it in the mass matrix and were integrated by Runge-Kutta. The band is three times the difference between
    its own results with steps of 1 and 10 ms; for decay_roll_added_mass this is more than the motion itself.
    """
    for name in _RUNS:
        times, theirs, ours = _poses_of(_cases()[name])
        apart = np.abs(ours - theirs).max(axis=0)
        for (_, quantity, unit), value in zip(_COLUMNS, apart.tolist(), strict=True):
            yield Comparison(f"{name}: greatest difference of {quantity}", unit, None, value)
        if name == "turn_L100_R50":
            lines = Series("VRX", theirs[:, 0], theirs[:, 1], reference=True), Series("ours", ours[:, 0], ours[:, 1])
            yield Chart("A turn with 100 and 50 % of power", "x [m]", "y [m]", lines, equal=True)
        if name in _CHARTS:
            title, ordinate, axis = _CHARTS[name]
            shown = [np.degrees(poses[:, axis]) if axis > 2 else poses[:, axis] for poses in (theirs, ours)]
            lines = Series("VRX", times, shown[0], reference=True), Series("ours", times, shown[1])
            yield Chart(title, "time [s]", ordinate, lines)


@case(
    "runtime/loop.py",
    "physics/hydrostatics.py",
    "physics/drag.py",
    "physics/thrust.py",
    "physics/wind.py",
    table="vrx_run",
)
def vrx_kept() -> Outcome:
    """Profile vrx: a recorded run repeated.

    The world example_course with the fleet trio, seed 7, 60 s with left 0.6 and right 0.4.
    """
    sim = Simulation(compile_world("example_course", fleet="trio"))
    sim.reset(seed=7)
    sim.step({boat: {"left": 0.6, "right": 0.4} for boat in sim.boats}, duration=60.0)
    for row in rows("vrx_run"):
        seen = sim.observe()[str(row["boat"])]
        for quantity, columns, unit, ours in (
            ("place", ("x", "y", "z"), "m", seen.position), ("attitude", ("qw", "qx", "qy", "qz"), "", seen.quaternion)
        ):  # fmt: skip
            apart = np.abs(np.array([row[column] for column in columns]) - ours).max()
            yield Comparison(f"{row['boat']}: greatest difference of {quantity} from the record", unit, None, apart)
