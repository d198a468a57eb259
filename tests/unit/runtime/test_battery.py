"""A battery under loads that are known in closed form."""

from math import sqrt
from types import SimpleNamespace

import pytest

from vrx_mj.errors import CommandError
from vrx_mj.model.boats import Battery
from vrx_mj.runtime.battery import Charge


def run(power, duration, *, resistance=0.0, voltage=((0.0, 10.0), (1.0, 10.0)), steps=1000):
    """A battery of 2 A h after a constant power [W] for a duration [s], and its last measurement."""
    sim = SimpleNamespace(time=0.0, energy=lambda _boat: power * sim.time)
    charge = Charge(sim, "b", Battery(capacity=2.0, voltage=voltage, resistance=resistance))
    for step in range(1, steps + 1):
        sim.time = duration * step / steps
        found = charge.measure()
    return charge, found


def test_a_constant_voltage_gives_its_charge_evenly():
    charge, found = run(100.0, 360.0)
    assert found == {"voltage": 10.0, "current": pytest.approx(10.0)}
    assert charge.left == pytest.approx(0.5)


def test_resistance_lowers_the_voltage_by_the_current():
    _, found = run(80.0, 1.0, resistance=0.2)
    current = (10.0 - sqrt(100.0 - 4.0 * 0.2 * 80.0)) / (2.0 * 0.2)
    assert found["current"] == pytest.approx(current)
    assert found["voltage"] == pytest.approx(10.0 - 0.2 * current)


def test_a_voltage_that_falls_with_the_charge_makes_the_current_rise():
    """U = 5 + 5 s at a power P: (7.5 - 5 s - 2.5 s^2) C = P t, by integrating U ds = -P dt / C."""
    charge, _ = run(40.0, 360.0, voltage=((0.0, 5.0), (1.0, 10.0)), steps=20_000)
    assert (7.5 - 5.0 * charge.left - 2.5 * charge.left**2) * 2.0 * 3600.0 == pytest.approx(40.0 * 360.0, rel=1e-3)


def test_an_empty_battery_stays_empty_and_a_full_one_is_at_rest():
    charge, _ = run(100.0, 3600.0)
    assert charge.left == 0.0
    charge.restart()
    assert (charge.left, charge.measure()) == (1.0, {"voltage": 10.0, "current": 0.0})


def test_a_power_beyond_the_battery_halves_its_voltage():
    _, found = run(1000.0, 0.01, resistance=1.0)
    assert found["voltage"] == 5.0


def test_without_a_known_power_nothing_is_drawn():
    def unknown(_boat):
        raise CommandError("no energy")

    sim = SimpleNamespace(time=0.0, energy=unknown)
    charge = Charge(sim, "b", Battery(capacity=2.0, voltage=((0.0, 10.0), (1.0, 12.0)), resistance=0.1))
    sim.time = 9.0
    assert (charge.measure(), charge.left) == ({"voltage": 12.0, "current": 0.0}, 1.0)
