"""Engines: workers of this machine, and those of a Ray cluster, by a false Ray."""

import logging
import os
import sys
from types import SimpleNamespace

import pytest

from vrx_mj.campaign import engines
from vrx_mj.campaign.engines import ProcessPool, RayCluster, _NodeWorker
from vrx_mj.campaign.manifest import code_version
from vrx_mj.campaign.plan import Cell, Trial
from vrx_mj.campaign.results import Result
from vrx_mj.campaign.worker import WorkerLostError
from vrx_mj.errors import VrxError

TRIALS = [Trial(Cell("crew:steady", "bay", seed)) for seed in range(3)]
RESULTS = [Result(trial.cell) for trial in TRIALS]


def test_workers_here_are_made_by_one_server_and_looked_after_four_times_a_second(monkeypatch, tmp_path):
    waited = []
    monkeypatch.setattr(engines, "start_server", lambda: "server")
    monkeypatch.setattr(engines, "WorkerProcess", lambda *given: given)
    monkeypatch.setattr(engines, "wait", lambda workers, timeout: waited.append((workers, timeout)) or workers[:1])
    pool = ProcessPool(3)
    assert pool.open(tmp_path) == 3
    assert pool.start() == ("server", tmp_path)
    assert pool.ready(["a", "b"]) == ["a"]
    assert waited == [(["a", "b"], 0.25)]


class Ray:
    """A false Ray, with nodes of so many processors; streams are lists of what comes."""

    class RayError(Exception):
        pass

    def __init__(self, cpus=4.0):
        self.did, self.cpus, self.listed, self.ready, self.fails = [], cpus, [], [], None
        self.exceptions = SimpleNamespace(RayError=self.RayError)
        self._private = SimpleNamespace(worker=SimpleNamespace(listen_error_messages=None))
        self.streams = []

    def init(self, address, *, runtime_env, log_to_driver, logging_level):
        if self.fails:
            raise self.fails
        self.environment = runtime_env
        self.did.append((address, log_to_driver, logging_level))

    def get_runtime_context(self):
        return SimpleNamespace(get_node_id=lambda: "here")

    def remote(self, **options):
        self.did.append(options)
        return lambda actor: SimpleNamespace(remote=lambda *given: self.make(actor, *given))

    def make(self, actor, *given):
        self.did.append((actor.__name__, *given))
        return SimpleNamespace(run=SimpleNamespace(options=self.options))

    def options(self, **options):
        return SimpleNamespace(remote=lambda chunk: self.stream(options, chunk))

    def stream(self, options, chunk):
        self.did.append((options, chunk))
        return iter(self.streams.pop(0) if self.streams else [])

    def cluster_resources(self):
        return {} if self.cpus is None else {"CPU": self.cpus}

    def wait(self, streams, timeout):
        self.did.append(timeout)
        return [stream for stream in streams if stream in self.ready], []

    def nodes(self):
        return self.listed

    def get(self, came):
        if isinstance(came, Exception):
            raise came
        return came

    def kill(self, actor):
        self.did.append("kill")

    def shutdown(self):
        self.did.append("shutdown")


@pytest.fixture
def ray(monkeypatch, tmp_path):
    false = Ray()
    monkeypatch.setitem(sys.modules, "ray", false)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "environ", {"VRX_MJ_PATH": "/boats", "HOME": "/root"})
    monkeypatch.setattr(engines.secrets, "token_hex", lambda size: "7f" * size)
    return false


def test_a_cluster_gets_the_files_of_the_folder_without_results_and_the_settings_of_vrx_mj(ray, tmp_path):
    folder = tmp_path / "results" / "one"
    folder.mkdir(parents=True)
    cluster = RayCluster("auto")
    assert cluster.open(folder) == 4
    ray._private.worker.listen_error_messages("a node died")  # is not printed
    assert ray.environment == {
        "working_dir": str(tmp_path),
        "excludes": ["*.rrd", ".git", ".venv", "__pycache__", "*.pyc", "/results/one/"],
        "env_vars": {"VRX_MJ_PATH": "/boats"},
    }
    assert ray.did == [("auto", False, logging.ERROR), {"num_cpus": 1, "scheduling_strategy": "SPREAD"}]
    assert (folder / ".cluster").read_text(encoding="utf-8") == "7f" * 8
    worker = cluster.start()
    given = {"num_returns": "streaming", "_generator_backpressure_num_objects": 16}
    assert ray.did[2:] == [("_NodeWorker", folder, "7f" * 8, code_version()), (given, [])]
    worker.submit((TRIALS[0],))
    worker.close()
    worker.join()
    cluster.close()
    assert ray.did[4:] == [(given, [TRIALS[0]]), "kill", "shutdown"]
    assert not (folder / ".cluster").exists()


@pytest.mark.parametrize(("jobs", "cpus", "workers"), [(None, 2.0, 2), (3, 2.0, 3), (None, 0.0, 1), (None, None, 1)])
def test_a_cluster_has_a_worker_for_each_processor_unless_a_number_is_given(ray, tmp_path, jobs, cpus, workers):
    ray.cpus = cpus
    assert RayCluster(jobs=jobs).open(tmp_path) == workers
    assert ray.did[0][0] is None


def test_a_folder_that_is_elsewhere_is_not_left_out(ray, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    RayCluster().open(tmp_path)
    assert ray.environment["excludes"][-1] == "*.pyc"


def test_a_cluster_that_cannot_be_used_says_how(ray, tmp_path, monkeypatch):
    for ray.fails in (ConnectionError("no head"), RuntimeError("no head"), ValueError("no head"), OSError("no head")):
        monkeypatch.delitem(os.environ, "RAY_AUTH_MODE", raising=False)
        with pytest.raises(VrxError) as caught:
            RayCluster().open(tmp_path)
        words = "cannot use a Ray cluster: no head"
        assert str(caught.value) == f"{words}; for one with a token set RAY_AUTH_MODE=token"
        monkeypatch.setitem(os.environ, "RAY_AUTH_MODE", "token")
        with pytest.raises(VrxError) as caught:
            RayCluster().open(tmp_path)
        assert str(caught.value) == words
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(VrxError, match=r"^--ray needs Ray"):
        RayCluster().open(tmp_path)


def test_a_cluster_is_left_if_the_folder_cannot_be_written_to(ray, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(VrxError, match="file"):
        RayCluster().open(tmp_path / "file")
    assert ray.did[-1] == "shutdown"


def test_workers_that_have_something_are_found_until_ray_ends_here(ray, tmp_path):
    cluster = RayCluster()
    cluster.open(tmp_path)
    first, second = workers = [cluster.start(), cluster.start()]
    ray.ready = [second.stream]
    assert cluster.ready(workers) == [second]
    assert ray.did[-1] == 0.25
    ray.ready, ray.listed = [], [{"NodeID": "there", "Alive": False}, {"NodeID": "here", "Alive": True}]
    assert cluster.ready(workers) == []
    ray.listed[1]["Alive"] = False
    with pytest.raises(VrxError, match=r"^Ray has stopped on this machine: start it again"):
        cluster.ready(workers)
    ray.ready = [first.stream]
    assert cluster.ready(workers) == [first]


def test_a_worker_of_a_cluster_gives_results_or_says_why_not(ray, tmp_path):
    caused = Ray.RayError("a node")
    caused.cause = VrxError("the node does not have it")
    ray.streams = [[RESULTS[0], caused], [Ray.RayError("\n gone \nfar"), Ray.RayError("No module named 'vrx_mj.rl'")]]
    cluster = RayCluster()
    cluster.open(tmp_path)
    first, second = cluster.start(), cluster.start()
    assert first.take() == RESULTS[0]
    with pytest.raises(VrxError, match=r"^the node does not have it$"):
        first.take()
    assert first.take() is None
    with pytest.raises(WorkerLostError, match=r"^Ray lost its worker: gone $"):
        second.take()
    with pytest.raises(VrxError, match=rf"^a node of the Ray cluster has no vrx_mj {code_version()}: install it there"):
        second.take()


def test_a_node_makes_its_worker_at_the_first_call_if_it_has_the_folder_and_the_code(monkeypatch, tmp_path):
    class Process:
        def __init__(self, context, root):
            assert (context, root) == ("server", tmp_path)
            made.append(self)
            self.came = [None]

        def submit(self, chunk):
            self.came = [*(RESULTS[trial.cell.seed] for trial in chunk), None]

        def take(self):
            return self.came.pop(0)

    made = []
    monkeypatch.setattr(engines, "start_server", lambda: "server")
    monkeypatch.setattr(engines, "WorkerProcess", Process)
    monkeypatch.setattr(engines.platform, "node", lambda: "n1")
    node = _NodeWorker(tmp_path, "7f", code_version())
    shared = rf"^the node n1 does not have the folder '{tmp_path}': -o needs one that all nodes share$"
    with pytest.raises(VrxError, match=shared):
        list(node.run([]))
    (tmp_path / ".cluster").write_text("80", encoding="utf-8")
    with pytest.raises(VrxError, match=shared):
        list(node.run([]))
    (tmp_path / ".cluster").write_text("7f", encoding="utf-8")
    assert list(node.run([])) == []
    assert list(node.run(TRIALS[:2])) == RESULTS[:2]
    assert list(node.run(TRIALS[2:])) == RESULTS[2:]
    assert len(made) == 1
    with pytest.raises(VrxError, match=rf"^the node n1 has vrx_mj {code_version()}: install 0 there, as here$"):
        list(_NodeWorker(tmp_path, "7f", "0").run([]))
