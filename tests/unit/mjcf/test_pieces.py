"""Pieces of worlds: those of a loaded world are what it was joined of, and groups of them are read as the whole."""

import mujoco
import numpy as np
import pytest

from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.pieces import MANY, Detail, pieces_of

RAFT = {"name": "raft", "pose": [20, 0, 0, 0, 0, 0.3], "dynamic": True, "layout": "X  X\nX  X\nXXXX\n"}
WORLDS = {
    "rafts": ({"extends": "ocean_buoys", "docks": [RAFT]}, {"usv_count": 2, "engines": "hinged", "thrusters": "X"}),
    "a task with docks": ("scan_dock_deliver", None),
    "a boat that is held": ("gymkhana", None),
    "meshes that collide": ("ocean", {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0], "robot": "skiff"}]}),
    "nothing": ({}, {"boats": []}),
}


def read(world):
    return pieces_of(world.mjcf, world.assets, world.parameters)


@pytest.mark.parametrize("name", WORLDS)
def test_the_pieces_of_a_loaded_world_are_those_it_was_joined_of(name):
    world, fleet = WORLDS[name]
    world = compile_world(world, fleet=fleet)
    pieces, again = world.pieces, read(world)
    assert again.text() == world.mjcf
    assert again.files == world.assets
    assert {part.name for part in again.parts if part.is_prefixed} >= {
        part.name for part in pieces.parts if part.is_prefixed
    }
    assert again.touches == pieces.touches
    for detail in Detail:
        assert not different(again.spec(detail).compile(), pieces.spec(detail).compile())


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
    assert len(pieces.parts) > MANY
    lengths, from_string = [], mujoco.MjSpec.from_string
    monkeypatch.setattr(
        mujoco.MjSpec, "from_string", lambda text, **files: lengths.append(len(text)) or from_string(text, **files)
    )
    grouped = pieces.spec(detail)
    assert len(lengths) > 3
    monkeypatch.setattr("vrx_mj.mjcf.pieces.MANY", 10_000)
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
