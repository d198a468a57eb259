"""Tasks in a world's file: VRX's values where it gives none, `extends`, and the types by their names."""

import pytest

from unit.tasks.samples import SAMPLES
from vrx_mj.config.base import field_docstrings
from vrx_mj.config.tasks import TASKS, TaskConfig
from vrx_mj.config.values import Cartesian, Geodetic, Pose
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError


def task_of(kind, **more):
    return load_world({"task": {"type": kind, **SAMPLES[kind].file, **more}}).task


def test_all_types_are_tried_here():
    assert set(SAMPLES) == set(TASKS)


@pytest.mark.parametrize("kind", TASKS)
def test_a_task_has_the_values_of_vrx(kind):
    task = task_of(kind)
    durations = (task.initial_state_duration, task.ready_state_duration, task.running_state_duration)
    defaults = SAMPLES[kind].defaults
    expected = (10.0, 10.0, defaults.get("running_state_duration", 300.0))
    assert (task.type, task.name, task.boat, durations, task.locked) == (kind, "", None, expected, True)
    assert {key: getattr(task, key) for key in defaults} == defaults


@pytest.mark.parametrize("kind", TASKS)
def test_every_key_is_explained(kind):
    assert TASKS[kind].model_fields.keys() <= field_docstrings(TASKS[kind]).keys()


def test_a_value_of_the_file_counts_more_than_that_of_the_type():
    task = task_of("scan_dock_deliver", dock_bonus_points=1, enable_color_checker="no")
    assert (task.dock_bonus_points, task.correct_dock_bonus_points, task.enable_color_checker) == (1.0, 5.0, False)
    assert task_of("dock", enable_color_checker=True).enable_color_checker is True


def test_the_channel_of_a_gymkhana_has_values_of_its_own():
    channel = task_of("gymkhana", collision_buffer=1).channel
    assert (channel.obstacle_penalty, channel.collision_buffer, channel.gates) == (10.0, 10.0, ())


def test_station_keeping_goes_by_the_name_of_2022_too():
    task = load_world({"task": {"type": "station_keeping", "goal_cart": [1, 2, 0]}}).task
    assert type(task) is TASKS["stationkeeping"]


def test_a_shown_object_stays_for_five_seconds():
    shown = task_of("perception").objects[0]
    assert (shown.time, shown.duration, shown.type) == (5.0, 5.0, None)


def test_a_place_may_be_given_in_latitude_and_longitude():
    earth = {"georeference": {"latitude": 1.0, "longitude": 2.0}}
    for kind, value in (("stationkeeping", {"goal": [1, 2, 0]}), ("wayfinding", {"waypoints": [[1, 2, 0]]})):
        (key,) = value
        assert load_world({**earth, "task": {"type": kind, **value}}).task.geodetic == (key,)
        assert task_of(kind).geodetic == ()


def test_a_place_in_latitude_and_longitude_may_have_any_key():
    class Rescue(TaskConfig):
        base: Geodetic
        buoys: tuple[Geodetic, ...] = ()
        corner: tuple[Cartesian, ...] | None = None
        home: Geodetic | None = None
        own: Pose = (0.0,) * 6

    task = {"type": "rescue", "base": [1.0, 2.0, 0.0], "corner": [[1.0, 2.0, 0.0]]}
    assert Rescue(**task).geodetic == ("base",)
    assert Rescue(**task, home=[1.0, 2.0, 0.0], buoys=[[1.0, 2.0, 0.0]]).geodetic == ("base", "buoys", "home")


def test_a_task_of_the_same_type_is_merged_and_one_of_another_type_replaces_it(here):
    base = "task: {type: navigation_course, course: c, obstacle_penalty: 5}\n"
    (here / "base.yaml").write_text(base, encoding="utf-8")
    task = load_world({"extends": "base", "task": {"running_state_duration": 500}}).task
    assert (task.type, task.obstacle_penalty, task.running_state_duration) == ("navigation_course", 5.0, 500.0)
    task = load_world({"extends": "base", "task": {"type": "wildlife"}}).task
    assert task.type == "wildlife"
    assert load_world({"extends": "base", "task": None}).task is None


def test_a_fault_of_a_key_with_the_name_of_the_type_is_at_the_key(here):
    (here / "mine.yaml").write_text(
        "task:\n  type: dock\n  dock: 5\n  bays: [{symbol: red_circle}]\n", encoding="utf-8"
    )
    with pytest.raises(ConfigError, match=r"^mine.yaml:3:9: task\.dock: expected text, got 5; put it in quotes$"):
        load_world("mine")


def test_an_empty_list_is_its_default():
    assert task_of("navigation_course", gates=None).gates == ()


def test_the_task_knows_where_it_stands(here):
    (here / "mine.yaml").write_text("name: mine\ntask:\n  type: wildlife\n  time_bonus: 1\n", encoding="utf-8")
    section = load_world("mine").section["task"]
    assert (section.entries["time_bonus"].value.line, section.entries["time_bonus"].value.column) == (4, 15)


def test_all_faults_are_told_at_once():
    with pytest.raises(ConfigError) as caught:
        task_of("dock", bays=[{"symbol": "red_star"}, {"symbol": "blue_cross", "dock_allowed": 3}], min_dock_time=-1)
    assert str(caught.value) == (
        "<world>: task.bays[0].symbol: expected a symbol COLOUR_SHAPE of red, green, blue, yellow and circle, cross, "
        "triangle, rectangle, got 'red_star'\n"
        "<world>: task.bays[1].dock_allowed: expected true or false, got 3\n"
        "<world>: task.min_dock_time: must be at least 0, got -1"
    )
