"""Worlds with one boat, object or dock more, or one less: the same as if they had been compiled so."""

import json

import mujoco
import pytest

from vrx_mj.errors import CommandError, ConfigError, VrxWarning
from vrx_mj.mjcf.compile import compile_world, with_boat, with_dock, with_object, without
from vrx_mj.model.world import tree_of

ONE = {"name": "one", "pose": [0.0, 0.0, 0.1, 0.0, 0.0, 0.5]}
TWO = {"name": "two", "pose": [30.0, 5.0, 0.1, 0.0, 0.0, -1.0], "engines": "hinged"}
LATE = {"name": "late", "pose": [60.0, 0.0, 0.1, 0.0, 0.0, 0.0]}
BUOY = {"name": "buoy", "model": "robotx_light_buoy", "pose": [30, 40, 0.5, 0, 0, 0]}
WORLD = {
    "wind": {"mean_velocity": 3, "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
    "objects": [BUOY],
    "docks": [{"name": "dock", "pose": [0, 80, 0, 0, 0, 0], "layout": "X X\nXXX", "dynamic": True}],
}


def compiled(*boats):
    return compile_world(WORLD, fleet={"boats": list(boats)})


def without_waiting_places(world):
    """Its parameters but for where balls wait, which goes by the order in which boats came."""
    tree = json.loads(json.dumps(dict(tree_of(world.parameters))))
    for item in tree["objects"]:
        if item["model"] == "blue_projectile":
            del item["pose"]
    return tree


def lines(world):
    """The MJCF in any order, but for the frames in which balls wait."""
    return sorted(line for line in world.mjcf.splitlines() if " -200.0" not in line)


@pytest.mark.parametrize(
    "said",
    [
        {"sensors": "none"},
        {"sensors": "vrx"},
        {"sensors": "none", "engines": "hinged", "color": [1, 0, 0, 1]},
        {"robot": "skiff"},
    ],
    ids=["plain", "with all sensors", "hinged and red", "a skiff"],
)
def test_a_boat_that_joins_is_as_if_compiled_last(said):
    joined = with_boat(compiled({**ONE, "sensors": "none"}), {**LATE, **said})
    there = compiled({**ONE, "sensors": "none"}, {**LATE, **said})
    assert without_waiting_places(joined) == without_waiting_places(there)
    assert joined.assets.keys() == there.assets.keys()
    assert lines(joined) == lines(there)


def test_a_boat_that_leaves_is_as_if_never_compiled():
    left = without(compiled(ONE, TWO, LATE), "two")
    assert tree_of(left.parameters)["lives"] == {"two": 1}
    rest = {key: value for key, value in without_waiting_places(left).items() if key != "lives"}
    expected = compiled(ONE, LATE)
    assert rest == without_waiting_places(expected)
    assert lines(left) == lines(expected)


def test_who_comes_and_goes_leaves_nothing_behind():
    world = began = compiled(ONE, TWO)
    for _ in range(5):
        world = without(with_boat(world, {**LATE, "robot": "skiff"}), "late")
    assert world.mjcf == began.mjcf
    assert world.assets == began.assets
    assert tree_of(world.parameters) == {**tree_of(began.parameters), "lives": {"late": 5}}


def test_a_world_is_not_changed_by_the_one_that_follows_from_it():
    world = compiled(ONE, TWO)
    before, mjcf = json.dumps(dict(tree_of(world.parameters))), world.mjcf
    without(with_boat(world, LATE), "one")
    assert (json.dumps(dict(tree_of(world.parameters))), world.mjcf) == (before, mjcf)


def test_balls_wait_apart():
    world = compiled(ONE, TWO)
    world = with_boat(without(world, "one"), LATE)
    world = with_boat(world, {**ONE, "name": "again"})
    places = [tuple(item["pose"][:3]) for item in tree_of(world.parameters)["objects"]]
    assert len(set(places)) == len(places)


def test_names_that_ros_refuses_are_told_of_boats_that_are_there_and_that_join():
    world = compiled(ONE)
    for make in (lambda boat: compiled(ONE, boat), lambda boat: with_boat(world, boat)):
        with pytest.warns(VrxWarning, match=r"^ROS refuses topics with the name of boat 'late-1': a letter, then "):
            make({**LATE, "name": "late-1"})


def test_what_has_no_room_or_no_such_layout_does_not_join(monkeypatch):
    world = compiled(ONE)
    with pytest.raises(ConfigError, match=r"^<boat>: thrusters: no thruster layout named 'Z'; known: H, T, X$"):
        with_boat(world, {**LATE, "thrusters": "Z"})
    count = len(world.parameters.objects)
    monkeypatch.setattr("vrx_mj.mjcf.compile.MOST_OBJECTS", count + 1)
    full = with_object(world, {**BUOY, "name": "other"})
    with pytest.raises(CommandError, match=rf"^no room for more: a world has at most {count + 1} objects$"):
        with_object(full, {**BUOY, "name": "more"})


def test_a_boat_alone_has_all_that_is_seen_of_it():
    world = compiled(ONE, TWO)
    whole = mujoco.MjSpec.from_string(world.mjcf, assets=dict(world.assets)).compile()
    alone = world.pieces.spec_of("two").compile()

    def shapes(model):
        own = [geom for geom in range(model.ngeom) if model.body(model.geom_bodyid[geom]).name.startswith("two/")]
        own = [geom for geom in own if "ball_shooter/" not in model.body(model.geom_bodyid[geom]).name]
        own = [geom for geom in own if not model.geom_contype[geom] and not model.geom_conaffinity[geom]]
        return [(model.geom(geom).name, model.geom_type[geom], model.geom_rgba[geom].tolist()) for geom in own]

    assert shapes(alone) == shapes(whole)
    assert len(shapes(alone)) == alone.ngeom > 20


PLACE = [90.0, 20.0, 0.25, 0.0, 0.0, 0.4]
OBJECTS = {
    "a light buoy": {"name": "more", "model": "robotx_light_buoy", "pose": PLACE},
    "a course": {"name": "more", "model": "short_navigation_course0", "pose": PLACE},
    "a dock with placards": {"name": "more", "model": "dock_2022", "pose": PLACE, "symbols": ["red_cross"]},
    "one that swims": {"name": "more", "model": "crocodile_buoy", "pose": PLACE, "path": {"circle": {"radius": 5}}},
    "a fixed one": {"name": "more", "model": "post", "pose": PLACE},
}
DOCKS = {
    "fixed, with bays": {"name": "more", "layout": "X X\nXXX", "pose": PLACE, "bays": [{"symbol": "red_cross"}]},
    "floating": {"name": "more", "layout": ["X X", "XXX"], "pose": PLACE, "dynamic": True, "mooring": {}},
}


def sorted_tables(world):
    """The tables in which objects and docks have rows, each in any order, without numbers of other rows."""
    tree = tree_of(world.parameters)
    numbers = {"element_start", "waypoint_start", "follower", "parent", "block"}
    tables = ("objects", "floats", "elements", "docks", "blocks", "moorings", "followers", "path_points", "lights",
              "placards")  # fmt: skip
    plain = {
        table: [{key: value for key, value in row.items() if key not in numbers} for row in tree[table]]
        for table in tables
    }
    return {table: sorted(map(json.dumps, rows)) for table, rows in plain.items()}


@pytest.mark.parametrize(
    ("entry", "key"),
    [*((entry, "objects") for entry in OBJECTS.values()), *((entry, "docks") for entry in DOCKS.values())],
    ids=[*OBJECTS, *DOCKS],
)
def test_an_object_or_dock_that_joins_is_as_if_compiled(entry, key):
    world = compiled({**ONE, "sensors": "none"})
    joined = (with_object if key == "objects" else with_dock)(world, entry)
    there = compile_world({**WORLD, key: [*WORLD[key], entry]}, fleet={"boats": [{**ONE, "sensors": "none"}]})
    assert sorted_tables(joined) == sorted_tables(there)
    assert joined.assets.keys() == there.assets.keys()
    assert sorted(joined.mjcf.splitlines()) == sorted(there.mjcf.splitlines())
    left = without(joined, "more")
    assert left.mjcf == world.mjcf
    assert left.assets == world.assets
    assert tree_of(left.parameters) == tree_of(world.parameters)


def test_who_leaves_takes_nobody_elses_line_or_path():
    """Things in twos, each with numbers of its own: what is left has by name what it had."""
    things = [
        {"name": f"{kind}_{number}", "pose": [40 * number, 20 * row, 0, 0, 0, 0], **how(number)}
        for row, (kind, how) in enumerate({
            "held": lambda n: {"model": "robotx_light_buoy", "mooring": {"length": 1 + n}},
            "swims": lambda n: {"model": "crocodile_buoy", "path": {"circle": {"radius": 3 + n}}},
        }.items())
        for number in range(2)
    ]  # fmt: skip
    docks = [
        {"name": f"dock_{n}", "layout": "X X\nXXX", "pose": [40 * n, 60, 0, 0, 0, n], "dynamic": True, "mooring": {}}
        for n in range(2)
    ]
    world = compile_world({"physics": {"profile": "marine"}, "objects": things, "docks": docks}, fleet="none")

    def lines(world):
        """Lines and paths by the body that has them."""
        own = world.parameters
        found = [(own.floats[rope.float].body, rope.anchor, rope.length) for rope in own.ropes]
        found += [(own.blocks[line.block].body, line.anchor, line.point) for line in own.moorings]
        for row in own.floats:
            if row.follower >= 0:
                path = own.followers[row.follower]
                places = own.path_points[path.waypoint_start : path.waypoint_start + path.waypoint_count]
                found.append((row.body, *(place.position for place in places)))
        return sorted(found)

    whole = lines(world)
    assert {line[0].partition("/")[0] for line in whole} == {item["name"] for item in (*things, *docks)}
    for name in (item["name"] for item in (*things, *docks)):
        assert lines(without(world, name)) == [line for line in whole if not line[0].startswith(f"{name}/")], name


@pytest.mark.parametrize("name", ["buoy", "dock", "one"])
def test_what_was_compiled_leaves_and_the_rest_keeps_its_numbers(name):
    """Rows refer to rows of other tables by their numbers, which are others now."""
    whole = with_dock(with_object(compiled(ONE, TWO), OBJECTS["one that swims"]), {**DOCKS["floating"], "name": "pier"})
    left = without(whole, name)
    for before, after in ((whole, left),):
        old, new = before.parameters, after.parameters
        kept = {row.body: row for row in new.floats}
        for row in old.floats:
            if not row.body.startswith(f"{name}/"):
                same = kept[row.body]
                part = slice(row.element_start, row.element_start + row.element_count)
                own = slice(same.element_start, same.element_start + same.element_count)
                assert old.elements[part] == new.elements[own]
                assert (row.follower < 0) == (same.follower < 0)
        lines = [new.blocks[line.block].body for line in new.moorings]
        assert lines == [old.blocks[line.block].body for line in old.moorings]
        for block in new.blocks:
            assert block.parent < 0 or new.blocks[block.parent].body.partition("/")[0] == block.body.partition("/")[0]
    swimmer = next(row for row in left.parameters.floats if row.body.startswith("more/"))
    follower = left.parameters.followers[swimmer.follower]
    assert follower.waypoint_count == len(left.parameters.path_points) == 8
