"""How many may connect, and who goes when there are too many."""

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.ros.limits import ConnectionLimit, Place

HERE, THERE, ELSEWHERE, ANYWHERE = "127.0.0.1", "10.0.0.7", "10.0.0.8", "10.0.0.9"


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
