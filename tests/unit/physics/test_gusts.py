"""The wind of profile `marine`: its profile over height, the NPD spectrum and the turning direction."""

import math

import numpy as np
import pytest

from unit.physics.rows import moving, table
from vrx_mj.model import tables
from vrx_mj.physics.tables import MARINE
from vrx_mj.physics.waves import random_phases
from vrx_mj.physics.wind import air_velocity, wind_on_float, wind_series, wind_share, wind_step
from vrx_mj.spectra import gust_frequencies, gust_variance, npd

EVEN = {
    "height": 10.0, "exponent": 0.0, "roughness": 0.0, "turning": 0.0, "spread": 0.0, "time_constant": 60.0, "key": 5,
}  # fmt: skip
STEADY = {
    "direction": (1.0, 0.0), "mean": 10.0, "gain": 0.0, "time_constant": 2.0, "first_step": 0.0, "key": 7,
}  # fmt: skip


def air(**changes):
    return table(tables.AIR, [EVEN | changes])


def series(steps, dt, bands=(), wind=STEADY, **changes):
    """Velocities (steps, 2) of a wind."""
    rows = table(tables.GUST_BAND, bands)
    state, turned, out = np.zeros(1, tables.WIND_STATE), np.zeros(1, tables.AIR_STATE), np.empty((steps, 2))
    wind_series(table(tables.WIND, [wind])[0], state[0], rows, air(**changes), turned, dt, out)
    return out


def norsok(f, speed, height):
    """The NPD spectrum [m2/Hz] by a second hand."""
    x = 172.0 * f * (height / 10.0) ** (2.0 / 3.0) * (speed / 10.0) ** (-0.75)
    return 320.0 * (speed / 10.0) ** 2 * (height / 10.0) ** 0.45 / (1.0 + x**0.468) ** (5.0 / (3.0 * 0.468))


@pytest.mark.parametrize("z", [1.0, 2.0, 10.0, 50.0])
def test_a_power_law_and_a_logarithm_by_hand(z):
    assert wind_share(air(exponent=0.11), z) == pytest.approx((z / 10.0) ** 0.11)
    assert wind_share(air(roughness=2e-4), z) == pytest.approx(math.log(z / 2e-4) / math.log(10.0 / 2e-4))
    assert wind_share(air(), z) == 1.0
    assert wind_share(air()[:0], z) == 1.0


def test_at_the_surface_the_wind_is_still():
    assert wind_share(air(roughness=2e-4), 1e-5) == 0.0
    assert wind_share(air(exponent=0.11), -1.0) == 0.0


@pytest.mark.parametrize(("speed", "height"), [(5.0, 10.0), (10.0, 10.0), (20.0, 3.0)])
def test_the_variance_is_the_spectrum_s_integral(speed, height):
    f = np.linspace(1.0 / 600.0, 0.5, 1_000_001)
    s = norsok(f, speed, height)
    assert gust_variance(npd(speed, height)) == pytest.approx(np.trapezoid(s, f), rel=1e-6)


@pytest.mark.parametrize("number", [1, 60, 200])
def test_harmonics_have_equal_shares_and_the_spectrum_s_mean_frequency(number):
    spectrum = npd(10.0, 10.0)
    found = np.array(gust_frequencies(spectrum, number)) / (2.0 * math.pi)
    f = np.linspace(1.0 / 600.0, 0.5, 1_000_001)
    s = norsok(f, 10.0, 10.0)
    assert (np.diff(found) > 0.0).all()
    assert found.mean() == pytest.approx(np.trapezoid(f * s, f) / np.trapezoid(s, f), rel=1e-4)


def test_three_hours_of_gusts_have_the_spectrum():
    """Energy below a tenth, below half and in all, within 5 %."""
    spectrum, hours, dt = npd(12.0, 10.0), 3, 0.5
    frequencies = gust_frequencies(spectrum, 200)
    phases = random_phases(3, len(frequencies), "gusts", "0")
    bands = [{"frequency": w, "phase": p} for w, p in zip(frequencies, phases, strict=True)]
    gain = math.sqrt(gust_variance(spectrum))
    speed = series(hours * 7200, dt, bands, STEADY | {"mean": 12.0, "gain": gain})[:, 0]
    power = np.abs(np.fft.rfft(speed - 12.0)) ** 2 * 2.0 / len(speed) ** 2
    f = np.fft.rfftfreq(len(speed), dt)
    for first, last in ((0.0, 0.01), (0.01, 0.05), (0.05, 0.2), (0.0, 0.6)):
        fine = np.linspace(max(first, 1.0 / 600.0), min(last, 0.5), 100_001)
        energy = np.trapezoid(norsok(fine, 12.0, 10.0), fine)
        assert power[(f >= first) & (f < last)].sum() == pytest.approx(energy, rel=0.05)


@pytest.mark.parametrize("dt", [0.5, 5.0])
def test_the_direction_has_its_deviation_and_time_constant_at_any_step(dt):
    steps = 100_000
    east, north = series(steps, dt, spread=math.radians(8.0), time_constant=20.0).T
    angle = np.arctan2(north, east)
    effective = steps * dt / 40.0
    assert angle.std() == pytest.approx(math.radians(8.0), rel=5.0 / math.sqrt(2.0 * effective))
    lag = round(20.0 / dt)
    kept = np.mean(angle[lag:] * angle[:-lag]) / angle.var()
    assert kept == pytest.approx(math.exp(-1.0), abs=5.0 / math.sqrt(effective))


def test_a_turning_wind_keeps_its_speed():
    out = series(720, 0.5, turning=math.radians(1.0))
    assert np.hypot(*out.T) == pytest.approx(np.full(720, 10.0))
    assert out[-1] == pytest.approx([10.0, 0.0])
    assert out[179] == pytest.approx([0.0, 10.0], abs=1e-9)


def test_a_series_is_its_steps():
    wind = STEADY | {"gain": 1.0}
    out = series(50, 0.1, wind=wind, spread=0.1, turning=0.3)
    state, turned = np.zeros(1, tables.WIND_STATE), np.zeros(1, tables.AIR_STATE)
    row, own, none = table(tables.WIND, [wind])[0], air(spread=0.1, turning=0.3), table(tables.GUST_BAND, [])
    for velocity in out:
        wind_step(row, state[0], none, own, turned, 0.1)
        assert air_velocity(row, state[0], turned) == tuple(velocity)


def test_a_buoy_feels_the_apparent_wind_in_its_own_axes():
    """It turns by 90 degrees and moves north at 2 m/s, its own x, in a wind to the north of 5 m/s."""
    item = table(tables.FLOAT, [])
    item = np.zeros(1, item.dtype)[0]
    item["profile"], item["wind"] = MARINE, (2.0, 1.0, 0.5)
    body = moving(angles=(0, 0, math.pi / 2), velocity=(2, 0, 0, 0, 0, 0))
    assert wind_on_float(item, body, (0.0, 5.0)) == pytest.approx((0.0, 2.0 * 3.0**2, 0, 0, 0, 0), abs=1e-12)
    assert wind_on_float(item, body, (1.0, 2.0)) == pytest.approx((1.0, 0, 0, 0, 0, 0), abs=1e-12)
