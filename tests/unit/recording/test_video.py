"""Videos without drawing: paths of cameras, moments between rows, foam, text, and what is refused."""

import dataclasses
import itertools
import math
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from PIL import Image, ImageSequence

import recorded_run
import vrx_mj
from vrx_mj.draw.style import boat_colors
from vrx_mj.errors import RecordError, UnknownNameError, VideoError, VrxError
from vrx_mj.mjcf.scene import cube_rays, drawing_model
from vrx_mj.packages import install_extra
from vrx_mj.physics.surface import SPOKES, fan_triangles
from vrx_mj.recording.antialiasing import fill_sky, write_yuv
from vrx_mj.recording.session import RecordWriter
from vrx_mj.recording.video import Film, Shot, draw_video, filming, looking, parse_size, write_video
from vrx_mj.recording.video.filming import (
    PHASES,
    clock_line,
    encoder_of,
    lay,
    name_tile,
    project,
    set_in,
    task_lines,
)
from vrx_mj.recording.video.stage import (
    ABOVE_MARGIN,
    AHEAD,
    BEHIND,
    FOAM_HEIGHT,
    FULL_SPEED,
    HIGH,
    LARGE_RADIUS,
    LASTS,
    MAX_PIECES,
    SPREAD,
    WHITE,
    WIDTH,
    Above,
    Chase,
    Foam,
    Footage,
    between,
    coarsen,
    smooth_path,
    thin_out,
    view_of,
)
from vrx_mj.sensors.sea import SeaSkin
from vrx_mj.tasks.referee import TaskStatus

UP = (0.0, 0.0, 1.0)


def straight(speed, duration=30.0, heading=0.0):
    """A path (n, 4) from the origin at 20 Hz."""
    time = np.arange(0.0, duration + 1e-9, 0.05)
    way = speed * time
    return np.column_stack([time, way * math.cos(heading), way * math.sin(heading), np.full_like(time, heading)])


@pytest.mark.parametrize(("begin", "duration"), [(0.0, 30.0), (100.0, 30.0), (7.0, 0.2), (7.0, 0.0)])
def test_smoothing_leaves_a_straight_way_as_it_is(begin, duration):
    path = straight(2.0, duration)
    place = smooth_path(begin + path[:, 0], path[:, 1:3], 1.2)
    assert place(begin + path[:, 0]) == pytest.approx(path[:, 1:3], abs=1e-9)
    assert place(begin + duration / 2.0) == pytest.approx([duration, 0.0])


@pytest.mark.parametrize("period", [1.5, 5.0, 8.0])
def test_smoothing_damps_a_wave_as_a_gaussian_does(period):
    """By exp(-s^2 / 2), s the standard deviation in radians of the wave."""
    path, rate = straight(2.0), 2.0 * math.pi / period
    wave = np.sin(rate * path[:, 0])
    place = smooth_path(path[:, 0] + 100.0, np.column_stack([path[:, 1], wave]), 1.2)
    inside = slice(150, -150)  # beyond 5 standard deviations of the ends
    smooth = place(path[inside, 0] + 100.0)[:, 1]
    assert smooth == pytest.approx(math.exp(-0.5 * (1.2 * rate) ** 2) * wave[inside], abs=1e-3)


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.0])
def test_the_chasing_eye_is_behind_the_boat_and_looks_before_it(heading):
    eye = Chase(straight(2.0, heading=heading), 0.5).eye(15.0)
    along, place = np.array([math.cos(heading), math.sin(heading)]), 30.0
    assert eye.position == pytest.approx([*((place - BEHIND) * along), 0.5 + HIGH])
    assert eye.rotation[:2, 0] / np.linalg.norm(eye.rotation[:2, 0]) == pytest.approx(along)
    target = np.array([*((place + AHEAD) * along), 1.1])
    column, row, _ = project(view_of(eye, 200, 100), target, 200, 100)
    assert (column, row) == pytest.approx((100.0, 50.0), abs=1e-6)


def test_the_chasing_eye_sees_all_of_a_large_boat_as_large_as_one_that_is_smaller():
    chase, spots = Chase(straight(2.0), 0.5), []
    for radius in (LARGE_RADIUS, 3.0 * LARGE_RADIUS):
        chase.radius = radius
        stern = np.array([30.0 - radius, 0.0, 0.5])
        spots.append(project(view_of(chase.eye(15.0), 200, 100), stern, 200, 100))
    (column, row, near), (_, low, far) = spots
    assert column == pytest.approx(100.0)
    assert far == pytest.approx(3.0 * near, rel=0.02)
    assert row == pytest.approx(low, abs=2.0)
    assert row < 100.0


def test_the_eye_above_has_all_boats_in_its_picture_at_all_times_and_north_up():
    paths = [straight(3.0), straight(2.0, heading=2.0), straight(1.0, heading=-2.0)]
    above = Above(paths, 0.0, 16 / 9)
    for time in (0.0, 12.0, 30.0):
        view = view_of(above.eye(time), 1600, 900)
        spots = [[np.interp(time, path[:, 0], path[:, axis]) for axis in (1, 2)] for path in paths]
        seen = [project(view, np.array([*spot, 0.0]), 1600, 900) for spot in spots]
        assert all(0.0 < column < 1600.0 and 0.0 < row < 900.0 for column, row, _ in seen)
        order = np.argsort([spot[1] for spot in spots])
        assert np.all(np.diff([seen[i][1] for i in order]) <= 1e-6)


@pytest.mark.parametrize(
    ("apart", "half"),
    [
        ((0.0, 0.0), 22.0),
        ((0.0, 100.0), 50.0 + ABOVE_MARGIN),
        ((320.0, 0.0), (160.0 + ABOVE_MARGIN) / 1.6),
    ],
)
def test_the_picture_from_above_has_the_boats_in_its_middle_and_a_margin_around_them(apart, half):
    paths = [straight(0.0), np.add(straight(0.0, 20.0), (0.0, *apart, 0.0))]
    above = Above(paths, 0.5, 1.6)
    for time, middle in ((15.0, np.array(apart) / 2.0), (25.0, np.zeros(2)), (40.0, np.array(apart) / 2.0)):
        corner = np.add(middle, (1.6 * half, half))
        column, row, _ = project(view_of(above.eye(time), 1600, 1000), np.array([*corner, 0.5]), 1600, 1000)
        assert (column, row) == pytest.approx((1600.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("heading", [0.0, 1.0, 2.4, -2.0, -0.7])
@pytest.mark.parametrize("rise", [-0.5, 0.3, 4.0])
def test_the_sky_of_a_picture_is_that_of_the_cube(heading, rise):
    side = 64
    faces = np.concatenate(list(cube_rays(side)))
    sky = np.arange(1, faces[..., 0].size + 1, dtype=np.uint32).reshape(6 * side, side)
    eye = looking((0.0, 0.0, 0.0), (math.cos(heading), math.sin(heading), rise), UP, field=1.2)
    view, drawn = view_of(eye, 48, 30), np.zeros((30, 48), np.uint32)
    drawn[5, :20] = 7
    fill_sky(drawn, sky, view.rotation, view.half_width, view.half_height)
    assert np.all(drawn[5, :20] == 7)
    drawn[5, :20] = drawn[6, :20]
    row, column = np.indices(drawn.shape)
    left = view.half_width * (1.0 - 2.0 * (column + 0.5) / 48)
    up = view.half_height * (2.0 * (row + 0.5) / 30 - 1.0)
    rays = np.stack([np.ones_like(left), left, up], axis=-1) @ view.rotation.T
    shown = faces.reshape(-1, 3)[drawn - 1]
    off = np.arccos(np.clip(np.sum(shown * rays, axis=-1) / np.linalg.norm(rays, axis=-1), -1.0, 1.0))
    assert off.max() < 4 * 2 * view.half_width / 48 + 2.0 / side  # pixels that share one, and one of the cube's


def test_a_place_projects_as_a_pinhole_does():
    view = view_of(looking((0.0, 0.0, 2.0), (10.0, 0.0, 2.0), UP, field=math.pi / 2), 200, 100)
    assert project(view, np.array([10.0, 5.0, 4.5]), 200, 100) == pytest.approx((50.0, 25.0, 10.0))
    assert project(view, np.array([-1.0, 0.0, 2.0]), 200, 100) is None


def test_between_two_rows_numbers_are_linear_and_turns_keep_their_length_the_short_way():
    first, second = np.zeros(9), np.zeros(9)
    first[0], second[0], second[1] = 1.0, 1.05, 4.0
    first[5:], second[5:] = (1.0, 0.0, 0.0, 0.0), (-math.cos(0.4), 0.0, 0.0, -math.sin(0.4))
    row = between(first, second, 1.025, [5])
    assert row[1] == pytest.approx(2.0)
    assert row[5:] == pytest.approx([math.cos(0.2), 0.0, 0.0, math.sin(0.2)])


def height(x, y):
    return 0.3 * np.sin(0.5 * np.asarray(x) - 20.0)


def foam(path, *sterns):
    """The foam of a boat."""
    return Foam(mujoco.MjSpec(), [(path, stern) for stern in sterns])


@pytest.mark.parametrize(("speed", "share"), [(FULL_SPEED, 1.0), (1.0, (1.0 - 0.25) / (FULL_SPEED - 0.25))])
def test_foam_lies_on_the_sea_behind_the_stern_grows_and_fades(speed, share):
    (edges,), (shades,) = foam(straight(speed), (-2.0, 1.0)).strips(20.0, height)
    x, y, z = edges.reshape(-1, 3).T
    assert z == pytest.approx(height(x, y) + FOAM_HEIGHT)
    assert x.max() == pytest.approx(speed * 20.0 - 2.0)
    assert x.min() == pytest.approx(speed * (20.0 - LASTS) - 2.0, abs=1e-9)  # where it was `LASTS` ago
    age = 20.0 - (edges[:, 0, 0] + 2.0) / speed
    half = (WIDTH + SPREAD * age[:-1, None]) / 2.0
    assert edges[:-1, :, 1] == pytest.approx(1.0 + half * (-1.0, 1.0))  # the last piece has no length
    assert shades == pytest.approx(WHITE * share * (1.0 - age / LASTS))


STORM = {
    "physics": {"profile": "marine"},
    "sea": {"model": "jonswap", "significant_height": 1.2, "peak_period": 5.0, "direction": [0.6, 0.8]},
}


@pytest.fixture(scope="module")
def storm_skin():
    world = vrx_mj.compile_world(STORM)
    return SeaSkin(drawing_model(world), world.parameters.sea)


VIEWS = [
    ((-30.0, 4.0, 2.0), 0.5, (-0.4, 0.3)),
    ((-40.0, -6.0, 12.0), 0.6, (-0.9, 0.1)),
    ((0.0, 0.0, 60.0), math.pi, (-1.6, -0.6)),
]
"""Eyes [m], half the widths of what they see along x, and the elevations that they see [rad]."""


@pytest.mark.parametrize(("eye", "half", "elevations"), VIEWS)
def test_drawn_heights_are_those_of_the_seas_facets(storm_skin, eye, half, elevations):
    storm_skin.move(np.array(eye), np.array(UP), 0.0, half, 20.0, elevations)
    corners = storm_skin.vertices[fan_triangles()].astype(float)
    size = np.ptp(corners, axis=1).max(axis=1)
    for share in ((0.2, 0.3, 0.5), (0.6, 0.3, 0.1), (1 / 3, 1 / 3, 1 / 3)):
        x, y, z = np.einsum("c,tci->it", share, corners)
        # a facet's side is a chord of its ring, by less than this part of its size: slopes are below 1
        assert np.all(np.abs(storm_skin.drawn_height(x, y) - z) < (half / SPOKES) * size + 1e-4)


@pytest.mark.parametrize(("eye", "half", "elevations"), VIEWS)
def test_no_crest_of_the_drawn_sea_hides_foam(storm_skin, eye, half, elevations):
    """Between its corners too: 9 x 9 places of each piece."""
    storm_skin.move(np.array(eye), np.array(UP), 0.0, half, 20.0, elevations)
    path = straight(FULL_SPEED) - (0.0, 30.0, 0.0, 0.0)
    (edges,), _ = foam(path, (-2.0, 1.0)).strips(20.0, storm_skin.drawn_height)
    edges = edges[:-1]  # the last is where the one before it is
    share = np.linspace(0.0, 1.0, 9)[:, None]
    sides = edges[:-1, None] + share[..., None] * (edges[1:] - edges[:-1])[:, None]
    x, y, z = (sides[:, :, :1] + share * (sides[:, :, 1:] - sides[:, :, :1])).reshape(-1, 3).T
    assert np.all(z > storm_skin.drawn_height(x, y))


@pytest.mark.parametrize(("height", "period"), [(0.1, 3.0), (0.3, 4.0)])
def test_foam_lies_around_each_hull_of_a_catamaran_and_not_between_them(height, period):
    """Two bars of 4 x 0.4 x 0.4 m that are 2 m apart, one mesh, turned by 0.5 rad."""
    bar = np.array(list(itertools.product((-2.0, 2.0), (-0.2, 0.2), (-0.2, 0.2))))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([(a, *pair) for a, b, c, d in quads for pair in ((b, c), (c, d))])
    spec = mujoco.MjSpec()
    spec.add_mesh(
        name="hulls",
        uservert=np.concatenate([np.add(bar, (0.0, side, 0.0)) for side in (-1.0, 1.0)]).ravel(),
        userface=np.concatenate([faces, faces + 8]).ravel(),
    )
    body = spec.worldbody.add_body(name="boat", pos=(3.0, 1.0, 0.0), quat=(math.cos(0.25), 0.0, 0.0, math.sin(0.25)))
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="hulls")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    swell = {"model": "jonswap", "significant_height": height, "peak_period": period}
    world = vrx_mj.compile_world({"extends": "ocean", "physics": {"profile": "marine"}, "sea": swell}, nudge=False)
    skin = SeaSkin(model, world.parameters.sea)
    boxes = skin.floats(data, np.array([0.0, 0.0, 2.0]), 0.0)
    turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
    along, across = ((boxes[:, :2] - (3.0, 1.0)) @ turn).T
    edge = np.abs(boxes[:, 2:4] @ turn)
    half_along, half_across = (np.sum(edges * boxes[:, 4:6], axis=1) for edges in (edge, edge[:, ::-1]))
    assert np.all(np.abs(np.abs(across) - 1.0) + half_across < 0.2 + 1e-6)
    for side in (-1.0, 1.0):
        own = np.sign(across) == side
        ends = (along + half_along)[own].max(), (along - half_along)[own].min()
        assert ends == pytest.approx((2.0, -2.0), abs=0.01 if height < 0.1 else 1.5)


def test_a_calm_sea_is_drawn_all_over_by_an_eighteenth_of_its_triangles():
    world = vrx_mj.compile_world("ocean", nudge=False)
    model = drawing_model(world)

    def area():
        skin = SeaSkin(model, world.parameters.sea)
        skin.move(np.array([0.0, 0.0, 3.0]), np.array([0.0, 0.0, 1.0]), 0.0, 0.5, 0.0, (-0.4, 0.1))
        corners = skin.vertices[model.skin_face[: model.skin_facenum[0]]].astype(float)
        return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].sum() / 2.0

    whole, count = area(), model.skin_facenum[0]
    thin_out(model)
    assert area() == pytest.approx(whole, rel=1e-6)
    assert model.skin_facenum[0] < 0.06 * count


def test_meshes_of_the_named_bodies_are_drawn_by_fewer_triangles_between_the_same_points():
    spec = mujoco.MjSpec()
    for name in ("boat", "buoy"):
        spec.add_mesh(name=name).make_sphere(subdivision=4)
        spec.worldbody.add_body(name=name).add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
    model = spec.compile()
    before, count = model.mesh_vert.copy(), model.mesh_facenum.copy()
    coarsen(model, ["boat"], 0.25)
    assert 100 < model.mesh_facenum[0] < 0.2 * count[0]
    assert model.mesh_facenum[1] == count[1]
    assert np.array_equal(model.mesh_vert, before)
    corners = before[model.mesh_face[: model.mesh_facenum[0]]].astype(float)
    normals = model.mesh_normal[model.mesh_facenormal[: model.mesh_facenum[0]]]
    assert np.einsum("fci,fci->fc", corners, normals).min() > 0.99  # on a ball of 1 m both are one
    volume = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * math.pi, rel=0.1)


def test_a_boat_that_lies_still_leaves_no_foam():
    _, shades = foam(straight(0.0), (-2.0, 0.0)).strips(20.0, height)
    assert not shades.any()


def test_foam_is_a_skin_that_faces_up_with_a_strip_for_each_wake():
    spec, path = mujoco.MjSpec(), straight(FULL_SPEED)
    skin = Foam(spec, [(path, (-2.0, side)) for side in (1.0, -1.0)])
    model = spec.compile()
    skin.move(20.0, height)
    corners = skin.vertices[model.skin_face].astype(float)
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert skin.strips(20.0, height)[0].shape == (2, MAX_PIECES, 2, 3)
    assert up.min() >= 0.0
    widths = WIDTH + SPREAD * np.arange(0.0, LASTS, 0.2)
    assert up.sum() / 2 == pytest.approx(2 * widths.mean() * FULL_SPEED * LASTS, rel=0.02)
    assert skin.palette[:, 0].max() == pytest.approx(WHITE, rel=0.05)


def test_twelve_boats_have_twelve_colours():
    colors = boat_colors(f"wamv{i}" for i in range(12))
    shades = np.array(list(colors.values()), float)
    apart = np.linalg.norm(shades[:, None] - shades[None], axis=2) + 1e3 * np.eye(12)
    assert apart.min() > 45.0


def test_lines_of_text():
    assert clock_line("bay", 12.34, 1.0) == "bay  12.3 s"
    assert clock_line("bay", 12.34, 2.5) == "bay  12.3 s  ×2.5"
    running = TaskStatus(0.0, 0.0, 60.0, phase="running", elapsed=15.4, score=10.0, collisions=1)
    assert task_lines("dock", running, "points") == ("dock: running, 45 s left", "score 10 points, collisions 1")
    assert task_lines("dock", TaskStatus(0.0, 0.0, 60.0, phase="ready"), "points")[0] == "dock: ready"


@pytest.mark.parametrize("place", [(2, 3), (-3, -1), (17, 9), (-8, 2), (5, -9), (40, 2), (2, 40)])
def test_a_tile_is_blended_where_it_covers_the_picture(place):
    rng = np.random.default_rng(5)
    picture, tile = (rng.integers(0, 256, shape, np.uint8) for shape in ((12, 20, 3), (6, 7, 4)))
    wide = np.pad(picture, ((50, 50), (50, 50), (0, 0))).astype(float)
    part = wide[50 + place[1] :, 50 + place[0] :][:6, :7]
    part += (tile[..., :3] - part) * (tile[..., 3:] / 255.0)
    lay(picture, tile, *place)
    assert np.array_equal(picture, np.rint(wide[50:62, 50:70]))


@pytest.mark.parametrize(("width", "height"), [(100, 60), (16, 16), (4096, 16)])
def test_the_view_in_the_corner_is_set_in_as_far_as_the_picture_reaches(width, height):
    picture, inset = np.zeros((height, width, 3), np.uint8), np.full((8, 10, 3), 7, np.uint8)
    set_in(picture, inset)
    rows, columns = np.nonzero(picture[..., 0])
    edge = round(0.02 * width)
    assert len(rows) == 10 * max(min(8, height - edge), 0)
    assert len(rows) == 0 or (rows.min(), columns.max()) == (edge, width - edge - 1)


@pytest.mark.parametrize("height", [4, 6])  # the third plane begins within a row, and at the beginning of one
def test_a_picture_as_yuv_is_that_of_bt_601(height):
    picture = np.random.default_rng(3).integers(0, 256, (height, 10, 3), np.uint8)
    picture[:2, :4] = (((255, 255, 255), (255, 255, 255), (0, 0, 255), (0, 0, 255)),) * 2
    planes = np.empty((3 * height // 2, 10), np.uint8)
    write_yuv(picture, planes)
    weights = np.array([0.299, 0.587, 0.114])
    luma = picture @ weights
    red, blue = ((picture[..., i] - luma) / (2.0 - 2.0 * weights[i]) for i in (0, 2))
    means = [plane.reshape(height // 2, 2, 5, 2).mean(axis=(1, 3)) for plane in (blue, red)]
    assert planes[:height] == pytest.approx(16.0 + 219.0 / 255.0 * luma, abs=0.51)  # a byte
    assert planes[height:].reshape(2, height // 2, 5) == pytest.approx(
        128.0 + 224.0 / 255.0 * np.array(means), abs=0.51
    )


def test_a_name_moves_to_the_side_by_parts_of_a_pixel():
    tiles = [name_tile("wamv1", (255, 0, 0), 18, phase)[..., 3].sum(axis=0) for phase in range(PHASES)]
    middles = [np.average(np.arange(len(tile)), weights=tile) for tile in tiles]
    assert np.all(np.diff(middles) > 0.1)
    assert middles[-1] - middles[0] == pytest.approx((PHASES - 1) / PHASES, abs=0.1)


def test_a_size_is_two_numbers():
    assert parse_size("1280x720") == (1280, 720)
    assert parse_size(None) is None
    with pytest.raises(VideoError) as refused:
        parse_size("wide")
    assert str(refused.value) == "invalid size 'wide': width and height in pixels are needed, as in 1280x720"


def test_the_kind_of_a_video_goes_by_its_name(tmp_path):
    with pytest.raises(VideoError) as refused:
        encoder_of(tmp_path / "run.avi")
    assert str(refused.value) == (
        f"invalid video '{tmp_path / 'run.avi'}': a name that ends in .mp4, .webp, .gif is needed"
    )


def test_without_the_encoder_of_mp4_the_extra_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "av", None)
    with pytest.raises(VideoError) as refused:
        write_video("run.rrd", tmp_path / "run.mp4")
    assert str(refused.value) == (
        f"'{tmp_path / 'run.mp4'}' needs the encoder of MP4, which is not installed; write a .webp, or "
        f"{install_extra('video')}"
    )


def test_a_recording_without_a_world_is_refused(tmp_path):
    file = tmp_path / "run.rrd"
    with RecordWriter(file, recorded_run.scene()) as writer:
        writer.rows(np.array([recorded_run.row_at(t) for t in (0.0, 0.05)]))
    with pytest.raises(RecordError) as refused:
        write_video(file, tmp_path / "run.webp")
    assert str(refused.value) == f"'{file}' has no world to draw: it was not made by a simulation"
    assert [path.name for path in tmp_path.iterdir()] == ["run.rrd"]


def test_a_recording_without_a_row_is_refused(two_seconds):
    with pytest.raises(RecordError, match="has no motion to draw: it ends before its first row"):
        Footage(dataclasses.replace(two_seconds, rows=two_seconds.rows[:0]))


@pytest.mark.parametrize(
    ("shot", "kind", "text"),
    [
        (Shot(view="top"), UnknownNameError, "no view named 'top'; known: both, chase, above"),
        (Shot(boat="crane"), UnknownNameError, "no boat named 'crane'; known: wamv1, wamv2, wamv3"),
        (
            Shot(size=(33, 44)),
            VideoError,
            "invalid size 33x44: two even numbers of pixels from 16 to 4096 are needed",
        ),
        (Shot(fps=0.0), VideoError, "invalid fps 0: a number from 0.001 to 1000 is needed"),
        (Shot(fps=1e-4), VideoError, "invalid fps 0.0001: a number from 0.001 to 1000 is needed"),
        (Shot(speed=-1.0), VideoError, "invalid speed -1: a number from 0.001 to 1000 is needed"),
        (Shot(speed=math.nan), VideoError, "invalid speed nan: a number from 0.001 to 1000 is needed"),
        (Shot(begin=3.0), VideoError, "invalid span 3 s to 2 s: the recording goes from 0 to 2 s"),
        (Shot(end=9.0), VideoError, "invalid span 0 s to 9 s: the recording goes from 0 to 2 s"),
    ],
)
def test_what_cannot_be_filmed_is_refused(two_seconds, shot, kind, text):
    with pytest.raises(kind) as refused:
        Film(two_seconds, shot, size=(64, 36), fps=10.0)
    assert isinstance(refused.value, VrxError)
    assert str(refused.value) == text


@pytest.mark.parametrize(("where", "reason"), [("", "Is a directory"), ("run.rrd/run.webp", "Not a directory")])
def test_a_video_that_cannot_be_written_is_refused_before_it_is_drawn(two_seconds, tmp_path, where, reason):
    video = tmp_path / (where or "folder.webp")
    if where:
        video.parent.touch()
    else:
        video.mkdir()
    with pytest.raises(VideoError) as refused:
        write_video(two_seconds, video)
    assert str(refused.value) == f"cannot write the video '{video}': {reason}"
    assert not list(tmp_path.glob(".*"))


def test_a_boat_that_is_in_no_row_is_not_followed(two_seconds):
    recorded = dataclasses.replace(two_seconds, rows=two_seconds.rows.copy())
    absent = recorded.boats["wamv2"]
    absent.position[:] = np.nan
    film = Film(recorded, Shot(), size=(64, 36), fps=10.0)
    assert set(film._paths) == {"wamv1", "wamv3"}
    with pytest.raises(VideoError) as refused:
        Film(recorded, Shot(boat="wamv2"), size=(64, 36), fps=10.0)
    assert str(refused.value) == "invalid boat 'wamv2': it is in no row of the recording"


@pytest.mark.parametrize(("fps", "speed", "count"), [(10.0, 1.0, 21), (10.0, 2.0, 11), (25.0, 1.0, 51), (3.0, 0.5, 13)])
def test_pictures_are_as_many_as_the_time_holds(two_seconds, fps, speed, count):
    film = Film(two_seconds, Shot(fps=fps, speed=speed), size=(64, 36), fps=10.0)
    assert len(film.times) == count
    assert film.times[-1] == pytest.approx((count - 1) * speed / fps)


def test_foam_widens_with_its_age():
    (edges,), _ = foam(straight(FULL_SPEED), (-2.0, 0.0)).strips(20.0, height)
    edges = edges[:-2]  # the last ones are in one place, without a width
    x, y, _ = edges.reshape(-1, 3).T
    age = (x.max() - x) / FULL_SPEED
    assert 2.0 * np.abs(y) == pytest.approx(WIDTH + SPREAD * age, abs=0.01)


def test_a_log_says_how_far_a_video_is(tmp_path, monkeypatch, capsys):
    clock = itertools.count(0.0, 20.0)
    monkeypatch.setattr("vrx_mj.bar.time", SimpleNamespace(monotonic=lambda: next(clock)))

    def write(_recording, video, _shot, *, progress):
        progress(1, 4)
        progress(2, 4)
        video.write_bytes(bytes(200_000))
        return 4

    monkeypatch.setattr("vrx_mj.recording.video.filming.write_video", write)
    said = draw_video(Path("run.rrd"), tmp_path / "run.webp", Shot())
    assert said == f"video: {tmp_path / 'run.webp'}, 4 pictures, 0.2 MB"
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("drawing: 1 of 4 pictures, ")
    assert second.startswith("drawing: 2 of 4 pictures, ")


@pytest.mark.parametrize(
    ("suffix", "rate", "durations"),
    [(".webp", 30, [33, 34, 33]), (".webp", 8, [125] * 3), (".gif", 8, [120] * 3), (".gif", 90, [20] * 3)],
)
def test_pictures_are_shown_for_the_time_between_them(suffix, rate, durations, tmp_path):
    pictures = np.random.default_rng(0).integers(0, 256, (3, 8, 8, 3)).astype(np.uint8)
    filming._ENCODERS[suffix][0](tmp_path / f"run{suffix}", iter(pictures), 3, Fraction(rate))
    with Image.open(tmp_path / f"run{suffix}") as image:
        assert [frame.copy().info["duration"] for frame in ImageSequence.Iterator(image)] == durations
