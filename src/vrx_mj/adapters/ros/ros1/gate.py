"""How many connections there may be, in all and per host."""

import contextlib
from collections import Counter

__all__ = ["Gate"]

MOST = 4096
SPARE_FILES = 200
"""Open files that are left to everything else."""


class Gate:
    """Counts those who are in."""

    def __init__(self, most: int | None = None) -> None:
        self.most = allowed() if most is None else most
        self.inside: Counter[str] = Counter()

    def enter(self, host: str) -> bool:
        """Let one more of a host in, or not. Hosts other than this one share half of the places, a quarter each."""
        total = self.inside.total()
        away = total - sum(count for name, count in self.inside.items() if is_loopback(name))
        crowded = not is_loopback(host) and (self.inside[host] >= self.most // 4 or away >= self.most // 2)
        if total >= self.most or crowded:
            return False
        self.inside[host] += 1
        return True

    def leave(self, host: str) -> None:
        """One of a host that was let in has gone."""
        self.inside[host] -= 1
        if not self.inside[host]:
            del self.inside[host]


def is_loopback(host: str) -> bool:
    """Whether an address is this machine's own, `127.0.0.1` or `::1`."""
    return host.startswith(("127.", "::ffff:127.")) or host == "::1"


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
