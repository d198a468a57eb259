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
