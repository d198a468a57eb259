"""What drifts: a neutral sphere in a wave, and boats in a current, in swell and in the wind."""

import math

import numpy as np
from scipy.optimize import brentq

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Outcome, between, case, near
from vrx_mj.validation.setups import GRAVITY, marine_simulation, only_boat, packaged_simulation, record

_ADRIFT = (
    ("skiff", "stern to it", 0.0), ("wamv", "stern to it", 0.0), ("wamv", "beam to it", 0.5 * math.pi),
    ("wamv", "bow into it", math.pi), ("otter", "stern to it", 0.0), ("heron", "stern to it", 0.0),
    ("heron", "bow into it", math.pi),
)  # fmt: skip
"""Robots in a swell, and their headings [rad]; it travels along 0."""


@case("physics/afloat.py", "physics/flotation.py", "physics/kinematics.py", "runtime/loop.py")
def sphere_orbit() -> Outcome:
    """A neutral sphere in a wave.

    assets/validation/worlds/orbit.yaml: a sphere of 0.1 m that weighs what it displaces, 1 m under waves 10 m long
    and 0.2 m high. Orbit and drift are the harmonic and the slope of its track over four periods.

    Reference: Linear theory: orbits of radius a e^(k z); Stokes (1847): drift omega k a^2 e^(2 k z).
    """
    sim, length, amplitude = packaged_simulation("orbit"), 10.0, 0.1
    k = 2.0 * math.pi / length
    omega = math.sqrt(GRAVITY * k)
    sim.step(duration=20.0)
    steps = 800
    part = sim.timestep * round(4.0 * 2.0 * math.pi / omega / steps / sim.timestep)
    t, track = (each[1:] for each in record(sim, lambda sim: sim.observe_object("sphere").position, steps, part))
    radius = amplitude * math.exp(k * float(track[:, 2].mean()))
    basis = np.column_stack([np.cos(omega * t), np.sin(omega * t), np.ones(steps), t])
    up, along = (np.linalg.lstsq(basis, track[:, axis], rcond=None)[0] for axis in (2, 0))
    drift = omega * k * radius**2
    yield near("radius of the orbit, upward", "m", radius, math.hypot(up[0], up[1]), relative=0.02)
    yield near("radius of the orbit, along the waves", "m", radius, math.hypot(along[0], along[1]), relative=0.02)
    yield near("drift", "m/s", drift, along[3], relative=0.10)
    turn = np.linspace(0.0, 2.0 * math.pi, 100)
    x, z = track[: steps // 4, 0], track[: steps // 4, 2]
    circle = Series("circle", x.mean() + radius * np.cos(turn), z.mean() + radius * np.sin(turn), reference=True)
    lines = circle, Series("sphere", x, z)
    yield Chart("Track of the sphere over one period", "along the waves [m]", "height [m]", lines, equal=True)


@case("physics/current.py", "physics/drag.py", "runtime/loop.py")
def current_adrift() -> Outcome:
    """A boat adrift in a current.

    The robots skiff and wamv without commands in flat water with a current of 0.5 m/s, from rest.

    Reference: All forces of the water are on the velocity through it: the boat ends with the current's.
    """
    speed, series = 0.5, []
    for robot in ("skiff", "wamv"):
        sim = marine_simulation({"usv_count": 1, "robot": robot, "sensors": "none"}, current={"speed": speed})
        times, speeds = _speeds(sim, 0, 120.0)
        yield near(f"speed of the {robot} after 120 s", "m/s", speed, speeds[-1], relative=1e-3)
        series.append(Series(robot, times, speeds))
    still = Series("current", [0.0, 120.0], [speed, speed], reference=True)
    yield Chart("Speed of the boats", "time [s]", "speed [m/s]", (still, *series))


@case("physics/kinematics.py", "physics/hydrostatics.py", "physics/vessel.py", "physics/drag.py")
def swell_adrift() -> Outcome:
    """A boat adrift in a long swell.

    Robots without commands in a regular wave of 20 s, 2.48 m in amplitude and 4.96 m from trough to crest: their
    way over 20 periods, after 10. The skiff has VRX's lift; the WAM-V and the Heron are meshes, the Otter is
    matrices.

    Reference: A boat that is short beside the wave drifts with it, by about the water's drift at the surface, omega
    k a^2 (Stokes, 1847), 0.019 m/s; the band is up to three times this. In VRX it drifts against the waves.
    """
    amplitude, period = 2.48, 20.0
    omega = 2.0 * math.pi / period
    stokes = omega * omega**2 / GRAVITY * amplitude**2
    series, times = [], np.zeros(1)
    for robot, name, heading in _ADRIFT:
        boats = [{"name": "a", "pose": [0.0, 0.0, 0.0, 0.0, 0.0, heading]}]
        fleet = {"robot": robot, "boats": boats, "sensors": "none"}
        sim = marine_simulation(fleet, sea={"model": "regular", "height": 2.0 * amplitude, "period": period})
        sim.step(duration=10.0 * period)
        times, x = record(sim, lambda sim: only_boat(sim).position[0], 800, period / 40.0)
        way = x - x[0]
        drift = way[-1] / (times[-1] - times[0])
        yield between(f"drift over 20 periods, {robot}, {name}", "m/s", 0.0, 3.0 * stokes, drift)
        series.append(Series(f"{robot}, {name}", times, way))
    line = Series("Stokes drift", times, stokes * (times - times[0]), reference=True)
    yield Chart("Drift of the boats along the swell", "time [s]", "distance [m]", (line, *series))


@case("physics/windage.py", "physics/wind.py", "physics/drag.py", "runtime/loop.py")
def beam_wind() -> Outcome:
    """A boat in a beam wind.

    assets/validation/worlds/beam_wind.yaml: a boat without engines in a wind of 10 m/s from the side; its speed to
    lee.

    Reference: The root of rho_air / 2 A_L c_y (V - v)^2 = d_1 v + d_2 v^2, with the numbers of the boat's file: the
    apparent wind drives, not the true one. The file's numbers are in both: the row shows that they act, not that a
    boat has them.
    """
    wind = 10.0
    sim = packaged_simulation("beam_wind")
    times, speeds = _speeds(sim, 1, 60.0)
    drift = drift_in_beam_wind(wind)
    yield near("speed after 60 s", "m/s", drift, speeds[-1], relative=1e-3)
    lines = Series("root", [0.0, 60.0], [drift, drift], reference=True), Series("boat", times, speeds)
    yield Chart("Speed to lee", "time [s]", "speed [m/s]", lines)


def drift_in_beam_wind(wind: float) -> float:
    """Speed to lee [m/s] of the boat of beam_wind.yaml in a wind [m/s]."""
    # Half of 1.225 kg/m3, lateral area and coefficient, linear and quadratic drag: numbers of the boat's file.
    return float(brentq(lambda v: 0.5 * 1.225 * 1.1 * 0.9 * (wind - v) ** 2 - 60.0 * v - 220.0 * v * v, 0.0, wind))


def _speeds(sim: Simulation, axis: int, duration: float) -> tuple[FloatArray, FloatArray]:
    """Times and speeds (240,) of the only boat of a run without commands, along an axis of the world."""
    times, places = record(sim, lambda sim: only_boat(sim).position[axis], 240, duration / 240)
    return 0.5 * (times[1:] + times[:-1]), np.diff(places) / np.diff(times)
