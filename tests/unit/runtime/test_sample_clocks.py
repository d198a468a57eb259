"""Clocks: rates kept on average, and what they hold."""

import numpy as np
import pytest

from vrx_mj.errors import StateError
from vrx_mj.runtime.timing import SampleClocks

QPOS, QVEL = np.arange(7.0), np.arange(6.0)


def run(rate, timestep, steps, marks=()):
    """(index, time) of every moment that a clock catches in a run from time 0."""
    moments, time, caught = SampleClocks(7, 6, marks), 0.0, []
    moments.start(rate, QPOS, QVEL, 0.0)
    for _ in range(steps):
        moments.latch_due(QPOS, QVEL, time)
        now = moments.last(rate)[0]
        if not caught or now.index != caught[-1][0]:
            caught.append((now.index, now.time))
        time += timestep
    return caught


@pytest.mark.parametrize(("rate", "timestep"), [(1.0, 0.01), (7.0, 0.004), (15.0, 0.007), (30.0, 0.01), (100.0, 0.004)])
def test_a_rate_is_kept_without_drift(rate, timestep):
    """Over 100 s every second has its number of moments, to one; each comes at the first step at or after k / rate."""
    caught = run(rate, timestep, round(100.0 / timestep))
    assert [index for index, _ in caught] == list(range(len(caught)))
    times = np.array([time for _, time in caught])
    late = times - np.arange(len(caught)) / rate
    assert late.min() > -1e-6
    assert late.max() < timestep
    assert len(caught) == round(100.0 * rate)


def test_15_a_second_at_steps_of_10_ms_is_15_in_every_second():
    times = [time for _, time in run(15.0, 0.01, 10_000)]
    assert np.histogram(np.add(times, 1e-6), bins=np.arange(101.0))[0].tolist() == [15] * 100


def test_above_the_steps_rate_there_is_one_at_every_step():
    caught = run(1000.0, 0.01, 300)
    assert [index for index, _ in caught] == list(range(0, 3000, 10))


def test_a_clock_starts_with_the_present_moment_and_has_none_before_it():
    moments = SampleClocks(7, 6, (5.0,))
    assert not moments.runs(10.0)
    moments.start(10.0, QPOS, QVEL, 0.37)
    now, before = moments.last(10.0)
    assert (now.index, now.time, before) == (3, 0.37, None)
    assert (now.qpos.tolist(), now.qvel.tolist(), now.device_state.tolist()) == (QPOS.tolist(), QVEL.tolist(), [5.0])


def test_a_clock_keeps_the_moment_before_the_last():
    moments = SampleClocks(7, 6, ())
    moments.start(10.0, QPOS, QVEL, 0.0)
    for k in range(1, 4):
        moments.latch_due(QPOS + k, QVEL - k, k / 10.0)
    now, before = moments.last(10.0)
    assert (now.index, now.time, before.time) == (3, 0.3, 0.2)
    assert (now.qpos.tolist(), before.qpos.tolist()) == ((QPOS + 3).tolist(), (QPOS + 2).tolist())
    assert (now.qvel.tolist(), before.qvel.tolist()) == ((QVEL - 3).tolist(), (QVEL - 2).tolist())


def test_what_was_moved_by_hand_is_caught_again_at_this_very_time_only():
    moments = SampleClocks(7, 6, ())
    moments.start(10.0, QPOS, QVEL, 0.0)
    moments.start(15.0, QPOS, QVEL, 0.0)
    moments.latch_due(QPOS + 1, QVEL, 0.1)
    moments.renew(QPOS + 2, QVEL, 0.1)
    assert moments.last(10.0)[0].qpos[0] == 2.0
    assert moments.last(15.0)[0].qpos[0] == 2.0
    moments.renew(QPOS + 3, QVEL, 0.12)
    assert moments.last(10.0)[0].qpos[0] == 2.0
    assert moments.last(10.0)[1].qpos[0] == 0.0


def test_packed_moments_are_read_back():
    moments = SampleClocks(7, 6, (1.0, 2.0))
    moments.start(10.0, QPOS, QVEL, 0.0)
    moments.start(15.0, QPOS, QVEL, 0.05)
    moments.latch_due(QPOS + 1, QVEL, 0.1)
    moments.device_state[1] = 7.0
    twin = SampleClocks(7, 6, (0.0, 0.0))
    twin.check(moments.pack())
    twin.unpack(moments.pack())
    assert twin.pack() == moments.pack()
    assert twin.device_state.tolist() == [1.0, 7.0]
    assert twin.last(15.0)[1].time == 0.05
    moments.reset()
    assert moments.pack() == SampleClocks(7, 6, (1.0, 2.0)).pack()


@pytest.mark.parametrize(
    "damage", [lambda block: block[:-1], lambda block: block + b"x", lambda block: b"", lambda block: b"\xff" * 16]
)
def test_bytes_that_are_no_moments_are_refused(damage):
    moments = SampleClocks(7, 6, (1.0,))
    moments.start(10.0, QPOS, QVEL, 0.0)
    block = damage(moments.pack())
    with pytest.raises(StateError, match=rf"^the state has {len(block)} bytes of sensor times instead of \d+$"):
        moments.check(block)


@pytest.mark.parametrize(("rate", "timestep"), [(100.0, 0.001), (10.0, 0.004), (15.0, 0.01)])
def test_after_hours_no_moment_comes_a_step_late(rate, timestep):
    """Time is a sum of rounded steps: after two hours it is off by more than a millionth of an interval."""
    steps = 7_200 * round(1 / timestep)
    time = float(np.cumsum(np.full(steps, timestep))[-1])
    moments = SampleClocks(7, 6, ())
    moments.start(rate, QPOS, QVEL, time)
    assert moments.last(rate)[0].index == 7_200 * rate
