"""The model that is drawn, and the light of the day that it is drawn in."""

import math

import mujoco
import numpy as np
import pytest

from vrx_mj.config.world import FogConfig, SkyConfig
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.scene import (
    DAY,
    FOAM_BRIGHTNESS,
    SEA,
    SKY_SIDE,
    daylight,
    drawing_model,
    drawing_spec,
    fog_range,
    sea_palette,
    sky_cube,
)
from vrx_mj.physics.surface import RINGS, SPOKES, horizon
from vrx_mj.runtime.stepping_models import stepping_models

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
    assert np.hypot(*(points[:, :2] - model.stat.center[:2]).T).max() == pytest.approx(horizon(2.0))
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


def test_the_palette_goes_from_deep_water_to_the_sky_and_from_foam_to_glitter():
    palette = sea_palette(64, 129, ZENITH, WHITE, np.array([0.5, 0.5, 0.5])).astype(int)
    assert palette.shape == (129, 64, 3)
    plain = palette[64]  # the middle of an odd number of rows is plain: no share of foam or glitter
    assert plain[0].max() < 80
    assert plain[-1] == pytest.approx([229.5] * 3, abs=0.5)  # all of the light of the horizon, to the nearest count
    assert np.all(np.diff(palette[64:, 0].sum(axis=1)) >= 0)
    # glitter adds half of 255; either count is the nearest
    assert (palette[-1, 0] - plain[0]).tolist() == pytest.approx([127.5] * 3, abs=1.0)
    assert palette[0].tolist() == [[round(255 * FOAM_BRIGHTNESS)] * 3] * 64


def test_in_fog_nothing_glitters():
    """A sky of one colour has no sun."""
    palette = sea_palette(64, 128, WHITE, WHITE, np.ones(3)).astype(int)
    assert (palette[64:] == palette[64]).all()


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
