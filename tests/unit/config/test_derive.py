"""Hydrodynamics guessed from shapes and mass, against closed forms."""

import math

import pytest

from urdf_boats import assemble, joint, link
from vrx_mj.config.derive import derived_hydrodynamics
from vrx_mj.config.dynamics import HydrodynamicsConfig
from vrx_mj.errors import VrxError

RHO = 997.8


def shape(kind, xyz="0 0 0", rpy="0 0 0", tag="collision"):
    return f'<{tag}><origin xyz="{xyz}" rpy="{rpy}"/><geometry><{kind}/></geometry></{tag}>'


def guess(*shapes, mass=100, parts=()):
    return derived_hydrodynamics(assemble(*parts, hull=link("base_link", mass, "".join(shapes))))


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
    assert str(caught.value) == "robot boat: no shape gives its length and width"
