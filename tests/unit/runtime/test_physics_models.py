"""The models that step: what is made quickly when boats come and go is what MuJoCo makes of the whole text."""

import copy
import re

import mujoco
import numpy as np
import pytest

import vrx_mj
from vrx_mj.mjcf.compile import with_boat, without
from vrx_mj.model.world import tree_of
from vrx_mj.runtime.stepping_models import PhysicsModels, _shared_models, arena_bytes, stepping_models

TWO = {
    "boats": [
        {"name": "hinged", "pose": [0, 0, 0.1, 0, 0, 0], "engines": "hinged"},
        {"name": "fixed", "pose": [12, 0, 0.1, 0, 0, 0], "sensors": "none"},
    ]
}
FILES = {"mesh_pathadr", "npaths", "paths", "nbuffer"}
"""What models of meshes in files have, and those of meshes whose points stand in the text have not."""


def plain_models(world):
    """What MuJoCo itself makes of the text, without what is only looked at: no spec is kept, no mesh is moved."""
    seen = r'<(?:camera|texture|geom [^>]*contype="0" conaffinity="0") ?[^>]*/>'
    mesh, solid = r'<mesh name="([^"]+)"[^>]*/>', re.sub(seen, "", world.mjcf)
    used = set(re.findall(r' mesh="([^"]+)"', solid))
    solid = re.sub(mesh, lambda found: found[0] if found[1] in used else "", solid)
    quiet = re.sub(mesh, "", re.sub(r"<geom [^>]*/>", "", solid))
    for text, assets in ((solid, dict(world.assets)), (quiet, {})):
        spec = mujoco.MjSpec.from_string(text, assets=assets)
        spec.compiler.discardvisual = True
        spec.memory = arena_bytes(world.mjcf.count("\n    <frame "))
        yield spec.compile()


def different(one, other):
    """Names of all that two models differ in."""
    found = set()
    for part in ("", "opt", "stat"):
        left, right = (getattr(model, part) if part else model for model in (one, other))
        for name in (name for name in dir(left) if not name.startswith("_") and name != "narena"):  # only memory
            value, same = getattr(left, name), getattr(right, name)
            if isinstance(value, np.ndarray | np.generic | int | float | bytes):
                found |= {name} if np.asarray(value).tobytes() != np.asarray(same).tobytes() else set()
    return found


def near_first(world, **said):
    x, y, *_ = tree_of(world.parameters)["boats"][0]["pose"]
    return {"pose": [x, y + 30.0, 0.1, 0, 0, 1.0], **said}


def come_and_go(world):
    """The worlds of a run in which boats come and go, one of which was refused by the run."""
    yield world
    refused = with_boat(world, near_first(world, name="late", sensors="none"))
    yield refused
    world = with_boat(world, near_first(world, name="late", engines="hinged", sensors="vrx"))
    yield world
    world = without(world, "fixed")
    yield world
    x, y, *_ = near_first(world)["pose"]
    world = with_boat(world, {"name": "skiff", "robot": "skiff", "pose": [x + 15, y, 0.1, 0, 0, 0]})
    yield world
    world = with_boat(world, {"name": "last", "pose": [x + 30, y, 0.1, 0, 0, 0], "sensors": ["ball_shooter"]})
    yield world
    yield without(world, "skiff")


@pytest.mark.parametrize("name", ["ocean", pytest.param("stationkeeping_task", marks=pytest.mark.slow)])
@pytest.mark.filterwarnings("ignore:robot ")
def test_every_model_is_what_mujoco_makes_of_the_whole_text(name):
    fleet = TWO if name == "ocean" else {**TWO, "origin": [-500, 240, 0]}
    stepping, start = PhysicsModels(roomy=False), vrx_mj.compile_world(name, fleet=fleet)
    for world in come_and_go(start):
        solid, quiet = plain_models(world)
        made = stepping.models(world)
        assert different(solid, made[0]) <= FILES
        assert not different(quiet, made[1])
        assert made[0].ngeom > made[1].ngeom == 0


def test_what_differs_is_told():
    """So the test above can fail."""
    world = vrx_mj.compile_world("ocean", fleet=TWO)
    moved = vrx_mj.compile_world("ocean", fleet={"boats": [TWO["boats"][0], {**TWO["boats"][1], "engines": "hinged"}]})
    assert {"nbody", "body_mass"} <= different(stepping_models(world)[0], stepping_models(moved)[0])


@pytest.mark.parametrize(("robot", "read_alone"), [("wamv", 2), ("barge_4m", 2), ("cora", 3)])
def test_who_comes_last_is_joined_and_nothing_is_read_again(monkeypatch, robot, read_alone):
    """Each of both models reads the boat, and the one with shapes the meshes that it has not."""
    _shared_models.cache_clear()
    world = vrx_mj.compile_world("ocean", fleet=TWO)
    stepping = PhysicsModels(roomy=False)
    stepping.models(world)
    read = mujoco.MjSpec.from_string
    lengths = []
    monkeypatch.setattr(
        mujoco.MjSpec, "from_string", lambda text, **said: lengths.append(len(text)) or read(text, **said)
    )
    stepping.models(with_boat(world, near_first(world, name="late", robot=robot)))
    assert len(lengths) == read_alone
    assert max(lengths) < len(world.mjcf) / 2


def test_another_world_is_read():
    stepping = PhysicsModels(roomy=False)
    for world in (vrx_mj.compile_world("ocean"), vrx_mj.compile_world({"physics": {"timestep": 0.02}})):
        assert not different(stepping_models(world)[0], stepping.models(world)[0])


@pytest.mark.parametrize("roomy", [True, False])
def test_the_next_runs_of_a_world_have_the_same_models_without_compiling(monkeypatch, roomy):
    _shared_models.cache_clear()
    models = PhysicsModels(roomy=roomy).models(vrx_mj.compile_world("ocean", fleet=TWO))
    first = [*map(copy.copy, models)]
    monkeypatch.delattr(mujoco.MjSpec, "compile")
    world = vrx_mj.compile_world("ocean", fleet=TWO)
    for _ in "12":
        for model in models:
            model.body_mass[:] = 1.0  # a user's changes are of one run
        models = PhysicsModels(roomy=roomy).models(world)
        assert not any(map(different, first, models))


def test_rows_of_a_batch_have_less_memory_than_a_run_of_the_same_world():
    world = vrx_mj.compile_world("ocean")
    run, row = (PhysicsModels(roomy=roomy).models(world)[0].narena for roomy in (True, False))
    assert row < run


def test_a_world_that_differs_in_a_sign_of_zero_has_models_of_its_own():
    poses = [{"boats": [{"name": "a", "pose": [0.0, 0.0, zero, 0.0, 0.0, 0.0]}]} for zero in (0.0, -0.0)]
    one, other = (vrx_mj.compile_world("ocean", fleet=fleet).pieces for fleet in poses)
    assert one.digest != other.digest


def test_boats_join_a_run_whose_models_were_kept():
    world = vrx_mj.compile_world("ocean", fleet=TWO)
    later = with_boat(world, near_first(world, name="late"))
    for _ in "12":
        stepping = PhysicsModels()
        stepping.models(world)
    joined = stepping.models(later)
    _shared_models.cache_clear()
    assert not any(map(different, PhysicsModels().models(later), joined))
