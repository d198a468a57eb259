"""Pieces of worlds: a saved world keeps them, a former one is one piece, and groups are read as the whole."""

import mujoco
import numpy as np
import pytest

from trees import make_world
from vrx_mj.mjcf.compile import compile_world, with_boat, without
from vrx_mj.mjcf.pieces import MIN_GROUPED, Detail
from vrx_mj.mjcf.world import World

RAFT = {"name": "raft", "pose": [20, 0, 0, 0, 0, 0.3], "dynamic": True, "layout": "X  X\nX  X\nXXXX\n"}
WORLDS = {
    "rafts": ({"extends": "ocean_buoys", "docks": [RAFT]}, {"usv_count": 2, "engines": "hinged", "thrusters": "X"}),
    "a task with docks": ("scan_dock_deliver", None),
    "a boat that is held": ("gymkhana", None),
    "meshes that collide": ("ocean", {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0], "robot": "skiff"}]}),
    "nothing": ({}, {"boats": []}),
}


def former(world):
    """The world as it is read from a folder without pieces."""
    return make_world(world.mjcf, world.assets, world.parameters)


@pytest.mark.parametrize("name", WORLDS)
def test_a_saved_world_keeps_its_pieces(name, tmp_path):
    world, fleet = WORLDS[name]
    world = compile_world(world, fleet=fleet)
    world.save(tmp_path)
    again = World.load(tmp_path)
    assert again.pieces == world.pieces
    kinds = [{id(part.piece) for part in one.pieces.parts} for one in (world, again)]
    assert len(kinds[0]) >= len(kinds[1]) == len(list((tmp_path / "pieces").iterdir())) - 1
    assert (again.sha256, again.files()) == (world.sha256, world.files())


@pytest.mark.parametrize("name", WORLDS)
def test_one_piece_makes_the_same_models(name):
    world, fleet = WORLDS[name]
    world = compile_world(world, fleet=fleet)
    assert former(world).sha256 == world.sha256
    for detail in Detail:
        assert not different(former(world).pieces.spec(detail).compile(), world.pieces.spec(detail).compile())


@pytest.mark.parametrize("name", WORLDS)
def test_a_model_of_visuals_has_all_that_is_seen_and_nothing_else(name):
    world, fleet = WORLDS[name]
    pieces = compile_world(world, fleet=fleet).pieces
    whole, visuals = (pieces.spec(detail).compile() for detail in (Detail.WHOLE, Detail.VISUALS))

    def seen(model):
        shapes = np.flatnonzero((model.geom_contype == 0) & (model.geom_conaffinity == 0))
        columns = model.geom_type, model.geom_size, model.geom_pos, model.geom_quat, model.geom_rgba
        bodies = [model.body(body).name for body in model.geom_bodyid[shapes]]
        meshes = [model.mesh(mesh).name if mesh >= 0 else "" for mesh in model.geom_dataid[shapes]]
        return bodies, meshes, [column[shapes].tolist() for column in columns]

    assert seen(visuals) == seen(whole)
    assert visuals.ngeom == len(seen(whole)[0])
    assert {*seen(visuals)[1]} - {""} == {visuals.mesh(mesh).name for mesh in range(visuals.nmesh)}


def test_boats_come_and_go_in_a_world_of_one_piece():
    def later(world):
        entry = {"name": "a", "pose": [60, 0, 0.1, 0, 0, 0.2], "sensors": ["ball_shooter"]}
        return without(with_boat(without(world, "wamv2"), entry), "wamv3")

    world = compile_world(
        "wayfinding_task", fleet={"usv_count": 3, "thrusters": "X", "engines": "hinged", "origin": "spawn"}
    )
    one, other = later(world), later(former(world))
    assert one.mjcf == other.mjcf
    for detail in Detail:
        assert not different(one.pieces.spec(detail).compile(), other.pieces.spec(detail).compile())


def different(one, other):
    """Names of all arrays that two models differ in."""
    return {
        name
        for name in dir(one)
        if name != "_address"
        and isinstance(getattr(one, name), np.ndarray | bytes | int)
        and np.asarray(getattr(one, name)).tobytes() != np.asarray(getattr(other, name)).tobytes()
    }


@pytest.mark.parametrize("detail", Detail)
def test_groups_are_read_as_the_whole(detail, monkeypatch):
    boats = [
        {"name": f"{'w' if number < 40 else 'x'}{number}", "pose": [15.0 * number, 0, 0.1, 0, 0, 0.1]}
        | ({"sensors": "none", "robot": "skiff"} if number % 5 == 0 else {"engines": "hinged"})
        for number in range(60)
    ]
    world = compile_world({"objects": [{"name": "b", "model": "robotx_light_buoy", "pose": [0, 40, 0, 0, 0, 0]}]},
                          fleet={"boats": boats})  # fmt: skip
    pieces = world.pieces
    assert len(pieces.parts) > MIN_GROUPED
    lengths, from_string = [], mujoco.MjSpec.from_string
    monkeypatch.setattr(
        mujoco.MjSpec, "from_string", lambda text, **files: lengths.append(len(text)) or from_string(text, **files)
    )
    grouped = pieces.spec(detail)
    assert len(lengths) > 3
    monkeypatch.setattr("vrx_mj.mjcf.pieces.MIN_GROUPED", 10_000)
    whole = pieces.spec(detail)
    assert not different(grouped.compile(), whole.compile())


def test_what_only_a_removed_part_uses_goes_with_it():
    fleet = {"boats": [{"name": name, "pose": [x, 0, 0.1, 0, 0, 0], "robot": robot, "sensors": "none"}
                       for name, x, robot in (("a", 0, "wamv"), ("b", 30, "skiff"), ("c", 60, "skiff"))]}  # fmt: skip
    pieces = compile_world("ocean", fleet=fleet).pieces
    assert pieces.without("b").assets == pieces.assets
    alone = pieces.without("b").without("c")
    assert len(alone.assets) < len(pieces.assets)
    assert alone.files.keys() < pieces.files.keys()


def test_the_first_of_each_kind_comes_with_its_ball():
    kinds = {"a": ("wamv", "none"), "b": ("wamv", "vrx"), "c": ("wamv", "vrx"), "d": ("skiff", "none")}
    fleet = {"boats": [{"name": name, "pose": [30 * x, 0, 0.1, 0, 0, 0], "robot": robot, "sensors": sensors}
                       for x, (name, (robot, sensors)) in enumerate(kinds.items())]}  # fmt: skip
    pieces = compile_world("ocean", fleet=fleet).pieces
    few = pieces.first_of_each_kind()
    assert [part.name for part in few.parts] == ["a", "b", "b/ball_shooter", "d"]
    assert few.assets == pieces.assets
    few.spec().compile()
