"""Meshes of hulls divided into panels."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from unit.physics.test_panels import barge, off
from vrx_mj.mjcf.derive import displaced
from vrx_mj.mjcf.panels import FEWEST, panels_of


def edges(triangles):
    return Counter((a, b) for row in triangles.tolist() for a, b in zip(row, row[1:] + row[:1], strict=True))


@settings(max_examples=30, deadline=None)
@given(st.tuples(*(st.floats(0.1, 10.0) for _ in range(3))))
def test_a_divided_barge_is_closed_and_the_same(size):
    vertices, faces = barge(*size)
    points, triangles = panels_of(vertices[faces])
    counts = edges(triangles)
    assert set(counts.values()) == {1}
    assert all((b, a) in counts for a, b in counts)
    assert displaced(points[triangles], 100.0).volume == pytest.approx(np.prod(size))
    assert FEWEST <= len(triangles) <= 5 * FEWEST  # 224 to 832 of 4000 that were drawn
    lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    assert lengths.max() <= 0.35 * max(size)


def test_a_mesh_that_is_fine_enough_stays():
    vertices, faces = off("sphere")
    points, triangles = panels_of(vertices[faces])
    assert len(triangles) == len(faces)
    assert points[triangles] == pytest.approx(vertices[faces], abs=1e-8)
