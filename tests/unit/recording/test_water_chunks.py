"""The water of a recording: the sea's meshes, wakes on them, and tracks in the colours of speeds."""

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import recorded_run
import vrx_mj
from fingerprints import check
from integration.test_fingerprints_recordings import columns_of
from vrx_mj.frames import quaternion, rotation_matrix
from vrx_mj.recording import sea_meshes, water_chunks
from vrx_mj.recording.blueprint import PLAN_WATER
from vrx_mj.recording.motion_chunks import MovingChunks
from vrx_mj.recording.sea_meshes import (
    CALM,
    CHORD,
    HORIZON,
    MOST_LINES,
    STEP,
    STILL_ERROR,
    bands,
    grid_around,
    hull_lines,
    patch_heights,
    swell_of,
    triangles,
)
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.recording.timeline import Deadband
from vrx_mj.recording.water_chunks import HEIGHTS, LEAD, MAX_COLOR_SPEED, SUNK, WAKE_WIDTHS, WaterChunks, speed_colors

TRIO = np.array([[0.0, 20.0], [17.3, -10.0], [-17.3, -10.0]])
FLEETS = {
    "one": TRIO[:1],
    "three": TRIO,
    "twenty": np.stack(np.meshgrid(15.0 * np.arange(5), 15.0 * np.arange(4)), axis=-1).reshape(-1, 2),
    "hundred": np.stack(np.meshgrid(15.0 * np.arange(10), 15.0 * np.arange(10)), axis=-1).reshape(-1, 2),
    "apart": TRIO * 30.0,
    "diverged": TRIO * 1e5,
}


def test_cells_are_small_at_each_boat_and_grow_to_the_horizon():
    for name, boats in FLEETS.items():
        grid = grid_around(boats)
        for axis, lines in enumerate((grid.x, grid.y)):
            assert (np.diff(lines) > 0.0).all(), name
            assert len(lines) <= MOST_LINES
            assert lines[0] <= boats[:, axis].min() - HORIZON
            assert lines[-1] >= boats[:, axis].max() + HORIZON
            if name not in ("apart", "diverged"):
                cell = np.diff(lines)[np.searchsorted(lines, boats[:, axis]) - 1]
                assert cell.max() < 3.3, name


def test_sea_is_level_where_cells_are_too_large_for_waves():
    grid, swell = grid_around(TRIO), swell_of(lambda x, y, t: 2.0 + recorded_run.sea_height(x, y, t))
    assert swell.level == pytest.approx(2.0, abs=0.01)
    assert swell.deviation == pytest.approx(recorded_run.AMPLITUDE / 2**0.5, rel=0.02)
    z = grid.heights(swell, np.array([3.0]))[0]
    cells = np.maximum(grid.cells[0], grid.cells[1][:, None])
    assert (z[cells >= CALM[1]] == swell.level).all()
    fine = cells <= CALM[0]
    y, x = np.meshgrid(grid.y, grid.x, indexing="ij")
    assert z[fine] == pytest.approx(2.0 + recorded_run.sea_height(x[fine], y[fine], 3.0), abs=1e-9)


def test_triangles_face_up_and_cover_the_grid():
    grid = grid_around(TRIO)
    z = np.zeros((1, len(grid.y), len(grid.x)))
    vertices = water_chunks.mesh_points(grid.x, grid.y, z)[0].reshape(-1, 3)
    a, b, c = np.moveaxis(vertices[triangles(len(grid.y), len(grid.x))].astype(np.float64), 1, 0)
    twice_area = np.cross(b - a, c - a)[:, 2]
    assert (twice_area > 0).all()
    assert twice_area.sum() / 2 == pytest.approx(np.ptp(grid.x) * np.ptp(grid.y), rel=1e-4)


def test_slopes_toward_the_sun_are_lighter():
    """The sun stands in the north-east: a surface that falls toward east is lit."""
    grid = grid_around(TRIO)
    middle = len(grid.y) // 2, len(grid.x) // 2
    bright = {s: sea_meshes.light(0.0, grid.toward(np.tile(s * grid.x, (1, len(grid.y), 1)))[0]) for s in (-0.05, 0.05)}
    assert bright[-0.05][middle] > bright[0.05][middle]


def surface(vertices, faces, points):
    """Heights of a mesh at points (k, 2): a second implementation, triangle by triangle; NaN outside."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    low, high = (each(each(a, b), c)[:, :2] for each in (np.minimum, np.maximum))
    close = ((high >= points.min(axis=0)) & (low <= points.max(axis=0))).all(axis=1)
    a, b, c = a[close], b[close], c[close]
    ab, ac, away = b - a, c - a, points[:, None] - a[:, :2]
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    u = (away[..., 0] * ac[:, 1] - away[..., 1] * ac[:, 0]) / area
    v = (ab[:, 0] * away[..., 1] - ab[:, 1] * away[..., 0]) / area
    heights = a[:, 2] + u * ab[:, 2] + v * ac[:, 2]
    inside = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1.0 + 1e-6)
    return np.where(inside.any(axis=1), np.where(inside, heights, -np.inf).max(axis=1), np.nan)


def test_points_on_the_mesh_are_on_its_triangles():
    grid, random = grid_around(TRIO), np.random.default_rng(3)
    z = random.normal(size=(2, len(grid.y), len(grid.x)))
    points = random.uniform(-600.0, 600.0, (2, 5, 20, 2))
    for heights, spots, found in zip(z, points, grid.heights_at(z, points), strict=True):
        vertices = np.stack([*np.meshgrid(grid.x, grid.y), heights], axis=-1).reshape(-1, 3)
        expected = surface(vertices, triangles(len(grid.y), len(grid.x)), spots.reshape(-1, 2))
        assert found.reshape(-1) == pytest.approx(expected, abs=1e-9)


def frames(chunks, path, name):
    """Times [s] and arrays of a component of an entity, in the order of time."""
    found = []
    for batch in (chunk.to_record_batch() for chunk in chunks if chunk.entity_path == path):
        column = next((batch.column(column) for column in batch.schema.names if column.endswith(f":{name}")), None)
        if column is not None:
            time = np.array(batch.column("sim_time").cast("int64")) / 1e9
            found += zip(time, (np.array(value.as_py()) for value in column), strict=True)
    found.sort(key=lambda frame: frame[0])
    time, values = zip(*found, strict=True)
    return np.array(time), values


def latest(shown, moment):
    """The newest of frames at a time [s]."""
    time, values = shown
    return values[np.searchsorted(time, moment + 1e-6) - 1]


def fleet_frames(chunks, rows, columns):
    """Times [s] and vertices of the fleet's mesh of so many rows and columns, whose bands are put together."""
    path, (first, *more) = f"/world/sea/{rows}x{columns}", bands(rows)
    time, whole = map(np.array, frames(chunks, f"{path}/{first.start}", "vertex_positions"))
    for band in more:
        moment, part = map(np.array, frames(chunks, f"{path}/{band.start}", "vertex_positions"))
        np.testing.assert_array_equal(moment, time)
        np.testing.assert_array_equal(part[:, :columns], whole[:, -columns:])  # no gap
        whole = np.concatenate([whole, part[:, columns:]], axis=1)
    return time, whole


def fleet_mesh(chunks):
    """A function of time [s]: vertices and triangles of the fleet's mesh that is shown then, of whatever size."""
    found = (MESH.fullmatch(chunk.entity_path) for chunk in chunks)
    sizes = {(int(size[1]), int(size[2])) for size in found if size}
    meshes = {size: fleet_frames(chunks, *size) for size in sizes}

    def at(moment):
        size = max(sizes, key=lambda size: max(t for t in (-1.0, *meshes[size][0]) if t <= moment + 1e-6))
        return latest(meshes[size], moment), triangles(*size)

    return at


MESH = re.compile("/world/sea/([0-9]+)x([0-9]+)/0")
STORM = {
    "physics": {"profile": "marine"},
    "sea": {"model": "jonswap", "significant_height": 1.2, "peak_period": 5.0, "direction": [1.0, 0.3]},
    "spawn": {"pose": [0, 0, 0.1, 0, 0, 1.0], "robot": "wamv"},
}


@pytest.fixture(scope="module")
def storm():
    """Ten seconds of a boat in a storm: its sea, rows, layout, and the chunks of its water."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(STORM))
    sim.command(sim.boats[0], left=0.6, right=0.5)
    rows = []
    for _ in range(200):
        rows.append(sim.row().copy())
        sim.advance(sim.steps_in(0.05))
    scene = scene_of(sim)
    return sim.sea.height, np.array(rows), scene, list(MovingChunks(scene)(np.array(rows)))


def test_waterline_of_a_hull_in_a_storm_is_right_within_3_cm_at_every_shown_time(storm):
    """At points along both hulls of a WAM-V, on the higher of the patch and the fleet's mesh."""
    height, rows, scene, chunks = storm
    boat = scene.boats()[0].name
    ahead, aside = np.meshgrid(np.linspace(-2.4, 2.4, 13), (-1.25, -1.03, -0.8, 0.8, 1.03, 1.25))
    marks = np.column_stack([ahead.ravel(), aside.ravel(), np.full(ahead.size, 0.12)])
    poses = rows[:, scene.layout().pose(scene.layout().bodies[0])]
    patch, fleet = frames(chunks, f"/world/sea/hulls/{boat}", "vertex_positions"), fleet_mesh(chunks)
    x, y = hull_lines(scene.boats()[0], swell_of(height).cell)
    for moment, pose in zip(rows[:, 0], poses, strict=True):
        turn = rotation_matrix(pose[3:])
        points = (pose[:3] + marks @ turn.T)[:, :2]
        near = surface(latest(patch, moment) @ turn.T + pose[:3], triangles(len(y), len(x)), points)
        around = surface(*fleet(moment), points)
        assert np.maximum(near, around) == pytest.approx(height(points[:, 0], points[:, 1], moment), abs=0.03)


def test_wakes_lie_on_the_drawn_sea_and_at_a_hull_on_the_sea_itself(storm):
    """There the fleet's mesh is lower. Planes of cells of 3 m are off by some cm, rms."""
    height, _, scene, chunks = storm
    swell = swell_of(height)
    over, fleet = HEIGHTS[0] + HEIGHTS[1] * swell.deviation, fleet_mesh(chunks)
    time, wakes = frames(chunks, f"/world/wakes/{scene.boats()[0].name}", "vertex_positions")
    assert len(time) == 10 * swell.rate
    for moment, wake in zip(time, wakes, strict=True):
        above = wake[:, 2] - over - surface(*fleet(moment), wake[:, :2])
        assert -STEP < above.min() <= above.max() < SUNK * swell.deviation + STEP
        off = wake[:, 2] - over - height(*wake[:, :2].T, moment + LEAD / swell.rate)
        assert np.sqrt(np.mean(off**2)) < 0.1


def test_a_wake_is_over_the_patches_of_its_own_boat_and_of_others():
    """A boat lies 8 m behind one that sails away from it, in a swell that lifts and sinks all of the sea at once."""
    water, time = WaterChunks(), np.arange(100) / 20
    names = ["wamv1", "wamv2"]
    water.keep(recorded_run.scene(2).boats(), lambda x, y, t: 0.4 * np.cos(2.0 * np.pi * t / 5.0) + 0.0 * x)
    places = np.zeros((100, 2, 3))
    places[:, 0, 0], places[:, 1, 0] = 2.0 * time, 4.0
    level = np.tile([1.0, 0.0, 0.0, 0.0], (100, 2, 1))
    chunks = list(water(names, time, np.concatenate([places, level], axis=-1)))
    moment, wakes = frames(chunks, "/world/wakes/wamv1", "vertex_positions")
    for name in names:
        patch = frames(chunks, f"/world/sea/hulls/{name}", "vertex_positions")
        place = places[:, names.index(name)]
        near = []
        for at, wake in zip(moment, wakes, strict=True):
            here = place[np.searchsorted(time, at - 1e-6)]
            points = latest(patch, at) + here
            inside = (np.abs(wake[:, :2] - here[:2]) < (2.0, 1.0)).all(axis=1)
            near += list(wake[inside, 2] - points[:, 2].max())
        assert len(near) > 3
        assert min(near) > 0.0


def test_patch_does_not_depend_on_how_a_boat_leans():
    """Under a plane that leans, heights in the boat's frame are those of a plane that leans the other way."""
    swell = sea_meshes.Swell(lambda x, y, t: 0.2 * x - 0.1 * y + 0.0 * t, 0.0, 0.0)
    lines, time, place = (np.linspace(-3.0, 3.0, 5), np.linspace(-1.0, 1.0, 3)), np.arange(3.0), np.zeros((3, 3))
    turn = np.tile(quaternion(0.15, -0.1, 0.7), (3, 1))
    z = patch_heights(swell, lines, time, np.hstack([place, turn]), 0.0)
    axes = rotation_matrix(turn[0])
    x, y = np.meshgrid(*lines)
    points = np.stack([x, y, z[0]], axis=-1) @ axes.T
    assert points[..., 2] == pytest.approx(0.2 * points[..., 0] - 0.1 * points[..., 1], abs=0.01)


def test_a_boat_upside_down_has_no_patch_in_sight():
    swell = sea_meshes.Swell(recorded_run.sea_height, 0.0, 0.2)
    lines, turn = (np.linspace(-3.0, 3.0, 5),) * 2, np.array([quaternion(3.0, 0.0, 0.5)])
    z = patch_heights(swell, lines, np.zeros(1), np.hstack([np.zeros((1, 3)), turn]), 0.2)
    assert (z * rotation_matrix(turn[0])[2, 2] < -1e3).all()


def made_up(block):
    """Chunks of ten seconds of the made-up run, in blocks of rows."""
    rows = np.array([recorded_run.row_at(t) for t in np.arange(200) / 20])
    moving = MovingChunks(recorded_run.scene())
    return [chunk for start in range(0, 200, block) for chunk in moving(rows[start : start + block])]


def test_water_does_not_depend_on_the_blocks_of_rows():
    whole, parts = made_up(200), made_up(7)
    grid = grid_around(np.array([recorded_run.row_at(0.0)])[0, 14:35].reshape(3, 7)[:, :2])
    mesh = [f"/world/sea/{len(grid.y)}x{len(grid.x)}/{band.start}" for band in bands(len(grid.y))]
    for path in (*mesh, "/world/wakes/wamv1", "/world/trails/wamv1"):
        name = "strips" if "trails" in path else "vertex_positions"
        one, other = frames(whole, path, name), frames(parts, path, name)
        np.testing.assert_array_equal(one[0], other[0])
        for a, b in zip(one[1], other[1], strict=True):
            np.testing.assert_allclose(a, b, atol=1e-6)


def test_the_patch_that_is_shown_is_near_the_water_in_blocks_of_any_length():
    """Within what it may be off before it changes, and the errors of rounding and of straight lines in time."""
    lines = hull_lines(recorded_run.scene().boats()[0], swell_of(recorded_run.sea_height).cell)
    for block in (200, 7):
        shown = frames(made_up(block), "/world/sea/hulls/wamv1", "vertex_positions")
        assert shown[0][0] == 0.0
        for moment in np.arange(200) / 20:
            pose = recorded_run.row_at(moment)[14:21]
            within = latest(shown, moment).reshape(len(lines[1]), len(lines[0]), 3)[1:-1, 1:-1]
            x, y, z = np.moveaxis(within @ rotation_matrix(pose[3:]).T + pose[:3], -1, 0)
            assert z == pytest.approx(recorded_run.sea_height(x, y, moment), abs=STILL_ERROR + CHORD + 2e-3)


@given(
    values=arrays(np.float64, st.tuples(st.integers(1, 60), st.integers(1, 3)), elements=st.floats(-9.0, 9.0)),
    step=st.floats(0.01, 1.0),
    keep=st.floats(0.5, 3.0),
    within=st.floats(0.0, 5.0),
    cut=st.integers(0, 60),
)
def test_what_is_shown_is_near_every_row_and_changes_no_more_than_it_must(values, step, keep, within, cut):
    shows = Deadband(step, keep=keep, within=within)
    first, second = shows(values[:cut]), shows(values[cut:])
    taken, shown = (np.concatenate(parts) for parts in zip(first, second, strict=True))
    assert taken[0]
    before = np.concatenate([[np.full(values.shape[1], np.nan)], shown[:-1]])
    off = np.abs(values - before)
    assert (np.abs(values - shown) <= max(within, keep * step) + 1e-6).all()
    assert (np.abs(values - shown)[taken] <= keep * step + 1e-6).all()
    assert (shown[~taken] == before[~taken]).all()
    assert (off[taken][1:] > max(within, keep * step) - 1e-6).any(axis=1).all()
    assert shown == pytest.approx(np.round(shown / step) * step)
    changed = (shown != before) & ~np.isnan(before)
    assert (off[changed] > keep * step - 1e-6).all()
    assert not (np.signbit(shown) & (shown == 0.0)).any(), "-0.0 is another number in a file"


def test_a_calm_sea_has_fewer_pictures_and_larger_cells():
    """Of a regular wave: amplitude A, angular frequency w, wave number k; rms speed A w / sqrt 2, and so on."""
    swell = swell_of(recorded_run.sea_height)
    rate, number = 2.0 * np.pi / recorded_run.PERIOD, 2.0 * np.pi / recorded_run.LENGTH
    expected = np.array([rate, rate**2, number**2]) * recorded_run.AMPLITUDE / 2**0.5
    assert (swell.speed, swell.acceleration, swell.curvature) == pytest.approx(expected, rel=0.05)
    calm = swell_of(lambda x, y, t: 0.1 * recorded_run.sea_height(x, y, t))
    level = swell_of(lambda x, y, t: 0.0 * x)
    assert swell.rate > calm.rate == level.rate == min(sea_meshes.RATES)
    assert swell.cell < calm.cell < level.cell
    assert swell.interval < calm.interval < level.interval


def test_one_mesh_of_the_fleet_is_shown_at_a_time_while_boats_sail_apart():
    """A mesh with other lines is another entity, with triangles at all times; the one before is cleared then."""
    water, time = WaterChunks(), np.arange(1200) / 20
    water.keep(recorded_run.scene(2).boats(), recorded_run.sea_height)
    places = np.zeros((1200, 2, 3))
    places[:, 1, 0] = 10.0 + 3.0 * time
    level = np.tile([1.0, 0.0, 0.0, 0.0], (1200, 2, 1))
    chunks = list(water(["wamv1", "wamv2"], time, np.concatenate([places, level], axis=-1)))
    meshes = [chunk for chunk in chunks if MESH.fullmatch(chunk.entity_path)]
    paths = {chunk.entity_path for chunk in meshes}
    assert len(paths) > 1
    assert {chunk.entity_path for chunk in meshes if chunk.is_static} == paths
    shown = {path: frames(meshes, path, "vertex_positions")[0] for path in paths}
    first, last = (min(shown, key=lambda path: shown[path][0]), max(shown, key=lambda path: shown[path][-1]))
    assert len(np.unique(np.concatenate(list(shown.values())))) == 60 * swell_of(recorded_run.sea_height).rate
    for path in paths - {last}:
        cleared = frames(chunks, path.removesuffix("/0"), "is_recursive")[0]
        assert any(moment > shown[path][-1] for moment in cleared)
    assert shown[first][0] == 0.0


def test_without_a_sea_there_are_trails_alone():
    scene = recorded_run.scene()
    dry = type(scene)(**{**vars(scene), "sea_height": None})
    rows = np.array([recorded_run.row_at(t) for t in np.arange(20) / 20])
    paths = {chunk.entity_path for chunk in MovingChunks(dry)(rows)}
    assert "/world/trails/wamv1" in paths
    assert not [path for path in paths if path.startswith(("/world/sea", "/world/wakes"))]


def test_a_wake_begins_at_the_boat_and_gets_wider():
    places = np.zeros((1, 1, 2))
    left = -2.0 * np.arange(1, water_chunks.WAKE_POINTS)[None, :, None, None] * np.array([1.0, 0.0])
    sides = water_chunks.ribbons(places, left)[0, :, :, 0]
    middle, width = sides.mean(axis=1), np.linalg.norm(sides[:, 0] - sides[:, 1], axis=1)
    assert middle[0] == pytest.approx((0.0, 0.0))
    assert middle[1:] == pytest.approx(left[0, :, 0])
    assert width[[0, -1]] == pytest.approx(WAKE_WIDTHS)


def test_points_of_a_wake_are_shown_where_they_were_until_they_are_the_last():
    """In the order from the boat on, for which there are triangles and colours."""
    sides = np.array(frames(made_up(200), "/world/wakes/wamv1", "vertex_positions")[1]).reshape(-1, 20, 2, 3)[..., :2]
    assert len(sides) > 15
    stayed = [(now[2:] == before[2:]).all() for before, now in pairwise(sides)]
    passed = [(now[2:] == before[1:-1]).mean() > 0.9 for before, now in pairwise(sides)]
    assert any(stayed)
    assert any(passed)
    assert all(one or other for one, other in zip(stayed, passed, strict=True))
    looks = water_chunks.wake_looks()
    assert np.unique(looks.triangle_indices.as_arrow_array().flatten()).tolist() == list(range(40))
    assert len(looks.vertex_colors.as_arrow_array()) == 40


def test_points_of_a_wake_stay_while_the_boat_goes_on():
    """A boat in a circle: what was left before the last point is where it was, and so are its sides."""
    count = water_chunks.WAKE_POINTS
    angle = 0.2 * np.arange(count + 3)
    track = 10.0 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
    one, next_one = (
        water_chunks.ribbons(track[None, i], track[None, i - count : i][:, ::-1]) for i in (count + 1, count + 2)
    )
    assert (next_one[0, 2:-1] == one[0, 1:-2]).all()


def test_a_boat_at_rest_has_no_wake():
    sides = water_chunks.ribbons(np.ones((1, 1, 2)), np.ones((1, water_chunks.WAKE_POINTS - 1, 1, 2)))
    assert (sides == 1.0).all()


def luminance(rgb):
    """Relative luminance, WCAG 2."""
    share = np.asarray(rgb) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4) @ (0.2126, 0.7152, 0.0722)


def test_the_colours_of_speeds_get_lighter_and_stand_out_from_the_plan():
    shades = luminance(speed_colors(np.linspace(0.0, MAX_COLOR_SPEED, 16)))
    assert (np.diff(shades) > 0.0).all()
    assert (shades[0] + 0.05) / (luminance(PLAN_WATER) + 0.05) > 3.0
    assert (speed_colors(np.array([2.0 * MAX_COLOR_SPEED])) == speed_colors(np.array([MAX_COLOR_SPEED]))).all()


def test_a_track_has_the_colour_of_its_speed():
    water = WaterChunks()
    time = np.arange(41) / 20
    poses = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (41, 1, 1))
    poses[:, 0, 0] = np.where(time < 1.0, 0.0, 2.0 * (time - 1.0))
    chunks = list(water(["a"], time, poses))
    moment, shown = frames(chunks, "/world/trails/a", "colors")
    rest, two = (speed_colors(np.array([speed]))[0] for speed in (0.0, 2.0))
    for at, color in zip(moment, shown, strict=True):
        expected = two if at > 1.0 else rest
        assert color[0] >> 8 == int.from_bytes(bytes(expected.tolist()), "big")


def test_seas_are_drawn_as_they_were():
    """All that makes meshes, of calm seas and rough ones, few boats and many, upright and leaning ones."""
    seas = [sea_meshes.Swell(recorded_run.sea_height, 0.1, 0.03 * 2**k, 0.01 * 3**k, 0.02 * 3**k, 0.01 * 3**k)
            for k in range(6)]  # fmt: skip
    check("meshes", "seas", seas=[[one.rate, one.interval, one.cell] for one in seas])
    for name, boats in FLEETS.items():
        grid = grid_around(boats)
        z = grid.heights(seas[2], np.array([0.0, 1.5]))
        near = grid.near(np.stack([boats, boats + 3.0]), np.full(len(boats), 5.0))
        check(
            "meshes",
            name,
            grid=grid,
            z=z,
            toward=grid.toward(z),
            near=near,
            at=grid.heights_at(z, np.stack([boats] * 2)),
        )
    (boat, *_), time = recorded_run.scene(1).bodies, np.linspace(0.0, 2.0, 9)
    turns = np.array([quaternion(0.1 * k, 0.4 - 0.1 * k, 0.5 * k) for k in range(7)] + [quaternion(3.0, 0, 0)] * 2)
    pose = np.hstack([np.outer(time, (2.0, -1.0, 0.1)), turns])
    for sea in seas[1::2]:
        lines = hull_lines(boat, sea.cell)
        check("meshes", f"patch {sea.cell:.3g}", lines=lines, z=patch_heights(sea, lines, time, pose, 0.02))
    bright = sea_meshes.light(*np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(-0.4, 0.4, 9)))
    haze = np.linspace(0.0, 1.0, 9)
    check(
        "meshes",
        "colours",
        bright=bright,
        colors=sea_meshes.colors(bright, haze),
        speeds=speed_colors(np.arange(0, 9, 0.3)),
    )


def test_what_boats_leave_is_what_it_was_however_far_they_go():
    """Fast, slow and still ones, one of which joins later: the sea is laid anew where they go far."""
    scene = recorded_run.scene(3)
    boats, water, time = (
        [body for body in scene.bodies if body.kind == "boat"],
        WaterChunks(),
        np.arange(0.0, 9.0, 0.05),
    )
    poses = np.zeros((len(time), 3, 7))
    poses[..., 3] = 1.0
    poses[:, 0, :2] = np.outer(time, (9.0, 2.0))
    poses[:, 1, :2] = 20.0 + 3.0 * np.column_stack([np.cos(time), np.sin(time)])
    poses[:, 2, :2] = -15.0
    for number, (begin, end, there) in enumerate(((0, 60, 2), (60, 61, 2), (61, 140, 3), (140, 180, 1))):
        water.keep(boats[:there], recorded_run.sea_height)
        chunks = water([boat.name for boat in boats[:there]], time[begin:end], poses[begin:end, :there])
        found = [[chunk.entity_path, *columns_of(chunk)] for chunk in chunks]
        check("meshes", f"water {number}", chunks=found)
