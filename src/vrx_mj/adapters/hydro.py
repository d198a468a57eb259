"""Radiation and diffraction of a hull by Capytaine, a boundary element code: Ancellin and Dias (2019)."""

import contextlib
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from types import ModuleType
from typing import Any

import numpy as np

from vrx_mj.adapters.pole_fit import Memory, fitted_memory
from vrx_mj.arrays import ComplexArray, FloatArray, IntArray
from vrx_mj.config.dynamics import FORMAT
from vrx_mj.config.shapes import normals_of
from vrx_mj.errors import CommandError, VrxError
from vrx_mj.model.kinds import MOTIONS
from vrx_mj.packages import importing

FREQUENCY_COUNTS = 10, 500
"""Least number of frequencies, which the ten poles of a memory need, and largest number."""
MIN_PANELS = 150
"""Least number of panels of the wet hull before they are halved."""
TOLERANCE = 0.02
"""Share of a force's maximum by which halving the panels may change it."""
_MOST_PANELS = 4000
"""Largest number of panels: time and memory grow with its square, and 3000 take half an hour and 1 GB."""
_PROBES, _PROBE_ANGLES = (0.3, 0.55, 0.8), 8
"""Shares of the highest frequency, and directions, at which the forces of two meshes are compared."""
_MIN_SHARE = 0.01
"""Least magnitude in a comparison, as a share of the largest force, or moment."""
_SHARP_ANGLE, _STRIP_HEIGHTS = math.radians(50.0), (0.05, 0.25)
"""Angle of an edge at which the flow is singular, and heights of the strips that are cut off the panels along it."""
_WAVE_ANGLES = 36
"""Number of directions of waves, over the circle."""
_FAR_ANGLES = 2 * _WAVE_ANGLES
"""Number of directions in which the waves that a hull makes and scatters are evaluated far off, over the circle."""
_MIN_WAVELENGTH = 5.0
"""Shortest wave, in mean edges of wet panels."""
_MOTIONS = tuple(map(str.capitalize, MOTIONS.names))
"""Capytaine's names of the six motions."""
_WET_DEPTH, _EDGE_TOLERANCE = 1e-9, 1e-6
"""Least depth of a wet point, and distance of what is on an edge [m]."""


@contextlib.contextmanager
def _logging_kept() -> Iterator[None]:
    """Log only the errors of Capytaine meanwhile, and undo what importing it does to the root logger."""
    root, own = logging.getLogger(), logging.getLogger("capytaine")
    handlers, levels = root.handlers[:], (root.level, own.level)
    own.setLevel(logging.ERROR)
    try:
        yield
    finally:
        root.handlers[:] = handlers
        root.setLevel(levels[0])
        own.setLevel(levels[1])


@_logging_kept()
def hydro_of_hull(
    corners: FloatArray,
    waterline: float,
    point: Sequence[float],
    *,
    density: float,
    gravity: float,
    frequencies: int = 40,
    highest: float | None = None,
    waves: Sequence[float] = (),
    panels: int = MIN_PANELS,
    tolerance: float | None = TOLERANCE,
    angles: int = _WAVE_ANGLES,
    progress: Callable[[int, int], None] = lambda done, whole: None,
) -> dict[str, Any]:
    """The content of a file for `hull: {hydro: ...}`.

    Args:
        corners: (n, 3, 3) closed triangles of the hull [m], axes of the base link.
        waterline: height of the water in these [m].
        point: to which the matrices belong [m].
        density: of the water [kg/m3].
        gravity: [m/s2]
        frequencies: number of frequencies, evenly spread.
        highest: of them [rad/s]; None: that of a wave of five mean edges of the wet panels.
        waves: frequencies of diffraction and mean drift, some of those; by default all.
        panels: into which the wet hull is cut at least.
        tolerance: those along sharp edges are cut again, and all are halved until that would change no force by more
            than this share of its largest; None: the panels stay as asked.
        angles: directions of waves, even over the circle.
        progress: called with the number of frequencies that are done, and of all.

    Raises:
        CommandError: there are fewer frequencies than a memory can be fitted to, or too many.
        VrxError: no part of the hull is wet, its mesh is too fine, or its radiation is not that of a hull.
        MissingPackageError: Capytaine is not installed.
    """
    fewest, most = FREQUENCY_COUNTS
    if not fewest <= frequencies <= most:
        raise CommandError(f"invalid frequencies {frequencies}: {fewest} to {most} are needed")
    with importing("the radiation of a hull", "Capytaine", "hydro"):
        import capytaine

    afloat, center = corners - (0.0, 0.0, waterline), np.subtract(point, (0.0, 0.0, waterline))
    highest = highest or math.sqrt(gravity * 2.0 * math.pi / (_MIN_WAVELENGTH * panel_hull(afloat, panels)[2]))
    omegas = np.linspace(0.0, highest, frequencies + 1)[1:]
    solver, change = _fine_solver(
        lambda count: _Solver(
            capytaine, _wet_mesh(capytaine, afloat, count, clustered=tolerance is not None), center, density, gravity
        ),
        panels, tolerance, [share * highest for share in _PROBES],
    )  # fmt: skip
    return {
        "format": FORMAT,
        "program": f"Capytaine {capytaine.__version__}, {solver.panels} panels",
        "density": density,
        "gravity": gravity,
        "point": list(map(float, point)),
        "mesh_error": None if change is None else round(change, 6),
        **_at_frequencies(omegas, waves or omegas.tolist(), solver, angles, progress),
    }


def _fine_solver(
    solver_of: Callable[[int], "_Solver"], panels: int, tolerance: float | None, probes: Sequence[float]
) -> tuple["_Solver", float | None]:
    """The solver whose forces change little when its panels are halved, or the finest, and that change as a share.

    Of the finest it is what halving the panels before it changed; None if none are halved.
    """
    solver, change = solver_of(panels), None
    if tolerance is None:
        return solver, change
    forces = solver.forces(probes)
    while True:
        panels *= 4
        try:
            finer = solver_of(panels)
        except VrxError:
            return solver, change
        found = finer.forces(probes)
        peaks = np.abs(found).max(axis=(0, 1)).reshape(2, 3)
        least = np.maximum(peaks, _MIN_SHARE * peaks.max(axis=1, keepdims=True)).ravel()
        change = float((np.abs(found - forces) / least).max())
        if change <= tolerance:
            return solver, change
        solver, forces = finer, found


def _at_frequencies(
    omegas: FloatArray, waves: Sequence[float], solver: "_Solver", angles: int, progress: Callable[[int, int], None]
) -> dict[str, Any]:
    """Radiation and its memory at n frequencies [rad/s], diffraction and mean drift at some, as the file has them."""
    chosen = np.abs(np.subtract.outer(omegas, waves)).argmin(axis=0)
    zero, infinite = (_symmetric(solver.radiation(omega)[0]) for omega in (0.0, math.inf))
    (added, damping), scattered, drift = np.zeros((2, omegas.size, 6, 6)), [], []
    for index, omega in enumerate(omegas.tolist()):
        progress(index, omegas.size)
        added[index], damping[index], made = solver.radiation(omega)
        if index not in chosen:
            continue
        forces, thrown = solver.diffraction(omega, angles)
        scattered.append(forces)
        drift.append(mean_drift(omega, thrown, made, solver.density, solver.gravity))
    from_waves, of_motions = zip(*drift, strict=True)
    return {
        "frequencies": omegas.tolist(),
        "added_mass": _nested_lists(_symmetric(added)),
        "damping": _nested_lists(_symmetric(damping)),
        "added_mass_zero": _nested_lists(zero),
        "added_mass_infinite": _nested_lists(infinite),
        **_memory(fitted_memory(omegas, added, damping, infinite)),
        "wave_frequencies": omegas[chosen].tolist() if len(chosen) < omegas.size else [],
        "diffraction": _complex_lists(scattered),
        "drift_scattered": _complex_lists(from_waves),
        "drift_radiated": _complex_lists(of_motions),
    }


def mean_drift(
    omega: float, scattered: ComplexArray, radiated: ComplexArray, density: float, gravity: float
) -> tuple[ComplexArray, ComplexArray]:
    """Coefficients of the mean force of waves on a hull in deep water, from its Kochin functions, per metre squared.

    With u_j the motions per metre of amplitude and u_0 = 1 the mean surge and sway forces and the yaw moment about the
    vertical through the origin are Re(sum a_j u_j + sum conj(u_i) b_ij u_j). They are the momentum that waves carry
    away far off (Maruo, 1960; Newman, 1967), in the form that holds for a hull which takes energy from them, too:

        F = -2 pi rho (omega e(beta) Re H(beta) + k^2 integral of |H|^2 e(theta)),         e(a) = (cos a, sin a),
        M = -2 pi rho (omega / k Im H'(beta) + k integral of Im(conj(H) H')),     H = H_0(beta) + sum u_j H_j.

    Args:
        omega: frequency [rad/s].
        scattered: Kochin functions (m, n) of the waves that the held hull scatters: m angles toward which waves
            travel, at n angles theta, both even over the circle; n is a multiple of m.
        radiated: Kochin functions (6, n) of motions of one metre or radian.
        density: [kg/m3]
        gravity: [m/s2]

    Returns:
        a, (m, 3, 7), and b, (3, 6, 6), complex.
    """
    m, n = scattered.shape
    assert n % m == 0
    k, share = omega**2 / gravity, 2.0 * math.pi * density
    order = np.fft.fftfreq(n, 1.0 / n) * (np.abs(np.fft.fftfreq(n)) < 0.5)
    beta, theta = (2.0 * math.pi / count * np.arange(count) for count in (m, n))
    weights = np.stack((np.cos(theta), np.sin(theta)))
    linear, quadratic = np.zeros((m, 3, 7), complex), np.zeros((m, 3, 7, 7), complex)
    for index in range(m):
        own = np.concatenate((scattered[index, None], radiated))
        slope = np.fft.ifft(1j * order * np.fft.fft(own))
        ahead = index * n // m
        forward = np.array([np.cos(beta[index]) * own[:, ahead], np.sin(beta[index]) * own[:, ahead]])
        linear[index] = -share * omega * np.concatenate((forward, -1j / k * slope[None, :, ahead]))
        mean = 2.0 * math.pi / n * own.conj()
        quadratic[index, :2] = -share * k**2 * np.einsum("it,ct,jt->cij", mean, weights, own)
        quadratic[index, 2] = 1j * share * k * mean @ slope.T
    linear += quadratic[:, :, 0] + quadratic[:, :, :, 0].conj()
    linear[:, :, 0] -= quadratic[:, :, 0, 0].conj()
    return linear, quadratic[0, :, 1:, 1:]


def _wet_mesh(package: ModuleType, corners: FloatArray, panels: int, *, clustered: bool) -> Any:
    """Capytaine's mesh of what is under z = 0, with strips of small panels along sharp edges if it is clustered."""
    vertices, faces, _ = panel_hull(corners, panels)
    if clustered:
        cut = _cut_along_edges(corners, vertices[faces])
        vertices, faces = cut.reshape(-1, 3), np.arange(3 * len(cut)).reshape(-1, 3)
    mesh = package.Mesh(vertices=vertices, faces=faces).immersed_part()
    if mesh.nb_faces > _MOST_PANELS:
        raise VrxError(f"{mesh.nb_faces:,} wet panels, more than {_MOST_PANELS:,}: simplify the mesh")
    return mesh


def _cut_along_edges(hull: FloatArray, panels: FloatArray) -> FloatArray:
    """Triangles (m, 3, 3) of which those with a side on a sharp edge of `hull` (n, 3, 3) are cut parallel to that."""
    import trimesh

    points, index = np.unique(np.round(hull.reshape(-1, 3), 9), axis=0, return_inverse=True)
    solid = trimesh.Trimesh(points, index.reshape(-1, 3), process=False)
    starts, ends = np.moveaxis(points[solid.face_adjacency_edges[solid.face_adjacency_angles > _SHARP_ANGLE]], 1, 0)
    along = ends - starts
    arms = 0.5 * (panels + np.roll(panels, 1, axis=1))[:, :, None] - starts  # to the middles of sides
    shares = np.clip((arms * along).sum(axis=-1) / np.square(along).sum(axis=-1), 0.0, 1.0)
    near = (np.linalg.norm(arms - shares[..., None] * along, axis=-1) < _EDGE_TOLERANCE).any(axis=-1)
    chosen = near.any(axis=1)
    order = near[chosen].argmax(axis=1)[:, None] + (-1, 0, 1)
    a, b, c = np.moveaxis(np.take_along_axis(panels[chosen], order[..., None] % 3, axis=1), 1, 0)
    found, low, high = [panels[~chosen]], a, b
    for share in _STRIP_HEIGHTS:
        p, q = low + share * (c - low), high + share * (c - high)
        found += [np.stack((a, b, q), axis=1), np.stack((a, q, p), axis=1)]
        a, b = p, q
    return np.concatenate([*found, np.stack((a, b, c), axis=1)])


def _symmetric(matrices: FloatArray) -> FloatArray:
    """The symmetric part of matrices (..., 6, 6)."""
    found: FloatArray = 0.5 * (matrices + np.swapaxes(matrices, -1, -2))
    return found


def _memory(memory: Memory) -> dict[str, Any]:
    """Poles and residues as the file has them."""
    poles, residues = memory.poles, memory.residues
    return {
        "poles": np.stack((poles.real, poles.imag), axis=-1).tolist(),
        "residues": _nested_lists(np.stack((residues.real, residues.imag), axis=-1)),
        "fit_error": round(memory.error, 6),
    }


def _nested_lists(values: object, digits: int = 7) -> Any:
    """Nested lists with so many significant digits, and 0 for what is less by two digits more than the largest."""
    array = np.asarray(values, np.float64)
    least = 0.1 ** (digits + 2) * float(np.abs(array).max(initial=0.0))
    flat = [0.0 if abs(value) <= least else float(f"{value:.{digits}g}") for value in array.ravel().tolist()]
    return np.array(flat).reshape(array.shape).tolist()


def _complex_lists(values: object) -> Any:
    """`_nested_lists` of complex numbers, each a pair of its parts, of five digits."""
    return _nested_lists(np.stack((np.real(values), np.imag(values)), axis=-1), 5)  # type: ignore[call-overload]


def panel_hull(corners: FloatArray, panels: int) -> tuple[FloatArray, IntArray, float]:
    """Vertices (n, 3), triangles (m, 3) of a hull whose wet part has at least so many, and that part's mean edge [m].

    Raises:
        VrxError: no part of it is under the water, which is at z = 0.
    """
    import trimesh

    wet = corners[corners[:, :, 2].min(axis=1) < -_WET_DEPTH]
    if not len(wet):
        raise VrxError("no part of the hull is under water; check --mass, and the mesh's unit (m)")
    area = float(np.linalg.norm(normals_of(wet), axis=1).sum()) / 2.0
    longest = math.sqrt(4.0 / math.sqrt(3.0) * area / panels)
    points, index = np.unique(np.round(corners.reshape(-1, 3), 9), axis=0, return_inverse=True)
    vertices, faces = trimesh.remesh.subdivide_to_size(points, index.reshape(-1, 3), longest, max_iter=20)
    found = np.asarray(vertices, np.float64)[faces]
    wet = found[found[:, :, 2].min(axis=1) < -_WET_DEPTH]
    edge = float(np.linalg.norm(wet - np.roll(wet, 1, axis=1), axis=2).mean())
    return np.asarray(vertices, np.float64), np.asarray(faces, np.int64), edge


class _Solver:
    """Capytaine for one hull."""

    def __init__(self, package: ModuleType, mesh: Any, center: FloatArray, density: float, gravity: float) -> None:
        """A mesh whose water is at z = 0, and the point to which its motions belong [m]."""
        dofs = package.rigid_body_dofs(rotation_center=center)
        body = package.FloatingBody(mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=dofs, name="hull")
        self._package, self._common, self._mesh = package, {"body": body, "rho": density, "g": gravity}, mesh
        self.density, self.gravity, self.panels = density, gravity, int(mesh.nb_faces)
        # with as many panels the added mass of a hemisphere is within 0.5 %, with the indirect method within 4 %
        self._solver = package.BEMSolver(method="direct")

    def forces(self, frequencies: Sequence[float]) -> ComplexArray:
        """Complex forces (frequencies, n, 6): of `_PROBE_ANGLES` waves, and of unit velocities of all six motions."""
        found = []
        for omega in frequencies:
            added, damping, _ = self.radiation(omega)
            found.append(np.concatenate((self.diffraction(omega, _PROBE_ANGLES)[0], damping + 1j * omega * added)))
        return np.array(found)

    def radiation(self, omega: float) -> tuple[FloatArray, FloatArray, ComplexArray]:
        """Added mass and damping (6, 6) at a frequency [rad/s], and the motions' Kochin functions (6, n)."""
        added, damping, results = np.zeros((6, 6)), np.zeros((6, 6)), []
        for j, motion in enumerate(_MOTIONS):
            problem = self._package.RadiationProblem(omega=omega, radiating_dof=motion, **self._common)
            found = self._solver.solve(problem)
            results.append((problem, found))
            for i, other in enumerate(_MOTIONS):
                added[i, j], damping[i, j] = found.added_masses[other], found.radiation_dampings[other]
        return added, damping, self._kochin(omega, results)

    def diffraction(self, omega: float, angles: int) -> tuple[ComplexArray, ComplexArray]:
        """Complex force (angles, 6) of waves of a frequency [rad/s] toward angles from the bow on, and Kochin ones."""
        found, results = np.zeros((angles, 6), complex), []
        for index in range(angles):
            angle = 2.0 * math.pi * index / angles
            problem = self._package.DiffractionProblem(omega=omega, wave_direction=angle, **self._common)
            result = self._solver.solve(problem)
            results.append((problem, result))
            found[index] = [result.forces[motion] for motion in _MOTIONS]
        return found, self._kochin(omega, results)

    def _kochin(self, omega: float, results: Sequence[tuple[Any, Any]]) -> ComplexArray:
        """Kochin functions of solved problems at `_FAR_ANGLES` angles, by Green's theorem on the hull.

        H(theta) = 1/(4 pi) integral of (d(phi)/dn - phi d/dn) e^(k z - i k (x cos theta + y sin theta)).
        """
        if not 0.0 < omega < math.inf:
            return np.zeros((len(results), 0), np.complex128)
        k, theta = omega**2 / self.gravity, 2.0 * math.pi / _FAR_ANGLES * np.arange(_FAR_ANGLES)
        way = np.stack((-1j * np.cos(theta), -1j * np.sin(theta), np.ones(_FAR_ANGLES)))
        wave = np.exp(k * self._mesh.faces_centers @ way) * self._mesh.faces_areas[:, None]
        across, faces = k * wave * (self._mesh.faces_normals @ way), self._mesh.nb_faces
        over = [
            problem.boundary_condition[:faces] @ wave - found.potential[:faces] @ across for problem, found in results
        ]
        return np.array(over, np.complex128) / (4.0 * math.pi)
