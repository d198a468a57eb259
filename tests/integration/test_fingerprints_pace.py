"""When a served world steps and for how long it waits, at several paces and with stalls: the times of before."""

import pytest

from fingerprints import check
from unit.ros.test_serve_loop import World, played
from vrx_mj.ros.serve import ServeOptions

SETTINGS = {
    "half speed": (0.5, 100.0, 0.0), "half speed, fast clock": (0.5, 1000.0, 0.0), "real time": (1.0, 100.0, 0.0),
    "slow clock": (1.0, 20.0, 0.0), "fast clock": (1.0, 1000.0, 0.0), "eight times": (8.0, 100.0, 0.0),
    "too slow": (1.0, 100.0, 0.012), "nearly too slow": (1.0, 100.0, 0.0095), "thirty times": (30.0, 100.0, 5e-4),
}  # fmt: skip
"""Simulated seconds per second, ticks of the clock per simulated second, and what a tick takes [s]."""


@pytest.mark.parametrize("name", SETTINGS)
def test_steps_and_waits_come_when_they_did(monkeypatch, name):
    rate, clock_rate, cost = SETTINGS[name]
    world = World(cost=cost, stalls={40: 0.15, 80: 0.35, 120: 1.6})
    lines = played(monkeypatch, world, ServeOptions(rate=rate, clock_rate=clock_rate, duration=3.0))
    check("pace", name, waits=world.waits, ticks=world.ticks, lines=[str(line) for line in lines])
