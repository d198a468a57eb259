"""What the forces on a hull lack of the mean force of waves: Newman's approximation, by hand."""

import math

import numpy as np
import pytest

from unit.physics.rows import moving, sea
from vrx_mj.physics.drift import ENTRY, FASTEST, drift_load
from vrx_mj.physics.kinematics import orbital_motion
from vrx_mj.physics.waves import wave_columns
from vrx_mj.spectra import Site, regular_wave

STEP, ANGLES, COUNT, G = 0.1, 16, 40, 9.81
HULL = moving((12.0, -7.0, 0.2), (0.0, 0.0, 0.6))
FORCES = np.random.default_rng(2).normal(0.0, 100.0, (COUNT, ANGLES + 1, 5, 3))
"""Coefficients of the velocity ahead and to the left: at rest, first and second of each."""


def load(*waves, velocity=(0.0, 0.0)):
    """Force and yaw moment in the hull's heading of waves of (amplitude, frequency, angle off the heading, phase)."""
    rows = []
    for amplitude, frequency, angle, phase in waves:
        way = math.cos(0.6 + angle), math.sin(0.6 + angle)
        (one,) = regular_wave(2.0 * amplitude, 2.0 * math.pi / frequency, way, Site(gravity=G))
        rows.append(one._asdict() | {"steepness": 0.0, "phase": phase})
    table = np.zeros((COUNT, ANGLES + 1, ENTRY))
    table[:, :, :15] = FORCES.reshape(COUNT, ANGLES + 1, 15)
    waves, water = sea(rows)
    time, heading = 2.5, (math.cos(0.6), math.sin(0.6))
    columns = wave_columns(waves, water, 4)
    orbital_motion(columns, water, HULL.x, HULL.y, HULL.z, time)
    phases = [
        one["wavenumber"] * (one["direction"] @ (12.0, -7.0)) - one["frequency"] * time + one["phase"] for one in waves
    ]
    entries = table.reshape(-1, ENTRY)
    return np.array(drift_load(entries, ANGLES + 1, STEP, columns, water, heading, velocity, time)), phases


def test_two_waves_beat_by_newmans_approximation():
    found, phases = load((0.2, 9.0 * STEP, 0.0, 0.7), (0.35, 12.5 * STEP, 7.25 * 2.0 * math.pi / ANGLES, -0.2))
    lacks = FORCES[9, 0, 0], 0.5 * (0.75 * FORCES[12:14, 7, 0] + 0.25 * FORCES[12:14, 8, 0]).sum(axis=0)
    beat = 2.0 * 0.2 * 0.35 * math.cos(phases[0] - phases[1])
    expected = 0.2**2 * lacks[0] + 0.35**2 * lacks[1] + beat * 0.5 * (lacks[0] + lacks[1])
    assert found == pytest.approx(expected, rel=1e-9)


def test_a_wave_beyond_the_table_has_the_last_frequency():
    found, _ = load((0.3, 7.0, 2.0 * math.pi / ANGLES, 0.0))
    assert found == pytest.approx(0.09 * FORCES[-1, 1, 0], rel=1e-6)


@pytest.mark.parametrize("velocity", [(0.3, -0.2), (-0.5, 0.1), (4.0, -9.0)])
def test_speed_counts_by_frequency_and_up_to_the_fastest(velocity):
    omega = 20 * STEP
    found, _ = load((0.3, omega, 3 * 2.0 * math.pi / ANGLES, 0.0), velocity=velocity)
    a, b = (min(max(omega * own / G, -FASTEST), FASTEST) for own in velocity)
    assert found == pytest.approx(0.09 * np.array((1.0, a, a * a, b, b * b)) @ FORCES[20, 3], rel=1e-9)
