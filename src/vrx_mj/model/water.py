"""Sea and wind of a compiled world."""

import math
from dataclasses import replace
from typing import Annotated

from pydantic import Field

from vrx_mj.constants import WATER_DENSITY, WAVE_GRAVITY
from vrx_mj.errors import CommandError
from vrx_mj.model.kinds import (
    TIED,
    Flag,
    Heading,
    NonNegative,
    Positive,
    Real,
    Seed,
    Share,
    Unless,
    Vec2,
    left_out,
    record,
)
from vrx_mj.spectra import REGULAR, SPECTRA, SeaModel, Site, breaking_height, steepest_sea


@record
class Wave:
    """One component of the sea."""

    amplitude: Real
    """Amplitude [m]."""
    wavenumber: Annotated[NonNegative, TIED]
    """Wavenumber [rad/m]."""
    frequency: Annotated[NonNegative, TIED]
    """Angular frequency [rad/s]."""
    direction: Heading
    """Direction of travel [rad]."""
    steepness: Annotated[Share, TIED]
    """Share of the trochoid's horizontal motion; heights ignore it."""
    orbital: Annotated[Real, TIED] | None = left_out(default=None)
    """Amplitude of the water's horizontal velocity at the mean level [m/s]; None: a linear wave's, g k a / omega."""
    energy_shape: Annotated[NonNegative, TIED] = left_out(default=0.0)
    """Shape of the Gamma distribution from which a run draws its energy, whose mean is this wave's [1]; 0: it is fixed.
    """

    def scale_by(self, factor: float) -> "Wave":
        """The wave `factor` times as high, and so the motion of its water."""
        return replace(self, amplitude=factor * self.amplitude, orbital=self.orbital and factor * self.orbital)


@record
class Sea:
    """The waves and their start-up ramp."""

    model: SeaModel
    """Kind of sea: VRX's Pierson-Moskowitz sampling, constant wavelength ratio, or none; spectra; regular waves."""
    tau: Real
    """Time constant of the ramp [s]; no ramp unless above 0."""
    level: Real
    """Height of the mean surface [m]."""
    waves: Annotated[tuple[Wave, ...], Field(max_length=10_000), Unless("is_stokes")]
    """The components."""
    significant_height: Annotated[NonNegative, Unless("has_fixed_height")]
    """Significant wave height [m]; setting it by name scales all components and keeps their periods."""
    period: Annotated[NonNegative, TIED]
    """Period that the file gives [s]."""
    direction: Annotated[Vec2, TIED]
    """Direction that the file gives, along x and y."""
    depth: Annotated[Positive, TIED] | None = left_out(default=None)
    """Depth of the water [m]; None: deep."""
    gravity: Annotated[Positive, TIED] = left_out(default=WAVE_GRAVITY)
    """Gravity of the waves and of their pressure [m/s2]."""
    density: Annotated[Positive, TIED] = left_out(default=WATER_DENSITY)
    """Density of the water [kg/m3]."""
    moving: Flag = left_out(default=0)
    """1: the water's motion acts on floating bodies, as in profile `marine`."""

    @property
    def random(self) -> bool:
        """Whether the phases of its waves are drawn from a run's seed."""
        return self.model in SPECTRA

    @property
    def is_stokes(self) -> bool:
        """Whether its waves are the harmonics of one steep wave, which follow from its height."""
        return self.model == "stokes5"

    @property
    def has_fixed_height(self) -> bool:
        """Whether its height cannot be scaled: it is flat, or a steep wave, whose harmonics grow otherwise."""
        return not self.significant_height or self.is_stokes

    def with_height(self, height: float) -> "Sea":
        """The sea with waves of the same periods and another significant height [m].

        Raises:
            CommandError: it breaks.
        """
        site = Site(math.inf if self.depth is None else self.depth, self.gravity)
        most = (breaking_height if self.model in REGULAR else steepest_sea)(self.period, site)
        if height > most:
            text = f"a sea of {self.period:.3g} s breaks at {most:.3g} m"
            raise CommandError(f"invalid sea.significant_height [m]: {text}, got {height:.3g} m")
        factor = height / self.significant_height
        waves = tuple(wave.scale_by(factor) for wave in self.waves)
        return replace(self, significant_height=height, waves=waves)

    def with_amplitude(self, index: int, amplitude: float) -> "Sea":
        """The sea with another amplitude [m] of one of its waves, and the significant height that follows."""
        wave = self.waves[index]
        own = wave.scale_by(amplitude / wave.amplitude) if wave.amplitude else replace(wave, orbital=None)
        waves = (*self.waves[:index], replace(own, amplitude=amplitude), *self.waves[index + 1 :])
        before, now = (math.hypot(*[wave.amplitude for wave in each]) for each in (self.waves, waves))
        height = self.significant_height * (now / before if before else 1.0)
        return replace(self, significant_height=height, waves=waves)


@record
class Layer:
    """The current at a depth."""

    depth: NonNegative
    """Depth under the mean surface [m]."""
    share: Real
    """Fraction of the current at the surface [1]."""


@record
class Current:
    """A mean current, a tide and a random part."""

    mean: Vec2
    """Mean velocity at the surface, along x and y [m/s]."""
    tide_major: Vec2
    """Velocity of the tide along the major axis of its ellipse at its maximum, along x and y [m/s]."""
    tide_minor: Vec2
    """Velocity of the tide a quarter of a period later, along the minor axis, along x and y [m/s]."""
    tide_frequency: NonNegative
    """Angular frequency of the tide [rad/s]."""
    tide_phase: Real
    """Phase of the tide at time 0 [rad]."""
    gain: NonNegative
    """Standard deviation of the random part (Gauss-Markov), along x and along y [m/s]."""
    time_constant: Positive
    """Time constant of the random part [s]."""
    seed: Seed
    """Seed of the random part; 0 leaves it to the run's seed."""
    layers: Annotated[tuple[Layer, ...], Field(max_length=10_000)]
    """Fractions of the mean and of the tide over the depth; none: 1 everywhere."""


@record
class Wind:
    """The mean wind and its gusts."""

    direction: Heading
    """Direction toward which the air moves [rad]."""
    mean: Real
    """Mean speed [m/s]."""
    gain: NonNegative
    """Standard deviation of the gusts [m/s]."""
    time_constant: Positive
    """Time constant of the gusts [s]."""
    first_step: NonNegative
    """Length of the first step of the gusts [s]; 0: that of all others."""
    seed: Seed
    """Seed of the gusts; 0 leaves it to the run's seed."""
    update_rate: Real
    """Rate at which VRX publishes the wind [Hz]."""


@record
class Air:
    """Profile over height, gusts of a spectrum and turning direction of a wind in profile `marine`."""

    height: Positive
    """Height above the water at which the wind's mean speed applies [m]."""
    exponent: NonNegative
    """Exponent of the wind's power law over height [1]; 0: the same at all heights."""
    roughness: NonNegative
    """Roughness length of the wind's logarithmic profile [m]; 0: the power law applies."""
    turning: Real
    """Rate at which the wind's direction turns [rad/s], counter-clockwise."""
    spread: NonNegative
    """Standard deviation of the wind's direction [rad]."""
    time_constant: Positive
    """Time constant of the direction [s]."""
    gust_frequencies: Annotated[tuple[Positive, ...], Field(max_length=10_000)]
    """Angular frequencies of the harmonics of its gusts [rad/s]; none: a Gauss-Markov process."""
