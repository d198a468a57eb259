"""What comes in from many connections, and who has to go where it is too much."""

from collections import Counter, deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros.interface import Delivery, Output
from vrx_mj.ros.limits import (
    SMALL,
    ConnectionLimit,
    Counts,
    Intake,
    Mailbox,
    Outbox,
    Place,
    pieces,
)

HERE, THERE = "127.0.0.1", "10.0.0.7"


def places(ended, *hosts):
    """Connections that write their numbers into `ended` when they have to go."""
    return [Place(host, lambda number=number: ended.append(number)) for number, host in enumerate(hosts)]


def test_what_was_announced_does_not_count_and_what_came_does():
    intake = Intake(100)
    one, other = places([], HERE, HERE)
    intake.hold(one, 60)
    intake.hold(one, 40)
    intake.hold(other, 60)
    assert intake.used == 100
    intake.hold(one, 0)
    intake.hold(one, 0)
    assert intake.used == 60


def test_who_holds_more_than_a_little_for_longest_goes():
    ended = []
    intake = Intake(4 * SMALL)
    small, first, second, third = places(ended, HERE, HERE, HERE, HERE)
    intake.hold(small, SMALL)
    for place in (first, second):
        intake.hold(place, SMALL + 1)
    intake.hold(third, SMALL)
    assert ended == [1]
    assert intake.used == 3 * SMALL + 1


def test_the_host_that_holds_most_gives():
    ended = []
    intake = Intake(100)
    there, here, more = places(ended, THERE, HERE, HERE)
    intake.hold(there, 40)
    intake.hold(here, 30)
    intake.hold(more, 50)
    assert ended == [1]  # this machine holds 80: its first one goes


def test_who_holds_too_much_alone_is_told():
    (one,) = places([], HERE)
    with pytest.raises(CommandError) as caught:
        Intake(100).hold(one, 101)
    assert str(caught.value) == "more than 100 bytes of incomplete messages"


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 3 * SMALL)), max_size=60))
def test_never_more_is_held_than_there_may_be(doings):
    held = dict.fromkeys(range(6), 0)
    intake = Intake(4 * SMALL)
    every = [Place(HERE if number % 2 else THERE, lambda number=number: held.update({number: 0})) for number in held]
    for number, size in doings:
        held[number] = size
        try:
            intake.hold(every[number], size)
        except CommandError:
            held[number] = 0
        assert intake.used == sum(held.values()) <= 4 * SMALL


# What waits for a slow subscriber


SIZES = st.lists(st.one_of(st.integers(0, 40), st.just(None)), max_size=60)


def drained(outbox):
    while (frame := outbox.pop()) is not None:
        yield frame


@given(SIZES)
def test_it_holds_the_newest_within_both_bounds_and_counts_the_rest(sizes):
    counts, expected, filled = Counts(), deque(), []
    outbox = Outbox(counts, 5, lambda: filled.append(len(outbox)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vrx_mj.ros.limits.MOST_BYTES", 100)
        dropped = filled_and_drained(outbox, sizes, counts, expected)
    assert outbox.dropped == counts.dropped == dropped
    assert len(filled) == len(sizes) - sizes.count(None)
    assert min(filled, default=1) > 0
    assert list(drained(outbox)) == list(expected)
    assert counts.waiting == 0


def filled_and_drained(outbox, sizes, counts, expected):
    """What an outbox drops that takes items of these sizes, and gives one at each None."""
    dropped = 0
    for number, size in enumerate(sizes):
        if size is None:
            assert outbox.pop() == (expected.popleft() if expected else None)
            continue
        expected.append(bytearray([number]) * size)
        fits = outbox.has_room(size)
        outbox.push(expected[-1], size)
        assert fits == (len(expected) <= 5 and sum(map(len, expected)) <= 100)
        while len(expected) > 5 or sum(map(len, expected)) > 100:
            expected.popleft()
            dropped += 1
        assert outbox.bytes == counts.waiting == sum(map(len, expected))
    return dropped


def test_the_newest_stays_even_if_it_is_larger_than_all_that_is_allowed(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.limits.MOST_BYTES", 10)
    outbox = Outbox(Counts(), 5, list)
    assert outbox.has_room(99)
    outbox.push(bytearray(4), 4)
    outbox.push(bytearray(99), 99)
    assert outbox.dropped == 1
    assert len(outbox.pop()) == 99


def test_where_all_together_hold_too_much_each_keeps_its_newest(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.limits.MOST_BYTES_OF_ALL", 10)
    counts = Counts()
    one, other = Outbox(counts, 5, list), Outbox(counts, 5, list)
    one.push(bytearray(6), 6)
    other.push(bytearray(3), 3)
    other.push(bytearray(3), 3)
    assert other.dropped == 1
    assert (len(one), len(other)) == (1, 1)
    one.forget()
    assert one.dropped == 0
    assert counts.waiting == 3


def test_of_each_topic_the_newest_wait_in_the_order_in_which_they_came(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.limits.MOST_WAITING", 2)
    monkeypatch.setattr("vrx_mj.ros.limits._MOST_KEYS", 2)
    queue = Mailbox(lambda sent: sent.output.name)
    plain, other = (Output(name, "std_msgs/Int8", lambda: None) for name in ("/p", "/o"))
    assert queue.put([Delivery(other, -1, 0.0)])
    for number in range(5):
        assert not queue.put([Delivery(plain, number, 0.0)])
    assert [sent.message for sent in queue.take()] == [-1, 3, 4]
    assert queue.dropped == 3
    assert queue.take() == []
    queue.put([Delivery(Output(name, "std_msgs/Int8", lambda: None), 1, 0.0) for name in ("/a", "/b", "/c")])
    assert (len(queue.take()), queue.dropped) == (2, 4)
    assert queue.put([Delivery(plain, 5, 0.0)])


# What waits of several sources


def test_what_waits_is_counted_until_it_is_taken_or_forgotten():
    counts = Counts()
    outbox = Outbox(counts, 9, list)
    for source, size in (("a", 10), ("b", 200), ("a", 3000)):
        outbox.push(size, size, source)
    assert counts.waiting == 3210
    outbox.forget("a")
    assert counts.waiting == 200
    assert outbox.pop() == 200
    assert counts.waiting == 0
    assert outbox.pop() is None
    assert counts.dropped == 0


def test_of_a_topic_with_a_queue_the_oldest_goes():
    counts = Counts()
    outbox = Outbox(counts, 9, list)
    for size in (1, 2, 3):
        outbox.push(size, size, "a", most=2)
    outbox.push(50, 50, "b", most=2)
    assert counts.dropped == 1
    assert list(drained(outbox)) == [2, 3, 50]


def test_there_is_room_for_one_large_answer_and_none_beside_it(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.limits.MOST_BYTES_OF_ALL", 10)
    counts = Counts()
    one, other = Outbox(counts, 9, list), Outbox(counts, 9, list)
    one.push("123456", 6)
    assert other.has_room(20)
    other.push("large, but the first", 20)
    assert not one.has_room(1)
    assert counts.waiting == 26
    other.forget()
    assert one.has_room(4)
    assert not one.has_room(5)


@pytest.mark.parametrize("parts", [(), (b"",), (b"abcdefgh",), (b"a", b"bcdefg", b"h"), (b"abc", b"def", b"gh")])
def test_pieces_of_a_frame_are_the_frame(parts):
    assert b"".join(pieces(parts, 3)) == b"".join(parts)
    assert {len(piece) for piece in pieces(parts, 3)} <= {1, 2, 3}


# How many may connect, and who goes when there are too many


ELSEWHERE, ANYWHERE = "10.0.0.8", "10.0.0.9"


def entering(connection_limit, host, ended=None):
    """One more connection of a host, None where there is no room; `ended` gets its number when it has to go."""
    place = Place(host, lambda: ended.append(place) if ended is not None else None)
    return place if connection_limit.enter(place) else None


def settled(connection_limit, host):
    """Whether one more connection of a host comes into use."""
    place = Place(host, list)
    return connection_limit.enter(place) and (
        connection_limit.settle(place) or connection_limit.leave(place) is not None
    )


def test_other_hosts_leave_room_for_this_machine():
    connection_limit = ConnectionLimit(most=16)
    for host in (THERE, ELSEWHERE):
        assert [settled(connection_limit, host) for _ in range(5)] == [True] * 3 + [
            False
        ] * 2  # 7/8 of a quarter, rounded down
    assert [settled(connection_limit, ANYWHERE) for _ in range(2)] == [True, False]  # of a half
    assert [settled(connection_limit, HERE) for _ in range(8)] == [True] * 7 + [False]
    assert connection_limit.inside == {THERE: 3, ELSEWHERE: 3, ANYWHERE: 1, HERE: 7}


def test_those_in_use_leave_room_for_those_who_ask():
    connection_limit, ended = ConnectionLimit(most=16), []
    while settled(connection_limit, HERE):
        pass
    assert connection_limit.inside == {HERE: 14}
    waiting = [entering(connection_limit, HERE, ended) for _ in range(5)]
    assert ended == waiting[:3]
    assert connection_limit.inside == {HERE: 16}


def test_the_longest_waiting_one_of_the_host_makes_room():
    connection_limit, ended = ConnectionLimit(most=8), []
    first, second = (entering(connection_limit, THERE, ended) for _ in range(2))
    local = entering(connection_limit, HERE, ended)
    connection_limit.wait(first)  # it has said something
    third = entering(connection_limit, THERE, ended)
    assert ended == [second]
    other = [entering(connection_limit, ELSEWHERE, ended) for _ in range(2)]
    assert entering(connection_limit, ANYWHERE, ended) is not None
    assert ended == [second, first]  # half of the places are taken: of those who have most
    assert None not in (local, third, *other)


def test_none_that_is_in_use_goes():
    connection_limit, ended = ConnectionLimit(most=4), []
    places = [entering(connection_limit, HERE, ended) for _ in range(4)]
    assert [connection_limit.settle(place) for place in places] == [True, True, True, False]
    for _ in range(9):
        assert entering(connection_limit, HERE, ended) is not None
    assert not set(ended) & set(places[:3])
    assert not connection_limit.settle(places[3])  # it has gone


@given(st.lists(st.tuples(st.sampled_from(["enter", "leave", "settle", "wait"]), st.integers(0, 30)), max_size=120))
def test_it_counts_who_is_in(doings):
    connection_limit, inside, every = ConnectionLimit(most=12), set(), []
    for what, number in doings:
        if what == "enter":
            place = Place([HERE, THERE, ELSEWHERE][number % 3], lambda: inside.discard(every[-1]))
            place.end = lambda place=place: inside.discard(place)
            every.append(place)
            if connection_limit.enter(place):
                inside.add(place)
        elif every:
            place = every[number % len(every)]
            getattr(connection_limit, what)(place)
            if what == "leave":
                inside.discard(place)
        assert connection_limit.inside == Counter(place.host for place in inside)
        assert len(inside) <= 12
        assert connection_limit.inside[THERE] <= 3
    for place in inside:
        connection_limit.leave(place)
    assert not connection_limit.inside
