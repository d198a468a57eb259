"""Fields and markers: where they are, and that what steps knows nothing of markers."""

import hashlib
import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.errors import CompileError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.objects import _Ground
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.mjcf.terrain import on_land, shoreline
from vrx_mj.model.world import tree_of
from vrx_mj.runtime.stepping_models import stepping_models

KINDS = [{"model": "mb_marker_buoy_red", "count": 8, "name": "red"}, {"model": "polyform_a5", "count": 7}]
FIELD = {"name": "field", "size": 60, "center": [-520, 190], "min_distance": 6, "objects": KINDS}
DOCK = {"name": "dock", "layout": "XXX\nX X", "pose": [-518, 192, 0, 0, 0, 0.4]}
POST = {"name": "post", "model": "post", "pose": [-525, 185, 0, 0, 0, 0]}


def field_of(world):
    items = [item for item in tree_of(world.parameters)["objects"] if item["name"].startswith("field/")]
    return [item["name"] for item in items], np.array([item["pose"][:2] for item in items])


def apart(points, others):
    return np.linalg.norm(points[:, None] - np.array(others)[None], axis=-1)


def drawn(seed, *names):
    """The first two numbers of a stream: SplitMix64 in whole numbers, from the seed's and the names' hash."""
    text = "\0".join(f"{type(name).__name__}:{name}" for name in (seed, *names))
    key = int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little")
    for counter in (1, 2):
        z = (key + counter * 0x9E3779B97F4A7C15) % 2**64
        z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
        yield ((z ^ z >> 31) >> 11) / 2**53


@pytest.fixture(scope="module")
def course():
    return compile_world({"extends": "sydney_regatta", "fields": [FIELD], "docks": [DOCK], "objects": [POST]})


def test_a_field_is_named_by_its_kinds(course):
    names, _ = field_of(course)
    assert names == [*(f"field/red_{i}" for i in range(8)), *(f"field/polyform_a5_{i}" for i in range(7))]


def test_nothing_of_a_field_is_too_near_to_anything(course):
    _, points = field_of(course)
    assert np.all(np.abs(points - (-520, 190)) <= 30.0)
    assert apart(points, points)[~np.eye(len(points), dtype=bool)].min() >= 6.0
    spawn = tree_of(course.parameters)["boats"][0]["pose"][:2]
    assert apart(points, [spawn, (-525, 185)]).min() >= 6.0
    turn = np.array([[math.cos(0.4), -math.sin(0.4)], [math.sin(0.4), math.cos(0.4)]])
    edge = np.linspace(-1.0, 1.0, 9)
    for i, j in tree_of(course.parameters)["docks"][0]["cells"]:
        block = np.array([(2 * i + a, 2 * j + b) for a in edge for b in edge]) @ turn.T + (-518, 192)
        assert apart(points, block).min() >= 6.0


def test_a_field_keeps_off_the_shore():
    field = {**FIELD, "size": 120, "center": [-540, 160], "min_distance": 5}
    _, points = field_of(compile_world({"extends": "sydney_regatta", "fields": [field]}))
    fine = [
        np.linspace(a, b, max(2, int(math.dist(a, b) / 0.1)))
        for ring in shoreline("sydney_regatta")
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
    ]
    assert apart(points, np.concatenate(fine)).min() >= 5.0 - 1e-6
    assert not any(on_land("sydney_regatta", *point) for point in points)


def test_a_field_is_the_same_every_time_and_another_with_another_seed():
    world = {"extends": "ocean", "fields": [{"name": "field", "size": 60, "objects": KINDS, "seed": 5}]}
    _, points = field_of(compile_world(world))
    assert points[0].tolist() == [60.0 * (share - 0.5) for share in drawn(5, "field", "field")]
    assert np.array_equal(field_of(compile_world(world))[1], points)
    assert np.array_equal(field_of(compile_world(world, seed=77))[1], points)
    world["fields"][0]["seed"] = 6
    assert not np.any(np.isclose(field_of(compile_world(world))[1], points))


def test_another_field_does_not_change_the_first():
    first = {"name": "field", "size": 60, "objects": KINDS}
    alone = field_of(compile_world({"extends": "ocean", "fields": [first]}))[1]
    both = compile_world({"extends": "ocean", "fields": [first, {**first, "name": "other"}]})
    assert np.array_equal(field_of(both)[1], alone)
    points = np.array([item["pose"][:2] for item in tree_of(both.parameters)["objects"]])
    assert apart(points, points)[~np.eye(len(points), dtype=bool)].min() >= 5.0


def test_a_full_field_says_how_many_it_holds():
    field = {"name": "f", "size": 10, "min_distance": 8, "center": [100, 0], "objects": [{"model": "post", "count": 9}]}
    with pytest.raises(CompileError) as caught:
        compile_world({"extends": "ocean", "name": "mine", "fields": [field]})
    assert str(caught.value) == (
        "world mine: the field f is full: 3 of its 9 objects fit in 10 m x 10 m around (100, 0), "
        "8 m from each other, boats, other objects, docks and the shore (1000 places were tried for the next one)"
    )


MARKED = {"extends": "ocean", "markers": {"places": [[8, 1, math.pi / 2], [-3, 0, 0]]}}


def test_a_marker_is_two_cylinders_that_only_pictures_have():
    plain, marked = compile_world({"extends": "ocean"}), compile_world(MARKED)
    assert marked.mjcf == plain.mjcf
    assert stepping_models(marked)[0].ngeom == stepping_models(plain)[0].ngeom
    model = drawing_model(marked)
    assert model.ngeom == drawing_model(plain).ngeom + 4
    upright, lying = (model.geom(f"vrx_mj/marker_{i}") for i in range(2))
    assert upright.pos == pytest.approx((8.0, 1.0, 1.5))
    assert lying.pos == pytest.approx((8.0, 2.0, 1.5))
    assert upright.size[:2] == pytest.approx((0.1, 1.0))
    assert upright.rgba == pytest.approx((1.0, 0.0, 0.0, 1.0))
    w, x, y, z = lying.quat
    axis = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    assert np.abs(axis) == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)


def test_the_goals_of_a_task_have_markers_unless_told_otherwise():
    task = {"type": "wayfinding", "waypoints_cart": [[10, 0, 0], [10, 10, 1]]}
    assert len(tree_of(compile_world({"extends": "ocean", "task": task}).parameters)["markers"]) == 4
    hidden = compile_world({"extends": "ocean", "task": task, "markers": {"task": False}})
    assert tree_of(hidden.parameters)["markers"] == []


def test_no_number_of_the_stream_is_used_for_two_coordinates(course):
    offsets = (field_of(course)[1] - FIELD["center"]).round(9).ravel().tolist()
    assert len(set(offsets)) == len(offsets)


@pytest.mark.parametrize(("away", "clear"), [(0.7, False), (1.1, True)])
def test_distances_to_a_dock_are_from_the_corners_of_its_blocks(away, clear):
    dock = SimpleNamespace(config=SimpleNamespace(block=2.0), pose=(0.0,) * 6, cells=[(0, 0)])
    ground = _Ground(SimpleNamespace(terrain=None, folder=None), [dock])
    place = 1.0 + away / math.sqrt(2.0)
    assert ground.clear(place, place, 1.0) == clear
