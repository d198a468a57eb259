"""The water of a recording: the sea's patch around the fleet, and wakes on it."""

from itertools import pairwise

import numpy as np
import pytest

import recorded_run
from vrx_mj.recording.motion_chunks import MovingChunks
from vrx_mj.recording.water_chunks import FADES, HORIZON, LASTS, OVER, SIDE, WAKE_RATE, Wake, sea_patch, sea_triangles

BOATS = np.array([[0.0, 20.0], [17.3, -10.0], [-17.3, -10.0]])


def inner(positions):
    return positions.reshape(SIDE, SIDE, 3)[1:-1, 1:-1]


@pytest.mark.parametrize("boats", [BOATS[:1], BOATS, BOATS * 8 + 100.0])
def test_patch_holds_every_boat_with_water_around(boats):
    positions, _ = sea_patch(recorded_run.sea_height, boats, 3.0)
    low, high = inner(positions)[0, 0, :2], inner(positions)[-1, -1, :2]
    assert (low < boats.min(axis=0) - 15.0).all()
    assert (high > boats.max(axis=0) + 15.0).all()


def test_vertices_keep_their_places_while_the_fleet_moves_a_little():
    before, _ = sea_patch(recorded_run.sea_height, BOATS, 0.0)
    after, _ = sea_patch(recorded_run.sea_height, BOATS + 0.4, 0.0)
    np.testing.assert_array_equal(before[:, :2], after[:, :2])


def test_fleet_that_moved_far_keeps_the_raster():
    before, _ = sea_patch(recorded_run.sea_height, BOATS, 0.0)
    after, _ = sea_patch(recorded_run.sea_height, BOATS + 100.0, 0.0)
    cell = inner(before)[0, 1, 0] - inner(before)[0, 0, 0]
    shift = (inner(after) - inner(before))[..., :2] / cell
    np.testing.assert_allclose(shift, np.round(shift), atol=1e-4)


def test_rim_lies_at_the_horizon_on_the_mean_level():
    positions, _ = sea_patch(recorded_run.sea_height, BOATS, 1.0)
    rim = positions.reshape(SIDE, SIDE, 3)[[0, -1]]
    assert (rim[..., 2] == 0.0).all()
    assert np.abs(rim[..., 1]).min() > HORIZON - 50.0


def test_slopes_toward_the_sun_are_lighter():
    """The sun stands in the north-east: a surface that falls toward east is lit."""
    _, lit = sea_patch(lambda x, y, t: -0.05 * x, np.zeros((1, 2)), 0.0)
    _, dark = sea_patch(lambda x, y, t: 0.05 * x, np.zeros((1, 2)), 0.0)
    middle = SIDE // 2 * SIDE + SIDE // 2
    assert (lit[middle] >> 16) & 255 > (dark[middle] >> 16) & 255


def test_triangles_face_up_and_cover_the_patch():
    positions, _ = sea_patch(lambda x, y, t: 0.0 * x, BOATS, 0.0)
    a, b, c = np.moveaxis(positions[sea_triangles()].astype(np.float64), 1, 0)
    twice_area = np.cross(b - a, c - a)[:, 2]
    assert (twice_area > 0).all()
    assert twice_area.sum() / 2 == pytest.approx((2 * HORIZON) ** 2, rel=1e-3)


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
