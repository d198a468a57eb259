"""Poles and residues of a memory: systems whose poles are known, and what any hull's radiation has to be."""

import numpy as np
import pytest

from vrx_mj.adapters.pole_fit import fitted_memory, kernel_of
from vrx_mj.errors import VrxError

FREQUENCIES = np.linspace(0.1, 6.0, 60)
INFINITE = np.diag((80.0, 90.0, 130.0, 40.0, 45.0, 20.0))


def radiation(poles, residues):
    """Added mass and damping of a memory at `FREQUENCIES`."""
    kernel = kernel_of(np.array(poles), np.array(residues), FREQUENCIES)
    return INFINITE + kernel.imag / FREQUENCIES[:, None, None], kernel.real


def passive_residue(pole, heave, pitch, coupled):
    """Residue (6, 6) of a s / ((s - p) (s - p*)), which damps at all frequencies but 0: a is positive definite."""
    share = np.zeros((6, 6))
    share[2, 2], share[4, 4], share[2, 4], share[4, 2] = heave, pitch, coupled, coupled
    return share * pole / (1j * pole.imag)


POLES = [-0.6 + 1.4j, -1.5 + 0.8j]
RESIDUES = [passive_residue(POLES[0], 800.0, 250.0, 90.0), passive_residue(POLES[1], 300.0, 100.0, -70.0)]


def test_known_poles_and_residues_are_found():
    memory = fitted_memory(FREQUENCIES, *radiation(POLES, RESIDUES), INFINITE)
    order = np.argsort(memory.poles.real)[::-1]
    assert memory.poles[order] == pytest.approx(np.array(POLES), rel=1e-6)
    assert memory.residues[order] == pytest.approx(np.array(RESIDUES), abs=1e-3)
    assert memory.error < 1e-6


def box_like(scale=1.0):
    """Added mass and damping that are no sum of poles: a hump of damping, and its Hilbert transform by quadrature."""
    dense = np.linspace(0.0, 40.0, 8001)
    damping = dense**3 * np.exp(-1.2 * dense)
    found = np.zeros((60, 6, 6)), np.zeros((60, 6, 6))
    for i, w in enumerate(FREQUENCIES):
        rest = np.where(np.abs(dense - w) > 1e-9, (damping - w**3 * np.exp(-1.2 * w)) / (dense**2 - w**2 + 1e-300), 0.0)
        found[0][i, 2, 2] = scale * 2.0 / np.pi * np.trapezoid(rest, dense)
        found[1][i, 2, 2] = scale * w**3 * np.exp(-1.2 * w)
    return INFINITE + found[0], found[1]


def test_poles_are_damped_and_the_fit_gains_no_energy():
    memory = fitted_memory(FREQUENCIES, *box_like(), INFINITE)
    assert (memory.poles.real < 0.0).all()
    assert memory.error < 0.05
    damping = kernel_of(memory.poles, memory.residues, np.linspace(0.0, 100.0, 5000)).real[:, 2, 2]
    assert damping.min() >= -1e-5 * damping.max()
    assert damping[0] == pytest.approx(0.0, abs=1e-9 * damping.max())


def test_an_error_of_measurement_is_no_source_of_energy():
    """Noise of 3 % of the peak makes damping negative where it is small; the fit is not."""
    added, damping = box_like()
    noise = np.random.default_rng(1).normal(0.0, 0.03 * damping.max(), 60)
    damping[:, 2, 2] += noise
    memory = fitted_memory(FREQUENCIES, added, damping, INFINITE)
    assert memory.damping >= -2e-6
    assert (memory.poles.real < 0.0).all()


def test_a_hull_that_makes_no_waves_has_no_memory():
    none = np.zeros((60, 6, 6))
    memory = fitted_memory(FREQUENCIES, INFINITE + none, none, INFINITE)
    assert (len(memory.poles), memory.error) == (0, 0.0)


def test_residues_are_symmetric_as_radiation_is():
    memory = fitted_memory(FREQUENCIES, *radiation(POLES, RESIDUES), INFINITE)
    assert np.array_equal(memory.residues, memory.residues.transpose(0, 2, 1))


def test_radiation_that_is_not_symmetric_is_refused():
    added, damping = radiation(POLES, RESIDUES)
    damping[30, 2, 4] += 200.0
    with pytest.raises(VrxError) as error:
        fitted_memory(FREQUENCIES, added, damping, INFINITE)
    assert str(error.value) == (
        "radiation is not symmetric at 3.1 rad/s, by 47% of its largest; is the mesh fine enough, and are all panels "
        "under water?"
    )


def test_negative_damping_is_refused():
    added, damping = radiation(POLES, RESIDUES)
    damping[40, 2, 2] = -150.0
    with pytest.raises(VrxError) as error:
        fitted_memory(FREQUENCIES, added, damping, INFINITE)
    assert str(error.value).startswith("radiation damping is negative at 4.1 rad/s, by ")
