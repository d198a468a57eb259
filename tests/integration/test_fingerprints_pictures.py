"""What maps of worlds, skies, charts and pages of campaigns show: the numbers that they showed before."""

import re
from dataclasses import replace

import numpy as np
import pytest

from campaigns import campaign_of, failed, scored
from fingerprints import check, drawn, numbers_in
from integration.test_fingerprints_worlds import compiled
from vrx_mj.campaign.page import page, sketch_of
from vrx_mj.campaign.scores import compare
from vrx_mj.campaign.vary import Quantity
from vrx_mj.config.world import SkyConfig
from vrx_mj.draw.course import map_of
from vrx_mj.draw.map import chart
from vrx_mj.mjcf.scene import daylight, sea_palette, sky_cube

EVERYDAY = {"gymkhana": None}
BY_NIGHT = {
    "wildlife_task": "trio",
    "example_course": "trio", "scan_dock_deliver": None, "wayfinding_task": None, "ocean_buoys": "usv_config",
    "my_course": None, "vrx2023/acoustic_tracking_task": None, "vrx2023/follow_path_task": None, "marina": None,
}  # fmt: skip


def check_map(name, fleet):
    world = compiled(name, fleet=fleet)
    scene = map_of(world)
    check("pictures", name, scene=scene, sketch=sketch_of(world), drawn=drawn(chart(scene, (1600, 1100))))


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_map_shows_what_it_showed(name):
    check_map(name, EVERYDAY[name])


@pytest.mark.slow
@pytest.mark.nightly
def test_so_do_those_of_other_worlds():
    for name, fleet in BY_NIGHT.items():
        check_map(name, fleet)


def test_skies_and_seas_have_the_colours_that_they_had():
    for hour in range(0, 24, 3):
        light = daylight(SkyConfig(time=float(hour), sunrise=5.5, sunset=19.0), 21.3)
        zenith, horizon, sun, color = map(np.array, (light.zenith, light.horizon, light.sun, light.light))
        sea = sea_palette(32, 8, zenith, horizon, color)
        check("pictures", f"hour {hour}", light=light, sky=sky_cube(16, zenith, horizon, sun, color), sea=sea)


GUSTS = Quantity("wind.mean", 0.0, 8.0, "m/s")


def results(shift):
    """Scores of two controllers in two worlds of two kinds of tasks, with failures, and a quantity that was varied."""
    random = np.random.default_rng(5)
    for place, (controller, world) in enumerate((who, where) for who in ("a:f", "b:f") for where in ("v", "w")):
        kind = "dock" if world == "v" else "stationkeeping"
        for seed in range(12):
            way = {"wamv": np.cumsum(random.normal(0.0, 3.0, (30, 2)), axis=0).tolist()}
            score = float(random.normal(place + shift, 1.0 + seed / 6))
            result = scored(controller, world, seed, score, kind=kind, tracks=way)
            yield replace(result, parameters={"wind.mean": GUSTS.value(seed)})
        yield failed(controller, world, 12, f"it sank in {place}")


@pytest.mark.slow
@pytest.mark.nightly
def test_a_campaigns_page_shows_what_it_showed():
    before, after = (campaign_of("results", [*results(shift)], vary=(GUSTS,)) for shift in (0.0, 0.4))
    sketches = {name: sketch_of(compiled(world)) for name, world in {"v": "marina", "w": "wayfinding_task"}.items()}
    html = page(after, sketches, compare(before, after))
    parts = re.findall("<svg.*?</svg>|<table.*?</table>", html, re.DOTALL)
    assert len(parts) > 3
    check("pictures", "campaign", numbers=[numbers_in(part) for part in parts])
