"""Worlds with one boat more, or one less: the same as if they had been compiled so."""

import json

import mujoco
import pytest

from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.joining import with_boat, without_boat
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
    left = without_boat(compiled(ONE, TWO, LATE), "two")
    assert tree_of(left.parameters)["lives"] == {"two": 1}
    rest = {key: value for key, value in without_waiting_places(left).items() if key != "lives"}
    expected = compiled(ONE, LATE)
    assert rest == without_waiting_places(expected)
    assert lines(left) == lines(expected)


def test_who_comes_and_goes_leaves_nothing_behind():
    world = began = compiled(ONE, TWO)
    for _ in range(5):
        world = without_boat(with_boat(world, {**LATE, "robot": "skiff"}), "late")
    assert world.mjcf == began.mjcf
    assert world.assets == began.assets
    assert tree_of(world.parameters) == {**tree_of(began.parameters), "lives": {"late": 5}}


def test_a_world_is_not_changed_by_the_one_that_follows_from_it():
    world = compiled(ONE, TWO)
    before, mjcf = json.dumps(dict(tree_of(world.parameters))), world.mjcf
    without_boat(with_boat(world, LATE), "one")
    assert (json.dumps(dict(tree_of(world.parameters))), world.mjcf) == (before, mjcf)


def test_balls_wait_apart():
    world = compiled(ONE, TWO)
    world = with_boat(without_boat(world, "one"), LATE)
    world = with_boat(world, {**ONE, "name": "again"})
    places = [tuple(item["pose"][:3]) for item in tree_of(world.parameters)["objects"]]
    assert len(set(places)) == len(places)


def test_a_boat_alone_has_all_that_is_seen_of_it():
    world = compiled(ONE, TWO)
    whole = mujoco.MjSpec.from_string(world.mjcf, assets=dict(world.assets)).compile()
    alone = world.pieces.spec_of("two").compile()

    def shapes(model):
        own = [geom for geom in range(model.ngeom) if model.body(model.geom_bodyid[geom]).name.startswith("two/")]
        own = [geom for geom in own if "ball_shooter/" not in model.body(model.geom_bodyid[geom]).name]
        return [(model.geom(geom).name, model.geom_type[geom], model.geom_rgba[geom].tolist()) for geom in own]

    assert shapes(alone) == shapes(whole)
    assert len(shapes(alone)) == alone.ngeom > 20
