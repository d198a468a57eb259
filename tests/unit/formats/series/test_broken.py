"""What is wrong with an axes file, said with its place; and files that would take all time or memory."""

import re

import pytest

from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxError, VrxWarning
from vrx_mj.formats.series.axes import MOST_WORLDS
from vrx_mj.formats.series.worlds import series_world
from work import calls_at_most

SHAPES = {
    "": "bay.yaml:1:1: empty; expected keys and values",
    "{}": "bay.yaml:1:1: expected axes, each with `steps` and `macros`",
    "extends: sand_island": "bay.yaml:1:10: extends: expected keys and values, got 'sand_island'",
    "a: {macros: {}}": "bay.yaml:1:4: a.steps: required, but missing",
    "a: {steps: 0}": "bay.yaml:1:12: a.steps: must be at least 1, got 0",
    "a: {steps: true}": "bay.yaml:1:12: a.steps: expected a whole number, got true",
    "a: {steps: 2.0}": "bay.yaml:1:12: a.steps: expected a whole number, got 2",
    "a: {steps: 1, macro: {}}": "bay.yaml:1:15: a.macro: unknown key 'macro'; did you mean 'macros'?",
    "a: {steps: 1, macros: [sandisland]}": "bay.yaml:1:23: a.macros: expected keys and values, got ['sandisland']",
    "a: {steps: 1, macros: {sandisland: }}": "bay.yaml:1:35: a.macros.sandisland: expected a list, got nothing",
    "a: {steps: 1, macros: {sandisland: [7]}}": (
        "bay.yaml:1:37: a.macros.sandisland[0]: expected keys and values, got 7"
    ),
    "a: {steps: 1, sequence: {first: {}}}": (
        "bay.yaml:1:33: a.sequence.first: expected a whole number of 0 or more as step, got 'first'"
    ),
    "a: {steps: 1, sequence: [1]}": "bay.yaml:1:25: a.sequence: expected keys and values, got [1]",
    "a: {steps: 1}\n+ b: {steps: 1}": ("bay.yaml:2:6: + b: begins with '+', as in a patch file; remove the '+'"),
    "a: {steps: 100}\nb: {steps: 101}": "bay.yaml:1: 100 x 101 steps make 10100 worlds; at most 10000 are allowed",
}


@pytest.mark.parametrize(("text", "expected"), SHAPES.items(), ids=range(len(SHAPES)))
def test_a_file_that_holds_no_axes_says_why(axes, text, expected):
    with pytest.raises(ConfigError) as caught:
        axes(text)
    assert str(caught.value) == expected


def test_every_problem_of_a_file_is_told_at_once(axes):
    with pytest.raises(ConfigError) as caught:
        axes("a: {steps: 0}\nb: {steps: 1, yaml: 3}\n")
    assert [problem.line for problem in caught.value.problems] == [1, 2]


CALLS = {
    "oceanwaves: [null]": (
        "bay.yaml:4:18: a.macros.oceanwaves[0]: no macro named 'oceanwaves'; did you mean 'ocean_waves'?"
    ),
    "ocean_waves: [{gian: 1}]": (
        "bay.yaml:4:26: a.macros.ocean_waves[0].gian: no parameter of ocean_waves named 'gian'; did you mean 'gain'?"
    ),
    "stationkeeping: [{/**gates: ''}]": (
        "bay.yaml:4:33: a.macros.stationkeeping[0]./**gates: no parameter of stationkeeping named '/**gates'; "
        "known: lat, lon, heading, namespace, competition, /**wp_markers"
    ),
    "nav_challenge: [null]": "bay.yaml:4:21: a.macros.nav_challenge[0]: nav_challenge needs the parameter 'name'",
    "wayfinding: [null]": "bay.yaml:4:18: a.macros.wayfinding[0]: wayfinding needs the parameter '/**waypoints'",
    "ocean_waves: [{gain: big}]": (
        "bay.yaml:4:26: a.macros.ocean_waves[0].gain: 'big': name 'big' is not defined; "
        "text needs single quotes inside the double quotes"
    ),
    "ocean_waves: [{gain: \"'big'\"}]": ("bay.yaml:4:26: a.macros.ocean_waves[0].gain: expected a number, got 'big'"),
    "ocean_waves: [{gain: [1]}]": "bay.yaml:4:26: a.macros.ocean_waves[0].gain: expected a number, got [1]",
    "ocean_waves: [{gain: 1 / n}]": (
        "bay.yaml:4:26: a.macros.ocean_waves[0].gain: '1 / n': division by zero; "
        "text needs single quotes inside the double quotes"
    ),
    "ocean_waves: [{gain: lambda}]": (
        "bay.yaml:4:26: a.macros.ocean_waves[0].gain: 'lambda': invalid syntax; "
        "text needs single quotes inside the double quotes"
    ),
    "ocean_waves: [{gain: n.__class__}]": (
        "bay.yaml:4:26: a.macros.ocean_waves[0].gain: 'n.__class__': Use of invalid name(s):  __class__; "
        "text needs single quotes inside the double quotes"
    ),
    "usv_wind_gazebo: [{seed: 1.5}]": (
        "bay.yaml:4:30: a.macros.usv_wind_gazebo[0].seed: expected a whole number, got 1.5"
    ),
    "nav_challenge: [{name: [1]}]": "bay.yaml:4:28: a.macros.nav_challenge[0].name: expected text, got [1]",
    "wayfinding: [{/**waypoints: [1]}]": (
        "bay.yaml:4:33: a.macros.wayfinding[0]./**waypoints: expected XML in quotes, got [1]"
    ),
    "dock: [{light_buoy_present: 2}]": (
        "bay.yaml:4:33: a.macros.dock[0].light_buoy_present: expected true or false, got 2"
    ),
    "wayfinding: [{/**waypoints: '<waypoint><pose>1 2</pose></waypoint>'}]": (
        "bay.yaml:4:33: a.macros.wayfinding[0]./**waypoints: "
        "<pose>: expected 3 numbers latitude longitude yaw, got '1 2'"
    ),
    "wayfinding: [{/**waypoints: '<way><pose>1 2 3</pose></way>'}]": (
        "bay.yaml:4:33: a.macros.wayfinding[0]./**waypoints: no element of this block named 'way'; known: waypoint"
    ),
    "wayfinding: [{/**waypoints: '<waypoint>'}]": (
        "bay.yaml:4:33: a.macros.wayfinding[0]./**waypoints: expected </waypoint>, which ends the <waypoint>"
    ),
    "wayfinding: [{/**waypoints: \"'1 2 3'\"}]": (
        "bay.yaml:4:33: a.macros.wayfinding[0]./**waypoints: expected elements <waypoint>, got '1 2 3'"
    ),
    "wayfinding: [{/**waypoints: '<!DOCTYPE a [<!ENTITY b \"c\">]><a>&b;</a>'}]": (
        "bay.yaml:4:33: a.macros.wayfinding[0]./**waypoints: "
        "is not XML: a stray '<' or '&' (write &lt; &amp;), or no quote or '='"
    ),
    "usv_wind_gazebo: [{/**wind_objs: '<wind_obj><name>wamv</name></wind_obj>'}]": (
        "bay.yaml:4:38: a.macros.usv_wind_gazebo[0]./**wind_objs: <wind_obj> 'wamv': "
        "<coeff_vector> is required, but missing"
    ),
    "nav_challenge: [{name: \"'a'\", /**gates: '<gate><left_marker>a</left_marker></gate>'}]": (
        "bay.yaml:4:45: a.macros.nav_challenge[0]./**gates: <gate>: <right_marker> is required, but missing"
    ),
    "stationkeeping: [{/**wp_markers: '<markers><colour>red</colour></markers>'}]": (
        "bay.yaml:4:38: a.macros.stationkeeping[0]./**wp_markers: no element of <markers> named 'colour'; "
        "known: scaling, height, material, initial_id"
    ),
    "wildlife: [{/**animal_includes: '', /**animal_buoys: '<buoy><name>a</name><goal>run</goal></buoy>'}]": (
        "bay.yaml:4:58: task.animals[0].goal: "
        "expected avoid, circumnavigate_clockwise or circumnavigate_counterclockwise, got 'run'"
    ),
    "sandisland: [null]\n    marina: [null]": (
        "bay.yaml:5:14: a.macros.marina[0]: a world has one base, which 'sandisland' on line 4 already gives"
    ),
    "ocean_waves: [{period: n}]": "bay.yaml:4:28: sea.period: must be above 0, got 0",
    "insert_model: [{uri: \"'dock_2019'\"}]": (
        "bay.yaml:4:26: a.macros.insert_model[0].uri: no model named 'dock_2019'; did you mean 'dock_2018'?"
    ),
    "stationkeeping: [null]": (
        "bay.yaml:4:22: task.goal: latitude and longitude need a `georeference`, which this world does not have"
    ),
}


@pytest.mark.parametrize(("call", "expected"), CALLS.items(), ids=range(len(CALLS)))
def test_a_wrong_call_says_what_and_where(axes, call, expected):
    axes(f"a:\n  steps: 1\n  macros:\n    {call}\n")
    with pytest.raises(VrxError) as caught:
        load_world("bay.yaml#0")
    assert str(caught.value) == expected


def test_a_call_that_cannot_be_expanded_is_that_of_its_own_worlds_alone(axes):
    deep = f"{'<pose>' * 59}{'</pose>' * 59}"
    text = f"a:\n  steps: 2\n  macros: {{}}\n  sequence:\n    1:\n      scene_macro: [{{/**ambient: '{deep}'}}]\n"
    series = axes(text)
    assert "scene" not in series_world(series, 0).section
    with pytest.raises(ConfigError) as caught:
        series_world(series, 1)
    told = "a.sequence.1.scene_macro[0]./**ambient: <pose>: elements are nested deeper than 60 levels"
    assert str(caught.value) == f"bay.yaml:6:34: {told}"


@pytest.mark.parametrize("text", ["${none}", "$(find nowhere)", "$${a}", "a & <b>"])
def test_what_xacro_would_take_for_an_expression_is_text_in_an_axes_file(axes, text):
    axes(f"a: {{steps: 1, macros: {{insert_model: [{{uri: \"'{text}'\"}}]}}}}")
    with pytest.raises(ConfigError, match=re.escape(f"no model named '{text}'; ")):
        load_world("bay.yaml#0")


def test_an_empty_block_is_as_one_left_out(axes):
    series = axes("a: {steps: 1, macros: {scene_macro: [{/**fog: null, /**ambient: ''}]}}")
    assert series_world(series, 0).section["scene"] == {"sky": True, "grid": False, "origin_visual": False}
    load_world("bay.yaml#0")


def test_every_wrong_call_of_a_world_is_told(axes):
    axes("a:\n  steps: 1\n  macros:\n    ocean: [null]\n    ocean_waves: [{gian: 1}]\n")
    with pytest.raises(ConfigError) as caught:
        load_world("bay.yaml#0")
    assert [problem.line for problem in caught.value.problems] == [4, 5]


@pytest.mark.parametrize("number", ["2", "-1", "x", "", "1.5", "99999999999"])
def test_a_number_that_no_world_has(axes, number):
    axes("a: {steps: 2, macros: {}}")
    with pytest.raises(VrxError, match=f"^bay.yaml#{re.escape(number)}: no such world; the series has worlds 0 to 1$"):
        load_world(f"bay.yaml#{number}")


def test_a_series_without_a_number_says_how_to_name_one(axes):
    for text in ("a: {steps: 2, macros: {}}", "a: {steps: 2, macros: {}, sequence: {0: {}}}"):
        axes(text)
        with pytest.raises(VrxError) as caught:
            load_world("bay.yaml")
        assert str(caught.value) == "bay.yaml is a series of worlds: name one, 'bay.yaml#0' to 'bay.yaml#1'"


def test_a_hash_in_a_folder_is_no_number(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c#").mkdir()
    (tmp_path / "c#" / "bay.yaml").write_text("sea: {gain: 0.2}", encoding="utf-8")
    assert load_world("c#/bay.yaml").name == "bay"


def test_a_step_that_never_comes_is_told(axes):
    with pytest.warns(VrxWarning, match="^bay.yaml: step 2, 7 of a does not exist: it has steps 0 to 1$"):
        axes("a: {steps: 2, macros: {}, sequence: {7: {}, 2: {}}}")


def quickly(run):
    """The error of a call that must give up soon."""
    with calls_at_most(6_000_000), pytest.raises(ConfigError) as caught:
        run()
    return str(caught.value)


def test_aliases_that_multiply_are_refused(axes):
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
    with pytest.raises(ConfigError, match="more than 200000 values, including aliases"):
        axes("\n".join(lines))


@pytest.mark.parametrize("steps", [MOST_WORLDS + 1, 10**30])
def test_too_many_steps_are_refused(axes, steps):
    assert f"{steps} steps make {steps} worlds" in quickly(lambda: axes(f"a: {{steps: {steps}, macros: {{}}}}"))


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("text", ["9 ** 9 ** 9", "sum(range(10 ** 9))", "'a' * 10 ** 9 + ''", "[0] * 10 ** 9"])
def test_expressions_that_would_take_forever_are_refused(axes, text):
    series = axes(f'a:\n  steps: 1\n  macros:\n    ocean_waves: [{{gain: "{text}"}}]\n')
    assert quickly(lambda: series_world(series, 0)).startswith("bay.yaml:4:26: a.macros.ocean_waves[0].gain: ")


def test_the_most_worlds_are_counted_at_once(axes):
    series = axes("a: {steps: 100, macros: {}}\nb: {steps: 100, macros: {ocean_waves: [{gain: n}]}}")
    assert series.count == MOST_WORLDS
    assert series_world(series, MOST_WORLDS - 1).section["sea"]["gain"] == 99
