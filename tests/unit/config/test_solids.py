"""Volumes of shapes and meshes against closed forms, and of meshes that are open, inside out or hollow."""

import math

import numpy as np
import pytest
import trimesh

from vrx_mj.config.shapes import Shape, solid, solid_of_mesh
from vrx_mj.mjcf.flotation import flotation, flotation_at

HIGH = 99.0


def volume(found):
    return flotation_at(found.corners, HIGH).volume


def mesh_of(*pieces, name="hull.stl"):
    whole = trimesh.util.concatenate(pieces)
    return solid_of_mesh(name, np.asarray(whole.vertices), np.asarray(whole.faces))


def box(size, at=(0, 0, 0), *, inside_out=False):
    made = trimesh.creation.box(size)
    made.apply_translation(at)
    return trimesh.Trimesh(made.vertices, made.faces[:, ::-1] if inside_out else made.faces, process=False)


@pytest.mark.parametrize(
    ("shape", "expected", "tolerance"),  # cylinders are prisms of their volume; round ends lose a little
    [
        ({"type": "box", "size": (4, 1, 0.5)}, 2, 1e-9),
        ({"type": "cylinder", "radius": 0.5, "length": 2}, math.pi * 0.5, 1e-9),
        ({"type": "sphere", "radius": 0.5}, math.pi / 6, 5e-3),
        ({"type": "capsule", "radius": 0.5, "length": 2}, math.pi / 6 + math.pi * 0.5, 5e-3),
        ({"type": "ellipsoid", "size": (2, 1, 0.5)}, math.pi / 6, 5e-3),
    ],
)
def test_volumes_of_shapes(shape, expected, tolerance):
    assert volume(solid(Shape(**shape))) == pytest.approx(expected, rel=tolerance)


def test_what_a_wedge_displaces():
    """Keel at z = 0, sides at 45 degrees: a triangle as high as the water and twice as wide."""
    points = np.array([[x, y, z] for x in (-1.5, 1.5) for y, z in ((0, 0), (-0.6, 0.6), (0.6, 0.6))], dtype=float)
    hull = trimesh.convex.convex_hull(points)
    corners = solid_of_mesh("wedge.stl", hull.vertices, hull.faces).corners
    found, level = flotation_at(corners, 0.4), 0.4
    assert found.volume == pytest.approx(3 * level**2)
    assert found.area == pytest.approx(3 * 2 * level)
    assert found.center == pytest.approx([0, 0, 2 / 3 * level], abs=1e-12)
    assert found.spread == pytest.approx([3**3 * 0.8 / 12, 3 * 0.8**3 / 12])
    assert flotation(corners, 3 * level**2).level == pytest.approx(level, abs=1e-5)


@pytest.mark.parametrize("level", [-2.0, -0.5, 0.0, 0.3, 2.0])
def test_what_is_displaced_is_what_a_library_cuts_off(level):
    """A mesh turned any way, against trimesh's own cut."""
    made = trimesh.creation.annulus(0.3, 0.5, 1.5)
    made.apply_transform(trimesh.transformations.euler_matrix(0.4, 0.7, 1.1))
    found = flotation_at(solid_of_mesh("ring.stl", made.vertices, made.faces).corners, level)
    cut = made.slice_plane([0, 0, level], [0, 0, -1], cap=True) if level < 1.0 else made
    if len(cut.faces) == 0:
        assert (found.volume, found.area) == (0, 0)
        return
    assert found.volume == pytest.approx(cut.volume)
    assert found.center == pytest.approx(cut.center_mass)


def test_a_mesh_that_is_inside_out_is_turned_and_said():
    found = mesh_of(box((2, 1, 0.5), inside_out=True))
    assert volume(found) == pytest.approx(1.0)
    assert found.notes == ("mesh hull.stl is inside out (a volume of -1 m3): its triangles are reversed",)


def test_a_mesh_that_is_open_is_closed_and_said():
    made = box((2, 1, 0.5))
    deck = made.face_normals[:, 2] > 0.5
    found = solid_of_mesh("hull.stl", made.vertices, made.faces[~deck])
    assert volume(found) == pytest.approx(1.0)
    assert found.notes == ("mesh hull.stl is open (4 edges without a second triangle): its convex hull is used",)


def test_open_hulls_that_are_apart_are_closed_apart():
    pair = [box((2, 0.2, 0.5), (0, side, 0)) for side in (-1, 1)]
    open_pair = [trimesh.Trimesh(made.vertices, made.faces[made.face_normals[:, 2] < 0.5]) for made in pair]
    assert volume(mesh_of(*open_pair)) == pytest.approx(0.4)


def test_panels_that_make_a_hull_are_closed_together():
    made = box((2, 1, 0.5))
    apart = trimesh.Trimesh(made.vertices[made.faces].reshape(-1, 3) * (1 + 1e-4), np.arange(36).reshape(-1, 3),
                            process=False)  # fmt: skip
    lifted = np.array(apart.vertices)
    lifted[:6] *= 1.001  # one panel does not meet the others
    found = solid_of_mesh("hull.stl", lifted, np.asarray(apart.faces))
    assert volume(found) == pytest.approx(1.0, rel=5e-3)


def test_triangles_with_corners_of_their_own_are_closed_if_these_meet():
    made = box((2, 1, 0.5))
    found = solid_of_mesh("hull.stl", made.vertices[made.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert (volume(found), found.notes) == (pytest.approx(1.0), ())


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_hollow_hull_keeps_the_water_out(inside_out):
    outer, inner = box((2, 1, 0.5), inside_out=inside_out), box((1.9, 0.9, 0.4), inside_out=not inside_out)
    assert volume(mesh_of(outer, inner)) == pytest.approx(1.0)


def test_one_hull_of_two_that_is_inside_out_counts_too():
    found = mesh_of(box((2, 0.2, 0.5), (0, 1, 0)), box((2, 0.1, 0.5), (0, -1, 0), inside_out=True))
    assert volume(found) == pytest.approx(0.3)


def test_a_plane_has_no_volume():
    found = solid_of_mesh("sheet.stl", np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]),
                          np.array([[0, 1, 2], [0, 2, 3]]))  # fmt: skip
    assert len(found.corners) == 0


def test_a_mesh_of_very_many_pieces_is_one():
    many = [box((0.01, 0.01, 0.01), (0.02 * i, 0, 0)) for i in range(120)]
    assert volume(mesh_of(*many)) == pytest.approx(120e-6)
