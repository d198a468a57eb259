"""What waits for a slow subscriber."""

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.ros.limits import Budget, Outbox

SIZES = st.lists(st.one_of(st.integers(0, 40), st.just(None)), max_size=60)


def drained(outbox):
    while (frame := outbox.pop()) is not None:
        yield frame


@given(SIZES)
def test_it_holds_the_newest_within_both_bounds_and_counts_the_rest(sizes):
    budget, expected, dropped = Budget(), deque(), 0
    outbox = Outbox(budget, most_messages=5, most_bytes=100)
    for number, size in enumerate(sizes):
        if size is None:
            assert outbox.pop() == (expected.popleft() if expected else None)
            continue
        expected.append(bytearray([number]) * size)
        outbox.push(expected[-1])
        while len(expected) > 5 or sum(map(len, expected)) > 100:
            expected.popleft()
            dropped += 1
        assert outbox.bytes == budget.used == sum(map(len, expected))
    assert outbox.dropped == dropped
    assert list(drained(outbox)) == list(expected)
    assert budget.used == 0


def test_the_newest_stays_even_if_it_is_larger_than_all_that_is_allowed():
    outbox = Outbox(Budget(), most_bytes=10)
    outbox.push(bytearray(4))
    assert outbox.push(bytearray(99)) == 1
    assert len(outbox.pop()) == 99


def test_where_all_together_hold_too_much_each_keeps_its_newest():
    budget = Budget(10)
    one, other = Outbox(budget), Outbox(budget)
    one.push(bytearray(6))
    other.push(bytearray(3))
    assert other.push(bytearray(3)) == 1
    assert (len(one), len(other)) == (1, 1)
    one.clear()
    assert one.dropped == 0
    assert budget.used == 3
