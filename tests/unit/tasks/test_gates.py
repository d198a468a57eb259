"""Gate geometry: by hand, by complex numbers, and with the gates of VRX's courses."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.tasks.streams import buoys, courses, frame, gate_names, pose, through
from vrx_mj.config.objects import load_object
from vrx_mj.model import tasks
from vrx_mj.tasks.gates import Gate, gate_between, marker_names, passage, side_of

COURSES = courses()
EAST = Gate(0.0, 0.0, 0.0, 10.0)
metres = st.floats(-100, 100)


def test_a_gate_is_crossed_with_its_left_marker_to_starboard():
    gate = gate_between(pose(20, -5), pose(20, 5))  # heading east, starboard is south
    assert gate == pytest.approx((20.0, 0.0, 0.0, 10.0))


@pytest.mark.parametrize(
    ("left", "right", "yaw"),
    [
        ((0, -1), (0, 1), 0.0),
        ((1, 0), (-1, 0), math.pi / 2),
        ((0, 1), (0, -1), math.pi),
        ((-1, 0), (1, 0), -math.pi / 2),
    ],
)
def test_directions_by_compass(left, right, yaw):
    turned = gate_between(pose(*left), pose(*right)).yaw - yaw
    assert (math.cos(turned), math.sin(turned)) == pytest.approx((1.0, 0.0), abs=1e-15)


def test_heights_of_the_buoys_widen_a_gate_as_in_vrx():
    assert gate_between(pose(0, -3, z=4.0), pose(0, 5, z=-2.0)).width == 10.0  # 8 and 6


@pytest.mark.parametrize(
    ("x", "y", "side"),
    [
        (-1e-9, 0, "before"),
        (0, 0, "after"),  # on the line is after
        (-3, 5, "before"),  # on the edge is inside
        (3, -5, "after"),
        (-3, 5.001, "outside"),
        (3, -5.001, "outside"),
        (-1e4, 0, "before"),  # however far
    ],
)
def test_sides_of_a_gate_that_leads_east(x, y, side):
    assert side_of(EAST, x, y) == side


@given(metres, metres, st.floats(-3, 3), st.floats(1, 50), metres, metres)
def test_sides_agree_with_complex_numbers(x, y, yaw, width, boat_x, boat_y):
    half = 0.5j * width * complex(math.cos(yaw), math.sin(yaw))
    left, right = complex(x, y) - half, complex(x, y) + half
    local = (complex(boat_x, boat_y) - (left + right) / 2) / ((right - left) / abs(right - left) / 1j)
    if abs(local.real) < 1e-9 or abs(abs(local.imag) - width / 2) < 1e-9:
        return  # rounding may decide
    expected = "outside" if abs(local.imag) > width / 2 else "after" if local.real > 0 else "before"
    gate = gate_between(pose(left.real, left.imag), pose(right.real, right.imag))
    assert side_of(gate, boat_x, boat_y) == expected


@pytest.mark.parametrize(
    ("before", "x", "way"),
    [
        ("before", 1, "forwards"),
        ("after", -1, "backwards"),
        ("outside", 1, None),
        ("outside", -1, None),
        ("before", -1, None),
        ("after", 1, None),
    ],
)
def test_a_passage_needs_both_sides_in_a_row(before, x, way):
    seen = frame(1.0, (x, 0), left=(0, -5), right=(0, 5))
    assert passage(tasks.Gate(left="left", right="right"), before, "wamv", seen)[1] == way


def test_beside_a_gate_there_is_no_passage():
    seen = frame(1.0, (1, 5.1), left=(0, -5), right=(0, 5))
    assert passage(tasks.Gate(left="left", right="right"), "before", "wamv", seen) == ("outside", None)


def test_marker_names_are_listed_once():
    gates = [tasks.Gate(left="a", right="b"), tasks.Gate(left="c", right="b")]
    assert marker_names(gates) == ("a", "b", "c")


@pytest.mark.parametrize("course", COURSES)
def test_the_shipped_courses_have_vrx_gates(course):
    places = {thing.name: tuple(thing.pose[:2]) for thing in load_object(course).objects}
    for number, (red, partner) in enumerate(COURSES[course]):
        names = [name for name in places if name.endswith(f"_bound_{number}") and not name.startswith("red")]
        assert len(names) == 1
        assert places[f"red_bound_{number}"] == pytest.approx(red, abs=0.006)  # the table has centimetres
        assert places[names[0]] == pytest.approx(partner, abs=0.006)
    assert sum(name.startswith("red_bound") for name in places) == len(COURSES[course])


@pytest.mark.parametrize("course", COURSES)
def test_every_gate_of_a_course_is_entered_before_and_left_after(course):
    poses = buoys(COURSES[course])
    for names, gate in zip(gate_names(len(COURSES[course])), COURSES[course], strict=True):
        found = gate_between(poses[names["left"]], poses[names["right"]])
        assert [side_of(found, *point) for point in through(gate)] == ["before", "after"]
