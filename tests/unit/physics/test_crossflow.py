"""Cross-flow drag by strips: closed forms of a plate, a second implementation, and what it does to energy."""

import numpy as np
import pytest
from numpy.random import default_rng

from unit.physics.rows import moving as placed
from unit.physics.rows import table as table_of
from vrx_mj.model.tables import STRIP
from vrx_mj.physics.drag import crossflow_drag
from vrx_mj.physics.motion import zero_wrench

RHO, CD, DRAFT, LENGTH = 1025.0, 0.9, 0.3, 4.0


def moving(**velocity):
    return placed(velocity=[velocity.get(name, 0.0) for name in "uvwpqr"])


def strips(count=400, stern=-2.0, height=0.0):
    """A plate of `LENGTH` m, whose strips are equal."""
    middles = stern + LENGTH * (np.arange(count) + 0.5) / count
    drag = 0.5 * RHO * CD * DRAFT * LENGTH / count
    return table_of(STRIP, [{"x": x, "z": height, "drag": drag, "lift": 0.0} for x in middles.tolist()])


def test_sway_is_the_drag_of_the_lateral_area():
    force = -0.5 * RHO * CD * DRAFT * LENGTH * 1.5**2
    assert crossflow_drag(strips(), moving(v=1.5)) == pytest.approx((0, force, 0, 0, 0, 0), rel=1e-12, abs=1e-9)
    assert crossflow_drag(strips(), moving(v=-1.5)) == pytest.approx((0, -force, 0, 0, 0, 0), rel=1e-12, abs=1e-9)


def test_yaw_is_the_integral_over_the_length():
    """N = -rho C_d T r|r| int_0^(L/2) x^3 dx = -rho C_d T L^4 / 64 r|r|, of which n strips miss 2 / n^2."""
    exact = -RHO * CD * DRAFT * LENGTH**4 / 64.0 * 0.25
    for n in (10, 20, 40, 80):
        assert crossflow_drag(strips(n), moving(r=0.5)).tz == pytest.approx(exact * (1.0 - 2.0 / n**2), rel=1e-12)


def test_sway_and_yaw_about_an_end_turn_about_it():
    """A plate that turns about its stern moves there not at all: Y = -rho/2 C_d T r|r| L^3/3, N = ... L^4/4."""
    found = crossflow_drag(strips(stern=0.0), moving(r=0.4))
    k = -0.5 * RHO * CD * DRAFT * 0.16
    assert found.fy == pytest.approx(k * LENGTH**3 / 3.0, rel=1e-4)
    assert found.tz == pytest.approx(k * LENGTH**4 / 4.0, rel=1e-4)


def test_roll_feels_drag_below_the_origin():
    """A plate at z = -0.5 m that rolls at p moves with 0.5 p: K = -0.5^3 rho/2 C_d T L p|p|, a drag."""
    found = crossflow_drag(strips(height=-0.5), moving(p=2.0))
    assert found.fy == pytest.approx(-0.5 * RHO * CD * DRAFT * LENGTH, rel=1e-12)
    assert found.tx == pytest.approx(-0.25 * RHO * CD * DRAFT * LENGTH, rel=1e-12)


def test_against_a_second_implementation_and_energy_is_only_lost():
    draw = default_rng(3)
    table = table_of(
        STRIP,
        [
            {"x": x, "z": z, "drag": k, "lift": lift}
            for x, z, k, lift in draw.uniform((-3, -1, 0, -20), (3, 1, 80, 20), (9, 4)).clip((-3, -1, 0, 0)).tolist()
        ],
    )
    for u, v, w, p, q, r in draw.normal(size=(200, 6)):
        found = np.array(crossflow_drag(table, moving(u=u, v=v, w=w, p=p, q=q, r=r)))
        places = np.stack([table["x"], np.zeros(9), table["z"]], axis=1)
        across = ((v * np.array([0, 1, 0]) + np.cross((p, 0, r), places)) * (0, 1, 0)).sum(axis=1)
        speed = np.hypot(u + q * table["z"], across)
        forces = np.outer(-(table["drag"] * np.abs(across) + table["lift"] * speed) * across, (0, 1, 0))
        assert found == pytest.approx([*forces.sum(axis=0), *np.cross(places, forces).sum(axis=0)], abs=1e-9)
        assert found @ (u, v, w, p, q, r) <= 1e-12
        mirrored = crossflow_drag(table, moving(u=u, v=-v, w=w, p=-p, q=q, r=-r))
        assert np.array(mirrored).tolist() == (found * (1, -1, 1, -1, 1, -1)).tolist()


def test_without_strips_or_motion_there_is_no_drag():
    assert crossflow_drag(strips(), moving()) == zero_wrench()
    assert crossflow_drag(strips()[:0], moving(v=3.0)) == zero_wrench()
