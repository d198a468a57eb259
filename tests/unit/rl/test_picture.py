"""Pictures in the terminal, and where their cameras stand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.frames import rotation
from vrx_mj.rl import picture


def test_two_pixels_are_one_character_over_the_picture_before(capsys):
    pixels = np.arange(4 * 3 * 3, dtype=np.uint8).reshape(4, 3, 3)
    picture.show(pixels)

    def cell(up, down):
        return "\x1b[38;2;{};{};{}m\x1b[48;2;{};{};{}m▀".format(*up, *down)

    rows = ["".join(map(cell, pixels[row], pixels[row + 1])) for row in (0, 2)]
    assert capsys.readouterr().out == f"\x1b[H{rows[0]}\x1b[0m\n{rows[1]}\x1b[0m\n"


@pytest.mark.parametrize(
    ("width", "height", "shown"), [(79, 5, 79), (80, 4, 80), (159, 4, 159), (160, 9, 80), (240, 12, 80)]
)
def test_wide_pictures_are_thinned_to_eighty_columns(capsys, width, height, shown):
    picture.show(np.zeros((height, width, 3), np.uint8))
    lines = capsys.readouterr().out.splitlines()
    step = width // shown
    assert [line.count("▀") for line in lines] == [shown] * ((math.ceil(height / step)) // 2)


class Camera:
    """Notes where it is asked to look from."""

    def __init__(self, monkeypatch):
        self.seen = []
        monkeypatch.setattr(picture.mujoco, "MjData", lambda _: SimpleNamespace(qpos=np.zeros(3)))
        monkeypatch.setattr(picture.mujoco, "mj_kinematics", lambda *_: self.seen.append("moved"))
        monkeypatch.setattr(picture, "drawing_model", lambda _: self.seen.append("made") or "model")
        monkeypatch.setattr(picture, "Cameras", lambda *_: self)
        self.set_sea, self.close = self.seen.append, lambda: self.seen.append("closed")

    def image(self, lens, data, place, axes, time):
        self.seen.append((place, axes, time, data.qpos.tolist(), lens.width, lens.height, lens.noise))
        return SimpleNamespace(rgb="picture")


def rows(*places, yaw=0.0):
    features = np.zeros((2, len(places), 7))
    features[1, :, :2] = places
    features[1, :, 3], features[1, :, 6] = math.cos(yaw / 2), math.sin(yaw / 2)
    return SimpleNamespace(features=features, qpos=np.arange(6.0).reshape(2, 3), time=np.array([0.0, 2.5]),
                           waves=lambda row: f"waves {row}")  # fmt: skip


@pytest.fixture
def drawn(monkeypatch):
    camera = Camera(monkeypatch)
    one = picture.Picture(SimpleNamespace(parameters=None), 64, 48)
    one.close()
    assert camera.seen == []
    return one, camera


def test_a_boat_is_seen_from_12_m_behind_and_6_m_above(drawn):
    one, camera = drawn
    for yaw in (0.0, 2.0):
        assert one.from_behind(rows((3.0, 4.0), yaw=yaw), 1) == "picture"
        place, axes, *rest = camera.seen[-1]
        assert place == pytest.approx([3.0 - 12.0 * math.cos(yaw), 4.0 - 12.0 * math.sin(yaw), 6.0])
        assert np.allclose(axes, rotation(0.0, 0.35, yaw))
        assert rest == [2.5, [3.0, 4.0, 5.0], 64, 48, 0.0]
    assert [what for what in camera.seen if isinstance(what, str)] == [
        "made", "moved", "waves 1", "moved", "waves 1",
    ]  # fmt: skip
    one.close()
    assert camera.seen[-1] == "closed"
    assert one.__getstate__()["_model"] is None


@pytest.mark.parametrize(
    ("present", "middle", "away"),
    [
        ([1, 1, 1], (5.0, 2.5), 14.0 + 0.55 * math.hypot(10.0, 5.0)),
        ([1, 0, 0], (0.0, 0.0), 14.0),
        ([0] * 3, (0.0, 0.0), 14.0),
    ],
)
def test_a_team_is_seen_from_the_south_so_far_that_all_are_in_sight(drawn, present, middle, away):
    one, camera = drawn
    one.from_south(rows((0.0, 0.0), (10.0, 2.0), (4.0, 5.0)), 1, np.array(present, bool))
    place, axes, *_ = camera.seen[-1]
    x, y = middle
    assert place == pytest.approx([x, y - away * math.cos(0.5), away * math.sin(0.5)])
    assert np.allclose(axes, rotation(0.0, 0.5, math.pi / 2))
