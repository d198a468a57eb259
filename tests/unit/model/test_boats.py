"""Thrusters of a compiled world: the unit of a command and its limits."""

import pytest

from trees import partial
from vrx_mj.model import boats
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import GLF, LINEAR, NEWTONS


@pytest.mark.parametrize("strongest", [1.0, 8.0, 2353.5])
def test_commands_in_newtons_are_limited_by_the_forces_however_weak(strongest):
    row = {"mapping": NEWTONS, "max_command": strongest, "max_forward": strongest, "max_reverse": -0.5}
    thruster = partial(row, Thruster)
    assert (thruster.in_newtons, thruster.command_limits) == (True, (-0.5, strongest))


@pytest.mark.parametrize("mapping", [LINEAR, GLF])
@pytest.mark.parametrize("largest", [1.0, 2.0])
def test_other_commands_are_shares_of_full_power(mapping, largest):
    row = {"mapping": mapping, "max_command": largest, "max_forward": 250.0, "max_reverse": -100.0}
    thruster = partial(row, Thruster)
    assert (thruster.in_newtons, thruster.command_limits) == (False, (-largest, largest))


def test_the_code_of_newtons_is_that_of_the_kernels():
    assert boats.NEWTONS == NEWTONS
