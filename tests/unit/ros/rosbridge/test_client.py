"""Messages in fragments, and what those of all clients hold together."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.ros.limits import SMALL, Intake, Place
from vrx_mj.ros.rosbridge.client import Fragments


def piece(identity, number, total, data):
    return {"op": "fragment", "id": identity, "num": number, "total": total, "data": data}


@given(st.lists(st.text("ab", max_size=5), min_size=1, max_size=4), st.randoms())
def test_a_message_is_whole_with_its_last_fragment_and_then_holds_nothing(parts, chance):
    intake = Intake(1000)
    fragments = Fragments(intake, Place("127.0.0.1", list))
    order = list(enumerate(parts))
    chance.shuffle(order)
    for count, (number, data) in enumerate(order[:-1], 1):
        assert fragments.add(piece("m", number, len(parts), data)) is None
        assert intake.used == sum(len(data) for _, data in order[:count])
    assert fragments.add(piece("m", order[-1][0], len(parts), order[-1][1])) == "".join(parts)
    assert intake.used == 0


def test_of_clients_that_hold_too_much_the_first_goes():
    ended, intake = [], Intake(3 * SMALL)
    first, second, third = (
        Fragments(intake, Place("127.0.0.1", lambda number=number: ended.append(number))) for number in range(3)
    )
    for one, name in itertools.product((first, second), "ab"):
        if not ended:
            one.add(piece(name, 0, 2, "x" * SMALL))
    assert ended == [0]
    third.add(piece("a", 0, 2, "x"))
    assert intake.used == 2 * SMALL + 1
    for one in (first, second, third):
        one.end()
    assert intake.used == 0


@pytest.mark.parametrize("count", [16, 17, 40])
def test_of_many_messages_that_have_begun_the_oldest_are_forgotten(count):
    intake = Intake(1000)
    fragments = Fragments(intake, Place("127.0.0.1", list))
    for number in range(count):
        fragments.add(piece(f"m{number}", 0, 2, "x"))
    assert intake.used == min(count, 16)
