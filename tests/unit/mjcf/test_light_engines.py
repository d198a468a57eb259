"""Engines of which a URDF does not say how hard they are to turn."""

import pytest

from urdf_boats import assemble, joint, link, thruster
from vrx_mj.mjcf.robots import LIGHTEST, thruster_rows

WEIGHTLESS_TURN = '<inertial><mass value="1"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
@pytest.mark.parametrize("inertial", ["", WEIGHTLESS_TURN], ids=["no mass", "no inertia"])
def test_an_engine_that_a_urdf_gives_no_inertia_has_a_servo_that_turns_it(engines, inertial):
    """Its hinge is 2 m aft of a hull whose centre of mass is elsewhere: forces act where the hinge is."""
    stern = f'<link name="stern">{inertial}</link>'
    hull = link("base_link", mass=100).replace("<inertial>", '<inertial><origin xyz="0.5 0 0.4"/>')
    tiller = joint("tiller", "stern", xyz="-2 0 0")
    shaft = joint("shaft", "stern_propeller", parent="stern", kind="continuous")
    parts = (stern, tiller, link("stern_propeller", mass=0), shaft, thruster("stern", "tiller"))
    (row,) = thruster_rows(assemble(*parts, hull=hull), engines, "")
    assert row.inertia == LIGHTEST
    if engines == "hinged":
        assert row.body_com == (0.0, 0.0, 0.0)
