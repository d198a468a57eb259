"""Videos of a run: as many pictures as they should have, boats where they are, and the same every time."""

from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from vrx_mj.recording.video import Film, Shot, draw_video, write_video
from vrx_mj.recording.video.filming import project
from vrx_mj.recording.video.stage import Above, Footage, view_of

SIZE = (320, 180)
WORLD = {"name": "bay", "spawn": {"sensors": "none", "thrusters": "H"}, "sea": {"model": "pms", "gain": 0.1}}
FLEET = {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0]}, {"name": "b", "pose": [0, 12, 0.1, 0, 0, 0]}]}
AHEAD = {"left": 0.8, "right": 0.8}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Boat a goes, b stays."""
    path = tmp_path_factory.mktemp("run") / "run.rrd"
    sim = vrx_mj.Simulation(vrx_mj.compile_world(WORLD, fleet=FLEET))
    with vrx_mj.record(sim, path):
        for _ in range(30):
            sim.step({"a": AHEAD}, duration=0.1)
    return vrx_mj.read_record(path)


def pictures(recorded, times, **shot):
    film = Film(recorded, Shot(captions=False, **shot), size=SIZE, fps=5.0)
    try:
        return [film.picture(time) for time in times]
    finally:
        film.close()


@pytest.mark.slow
@pytest.mark.render
def test_boats_are_seen_where_they_are(recorded):
    """White hulls on dark water: from above each boat is the brightest spot near its place, and nowhere else is one."""
    (shown,) = pictures(recorded, [3.0], view="above")
    footage = Footage(recorded)
    above = Above([footage.path(boat) for boat in ("a", "b")], footage.level, SIZE[0] / SIZE[1])
    view, bright = view_of(above.eye(3.0), *SIZE), shown.astype(int).sum(axis=2) > 500
    rows, columns = np.nonzero(bright)
    near = np.zeros(len(rows), bool)
    for place in footage.places(footage.at(3.0)).values():
        column, row, _ = project(view, place, *SIZE)
        close = np.hypot(columns - column, rows - row) < 16.0
        assert close.sum() > 5
        near |= close
    assert near.mean() > 0.9


@pytest.mark.render
def test_the_same_moment_is_the_same_picture_and_another_is_not(recorded):
    first, last, again = pictures(recorded, [0.4, 2.6, 0.4])
    assert first.shape == (SIZE[1], SIZE[0], 3)
    assert np.array_equal(first, again)
    assert np.abs(first.astype(int) - last).mean() > 1.0
    assert np.array_equal(first, pictures(recorded, [0.4])[0])


@pytest.mark.render
@pytest.mark.parametrize("suffix", [".mp4", ".webp", ".gif"])
def test_a_video_has_its_pictures_and_its_size(recorded, tmp_path, suffix):
    path, told = tmp_path / f"run{suffix}", []
    shot = Shot(size=(160, 90), fps=5.0, begin=1.0, end=3.0)
    count = write_video(recorded, path, shot, progress=lambda *numbers: told.append(numbers))
    assert (count, told[-1]) == (11, (11, 11))
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    found = decoded(path)
    assert len(found) == 11
    assert {picture.shape for picture in found} == {(90, 160, 3)}
    assert np.abs(found[0].astype(int) - found[-1]).mean() > 1.0


def decoded(path: Path):
    """The pictures of a video."""
    if path.suffix == ".mp4":
        import av

        with av.open(str(path)) as container:
            return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    from PIL import Image, ImageSequence

    with Image.open(path) as image:
        return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(image)]


@pytest.mark.render
def test_the_command_says_what_it_has_drawn(recorded, tmp_path):
    video = tmp_path / "run.webp"
    said = draw_video(recorded.path, video, Shot(size=(64, 36), fps=2.0, view="chase", boat="b"))
    assert said == f"video: {video}, 7 pictures, {video.stat().st_size / 1e6:.1f} MB"
