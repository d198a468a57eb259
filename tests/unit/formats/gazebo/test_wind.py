"""The wind of worlds of gz-sim, beside that of VRX's plugins."""

import math
from pathlib import Path

import pytest

import vrx_mj
from vrx_mj.formats.gazebo.worlds import gazebo_world


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch, strict):
    monkeypatch.chdir(tmp_path)


def said(body):
    """What a world of these elements, which begin on line 3, is."""
    Path("bay.world").write_text(f'<sdf version="1.9">\n<world name="bay">\n{body}\n</world>\n</sdf>', encoding="utf-8")
    return gazebo_world(Path("bay.world"))


def losses(world):
    """Notes of what is not as in Gazebo."""
    return [f"{note.what} {note.fate}: {note.ours}" for note in world.notes if note.fate != "imported"]


@pytest.mark.parametrize(("velocity", "wind", "loss"), [
    ("0 10 0", {"direction": 90.0, "mean_velocity": 10.0}, []),
    ("-3 4 2", {"direction": math.degrees(math.atan2(4, -3)), "mean_velocity": 5.0},
     ["<wind> approximated: wind is horizontal: the third number is ignored"]),
    ("0 0 0", None, ["<wind> ignored: there is no wind"]),
    ("", None, ["<wind> ignored: there is no wind"]),
])  # fmt: skip
def test_the_wind_of_gz_sim_is_ours(velocity, wind, loss):
    world = said(f"<wind><linear_velocity>{velocity}</linear_velocity></wind>")
    assert (world.section.get("wind"), losses(world)) == (wind, loss)


def test_the_wind_of_a_plugin_of_vrx_counts_wherever_it_is():
    plugin = '<plugin filename="libusv_gazebo_wind_plugin.so"><wind_mean_velocity>3</wind_mean_velocity></plugin>'
    calm = "<wind><linear_velocity>9 0 0</linear_velocity></wind>"
    for body, line in ((f"{calm}\n{plugin}", 4), (f"{plugin}\n{calm}", 3)):
        world = said(body)
        assert world.section["wind"]["mean_velocity"] == 3.0
        assert losses(world) == [f"<wind> ignored: the wind plugin on line {line} is used instead"]


def test_the_wind_of_gz_sim_reaches_the_compiled_world():
    said("<wind><linear_velocity>0 5 0</linear_velocity></wind>")
    wind = vrx_mj.compile_world("bay.world", fleet="none").parameters.wind
    assert (wind.mean, wind.direction) == (5.0, pytest.approx((0.0, 1.0)))
