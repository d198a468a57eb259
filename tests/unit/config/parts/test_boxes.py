"""Boxes: properties that hold wherever the parts are."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.config.parts.compliance import INSET, Box, assigned, load_rules, nearest_box, nearest_place

BOXES = {kind: load_rules("classic").of(kind).boxes for kind in ("components", "thrusters")}
KINDS = st.sampled_from(sorted(BOXES))
SHARES = st.tuples(*[st.floats(0.0, 1.0)] * 3)
NEAR = st.tuples(st.floats(-4, 4), st.floats(-3, 3), st.floats(-2, 4))


def inside(box, share):
    return tuple(low + (high - low) * part for low, high, part in zip(box.low, box.high, share, strict=True))


@given(kind=KINDS, index=st.integers(0, 4), share=SHARES)
def test_a_point_inside_a_box_passes(kind, index, share):
    boxes = BOXES[kind]
    point = inside(boxes[index % len(boxes)], share)
    assert assigned([point], boxes)[0] is not None


@pytest.mark.parametrize("kind", sorted(BOXES))
def test_faces_edges_and_corners_are_inside_and_a_micrometre_more_is_not(kind):
    for box in BOXES[kind]:
        for axis in range(3):
            for face, out in ((box.low, -1e-6), (box.high, 1e-6)):
                point = [*box.center]
                point[axis] = face[axis]
                assert box.contains(tuple(point))
                point[axis] += out
                assert not box.contains(tuple(point))
        assert box.contains(box.low)
        assert box.contains(box.high)


def test_a_face_is_where_it_is_written_though_floats_are_not():
    box = Box(name="a", center=(0.8, 0.0, 1.8), size=(1.0, 1.0, 1.0))
    assert box.low[0] != 0.3
    assert box.contains((0.3, 0.0, 1.3))


@given(kind=KINDS, point=NEAR, share=SHARES, index=st.integers(0, 4))
def test_the_nearest_place_of_a_lone_part_is_legal_and_nearest(kind, point, share, index):
    boxes = BOXES[kind]
    spot = nearest_place([point], 0, boxes)
    assert assigned([spot.point], boxes)[0] == spot.box
    assert spot.distance == pytest.approx(math.dist(point, spot.point))
    other = inside(boxes[index % len(boxes)], share)
    assert spot.distance <= math.dist(point, other) + 1e-9
    assert spot.distance == pytest.approx(nearest_box(point, boxes).distance)


@given(points=st.lists(NEAR, min_size=2, max_size=4), sample=NEAR)
def test_the_nearest_place_among_others_is_legal_and_nearest(points, sample):
    boxes = BOXES["thrusters"]
    before = assigned(points, boxes)

    def legal(place):
        after = assigned([place, *points[1:]], boxes)
        return after[0] is not None and all(new or not old for new, old in zip(after[1:], before[1:], strict=True))

    spot = nearest_place(points, 0, boxes)
    assert legal(spot.point)
    if legal(sample):
        assert spot.distance <= math.dist(points[0], sample) + 2.0 * INSET


@given(points=st.lists(NEAR, max_size=7))
def test_no_box_takes_more_than_it_has_room_for(points):
    boxes = BOXES["thrusters"]
    given_ = assigned(points, boxes)
    assert all(given_.count(box) <= box.capacity for box in boxes)
    for point, box in zip(points, given_, strict=True):
        assert (
            box.contains(point)
            if box
            else all(given_.count(other) == other.capacity for other in boxes if other.contains(point))
        )


def test_a_place_on_a_shared_face_leaves_the_others_theirs():
    boxes = BOXES["thrusters"]
    points = [(0.9, 0.8, 0.9), (0.9, 0.5, 0.0), (1.0, 1.2, 0.0)]
    assert [box and box.name.removeprefix("thruster_compliance_") for box in assigned(points, boxes)] == [
        None,
        "port_for",
        None,
    ]
    spot = nearest_place(points, 0, boxes)
    assert [bool(box) for box in assigned([spot.point, *points[1:]], boxes)][:2] == [True, True]


def test_no_box_with_room_is_no_place():
    box = Box(name="only", center=(0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0), capacity=1)
    assert nearest_place([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)], 1, [box]) is None
    assert nearest_place([(3.0, 0.0, 0.0)], 0, []) is None
    assert nearest_box((3.0, 0.0, 0.0), []) is None
