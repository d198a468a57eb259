import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

from campaigns import campaign_of, failed, scored
from vrx_mj.campaign.page import (
    _BEST_COLOR,
    _MIDDLE_COLOR,
    _WORST_COLOR,
    SHAPES,
    LivePage,
    _breakable,
    _color,
    _frame,
    _number,
    _track,
    _view,
    page,
)
from vrx_mj.campaign.results import Result, ResultStore, sketch_file, write_json
from vrx_mj.campaign.scores import compare
from vrx_mj.campaign.vary import Quantity

EVIL = "<script>alert('no')</script> & \"more\""
VOID = {"meta", "input", "br", "wbr", "link"}


def sketch(name="w", task="stationkeeping"):
    return {
        "name": name, "description": EVIL, "task": {"type": task, "name": task},
        "shore": [[[-500.0, -500.0], [500.0, -500.0], [500.0, -1.0], [-500.0, -1.0]]],
        "docks": [{"name": EVIL, "cells": [[10.0, 10.0], [12.0, 10.0]], "yaw": 0.5, "cell": 2.0}],
        "objects": [{"name": EVIL, "spot": [5.0, 5.0], "color": "#ff0000", "size": 1.0}],
        "boats": [{"name": "wamv", "x": 0.0, "y": 0.0, "yaw": 1.0}], "waypoints": [[20.0, 5.0, 0.0]],
        "gates": [{"left": [1.0, 2.0], "right": [3.0, 4.0], "yaw": 0.0}],
        "circles": [{"x": 9.0, "y": 9.0, "radius": 10.0, "title": EVIL}],
        "bays": [{"corners": [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]], "allowed": True, "title": EVIL}],
        "beacons": [[3.0, 3.0]], "paths": [[[0.0, 0.0], [1.0, 1.0]]],
    }  # fmt: skip


class Parsed(HTMLParser):
    """The elements of a page, checked to be well nested."""

    def __init__(self, text):
        super().__init__()
        self.elements, self._open, self.words = [], [], []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)

    def of(self, tag, kind=None):
        return [
            at for name, at in self.elements if name == tag and (kind is None or kind in at.get("class", "").split())
        ]


TRACKS = {"wamv": [[0.0, 0.0], [3.0, 4.0], [20.0, 5.0]]}
RESULTS = [
    scored("a:f", "w", 0, 1.0, tracks=TRACKS),
    scored("a:f", "w", 1, 3.0, tracks=TRACKS),
    scored("b:f", "w", 0, 2.0, tracks=TRACKS),
    failed("b:f", "w", 1, EVIL),
]


@pytest.fixture(scope="module")
def parsed():
    return Parsed(page(campaign_of("results", RESULTS), {"w": sketch()}))


def test_every_cell_is_there_with_its_colour(parsed):
    cells = [at for at in parsed.of("td") if "data-s" in at]
    assert [(at["class"], at["data-s"], at["data-v"]) for at in cells] == [
        ("score", "0", "1"), ("score", "1", "3"), ("score", "0", "2"), ("failed", "1", ""),
    ]  # fmt: skip
    assert [at.get("style") for at in cells[:3]] == [
        "background:#5eb5a6", "background:#e78762", "background:#f6eccd",
    ]  # fmt: skip
    assert cells[0]["title"] == "seed 0: 1 m after 300.0 s, finished, timed out"


def test_cells_say_what_was_cut_and_what_never_started():
    results = [scored("a:f", "w", 0, 0.00196, phase="running"), scored("a:f", "w", 1, 0.0, phase="ready")]
    parsed = Parsed(page(campaign_of("results", results), {}))
    cut, never = (at for at in parsed.of("td") if "data-s" in at)
    assert (cut["class"], cut["data-v"], cut["title"]) == (
        "score", "0.00196", "seed 0: 0.00196 m after 300.0 s, cut while running"
    )  # fmt: skip
    assert (never["class"], never["data-v"], never["title"]) == ("none", "", "seed 1: not started, 320 s")
    assert "0.00196 ✂" in parsed.words


def test_nothing_of_a_name_or_message_becomes_part_of_the_page(parsed):
    assert len(parsed.of("script")) == 1
    assert EVIL in parsed.words  # the failure's message, as text
    assert not [at for _, at in parsed.elements if any(name.startswith("on") for name in at)]


def test_the_page_needs_no_network(parsed):
    links = [at[key] for _, at in parsed.elements for key in ("href", "src", "action") if at.get(key)]
    assert links
    assert not [link for link in links if re.match(r"[a-z]+:|//", link)]
    assert not parsed.of("link")
    assert not re.search(r"url\(|@import|fetch\(|XMLHttp|location.reload", "".join(parsed.words))


def test_a_page_that_is_written_while_trials_run_says_so_and_loads_itself_again():
    words = "".join(Parsed(page(campaign_of("results", RESULTS), {}, running=True)).words)
    assert "running: as of 20" in words
    assert "results.csv" not in words  # is written at the end
    assert "location.reload()" in words


def test_quantities_that_were_varied_are_charts_and_recordings_worth_seeing_are_links():
    vary = (Quantity("wind.mean", 0.0, 8.0, "m/s"), Quantity(EVIL, 0.0, 1.0))
    results = [replace(scored(who, "w", seed, seed + 0.1), parameters={"wind.mean": seed * 0.5, EVIL: 0.1},
                       recording="run.rrd") for seed in range(16) for who in ("a:f", "b:f")]  # fmt: skip
    parsed = Parsed(page(campaign_of("results", results, vary=vary), {}))
    assert len(parsed.of("svg", "chart")) == 2
    assert "a:f, rank correlation +1.00" in parsed.words
    assert "wind.mean [m/s]" in parsed.words
    links = [at["href"] for at in parsed.of("a") if at["href"].endswith("run.rrd")]
    assert links[0] == "cells/a.f/w/seed_15/run.rrd"
    assert len(links) == 10


def test_worlds_that_no_seed_changes_are_named_with_what_would():
    results = [replace(scored("a:f", "w", seed, 1.0), poses_sha256="1") for seed in (0, 1)]
    words = "".join(Parsed(page(campaign_of("results", results), {})).words)
    assert "bit for bit, in w. Draw weather or boats for each trial with --vary" in words


def test_maps_show_the_tracks_of_each_controller_and_seed(parsed):
    tracks = [(at["data-c"], at["data-s"]) for at in parsed.of("g", "track")]
    assert tracks == [("0", "0"), ("0", "1"), ("1", "0")]
    for kind in ("land", "dock", "bay", "gate", "beacon", "swim", "boat"):
        assert len(parsed.of("path", kind)) == 1, kind
    assert (
        len(parsed.of("circle", "goal")) == len(parsed.of("circle", "ring")) == len(parsed.of("circle", "thing")) == 1
    )
    west, north, width, height = map(float, parsed.of("svg")[0]["viewbox"].split())
    assert west < -1.0 < 20.0 < west + width
    assert north < -19.0 < 1.0 < north + height  # y points south: the circle reaches 19 m north


def test_what_changed_is_on_the_page():
    before = [scored("a:f", "w", seed, 9.0 + seed) for seed in range(8)]
    after = [scored("a:f", "w", seed, 1.0) for seed in range(7)] + [failed("a:f", "w", 7)]
    now = campaign_of("new", after)
    words = Parsed(page(now, {}, compare(now, campaign_of("old", before)))).words
    assert "Changes since old" in words
    assert "significantly better" in words
    assert "fails now" in words


def test_trials_without_a_task_and_those_not_sailed_have_cells_too():
    done = scored("a:f", "v", 0, 1.0)
    campaign = campaign_of("results", [done, Result(done.cell.__class__("a:f", "w", 1), sim_time=60.0)])
    cells = [at["class"] for at in Parsed(page(campaign, {"w": sketch()})).of("td") if "data-s" in at]
    assert cells == ["score", "missing", "missing", "none"]


@pytest.mark.slow
@pytest.mark.parametrize(("worlds", "seeds", "tracks"), [(100, 10, 1000), (10, 2500, 500)])
def test_a_large_campaign_makes_a_page_of_bounded_size(tmp_path, worlds, seeds, tracks):
    """Many worlds, and many seeds, of which none has a cell of its own."""
    long = {"wamv": [[0.1 * i, 0.2 * i] for i in range(100)]}
    names = [f"vrx2022/phase2/world{i}" for i in range(worlds)]
    results = [scored("a:f", world, seed, float(seed), tracks=long) for world in names for seed in range(seeds)]
    campaign = campaign_of(tmp_path, results)
    with ResultStore(tmp_path, writes=True) as store:
        store.add(*results)
    for world in names:
        write_json(sketch_file(tmp_path, world), {"format": 1, **sketch()})
    LivePage(campaign).write()
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert text.count('class="track') == tracks
    assert len(text) < 2_000_000
    assert ("data-s" in text.partition('<section id="maps"')[0]) == (seeds < 30)
    with (tmp_path / "results.csv").open(encoding="utf-8") as table:
        assert sum(1 for _ in table) == len(results) + 1


def test_on_a_phone_tables_scroll_in_their_boxes_and_names_break(tmp_path):
    results = [scored("a.b:f", "my_bays/1", seed, float(seed)) for seed in range(2)]
    campaign = campaign_of(tmp_path, [*results, failed("a.b:f", "my_bays/1", 2, EVIL)])
    text = page(campaign, {}, compare(campaign, campaign_of(tmp_path, results[:1])))
    assert text.count("<table") == text.count('<div class="card scroll"><table') >= 5
    assert "my_<wbr>bays/<wbr>1</td>" in text
    assert "a.<wbr>b:<wbr>f" in text


def test_a_live_page_is_written_again_after_five_seconds_or_a_hundred_times_what_it_took(monkeypatch, tmp_path):
    clock, written, live = [0.0], [], LivePage(campaign_of(tmp_path, RESULTS))
    seconds = iter((0.0625, 1.0, 0.0))

    def write(*, running):
        written.append((clock[0], running))
        clock[0] += next(seconds)

    monkeypatch.setattr(live, "write", write)
    monkeypatch.setattr("vrx_mj.campaign.page.time", SimpleNamespace(monotonic=lambda: clock[0]))
    for clock[0] in (100.0, 106.0, 106.3125, 207.0, 207.3125):
        live.refresh()
    live.refresh(one := failed("a:f", "bay", 99, "it sank"))
    assert live._results[one.cell].error == "it sank"
    assert written == [(100.0, True), (106.3125, True), (207.3125, True)]


@pytest.mark.parametrize(
    ("better", "ends"), [("higher", (_WORST_COLOR, _BEST_COLOR)), ("lower", (_BEST_COLOR, _WORST_COLOR))]
)
def test_colours_of_scores_go_from_the_worst_over_the_middle_to_the_best_in_straight_lines(better, ends):
    scores, stops = (10.0, 12.5, 15.0, 17.5, 20.0), np.array((ends[0], _MIDDLE_COLOR, ends[1]))
    expected = [stops[0], (stops[0] + stops[1]) / 2, stops[1], (stops[1] + stops[2]) / 2, stops[2]]
    for score, color in zip(scores, expected, strict=True):
        found = _color(score, scores, better).removeprefix("#")
        assert list(bytes.fromhex(found)) == pytest.approx(list(color), abs=0.5)
    assert _color(3.0, (3.0, 3.0), better) == ""


@pytest.mark.parametrize(
    ("spots", "frame"),
    [
        ([(5.0, 7.0)], (-10.0, -3.0, 20.0, 17.0)),  # 30 m x 20 m at least
        ([(0.0, 0.0), (100.0, 0.0)], (-9.0, -118.0 / 3.0, 109.0, 118.0 / 3.0)),  # 112 m and 6 m, half as much again
        ([(0.0, 0.0), (50.0, 100.0)], (-63.5, -9.0, 113.5, 109.0)),
        ([(0.0, 0.0), (1.0, 20.0)], (-20.8, -4.2, 21.8, 24.2)),
    ],
)
def test_a_frame_is_half_as_wide_again_as_high_round_its_places(spots, frame):
    assert _frame(spots) == pytest.approx(frame)


def test_a_track_has_thirty_points_at_most_and_its_last():
    for count, shown in ((29, 29), (30, 16), (59, 30), (60, 21), (400, 30)):
        line = [[float(i), 0.0] for i in range(count)]
        points = _track(scored("a:f", "w", 0, 1.0), line, ["b:f", "a:f"])["points"]
        assert (len(points), points[-1]) == (shown, line[-1])


def test_things_widen_a_map_within_forty_metres_of_what_matters():
    empty = {key: [] for key in sketch()} | {"boats": [{"x": 0.0, "y": 0.0}]}
    for x, wide in ((39.5, True), (40.0, False), (40.5, False)):
        west, _, east, _ = _view(empty | {"objects": [{"spot": [x, 0.0]}]}, [])
        assert (east - west > 31.0) is wide


def test_numbers_have_three_digits_and_names_may_break():
    assert [_number(value) for value in (None, math.nan, 1234.5, 0.12345)] == ["–", "–", "1.23e+03", "0.123"]
    assert _number(0.12345, 2) == "0.12"
    assert _breakable("a/b_c.d:<e>") == "a/<wbr>b_<wbr>c.<wbr>d:<wbr>&lt;e&gt;"


def test_shapes_of_a_map_are_about_their_place():
    assert SHAPES["cross"](2.0, 3.0, 0.5) == "M1.5 -2.5L2.5 -3.5M1.5 -3.5L2.5 -2.5"  # y of an SVG points down
    assert SHAPES["ahead"](2.0, 3.0, math.pi / 2, 4.0) == pytest.approx((2.0, 7.0))
    square = np.array(SHAPES["square"](2.0, 3.0, 0.5, 0.3)) - (2.0, 3.0)
    corner = math.sqrt(0.5) * np.exp(1j * (0.3 + np.pi / 4 * np.array([-3, -1, 1, 3])))
    assert square @ (1.0, 1.0j) == pytest.approx(corner)
    tip, *barbs = np.array(SHAPES["arrow"](2.0, 3.0, 0.3, 2.0)) - (2.0, 3.0)
    assert tip @ (1.0, 1.0j) == pytest.approx(2.0 * np.exp(0.3j))
    for barb, turn in zip(barbs, (2.55, -2.55), strict=True):
        assert barb @ (1.0, 1.0j) == pytest.approx(1.6 * np.exp(1j * (0.3 + turn)))
