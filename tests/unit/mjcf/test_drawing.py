"""The model that is drawn, and the light of the day that it is drawn in."""

import math

import mujoco
import numpy as np
import pytest

from unit.physics.rows import sea
from vrx_mj.config.scene import FogConfig, SkyConfig
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.drawing import SEA, SKY_SIDE, drawing_model, drawing_spec, sea_palette, sky_cube
from vrx_mj.mjcf.scene import DAY, daylight, fog_range
from vrx_mj.model.world import tree_of
from vrx_mj.physics.surface import (
    EDGE,
    HORIZON,
    RINGS,
    SPOKES,
    draw_surface,
    fan,
    fan_triangles,
    reflectance,
    ripples,
)
from vrx_mj.physics.waves import surface_height
from vrx_mj.runtime.physics_models import stepping_models

BUOYS = {
    "sea": {"model": "pms", "gain": 0.3, "period": 5.0, "scale": 2.5, "tau": 3.0},
    "objects": [{"name": "red", "model": "mb_marker_buoy_red", "pose": [20, 5, 0, 0, 0, 0]}],
}
ZENITH, WHITE = np.array([0.2, 0.4, 0.8]), np.array([0.9, 0.9, 0.9])
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def world():
    return compile_world(BUOYS)


# The model


def test_what_steps_has_no_sea_to_look_at(world):
    drawn, stepped = drawing_model(world), stepping_models(world)[0]
    assert (drawn.nskin, stepped.nskin) == (1, 0)
    assert (drawn.nq, drawn.nv, drawn.nbody) == (stepped.nq, stepped.nv, stepped.nbody)
    assert [drawn.body(i).name for i in range(drawn.nbody)] == [stepped.body(i).name for i in range(stepped.nbody)]


def test_the_skin_takes_the_place_of_the_plane_of_water(world):
    spec = drawing_spec(world)
    assert spec.geom("water") is None
    model = spec.compile()
    points = model.skin_vert.reshape(-1, 3)
    assert len(points) == RINGS * SPOKES
    assert np.all(points[:, 2] == 0.0)
    assert np.hypot(*(points[:, :2] - model.stat.center[:2]).T).max() == pytest.approx(HORIZON)
    assert model.skin(0).name == model.material(int(model.skin_matid[0])).name == SEA


def test_a_world_without_water_has_no_skin():
    assert drawing_model(compile_world({"sea": {"model": "none"}})).nskin == 0


def test_the_skin_stays_where_its_vertices_are(world):
    model = drawing_model(world)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    scene = mujoco.MjvScene(model, 2000)
    everything = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), everything, scene)
    assert np.allclose(scene.skinvert.reshape(-1), model.skin_vert.reshape(-1), atol=1e-3)


# The surface


def test_triangles_cover_the_fan_once_and_face_up():
    distances, spokes = fan()
    r, angle = np.meshgrid(distances, math.pi * spokes, indexing="ij")
    x, y = (r * np.cos(angle)).reshape(-1), (r * np.sin(angle)).reshape(-1)
    a, b, c = fan_triangles().T
    areas = ((x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a])) / 2.0
    assert areas.min() > 0.0
    sides = SPOKES - 1
    polygon = sides / 2 * HORIZON**2 * math.sin(2 * math.pi / sides)
    assert areas.sum() == pytest.approx(polygon)


def drawn_surface(water, time, *, eye=(3.0, -7.0, 2.0), course=0.3, half=0.7, shaded=True):
    waves, level = sea(water["waves"], tau=water["tau"], level=water["level"])
    shading = ripples(waves) if shaded else waves[:0]
    distances, spokes = fan()
    shape = (RINGS * SPOKES, 3)
    vertices, normals, palette = np.zeros(shape, "f4"), np.zeros(shape, "f4"), np.zeros((shape[0], 2), "f4")
    draw_surface(
        waves, shading, level, time, np.array(eye), UP, course, half, distances, spokes, vertices, normals, palette
    )
    return waves, level, vertices, normals, palette


@pytest.mark.parametrize("time", [0.0, 1.7, 400.0])
def test_near_the_eye_heights_are_those_of_the_physics(world, time):
    waves, level, vertices, _, _ = drawn_surface(tree_of(world.parameters)["sea"], time)
    distances, _ = fan()
    near = vertices[: SPOKES * int(np.searchsorted(distances, 20.0))]
    expected = [surface_height(waves, level, float(x), float(y), time) for x, y, _ in near.astype(float)]
    assert near[:, 2] == pytest.approx(expected, abs=1e-5)  # of x and y in single precision
    assert time == 0.0 or np.ptp(near[:, 2]) > 0.05


def test_normals_are_square_to_the_surface(world):
    waves, level, vertices, normals, _ = drawn_surface(tree_of(world.parameters)["sea"], 30.0, shaded=False)
    step = 1e-4
    for x, y, normal in ((*v[:2], n) for v, n in zip(vertices[:1500:37], normals[:1500:37], strict=True)):
        ways = ((step, 0.0), (0.0, step))
        slopes = [
            (surface_height(waves, level, x + i, y + j, 30.0) - surface_height(waves, level, x - i, y - j, 30.0))
            / (2 * step)
            for i, j in ways
        ]
        square = np.array([-slopes[0], -slopes[1], 1.0])
        assert normal == pytest.approx(square / np.linalg.norm(square), abs=1e-4)


def test_far_away_the_sea_is_flat_and_wide(world):
    _, _, vertices, normals, palette = drawn_surface(tree_of(world.parameters)["sea"], 30.0)
    rim = slice(-SPOKES, None)
    assert np.all(vertices[rim, 2] == 0.0)
    assert np.all(normals[rim] == (0.0, 0.0, 1.0))
    assert np.hypot(vertices[rim, 0] - 3.0, vertices[rim, 1] + 7.0) == pytest.approx(HORIZON)
    assert palette.min() >= EDGE - 1e-6
    assert palette.max() <= 1.0 - EDGE + 1e-6
    bearings = np.arctan2(vertices[rim, 1] + 7.0, vertices[rim, 0] - 3.0)
    assert [bearings.min(), bearings.max()] == pytest.approx([0.3 - 0.7, 0.3 + 0.7], abs=1e-4)


def test_ripples_shade_a_sea_and_leave_a_calm_alone(world):
    _, _, plain, smooth, _ = drawn_surface(tree_of(world.parameters)["sea"], 30.0, shaded=False)
    _, _, shaded, rough, _ = drawn_surface(tree_of(world.parameters)["sea"], 30.0)
    assert np.array_equal(plain, shaded)
    assert np.abs(smooth - rough).max() > 0.01
    assert len(ripples(sea()[0])) == 0


def test_water_mirrors_little_upright_and_much_at_a_grazing_angle():
    assert reflectance(1.0) == pytest.approx(((1.333 - 1) / (1.333 + 1)) ** 2, abs=5e-4)  # Fresnel, n = 1.333
    assert reflectance(0.5) == pytest.approx(0.02 + 0.98 / 32)
    assert reflectance(0.0) == reflectance(0.1) > 0.5


# Sky and palette


@pytest.mark.parametrize("sun", [(0.6, 0.0, 0.8), (0.0, -0.6, 0.8), (-0.48, 0.36, 0.8), (0.0, 0.0, 1.0)])
def test_the_sky_is_brightest_where_the_sun_is(sun):
    lit, dark = (sky_cube(64, ZENITH, WHITE, np.array(sun), np.full(3, light)).astype(int) for light in (0.8, 0.0))
    added = (lit - dark).sum(axis=-1)
    face, row, column = np.unravel_index(int(added.argmax()), (6, 64, 64))
    # the upper face's columns run to the east, its rows to the south: found by drawing a cube of coloured faces
    place = (2.0 * (np.array([column, row]) + 0.5) / 64 - 1.0) * (1, -1)
    assert face == 2
    assert place == pytest.approx(np.array(sun[:2]) / sun[2], abs=0.04)


def test_a_sky_of_one_colour_has_no_sun():
    assert np.unique(sky_cube(32, WHITE, WHITE, UP, np.ones(3)).reshape(-1, 3), axis=0).tolist() == [[230, 230, 230]]


def test_the_palette_goes_from_deep_water_to_the_sky_and_to_glitter():
    palette = sea_palette(64, 128, ZENITH, WHITE, np.array([0.5, 0.5, 0.5])).astype(int)
    assert palette.shape == (128, 64, 3)
    assert palette[0, 0].max() < 80
    assert palette[0, -1] == pytest.approx([229.5] * 3, abs=0.6)  # all of the light of the horizon
    assert np.all(np.diff(palette[:, 0].sum(axis=1)) >= 0)
    assert (palette[-1, 0] - palette[0, 0]).tolist() == pytest.approx([127, 127, 127], abs=1)


def test_the_drawing_models_sky_is_painted(world):
    model = drawing_model(world)
    sky = model.texture("sky")
    assert (int(sky.width[0]), int(sky.height[0])) == (SKY_SIDE, 6 * SKY_SIDE)


# Time of day


def test_a_sky_without_an_hour_is_a_clear_day():
    plain = compile_world({"scene": {"sky": True}}).mjcf
    assert plain == compile_world({}).mjcf
    assert 'dir="-0.5 0.1 -0.9"' in plain


@pytest.mark.parametrize(("time", "elevation", "east"), [(6.0, 0.0, 1.0), (13.0, 60.0, 0.0), (20.0, 0.0, -1.0)])
def test_the_sun_rises_in_the_east_and_sets_in_the_west(time, elevation, east):
    for latitude, noon in ((-33.7, 1.0), (48.0, -1.0)):
        sun = np.array(daylight(SkyConfig(time=time), latitude).sun)
        assert np.linalg.norm(sun) == pytest.approx(1.0)
        assert math.degrees(math.asin(sun[2])) == pytest.approx(max(elevation, 5.0))
        flat = sun[:2] / np.linalg.norm(sun[:2])
        assert flat == pytest.approx([east, noon if east == 0.0 else 0.0], abs=1e-9)


def test_noon_is_a_clear_day_dusk_is_red_and_night_is_dark():
    noon, dusk, night = (daylight(SkyConfig(time=hour), 0.0) for hour in (13.0, 19.8, 1.0))
    assert (noon.zenith, noon.horizon, noon.light, noon.ambient) == (DAY.zenith, DAY.horizon, DAY.light, 1.0)
    assert dusk.horizon[0] > 1.3 * dusk.horizon[2]
    assert sum(night.zenith) < sum(dusk.zenith) < sum(noon.zenith)
    assert night.ambient < dusk.ambient < noon.ambient


def test_brightness_changes_without_jumps_through_day_and_night():
    hours = np.linspace(0.0, 24.0, 24 * 60 + 1)
    skies = [daylight(SkyConfig(time=float(hour), sunrise=5.5, sunset=18.0), -33.0) for hour in hours]
    values = np.array([(*sky.zenith, *sky.horizon, *sky.light, sky.ambient) for sky in skies])
    assert np.abs(np.diff(values, axis=0)).max() < 0.05
    assert values[0] == pytest.approx(values[-1])


def test_the_hour_reaches_the_light_of_the_world():
    model = drawing_model(compile_world({"scene": {"ambient": [0.4, 0.4, 0.4], "sky": {"time": 19.9}}}))
    light = daylight(SkyConfig(time=19.9), 0.0)
    assert model.light("sun").dir == pytest.approx(-np.array(light.sun), abs=1e-6)
    assert model.light("sun").diffuse == pytest.approx(light.light, abs=1e-6)
    assert model.vis.headlight.ambient == pytest.approx([0.4 * light.ambient] * 3)


def test_a_sun_that_sets_before_it_rises_is_an_error():
    with pytest.raises(ConfigError, match=r"sunset: must be later than sunrise, 9; got 8$"):
        compile_world({"scene": {"sky": {"sunrise": 9, "sunset": 8}}})


def test_clouds_are_told_to_be_missing():
    with pytest.warns(VrxWarning, match="^world world: MuJoCo cannot draw the sky's clouds$"):
        compile_world({"scene": {"sky": {"time": 9, "clouds": {"speed": 12}}}})


# Fog


@pytest.mark.parametrize("kind", ["exp", "quadratic"])
def test_fog_of_another_law_is_linear_between_5_and_95_percent(kind):
    fog = FogConfig(type=kind, density=0.02)
    hidden = [1.0 - math.exp(-((0.02 * d) ** (2 if kind == "quadratic" else 1))) for d in fog_range(fog)]
    assert hidden == pytest.approx([0.05, 0.95])


def test_linear_fog_is_as_it_says_and_no_density_is_no_fog():
    assert fog_range(FogConfig(type="linear", start=3, end=70)) == (3.0, 70.0)
    assert fog_range(FogConfig(type="exp", density=0.0)) == (2000.0, 4000.0)
