"""What `vrx-mj list robots --verbose` says of commands."""

import pytest

from vrx_mj.cli.files import command_lines, listing

TOLD = {
    "wamv": (
        (
            "vrx: left, right -1 to 1 of full power, which is at most 250 N ahead and 100 N astern, for 1 s; "
            "left_angle, right_angle -1.571 to 1.571 rad"
        ),
        "vrx3: left, right -1000 to 2353.53 N, until the next command; left_angle, right_angle -3.142 to 3.142 rad",
    ),
    "skiff": (
        (
            "vrx: propeller -1 to 1 of full power, which is at most 120 N ahead and 60 N astern, for 1 s; "
            "rudder_angle -0.61 to 0.61 rad"
        ),
        "vrx3: propeller -60 to 120 N, until the next command; rudder_angle -0.61 to 0.61 rad",
    ),
    "cora": (
        "vrx: left, right -1 to 1 of full power, which is at most 120000 N ahead and 50000 N astern, for 1 s",
        "vrx3: left, right -50000 to 120000 N, until the next command",
    ),
}


@pytest.mark.parametrize("robot", TOLD)
def test_units_and_limits_follow_the_profile(robot):
    assert tuple(command_lines(robot)) == TOLD[robot]


def test_they_stand_below_the_robot_in_the_verbose_list_alone():
    lines = list(listing("robots", "skiff", verbose=True))
    assert lines[0].startswith("skiff: Skiff, a 2.4 m monohull")
    assert lines[1:] == [f"  {line}" for line in TOLD["skiff"]]
    assert list(listing("robots", "skiff")) == ["skiff"]


def test_a_robot_that_cannot_be_built_is_listed_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setenv("VRX_MJ_PATH", str(tmp_path))
    folder = tmp_path / "assets" / "robots" / "wreck"
    for place in (folder, tmp_path / "robots" / "wreck"):
        place.mkdir(parents=True)
        (place / "robot.yaml").write_text("urdf: nowhere.urdf\ndescription: sunk\n", encoding="utf-8")
    lines = list(listing("robots", "wreck", verbose=True))
    assert len(lines) == 1
    assert lines[0].startswith("wreck: sunk")
