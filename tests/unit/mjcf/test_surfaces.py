"""Surfaces that cross and overlap against closed forms, and against every pair one by one."""

import itertools

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import VrxError
from vrx_mj.mjcf import surfaces
from vrx_mj.mjcf.surfaces import MOST_SHOWN, checked_surface, crossings, overlap


def box(size, at=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    made = trimesh.creation.box(size)
    made.apply_transform(trimesh.transformations.euler_matrix(*turn))
    return np.asarray(made.triangles) + at


def ball(level=3, radius=1.0):
    return np.asarray(trimesh.creation.icosphere(level, radius).triangles)


def test_shapes_that_touch_or_are_apart_are_fine():
    """A deck on two floats, whose faces and edges meet."""
    deck = box((2.0, 3.0, 0.2), (0.0, 0.0, 0.3))
    catamaran = np.concatenate([deck, box((4.0, 0.4, 0.4), (0.0, 1.0, 0.0)), box((4.0, 0.4, 0.4), (0.0, -1.0, 0.0))])
    assert checked_surface(catamaran) == ()
    found = overlap(catamaran)
    assert (found.twice, found.inverted) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert found.volume == pytest.approx(1.2 + 2 * 0.64, rel=0.02)


@pytest.mark.parametrize("level", [1, 2, 3, 4])
def test_a_ball_holds_its_volume_once(level):
    corners = ball(level)
    found = overlap(corners)
    assert found.volume == pytest.approx(trimesh.creation.icosphere(level).volume, rel=2e-3)
    assert (found.twice, found.inverted, crossings(corners)[0]) == (pytest.approx(0.0, abs=1e-12), 0.0, 0)


@given(st.floats(-0.9, 0.9), st.floats(0.1, 1.0), st.floats(0.2, 1.0))
def test_what_two_boxes_share_counts_twice(shift, width, height):
    found = overlap(np.concatenate([box((1.0, 1.0, 1.0)), box((1.0, width, height), (shift, 0.0, 0.0))]))
    assert found.twice == pytest.approx((1.0 - abs(shift)) * width * height, abs=0.03)
    assert found.volume == pytest.approx(1.0 + abs(shift) * width * height, abs=0.03)
    assert found.inverted == 0.0


def test_the_place_of_a_crossing_is_on_both_triangles():
    one = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]])
    other = np.array([[[1.0, 1, -1], [1, 1, 1], [1, 5, 1]]])
    count, place = crossings(np.concatenate([one, other]))
    assert count == 1
    assert place == pytest.approx([1.0, 2.0, 0.0])  # the line from y = 1 to y = 3 at x = 1


def brute(corners):
    """Pairs of triangles that share an inner point of an edge and a face, by solving for each edge and triangle."""
    found = 0
    for one, other in itertools.combinations(corners, 2):
        hit = False
        for edge, face in ((one, other), (other, one)):
            for i in range(3):
                a, b = edge[i], edge[(i + 1) % 3]
                system = np.stack([b - a, face[0] - face[1], face[0] - face[2]], axis=1)
                if abs(np.linalg.det(system)) > 1e-12:
                    t, u, v = np.linalg.solve(system, face[0] - a)
                    hit |= 0.0 < t < 1.0 and u > 0.0 and v > 0.0 and u + v < 1.0
        found += hit
    return found


@pytest.mark.parametrize("seed", range(5))
def test_crossings_are_those_of_every_pair(seed):
    random = np.random.default_rng(seed)
    corners = random.normal(size=(60, 1, 3)) + 0.5 * random.normal(size=(60, 3, 3))
    assert crossings(corners)[0] == brute(corners) > 10


def test_a_dent_that_comes_out_on_the_other_side_is_found():
    made = trimesh.creation.icosphere(3)
    points = made.vertices.copy()
    points[points[:, 2].argmax()] = (0.1, 0.05, -1.5)
    (note,) = checked_surface(points[made.faces])
    assert note == (
        "its surface intersects itself: 8 pairs of triangles cross, the first at (0.0662, 0.0174, -0.994) m; "
        "repair it, for example with Blender's 3D-Print Toolbox"
    )


def test_a_mirrored_half_that_reaches_over_the_middle_is_found():
    """Halves overlap by 0.1 m about y = 0: all their edges meet the others' edges, as they are mirrored."""
    half = box((4.0, 1.0, 1.0), (0.0, 0.45, 0.0), (0.3, 0.0, 0.0))
    mirrored = half[:, ::-1] * (1.0, -1.0, 1.0)
    count, place = crossings(np.concatenate([half, mirrored]))
    assert count > 0
    assert place[1] == pytest.approx(0.0, abs=1e-9)


def test_one_in_another_lifts_twice_and_a_cavity_less():
    inner, outer = ball(3, 0.5), ball(3)
    (note,) = checked_surface(np.concatenate([outer, inner]))
    assert note == (
        "its surfaces overlap: 0.519 of 4.15 m3 count twice and add buoyancy; join them to one, for example with "
        "Blender's Boolean union"
    )
    assert checked_surface(np.concatenate([outer, inner[:, ::-1]])) == ()


@pytest.mark.parametrize(("radius", "is_told"), [(0.3, False), (0.8, True)])
def test_what_overlaps_is_told_by_its_share_of_a_large_hull(radius, is_told):
    text = " ".join(checked_surface(np.concatenate([box((10.0, 4.0, 2.0)), ball(3, radius)])))
    assert ("count twice" in text) == is_told


def test_the_two_parts_that_overlap_most_are_named():
    parts = [box((1.0, 1.0, 1.0), (at, 0.0, 0.0)) for at in (0.0, 0.9, 1.4)]
    (note,) = checked_surface(np.concatenate(parts), ("bow", "middle", "stern"), (0, 12, 24))
    assert note.startswith("its surfaces overlap, most of all middle and stern: 0.581 of 2.4 m3 count twice")


def test_a_part_that_is_inside_out_is_refused():
    with pytest.raises(VrxError) as error:
        checked_surface(np.concatenate([box((1.0, 1.0, 1.0)), box((1.0, 1.0, 1.0), (3.0, 0.0, 0.0))[:, ::-1]]))
    assert str(error.value) == (
        "its surface intersects itself: 1 m3 of 2 m3 are inside out; repair it, for example with Blender's "
        "3D-Print Toolbox"
    )


@pytest.mark.slow
def test_many_long_triangles_are_bounded():
    random = np.random.default_rng(1)
    corners = random.normal(size=(20_000, 1, 3)) + random.normal(size=(20_000, 3, 3))
    assert crossings(corners)[0] == MOST_SHOWN
    assert overlap(corners[:2000]).volume >= 0.0
    assert checked_surface(np.empty((0, 3, 3))) == ()


@pytest.mark.parametrize(("most", "is_found"), [(24, True), (23, False)])
def test_crossings_are_not_looked_for_among_more_triangles_than_that_takes_seconds(monkeypatch, most, is_found):
    monkeypatch.setattr(surfaces, "_MOST_TRIANGLES", most)
    two_boxes = np.concatenate([box((1.0, 1.0, 1.0)), box((1.0, 1.0, 1.0), (0.5, 0.4, 0.3))])
    assert (crossings(two_boxes)[0] > 0) == is_found
