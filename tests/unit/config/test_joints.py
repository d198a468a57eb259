"""Links and joints of an object's file: a tree from its own link, and what is wrong where it is none."""

import pytest
import yaml

from vrx_mj.config.objects import MOST_LINKS, JointConfig, link_order, load_object
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxWarning

LINK = {"mass": 2.0, "inertia": [1.0, 1.0, 1.0]}
BUOYANCY = {"linear_drag": 1.0, "angular_drag": 1.0, "elements": [{"type": "box", "size": [1, 1, 1]}]}


def joint(name="j", parent="link", child="arm", **other):
    return {"name": name, "type": "revolute", "parent": parent, "child": child, **other}


def jointed(joints, links=("arm",), **other):
    return {"static": True, "links": [{"name": name, **LINK} for name in links], "joints": list(joints), **other}


def loaded(here, content):
    (here / "mine.yaml").write_text(yaml.safe_dump(content, sort_keys=False), "utf-8")
    return load_object("mine")


def faults(here, content):
    """Messages about the object's file, without its places."""
    with pytest.raises(ConfigError) as caught:
        loaded(here, content)
    return [f"{problem.key}: {problem.message}" for problem in caught.value.problems]


@pytest.mark.usefixtures("here")
def test_a_link_hangs_on_another_by_a_joint(here):
    thing = loaded(here, jointed([joint(axis={"xyz": [0, 1, 0], "limits": [-1, 2]})]))
    (own,) = thing.joints
    assert thing.kind == "static"
    assert (own.axis.xyz, own.axis.limits, own.axis.damping) == ((0.0, 1.0, 0.0), (-1.0, 2.0), 0.0)


@pytest.mark.usefixtures("here")
def test_what_floats_may_float_by_its_other_links_alone(here):
    afloat = jointed([joint()], static=False, mass=1.0, inertia=[1, 1, 1])
    afloat["links"][0]["buoyancy"] = BUOYANCY
    thing = loaded(here, afloat)
    assert (thing.kind, thing.whole_mass) == ("floating", 3.0)


@pytest.mark.usefixtures("here")
def test_what_sinks_is_the_whole_with_all_its_links(here):
    afloat = jointed([joint()], static=False, mass=999.0, inertia=[1, 1, 1], buoyancy=BUOYANCY)
    loaded(here, afloat)
    with pytest.warns(VrxWarning) as caught:
        load_world({"objects": [{"name": "a", "model": "mine"}]})
    assert [str(item.message) for item in caught] == [
        "mine.yaml: sinks: mass 1001 kg; its buoyancy displaces at most 1000 kg"
    ]


def test_links_come_after_those_they_hang_on():
    pairs = [("b", "c"), ("link", "a"), ("a", "d"), ("link", "b")]
    joints = [JointConfig(name=f"{p}{c}", type="revolute", parent=p, child=c) for p, c in pairs]
    assert link_order("link", joints) == ["a", "b", "d", "c"]


@pytest.mark.parametrize(
    ("joints", "links", "expected"),
    [
        ([joint(parent="arn")], ["arm"], ["joints[0].parent: no link named 'arn'; known: link, arm"]),
        ([joint(child="leg")], ["arm"], ["joints[0].child: no link named 'leg'; known: link, arm"]),
        ([joint(parent="arm")], ["arm"], ["joints[0].child: joins the link 'arm' to itself"]),
        (
            [joint(parent="arm", child="link")],
            ["arm"],
            ["joints[0].child: 'link' is the root link, which has no parent; swap parent and child"],
        ),
        (
            [joint("p", "a", "b"), joint("q", "b", "c"), joint("r", "c", "a")],
            ["a", "b", "c"],
            ["joints[0]: the links form a loop: b > a > c > b"],
        ),
        (
            [joint("p"), joint("q", "b", "arm"), joint("r", "link", "b")],
            ["arm", "b"],
            ["joints[1].child: link 'arm' is already the child of joint 'p'"],
        ),
        ([joint("p"), joint("p", "arm", "b")], ["arm", "b"], ["joints[1].name: duplicate name 'p'"]),
        (
            [joint()],
            ["arm", "b"],
            ["links[1].name: link 'b' is not the child of a joint; only the root link 'link' may have none"],
        ),
        ([joint()], ["arm", "link"], ["links[1].name: duplicate name 'link'"]),
        (
            [],
            ["arm"],
            ["links[0].name: link 'arm' is not the child of a joint; only the root link 'link' may have none"],
        ),
    ],
)
@pytest.mark.usefixtures("here")
def test_joints_make_a_tree(here, joints, links, expected):
    assert faults(here, jointed(joints, links)) == expected


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"axis": {"xyz": [0, 0, 0]}}, "axis.xyz: must not be zero, got [0, 0, 0]"),
        ({"axis": {"xyz": [0, float("nan"), 0]}}, "axis.xyz[1]: must be finite, got nan"),
        ({"axis": {"limits": [2, 1]}}, "axis.limits: lower must be below upper, got [2, 1]"),
        ({"axis": {"limits": [1]}}, "axis.limits: expected 2 numbers [lower, upper], got [1]"),
        ({"axis": {"damping": -1}}, "axis.damping: must be at least 0, got -1"),
        ({"axis2": {}}, "axis2: not allowed for `type: revolute`; allowed for universal"),
        ({"type": "universal"}, "axis2: required for `type: universal`"),
        (
            {"type": "universal", "axis": {"xyz": [0.0, 2.0, 0.0]}, "axis2": {"xyz": [0.0, -1.0, 0.001]}},
            "axis2.xyz: must not be parallel to the first axis: a universal joint turns about two",
        ),
        (
            {"type": "continuous", "axis": {"limits": [0, 1]}},
            "axis.limits: not allowed for a continuous joint; write `type: revolute`",
        ),
        ({"type": "ball", "axis": {"friction": 1}}, "axis.friction: not allowed for a ball joint"),
        (
            {"type": "hinge"},
            "type: expected revolute, continuous, prismatic, universal or ball, got 'hinge'",
        ),
    ],
)
@pytest.mark.usefixtures("here")
def test_a_joint_has_the_axes_of_its_type(here, changed, expected):
    assert faults(here, jointed([joint(**changed)])) == [f"joints[0].{expected}"]


@pytest.mark.usefixtures("here")
def test_an_object_has_only_so_many_links(here):
    names = [f"l{i}" for i in range(MOST_LINKS + 1)]
    joints = [joint(f"j{i}", child=name) for i, name in enumerate(names)]
    assert faults(here, jointed(joints, names)) == ["links: at most 64 are allowed, got 65"]


@pytest.mark.usefixtures("here")
def test_what_is_made_of_others_has_no_joints(here):
    content = {"objects": [{"name": "a", "model": "ball"}], "joints": [joint()]}
    expected = "joints: not allowed: an object made of `objects` or `docks` has no body of its own"
    assert faults(here, content) == [expected]
