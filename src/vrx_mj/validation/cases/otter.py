"""The Otter of published coefficients: top speeds, and periods of its free motions."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Case, Findings, near
from vrx_mj.validation.setups import GRAVITY, packaged_simulation

__all__ = ["CASES"]

THRUST = 0.02216 / 2.0
"""k of the thrust k n^2 of a propeller [N s2/rad2]."""
HULL_MASS, PAYLOAD = 55.0, 25.0
SURGE_DAMPING = 24.4 * GRAVITY / (6.0 * 0.5144)
"""|X_u| [N s/m]: 24.4 kg of bollard pull at 6 knots."""


def _cross(r: FloatArray) -> FloatArray:
    """The matrix S(r) of r x."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def _moved(r: FloatArray) -> FloatArray:
    """The matrix H(r) that moves velocities to a point."""
    found = np.eye(6)
    found[:3, 3:] = _cross(r).T
    return found


def matrices() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mass with added mass, linear damping and stiffness (6, 6) about the origin, in axes forward, right, down."""
    density, length, beam, pontoon, aside, fullness, block = 1025.0, 2.0, 1.08, 0.25, 0.395, 0.75, 0.4
    mass = HULL_MASS + PAYLOAD
    payload = np.array([0.0, 0.0, -0.35])
    center = (HULL_MASS * np.array([0.2, 0.0, -0.2]) + PAYLOAD * payload) / mass
    radii = np.diag([(0.4 * beam) ** 2, (0.25 * length) ** 2, (0.25 * length) ** 2])
    shift, extra = _cross(center), _cross(payload)
    inertia = HULL_MASS * radii - HULL_MASS * shift @ shift - PAYLOAD * extra @ extra
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, 3:] = mass * np.eye(3), inertia
    about = _moved(center)
    added = np.diag([0.1 * HULL_MASS, 1.5 * HULL_MASS, HULL_MASS, *(np.array([0.2, 0.8, 1.7]) * np.diag(inertia))])
    whole = about.T @ rigid @ about + added
    volume, plane = mass / density, fullness * length * pontoon
    draft = volume / (2.0 * block * pontoon * length)
    shape = 6.0 * fullness**3 / ((1.0 + fullness) * (1.0 + 2.0 * fullness))
    across = length * pontoon**3 / 6.0 * shape + 2.0 * plane * aside**2
    along = 0.8 * pontoon * length**3 / 6.0
    lever = (2.5 * draft - 0.5 * volume / (length * pontoon)) / 3.0 - (draft - center[2])  # KB - KG
    weight = density * GRAVITY
    restoring = [2.0 * weight * plane, weight * (across + volume * lever), weight * (along + volume * lever)]
    stiff = np.diag([0.0, 0.0, *restoring, 0.0])
    flotation = _moved(np.array([-0.2, 0.0, 0.0]))
    relative = [2.0 * ratio * math.sqrt(stiff[i, i] * whole[i, i]) for ratio, i in ((0.3, 2), (0.2, 3), (0.4, 4))]
    damping = np.diag([SURGE_DAMPING, 0.0, *relative, whole[5, 5]])
    return whole, damping, flotation.T @ stiff @ flotation


def _periods(stiffness: FloatArray, damping: FloatArray) -> list[float]:
    """Damped periods [s] of accelerations by pose (6, 6) and by velocity (6, 6), the shortest first."""
    system = np.block([[np.zeros((6, 6)), np.eye(6)], [stiffness, damping]])
    return sorted(2.0 * math.pi / value.imag for value in np.linalg.eigvals(system) if value.imag > 1e-3)


def _accelerations(sim: Simulation, pose: FloatArray, velocity: FloatArray) -> FloatArray:
    """Accelerations (6,) of the boat's own velocities in one step."""
    (boat,) = sim.boats
    sim.reset()
    sim.set_boat(boat, pose=pose.tolist(), velocity=velocity.tolist())
    sim.advance(1)
    seen = sim.observe()[boat]
    return (np.concatenate((seen.velocity, seen.angular_velocity)) - velocity) / sim.timestep


def periods() -> Findings:
    """Free motions about rest, linearised."""
    mass, damping, stiffness = matrices()
    inverse: FloatArray = np.asarray(np.linalg.inv(mass), np.float64)
    theirs = _periods(-inverse @ stiffness, -inverse @ damping)
    sim, step, still = packaged_simulation("otter"), 1e-4, np.zeros(6)
    by_pose, by_velocity = np.zeros((6, 6)), np.zeros((6, 6))
    for axis in range(6):
        aside = step * np.eye(6)[axis]
        by_pose[:, axis] = (_accelerations(sim, aside, still) - _accelerations(sim, -aside, still)) / (2.0 * step)
        by_velocity[:, axis] = (_accelerations(sim, still, aside) - _accelerations(sim, still, -aside)) / (2.0 * step)
    ours = _periods(by_pose, by_velocity)
    ours += [math.nan] * (len(theirs) - len(ours))
    rows = [
        near(f"damped period {number}", "s", reference, value, relative=0.01)
        for number, (reference, value) in enumerate(zip(theirs, ours, strict=False), 1)
    ]
    return Findings(tuple(rows))


def surge() -> Findings:
    """Speeds at three rates of the propellers."""
    sim, rows = packaged_simulation("otter"), []
    series: list[Series] = []
    (boat,) = sim.boats
    for rate in (60.0, 80.0, 100.0):
        sim.reset()
        times, speeds = [0.0], [0.0]
        for _ in range(100):
            sim.step({boat: {"left": (rate / 100.0) ** 2, "right": (rate / 100.0) ** 2}}, duration=0.2)
            times.append(sim.time)
            speeds.append(float(sim.observe()[boat].velocity[0]))
        reference = 2.0 * THRUST * rate**2 / SURGE_DAMPING
        rows.append(near(f"speed at {rate:g} rad/s", "m/s", reference, speeds[-1], relative=0.01))
        label = "closed form" if not series else ""
        series.append(Series(label, [0.0, times[-1]], [reference] * 2, reference=True))
        series.append(Series(f"{rate:g} rad/s", times, speeds))
    return Findings(tuple(rows), (Chart("Speed of the Otter", "time [s]", "speed [m/s]", tuple(series)),))


SOURCE = (
    "Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the Python Vehicle "
    "Simulator: mass, added mass, damping and stiffness by its formulas, worked out here a second time."
)
FILES = ("mjcf/hulls.py", "physics/added_mass.py", "physics/vessel.py", "runtime/loop.py")
CASES = (
    Case(
        name="otter-periods",
        title="Free motions of the Otter",
        setup="assets/validation/worlds/otter.yaml, a hull of matrices (hydrostatics: matrix) at rest. "
        "Accelerations in one step from poses 0.1 mm or mrad aside and from velocities of 0.1 mm/s or mrad/s make "
        "the linear system; its damped periods are those of its eigenvalues, of pitch, of heave and of roll and "
        "their couplings.",
        source=f"{SOURCE} Eigenvalues of M, D and G.",
        files=FILES,
        run=periods,
    ),
    Case(
        name="otter-surge",
        title="Speeds of the Otter",
        setup="assets/validation/worlds/otter.yaml with both propellers at 60, 80 and 100 rad/s, 20 s from rest, "
        "without its ballast: trimmed, its payload would push ahead.",
        source=f"{SOURCE} 2 k n^2 = |X_u| u.",
        files=FILES,
        run=surge,
    ),
)
