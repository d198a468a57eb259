"""Wakes of a recording."""

from itertools import pairwise

import numpy as np
import pytest

import recorded_run
from vrx_mj.recording.motion_chunks import FADES, LASTS, OVER, WAKE_RATE, MovingChunks, Wake


def sail(wake, duration):
    """Leave points along a circle; the strips at the end."""
    strips = []
    for t in np.arange(0.0, duration + 1e-9, 1.0 / WAKE_RATE):
        strips = wake.strips(t, np.array([10.0 * np.cos(0.2 * t), 10.0 * np.sin(0.2 * t)]), recorded_run.sea_height)
    return strips


def test_every_point_of_a_wake_lies_on_the_sea_of_its_moment():
    points = np.concatenate(sail(Wake(), 30.0))
    assert points[:, 2] == pytest.approx(recorded_run.sea_height(points[:, 0], points[:, 1], 30.0) + OVER, abs=1e-5)


def test_a_wake_begins_at_the_boat_and_is_as_long_as_its_way_of_the_last_seconds():
    strips = sail(Wake(), 60.0)
    assert len(strips) == len(FADES)
    assert strips[0][0, :2] == pytest.approx([10.0 * np.cos(12.0), 10.0 * np.sin(12.0)], abs=1e-4)
    assert strips[-1][-1, :2] == pytest.approx([10.0 * np.cos(8.0), 10.0 * np.sin(8.0)], abs=1e-4)
    way = sum(np.linalg.norm(np.diff(strip[:, :2], axis=0), axis=1).sum() for strip in strips)
    assert way == pytest.approx(10.0 * 0.2 * LASTS, rel=0.01)


def test_the_colours_of_a_wake_follow_each_other_without_a_gap():
    strips = sail(Wake(), 30.0)
    for before, after in pairwise(strips):
        assert before[-1] == pytest.approx(after[0])


def test_a_recording_has_wakes_twice_a_second_and_none_without_a_sea():
    rows = np.array([recorded_run.row_at(t) for t in np.arange(0.0, 4.99, 0.05)])
    scene = recorded_run.scene()
    wakes = [chunk for chunk in MovingChunks(scene)(rows) if chunk.entity_path.startswith("/world/wakes/")]
    assert {chunk.entity_path: chunk.num_rows for chunk in wakes} == dict.fromkeys(
        (f"/world/wakes/wamv{i}" for i in (1, 2, 3)), 10
    )
    dry = type(scene)(**{**vars(scene), "sea_height": None})
    assert not [chunk for chunk in MovingChunks(dry)(rows) if chunk.entity_path.startswith("/world/wakes/")]
