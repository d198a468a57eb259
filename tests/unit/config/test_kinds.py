"""What a file is, and what takes it."""

import pytest

from vrx_mj.config.kinds import FORMATS, other_kind, wrong_kind

AXIS = {"steps": 2, "macros": {}}


@pytest.mark.parametrize("end", FORMATS)
def test_a_file_of_a_known_kind_is_called_what_it_is(tmp_path, end):
    file = tmp_path / (end if "." in end.strip(".") and not end.startswith(".") else f"bay{end}")
    file.write_text("x", encoding="utf-8")
    found = wrong_kind(file, "a fleet")
    assert found is not None
    assert found.startswith(f"{FORMATS[end].name}, not a fleet")
    assert "FILE" not in found


def test_axes_are_no_fleet():
    assert other_kind("fleets", {"wind": AXIS, "sea": AXIS}) == (
        "axes of a series of worlds; pass one of them as WORLD by its number: axes.yaml#0"
    )
    assert other_kind("fleets", {"boats": AXIS}) == other_kind("fleets", {"wind": AXIS})
    assert other_kind("fleets", {}) is None


def test_the_file_of_a_world_is_no_fleet():
    assert other_kind("fleets", {"sea": {}}) == ("it has the key 'sea', of a world; pass it as WORLD")
    assert other_kind("fleets", {"sea": {}, "boats": []}) is None
