"""Where all boats of a fleet are, in one frame."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from vrx_mj.control.navigation import Estimate, Navigator, TangentPlane
from vrx_mj.errors import SensorError

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["Muster"]


class Muster:
    """Estimates of all boats, each by a `Navigator` of its own, told each other by radio, as it were."""

    def __init__(self, origin: TangentPlane | None = None) -> None:
        """East and north count from an `origin`; by default, from the first fix of the first boat."""
        self.plane = origin
        """The frame; of no meaning where boats navigate by ground truth, for they share the world's."""
        self._navigators: dict[str, Navigator] = {}

    def __call__(self, boats: "Mapping[str, BoatObservation]", t: float) -> dict[str, Estimate]:
        """Where the boats are at the time `t` [s].

        Raises:
            SensorError: some boats navigate by GPS and some by ground truth, so that they share no frame.
        """
        self._navigators = {name: self._navigators.get(name) or Navigator() for name in boats}
        seen = {name: navigator(boats[name], t) for name, navigator in self._navigators.items()}
        blind = [name for name, navigator in self._navigators.items() if navigator.plane is None]
        if len(blind) == len(seen):
            return seen
        if blind:
            raise SensorError(f"no GPS receiver or no IMU: {', '.join(blind)}; the other boats of the fleet have both")
        return {name: self._shared(self._navigators[name], own) for name, own in seen.items()}

    def _shared(self, navigator: Navigator, own: Estimate) -> Estimate:
        """In the fleet's frame; over a fleet's breadth the axes of both are parallel."""
        assert navigator.plane is not None, "navigates by ground truth"
        if self.plane is None:
            self.plane = navigator.plane
        x, y = self.plane.local(*navigator.plane.geodetic(own.x, own.y))
        return replace(own, x=x, y=y)
