"""The mean force of waves on a hull, and the part of it that the forces of the loop lack.

The loop's forces are those of first order on the moving hull: pressure of the undisturbed wave on the moved mesh, and
diffraction, radiation and damping in body axes. They hold some of the products of motions and waves of which the mean
force of second order is made, and not the others, so that their mean is as large as the true one and may be of another
sign. What they lack is tabulated here when a world is compiled, for a hull that moves freely.
"""

from dataclasses import replace

import numpy as np

from vrx_mj.arrays import ComplexArray, FloatArray
from vrx_mj.config.dynamics import Hydro
from vrx_mj.mjcf.flotation import below
from vrx_mj.mjcf.hull_tables import hull_tables, nested_tuples
from vrx_mj.model import tables
from vrx_mj.model.boats import Vessel
from vrx_mj.physics.tables import Table
from vrx_mj.physics.vessel import pressure_harmonics

_STEEP = 0.01
"""Amplitude times wavenumber of the waves whose mean is taken; it is of second order up to 0.1 and more."""
_SHORT = 1.2, 1.6
"""Wavenumber times half the waterline from which what the loop lacks of a wave's pressure is added, and all of it."""
_ANGLES = 48
"""Angles of a hull's table of waves, or the next multiple of those that its file has."""
_SMALL = 1e-3
"""Largest amplitude of these waves, as a share of the cube root of the volume displaced."""


def with_drift(
    vessel: Vessel, hydro: Hydro, inertia: FloatArray, stiffness: FloatArray, transform: FloatArray, rest: float,
    density: float,
) -> Vessel:  # fmt: skip
    """Return the model of a hull whose diffraction has what the loop's forces lack, in their mean and of short waves.

    Of these it is what the box of waves leaves out of their pressure on the hull at rest.

    Args:
        vessel: model with diffraction.
        hydro: its file; without drift, the mean is left as it is.
        inertia: (6, 6) of the boat without added mass, about the link's origin.
        stiffness: (6, 6) about the link's origin.
        transform: (6, 6) from motions of the origin to those of the file's point.
        rest: height of the link's origin over the water at rest [m].
        density: of the water [kg/m3].
    """
    assert vessel.diffraction is not None
    table = np.array(vessel.diffraction.forces)
    count, angles = table.shape[:2]
    omega: FloatArray = vessel.diffraction.step * np.arange(1.0, count)
    waves = _waves(omega, angles, vessel, hydro.gravity, density)
    forces = (table[1:, :, :6] + 1j * table[1:, :, 6:]).reshape(-1, 6)
    loads = _Loads(vessel, waves, rest, hydro.gravity, density)
    _, boxed = loads(np.zeros((waves.size, 6), np.complex128))
    if vessel.is_mesh:
        forces = forces + _krylov(vessel, waves, rest, density * hydro.gravity, boxed)
    motions = _motions(vessel, waves, boxed + forces, inertia, stiffness)
    table[1:] = np.concatenate((forces.real, forces.imag), axis=1).reshape(count - 1, angles, 12)
    found = replace(vessel.diffraction, forces=nested_tuples(_with_more_angles(table)))
    if hydro.drift_scattered:
        lacks = _far_field(hydro, density, omega, angles, motions @ transform.T) - _own_mean(
            vessel, waves, loads, forces, motions, inertia, angles
        )
        drift = np.concatenate((np.zeros((1, angles, 3)), lacks.reshape(count - 1, angles, 3)))
        found = replace(found, drift=nested_tuples(_with_more_angles(drift)))
    return replace(vessel, diffraction=found)


def _with_more_angles(values: FloatArray) -> FloatArray:
    """Values (n, m, ...) at even angles over the circle, at a multiple of these near `_ANGLES`, by their harmonics."""
    count = values.shape[1]
    more = count * max(round(_ANGLES / count), 1)
    harmonics = np.fft.rfft(values, axis=1)
    if count % 2 == 0 and more > count:
        harmonics[:, -1] *= 0.5  # of the shortest, whose sine is not known
    return np.asarray(np.fft.irfft(harmonics, more, axis=1) * (more / count), np.float64)


def _waves(omega: FloatArray, angles: int, vessel: Vessel, gravity: float, density: float) -> Table:
    """Small waves of each frequency [rad/s] toward each angle, in deep water."""
    beta = np.tile(2.0 * np.pi / angles * np.arange(angles), omega.size)
    waves = np.zeros(beta.size, tables.WAVE)
    waves["frequency"] = np.repeat(omega, angles)
    waves["wavenumber"] = waves["frequency"] ** 2 / gravity
    waves["direction"] = np.stack((np.cos(beta), np.sin(beta)), axis=1)
    waves["amplitude"] = np.minimum(_STEEP / waves["wavenumber"], _SMALL * np.cbrt(vessel.displacement / density))
    waves["orbital"] = waves["frequency"] * waves["amplitude"]
    return waves


class _Loads:
    """The loop's pressure of single waves on a hull."""

    def __init__(self, vessel: Vessel, waves: Table, rest: float, gravity: float, density: float) -> None:
        own = hull_tables([vessel])
        self._hull, self._waves, self._rest = (own.vessels[0], own.meshes), waves, rest
        sea = np.zeros(1, tables.SEA)
        sea["gravity"], sea["density"], sea["depth"] = gravity, density, np.inf
        self._sea = sea[0]

    def __call__(self, motions: ComplexArray) -> tuple[FloatArray, ComplexArray]:
        """Mean per amplitude squared and first harmonic per amplitude, (n, 6) each, at motions per amplitude (n, 6)."""
        a, found = self._waves["amplitude"][:, None], np.zeros((len(self._waves), 18))
        moved = a * np.concatenate((motions.real, motions.imag), axis=1)
        pressure_harmonics(*self._hull, self._waves, self._sea, self._rest, moved, found)
        return found[:, :6] / a**2, (found[:, 6:12] + 1j * found[:, 12:]) / a


def _krylov(vessel: Vessel, waves: Table, rest: float, weight: float, boxed: ComplexArray) -> ComplexArray:
    """Force per amplitude (n, 6) that the loop's, `boxed`, lacks of the pressure of short waves on the hull at rest.

    Midpoints of edges integrate it over each triangle, on which the loop has it linear. `weight` is that of water
    [N/m3].
    """
    wet = below(np.array(vessel.vertices)[np.array(vessel.triangles)], -rest)
    share = np.cross(wet[:, 2] - wet[:, 0], wet[:, 1] - wet[:, 0])[:, None] / 6.0  # of a midpoint, inward
    places = 0.5 * (wet + np.roll(wet, -1, axis=1))
    loads = np.concatenate((np.broadcast_to(share, places.shape), np.cross(places, share)), axis=2).reshape(-1, 6)
    (x, y, z), k = places.reshape(-1, 3).T, waves["wavenumber"][:, None]
    along = np.outer(waves["direction"][:, 0], x) + np.outer(waves["direction"][:, 1], y)
    whole = weight * (np.exp(k * (z + rest + 1j * along)) @ loads)
    begins, ends = _SHORT
    share = np.clip((0.5 * k * vessel.length - begins) / (ends - begins), 0.0, 1.0)
    return np.asarray(share * (whole - boxed), np.complex128)


def _memory(vessel: Vessel, omega: FloatArray) -> ComplexArray:
    """Force over velocity of the waves that a hull makes, (n, 6, 6), at frequencies (n,) in e^(-i omega t)."""
    found = np.zeros((omega.size, 6, 6), np.complex128)
    for row in vessel.memory:
        pole = complex(*row.pole)
        residue = np.array(row.residue) + 1j * np.array(row.residue_imaginary)
        at = -1j * omega[:, None]
        found[:, :, row.motion] += 0.5 * (residue / (at - pole) + residue.conj() / (at - pole.conjugate()))
    return found


def _orbital(vessel: Vessel, waves: Table) -> ComplexArray:
    """Velocity of the water at the centre of buoyancy per amplitude (n, 3), the link's origin being at the surface."""
    (x, y), (east, north) = vessel.buoyancy[:2], waves["direction"].T
    at = waves["frequency"] * np.exp(1j * waves["wavenumber"] * (x * east + y * north))
    return np.stack((at * east, at * north, -1j * at), axis=1)


def _motions(
    vessel: Vessel, waves: Table, forces: ComplexArray, inertia: FloatArray, stiffness: FloatArray
) -> ComplexArray:
    """Motions of the free hull's origin per amplitude, (n, 6), by the forces of undisturbed and scattered waves."""
    omega = waves["frequency"]
    damping = np.array(vessel.damping)
    resisted = _memory(vessel, omega) + damping
    system = -(omega**2)[:, None, None] * (inertia + np.array(vessel.added_mass)) + stiffness
    system = system - 1j * omega[:, None, None] * resisted
    excited = forces + _orbital(vessel, waves) @ damping[:, :3].T
    return np.asarray(np.linalg.solve(system, excited[..., None])[..., 0], np.complex128)


def _far_field(hydro: Hydro, density: float, omega: FloatArray, angles: int, motions: ComplexArray) -> FloatArray:
    """Mean surge and sway force and yaw moment (n, 3) of the momentum that waves carry away far off."""
    scattered, radiated = (
        np.array(own)[..., 0] + 1j * np.array(own)[..., 1] for own in (hydro.drift_scattered, hydro.drift_radiated)
    )
    a, b = (_between(omega, hydro.waves, own) for own in (scattered, radiated))
    u = motions.reshape(omega.size, angles, 6)
    own = a[..., 0] + np.einsum("nmcj,nmj->nmc", a[..., 1:], u) + np.einsum("nmi,ncij,nmj->nmc", u.conj(), b, u)
    return np.asarray(own.real.reshape(-1, 3) * density / hydro.density, np.float64)


def _between(omega: FloatArray, frequencies: tuple[float, ...], values: ComplexArray) -> ComplexArray:
    """Values at frequencies, on a cubic spline through those of the file and 0 at 0."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(np.concatenate(([0.0], frequencies)), np.concatenate((np.zeros_like(values[:1]), values)))
    return np.asarray(spline(omega), np.complex128)


def _own_mean(
    vessel: Vessel, waves: Table, loads: _Loads, forces: ComplexArray, motions: ComplexArray, inertia: FloatArray,
    angles: int,
) -> FloatArray:  # fmt: skip
    """Mean surge and sway force and yaw moment (n, 3) of the loop's forces on a hull with these motions.

    Body-axes forces F turn with the hull by w: half the real part of conj(w) x F. Diffraction is met where the hull is
    and at its heading. Added mass has no mean force (Kirchhoff), and its mean moment is that of Munk. What damping does
    to the slip of a steady drift is no part of it.
    """
    omega, k, (east, north) = waves["frequency"], waves["wavenumber"], waves["direction"].T
    mean, _ = loads(motions)
    rate = -1j * omega[:, None] * motions
    slip = rate.copy()
    slip[:, :3] -= _orbital(vessel, waves)
    turning = forces - np.einsum("nij,nj->ni", _memory(vessel, omega), rate) - slip @ np.array(vessel.damping).T
    spin = motions[:, 3:].conj()
    mean[:, :3] += 0.5 * np.cross(spin, turning[:, :3]).real
    mean[:, 3:] += 0.5 * np.cross(spin, turning[:, 3:]).real
    mean += 0.5 * np.cross(spin, slip[:, :3]).real @ np.array(vessel.damping)[:, :3].T
    around = forces.reshape(-1, angles, 6)
    order = np.fft.fftfreq(angles, 1.0 / angles)[:, None] * (np.abs(np.fft.fftfreq(angles)) < 0.5)[:, None]
    slope = np.fft.ifft(1j * order * np.fft.fft(around, axis=1), axis=1).reshape(-1, 6)
    path = k * (east * motions[:, 0] + north * motions[:, 1])
    mean += 0.5 * (1j * forces * path.conj()[:, None] - slope * motions[:, 5:].conj()).real
    impulse = rate @ np.array(vessel.added_mass)[:3].T
    if not vessel.munk:
        impulse = rate[:, 3:] @ np.array(vessel.added_mass)[:3, 3:].T
    carried = (-(omega**2)[:, None] * motions) @ inertia[:3].T
    moment = np.cross(motions[:, :3].conj(), carried) - np.cross(rate[:, :3].conj(), impulse)
    mean[:, 5] += 0.5 * moment[:, 2].real
    return np.asarray(mean[:, [0, 1, 5]], np.float64)
