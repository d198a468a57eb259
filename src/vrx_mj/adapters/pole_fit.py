"""Fit of poles and residues of a hull's memory to its radiation at frequencies.

Added mass A(omega) and damping B(omega) are one function, K(i omega) = B(omega) + i omega (A(omega) - A(inf)) (Ogilvie,
1964), whose retardation kernel is fitted by K(t) = sum over k of Re(r_k e^(p_k t)). The poles are common to motions
that are coupled, and found by vector fitting (Gustavsen and Semlyen, 1999): those to the right of the imaginary axis
are mirrored, so that all are damped. The residues are a least squares fit, symmetric as the matrices are, with no
damping at frequency 0; where a hull would gain energy from the waves it makes, it is bound to damp there (Lawson and
Hanson, 1974, chapter 23).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import ComplexArray, FloatArray
from vrx_mj.errors import VrxError

_ITERATIONS = 30
"""Iterations of vector fitting."""
_MIN_ENTRY = 1e-3
"""Entries below this share of the geometric mean of their diagonals' peaks are left out."""
_MIN_PEAK = 0.01
"""Least peak of a diagonal that is assumed, as a share of the largest one's."""
_ORDERS = (4, 6, 8, 10, 12, 14)
"""Numbers of poles, tried in this order."""
_COUPLED_ORDERS = (16, 18, 20)
"""Further numbers of poles for motions that are coupled, as by the water between two hulls."""
_GOOD_ERROR = 0.005
"""Error below which a fit is accepted."""
_PASSIVITY_ROUNDS = 40
"""Largest number of rounds that make the fit passive."""
_SLACK = 1e-6
"""Largest negative damping that is left, normalised."""


@dataclass(frozen=True)
class Memory:
    """Poles and residues of a hull's retardation kernel."""

    poles: ComplexArray
    """(n,) poles [1/s], of each conjugate pair the one above the real axis."""
    residues: ComplexArray
    """(n, 6, 6) residues: force i per memory of motion j."""
    error: float
    """Root mean square of the misfit over that of K(i omega), of normalised entries."""
    damping: float
    """Least eigenvalue of the fitted damping over all frequencies, normalised: below 0 the fit gains energy."""


def kernel_of(poles: ComplexArray, residues: ComplexArray, frequencies: FloatArray) -> ComplexArray:
    """K(i omega) (m, ...) of poles (n,) and residues (n, ...) at frequencies (m,) [rad/s]."""
    at = 1j * frequencies[:, None]
    above, below = 1.0 / (at - poles), 1.0 / (at - poles.conj())
    total: ComplexArray = 0.5 * (np.tensordot(above, residues, 1) + np.tensordot(below, residues.conj(), 1))
    return total


def _basis(poles: ComplexArray, frequencies: FloatArray) -> ComplexArray:
    """Columns (m, 2 n) that real and imaginary parts of the residues are multiplied by; real poles have one each."""
    at = 1j * frequencies[:, None]
    above, below = 0.5 / (at - poles), 0.5 / (at - poles.conj())
    columns = [above + below, (1j * (above - below))[:, poles.imag > 0.0]]
    return np.concatenate(columns, axis=1)


def _stack(columns: ComplexArray) -> FloatArray:
    return np.concatenate((columns.real, columns.imag))


def _relocate_poles(poles: ComplexArray, samples: ComplexArray, frequencies: FloatArray) -> ComplexArray:
    """Poles after one round of vector fitting to samples (m, entries): zeros of the fitted weight 1 + basis c."""
    basis = _basis(poles, frequencies)
    n, blocks, sides = basis.shape[1], [], []
    for entry in samples.T:
        q, r = np.linalg.qr(_stack(np.concatenate((basis, -entry[:, None] * basis), axis=1)))
        blocks.append(r[n:, n:])
        sides.append(q.T[n:] @ _stack(entry))
    weights = np.linalg.lstsq(np.concatenate(blocks), np.concatenate(sides), rcond=None)[0]
    state, start = _realisation(poles)
    zeros = np.linalg.eigvals(state - np.outer(start, weights)).astype(complex)
    size = np.abs(zeros)
    # on the imaginary axis a memory would last for ever, and slower ones than the frequencies show are not known
    real = -np.maximum(np.maximum(np.abs(zeros.real), 0.01 * size), 0.5 * frequencies[0])
    moved: ComplexArray = real + 1j * np.where(np.abs(zeros.imag) < 1e-9 * size, 0.0, zeros.imag)
    return moved[moved.imag >= 0.0]


def _realisation(poles: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """State matrix and input vector, real, whose transfer functions to the states are the columns of `_basis`."""
    pairs = np.flatnonzero(poles.imag > 0.0)
    count, size = len(poles), len(poles) + len(pairs)
    state, start = np.zeros((size, size)), np.zeros(size)
    state[:count, :count], start[:count] = np.diag(poles.real), 1.0
    for extra, pair in enumerate(pairs, count):
        state[extra, extra] = poles[pair].real
        state[pair, extra], state[extra, pair] = poles[pair].imag, -poles[pair].imag
    return state, start


def fitted_memory(frequencies: FloatArray, added: FloatArray, damping: FloatArray, infinite: FloatArray) -> Memory:
    """The memory of a hull's radiation; motions that are not coupled have poles of their own.

    Args:
        frequencies: (m,) rising, above 0 [rad/s].
        added: (m, 6, 6) added mass at each [kg, kg m, kg m2].
        damping: (m, 6, 6) its damping [kg/s, kg m/s, kg m2/s].
        infinite: (6, 6) added mass at infinite frequency.

    Raises:
        VrxError: the matrices are not symmetric, or the hull gains energy from its waves.
    """
    kernels: ComplexArray = damping + 1j * frequencies[:, None, None] * (added - infinite)
    peaks = np.abs(kernels).max(axis=0)
    if not np.diag(peaks).max() > 0.0:
        return Memory(np.zeros(0, complex), np.zeros((0, 6, 6), complex), 0.0, 0.0)
    # of a motion that makes next to no waves, as the roll of a sphere, the little that there is is no matter
    scale = np.sqrt(np.maximum(np.diag(peaks), _MIN_PEAK * np.diag(peaks).max()))
    normal: ComplexArray = kernels / np.outer(scale, scale)
    _check(normal, frequencies)
    normal = np.asarray(0.5 * (normal + normal.transpose(0, 2, 1)), np.complex128)
    fits = [_best_fit(normal, frequencies, entries) for entries in _coupled_entries(np.abs(normal).max(axis=0))]
    poles = np.concatenate([poles for poles, _ in fits])
    residues = np.concatenate([residues for _, residues in fits])
    misfit = kernel_of(poles, residues, frequencies) - normal
    error = float(np.sqrt((np.abs(misfit) ** 2).sum() / (np.abs(normal) ** 2).sum()))
    least = float(_eigenvalues(poles, residues, _dense(frequencies))[0].min())
    return Memory(poles, residues * np.outer(scale, scale), error, least)


def _coupled_entries(peaks: FloatArray) -> list[list[tuple[int, int]]]:
    """The entries (i, j), j <= i, that are not negligible, by groups of motions that have some in common."""
    groups: list[set[int]] = []
    for i in range(6):
        here = {j for j in range(6) if peaks[i, j] > _MIN_ENTRY}
        if here:
            met = [group for group in groups if group & here]
            groups = [group for group in groups if group not in met] + [here.union(*met)]
    return [
        [(i, j) for i in sorted(group) for j in sorted(group) if j <= i and peaks[i, j] > _MIN_ENTRY]
        for group in groups
    ]


def _check(normal: ComplexArray, frequencies: FloatArray) -> None:
    """Radiation is symmetric, and damps at every frequency."""
    odd = np.abs(normal - normal.transpose(0, 2, 1)).max(axis=(1, 2))
    if odd.max() > 0.1:
        raise VrxError(
            f"radiation is not symmetric at {frequencies[odd.argmax()]:.4g} rad/s, by {odd.max():.0%} of its largest; "
            "is the mesh fine enough, and are all panels under water?"
        )
    least = np.linalg.eigvalsh(0.5 * (normal.real + normal.real.transpose(0, 2, 1)))[:, 0]
    if least.min() < -0.1:
        raise VrxError(
            f"radiation damping is negative at {frequencies[least.argmin()]:.4g} rad/s, by {-least.min():.0%} of its "
            "largest: an irregular frequency, or a coarse mesh; use a finer mesh, or lower frequencies"
        )


def _best_fit(
    normal: ComplexArray, frequencies: FloatArray, entries: Sequence[tuple[int, int]]
) -> tuple[ComplexArray, ComplexArray]:
    """Poles and residues of coupled motions: of the first number of poles with a good fit, or of the best one."""
    samples = np.stack([normal[:, i, j] for i, j in entries], axis=1)
    size, least, best = np.linalg.norm(samples), np.inf, None
    for order in _ORDERS if len(entries) == 1 else (*_ORDERS, *_COUPLED_ORDERS):
        spread = np.linspace(frequencies[0], frequencies[-1], order // 2 + 1)[1:] * 0.8
        poles = -0.3 * spread + 1j * spread
        for _ in range(_ITERATIONS):
            poles = _relocate_poles(poles, samples, frequencies)
        residues = _residues(poles, samples, frequencies, entries)
        fitted = kernel_of(poles, residues, frequencies)
        error = float(np.linalg.norm(np.stack([fitted[:, i, j] for i, j in entries], axis=1) - samples) / size)
        if error < least:
            least, best = error, (poles, residues)
        if least <= _GOOD_ERROR:
            break
    assert best is not None
    return best


def _eigenvalues(poles: ComplexArray, residues: ComplexArray, frequencies: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least eigenvalues (n,) of the fitted damping at frequencies (n,), and their vectors (n, 6)."""
    values, vectors = np.linalg.eigh(kernel_of(poles, residues, frequencies).real)
    return values[:, 0], vectors[:, :, 0]


def _dense(frequencies: FloatArray) -> FloatArray:
    """Frequencies (n,) that cover those given, and go far beyond them."""
    last = frequencies[-1]
    return np.concatenate((np.linspace(0.0, last, 800)[1:], np.geomspace(1.0, 20.0, 200)[1:] * last))


def _residues(
    poles: ComplexArray, samples: ComplexArray, frequencies: FloatArray, entries: Sequence[tuple[int, int]]
) -> ComplexArray:
    """Symmetric residues (n, 6, 6) that fit samples (m, entries), damp nothing at frequency 0, and gain no energy."""
    still, dense = _basis(poles, np.zeros(1)).real, _dense(frequencies)
    free = np.linalg.svd(still)[2][1:].T  # combinations without damping at frequency 0
    q, r = np.linalg.qr(_stack(_basis(poles, frequencies)) @ free)
    best = np.linalg.lstsq(r, q.T @ _stack(samples), rcond=None)[0]
    chosen, cuts = best, list[FloatArray]()
    for _ in range(_PASSIVITY_ROUNDS):
        residues = _matrices(poles, free @ chosen, entries)
        values, vectors = _eigenvalues(poles, residues, dense)
        if values.min() >= -_SLACK:
            break
        dips = np.flatnonzero((values < -_SLACK) & (values <= np.roll(values, 1)) & (values <= np.roll(values, -1)))
        for dip in dips:
            row = (_basis(poles, dense[dip : dip + 1]).real @ free)[0]
            sides = [(2.0 - (i == j)) * vectors[dip, i] * vectors[dip, j] for i, j in entries]
            cuts.append(np.outer(row, sides))
        chosen = best + np.linalg.solve(r, _least_change(r, best, np.array(cuts)))
    return residues


def _least_change(r: FloatArray, best: FloatArray, cuts: FloatArray) -> FloatArray:
    """Least y with cut . (best + r^-1 y) >= 0 for each cut, all of the shape of `best`."""
    from scipy.optimize import nnls

    slopes = np.linalg.solve(r.T[None], cuts).reshape(len(cuts), -1)
    missing = -(cuts * best).sum(axis=(1, 2))
    system = np.concatenate((slopes.T, missing[None]))
    side = np.zeros(len(system))
    side[-1] = 1.0
    rest = system @ nnls(system, side)[0] - side
    change: FloatArray = (-rest[:-1] / rest[-1]).reshape(best.shape)
    return change


def _matrices(poles: ComplexArray, weights: FloatArray, entries: Sequence[tuple[int, int]]) -> ComplexArray:
    """Residues (n, 6, 6) of the basis' weights (columns, entries)."""
    count = len(poles)
    residues = np.zeros((count, 6, 6), complex)
    for (i, j), column in zip(entries, weights.T, strict=True):
        values = column[:count].astype(complex)
        values[poles.imag > 0.0] += 1j * column[count:]
        residues[:, i, j] = residues[:, j, i] = values
    return residues
