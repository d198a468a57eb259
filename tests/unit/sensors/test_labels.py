"""Labels of pictures: boxes, areas and masks have closed forms for spheres and boxes."""

import functools
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from vrx_mj.config.sensors import CameraConfig
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.sensors.camera import Cameras
from vrx_mj.sensors.view import CATEGORIES, Labeller, category_of

SPHERE, BOX = 0.106, 0.171
"""Radius of `demo_sphere` and edge of `demo_box` [m]."""
CAMERA = CameraConfig(name="camera", link="l", frame="f", width=640, height=480, noise=0.0)
FOCAL = 320.0 / math.tan(CAMERA.horizontal_fov / 2.0)
EYE = np.array([0.0, 0.0, 1.5])
CALM = {"model": "pms", "gain": 0.0, "period": 5.0}
WAVES = {"model": "pms", "gain": 0.3, "period": 3.0, "scale": 1.5, "tau": 0.0}
FOG = {"type": "linear", "color": [0.5, 0.6, 0.7], "start": 1, "end": 4}
AT_ONE = (3.0, 0.4, 1.7)
WORLDS = {
    "one": {"objects": [("demo_sphere", AT_ONE)]},
    "behind": {"objects": [("demo_sphere", (-3.0, 0.0, 1.5)), ("demo_sphere", (3.0, 8.0, 1.5))]},
    "half hidden": {"objects": [("demo_box", (1.5, 0.0855, 1.5)), ("demo_sphere", (2.5, 0.0, 1.5))]},
    "hidden": {"objects": [("demo_box", (1.5, 0.0, 1.5)), ("demo_sphere", (2.5, 0.0, 1.5))]},
    "afloat": {"objects": [("demo_sphere", (2.0, 0.0, 0.0))]},
    "in waves": {"objects": [("demo_sphere", (2.0, 0.0, 0.0))], "sea": WAVES},
    "under water": {"objects": [("demo_sphere", (2.0, 0.0, -0.5))]},
    "fog": {"objects": [("demo_sphere", (3.9, 0.0, 1.5)), ("demo_box", (4.2, 0.5, 1.5))], "scene": {"fog": FOG}},
}


@functools.cache
def drawn(world):
    """Cameras, data and labeller of a world."""
    kept = WORLDS[world]
    things = [
        {"name": f"thing{i}", "model": model, "pose": [*place, 0, 0, 0]}
        for i, (model, place) in enumerate(kept["objects"])
    ]
    compiled = compile_world({"spawn": {"pose": [-60, 0, 0.1, 0, 0, 0]}, "sea": CALM, **kept, "objects": things})
    model = drawing_model(compiled)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return Cameras(model, compiled.parameters), data, Labeller(model, compiled.parameters)


def labels(world, *, eye=EYE, time=20.0, camera=CAMERA, own="nobody"):
    cameras, data, labeller = drawn(world)
    cameras.image(camera, data, np.array(eye), np.eye(3), time)
    return labeller(cameras.seen_geoms(camera), own)


def extent(ahead, beside, radius):
    """The least and the greatest tangent under which a sphere is seen in a plane through the eye."""
    root = radius * math.sqrt(ahead**2 + beside**2 - radius**2)
    return sorted((ahead * beside + side * root) / (ahead**2 - radius**2) for side in (-1.0, 1.0))


def sphere_box(place, eye, radius):
    """First and last edge along columns, then along rows, of a sphere's outline [pixels]."""
    ahead, left, up = np.subtract(place, eye)
    found = ((320, extent(ahead, -left, radius)), (240, extent(ahead, -up, radius)))
    return [middle + FOCAL * edge for middle, both in found for edge in both]


def edges(label):
    x, y, width, height = label.box
    return [x, x + width, y, y + height]


@pytest.mark.render
@pytest.mark.parametrize("samples", [0, 4])
@pytest.mark.parametrize("eye", [(0.0, 0.0, 1.5), (1.2, 0.0, 1.5), (0.5, 1.4, 2.3)])
def test_the_box_of_a_sphere_is_that_of_its_projection(eye, samples):
    (found,) = labels("one", eye=eye, camera=CAMERA.model_copy(update={"antialiasing": samples})).objects
    assert (found.name, found.category, found.category_id) == ("thing0", "object", CATEGORIES["object"]["id"])
    assert edges(found) == pytest.approx(sphere_box(AT_ONE, eye, SPHERE), abs=1.0)
    ahead, *aside = np.subtract(AT_ONE, eye)
    distance2 = ahead**2 + np.dot(aside, aside)
    # an ellipse's area: its cone's section by the plane of the picture
    area = math.pi * FOCAL**2 * SPHERE**2 * math.sqrt(distance2 - SPHERE**2) / (ahead**2 - SPHERE**2) ** 1.5
    assert found.area == pytest.approx(area, rel=0.04)  # 20 facets around: 1.6 % less


@pytest.mark.render
def test_what_stands_before_a_thing_is_left_out_of_its_mask_and_its_box():
    box, sphere = labels("half hidden").objects
    assert edges(box)[1] == pytest.approx(320.0, abs=1.0)  # the box ends at the axis of view
    assert edges(sphere)[0] == pytest.approx(320.0, abs=1.0)
    assert edges(sphere)[1:] == pytest.approx(sphere_box((2.5, 0.0, 1.5), EYE, SPHERE)[1:], abs=1.0)
    assert sphere.area == pytest.approx(0.5 * math.pi * (FOCAL * SPHERE / 2.5) ** 2, rel=0.06)
    assert box.area == box.box[2] * box.box[3]


@pytest.mark.render
@pytest.mark.parametrize(("world", "seen"), [("behind", []), ("hidden", ["thing0"]), ("under water", [])])
def test_what_is_out_of_view_or_hidden_has_no_label(world, seen):
    found = labels(world)
    assert [one.name for one in found.objects] == seen
    assert (found.mask > 0).any() == bool(seen)


@pytest.mark.render
def test_fog_hides_what_is_beyond_its_end():
    assert [one.name for one in labels("fog").objects] == ["thing0"]


@pytest.mark.render
@pytest.mark.parametrize("time", [20.0, 20.7, 21.4])
@pytest.mark.parametrize("world", ["afloat", "in waves"])
def test_a_mask_ends_at_the_waterline_of_the_physics(world, time):
    """Points of the sphere over the surface, seen by a second pinhole."""
    eye = np.array([0.0, 0.0, 0.7])
    (found,) = labels(world, eye=eye, time=time).objects
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(100_000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    points = np.array([2.0, 0.0, 0.0]) + SPHERE * ways
    sea = drawn(world)[0]._sea.height
    dry = (points[:, 2] > sea(points[:, 0], points[:, 1], time)) & ((ways * (eye - points)).sum(axis=1) > 0)
    ahead, left, up = (points[dry] - eye).T
    columns, rows = 320 - FOCAL * left / ahead, 240 - FOCAL * up / ahead
    assert edges(found) == pytest.approx([columns.min(), columns.max(), rows.min(), rows.max()], abs=1.5)


@pytest.mark.render
def test_waves_move_the_waterline():
    heights = {labels("in waves", eye=(0.0, 0.0, 0.7), time=t).objects[0].box[3] for t in (20.0, 20.7, 21.4)}
    assert len(heights) > 1


@functools.cache
def course():
    """Labels of the WAM-V's front camera in the example course, and the names of its geoms."""
    compiled = compile_world("example_course", fleet="trio")
    model = drawing_model(compiled)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    cameras, labeller = Cameras(model, compiled.parameters), Labeller(model, compiled.parameters)
    body = data.body("wamv2/base_link")
    frame = body.xmat.reshape(3, 3)
    cameras.image(CAMERA, data, body.xpos + frame @ (0.75, 0.1, 1.5), frame, 0.0)
    return labeller(cameras.seen_geoms(CAMERA), "wamv2")


@pytest.mark.render
def test_boxes_areas_and_masks_say_the_same():
    found = course()
    assert found.mask.shape == (480, 640)
    numbers, areas = np.unique(found.mask[found.mask > 0], return_counts=True)
    assert [one.number for one in found.objects] == numbers.tolist()
    assert [one.area for one in found.objects] == areas.tolist()
    for one in found.objects:
        rows, columns = np.nonzero(found.mask == one.number)
        assert one.box == (columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1)


@pytest.mark.render
def test_boats_and_shore_are_told_apart():
    kinds = {one.name: one.category for one in course().objects}
    assert kinds["wamv2"] == "own_boat"
    assert kinds["terrain"] == "shore"
    assert {kind for kind in kinds.values() if "buoy" in kind}
    assert {kinds[name] for name in ("wamv1", "wamv3") if name in kinds} == {"boat"}


def test_numbers_of_categories_stay():
    """A data set of last year still means the same: new categories get new numbers."""
    known = (
        "own_boat boat shore dock placard mb_marker_buoy_red mb_marker_buoy_green mb_marker_buoy_white "
        "mb_marker_buoy_black mb_round_buoy_orange mb_round_buoy_black polyform surmark46104 surmark950400 "
        "surmark950410 red_totem green_totem blue_totem yellow_totem black_totem light_buoy crocodile platypus turtle "
        "ball buoy object"
    )
    assert {name: row["id"] for name, row in CATEGORIES.items()} == {
        name: number for number, name in enumerate(known.split(), 1)
    }


def test_every_buoy_and_animal_of_the_catalogue_has_its_category():
    names = [file.stem for file in (Path(__file__).parents[3] / "assets/objects").glob("*.yaml")]
    kinds = {name: category_of(name) for name in names if not name.startswith("robotx_20")}  # those are courses
    for word in ("buoy", "totem", "surmark", "polyform"):
        assert not {name for name, kind in kinds.items() if word in name and kind in ("object", "buoy")}
    assert kinds["mb_marker_buoy_red_2023_damped"] == "mb_marker_buoy_red"
    assert kinds["turtle_2023"] == "turtle"
    assert kinds["robotx_light_buoy_rgb"] == "light_buoy"
    assert category_of("my_own_racing_buoy") == "buoy"
