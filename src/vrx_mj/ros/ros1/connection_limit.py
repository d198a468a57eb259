"""How many connections there may be, in all and per host."""

import contextlib
from collections import Counter, OrderedDict
from collections.abc import Mapping, Sequence

from vrx_mj.ros.access import is_loopback
from vrx_mj.ros.intake import Place

__all__ = ["ConnectionLimit"]

MOST = 4096
IN_USE = 7 / 8
"""Share of the places that connections in use may have, at most."""
SPARE_FILES = 200
"""Open files that are left to everything else."""


class ConnectionLimit:
    """How many connections there may be, in all and per host.

    Those that wait for their peers make room for new ones, the longest waiting first: a peer that connects and says
    nothing, or says it slowly, keeps nobody out. Those in use stay, but never have all places, so that somebody new
    can always ask. Hosts other than this one share half of the places, a quarter each.
    """

    def __init__(self, most: int | None = None) -> None:
        self.most = allowed() if most is None else most
        self.inside: Counter[str] = Counter()
        """Connections by host."""
        self._waiting: dict[str, OrderedDict[Place, None]] = {}
        self._used: set[Place] = set()
        self._in_use: Counter[str] = Counter()

    def enter(self, place: Place) -> bool:
        """Let one more in, who waits for its peer, or not."""
        while (crowd := self._crowd(place.host, self.inside, 1.0)) is not None:
            if not self._make_room(crowd):
                return False
        self.inside[place.host] += 1
        self._waiting.setdefault(place.host, OrderedDict())[place] = None
        return True

    def wait(self, place: Place) -> None:
        """From now on it waits for its peer, as the last one to do so."""
        if place in self._waiting.get(place.host, ()):
            self._waiting[place.host].move_to_end(place)

    def settle(self, place: Place) -> bool:
        """From now on it is in use, if so many may be."""
        waiting = self._waiting.get(place.host, OrderedDict())
        if place not in waiting or self._crowd(place.host, self._in_use, IN_USE) is not None:
            return False
        del waiting[place]
        self._used.add(place)
        self._in_use[place.host] += 1
        return True

    def leave(self, place: Place) -> None:
        """One has gone; nothing happens where it has gone already."""
        host = place.host
        if place in self._used:
            self._used.discard(place)
            self._in_use[host] -= 1
        elif place in self._waiting.get(host, ()):
            del self._waiting[host][place]
        else:
            return
        self.inside[host] -= 1
        if not self.inside[host]:
            del self.inside[host], self._waiting[host], self._in_use[host]

    def _crowd(self, host: str, counts: Mapping[str, int], share: float) -> list[str] | None:
        """Hosts that have all that they may of a share of the places, where one more of `host` would be too much."""
        most = share * self.most
        others = [name for name in counts if not is_loopback(name)]
        if not is_loopback(host) and counts.get(host, 0) >= most // 4:
            return [host]
        if not is_loopback(host) and sum(counts[name] for name in others) >= most // 2:
            return others
        return list(counts) if sum(counts.values()) >= int(most) else None

    def _make_room(self, hosts: Sequence[str]) -> bool:
        """End the connection that waits for longest, of the host that has most; False: none waits."""
        crowd = [host for host in hosts if self._waiting.get(host)]
        if not crowd:
            return False
        host = max(crowd, key=lambda name: self.inside[name])
        place = next(iter(self._waiting[host]))
        self.leave(place)
        place.end()
        return True


def allowed() -> int:
    """Connections that the process may have open; where it may have few files, it takes the leave that it can get."""
    try:
        import resource
    except ImportError:  # Windows
        return MOST
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= soft < MOST + SPARE_FILES:  # 1024 as a rule: two recorders of twenty boats have more topics
        soft = MOST + SPARE_FILES if hard < 0 else min(hard, MOST + SPARE_FILES)
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return min(MOST, max(soft - SPARE_FILES, 16)) if soft >= 0 else MOST
