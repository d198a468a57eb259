"""Campaigns on real Ray clusters of this machine: they give what this machine gives, whatever dies meanwhile."""

import contextlib
import dataclasses
import os
import signal
import sqlite3
import sys
import time

import psutil
import pytest

from needs import RAY, needs
from vrx_command import start, vrx
from vrx_mj.campaign import engines
from vrx_mj.campaign.engines import ProcessPool, RayCluster, run_trials
from vrx_mj.campaign.plan import Cell, Trial
from vrx_mj.campaign.results import LOG, read_sketches
from vrx_mj.errors import VrxError
from vrx_mj.packages import needs_extra

WORLD = """
extends: ocean
task: {type: stationkeeping, goal_cart: [8, 0, 0], initial_state_duration: 0.5, ready_state_duration: 0.5,
       running_state_duration: 2}
"""
CREW = """
import os, time

def steady(obs, t):
    print("steady as she goes")
    return {"wamv": {"left": 0.5, "right": 0.4}}

def slow(obs, t):
    time.sleep(0.05)
    return steady(obs, t)

def leaves(obs, t):
    os._exit(3)
"""


def on_ray(test):
    """Mark a test that runs on Ray."""
    for mark in (needs(RAY), pytest.mark.slow, pytest.mark.nightly, pytest.mark.filterwarnings("ignore")):  # Ray's own
        test = mark(test)
    return test


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bay.yaml").write_text(WORLD, encoding="utf-8")
    (tmp_path / "crew.py").write_text(CREW, encoding="utf-8")
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
    return tmp_path


@pytest.fixture
def cluster():
    """Two nodes of one processor each."""
    nodes = pytest.importorskip("ray.cluster_utils").Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    nodes.add_node(num_cpus=1)
    yield nodes
    nodes.shutdown()


def lasting(result):
    return dataclasses.replace(result, wall_time=0.0)


def trials_of(controller, count):
    return [Trial(Cell(f"crew:{controller}", "bay.yaml", seed)) for seed in range(count)]


@on_ray
class TestOnRay:
    def test_a_cluster_gives_what_this_machine_gives(self, folder):
        trials = [*trials_of("steady", 2), *trials_of("leaves", 1)]
        there = {result.cell: result for result in run_trials(trials, folder / "there", RayCluster(jobs=2))}
        here = {result.cell: result for result in run_trials(trials, folder / "here", ProcessPool(2))}
        assert {cell: lasting(result) for cell, result in there.items()} == {
            cell: lasting(result) for cell, result in here.items()
        }
        first, last = trials[0].cell, trials[-1].cell
        assert there[first].score is not None
        assert (there[last].state, "exit code 3" in there[last].error) == ("failed", True)
        assert read_sketches(folder / "there", ["bay.yaml"]) == read_sketches(folder / "here", ["bay.yaml"])
        assert "steady as she goes" in (folder / "there" / first.folder / LOG).read_text(encoding="utf-8")

    def test_a_killed_worker_and_a_killed_node_lose_no_trial(self, folder, cluster, capfd):
        trials, ended = trials_of("slow", 12), []
        for result in run_trials(trials, folder / "there", RayCluster(cluster.address, jobs=2)):
            ended.append(result)
            if len(ended) == 2:
                cluster.remove_node(cluster.list_all_nodes()[-1], allow_graceful=False)
            if len(ended) == 5:
                next(one for one in psutil.process_iter() if is_worker(one)).kill()
        assert "raylet" not in "".join(capfd.readouterr())
        here = run_trials(trials, folder / "here", ProcessPool(2))
        assert sorted(map(lasting, ended), key=lambda one: one.cell) == sorted(
            map(lasting, here), key=lambda one: one.cell
        )

    def test_a_ray_that_ends_on_this_machine_ends_the_campaign(self, folder, cluster, capfd):
        sailed = run_trials(trials_of("slow", 12), folder / "there", RayCluster(cluster.address, jobs=2))
        next(sailed)
        cluster.head_node.kill_raylet()
        with pytest.raises(VrxError, match="Ray has stopped on this machine: start it again, and run the same"):
            list(sailed)
        assert "raylet" not in "".join(capfd.readouterr())

    def test_a_killed_coordinator_is_resumed(self, folder, cluster):
        words = ("campaign", "crew:slow", "--worlds", "bay.yaml", "--seeds", "0..5", "-o", "there", "--ray")
        words = (*words, cluster.address)
        (folder / "there").rmdir()
        process = start(*words, cwd=folder)
        deadline = time.monotonic() + 300.0
        while len(rows(folder / "there")) < 2:
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
        process.wait()
        before = rows(folder / "there")
        code, out, err = vrx(*words, cwd=folder)
        after = rows(folder / "there")
        assert (code, len(after)) == (0, 6), err
        assert {row[0] for row in after.values()} == {"finished"}
        assert {seed: after[seed] for seed in before} == before
        assert "6 of 6 trials finished, 0 failed" in out

    @pytest.mark.parametrize(
        ("name", "value", "message"),
        [
            ("code_version", lambda: "0.0.9 abc", r"the node \S+ has vrx_mj 0\.1\.0 \w+: install 0\.0\.9 abc there"),
            (
                "_CAMPAIGN_FILE",
                "../elsewhere",
                r"the node \S+ does not have the folder '.*there': -o needs one that all",
            ),
        ],
    )
    def test_a_node_that_differs_is_refused_by_name(self, folder, monkeypatch, name, value, message):
        monkeypatch.setattr(engines, name, value)
        if name == "_CAMPAIGN_FILE":
            monkeypatch.setattr(engines, "write_files", lambda *_: None)
        with pytest.raises(VrxError, match=message):
            list(run_trials(trials_of("steady", 1), folder / "there", RayCluster(jobs=1)))


def is_worker(process):
    """Whether a process is an actor of this test's cluster."""
    with contextlib.suppress(psutil.Error):
        return "ray::_NodeWorker" in " ".join(process.cmdline()) and os.getpid() in {p.pid for p in process.parents()}
    return False


def rows(folder):
    """State and fingerprint by seed, as far as the database is there."""
    try:
        with contextlib.closing(sqlite3.connect(f"file:{folder / 'results.sqlite'}?mode=ro", uri=True)) as base:
            found = base.execute("select seed, state, state_sha256 from trials").fetchall()
    except sqlite3.OperationalError:
        return {}
    return {seed: own for seed, *own in found}


def test_without_ray_it_says_what_to_install(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(VrxError) as raised:
        next(run_trials(trials_of("steady", 1), folder / "there", RayCluster()))
    assert str(raised.value) == needs_extra("--ray", "Ray", "ray")
