"""How often a referee looks, and the numbers of a frame."""

import pytest

from vrx_mj.tasks.referee import FRAME_RATE, FrameLayout, frame_stride, has_started, score_text


@pytest.mark.parametrize("per_second", [1, 7, 19, 20, 21, 39, 40, 50, 60, 100, 101, 240, 250, 300, 400, 500, 1000])
def test_frames_come_at_the_least_rate_of_20_hz_or_more_that_divides_a_second_into_whole_steps(per_second):
    rates = [per_second // stride for stride in range(1, per_second + 1) if per_second % stride == 0]
    slowest = min((rate for rate in rates if rate >= FRAME_RATE), default=per_second)
    assert frame_stride(1.0 / per_second) == per_second // slowest


def test_a_timestep_that_does_not_divide_a_second_has_frames_at_20_hz_or_more():
    assert frame_stride(0.003) == 16  # 333 steps a second, 0.048 s
    assert frame_stride(0.07) == 1


def test_a_frame_has_poses_by_name_and_only_the_touches_that_were():
    layout = FrameLayout(("boat", "buoy"), ("dock", "terrain"))
    assert layout.width == 1 + 2 * 7 + 2
    frame = layout.frame([2.5, 1, 2, 3, 1, 0, 0, 0, 4, 5, 6, 0, 0, 0, 1, -1.0, 0.0])
    assert frame.time == 2.5
    assert (frame.poses["buoy"].x, frame.poses["buoy"].y, frame.poses["buoy"].z) == (4, 5, 6)
    assert frame.poses["buoy"].quaternion == (0, 0, 0, 1)
    assert frame.touches == {"terrain": 0.0}


@pytest.mark.parametrize(("phase", "started"), [("initial", 0), ("ready", 0), ("running", 1), ("finished", 1)])
def test_there_is_a_score_from_the_start_on(phase, started):
    assert has_started(phase) == started
    assert score_text(phase, 1.5, "m") == ("score 1.5 m" if started else "no score yet")
