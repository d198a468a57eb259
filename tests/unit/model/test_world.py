"""A compiled world's parameters as dataclasses: their form in JSON, and whether their tables fit each other."""

import json
import math
import random
from dataclasses import replace

import pytest
from pydantic import ValidationError

from vrx_mj.mjcf.compile import compile_world
from vrx_mj.model.things import Rope
from vrx_mj.model.world import broken_references, format_of, joined_entries, json_entries, parameters_of, tree_of

RAFT = {"name": "raft", "pose": [20, 0, 0, 0, 0, 0.3], "dynamic": True, "mooring": {}, "layout": "X  X\nX  X\nXXXX\n"}


@pytest.fixture(scope="module")
def text():
    return joined_entries(json_entries(compile_world("gymkhana").parameters)).encode()


@pytest.fixture(scope="module")
def rafts():
    world = compile_world({"docks": [RAFT, {**RAFT, "name": "other", "pose": [60, 0, 0, 0, 0, 0]}]})
    return world.parameters


@pytest.fixture(scope="module")
def swimmers():
    world = compile_world("wildlife_task", fleet={"usv_count": 2, "origin": "spawn"})
    return world.parameters


def test_the_tree_and_the_dataclasses_hold_the_same(text):
    typed, tree = parameters_of(text), json.loads(text)
    assert tree_of(typed) == tree
    assert typed.hulls[0].drag_linear == tuple(tree["hulls"][0]["drag_linear"])
    assert typed.task.pinger.x == tree["task"]["pinger"]["x"]
    assert math.isclose(typed.wind.time_constant, tree["wind"]["time_constant"])


def test_no_value_of_another_kind_is_taken(text):
    """Whatever takes the place of a table, an entry or a number is refused, or is a number that is allowed there."""
    chance, said = random.Random(1), []
    for _ in range(250):
        tree = json.loads(text)
        owner, key = tree, chance.choice(sorted(tree.keys() - {"lives", "format", "physics_version", "sensors"}))
        while isinstance(owner[key], dict | list) and owner[key] and chance.random() < 0.8:
            owner = owner[key]
            key = chance.choice(sorted(owner) if isinstance(owner, dict) else range(len(owner)))
        before = owner[key]
        owner[key] = chance.choice([None, True, "x", -3, 10**30, 1e13, [], {}, [None], {"a": 1}])
        try:
            parameters_of(json.dumps(tree).encode())
        except ValidationError as error:
            said.append(error)
        else:
            alike = {type(None): (str, list, dict), bool: (bool,), str: (str, type(None)), int: (int, float)}
            assert isinstance(before, alike.get(type(owner[key]), (dict, list, type(None)))), (key, owner[key])
    assert len(said) > 150


@pytest.mark.parametrize(("key", "number"), [("format", 4), ("profile", 0), ("mapping", 1)])
@pytest.mark.parametrize("other", ["true", "1.0", "-1"])
def test_codes_are_whole_numbers(text, key, number, other):
    """Python takes `True` and 1.0 for 1."""
    wrong = text.replace(f'"{key}": {number}'.encode(), f'"{key}": {other}'.encode(), 1)
    assert wrong != text
    with pytest.raises(ValidationError, match=rf"{key}\n  Input should be"):
        parameters_of(wrong)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e400", "1e13", "1" + "0" * 5000])
def test_a_number_is_finite_and_of_a_size_that_can_be(text, number):
    wrong = text.replace(b'"tau": 2.0', b'"tau": ' + number.encode(), 1)
    assert wrong != text
    with pytest.raises(ValidationError, match=r"sea\.tau|number out of range"):
        parameters_of(wrong)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"parent": 1}, "blocks[1].parent: 1 is not a block of its dock that comes before"),
        ({"parent": -1}, "blocks[1].parent: -1 is not a block of its dock that comes before"),
        ({"depth": 0}, "blocks[1].depth: 0 is not the number of hinges to its root"),
        ({"element_start": 10**6}, "blocks[1].element_start: there is no row 1000000 among 17 elements"),
        ({"body": "x"}, "blocks: their bodies are not those of the floating docks"),
    ],
)
def test_blocks_stand_tree_after_tree(rafts, change, fault):
    assert not list(broken_references(rafts))
    blocks = (rafts.blocks[0], replace(rafts.blocks[1], **change), *rafts.blocks[2:])
    assert next(broken_references(replace(rafts, blocks=blocks))) == fault


def test_a_block_of_another_dock_is_no_parent(rafts):
    half = len(rafts.blocks) // 2
    blocks = (*rafts.blocks[: half + 1], replace(rafts.blocks[half + 1], parent=0), *rafts.blocks[half + 2 :])
    fault = f"blocks[{half + 1}].parent: 0 is not a block of its dock that comes before"
    assert next(broken_references(replace(rafts, blocks=blocks))) == fault


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"hulls": ()}, "hulls: 0 rows for 2 boats"),
        ({"stations": ()}, "hulls[0].station_start: there is no row 3 among 0 stations"),
        ({"thrusters": ()}, "hulls[0].thruster_start: there is no row 1 among 0 thrusters"),
        ({"floats": ()}, "floats: 0 rows for 6 floating objects"),
        ({"followers": ()}, "floats[1].follower: there is no row 0 among 0 followers"),
        ({"path_points": ()}, "followers[0].waypoint_start: there is no row 1 among 0 path_points"),
        ({"lights": ()}, None),
        ({"boats": ()}, "hulls: 2 rows for 0 boats"),
    ],
)
def test_a_table_has_as_many_rows_as_are_pointed_at(swimmers, change, fault):
    assert next(broken_references(replace(swimmers, **change)), None) == fault


def test_a_thruster_is_one_of_its_hull(swimmers):
    thrusters = (replace(swimmers.thrusters[0], hull=1), *swimmers.thrusters[1:])
    fault = "thrusters[0].hull: 1 is not the hull whose thruster it is"
    assert next(broken_references(replace(swimmers, thrusters=thrusters))) == fault


def test_a_line_holds_something(rafts):
    moored = replace(rafts.moorings[-1], block=len(rafts.blocks))
    found = list(broken_references(replace(rafts, moorings=(*rafts.moorings[:-1], moored))))
    place, count = f"moorings[{len(rafts.moorings) - 1}].block", len(rafts.blocks)
    assert found == [f"{place}: there is no row {count} among {count} blocks"]
    rope = Rope(float=len(rafts.floats), anchor=(0.0, 0.0), length=1.0, stiffness=1.0, damping=1.0)
    assert list(broken_references(replace(rafts, ropes=(rope,)))) == [
        f"ropes[0].float: there is no row {len(rafts.floats)} among {len(rafts.floats)} floats"
    ]


def test_a_name_is_given_once(swimmers):
    twin = replace(swimmers.boats[1], name=swimmers.boats[0].name)
    named = list(broken_references(replace(swimmers, boats=(swimmers.boats[0], twin))))
    assert "boats, objects and docks: the name 'wamv1' is given 2 times" in named
    both = (*swimmers.boats, *swimmers.boats)
    named = [fault for fault in broken_references(replace(swimmers, boats=both)) if "given 2 times" in fault]
    assert len(named) == len(swimmers.boats)


def test_a_hull_has_the_thrusters_that_say_so(swimmers):
    wrong = replace(swimmers.thrusters[3], hull=0)
    found = next(broken_references(replace(swimmers, thrusters=(*swimmers.thrusters[:3], wrong))))
    assert found == "thrusters[3].hull: 0 is not the hull whose thruster it is"


def test_a_key_that_is_given_twice_is_refused(text):
    with pytest.raises(ValueError, match=r"^the key 'seed' is given twice$"):
        parameters_of(text.replace(b'"seed": 0', b'"seed": 0, "seed": 1', 1))


def test_a_text_has_so_many_bytes(text, monkeypatch):
    monkeypatch.setattr("vrx_mj.model.world.MOST_BYTES", len(text))
    assert parameters_of(text)
    with pytest.raises(ValueError, match=rf"^{len(text) + 1:,} bytes; at most {len(text):,} are read$"):
        parameters_of(text + b" ")


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"thruster_start": 3}, "hulls: thruster_start is 3 where thrusters were left at 2"),
        ({"thruster_count": 1}, "hulls: they have 3 thrusters of 4"),
    ],
)
def test_spans_of_rows_follow_each_other_and_leave_none_out(swimmers, change, fault):
    hulls = (swimmers.hulls[0], replace(swimmers.hulls[1], **change))
    assert fault in list(broken_references(replace(swimmers, hulls=hulls)))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"body": "x", "follower": -1}, "links[0].body: 'x' is not a body of an object"),
        ({"follower": 0}, "links[0].follower: a link has none"),
    ],
)
def test_a_link_is_a_body_of_an_object_and_follows_no_path(swimmers, change, fault):
    links = (replace(swimmers.floats[0], **change),)
    assert fault in broken_references(replace(swimmers, links=links))


def test_the_version_is_read_before_all_else():
    assert format_of(b'{"format": 99, "hulls": 1}') == 99
    with pytest.raises(ValidationError):
        format_of(b'{"hulls": 1}')


def test_a_race_is_that_of_a_thruster(swimmers):
    wrong = replace(swimmers.thrusters[0], race=4)
    found = next(broken_references(replace(swimmers, thrusters=(wrong, *swimmers.thrusters[1:]))))
    assert found == "thrusters[0].race: there is no row 4 among 4 thrusters"
