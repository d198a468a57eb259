"""What the rules of tasks do to the world, and what they sum up."""

from dataclasses import dataclass

from vrx_mj.tasks.frame import Count


@dataclass(frozen=True, slots=True)
class Release:
    """Let go of the boat."""

    boat: str


@dataclass(frozen=True, slots=True)
class PlaceObject:
    """Put a floating object somewhere, at rest."""

    name: str
    pose: tuple[float, float, float, float, float, float]
    """x, y, z [m], roll, pitch, yaw [rad], ENU."""


@dataclass(frozen=True, slots=True)
class LightUp:
    """Have a light buoy show three colours in turn, from a second later on."""

    name: str
    colors: tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class ShowSymbol:
    """Have a placard show a symbol."""

    placard: str
    symbol: str
    """Symbol, such as `red_circle`."""


@dataclass(frozen=True, slots=True)
class SetPinger:
    """Put the beacon that all receivers of a boat hear somewhere."""

    boat: str
    position: tuple[float, float, float]
    """Position [m, ENU]."""


Action = Release | PlaceObject | LightUp | ShowSymbol | SetPinger


@dataclass
class RunningMean:
    """Sums over the frames since the run began."""

    frames: Count = 0
    """Number of frames."""
    total: float = 0.0
    """Sum of the errors [m]."""
    error: float = 0.0
    """Error of the last frame [m]."""

    @property
    def mean(self) -> float:
        """Mean error [m]; 0 before the first frame."""
        return self.total / self.frames if self.frames else 0.0

    def add(self, error: float) -> float:
        """Take in the error of a frame [m]; returns the mean."""
        self.frames, self.total, self.error = self.frames + 1, self.total + error, error
        return self.mean
