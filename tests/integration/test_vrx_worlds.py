"""Worlds of VRX against what VRX's own files say: seas, winds, goals, docks, gates, animals and beacons."""

import csv
import math
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import vrx_mj
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import WorldConfig, load_world
from vrx_mj.errors import ConfigError
from vrx_mj.model.world import tree_of

GOLDEN = Path(__file__).parents[1] / "golden"
OF_A_PLACE = re.compile("post_|antenna|ground_station|blue_projectile")
TOLERANCES = {"goal": 0.0051, "waypoint": 0.0051, "sea": 1e-4}
"""The golden places of goals are rounded to 0.01 m, the directions of seas to 1e-4; all else is as VRX writes it."""
LATER = {"dock_2023": "dock_2022", "obstacle_course_2023": "obstacle_course"}
"""VRX's names of our models of 2023, where those differ."""

Facts = dict[str, list[str]]


@cache
def golden() -> dict[str, Facts]:
    found: dict[str, Facts] = defaultdict(lambda: defaultdict(list))
    for file in GOLDEN.glob("worlds_*.csv"):
        lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        for row in csv.DictReader(lines):
            fog = row["fact"] == "fog"  # of a linear one the density, which VRX's files have, does nothing
            found[row["world"]][row["fact"]].append(row["value"].split()[0] if fog else row["value"])
    return found


def facts(world: WorldConfig) -> Facts:
    """What a world's configuration says, in the words of the golden files."""
    found: Facts = defaultdict(list)
    for fact, values in (*surroundings(world), *task_facts(world)):
        found[fact].append(" ".join(f"{value}" for value in values))
    return found


def surroundings(world: WorldConfig) -> Iterator[tuple[str, tuple]]:
    sea, wind, scene = world.sea, world.wind, world.scene
    length = math.hypot(*sea.direction)
    yield "sea", (sea.gain, sea.period, *(part / length for part in sea.direction))
    if wind:
        yield "wind", (wind.direction, wind.mean_velocity, wind.var_gain, wind.var_time, wind.seed)
    yield "ambient", scene.ambient[:1]
    if scene.fog:
        assert (scene.fog.type, scene.fog.start, scene.fog.end) == ("linear", 1.0, 100.0)
        yield "fog", scene.fog.color[:1]
    if names := sorted(item.name for item in world.objects if not OF_A_PLACE.match(item.name)):
        yield "names", names
    if world.task:
        task = world.task
        yield "task", (task.name or task.type,)
        yield "durations", (task.initial_state_duration, task.ready_state_duration, task.running_state_duration)


def task_facts(world: WorldConfig) -> Iterator[tuple[str, tuple]]:
    kind = world.task.type if world.task else ""
    if kind in {"stationkeeping", "station_keeping"}:
        yield "goal", local(world, world.task.goal)
    if kind == "wayfinding":
        yield from (("waypoint", local(world, place)) for place in world.task.waypoints)
    if kind == "perception":
        assert {(item.duration, item.pose[3:]) for item in world.task.objects} == {(5.0, (0.0, 0.0, 0.0))}
        yield from (("shown", (item.time, item.type, item.name, *item.pose[:3])) for item in world.task.objects)
    if kind in {"navigation_course", "follow_path", "gymkhana"}:
        yield from channel_facts(world)
    if kind in {"dock", "scan_and_dock", "scan_dock_deliver"}:
        yield from dock_facts(world)
    if kind == "wildlife":
        yield "rate", (world.task.publication_rate,)
        yield from animal_facts(world)
    if kind in {"gymkhana", "acoustic_perception"}:
        yield "pinger", world.task.pinger
    if kind == "acoustic_perception":
        yield "tolerance", (world.task.goal_tolerance,)
    if kind == "acoustic_tracking":
        yield from tracking_facts(world)


def tracking_facts(world: WorldConfig) -> Iterator[tuple[str, tuple]]:
    beacon = placed(world, world.task.pinger)
    assert (beacon.path.force, beacon.path.torque, world.task.pinger_depth) == (350.0, 1.5, 2.0)
    yield "start", beacon.pose[:2]
    yield "way", tuple(number for point in beacon.path.waypoints for number in point)
    buoys = [item for item in world.objects if item.model == "mb_round_buoy_black_2023"]
    yield "obstacles", tuple(number for item in buoys for number in item.pose[:2])


def channel_facts(world: WorldConfig) -> Iterator[tuple[str, tuple]]:
    gymkhana = world.task.type == "gymkhana"
    course = placed(world, world.task.channel.course if gymkhana else world.task.course)
    yield "course", place(course)
    for item in world.objects:
        if gymkhana and item.model.startswith("obstacle"):
            yield "field", place(item)


def dock_facts(world: WorldConfig) -> Iterator[tuple[str, tuple]]:
    task = world.task
    yield "dock", place(placed(world, task.dock))
    yield from (("light", place(item)[1:]) for item in world.objects if item.model.startswith("robotx_light_buoy"))
    if task.type != "dock":
        yield "colors", task.color_sequence
    for bay in task.bays:
        yield "bay", (bay.name, bay.symbol, *(["correct"] if bay.dock_allowed else []))


def animal_facts(world: WorldConfig) -> Iterator[tuple[str, tuple]]:
    for animal in world.task.animals:
        item = placed(world, animal.name)
        name, path = re.sub("_(buoy|moving)$", "", animal.name), item.path
        assert item.model.split("_")[0] == name.rstrip("12")
        if path is None:
            way = ("model",)
        elif path.line:
            way = ("line", path.line.length, path.line.direction)
        elif path.circle:
            way = ("circle", path.circle.radius)
        else:
            points = [number for point in path.waypoints for number in point]
            way = ("waypoints", *points, "force", path.force, "torque", path.torque)
        yield "animal", (name, *item.pose[:2], *way)


def local(world, goal):
    return (*world.georeference.to_enu(*goal[:2])[:2], goal[2])


def placed(world, name):
    (found,) = (item for item in world.objects if item.name == name)
    return found


def place(item):
    assert item.pose[3:5] == (0.0, 0.0)
    return (LATER.get(item.model, item.model), *item.pose[:3], item.pose[5])


def same(fact, told, expected):
    """Whether two values are the same words, and numbers within the tolerance of their fact."""
    ours, theirs = told.split(), expected.split()
    close = (near(*pair, TOLERANCES.get(fact, 1e-9)) for pair in zip(ours, theirs, strict=False))
    return len(ours) == len(theirs) and all(close)


def near(one, other, tolerance):
    try:
        return abs(float(one) - float(other)) <= tolerance
    except ValueError:
        return one == other


@pytest.mark.parametrize("name", sorted(golden()))
def test_a_world_says_what_vrxs_says(name):
    told = facts(load_world(name))
    for fact, expected in golden()[name].items():
        if fact != "gates":
            assert len(told[fact]) == len(expected), fact
            assert [pair for pair in zip(told[fact], expected, strict=True) if not same(fact, *pair)] == []


COURSES = sorted(name for name, known in golden().items() if "gates" in known)
FIRST = {re.sub(r"\d+\w*$", "", name): name for name in reversed(COURSES)}.values()
"""The first of each series; the others have its objects elsewhere."""


@pytest.mark.parametrize("name", FIRST)
def test_a_course_has_vrxs_gates_red_to_starboard(name):
    task = tree_of(vrx_mj.compile_world(name).parameters)["task"]
    gates = task["channel"]["gates"] if task["type"] == "gymkhana" else task["gates"]
    assert [str(len(gates))] == golden()[name]["gates"]
    assert all(gate["left"].endswith(f"/red_bound_{index}") for index, gate in enumerate(gates))
    assert all(gate["right"].endswith(f"_bound_{index}") for index, gate in enumerate(gates))


@pytest.mark.slow
@pytest.mark.nightly
def test_so_have_the_others(subtests):
    for name in sorted({*COURSES} - {*FIRST}):
        with subtests.test(name):
            test_a_course_has_vrxs_gates_red_to_starboard(name)


CALM_GUSTS = {"wind": ["240 0 0 2 10"]}
CHANGED = {
    "vrx2022/practice/gymkhana0": {"wind": ["240 0 0 2 10"]},
    "vrx2022/practice/gymkhana1": {"sea": ["0.35 10 0.7071 0.7071"], "wind": ["72 5 4 2 7"]},
    "vrx2022/practice/gymkhana2": {"wind": ["355 9 5 2 19"]},
    "vrx2022/practice/perception0": CALM_GUSTS,
    "vrx2022/practice/perception1": CALM_GUSTS,
    "vrx2022/practice/perception2": {"sea": ["0.7 4.5 -1 0"], **CALM_GUSTS},
    "vrx2022/practice/scan_dock_deliver1": {"sea": ["0.2 9 0.6585 -0.7526"]},
    "vrx2022/practice/stationkeeping2": {"sea": ["0.7 6 0.4258 0.9048"]},
    "vrx2022/practice/wayfinding2": {"sea": ["0.8 5 -0.9945 0.1047"]},
}
"""How VRX's practice copies differ from the worlds of phase 2; in 2023 it is the light alone."""
PRACTICE = [name for name in catalogue("worlds") if "/practice/" in name and not name.endswith("0b")]


@pytest.mark.parametrize("name", PRACTICE)
def test_a_world_for_practice_is_that_of_phase_2_but_for_what_vrx_changed(name):
    told, first = facts(load_world(name)), facts(load_world(name.replace("practice", "phase2")))
    changed = {"ambient": ["1"]} if name.startswith("vrx2023") else CHANGED.get(name, {})
    expected = {**first, **changed}
    assert set(told) == set(expected)
    for fact, values in expected.items():
        assert len(told[fact]) == len(values), fact
        assert [pair for pair in zip(told[fact], values, strict=True) if not same(fact, *pair)] == []


def test_there_are_three_worlds_for_practice_of_each_kind():
    numbers = {year: len([name for name in PRACTICE if name.startswith(f"vrx{year}")]) for year in (2019, 2022, 2023)}
    assert numbers == {2019: 18, 2022: 18, 2023: 24}


@pytest.mark.parametrize("number", [1, 2])
def test_the_practice_gymkhanas_score_three_of_their_four_gates(number):
    task = tree_of(vrx_mj.compile_world(f"vrx2022/practice/gymkhana{number}").parameters)["task"]
    course = "gymkhana_navigation_course"
    pairs = [{"left": f"{course}/red_bound_{i}", "right": f"{course}/green_bound_{i}"} for i in range(3)]
    assert task["channel"]["gates"] == pairs


def test_wind_blows_on_boats_unless_its_stale_link_is_kept():
    name = "vrx2019/phase2/stationkeeping1"
    meant = tree_of(vrx_mj.compile_world(name).parameters)
    literal = tree_of(vrx_mj.compile_world({"extends": name, "physics": {"quirks": ["wind_stale_link"]}}).parameters)
    assert [hull["wind"] for hull in meant["hulls"]] == [[0.5, 0.5, 0.33]]
    assert [hull["wind"] for hull in literal["hulls"]] == [[0.0, 0.0, 0.0]]
    assert literal["wind"] == meant["wind"]


def test_the_stale_link_spares_boats_alone():
    literal = {"extends": "vrx2019/wind_test", "physics": {"quirks": ["wind_stale_link"]}}
    parameters = tree_of(vrx_mj.compile_world(literal).parameters)
    buoys = [row["wind"] for row in parameters["floats"] if row["body"].startswith("robotx_light_buoy/")]
    assert (buoys, parameters["hulls"][0]["wind"]) == ([[0.5, 0.5, 0.33]], [0.0, 0.0, 0.0])


def test_an_unknown_quirk_is_refused():
    with pytest.raises(ConfigError) as caught:
        load_world({"extends": "ocean", "physics": {"quirks": ["wind"]}})
    assert str(caught.value) == "<world>: physics.quirks[0]: expected wind_stale_link, got 'wind'"
