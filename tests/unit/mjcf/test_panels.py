"""Meshes of hulls divided into panels."""

from collections import Counter

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.test_panels import barge, off
from vrx_mj.mjcf.flotation import flotation_at
from vrx_mj.mjcf.surfaces import MIN_PANELS, panels_of
from vrx_mj.model.boats import MOST_TRIANGLES


def edges(triangles):
    return Counter((a, b) for row in triangles.tolist() for a, b in zip(row, row[1:] + row[:1], strict=True))


@given(st.tuples(*(st.floats(0.1, 10.0) for _ in range(3))))
def test_a_divided_barge_is_closed_and_the_same(size):
    vertices, faces = barge(*size)
    points, triangles = panels_of(vertices[faces])
    counts = edges(triangles)
    assert set(counts.values()) == {1}
    assert all((b, a) in counts for a, b in counts)
    assert flotation_at(points[triangles], 100.0).volume == pytest.approx(np.prod(size))
    assert MIN_PANELS <= len(triangles) <= 5 * MIN_PANELS  # 224 to 832 of 4000 that were drawn
    lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    assert lengths.max() <= 0.35 * max(size)


def rows(corners):
    """Triangles in an order of their own."""
    return sorted(sorted(triangle) for triangle in np.round(corners, 6).tolist())


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.3, -1.7, 0.4)])
def test_triangles_of_a_box_are_mirrored_to_both_sides_and_ahead(place):
    vertices, faces = barge(4.0, 2.0, 1.0)
    points, triangles = panels_of(vertices[faces] + place)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    corners = points[triangles] - middle
    for axis in (0, 1):
        mirrored = corners.copy()
        mirrored[:, :, axis] *= -1.0
        assert rows(mirrored) == rows(corners)


def test_of_a_box_with_a_bow_only_the_sides_are_mirrored():
    outline = np.array([(-2.0, -1.0), (1.0, -1.0), (2.5, 0.0), (1.0, 1.0), (-2.0, 1.0)])
    hull = trimesh.convex.convex_hull(np.array([(x, y, z) for x, y in outline for z in (-0.5, 0.5)]))
    points, triangles = panels_of(np.array(hull.triangles))
    corners = points[triangles]
    assert rows(corners * (1.0, -1.0, 1.0)) == rows(corners)
    assert flotation_at(corners, 100.0).volume == pytest.approx(7.5)
    counts = edges(triangles)
    assert set(counts.values()) == {1}
    assert all((b, a) in counts for a, b in counts)


def test_a_hull_with_two_sides_is_divided_as_it_is():
    vertices, faces = barge(4.0, 2.0, 1.0)
    vertices = vertices + 0.2 * vertices[:, ::-1] * (vertices > 0.0)
    points, triangles = panels_of(vertices[faces])
    assert flotation_at(points[triangles], 100.0).volume == pytest.approx(flotation_at(vertices[faces], 100.0).volume)
    assert rows(points[triangles] * (1.0, -1.0, 1.0)) != rows(points[triangles])


def test_a_mesh_that_is_fine_enough_stays():
    vertices, faces = off("sphere")
    points, triangles = panels_of(vertices[faces])
    assert len(triangles) == len(faces)
    assert points[triangles] == pytest.approx(vertices[faces], abs=1e-8)


def test_of_long_narrow_triangles_there_are_no_more_than_a_hull_may_have():
    pontoon = np.array(trimesh.creation.cylinder(0.2, 3.0, sections=64).triangles)
    corners = np.concatenate([pontoon, np.add(pontoon, (0.0, 1.8, 0.0))])
    points, triangles = panels_of(corners)
    assert len(corners) < len(triangles) <= MOST_TRIANGLES
    assert set(edges(triangles).values()) == {1}
    assert flotation_at(points[triangles], 100.0).volume == pytest.approx(flotation_at(corners, 100.0).volume)
