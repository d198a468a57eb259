"""What maps of worlds, pictures of boats and pages of campaigns show: the numbers that they showed before."""

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import Collection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from campaigns import campaign_of, failed, scored
from fingerprints import check, numbers_in
from integration.test_fingerprints_worlds import compiled
from vrx_mj.campaign.page import page, sketch_of
from vrx_mj.campaign.scores import compare
from vrx_mj.campaign.vary import Quantity
from vrx_mj.draw.boat_pictures import _figure
from vrx_mj.draw.course import map_of
from vrx_mj.draw.map import chart
from vrx_mj.formats.parts.compliance import judge
from vrx_mj.formats.parts.read import load_parts

EVERYDAY = {"gymkhana": None}
BY_NIGHT = {
    "wildlife_task": "trio",
    "example_course": "trio", "scan_dock_deliver": None, "wayfinding_task": None, "ocean_buoys": "usv_config",
    "my_course": None, "vrx2023/acoustic_tracking_task": None, "vrx2023/follow_path_task": None, "marina": None,
}  # fmt: skip


def shapes(figure):
    """Lines, patches and collections of a figure; names are placed by the fonts that a machine has."""
    for artist in figure.findobj(lambda one: isinstance(one, (Line2D, Patch, Collection)) and one.get_visible()):
        if isinstance(artist, Line2D):
            yield [artist.get_xydata(), artist.get_linewidth(), str(artist.get_color())]
        elif isinstance(artist, Patch):
            path = artist.get_patch_transform().transform_path(artist.get_path())
            yield [path.vertices, artist.get_facecolor(), artist.get_linewidth()]
        else:
            paths = [path.vertices for path in artist.get_paths()]
            yield [artist.get_offsets(), *paths, artist.get_facecolor(), artist.get_linewidth()]


def check_map(name, fleet):
    world = compiled(name, fleet=fleet)
    scene = map_of(world)
    figure = chart(scene, (800, 550))
    limits = [(axes.get_xlim(), axes.get_ylim(), axes.get_position().bounds) for axes in figure.axes]
    check("pictures", name, scene=scene, limits=limits, shapes=[*shapes(figure)], sketch=sketch_of(world))


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_map_shows_what_it_showed(name):
    check_map(name, EVERYDAY[name])


@pytest.mark.slow
def test_so_do_those_of_other_worlds():
    for name, fleet in BY_NIGHT.items():
        check_map(name, fleet)


COMPONENTS = """
wamv_camera: [{name: front, x: 0.75, y: 0.25}, {name: back, x: -0.3}]
wamv_gps: [{name: gps, x: -0.85}]
wamv_pinger: [{name: pinger}]
"""
THRUSTERS = "engine: [{prefix: left, position: -2.373776 1.027135 0.318237}, {prefix: far, position: 40 0 0}]\n"


def test_a_verdict_and_its_picture_are_what_they_were(tmp_path):
    (tmp_path / "c.yaml").write_text(COMPONENTS, encoding="utf-8")
    (tmp_path / "t.yaml").write_text(THRUSTERS, encoding="utf-8")
    verdict = judge(load_parts(tmp_path / "c.yaml", "components"), load_parts(tmp_path / "t.yaml", "thrusters"))
    check("pictures", "verdict", shapes=[*shapes(_figure(verdict))])


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
            yield replace(result, parameters={"wind.mean": GUSTS.drawn(seed)})
        yield failed(controller, world, 12, f"it sank in {place}")


@pytest.mark.slow
def test_a_campaigns_page_shows_what_it_showed():
    before, after = (campaign_of("results", [*results(shift)], vary=(GUSTS,)) for shift in (0.0, 0.4))
    sketches = {name: sketch_of(compiled(world)) for name, world in {"v": "marina", "w": "wayfinding_task"}.items()}
    html = page(after, sketches, compare(before, after))
    parts = re.findall("<svg.*?</svg>|<table.*?</table>", html, re.DOTALL)
    assert len(parts) > 3
    check("pictures", "campaign", numbers=[numbers_in(part) for part in parts])
