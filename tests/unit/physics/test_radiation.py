"""Memory of waves made and force of waves scattered: closed forms, and the same sums in NumPy."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import moving, sea, table
from vrx_mj.model import tables
from vrx_mj.physics.drift import ENTRY
from vrx_mj.physics.vessel import diffraction_load, memory_load, memory_step
from vrx_mj.physics.waves import wave_columns
from vrx_mj.spectra import Site, irregular_sea, jonswap, regular_wave

HEAVE = 2
POLE, RESIDUE = -0.4 + 1.3j, 700.0 - 250.0j


def memory(*rows):
    """Rows (motion, pole, force, residue), and as many states at rest."""
    found = []
    for motion, pole, force, residue in rows:
        real, imaginary = np.zeros(6), np.zeros(6)
        real[force], imaginary[force] = residue.real, residue.imag
        pair = (pole.real, pole.imag)
        found.append({"motion": motion, "pole": pair, "residue": real, "residue_imaginary": imaginary})
    return table(tables.MEMORY, found), np.zeros(len(rows), tables.MEMORY_STATE)


def heaving(speed):
    return moving(velocity=(0.0, 0.0, speed, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("dt", [0.001, 0.01, 0.25])
def test_a_constant_speed_is_remembered_exactly_at_any_step(dt):
    rows, state = memory((HEAVE, POLE, HEAVE, RESIDUE))
    for _ in range(round(2.0 / dt)):
        memory_step(rows, state, heaving(0.3), dt)
    integral = (RESIDUE * (cmath.exp(POLE * 2.0) - 1.0) / POLE).real * 0.3
    assert memory_load(rows, state).fz == pytest.approx(-integral, rel=1e-12)


def test_what_a_hull_did_fades_as_the_kernel_does():
    rows, state = memory((HEAVE, POLE, HEAVE, RESIDUE))
    memory_step(rows, state, heaving(1e6), 1e-6)  # an impulse of one metre
    for _ in range(300):
        memory_step(rows, state, heaving(0.0), 0.01)
    assert memory_load(rows, state).fz == pytest.approx(-(RESIDUE * cmath.exp(POLE * 3.0)).real, rel=1e-5)


def test_an_oscillation_finds_the_added_mass_and_damping_of_its_frequency():
    frequency, dt = 2.0, 2e-3
    rows, state = memory((HEAVE, POLE, HEAVE, RESIDUE), (HEAVE, -1.1 + 0.0j, HEAVE, 90.0 + 0.0j))
    times = dt * np.arange(1, round(40.0 * math.pi / frequency / dt))
    found = []
    for t in times:
        memory_step(rows, state, heaving(math.cos(frequency * (t - 0.5 * dt))), dt)
        found.append(memory_load(rows, state).fz)
    at = 1j * frequency
    kernel = 0.5 * (RESIDUE / (at - POLE) + RESIDUE.conjugate() / (at - POLE.conjugate())) + 90.0 / (at + 1.1)
    expected = -(kernel * np.exp(at * times)).real
    late = times > 50.0  # what the start left has faded by e^-20
    assert np.array(found)[late] == pytest.approx(expected[late], abs=1e-6 * abs(kernel))


MOTIONS = st.lists(st.floats(-3, 3), min_size=6, max_size=6)


@given(velocities=st.lists(MOTIONS, min_size=1, max_size=8), dt=st.floats(1e-4, 0.5))
def test_memory_is_a_sum_over_all_motions_forces_and_poles(velocities, dt):
    draw = np.random.default_rng(3)
    entries = [
        (motion, complex(-draw.uniform(0.1, 3), draw.uniform(0, 3)), force, complex(*draw.normal(0, 100, 2)))
        for motion in range(6)
        for force in range(6)
    ]
    rows, state = memory(*entries)
    x = np.zeros(len(entries), complex)
    pole = np.array([one[1] for one in entries])
    for velocity in velocities:
        memory_step(rows, state, moving(velocity=velocity), dt)
        driven = np.array([velocity[one[0]] for one in entries])
        x = np.exp(pole * dt) * x + (np.exp(pole * dt) - 1.0) / pole * driven
    load = np.zeros(6)
    for (_, _, force, residue), value in zip(entries, x, strict=True):
        load[force] -= (residue * value).real
    assert np.array(memory_load(rows, state)) == pytest.approx(load, abs=1e-9 * (1.0 + np.abs(load).max()))


ANGLES, STEP = 36, 0.1


def forces(frequency, angle):
    """A force and torque per metre that are smooth over frequency and angle."""
    draw = np.random.default_rng(5).normal(0.0, 1.0, (6, 4))
    a, b, c, d = draw.T
    return frequency * (a + 1j * b + (c + 1j * d) * np.exp(1j * angle)) * np.exp(-0.3j * frequency)


def scattering():
    found = np.zeros((40, ANGLES + 1, ENTRY))
    for i in range(40):
        for j in range(ANGLES + 1):
            f = forces(STEP * i, 2.0 * math.pi * j / ANGLES)
            found[i, j, :6], found[i, j, 8:14] = f.real, f.imag
    return found


TABLE = scattering()
OFFSHORE = moving((12.0, -7.0, 0.2), (0.0, 0.0, 0.6))


def turned(load, yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.concatenate((turn @ load[:3], turn @ load[3:]))


def wave_rows(components, phases):
    return sea([c._asdict() | {"steepness": 0.0, "phase": p} for c, p in zip(components, phases, strict=True)])


def load_of(table, waves, water, body, heading, time):
    """The load on a hull of a heading [rad]."""
    columns = wave_columns(waves, water, 4)
    entries, row, toward = table.reshape(-1, table.shape[2]), table.shape[1], (math.cos(heading), math.sin(heading))
    return np.array(diffraction_load(entries, row, STEP, columns, water, body, toward, time))


@pytest.mark.parametrize("time", [0.0, 3.3])
def test_diffraction_at_an_entry_of_the_table_is_that_entry(time):
    frequency, angle = 17 * STEP, 5 * 2.0 * math.pi / ANGLES
    heading = 0.6
    toward = heading + angle
    components = regular_wave(0.4, 2.0 * math.pi / frequency, (math.cos(toward), math.sin(toward)), Site(gravity=9.81))
    waves, water = wave_rows(components, [0.7])
    k = waves[0]["wavenumber"]
    theta = k * (math.cos(toward) * 12.0 - math.sin(toward) * 7.0) - frequency * time + 0.7
    expected = turned((0.2 * forces(frequency, angle) * np.exp(1j * theta)).real, heading)
    found = load_of(TABLE, waves, water, OFFSHORE, heading, time)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_diffraction_of_a_sea_is_the_sum_over_its_waves():
    components = irregular_sea(jonswap(1.5), 0.3, (0.5, 3.5), (0.0, 1.0), 25, 4.0)
    phases = np.linspace(0.0, 6.0, 25)
    waves, water = wave_rows(components, phases)
    total, time = np.zeros(6), 8.2
    for wave, phase in zip(components, phases, strict=True):
        angle = math.atan2(wave.direction[1], wave.direction[0])
        at = wave.wavenumber * (wave.direction[0] * 12.0 - wave.direction[1] * 7.0) - wave.frequency * time + phase
        total += (wave.amplitude * forces(wave.frequency, angle - 0.6) * np.exp(1j * at)).real
    found = load_of(TABLE, waves, water, OFFSHORE, 0.6, time)
    # linear between entries of 10 degrees and 0.1 rad/s: (spacing^2 / 8) of the curvature
    assert found == pytest.approx(turned(total, 0.6), abs=0.006 * np.abs(total).max())


def test_waves_beyond_the_table_exert_no_diffraction():
    waves, water = wave_rows(regular_wave(0.1, 2.0 * math.pi / 4.5, (1.0, 0.0), Site(gravity=9.81)), [0.0])
    assert not load_of(TABLE, waves, water, OFFSHORE, 0.0, 1.0).any()


@given(yaw=st.floats(-10, 10), angle=st.floats(-10, 10))
def test_any_heading_and_direction_stay_inside_the_table(yaw, angle):
    waves, water = wave_rows(regular_wave(0.1, 4.0, (math.cos(angle), math.sin(angle)), Site(gravity=9.81)), [0.0])
    found = load_of(TABLE, waves, water, OFFSHORE, yaw, 1.0)
    assert np.abs(found).max() < 0.05 * np.abs(TABLE).max() * 2.0


def test_diffraction_turns_with_the_hull():
    body = moving((12.0, -7.0, 0.2), (0.1, -0.2, 0.6))
    components = regular_wave(0.4, 4.0, (1.0, 0.0), Site(gravity=9.81))
    waves, water = wave_rows(components, [0.7])
    level = turned(load_of(TABLE, waves, water, OFFSHORE, 0.6, 1.0), -0.6)
    rows = np.array(body[3:12]).reshape(3, 3)
    expected = np.concatenate((rows @ level[:3], rows @ level[3:]))
    assert load_of(TABLE, waves, water, body, 0.6, 1.0) == pytest.approx(expected, rel=1e-9)
