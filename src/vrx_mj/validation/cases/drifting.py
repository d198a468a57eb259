"""What drifts: spheres and boats in waves, current and wind, the current itself, moorings; and radiating spheres."""

import json
import math
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation_matrix
from vrx_mj.packages import root
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import (
    GRAVITY,
    PHYSICS,
    Comparison,
    Outcome,
    TableRow,
    autocorrelation,
    case,
    marine_simulation,
    one_boat,
    only_boat,
    packaged_simulation,
    record,
    rows,
    unit,
    with_boat_at,
)

_MEMORY = ("physics/vessel.py", "adapters/pole_fit.py", "adapters/hydro.py")
_IEA_EXTREMES = (
    ("first trough", 2.21, 2.23, -0.892, -0.868),
    ("first crest", 4.37, 4.45, 0.631, 0.651),
    ("second trough", 6.52, 6.63, -0.496, -0.466),
)
"""Times [s] and heights [m] after a drop of 1 m: five codes and CFD."""
_HEAVE = {3.0: (0.115, 0.118), 4.0: (0.99, 1.18), 4.4: (1.77, 1.88), 5.0: (1.42, 1.53), 6.0: (1.12, 1.16),
         8.0: (1.03, 1.03), 11.0: (1.01, 1.01)}  # fmt: skip
"""Heave over the amplitude of the wave by its period [s]: lowest and highest of the codes."""
_RADIUS = 5.0
_NUMBERS = (0.3, 0.5, 0.7, 1.0, 1.4, 2.0)
"""Wavenumbers times radius at which radiation is compared; the decay's is 1.03."""
_RELATIVE = {4.4: 1.70, 5.0: 1.48, 11.0: 1.00}
"""Heave over the amplitude by period [s] without diffraction, in the relative form, in the frequency domain."""
_ADRIFT = (
    ("skiff", "stern to it", 0.0), ("wamv", "stern to it", 0.0), ("wamv", "beam to it", 0.5 * math.pi),
    ("wamv", "bow into it", math.pi), ("otter", "stern to it", 0.0), ("heron", "stern to it", 0.0),
    ("heron", "bow into it", math.pi),
)  # fmt: skip
"""Robots in a swell, and their headings [rad]; it travels along 0."""
_DEPTHS = (0.5, 2.0, 4.0, 7.5, 12.0)
"""Depths of the drogues in drogues.yaml [m]."""
_PROFILE = ((0.0, 1.0), (1.0, 1.0), (5.0, 0.6), (10.0, 0.1))
"""Shares of the current by depth [m]."""
_MEAN, _TOWARD = 0.3, 30.0
"""Mean speed [m/s] and its direction [degrees]."""
_MAJOR, _MINOR, _AXIS, _PERIOD, _PHASE = 0.6, -0.25, 70.0, 300.0, 40.0
"""Tide: half axes [m/s], direction of the longer [degrees], period [s], phase [degrees]."""
_DEVIATION, _KEPT = 0.1, 2.0
"""Standard deviation [m/s] and time constant [s] of the random part."""
_RECORD, _SAMPLE = 7200.0, 0.2
"""Length of its record, and time between samples [s]."""
_CURRENT_FILES = ("physics/conditions.py", "physics/flotation.py", "runtime/loop.py")
_MASS = 1025.0 * 4.0 / 3.0 * math.pi * 0.5**3
_DRAG = 0.05 * _MASS
"""Drag of the sphere [N s/m]."""
_LENGTH, _STIFFNESS = 3.0, 200.0
_DEPTH = 5.0
_MOORING_FILES = ("physics/afloat.py", "physics/flotation.py", "physics/conditions.py", "runtime/loop.py")


def _decay(world: str, drop: float, until: float, **keys: object) -> tuple[FloatArray, FloatArray]:
    """Times [s] and heights [m] of a sphere that is let go at a height."""
    sim = with_boat_at(packaged_simulation(world, **keys), (0.0, 0.0, drop, 0.0, 0.0, 0.0))
    count = round(until / sim.timestep)
    _, heights = record(sim, lambda sim: only_boat(sim).position[2], count, sim.timestep)
    return np.arange(count + 1, dtype=np.float64) * sim.timestep, heights


def _extremes(times: FloatArray, heights: FloatArray) -> list[tuple[float, float]]:
    """Times and heights of crests and troughs after the start: of the parabola through three samples."""
    found = []
    for i in range(1, len(heights) - 1):
        before, here, after = heights[i - 1 : i + 2]
        if (here - before) * (after - here) <= 0.0 and here != after:
            shift = 0.5 * (before - after) / (before - 2.0 * here + after)
            top = here - 0.25 * (before - after) * shift
            found.append((float(times[i] + shift * (times[1] - times[0])), float(top)))
    return found


def _in_theory() -> list[TableRow]:
    """Extremes of linear theory with the buoyancy of the sphere's shape."""
    return [each for each in rows("hemisphere_decay") if each["theory"] == "restoring"]


@case(*_MEMORY)
def sphere_decay() -> Outcome:
    """Free decay of a sphere with wave radiation.

    assets/validation/worlds/iea_sphere.yaml: radius 5 m, 261.8 t, half under water of 1000 kg/m3, released 1 m too
    high. Added mass and memory are from Capytaine: make_spheres.py.

    Reference: Wendt et al. (2019), benchmark of IEA OES: lowest and highest of five codes and CFD.
    """
    times, heights = _decay("iea_sphere", 1.0, 12.0)
    exact = {each["extreme"]: each["height"] for each in _in_theory()}
    for (name, *_), (time, height) in zip(_IEA_EXTREMES, _extremes(times, heights), strict=False):
        yield Comparison(f"{name}, height", "m", None, height, theory=exact[name])
        yield Comparison(f"{name}, time", "s", None, time)
    middles = [(0.5 * (early + late), 0.5 * (low + high)) for _, early, late, low, high in _IEA_EXTREMES]
    at, of = np.array(middles).T
    lines = Series("five codes and CFD", at, of, kind="points", reference=True), Series("ours", times, heights)
    yield Chart("Height of the sphere", "time [s]", "height [m]", lines)


@case(*_MEMORY, table="hemisphere_decay")
def sphere_theory() -> Outcome:
    """Free decay of a sphere, in theory.

    assets/validation/worlds/iea_sphere.yaml as in sphere-decay, in steps of 1 ms: at 10 ms the motion is half a step
    early.
    """
    times, heights = _decay("iea_sphere", 1.0, 8.0, physics={**PHYSICS, "timestep": 0.001})
    for each, (time, height) in zip(_in_theory(), _extremes(times, heights), strict=False):
        name = each["extreme"]
        yield Comparison(f"{name}, height", "m", each["height"], height)
        yield Comparison(f"{name}, time", "s", each["time"], time)


@case(*_MEMORY)
def sphere_tank() -> Outcome:
    """Free decay of a sphere in a tank.

    assets/validation/worlds/kramer_sphere.yaml: diameter 0.3 m, 7.056 kg, water of 998.2 kg/m3, g 9.82 m/s2, released
    at 30, 90 and 150 mm.

    Reference: Kramer et al. (2021), Highly accurate experimental heave decay tests with a floating sphere.
    """
    series, crests = [], []
    for drop in (0.03, 0.09, 0.15):
        times, heights = _decay("kramer_sphere", drop, 2.0)
        series.append(Series(f"{1000.0 * drop:g} mm", times, heights / drop))
        crests.append(_extremes(times, heights)[1])
    time, height = crests[0]
    yield Comparison("next crest after 30 mm, time", "s", None, time)
    yield Comparison("next crest after 30 mm, share of the drop", "", None, height / 0.03)
    for name, (before, after) in zip((90, 150), pairwise(crests), strict=True):
        yield Comparison(f"next crest after {name} mm, later than before", "s", None, after[0] - before[0])
    measured = Series("measured crest after 30 mm", [0.7635], [0.64], kind="points", reference=True)
    yield Chart("Height over the drop", "time [s]", "height / drop", (measured, *series))


def _heave(period: float, world: str) -> float:
    """Heave over the amplitude of a low wave of a period [s], when what the start left has faded."""
    height, step = 0.1, 0.05
    sea = {"model": "regular", "height": height, "period": period, "density": 1000.0}
    sim = packaged_simulation(world, sea=sea)
    seen, places = record(sim, lambda sim: only_boat(sim).position, round(30.0 * period / step), step)
    last = slice(-round(5.0 * period / step), None)
    times, (x, _, z) = seen[last], places[last].T
    omega = math.tau / period
    turned = z * np.exp(1j * (omega * times - omega**2 / 9.81 * x))  # it drifts with the waves
    return float(2.0 * abs(turned.mean()) / (0.5 * height))


@case(*_MEMORY, quick=False)
def sphere_heave() -> Outcome:
    """Heave of a sphere in regular waves.

    assets/validation/worlds/iea_sphere.yaml in waves of 0.1 m, for 30 periods, with the forces of diffraction in
    its file; in iea_sphere_relative.yaml without, by the relative form.

    Reference: Wendt et al. (2019): lowest and highest of the codes, within 2 %. Relative form: (C_FK - omega2 A + i
    omega B) of the water's motion at the depth of the centre of buoyancy, in the mean over the waterplane, 2 J1(k R) /
    (k R) of that at its middle, in the frequency domain.
    """
    points = []
    for period in _HEAVE:
        points.append(_heave(period, "iea_sphere"))
        yield Comparison(f"heave at {period:g} s", "", None, points[-1])
    for period, reference in _RELATIVE.items():
        points.append(_heave(period, "iea_sphere_relative"))
        yield Comparison(f"heave at {period:g} s, relative form", "", reference, points[-1])
    periods, middle, count = list(_HEAVE), [0.5 * sum(pair) for pair in _HEAVE.values()], len(_HEAVE)
    lines = (
        Series("codes", periods, middle, kind="points", reference=True),
        Series("ours, with diffraction", periods, points[:count]),
        Series("ours, relative form", list(_RELATIVE), points[count:], kind="points"),
    )
    yield Chart("Heave over the wave's amplitude", "period [s]", "heave / amplitude", lines)


@case("adapters/hydro.py", table="hemisphere")
def hemisphere() -> Outcome:
    """Radiation of a hemisphere in heave.

    assets/robots/sphere/hydro.json, which Capytaine computed with 2592 panels.

    Reference: Hulme (1982): 0.831 of the displaced mass at frequency 0, 0.5 at infinite frequency. Between:
    """
    table = json.loads((root() / "assets" / "robots" / "sphere" / "hydro.json").read_text(encoding="utf-8"))
    displaced = table["density"] * 2.0 / 3.0 * math.pi * _RADIUS**3
    yield Comparison("A33 / (rho V), frequency 0", "", 0.831, table["added_mass_zero"][2][2] / displaced)
    yield Comparison("A33 / (rho V), infinite", "", 0.5, table["added_mass_infinite"][2][2] / displaced)
    omega = np.array(table["frequencies"])
    numbers = omega**2 * _RADIUS / table["gravity"]
    ours = {
        "A33 / (rho V)": np.array(table["added_mass"])[:, 2, 2] / displaced,
        "B33 / (rho V omega)": np.array(table["damping"])[:, 2, 2] / (displaced * omega),
    }
    exact = np.array([list(each.values()) for each in rows("hemisphere")]).T
    for name, reference in zip(ours, exact[1:], strict=True):
        lines = (
            Series("multipoles", exact[0], reference, kind="points", reference=True),
            Series("ours", numbers, ours[name]),
        )
        yield Chart(name, "k a", name, lines)
        for ka, value in zip(exact[0], reference, strict=True):
            if ka in _NUMBERS:
                yield Comparison(f"{name}, k a {ka:g}", "", value, _at(ka, numbers, ours[name]))


def _at(number: float, numbers: FloatArray, values: FloatArray) -> float:
    """A value between samples, by the cubic through the four around it."""
    first = int(np.searchsorted(numbers, number)) - 2
    x, y = numbers[first : first + 4], values[first : first + 4]
    return float(sum(y[i] * np.prod([(number - x[j]) / (x[i] - x[j]) for j in range(4) if j != i]) for i in range(4)))


@case("physics/afloat.py", "physics/flotation.py", "physics/kinematics.py", "runtime/loop.py")
def sphere_orbit() -> Outcome:
    """A neutral sphere in a wave.

    assets/validation/worlds/orbit.yaml: a neutrally buoyant sphere of 0.1 m, 1 m under waves 10 m long
    and 0.2 m high. Orbit and drift are the harmonic and the slope of its track over four periods.

    Reference: Linear theory: orbits of radius a e^(k z); Stokes (1847): drift omega k a^2 e^(2 k z).
    """
    sim, length, amplitude = packaged_simulation("orbit"), 10.0, 0.1
    k = math.tau / length
    omega = math.sqrt(GRAVITY * k)
    sim.step(duration=20.0)
    steps = 800
    part = sim.timestep * round(4.0 * math.tau / omega / steps / sim.timestep)
    t, track = (each[1:] for each in record(sim, lambda sim: sim.observe_object("sphere").position, steps, part))
    radius = amplitude * math.exp(k * float(track[:, 2].mean()))
    basis = np.column_stack([np.cos(omega * t), np.sin(omega * t), np.ones(steps), t])
    up, along = (np.linalg.lstsq(basis, track[:, axis], rcond=None)[0] for axis in (2, 0))
    drift = omega * k * radius**2
    yield Comparison("radius of the orbit, upward", "m", radius, math.hypot(up[0], up[1]))
    yield Comparison("radius of the orbit, along the waves", "m", radius, math.hypot(along[0], along[1]))
    yield Comparison("drift", "m/s", drift, along[3])
    turn = np.linspace(0.0, math.tau, 100)
    x, z = track[: steps // 4, 0], track[: steps // 4, 2]
    circle = Series("circle", x.mean() + radius * np.cos(turn), z.mean() + radius * np.sin(turn), reference=True)
    lines = circle, Series("sphere", x, z)
    yield Chart("Track of the sphere over one period", "along the waves [m]", "height [m]", lines, equal=True)


@case("physics/conditions.py", "physics/drag.py", "runtime/loop.py")
def current_adrift() -> Outcome:
    """A boat adrift in a current.

    The robots skiff and wamv without commands in flat water with a current of 0.5 m/s, from rest.

    Reference: All forces of the water depend on the velocity through it, so the boat ends at the current's velocity.
    """
    speed, series = 0.5, []
    for robot in ("skiff", "wamv"):
        sim = marine_simulation({"usv_count": 1, "robot": robot, "sensors": "none"}, current={"speed": speed})
        times, speeds = _speeds(sim, 0, 120.0)
        yield Comparison(f"speed of the {robot} after 120 s", "m/s", speed, speeds[-1])
        series.append(Series(robot, times, speeds))
    still = Series("current", [0.0, 120.0], [speed, speed], reference=True)
    yield Chart("Speed of the boats", "time [s]", "speed [m/s]", (still, *series))


@case("physics/kinematics.py", "physics/hydrostatics.py", "physics/vessel.py", "physics/drag.py")
def swell_adrift() -> Outcome:
    """A boat adrift in a long swell.

    Robots without commands in a regular wave of 20 s, 2.48 m in amplitude and 4.96 m from trough to crest: their
    drift over 20 periods, after 10. The skiff, the WAM-V and the Heron have meshes, the Otter has matrices.

    Reference: A boat that is short compared with the wave drifts with it, at about the speed of the water at the
    surface, omega k a^2 (Stokes, 1847), 0.019 m/s; the band is up to three times this. In VRX it drifts against the
    waves.
    """
    amplitude, period = 2.48, 20.0
    omega = math.tau / period
    stokes = omega * omega**2 / GRAVITY * amplitude**2
    series, times = [], np.zeros(1)
    for robot, name, heading in _ADRIFT:
        fleet = one_boat(robot, heading, sensors="none")
        sim = marine_simulation(fleet, sea={"model": "regular", "height": 2.0 * amplitude, "period": period})
        sim.step(duration=10.0 * period)
        times, x = record(sim, lambda sim: only_boat(sim).position[0], 800, period / 40.0)
        way = x - x[0]
        drift = way[-1] / (times[-1] - times[0])
        yield Comparison(f"drift over 20 periods, {robot}, {name}", "m/s", None, drift)
        series.append(Series(f"{robot}, {name}", times, way))
    line = Series("Stokes drift", times, stokes * (times - times[0]), reference=True)
    yield Chart("Drift of the boats along the swell", "time [s]", "distance [m]", (line, *series))


@case("physics/wind.py", "physics/drag.py", "runtime/loop.py")
def beam_wind() -> Outcome:
    """A boat in a beam wind.

    assets/validation/worlds/beam_wind.yaml: a boat without engines in a wind of 10 m/s from the side; its speed to
    leeward.

    Reference: The root of rho_air / 2 A_L c_y (V - v)^2 = d_1 v + d_2 v^2, with the numbers of the boat's file: the
    apparent wind drives the boat, not the true one. Both sides use the file's numbers: the row shows that they act, not
    that a real boat has them.
    """
    wind = 10.0
    sim = packaged_simulation("beam_wind")
    times, speeds = _speeds(sim, 1, 60.0)
    drift = drift_in_beam_wind(wind)
    yield Comparison("speed after 60 s", "m/s", drift, speeds[-1])
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


def _velocity(sim: Simulation, name: str) -> FloatArray:
    """Velocity (2,) toward east and north [m/s]."""
    seen = sim.observe_object(name)
    return (np.array(rotation_matrix(seen.quaternion)) @ seen.velocity)[:2]


@case(*_CURRENT_FILES)
def current_tide() -> Outcome:
    """A tide over the depth.

    assets/validation/worlds/drogues.yaml: neutral spheres with high drag, 0.5 to 12 m deep, in a current of 0.3 m/s
    toward 30 degrees with a tide of 0.6 and 0.25 m/s, turning clockwise, over a profile. Their velocities over the
    second of its periods of 300 s: mean and first harmonic.

    Reference: Mean and ellipse of the world's file, times the profile, interpolated linearly between its depths.
    """
    current = {
        "speed": _MEAN, "direction": _TOWARD, "profile": _PROFILE,
        "tide": {"speed": _MAJOR, "minor": _MINOR, "direction": _AXIS, "period": _PERIOD, "phase": _PHASE},
    }  # fmt: skip
    sim, samples, names = packaged_simulation("drogues", current=current), 300, [f"drogue{n}" for n in range(1, 6)]
    sim.step(duration=_PERIOD)
    times, found = record(sim, lambda sim: [_velocity(sim, name) for name in names], samples, _PERIOD / samples)
    phase, seen = math.tau / _PERIOD * times[1:], found[1:]
    mean = seen.mean(axis=0)
    swing = 2.0 * np.tensordot(np.exp(-1j * phase), seen, 1) / samples  # of e^(i omega t)
    shares = np.interp(_DEPTHS, *np.transpose(_PROFILE))
    turn = np.exp(1j * math.radians(_PHASE))
    for depth, share, steady, wave in zip(_DEPTHS, shares.tolist(), mean, swing, strict=True):
        at = f"at {depth:g} m"
        along, across = (complex(wave @ unit(angle) / turn) for angle in (_AXIS, _AXIS + 90.0))
        yield Comparison(f"mean {at}", "m/s", share * _MEAN, steady @ unit(_TOWARD))
        yield Comparison(f"greatest tide {at}", "m/s", share * _MAJOR, along.real)
        yield Comparison(f"least tide {at}, clockwise", "m/s", share * _MINOR, -across.imag)
    yield _ellipses(seen, shares, phase)


def _ellipses(seen: FloatArray, shares: FloatArray, phase: FloatArray) -> Chart:
    """Chart of what the arrow of the current draws at the surface, in the middle and at the bottom of the profile."""
    series: list[Series] = []
    angle = phase + math.radians(_PHASE)
    ring = np.outer(_MAJOR * np.cos(angle), unit(_AXIS)) + np.outer(_MINOR * np.sin(angle), unit(_AXIS + 90.0))
    for number in (0, 2, 4):
        east, north = (shares[number] * (_MEAN * unit(_TOWARD) + ring)).T
        series.append(Series("closed form", east, north, reference=True))
        series.append(Series(f"{_DEPTHS[number]:g} m", seen[::10, number, 0], seen[::10, number, 1], kind="points"))
    return Chart("Velocity over a period, by depth", "east [m/s]", "north [m/s]", series, equal=True)


@case(*_CURRENT_FILES)
def current_random() -> Outcome:
    """The random part of a current.

    assets/validation/worlds/drogue_random.yaml: one of these spheres in a current with a random part only, 0.1 m/s
    with a time constant of 2 s: 2 h, every 0.2 s.

    Reference: Gauss-Markov process: variance sigma^2, correlation e^(-t / tau). The bands are three standard
    deviations of what a record of T = 3600 tau shows in two components: of the variance and of the correlation
    between them sqrt(tau / T), of the correlation after tau by Bartlett (1946) sqrt((1 - 3 e^-2) tau / (2 T)).
    """
    current = {"var_gain": _DEVIATION, "var_time": _KEPT, "seed": 1}
    sim = packaged_simulation("drogue_random", current=current)
    sim.step(duration=20.0)
    _, found = record(sim, lambda sim: _velocity(sim, "drogue"), round(_RECORD / _SAMPLE), _SAMPLE)
    off = found[1:] - found[1:].mean(axis=0)
    lags = np.arange(round(3.0 * _KEPT / _SAMPLE) + 1)
    variance, kept = autocorrelation(off, lags)
    one = np.interp(_KEPT / _SAMPLE, lags, kept)
    mixed = (off[:, 0] * off[:, 1]).mean() / variance
    yield Comparison("variance over its closed form", "", 1.0, variance / _DEVIATION**2)
    yield Comparison("correlation after a time constant", "", math.exp(-1.0), one)
    yield Comparison("correlation between east and north", "", 0.0, mixed)
    times = _SAMPLE * lags
    lines = Series("closed form", times, np.exp(-times / _KEPT), reference=True), Series("ours", times, kept)
    yield Chart("Correlation of the random part", "lag [s]", "correlation", lines)


def _offset(speed: float) -> float:
    """How far from its anchor [m] a rope holds the sphere in a current [m/s]."""
    return _LENGTH + _DRAG * speed / _STIFFNESS


def _track(sim: Simulation, place: tuple[float, float], duration: float) -> tuple[FloatArray, FloatArray]:
    """Times (n,) and places (n, 2) of the sphere after it is let go at a place."""
    sim.set_object("sphere", pose=(*place, -_DEPTH, 0.0, 0.0, 0.0), velocity=[0.0] * 6)
    times, places = record(sim, lambda sim: sim.observe_object("sphere").position[:2], round(duration / 0.05), 0.05)
    return times - times[0], places


def _swing(times: FloatArray, offs: FloatArray) -> tuple[float, float]:
    """Mean period [s] of the crossings of 0, and the ratio of one swing to that before on the other side."""
    at = np.flatnonzero(offs[:-1] * offs[1:] < 0.0)
    crossings = times[at] - offs[at] * (times[at + 1] - times[at]) / (offs[at + 1] - offs[at])
    heights = [float(np.abs(offs[a:b]).max()) for a, b in pairwise(at)]
    ratios = np.array(heights[1:]) / np.array(heights[:-1])
    return 2.0 * float(np.diff(crossings).mean()), float(ratios.mean())


@case(*_MOORING_FILES)
def mooring_offset() -> Outcome:
    """Offset of a moored sphere in a current.

    assets/validation/worlds/moored.yaml: a neutral sphere of 1 m, 5 m deep, on a rope of 3 m and 200 N/m without
    damping; released where the rope is straight; its position after 300 s in currents of 0.5, 1 and 1.5 m/s.

    Reference: Stretch d U / s, with the drag d = 26.8 N s/m of the sphere's file: the rope pulls on the horizontal
    plane.
    """
    longest = 300.0
    series = []
    for speed in (0.5, 1.0, 1.5):
        sim = packaged_simulation("moored", current={"speed": speed, "direction": 0})
        times, places = _track(sim, (_LENGTH, 0.0), longest)
        stretch = places[-1, 0] - _LENGTH
        yield Comparison(f"stretch of the rope in {speed:g} m/s", "m", _offset(speed) - _LENGTH, stretch)
        series.append(Series("closed form", [0.0, longest], [_offset(speed)] * 2, reference=True))
        series.append(Series(f"{speed:g} m/s", times, places[:, 0]))
    yield Chart("Distance of the sphere from the anchor", "time [s]", "distance [m]", series)


@case(*_MOORING_FILES)
def mooring_period() -> Outcome:
    """Swings on a mooring.

    assets/validation/worlds/moored.yaml: a neutral sphere of 1 m, 5 m deep, on a rope of 3 m and 200 N/m without
    damping, in a current of 1 m/s; released 5 cm from its rest position, along the rope and across it.

    Reference: Along sqrt(s / m - delta^2) and across sqrt(d U / (m r) - delta^2), with r the distance from the
    anchor and delta = d / 2 m: a spring, and a pendulum in the stream. Objects have no added mass. A rope is
    implicit in time, which damps like the step times its stiffness, here 2 N s/m.
    """
    sim, aside = packaged_simulation("moored"), 0.05
    far = _offset(1.0)
    times, places = _track(sim, (far + aside, 0.0), 40.0)
    decay = _DRAG / (2.0 * _MASS)
    along = math.sqrt(_STIFFNESS / _MASS - decay**2)
    across = math.sqrt(_DRAG / (_MASS * far) - decay**2)
    stretch = places[:, 0] - far
    found, ratio = _swing(times, stretch)
    later, sway = _track(sim, (far, aside), 240.0)
    yield Comparison("period along the rope", "s", math.tau / along, found)
    yield Comparison("half a swing over the one before", "", math.exp(-decay * math.pi / along), ratio)
    yield Comparison("period across it", "s", math.tau / across, _swing(later, sway[:, 1])[0])
    closed = np.exp(-decay * times) * (np.cos(along * times) + decay / along * np.sin(along * times))
    lines = Series("closed form", times, aside * closed, reference=True), Series("ours", times, stretch)
    yield Chart("Stretch of the rope beyond that at rest", "time [s]", "stretch [m]", lines)
