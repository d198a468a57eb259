"""Signals that end a process, and those that it ignores from the start."""

import contextlib
import signal
import sys
import threading
from types import SimpleNamespace

import pytest

from vrx_mj import signals
from vrx_mj.signals import check_interrupts, ended_by_signals

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has other signals")


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_work_as_ctrl_c_does(name):
    number = getattr(signal, name)
    before = signal.signal(number, signal.SIG_DFL)  # the tests may run under nohup
    try:
        with ended_by_signals() as came:
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(number)
            assert came == [number]
        assert signal.getsignal(number) is signal.SIG_DFL
    finally:
        signal.signal(number, before)


def test_an_interrupt_that_a_package_caught_is_raised_again():
    with ended_by_signals():
        check_interrupts()
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            check_interrupts()
    check_interrupts()


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        with ended_by_signals() as came:
            signal.raise_signal(signal.SIGHUP)
        assert (came, signal.getsignal(signal.SIGHUP)) == ([], signal.SIG_IGN)
    finally:
        signal.signal(signal.SIGHUP, before)


def test_another_thread_leaves_signals_alone():
    before, seen = signal.getsignal(signal.SIGTERM), []

    def work():
        with ended_by_signals():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


def test_a_handler_that_python_does_not_know_is_left_alone(monkeypatch):
    monkeypatch.setattr(signal, "getsignal", lambda _number: None)
    monkeypatch.setattr(signal, "signal", lambda *_: pytest.fail("it cannot be put back"))
    with ended_by_signals() as came:
        assert came == []


def test_once_the_interpreter_exits_calls_of_other_threads_end(monkeypatch):
    own, told = threading.get_ident(), []
    signals.check_exit()
    monkeypatch.setattr(signals, "_exiting", [own])
    signals.check_exit()

    def enter():
        try:
            with signals.delays_exit():
                told.append("inside")
        except SystemExit:
            told.append("ended")

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert told == ["ended"]
    assert signals._inside == set()


def test_an_exit_waits_for_what_is_inside_and_not_for_itself(monkeypatch):
    monkeypatch.setattr(signals, "_inside", set())
    with signals.delays_exit():
        with signals.delays_exit():
            assert signals._inside == {threading.get_ident()}
        assert signals._inside == {threading.get_ident()}
        assert not any(busy(threading.get_ident()) for busy in signals.BUSY[:1])
        assert signals.BUSY[0](-1)
    assert signals._inside == set()
    assert not signals.BUSY[0](-1)


@pytest.mark.parametrize("ends", [True, False])
def test_an_exit_waits_until_nothing_is_busy_for_30_s_at_most(monkeypatch, ends):
    clock = SimpleNamespace(now=0.0, naps=[])

    def sleep(seconds):
        clock.naps.append(seconds)
        clock.now += 1.0

    monkeypatch.setattr(signals, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=sleep))
    monkeypatch.setattr(signals, "_exiting", [])
    monkeypatch.setattr(signals, "BUSY", [lambda own: own == threading.get_ident() and not (ends and clock.now >= 7.0)])
    signals._end_other_threads()
    assert clock.naps == [0.001] * (7 if ends else 30)
    assert signals._exiting == [threading.get_ident()]
