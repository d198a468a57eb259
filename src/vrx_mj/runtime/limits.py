"""What this process may use of its machine: the system's figures, and the container's limits where there are any."""

import os
from pathlib import Path

__all__ = ["core_share", "free_memory", "thread_count", "total_memory"]

ROOT = Path("/")
"""Where `sys/fs/cgroup` and `proc` are; Linux has them."""


def free_memory(root: Path = ROOT) -> float | None:
    """Memory [bytes] that is free for this process; None where the system does not tell."""
    group = root / "sys/fs/cgroup"
    known = [_meminfo(root / "proc/meminfo", "MemAvailable")]
    for limit, used in (
        (group / "memory.max", group / "memory.current"),
        (group / "memory/memory.limit_in_bytes", group / "memory/memory.usage_in_bytes"),
    ):
        most, now = _first(limit), _first(used)
        known.append(most - now if most is not None and now is not None else None)
    return min((free for free in known if free is not None), default=None)


def total_memory(root: Path = ROOT) -> float | None:
    """Memory [bytes] that this process may take at most, free or not; None where the system does not tell."""
    group = root / "sys/fs/cgroup"
    known = [_meminfo(root / "proc/meminfo", "MemTotal")]
    known += [_first(group / name) for name in ("memory.max", "memory/memory.limit_in_bytes")]
    return min((most for most in known if most is not None), default=None)


def core_share(root: Path = ROOT) -> tuple[int, float]:
    """Cores that this process may run on, and how many of them the container lets it use at a time."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    group = root / "sys/fs/cgroup"
    quota, period = _first(group / "cpu.max"), _first(group / "cpu.max", 1)
    if quota is None:
        quota, period = _first(group / "cpu/cpu.cfs_quota_us"), _first(group / "cpu/cpu.cfs_period_us")
    if quota is None or not period or quota <= 0:
        return count, float(count)
    return count, min(float(count), quota / period)


def thread_count() -> int:
    """How many threads to compute with: what OMP_NUM_THREADS says, or SLURM_CPUS_PER_TASK, or else the share of cores.

    Never more than the share; the first number of a list such as `4,2` counts; what is no number above 0 is ignored.
    """
    share = max(1, int(core_share()[1]))
    for name in ("OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK"):
        first = os.environ.get(name, "").partition(",")[0].strip()
        if first.isdecimal() and int(first) > 0:
            return min(share, int(first))
    return share


def _first(file: Path, index: int = 0) -> float | None:
    """A number of a file of blank-separated ones; None where there is none, as for "max"."""
    try:
        return float(file.read_text(encoding="ascii").split()[index])
    except (OSError, ValueError, IndexError):
        return None


def _meminfo(file: Path, name: str) -> float | None:
    try:
        lines = file.read_text(encoding="ascii").splitlines()
    except (OSError, ValueError):
        return None
    found = [line.split()[1] for line in lines if line.startswith(f"{name}:")]
    return 1024.0 * float(found[0]) if found else None
