"""What of a shape is under water."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from unit.physics.rows import SIZES, element, matrix, moving, moving_row, oracle, table
from vrx_mj.model.tables import ELEMENT
from vrx_mj.physics.volumes import submerged_part

angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
lengths = st.floats(0.2, 2.0)
sizes = st.tuples(lengths, lengths, lengths)
shapes = st.sampled_from(sorted(SIZES))


def wet(shape, size, body, level=0.0):
    return submerged_part(table(ELEMENT, [element(shape, size)])[0], body, level)


def volume_of(shape, size):
    """The volume of the solid that stands for a shape: VRX's cylinder has twenty sides."""
    share = 10 * math.sin(math.radians(18)) / math.pi if shape == "cylinder" else 1.0
    return SIZES[shape](*size)[1] * share


BALL, CUBE, TILE, POST = (0.325, 0, 0), (2.0, 2.0, 2.0), (1.5, 1.5, 0.4), (0.5, 2.0, 0)
CASES = [  # shape, size, height of the centre, roll, volume, centroid's y and z: other code
    ("sphere", BALL, 0.10, 0, 0.0397607820, 0, -0.080625),
    ("sphere", BALL, 0.0, 0, 0.0718966569, 0, -0.121875),
    ("sphere", BALL, -0.10, 0, 0.104032532, 0, -0.169034091),
    ("box", CUBE, 1.0, math.pi / 4, 0.343145751, 0, -0.138071187),
    ("box", CUBE, 0.5, math.pi / 4, 1.67157288, 0, -0.304737854),
    ("box", TILE, 0.15, 0.1, 0.115860139, -0.318887122, -0.0412919652),
    ("cylinder", POST, 0.5, 0, 0.386271243, 0, -0.25),
    ("cylinder", POST, 0.2, math.pi / 2, 0.386666598, 0, -0.122102066),
    ("cylinder", POST, -3.0, 0.7, 1.54508497, 0, -3.0),
]


@pytest.mark.parametrize(("shape", "size", "z", "roll", "volume", "y", "depth"), CASES)
def test_volumes_and_centroids(shape, size, z, roll, volume, y, depth):
    result = wet(shape, size, moving((0, 0, z), (roll, 0, 0)))
    assert result == pytest.approx((volume, 0, y, depth), rel=6e-9, abs=1e-9)


def test_they_are_vrx_s():
    """VRX rounds the water level of boxes and cylinders to 32 bits; 3e-8 m3 and 2e-8 m is how it compares."""
    for row in oracle("submerged_volume"):
        size = (row["a_m"], row["b_m"], row["c_m"])
        result = wet(row["shape"], size, moving_row(row), row["fluid_level_m"])
        assert result.volume == pytest.approx(row["volume_m3"], rel=1e-6, abs=1e-7), row["case"]
        centroid = [row["cx_m"], row["cy_m"], row["cz_m"]]
        assert result[1:] == pytest.approx(centroid, rel=1e-6, abs=1e-6), row["case"]


@given(shape=shapes, size=sizes, z=st.floats(-3, 3), angle=angles)
def test_what_is_wet_and_what_is_dry_make_the_whole(shape, size, z, angle):
    """The dry part of a symmetric solid is the wet part of the same solid as far on the other side."""
    below, above = (wet(shape, size, moving((0, 0, height), angle)).volume for height in (z, -z))
    assert below + above == pytest.approx(volume_of(shape, size), abs=1.1e-6)  # up to 1e-6 m3 counts as dry


@given(shape=shapes, size=sizes, z=st.floats(-3, 3), angle=angles, sink=st.floats(0, 1))
def test_sinking_deeper_never_loses_volume(shape, size, z, angle, sink):
    deep, shallow = (wet(shape, size, moving((0, 0, height), angle)).volume for height in (z - sink, z))
    assert deep >= shallow - 1e-12


@given(size=sizes, z=st.floats(-1, 1), angle=angles, seed=st.integers(0, 9))
def test_a_box_against_random_points(size, z, angle, seed):
    count = 4000
    body = moving((0, 0, z), angle)
    points = (np.random.default_rng(seed).random((count, 3)) - 0.5) * size @ matrix(body).T + (0, 0, z)
    inside = points[points[:, 2] < 0]
    result = wet("box", size, body)
    whole = float(np.prod(size))
    assert result.volume == pytest.approx(whole * len(inside) / count, abs=5 * whole / (2 * math.sqrt(count)))
    assume(len(inside) > 1000)
    error = 5 * 0.58 * max(size) * math.sqrt(3) / math.sqrt(len(inside))
    assert result[1:] == pytest.approx(inside.mean(axis=0), abs=error)


@given(size=sizes, z=st.floats(-1, 1), angle=angles)
def test_a_box_may_be_written_with_its_edges_in_another_order(size, z, angle):
    """What one order leaves to the formula for upright prisms, another one clips face by face."""
    a, b, c = size
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # the element's x is the body's y, and so on
    other = table(ELEMENT, [element("box", (b, c, a), turn=turn)])[0]
    body = moving((0.3, 0.4, z), angle)
    assert tuple(submerged_part(other, body, 0.0)) == pytest.approx(tuple(wet("box", size, body)), rel=1e-9, abs=1e-8)


@given(shape=shapes, size=sizes, z=st.floats(-1, 1), angle=angles)
def test_the_volume_s_change_with_depth_is_its_waterline(shape, size, z, angle):
    """Archimedes: d(V z_c) / d(level) = level dV / d(level), here by differences at the level 0."""
    step = 1e-4
    results = [wet(shape, size, moving((5, 5, z), angle), level) for level in (-step, 0.0, step)]
    low, middle, high = (r.volume for r in results)
    assume(low > 1e-3)
    assert high - middle >= 0
    moment = results[2].volume * results[2].z - results[0].volume * results[0].z
    # between -step and step the added slices lie at those heights
    assert abs(moment) <= step * (high - low) + 1e-9


def test_an_element_lies_where_its_link_puts_it():
    one = table(ELEMENT, [element("sphere", (0.3, 0, 0), position=(1.0, 2.0, -1.0))])[0]
    result = submerged_part(one, moving((10.0, 20.0, 0.0), (0, 0, math.pi / 2)), 0.0)
    assert result[1:] == pytest.approx((8.0, 21.0, -1.0))


@pytest.mark.parametrize("shape", sorted(SIZES))
def test_above_the_water_all_is_zero(shape):
    assert wet(shape, (0.5, 0.5, 0.5), moving((1, 1, 2))) == (0, 0, 0, 0)


def test_a_volume_of_a_cubic_centimetre_is_dry():
    assert wet("box", (1.0, 1.0, 1.0), moving((0, 0, 0.5 - 9e-7))).volume == 0.0
    assert wet("box", (1.0, 1.0, 1.0), moving((0, 0, 0.5 - 1.1e-6))).volume == pytest.approx(1.1e-6)
