"""Verdicts against a table of cases, made from the boxes and counts of VRX's rules."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import UnknownNameError, VrxWarning
from vrx_mj.formats.parts.compliance import INSET, Box, assign_boxes, judge, load_rules, nearest_box, nearest_place

FOR, AFT = "component_compliance_for", "component_compliance_aft"
PORT_AFT, STAR_AFT = "thruster_compliance_port_aft", "thruster_compliance_star_aft"
PORT_FOR, STAR_FOR = "thruster_compliance_port_for", "thruster_compliance_star_for"
MIDDLE = "thruster_compliance_middle"


def camera(**values):
    return ("wamv_camera", {"name": "front", **values})


def place(name, x, y, z):
    return (name, {"name": "part", "x": x, "y": y, "z": z})


COMPONENTS = {
    # one part, by its type, with the box that takes it
    "a camera by default": ([camera()], FOR),
    "a GPS by default, on two faces": ([("wamv_gps", {})], FOR),
    "an IMU by default, on a corner": ([("wamv_imu", {})], FOR),
    "a lidar by default": ([("lidar", {"name": "top"})], FOR),
    "a ball shooter by default": ([("wamv_ball_shooter", {})], FOR),
    "a pinger, tested against no box": ([("wamv_pinger", {"position": "1.0 0 -1.0"})], None),
    "a pinger far away": ([("wamv_pinger", {"position": "900 0 0"})], None),
    "a GPS aft, on the lower face": ([place("wamv_gps", -0.85, 0, 1.3)], AFT),
    "low corner of the forward box": ([place("wamv_gps", 0.3, -0.5, 1.3)], FOR),
    "high corner of the forward box": ([place("wamv_gps", 1.3, 0.5, 2.3)], FOR),
    "low corner of the aft box": ([place("wamv_gps", -1.15, -0.5, 1.3)], AFT),
    "high corner of the aft box": ([place("wamv_gps", -0.65, 0.5, 2.3)], AFT),
    "three cameras": ([camera(name=name) for name in "abc"], FOR),
    "two lidars": ([("lidar", {"name": "a"}), ("lidar", {"name": "b"})], FOR),
    "every permitted parameter": ([camera(R=0, P=0.1, Y=1, post_Y=2, visualize=True)], FOR),
}

REFUSED = {
    "a millimetre aft of the forward box": (
        [place("wamv_gps", 0.299, 0, 1.5)],
        f"outside every box; it misses {FOR} by 0.001 m: 0.001 m too far aft",
        (0.3, 0.0, 1.5),
    ),
    "a millimetre ahead of the aft box": (
        [place("wamv_gps", -0.649, 0, 1.5)],
        f"outside every box; it misses {AFT} by 0.001 m: 0.001 m too far forward",
        (-0.65, 0.0, 1.5),
    ),
    "over the cpu cases": (
        [place("wamv_gps", 0, 0, 1.5)],
        f"outside every box; it misses {FOR} by 0.3 m: 0.3 m too far aft",
        (0.3, 0.0, 1.5),
    ),
    "ahead": (
        [place("wamv_imu", 1.5, 0, 1.5)],
        f"outside every box; it misses {FOR} by 0.2 m: 0.2 m too far forward",
        (1.3, 0.0, 1.5),
    ),
    "too far to port": (
        [place("wamv_imu", 0.8, 0.75, 1.5)],
        f"outside every box; it misses {FOR} by 0.25 m: 0.25 m too far to port",
        (0.8, 0.5, 1.5),
    ),
    "too far to starboard": (
        [place("wamv_imu", -0.9, -0.75, 1.5)],
        f"outside every box; it misses {AFT} by 0.25 m: 0.25 m too far to starboard",
        (-0.9, -0.5, 1.5),
    ),
    "too low": (
        [place("wamv_imu", 0.8, 0, 1.29)],
        f"outside every box; it misses {FOR} by 0.01 m: 0.01 m too low",
        (0.8, 0.0, 1.3),
    ),
    "too high": (
        [place("wamv_imu", 0.8, 0, 3.3)],
        f"outside every box; it misses {FOR} by 1 m: 1 m too high",
        (0.8, 0.0, 2.3),
    ),
    "off a corner": (
        [place("wamv_imu", 1.6, 0.9, 1.5)],
        f"outside every box; it misses {FOR} by 0.5 m: 0.3 m too far forward, 0.4 m too far to port",
        (1.3, 0.5, 1.5),
    ),
    "a ball shooter on VRX's own suite's place, 4 mm under the box": (
        [place("wamv_ball_shooter", 0.54, 0.3, 1.296)],
        f"outside every box; it misses {FOR} by 0.004 m: 0.004 m too low",
        (0.54, 0.3, 1.3),
    ),
    "the first of two": (
        [camera(x=0), camera(name="other")],
        f"outside every box; it misses {FOR} by 0.3 m: 0.3 m too far aft",
        (0.3, 0.0, 1.5),
    ),
    "update_rate": ([("wamv_gps", {"update_rate": 5})], "parameter update_rate not permitted", None),
    "update_rate of the IMU": ([("wamv_imu", {"update_rate": 5})], "parameter update_rate not permitted", None),
    "post_z_from": ([camera(post_z_from=1.3)], "parameter post_z_from not permitted", None),
    "post_z_from of a lidar": (
        [("lidar", {"name": "a", "post_z_from": 1.2})],
        "parameter post_z_from not permitted",
        None,
    ),
    "frameId of a shooter": ([("wamv_ball_shooter", {"frameId": "a/b"})], "parameter frameId not permitted", None),
    "frameId of a pinger": ([("wamv_pinger", {"frameId": "a/b"})], "parameter frameId not permitted", None),
    "orientation of a pinger": (
        [("wamv_pinger", {"orientation": "0 0 1"})],
        "parameter orientation not permitted",
        None,
    ),
    "jazzy's name of a pinger": (
        [("wamv_pinger", {"sensor_name": "receiver"})],
        "parameter sensor_name not permitted; the macro of this VRX release has no such parameter",
        None,
    ),
}

TOO_MANY = {
    "wamv_camera": 3,
    "wamv_gps": 1,
    "wamv_imu": 1,
    "lidar": 2,
    "wamv_ball_shooter": 1,
    "wamv_pinger": 1,
    "wamv_p3d": 0,
}

LEFT, RIGHT = (-2.373776, 1.027135, 0.318237), (-2.373776, -1.027135, 0.318237)
ENGINES = {
    # places, and the box of each; None for one outside every box
    "layout H": ((LEFT, RIGHT), (PORT_AFT, STAR_AFT)),
    "layout T": ((LEFT, RIGHT, (0.0, 0.0, 0.318237)), (PORT_AFT, STAR_AFT, MIDDLE)),
    "layout X": ((LEFT, RIGHT, (1.6, 0.7, 0.25), (1.6, -0.7, 0.25)), (PORT_AFT, STAR_AFT, PORT_FOR, STAR_FOR)),
    "on the forward face": (((1.75, 1.0, 0.0), (1.75, -1.0, 0.0)), (PORT_FOR, STAR_FOR)),
    "on the aft face": (((-2.75, 1.5, 0.6), (-2.75, -1.5, -0.6)), (PORT_AFT, STAR_AFT)),
    "corners of the middle": (((-1.0, -0.5, -0.6),), (MIDDLE,)),
    "on a shared face, once": (((0.9, 0.5, 0.0),), (PORT_FOR,)),
    "on a shared face, twice: one in each box": (((0.9, 0.5, 0.0), (0.9, 0.5, 0.0)), (PORT_FOR, MIDDLE)),
    "on a shared face, three times": (((0.9, 0.5, 0.0),) * 3, (PORT_FOR, MIDDLE, None)),
    "a full box": ((LEFT, (-2.0, 1.0, 0.0)), (PORT_AFT, None)),
    "the middle twice": (((0.0, 0.0, 0.0), (0.2, 0.0, 0.0)), (MIDDLE, None)),
    "too high": (((-2.25, 1.0, 0.7),), (None,)),
    "too deep": (((-2.25, 1.0, -0.61),), (None,)),
    "between the hulls, aft": (((-2.25, 0.0, 0.0),), (None,)),
    "between the aft and the forward box": (((-0.5, 1.0, 0.0),), (None,)),
    "the first outside, the last inside": (((5.0, 1.0, 0.0), RIGHT), (None, STAR_AFT)),
}


def written(instances):
    """A component file with these instances, a type a key."""
    types = dict.fromkeys(name for name, _ in instances)
    lines = []
    for name in types:
        lines.append(f"{name}:\n")
        for _, values in (each for each in instances if each[0] == name):
            row = ", ".join(f"{key}: {str(value).lower() if value is True else value}" for key, value in values.items())
            lines.append(f"    - {{{row}}}\n")
    return "".join(lines)


def engines(*places):
    rows = (f"    - {{prefix: e{i}, position: {x} {y} {z}}}\n" for i, (x, y, z) in enumerate(places))
    return "engine:\n" + "".join(rows)


@pytest.mark.parametrize("case", COMPONENTS)
def test_components_that_pass(parts, case):
    instances, box = COMPONENTS[case]
    verdict = judge(parts(written(instances)), None)
    assert (verdict.compliant, verdict.reasons) == (True, ())
    assert [part.box and part.box.name for part in verdict.parts] == [box] * len(instances)
    assert (verdict.generator.passes, verdict.generator.errors) == (True, False)


@pytest.mark.parametrize("case", REFUSED)
def test_components_that_do_not(parts, case):
    instances, message, legal = REFUSED[case]
    verdict = judge(parts(written(instances)), None)
    first = verdict.parts[0]
    assert not verdict.compliant
    assert verdict.reasons == (f"{first.instance.type} {first.name}: {message}",)
    assert [breach.message for breach in first.breaches] == [message]
    assert (first.legal and first.legal.point) == (legal and pytest.approx(legal, abs=1e-12))


@pytest.mark.parametrize("name", TOO_MANY)
def test_one_more_than_the_rules_allow(parts, name):
    most = TOO_MANY[name]
    verdict = judge(parts(written([(name, {"name": f"n{i}"}) for i in range(most + 1)])), None)
    assert verdict.reasons == (f"{most + 1} {name} requested, maximum {most}",)
    assert [part.compliant for part in verdict.parts] == [True] * most + [False]
    assert verdict.parts[-1].breaches[0].message == f"number {most + 1} of its type; at most {most}"
    assert (verdict.generator.passes, verdict.generator.errors) == (True, True)


@pytest.mark.parametrize("case", ENGINES)
def test_engines_get_the_first_box_with_room(parts, case):
    places, boxes = ENGINES[case]
    verdict = judge(None, parts(engines(*places), "thrusters"))
    assert tuple(part.box and part.box.name for part in verdict.parts) == boxes
    assert verdict.compliant == (None not in boxes)
    assert verdict.generator.passes == (boxes[-1] is not None)
    assert verdict.generator.errors == (None in boxes)


def test_five_engines_are_too_many_though_there_are_five_boxes(parts):
    file = parts(engines(LEFT, RIGHT, (1, 1, 0), (1, -1, 0), (0, 0, 0)), "thrusters")
    verdict = judge(None, file)
    assert all(part.box for part in verdict.parts)
    assert verdict.reasons == ("5 engine requested, maximum 4",)


def test_a_full_box_is_named_and_the_nearest_with_room_is_shown(parts):
    verdict = judge(None, parts(engines((0, 0, 0), (0.3, 0.2, 0.1)), "thrusters"))
    assert verdict.reasons == (f"engine e1: inside {MIDDLE}, which is full",)
    legal = verdict.parts[1].legal
    assert legal.box.name == PORT_FOR
    assert legal.point == (0.75, 0.5, 0.1)
    assert legal.distance == pytest.approx((0.45**2 + 0.3**2) ** 0.5)


def test_two_full_boxes_are_both_named(parts):
    verdict = judge(None, parts(engines(*[(0.9, 0.5, 0.0)] * 3), "thrusters"))
    assert verdict.reasons == (f"engine e2: inside {PORT_FOR} and {MIDDLE}, which are full",)


def test_no_place_is_left_for_a_sixth_engine(parts):
    file = parts(engines(LEFT, RIGHT, (1, 1, 0), (1, -1, 0), (0, 0, 0), (9, 9, 9)), "thrusters")
    assert judge(None, file).parts[5].legal is None


def test_parts_that_must_move_are_not_sent_to_one_place(parts):
    verdict = judge(None, parts(engines((-2.25, 1.6, 0), (-2.25, 1.7, 0)), "thrusters"))
    assert [part.legal.box.name for part in verdict.parts] == [PORT_AFT, MIDDLE]


RULES = {
    "a pinger of classic": (written([("wamv_pinger", {"name": "pinger"})]), {"classic"}),
    "a pinger of jazzy": (written([("wamv_pinger", {"sensor_name": "receiver"})]), {"jazzy"}),
    "a ball shooter": (written([("wamv_ball_shooter", {})]), {"classic", "jazzy"}),
    "ground truth": (written([("wamv_p3d", {"name": "p3d_wamv"})]), {"2019"}),
    "visualize": (written([camera(visualize=True)]), {"classic", "jazzy"}),
    "a camera": (written([camera(P=0.1)]), {"classic", "jazzy", "2019"}),
    "an engine at x 0.6": (engines((0.6, 1, 0)), {"2019"}),
    "an engine at x 1.7": (engines((1.7, 1, 0)), {"classic", "jazzy"}),
    "an engine at x 1.0": (engines((1.0, -1, 0)), {"classic", "jazzy", "2019"}),
}


@pytest.mark.parametrize("rules", ["classic", "jazzy", "2019"])
@pytest.mark.parametrize("case", RULES)
def test_rules_differ_by_release(parts, case, rules):
    text, passing = RULES[case]
    kind = "thrusters" if text.startswith("engine") else "components"
    file = parts(text, kind)
    verdict = judge(file, None, rules) if kind == "components" else judge(None, file, rules)
    assert verdict.compliant == (rules in passing)


def test_a_type_that_the_rules_do_not_know(parts):
    verdict = judge(parts(written([("wamv_pinger", {})])), None, "2019")
    assert verdict.reasons == ("type wamv_pinger is not an accepted component type",)
    assert (verdict.generator.passes, verdict.generator.stops) == (None, ("type wamv_pinger",))


def test_there_are_only_these_rules():
    with pytest.raises(UnknownNameError) as caught:
        judge(None, None, "2016")
    assert str(caught.value) == "no set of rules named '2016'; did you mean '2019'?"


def test_vrx_judges_by_the_last_part_alone(parts):
    text = written([camera(name="a", x=5), camera(name="b")])
    verdict = judge(parts(text), None)
    assert not verdict.compliant
    assert (verdict.generator.passes, verdict.generator.errors) == (True, True)
    verdict = judge(parts(written([camera(name="b"), camera(name="a", x=5)])), None)
    assert (verdict.generator.passes, verdict.generator.errors) == (False, True)


def test_vrx_takes_a_piece_of_a_permitted_name_for_permitted(parts):
    verdict = judge(parts("wamv_pinger: [{name: pinger}]\n"), None, "jazzy")
    assert verdict.reasons == (
        "wamv_pinger pinger: parameter name not permitted; the macro of this VRX release has no such parameter",
    )
    assert (verdict.generator.passes, verdict.generator.errors) == (True, False)


@pytest.mark.parametrize(("rules", "passes"), [("classic", False), ("jazzy", True), ("2019", False)])
def test_an_empty_file_is_legal_whatever_vrx_says(parts, rules, passes):
    verdict = judge(parts(""), parts("", "thrusters"), rules)
    assert (verdict.compliant, verdict.parts) == (True, ())
    assert (verdict.generator.passes, verdict.generator.errors) == (passes, not passes)


def test_both_files_count(parts):
    good, bad = parts(written([camera()])), parts(engines((9, 9, 9)), "thrusters")
    assert judge(good, None).compliant
    verdict = judge(good, bad)
    assert [part.kind for part in verdict.parts] == ["components", "thrusters"]
    assert (verdict.compliant, verdict.generator.passes) == (False, False)


@pytest.mark.parametrize("rules", ["classic", "jazzy", "2019"])
def test_a_name_that_ros_refuses_is_told_beside_the_verdict(parts, rules):
    text = 'engine: [{prefix: back-left, position: "-2.373776 1.027135 0.318237", orientation: "0 0 0"}]\n'
    verdict = judge(None, parts(text, "thrusters"), rules)
    assert verdict.compliant
    (part,) = verdict.parts
    assert part.warning == "ROS refuses the name 'back-left': a letter, then letters, digits and '_' are allowed"


def test_a_lidar_of_unknown_type_counts(parts):
    with pytest.warns(VrxWarning):
        file = parts("lidar: [{name: a, type: 64_beam}, {name: b}, {name: c}]\n")
    assert judge(file, None).reasons == ("3 lidar requested, maximum 2",)


def test_there_are_enough_cases():
    assert len(COMPONENTS) + len(REFUSED) + len(TOO_MANY) + len(ENGINES) >= 55


# Boxes: properties that hold wherever the parts are


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
    assert assign_boxes([point], boxes)[0] is not None


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
    assert assign_boxes([spot.point], boxes)[0] == spot.box
    assert spot.distance == pytest.approx(math.dist(point, spot.point))
    other = inside(boxes[index % len(boxes)], share)
    assert spot.distance <= math.dist(point, other) + 1e-9
    assert spot.distance == pytest.approx(nearest_box(point, boxes).distance)


@given(points=st.lists(NEAR, min_size=2, max_size=4), sample=NEAR)
def test_the_nearest_place_among_others_is_legal_and_nearest(points, sample):
    boxes = BOXES["thrusters"]
    before = assign_boxes(points, boxes)

    def legal(place):
        after = assign_boxes([place, *points[1:]], boxes)
        return after[0] is not None and all(new or not old for new, old in zip(after[1:], before[1:], strict=True))

    spot = nearest_place(points, 0, boxes)
    assert legal(spot.point)
    if legal(sample):
        assert spot.distance <= math.dist(points[0], sample) + 2.0 * INSET


@given(points=st.lists(NEAR, max_size=7))
def test_no_box_takes_more_than_it_has_room_for(points):
    boxes = BOXES["thrusters"]
    given_ = assign_boxes(points, boxes)
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
    assert [box and box.name.removeprefix("thruster_compliance_") for box in assign_boxes(points, boxes)] == [
        None,
        "port_for",
        None,
    ]
    spot = nearest_place(points, 0, boxes)
    assert [bool(box) for box in assign_boxes([spot.point, *points[1:]], boxes)][:2] == [True, True]


def test_no_box_with_room_is_no_place():
    box = Box(name="only", center=(0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0), capacity=1)
    assert nearest_place([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)], 1, [box]) is None
    assert nearest_place([(3.0, 0.0, 0.0)], 0, []) is None
    assert nearest_box((3.0, 0.0, 0.0), []) is None
