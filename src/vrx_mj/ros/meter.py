"""What serving costs, and the pace that is really kept: the line of status."""

import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from vrx_mj.ros.offer import Transport
from vrx_mj.ros.ros_server import RosServer

__all__ = ["Meter", "memory"]

KB, MB = 1e3, 1e6


class Meter:
    """Differences since the last line."""

    def __init__(self, station: RosServer, transports: Sequence[Transport], now: float) -> None:
        self._station, self._transports = station, transports
        self._begun = self._then = now, station.sim.time, time.process_time(), 0
        self._stepped = self._last = 0.0
        self._read: dict[tuple[str, str], float] = {}
        self._latest = station.sim.time
        self.pace = 0.0
        """Simulated seconds per second since the line before."""
        self.load: Mapping[tuple[str, str], float] = {}
        """Share of wall time that each sensor took since the line before."""

    def line(self) -> str:
        """Measure, and tell."""
        now, moment, cpu, sent = self._now()
        wall = max(now - self._then[0], 1e-9)
        self.pace = max(0.0, moment - self._then[1]) / wall
        self._stepped += max(0.0, moment - self._then[1])
        spent = dict(self._station.sim.reading_times)
        self.load = {
            key: (total - self._read.get(key, 0.0)) / wall
            for key, total in spent.items()
            if total > self._read.get(key, 0.0)
        }
        parts = [
            f"t {moment:.1f} s",
            "paused" if self._station.paused else f"pace {self.pace:.2f}",
            f"CPU {100.0 * (cpu - self._then[2]) / wall:.0f} %",
            f"{memory() / MB:.0f} MB",
            f"{(sent - self._then[3]) / wall / KB:.0f} KB/s to {self._clients()} clients",
        ]
        dropped = sum(transport.traffic.dropped for transport in self._transports)
        if dropped:
            parts.append(f"{dropped} messages dropped")
        if self.load:
            (boat, sensor), share = max(self.load.items(), key=lambda item: item[1])
            parts.append(f"dearest: {sensor} of {boat}, {100.0 * share:.0f} %")
        if self._station.lockstep is not None and self._station.lockstep.missing:
            first, *others = self._station.lockstep.missing
            parts.append(f"waits for {first}{f' and {len(others)} more' if others else ''}")
        self._then, self._read = (now, moment, cpu, sent), spent
        return "  ".join(parts)

    def summary(self) -> str:
        """The whole run."""
        now, moment, cpu, sent = self._now()
        wall = max(now - self._begun[0], 1e-9)
        stepped = self._stepped + max(0.0, moment - self._then[1])
        return (
            f"served {stepped:.1f} s in {wall:.1f} s: pace {stepped / wall:.3f}, CPU "
            f"{100.0 * (cpu - self._begun[2]) / wall:.0f} %, {memory() / MB:.0f} MB, {sent / MB:.1f} MB sent"
        )

    def _now(self) -> tuple[float, float, float, int]:
        sent = sum(transport.traffic.sent for transport in self._transports)
        return time.perf_counter(), self._station.sim.time, time.process_time(), sent

    def _clients(self) -> int:
        return sum(transport.traffic.clients for transport in self._transports)


def memory() -> float:
    """Resident memory of this process [bytes]; where the system does not tell of now, the most that it was."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return float(pages * os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError, IndexError):
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0
