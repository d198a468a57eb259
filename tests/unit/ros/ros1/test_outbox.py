"""What waits for a slow subscriber."""

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.ros.interface import Output, Sent
from vrx_mj.ros.limits import Backlog, Counts, TopicQueue

SIZES = st.lists(st.one_of(st.integers(0, 40), st.just(None)), max_size=60)


def drained(outbox):
    while (frame := outbox.pop()) is not None:
        yield frame


@given(SIZES)
def test_it_holds_the_newest_within_both_bounds_and_counts_the_rest(sizes):
    counts, expected, dropped = Counts(), deque(), 0
    outbox = Backlog(counts, most_messages=5, most_bytes=100)
    for number, size in enumerate(sizes):
        if size is None:
            assert outbox.pop() == (expected.popleft() if expected else None)
            continue
        expected.append(bytearray([number]) * size)
        outbox.push(expected[-1], size)
        while len(expected) > 5 or sum(map(len, expected)) > 100:
            expected.popleft()
            dropped += 1
        assert outbox.bytes == counts.waiting == sum(map(len, expected))
    assert outbox.dropped == counts.dropped == dropped
    assert list(drained(outbox)) == list(expected)
    assert counts.waiting == 0


def test_the_newest_stays_even_if_it_is_larger_than_all_that_is_allowed():
    outbox = Backlog(Counts(), most_messages=5, most_bytes=10)
    outbox.push(bytearray(4), 4)
    outbox.push(bytearray(99), 99)
    assert outbox.dropped == 1
    assert len(outbox.pop()) == 99


def test_where_all_together_hold_too_much_each_keeps_its_newest(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.limits.MOST_BYTES_OF_ALL", 10)
    counts = Counts()
    one, other = Backlog(counts, 5, 100), Backlog(counts, 5, 100)
    one.push(bytearray(6), 6)
    other.push(bytearray(3), 3)
    other.push(bytearray(3), 3)
    assert other.dropped == 1
    assert (len(one), len(other)) == (1, 1)
    one.forget(None)
    assert one.dropped == 0
    assert counts.waiting == 3


def test_of_each_topic_the_newest_wait_in_the_order_in_which_they_came():
    queue = TopicQueue(most=2)
    plain, other = (Output(name, "std_msgs/Int8", lambda: None) for name in ("/p", "/o"))
    assert queue.put([Sent(other, -1, 0.0)])
    for number in range(5):
        assert not queue.put([Sent(plain, number, 0.0)])
    assert [sent.message for sent in queue.take()] == [-1, 3, 4]
    assert queue.dropped == 3
    assert queue.take() == []
    assert queue.put([Sent(plain, 5, 0.0)])
