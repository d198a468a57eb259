"""The sea as cameras see it: the waves that push, as far as points carry them, and in the light what they do not."""

import math
from itertools import pairwise

import numpy as np
import pytest

from unit.physics.rows import sea, sea_of, table
from vrx_mj.model import tables
from vrx_mj.physics.surface import (
    COARSE,
    EDGE,
    FINE,
    PLAIN,
    RINGS,
    SPOKES,
    draw_surface,
    fan_triangles,
    horizon,
    reflectance,
    ring_distances,
    ripples,
    spokes,
)
from vrx_mj.physics.waves import elevation, ramp

SUN, TIME, COURSE, HALF = np.array([0.0, 0.6, 0.8]), 7.3, 0.4, 0.6
SEA = "W04"
NO_RIPPLES = table(tables.WAVE, [])
NOTHING = np.zeros((0, 7))
LEVEL_VIEW = (-0.35, 0.35)


def surface(waves, water, *, height=1.8, elevations=LEVEL_VIEW, shading=NO_RIPPLES, floats=NOTHING, sun=SUN):
    """Distances of the rings; points, normals and places on the palette, by ring and spoke."""
    distances = ring_distances(height, 0.2, *elevations)
    points, normals, palette = (np.zeros((RINGS * SPOKES, width), np.float32) for width in (3, 3, 2))
    eye, sums = np.array([3.0, -2.0, height]), np.zeros((8, SPOKES))
    sums[:2] = np.cos(COURSE + HALF * spokes()), np.sin(COURSE + HALF * spokes())
    draw_surface(
        waves, shading, water, TIME, eye, sun, HALF, distances, 1.0, floats, sums, points, normals, palette
    )  # fmt: skip
    return distances, *(values.astype(float).reshape(RINGS, SPOKES, -1) for values in (points, normals, palette))


@pytest.fixture(scope="module")
def drawn():
    """The surface of a rough sea, its waves and how much it has grown."""
    waves, water = sea_of(SEA)
    return waves, ramp(water, TIME), *surface(waves, water)


def test_near_the_eye_points_lie_on_the_waves(drawn):
    waves, grown, distances, points, _, _ = drawn
    seen = points[distances < 15.0].reshape(-1, 3)
    heights = [grown * elevation(waves, x, y, TIME) for x, y, _ in seen]
    assert np.ptp(heights) > 0.2
    assert seen[:, 2] == pytest.approx(heights, abs=2e-4)  # of 32 bits


def test_near_the_eye_normals_stand_upright_on_the_waves(drawn):
    """Against differences of the heights over a millimetre."""
    waves, grown, distances, points, normals, _ = drawn
    step, near = 1e-3, distances < 15.0
    for (x, y, _), normal in zip(points[near].reshape(-1, 3)[::7], normals[near].reshape(-1, 3)[::7], strict=True):
        east, north = (
            grown * (elevation(waves, x + dx, y + dy, TIME) - elevation(waves, x - dx, y - dy, TIME)) / (2 * step)
            for dx, dy in ((step, 0.0), (0.0, step))
        )
        expected = np.array([-east, -north, 1.0])
        assert normal == pytest.approx(expected / np.linalg.norm(expected), abs=1e-3)


def test_waves_that_lie_closer_than_the_points_are_not_drawn(drawn):
    _, _, distances, points, normals, palette = drawn
    far = distances > 0.9 * horizon(1.8)
    assert np.abs(points[far, :, 2]).max() == 0.0
    assert (normals[far] == (0.0, 0.0, 1.0)).all()
    assert ((palette >= EDGE - 1e-6) & (palette <= 1.0 - EDGE + 1e-6)).all()
    bearings = np.arctan2(points[-1, :, 1] + 2.0, points[-1, :, 0] - 3.0)
    assert [bearings.min(), bearings.max()] == pytest.approx([COURSE - HALF, COURSE + HALF], abs=1e-4)


def one_wave(length, heading, amplitude=0.1):
    k = 2.0 * math.pi / length
    return sea(
        [{"amplitude": amplitude, "wavenumber": k, "frequency": math.sqrt(9.81 * k),
          "direction": (math.cos(heading), math.sin(heading)), "steepness": 0.0}],
        tau=0.0, level=0.0,
    )  # fmt: skip


@pytest.mark.parametrize("height", [0.5, 2.0, 12.0, 60.0, 200.0])
@pytest.mark.parametrize("heading", [COURSE, COURSE + 0.5 * math.pi])
def test_a_wave_fades_by_the_cells_along_its_way(height, heading):
    """Whole up to `FINE` of its phase from point to point, and gone from `COARSE` on, on the middle spoke."""
    length = 0.5 * height + 3.0
    distances, points, _, _ = surface(*one_wave(length, heading), height=height)
    cells = 0.5 * np.abs(np.gradient(2.0 * distances)) if heading == COURSE else distances * 2.0 * HALF / (SPOKES - 1)
    phase, middle = 2.0 * math.pi / length * cells, points[:, SPOKES // 2]
    k = 2.0 * math.pi / length
    along = math.cos(heading) * middle[:, 0] + math.sin(heading) * middle[:, 1]
    whole = 0.1 * np.cos(k * along - math.sqrt(9.81 * k) * TIME)
    inner = slice(1, -1)  # the last ring's cells are half
    assert np.abs(middle[inner, 2] - whole[inner])[phase[inner] < FINE].max() < 2e-3
    assert np.abs(middle[phase > COARSE, 2]).max() < 1e-9


@pytest.mark.parametrize("height", [0.5, 2.0, 12.0, 60.0, 200.0])
def test_rings_look_equally_far_apart_from_the_edge_of_the_picture_to_the_horizon(height):
    distances = ring_distances(height, 0.0, -0.4, 0.4)
    assert len(distances) == RINGS
    assert distances[0] <= height / math.tan(0.4)
    assert distances[-1] == pytest.approx(horizon(height))
    steps = np.abs(np.diff(np.arctan2(height, distances)))
    assert steps.max() < 0.017  # 8 pixels of 500 to a radian
    assert (np.diff(distances) / distances[1:]).max() < 0.25


@pytest.mark.parametrize("height", [0.5, 12.0, 200.0])
def test_the_horizon_is_a_straight_line_across_the_view(height):
    points = surface(*sea_of(SEA), height=height)[1]
    ahead = (points[-1, :, :2] - (3.0, -2.0)) @ (math.cos(COURSE), math.sin(COURSE))
    assert ahead == pytest.approx(horizon(height), rel=1e-6)


def test_rings_end_where_a_picture_does_that_looks_down():
    distances = ring_distances(100.0, 0.0, -0.5 * math.pi, -1.0)
    assert distances[0] == 0.0
    assert distances[-1] == pytest.approx((100.0 + 0.2) / math.tan(1.0))


def test_the_horizon_is_as_far_as_on_earth():
    assert horizon(200.0) == pytest.approx(math.sqrt(2 * 6371e3 * 200.0), rel=2e-3)


def test_triangles_cover_the_fan_without_empty_ones():
    distances = ring_distances(2.0, 0.0, -0.4, 0.4)
    r, angle = np.repeat(distances, SPOKES), np.tile(spokes(), RINGS)
    a, b, c = np.stack((r * np.cos(angle), r * np.sin(angle)), axis=1)[fan_triangles()].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    areas = 0.5 * (ux * vy - uy * vx)
    assert (areas > 0.0).all()
    assert areas.sum() == pytest.approx(distances[-1] ** 2 - distances[0] ** 2, rel=1e-3)


# Light


def test_water_mirrors_more_the_flatter_it_is_looked_at_and_less_the_rougher_it_is():
    """Schlick's formula: 2 % from above, and towards all of it along the surface."""
    assert reflectance(1.0, 0.0) == pytest.approx(((1.333 - 1) / (1.333 + 1)) ** 2, abs=5e-4)  # Fresnel, n = 1.333
    assert reflectance(0.5, 0.0) == pytest.approx(0.02 + 0.98 / 32)
    assert reflectance(0.0, 0.0) == pytest.approx(1.0)
    found = [reflectance(cosine, 0.1) for cosine in np.linspace(0.0, 1.0, 10)]
    assert all(one > other for one, other in pairwise(found))
    grazing = [reflectance(0.0, deviation) for deviation in (0.0, 0.05, 0.1, 0.2)]
    assert all(one > other for one, other in pairwise(grazing))


def test_the_mean_reflectance_is_that_over_the_slopes():
    """A second way: Fresnel's law over faces that lean by normal slopes and are seen."""
    rng = np.random.default_rng(1)
    slopes = rng.normal(0.0, 0.12, (200_000, 2))
    for elevation_of_view in (0.1, 0.3, 0.8):
        view = np.array([math.cos(elevation_of_view), 0.0, math.sin(elevation_of_view)])
        facing = view[2] - slopes[:, 0] * view[0]
        cosine = np.clip(facing / np.sqrt(1.0 + (slopes**2).sum(axis=1)), 0.0, 1.0)
        weight = np.maximum(facing, 0.0)  # of a face's area, what is seen of it
        mean = np.average(0.02 + 0.98 * (1.0 - cosine) ** 5, weights=weight)
        assert reflectance(view[2], 0.12) == pytest.approx(mean, abs=0.06)


def whiteness(palette):
    return (palette[..., 1] - PLAIN) / (PLAIN - EDGE)


def test_the_rougher_the_sea_the_wider_the_glitter():
    """Waves too short for the points widen it as slopes do: Cox and Munk's density."""
    wide, bright = [], []
    for amplitude in (0.002, 0.02):
        water = one_wave(1.0, COURSE, amplitude)
        glitter = whiteness(surface(*water, height=200.0, elevations=(-1.5, 0.0), sun=np.array([0.5, 0.2, 0.84]))[3])
        wide.append((glitter > 0.5 * glitter.max()).mean())
        bright.append(glitter.max())
    assert wide[1] > 1.5 * wide[0]
    assert bright[1] < 0.7 * bright[0]


def test_a_low_suns_path_on_calm_water_has_no_edge():
    """It is too bright for a picture: cut off, it would end within a cell, and its edge follow the spokes."""
    low = np.array([math.cos(COURSE) * math.cos(0.2), math.sin(COURSE) * math.cos(0.2), math.sin(0.2)])
    glitter = whiteness(surface(*one_wave(5.0, COURSE, 0.001), sun=low)[3])
    assert glitter.max() > 0.9
    assert np.abs(np.diff(glitter, axis=1)).max() < 0.6  # of white


@pytest.mark.parametrize("elevation_of_sun", [0.06, 0.02, 0.005])
def test_a_low_suns_path_reaches_the_horizon_and_there_is_none_with_the_sun_behind(elevation_of_sun):
    """However flatly both look at the water: what counts is how far a face leans that mirrors one to the other."""
    level, up = math.cos(elevation_of_sun), math.sin(elevation_of_sun)
    ahead = np.array([math.cos(COURSE) * level, math.sin(COURSE) * level, up])
    water = one_wave(5.0, COURSE, 0.001)
    assert whiteness(surface(*water, sun=ahead)[3])[-40:].max(axis=1).min() > 0.9
    assert np.abs(whiteness(surface(*water, sun=ahead * (-1.0, -1.0, 1.0))[3])).max() < 1e-4  # foam of so calm a sea


@pytest.mark.parametrize("off", [0.0, 0.005, 0.01])
def test_the_path_of_a_setting_sun_is_as_wide_as_spokes_can_carry(off):
    """Narrower, it would be of two or three spokes, and its edges steps, wherever between two of them the sun is."""
    angle = COURSE + off
    low = np.array([math.cos(angle) * math.cos(0.06), math.sin(angle) * math.cos(0.06), math.sin(0.06)])
    glitter = whiteness(surface(*one_wave(5.0, COURSE, 0.001), sun=low)[3])
    far = glitter[-20:]
    assert (far > 0.5 * far.max(axis=1, keepdims=True)).sum(axis=1).min() >= 4
    assert np.abs(np.diff(glitter, axis=1)).max() < 0.8  # of white


def test_the_palettes_ends_lie_off_its_borders_where_all_or_none_of_the_sky_is_mirrored():
    """Waves that no sea has, lit from ahead and seen from low."""
    low = np.array([math.cos(COURSE), math.sin(COURSE), 0.02])
    mirrored = surface(*one_wave(20.0, COURSE, 9.0), sun=low)[3][..., 0]
    assert (mirrored.min(), mirrored.max()) == pytest.approx((EDGE, 1.0 - EDGE), abs=1e-6)


def test_steep_crests_are_foam_and_troughs_and_gentle_seas_are_not():
    length, amplitude = 20.0, 1.4  # downward acceleration of a crest: 0.44 g
    distances, points, _, palette = surface(*one_wave(length, COURSE, amplitude), height=6.0)
    near, foam = distances < 40.0, -whiteness(palette)
    crests, troughs = points[near, :, 2] > 0.97 * amplitude, points[near, :, 2] < 0.5 * amplitude
    assert foam[near][crests].min() > 0.9
    assert foam[near][troughs].max() < 0.1
    gentle = surface(*one_wave(length, COURSE, 0.3), height=6.0)[3]
    assert -whiteness(gentle).min() < 0.02


def test_foam_surrounds_what_stands_in_the_water():
    float_ = np.array([[3.0 + 8.0 * math.cos(COURSE), -2.0 + 8.0 * math.sin(COURSE), 1.0, 0.0, 1.0, 0.3, 0.8]])
    _, points, _, palette = surface(*sea([], tau=0.0, level=0.0), floats=float_)
    off = np.abs(points[..., :2] - float_[0, :2]) - (1.0, 0.3)
    beside = np.hypot(*np.moveaxis(np.maximum(off, 0.0), -1, 0))
    foam = -whiteness(palette)
    assert foam[beside == 0.0].max() > 0.4
    assert foam[beside > 2.0].max() < 0.01


def test_ripples_are_water_waves_and_a_calm_sea_has_none():
    assert len(ripples(NO_RIPPLES)) == 0
    waves, water = sea_of(SEA)
    small = ripples(waves)
    assert small["frequency"] == pytest.approx(np.sqrt(9.81 * small["wavenumber"]))
    assert np.hypot(*small["direction"].T) == pytest.approx(1.0)
    assert (small["amplitude"] < 0.1).all()
    plain, shaded = surface(waves, water), surface(waves, water, shading=small)
    assert np.array_equal(plain[1], shaded[1])  # they only tilt the normals
    assert np.abs(plain[2] - shaded[2]).max() > 0.01
