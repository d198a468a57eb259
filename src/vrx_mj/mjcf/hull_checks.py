"""Whether a hull of profile `marine` can be: its lift, its inertia, and small motions about its rest."""

import math
import warnings
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.mjcf.flotation import flotation
from vrx_mj.mjcf.radiation import about_origin
from vrx_mj.model.boats import Vessel
from vrx_mj.model.water import Sea
from vrx_mj.physics.tables import MATRIX
from vrx_mj.rigid_bodies import MassProperties

_GRAVITY = 9.81
"""Gravity in the stiffness at rest [m/s2]; a world's own is within 1 %."""
_FASTEST = 1000.0
"""Fastest motion about the rest [rad/s]: a boat of a draft of 0.01 mm has that."""
_GROWTH = 1e-3
"""Rate [1/s] up to which a motion that grows may be rounding."""
_MOST_LOST = 0.01
"""Share of a sea's energy that may be beyond the last frequency of a hull's file without a remark."""
_MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def check_mass(name: str, added: FloatArray, body: MassProperties, key: str) -> None:
    """Refuse added mass (6, 6) about the origin that is not symmetric, or not positive definite with the boat's own.

    Raises:
        VrxError: the boat would push itself.
    """
    odd = np.abs(added - added.T)
    if odd.max() > 1e-6 * np.abs(added).max():
        row, column = (int(value) + 1 for value in np.unravel_index(odd.argmax(), odd.shape))
        raise VrxError(
            f"robot {name}: hull.{key} is not symmetric: A{row}{column} is {added[row - 1, column - 1]:.4g}, "
            f"A{column}{row} is {added[column - 1, row - 1]:.4g}; an ideal fluid's is"
        )
    values, vectors = np.linalg.eigh(_inertia(body) + added)
    if values[0] <= 0.0:
        motion = _MOTIONS[int(np.abs(vectors[:, 0]).argmax())]
        raise VrxError(
            f"robot {name}: the mass of hull.{key} and the boat is not positive definite: its least eigenvalue is "
            f"{values[0]:.4g}, mostly of {motion}; check signs and sizes off the diagonal, and `point`"
        )


def _inertia(body: MassProperties) -> FloatArray:
    """The boat's own inertia (6, 6) about the link's origin."""
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, 3:] = body.mass * np.eye(3), body.inertia
    return about_origin(rigid, body.center)


def check_rest(name: str, vessel: Vessel, body: MassProperties, density: float, said: Sequence[str]) -> None:
    """Warn of a hull that capsizes or lies oddly, unless that is in `said`; refuse one that its waves swing up.

    Raises:
        VrxError: small motions about its rest grow by its memory, or are too fast for any step.
    """
    stiffness, notes = _stiffness_at_rest(vessel, body, density)
    for note in notes:
        if not any(note in other for other in said):
            warnings.warn(f"robot {name}: {note}", VrxWarning, stacklevel=2)
    rates = _rates(_inertia(body) + np.array(vessel.added_mass), stiffness, vessel)
    fastest = float(np.abs(rates).max())
    if fastest > _FASTEST:
        raise VrxError(
            f"robot {name}: its fastest motion about its rest is one of {fastest:.3g} rad/s, for which steps of "
            f"{0.2 / fastest:.1g} s are needed; check the units of its hull, and the mass and inertia of its links"
        )
    worst = rates[rates.real.argmax()]
    if worst.real > _GROWTH:
        swing = f", with a period of {2.0 * math.pi / abs(worst.imag):.3g} s" if abs(worst.imag) > 1e-6 else ""
        text = f"robot {name} is unstable: a small motion about its rest grows at {worst.real:.3g} 1/s{swing}"
        if vessel.memory:
            raise VrxError(f"{text}; its memory of waves gives it energy: check poles and residues of `hydro`")
        warnings.warn(f"{text}; check the entries of `damping_linear`", VrxWarning, stacklevel=2)


def warn_if_uncovered(name: str, vessel: Vessel | None, sea: Sea) -> None:
    """Warn of a sea of which more than `_MOST_LOST` is beyond the frequencies of a hull's diffraction.

    Its directions are all around the hull, and it begins at 0: nothing else is outside.
    """
    if vessel is None or vessel.diffraction is None:
        return
    last = vessel.diffraction.step * (len(vessel.diffraction.forces) - 1)
    energies = [(wave.frequency >= last, wave.amplitude**2) for wave in sea.waves]
    whole = math.fsum(energy for _, energy in energies)
    beyond = math.fsum(energy for outside, energy in energies if outside)
    if beyond > _MOST_LOST * whole:
        warnings.warn(
            f"robot {name}: {100.0 * beyond / whole:.3g} % of the sea's energy is in waves beyond {last:.3g} rad/s, "
            f"the last frequency of its `hydro`, shorter than {2.0 * math.pi / last:.3g} s: they are not scattered; "
            "compute it to higher frequencies, with more `--panels`",
            VrxWarning,
            stacklevel=4,
        )


def _stiffness_at_rest(vessel: Vessel, body: MassProperties, density: float) -> tuple[FloatArray, list[str]]:
    """Stiffness (6, 6) about the origin without what capsizes it, and remarks about how it lies."""
    if vessel.hydrostatics == MATRIX:
        restoring = about_origin(np.array(vessel.restoring), -np.array(vessel.point))
        notes = [
            f"hull.restoring of {_MOTIONS[index]} is {restoring[index, index]:.4g} N m: it capsizes"
            for index in (3, 4)
            if restoring[index, index] < 0.0
        ]
        values, vectors = np.linalg.eigh(0.5 * (restoring + restoring.T))
        return about_origin((vectors * np.maximum(values, 0.0)) @ vectors.T, np.array(vessel.point)), notes
    corners = np.array(vessel.vertices)[np.array(vessel.triangles)]
    wet = flotation(corners, body.mass / density)
    weight = density * _GRAVITY
    trim, heel = (weight * wet.volume * max(height, 0.0) for height in wet.metacentric_heights(body.center))
    own = np.diag([0.0, 0.0, weight * wet.area, heel, trim, 0.0])
    return about_origin(own, np.array([wet.center[0], wet.center[1], body.center[2]])), wet.remarks(body.center)


def _rates(inertia: FloatArray, stiffness: FloatArray, vessel: Vessel) -> npt.NDArray[np.complex128]:
    """Complex rates [1/s] of small motions about the rest: of M a + D v + sum of Re(r x) + C s = 0, x' = p x + v."""
    count = len(vessel.memory)
    system = np.zeros((12 + 2 * count, 12 + 2 * count))
    force = np.zeros((6, 12 + 2 * count))
    force[:, :6], force[:, 6:12] = -stiffness, -np.array(vessel.damping)
    for index, memory in enumerate(vessel.memory):
        row, (real, imaginary) = 12 + 2 * index, memory.pole
        system[row : row + 2, row : row + 2] = [[real, -imaginary], [imaginary, real]]
        system[row, 6 + memory.motion] = 1.0
        force[:, row], force[:, row + 1] = -np.array(memory.residue), np.array(memory.residue_imaginary)
    system[:6, 6:12] = np.eye(6)
    system[6:12] = np.linalg.solve(inertia, force)
    return np.linalg.eigvals(system).astype(np.complex128)
