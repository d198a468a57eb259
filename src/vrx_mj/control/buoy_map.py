"""A map of what floats around, made of many looks: places from the lidar, colours from a camera.

A place is the mean of the last looks, as buoys drift; a colour is what most looks said. What was seen once, or has gone
from where the lidar must see it, is forgotten.
"""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from vrx_mj.control.clusters import Cluster
from vrx_mj.control.guidance import Point
from vrx_mj.control.pictures import Look

__all__ = ["WIDEST", "Buoy", "BuoyMap", "kind_of"]

SAME = 2.0
"""What is seen within this distance [m] of where a buoy was is that buoy; some of VRX's fields have them 1 m apart."""
WIDEST = 1.4
"""What is wider than this [m] is no buoy, but shore or dock."""
HIGHEST = 2.0
"""What rises higher than this [m] is no buoy either: VRX's reach up to 1 m, and waves lift them by another."""
SHARE = 0.4
"""Weight of the last look in a buoy's place."""
SURE = 2
"""So many looks are needed for a place, and so many votes for a colour."""
FORGET = 12.0
"""For how long [s] a buoy within `CLEAR` may not be seen before it is forgotten."""
CLEAR = 18.0
"""Up to this distance [m] the lidar sees every buoy that nothing hides, though waves heave it between two rings."""
MARKER = 0.68
"""A buoy that stands out of the water higher than this [m], and higher than it is wide, is a marker and no ball."""
SEASONED = 6
"""What was seen so often is not forgotten: hidden behind another, or far off, it is still there."""


@dataclass
class Buoy:
    """Something that floats."""

    x: float
    """[m]"""
    y: float
    """[m]"""
    z: float = 0.4
    """Of what the last look saw of it, above the boat's origin [m]."""
    seen: int = 1
    """How often."""
    last: float = 0.0
    """When [s]."""
    looks: int = 0
    """How often it was looked at through a camera from near."""
    tried: float = 0.0
    """For how long it was tried to see it [s]."""
    votes: Counter[str] = field(default_factory=Counter)
    """What the looks at it said: its kind, see `kind`."""

    @property
    def place(self) -> Point:
        """Where it is [m]."""
        return self.x, self.y

    def to(self, x: float, y: float) -> tuple[float, float]:
        """Distance [m] and direction [rad] of a place from here."""
        return math.hypot(x - self.x, y - self.y), math.atan2(y - self.y, x - self.x)

    @property
    def kind(self) -> str:
        """red, green, white, blue or black of a marker, `ball` of any ball; empty as long as it is unsure."""
        if not self.votes:
            return ""
        (kind, count), *rest = self.votes.most_common(2)
        ahead = count - (rest[0][1] if rest else 0)
        return kind if count >= SURE and ahead > 0 else ""


class BuoyMap:
    """The buoys met so far."""

    def __init__(self) -> None:
        self.buoys: list[Buoy] = []

    @property
    def sure(self) -> list[Buoy]:
        """Those seen often enough to be there."""
        return [buoy for buoy in self.buoys if buoy.seen >= SURE]

    def of(self, *kinds: str) -> list[Buoy]:
        """Those of some kinds that are sure."""
        return [buoy for buoy in self.sure if buoy.kind in kinds]

    def see(self, here: Point, found: Iterable[Cluster], time: float) -> None:
        """Take the clusters of one look from `here` [m]; their places are relative to it."""
        for cluster in found:
            if cluster.extent < WIDEST and cluster.top < HIGHEST:
                self._see(here[0] + cluster.x, here[1] + cluster.y, (cluster.bottom + cluster.top) / 2.0, time)
        self.buoys = [buoy for buoy in self.buoys if not self._gone(buoy, here, time)]

    def _see(self, x: float, y: float, z: float, time: float) -> None:
        known = min(self.buoys, key=lambda buoy: math.dist(buoy.place, (x, y)), default=None)
        if known is None or math.dist(known.place, (x, y)) > SAME:
            self.buoys.append(Buoy(x, y, z, last=time))
            return
        if known.last != time:
            known.seen += 1
            known.x += SHARE * (x - known.x)
            known.y += SHARE * (y - known.y)
            known.z, known.last = z, time

    @staticmethod
    def _gone(buoy: Buoy, here: Point, time: float) -> bool:
        unseen = time - buoy.last
        if buoy.seen < SURE and unseen > FORGET:
            return True
        near = math.dist(buoy.place, here) < CLEAR
        return near and unseen > FORGET and buoy.seen < SEASONED


def kind_of(look: Look) -> str:
    """The kind of buoy that something looks like; empty if it looks like none."""
    if not 0.15 < look.width < 1.35 or not 0.15 < look.height < 1.5:
        return ""
    if look.height < max(MARKER, 1.1 * look.width):
        return "ball" if look.color in ("black", "orange", "blue") else ""
    return "ball" if look.color == "orange" else look.color
