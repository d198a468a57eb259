"""Pictures: where things are in them, in what colours, and that they are the same every time."""

import functools
import math
import multiprocessing
import os
import threading

import mujoco
import numpy as np
import pytest

from trees import make_world
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.errors import RenderError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.sensors import canvas
from vrx_mj.sensors.camera import Cameras
from vrx_mj.sensors.view import View

pytestmark = pytest.mark.render

ASIDE = {"spawn": {"pose": [-60, 0, 0.1, 0, 0, 0]}}
CALM = {**ASIDE, "sea": {"model": "pms", "gain": 0.0, "period": 5.0}}
WAVES = {**ASIDE, "sea": {"model": "pms", "gain": 0.3, "period": 5.0, "scale": 2.5, "tau": 0.0}}
LEVEL = np.eye(3)
RED, WHITE, BLUE = "1 0 0 1", "1 1 1 1", "0 0 1 1"


def config(**changes):
    values = {"name": "camera", "link": "l", "frame": "f", "width": 640, "height": 360, "noise": 0.0, **changes}
    return CameraConfig(**values)


def turned(*, pitch=0.0, yaw=0.0):
    """Camera to world axes: pitch nose down, then yaw, as a boat's sensors are mounted."""
    cp, sp, cy, sy = math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])


def pixel(camera, position, rotation, point):
    """Column and row [pixels from 0] where a point [m, world] is seen: a second pinhole, from the field of view."""
    ahead, left, up = rotation.T @ (np.asarray(point) - position)
    focal = camera.width / 2 / math.tan(camera.horizontal_fov / 2)
    return (camera.width - 1) / 2 - focal * left / ahead, (camera.height - 1) / 2 - focal * up / ahead


@functools.cache
def _drawn(key):
    world, balls = _WORLDS[key]
    compiled = compile_world(world)
    shapes = "".join(
        f'<geom type="sphere" size="{radius}" pos="{x} {y} {z}" rgba="{color}" group="2" contype="0" conaffinity="0"/>'
        for (x, y, z), radius, color in balls
    )
    compiled = make_world(
        compiled.mjcf.replace("</worldbody>", f"{shapes}</worldbody>"), compiled.assets, compiled.parameters
    )
    model = drawing_model(compiled)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return Cameras(model, compiled.parameters), data


FOG = {"type": "linear", "color": [0.5, 0.6, 0.7], "start": 2, "end": 60}
BALLS = (((30, 4, 1.5), 0.5, RED), ((50, -10, 3.0), 1.0, BLUE))
_WORLDS = {
    "balls": (CALM, BALLS),
    "waves": (WAVES, ()),
    "high waves": ({**WAVES, "sea": WAVES["sea"] | {"gain": 0.6}}, ()),
    "fog": ({**CALM, "scene": {"fog": FOG}}, (((100, 0, 3), 2.0, WHITE), ((12, 3, 3), 1.0, WHITE))),
    "dusk": ({**CALM, "scene": {"sky": {"time": 19.8}}}, ()),
    "near": (CALM, (((0.03, 0, 1.5), 0.01, RED), ((20, 0, 1.5), 0.5, RED))),
    "calm": (CALM, ()),
    "poles": (
        {
            **ASIDE,
            "physics": {"profile": "marine"},
            "sea": {"model": "jonswap", "significant_height": 1.2, "peak_period": 5.0, "direction": [0.6, 0.8]},
        },
        (),
    ),
    "clear fog": ({**CALM, "scene": {"fog": FOG | {"start": 4000, "end": 9000}}}, ()),
    "dry": ({**ASIDE, "sea": {"model": "none"}}, ()),
}


def image(world, camera, position=(0.0, 0.0, 1.5), rotation=LEVEL, time=20.0, **stream):
    cameras, data = _drawn(world)
    return cameras.image(camera, data, np.array(position), rotation, time, **stream).rgb


def centre_of(mask):
    rows, columns = np.nonzero(mask)
    return columns.mean(), rows.mean()


def red(rgb):
    return (rgb[..., 0] > 90) & (rgb[..., 1] < 40) & (rgb[..., 2] < 40)


def blue(rgb):
    return (rgb[..., 2] > 90) & (rgb[..., 0] < 40) & (rgb[..., 1] < 40)


# Where things are


@pytest.mark.parametrize("shape", [(640, 360), (320, 240), (200, 400)])
@pytest.mark.parametrize("fov", [1.3962634, 0.6, 2.2])
def test_spheres_are_where_the_pinhole_puts_them(shape, fov):
    camera = config(width=shape[0], height=shape[1], horizontal_fov=fov)
    place, rotation = np.array([0.0, 0.0, 1.5]), turned(pitch=0.05, yaw=0.02)
    rgb = image("balls", camera, place, rotation)
    for found, (center, _, _) in zip((red(rgb), blue(rgb)), BALLS, strict=True):
        column, row = pixel(camera, place, rotation, center)
        if not (4 < column < shape[0] - 4):
            assert not found.any()
            continue
        assert centre_of(found) == pytest.approx((column, row), abs=1.5)  # shading hides part of a rim


@pytest.mark.parametrize(("height", "pitch"), [(1.5, 0.0), (1.5, 0.2617994), (3.0, 0.1), (1.5, -0.1)])
def test_horizon_is_level_and_where_the_pitch_puts_it(height, pitch):
    camera = config()
    rgb = image("calm", camera, (0, 0, height), turned(pitch=pitch)).astype(int)
    focal = camera.width / 2 / math.tan(camera.horizontal_fov / 2)
    expected = (camera.height - 1) / 2 - focal * math.tan(pitch)
    for column in (5, 160, 320, 480, 634):
        step = np.abs(np.diff(rgb[:, column].sum(axis=1)))
        assert int(step.argmax()) + 0.5 == pytest.approx(expected, abs=2.0)


def test_stereo_cameras_see_a_ball_apart_by_focal_length_times_baseline_over_distance():
    camera = config(width=1280, height=720)
    left, right = (centre_of(red(image("balls", camera, (20, 4 + y, 1.5)))) for y in (0.1, -0.1))
    assert left[0] - right[0] == pytest.approx(762.72 * 0.2 / 10.0, abs=0.6)  # the ball's middle is 10 m away
    assert left[1] == pytest.approx(right[1], abs=0.3)


def test_another_sea_is_drawn_as_a_world_that_has_it():
    cameras, _ = _drawn("waves")
    nominal = image("waves", config())
    waves = cameras._sea._waves.copy()
    try:
        for factor, other in ((2.0, "high waves"), (0.0, "calm"), (1.0, "waves")):
            changed = waves.copy()
            changed["amplitude"] *= factor
            cameras.set_sea(changed)
            np.testing.assert_array_equal(image("waves", config()), image(other, config()))
            assert (factor == 1.0) == (image("waves", config()) == nominal).all()
    finally:
        cameras.set_sea(waves)


def test_what_is_nearer_than_near_is_not_seen():
    camera = config()
    assert centre_of(red(image("near", camera))) == pytest.approx((319.5, 179.5), abs=1.0)
    assert red(image("near", camera)).sum() < 900  # the ball 20 m away, not the one 3 cm away
    assert red(image("near", config(near=0.001))).sum() > 10_000


def test_what_is_beyond_far_is_not_seen_but_the_horizon_is():
    near_only, all_of_it = (image("balls", config(far=far)) for far in (40.0, 300.0))
    assert red(near_only).any()
    assert not blue(near_only).any()
    assert blue(all_of_it).any()
    sea_and_sky = ~red(all_of_it) & ~blue(all_of_it)
    assert np.mean(np.any(near_only != all_of_it, axis=2) & sea_and_sky) < 0.002  # the blue ball's dark rim


def test_the_boats_own_hull_is_in_view():
    compiled = compile_world(CALM)
    model = drawing_model(compiled)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    cameras = Cameras(model, compiled.parameters)
    body = data.body("wamv/base_link")
    frame = body.xmat.reshape(3, 3)
    rgb = cameras.image(config(), data, body.xpos + frame @ (0.75, 0.1, 1.5), frame @ turned(pitch=0.26), 0.0).rgb
    cameras.close()
    corner = rgb[-40:, 40:140].reshape(-1, 3).astype(int)  # the port float, ahead and below: white
    assert np.median(corner.min(axis=1)) > 100


# The sea


POLES = [(5.0, -1.0), (8.0, 1.5), (12.0, -3.0), (18.0, 2.0), (24.0, -9.0), (30.0, 6.0)]


@functools.cache
def _poles():
    """A rough sea with thin red poles in it, and a second one that has none."""
    world = compile_world(_WORLDS["poles"][0])
    geom = '<geom type="cylinder" size="0.06 4" pos="{} {} 0" rgba="1 0 0 1" group="2" contype="0" conaffinity="0"/>'
    shapes = "".join(geom.format(x, y) for x, y in POLES)
    world = make_world(world.mjcf.replace("</worldbody>", f"{shapes}</worldbody>"), world.assets, world.parameters)
    model = drawing_model(world)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return Cameras(model, world.parameters), data


def waterline(height, eye, x, y, time):
    """Height [m] from which on a pole at x, y is seen over the waves of `height`: no crest before it hides it."""
    near, away = 0.06, math.hypot(x - eye[0], y - eye[1])
    share = np.linspace(0.02, 1.0 - near / away, 4000)
    there = height(eye[0] + share * (x - eye[0]), eye[1] + share * (y - eye[1]), time)
    return float(np.max(eye[2] + (there - eye[2]) / share * share[-1]))


@pytest.mark.parametrize("high", [1.2, 2.0, 4.0, 12.0])
@pytest.mark.parametrize("time", [20.0, 41.7])
def test_waterlines_in_pictures_are_those_of_the_physics(high, time):
    """Of poles 5 m to 30 m away in a sea of 1.2 m, within 2 pixels of 640."""
    cameras, data = _poles()
    level = float(cameras._sea.height(np.zeros(1), np.zeros(1), time)[0])
    eye, camera = np.array([0.0, 0.0, level + high]), config(width=640, height=480)
    rotation = turned(pitch=math.atan2(high, 14.0))
    rgb = cameras.image(camera, data, eye, rotation, time).rgb
    reddish = (rgb[..., 0] > 1.6 * rgb[..., 1].astype(float)) & (rgb[..., 0] > 1.6 * rgb[..., 2].astype(float))
    seen = 0
    for x, y in POLES:
        z = waterline(cameras._sea.height, eye, x, y, time)
        shrink = 1.0 - 0.06 / math.hypot(x, y)
        column, row = pixel(camera, eye, rotation, (x * shrink, y * shrink, z))
        if not (3 < column < 636 and 3 < row < 474):
            continue
        rows = np.flatnonzero(reddish[:, round(column) - 1 : round(column) + 2].any(axis=1))
        assert rows.max() + 0.5 == pytest.approx(row, abs=2.0)
        seen += 1
    assert seen >= 3


@pytest.mark.parametrize("high", [0.5, 2.0, 12.0, 60.0, 200.0])
def test_waves_are_seen_from_all_heights_and_the_horizon_is_level(high):
    pictures = [
        image("high waves", config(), (0, 0, high), turned(pitch=0.3), time).astype(int) for time in (20.0, 21.5)
    ]
    moved = np.abs(pictures[0] - pictures[1]).max(axis=2)
    assert np.mean(moved[-120:] > 2) > 0.1
    first = np.array([np.abs(np.diff(pictures[0][:, column].sum(axis=1))).argmax() for column in range(0, 640, 40)])
    assert np.ptp(first) <= (0 if high > 2.0 else 30)


def test_fog_that_hides_the_sky_leaves_no_glint():
    """Down to where a calm sea mirrors the sun, 60 degrees under the horizon."""
    place, rotation = (0, 0, 50.0), turned(pitch=1.05)
    clear, foggy = (image(key, config(), place, rotation).astype(int) for key in ("calm", "clear fog"))
    assert np.ptp(clear.sum(axis=2)) > 100
    assert np.ptp(foggy.sum(axis=2)) < 40


@pytest.mark.parametrize("samples", [2, 4])
def test_antialiasing_smooths_edges_and_leaves_other_cameras_as_they_are(samples):
    plain = image("balls", config())
    smooth = image("balls", config(antialiasing=samples))
    assert np.array_equal(plain, image("balls", config()))
    between = [np.sum((rgb[..., 0] > 50) & (rgb[..., 0] < 110) & (rgb[..., 1] < 60)) for rgb in (plain, smooth)]
    changed = (plain != smooth).any(axis=2)
    assert 0 < changed.mean() < 0.05
    assert between[1] != between[0]


def test_shapes_of_fewer_facets_look_as_mujocos_own(monkeypatch):
    """A mistaken number of a list would draw another shape in the place of a cylinder, or that in another's place."""
    sizes = {"sphere": ".5", "ellipsoid": ".5 .3 .4", "cylinder": ".4 .6", "capsule": ".3 .4", "box": ".4 .3 .5"}
    geoms = [
        f'<geom type="{kind}" size="{size}" pos="0 {2 * n - 4} 0"/>' for n, (kind, size) in enumerate(sizes.items())
    ]
    tilted = '<geom type="cylinder" size="1 .7" pos="0 0 -2.5" euler="50 70 0"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{''.join(geoms)}{tilted}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    view = View(np.array([-9.0, 0.0, 2.0]), turned(pitch=0.3), 0.6, 0.6, 0.1, 50.0, 300 / 1.2)
    pictures = []
    for _ in range(2):
        drawing = canvas.Canvas(model, width=300, height=300, fog=False)
        pictures.append(np.empty((300, 300, 3), np.uint8))
        drawing.draw(data, view, (), pictures[-1])
        drawing.close()
        monkeypatch.setattr(canvas.Canvas, "_simplify_cylinders", lambda self: None)
    fewer, own = (picture.astype(int) for picture in pictures)
    assert np.mean(own.any(axis=2)) > 0.03
    assert np.abs(fewer - own).max() <= 2


# Colours


def test_the_sea_moves_and_so_do_its_pictures():
    first, same, later = (image("waves", config(), time=t).astype(int) for t in (20.0, 20.0, 20.5))
    assert np.array_equal(first, same)
    water = np.abs(first - later)[200:].max(axis=2)
    assert np.mean(water > 2) > 0.3
    assert not np.any(np.abs(first - later)[:120])  # the sky stands still


def test_a_world_without_water_shows_sky_alone():
    dry, calm = image("dry", config()), image("calm", config())
    assert np.array_equal(dry[:150], calm[:150])
    assert np.abs(dry[-1].astype(int) - calm[-1]).min() > 30


def test_a_calm_sea_does_not_move():
    assert np.array_equal(image("calm", config(), time=3.0), image("calm", config(), time=30.0))


def test_fog_hides_a_white_ball_far_away_but_not_a_near_one():
    camera = config()
    place = np.array([0.0, 0.0, 2.0])
    rgb = image("fog", camera, place)
    color = np.rint(np.array(FOG["color"]) * 255)
    column, row = (round(value) for value in pixel(camera, place, LEVEL, (100, 0, 3)))
    assert np.abs(rgb[row, column] - color).max() <= 2
    assert np.abs(rgb[row - 60, column] - color).max() <= 2  # the sky is fog too
    column, row = (round(value) for value in pixel(camera, place, LEVEL, (12, 3, 3)))
    assert np.abs(rgb[row, column] - color).max() > 30


def test_dusk_is_darker_and_redder_than_day():
    day, dusk = (image(key, config()).reshape(-1, 3).astype(float) for key in ("calm", "dusk"))
    assert dusk.mean() < 0.75 * day.mean()
    redness = [rgb[:, 0].mean() / rgb[:, 2].mean() for rgb in (day, dusk)]
    assert redness[1] > 1.3 * redness[0]


# The same every time


@pytest.mark.parametrize("world", ["waves", "balls"])
def test_the_same_moment_gives_the_same_bits_whatever_was_drawn_before(world):
    camera = config(noise=0.007)
    first = image(world, camera, key=7, index=3)
    image(world, config(width=800, height=600), rotation=turned(yaw=3.0), time=9.0, key=1)
    assert np.array_equal(first, image(world, camera, key=7, index=3))
    image(world, config(width=800, height=600), rotation=turned(yaw=3.0), time=9.0, key=1)
    _drawn(world)[0].close()
    assert np.array_equal(first, image(world, camera, key=7, index=3))


def test_noise_is_that_of_the_stream_and_equal_in_three_channels():
    clean = image("calm", config()).astype(int)
    noisy = [image("calm", config(noise=0.02), key=key, index=index).astype(int) for key, index in ((7, 0), (7, 1))]
    change = noisy[0] - clean
    inner = np.all((clean > 30) & (clean < 225), axis=2)
    assert np.array_equal(change[inner][:, 0], change[inner][:, 2])
    deviation = change[inner][:, 0]
    assert deviation.std() == pytest.approx(0.02 * 255, rel=0.02)
    assert deviation.mean() == pytest.approx(0.0, abs=0.05)
    assert abs(np.corrcoef(deviation, (noisy[1] - clean)[inner][:, 0])[0, 1]) < 0.01


def test_every_picture_of_a_stream_has_noise_of_its_own():
    camera = config(width=64, height=36, noise=0.02)  # keys of 64 bits, half of them beyond a signed integer
    pictures = {image("calm", camera, key=2**64 - 1 - key, index=i).tobytes() for key in (0, 5) for i in range(8)}
    assert len(pictures) == 16


def test_another_thread_is_refused():
    errors = []
    image("calm", config())

    def elsewhere():
        try:
            image("calm", config())
        except RenderError as error:
            errors.append(str(error))

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert errors == ["a camera's pictures must be drawn in the thread that drew its first one"]


def test_cameras_that_another_thread_lets_go_do_no_harm():
    """As garbage is collected in any thread: what they held is freed in their own, and others go on drawing."""
    compiled = compile_world(CALM)
    model = drawing_model(compiled)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    kept, left = Cameras(model, compiled.parameters), Cameras(model, compiled.parameters)
    pictures = [cameras.image(config(), data, np.zeros(3), LEVEL, 1.0).rgb for cameras in (kept, left)]
    thread = threading.Thread(target=left.close)
    thread.start()
    thread.join()
    assert threading.current_thread() in canvas._ORPHANS
    pictures += [cameras.image(config(), data, np.zeros(3), LEVEL, 1.0).rgb for cameras in (kept, left)]
    assert threading.current_thread() not in canvas._ORPHANS  # the second one has a new canvas
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)


def drawn_in_a_child(pipe):
    """Tell what a camera that drew before the fork says, and one that never drew; then go in peace."""
    compiled = compile_world(CALM)
    model = drawing_model(compiled)
    fresh = Cameras(model, compiled.parameters)
    for draw in (
        lambda: image("calm", config()),
        lambda: fresh.image(config(), mujoco.MjData(model), np.zeros(3), LEVEL, 1.0),
    ):
        try:
            draw()
        except RenderError as error:
            pipe.send(str(error))
    canvas._close_all()
    pipe.send("closed")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_process_that_was_forked_from_one_that_drew_is_refused():
    """OpenGL would hang there for ever: its threads are not copied, and its locks are."""
    image("calm", config())
    ours, theirs = multiprocessing.Pipe()
    child = multiprocessing.get_context("fork").Process(target=drawn_in_a_child, args=(theirs,))
    child.start()
    told = [ours.recv() if ours.poll(60.0) else None for _ in range(3)]
    child.kill()
    refused = (
        "this process was forked from one that had drawn pictures, so it cannot draw: "
        "start it with 'spawn' or 'forkserver', or draw only in processes that were forked before"
    )
    assert told == [refused, refused, "closed"]


def test_the_drawing_model_of_the_caller_is_left_alone():
    compiled = compile_world(CALM)
    model = drawing_model(compiled)
    before = model.geom_group.copy(), model.vis.global_.offwidth, model.skin_vert.copy()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    cameras = Cameras(model, compiled.parameters)
    cameras.image(config(), data, np.zeros(3), LEVEL, 1.0)
    cameras.close()
    assert np.array_equal(model.geom_group, before[0])
    assert model.vis.global_.offwidth == before[1]
    assert np.array_equal(model.skin_vert, before[2])
