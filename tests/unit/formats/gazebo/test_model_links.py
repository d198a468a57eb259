"""Links of models of Gazebo on joints: trees, frames of axes, and what is wrong with a joint."""

import math
from pathlib import Path

import pytest

from vrx_mj.config.base import keys_of
from vrx_mj.config.objects import AxisConfig
from vrx_mj.config.values import MAX_NUMBER
from vrx_mj.errors import ConfigError
from vrx_mj.formats.gazebo.document import Report
from vrx_mj.formats.gazebo.sdf_objects import model_section

TYPES = "fixed, revolute, continuous, prismatic, ball, universal, screw, revolute2 or gearbox"
BOX = '<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>'


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def link(name, pose="0 0 0 0 0 0", mass=10.0, content=BOX):
    inertia = "<inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia>"
    inertial = f"<inertial><mass>{mass}</mass>{inertia}</inertial>"
    return f'<link name="{name}"><pose>{pose}</pose>{inertial}{content}</link>'


def joint(name, kind, parent, child, content="<axis><xyz>0 0 1</xyz></axis>"):
    ends = f"<parent>{parent}</parent><child>{child}</child>"
    return f'<joint name="{name}" type="{kind}">{ends}{content}</joint>'


def read(body, version="1.6"):
    """The object of a model, and what became of each joint and link in it."""
    Path("m.sdf").write_text(f'<sdf version="{version}"><model name="m">\n{body}</model></sdf>', encoding="utf-8")
    report = Report()
    found = model_section(Path("m.sdf"), report)
    notes = [f"{note.what} {note.fate}: {note.ours}" for note in report.notes if note.what != "<model> 'm'"]
    return found, notes


def refusal(body):
    with pytest.raises(ConfigError) as caught:
        read(body)
    return str(caught.value)


def plain(value):
    """Sections and items as dicts and lists."""
    if hasattr(value, "items"):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value


def test_a_hinge_keeps_its_links_apart():
    dynamics = "<damping>0.5</damping><friction>0.1</friction><spring_stiffness>3</spring_stiffness>"
    limits = "<limit><lower>-1</lower><upper>2</upper><effort>5</effort></limit>"
    more = "<spring_reference>-0.2</spring_reference>"
    axis = f"<pose>0 0 0.5 0 0 0</pose><axis><xyz>0 1 0</xyz>{limits}<dynamics>{dynamics}{more}</dynamics></axis>"
    found, notes = read(
        link("base") + link("arm", "1 0 2 0 0 0", 3.0) + joint("hinge", "revolute", "base", "arm", axis)
    )
    (arm,), (hinge,) = plain(found["links"]), plain(found["joints"])
    assert (found["link"], found["mass"]) == ("base", 10.0)
    assert (arm["name"], arm["pose"], arm["mass"]) == ("arm", [1, 0, 2, 0, 0, 0], 3.0)
    assert arm["buoyancy"]["elements"] == [{"type": "box", "size": [1, 1, 1]}]
    assert hinge == {
        "name": "hinge",
        "type": "revolute",
        "parent": "base",
        "child": "arm",
        "pose": [0, 0, 0.5, 0, 0, 0],
        "axis": {
            "xyz": [0, 1, 0],
            "limits": [-1, 2],
            "damping": 0.5,
            "friction": 0.1,
            "stiffness": 3.0,
            "spring_reference": -0.2,
        },
    }
    assert set(hinge["axis"]) == set(keys_of(AxisConfig))
    assert notes == ["<joint> 'hinge' imported: `joints`"]


@pytest.mark.parametrize(
    ("kind", "content", "expected", "note"),
    [
        ("continuous", "<axis><xyz>1 0 0</xyz></axis>", "continuous", "imported: `joints`"),
        ("prismatic", "<axis><xyz>1 0 0</xyz></axis>", "prismatic", "imported: `joints`"),
        ("universal", "<axis/><axis2><xyz>0 1 0</xyz></axis2>", "universal", "imported: `joints`"),
        ("ball", "", "ball", "imported: `joints`"),
        ("screw", "<axis/>", "revolute", "approximated: `joints`: a revolute joint that does not advance"),
        ("revolute2", "<axis/><axis2/>", "universal", "approximated: `joints`: a universal joint"),
    ],
)
def test_types_of_joints(kind, content, expected, note):
    found, notes = read(link("base") + link("arm") + joint("j", kind, "base", "arm", content))
    (own,) = plain(found["joints"])
    assert own["type"] == expected
    assert notes == [f"<joint> 'j' {note}"]
    assert ("axis2" in own) == (expected == "universal")
    assert ("axis" in own) == (expected != "ball")


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        ("", None),
        ("<lower>-1e16</lower><upper>1e16</upper>", None),
        ("<lower>-inf</lower><upper>inf</upper>", None),
        ("<lower>-2</lower><upper>1e16</upper>", [-2.0, 1e9]),
        ("<upper>3</upper>", [-1e9, 3.0]),
    ],
)
def test_limits_that_are_none(limit, expected):
    axis = f"<axis><limit>{limit}</limit></axis>"
    found, _ = read(link("base") + link("arm") + joint("j", "revolute", "base", "arm", axis))
    assert plain(found["joints"])[0]["axis"].get("limits") == expected


@pytest.mark.parametrize(
    ("kind", "axis", "note"),
    [
        ("fixed", "", "its links are merged into one rigid body"),
        (
            "revolute",
            "<axis><limit><lower>0</lower><upper>0</upper></limit></axis>",
            "its limits are equal, so it is fixed: its links are merged into one rigid body",
        ),
    ],
)
def test_links_that_cannot_move_are_one_body(kind, axis, note):
    found, notes = read(link("base") + link("arm", "0 0 4 0 0 0") + joint("j", kind, "base", "arm", axis))
    assert "links" not in found
    assert (found["mass"], plain(found["center_of_mass"])) == (20.0, [0, 0, 2])
    assert notes == [f"<joint> 'j' imported: {note}"]


def test_what_is_fixed_to_a_moving_link_moves_with_it():
    body = link("base") + link("arm", "1 0 0 0 0 0") + link("hand", "3 0 0 0 0 0")
    body += joint("a", "fixed", "hand", "arm", "") + joint("b", "revolute", "base", "arm")
    found, _ = read(body)
    (arm,) = plain(found["links"])
    assert (arm["name"], arm["pose"], arm["mass"], arm["center_of_mass"]) == (
        "arm",
        [1, 0, 0, 0, 0, 0],
        20.0,
        [1, 0, 0],
    )
    assert [shape.get("pose", [0] * 6)[0] for shape in arm["collisions"]] == [0, 2]


def test_a_joint_to_the_world_holds_the_model():
    found, notes = read(
        link("post") + link("arm") + joint("a", "fixed", "world", "post", "") + joint("b", "ball", "post", "arm")
    )
    assert (found["static"], found["link"], [one["name"] for one in found["links"]]) == (True, "post", ["arm"])
    assert "mass" not in found
    assert notes == ["<joint> 'a' imported: `static`", "<joint> 'b' imported: `joints`"]
    found, _ = read(link("door") + joint("hinge", "revolute", "world", "door"))
    assert (found["static"], found["link"], plain(found["joints"])[0]["parent"]) == (True, "world", "world")


def test_a_joint_may_be_given_from_the_outer_link():
    """The root is the link from which all joints lead; of one that leads to it parent and child are swapped."""
    axes = "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>"
    body = link("a") + link("b", "0 0 1 0 0 0") + link("c", "0 0 5 0 0 0")
    found, _ = read(body + joint("ab", "revolute", "a", "b") + joint("cb", "universal", "c", "b", axes))
    _, own = plain(found["joints"])
    assert (own["parent"], own["child"], own["pose"][:3]) == ("b", "c", [0, 0, -4])
    assert (own["axis"]["xyz"], own["axis2"]["xyz"]) == ([0, -1, 0], [-1, 0, 0])


def test_links_and_joints_may_share_names_but_not_with_their_likes():
    body = link("arm") + link("a::b") + link("a__b") + joint("arm", "revolute", "arm", "a::b")
    found, _ = read(body + joint("arm", "ball", "arm", "a__b", ""))
    assert [one["name"] for one in found["links"]] == ["a__b", "a__b_2"]
    assert [one["name"] for one in plain(found["joints"])] == ["arm", "arm_2"]


def test_a_loop_of_joints_is_opened_once():
    body = link("a") + link("b") + link("c")
    body += joint("ab", "revolute", "a", "b") + joint("bc", "revolute", "b", "c") + joint("ca", "revolute", "c", "a")
    found, notes = read(body)
    assert len(found["joints"]) == len(found["links"]) == 2
    assert [note for note in notes if "approximated" in note] == [
        "<joint> 'bc' approximated: it closes a loop of joints; it is left out, and the loop stays open"
    ]


def test_a_link_without_a_joint_is_part_of_the_first():
    found, notes = read(link("a") + link("b") + link("c", "4 0 0 0 0 0") + joint("ab", "revolute", "a", "b"))
    assert (found["mass"], plain(found["center_of_mass"]), len(found["links"])) == (20.0, [2, 0, 0], 1)
    assert notes == [
        "<joint> 'ab' imported: `joints`",
        "<link> 'c' approximated: no joint holds c: part of the first link's rigid body",
    ]


def test_links_of_models_in_models_hang_on_joints_too():
    inner = f'<model name="leg"><pose>0 0 -1 0 0 0</pose>{link("foot", "0 0 -1 0 0 0")}</model>'
    found, _ = read(link("base") + inner + joint("j", "revolute", "base", "leg::foot"))
    (foot,) = plain(found["links"])
    assert (foot["name"], foot["pose"]) == ("leg__foot", [0, 0, -2, 0, 0, 0])


def test_ends_may_be_frames():
    frame = '<frame name="tip" attached_to="arm"><pose>0 0 1 0 0 0</pose></frame>'
    found, _ = read(link("base") + link("arm", "2 0 0 0 0 0") + frame + joint("j", "revolute", "base", "tip"), "1.8")
    (own,) = plain(found["joints"])
    assert (own["child"], own["pose"]) == ("arm", [0, 0, 1, 0, 0, 0])


QUARTER = math.pi / 2


@pytest.mark.parametrize(
    ("version", "direction", "expected"),
    [
        ("1.6", "<xyz>1 0 0</xyz>", [1, 0, 0]),  # the joint's frame, which is turned by a quarter about z
        ("1.4", "<xyz>1 0 0</xyz>", [0, -1, 0]),  # the model's
        ("1.6", "<xyz>1 0 0</xyz><use_parent_model_frame>1</use_parent_model_frame>", [0, -1, 0]),
        ("1.7", '<xyz expressed_in="base">1 0 0</xyz>', [0, -1, 0]),
        ("1.7", '<xyz expressed_in="__model__">1 0 0</xyz>', [0, -1, 0]),
        ("1.7", '<xyz expressed_in="arm">1 0 0</xyz>', [1, 0, 0]),
    ],
)
def test_an_axis_is_in_the_frame_that_its_version_says(version, direction, expected):
    body = link("base") + link("arm", f"1 0 0 0 0 {QUARTER!r}")
    found, _ = read(body + joint("j", "revolute", "base", "arm", f"<axis>{direction}</axis>"), version)
    assert plain(found["joints"])[0]["axis"]["xyz"] == pytest.approx(expected, abs=1e-12)


def test_endless_damping_is_the_largest_that_there_is():
    """ArduPilot's wsc_aircraft holds its wings with 5e80."""
    dynamics = "<dynamics><damping>5e80</damping><friction>5e80</friction></dynamics>"
    found, _ = read(link("a") + link("b") + joint("j", "revolute", "a", "b", f"<axis>{dynamics}</axis>"))
    axis = plain(found["joints"])[0]["axis"]
    assert (axis["damping"], axis["friction"]) == (MAX_NUMBER, MAX_NUMBER)


def test_a_static_model_does_not_move():
    found, notes = read("<static>true</static>" + link("a") + link("b") + joint("j", "revolute", "a", "b"))
    assert (found["static"], "links" in found, len(found["collisions"])) == (True, False, 2)
    assert notes == ["<joint> 'j' imported: the model is static"]


def test_what_would_sink_stands_and_moves_its_joints():
    found, _ = read(link("tower", mass=5000.0) + link("arm") + joint("j", "revolute", "tower", "arm"))
    assert (found["static"], "buoyancy" in found["links"][0], len(found["joints"])) == (True, False, 1)


def test_each_link_displaces_what_the_plugin_says_of_it():
    def part(name):
        shape = "<geometry><sphere><radius>1</radius></sphere></geometry>"
        return f"<buoyancy><link_name>{name}</link_name>{shape}</buoyancy>"

    plugins = "".join(
        f'<plugin filename="libbuoyancy_gazebo_plugin.so"><linear_drag>{drag}</linear_drag>{part(name)}</plugin>'
        for drag, name in ((3, "arm"), (7, "base"))
    )
    found, _ = read(link("base") + link("arm") + joint("j", "revolute", "base", "arm") + plugins)
    own, other = plain(found["buoyancy"]), plain(found["links"][0]["buoyancy"])
    assert (own["linear_drag"], other["linear_drag"]) == (7.0, 3.0)
    assert own["elements"] == other["elements"] == [{"type": "sphere", "radius": 1.0}]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (joint("j", "revolute", "a", "d"), "m.sdf:2: joint 'j' / child: no link named 'd'; known: a, b"),
        (joint("j", "revolute", "a", "a"), "m.sdf:2: joint 'j': joins the link 'a' to itself"),
        (
            '<joint name="j" type="revolute"><parent>a</parent></joint>',
            "m.sdf:2: joint 'j' / child: required, but missing",
        ),
        (
            joint("j", "hinge", "a", "b"),
            f"m.sdf:2: joint 'j' / type: expected {TYPES}, got 'hinge'",
        ),
        (
            joint("j", "revolute", "a", "b", "<axis><xyz>0 0 0</xyz></axis>"),
            "m.sdf:2: joint 'j' / axis / xyz: must not be zero, got '0 0 0'",
        ),
        (
            joint("j", "revolute", "a", "b", "<axis><xyz>0 nan 0</xyz></axis>"),
            "m.sdf:2: joint 'j' / axis / xyz: must be finite, got 'nan'",
        ),
        (
            joint("j", "revolute", "a", "b", "<axis><limit><lower>2</lower><upper>1</upper></limit></axis>"),
            "m.sdf:2: joint 'j' / axis / limit: lower 2 is above upper 1",
        ),
        (
            joint("j", "revolute", "a", "b", "<axis><limit><lower>low</lower></limit></axis>"),
            "m.sdf:2: joint 'j' / axis / limit / lower: expected a number, got 'low'",
        ),
        (
            joint("j", "revolute", "a", "b", "<axis><dynamics><damping>-1</damping></dynamics></axis>"),
            "m.sdf:2: joint 'j' / axis / dynamics / damping: must be at least 0, got -1",
        ),
        (
            joint("j", "revolute", "a", "b", '<axis><xyz expressed_in="c">1 0 0</xyz></axis>'),
            "m.sdf:2: joint 'j': no frame named 'c'; known: a, b, j",
        ),
    ],
)
def test_a_wrong_joint_is_named_with_its_place(text, expected):
    assert refusal(link("a") + link("b") + text) == expected
