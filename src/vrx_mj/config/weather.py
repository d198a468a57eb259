"""Sea, wind and current of a world's file, and what a boat shows to the wind."""

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import Field, model_validator

from vrx_mj.config.base import Config, Fault, Faults, InFolder, Only, column_faults, exclusive
from vrx_mj.config.loading import loads
from vrx_mj.config.search import contained_file
from vrx_mj.config.tree import Section, literal
from vrx_mj.config.values import MAX_NUMBER, NonNegative, Number, NumberOf, Positive, Vec3, demand, numbers
from vrx_mj.config.yaml_text import read_lines
from vrx_mj.constants import SEA_WATER_DENSITY
from vrx_mj.errors import VrxError
from vrx_mj.model.boats import Windage, WindCoefficients
from vrx_mj.model.kinds import Seed
from vrx_mj.model.water import Air, Current, Layer, Sea, Wind
from vrx_mj.spectra import (
    REGULAR,
    SEA_STATES,
    SPECTRA,
    VRX_SEAS,
    SeaModel,
    Site,
    breaking_height,
    developed_period,
    steepest_sea,
)

_M2 = 44714.16
"""Period of the principal lunar tide [s]: 12 h 25 min 14 s."""
_SPECTRA = tuple(SPECTRA)
_REGULAR = tuple(REGULAR)
GRAVITY = 9.81
"""For the height at which waves break [m/s2]; a world's own is within 1 %."""


class TideConfig(Config):
    """A tidal current whose velocity vector follows an ellipse."""

    speed: NonNegative
    """Maximum speed, along `direction` [m/s]."""
    minor: Number = 0.0
    """Maximum speed across it [m/s]; with a negative value the vector turns clockwise."""
    direction: Number = 0.0
    """Direction of the maximum speed [degrees], counter-clockwise from x."""
    period: Positive = _M2
    """Period [s]; by default that of the principal lunar tide (M2)."""
    phase: Annotated[float, NumberOf(Current, "tide_phase")] = 0.0
    """Phase at time 0 [degrees]; at phase 0 the speed along `direction` is at its maximum."""


_Layer = tuple[Annotated[float, NumberOf(Layer, "depth")], Annotated[float, NumberOf(Layer, "share")]]


class CurrentConfig(Config):
    """A current, the same everywhere at a given depth."""

    speed: NonNegative = 0.0
    """Mean speed at the surface [m/s]."""
    direction: Number = 0.0
    """Direction in which the water moves [degrees], counter-clockwise from x, like that of the wind."""
    profile: Annotated[tuple[Annotated[_Layer, numbers("depth share")], ...], Field(max_length=10_000)] = ()
    """Depths [m] and the fraction of the mean and of the tide there, interpolated linearly; by default 1 everywhere."""
    tide: TideConfig | None = None
    """A tide, which is added to the mean."""
    var_gain: Annotated[float, NumberOf(Current, "gain")] = 0.0
    var_time: Annotated[float, NumberOf(Current, "time_constant")] = 60.0
    seed: Annotated[Seed, NumberOf(Current, "seed")] = 0

    def _faults(self) -> Iterable[Fault]:
        return column_faults("profile", [depth for depth, _ in self.profile], "a depth", " m")


class WindObject(Config):
    """Something on which the wind acts: a boat, an object, or every boat of a kind."""

    model: str
    """Name of a boat, an object, a kind of robot or a model of objects."""
    link: str | None = None
    """VRX's link_name: for an object with joints, the link on which the wind acts; by default its own link."""
    coefficients: Annotated[Vec3, NumberOf(WindCoefficients, "coefficients")]


class WindConfig(Config):
    """Mean wind with Gauss-Markov gusts as in VRX's usv_gazebo_wind_plugin, and what profile `marine` adds."""

    direction: Number = 270.0
    """Direction in which the air moves [degrees], counter-clockwise from x."""
    mean_velocity: Annotated[float, NumberOf(Wind, "mean"), Field(ge=0)] = 0.0
    var_gain: Annotated[float, NumberOf(Wind, "gain"), Only("spectrum", ("gauss_markov",))] = 0.0
    var_time: Annotated[float, NumberOf(Wind, "time_constant"), Only("spectrum", ("gauss_markov",))] = 2.0
    seed: Annotated[Seed, NumberOf(Wind, "seed")] = 0
    update_rate: Annotated[float, NumberOf(Wind, "update_rate")] = 10.0
    """Rate at which VRX publishes the wind [Hz]; it has no effect on motion."""
    height: Annotated[float, NumberOf(Air, "height")] = 10.0
    """Height above the water at which `mean_velocity` applies [m]. This key and the following ones are for profile
    `marine`."""
    exponent: Annotated[float | None, NumberOf(Air, "exponent"), Field(le=1)] = None
    """Exponent of a power law over height, 0.11 over open water; by default the wind is the same at all heights."""
    roughness: Annotated[Positive | None, NumberOf(Air, "roughness")] = None
    """Roughness length of a logarithmic profile over height [m], 0.0002 over open water; instead of `exponent`."""
    spectrum: Literal["gauss_markov", "npd"] = "gauss_markov"
    """Spectrum of the gusts: that of `var_gain` and `var_time`, or the NPD (Froya) spectrum, which follows from speed
    and height."""
    components: Annotated[int, Field(ge=1, le=500), Only("spectrum", ("npd",))] = 60
    """Number of harmonics that make up the gusts of a spectrum."""
    turning: Annotated[float, NumberOf(Air, "turning")] = 0.0
    """Rate at which the direction turns [degrees/s], counter-clockwise."""
    var_direction: Annotated[float, NumberOf(Air, "spread")] = 0.0
    """Standard deviation of the direction (Gauss-Markov) [degrees]."""
    var_direction_time: Annotated[float, NumberOf(Air, "time_constant")] = 60.0
    objects: tuple[WindObject, ...] | None = None
    """Objects on which the wind acts, in addition to boats whose robot has its own coefficients; by default only these
    boats. With `[]` the wind acts on nothing."""

    def _faults(self) -> Faults:
        yield from exclusive(self, "exponent", "roughness")
        if self.roughness is not None and self.roughness >= self.height:
            yield ("roughness",), f"a roughness below `height`, {self.height:g} m, is needed, got {self.roughness:g} m"


_Vessel = Literal[
    "car_carrier", "cargo_vessel", "cargo_vessel_containers", "container_ship", "destroyer", "diving_support_vessel",
    "drilling_vessel", "ferry", "fishing_vessel", "lng_tanker", "offshore_supply_vessel", "passenger_liner",
    "research_vessel", "speed_boat", "tanker_loaded", "tanker_ballast", "tender",
]  # fmt: skip
_Point = Annotated[tuple[Number, Number, Number, Number], numbers("angle cx cy cn")]
_Three = Annotated[tuple[NonNegative, NonNegative, Number], numbers("cx cy cn")]


class IsherwoodConfig(Config):
    """Inputs of Isherwood's (1972) formulas for merchant ships besides the areas. The link's origin is amidships."""

    breadth: Positive
    """Breadth [m]."""
    perimeter: Positive
    """Length of the outline of the lateral area, without the waterline, masts and ventilators [m]."""
    superstructure_area: NonNegative = 0.0
    """Lateral area of the superstructure [m2]."""
    masts: Annotated[int, Field(ge=0, le=20)] = 0
    """Number of distinct groups of masts seen from the side, without those close to the bridge."""


class WindageConfig(Config):
    """Areas of a boat in the wind of profile `marine`, and one of `coefficients`, `curve`, `isherwood` and `vessel`."""

    frontal_area: Annotated[float, NumberOf(Windage, "frontal_area")]
    lateral_area: Annotated[float, NumberOf(Windage, "lateral_area")]
    length: Annotated[float, NumberOf(Windage, "length")]
    height: Annotated[float, NumberOf(Windage, "height")]
    """Height of the lateral area's centre above the link's origin, which is taken as the water level [m]. The wind acts
    there, with its speed at this height."""
    offset: Annotated[float, NumberOf(Windage, "offset")] = 0.0
    coefficients: _Three | None = None
    """Coefficients cx, cy, cn of -cx cos(a), cy sin(a) and cn sin(2 a), where a is the angle off the bow from which the
    wind comes."""
    curve: Annotated[tuple[_Point, ...], Field(max_length=361)] = ()
    """Coefficients over that angle from 0 to 180 [degrees], interpolated linearly, the same on both sides. cx is
    negative in wind from ahead. A positive cy pushes to leeward, and a positive cn turns the bow to leeward."""
    isherwood: IsherwoodConfig | None = None
    """A merchant ship with Isherwood's (1972) coefficients."""
    vessel: _Vessel | None = None
    """Type of vessel, with Blendermann's (1994) coefficients."""

    def _faults(self) -> list[Fault]:
        found = list(exclusive(self, "coefficients", "curve", "isherwood", "vessel", required=True))
        found += column_faults("curve", [row[0] for row in self.curve], "an angle", ends=(0.0, 180.0))
        found += [
            (("curve", index), f"cy and cn of 0 are needed at {angle:g}, where the sides meet")
            for index, (angle, _, cy, cn) in enumerate(self.curve)
            if angle in (0.0, 180.0) and (cy or cn)
        ]
        if self.isherwood and self.isherwood.superstructure_area > self.lateral_area:
            text = f"must be at most lateral_area, {self.lateral_area:g} m2, got {self.isherwood.superstructure_area:g}"
            found.append((("isherwood", "superstructure_area"), text))
        return found


class SpectrumTable(NamedTuple):
    """A spectrum in a file."""

    frequencies: tuple[float, ...]
    """Rising frequencies [Hz]."""
    densities: tuple[float, ...]
    """Density of the variance at each [m2/Hz]."""

    @property
    def significant_height(self) -> float:
        """Significant height 4 sqrt(m0) [m], by the trapezoidal rule."""
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
        return f"a frequency above {points[-1][0]:g} Hz, that of the previous line, is needed"
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
    """The waves: VRX's, with the parameters, meanings and defaults of its `ocean_waves`, or those of a spectrum."""

    folder_keys: ClassVar = {"folder": "file"}
    model: SeaModel = "pms"
    """Kind of sea.

    VRX's: Pierson-Moskowitz sampling (`pms`), constant wavelength-to-amplitude ratio (`cwr`), flat water (`none`).
    Spectra: `jonswap`, Pierson-Moskowitz of a given height and period (`pm`), shallow water (`tma`), a `file`. One
    wave: a linear one (`regular`), a steep one of five harmonics (`stokes5`)."""
    number: Annotated[int, Field(ge=1, le=100), Only("model", VRX_SEAS)] = 3
    """Number of component waves of `pms` and `cwr`; at most 3 for pms."""
    scale: Annotated[Positive, Only("model", VRX_SEAS)] = 1.5
    """Ratio between neighbouring components: of frequencies in pms, of wavelengths in cwr; 1.1 in profile vrx3."""
    angle: Annotated[Number, Only("model", VRX_SEAS)] = 0.4
    """Angle between the directions of neighbouring components of `pms` and `cwr` [rad]."""
    steepness: Annotated[NonNegative, Only("model", VRX_SEAS)] = 0.0
    """VRX's steepness. It is stored, but the height of the water does not depend on it."""
    gain: Annotated[NonNegative, Only("model", ("pms",))] = 0.1
    """Factor on amplitudes (pms)."""
    amplitude: Annotated[NonNegative, Only("model", ("cwr",))] = 0.0
    """Median amplitude [m] (cwr)."""
    period: Annotated[Positive, Only("model", (*VRX_SEAS, *_REGULAR))] = 5.0
    """Peak (pms) or median (cwr) period, or that of a regular wave [s]."""
    direction: Annotated[_Direction, Only("model", (*VRX_SEAS, *_SPECTRA, *_REGULAR))] = (1.0, 0.0)
    """Direction in which the waves travel, as components along x and y; any nonzero length."""
    tau: Annotated[float, NumberOf(Sea, "tau"), Field(ge=0), Only("model", VRX_SEAS)] = 2.0
    """Time constant of the growth of VRX's waves at the start [s]."""
    significant_height: Annotated[float | None, NumberOf(Sea, "significant_height"), Only("model", _SPECTRA)] = None
    """Significant wave height of a spectrum, Hs = 4 sqrt(m0) [m]; by default that of `sea_state`, or of the file. If
    this file sets no `model` and its base has no spectrum, it makes the sea `jonswap`, with a warning."""
    peak_period: Annotated[Positive | None, Only("model", _SPECTRA)] = None
    """Peak period of a spectrum [s]; by default that of a fully developed sea, 5 s at a height of 1 m."""
    sea_state: Annotated[Annotated[int, Field(ge=0, lt=len(SEA_STATES))] | None, Only("model", _SPECTRA)] = None
    """Sea state 0 to 6 (WMO code table 3700) instead of a height: 0, 0.05, 0.3, 0.875, 1.875, 3.25 or 5 m."""
    gamma: Annotated[float, Field(ge=1, le=20), Only("model", _spectra_with("gamma"))] = 3.3
    """Peak enhancement of `jonswap` and `tma`."""
    spreading: Annotated[Annotated[float, Field(gt=0, le=1000)] | None, Only("model", _SPECTRA)] = None
    """Exponent s of the directional spreading cos^(2 s)(theta / 2) of a spectrum; by default all waves travel in the
    same direction."""
    components: Annotated[int, Field(ge=1, le=500), Only("model", _SPECTRA)] = 60
    """Number of component waves of a spectrum, of equal mean energy."""
    amplitudes: Annotated[Literal["drawn", "fixed"], Only("model", _SPECTRA)] = "drawn"
    """Whether the energies of the components are drawn from the run's seed, or equal those of the spectrum in every
    run."""
    record: Annotated[Positive, Only("model", _SPECTRA), Only("amplitudes", ("drawn",))] = 3600.0
    """Length of a record whose significant wave height scatters between seeds as in a Gaussian sea [s]."""
    height: Annotated[NonNegative | None, Only("model", _REGULAR, required=True)] = None
    """Height of a regular wave, crest over trough [m]."""
    file: Annotated[Annotated[str, loads(read_spectrum)] | None, Only("model", ("file",), required=True)] = None
    """Spectrum of model `file`: a CSV file with lines of frequency [Hz] and density [m2/Hz], as a path relative to this
    file."""
    depth: Annotated[float | None, NumberOf(Sea, "depth")] = None
    """Depth of the water over a flat bottom [m]; by default the water is deep. Echo sounders detect the bottom.
    Wavelengths and water motion depend on it, except that VRX's waves keep their deep-water lengths."""
    density: Annotated[float, NumberOf(Sea, "density")] = SEA_WATER_DENSITY
    """Density of the water that acts on hulls [kg/m3]; only in profile `marine`."""
    ramp: Annotated[float, NumberOf(Sea, "tau"), Field(ge=0), Only("model", (*_SPECTRA, *_REGULAR))] = 0.0
    """Time constant of the growth of spectra and regular waves [s]; by default they have full height from the start."""

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

    def _faults(self) -> Faults:
        if self.model == "pms" and self.number > 3:
            yield ("number",), f"must be at most 3 in a pms sea, got {self.number}"
        if self.model == "pms" and self.scale < 1:
            yield ("scale",), f"must be at least 1 in a pms sea, got {self.scale:g}"
        site = Site(self.depth or math.inf, GRAVITY)
        if self.model == "tma" and self.depth is None:
            yield ("depth",), "required for `model: tma`, a sea in shallow water; for deep water use jonswap"
        elif self.model in SPECTRA:
            found = list(exclusive(self, "significant_height", "sea_state", required=self.model != "file"))
            yield from found or self._breaking("sea", self.hs, self.tp, steepest_sea(self.tp, site))
        elif self.height is not None:
            yield from self._breaking("wave", self.height, self.period, breaking_height(self.period, site))

    def _breaking(self, what: str, height: float, period: float, most: float) -> Faults:
        """A sea or a wave that is higher than what breaks; a longer period helps little in shallow water."""
        if height > most:
            given = [key for key in ("height", "significant_height") if getattr(self, key) is not None]
            where, more = (f" in {self.depth:g} m of water", " or greater depth") if self.depth else ("", "")
            text = f"a {what} of {period:.3g} s breaks at {most:.3g} m{where}, got {height:.3g} m"
            longer = "period" if what == "wave" else "peak_period"
            yield (*given, "model")[:1], f"{text}; reduce the height, or use a longer {longer}{more}"
