"""What is written into films, where and how large, and how large and how often they are drawn."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from trees import partial
from vrx_mj.errors import VideoError
from vrx_mj.recording.reader import Event
from vrx_mj.recording.video import Film, Shot, filming, looking
from vrx_mj.recording.video.filming import encoder_of, project, task_lines
from vrx_mj.recording.video.stage import view_of
from vrx_mj.tasks.referee import TaskStatus

UP = (0.0, 0.0, 1.0)


@pytest.fixture
def written(monkeypatch):
    """What is laid over a picture: text or texts, height of letters and phase, and where."""
    found = []

    def tile(text, color, size, phase):
        found.append([text, color, size, phase])
        return np.zeros((2 * size, 40, 4), np.uint8)

    def panel(lines, size):
        found.append([*lines, size])
        return np.zeros((30, 60, 4), np.uint8)

    monkeypatch.setattr(filming, "name_tile", tile)
    monkeypatch.setattr(filming, "_panel", panel)
    monkeypatch.setattr(filming, "lay", lambda _picture, _tile, column, row: found[-1].extend([column, row]))
    return found


@pytest.mark.parametrize(("height", "letters"), [(90, 9), (720, 19), (1080, 28)])
@pytest.mark.parametrize("place", [(100.0, 7.3, 0.0), (40.0, -5.1, 1.0), (249.9, 3.0, 0.0)])
def test_names_are_written_over_their_boats(two_seconds, written, monkeypatch, height, letters, place):
    film, picture = Film(two_seconds, Shot(), size=(64, 36), fps=10.0), np.zeros((height, 2 * height, 3), np.uint8)
    film._labels = [{"wamv1": "one"}]
    monkeypatch.setattr(film._footage, "places", lambda _: {"wamv1": np.array(place)})
    view = view_of(looking((0.0, 0.0, 2.0), (10.0, 0.0, 2.0), UP), 2 * height, height)
    film._name_boats(picture, view, film._footage.at(0.0))
    column, row, _ = project(view, np.add(place, (0.0, 0.0, 2.3)), 2 * height, height)
    ((text, color, size, phase, left, top),) = written
    assert (text, color, size) == ("one", film._colors["wamv1"], letters)
    assert left + 20 + phase / 4 == pytest.approx(column, abs=1 / 8 + 1e-9)
    assert top + 2 * size - 2 == pytest.approx(row, abs=0.5 + 1e-9)


@pytest.mark.parametrize("place", [(250.1, 3.0, 0.0), (-5.0, 0.0, 0.0)])
def test_names_of_boats_far_away_or_behind_are_not(two_seconds, written, monkeypatch, place):
    film = Film(two_seconds, Shot(), size=(64, 36), fps=10.0)
    monkeypatch.setattr(film._footage, "places", lambda _: {"wamv1": np.array(place)})
    view = view_of(looking((0.0, 0.0, 2.0), (10.0, 0.0, 2.0), UP), 160, 90)
    film._name_boats(np.zeros((90, 160, 3), np.uint8), view, film._footage.at(0.0))
    assert written == []


@pytest.mark.parametrize(("height", "letters"), [(100, 9), (720, 24)])
def test_what_has_just_happened_is_written_below_and_time_and_task_above(
    two_seconds, written, monkeypatch, height, letters
):
    times = (0.0, 1.0, 2.0, 6.5, 7.0, 7.5, 8.0)
    recorded = dataclasses.replace(two_seconds, events=tuple(Event(time, f"it {time:g}", "INFO") for time in times))
    film, picture = Film(recorded, Shot(speed=0.5), size=(64, 36), fps=10.0), np.zeros((height, 99, 3), np.uint8)
    edge = letters // 2
    for time, shown in (
        (0.5, []), (1.0, ["1.0 s  it 1"]), (2.99, ["1.0 s  it 1", "2.0 s  it 2"]), (3.0, ["2.0 s  it 2"]),
        (8.0, ["7.0 s  it 7", "7.5 s  it 7.5", "8.0 s  it 8"]),
    ):  # fmt: skip
        written.clear()
        film._write(picture, time)
        clock = [[f"made_up  {time:.1f} s  ×0.5", letters, edge, edge]]
        assert written == clock + [[*shown, letters, edge, height - edge - 30]] * bool(shown)
    status = TaskStatus(0.0, 0.0, 60.0, phase="running", elapsed=15.4, score=10.0, collisions=1)
    monkeypatch.setattr(film._footage, "status_at", lambda _: ("dock", status, "points"))
    written.clear()
    film._write(picture, 0.5)
    assert written[0][:-3] == ["made_up  0.5 s  ×0.5", *task_lines("dock", status, "points")]


@pytest.mark.parametrize(("count", "size"), [(1, 9), (3, 24)])
def test_lines_stand_on_a_dark_panel_with_round_corners(count, size):
    panel = filming._panel(("H" * 9,) * count, size).astype(int)
    step, edge = round(1.35 * size), size // 2
    assert len(panel) == count * step + edge
    assert panel.shape[1] == pytest.approx(filming._font_of(size).getlength("H" * 9) + 2 * edge, abs=1.0)
    assert (panel[0, 0] == (8, 22, 34, 0)).all()
    assert (panel[:, 1][len(panel) // 2] == (8, 22, 34, 150)).all()
    rows = np.flatnonzero((panel[..., 0] > 200).any(axis=1))
    assert len(np.flatnonzero(np.diff(rows) > 1)) == count - 1
    assert rows[0] + len(panel) - rows[-1] == pytest.approx(edge + step - 0.75 * size, abs=0.35 * size)
    assert (panel[..., :3][panel[..., 3] == 255] > 250).any()


@pytest.mark.parametrize(
    ("suffix", "size", "fps"), [(".mp4", (1280, 720), 25.0), (".WEBP", (800, 450), 12.5), (".gif", (640, 360), 12.5)]
)
def test_a_kind_of_video_has_a_size_and_a_rate_of_its_own(suffix, size, fps, monkeypatch):
    monkeypatch.setattr(filming, "find_spec", lambda _: object())
    assert encoder_of(Path(f"run{suffix}"))[1:] == (size, fps)


@pytest.mark.parametrize("side", [14, 15, 17, 4095, 4098])
def test_sides_of_pictures_are_even_and_within_their_range(two_seconds, side):
    for size in ((side, 64), (64, side)):
        with pytest.raises(VideoError, match=r": two even numbers of pixels from 16 to 4096 are needed$"):
            Film(two_seconds, Shot(size=size), size=(64, 36), fps=10.0)
    for size in ((16, 4096), (4096, 16)):
        assert Film(two_seconds, Shot(size=size), size=(64, 36), fps=10.0).size == size


@pytest.mark.parametrize("name", ["fps", "speed"])
def test_rates_of_films_may_be_at_the_ends_of_their_range(two_seconds, name):
    for value in (0.001, 1000.0):
        film = Film(two_seconds, Shot(begin=1.0, end=1.0, **{name: value}), size=(64, 36), fps=10.0)
        assert film.times == (1.0,)
    for value in (0.00099, 1000.1):
        with pytest.raises(VideoError, match=rf"^invalid {name} {value:g}: a number from 0.001 to 1000 is needed$"):
            Film(two_seconds, Shot(**{name: value}), size=(64, 36), fps=10.0)


def test_the_view_in_the_corner_is_drawn_four_times_a_second_of_the_video_in_a_frame(two_seconds, monkeypatch):
    for fps, speed, height in ((20.0, 2.0, 360), (10.0, 0.5, 1080), (3.0, 1.0, 36)):
        film, drawn = Film(two_seconds, Shot(fps=fps, speed=speed), size=(2 * height, height), fps=10.0), []

        def picture(time, eye, size, drawn=drawn):
            drawn.append((round(time, 9), size))
            return np.zeros((size[1], size[0], 3), np.uint8)

        monkeypatch.setattr(film, "_view_picture", picture)
        insets = [film._inset_at(time) for time in film.times]
        line, every = max(1, round(height / 360)), max(1, round(fps / 4))
        assert [time for time, _ in drawn] == pytest.approx(film.times[::every])
        width = 2 * round(0.34 * height)
        assert {size for _, size in drawn} == {(width, 2 * round(0.17 * height))}
        assert insets[0].shape == (2 * round(0.17 * height) + 2 * line, width + 2 * line, 3)
        inner = insets[0][line:-line, line:-line]
        assert not inner.any()
        assert insets[0].astype(int).sum() == (insets[0].size - inner.size) // 3 * (235 + 245 + 255)


def test_the_boat_that_a_task_scores_is_followed_or_the_one_that_is_asked_for(two_seconds):
    def followed(task, boat=None):
        (company,) = two_seconds.companies
        parameters = partial({"sea": {"level": 0.0}, "task": task, "boats": []})
        companies = (SimpleNamespace(files=company.files, world=SimpleNamespace(parameters=parameters)),)
        return filming._boat_to_follow(dataclasses.replace(two_seconds, companies=companies), boat)

    assert followed(None) == "wamv1"
    assert followed({"boat": "wamv2"}) == "wamv2"
    assert followed({"boat": "gone"}) == "wamv1"
    assert followed({"boat": "wamv2"}, "wamv3") == "wamv3"
    with pytest.raises(VideoError, match=r"has no boat to follow$"):
        filming._boat_to_follow(SimpleNamespace(boats={}, path="run.rrd"), None)
