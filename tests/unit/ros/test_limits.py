"""What comes in from many connections, and who has to go where it is too much."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import SMALL, Intake, Place

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
