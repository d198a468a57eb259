"""Hydrodynamics guessed from shapes and mass, against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from urdf_boats import assemble, joint, link
from vrx_mj import compile_world
from vrx_mj.config.dynamics import HydrodynamicsConfig
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.mjcf.flotation import derived_floats, derived_lines
from vrx_mj.mjcf.hulls import about_origin

RHO = 997.8


def shape(kind, xyz="0 0 0", rpy="0 0 0", tag="collision"):
    return f'<{tag}><origin xyz="{xyz}" rpy="{rpy}"/><geometry><{kind}/></geometry></{tag}>'


def guess(*shapes, mass=100, parts=()):
    return derived_lines(assemble(*parts, hull=link("base_link", mass, "".join(shapes)))).values


def test_the_floats_lift_two_and_a_half_times_the_weight():
    found = guess(shape('box size="4 1 0.5"'), mass=300)
    lift = RHO * math.pi * found["hull_radius"] ** 2 * found["boat_length"]  # two half cylinders, as deep as they go
    assert lift == pytest.approx(2.5 * 300)


def test_two_lines_of_floats_are_as_stiff_in_roll_as_a_rectangle():
    length, beam = 4, 1.3
    found = guess(shape(f'box size="{length} {beam} 0.5"'))
    rectangle = length * beam**3 / 12  # second moment of the waterplane
    assert length * beam * (found["boat_width"] / 2) ** 2 == pytest.approx(rectangle)


@pytest.mark.parametrize(
    ("shapes", "length", "beam"),
    [
        ([shape('box size="4 1 0.5"')], 4, 1),
        ([shape('box size="4 1 0.5"', rpy=f"0 0 {math.pi / 2}")], 1, 4),
        ([shape('cylinder length="3" radius="0.25"', rpy=f"0 {math.pi / 2} 0")], 3, 0.5),
        ([shape('sphere radius="0.5"', "1 0 0"), shape('sphere radius="0.5"', "-1 0 0")], 3, 1),
        ([shape('box size="2 0.3 0.3"', "0 1 0"), shape('box size="2 0.3 0.3"', "0 -1 0")], 2, 2.3),
        ([shape('box size="5 2 1"', tag="visual")], 5, 2),  # nothing collides
        ([shape('box size="4 1 0.5"'), shape('box size="9 9 9"', tag="visual")], 4, 1),
    ],
)
def test_length_and_beam_are_those_of_the_box_around_what_collides_or_is_seen(shapes, length, beam):
    found = guess(*shapes)
    assert found["boat_length"] == pytest.approx(length)
    assert found["boat_width"] == pytest.approx(beam / math.sqrt(3))


def test_shapes_of_other_links_count_where_they_are():
    arm = (link("float", 20, shape('box size="1 1 1"')), joint("arm", "float", kind="fixed", xyz="0 3 0"))
    found = guess(shape('box size="4 1 0.5"'), parts=arm)
    assert found["boat_width"] == pytest.approx(4 / math.sqrt(3))
    assert RHO * math.pi * found["hull_radius"] ** 2 * 4 == pytest.approx(2.5 * 120)


def test_drag_is_the_wam_vs_by_froudes_law():
    same, double = (guess(shape(f'box size="{length} 1 0.5"')) for length in (4.9, 9.8))
    assert same["drag_linear"] == pytest.approx((51.3, 40, 500, 50, 50, 400))  # the WAM-V's own, VRX
    assert same["drag_quadratic"] == pytest.approx((72.4, 0, 0, 0, 0, 0))
    forces, moments = 2**2.5, 2**4.5  # force / speed, moment / rate: mass goes with length^3, time with length^0.5
    expected = [value * (forces if i < 3 else moments) for i, value in enumerate(same["drag_linear"])]
    assert double["drag_linear"] == pytest.approx(expected)
    assert double["drag_quadratic"] == pytest.approx((4 * 72.4, 0, 0, 0, 0, 0))
    assert double["added_mass"] == (0,) * 6


def test_a_guess_is_a_hull():
    found = HydrodynamicsConfig.model_validate(guess(shape('box size="4 1 0.5"')))
    assert (found.length_n, found.water_level, found.water_density) == (2, 0, RHO)


def test_a_boat_without_a_shape_is_refused():
    with pytest.raises(VrxError) as caught:
        guess()
    assert str(caught.value) == "robot boat: no shape gives its length and width; give a link <collision> or <visual>"


# Floats that lift as the volume does: each against the closed form of its shape

INERTIA = '<inertia ixx="{0}" iyy="{0}" izz="{0}" ixy="0" ixz="0" iyz="0"/>'


def floats(*shapes, mass, center="0 0 0", stations=2, parts=()):
    inertial = f'<inertial><origin xyz="{center}"/><mass value="{mass}"/>{INERTIA.format(mass)}</inertial>'
    hull = f'<link name="base_link">{inertial}{"".join(shapes)}</link>'
    return derived_floats(assemble(*parts, hull=hull), RHO, stations)


def lift(found, level, heel=0.0, trim=0.0):
    """Volume [m3] and moments about the base link [m4] that the floats lift with the water at a level, or a slope."""
    total = np.zeros(3)
    for hull in found.values["hulls"]:
        length, radius = hull["length"] / len(hull["points"]), hull["radius"]
        for x, y, z in hull["points"]:
            depth = min(max(level + heel * y + trim * x - z, 0.0), radius)
            chord = math.sqrt(2 * radius * depth - depth**2)
            area = radius**2 * math.acos((radius - depth) / radius) - (radius - depth) * chord
            height = found.pushed[2] + z
            total += length * area * np.array([1.0, x + trim * height, y + heel * height])
    return total


def rate(found, level, step=1e-6, **turn):
    """How volume and moments grow with the level, or with a slope of the water."""
    if not turn:
        return (lift(found, level + step) - lift(found, level - step)) / (2 * step)
    (key,) = turn
    return (lift(found, level, **{key: step}) - lift(found, level, **{key: -step})) / (2 * step)


@pytest.mark.parametrize("at", [-0.3, 0.0, 0.3])  # the hull's middle: base_link is at the deck, there, at the keel
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_barge_floats_as_archimedes_says(share, at):
    length, beam, height = 4.0, 1.2, 0.6
    volume = share * length * beam * height
    found = floats(shape(f'box size="{length} {beam} {height}"', f"0 0 {at}"), mass=RHO * volume, center=f"0 0 {at}")
    level = at + (share - 0.5) * height
    assert lift(found, level)[0] == pytest.approx(volume, rel=1e-4)
    assert lift(found, 9.0)[0] == pytest.approx(length * beam * height if share > 0.1 else 10 * volume, rel=1e-4)
    assert rate(found, level)[0] == pytest.approx(length * beam, rel=1e-4)  # the waterplane
    buoyancy = at + (share - 1) * height / 2
    heel, trim = rate(found, level, heel=1.0)[2], rate(found, level, trim=1.0)[1]
    assert heel == pytest.approx(length * beam**3 / 12 + volume * buoyancy, rel=1e-4)  # metacentre over base_link
    assert trim == pytest.approx(length**3 * beam / 12 + volume * buoyancy, rel=1e-4)
    assert found.rest == f"waterline at z = {level:.3g} m, draft {share * height:.3g} m"


@pytest.mark.parametrize("stations", [1, 2, 3, 8])
def test_more_stations_lift_the_same(stations):
    found = floats(shape('box size="4 1 0.5"'), mass=RHO, stations=stations)
    assert lift(found, 0.0)[0] == pytest.approx(1.0, rel=1e-4)
    trim = rate(found, 0.0, trim=1.0)[1]
    assert trim == pytest.approx((4**3 / 12 if stations > 1 else 0.0) - 0.125, rel=1e-3)


def test_a_catamarans_hulls_give_it_its_stiffness():
    pair = [shape('box size="3 0.2 0.4"', f"0 {side} 0") for side in (-0.7, 0.7)]
    found = floats(*pair, mass=RHO * 0.24)
    assert lift(found, 0.0)[0] == pytest.approx(0.24, rel=1e-4)
    moment = 2 * (3 * 0.2**3 / 12 + 0.6 * 0.7**2)
    assert rate(found, 0.0, heel=1.0)[2] == pytest.approx(moment + 0.24 * -0.1, rel=1e-4)


def test_a_cylinder_that_is_half_under_water():
    found = floats(shape('cylinder length="3" radius="0.4"', rpy=f"0 {math.pi / 2} 0"), mass=RHO * math.pi * 0.24)
    assert lift(found, 0.0)[0] == pytest.approx(math.pi * 0.24, rel=1e-4)
    assert rate(found, 0.0)[0] == pytest.approx(2.4, rel=5e-3)  # a prism of 64 sides: its waterplane is less exact
    assert rate(found, 0.0, heel=1.0)[2] == pytest.approx(0.0, abs=4e-3)  # its metacentre is its axis


def test_the_floats_are_where_the_volume_is():
    found = floats(shape('box size="2 1 0.5"', "3 0.25 -1"), mass=RHO * 0.5, center="3 0.25 -1")
    volume, ahead, left = lift(found, -1.0)
    assert (ahead / volume, left / volume) == pytest.approx((3.0, 0.25))
    assert found.notes == ()


@given(share=st.floats(0.02, 0.98), width=st.floats(0.2, 3), height=st.floats(0.05, 3), at=st.floats(-5, 5))
def test_any_box_floats_at_its_draft(share, width, height, at):
    found = floats(shape(f'box size="2 {width} {height}"', f"0 0 {at}"), mass=RHO * share * 2 * width * height)
    assert lift(found, at + (share - 0.5) * height)[0] == pytest.approx(share * 2 * width * height, rel=1e-3)


def test_a_mass_that_the_volume_cannot_carry_is_said():
    found = floats(shape('box size="1 1 0.1"'), mass=150)
    assert found.notes == ("the volume of its shapes, 0.1 m3, carries only 99.78 kg of its 150 kg: it floats awash",)
    assert lift(found, 0.045)[0] == pytest.approx(150 / RHO)


def test_what_is_seen_carries_the_boat_if_what_collides_cannot():
    found = floats(shape('sphere radius="0.1"'), shape('box size="2 1 0.5"', tag="visual"), mass=RHO * 0.5)
    assert found.rest == "waterline at z = 0 m, draft 0.25 m"


def test_a_top_heavy_boat_is_said():
    found = floats(shape('box size="4 1 0.5"'), mass=RHO, center="0 0 0.5")
    expected = "its centre of mass is 0.625 m above its centre of buoyancy: the metacentric height is -0.292 m, and it "
    assert found.notes == (f"{expected}capsizes",)  # 4 * 1^3 / 12 / 1 m3 = 0.333 m


@pytest.mark.parametrize(
    ("center", "note"),
    [
        ("0.5 0 0", "5 degrees down at the bow: its centre of mass is 0.5 m"),
        ("-0.5 0 0", "5 degrees down at the stern: its centre of mass is 0.5 m"),
        ("0 0.05 0", "13 degrees down at the port side: its centre of mass is 0.05 m"),
        ("0 -0.05 0", "13 degrees down at the starboard side: its centre of mass is 0.05 m"),
    ],
)
def test_a_boat_that_does_not_float_level_is_said(center, note):
    """The metacentric heights are 4^3 / 12 - 0.125 and 4 / 12 - 0.125 m."""
    found = floats(shape('box size="4 1 0.5"'), mass=RHO, center=center)
    assert found.notes == (f"it floats about {note} from its centre of buoyancy; check the <inertial> of its links",)


@pytest.mark.parametrize("kind", ["fixed", "revolute", "prismatic", "continuous"])
def test_a_mass_on_any_joint_that_is_held_floats_as_on_a_fixed_one(kind):
    limits = None if kind in {"fixed", "continuous"} else (0, 0)
    parts = (link("mast", 20), joint("step", "mast", kind=kind, xyz="0 0.1 0.3", limits=limits))
    boat = assemble(*parts, hull=link("base_link", 100, shape('box size="2 1 0.5"')))
    fixed = assemble(link("mast", 20), joint("step", "mast", kind="fixed", xyz="0 0.1 0.3"),
                     hull=link("base_link", 100, shape('box size="2 1 0.5"')))  # fmt: skip
    assert derived_floats(boat, RHO, 2) == derived_floats(fixed, RHO, 2)


def test_a_marine_hull_has_its_added_mass_and_its_wind_at_the_centre_of_mass(tmp_path):
    """Floats that follow from shapes push elsewhere, on the z axis of the base link."""
    center, added = (0.2, -0.1, 0.05), (3.0, 40.0, 60.0, 1.0, 4.0, 4.0)
    hull = link("base_link", 100, shape('box size="2 1 0.5"'))
    hull = hull.replace("<inertial>", f'<inertial><origin xyz="{" ".join(map(str, center))}"/>')
    (tmp_path / "box.urdf").write_text(f'<robot name="box">{hull}</robot>', encoding="utf-8")
    text = (
        f"urdf: box.urdf\nhydrodynamics: {{added_mass: {list(added)}}}\nhull: {{damping_linear: [0, 0, 9, 9, 9, 9]}}\n"
    )
    (tmp_path / "box.yaml").write_text(text, encoding="utf-8")
    boat = {"robot": str(tmp_path / "box.yaml"), "boats": [{"name": "a", "pose": [0.0] * 6}]}
    with pytest.warns(VrxWarning):  # it has no thruster
        world = compile_world({"physics": {"profile": "marine"}, "sea": {"model": "none"}}, fleet=boat)
    (found,) = world.parameters.hulls
    assert found.link_com == pytest.approx(center)
    assert np.array(found.vessel.added_mass) == pytest.approx(about_origin(np.diag(added), center))
