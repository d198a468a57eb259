import os
import threading
from collections import Counter
from types import SimpleNamespace

import psutil
import pytest

from vrx_mj.runtime import limits


@pytest.mark.parametrize(
    ("share", "environment", "count"),
    [
        (8.0, {}, 8),
        (1.5, {}, 1),
        (0.4, {}, 1),
        (8.0, {"OMP_NUM_THREADS": "3"}, 3),
        (8.0, {"OMP_NUM_THREADS": "4,2"}, 4),
        (8.0, {"SLURM_CPUS_PER_TASK": "2"}, 2),
        (8.0, {"OMP_NUM_THREADS": "5", "SLURM_CPUS_PER_TASK": "2"}, 5),
        (2.0, {"OMP_NUM_THREADS": "64"}, 2),
        (8.0, {"OMP_NUM_THREADS": "all", "SLURM_CPUS_PER_TASK": "2"}, 2),
        (8.0, {"OMP_NUM_THREADS": "0"}, 8),
    ],
)
def test_threads_obey_the_environment_and_the_container(monkeypatch, share, environment, count):
    monkeypatch.setattr(limits, "core_share", lambda: (8, share))
    for name in ("OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert limits.thread_count() == count


def files(root, **texts):
    for name, text in texts.items():
        path = root / name.replace("__", "/").replace("_dot_", ".")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="ascii")
    return root


def test_limits_of_containers(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=2_000_000, total=9_000_000))
    group = "sys__fs__cgroup__"
    assert limits.free_memory(tmp_path) == 2e6
    assert limits.total_memory(tmp_path) == 9e6
    assert limits.core_share(tmp_path) == (8, 8.0)
    new = files(
        tmp_path / "2",
        **{f"{group}memory_dot_max": "900\n", f"{group}memory_dot_current": "400\n",
           f"{group}cpu_dot_max": "150000 100000\n"},
    )  # fmt: skip
    assert (limits.free_memory(new), limits.core_share(new)) == (500.0, (8, 1.5))
    assert limits.total_memory(new) == 900.0
    free = files(tmp_path / "3", **{f"{group}memory_dot_max": "max\n", f"{group}cpu_dot_max": "max 100000\n"})
    assert (limits.free_memory(free), limits.core_share(free)) == (2e6, (8, 8.0))
    assert limits.total_memory(free) == 9e6
    old = files(tmp_path / "1", **{
        f"{group}memory__memory_dot_limit_in_bytes": "900", f"{group}memory__memory_dot_usage_in_bytes": "100",
        f"{group}cpu__cpu_dot_cfs_quota_us": "200000", f"{group}cpu__cpu_dot_cfs_period_us": "100000",
    })  # fmt: skip
    assert (limits.free_memory(old), limits.core_share(old)) == (800.0, (8, 2.0))
    assert limits.total_memory(old) == 900.0


def test_three_long_rows_use_two_threads_all_the_time():
    """Every call waits for another one beside it, which a thread that is left alone never gets."""
    beside, seen = threading.Barrier(2), []
    pool = limits.ThreadPool(2)
    turns = pool.turns(3, 0.033)

    def work(first, last):
        beside.wait(timeout=10.0)
        seen.append((first, last))

    pool.share(3, work, 0.033 / turns, turns)
    assert turns == 8
    assert Counter(seen) == dict.fromkeys([(0, 1), (1, 2), (2, 3)], turns)


@pytest.mark.parametrize(
    ("seconds", "sizes"), [(0.0, {8}), (1e-5, {8}), (4e-4, {4}), (1.0, {4})], ids=["unknown", "short", "longer", "long"]
)
def test_pieces_of_short_rows_have_more_of_them(seconds, sizes):
    seen = []
    limits.ThreadPool(2).share(32, lambda first, last: seen.append((first, last)), seconds)
    assert {last - first for first, last in seen} == sizes
    assert sorted(row for first, last in seen for row in range(first, last)) == list(range(32))
