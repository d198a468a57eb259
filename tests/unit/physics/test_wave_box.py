"""Waves in a box around a hull against the sum of the waves at every point."""

import math

import numpy as np
import pytest

from unit.physics.rows import moving, sea, table
from vrx_mj.model.tables import PART, VESSEL
from vrx_mj.physics.kinematics import water_pressure
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.physics.wave_box import BOX_MEMORY, LEVELS, ROWS, SHALLOW_LEVELS, SLENDER_ROWS, pressures_in_waves
from vrx_mj.physics.waves import surface_height, wave_columns
from vrx_mj.spectra import Site, irregular_sea, jonswap, regular_wave

POINTS = np.random.default_rng(1).uniform(-1.0, 1.0, (300, 3)) * (2.5, 1.2, 0.4)
POSE = (3.0, 4.0, 0.05, 0.1, -0.05, 0.6)


def components(waves):
    return [{**wave._asdict(), "steepness": 0.0} for wave in waves]


def pressures(points, pose, waves, water, t, rows=ROWS, levels=LEVELS):
    """Of the polynomial, and of the sum over the waves; `points` of a part, (n, 3), or of several."""
    body = moving(pose[:3], pose[3:])
    hulls = points.reshape(-1, *points.shape[-2:])
    filled = np.pad(hulls, ((0, 0), (0, -hulls.shape[1] % WIDTH), (0, 0)), mode="edge")
    low, high = hulls.min(axis=1), hulls.max(axis=1)
    size = filled.shape[1]
    parts = table(PART, [{"center": 0.5 * (low + high)[i], "start": i * size, "size": size} for i in range(len(hulls))])
    vessel = np.zeros(1, VESSEL)[0]
    vessel["half"], vessel["wave_rows"], vessel["wave_levels"] = 0.5 * (high - low)[0], rows, levels
    out, polynomial = np.zeros(len(hulls) * size), np.zeros((LEVELS, ROWS, WIDTH))
    columns = wave_columns(waves, water, BOX_MEMORY + 2 * len(hulls))
    turned = np.ascontiguousarray(filled.reshape(-1, 3).T)
    pressures_in_waves(vessel, parts, turned, columns, water, body, t, polynomial, out)
    turn = np.array(body[3:12]).reshape(3, 3)
    exact = [water_pressure(waves, water, *place, t) for place in points.reshape(-1, 3) @ turn.T + np.array(body[:3])]
    return out.reshape(len(hulls), size)[:, : hulls.shape[1]].ravel(), np.array(exact)


@pytest.mark.parametrize("depth", [math.inf, 5.0])
@pytest.mark.parametrize(("length", "bound"), [(10.0, 6e-3), (20.0, 4e-4), (50.0, 1e-5)])
def test_a_wave_is_met_within_a_share_of_its_amplitude(depth, length, bound):
    """The bound is (k a)^5 / 1057 of both sides, and of the depth."""
    k = 2.0 * math.pi / length
    period = 2.0 * math.pi / math.sqrt(9.81 * k * math.tanh(min(k * depth, 50.0)))
    waves, water = sea(components(regular_wave(0.2, period, (0.8, 0.6), Site(depth, 9.81))), depth=depth)
    found, exact = pressures(POINTS, POSE, waves, water, 1.3)
    wet = exact > 0.0
    assert np.abs(found - exact)[wet].max() < bound * 1025.0 * 9.81 * 0.1
    assert (found[~wet] <= 0.0).all()


def test_waves_grow_with_the_ramp_of_the_sea():
    """To 40 % of their height after 1 s."""
    waves, water = sea(components(regular_wave(0.2, 6.0, (0.8, 0.6), Site())), tau=-1.0 / math.log(0.6))
    found, exact = pressures(POINTS, POSE, waves, water, 1.0)
    full, _ = pressures(POINTS, POSE, waves, sea([])[1], 1.0)
    wet = exact > 0.0
    assert np.abs(found - exact)[wet].max() < 1e-4 * 1025.0 * 9.81 * 0.1
    assert np.abs(found - full)[wet].max() > 0.1 * 1025.0 * 9.81 * 0.1


@pytest.mark.parametrize("depth", [math.inf, 12.0])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.5, 0.75])
def test_depth_counts_from_the_surface_that_lifts_the_hull(phase, depth):
    """On a crest, above the mean level, in a trough, and between: a swell of 5 m and 20 s."""
    waves, water = sea(components(regular_wave(4.96, 20.0, (0.8, 0.6), Site(depth, 9.81))), depth=depth)
    t = phase * 20.0
    height = surface_height(waves, water, 3.0, 4.0, t)
    found, exact = pressures(POINTS, (3.0, 4.0, height - 0.1, 0.1, -0.05, 0.6), waves, water, t)
    wet = exact > 0.0
    assert np.abs(found - exact)[wet].max() < 1e-6 * 1025.0 * 9.81 * 2.48


def test_the_pressure_at_the_surface_is_the_air_s():
    waves, water = sea(components(irregular_sea(jonswap(1.2, 3.3), 0.3, (0.6, 4.0), (1.0, 0.0), 60, None, Site())))
    found, _ = pressures(np.array([[0.0, 0.0, z] for z in np.linspace(-1.0, 1.0, 201)]), (0, 0, 0, 0, 0, 0), waves,
                         water, 2.0)  # fmt: skip
    assert (np.diff(found) < 0.0).all()
    assert found[0] > 0.0 > found[-1]


@pytest.mark.parametrize("attitude", [(math.pi / 2, 0.0, 0.3), (math.pi, 0.0, 0.0), (0.0, 1.55, 0.2), (2.0, -1.0, 3.0)])
def test_a_capsized_hull_is_in_its_box_too(attitude):
    waves, water = sea(components(regular_wave(0.2, 4.0, (0.0, 1.0), Site())))
    found, exact = pressures(POINTS, (1.0, 2.0, -0.1, *attitude), waves, water, 0.7)
    wet = exact > 0.0
    assert np.abs(found - exact)[wet].max() < 1e-3 * 1025.0 * 9.81 * 0.1


def test_ripples_fade_out():
    """Waves of a fifth of the length are not felt."""
    waves, water = sea(components(regular_wave(0.02, math.sqrt(2.0 * math.pi / 9.81), (1.0, 0.0), Site())))
    found, _ = pressures(POINTS, (0, 0, 0, 0, 0, 0), waves, water, 0.0)
    assert found == pytest.approx(-1025.0 * 9.81 * POINTS[:, 2], rel=1e-9)


@pytest.mark.parametrize(("length", "bound"), [(3.0, 6e-3), (6.0, 8e-4), (20.0, 2e-5)])
def test_three_nodes_are_enough_across_a_slender_hull(length, bound):
    """The bound is (k a)^3 / 15.6 of half its breadth, 0.2 m, and of the depth."""
    k = 2.0 * math.pi / length
    waves, water = sea(components(regular_wave(0.02, math.sqrt(2.0 * math.pi * length / 9.81), (0.0, 1.0), Site())))
    slender, pose = POINTS * (0.1, 0.2 / 1.2, 0.5), (3.0, 4.0, 0.05, 0.05, -0.05, 0.0)
    found, exact = pressures(slender, pose, waves, water, 1.3, SLENDER_ROWS, SHALLOW_LEVELS)
    wet = exact > 0.0
    assert k * 0.2 < 0.5
    assert np.abs(found - exact)[wet].max() < bound * 1025.0 * 9.81 * 0.01
    assert (found[~wet] <= 0.0).all()


@pytest.mark.parametrize("roll", [-0.5, 0.5])
def test_the_hulls_of_a_heeled_catamaran_are_each_in_a_box_that_is_deep_enough(roll):
    """The deeper one to port, and to starboard; the bound is that of three nodes over the depth, 1 m of 40 m."""
    waves, water = sea(components(regular_wave(0.5, math.sqrt(2.0 * math.pi * 40.0 / 9.81), (0.6, 0.8), Site())))
    hulls = POINTS * (1.0, 0.2, 0.5) + np.array([-1.0, 1.0])[:, None, None] * (0.0, 1.0, 0.0)
    found, exact = pressures(hulls, (3.0, 4.0, 0.0, roll, 0.02, 0.3), waves, water, 1.3, SLENDER_ROWS, SHALLOW_LEVELS)
    wet = (exact > 0.0).reshape(2, -1)
    assert wet.any(axis=1).all()
    assert np.abs(found - exact)[wet.ravel()].max() < 2e-4 * 1025.0 * 9.81 * 0.25


@pytest.mark.parametrize("nodes", [(ROWS, LEVELS), (SLENDER_ROWS, SHALLOW_LEVELS)], ids=["many", "few"])
def test_a_sea_is_met_in_every_phase(nodes):
    """Two thirds of it are longer than 12 m, beside a hull of 5 m; within 0.5 % of Hs / 2 on average, 2.5 % at most."""
    rows = components(irregular_sea(jonswap(5.0, 3.3), 0.5, (0.8, 3.0), (1.0, 0.5), 60, 8.0, Site()))
    phases = np.random.default_rng(3).uniform(0.0, 2.0 * math.pi, len(rows))
    waves, water = sea([row | {"phase": phase} for row, phase in zip(rows, phases, strict=True)])
    apart = []
    for t in np.linspace(0.0, 60.0, 25).tolist():
        pose = (*POSE[:2], surface_height(waves, water, *POSE[:2], t), *POSE[3:])
        found, exact = pressures(POINTS * (1.0, 0.2, 0.5), pose, waves, water, t, *nodes)
        apart.append(np.abs(found - exact)[exact > 0.0] / (1025.0 * 9.81 * 0.25))
    assert np.concatenate(apart).mean() < 0.005
    assert np.concatenate(apart).max() < 0.025
