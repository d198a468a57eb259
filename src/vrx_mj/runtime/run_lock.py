"""Threads that share a run: one after the other, and none changes what another advances.

The compiled loop runs without Python's lock, on memory that a second call would move under it. Whose turn it is, is
in a dictionary, since `setdefault` is one step for all threads, in 50 ns, and leaves nothing behind when Ctrl-C comes.

A daemon thread may still advance a run when the interpreter exits. It is ended before the memory of the run is freed.
"""

import functools
import os
import threading
import weakref
from collections.abc import Callable
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from vrx_mj.errors import CommandError
from vrx_mj.signals import BUSY, check_exit

_P = ParamSpec("_P")
_R = TypeVar("_R")

HOLDER = "holder"
"""Key of `RunLock.claim`."""
_ALL_LOCKS: "weakref.WeakSet[RunLock]" = weakref.WeakSet()
"""All locks of the process."""


class RunLock:
    """Lock of a run: which thread may use it now."""

    __slots__ = ("__weakref__", "boats_lock", "claim", "lock", "what")

    def __init__(self, what: str) -> None:
        """Start without a holder; `what` is shared, as messages name it."""
        self.what = what
        self.claim: dict[str, int] = {}
        """Under `HOLDER` the thread that advances, as `threading.get_ident` numbers it, or minus the thread that does
        something short; the caller that put it there takes it away."""
        self._renew()
        _ALL_LOCKS.add(self)

    def check(self, call: str) -> None:
        """Refuse a call while another thread advances.

        Raises:
            CommandError: one does.
            SystemExit: the program exits in another thread.
        """
        check_exit()
        holder = self.claim.get(HOLDER, 0)
        if holder > 0 and holder != threading.get_ident():
            raise CommandError(
                f"{call} cannot be called while another thread advances the {self.what}: call it afterwards, or from "
                "that thread"
            )

    def check_own(self, call: str) -> None:
        """Refuse a call while this thread advances.

        Raises:
            CommandError: it does.
        """
        if self.claim.get(HOLDER) == threading.get_ident():
            raise _within(call)

    def take(self, call: str, mark: int) -> None:
        """Take the lock, after the short calls of other threads; CommandError if one advances, or this one has it."""
        while (holder := self.claim.setdefault(HOLDER, mark)) is not mark:
            self.check(call)
            if abs(holder) == threading.get_ident():
                raise _within(call)
            with self.lock:  # until the short call is over
                pass

    def _renew(self) -> None:
        self.lock = threading.RLock()
        """Held for a short call."""
        self.boats_lock = threading.RLock()
        """Held, inside of `lock`, while boats come or go, and by callers that look them up."""

    def _forget(self) -> None:
        """In a forked process: other threads are not there, and what they were about to do is half done."""
        self._renew()
        if self.claim.get(HOLDER, 0) < 0 and self.claim[HOLDER] != -threading.get_ident():
            del self.claim[HOLDER]


def _within(call: str) -> CommandError:
    return CommandError(f"{call} cannot be called while the run advances, as from a recorder: call it afterwards")


def _forget_all() -> None:
    for lock in list(_ALL_LOCKS):
        lock._forget()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_all)

BUSY.append(lambda own: any(abs(lock.claim.get(HOLDER, own)) != own for lock in list(_ALL_LOCKS)))


class _HasRunLock(Protocol):
    _run_lock: RunLock


_S = TypeVar("_S", bound=_HasRunLock)


def with_run_lock(method: Callable[Concatenate[_S, _P], _R]) -> Callable[Concatenate[_S, _P], _R]:
    """A method that waits for short calls of other threads, and is refused while one of them advances."""

    @functools.wraps(method)
    def in_its_turn(self: _S, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        run_lock, mark = self._run_lock, -threading.get_ident()
        run_lock.check(method.__name__)
        with run_lock.lock:
            try:
                if run_lock.claim.setdefault(HOLDER, mark) is not mark:
                    run_lock.check(method.__name__)  # else it is within a call of its own thread
                check_exit()  # which waits for the claim
                return method(self, *args, **kwargs)
            finally:
                if run_lock.claim and run_lock.claim[HOLDER] is mark:
                    del run_lock.claim[HOLDER]

    return in_its_turn  # type: ignore[return-value]  # which names its first argument


def advancing(method: Callable[Concatenate[_S, _P], _R]) -> Callable[Concatenate[_S, _P], _R]:
    """A method that advances: it waits for short calls of other threads, and all others are refused meanwhile."""

    @functools.wraps(method)
    def in_its_turn(self: _S, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        claim, mark = self._run_lock.claim, threading.get_ident()
        try:
            self._run_lock.take(method.__name__, mark)
            return method(self, *args, **kwargs)
        finally:  # with no call, in which Ctrl-C could come first
            if claim and claim[HOLDER] is mark:
                del claim[HOLDER]

    return in_its_turn  # type: ignore[return-value]  # as there
