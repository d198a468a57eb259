"""The mean force of waves on a hull, and the part of it that the forces of the loop lack.

The loop's forces are those of first order on the moving hull: pressure of the undisturbed wave on the moved mesh, and
diffraction, radiation, damping and added mass in body axes. They hold some of the products of motions and waves of
which the mean force of second order is made, and not the others, so that their mean is as large as the true one and may
be of another sign. What they lack is tabulated here when a world is compiled, for a hull that moves freely.

The mean force itself is what a file knows of the waves far off the hull. Without that it is the sum of two parts: that
of the waves that a rigid hull makes by its motions against the water, and that of those that its sides reflect.
"""

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ComplexArray, FloatArray
from vrx_mj.config.dynamics import Hydro
from vrx_mj.mjcf.flotation import below, faces_of, outline
from vrx_mj.model import tables
from vrx_mj.model.boats import Drift, Vessel
from vrx_mj.model.tables import hull_tables, nested_tuples
from vrx_mj.physics.drift import FASTEST
from vrx_mj.physics.tables import Table
from vrx_mj.physics.vessel import load_harmonics

_STEEPNESS = 0.01
"""Amplitude times wavenumber of the waves of which the mean force is taken; it is of second order up to 0.1 and
more."""
_SHORT_WAVES = 1.2, 1.6
"""Wavenumber times half the hull's extent along a wave from which the part that its box lacks is added, and added in
full."""
_MIN_ANGLES = 48
"""Least number of angles of a table of diffraction; the next multiple of those in the hull's file is taken."""
_MAX_AMPLITUDE = 1e-3
"""Largest amplitude of these waves, as a share of the cube root of the displaced volume."""
_FREQUENCIES, _ANGLES, _MIN_WAVELENGTH = 64, 16, 0.25
"""Numbers of frequencies and angles without diffraction, and the shortest wave over the length of the waterline."""
_TAU, _FROUDE = 0.5 * FASTEST, 0.3
"""Speed times frequency over gravity at which derivatives are taken, and the largest Froude number of these speeds."""
_STRIDE = 2
"""Derivatives are computed at every so many frequencies."""


class HullInWaves:
    """A free hull in small waves of n frequencies toward m angles; arrays are of n m waves, by frequency first."""

    def __init__(
        self, vessel: Vessel, inertia: FloatArray, stiffness: FloatArray, level: float, density: float, gravity: float
    ) -> None:
        """Compute its motions, without speed.

        Args:
            vessel: its model.
            inertia: (6, 6) of the boat without added mass, about the link's origin.
            stiffness: (6, 6) about the link's origin.
            level: height of the water at rest over the link's origin [m].
            density: of the water [kg/m3].
            gravity: [m/s2]
        """
        self.vessel, self._inertia, self._level, self._density, self._gravity = vessel, inertia, level, density, gravity
        self.most = density * gravity * vessel.length
        self._stiffness, self._added, self._linear = stiffness, np.array(vessel.added_mass), np.array(vessel.damping)
        own = hull_tables([vessel])
        self._hull = own.vessels[0], own.meshes
        count, self.angles = _FREQUENCIES, _ANGLES
        self.step = float(np.sqrt(2.0 * np.pi * gravity / (_MIN_WAVELENGTH * vessel.length))) / count
        if vessel.diffraction:
            count, self.angles = len(vessel.diffraction.forces) - 1, len(vessel.diffraction.forces[0])
            self.step = vessel.diffraction.step
        self.frequencies, self.scattered = self.step * np.arange(1.0, count + 1.0), np.zeros((0, 6), np.complex128)
        self._meet_waves(np.zeros(2))

    def at(self, tau: FloatArray) -> "HullInWaves":
        """The hull at a velocity (2,) ahead and to the left, times frequency over gravity, of `every` such frequency.

        In long waves it is no faster than its displacement carries it.
        """
        own = copy.copy(self)
        own.frequencies, own.scattered = self.frequencies[_STRIDE - 1 :: _STRIDE], self.every(self.scattered)
        own._meet_waves(tau)
        return own

    def _meet_waves(self, tau: FloatArray) -> None:
        """Motions, forces and slip at such a velocity."""
        self.waves = self._small_waves()
        omega, (cos, sin) = self.waves["frequency"], self.waves["direction"].T
        fastest = _FROUDE * np.sqrt(self.vessel.length / self._gravity) * omega
        self.tau = np.minimum(1.0, fastest / max(np.hypot(*tau), 1e-9))[:, None] * tau
        self.velocities = np.pad(self.tau * self._gravity / omega[:, None], ((0, 0), (0, 1)))
        self.along = self.tau[:, 0] * cos + self.tau[:, 1] * sin
        self.across = self.tau[:, 0] * sin - self.tau[:, 1] * cos
        self._encounter = omega * (1.0 - self.along)
        self._memory, axes = _memory(self.vessel, self._encounter), np.eye(3)
        self._tilted = np.zeros((omega.size, 6, 6))
        self._tilted[:, :3, 3:] = np.tensordot(self.velocities, [cross_matrix(axis) for axis in axes], 1)
        carried = [coriolis(self._added, axis, munk=bool(self.vessel.munk)) for axis in axes]
        self.motions = self._free_motions(self._linear + self._memory - np.tensordot(self.velocities, carried, 1))
        self.mean, _, self.slip = self._loads(self.motions)

    def _small_waves(self) -> Table:
        """The waves, in deep water."""
        beta = np.tile(2.0 * np.pi / self.angles * np.arange(self.angles), self.frequencies.size)
        waves = np.zeros(beta.size, tables.WAVE)
        waves["frequency"] = np.repeat(self.frequencies, self.angles)
        waves["wavenumber"] = waves["frequency"] ** 2 / self._gravity
        waves["direction"] = np.stack((np.cos(beta), np.sin(beta)), axis=1)
        small = _MAX_AMPLITUDE * np.cbrt(self.vessel.displacement / self._density)
        waves["amplitude"] = np.minimum(_STEEPNESS / waves["wavenumber"], small)
        waves["orbital"] = waves["frequency"] * waves["amplitude"]
        return waves

    def _loads(self, motions: ComplexArray) -> tuple[FloatArray, ComplexArray, ComplexArray]:
        """The loop's forces at motions per amplitude (n m, 6), but those of memory and diffraction.

        Their mean per amplitude squared, without what they are in calm water, and the first harmonics per amplitude of
        them and of the velocity through the water, (n m, 6) each.
        """
        a, found = self.waves["amplitude"][:, None], np.zeros((self.waves.size, 5, 6))
        sea = np.zeros(1, tables.SEA)
        sea["gravity"], sea["density"], sea["depth"] = self._gravity, self._density, np.inf
        moved = a * np.concatenate((motions.real, motions.imag), axis=1)
        load_harmonics(*self._hull, self.waves, sea[0], -self._level, moved, self.velocities, found)
        found[:, 0, :2] += self.velocities @ self._linear[:2, :3].T
        found[:, 0, 5] += self.velocities @ self._linear[5, :3]
        if self.vessel.munk:
            found[:, 0, 5] += np.cross(self.velocities, self.velocities @ self._added[:3, :3].T)[:, 2]
        first = (found[:, [1, 3]] + 1j * found[:, [2, 4]]) / a[..., None]
        return found[:, 0] / a**2, first[:, 0], first[:, 1]

    def _free_motions(self, damping: ComplexArray) -> ComplexArray:
        """Motions of its origin per amplitude; `damping`, (n m, 6, 6), is of velocities in its axes."""
        omega = self._encounter[:, None, None]
        still = np.zeros((self.waves.size, 6), np.complex128)
        _, self.excited, slip = self._loads(still)
        if not self.scattered.size:
            self.scattered = self._diffraction(slip)
        self.excited += self.scattered
        if not self.vessel.diffraction:
            self.excited -= np.einsum("nij,nj->ni", self._memory, slip)
        system = self._stiffness - omega**2 * (self._inertia + self._added)
        system = system + damping @ (self._tilted - 1j * omega * np.eye(6))
        return np.asarray(np.linalg.solve(system, self.excited[..., None])[..., 0], np.complex128)

    def _diffraction(self, slip: ComplexArray) -> ComplexArray:
        """Force of diffraction per amplitude (n m, 6), with what the loop lacks of short waves on a mesh."""
        if not self.vessel.diffraction:
            return np.zeros((self.waves.size, 6), np.complex128)
        table = np.array(self.vessel.diffraction.forces)[1:].reshape(-1, 12)
        found = table[:, :6] + 1j * table[:, 6:]
        if self.vessel.is_mesh:
            found += self._left_out(self.excited + slip @ self._linear.T)
        return np.asarray(found, np.complex128)

    def _left_out(self, boxed: ComplexArray) -> ComplexArray:
        """Force per amplitude (n m, 6) that the loop's, `boxed`, lacks of short waves' pressure on the hull at rest.

        Midpoints of edges integrate it over each triangle, on which the loop has it linear.
        """
        vessel, level, k = self.vessel, self._level, self.waves["wavenumber"][:, None]
        wet = below(faces_of(vessel), level)
        share = np.cross(wet[:, 2] - wet[:, 0], wet[:, 1] - wet[:, 0])[:, None] / 6.0  # of a midpoint, inward
        places = 0.5 * (wet + np.roll(wet, -1, axis=1))
        loads = np.concatenate((np.broadcast_to(share, places.shape), np.cross(places, share)), axis=2).reshape(-1, 6)
        along, z = self.waves["direction"] @ places[..., :2].reshape(-1, 2).T, places[..., 2].ravel()
        whole = self._density * self._gravity * (np.exp(k * (z - level + 1j * along)) @ loads)
        begins, ends = _SHORT_WAVES
        share = np.clip((0.5 * k * np.ptp(along, axis=1, keepdims=True) - begins) / (ends - begins), 0.0, 1.0)
        return np.asarray(share * (whole - boxed), np.complex128)

    @property
    def _rate(self) -> ComplexArray:
        """Velocities in its axes per amplitude, with what it has of its own velocity where it turns."""
        turned = np.einsum("nij,nj->ni", self._tilted, self.motions)
        return np.asarray(turned - 1j * self._encounter[:, None] * self.motions, np.complex128)

    def own_mean(self) -> FloatArray:
        """Mean surge and sway force and yaw moment (n m, 3) of the loop's forces, with these motions.

        Body-axes forces F turn with the hull by w: half the real part of conj(w) x F. Diffraction is met where the
        hull is and at its heading. What damping does with the Stokes drift at half the draft is no part of it.
        """
        vessel, k, (east, north) = self.vessel, self.waves["wavenumber"], self.waves["direction"].T
        mean, motions, forces = self.mean.copy(), self.motions, self.scattered
        drift = (self.waves["frequency"] * k * np.exp(-k * self._sides()[0]))[:, None] * self.waves["direction"]
        mean -= drift @ self._linear[:, :2].T
        through = self._rate if vessel.diffraction else self.slip
        turning = forces - np.einsum("nij,nj->ni", self._memory, through)
        spin = motions[:, 3:].conj()
        mean[:, :3] += 0.5 * np.cross(spin, turning[:, :3]).real
        mean[:, 3:] += 0.5 * np.cross(spin, turning[:, 3:]).real
        around = forces.reshape(-1, self.angles, 6)
        order = np.fft.fftfreq(self.angles, 1.0 / self.angles)[:, None]
        order[2.0 * np.abs(order) == self.angles] = 0.0  # whose sine is not known
        slope = np.fft.ifft(1j * order * np.fft.fft(around, axis=1), axis=1).reshape(-1, 6)
        path = k * (east * motions[:, 0] + north * motions[:, 1])
        mean += 0.5 * (1j * forces * path.conj()[:, None] - slope * motions[:, 5:].conj()).real
        carried = -(self._encounter[:, None] ** 2) * motions @ self._inertia[:3].T
        mean[:, 5] += 0.5 * np.cross(motions[:, :3].conj(), carried)[:, 2].real
        return np.asarray(mean[:, [0, 1, 5]], np.float64)

    def far_field(self, hydro: Hydro, transform: FloatArray) -> FloatArray:
        """Mean surge and sway force and yaw moment (n m, 3) of the momentum that waves carry away far off.

        `transform` is the (6, 6) from motions of the origin to those of the file's point.
        """
        scattered, radiated = (
            np.array(own)[..., 0] + 1j * np.array(own)[..., 1] for own in (hydro.drift_scattered, hydro.drift_radiated)
        )
        a, b = (_between(self.frequencies, hydro.waves, own) for own in (scattered, radiated))
        u = (self.motions @ transform.T).reshape(-1, self.angles, 6)
        own = a[..., 0] + np.einsum("nmcj,nmj->nmc", a[..., 1:], u) + np.einsum("nmi,ncij,nmj->nmc", u.conj(), b, u)
        return np.asarray(own.real.reshape(-1, 3) * self._density / hydro.density, np.float64)

    def met_at(self, speed: "HullInWaves", mean: FloatArray) -> FloatArray:
        """Mean force (n m, 3) at a speed by that without, as the table of `from_zero` has it.

        Aranha (1994): 1 - 4 tau_along times that of the waves as the hull meets them, of frequency omega (1 -
        tau_along), turned by 2 tau_across.
        """
        from scipy.interpolate import RectBivariateSpline

        rows = np.array(self.from_zero(mean))
        around, turn = np.tile(rows, (1, 3, 1)), 2.0 * np.pi / rows.shape[1]
        angles = turn * np.arange(-rows.shape[1], 2.0 * rows.shape[1])
        known = np.concatenate(([0.0], self.frequencies))
        omega = np.minimum(speed.waves["frequency"] * (1.0 - speed.along), known[-1])
        beta = np.tile(2.0 * np.pi / self.angles * np.arange(self.angles), speed.frequencies.size) + 2.0 * speed.across
        met = [RectBivariateSpline(known, angles, around[..., axis]).ev(omega, beta) for axis in range(3)]
        return np.asarray((1.0 - 4.0 * speed.along)[:, None] * np.stack(met, axis=1), np.float64)

    def every(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Every `_STRIDE`-th frequency of values (n m, ...)."""
        return values.reshape(-1, self.angles, values.shape[1])[_STRIDE - 1 :: _STRIDE].reshape(-1, values.shape[1])

    def at_all(self, values: FloatArray) -> FloatArray:
        """Values (n m, ...) at all frequencies of those at `every` one, linear between them, from 0 at 0 on."""
        rows = values.reshape(-1, self.angles, values.shape[1])
        rows = np.concatenate((np.zeros_like(rows[:1]), rows, rows[-1:]))
        place = np.arange(1.0, self.frequencies.size + 1.0) / _STRIDE
        low = np.minimum(place.astype(int), len(rows) - 2)
        up = (place - low)[:, None, None]
        return np.asarray(((1.0 - up) * rows[low] + up * rows[low + 1]).reshape(-1, values.shape[1]), np.float64)

    def from_zero(self, values: FloatArray) -> Any:
        """Rows of `values` (n m, ...) as nested tuples by frequency, from 0 on, where they are 0, and by angle.

        Those of diffraction are at a multiple of the angles near `_MIN_ANGLES`, by their harmonics.
        """
        rows = np.concatenate((np.zeros_like(values[: self.angles]), values)).reshape(-1, self.angles, values.shape[1])
        more = self.angles * max(round(_MIN_ANGLES / self.angles), 1)
        if self.vessel.diffraction and more > self.angles:
            harmonics = np.fft.rfft(rows, axis=1)
            if self.angles % 2 == 0:
                harmonics[:, -1] *= 0.5  # of the shortest, whose sine is not known
            rows = np.fft.irfft(harmonics, more, axis=1) * (more / self.angles)
        return nested_tuples(rows)

    def radiation_drift(self) -> FloatArray:
        """Mean surge and sway force and yaw moment (n m, 3) of the waves that its motions against the water make.

        Maruo (1960): k / omega times the power that they take from the waves, less what they carry on. What goes toward
        an angle is known by the force of waves from there (Haskind, 1957; Newman, 1962).
        """
        omega, k = self.frequencies[:, None], self.frequencies[:, None] ** 2 / self._gravity
        excited, slip = (own.reshape(-1, self.angles, 6) for own in (self.excited, self.slip))
        toward = np.abs(np.einsum("nti,nbi->nbt", np.roll(excited, self.angles // 2, axis=1), slip)) ** 2
        angle = 2.0 * np.pi / self.angles * np.arange(self.angles)
        way = np.stack((np.cos(angle), np.sin(angle), np.zeros(self.angles)))
        share = k * omega**2 / (4.0 * self.angles * self._density * self._gravity**3)
        lost = toward.sum(axis=2)[..., None] * way.T - np.einsum("nbt,ct->nbc", toward, way)
        return np.asarray((share[..., None] * lost).reshape(-1, 3), np.float64)

    def reflection_drift(self) -> FloatArray:
        """Mean surge and sway force and yaw moment (n m, 3) of the waves that the sides throw back.

        Faltinsen et al. (1980): rho g / 2 sin^2 of the angle between waves and waterline, per metre of that, on the
        sides that face the waves; times the share of their energy that a wall of the same draft throws back (Ursell,
        1947), and the square of their height over the hull as it moves, up to theirs: one that goes with the water
        reflects nothing. Sides that others hide count for what is seen of them.
        """
        from scipy.special import i1, k1

        found, k, way = np.zeros((self.waves.size, 3)), self.waves["wavenumber"], self.waves["direction"]
        draft, middles, normals = self._sides()
        share = 0.5 * self._density * self._gravity / (1.0 + (k1(k * draft) / (np.pi * i1(k * draft))) ** 2)
        long = np.linalg.norm(normals, axis=1)
        middles, normals, long = middles[long > 0.0], normals[long > 0.0], long[long > 0.0]
        met = np.minimum(way @ (normals / long[:, None]).T, 0.0)
        x, y = middles.T
        height = np.exp(1j * k[:, None] * (way @ middles.T))
        height = height - self.motions[:, 2:3] - self.motions[:, 3:4] * y + self.motions[:, 4:5] * x
        pressure = share[:, None] * np.minimum(np.abs(height) ** 2, 1.0) * met**2
        seen = np.ptp(way[:, ::-1] * (-1.0, 1.0) @ middles.T, axis=1) / -np.minimum(way @ normals.T, 0.0).sum(axis=1)
        pressure *= np.minimum(seen, 1.0)[:, None]
        found[:, :2] -= pressure @ normals
        found[:, 2] -= pressure @ (x * normals[:, 1] - y * normals[:, 0])
        return found

    def _sides(self) -> tuple[float, FloatArray, FloatArray]:
        """Draft [m], and `outline` of the waterline; that of a hull with a stiffness is a rectangle."""
        vessel = self.vessel
        if vessel.is_mesh:
            corners = faces_of(vessel)
            return self._level - float(corners[:, :, 2].min()), *outline(corners, self._level)
        area = vessel.restoring[2][2] / (self._density * self._gravity)
        a, b = 0.5 * vessel.length, 0.5 * area / vessel.length
        middles = np.array([(a, 0.0), (0.0, b), (-a, 0.0), (0.0, -b)])
        return vessel.displacement / self._density / area, middles, np.sign(middles) * np.array((2.0 * b, 2.0 * a))


def with_drift(hull: HullInWaves, hydro: Hydro | None, transform: FloatArray) -> Vessel:
    """A hull's model with what its forces lack of the mean force of waves, by frequency from 0 on and by its speed.

    Without radiation it is at most twice what a wall as long throws back: a motion that nothing damps has no linear
    amplitude at its resonance. `hydro` is the file of a hull with diffraction, whose table also gets what the box of
    waves leaves out of short ones; without drift in it, the mean is left as it is. `transform` is the (6, 6) from the
    origin to its point.
    """
    vessel, most = hull.vessel, hull.most * np.array((1.0, 1.0, hull.vessel.length))
    if vessel.diffraction:
        forces = hull.from_zero(np.concatenate((hull.scattered.real, hull.scattered.imag), axis=1))
        vessel = replace(vessel, diffraction=replace(vessel.diffraction, forces=forces))
        if not (hydro and hydro.drift_scattered):
            return vessel
        whole, most = hull.far_field(hydro, transform), np.full(3, np.inf)
    else:
        whole = hull.radiation_drift() + hull.reflection_drift()
    at_rest = np.clip(whole - hull.own_mean(), -most, most)
    parts, still = [at_rest], hull.every(at_rest)
    for axis in _TAU * np.eye(2):
        forward, back = hull.at(axis), hull.at(-axis)
        more, less = (np.clip(hull.met_at(own, whole) - own.own_mean(), -most, most) for own in (forward, back))
        tau = forward.tau.sum(axis=1, keepdims=True)
        parts.append(hull.at_all((more - less) / (2.0 * tau)))
        parts.append(hull.at_all((more + less - 2.0 * still) / (2.0 * tau**2)))
    return replace(vessel, drift=Drift(step=hull.step, forces=hull.from_zero(np.concatenate(parts, axis=1))))


def coriolis(added: FloatArray, velocity: FloatArray, *, munk: bool) -> FloatArray:
    """The (6, 6) from small velocities to the force of the added mass (6, 6) on a hull that moves with (3,) [m/s].

    It is `physics.drag.added_mass_bias` in its first order.
    """
    along, linear, angular = (cross_matrix(vector) for vector in (velocity, *np.split(added[:, :3] @ velocity, 2)))
    found = np.zeros((6, 6))
    found[:3, 3:] = linear - added[:3, :3] @ along
    found[3:, 3:] = angular - added[3:, :3] @ along - along @ added[:3, 3:]
    if munk:
        found[3:, :3] = linear - along @ added[:3, :3]
    return found


def cross_matrix(vector: FloatArray) -> FloatArray:
    """The (3, 3) of the vector product with a vector (3,) on its left."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _memory(vessel: Vessel, omega: FloatArray) -> ComplexArray:
    """Force over velocity of the waves that a hull makes, (n, 6, 6), at frequencies (n,) in e^(-i omega t)."""
    found = np.zeros((omega.size, 6, 6), np.complex128)
    for row in vessel.memory:
        pole = complex(*row.pole)
        residue = np.array(row.residue) + 1j * np.array(row.residue_imaginary)
        at = -1j * omega[:, None]
        found[:, :, row.motion] += 0.5 * (residue / (at - pole) + residue.conj() / (at - pole.conjugate()))
    return found


def _between(omega: FloatArray, frequencies: tuple[float, ...], values: ComplexArray) -> ComplexArray:
    """Values at frequencies, on a cubic spline through those of the file and 0 at 0."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(np.concatenate(([0.0], frequencies)), np.concatenate((np.zeros_like(values[:1]), values)))
    return np.asarray(spline(omega), np.complex128)
