"""Time that keeps pace with the wall's: what a stall does to it."""

from types import SimpleNamespace

import numpy as np
import pytest

from ros_scene import Fake
from vrx_mj.ros import serve as serving
from vrx_mj.ros.serve import CATCHING_UP, MAX_LAG, ServeOptions

STEP = 0.01


class Wall:
    """A clock on the wall that goes on while somebody waits, and an inbox in which nothing arrives."""

    pending = False

    def __init__(self):
        self.now = 100.0

    def perf_counter(self):
        return self.now

    process_time = perf_counter

    def wait(self, seconds):
        self.now += seconds + 1e-5  # what comes between two waits
        return False


class Server:
    """A simulation that steps at once; stalls are by the step before which they come [s]."""

    paused = False
    lockstep = None

    def __init__(self, wall, steps, stalls, cost=0.0):
        self.sim = SimpleNamespace(timestep=STEP, time=0.0, task_is_over=False, reading_times={})
        self.ticks, self._wall, self._steps, self._stalls, self._cost = [], wall, steps, dict(stalls), cost

    def announce(self):
        """Nothing is published."""

    def receive(self):
        self._wall.now += self._stalls.pop(len(self.ticks), 0.0)

    def tick(self):
        self._wall.now += self._cost
        self.ticks.append(self._wall.now)
        self.sim.time += STEP * self._steps
        return self._steps


def ticks(monkeypatch, *, stalls=(), duration=20.0, rate=1.0, clock=100.0, cost=0.0):
    """Wall times of the ticks of a run, and what was reported."""
    wall, told = Wall(), []
    server = Server(wall, round(1.0 / (clock * STEP)), stalls, cost)
    monkeypatch.setattr(serving, "time", wall)
    loop = serving._Loop(
        server, wall, ServeOptions(rate=rate, clock_rate=clock, duration=duration), [Fake()], lambda: False
    )
    ending = SimpleNamespace(is_set=lambda: False)
    loop.run(ending, lambda _: None, lambda level, text: told.append(text) if level == "WARN" else None)
    return server.ticks, told


@pytest.mark.parametrize("clock", [100.0, 20.0])
@pytest.mark.parametrize("rate", [1.0, 2.0])
@pytest.mark.parametrize("stall", [0.02, 0.3, 1.5])
def test_lost_time_is_made_up_little_by_little(monkeypatch, stall, rate, clock):
    at, told = ticks(monkeypatch, stalls={200: stall}, rate=rate, clock=clock, duration=200 / clock + 20.0)
    period = 1.0 / (rate * clock)
    ahead = np.arange(len(at)) - CATCHING_UP * np.array(at) / period
    assert (ahead - np.minimum.accumulate(ahead)).max() <= 2.0 + CATCHING_UP * STEP / rate / period + 1e-6
    made_up = len(at) * period - (at[-1] - at[0])
    assert made_up == pytest.approx(-max(0.0, stall - MAX_LAG), abs=2.0 * period + 0.02)
    assert len(told) == (stall > 0.2)


def test_a_stall_is_reported_once(monkeypatch):
    way = "catching up at 1.2 times the pace; lag beyond 1 s is dropped"
    assert ticks(monkeypatch, stalls={200: 0.3, 1000: 0.5})[1] == [f"0.3 s behind the pace: {way}"]


def test_a_server_that_is_always_too_slow_owes_no_more_than_a_second(monkeypatch):
    wall_times, told = ticks(monkeypatch, cost=0.02, duration=10.0)
    assert wall_times[-1] - wall_times[0] == pytest.approx(0.02 * 999, rel=1e-3)
    assert len(told) == 1


@pytest.mark.parametrize("rate", [0.1, 1.0, 10.0, 50.0])
def test_without_stalls_the_pace_is_kept(monkeypatch, rate):
    at, told = ticks(monkeypatch, rate=rate, duration=20.0)
    assert (len(at) - 1) / (at[-1] - at[0]) == pytest.approx(100.0 * rate, rel=1e-2)
    assert told == []
