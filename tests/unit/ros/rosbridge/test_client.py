"""Messages in fragments, and what those of all clients hold together."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import SMALL, Intake, Place
from vrx_mj.ros.rosbridge.server import _FRAGMENT_OVERHEAD, Fragments


def piece(identity, number, total, data):
    return {"op": "fragment", "id": identity, "num": number, "total": total, "data": data}


@given(st.lists(st.text("ab", max_size=5), min_size=1, max_size=4), st.randoms())
def test_a_message_is_whole_with_its_last_fragment_and_then_holds_nothing(parts, chance):
    intake = Intake(100_000)
    fragments = Fragments(intake, Place("127.0.0.1", list))
    order = list(enumerate(parts))
    chance.shuffle(order)
    for count, (number, data) in enumerate(order[:-1], 1):
        assert fragments.add(piece("m", number, len(parts), data)) is None
        assert intake.used == sum(len(data) + _FRAGMENT_OVERHEAD for _, data in order[:count])
    assert fragments.add(piece("m", order[-1][0], len(parts), order[-1][1])) == "".join(parts)
    assert intake.used == 0


def test_of_clients_that_hold_too_much_the_first_goes():
    ended, intake = [], Intake(3 * (SMALL + _FRAGMENT_OVERHEAD))
    first, second, third = (
        Fragments(intake, Place("127.0.0.1", lambda number=number: ended.append(number))) for number in range(3)
    )
    for one, name in itertools.product((first, second), "ab"):
        if not ended:
            one.add(piece(name, 0, 2, "x" * SMALL))
    assert ended == [0]
    third.add(piece("a", 0, 2, "x"))
    assert intake.used == 2 * (SMALL + _FRAGMENT_OVERHEAD) + 1 + _FRAGMENT_OVERHEAD
    for one in (first, second, third):
        one.end()
    assert intake.used == 0


def test_fragments_without_characters_are_bounded_too(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.rosbridge.server.MOST_INCOMING", 3 * _FRAGMENT_OVERHEAD)
    intake = Intake(100_000)
    fragments = Fragments(intake, Place("127.0.0.1", list))
    for number in range(3):
        for _ in range(2):  # one that comes twice counts once
            fragments.add(piece("m" if number else "n", number, 300, ""))
    assert intake.used == 3 * _FRAGMENT_OVERHEAD
    with pytest.raises(CommandError, match="more than 300 characters of incomplete"):
        fragments.add(piece("m", 5, 300, ""))
    assert intake.used == 0
