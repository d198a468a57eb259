"""The current of a world's file: a mean with a profile over depth, a tide, and a slow random part."""

from collections.abc import Iterable
from typing import Annotated

from vrx_mj.config.base import Config, Fault, column_faults
from vrx_mj.config.values import NonNegative, Number, Positive, Seed, numbers

_M2 = 44714.16
"""Period of the principal lunar tide [s]: 12 h 25 min 14 s."""


class TideConfig(Config):
    """A current whose arrow draws an ellipse."""

    speed: NonNegative
    """Greatest speed, along `direction` [m/s]."""
    minor: Number = 0.0
    """Greatest speed across it [m/s]; below 0 the arrow turns clockwise."""
    direction: Number = 0.0
    """Direction of the greatest speed [degrees], counter-clockwise from x."""
    period: Positive = _M2
    """Period [s]; by default that of the principal lunar tide."""
    phase: Number = 0.0
    """Phase at time 0 [degrees]: 0 is the greatest speed along `direction`."""


class CurrentConfig(Config):
    """Water that streams, the same everywhere but for its depth."""

    speed: NonNegative = 0.0
    """Mean speed at the surface [m/s]."""
    direction: Number = 0.0
    """Direction in which the water moves [degrees], counter-clockwise from x, as for the wind."""
    profile: tuple[Annotated[tuple[NonNegative, Number], numbers("depth share")], ...] = ()
    """Share of the mean and of the tide at depths [m], with straight lines between them; by default 1 everywhere."""
    tide: TideConfig | None = None
    """A tide, which adds to the mean."""
    var_gain: NonNegative = 0.0
    """Standard deviation of a random part (Gauss-Markov), along x and along y [m/s]."""
    var_time: Positive = 60.0
    """Time constant of the random part [s]."""
    seed: Seed = 0
    """Seed of the random part; 0 leaves it to the world's seed."""

    def _faults(self) -> Iterable[Fault]:
        return column_faults("profile", [depth for depth, _ in self.profile], "a depth", " m")
