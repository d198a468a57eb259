"""A barge with a hull of its own: stiffness, wave forces, heave without damping, and a blow with added mass."""

import itertools
import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Case, Findings, Row, between, near
from vrx_mj.validation.setups import GRAVITY, packaged_simulation

_LENGTH, _BEAM, _DRAFT, _DENSITY, _MASS = 4.0, 2.0, 0.5, 1025.0, 4100.0
_SURGE_ADDED, _HEAVE_ADDED = 900.0, 3000.0
"""Added mass in the barge's file [kg]."""
_STIFFNESS = _DENSITY * GRAVITY * _LENGTH * _BEAM
"""C33 [N/m]."""
_PERIOD = 2.0 * math.pi * math.sqrt((_MASS + _HEAVE_ADDED) / _STIFFNESS)
"""Of heave [s]."""
_DROP = 0.05
"""Height from which it is let go [m]."""
_WORLD = "assets/validation/worlds/barge.yaml"


def _water(sim: Simulation, pose: FloatArray) -> FloatArray:
    """Force and torque (6,) of the water's pressure on the barge, held in a pose."""
    (boat,) = sim.boats
    sim.set_boat(boat, pose=pose.tolist())
    return sim.forces(boat)["hydrostatics"]


def _afloat() -> Findings:
    """Stiffness of the barge in a run."""
    sim, step, rows = packaged_simulation("barge"), 1e-3, []
    volume, lever = _LENGTH * _BEAM * _DRAFT, 0.5 * _DRAFT - 0.5
    weight = _DENSITY * GRAVITY
    closed = (
        ("C33, heave", "N/m", 2, _STIFFNESS),
        ("C44, roll", "N m/rad", 3, weight * (_LENGTH * _BEAM**3 / 12.0 + volume * lever)),
        ("C55, pitch", "N m/rad", 4, weight * (_BEAM * _LENGTH**3 / 12.0 + volume * lever)),
    )
    for name, unit, axis, reference in closed:
        aside = step * np.eye(6)[axis]
        slope = (_water(sim, -aside)[axis] - _water(sim, aside)[axis]) / (2.0 * step)
        rows.append(near(name, unit, reference, float(slope), relative=1e-3))
    rows.append(near("force at rest", "N", _MASS * GRAVITY, float(_water(sim, np.zeros(6))[2]), relative=1e-3))
    return Findings(tuple(rows))


def _froude_krylov() -> Findings:
    """Forces of a wave on the fixed barge."""
    k, height = (2.0 * math.pi / 3.0) ** 2 / GRAVITY, 0.02
    rows: list[Row] = []
    charts = []
    for name, direction, along, across in (("head", (1.0, 0.0), _LENGTH, _BEAM), ("beam", (0.0, 1.0), _BEAM, _LENGTH)):
        share = math.sin(0.5 * k * along) / (0.5 * k * along)
        heave = _STIFFNESS * math.exp(-k * _DRAFT) * share
        push = 2.0 * _DENSITY * GRAVITY * across * math.sin(0.5 * k * along) * (1.0 - math.exp(-k * _DRAFT)) / k
        ours, chart = _wave_force(name, direction, height, (heave, push))
        rows += [
            near(f"heave, {name} wave", "N/m", heave, ours[2], relative=5e-3),
            near(f"{'surge' if direction[0] else 'sway'}, {name} wave", "N/m", push, ours[0 if direction[0] else 1],
                 relative=5e-3),
        ]  # fmt: skip
        charts.append(chart)
    return Findings(tuple(rows), tuple(charts))


def _wave_force(
    name: str, direction: tuple[float, float], height: float, closed: tuple[float, float]
) -> tuple[list[float], Chart]:
    """Amplitudes of surge, sway and heave per metre of wave [N/m], and the force over a period.

    `closed` is what they are in heave and along the wave: in phase with the crest, and a quarter of a period before it.
    """
    sea = {"model": "regular", "height": height, "period": 3.0, "direction": list(direction)}
    sim, found, times = packaged_simulation("barge", sea=sea), [], []
    for _ in range(60):
        found.append(_water(sim, np.zeros(6))[:3])
        times.append(sim.time + sim.timestep)  # a force is that of the time at which its step ends
        sim.step(duration=0.05)
    forces, phase = np.array(found), 2.0 * math.pi / 3.0 * np.array(times)
    up, along = (0.5 * height * value for value in closed)
    turn = np.exp(2j * math.pi * np.arange(60) / 60)
    amplitude = 2.0 / 60.0 * np.abs(turn @ forces) / (0.5 * height)
    chart = Chart(
        f"Force on the fixed barge in a {name} wave of 1 cm",
        "time [s]",
        "force [N]",
        (
            Series("closed forms", times, up * np.cos(phase), reference=True),
            Series("", times, -along * np.sin(phase), reference=True),
            Series("heave less weight", times, forces[:, 2] - _MASS * GRAVITY),
            Series("surge" if direction[0] else "sway", times, forces[:, 0 if direction[0] else 1]),
        ),
    )
    return [float(value) for value in amplitude], chart


def _heave() -> Findings:
    """Free heave without damping: its period and its energy."""
    sim = packaged_simulation("barge")
    (boat,) = sim.boats
    sim.set_boat(boat, pose=(0.0, 0.0, _DROP, 0.0, 0.0, 0.0))
    heights, speeds = [_DROP], [0.0]
    for _ in range(round(20.0 * _PERIOD / sim.timestep)):
        sim.advance(1)
        seen = sim.observe()[boat]
        heights.append(float(seen.position[2]))
        speeds.append(float(seen.velocity[2]))
    z, w = np.array(heights), np.array(speeds)
    times = np.arange(len(z), dtype=np.float64) * sim.timestep
    energy = 0.5 * (_MASS + _HEAVE_ADDED) * w**2 + 0.5 * _STIFFNESS * z**2
    whole = round(_PERIOD / sim.timestep)
    up = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
    crossings = sim.timestep * (up - z[up] / (z[up + 1] - z[up]))
    rows = (
        near("period", "s", _PERIOD, float(np.diff(crossings).mean()), relative=2e-3),
        near("energy, mean of the 20th period over that of the first", "", 1.0,
             float(energy[-whole:].mean() / energy[:whole].mean()), relative=1e-4),
    )  # fmt: skip
    closed = _DROP * np.cos(2.0 * math.pi / _PERIOD * times)
    first = times < 5.0 * _PERIOD
    chart = Chart(
        "Height of the barge",
        "time [s]",
        "height [m]",
        (Series("closed form", times[first], closed[first], reference=True), Series("ours", times[first], z[first])),
    )
    return Findings(rows, (chart,))


def _step_halved() -> Findings:
    """The order of the scheme in time."""
    until, steps, errors = 2.0, (0.02, 0.01, 0.005, 0.0025), []
    for step in steps:
        physics = {"profile": "marine", "gravity": GRAVITY, "timestep": step}
        sim = packaged_simulation("barge", physics=physics)
        (boat,) = sim.boats
        sim.set_boat(boat, pose=(0.0, 0.0, _DROP, 0.0, 0.0, 0.0))
        sim.step(duration=until)
        height = float(sim.observe()[boat].position[2])
        errors.append(abs(height - _DROP * math.cos(2.0 * math.pi / _PERIOD * until)))
    rows = tuple(
        between(f"order from {coarse:g} to {fine:g} s", "", 0.95, 1.1, math.log2(errors[i] / errors[i + 1]))
        for i, (coarse, fine) in enumerate(itertools.pairwise(steps))
    )
    lines = (
        Series("order 1", np.log10(steps), np.log10(errors[0]) + np.log10(np.array(steps) / steps[0]), reference=True),
        Series("ours", np.log10(steps), np.log10(errors), kind="points"),
    )
    return Findings(rows, (Chart("Error of the height after 2 s", "log10 of the step [s]", "log10 of it [m]", lines),))


def _impact() -> Findings:
    """A blow against a quay: the impulse with the mass of the water that goes along."""
    quay = {"name": "quay", "pose": [4, 0, 0, 0, 0, 0], "layout": "XXX\nXXX\nXXX\n"}
    rows: list[Row] = []
    series: list[Series] = []
    for speed in (0.2, 0.5):
        sim = packaged_simulation("barge", docks=[quay])
        (boat,) = sim.boats
        sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0), velocity=(speed, 0, 0, 0, 0, 0))
        forces, speeds = [], []
        for _ in range(round(20.0 / sim.timestep)):
            forces.append(-float(sim.forces(boat)["contact"][0]))
            sim.advance(1)
            speeds.append(float(sim.observe()[boat].velocity[0]))
        impulse, back = sim.timestep * sum(forces), -speeds[-1]
        reference = (_MASS + _SURGE_ADDED) * (speed + back)
        rows.append(near(f"impulse at {speed:g} m/s, e {back / speed:.3f}", "N s", reference, impulse, relative=0.02))
        (first, *_) = np.flatnonzero(forces)
        seen = slice(max(int(first) - 10, 0), int(first) + 60)
        times = np.array(sim.timestep * np.arange(seen.stop - seen.start), np.float64)
        momentum = [0.0, sim.timestep * (seen.stop - seen.start)], [reference] * 2
        series.append(Series("" if series else "change of momentum", *momentum, reference=True))
        series.append(Series(f"{speed:g} m/s", times, np.array(sim.timestep * np.cumsum(forces)[seen], np.float64)))
    return Findings(tuple(rows), (Chart("Impulse of the quay so far", "time [s]", "impulse [N s]", tuple(series)),))


def _float_contact() -> Findings:
    """A blow against a buoy, by the length of the step."""
    buoy = {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [3.6, 0, 0, 0, 0, 0], "mooring": None}
    steps, impulses, series = (0.0005, 0.02, 0.01, 0.005), [], []
    for step in steps:
        physics = {"profile": "marine", "gravity": GRAVITY, "timestep": step}
        sim = packaged_simulation("barge", objects=[buoy], physics=physics)
        (boat,) = sim.boats
        sim.step(duration=1.0)
        sim.set_boat(boat, pose=(0, 0, 0, 0, 0, 0), velocity=(1.0, 0, 0, 0, 0, 0))
        pushes = []
        for _ in range(round(4.0 / step)):
            pushes.append(-step * float(sim.forces(boat)["contact"][0]))
            sim.advance(1)
        impulses.append(sum(pushes))
        times = [step * number for number in range(len(pushes))]
        label = f"{1000.0 * step:g} ms"
        series.append(Series(label, times, list(itertools.accumulate(pushes)), reference=step == steps[0]))
    rows = tuple(
        near(f"impulse with steps of {1000.0 * step:g} ms", "N s", impulses[0], impulse, relative=0.10)
        for step, impulse in zip(steps[1:], impulses[1:], strict=True)
    )
    return Findings(rows, (Chart("Impulse on the barge so far", "time [s]", "impulse [N s]", tuple(series)),))


_HULL = ("physics/panels.py", "physics/vessel.py", "runtime/loop.py")
CASES = (
    Case(
        name="barge-afloat",
        title="A barge in a run",
        setup=f"{_WORLD}: a box of 4 x 2 x 1 m, 4100 kg, KG 0.5 m, in still water. Stiffness is the central "
        "difference of the forces that the simulation reports in poses 1 mm or 1 mrad aside.",
        source="C33 = rho g A, C44 = rho g (I_T + V (KB - KG)), C55 = rho g (I_L + V (KB - KG)); weight is rho g V.",
        files=_HULL,
        run=_afloat,
    ),
    Case(
        name="froude-krylov",
        title="Wave forces on a fixed barge",
        setup=f"{_WORLD} with a regular wave of 3 s and an amplitude of 1 cm from ahead and from the side; the barge "
        "is put back before each of 60 samples over a period. Forces are first harmonics per metre of wave "
        "amplitude.",
        source="Airy's pressure rho g a e^(k z) cos(k x - omega t) integrated over the box, per metre: heave rho g "
        "A e^(-k d) sin(k l / 2) / (k l / 2), the ends 2 rho g b sin(k l / 2) (1 - e^(-k d)) / k.",
        files=("physics/panels.py", "physics/wave_box.py", "physics/vessel.py"),
        run=_froude_krylov,
    ),
    Case(
        name="heave-undamped",
        title="Free heave without damping",
        setup=f"{_WORLD}, let go 5 cm too high, for 20 periods. Nothing damps it, so the energy of motion, added mass "
        "included, and of stiffness must stay; compared are its means over whole periods.",
        source="2 pi sqrt((m + A33) / C33), and conservation of energy.",
        files=("physics/added_mass.py", *_HULL),
        run=_heave,
    ),
    Case(
        name="step-halved",
        title="Order of the scheme in time",
        setup=f"{_WORLD}, let go 5 cm too high, with steps of 20, 10, 5 and 2.5 ms; the error of the height after 2 s.",
        source="The closed form of free heave. The scheme is MuJoCo's semi-implicit Euler, which is of first order: "
        "half the step, half the error.",
        files=("runtime/loop.py",),
        run=_step_halved,
    ),
    Case(
        name="added-mass-impact",
        title="A blow with added mass",
        setup=f"{_WORLD}, which runs into a fixed quay at 0.2 and 0.5 m/s without drag. The impulse is the sum of the "
        "contact force over the steps; e is the ratio of the speeds after and before.",
        source="The momentum that changes is the boat's and the water's that goes along: (m + A11) (1 + e) v. Added "
        "mass that is only a force would leave it out of the blow.",
        files=("physics/added_mass.py", "runtime/loop.py"),
        run=_impact,
    ),
    Case(
        name="float-contact",
        title="A blow against a buoy, by the length of the step",
        setup=f"{_WORLD}, without damping, which runs at 1 m/s into a marker buoy without mooring. The impulse is the "
        "sum of the contact force over 4 s, at steps of 20, 10 and 5 ms.",
        source="The same run at a step of 0.5 ms. Drag of what floats is part of its inertia, so that a long step "
        "does not give a light buoy more or less of a blow.",
        files=("physics/flotation.py", "physics/afloat.py", "runtime/loop.py"),
        run=_float_contact,
        quick=False,
    ),
)
