"""Rows for recorders: each gets those of its own rate, whatever the others want and whenever they are handed over."""

import numpy as np
import pytest

from vrx_mj.errors import CommandError
from vrx_mj.runtime.loop import COUNTDOWN, FILLED, STRIDE
from vrx_mj.runtime.subscriptions import Sampler


class Recorder:
    def __init__(self):
        self.steps = []

    def rows(self, block):
        self.steps += block[:, 0].astype(int).tolist()


def run(sampler, steps, *, drained=()):
    """Fill the buffer as the loop does: a row at each multiple of the stride, the step's number in it."""
    for step in range(steps):
        if sampler.table[COUNTDOWN] == 0:
            sampler.table[COUNTDOWN] = sampler.table[STRIDE]
            sampler.buffer[sampler.table[FILLED]] = step
            sampler.table[FILLED] += 1
        sampler.table[COUNTDOWN] -= 1
        if step in drained:
            sampler.drain()
    sampler.drain()


@pytest.mark.parametrize("drained", [(), (3, 4, 17, 55), range(100)])
def test_every_recorder_gets_rows_at_its_own_rate(drained):
    sampler, fast, slow = Sampler(2, 0.01), Recorder(), Recorder()
    sampler.add(fast, 25.0)
    sampler.add(slow, 100.0 / 6.0)
    assert sampler.table[STRIDE] == 2  # every 4 and every 6 steps: the loop need not write each of them
    run(sampler, 100, drained=drained)
    assert fast.steps == list(range(0, 100, 4))
    assert slow.steps == list(range(0, 100, 6))


def test_who_ends_gets_no_more_and_the_others_begin_anew():
    sampler, one, other = Sampler(2, 0.01), Recorder(), Recorder()
    sampler.add(one, 10.0)
    sampler.add(other, 20.0)
    run(sampler, 20)
    sampler.remove(one)
    run(sampler, 10)
    assert one.steps == [0, 10]
    assert other.steps == [0, 5, 10, 15, 0, 5]
    assert sampler.listeners == (other,)


def test_without_recorders_nothing_is_kept():
    sampler = Sampler(2, 0.01)
    assert len(sampler.buffer) == 0
    sampler.check_free("reset")
    sampler.add(Recorder(), 20.0)
    assert sampler.buffer.shape[1] == 2
    sampler.resize(5)
    assert sampler.buffer.shape[1] == 5
    with pytest.raises(CommandError):
        sampler.check_free("reset")


def test_a_rate_above_that_of_the_steps_is_every_step():
    sampler, recorder = Sampler(1, 0.01), Recorder()
    sampler.add(recorder, 1e6)
    run(sampler, 3)
    assert recorder.steps == [0, 1, 2]
    assert np.all(sampler.table[[STRIDE, FILLED]] == (1, 0))
