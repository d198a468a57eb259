"""Profile `vrx` against VRX's own code: heights of its seas, and runs of its boat."""

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Comparison, Outcome, TableRow, case, rows
from vrx_mj.validation.setups import packaged_simulation

_Pilot = Callable[[Simulation, float], None]
"""Sails a run on for a time [s]."""
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
    found[:, 5] -= 2.0 * np.pi * np.round((found[:, 5] - theirs[:, 5]) / (2.0 * np.pi))  # whole turns are none
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
