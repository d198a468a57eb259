"""Propellers in the air, foils of usv_sim_lsa, and thrusters by their tags: what of other simulators becomes ours."""

import math
from contextlib import nullcontext

import pytest

from unit.formats.urdf.test_gazebo import FREE, boat_with
from vrx_mj.errors import ConfigError
from vrx_mj.physics.thrust import normal_slope


@pytest.mark.parametrize(("efforts", "thrust"), [
    ("<effortUnderWater>0</effortUnderWater><effortOverWater>4.12</effortOverWater>", 4.12),
    ("<effortOverWater>4.12</effortOverWater>", 4.12),
    ("<effortUnderWater>11.5</effortUnderWater><effortOverWater>0</effortOverWater>", 11.5),
])  # fmt: skip
def test_a_propeller_in_the_air_pushes(efforts, thrust):
    """usv_sim's airboat gives no effort under water."""
    boat = boat_with(FREE, f"<thruster><name>thruster_0</name>{efforts}</thruster>", kind="revolute", limits=(-1, 1))
    (found,) = boat.thrusters
    assert (found.drive.max_force_forward, found.drive.max_force_reverse) == (thrust, -thrust)
    said = any(
        "the maximum thrust is the same in and out of the water: 4.12 N" in line for line in map(str, boat.warnings)
    )
    assert said == (thrust == 4.12)


def test_vrxs_thrusters_are_known_by_their_tags():
    content = "<thruster><linkName>thruster_0</linkName><cmdTopic>left_thrust_cmd</cmdTopic></thruster>"
    boat = boat_with("libusv_gazebo_thrust_plugin_v2.so", content)
    assert [thruster.name for thruster in boat.thrusters] == ["left"]
    assert any("libusv_gazebo_thrust_plugin_v2.so is read as VRX's thrust plugin" in line
               for line in map(str, boat.warnings))  # fmt: skip


FOIL = "libfoil_dynamics_plugin.so"


def foil(type_, more="", **joint_of_it):
    content = f"<link_type>{type_}</link_type><link_name>thruster_0</link_name><area>0.02</area><cp>-0.2 0 0</cp>{more}"
    return boat_with(FOIL, content, axis="0 0 1", **joint_of_it)


@pytest.mark.parametrize(("more", "lift"), [
    ("", 1.5), ("<mult_lift>2</mult_lift>", 2.0), ("<mult_lift>2</mult_lift><mult_drag>1</mult_drag>", 1.0),
])  # fmt: skip
def test_rudders_of_usv_sim_have_the_force_of_their_plates(more, lift):
    """A plate of lift c sin(2 a) and drag c (1 - cos(2 a)) has the normal force 2 c sin(a)."""
    (blade,) = foil("rudder", more, kind="revolute", limits=(-1.57, 1.57)).thrusters
    assert (blade.name, blade.joint, blade.drive.max_angle) == ("thruster_0", "thruster_0_joint", 1.57)
    assert blade.blade.area == 0.02
    assert normal_slope(blade.blade.aspect_ratio) == pytest.approx(2.0 * lift)
    assert blade.center == pytest.approx((-0.2, 0, 0))


def test_a_foil_that_no_joint_turns_is_a_keel():
    (blade,) = foil("keel", kind="fixed").thrusters
    assert (blade.joint, blade.drive.max_angle, blade.center) == (None, 0.0, pytest.approx((-0.7, -0.4, -0.2)))


def test_sails_of_usv_sim_are_ours():
    boat = foil("sail", kind="revolute", limits=(-3.14, 3.14))
    (found,) = boat.thrusters
    assert (found.blade.area, found.blade.sheet, found.drive.max_angle) == (0.02, True, pytest.approx(math.pi / 2))
    assert any(
        "a sail on a sheet: its command limits the boom to leeward; its coefficients are replaced" in line
        for line in map(str, boat.warnings)
    )


@pytest.mark.parametrize(("kind", "words"), [
    ("sail", "a foil of link_type 'sail' without a joint is ignored"),
    ("wing", "a foil of link_type 'wing' is ignored"),
])  # fmt: skip
def test_other_foils_are_told(kind, words):
    assert any(words in line for line in map(str, foil(kind, kind="fixed").warnings))


def test_sails_and_rudders_of_asv_sim_have_their_coefficients():
    """ArduPilot's catamaran: lift to the stall and from there to nothing, drag in proportion to the angle."""
    numbers = "<link_name>thruster_0</link_name><area>0.32</area><cla>6</cla><alpha_stall>0.15</alpha_stall>"
    turns = {"kind": "revolute", "axis": "0 0 1", "limits": (-2, 2)}
    (sail,) = boat_with("asv_sim2-sail-lift-drag-system", numbers + "<cda>0.6</cda>", **turns).thrusters
    stall = math.degrees(0.15)
    rows = [(0, 0, 0), (stall, 0.9, 0.09), (90, 0, 0.3 * math.pi), (180 - stall, -0.9, 0.09), (180, 0, 0)]
    assert [pytest.approx(row) for row in sail.blade.coefficients] == rows
    (blade,) = boat_with("asv_sim2-foil-lift-drag-system", numbers, **turns).thrusters
    assert blade.blade.area * normal_slope(blade.blade.aspect_ratio) == pytest.approx(0.32 * 6)


def test_what_a_file_of_asv_sim_leaves_out_is_a_thin_plate():
    """Lift 2 pi a to 1 at the stall, and drag in proportion to the angle, which is 1 across the wind."""
    turns = {"kind": "revolute", "axis": "0 0 1", "limits": (-2, 2)}
    (sail,) = boat_with("asv_sim2-sail-lift-drag-system", "<link_name>thruster_0</link_name>", **turns).thrusters
    stall = math.degrees(0.5 / math.pi)
    rows = [(0, 0, 0), (stall, 1, 1 / math.pi**2), (90, 0, 1), (180 - stall, -1, 1 / math.pi**2), (180, 0, 0)]
    assert (sail.blade.area, [pytest.approx(row) for row in sail.blade.coefficients]) == (1, rows)


@pytest.mark.parametrize(("tag", "value", "fault"), [
    ("alpha_stall", "1.5", None), ("alpha_stall", "1.51", "must be at most 1.5"),
    ("alpha_stall", "0", "must be above 0"), ("cla", "0.5", None), ("cla", "0", "must be above 0"),
    ("cda", "0", None), ("cda", "-0.1", "must be at least 0"),
])  # fmt: skip
def test_coefficients_of_asv_sims_sails_have_limits(tag, value, fault):
    content = f"<link_name>thruster_0</link_name><{tag}>{value}</{tag}>"
    with pytest.raises(ConfigError, match=fault) if fault else nullcontext():
        boat_with("asv_sim2-sail-lift-drag-system", content, kind="revolute", axis="0 0 1", limits=(-2, 2))
