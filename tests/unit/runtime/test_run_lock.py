"""Whose turn it is with a run that threads share."""

import os
import threading
import time

import pytest

from vrx_mj.errors import CommandError
from vrx_mj.runtime.run_lock import HOLDER, RunLock, advancing, with_run_lock

ELSEWHERE = "{} cannot be called while another thread advances the thing: call it afterwards, or from that thread"
WITHIN = "{} cannot be called while the run advances, as from a recorder: call it afterwards"


class Thing:
    """Something that advances until it is told to stop."""

    def __init__(self):
        self._run_lock = RunLock("thing")
        self.begun, self.end = threading.Event(), threading.Event()
        self.calls = []

    @advancing
    def advance(self, inside=lambda: None):
        self.begun.set()
        inside()
        assert self.end.wait(20.0)

    @with_run_lock
    def change(self, name="change", inside=lambda: None):
        self.calls.append(name)
        inside()
        self.calls.append(name)


def refused(call, *words):
    with pytest.raises(CommandError) as caught:
        call(*words)
    return str(caught.value)


@pytest.fixture
def thing():
    thing = Thing()
    yield thing
    thing.end.set()


def test_while_one_thread_advances_others_are_refused(thing):
    other = threading.Thread(target=thing.advance)
    other.start()
    assert thing.begun.wait(20.0)
    assert refused(thing.change) == ELSEWHERE.format("change")
    assert refused(thing.advance) == ELSEWHERE.format("advance")
    thing.end.set()
    other.join()
    thing.change()
    thing.advance()


def test_within_an_advance_its_own_thread_may_change_but_not_advance(thing):
    heard = []
    thing.end.set()
    refusals = (thing.advance,), (thing._run_lock.check_own, "spawn")
    thing.advance(lambda: (thing.change(), heard.extend(refused(*call) for call in refusals)))
    assert heard == [WITHIN.format("advance"), WITHIN.format("spawn")]
    assert len(thing.calls) == 2
    assert thing._run_lock.claim == {}


def test_within_a_short_call_its_own_thread_may_make_others_but_not_advance(thing):
    heard = []
    thing.change("outer", lambda: (thing.change("inner"), heard.append(refused(thing.advance))))
    assert heard == [WITHIN.format("advance")]
    assert thing.calls == ["outer", "inner", "inner", "outer"]
    assert thing._run_lock.claim == {}


@pytest.mark.parametrize("call", ["change", "advance"])
def test_short_calls_are_waited_for(thing, call):
    thing.end.set()
    inside, go_on = threading.Event(), threading.Event()
    first = threading.Thread(target=thing.change, args=("first", lambda: (inside.set(), go_on.wait(20.0))))
    second = threading.Thread(target=thing.change if call == "change" else thing.advance)
    first.start()
    assert inside.wait(20.0)
    second.start()
    time.sleep(0.05)
    assert second.is_alive()
    go_on.set()
    first.join()
    second.join()
    assert thing.calls == ["first", "first", "change", "change"][: 4 if call == "change" else 2]
    assert thing._run_lock.claim == {}


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_ends_the_turn(thing, error):
    def fail():
        raise error

    for call in (thing.advance, thing.change):
        with pytest.raises(error):
            call(inside=fail)
    assert thing._run_lock.claim == {}
    free = []
    other = threading.Thread(target=lambda: free.append(thing._run_lock.lock.acquire(blocking=False)))
    other.start()
    other.join()
    assert free == [True]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_does_not_wait_for_threads_that_it_has_not(thing):
    inside, go_on = threading.Event(), threading.Event()
    other = threading.Thread(target=thing.change, args=("other", lambda: (inside.set(), go_on.wait(20.0))))
    other.start()
    assert inside.wait(20.0)
    child = os.fork()
    if not child:
        thing.end.set()
        thing.change()
        thing.advance()
        os._exit(0 if thing._run_lock.claim == {} else 1)
    until = time.monotonic() + 20.0
    while (ended := os.waitpid(child, os.WNOHANG)) == (0, 0) and time.monotonic() < until:
        time.sleep(0.01)
    go_on.set()
    other.join()
    assert ended == (child, 0)


def test_what_was_advancing_in_another_thread_stays_refused_after_a_fork():
    """It stopped in the midst of a step."""
    turn = RunLock("thing")
    turn.claim[HOLDER] = threading.get_ident() + 1
    turn._forget()
    assert refused(turn.check, "advance") == ELSEWHERE.format("advance")
    turn.claim[HOLDER] *= -1
    turn._forget()
    turn.check("advance")
