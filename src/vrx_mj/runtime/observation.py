"""What a boat's controller sees."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, overload

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import heading, rotation_matrix

if TYPE_CHECKING:
    from vrx_mj.runtime.hull import Hull, Propeller
    from vrx_mj.sensors.readings import Reading

TASK = "task"
"""Key of the task in observations and commands; no boat may have this name."""


@dataclass(frozen=True)
class BoatObservation:
    """State of a boat: pose and velocity of its `base_link` origin, sensors and thrusters."""

    position: FloatArray
    """Position, (3,) [m, ENU]."""
    quaternion: FloatArray
    """Orientation, (4,) quaternion (w, x, y, z), body to world."""
    velocity: FloatArray
    """Linear velocity u, v, w, (3,) [m/s], body axes (forward, left, up)."""
    angular_velocity: FloatArray
    """Angular velocity p, q, r, (3,) [rad/s], body axes."""
    sensors: Mapping[str, "Reading"] = field(default_factory=dict, repr=False, compare=False)
    """Last readings of the sensors by name, computed when looked up, as in `Simulation.sense`."""
    thrusters: Mapping[str, "Propeller"] = field(default_factory=dict, repr=False, compare=False)
    """Thrusters of the boat by name."""
    hull: "Hull | None" = field(default=None, repr=False, compare=False)
    """Mass, drag, size and rudders of the boat."""

    @property
    def roll(self) -> float:
        """Roll [rad]; positive with the starboard side down."""
        w, x, y, z = self.quaternion.tolist()
        return math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))

    @property
    def pitch(self) -> float:
        """Pitch [rad]; positive with the bow down."""
        w, x, y, z = self.quaternion.tolist()
        return math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))

    @property
    def heading(self) -> float:
        """Heading [rad], counter-clockwise from the world's x axis, from -pi to pi."""
        return heading(*self.quaternion.tolist())

    @property
    def speed(self) -> float:
        """Horizontal speed over ground [m/s]."""
        return math.hypot(*self._over_ground())

    @property
    def course(self) -> float:
        """Course over ground [rad], counter-clockwise from the world's x axis, from -pi to pi."""
        vx, vy = self._over_ground()
        return math.atan2(vy, vx)

    def _over_ground(self) -> list[float]:
        """Horizontal velocity along x and y [m/s]."""
        turn = rotation_matrix(self.quaternion)
        return [float(turn[row] @ self.velocity) for row in (0, 1)]


class Observation(dict[str, BoatObservation]):
    """Input of controllers: boats by name and, in a world with a task, its phase, score and outputs as `obs["task"]`.

    Iteration covers the boats only.
    """

    def __init__(self, boats: Iterable[tuple[str, BoatObservation]], task: Mapping[str, object] | None = None) -> None:
        super().__init__(boats)
        self.task = task

    def __missing__(self, name: str) -> object:
        """The task, which is not among the boats."""
        if name == TASK and self.task is not None:
            return self.task
        raise KeyError(name)

    def __contains__(self, name: object) -> bool:
        """Whether there is such a boat, or a task."""
        return super().__contains__(name) or (name == TASK and self.task is not None)

    def get(self, name: str, default: Any = None) -> Any:
        """Entry of a boat or of the task; `default` if there is none."""
        try:
            return self[name]
        except KeyError:
            return default

    if TYPE_CHECKING:

        @overload
        def __getitem__(self, name: Literal["task"]) -> Mapping[str, Any]: ...  # type: ignore[overload-overlap]

        @overload
        def __getitem__(self, name: str) -> BoatObservation: ...

        def __getitem__(self, name: str) -> Any:
            """A boat, or the task."""
