"""Estimates of hulls: closed forms of Lewis sections and ellipsoids, and Capytaine's figures of four boats."""

import math

import numpy as np
import pytest
import trimesh

from vrx_mj.mjcf.hull_estimate import _HOERNER, DENSITY, added_mass_of_sections, estimated_hull, shares_of_strips
from vrx_mj.packages import root


@pytest.mark.parametrize("draft", [0.2, 0.5, 1.5])
def test_sections_of_ellipses_have_the_added_mass_of_half_a_plate(draft):
    """Sway rho pi / 2 T2 and heave rho pi / 8 B2, whatever the other axis is."""
    breadth, area = np.array([1.0]), np.array([math.pi / 4.0 * draft])
    sway, heave = added_mass_of_sections(breadth, np.array([draft]), area)
    assert sway == pytest.approx(0.5 * math.pi * DENSITY * draft**2)
    assert heave == pytest.approx(0.125 * math.pi * DENSITY)


def test_a_square_section_has_more():
    """Half of 4.754 rho a2 of a square with edges 2 a (Newman 1977, table 4.3); a Lewis form has round corners."""
    sway, heave = added_mass_of_sections(*(np.array([value]) for value in (2.0, 1.0, 2.0)))
    assert sway == pytest.approx(heave)
    assert sway / (0.5 * DENSITY) == pytest.approx(4.754, rel=0.06)


def test_an_ellipsoid_has_the_added_mass_of_a_sphere_and_of_strips():
    assert shares_of_strips(2.0, 2.0, 1.0)[:2] == pytest.approx([0.5, 0.5], rel=2e-3)
    assert shares_of_strips(1000.0, 1.0, 0.3) == pytest.approx(np.ones(4), rel=1e-3)


def twins(robot, side):
    hull = trimesh.load_mesh(root() / "assets" / "robots" / robot / "meshes" / "water.obj", process=False)
    return np.concatenate([hull.triangles + np.array([0.0, y, 0.0]) for y in (side, -side)])


CAPYTAINE = {  # of the files of robots, surge, sway, heave, pitch, yaw
    "barge_4m": (trimesh.creation.box((4, 2, 1)).triangles, 4100.0, (1007, 2302, 5478, 5446, 2126)),
    "barge_10m": (trimesh.creation.box((10, 4, 2)).triangles, 41000.0, (8299, 24486, 56077, 385180, 145616)),
    "blueboat": (twins("blueboat", 0.365), 17.5, (1.3, 26, 12, 0.9, 2.1)),
    "heron": (twins("heron", 0.39), 35.0, (3, 51, 19, 1.6, 5.4)),
}


def test_added_mass_is_near_another_program_s():
    """As the files that are written say: 17 of 20 figures within 25 %, the worst within 42 %."""
    ratios = []
    for corners, mass, theirs in CAPYTAINE.values():
        own = np.diag(estimated_hull(np.asarray(corners), mass, 2).added_mass)[[0, 1, 2, 4, 5]]
        ratios.append(own / theirs)
    off = np.abs(np.array(ratios) - 1.0)
    assert (int((off < 0.25).sum()), float(off.max()) < 0.42) == (17, True)


def test_a_box_by_hand():
    box = np.asarray(trimesh.creation.box((4, 2, 1.2)).triangles) + np.array([7.0, 3.0, 0.6])
    boat = estimated_hull(box, 4100.0, 2)
    assert (boat.hulls, boat.length, boat.beam, boat.sheet.draft) == pytest.approx((1, 4.0, 2.0, 0.5))
    assert boat.sheet.center_of_mass == pytest.approx((0.0, 0.0, 0.1), abs=1e-9)
    assert boat.inertia == pytest.approx((4100.0 * 0.75**2, 4100.0, 4100.0))
    assert boat.windage == pytest.approx((1.4, 2.8, 0.35))
    speed = 0.4 * math.sqrt(9.80665 * 4.0)
    friction = 0.075 / (math.log10(speed * 4.0 / 1.19e-6) - 2.0) ** 2
    form = 1.0 + 25.6 / (4.0 * 2.0) - 0.095
    wanted = 0.5 * DENSITY * ((8.0 + 4.0 + 2.0) * friction * form + 0.8 + 0.2)
    assert boat.surge_drag == pytest.approx(wanted, rel=1e-6)
    assert boat.thrust * 2.0 == pytest.approx(wanted * speed**2)


def test_hulls_side_by_side_are_told_apart_and_damp_each_other_s_turn():
    corners, mass, _ = CAPYTAINE["heron"]
    boat = estimated_hull(corners, mass, 2)
    assert (boat.hulls, [y for _, y, _ in boat.engines]) == (2, pytest.approx([0.3626, -0.3626], abs=1e-3))
    assert boat.damping[5] == pytest.approx(2.0 * boat.surge_drag * boat.speed * 0.39**2, rel=1e-3)


def test_the_criterion_is_zero_with_the_skeg_that_is_advised():
    """The lift of a skeg without reserve makes C = Yv (Nr - m xg U) - Nv (Yr - m U) vanish."""
    barge, mass, _ = CAPYTAINE["barge_4m"]
    boat = estimated_hull(np.asarray(barge), mass, 2)
    x, _, area, aspect = boat.stern
    slope, fin = 6.13 * aspect / (aspect + 2.25), 6.13 / 3.25
    criterion, growth, _, skeg = boat.course
    lift = 0.5 * DENSITY * (area * slope + skeg / 1.25 * fin)
    a, iz = boat.added_mass, boat.damping[5]
    yv, yr = -lift, -(mass + a[0, 0] + lift * x)
    nv, nr = -(a[1, 1] - a[0, 0] + lift * x), -(a[1, 5] + lift * x**2 + iz / boat.speed)
    assert criterion < 0.0 < growth
    assert yv * nr - nv * yr == pytest.approx(0.0, abs=1e-6 * abs(yv * nr))


WIDE, NARROW, LONG, DRAFT = 2.0, 0.2, 6.0, 0.5
"""Of a wedge [m]: the breadth of its stern and of its bow."""


def wedge(ahead=0.0):
    """A wall-sided hull, wide astern, its mass so far ahead of the middle of what it displaces."""
    plan = [(0.0, -0.5 * WIDE), (LONG, -0.5 * NARROW), (LONG, 0.5 * NARROW), (0.0, 0.5 * WIDE)]
    hull = trimesh.convex.convex_hull([(x, y, z) for x, y in plan for z in (0.0, 2.0 * DRAFT)])
    return estimated_hull(
        np.asarray(hull.triangles),
        DENSITY * 0.5 * (WIDE + NARROW) * LONG * DRAFT,
        1,
        (float(hull.center_mass[0]) + ahead, 0.0, DRAFT),
    )


def test_heave_and_sway_are_coupled_with_turns_by_where_the_added_mass_is():
    """A wedge, wide astern: heave's is there, as the square of the breadth, sway's is over the length, as the draft."""
    boat = wedge()
    x = LONG * (np.arange(2000) + 0.5) / 2000
    breadth = WIDE + (NARROW - WIDE) * x / LONG
    off = x - breadth @ x / breadth.sum()  # of the centre of buoyancy
    sway, heave = added_mass_of_sections(breadth, np.full(2000, DRAFT), breadth * DRAFT)
    a = boat.added_mass
    assert a[1, 5] / a[1, 1] == pytest.approx(sway @ off / sway.sum(), rel=0.02)
    assert a[2, 4] / a[2, 2] == pytest.approx(-heave @ off / heave.sum(), rel=0.02)
    assert a[1, 5] > 0.0 < a[2, 4]
    assert np.array_equal(a, a.T)
    assert np.array_equal(a, wedge(ahead=0.3).added_mass)  # wherever the mass is


@pytest.mark.parametrize("ahead", [-0.4, 0.0, 0.3])
def test_a_small_turn_grows_as_the_equations_about_the_origin_say(ahead):
    """M nu' + N nu = 0 of sway and yaw (Fossen 2021, 6.5), ours are about the centre of mass."""
    boat = wedge(ahead)
    mass = DENSITY * boat.sheet.volume
    a, u, (x, _, area, aspect) = boat.added_mass, boat.speed, boat.stern
    lift = 0.5 * DENSITY * area * 6.13 * aspect / (aspect + 2.25)
    inertia = boat.inertia[2] + mass * ahead**2
    whole = [[mass + a[1, 1], mass * ahead + a[1, 5]], [mass * ahead + a[1, 5], inertia + a[5, 5]]]
    sway = [lift, mass + a[0, 0] + lift * x]
    yaw = [a[1, 1] - a[0, 0] + lift * x, mass * ahead + a[1, 5] + lift * x**2 + boat.damping[5] / u]
    roots = np.linalg.eigvals(-np.linalg.solve(whole, u * np.array([sway, yaw])))
    assert boat.course[1] == pytest.approx(float(roots.real.max()), rel=1e-9)
    _, _, moment, _ = boat.course
    assert (moment > 0.0) == (boat.course[0] < 0.0)


def test_the_broader_a_hull_for_its_draft_the_less_it_drags_across():
    broader, drag = np.diff(_HOERNER)
    assert np.all(broader > 0.0)
    assert np.all(drag < 0.0)
