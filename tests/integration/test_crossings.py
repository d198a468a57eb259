"""What compiling a world of ours calls: no reader of other people's files but the robot's, and few files in turn."""

import pytest

from crossings import calls_between_files, crossings
from vrx_mj import compile_world

MOST = 10_500
"""Calls from one file to another in compiling `example_course`; 10,378 are made, 431 of them from masses of boats to
`rigid_bodies`, where objects' are joined too."""


@pytest.mark.slow
def test_a_world_of_ours_is_compiled_without_readers_of_others_but_the_robot_s():
    calls = calls_between_files(lambda: compile_world("example_course"))
    assert [names for names in calls if names[1].startswith("formats/") and "formats/urdf/" not in names[1]] == []
    assert 0 < crossings(calls) <= MOST


def test_calls_are_counted_between_files():
    calls = calls_between_files(lambda: compile_world({"name": "calm"}))
    assert calls["", "mjcf/compile.py"] or calls["signals.py", "mjcf/compile.py"]
