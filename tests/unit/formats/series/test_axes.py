"""Axes, steps, sequences and expressions: which worlds an axes file makes."""

import contextlib
import itertools
import re
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from axes_files import LOST_AN_AXIS, WORLDS
from vrx_mj.config import search
from vrx_mj.config.tree import File, Place, Section
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.formats.series.axes import Axis, Series, calls_of, read_series
from vrx_mj.formats.series.worlds import _side, refuse_axes, series_world

NOWHERE = Section({}, Place(File("bay.yaml", None)), {})
GREY = (1.0, 0.3)
"""Light at the steps of the scene; the figures of each step are those of VRX's examples."""


def world(series, number):
    return series_world(series, number).section


def read(sample, name):
    """A sample, whatever it warns of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        return read_series(Path(sample(name)))


@pytest.mark.parametrize(("name", "count"), WORLDS.items())
def test_the_examples_make_as_many_worlds_as_vrx(sample, name, count):
    assert read(sample, name).count == count


def test_the_first_axis_varies_fastest(sample):
    series = read(sample, "nav_challenge_deep")
    steps = [tuple(series.coordinate(k).values()) for k in range(8)]
    assert list(series.coordinate(0)) == ["constant", "tasks", "waves", "wind", "scene"]
    assert [step[2:] for step in steps] == [
        (0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1),
    ]  # fmt: skip


@given(st.lists(st.integers(1, 5), min_size=1, max_size=5))
def test_the_order_is_that_of_a_product_of_the_axes_backwards(counts):
    axes = tuple(Axis(f"axis {i}", count, NOWHERE, {}, {}) for i, count in enumerate(counts))
    series = Series(NOWHERE.place.file, "bay", NOWHERE, axes)
    found = [tuple(series.coordinate(k).values()) for k in range(series.count)]
    backwards = itertools.product(*(range(count) for count in reversed(counts)))
    assert found == [steps[::-1] for steps in backwards]


@pytest.mark.parametrize("name", ["nav_challenge_deep", "perception_deep", "scan_and_dock_shallow"])
def test_the_steps_have_the_weather_of_the_examples(sample, name):
    series = read(sample, name)
    for k in range(series.count):
        at = series.coordinate(k)
        waves, wind, scene = (at.get(axis, at.get("environment")) for axis in ("waves", "wind", "scene"))
        found = world(series, k)
        assert (found["sea"]["gain"], found["sea"]["period"]) == ((1.0, 1.0), (0.4, 8.0))[waves]
        gusts = tuple(found["wind"][key] for key in ("mean_velocity", "var_gain", "var_time", "seed"))
        assert gusts == ((0, 0, 2, 10), (8, 8, 20, 10))[wind]
        assert found["scene"]["ambient"] == (GREY[scene],) * 3 + (1.0,)
        fog = {"type": "linear", "color": ((0.7,) * 3, (0.9,) * 3)[scene] + (1.0,)}
        assert found["scene"].get("fog") == (fog if "deep" in name else None)
        assert found["wind"]["objects"] == ({"model": "wamv", "coefficients": (0.5, 0.5, 0.33)},)


def test_an_axis_without_its_name_loses_the_task_as_in_vrx(sample):
    with pytest.warns(VrxWarning) as caught:
        series = read_series(Path(sample("station_keeping_shallow")))
    assert [str(told.message) for told in caught] == [LOST_AN_AXIS]
    found = world(series, 0)
    assert "task" not in found
    assert (found["sea"]["gain"], found["scene"]["ambient"]) == (1.0, (1.0, 1.0, 1.0, 1.0))


def waves(series, number, key="gain"):
    return world(series, number)["sea"][key]


def test_values_of_macros_are_expressions_of_the_step(axes):
    series = axes("""
sea:
  steps: 3
  macros:
    ocean_waves:
      - gain: 0.1 * n + 0.2
        period: 4 if n < 2 else math.sqrt(81)
        scale: 2.5
        angle: "'0.7'"
""")
    assert [waves(series, k) for k in range(3)] == [0.2, 0.1 + 0.2, 0.1 * 2 + 0.2]
    assert [waves(series, k, "period") for k in range(3)] == [4, 4, 9.0]
    assert {(waves(series, k, "scale"), waves(series, k, "angle")) for k in range(3)} == {(2.5, 0.7)}


def test_a_sequence_takes_the_place_of_the_macros_at_its_steps(axes):
    series = axes("""
sea:
  steps: 3
  macros: {ocean_waves: [{gain: n + 1}], sandisland: [null]}
  sequence: {1: {ocean_waves: [{gain: 0.5}]}}
""")
    assert [waves(series, k) for k in range(3)] == [1, 0.5, 3]
    assert ["extends" in world(series, k) for k in range(3)] == [True, False, True]


def test_blocks_of_macros_may_be_raw_quoted_or_worked_out(axes):
    series = axes("""
scene:
  steps: 3
  macros:
    scene_macro:
      - /**ambient: str(n / 2) + ' 1 1 1'
        /**fog: <fog><type>linear</type></fog>
""")
    assert [world(series, k)["scene"]["ambient"] for k in range(3)] == [(x, 1.0, 1.0, 1.0) for x in (0.0, 0.5, 1.0)]
    assert world(series, 0)["scene"]["fog"] == {"type": "linear"}


def test_a_macro_is_called_several_times_under_names_with_asterisks(axes):
    series = axes("""
buoys:
  steps: 1
  macros:
    sydneyregatta: [null]
    insert_model: [{uri: "'mb_marker_buoy_red'", x: 1}, {uri: "'mb_marker_buoy_red'", x: 2}]
    insert_model*: [{uri: "'model://navigation_course3'", x: 3}]
    '**insert_model': [{uri: "'antenna'", x: 4}, null]
""")
    found = [(thing["name"], thing["model"], thing["pose"][0]) for thing in world(series, 0)["objects"]]
    assert found == [
        ("mb_marker_buoy_red", "mb_marker_buoy_red", 1),
        ("mb_marker_buoy_red_1", "mb_marker_buoy_red", 2),
        ("vrx_navigation_course_3", "navigation_course3", 3),
        ("antenna_1", "antenna", 4),  # the base has one
        ("robotx_dock_2018", "dock_2018", 60.0),
    ]


def test_axes_add_up_where_both_have_a_sequence_for_a_macro(axes):
    series = axes("""
red: {steps: 1, macros: {}, sequence: {0: {insert_model: [{uri: red_totem}]}}}
blue: {steps: 1, macros: {}, sequence: {0: {insert_model: [{uri: blue_totem}, {uri: black_totem}]}}}
""")
    assert [call.parameters["uri"] for call in calls_of(series, 0)] == ["red_totem", "blue_totem", "black_totem"]
    assert [thing["model"] for thing in world(series, 0)["objects"]] == ["red_totem", "blue_totem", "black_totem"]


def test_of_two_seas_the_later_one_counts_with_a_warning(axes):
    series = axes("""
constant: {steps: 1, macros: {ocean_waves: [{gain: 1}]}}
waves:
  steps: 1
  macros: {ocean_waves: [{period: 8}]}
""")
    told = "bay.yaml: ocean_waves is called on lines 2 and 5; the last one is used"
    with pytest.warns(VrxWarning, match=f"^{re.escape(told)}$"):
        found = world(series, 0)
    assert (found["sea"]["gain"], found["sea"]["period"]) == (0.1, 8)


def test_without_waves_the_water_is_flat(axes):
    assert world(axes("a: {steps: 1, macros: {sandisland: [null]}}"), 0)["sea"] == {"model": "none"}


def test_objects_are_looked_for_once_in_a_series(axes, monkeypatch):
    series = axes("a:\n  steps: 3\n  macros: {sydneyregatta: [], ocean_waves: [{gain: '0.1 * n'}]}\n")
    asked = []
    monkeypatch.setattr(search, "_names_and_files", lambda kind, place: asked.append((kind, place)) or [])
    for number in range(series.count):
        world(series, number)
    assert len(asked) == len(set(asked))


def test_a_step_may_have_a_file_beside_its_world(axes):
    series = axes("a: {steps: 2, macros: {}, yamls: {1: {pinger: {position: [1, 2, -3]}}}}")
    assert [series_world(series, k).side for k in range(2)] == [None, {"pinger": {"position": (1, 2, -3)}}]


def test_stray_text_between_elements_is_left_out_with_a_warning(axes):
    series = axes("""
a:
  steps: 1
  macros: {}
  sequence:
    0:
      scene_macro:
        - /**fog: "
            +<fog>
            +  <type>exp</type><density>0.1</density>
            +</fog>"
          /**ambient: ''
""")
    told = r"^bay\.yaml:8: '\+' between the elements of /\*\*fog is ignored$"
    with pytest.warns(VrxWarning, match=told):
        assert world(series, 0)["scene"]["fog"] == {"type": "exp", "density": 0.1}


def test_axes_are_told_from_worlds(tmp_path):
    file = tmp_path / "bay.yaml"
    for text, expected in (("a: {steps: 1, macros: {}}", True), ("sea: {gain: 1}", False), ("a: [", False)):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(VrxError, match="is a series of worlds") if expected else contextlib.nullcontext():
            refuse_axes(file, file.name)


def test_of_what_several_axes_write_beside_a_world_the_last_counts():
    axes = (SimpleNamespace(name="one", sides={0: "first"}), SimpleNamespace(name="two", sides={0: "second"}))
    series = SimpleNamespace(axes=axes)
    found = {(one, two): _side(series, {"one": one, "two": two}) for one in (0, 1) for two in (0, 1)}
    assert found == {(0, 0): "second", (0, 1): "first", (1, 0): "second", (1, 1): None}
