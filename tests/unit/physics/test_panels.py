"""Pressure on meshes: closed forms of barges and spheres, and another program's hydrostatics."""

import csv
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import rotation
from vrx_mj.packages import root
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.physics.panels import panels_of, wrench_of_pressures, wrench_of_still_water

TABLES = root() / "assets" / "validation"
WEIGHT = 1025.0 * 9.81
BOX = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
FACES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
     (1, 5, 7), (1, 7, 3)], np.int64
)  # fmt: skip


def barge(length, beam, depth, up=0.0):
    return BOX * (length, beam, depth) + (0.0, 0.0, up), FACES


def off(name):
    lines = (TABLES / "hulls" / f"{name}.off").read_text(encoding="utf-8").split("\n")
    count, faces, _ = (int(word) for word in lines[1].split())
    vertices = np.array([[float(word) for word in line.split()] for line in lines[2 : 2 + count]])
    triangles = [[int(word) for word in line.split()[1:]] for line in lines[2 + count : 2 + count + faces]]
    return vertices, np.array(triangles, np.int64)


def wrench(mesh, roll=0.0, pitch=0.0, height=0.0, weight=WEIGHT):
    """World axes, about the link's origin."""
    vertices, triangles = mesh
    turn = rotation(roll, pitch, 0.0)
    found = wrench_of_still_water(panels_of(vertices, triangles), turn[2], height, weight)
    return np.concatenate((turn @ found[:3], turn @ found[3:]))


@pytest.mark.parametrize("draft", [0.1, 0.5, 0.9])
def test_a_barge_displaces_its_draft(draft):
    found = wrench(barge(4.0, 2.0, 1.0, up=0.5), height=-draft)
    assert found == pytest.approx((0, 0, WEIGHT * 8.0 * draft, 0, 0, 0), abs=1e-7)


@pytest.mark.parametrize(
    ("size", "weight", "kg", "stiffness"),
    [
        ((4.0, 2.0, 0.5), 1025.0 * 9.81, 0.5, (80_442.0, 16_758.75, 97_200.75)),
        ((10.0, 4.0, 1.0), 1000.0 * 9.81, 1.5, (392_400.0, 130_800.0, 2_877_600.0)),
    ],
)
def test_stiffness_of_barges(size, weight, kg, stiffness):
    """About the centre of mass, KG over the keel: C33 = rho g A, C44 = rho g V GM_T, C55 = rho g V GM_L."""
    length, beam, draft = size
    mesh, step = barge(length, beam, 3.0 * draft, up=0.5 * draft - kg + draft), 1e-4  # origin at the centre of mass
    height = kg - draft

    def restoring(heave=0.0, roll=0.0, pitch=0.0):
        return wrench(mesh, roll, pitch, height + heave, weight)[[2, 3, 4]]

    found = [
        (restoring(**{name: -step}) - restoring(**{name: step}))[index] / (2.0 * step)
        for index, name in enumerate(("heave", "roll", "pitch"))
    ]
    assert found == pytest.approx(stiffness, rel=1e-3)


def rows():
    with (TABLES / "hydrostatics.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


@pytest.mark.parametrize("row", rows(), ids=lambda row: f"{row['mesh']}-{row['heel']}-{row['trim']}")
def test_meshes_displace_what_another_program_says(row):
    mesh, heel, trim = off(row["mesh"]), math.radians(float(row["heel"])), math.radians(float(row["trim"]))
    found = wrench(mesh, heel, trim, weight=9810.0)
    volume = float(row["volume"])
    assert found[2] / 9810.0 == pytest.approx(volume, rel=5e-3)
    assert found[:2] == pytest.approx((0.0, 0.0), abs=1e-6 * found[2])
    center = -found[4] / found[2], found[3] / found[2]
    size = np.ptp(mesh[0], axis=0).max()
    assert center == pytest.approx((float(row["x"]), float(row["y"])), abs=5e-4 * size)
    step = 1e-5
    area = (wrench(mesh, heel, trim, -step, 9810.0) - wrench(mesh, heel, trim, step, 9810.0))[2] / (2 * step * 9810.0)
    assert area == pytest.approx(float(row["area"]), rel=5e-3)


@given(*[st.floats(-math.pi, math.pi)] * 2)
def test_a_closed_hull_far_under_water_feels_its_volume_alone(roll, pitch):
    """Archimedes: rho g V upward through the centre of volume, however it lies."""
    found = wrench(barge(1.0, 0.5, 0.2, up=0.3), roll, pitch, height=-9.0)
    lever = rotation(roll, pitch, 0.0) @ (0.0, 0.0, 0.3)
    lift = WEIGHT * 0.1
    assert found == pytest.approx((0, 0, lift, lever[1] * lift, -lever[0] * lift, 0), abs=1e-6 * lift)


@given(st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0))
def test_what_is_under_water_and_what_is_over_it_make_the_whole(roll, height):
    """The wet part of a body and that of the same body upside down, in water up to the same plane, fill it."""
    mesh = barge(1.0, 0.7, 0.4)
    below = wrench(mesh, roll, 0.0, height)[2]
    above = wrench(mesh, roll + math.pi, 0.0, -height)[2]
    assert below + above == pytest.approx(WEIGHT * 0.28, rel=1e-9)


def triangle_wrench(corners, pressures):
    """Of one triangle by the kernels, whose points may be in another order than its corners."""
    mesh = panels_of(corners, np.array([[0, 1, 2]]))
    places = [int(np.flatnonzero((corners == point).all(axis=1))[0]) for point in mesh.points.T]
    return wrench_of_pressures(mesh, pressures[places])


def test_dry_and_wet_corners_in_every_order():
    """A triangle cut anywhere gives what its parts give: pressure is linear, whatever the corners' numbers."""
    random = np.random.default_rng(3)
    for _ in range(12):
        corners, pressures = random.normal(size=(3, 3)), random.normal(size=3)
        order = random.permutation(3)
        turned = order if np.linalg.det(np.eye(3)[order]) > 0 else order[::-1]
        one, other = triangle_wrench(corners, pressures), triangle_wrench(corners[turned], pressures[turned])
        assert one == pytest.approx(other, abs=1e-12)
        fine, many = subdivided(corners, pressures, 48)
        assert one == pytest.approx(many, abs=2e-3), fine


@pytest.mark.parametrize("dry", [0.0, -0.0, -1e-300, -1e9])
def test_a_corner_at_the_surface_or_far_over_it_makes_no_trouble(dry):
    """The wet piece of a triangle grows from its whole to nothing as the dry corner rises."""
    corners = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    found = triangle_wrench(corners, np.array([3.0, dry, dry]))
    share = 3.0 / (3.0 - dry)
    assert found[2] == pytest.approx(-0.5 * share**2, rel=1e-12)
    assert np.isfinite(found).all()


def test_triangles_are_paired_across_their_longest_edges():
    """Each of a box's faces is a pair; every triangle is in one, with its outside outside."""
    vertices, triangles = barge(4.0, 2.0, 1.0)
    mesh = panels_of(vertices, triangles)
    found = sorted(sorted(mesh.points[:, list(pair)].T.tolist()) for pair in mesh.pairs)
    faces = [
        sorted(vertices[vertices[:, axis] == side].tolist()) for axis in range(3) for side in set(vertices[:, axis])
    ]
    assert found == sorted(faces)
    halves = np.concatenate([mesh.pairs[:, [0, 1, 2]], mesh.pairs[:, [0, 2, 3]]])
    corners = mesh.points.T[halves]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1)) > 0.0).all()


def test_a_triangle_without_a_neighbour_is_a_pair_of_its_own():
    fan = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 2.0, 0.0), (-1.0, 0.5, 0.0)])
    mesh = panels_of(fan, np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4)]))
    places = [[int(np.flatnonzero((fan == mesh.points[:, k]).all(axis=1))[0]) for k in pair] for pair in mesh.pairs]
    assert sorted(map(sorted, places)) == [[0, 1, 2, 2], [0, 2, 3, 4]]


def catamaran():
    vertices, triangles = barge(4.0, 0.5, 0.5)
    both = [vertices + np.array([0.0, side, 0.0]) for side in (-1.0, 1.0)]
    return np.concatenate(both), np.concatenate([triangles, triangles + len(vertices)])


def test_hulls_beside_each_other_are_parts():
    mesh = panels_of(*catamaran())
    assert [(part.center, part.start, part.size) for part in mesh.parts] == [
        ((0.0, -1.0, 0.0), 0, WIDTH), ((0.0, 1.0, 0.0), WIDTH, WIDTH)
    ]  # fmt: skip
    assert mesh.half == (2.0, 0.25, 0.25)
    assert (mesh.is_slender, mesh.is_shallow) == (True, True)


def test_a_bulb_under_a_hull_is_of_its_part():
    vertices, triangles = barge(4.0, 1.0, 0.5)
    both = np.concatenate([vertices, 0.2 * vertices - (0.0, 0.0, 1.0)])
    mesh = panels_of(both, np.concatenate([triangles, triangles + len(vertices)]))
    assert [part.size for part in mesh.parts] == [2 * WIDTH]
    assert mesh.points.shape == (3, 2 * WIDTH)


def test_the_shares_of_a_closed_surface_cancel():
    """The same pressure everywhere does nothing."""
    for vertices, triangles in (catamaran(), off("sphere")):
        shares = panels_of(vertices, triangles).shares
        assert shares.sum(axis=1) == pytest.approx(np.zeros(6), abs=1e-12 * np.abs(shares).sum())


def subdivided(corners, pressures, count):
    """The same by midpoints of many small triangles."""
    total = np.zeros(6)
    normal = 0.5 * np.cross(corners[1] - corners[0], corners[2] - corners[0]) / count**2
    for i in range(count):
        for j in range(count - i):
            for shift in ((1 / 3, 1 / 3), (2 / 3, 2 / 3)) if j < count - i - 1 else ((1 / 3, 1 / 3),):
                u, v = (i + shift[0]) / count, (j + shift[1]) / count
                weights = np.array([1 - u - v, u, v])
                pressure = max(weights @ pressures, 0.0)
                force = -pressure * normal
                total += np.concatenate((force, np.cross(weights @ corners, force)))
    return count, total
