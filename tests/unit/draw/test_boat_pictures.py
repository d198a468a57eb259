"""Pictures of verdicts: what is drawn where. How it looks is for a person to see."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fingerprints import FONTS, check, placed
from vrx_mj.draw import boat_pictures
from vrx_mj.draw.boat_pictures import _HULL, BAD_COLOR, GOOD_COLOR, draw_hull, draw_verdict
from vrx_mj.errors import VrxError
from vrx_mj.formats.parts.compliance import judge
from vrx_mj.formats.parts.read import load_parts

COMPONENTS = """
wamv_camera: [{name: front, x: 0.75, y: 0.25}, {name: back, x: -0.3}]
wamv_gps: [{name: gps, x: -0.85}]
wamv_pinger: [{name: pinger}]
"""
THRUSTERS = "engine: [{prefix: left, position: -2.373776 1.027135 0.318237}, {prefix: far, position: 40 0 0}]\n"


@pytest.fixture
def verdict(tmp_path):
    return verdict_of(tmp_path, COMPONENTS, THRUSTERS)


def verdict_of(folder, components, thrusters):
    (folder / "c.yaml").write_text(components, encoding="utf-8")
    (folder / "t.yaml").write_text(thrusters, encoding="utf-8")
    return judge(load_parts(folder / "c.yaml", "components"), load_parts(folder / "t.yaml", "thrusters"))


def dots(axes, color):
    """Places of the markers of a colour."""
    lines = [line for line in axes.lines if line.get_marker() in {"o", "X"} and line.get_markerfacecolor() == color]
    return {tuple(np.round(line.get_xydata()[0], 3).tolist()) for line in lines}


def test_dots_are_where_the_parts_are(verdict):
    top, side, front, _ = boat_pictures._figure(verdict).axes
    assert dots(top, GOOD_COLOR) == {(0.75, 0.25), (-0.85, 0.0), (-2.374, 1.027)}
    assert dots(side, GOOD_COLOR) == {(0.75, 1.5), (-0.85, 1.3), (-2.374, 0.318)}
    assert dots(front, GOOD_COLOR) == {(0.25, 1.5), (0.0, 1.3), (1.027, 0.318)}
    assert (-0.3, 0.0) in dots(top, BAD_COLOR)


def test_a_line_leads_to_the_nearest_legal_place(verdict):
    top = boat_pictures._figure(verdict).axes[0]
    lines = [line.get_xydata().tolist() for line in top.lines if line.get_linestyle() == "--"]
    assert [[-0.3, 0.0], [-0.65, 0.0]] in [np.round(line, 9).tolist() for line in lines]


def test_a_part_that_is_far_away_is_drawn_at_the_edge(verdict):
    top = boat_pictures._figure(verdict).axes[0]
    right = top.get_xlim()[1]
    assert right == pytest.approx(boat_pictures.BOAT[1][0] + boat_pictures.REACH)
    assert max(x for x, _ in dots(top, BAD_COLOR)) == pytest.approx(right)


def test_an_engine_is_drawn_where_a_thruster_is_mounted_and_nowhere_else(verdict):
    engines = [part.point for part in verdict.parts if part.kind == "thrusters" for _ in boat_pictures._ENGINE]
    drawn = [triangles.reshape(-1, 3).mean(axis=0) for triangles, _ in boat_pictures._engines(verdict)]
    assert len(drawn) == len(engines) == 4
    assert np.linalg.norm(np.subtract(drawn, engines), axis=1).max() < 1.0


def test_boxes_are_drawn_and_named(verdict):
    top, side, *_ = boat_pictures._figure(verdict).axes
    edges = {
        tuple(np.round([patch.get_x(), patch.get_y(), patch.get_width(), patch.get_height()], 9).tolist())
        for patch in top.patches
        if not patch.get_fill()
    }
    assert {(0.3, -0.5, 1.0, 1.0), (-1.15, -0.5, 0.5, 1.0), (-1.0, -0.5, 2.5, 1.0)} <= edges
    assert len(edges) == 7
    names = {text.get_text() for text in side.texts}
    assert {"for", "aft", "middle (room for 1)", "port_for (room for 1)\nstar_for (room for 1)"} <= names


def test_the_views_have_one_scale(verdict):
    figure = boat_pictures._figure(verdict)
    scales = []
    for axes in figure.axes[:3]:
        frame = axes.get_window_extent()
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        scales += [frame.width / abs(right - left), frame.height / abs(high - low)]
    assert scales == pytest.approx([scales[0]] * 6)


def test_parts_are_listed_with_what_they_break(verdict):
    listed = [text.get_text() for text in boat_pictures._figure(verdict).axes[3].texts]
    assert "1  front  (wamv_camera, in for)" in listed
    assert "4  pinger  (wamv_pinger, needs no box)" in listed
    assert "      outside every box; it misses component_compliance_aft by 0.35 m: 0.35 m too far forward" in listed


def test_numbers_of_parts_do_not_cover_each_other(verdict):
    figure = boat_pictures._figure(verdict)
    for axes in figure.axes[:3]:
        numbers = [text for text in axes.texts if text.get_text().replace(",", "").isdigit()]
        frames = [text.get_window_extent() for text in numbers]
        assert frames
        assert not [(a, b) for i, a in enumerate(frames) for b in frames[i + 1 :] if a.overlaps(b)]


@pytest.mark.parametrize("suffix", [".png", pytest.param(".pdf", marks=pytest.mark.slow), ".svg"])
def test_it_is_written_as_its_suffix_says(verdict, tmp_path, suffix):
    draw_verdict(verdict, tmp_path / f"boat{suffix}")
    start = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}[suffix]
    assert (tmp_path / f"boat{suffix}").read_bytes().startswith(start)


@pytest.mark.slow
def test_the_same_verdict_gives_the_same_bytes(verdict, tmp_path):
    for name in ("a.png", "b.png"):
        draw_verdict(verdict, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.slow
def test_no_parts_and_very_many(tmp_path):
    draw_verdict(verdict_of(tmp_path, "", ""), tmp_path / "none.png")
    rows = "".join(f"  - {{name: camera_{i}, x: {0.01 * i}, y: {0.3 - 0.01 * i}}}\n" for i in range(40))
    draw_verdict(verdict_of(tmp_path, f"wamv_camera:\n{rows}", ""), tmp_path / "many.png")


def test_no_other_kind_of_picture(verdict, tmp_path):
    with pytest.raises(VrxError) as caught:
        draw_verdict(verdict, tmp_path / "boat.gif")
    assert str(caught.value) == "invalid file name 'boat.gif' for a picture: it must end in .png, .pdf, .svg"


def test_the_boat_that_is_drawn_is_the_same_on_both_sides():
    assert sorted((name, light, (x, -y + 0.0, z)) for name, light, (x, y, z) in _HULL) == sorted(_HULL)


def test_pictures_of_boats_are_drawn_as_they_were(verdict, tmp_path, monkeypatch):
    check("draw", "verdict", rounding=FONTS, picture=placed(boat_pictures._figure(verdict)))
    rows = "".join(f"  - {{name: camera_{i}, x: {0.01 * i}, y: {0.3 - 0.01 * i}}}\n" for i in range(40))
    many = verdict_of(tmp_path, f"wamv_camera:\n{rows}", "")
    monkeypatch.setattr(boat_pictures, "draw_surfaces", lambda *_: None)  # the boat is seen in the other one
    check("draw", "verdict of many", rounding=FONTS, picture=placed(boat_pictures._figure(many)))
    for count in (0, 1, 5, 8, 11, 13):
        some = verdict_of(tmp_path, "wamv_camera:\n" + "".join(rows.splitlines(keepends=True)[:count]), "")
        figure = Figure(figsize=(5, 4))
        boat_pictures._list(figure.add_subplot(), some)
        check("draw", f"list of {count}", rounding=FONTS, picture=placed(figure))
    monkeypatch.undo()
    figures = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda figure, *_, **__: figures.append(figure))
    corners = np.random.default_rng(3).normal(size=(20, 3, 3))
    draw_hull(corners, (0.1, 0.2, 0.3), [(-1.0, 0.5, -0.2), (-1.0, -0.5, -0.2)], tmp_path / "hull.png")
    check("draw", "hull", rounding=FONTS, picture=placed(*figures))
