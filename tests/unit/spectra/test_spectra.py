"""Seas of spectra and regular waves: closed forms, published values, and moments of what is made of them."""

import csv
import math

import numpy as np
import pytest

from fingerprints import check
from vrx_mj.packages import root
from vrx_mj.spectra import (
    Site,
    breaking_height,
    developed_period,
    equal_energy_bands,
    gust_frequencies,
    gust_variance,
    irregular_sea,
    jonswap,
    npd,
    pierson_moskowitz,
    regular_wave,
    spread_angles,
    steepest_sea,
    stokes_wave,
    tabular,
    tma,
    wavenumber,
)

TABLES = root() / "assets" / "validation"


def test_bands_of_pierson_and_moskowitz_are_those_of_its_closed_form():
    first, last, number = 0.6, 3.0, 40
    shares = [math.exp(-1.25 / edge**4) for edge in (first, last)]
    quantiles = [
        (1.25 / -math.log(shares[0] + (shares[1] - shares[0]) * index / number)) ** 0.25 for index in range(number + 1)
    ]
    found, widths = equal_energy_bands(pierson_moskowitz(1.0), first, last, number)
    assert widths == pytest.approx(np.diff(quantiles), rel=0.01)
    assert all(a < frequency < b for a, frequency, b in zip(quantiles, found, quantiles[1:], strict=False))


def mean_frequency(spectrum, first, last, number=20_000):
    """By the trapezoidal rule: of its moments of orders 1 and 0."""
    frequency = np.linspace(first, last, number)
    density = np.array([spectrum(value) for value in frequency])
    return float(np.trapezoid(frequency * density, frequency) / np.trapezoid(density, frequency))


@pytest.mark.parametrize(
    "spectrum",
    [pierson_moskowitz(1.2), jonswap(1.2), jonswap(1.2, 7.0), tma(1.2, Site(4.0))],
    ids=["pm", "jonswap", "narrow", "shallow"],
)
def test_height_and_mean_frequency_are_those_of_the_spectrum(spectrum):
    band, height = (0.3, 7.2), 1.7
    waves = irregular_sea(spectrum, height, band, (0.0, 1.0), 60)
    energy = [wave.amplitude**2 / 2.0 for wave in waves]
    assert 4.0 * math.sqrt(math.fsum(energy)) == pytest.approx(height, rel=1e-14)
    assert sum(wave.frequency for wave in waves) / 60 == pytest.approx(mean_frequency(spectrum, *band), rel=1e-5)


def test_no_two_waves_have_a_common_period():
    frequencies = sorted(wave.frequency for wave in irregular_sea(jonswap(1.0), 1.0, (0.25, 6.0), (1.0, 0.0), 500))
    steps = np.diff(frequencies)
    assert steps.min() > 0.0
    assert len(set(np.round(steps, 9))) == 499


@pytest.mark.parametrize("s", [0.5, 2.0, 10.0, 75.0])
@pytest.mark.parametrize("number", [60, 500])
def test_directions_spread_as_the_cosine_does(s, number):
    angles = np.array(spread_angles(s, number))
    assert np.mean(np.cos(angles)) == pytest.approx(s / (s + 1.0), abs=2.0 / number)  # first Fourier coefficient
    second = s * (s - 1.0) / ((s + 1.0) * (s + 2.0))
    assert np.mean(np.cos(2.0 * angles)) == pytest.approx(second, abs=8.0 / number)
    halves = np.cos(angles[: number // 2]).mean(), np.cos(angles[number // 2 :]).mean()
    assert halves[0] == pytest.approx(halves[1], abs=6.0 / number)  # whatever the frequency


def test_a_table_is_a_spectrum_with_straight_lines():
    shape = tabular([0.5, 1.0, 2.0], [0.0, 4.0, 0.0])
    assert [shape(value) for value in (0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 2.1)] == [0.0, 0.0, 2.0, 4.0, 2.0, 0.0, 0.0]
    mean = sum(wave.frequency for wave in irregular_sea(shape, 1.0, (0.25, 6.0), (1.0, 0.0), 50)) / 50
    assert mean == pytest.approx((0.5 + 1.0 + 2.0) / 3.0, rel=1e-6)  # of a triangle


def test_a_regular_wave():
    (wave,) = regular_wave(1.0, 3.0, (0.0, 2.0))
    k = (2.0 * math.pi / 3.0) ** 2 / 9.81
    assert wave.direction == (0.0, 1.0)
    rest = wave.amplitude, wave.wavenumber, wave.frequency, wave.orbital
    assert rest == pytest.approx((0.5, k, 2.0 * math.pi / 3.0, 0.5 * 2.0 * math.pi / 3.0))


def stokes_rows():
    with (TABLES / "stokes5.csv").open(encoding="utf-8") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{key: float(value) for key, value in row.items()} for row in rows]


@pytest.mark.parametrize(
    "row", stokes_rows(), ids=lambda row: f"H{row['height']:g}-L{row['length']:g}-h{row['depth']:g}"
)
def test_stokes_waves_are_those_of_another_program(row):
    period = row["length"] / row["speed"]
    waves = stokes_wave(row["height"], period, (1.0, 0.0), Site(row["depth"]))
    assert 2.0 * math.pi / waves[0].wavenumber == pytest.approx(row["length"], rel=1e-9)
    assert [wave.frequency / waves[0].frequency for wave in waves] == pytest.approx([1, 2, 3, 4, 5])
    crest = sum(wave.amplitude for wave in waves)
    trough = sum(wave.amplitude * (-1) ** (index + 1) for index, wave in enumerate(waves))
    assert (crest, trough) == pytest.approx((row["crest"], row["trough"]), abs=1e-9)
    assert sum(wave.orbital for wave in waves) == pytest.approx(row["speed_at_mean_level"], rel=1e-9)


@pytest.mark.parametrize(("height", "period", "depth"), [(0.2, 2.5, 2.0), (0.6, 2.5, 2.0), (0.3, 2.0, 10.0)])
def test_along_the_surface_of_a_stokes_wave_stream_function_and_pressure_are_constant(height, period, depth):
    """In axes that travel with it; what is left is of the sixth order of the steepness."""
    waves = stokes_wave(height, period, (1.0, 0.0), Site(depth))
    k, orders, phase = waves[0].wavenumber, np.arange(1.0, 6.0)[:, None], np.linspace(0.0, math.pi, 33)
    amplitude, orbital = np.array([(wave.amplitude, wave.orbital) for wave in waves]).T[..., None]
    speed, z = waves[0].frequency / k, (amplitude * np.cos(orders * phase)).sum(axis=0)
    rising, level = (f(orders * k * (z + depth)) / np.cosh(orders * k * depth) for f in (np.sinh, np.cosh))
    stream = (orbital / (orders * k) * rising * np.cos(orders * phase)).sum(axis=0) - speed * z
    east, up = (orbital * level * np.cos(orders * phase)).sum(axis=0), orbital * rising * np.sin(orders * phase)
    head = 0.5 * ((east - speed) ** 2 + up.sum(axis=0) ** 2) + Site().gravity * z
    least = 10.0 * (0.5 * k * height) ** 6
    assert np.ptp(stream) * k / speed < least
    assert np.ptp(head) / speed**2 < least


def test_a_low_stokes_wave_is_linear():
    low, linear = stokes_wave(1e-4, 4.0, (1.0, 0.0), Site(7.0)), regular_wave(1e-4, 4.0, (1.0, 0.0), Site(7.0))
    assert low[0].amplitude == pytest.approx(linear[0].amplitude, rel=1e-6)
    assert low[0].orbital == pytest.approx(linear[0].orbital, rel=1e-6)


def test_a_spectrum_without_energy_is_refused():
    with pytest.raises(ValueError, match="the spectrum has no energy"):
        equal_energy_bands(lambda _: 0.0, 0.5, 2.0, 10)


SHORE, CREEK = Site(6.0), Site(0.8, 9.7)


def test_waves_and_spectra_are_what_they_were():
    sites, table = (Site(), SHORE, CREEK), tabular([0.5, 1.0, 2.5], [0.1, 2.0, 0.0])
    periods = np.array([0.9, 2.0, 4.5, 7.9, 9.0, 14.9, 16.0])
    spectra = {
        "pm": pierson_moskowitz(1.3), "jonswap": jonswap(1.3, 2.5), "tma": tma(1.3, SHORE), "table": table,
        "npd": npd(12.0, 4.0), "calm": npd(3.0, 10.0),
    }  # fmt: skip
    for name, spectrum in spectra.items():
        gusts = gust_variance(spectrum) if name != "table" else 0.0
        check("spectra", name, densities=[spectrum(frequency) for frequency in np.geomspace(0.2, 6.0, 40)],
              bands=equal_energy_bands(spectrum, 0.6, 2.4, 7), gusts=gusts,
              sea=irregular_sea(spectrum, 0.7, (0.6, 2.4), (3.0, -4.0), 9, 8.0, SHORE, 300.0))  # fmt: skip
    check(
        "spectra", "waves",
        numbers=[[wavenumber(2.0 * math.pi / period, site) for period in periods] for site in sites],
        heights=[[steepest_sea(period, site), breaking_height(period, site)] for period in periods for site in sites],
        developed=[developed_period(height, gravity) for height in (0.1, 2.0) for gravity in (9.81, 3.7)],
        stokes=[stokes_wave(0.05 * min(depth, 6.0), 3.5, (1.0, 2.0), Site(depth)) for depth in (6.0, 3.0, 1e3)],
        regular=regular_wave(0.4, 3.0, (0.0, -2.0), CREEK), gusts=gust_frequencies(npd(8.0, 5.0), 12),
        angles=[spread_angles(spreading, 11) for spreading in (1.0, 7.5, 75.0)],
    )  # fmt: skip


def test_the_height_of_a_sea_is_limited_by_its_length_up_to_8_s_from_15_s_and_between():
    length = 9.81 / (2.0 * math.pi)
    for period, share in ((8.0, 15.0), (15.0, 25.0), (20.0, 25.0), (4.0, 15.0)):
        assert steepest_sea(period) == pytest.approx(length * period**2 / share)
    assert steepest_sea(11.5) == pytest.approx(length * 11.5**2 * 0.5 * (1.0 / 15.0 + 1.0 / 25.0))
    assert steepest_sea(9.0, Site(0.5)) == breaking_height(9.0, Site(0.5))


@pytest.mark.parametrize(("height", "period"), [(1.0, 0.5), (60.0, 4.0)])
def test_a_stokes_wave_that_cannot_be_is_refused(height, period):
    with pytest.raises(ValueError, match=rf"^no Stokes wave of {height:g} m has a period of {period:g} s there$"):
        stokes_wave(height, period, (1.0, 0.0))


def test_a_table_has_nothing_beyond_its_ends_and_its_values_at_them():
    spectrum = tabular([0.5, 1.0, 2.5], [0.1, 2.0, 0.3])
    assert [spectrum(frequency) for frequency in (0.5, 1.0, 2.5)] == pytest.approx([0.1, 2.0, 0.3])
    assert spectrum(np.nextafter(0.5, 0.0)) == spectrum(np.nextafter(2.5, 3.0)) == 0.0
