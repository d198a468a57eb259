"""Meshes of ours in place of VRX's: where and how large they are drawn."""

import math
from pathlib import Path

import pytest

from urdf_boats import link, robot
from vrx_mj.errors import ConfigError
from vrx_mj.formats.urdf.reader import read_urdf, stand_ins
from vrx_mj.frames import apply, compose, inverse, rotation

POINT = (0.3, -0.2, 0.7)


def seen(mesh, attributes="", xyz="0 0 0", rpy="0 0 0"):
    geometry = f'<geometry><mesh filename="package://vrx/meshes/{mesh}" {attributes}/></geometry>'
    visual = f'<visual><origin xyz="{xyz}" rpy="{rpy}"/>{geometry}</visual>'
    return read_urdf(robot(hull=link("base_link", 9, visual)), Path("boat.urdf")).links["base_link"].visuals


def scaled(point, factors):
    return [value * factor for value, factor in zip(point, factors, strict=True)]


def drawn(pose, point):
    """A point of a frame at `pose`, in the link."""
    return [a + b for a, b in zip(pose[:3], apply(rotation(*pose[3:]), point), strict=True)]


@pytest.mark.parametrize("mesh", stand_ins())
def test_where_vrx_draws_its_mesh_ours_is_drawn_in_the_links_own_frame(mesh):
    x, y, z, *rpy = stand_ins()[mesh]["pose"]
    for visual in seen(mesh, xyz=f"{x} {y} {z}", rpy=" ".join(map(str, rpy))):
        assert visual.pose[:3] == pytest.approx((0, 0, 0), abs=1e-12)
        for row, unit in zip(rotation(*visual.pose[3:]), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), strict=True):
            assert row == pytest.approx(unit, abs=1e-12)


@pytest.mark.parametrize(
    ("mesh", "attributes", "factors"),
    [
        ("WAM-V-Base.dae", "", (1, 1, 1)),
        ("WAM-V-Base.dae", 'scale="0.25 0.5 0.5"', (0.25, 0.5, 0.5)),
        ("battery.dae", 'scale="2 1 3"', (2, 1, 3)),
        ("sensor_post_arm.dae", 'scale="2"', (2, 2, 2)),
        ("3d_lidar.dae", 'scale="1 -1 1"', (1, -1, 1)),
    ],
)
def test_a_scaled_mesh_has_a_scaled_stand_in(mesh, attributes, factors):
    pose = (1, 2, 3, 0, 0, 0.5)
    theirs = inverse(stand_ins()[mesh]["pose"])  # from our mesh's frame, the link's, to that of VRX's mesh
    expected = drawn(pose, scaled(drawn(theirs, POINT), factors))
    for visual in seen(mesh, attributes, "1 2 3", "0 0 0.5"):
        assert visual.scale == pytest.approx(factors)
        assert drawn(visual.pose, scaled(POINT, factors)) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("scale", "message"),
    [("0 1 1", "must not be 0"), ("1 2", "expected 3 numbers x y z, got '1 2'")],
)
def test_a_scale_that_is_none_is_told(scale, message):
    with pytest.raises(ConfigError) as caught:
        seen("WAM-V-Base.dae", f'scale="{scale}"')
    assert str(caught.value).endswith(f"mesh / scale: {message}")


def test_the_place_of_a_stand_in_follows_its_mesh():
    (visual,) = seen("engine.dae", xyz="1 0 0", rpy=f"0 0 {math.pi / 2}")
    assert visual.pose == pytest.approx(compose((1, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, math.pi / 2)))
