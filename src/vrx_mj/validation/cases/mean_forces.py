"""The mean force of waves: on a barge that is free, moored and towed, and how fast boats drift by it."""

import json
import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from vrx_mj.arrays import FloatArray
from vrx_mj.config.dynamics import read_hydro
from vrx_mj.config.robots import load_robot
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.mjcf.drift import HullInWaves
from vrx_mj.mjcf.flotation import faces_of, flotation
from vrx_mj.mjcf.hulls import about_origin
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Hull
from vrx_mj.model.water import Sea
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import (
    GRAVITY,
    Comparison,
    Outcome,
    case,
    folder,
    marine_world,
    only_boat,
    packaged_simulation,
    record,
    rows,
    with_boat_at,
)

_ROBOTS = "barge_10m", "barge_4m", "blueboat", "cylinder", "heron", "kingfisher", "otter", "wamv", "cora", "skiff"
_FREE = tuple((robot, *way) for robot in _ROBOTS for way in (("stern to it", 0.0), ("beam to it", 0.5 * math.pi)))
"""Robots with a hull of their own that something brakes, and their headings [rad]."""
_SWELL = {"model": "regular", "height": 0.8, "period": 6.0, "ramp": 12.0}
_SEA = {"model": "jonswap", "significant_height": 0.3, "peak_period": 4.0, "direction": [1.0, 0.0], "ramp": 20.0}
_SEEDS = 0, 1
_SPHERES = 6
"""Spheres in each of the seas."""
_TOWARD = {"head": math.pi, "beam": 0.5 * math.pi, "following": 0.0}
"""Angles off the bow toward which waves travel [rad]."""


@case("physics/drift.py", "mjcf/drift.py", "physics/vessel.py", quick=False)
def waves_adrift() -> Outcome:
    """Boats adrift in waves.

    Robots without commands in a swell of 6 s, 0.8 m from trough to crest, stern and beam to the waves: the slope
    of their track over 50 periods, after 300; and in a JONSWAP sea of 0.3 m and 4 s, over 900 s after 900, the mean of
    two seeds. Both begin with a ramp. Boats are free to yaw. The sphere has no damping: its acceleration in the
    sea is measured, from 60 to 360 s, the mean of six spheres and two seeds.

    Reference: The speed at which damping balances the mean force of the waves, sum a^2 D. Damping is d s + q |s| s and
    cross-flow drag, averaged over the hull's motion relative to the water, with s the speed minus the Stokes drift at
    half the draft T, sum omega k a^2 e^(-k T). D is that of the waves that the hull makes (Maruo, 1960) and reflects
    (Faltinsen et al., 1980), or with a file the far-field force, at the hull's headings and speed (Aranha,
    1994). The added mass of the sphere is half of its mass (Lamb, 1932).
    """
    for name, sea, seeds, times in (("swell", _SWELL, (0,), (1800.0, 2100.0)), ("sea", _SEA, _SEEDS, (900.0, 1800.0))):
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
        turns = np.linspace(0.0, math.tau, speeds.size, endpoint=False)
        reference = np.interp(-yaw, turns, speeds, period=math.tau).mean()
        found.append((float(reference), float(np.polyfit(times, x, 1)[0])))
    return found


def _spheres_in_sea(seed: int) -> tuple[float, float]:
    """Reference and our mean acceleration [m/s2] of spheres."""
    world = _adrift([("sphere", "", 0.0)] * _SPHERES, _SEA, seed)
    sim, calm = Simulation(world), _adrift([("sphere", "", 0.0)], {"model": "none"}, seed)
    hull = calm.parameters.hulls[0]  # with the forces of its file alone
    sim.step(duration=60.0)
    times, track = record(sim, _places, 300, 1.0)
    own, gained = _SeaOnHull("sphere", hull, world.parameters.sea), 0.0
    for _ in range(4):  # the force is less the faster it goes: at the middle of the record
        gained = float(own.force_at(gained * float(times.mean()))[0, 0] / (1.5 * hull.mass))
    return gained, float(2.0 * np.polyfit(times, track[:, :, 0], 2)[0].mean())


class _SeaOnHull:
    """A sea on a free hull, by m angles off its bow toward which it travels, even over the circle."""

    slip: FloatArray
    """The hull's swinging velocity through the water (m, n, 6) [m/s, rad/s], at n times far apart."""
    stokes: float
    """Stokes drift at half the draft [m/s]."""

    def __init__(self, robot: str, hull: Hull, sea: Sea) -> None:
        own, force, draft = _in_waves(robot, hull, sea.density)
        self._waves = omega, a = np.array([(wave.frequency, wave.amplitude) for wave in sea.waves]).T
        self._own, self._force = own, force[:, :2]
        k, phases = omega**2 / GRAVITY, np.random.default_rng(1).uniform(0.0, math.tau, omega.size)
        swing = a * np.exp(1j * (phases - np.outer(17.3 * np.arange(1000.0), omega)))
        slip = (swing @ self._by_angle(own.slip, omega)).real
        self.slip = np.concatenate((slip, -slip), axis=1)
        self.stokes = float((omega * k * a**2 * np.exp(-k * draft)).sum())

    def _by_angle(self, values: npt.NDArray[Any], omega: FloatArray) -> npt.NDArray[Any]:
        """Values of each of the sea's waves (m, n, ...), of those of the hull's at some frequencies."""
        known = np.concatenate(([0.0], self._own.frequencies))
        values = values.reshape(self._own.frequencies.size, self._own.angles, -1)
        values = np.concatenate((np.zeros_like(values[:1]), values))
        return np.asarray(CubicSpline(known, values)(np.minimum(omega, known[-1]))).transpose(1, 0, 2)

    def force_at(self, speed: float) -> FloatArray:
        """Mean surge and sway force (m, 2) [N] on a hull that goes with the waves at a speed [m/s]: Aranha (1994)."""
        omega, a = self._waves
        tau = omega * speed / GRAVITY
        found: FloatArray = ((1.0 - 4.0 * tau) * a**2) @ self._by_angle(self._force, (1.0 - tau) * omega)
        return found


def _steady_speeds(hull: Hull, sea: _SeaOnHull) -> FloatArray:
    """Speeds of a free hull along a sea [m/s], (m,): what damps it, in the mean over its swinging, takes the force."""
    vessel, speeds = hull.vessel, []
    assert vessel is not None
    (x, y, z), (ahead, aside, *_) = vessel.point, vessel.damping_quadratic
    for number, slip in enumerate(sea.slip):
        u, v, _, p, q, r = slip.T
        turn, speed = math.tau * number / len(sea.slip), 0.0
        drags = (
            ((ahead, u + q * z - r * y),),
            ((aside, v + r * x - p * z), *((strip.drag, v + r * strip.x - p * strip.z) for strip in vessel.strips)),
        )
        for _ in range(4):  # the force is less the faster it goes
            through = [
                brentq(
                    lambda s, d=d, f=f, own=own: d * s + sum((k * np.abs(s + w) * (s + w)).mean() for k, w in own) - f,
                    -9.0,
                    9.0,
                )
                for d, f, own in zip(np.diag(vessel.damping)[:2], sea.force_at(speed)[number], drags, strict=True)
            ]
            speed = sea.stokes + math.cos(turn) * through[0] + math.sin(turn) * through[1]
        speeds.append(speed)
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
        rest = flotation(faces_of(vessel), vessel.displacement / density)
        center = np.array((rest.middle, rest.center[1], hull.body_com[2]))
        trim, heel = (weight * rest.volume * height for height in rest.metacentric_heights(center))
        stiffness = about_origin(np.diag([0.0, 0.0, weight * rest.area, heel, trim, 0.0]), center)
        level, draft = rest.level, rest.level - min(z for _, _, z in vessel.vertices)
    else:
        level, stiffness = vessel.waterline, np.array(vessel.restoring)
        draft = vessel.displacement * GRAVITY / stiffness[2, 2]
    found = HullInWaves(vessel, rigid, stiffness, level, density, GRAVITY)
    if vessel.diffraction is None:
        return found, found.radiation_drift() + found.reflection_drift(), draft
    assert config.hydro is not None
    hydro, transform = read_hydro(config.hydro, config.folder), np.eye(6)
    transform[:3, 3:] = np.cross(np.eye(3), hydro.point).T
    return found, found.far_field(hydro, transform), draft


@case("physics/vessel.py", "mjcf/drift.py", "adapters/hydro.py", table="drift")
def mean_drift() -> Outcome:
    """Mean force of waves on a free barge.

    assets/validation/worlds/drift_barge.yaml: a box of 3.2 x 1.4 m with a draft of 0.35 m, damped only by its waves
    except in roll, in regular waves 1 or 4 cm high. The force is the acceleration of its track over 25 s, times its
    mass and its added mass at frequency 0.

    Reference: Capytaine's far-field force (Maruo, 1960; Newman, 1967) with its own motions, by its indirect method;
    the band is 10 %, or 2 % of the largest of head waves.
    """
    found = [(row, _mean_force(row["sea"], row["period"])) for row in rows("drift")]
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
    amplitude, omega = _amplitude(period), math.tau / period
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
    the mean force of the spring over 90 s, after 20, by least squares together with the waves and the slow oscillation.

    Reference: That of mean-drift, since so soft a spring does not affect it; the band is 15 %, or 2 % of the largest of
    head waves.
    """
    for row in rows("drift"):
        name = f"{row['sea']} waves of {row['period']:g} s, pull over amplitude squared"
        toward = _TOWARD[row["sea"]]
        ahead, aside = row["force"] * math.cos(toward), row["force"] * math.sin(toward)
        x, y = _line_force(toward, row["period"], 0.0, (ahead, aside))
        yield Comparison(name, "N/m2", row["force"], math.cos(toward) * x + math.sin(toward) * y)


@case("physics/drift.py", "mjcf/drift.py", "physics/vessel.py", table="towed", quick=False)
def towed_drift() -> Outcome:
    """Mean force of waves on a towed barge.

    The barge of moored-drift on the same spring, whose end moves ahead at 0.1 or 0.2 m/s; it has no resistance in calm
    water. The mean force ahead, and in beam waves also sideways.

    Reference: Aranha (1994), 1 - 4 tau times the force at rest of waves of the frequency of encounter, from a direction
    2 tau further ahead, with tau = omega U / g along and across them; that force is Capytaine's far-field one. The band
    is 15 %, or 2 % of the largest of head waves at rest.
    """
    for row in rows("towed"):
        expected = row["ahead"], row["aside"]
        ahead, aside = _line_force(_TOWARD[row["sea"]], row["period"], row["speed"], expected)
        name = f"{row['sea']} waves of {row['period']:g} s at {row['speed']:g} m/s, force"
        yield Comparison(f"{name} ahead over amplitude squared", "N/m2", row["ahead"], ahead)
        if row["sea"] == "beam":
            yield Comparison(f"{name} aside over amplitude squared", "N/m2", row["aside"], aside)


def _line_force(toward: float, period: float, speed: float, expected: tuple[float, float]) -> tuple[float, float]:
    """Mean force [N/m2] of waves on a spring ahead and aside over the amplitude squared, as it goes ahead [m/s].

    The barge is let go where the expected force would hold it.
    """
    amplitude, slow, omega = _amplitude(period), math.tau / 25.0, math.tau / period
    mass, brake, turning = 2100.0, 40.0, np.array((2000.0, 1000.0))
    water = {"model": "regular", "height": 2.0 * amplitude, "period": period, "density": 1025.0, "ramp": 5.0}
    sim = with_boat_at(packaged_simulation("drift_barge", sea=water), (0.0,) * 5 + (-toward,), (speed,) + (0.0,) * 5)
    way = np.array((math.cos(toward), -math.sin(toward)))
    aside = np.array((-way[1], way[0]))
    rest = (expected[0] * way + expected[1] * aside) * amplitude**2 / (mass * slow**2)
    found = []
    for _ in range(11000):
        boat, rates = only_boat(sim), sim.data.qvel
        stretch = np.array(boat.position[:2]) + rest - speed * sim.time * way
        yaw = math.remainder(2.0 * math.atan2(boat.quaternion[3], boat.quaternion[0]) + toward, math.tau)
        pull = -mass * slow**2 * stretch - brake * (rates[:2] - speed * way)
        sim.data.qfrc_applied[[0, 1, 5]] = *pull, -turning @ (yaw, rates[5])
        sim.step(duration=sim.timestep)
        found.append((sim.time, pull @ way, pull @ aside))
    t, *pulls = np.array(found[2000:]).T
    met = omega - omega**2 / GRAVITY * speed * math.cos(toward)
    swings = [
        np.exp(-0.5 * brake / mass * t) * f(n * slow * t)
        for n in (0.85, 0.9, 0.95, 1.0, 1.05)
        for f in (np.cos, np.sin)
    ]
    waves = [f(n * met * t) for n in (1, 2) for f in (np.cos, np.sin)]
    fitted = np.linalg.lstsq(np.column_stack([np.ones(t.size), *waves, *swings]), np.transpose(pulls), rcond=None)[0]
    return float(-fitted[0, 0] / amplitude**2), float(-fitted[0, 1] / amplitude**2)
