"""What drifts: a neutral sphere in a wave, and boats in a current, in swell and in the wind.

The current, as drogues show it: its profile, its tide and its random part.

A mooring in a current: where it holds what floats, and how that swings.
"""

import json
import math
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from vrx_mj.arrays import FloatArray
from vrx_mj.config.dynamics import read_hydro
from vrx_mj.config.robots import load_robot
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation_matrix
from vrx_mj.mjcf.drift import HullInWaves
from vrx_mj.mjcf.flotation import flotation
from vrx_mj.mjcf.hulls import about_origin
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Hull
from vrx_mj.model.water import Sea
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Comparison, Outcome, case, folder
from vrx_mj.validation.rows import rows as table_rows
from vrx_mj.validation.setups import (
    GRAVITY,
    autocorrelation,
    marine_simulation,
    marine_world,
    only_boat,
    packaged_simulation,
    record,
    with_boat_at,
)

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
    yield Comparison("radius of the orbit, upward", "m", radius, math.hypot(up[0], up[1]))
    yield Comparison("radius of the orbit, along the waves", "m", radius, math.hypot(along[0], along[1]))
    yield Comparison("drift", "m/s", drift, along[3])
    turn = np.linspace(0.0, 2.0 * math.pi, 100)
    x, z = track[: steps // 4, 0], track[: steps // 4, 2]
    circle = Series("circle", x.mean() + radius * np.cos(turn), z.mean() + radius * np.sin(turn), reference=True)
    lines = circle, Series("sphere", x, z)
    yield Chart("Track of the sphere over one period", "along the waves [m]", "height [m]", lines, equal=True)


@case("physics/conditions.py", "physics/drag.py", "runtime/loop.py")
def current_adrift() -> Outcome:
    """A boat adrift in a current.

    The robots skiff and wamv without commands in flat water with a current of 0.5 m/s, from rest.

    Reference: All forces of the water are on the velocity through it: the boat ends with the current's.
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
        yield Comparison(f"drift over 20 periods, {robot}, {name}", "m/s", None, drift)
        series.append(Series(f"{robot}, {name}", times, way))
    line = Series("Stokes drift", times, stokes * (times - times[0]), reference=True)
    yield Chart("Drift of the boats along the swell", "time [s]", "distance [m]", (line, *series))


_FREE = tuple(
    (robot, *way)
    for robot in ("barge_10m", "barge_4m", "blueboat", "cylinder", "heron", "kingfisher", "otter", "wamv")
    for way in (("stern to it", 0.0), ("beam to it", 0.5 * math.pi))
)
"""Robots with a hull of their own that something brakes, and their headings [rad]."""
_SWELL = {"model": "regular", "height": 0.8, "period": 6.0, "ramp": 12.0}
_SEA = {"model": "jonswap", "significant_height": 0.3, "peak_period": 4.0, "direction": [1.0, 0.0], "ramp": 20.0}
_SEEDS = 0, 1
_SPHERES = 6
"""Spheres in each of the seas."""


@case("physics/drift.py", "mjcf/drift.py", "physics/vessel.py", quick=False)
def waves_adrift() -> Outcome:
    """Boats adrift in waves.

    Robots without commands in a swell of 6 s, 0.8 m from trough to crest, with the waves and beam to them: the slope
    of their track over 50 periods, after 300; and in a JONSWAP sea of 0.3 m and 4 s, over 900 s after 300, the mean of
    two seeds. Both begin with a ramp. Boats yaw as they like. Nothing brakes the sphere: it has an acceleration in the
    sea, from 60 to 360 s, the mean of six of them and two seeds.

    Reference: The speed at which what damps a hull takes the mean force of the waves, sum a^2 D: d s + q |s| s and the
    drag across it, in the mean over the hull's motion against the water, with s the speed less the Stokes drift at half
    the draft T, sum omega k a^2 e^(-k T). D is that of the waves that the hull makes (Maruo, 1960) and throws back
    (Faltinsen et al., 1980), or with a file that of all far off, at the headings that it has. The sphere carries half
    of its mass along (Lamb, 1932).
    """
    for name, sea, seeds, times in (("swell", _SWELL, (0,), (1800.0, 2100.0)), ("sea", _SEA, _SEEDS, (300.0, 1200.0))):
        found = np.mean([_speeds_adrift(sea, seed, *times) for seed in seeds], axis=0)
        for (robot, way, _), (reference, ours) in zip(_FREE, found, strict=True):
            yield Comparison(f"speed in the {name}, {robot}, {way}", "m/s", reference, ours)
        theirs, own = found.T
        line = Series("equal", [0.0, theirs.max()], [0.0, theirs.max()], reference=True)
        points = Series("boats", theirs, own, kind="points")
        yield Chart(f"Speeds in the {name}", "reference [m/s]", "ours [m/s]", (line, points))
    reference, ours = np.mean([_spheres_in_sea(seed) for seed in _SEEDS], axis=0)
    yield Comparison("acceleration in the sea, sphere", "m/s2", reference, ours)


def _adrift(boats: Sequence[tuple[str, str, float]], sea: dict[str, object], seed: int) -> World:
    """Robots in a sea that travels east, so far apart along it that each has its own waves."""
    fleet = [
        {"name": f"{robot}{n}", "robot": robot, "pose": [337.0 * n, 0.0, 0.0, 0.0, 0.0, heading]}
        for n, (robot, _, heading) in enumerate(boats)
    ]
    return marine_world({"boats": fleet, "sensors": "none"}, sea=sea, seed=seed)


def _places(sim: Simulation) -> list[tuple[float, float]]:
    """Place along x [m] and yaw [rad] of all boats."""
    return [
        (boat.position[0], 2.0 * math.atan2(boat.quaternion[3], boat.quaternion[0])) for boat in sim.observe().values()
    ]


def _speeds_adrift(sea: dict[str, object], seed: int, start: float, end: float) -> list[tuple[float, float]]:
    """Reference and our mean speed [m/s] of all free boats between two times [s]."""
    world = _adrift(_FREE, sea, seed)
    sim, found = Simulation(world), []
    sim.step(duration=start)
    times, track = record(sim, _places, round((end - start) / 0.75), 0.75)
    hulls = {robot: hull for (robot, _, _), hull in zip(_FREE, world.parameters.hulls, strict=True)}
    steady = {
        robot: _steady_speeds(hull, _SeaOnHull(robot, hull, world.parameters.sea)) for robot, hull in hulls.items()
    }
    for (robot, _, _), (x, yaw) in zip(_FREE, track.transpose(1, 2, 0), strict=True):
        speeds = steady[robot]
        turns = np.linspace(0.0, 2.0 * np.pi, speeds.size, endpoint=False)
        reference = np.interp(-yaw, turns, speeds, period=2.0 * np.pi).mean()
        found.append((float(reference), float(np.polyfit(times, x, 1)[0])))
    return found


def _spheres_in_sea(seed: int) -> tuple[float, float]:
    """Reference and our mean acceleration [m/s2] of spheres."""
    world = _adrift([("sphere", "", 0.0)] * _SPHERES, _SEA, seed)
    sim, calm = Simulation(world), _adrift([("sphere", "", 0.0)], {"model": "none"}, seed)
    hull = calm.parameters.hulls[0]  # with the forces of its file alone
    sim.step(duration=60.0)
    times, track = record(sim, _places, 300, 1.0)
    force = _SeaOnHull("sphere", hull, world.parameters.sea).force[0, 0]
    return float(force / (1.5 * hull.mass)), float(2.0 * np.polyfit(times, track[:, :, 0], 2)[0].mean())


class _SeaOnHull:
    """A sea on a free hull, by m angles off its bow toward which it travels, even over the circle."""

    force: FloatArray
    """Its mean surge and sway force (m, 2) [N]."""
    slip: FloatArray
    """The hull's swinging velocity through the water (m, n, 6) [m/s, rad/s], at n times far apart."""
    stokes: float
    """Stokes drift at half the draft [m/s]."""

    def __init__(self, robot: str, hull: Hull, sea: Sea) -> None:
        own, force, draft = _in_waves(robot, hull, sea.density)
        omega, a = np.array([(wave.frequency, wave.amplitude) for wave in sea.waves]).T
        known = np.concatenate(([0.0], own.frequencies))

        def by_angle(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
            values = values.reshape(own.frequencies.size, own.angles, -1)
            values = np.concatenate((np.zeros_like(values[:1]), values))
            return np.asarray(CubicSpline(known, values)(np.minimum(omega, known[-1]))).transpose(1, 0, 2)

        k, phases = omega**2 / GRAVITY, np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, omega.size)
        swing = a * np.exp(1j * (phases - np.outer(17.3 * np.arange(1000.0), omega)))
        self.force = a**2 @ by_angle(force)[..., :2]
        slip = (swing @ by_angle(own.slip)).real
        self.slip = np.concatenate((slip, -slip), axis=1)
        self.stokes = float((omega * k * a**2 * np.exp(-k * draft)).sum())


def _steady_speeds(hull: Hull, sea: _SeaOnHull) -> FloatArray:
    """Speeds of a free hull along a sea [m/s], (m,): what damps it, in the mean over its swinging, takes the force."""
    vessel, speeds = hull.vessel, []
    assert vessel is not None
    (x, y, z), (ahead, aside, *_) = vessel.point, vessel.damping_quadratic
    for turn, force, slip in zip(
        np.linspace(0.0, 2.0 * np.pi, len(sea.force), endpoint=False), sea.force, sea.slip, strict=True
    ):
        u, v, _, p, q, r = slip.T
        drags = (
            ((ahead, u + q * z - r * y),),
            ((aside, v + r * x - p * z), *((strip.drag, v + r * strip.x - p * strip.z) for strip in vessel.strips)),
        )
        through = [
            brentq(
                lambda s, d=d, f=f, own=own: d * s + sum((k * np.abs(s + w) * (s + w)).mean() for k, w in own) - f,
                -9.0,
                9.0,
            )
            for d, f, own in zip(np.diag(vessel.damping)[:2], force, drags, strict=True)
        ]
        speeds.append(sea.stokes + math.cos(turn) * through[0] + math.sin(turn) * through[1])
    return np.array(speeds)


@cache
def _in_waves(robot: str, hull: Hull, density: float) -> tuple[HullInWaves, FloatArray, float]:
    """A hull in small waves, their mean force on it (n m, 3) over their amplitude squared [N/m2], and its draft [m]."""
    config, own, vessel = load_robot(robot).hull, hull.inertia, hull.vessel
    assert config is not None
    assert own is not None
    assert vessel is not None
    rigid = np.diag([hull.mass] * 3 + [0.0] * 3)
    rigid[3:, 3:] = (own.xx, own.xy, own.xz), (own.xy, own.yy, own.yz), (own.xz, own.yz, own.zz)
    rigid, weight = about_origin(rigid, hull.body_com), density * GRAVITY
    if vessel.is_mesh:
        rest = flotation(np.array(vessel.vertices)[np.array(vessel.triangles)], vessel.displacement / density)
        center = np.array((rest.middle, rest.center[1], hull.body_com[2]))
        trim, heel = (weight * rest.volume * height for height in rest.metacentric_heights(center))
        stiffness = about_origin(np.diag([0.0, 0.0, weight * rest.area, heel, trim, 0.0]), center)
        level, draft = rest.level, rest.level - min(z for _, _, z in vessel.vertices)
    else:
        level, stiffness = vessel.waterline, np.array(vessel.restoring)
        draft = vessel.displacement * GRAVITY / stiffness[2, 2]
    found = HullInWaves(vessel, rigid, stiffness, level, density, GRAVITY)
    if vessel.diffraction is None:
        return found, found.radiated() + found.reflected(), draft
    assert config.hydro is not None
    hydro, transform = read_hydro(config.hydro, config.folder), np.eye(6)
    transform[:3, 3:] = np.cross(np.eye(3), hydro.point).T
    return found, found.far_field(hydro, transform), draft


@case("physics/vessel.py", "mjcf/drift.py", "adapters/hydro.py", table="drift")
def mean_drift() -> Outcome:
    """Mean force of waves on a free barge.

    assets/validation/worlds/drift_barge.yaml: a box of 3.2 x 1.4 m with a draft of 0.35 m that only its waves damp,
    roll apart, in regular waves 1 or 4 cm high. The force is the acceleration of its track over 25 s, times its mass
    with the added one at frequency 0.

    Reference: Capytaine's far-field force (Maruo, 1960; Newman, 1967) with its own motions, by its indirect method;
    the band is 10 %, or 2 % of the largest of head waves.
    """
    found = [(row, _mean_force(row["sea"], row["period"])) for row in table_rows("drift")]
    for row, force in found:
        name = f"{row['sea']} waves of {row['period']:g} s, force over amplitude squared"
        yield Comparison(name, "N/m2", row["force"], force)
    head = [(row["period"], row["force"], force) for row, force in found if row["sea"] == "head"]
    period, theirs, ours = np.array(head).T
    lines = Series("Capytaine", period, theirs, kind="points", reference=True), Series("ours", period, ours)
    yield Chart("Mean force of head waves over amplitude squared", "period [s]", "force [N/m2]", lines)


def _mean_force(sea: str, period: float) -> float:
    """Mean force [N/m2] along waves of a period [s] on the free barge, over their amplitude squared.

    Three runs find the speed that the start gives it; the last one starts with the opposite, and so stays where it is:
    at 1 cm/s it would meet waves of another frequency, and near the resonance of roll another force.
    """
    amplitude, omega = _amplitude(period), 2.0 * math.pi / period
    heading, axis = (math.pi, 0) if sea == "head" else (0.5 * math.pi, 1)
    water = {"model": "regular", "height": 2.0 * amplitude, "period": period, "density": 1025.0}
    start, acceleration = np.zeros(6), 0.0
    for _ in range(4):
        sim = packaged_simulation("drift_barge", sea=water)
        with_boat_at(sim, (0.0, 0.0, 0.0, 0.0, 0.0, heading), start.tolist())
        sim.step(duration=15.0)
        times, x = record(sim, lambda sim: only_boat(sim).position[0], 500, 0.05)
        t = times - times.mean()
        waves = [f(n * omega * t) for n in (1, 2) for f in (np.cos, np.sin)]
        basis = np.column_stack([0.5 * t**2, t, np.ones(t.size), *waves, *(t * own for own in waves[:2])])
        acceleration, speed = np.linalg.lstsq(basis, x, rcond=None)[0][:2]
        start[axis] += speed  # along the hull's own axis, which points against the waves
    table = json.loads((folder() / "worlds" / "drift_barge" / "hydro.json").read_text(encoding="utf-8"))
    mass = table["displacement"] + table["added_mass_zero"][axis][axis]
    return float(acceleration * mass / amplitude**2)


def _amplitude(period: float) -> float:
    """Amplitude [m] in waves of a period [s]: beside the resonance of roll, one of 2 cm has 10 % more."""
    return 0.005 if period <= 2.0 else 0.02


@case("physics/vessel.py", "mjcf/drift.py", "adapters/hydro.py", table="drift", quick=False)
def moored_drift() -> Outcome:
    """Mean force of waves on a moored barge.

    The barge of drift_barge.yaml on a spring that gives it a period of 25 s in surge and sway, and holds its heading;
    the mean pull of the spring over 90 s, after 20, by least squares beside the waves and the slow swings.

    Reference: As of mean-drift, which does not depend on so soft a spring; the band is 15 %, or 2 % of the largest of
    head waves.
    """
    for row in table_rows("drift"):
        name = f"{row['sea']} waves of {row['period']:g} s, pull over amplitude squared"
        yield Comparison(name, "N/m2", row["force"], _pull(row["sea"], row["period"], row["force"]))


def _pull(sea: str, period: float, expected: float) -> float:
    """Mean pull [N/m2] of the spring over the amplitude squared; it is let go where the expected one would hold it."""
    amplitude, slow, heading = _amplitude(period), 2.0 * math.pi / 25.0, math.pi if sea == "head" else 0.5 * math.pi
    mass, brake, turning = 2100.0, 40.0, np.array((2000.0, 1000.0))
    water = {"model": "regular", "height": 2.0 * amplitude, "period": period, "density": 1025.0, "ramp": 5.0}
    sim = with_boat_at(packaged_simulation("drift_barge", sea=water), (0.0, 0.0, 0.0, 0.0, 0.0, heading), [0.0] * 6)
    rest = expected * amplitude**2 / (mass * slow**2)
    found = []
    for _ in range(11000):
        boat, rates = only_boat(sim), sim.data.qvel
        x, y = boat.position[0] + rest, boat.position[1]
        yaw = math.remainder(2.0 * math.atan2(boat.quaternion[3], boat.quaternion[0]) - heading, 2.0 * math.pi)
        pull = -mass * slow**2 * np.array((x, y)) - brake * rates[:2]
        sim.data.qfrc_applied[[0, 1, 5]] = *pull, -turning @ (yaw, rates[5])
        sim.step(duration=sim.timestep)
        found.append((sim.time, pull[0]))
    t, pulls = np.array(found[2000:]).T
    swings = [
        np.exp(-0.5 * brake / mass * t) * f(n * slow * t)
        for n in (0.85, 0.9, 0.95, 1.0, 1.05)
        for f in (np.cos, np.sin)
    ]
    waves = [f(n * 2.0 * math.pi / period * t) for n in (1, 2) for f in (np.cos, np.sin)]
    fitted = np.linalg.lstsq(np.column_stack([np.ones(t.size), *waves, *swings]), pulls, rcond=None)[0]
    return float(-fitted[0] / amplitude**2)


@case("physics/wind.py", "physics/drag.py", "runtime/loop.py")
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


def _velocity(sim: Simulation, name: str) -> FloatArray:
    """Velocity (2,) toward east and north [m/s]."""
    seen = sim.observe_object(name)
    found: FloatArray = (np.array(rotation_matrix(seen.quaternion)) @ seen.velocity)[:2]
    return found


def _unit(degrees: float) -> FloatArray:
    return np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])


@case(*_CURRENT_FILES)
def current_tide() -> Outcome:
    """A tide over the depth.

    assets/validation/worlds/drogues.yaml: neutral spheres with much drag, 0.5 to 12 m deep, in a current of 0.3 m/s
    toward 30 degrees with a tide of 0.6 and 0.25 m/s, turning clockwise, over a profile. Their velocities over the
    second of its periods of 300 s: mean and first harmonic.

    Reference: Mean and ellipse of the world's file, times the share of straight lines between the profile's depths.
    """
    current = {
        "speed": _MEAN, "direction": _TOWARD, "profile": _PROFILE,
        "tide": {"speed": _MAJOR, "minor": _MINOR, "direction": _AXIS, "period": _PERIOD, "phase": _PHASE},
    }  # fmt: skip
    sim, samples, names = packaged_simulation("drogues", current=current), 300, [f"drogue{n}" for n in range(1, 6)]
    sim.step(duration=_PERIOD)
    times, found = record(sim, lambda sim: [_velocity(sim, name) for name in names], samples, _PERIOD / samples)
    phase, seen = 2.0 * math.pi / _PERIOD * times[1:], found[1:]
    mean = seen.mean(axis=0)
    swing = 2.0 * np.tensordot(np.exp(-1j * phase), seen, 1) / samples  # of e^(i omega t)
    shares = np.interp(_DEPTHS, *np.transpose(_PROFILE))
    turn = np.exp(1j * math.radians(_PHASE))
    for depth, share, steady, wave in zip(_DEPTHS, shares.tolist(), mean, swing, strict=True):
        at = f"at {depth:g} m"
        along, across = (complex(wave @ _unit(angle) / turn) for angle in (_AXIS, _AXIS + 90.0))
        yield Comparison(f"mean {at}", "m/s", share * _MEAN, steady @ _unit(_TOWARD))
        yield Comparison(f"greatest tide {at}", "m/s", share * _MAJOR, along.real)
        yield Comparison(f"least tide {at}, clockwise", "m/s", share * _MINOR, -across.imag)
    yield _ellipses(seen, shares, phase)


def _ellipses(seen: FloatArray, shares: FloatArray, phase: FloatArray) -> Chart:
    """What the arrow of the current draws at the surface, in the middle and at the bottom of the profile."""
    series: list[Series] = []
    angle = phase + math.radians(_PHASE)
    ring = np.outer(_MAJOR * np.cos(angle), _unit(_AXIS)) + np.outer(_MINOR * np.sin(angle), _unit(_AXIS + 90.0))
    for number in (0, 2, 4):
        east, north = (shares[number] * (_MEAN * _unit(_TOWARD) + ring)).T
        series.append(Series("closed form", east, north, reference=True))
        series.append(Series(f"{_DEPTHS[number]:g} m", seen[::10, number, 0], seen[::10, number, 1], kind="points"))
    return Chart("Velocity over a period, by depth", "east [m/s]", "north [m/s]", series, equal=True)


@case(*_CURRENT_FILES)
def current_random() -> Outcome:
    """The random part of a current.

    assets/validation/worlds/drogue_random.yaml: one of these spheres in a current of a random part alone, 0.1 m/s
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


_MASS = 1025.0 * 4.0 / 3.0 * math.pi * 0.5**3
_DRAG = 0.05 * _MASS
"""Drag of the sphere [N s/m]."""
_LENGTH, _STIFFNESS = 3.0, 200.0
_DEPTH = 5.0
_MOORING_FILES = ("physics/afloat.py", "physics/flotation.py", "physics/conditions.py", "runtime/loop.py")


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
    damping; let go where the rope is straight, its place after 300 s in currents of 0.5, 1 and 1.5 m/s.

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
    damping, in a current of 1 m/s; let go 5 cm from where it rests, along the rope and across it.

    Reference: Along sqrt(s / m - delta^2) and across sqrt(d U / (m r) - delta^2), with r the distance from the
    anchor and delta = d / 2 m: a spring, and a pendulum in the stream. Objects have no added mass. A rope is
    implicit in time, which damps as the step times its stiffness does, here 2 N s/m.
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
    yield Comparison("period along the rope", "s", 2.0 * math.pi / along, found)
    yield Comparison("half a swing over the one before", "", math.exp(-decay * math.pi / along), ratio)
    yield Comparison("period across it", "s", 2.0 * math.pi / across, _swing(later, sway[:, 1])[0])
    closed = np.exp(-decay * times) * (np.cos(along * times) + decay / along * np.sin(along * times))
    lines = Series("closed form", times, aside * closed, reference=True), Series("ours", times, stretch)
    yield Chart("Stretch of the rope beyond that at rest", "time [s]", "stretch [m]", lines)
