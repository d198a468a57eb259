"""Which command gives a force: the mapping of a thruster backwards."""

from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.model.tables import THRUSTER
from vrx_mj.physics.tables import GLF, LINEAR, NEWTONS, RUDDER
from vrx_mj.physics.thrust import thrust_force
from vrx_mj.runtime.hull import thrusters

DRIVES = {
    "linear": (LINEAR, 1.0, 250.0, -100.0), "slow": (LINEAR, 0.5, 250.0, -100.0), "fast": (LINEAR, 3.0, 250.0, 0.0),
    "glf": (GLF, 1.0, 250.0, -100.0), "newtons": (NEWTONS, 2e3, 2e3, -1e3),
}  # fmt: skip


def row(mapping, max_command, forward, reverse):
    table = np.zeros(1, THRUSTER)
    table["mapping"], table["max_command"], table["max_forward"], table["max_reverse"] = (
        mapping, max_command, forward, reverse
    )  # fmt: skip
    table["rotation"], table["direction"], table["max_angle"] = np.eye(3), (1.0, 0.0, 0.0), 1.5
    table["measured"] = -1
    return table


def thruster(name):
    table = row(*DRIVES[name])
    return thrusters(SimpleNamespace(thrusters=table), {"left": 0})["left"], table[0]


@pytest.mark.parametrize("name", DRIVES)
def test_no_force_is_no_command_exactly(name):
    assert thruster(name)[0].command(0.0) == 0.0


@pytest.mark.parametrize("name", DRIVES)
def test_a_command_gives_the_force_that_it_was_asked_for(name):
    found, own = thruster(name)
    assert found.max_forward == thrust_force(own, found.max_command)
    assert found.max_reverse == thrust_force(own, -found.max_command)
    slack = 0.02 * found.max_forward if name == "glf" else 1e-12  # of the table's 400 pieces, and of rounding
    for force in np.linspace(found.max_reverse, found.max_forward, 41):
        assert thrust_force(own, found.command(float(force))) == pytest.approx(force, abs=slack)


@pytest.mark.parametrize("name", DRIVES)
def test_beyond_what_it_can_give_the_command_gives_the_most(name):
    found, own = thruster(name)
    for far, most in ((1e6, found.max_forward), (-1e6, found.max_reverse)):
        assert thrust_force(own, found.command(far)) == most


def test_it_pushes_where_and_whither_it_is_mounted():
    table = row(*DRIVES["linear"])
    table["position"], table["propeller"] = (-2.0, 1.0, 0.1), (0.3, 0.0, -0.5)
    table["rotation"] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # engine ahead is hull to port
    found = thrusters(SimpleNamespace(thrusters=table), {"side": 0})["side"]
    assert found.position == pytest.approx((-2.0, 1.3, -0.4))
    assert found.direction == pytest.approx((0.0, 1.0, 0.0))
    assert found.max_angle == 1.5


def test_rudders_push_nothing():
    table = row(RUDDER, 1.0, 0.0, 0.0)
    assert thrusters(SimpleNamespace(thrusters=table), {"rudder": 0}) == {}
