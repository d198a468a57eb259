"""The WAM-V that our xacro macros make, against the figures of VRX's.

Links, joints and shapes one by one, and the whole boat's mass, centre of mass and inertia.
"""

import csv
import fnmatch
import math
from pathlib import Path

import numpy as np
import pytest

from wamv_boats import BOATS, local, numbers, origin, robot

GOLDEN = Path(__file__).parents[2] / "golden"
# total mass, centre of mass in base_link, xx, yy, zz and xz of the inertia about it: worked out from VRX's own URDFs,
# and compared to half of the last digit given
COMPOSITES = {
    "H": (258.0, (-0.286, 0, 0.146), (217.0, 566.1, 682.9, 11.4)),
    "T": (273.5, (-0.270, -0.001, 0.154), (218.5, 568.7, 684.2, 10.7)),
    "X": (289.0, (-0.084, 0, 0.155), (234.5, 665.8, 795.6, 6.8)),
    "H singles": (262.17, (-0.277, 0, 0.167), (224.9, 576.7, 686.1, 8.0)),
    "H suite": (283.28, (-0.265, 0, 0.268), (262.5, 615.9, 690.0, 3.6)),
    "T suite": (298.78, (-0.251, 0, 0.270), (263.6, 618.0, 691.1, 3.5)),
    "X suite": (314.28, (-0.081, 0, 0.265), (279.8, 714.1, 801.4, 5.3)),
    "example": (283.28, (-0.264, -0.001, 0.268), (262.5, 616.2, 690.2, 3.4)),
}
LUMPED = {
    "H": (227.0, (0, 0, 0.124), (181.4, 408.2, 495.0)),
    "T suite": (250.18, (-0.0035, -0.001, 0.255), (225.2, 454.1, 499.8)),
}


def golden(name):
    lines = (GOLDEN / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def inertial(link):
    """Mass, place, turn, and ixx, iyy, izz; products of inertia are all zero."""
    found = link.find("inertial")
    if found is None:
        return [0.0], [0.0] * 3, [0.0] * 3, [0.0] * 3
    tensor = found.find("inertia")
    assert [float(tensor.get(key)) for key in ("ixy", "ixz", "iyz")] == [0, 0, 0]
    return (
        [float(found.find("mass").get("value"))],
        *origin(found),
        [float(tensor.get(key)) for key in ("ixx", "iyy", "izz")],
    )


def kind_of(joint):
    limit = joint.find("limit")
    if joint.get("type") == "revolute" and limit.get("lower") == limit.get("upper") == "0":
        assert (float(limit.get("effort")), float(limit.get("velocity"))) == (1000, 0)
        return "locked"
    return joint.get("type")


def rows_of(boat):
    wanted = BOATS[boat][1] | {"all"}
    return {row["link"]: row for row in golden("wamv_links.csv") if wanted & set(row["boats"].split())}


@pytest.mark.parametrize(
    "boat", [pytest.param(boat, marks=[pytest.mark.slow] * (turn % 2)) for turn, boat in enumerate(BOATS)]
)
def test_every_link_has_the_mass_inertia_and_place_of_vrxs(boat):
    made, rows = robot(boat), rows_of(boat)
    links = {local(link): link for link in made.findall("link")}
    joints = {local(joint.find("child"), "link"): joint for joint in made.findall("joint")}
    assert links.keys() == rows.keys()
    assert joints.keys() == rows.keys() - {"base_link"}
    for name, row in rows.items():
        expected = [numbers(row[key]) for key in ("mass", "com", "com_rpy", "inertia")]
        for figure, given in zip(inertial(links[name]), expected, strict=True):
            assert figure == pytest.approx(given, rel=1e-9, abs=1e-10), name
    for name, joint in joints.items():
        row = rows[name]
        assert [local(joint), local(joint.find("parent"), "link"), kind_of(joint)] == [
            row["joint"],
            row["parent"],
            row["type"],
        ]
        for figure, given in zip(origin(joint), (row["xyz"], row["rpy"]), strict=True):
            assert figure == pytest.approx(numbers(given), abs=1e-10), name


def shapes(link):
    for shape in link.findall("collision"):
        found = next(iter(shape.find("geometry")))
        size = found.get("size") or f"{found.get('length')} {found.get('radius')}"
        yield shape.get("name"), (found.tag, numbers(size), *origin(shape))


@pytest.mark.parametrize("boat", BOATS)
def test_every_link_has_the_collision_shapes_of_vrxs(boat):
    rows = golden("wamv_collisions.csv")
    for link in robot(boat).findall("link"):
        name = local(link)
        own = {row["name"]: row for row in rows if fnmatch.fnmatchcase(name, row["link"])}
        found = dict(shapes(link))
        assert len(found) == len(own), name
        for shape, (kind, *figures) in found.items():
            row = next(row for pattern, row in own.items() if fnmatch.fnmatchcase(shape, pattern))
            assert kind == row["shape"]
            for figure, key in zip(figures, ("size", "xyz", "rpy"), strict=True):
                assert figure == pytest.approx(numbers(row[key]), abs=1e-9), shape


def test_engines_steer_and_propellers_turn_as_vrxs():
    joints = {local(joint): joint for joint in robot("H").findall("joint")}
    engine, propeller = joints["left_chasis_engine_joint"], joints["left_engine_propeller_joint"]
    assert engine.find("axis").get("xyz") == "0 0 1"
    limit = engine.find("limit").attrib
    assert {key: float(value) for key, value in limit.items()} == {
        "lower": -math.pi,
        "upper": math.pi,
        "effort": 10,
        "velocity": 10,
    }
    assert propeller.find("axis").get("xyz") == "1 0 0"
    assert {key: float(value) for key, value in propeller.find("limit").attrib.items()} == {
        "effort": 100,
        "velocity": 100,
    }
    assert {key: float(value) for key, value in propeller.find("dynamics").attrib.items()} == {
        "friction": 0.05,
        "damping": 0.05,
    }


# Composites


def turn(rpy):
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return yaw @ pitch @ roll


def joined(made, *, lumped=False):
    """Mass, centre of mass and inertia of all links at zero angles; lumped: of base_link and what is fixed to it."""
    frames = {"base_link": (np.zeros(3), np.eye(3))}
    joints = made.findall("joint")
    while joints:
        joint = next(each for each in joints if local(each.find("parent"), "link") in frames)
        joints.remove(joint)
        xyz, rpy = origin(joint)
        place, axes = frames[local(joint.find("parent"), "link")]
        if lumped and joint.get("type") != "fixed":
            below = {local(joint.find("child"), "link")}
            joints = [each for each in joints if local(each.find("parent"), "link") not in below]
        else:
            frames[local(joint.find("child"), "link")] = (place + axes @ xyz, axes @ turn(rpy))
    parts = []
    for link in made.findall("link"):
        if local(link) in frames and link.find("inertial") is not None:
            (mass,), xyz, rpy, moments = inertial(link)
            place, axes = frames[local(link)]
            own = axes @ turn(rpy)
            parts.append((mass, place + axes @ xyz, own @ np.diag(moments) @ own.T))
    total = sum(mass for mass, _, _ in parts)
    center = sum(mass * place for mass, place, _ in parts) / total
    arms = [(mass, place - center, tensor) for mass, place, tensor in parts]
    tensor = sum(own + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm)) for mass, arm, own in arms)
    return total, center, tensor


@pytest.mark.parametrize("boat", COMPOSITES)
def test_the_whole_boat_weighs_what_vrxs_does(boat):
    mass, center, inertia = COMPOSITES[boat]
    total, place, tensor = joined(robot(boat))
    assert total == pytest.approx(mass, abs=0.005)
    assert place == pytest.approx(center, abs=0.0005001)
    assert [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 2]] == pytest.approx(inertia, abs=0.05001)


@pytest.mark.parametrize("boat", LUMPED)
def test_what_is_fixed_to_the_hull_weighs_what_vrxs_does(boat):
    mass, center, inertia = LUMPED[boat]
    total, place, tensor = joined(robot(boat), lumped=True)
    assert total == pytest.approx(mass, abs=0.005)
    assert place == pytest.approx(center, abs=0.0005001)
    assert np.diag(tensor) == pytest.approx(inertia, abs=0.05001)
