"""Forces of waves on hulls: pressure against its integral, scattering, short waves, resolution, a flume section."""

import math
from collections import defaultdict
from collections.abc import Mapping
from itertools import groupby, pairwise, product
from typing import Any

import numpy as np

from vrx_mj.arrays import ComplexArray, FloatArray
from vrx_mj.config.shapes import normals_of
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation_matrix
from vrx_mj.mjcf.flotation import faces_of
from vrx_mj.model.kinds import MOTIONS
from vrx_mj.physics.panels import panels_of, wrench_of_pressures
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import (
    GRAVITY,
    Comparison,
    Outcome,
    TableRow,
    case,
    marine_simulation,
    marine_world,
    one_boat,
    only_boat,
    packaged_simulation,
    record,
    rows,
    unit,
)
from vrx_mj.validation.cases.waves import PERIOD, moment

_SEAS: Mapping[str, Mapping[str, Any]] = {
    "swell": {"model": "regular", "height": 4.96, "period": 20.0},
    "sea": {"model": "jonswap", "significant_height": 1.0, "peak_period": 8.0, "spreading": 8, "components": 60},
}
"""Seas: of 2.48 m in amplitude, on which boats are lifted, and one of waves 100 m long, in which they are held."""
_BOATS = (("wamv", -0.151, 0.6), ("heron", 0.0, 2.0), ("barge_4m", 0.0, -0.4))
"""Robots, where they float [m], and their headings [rad]; the waves travel along 0."""
_SAMPLES, _STEP = 40, 0.5
"""How often the forces are compared, and how far apart [s]."""
_PERIOD, _AMPLITUDE, _PHASES = 3.0, 0.01, 60
_PLACE = 1.7, -0.9
"""Place of the hull's origin [m]."""
_CENTER = -0.1
"""Place of its centre of mass, ahead of its origin [m]."""
_KINDS = ("diffraction", "froude_krylov")
_TURNS = np.exp(2j * math.pi * np.arange(_PHASES) / _PHASES)
_ROLL_DAMPING = 400.0
"""Linear damping of the barge's roll [N m s]."""
_FREE_AMPLITUDE, _LAST = 0.001, 8
"""Amplitude of the wave [m]; how many of its last periods count."""
_DENSITY, _LENGTH, _BEAM, _DRAFT = 1025.0, 4.0, 2.0, 0.5
"""Water [kg/m3] and size of the fixed barge [m]."""
_WAVE = (math.tau / 3.0) ** 2 / GRAVITY
"""Wavenumber of a period of 3 s in deep water [rad/m]."""
_CUTS = (2, 4, 8, 16)
"""Parts into which the barge's beam is cut; its length has twice as many."""
_COUNTS = (15, 30, 60, 120, 240)
_CALM = 1e6
"""Pressure that is added, so that all panels are wet [Pa]."""
_REST = (0.0, 0.0, -0.0964715, 0.0, 0.0, 0.0)
"""Pose of the section afloat: its centre of gravity is that far under the water."""
_SECTION_LENGTH, _TANK_DENSITY = 0.586, 1000.0
"""Length of the section [m] and density of the water [kg/m3]."""
_SPRINGS, _FRICTION, _STRENGTH = 59.4, 8.7, 100.0
"""Springs [N/m] and friction [N s/m] of the rig, and full thrust [N] of the engines that stand for them."""
_SLOW, _FADES = 0.74, 0.05
"""Frequency [rad/s] and decay [1/s] of the section on its springs."""
_FLUME_SAMPLE, _DURATION, _SETTLED = 0.02, 30.0, 12.0
"""Time between samples, length of a run, and from when on the mean force counts [s]."""
_FORCES = {"sway": ("sway force", "N/m"), "heave": ("heave force", "N/m"), "roll": ("roll moment", "N m/m")}
"""Forces of waves on the fixed section by motion, with their units."""


@case("physics/wave_box.py", "physics/panels.py", "physics/kinematics.py")
def wave_pressure() -> Outcome:
    """Pressure of waves on level boats.

    Robots wamv, heron and barge_4m, level: lifted with the surface in a swell of 2.48 m and 20 s, held in a JONSWAP
    sea of 1 m and 8 s with 60 components; the pressure on their meshes every 0.5 s for 20 s. The difference is the
    root of the mean square, over that of what varies.

    Reference: The pressure of all waves at every point, integrated over the wet part of the mesh, each of whose
    triangles is divided in four (NumPy); in the run the waves are added up at the nodes of a box.
    """
    for name, sea in _SEAS.items():
        for robot, rest, heading in _BOATS:
            sim = marine_simulation(one_boat(robot, heading, sensors="none"), sea=sea, seed=5)
            times, ours, exact = _pressures_of(sim, rest, heading, lifted=name == "swell")
            apart, varied = ours - exact, exact - exact.mean(axis=0)
            for kind, half in (("force", slice(0, 3)), ("torque", slice(3, 6))):
                share = 100.0 * np.linalg.norm(apart[:, half]) / np.linalg.norm(varied[:, half])
                yield Comparison(f"{kind} on the {robot} in the {name}, difference", "%", None, share)
            if robot == "wamv":
                lift = exact[:, 2].mean()
                lines = (
                    Series("lift less its mean, integral", times, exact[:, 2] - lift, reference=True),
                    Series("along the waves, integral", times, exact[:, 0], reference=True),
                    Series("lift less its mean", times, ours[:, 2] - lift),
                    Series("along the waves", times, ours[:, 0]),
                )
                yield Chart(f"Pressure on the WAM-V in the {name}", "time [s]", "force [N]", lines)


def _pressures_of(
    sim: Simulation, rest: float, heading: float, *, lifted: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times (n,), and what the pressure does to the only boat, level, in the run and by its integral, (n, 6) each."""
    (boat,) = sim.boats
    (hull,) = sim.world.parameters.hulls
    assert hull.vessel is not None, "no hull of its own"
    mesh = _divide(faces_of(hull.vessel))
    times, ours, exact = [], [], []
    for _ in range(_SAMPLES):
        then = sim.time + sim.timestep  # a force is that of the time at which its step ends
        height = float(sim.sea.height(0.0, 0.0, then)) if lifted else 0.0
        sim.set_boat(boat, pose=(0.0, 0.0, rest + height, 0.0, 0.0, heading))
        origin, turn = sim.data.qpos[:3].copy(), rotation_matrix(sim.data.qpos[3:7])
        times.append(then)
        ours.append(sim.forces(boat)["hydrostatics"])
        exact.append(_integral(sim, mesh @ turn.T + origin, origin + turn @ np.array(hull.body_com), then))
        sim.step(duration=_STEP)
    return np.array(times), np.array(ours), np.array(exact)


def _divide(triangles: FloatArray) -> FloatArray:
    """Triangles (n, 3, 3), each divided in four."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    d, e, f = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    return np.concatenate([np.stack(corners, 1) for corners in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))])


def _integral(sim: Simulation, triangles: FloatArray, center: FloatArray, time: float) -> FloatArray:
    """Force and torque (6,) about a point of the pressure on triangles (n, 3, 3), all in world axes."""
    t = np.full(triangles.shape[:2], time)
    depth = sim.sea.height(triangles[..., 0], triangles[..., 1], t) - triangles[..., 2]
    wet = _wet(triangles, depth)
    area = 0.5 * normals_of(wet) / 3.0
    total = np.zeros(6)
    for place in (0.5 * (wet + np.roll(wet, -1, axis=1))).swapaxes(0, 1):  # midpoints of edges
        force = -area * sim.sea.pressure(place[:, 0], place[:, 1], place[:, 2], np.full(len(place), time))[:, None]
        total += np.concatenate((force.sum(axis=0), np.cross(place - center, force).sum(axis=0)))
    return total


def _wet(triangles: FloatArray, depth: FloatArray) -> FloatArray:
    """The parts of triangles (n, 3, 3) whose depth, (n, 3) at the corners, is above zero, as triangles."""
    found = [triangles[(depth > 0.0).all(axis=1)]]
    for first in range(3):
        order = [first, (first + 1) % 3, (first + 2) % 3]
        (a, b, c), (p, q, r) = np.moveaxis(triangles[:, order], 1, 0), depth[:, order].T
        one, two = (p > 0.0) & (q <= 0.0) & (r <= 0.0), (p <= 0.0) & (q > 0.0) & (r > 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ab, ac = a + (p / (p - q))[:, None] * (b - a), a + (p / (p - r))[:, None] * (c - a)
        found += [np.stack((a, ab, ac), 1)[one], np.stack((ab, b, c), 1)[two], np.stack((ab, c, ac), 1)[two]]
    return np.concatenate(found)


def _reference() -> dict[tuple[float, float], ComplexArray]:
    """Complex amplitudes (kinds, motions) by heading and by where the wave goes [degrees]."""
    found: dict[tuple[float, float], ComplexArray] = {}
    for row in rows("diffraction"):
        course = row["heading"], row["toward"]
        forces = found.setdefault(course, np.zeros((len(_KINDS), len(MOTIONS.names)), np.complex128))
        value = complex(row["real"], row["imaginary"])
        forces[_KINDS.index(row["kind"]), MOTIONS.names.index(row["motion"])] = value
    return found


def _wave(amplitude: float, period: float, toward: float) -> dict[str, object]:
    """A regular wave of an amplitude [m] and a period [s] that goes toward an angle [degrees], in sea water."""
    sea = {"model": "regular", "height": 2.0 * amplitude, "period": period, "density": 1025.0}
    return {**sea, "direction": unit(toward).tolist()}


def _forces(heading: float, toward: float) -> FloatArray:
    """Forces (samples, kinds, motions) over a period on the hull, held, and as a third kind the wave's height."""
    sim, turn = packaged_simulation("bowed_box", sea=_wave(_AMPLITUDE, _PERIOD, toward)), math.radians(heading)
    (boat,) = sim.boats
    pose = [*_PLACE, 0.0, 0.0, 0.0, turn]
    found = np.zeros((_PHASES, 3, len(MOTIONS.names)))
    for sample in range(_PHASES):
        sim.set_boat(boat, pose=pose, velocity=[0.0] * 6)
        forces = sim.forces(boat)
        found[sample, :2] = forces["diffraction"], forces["hydrostatics"]
        found[sample, 2] = _crest(sim, turn)
        sim.step(duration=_PERIOD / _PHASES)
    return found


def _crest(sim: Simulation, turn: float) -> float:
    """Height of the wave at the centre of mass, at the end of the step [m]."""
    x, y = _PLACE[0] + _CENTER * math.cos(turn), _PLACE[1] + _CENTER * math.sin(turn)
    return float(sim.sea.height(x, y, sim.time + sim.timestep))


@case("physics/vessel.py", "physics/panels.py", "adapters/hydro.py", table="diffraction")
def diffraction_headings() -> Outcome:
    """Diffraction forces on a fixed hull.

    assets/validation/worlds/bowed_box.yaml: a box with a bow, 4.5 m long, with its file of 36 directions and 12
    frequencies, in a regular wave of 3 s and 1 cm; the hull is reset before each of 60 samples over a period.
    First harmonics per metre of wave, in world axes about the centre of mass: amplitudes of what is above a tenth
    of the whole force or moment, and the difference of all three with their phases.
    """
    for (heading, toward), theirs in _reference().items():
        samples = _forces(heading, toward)
        swings = np.tensordot(_TURNS, samples, 1)  # of e^(-i omega t)
        ours = swings[:2] / swings[2, 0]
        course = f"heading {heading:g}, wave toward {toward:g} degrees"
        size = np.repeat([np.linalg.norm(theirs[0, :3]), np.linalg.norm(theirs[0, 3:])], 3)
        for i, motion in enumerate(MOTIONS.names):
            if abs(theirs[0, i]) > 0.1 * size[i]:
                unit = "N/m" if i < 3 else "N m/m"
                yield Comparison(f"{motion}, {course}", unit, abs(theirs[0, i]), abs(ours[0, i]))
        for kind, label in enumerate(("diffraction", "Froude-Krylov")):
            for half, name in ((slice(0, 3), "force"), (slice(3, 6), "moment")):
                apart = np.linalg.norm(ours[kind, half] - theirs[kind, half]) / np.linalg.norm(theirs[kind, half])
                quantity = f"{label}, difference of the {name} over its size, with phase, {course}"
                yield Comparison(quantity, "", None, apart)
        if heading == 60.0:
            yield _chart(samples, theirs[0], course)


def _chart(samples: FloatArray, theirs: ComplexArray, course: str) -> Chart:
    """Diffraction over a period, from the passage of a crest on."""
    first = int(samples[:, 2, 0].argmax())
    times = _PERIOD / _PHASES * np.arange(_PHASES)
    turn = np.exp(-2j * math.pi / _PERIOD * times)
    series: list[Series] = []
    for i in range(3):
        series.append(Series("Capytaine", times, _AMPLITUDE * (theirs[i] * turn).real, reference=True))
        series.append(Series(MOTIONS.names[i], times, np.roll(samples[:, 0, i], -first)))
    return Chart(f"Diffraction of a wave of 1 cm, {course}", "time [s]", "force [N]", series)


@case("physics/vessel.py")
def roll_damping() -> Outcome:
    """Damping of roll of a hull with diffraction.

    assets/validation/worlds/drift_barge.yaml, free from rest in beam waves of 2 s and 4 cm for 20 s: the moment of its
    linear damping in roll, 400 N m s, every 50 ms.

    Reference: Minus 400 N m s times the hull's own roll rate, because the diffraction forces are those on a hull
    that does not rotate.
    """
    wave = {"model": "regular", "height": 0.04, "period": 2.0, "direction": [0.0, 1.0], "density": 1025.0}
    sim = packaged_simulation("drift_barge", sea=wave)

    def moments(sim: Simulation) -> tuple[float, float]:
        return sim.forces(sim.boats[0])["drag"][3], -_ROLL_DAMPING * only_boat(sim).angular_velocity[0]

    times, (ours, expected) = (each.T for each in record(sim, moments, 400, 0.05))
    largest = np.abs(expected).max()
    yield Comparison("greatest difference, over the largest moment", "", None, np.abs(ours - expected).max() / largest)
    lines = Series("damping times rate", times, expected, reference=True), Series("ours", times, ours)
    yield Chart("Moment of roll damping", "time [s]", "moment [N m]", lines)


def _swing(robot: str, period: float, toward: float, periods: int) -> tuple[FloatArray, bool]:
    """Heave of a robot's centre of mass over a wave's amplitude, roll and pitch over its slope; is it a hull long?"""
    sea, along = _wave(_FREE_AMPLITUDE, period, toward), unit(toward).tolist()
    sim = marine_simulation(one_boat(robot, sensors="none"), sea=sea)
    center, omega = np.array(sim.world.parameters.hulls[0].body_com), math.tau / period
    wavenumber, found, phases = omega**2 / GRAVITY, [], []
    for step in range(round(periods * period / sim.timestep)):
        sim.advance(1)
        if step >= round((periods - _LAST) * period / sim.timestep):
            turn = rotation_matrix(sim.data.qpos[3:7])
            x, y, z = sim.data.qpos[:3] + turn @ center
            phases.append(omega * sim.time - wavenumber * (along[0] * x + along[1] * y))
            found.append([z, turn[2, 1], -turn[2, 0]])
    about_mean = np.subtract(found, np.mean(found, axis=0))  # whose phase swings with surge and sway
    harmonics = 2.0 / len(found) * np.abs(np.exp(1j * np.array(phases)) @ about_mean)
    swings: FloatArray = harmonics / _FREE_AMPLITUDE / (1.0, wavenumber, wavenumber)
    vessel = sim.world.parameters.hulls[0].vessel
    assert vessel is not None
    return swings, math.tau / wavenumber >= vessel.length


@case("physics/waves.py", "physics/kinematics.py", "physics/vessel.py", table="short_waves")
def short_waves() -> Outcome:
    """A boat in waves as long as its hulls, and shorter.

    Robot wamv without sensors, 4.1 m long at the waterline and without a radiation file, free in following and beam
    waves of 1 mm; first harmonics of heave of the centre of mass, roll and pitch over the last 8 of 24 periods. The
    wave of 1.5 s is 0.85 of the hulls' length; in it, no motion may exceed twice the reference's.
    """
    for row in rows("short_waves"):
        yield from _swings(row, "", 24)


@case("physics/wave_box.py", "physics/vessel.py", "mjcf/drift.py", "adapters/hydro.py", table="response_amplitudes")
def response_amplitudes() -> Outcome:
    """Boats with a file of radiation and diffraction in waves as long as their hulls, and shorter.

    Robots wamv_hydro, otter_hydro, heron_hydro and blueboat_hydro without sensors, free in waves of 1 mm; first
    harmonics of heave of the centre of mass, roll and pitch over the last 8 of 60 periods. In waves shorter than the
    waterline, no motion may exceed twice the reference's.
    """
    for row in rows("response_amplitudes"):
        yield from _swings(row, "_hydro", 60)


def _swings(row: Mapping[str, Any], suffix: str, periods: int) -> Outcome:
    """Rows of a robot in a wave of a table; of one shorter than the waterline there is no reference."""
    robot, period, toward = row["robot"], row["period"], row["toward"]
    swings, long = _swing(f"{robot}{suffix}", period, toward, periods)
    for motion, ours in zip(("heave", "roll", "pitch"), swings, strict=True):
        if row[motion] >= 0.02:  # a beam sea does not pitch it, nor a head sea roll it
            per = "metre" if motion == "heave" else "slope"
            name = f"{robot}, {motion} per {per}, {period:g} s, wave toward {toward:g} degrees"
            yield Comparison(name, "", row[motion] if long else None, ours)


def _side(across: tuple[FloatArray, FloatArray], place: FloatArray) -> list[FloatArray]:
    """Triangles of a rectangle, counter-clockwise along the two axes; `place` (3, 3) takes (u, v, 1) into space."""
    found = []
    for (a, b), (c, d) in product(*(pairwise(values.tolist()) for values in across)):
        p, q, r, s = (place @ (u, v, 1.0) for u, v in ((a, c), (b, c), (b, d), (a, d)))
        found += [np.array((p, q, r)), np.array((p, r, s))]
    return found


def _barge(cuts: int) -> FloatArray:
    """Bottom, bow and stern of a barge (n, 3, 3) [m], the water at z = 0."""
    x = np.linspace(-0.5 * _LENGTH, 0.5 * _LENGTH, 2 * cuts + 1)
    y, z = np.linspace(-0.5 * _BEAM, 0.5 * _BEAM, cuts + 1), np.linspace(-_DRAFT, 0.0, cuts // 2 + 1)
    bottom = np.array([(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -_DRAFT)])
    bow = np.array([(0.0, 0.0, 0.5 * _LENGTH), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    stern = np.array([(0.0, 0.0, -0.5 * _LENGTH), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)])
    return np.array(_side((y, x), bottom) + _side((y, z), bow) + _side((z, y), stern))


def _force(cuts: int, phase: float) -> FloatArray:
    """Force (6,) of the pressure of a wave of 1 m, at one phase, on the barge at rest."""
    corners = _barge(cuts).reshape(-1, 3)
    mesh = panels_of(corners, np.arange(len(corners)).reshape(-1, 3))
    x, _, z = mesh.points
    wave = _DENSITY * GRAVITY * np.exp(_WAVE * z) * np.cos(_WAVE * x + phase)
    still = np.full(len(x), _CALM)
    with_wave, without = (wrench_of_pressures(mesh, pressures) for pressures in (still + wave, still))
    return np.asarray(with_wave - without)


@case("physics/panels.py")
def panels_doubled() -> Outcome:
    """Panels doubled.

    The pressure of a wave of 3 s on a fixed barge of 4 x 2 x 0.5 m, whose bottom and ends are cut into 2 to 16
    parts across.

    Reference: Closed form, rho g A e^(-k d) sinc(k l / 2) and 2 rho g b sin(k l / 2) (1 - e^(-k d)) / k per metre.
    The pressure is linear over a panel: twice as many in each direction leave a quarter of the error, order 2.
    """
    long, deep = 0.5 * _WAVE * _LENGTH, math.exp(-_WAVE * _DRAFT)
    heave = _DENSITY * GRAVITY * _LENGTH * _BEAM * deep * math.sin(long) / long
    surge = 2.0 * _DENSITY * GRAVITY * _BEAM * math.sin(long) * (1.0 - deep) / _WAVE
    errors = {
        "heave": [abs(float(_force(cuts, 0.0)[2]) / heave - 1.0) for cuts in _CUTS],
        "surge": [abs(float(_force(cuts, 0.5 * math.pi)[0]) / surge - 1.0) for cuts in _CUTS],
    }
    yield from _convergence("Error of the force", "panels across", _CUTS, errors, 2.0)


@case("spectra.py")
def components_doubled() -> Outcome:
    """Components doubled.

    A JONSWAP sea of Tp 7 s, of 15 to 240 components: m2 / m0, the variance of the surface's vertical velocity over
    that of its height.

    Reference: Integrals of the spectrum. Each component has the mean frequency of its band, so m0 and m1 are exact,
    and m2 lacks the spread inside bands: order 2 where a spectrum ends, 0.5 for a tail of omega^-5 without end;
    this one ends at six times the peak's frequency.
    """
    exact = moment(2) / moment(0)
    errors = []
    for count in _COUNTS:
        sea = {"model": "jonswap", "significant_height": 1.0, "peak_period": PERIOD, "components": count}
        waves = marine_world(sea=sea).parameters.sea.waves
        errors.append(abs(math.fsum(wave.frequency**2 for wave in waves) / len(waves) / exact - 1.0))
    yield from _convergence("Error of m2 / m0", "components", _COUNTS, {"m2 / m0": errors}, 1.0)


def _convergence(
    title: str,
    parts: str,
    numbers: tuple[int, ...],
    errors: dict[str, list[float]],
    order: float,
) -> Outcome:
    """How fast errors go down with a number of parts; both as logarithms, with a line of an order."""
    for name, found in errors.items():
        for (a, one), (b, other) in pairwise(zip(numbers, found, strict=True)):
            quantity = f"order of the error of {name}, from {a} to {b} {parts}"
            yield Comparison(quantity, "", None, math.log2(one / other))
    x = np.log10(numbers)
    first = next(iter(errors.values()))[0]
    line = Series(f"order {order:g}", x, np.log10(first) - order * (x - x[0]), reference=True)
    points = [Series(name, x, np.log10(found), kind="points") for name, found in errors.items()]
    yield Chart(title, f"log10 of the number of {parts}", "log10 of the relative error", (line, *points))


@case("physics/vessel.py", "mjcf/drift.py", "runtime/loop.py", table="flume")
def section_flume() -> Outcome:
    """A section of a ship in a flume.

    assets/validation/worlds/flume.yaml: the section with the added mass, damping, diffraction and drift of linear
    theory in two dimensions, in regular waves of the measured amplitude and 1 m of water, which grow as exp(-t / 2.5
    periods). Fixed: first harmonics of Froude-Krylov force and diffraction. Afloat, on the springs and with the
    friction of the rig: first harmonics in the flume's window over that of our wave there; mean force of the last 18
    of 30 s. Its linear roll damping is fitted to the roll at 1.238 s, which is not a row.

    Reference: The mean force on the fixed section is not compared: a hull's file has that of a moving hull.
    """
    charts: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    conditions = groupby(rows("flume"), lambda row: (row["set"], row["period"], 1e3 * row["height"]))
    for (kind, period, height), group in conditions:
        own = list(group)
        ours = _fixed_forces(own[0]) if kind == "fixed" else _floating_section(own[0])
        for row in (row for row in own if row["quantity"] in ours):
            name, unit = _FORCES[row["quantity"]] if kind == "fixed" else (row["quantity"], "")
            found = row["measured"], ours[row["quantity"]]
            charts[name].append((period, *found))
            if (kind, name, period) != ("free", "roll", 1.238):
                yield Comparison(f"{name}, {kind}, {period:g} s, {height:g} mm", unit, *found, row["theory"])
    for name, points in charts.items():
        periods, measured, found = zip(*points, strict=True)
        theirs = Series("measured", periods, measured, kind="points", reference=True)
        yield Chart(name.capitalize(), "period [s]", name, (theirs, Series("ours", periods, found, kind="points")))


def _simulation(row: TableRow) -> Simulation:
    """The section in the waves of a row, which are there at once where it is fixed."""
    sea = {"model": "regular", "height": 2.0 * row["amplitude"], "period": row["period"], "direction": [0, 1]}
    sea |= {"density": _TANK_DENSITY, "depth": 1.0, "ramp": 0.0 if row["set"] == "fixed" else 2.5 * row["period"]}
    robot = "held" if row["set"] == "roll_held" else "robot"
    spawn = {"robot": f"flume_section/{robot}.yaml", "pose": _REST, "sensors": "none"}
    return packaged_simulation("flume", sea=sea, spawn=spawn)


def _fit(times: FloatArray, values: FloatArray, period: float, *others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means and amplitudes of the first harmonic of values (n, m) at times (n,), beside their second and `others`."""
    phase = math.tau / period * times
    waves = [f(n * phase) for n in (1, 2) for f in (np.cos, np.sin)]
    found = np.linalg.lstsq(np.stack([np.ones(times.size), *waves, *others], axis=1), values, rcond=None)[0]
    return found[0], np.hypot(found[1], found[2])


def _fixed_forces(row: TableRow) -> dict[str, float]:
    """Forces on the section, put back before each sample of a period, over the wave's amplitude."""
    sim, times, found = _simulation(row), [], []
    (boat,) = sim.boats
    for _ in range(math.ceil(row["period"] / _FLUME_SAMPLE)):
        sim.set_boat(boat, pose=_REST, velocity=[0.0] * 6)
        forces = sim.forces(boat)
        times.append(sim.time)
        found.append((forces["diffraction"] + forces["hydrostatics"])[1:4])
        sim.step(duration=_FLUME_SAMPLE)
    _, sizes = _fit(np.array(times), np.array(found), row["period"])
    return dict(zip(_FORCES, (sizes / row["amplitude"]).tolist(), strict=True))


def _floating_section(row: TableRow) -> dict[str, float]:
    """Motions over the wave's amplitude, and slope, and mean force over rho g a^2 L / 2, of the section on the rig."""
    sim, times, found = _simulation(row), [], []
    for _ in range(round(_DURATION / _FLUME_SAMPLE)):
        seen = only_boat(sim)
        (_, y, z), (_, sway, heave) = seen.position, seen.velocity
        times.append(sim.time)
        found.append((y, z, seen.roll, float(sim.sea.height(0.0, 0.0, sim.time))))
        rig = {"sway": -(_SPRINGS * y + _FRICTION * sway) / _STRENGTH, "heave": -_FRICTION * heave / _STRENGTH}
        sim.step({sim.boats[0]: rig}, duration=_FLUME_SAMPLE)
    t, values = np.array(times), np.array(found)
    window, late = t >= row["until"] - row["periods"] * row["period"], t >= _SETTLED
    window &= t < row["until"]
    _, sizes = _fit(t[window], values[window], row["period"], t[window])
    swing = [np.exp(-_FADES * t[late]) * f(_SLOW * t[late]) for f in (np.cos, np.sin)]
    mean, _ = _fit(t[late], values[late], row["period"], *swing)
    sway, heave, roll = (sizes[:3] / sizes[3]).tolist()
    unit = 0.5 * _TANK_DENSITY * GRAVITY * row["amplitude"] ** 2 * _SECTION_LENGTH
    force = _SPRINGS * float(mean[0]) / unit
    return {"sway": sway, "heave": heave, "roll": roll / row["wavenumber"], "mean force": force}
