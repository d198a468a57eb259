"""What drifts: a neutral sphere in a wave, and boats in a current, in swell and in the wind."""

import math

import numpy as np
from scipy.optimize import brentq

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Case, Findings, between, near
from vrx_mj.validation.setups import GRAVITY, marine_simulation, packaged_simulation

_ADRIFT = (
    ("skiff", "stern to it", 0.0), ("wamv", "stern to it", 0.0), ("wamv", "beam to it", 0.5 * math.pi),
    ("wamv", "bow into it", math.pi), ("otter", "stern to it", 0.0), ("heron", "stern to it", 0.0),
    ("heron", "bow into it", math.pi),
)  # fmt: skip
"""Robots in a swell, and their headings [rad]; it travels along 0."""


def _sphere_orbit() -> Findings:
    """The orbit of a neutral sphere, and its drift."""
    sim, length, amplitude = packaged_simulation("orbit"), 10.0, 0.1
    k = 2.0 * math.pi / length
    omega = math.sqrt(GRAVITY * k)
    sim.step(duration=20.0)
    steps, times, places = 800, [], []
    for _ in range(steps):
        sim.advance(round(4.0 * 2.0 * math.pi / omega / steps / sim.timestep))
        times.append(sim.time)
        places.append(sim.observe_object("sphere").position)
    track, t = np.array(places), np.array(times)
    radius = amplitude * math.exp(k * float(track[:, 2].mean()))
    basis = np.column_stack([np.cos(omega * t), np.sin(omega * t), np.ones(steps), t])
    up, along = (np.linalg.lstsq(basis, track[:, axis], rcond=None)[0] for axis in (2, 0))
    drift = omega * k * radius**2
    rows = (
        near("radius of the orbit, upward", "m", radius, math.hypot(up[0], up[1]), relative=0.02),
        near("radius of the orbit, along the waves", "m", radius, math.hypot(along[0], along[1]), relative=0.02),
        near("drift", "m/s", drift, float(along[3]), relative=0.10),
    )
    circle = np.linspace(0.0, 2.0 * math.pi, 100)
    first = track[: steps // 4]
    chart = Chart(
        "Track of the sphere over one period",
        "along the waves [m]",
        "height [m]",
        (
            Series("circle", first[:, 0].mean() + radius * np.cos(circle), first[:, 2].mean() + radius * np.sin(circle),
                   reference=True),
            Series("sphere", first[:, 0], first[:, 2]),
        ),
        equal=True,
    )  # fmt: skip
    return Findings(rows, (chart,))


def _sailed(sim: Simulation, duration: float, samples: int) -> tuple[FloatArray, FloatArray]:
    """Times (n,) and places (n, 3) of the only boat of a run without commands."""
    (boat,) = sim.boats
    times, places = [sim.time], [sim.observe()[boat].position.copy()]
    for _ in range(samples):
        sim.step(duration=duration / samples)
        times.append(sim.time)
        places.append(sim.observe()[boat].position.copy())
    return np.array(times), np.array(places)


def _current_adrift() -> Findings:
    """Boats adrift in a current."""
    speed, found, series = 0.5, [], []
    for robot in ("skiff", "wamv"):
        sim = marine_simulation({"usv_count": 1, "robot": robot, "sensors": "none"}, current={"speed": speed})
        times, places = _sailed(sim, 120.0, 240)
        speeds = np.diff(places[:, 0]) / np.diff(times)
        found.append(near(f"speed of the {robot} after 120 s", "m/s", speed, float(speeds[-1]), relative=1e-3))
        series.append(Series(robot, 0.5 * (times[1:] + times[:-1]), speeds))
    still = Series("current", [0.0, times[-1]], [speed, speed], reference=True)
    return Findings(tuple(found), (Chart("Speed of the boats", "time [s]", "speed [m/s]", (still, *series)),))


def _swell_adrift() -> Findings:
    """Boats adrift in a long swell."""
    amplitude, period = 2.48, 20.0
    omega = 2.0 * math.pi / period
    stokes = omega * omega**2 / GRAVITY * amplitude**2
    rows, series, times = [], [], np.zeros(1)
    for robot, name, heading in _ADRIFT:
        boats = [{"name": "a", "pose": [0.0, 0.0, 0.0, 0.0, 0.0, heading]}]
        fleet = {"robot": robot, "boats": boats, "sensors": "none"}
        sim = marine_simulation(fleet, sea={"model": "regular", "height": 2.0 * amplitude, "period": period})
        sim.step(duration=10.0 * period)
        times, places = _sailed(sim, 20.0 * period, 800)
        way = places[:, 0] - places[0, 0]
        drift = float(way[-1] / (times[-1] - times[0]))
        rows.append(between(f"drift over 20 periods, {robot}, {name}", "m/s", 0.0, 3.0 * stokes, drift))
        series.append(Series(f"{robot}, {name}", times, way))
    line = Series("Stokes drift", times, stokes * (times - times[0]), reference=True)
    return Findings(tuple(rows), (Chart("Way of the boats along the swell", "time [s]", "way [m]", (line, *series)),))


def _beam_wind() -> Findings:
    """A boat that the wind drives sideways."""
    wind = 10.0
    sim = packaged_simulation("beam_wind")
    times, places = _sailed(sim, 60.0, 240)
    speeds = np.diff(places[:, 1]) / np.diff(times)
    # Half of 1.225 kg/m3, lateral area and coefficient, linear and quadratic drag: numbers of the boat's file.
    drift = float(brentq(lambda v: 0.5 * 1.225 * 1.1 * 0.9 * (wind - v) ** 2 - 60.0 * v - 220.0 * v * v, 0.0, wind))
    chart = Chart(
        "Speed to lee",
        "time [s]",
        "speed [m/s]",
        (
            Series("root", [0.0, times[-1]], [drift, drift], reference=True),
            Series("boat", 0.5 * (times[1:] + times[:-1]), speeds),
        ),
    )
    return Findings((near("speed after 60 s", "m/s", drift, float(speeds[-1]), relative=1e-3),), (chart,))


CASES = (
    Case(
        name="sphere-orbit",
        title="A neutral sphere in a wave",
        setup="assets/validation/worlds/orbit.yaml: a sphere of 0.1 m that weighs what it displaces, 1 m under "
        "waves 10 m long and 0.2 m high. Orbit and drift are the harmonic and the slope of its track over four "
        "periods.",
        source="Linear theory: orbits of radius a e^(k z); Stokes (1847): drift omega k a^2 e^(2 k z).",
        files=("physics/afloat.py", "physics/flotation.py", "physics/kinematics.py", "runtime/loop.py"),
        run=_sphere_orbit,
    ),
    Case(
        name="current-adrift",
        title="A boat adrift in a current",
        setup="The robots skiff and wamv without commands in flat water with a current of 0.5 m/s, from rest.",
        source="All forces of the water are on the velocity through it: the boat ends with the current's.",
        files=("physics/current.py", "physics/drag.py", "runtime/loop.py"),
        run=_current_adrift,
    ),
    Case(
        name="swell-adrift",
        title="A boat adrift in a long swell",
        setup="Robots without commands in a regular wave of 20 s, 2.48 m in amplitude and 4.96 m from trough to "
        "crest: their way over 20 periods, after 10. The skiff has VRX's lift; the WAM-V and the Heron are meshes, the "
        "Otter is matrices.",
        source="A boat that is short beside the wave drifts with it, by about the water's drift at the surface, "
        "omega k a^2 (Stokes, 1847), 0.019 m/s; the band is up to three times this. In VRX it drifts against the "
        "waves.",
        files=("physics/kinematics.py", "physics/hydrostatics.py", "physics/vessel.py", "physics/drag.py"),
        run=_swell_adrift,
    ),
    Case(
        name="beam-wind",
        title="A boat in a beam wind",
        setup="assets/validation/worlds/beam_wind.yaml: a boat without engines in a wind of 10 m/s from the side; "
        "its speed to lee.",
        source="The root of rho_air / 2 A_L c_y (V - v)^2 = d_1 v + d_2 v^2, with the numbers of the boat's file: "
        "the apparent wind drives, not the true one. The file's numbers are in both: the row shows that they act, not "
        "that a boat has them.",
        files=("physics/windage.py", "physics/wind.py", "physics/drag.py", "runtime/loop.py"),
        run=_beam_wind,
    ),
)
