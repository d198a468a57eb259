"""Seas as ocean engineers describe them: spectra, spreading, regular waves, and the components that add up to them.

A spectrum is cut into bands of equal energy, and each is one wave at the mean frequency of its band: the variance and
the mean frequency of the sea are those of its spectrum, and no two waves have a common period, so that the sea never
repeats. How much energy a band has in one record is drawn from a run's seed, as in a Gaussian sea. Numbers are made by
scalar functions, which give the same bits on every processor.

Linear wave theory, sea states, and the spectrum of gusts (NPD) with its harmonics are here as well.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Literal, NamedTuple

SEA_STATES = (0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0)
"""Significant height [m] of sea states 0 to 6: middles of the heights in WMO's code table 3700."""
_STEEPEST = 0.142
"""Height over length of the steepest wave in deep water (Michell, 1893; Miche's factor in any depth, 1944)."""
DEEP = 20.0
"""Wavenumber times depth beyond which water is infinitely deep: tanh is 1 there to the last bit."""
LONGEST, SHORTEST = 0.25, 6.0
"""Frequencies between which a spectrum counts, as multiples of its peak's; 0.1 % of a Pierson-Moskowitz sea is left
out, whose energy its other waves have."""
_SAMPLES = 4000
"""Number of frequencies at which a spectrum is sampled."""
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""The golden ratio less 1: its multiples, less their whole parts, lie evenly between 0 and 1 however many there are."""
VRX_SEAS = ("pms", "cwr")
"""Models of VRX's wave fields: `physics.waves`."""
_BAND = 2.0 * math.pi * (1.0 / 600.0), 2.0 * math.pi * 0.5
"""Frequencies between which the NPD spectrum holds [rad/s]: 1/600 and 0.5 Hz."""
_SHAPE = 0.468
"""Exponent n of the NPD spectrum."""


class Site(NamedTuple):
    """Where waves are."""

    depth: float = math.inf
    """Depth of the water [m]."""
    gravity: float = 9.81
    """Gravity [m/s2]."""


def wavenumber(frequency: float, site: Site = Site()) -> float:  # noqa: B008  (a tuple)
    """Return the wavenumber k [rad/m] of linear waves: omega^2 = g k tanh(k h), solved to the last bits.

    Args:
        frequency: angular, above 0 [rad/s].
        site: depth and gravity.
    """
    deep = frequency * frequency / site.gravity
    if deep * site.depth > DEEP:
        return deep
    x = deep * site.depth
    y = x / math.sqrt(math.tanh(x)) if x < 1.0 else x  # y tanh(y) = x, from a guess on the safe side
    for _ in range(50):
        t = math.tanh(y)
        step = (y * t - x) / (t + y * (1.0 - t * t))
        y -= step
        if abs(step) <= 1e-15 * y:
            break
    return y / site.depth


def developed_period(height: float, gravity: float = 9.81) -> float:
    """Return the peak period [s] of a sea that the wind has fully raised to a significant height [m].

    Of Pierson and Moskowitz' spectrum (1964): Hs = 4 g sqrt(alpha / 5) / omega_p^2, alpha = 0.0081.
    """
    return 2.0 * math.pi * math.sqrt(height / (4.0 * gravity * math.sqrt(0.0081 / 5.0)))


def breaking_height(period: float, site: Site = Site()) -> float:  # noqa: B008
    """Return the height [m] at which a wave of a period [s] breaks: 0.142 L tanh(k h) (Miche, 1944)."""
    k = wavenumber(2.0 * math.pi / period, site)
    return _STEEPEST * 2.0 * math.pi / k * math.tanh(min(k * site.depth, DEEP))


def steepest_sea(period: float, site: Site = Site()) -> float:  # noqa: B008
    """Return the greatest significant height [m] of a sea of a peak period [s].

    In deep water Hs is at most a fifteenth of the peak's wave length g Tp^2 / 2 pi up to 8 s, at most a 25th of it from
    15 s on, and linear in between (DNV-RP-C205, 2010, 3.5.4); in shallow water it is at most `breaking_height`, too.
    """
    long = min(max((period - 8.0) / 7.0, 0.0), 1.0)
    share = (1.0 - long) / 15.0 + long / 25.0
    return min(share * site.gravity * period**2 / (2.0 * math.pi), breaking_height(period, site))


Spectrum = Callable[[float], float]
"""Density of the variance over angular frequency [m2 s/rad] at a frequency [rad/s]; any constant factor is allowed."""


class Component(NamedTuple):
    """A wave: amplitude cos(wavenumber (direction . x) - frequency t + phase)."""

    amplitude: float
    """Amplitude of the surface [m]; that of a harmonic may be below 0."""
    wavenumber: float
    """Wavenumber [rad/m]."""
    frequency: float
    """Angular frequency [rad/s]."""
    direction: tuple[float, float]
    """Unit vector of travel, east and north."""
    orbital: float
    """Amplitude of the water's horizontal velocity at the mean level [m/s]."""
    energy_shape: float = 0.0
    """Shape of the Gamma distribution from which a run draws its energy, whose mean is this wave's [1]; 0: it is fixed.
    """


def pierson_moskowitz(peak: float) -> Spectrum:
    """Return the shape of a fully developed sea with its peak at an angular frequency [rad/s] (1964; ITTC 1978)."""
    return lambda frequency: frequency**-5.0 * math.exp(-1.25 * (peak / frequency) ** 4.0)


def jonswap(peak: float, gamma: float = 3.3) -> Spectrum:
    """Return the shape of a growing sea (Hasselmann et al., 1973); `gamma` is the peak's enhancement."""
    developed = pierson_moskowitz(peak)

    def density(frequency: float) -> float:
        width = 0.07 if frequency <= peak else 0.09
        off = (frequency - peak) / (width * peak)
        return float(developed(frequency) * gamma ** math.exp(-0.5 * off * off))

    return density


def tma(peak: float, site: Site, gamma: float = 3.3) -> Spectrum:
    """Return the shape of a growing sea in shallow water: JONSWAP's times phi(omega, h) (Bouws et al., 1985).

    phi = tanh^2(k h) / (1 + 2 k h / sinh(2 k h)) (Kitaigorodskii et al., 1975; in the form of Holthuijsen, 2007).
    """
    deep = jonswap(peak, gamma)

    def density(frequency: float) -> float:
        kh = min(wavenumber(frequency, site) * site.depth, DEEP)
        return deep(frequency) * math.tanh(kh) ** 2 / (1.0 + 2.0 * kh / math.sinh(2.0 * kh))

    return density


def tabular(frequencies: Sequence[float], densities: Sequence[float]) -> Spectrum:
    """Return a spectrum with straight lines between points (n,) [rad/s], [m2 s/rad], and nothing beyond them."""

    def density(frequency: float) -> float:
        if not frequencies[0] <= frequency <= frequencies[-1]:
            return 0.0
        after = max(bisect_left(frequencies, frequency), 1)
        left, right = frequencies[after - 1 : after + 1]
        share = (frequency - left) / (right - left)
        return (1.0 - share) * densities[after - 1] + share * densities[after]

    return density


class SpectrumKind(NamedTuple):
    """A model of an irregular sea: waves of random phases, which add up to a spectrum."""

    shape: Callable[..., Spectrum]
    """Function of the angular frequency of the peak [rad/s], of a `Site`, and of the `keys` by name."""
    keys: tuple[str, ...] = ()
    """Attributes of `config.weather.SeaConfig` on which the shape depends."""


SPECTRA: Mapping[str, SpectrumKind] = {
    "jonswap": SpectrumKind(lambda peak, _site, gamma: jonswap(peak, gamma), ("gamma",)),
    "pm": SpectrumKind(lambda peak, _site: pierson_moskowitz(peak)),
    "tma": SpectrumKind(tma, ("gamma",)),
    "file": SpectrumKind(
        lambda _peak, _site, spectrum: tabular([2.0 * math.pi * f for f in spectrum.frequencies], spectrum.densities),
        ("spectrum",),
    ),
}
"""All spectra by the name that world files give them."""


def _quantiles(edges: Sequence[float], masses: Sequence[float], shares: Sequence[float]) -> list[float]:
    """Where the sum of masses (n,) that lie evenly between edges (n + 1,) reaches shares of it, in rising order."""
    sums = [0.0, *accumulate(masses)]
    found, cell = [], 0
    for share in shares:
        goal = share * sums[-1]
        while cell < len(masses) - 1 and sums[cell + 1] < goal:
            cell += 1
        inside = (goal - sums[cell]) / masses[cell] if masses[cell] > 0.0 else 0.0
        found.append(edges[cell] + min(max(inside, 0.0), 1.0) * (edges[cell + 1] - edges[cell]))
    return found


def _strata(edges: Sequence[float], masses: Sequence[float], number: int) -> tuple[list[float], list[float]]:
    """Means (number,) and widths of parts of equal mass; the masses (n,) lie evenly between edges (n + 1,)."""
    sums, moments = [0.0, *accumulate(masses)], [0.0]
    for index, mass in enumerate(masses):
        moments.append(moments[-1] + mass * 0.5 * (edges[index] + edges[index + 1]))
    borders = _quantiles(edges, masses, [index / number for index in range(number + 1)])
    upto, cell = [], 0
    for border in borders:
        while cell < len(masses) - 1 and edges[cell + 1] < border:
            cell += 1
        width = edges[cell + 1] - edges[cell]
        mass = masses[cell] * (border - edges[cell]) / width
        upto.append(moments[cell] + mass * 0.5 * (edges[cell] + border))
    total = sums[-1] / number
    means = [(after - before) / total for before, after in pairwise(upto)]
    return means, [after - before for before, after in pairwise(borders)]


def band_edges(first: float, last: float) -> list[float]:
    """Return the frequencies [rad/s] at which a spectrum is sampled between two: at equal ratios."""
    ratio = (last / first) ** (1.0 / _SAMPLES)
    return [first * ratio**index for index in range(_SAMPLES)] + [last]


def equal_energy_bands(spectrum: Spectrum, first: float, last: float, number: int) -> tuple[list[float], list[float]]:
    """Return mean frequencies and widths (number,) [rad/s] of bands of equal energy between two frequencies.

    Raises:
        ValueError: the spectrum has no energy there.
    """
    edges = band_edges(first, last)
    masses = [(b - a) * spectrum(0.5 * (a + b)) for a, b in pairwise(edges)]
    if not sum(masses) > 0.0:
        raise ValueError("the spectrum has no energy")
    return _strata(edges, masses, number)


def spread_angles(spreading: float, number: int) -> list[float]:
    """Return angles (number,) [rad] off the mean direction, for D(theta) = C cos^(2 s)(theta / 2).

    The form is that of Longuet-Higgins et al. (1963). Each is the mean of a part of equal energy; their order is such
    that neighbours in frequency travel apart.
    `spreading` is the exponent s: about 1 for a short sea, 10 for wind waves, 75 for swell (Goda, 2010).
    """
    half = 2000
    edges = [math.pi * (index / half - 1.0) for index in range(2 * half + 1)]
    masses = [math.cos(0.25 * (a + b)) ** (2.0 * spreading) for a, b in pairwise(edges)]
    sorted_angles, _ = _strata(edges, masses, number)
    order = sorted(range(number), key=lambda index: math.fmod((index + 0.5) * _GOLDEN, 1.0))
    angles = [0.0] * number
    for angle, index in zip(sorted_angles, order, strict=True):
        angles[index] = angle
    return angles


def _linear(amplitude: float, frequency: float, towards: tuple[float, float], site: Site) -> Component:
    k = wavenumber(frequency, site)
    return Component(amplitude, k, frequency, towards, amplitude * site.gravity * k / frequency)


def rotated_direction(direction: Sequence[float], angle: float) -> tuple[float, float]:
    """Return the unit vector of a direction, turned counter-clockwise by an angle [rad]."""
    length = math.hypot(direction[0], direction[1])
    x, y = direction[0] / length, direction[1] / length
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


def _energy_shape(bandwidth: float) -> float:
    """Shape of the Gamma distribution of a wave's energy in a record of T seconds: `bandwidth` is its band's, B T [1].

    In a record of a Gaussian sea a band's energy has the variance 1 / (B T) of its mean squared (Bendat and
    Piersol, 2010). The beats of the wave with its neighbours, B apart, make the part sum sinc^2(pi n B T), n from -inf
    to inf but for 0, of it: all but 1 where the band is narrower than 1 / T, nothing where B T is whole. The rest is
    the variance 1 / shape.
    """
    x = max(bandwidth, 1.0)
    whole = math.floor(x)
    return x * x / ((x - whole) ** 2 + whole)


def irregular_sea(
    spectrum: Spectrum,
    height: float,
    band: tuple[float, float],
    direction: Sequence[float],
    number: int,
    spreading: float | None = None,
    site: Site = Site(),  # noqa: B008
    record: float = 0.0,
) -> list[Component]:
    """Return the waves of a sea: equal amplitudes, whose variance is that of the significant height exactly.

    Args:
        spectrum: shape of the spectrum.
        height: significant height Hs = 4 sqrt(m0) [m].
        band: lowest and highest angular frequency [rad/s].
        direction: of travel on the whole, east and north, any length but 0.
        number: of waves.
        spreading: exponent s of cos^(2 s)(theta / 2); None: all waves travel alike.
        site: depth and gravity.
        record: time T [s] over which significant heights differ from run to run as a Gaussian sea's do; 0: they do not.

    Raises:
        ValueError: the spectrum has no energy in the band.
    """
    amplitude = height / 4.0 * math.sqrt(2.0 / number)
    frequencies, widths = equal_energy_bands(spectrum, *band, number)
    angles = [0.0] * number if spreading is None else spread_angles(spreading, number)
    shapes = [_energy_shape(record * width / (2.0 * math.pi)) if record else 0.0 for width in widths]
    return [
        _linear(amplitude, frequency, rotated_direction(direction, angle), site)._replace(energy_shape=shape)
        for frequency, angle, shape in zip(frequencies, angles, shapes, strict=True)
    ]


def regular_wave(height: float, period: float, direction: Sequence[float], site: Site = Site()) -> list[Component]:  # noqa: B008
    """Return the one linear (Airy) wave of a height, crest over trough [m], and a period [s]."""
    return [_linear(0.5 * height, 2.0 * math.pi / period, rotated_direction(direction, 0.0), site)]


_Harmonics = tuple[tuple[float, ...], ...]
"""Coefficients of five harmonics, of each by powers 1 to 5 of the steepness k H / 2: Fenton (1985), table 1."""


def _polynomial(x: float, *coefficients: float) -> float:
    """The sum of coefficients times powers of x, from power 0 on."""
    total = 0.0
    for power, coefficient in enumerate(coefficients):
        total += coefficient * x**power
    return total


def _harmonics(c11: float, c22: float, c31: float, c33: float, c42: float, c44: float, *fifth: float) -> _Harmonics:
    """Coefficients, each of a power and a harmonic; the last are those of power 5 and harmonics 1, 3 and 5."""
    c51, c53, c55 = fifth
    return (
        (c11, 0.0, c31, 0.0, c51),
        (0.0, c22, 0.0, c42, 0.0),
        (0.0, 0.0, c33, 0.0, c53),
        (0.0, 0.0, 0.0, c44, 0.0),
        (0.0, 0.0, 0.0, 0.0, c55),
    )


def _stokes_velocity(kh: float) -> _Harmonics:
    """Coefficients A of the velocity potential at some k h."""
    s, sh = 1.0 / math.cosh(2.0 * kh), math.sinh(kh)
    r = 1.0 - s
    return _harmonics(
        1.0 / sh,
        3.0 * s**2 / (2.0 * r**2),
        _polynomial(s, -4.0, -20.0, 10.0, -13.0) / (8.0 * sh * r**3),
        _polynomial(s, 0.0, 0.0, -2.0, 11.0) / (8.0 * sh * r**3),
        _polynomial(s, 0.0, 12.0, -14.0, -264.0, -45.0, -13.0) / (24.0 * r**5),
        _polynomial(s, 0.0, 0.0, 0.0, 10.0, -174.0, 291.0, 278.0) / (48.0 * (3.0 + 2.0 * s) * r**5),
        _polynomial(s, -1184.0, 32.0, 13232.0, 21712.0, 20940.0, 12554.0, -500.0, -3341.0, -670.0)
        / (64.0 * sh * (3.0 + 2.0 * s) * (4.0 + s) * r**6),
        _polynomial(s, 0.0, 4.0, 105.0, 198.0, -1376.0, -1302.0, -117.0, 58.0) / (32.0 * sh * (3.0 + 2.0 * s) * r**6),
        _polynomial(s, 0.0, 0.0, 0.0, -6.0, 272.0, -1552.0, 852.0, 2029.0, 430.0)
        / (64.0 * sh * (3.0 + 2.0 * s) * (4.0 + s) * r**6),
    )


def _stokes_surface(kh: float) -> _Harmonics:
    """Coefficients B of the surface."""
    s, ct = 1.0 / math.cosh(2.0 * kh), 1.0 / math.tanh(kh)
    r = 1.0 - s
    b31 = -3.0 * _polynomial(s, 1.0, 3.0, 3.0, 2.0) / (8.0 * r**3)
    b53 = 9.0 * _polynomial(s, 132.0, 17.0, -2216.0, -5897.0, -6292.0, -2687.0, 194.0, 467.0, 82.0)
    b53 /= 128.0 * (3.0 + 2.0 * s) * (4.0 + s) * r**6
    b55 = 5.0 * _polynomial(s, 300.0, 1579.0, 3176.0, 2949.0, 1188.0, 675.0, 1326.0, 827.0, 130.0)
    b55 /= 384.0 * (3.0 + 2.0 * s) * (4.0 + s) * r**6
    return _harmonics(
        1.0,
        ct * (1.0 + 2.0 * s) / (2.0 * r),
        b31,
        -b31,
        ct * _polynomial(s, 6.0, -26.0, -182.0, -204.0, -25.0, 26.0) / (6.0 * (3.0 + 2.0 * s) * r**4),
        ct * _polynomial(s, 24.0, 92.0, 122.0, 66.0, 67.0, 34.0) / (24.0 * (3.0 + 2.0 * s) * r**4),
        -(b53 + b55),
        b53,
        b55,
    )


def _stokes_speed(k: float, height: float, site: Site) -> float:
    """Speed [m/s] of a Stokes wave over water whose mean velocity at a point is zero."""
    kh = min(k * site.depth, DEEP)
    s, steepness = 1.0 / math.cosh(2.0 * kh), 0.5 * k * height
    r, c0 = 1.0 - s, math.sqrt(math.tanh(kh))
    c2 = c0 * (2.0 + 7.0 * s**2) / (4.0 * r**2)
    c4 = c0 * _polynomial(s, 4.0, 32.0, -116.0, -400.0, -71.0, 146.0) / (32.0 * r**5)
    return math.sqrt(site.gravity / k) * (c0 + steepness**2 * c2 + steepness**4 * c4)


def _product(one: Sequence[float], other: Sequence[float]) -> float:
    return math.fsum(a * b for a, b in zip(one, other, strict=True))


def stokes_wave(height: float, period: float, direction: Sequence[float], site: Site = Site()) -> list[Component]:  # noqa: B008
    """Return the five harmonics of a steep regular wave, to the fifth order of its steepness (Fenton, 1985).

    Args:
        height: crest over trough [m].
        period: [s], in water that does not stream on the average.
        direction: of travel, east and north.
        site: depth and gravity.

    Raises:
        ValueError: the theory has no wave of that height and period.
    """
    omega = 2.0 * math.pi / period
    low, high = 0.3 * wavenumber(omega, site), 1.01 * wavenumber(omega, site)
    for _ in range(200):  # the longer a wave of a height, the smaller its frequency
        k = 0.5 * (low + high)
        if k * _stokes_speed(k, height, site) < omega:
            low = k
        else:
            high = k
        if high - low <= 1e-15 * high:
            break
    if abs(k * _stokes_speed(k, height, site) / omega - 1.0) > 1e-9:
        raise ValueError(f"no Stokes wave of {height:g} m has a period of {period:g} s there")
    kh, powers = min(k * site.depth, DEEP), [(0.5 * k * height) ** power for power in range(1, 6)]
    towards, scale = rotated_direction(direction, 0.0), math.sqrt(math.tanh(kh) * site.gravity / k)
    rows = []
    for order, (surface, velocity) in enumerate(zip(_stokes_surface(kh), _stokes_velocity(kh), strict=True), 1):
        amplitude = _product(surface, powers) / k
        orbital = scale * order * _product(velocity, powers) * math.cosh(order * kh)
        rows.append(Component(amplitude, order * k, order * omega, towards, orbital))
    return rows


REGULAR: Mapping[str, Callable[[float, float, tuple[float, float], Site], list[Component]]] = {
    "regular": regular_wave,
    "stokes5": stokes_wave,
}
"""Models of one wave, as functions of height, period, direction and site."""
if TYPE_CHECKING:
    SeaModel = str
else:
    SeaModel = Literal[(*VRX_SEAS, "none", *SPECTRA, *REGULAR)]


def npd(speed: float, height: float) -> Spectrum:
    """Return the spectrum of the wind's speed [m2 s/rad] at a height [m] over the sea.

    NORSOK N-003; Andersen and Lovseth (1992), from measurements on Froya.

    S(f) = 320 (U/10)^2 (z/10)^0.45 / (1 + x^n)^(5 / 3n), x = 172 f (z/10)^(2/3) (U/10)^(-3/4), n = 0.468, in m2/Hz;
    `speed` U is the hour's mean at 10 m, above 0 [m/s].
    """
    level = 320.0 * (speed / 10.0) ** 2 * (height / 10.0) ** 0.45
    scale = 172.0 * (height / 10.0) ** (2.0 / 3.0) * (speed / 10.0) ** -0.75

    def density(frequency: float) -> float:
        f = frequency / (2.0 * math.pi)
        return float(level / (1.0 + (scale * f) ** _SHAPE) ** (5.0 / (3.0 * _SHAPE)) / (2.0 * math.pi))

    return density


def gust_variance(spectrum: Spectrum) -> float:
    """Return the variance of gusts [m2/s2]: the integral of their spectrum between 1/600 and 0.5 Hz."""
    return math.fsum(
        (b - a) * (spectrum(a) + 4.0 * spectrum(0.5 * (a + b)) + spectrum(b)) / 6.0
        for a, b in pairwise(band_edges(*_BAND))
    )


def gust_frequencies(spectrum: Spectrum, number: int) -> list[float]:
    """Return the angular frequencies (number,) [rad/s] of harmonics that have equal shares of the energy."""
    return equal_energy_bands(spectrum, *_BAND, number)[0]
