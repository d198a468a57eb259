"""Floating docks: the drag that their inertia takes up, and the lines that hold them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import moving, table
from vrx_mj.model import tables
from vrx_mj.physics.raft import RAFT_WORK, _add_drag, moor

NUMBER = st.floats(-5.0, 5.0)
STIFFNESS, DAMPING, DT = 2000.0, 500.0, 0.01


def cross_matrix(x, y, z):
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def dragged(point, k, kz):
    """Drag at a point as a matrix on the velocity and spin of the origin: J^T diag(k, k, kz) J with J = [1, -r x]."""
    jacobian = np.hstack([np.eye(3), -cross_matrix(*point)])
    return jacobian.T @ np.diag([k, k, kz]) @ jacobian


@given(st.tuples(NUMBER, NUMBER, NUMBER), st.floats(0.0, 10.0), st.floats(0.0, 10.0))
def test_drag_at_a_point_acts_on_all_six_velocities_of_the_origin(point, k, kz):
    found = np.zeros((6, 6))
    _add_drag(found, point, k, kz)
    assert found == pytest.approx(dragged(point, k, kz), abs=1e-9)
    assert np.linalg.eigvalsh(found).min() > -1e-9  # it takes power and gives none


def line(body, point):
    """A line that holds a block at a point of it, and that block's row and work."""
    row = {name: 0 for name in tables.BLOCK.names if not tables.BLOCK[name].shape}
    row |= {name: (0.0, 0.0, 0.0) for name in tables.BLOCK.names if tables.BLOCK[name].shape}
    blocks = table(tables.BLOCK, [row | {"parent": -1, "offset": (0.5, 0.0, 0.25)}])
    work = np.zeros(1, RAFT_WORK)
    work["frame"][0] = body
    settings = {"block": 0, "point": point, "anchor": (10.0, -3.0), "stiffness": STIFFNESS, "damping": DAMPING}
    return table(tables.MOORING, [settings])[0], blocks, work


def end_of(body, point):
    """Place and velocity of a point of a body, world axes."""
    turn = np.array(body[3:12]).reshape(3, 3)
    lever = turn @ point
    return np.array(body[:3]) + lever, turn @ np.array(body[12:15]) + np.cross(turn @ np.array(body[15:18]), lever)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.1, -0.2, 2.0)])
def test_a_line_pulls_back_to_its_anchor_by_where_its_end_will_be(angles):
    """Implicit in the velocity v of its end: -k (x + dt v) - c v, level; the rest of that is in the inertia."""
    point = np.array([1.0, 0.6, 0.2])
    body = moving((9.0, -3.5, 0.3), angles, (0.5, -0.2, 0.1, 0.05, 0.1, 0.3))
    own, blocks, work = line(body, point)
    wrench = np.array(moor(own, blocks, work, DT))
    place, velocity = end_of(body, point)
    force = -STIFFNESS * (place - (10.0, -3.0, 0.0)) - (DAMPING + DT * STIFFNESS) * velocity
    force[2] = 0.0
    assert wrench[:3] == pytest.approx(force)
    centre, _ = end_of(body, np.array([0.5, 0.0, 0.25]))
    assert wrench[3:] == pytest.approx(np.cross(place - centre, force))
    lever = place - np.array(body[:3])
    assert work["drag"][0] == pytest.approx(dragged(lever, DT * (DAMPING + DT * STIFFNESS), 0.0), abs=1e-9)


def test_a_line_whose_end_rests_at_its_anchor_pulls_nothing():
    own, blocks, work = line(moving((9.0, -3.0, 0.3)), (1.0, 0.0, 0.0))
    assert np.abs(moor(own, blocks, work, DT)).max() == pytest.approx(0.0, abs=1e-9)
