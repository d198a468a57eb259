"""The sea of a world's file: VRX's wave fields, spectra of ocean engineers, and regular waves."""

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple

from pydantic import Field, model_validator

from vrx_mj.config.base import Fault, InFolder, Only, exclusive
from vrx_mj.config.loading import loads
from vrx_mj.config.search import contained_file
from vrx_mj.config.tree import Section
from vrx_mj.config.values import MAX_NUMBER, NonNegative, Number, Positive, demand, numbers
from vrx_mj.config.wording import literal
from vrx_mj.config.yaml_text import read_lines
from vrx_mj.constants import SEA_WATER_DENSITY
from vrx_mj.errors import VrxError
from vrx_mj.linear_waves import SEA_STATES, Site, breaking_height, developed_period, steepest_sea
from vrx_mj.spectra import REGULAR, SPECTRA, VRX_SEAS, SeaModel

_SPECTRA = tuple(SPECTRA)
_REGULAR = tuple(REGULAR)
GRAVITY = 9.81
"""For the height at which waves break [m/s2]; a world's own is within 1 %."""


class SpectrumTable(NamedTuple):
    """A spectrum in a file."""

    frequencies: tuple[float, ...]
    """Rising frequencies [Hz]."""
    densities: tuple[float, ...]
    """Density of the variance at each [m2/Hz]."""

    @property
    def significant_height(self) -> float:
        """4 sqrt(m0) [m], by the trapezoidal rule."""
        f, s = self.frequencies, self.densities
        areas = (0.5 * (f[i + 1] - f[i]) * (s[i] + s[i + 1]) for i in range(len(f) - 1))
        return 4.0 * math.sqrt(math.fsum(areas))

    @property
    def peak_period(self) -> float:
        """Period of the largest density [s]."""
        return 1.0 / self.frequencies[self.densities.index(max(self.densities))]


def read_spectrum(path: str, folder: Path | None) -> SpectrumTable:
    """The spectrum of a file, whose path stays in `folder`; without one it starts in the current folder.

    A line has a frequency and a density, parted by commas or blanks; empty lines, those with `#`, and words in the
    first line are left out.

    Raises:
        VrxError: it cannot be read, or is not a spectrum.
    """
    points: list[tuple[float, float]] = []
    for number, line in enumerate(read_lines(contained_file(path, folder)), 1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        is_point = words and (points or words[0][0] in "+-.0123456789")
        if is_point and (wrong := _add_point(points, words)):
            raise VrxError(f"spectrum '{path}', line {number}: {wrong}, got {literal(line)}")
    if len(points) < 2 or not any(density for _, density in points):
        needed = "at least 2 points, not all of density 0, are needed"
        raise VrxError(f"spectrum '{path}': {needed}, got {len(points)}")
    frequencies, densities = zip(*points, strict=True)
    return SpectrumTable(frequencies, densities)


def _add_point(points: list[tuple[float, float]], words: Sequence[str]) -> str | None:
    """Add the point of a line's words; what is wrong with it, if it is no point or does not follow."""
    try:
        frequency, density = float(words[0]), float(words[1])
    except (ValueError, IndexError):
        return "a frequency [Hz] and a density [m2/Hz] are needed"
    if not (0.0 < frequency < MAX_NUMBER and 0.0 <= density < MAX_NUMBER):
        return "a frequency above 0 and a density of 0 or more are needed"
    if points and frequency <= points[-1][0]:
        return f"a frequency above that of the line before, {points[-1][0]:g} Hz, is needed"
    points.append((frequency, density))
    return None


_Direction = Annotated[
    tuple[Number, Number],
    numbers("x y"),
    demand(lambda value: math.hypot(*value) >= 1e-9, "must not be zero, got [0, 0]"),
]


def _spectra_with(key: str) -> tuple[str, ...]:
    return tuple(name for name, kind in SPECTRA.items() if key in kind.keys)


class SeaConfig(InFolder):
    """The waves: VRX's, with the tags, meanings and defaults of its `ocean_waves`, or those of a spectrum."""

    folder_keys: ClassVar = {"folder": "file"}
    model: SeaModel = "pms"
    """Kind of sea.

    VRX's: Pierson-Moskowitz sampling (`pms`), constant wavelength-to-amplitude ratio (`cwr`), flat water (`none`).
    Spectra: `jonswap`, Pierson-Moskowitz' for a height and a period (`pm`), shallow water (`tma`), a `file`. One wave:
    a linear one (`regular`), a steep one of five harmonics (`stokes5`)."""
    number: Annotated[int, Field(ge=1, le=100), Only("model", VRX_SEAS)] = 3
    """Component waves of `pms` and `cwr`; pms has at most 3."""
    scale: Annotated[Positive, Only("model", VRX_SEAS)] = 1.5
    """Ratio between neighbouring components: of frequencies in pms, of wavelengths in cwr; 1.1 in profile vrx3."""
    angle: Annotated[Number, Only("model", VRX_SEAS)] = 0.4
    """Angle between the directions of neighbouring components of `pms` and `cwr` [rad]."""
    steepness: Annotated[NonNegative, Only("model", VRX_SEAS)] = 0.0
    """VRX's steepness; it is kept, but the height of the water does not depend on it."""
    gain: Annotated[NonNegative, Only("model", ("pms",))] = 0.1
    """Factor on amplitudes (pms)."""
    amplitude: Annotated[NonNegative, Only("model", ("cwr",))] = 0.0
    """Median amplitude [m] (cwr)."""
    period: Annotated[Positive, Only("model", (*VRX_SEAS, *_REGULAR))] = 5.0
    """Peak (pms) or median (cwr) period, or that of a regular wave [s]."""
    direction: Annotated[_Direction, Only("model", (*VRX_SEAS, *_SPECTRA, *_REGULAR))] = (1.0, 0.0)
    """Direction in which the waves travel, along x and y; any length but zero."""
    tau: Annotated[NonNegative, Only("model", VRX_SEAS)] = 2.0
    """Time constant of the waves' growth at the start [s], of VRX's seas."""
    significant_height: Annotated[NonNegative | None, Only("model", _SPECTRA)] = None
    """Significant height of a spectrum, Hs = 4 sqrt(m0) [m]; by default that of `sea_state`, or of the file.

    On top of a base's `model` without one, or of no model, it makes the sea `jonswap`, with a warning."""
    peak_period: Annotated[Positive | None, Only("model", _SPECTRA)] = None
    """Peak period of a spectrum [s]; by default that of a sea fully raised by the wind, 5 s at a height of 1 m."""
    sea_state: Annotated[Annotated[int, Field(ge=0, lt=len(SEA_STATES))] | None, Only("model", _SPECTRA)] = None
    """Sea state 0 to 6 (WMO code table 3700) instead of a height: 0, 0.05, 0.3, 0.875, 1.875, 3.25 or 5 m."""
    gamma: Annotated[float, Field(ge=1, le=20), Only("model", _spectra_with("gamma"))] = 3.3
    """Peak enhancement of `jonswap` and `tma`."""
    spreading: Annotated[Annotated[float, Field(gt=0, le=1000)] | None, Only("model", _SPECTRA)] = None
    """Exponent s of the spreading cos^(2 s)(theta / 2) of a spectrum; by default all waves travel alike."""
    components: Annotated[int, Field(ge=1, le=500), Only("model", _SPECTRA)] = 60
    """Component waves of a spectrum, of equal energy."""
    height: Annotated[NonNegative | None, Only("model", _REGULAR, required=True)] = None
    """Height of a regular wave, crest over trough [m]."""
    file: Annotated[Annotated[str, loads(read_spectrum)] | None, Only("model", ("file",), required=True)] = None
    """Spectrum of model `file`: lines of frequency [Hz] and density [m2/Hz], as CSV; a path relative to this file."""
    depth: Positive | None = None
    """Depth of the water [m], over a flat bottom; by default it is deep.

    Echo sounders find the bottom. Waves have their lengths and motion by it; VRX's keep the lengths of deep water."""
    density: Positive = SEA_WATER_DENSITY
    """Density of the water [kg/m3], which presses on hulls; only in profile `marine`."""
    ramp: Annotated[NonNegative, Only("model", (*_SPECTRA, *_REGULAR))] = 0.0
    """Time constant of the growth of spectra and regular waves [s]; by default they are there from the start."""

    @model_validator(mode="before")
    @classmethod
    def _of_a_height(cls, data: object) -> object:
        """A height of spectra on top of a base's model without one, or of no model, makes the sea `jonswap`."""
        if not isinstance(data, Section) or data.get("model") in SPECTRA:
            return data
        key = min(("significant_height", "sea_state"), key=data.depth)
        if data.depth("model") <= data.depth(key):
            return data
        return Section({**data, "model": "jonswap"}, data.place, {**data.entries, "model": data.entries[key]})

    @cached_property
    def spectrum(self) -> SpectrumTable:
        """The spectrum of the file."""
        assert self.file is not None, "of a sea of another model"
        return read_spectrum(self.file, self.folder)

    @property
    def hs(self) -> float:
        """Significant height of a spectrum [m]."""
        if self.significant_height is not None:
            return self.significant_height
        return self.spectrum.significant_height if self.sea_state is None else SEA_STATES[self.sea_state]

    @property
    def tp(self) -> float:
        """Peak period of a spectrum [s]."""
        if self.peak_period is not None:
            return self.peak_period
        return self.spectrum.peak_period if self.model == "file" else developed_period(max(self.hs, 1e-3))

    def _faults(self) -> Iterator[Fault]:
        if self.model == "pms" and self.number > 3:
            yield ("number",), f"must be at most 3 in a pms sea, got {self.number}"
        if self.model == "pms" and self.scale < 1:
            yield ("scale",), f"must be at least 1 in a pms sea, got {self.scale:g}"
        site = Site(self.depth or math.inf, GRAVITY)
        if self.model == "tma" and self.depth is None:
            yield ("depth",), "required for `model: tma`, shallow water; in deep water it is jonswap"
        elif self.model in SPECTRA:
            found = list(exclusive(self, "significant_height", "sea_state", required=self.model != "file"))
            yield from found or self._breaking("sea", self.hs, self.tp, steepest_sea(self.tp, site))
        elif self.height is not None:
            yield from self._breaking("wave", self.height, self.period, breaking_height(self.period, site))

    def _breaking(self, what: str, height: float, period: float, most: float) -> Iterator[Fault]:
        """A sea or a wave that is higher than what breaks; a longer period helps little in shallow water."""
        if height > most:
            given = [key for key in ("height", "significant_height") if getattr(self, key) is not None]
            where, more = (f" in {self.depth:g} m of water", " or more depth") if self.depth else ("", "")
            text = f"a {what} of {period:.3g} s breaks at {most:.3g} m{where}, got {height:.3g} m"
            longer = "period" if what == "wave" else "peak_period"
            yield (*given, "model")[:1], f"{text}; give less height, or a longer {longer}{more}"
