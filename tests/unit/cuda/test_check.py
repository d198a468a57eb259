"""What `python -m vrx_mj.cuda.check` prints of made-up rows, environments and a clock: each verdict, good and bad."""

import contextlib
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from unit.cuda.standalone import load

DRIFT = 2.0**-40
"""How far a step takes rows of the card from the CPU's; sums of it are exact."""


class Card:
    """A graphics processor, its clock [s], and the one fault that it may have."""

    def __init__(self):
        self.fault, self.now, self.rows_time, self.captured, self.made = "", 0.0, 2.0**-30, None, 0
        self.checked = []

    def rows(self, world, n, *, seed, engine=None, stream=None):
        self.now += 0.5
        self.made += 1
        return Rows(self, world, np.broadcast_to(seed, n), DRIFT if engine is None else 0.0, stream)

    @contextlib.contextmanager
    def graph(self, graph, stream):
        self.captured = graph.launches = []
        yield
        self.captured = None


class Rows:
    """Rows of either processor: each moves by its commands."""

    timestep, channels, n = 0.05, ("port", "starboard"), property(lambda self: len(self.own))

    def __init__(self, card, world, seeds, drift, stream):
        assert stream in {None, "stream"}
        self.card, self.number, self.own = card, card.made, np.repeat(np.array(seeds)[:, None] * 1.0, 3, axis=1)
        self.drift = drift * 1.5 if card.fault == "numbers" and len(seeds) > 4 else drift
        self.drift *= 1.0 + self.number if card.fault == "again" and len(seeds) > 4 else 1.0
        agree = card.fault != "threads"
        self._rows = SimpleNamespace(
            threads=8 if world.get("physics", {}).get("profile") == "marine" else 1, threads_agree=lambda: agree
        )

    def host(self):
        assert self.drift, "these are on the host"
        return SimpleNamespace(qpos=self.own)

    @property
    def qpos(self):
        assert not self.drift, "these are on the card"
        return self.own

    def command(self, values):
        assert values.shape == (len(self.own), len(self.channels))
        self.commands = np.round(1024.0 * values.sum(axis=1, keepdims=True)) / 1024.0

    def advance(self, steps):
        self.own += steps * (self.commands + self.drift)
        self.card.now += len(self.own) * steps * self.card.rows_time

    def step(self, actions, duration):
        def launch():
            self.command(np.asarray(actions))
            self.advance(round(duration / self.timestep))

        launch() if self.card.captured is None else self.card.captured.append(launch)

    def vary(self, *, wave_period):
        assert wave_period.shape == (len(self.own),)
        self.card.varied = wave_period

    def reset(self, *, seed):
        assert seed == 7

    def check(self):
        self.card.checked.append(len(self.own))

    def observe(self):
        """Nothing is looked at here."""


class Array(np.ndarray):
    """An array of the card, or a tensor."""

    def cpu(self):
        return np.asarray(self).view(Array)

    cuda = numpy = cpu

    def tanh(self):
        return np.tanh(self)


class Environments:
    """Environments of either processor, whose observations are sums of the actions."""

    single_action_space = SimpleNamespace(shape=(4,))

    def __init__(self, card, n, device):
        self.card, self.n, self.device, self.steps = card, n, device, 0

    def reset(self, seed):
        self.seen = np.full((self.n, 5), seed, np.float32)
        return self.seen.view(Array), {}

    def step(self, actions):
        self.steps += 1
        self.card.now += 8.0 * self.n * self.card.rows_time
        self.seen = self.seen + np.asarray(actions).sum(axis=1, keepdims=True)
        wrong = self.card.fault == "environments" and self.device and self.steps == 1
        return (self.seen + np.float32(2.0**-18 if wrong else 0.0)).view(Array), 0.0, False, False, {}


class Graph:
    def __init__(self, card):
        self.card = card

    def replay(self):
        for launch in self.launches:
            launch()
        if self.card.fault == "graph":
            self.launches = []


@pytest.fixture
def card(monkeypatch):
    card = Card()

    def make_vec(id, num_envs, waves, wind_speed, engine=None, device=None):  # noqa: A002  (as Gymnasium has it)
        assert (id, waves, wind_speed) == ("vrx_mj.rl:vrx_mj/StationKeeping-v0", (0, 1), (0, 6))
        assert (engine, device) in {("free", None), (None, "cuda")}
        card.now += 0.5
        return Environments(card, num_envs, device)

    on_card = SimpleNamespace(
        Stream=lambda: SimpleNamespace(cuda_stream="stream", synchronize=int), stream=contextlib.nullcontext,
        CUDAGraph=lambda: Graph(card), graph=card.graph, synchronize=int,
    )  # fmt: skip
    full = lambda shape, value, device: np.full(shape, value).view(Array)  # noqa: E731
    torch = SimpleNamespace(
        from_dlpack=lambda array: array, from_numpy=lambda array: array.view(Array), full=full, cuda=on_card
    )
    monkeypatch.setitem(sys.modules, "torch", torch)
    monkeypatch.setitem(sys.modules, "gymnasium", SimpleNamespace(make_vec=make_vec))
    return card


@pytest.fixture
def check(monkeypatch, card):
    """The module, which needs no numba-cuda then."""
    device = SimpleNamespace(name="a card")
    cuda = SimpleNamespace(get_current_device=lambda: device, synchronize=int)
    rows = SimpleNamespace(Batch=Rows, check_driver=str)
    module = load(monkeypatch, "check", cuda, {"vrx_mj.cuda.batch": rows})
    module.compile_world = lambda world, fleet: world
    module.time = SimpleNamespace(perf_counter=lambda: card.now)
    module.Batch, module.batch = card.rows, SimpleNamespace(Batch=card.rows)
    return module


def printed(check, capsys, **extent):
    """The exit status, and lines before and among the verdicts."""
    status = check.main(check.Extent(**{"more": 6, "divisor": 64, "launches": 3, "episode": 4, **extent}))
    lines = capsys.readouterr().out.splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith("verdicts"))
    return status, lines[: first + 1], [line.removeprefix("a card: ") for line in lines[first + 1 :]]


def test_all_that_is_printed(check, card, capsys):
    status, lines, verdicts = printed(check, capsys)
    assert status == 0
    assert card.checked == [16, 4096, 16, 4096, 1024, 16, 512]
    assert (card.varied.min(), card.varied.max()) == (0.9, 1.1)
    assert lines[:20] == [
        "a card", "vrx, 5 waves:",
        "  vrx, 5 waves, 10 s: 1.8e-10 from the CPU's, within 1e-09: yes",
        "  vrx, 5 waves, 60 s: 1.1e-09 from the CPU's, within 1e-06: yes",
        "  vrx, 5 waves: the same bits from run to run, and in 4 and 6 rows: yes",
        "  16 rows made and compiled in 0.5 s",
        "  vrx, 5 waves, 16 rows, 10 steps a launch, boat steps: 1073.7 million a second",
        "  4096 rows made and compiled in 0.5 s",
        "  vrx, 5 waves, 4096 rows, 10 steps a launch, boat steps: 1073.7 million a second",
        "StationKeeping, 3 waves of each row's own:",
        "  environments, 4 steps: 0.0e+00 from the CPU's, within 1e-06: yes",
        "  4096 environments made and reset in 0.5 s",
        "  StationKeeping, 4096 environments with tensors, steps: 134.2 million a second",
        "  the same bits from a CUDA graph: yes",
        "vrx, 60 waves:", *(line.replace("5 waves", "60 waves") for line in lines[2:7]),
    ]  # fmt: skip
    assert lines[-1] == "verdicts, after 12 s:"  # 24 of rows and environments that were made
    assert [line for line in verdicts if "wanted" not in line] == [
        line.strip() for line in lines if line.endswith(": yes")
    ]
    rate = ", 10 steps a launch, boat steps: 1073.7 million a second, wanted"
    assert [line for line in verdicts if "wanted" in line] == [
        f"vrx, 5 waves, 4096 rows{rate} 1000: met",
        "StationKeeping, 4096 environments with tensors, steps: 134.2 million a second, wanted 100: met",
        f"vrx, 60 waves, 4096 rows{rate} 400: met",
        f"vrx, 60 waves of each row's own, 1024 rows{rate} 317: met",
        f"marine, 60 waves, 512 rows{rate} 20: met",
    ]
    assert len(verdicts) == 17


BITS = [f"{world} waves: the same bits from run to run, and in 4 and 6 rows: NO"
        for world in ("vrx, 5", "vrx, 60", "marine, 60")]  # fmt: skip
GRAPH = "the same bits from a CUDA graph: NO"


@pytest.mark.parametrize(
    ("fault", "bad"),
    [
        ("numbers", BITS),
        ("again", [BITS[0], GRAPH, *BITS[1:]]),
        ("threads", ["marine, 60 waves: the same bits from the 8 threads of a row: NO"]),
        ("environments", ["environments, 4 steps: 3.8e-06 from the CPU's, within 1e-06: NO"]),
        ("graph", [GRAPH]),
    ],
)
def test_each_fault_is_a_verdict_and_the_exit_status(fault, bad, check, card, capsys):
    card.fault = fault
    status, lines, verdicts = printed(check, capsys)
    assert status == 1
    assert [line for line in verdicts if line.endswith("NO")] == bad
    assert [line.strip() for line in lines if line.endswith("NO")] == bad


@pytest.mark.parametrize(("steps", "verdict"), [(20, "yes"), (19.999, "NO")])
def test_a_bound_holds_up_to_its_end(steps, verdict, check, capsys):
    status, _, verdicts = printed(check, capsys, seconds={1: steps * DRIFT, 2: 1.0})
    assert verdicts[:2] == [
        f"vrx, 5 waves, 1 s: 1.8e-11 from the CPU's, within 2e-11: {verdict}",
        "vrx, 5 waves, 2 s: 3.6e-11 from the CPU's, within 1e+00: yes",
    ]
    assert status == (verdict == "NO")


def test_a_slow_card_is_no_fault(check, card, capsys):
    card.rows_time = 2.0**-28
    status, _, verdicts = printed(check, capsys, divisor=2048)
    assert status == 0
    assert [line.partition(", wanted ")[2] for line in verdicts if "wanted" in line] == [
        "1000: NOT MET", "100: NOT MET", "400: NOT MET", "317: NOT MET", "20: met",
    ]  # fmt: skip


@pytest.mark.parametrize("missing", ["torch", "gymnasium"])
def test_what_is_not_installed_is_left_out(missing, check, capsys, monkeypatch):
    """A graph needs PyTorch alone, and is compared without Gymnasium."""
    monkeypatch.setitem(sys.modules, missing, None)
    status, lines, verdicts = printed(check, capsys, divisor=2048)
    assert status == 0
    assert "environments are left out: Gymnasium or PyTorch is not installed" in lines
    assert "  1 rows made and compiled in 0.5 s" in lines
    assert not any("environments" in line for line in verdicts)
    without_torch = "a CUDA graph is left out: PyTorch is not installed" in lines
    assert ("the same bits from a CUDA graph: yes" in verdicts) == (not without_torch) == (missing == "gymnasium")
