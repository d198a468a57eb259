"""Values that no function takes, and calls with them."""

import contextlib
import decimal
import fractions
import math
import pathlib
import signal

import gymnasium
import numpy as np

from vrx_mj.errors import ConfigError, DivergedError, VrxError
from vrx_mj.rl import ActionError

JUNK = {
    "None": None,
    "list": [],
    "dict": {},
    "empty": "",
    "text": "x",
    "bytes": b"",
    "10**400": 10**400,
    "10**5000": 10**5000,
    "-1": -1,
    "0": 0,
    "1.5": 1.5,
    "nan": math.nan,
    "inf": math.inf,
    "1e308": 1e308,
    "True": True,
    "object": object(),
    "class": int,
    "function": lambda: None,
    "strings": ["a", "b"],
    "nested": [[1.0, [2.0]], 3.0],
    "matrix": np.zeros((2, 3)),
    "nans": np.full(6, np.nan),
    "huge": [1e308] * 6,
    "words": np.array(["a", "b"]),
    "objects": np.array([None, {}], object),
    "complex": 1j,
    "path": pathlib.Path("no/such/file"),
    "folder": pathlib.Path(),
    "long": "y" * 100_000,
    "nul": "a\0b",
    "surrogate": "\ud800",
    "lines": "a\nb",
    "set": {1, 2},
    "tuple of None": (None, None, None),
    "big array": np.array([10**400, 1], object),
    "no dimensions": np.array(1.5),
    "no items": np.zeros(0),
    "masked": np.ma.masked,
    "signalling": decimal.Decimal("sNaN"),
    "decimal": decimal.Decimal("1e999999"),
    "fraction": fractions.Fraction(10**400, 3),
    "moment": np.datetime64("2024-01-01"),
    "range": range(6),
}
NAMED = {
    "world": ("world", "World"), "fleet": ("fleet",), "target": ("path",), "source": ("path", "saved world"),
    "path": ("path", "file name", "recording", "state"), "first": ("path", "recording", "first"),
    "recording": ("path",), "second": ("path", "recording", "second"), "commands": ("command", "boat", "thruster"),
    "values": ("commands", "command"),
    "state": ("State",), "row": ("row",), "sensors": ("sensor",), "sensor": ("pinger", "shooter"),
    "name": ("name", "boat", "object", "light", "placard", "place"), "symbol": ("symbol",), "colors": ("colour",),
    "boat": ("recorded sensor",), "boats": ("boats", "usv_count"), "block": ("bytes",),
    "listener": ("attach",), "callback": ("callback",), "sim": ("simulation",),
    "problem": ("problem",),
    "pose": ("pose", "place"), "options": ("option",), "action": ("action",), "actions": ("action",),
    "steps": ("steps",), "left": ("command", "left"), "topic": ("message",), "content": ("message", "color_sequence"),
    "follow": ("boat",), "time": ("no state",), "seed": ("Seed", "seeds"), "rows": ("of shape",), "agent": ("boat",),

    "text": ("text",), "scene": ("scene", "MapScene"), "neighbours": ("neighbours",), "render_mode": ("render_mode",),
}  # fmt: skip
"""Words of which a message has one, for an argument that it does not call by its name."""
HANGS = 60.0
"""Processor time after which a call is ended [s]."""
CALLED = {"callback", "tell", "controller", "progress", "advance"}
"""Functions of the caller's own, whose errors are his."""
OURS = (VrxError, gymnasium.error.Error, ActionError)


class Junk:
    """Calls with junk, and what came of them."""

    def __init__(self):
        self.calls, self.wrong = 0, []
        self.every = 1
        """Of the kinds of junk each so-manieth is tried, others for other arguments: for calls that take long."""

    def try_all(self, label, call, known, mend=None):
        """Replace each argument of `call(**known)` in turn; `mend` is called after each."""
        call(**known)
        for number, name in enumerate(known):
            for kind, value in list(JUNK.items())[number % self.every :: self.every]:
                if name in CALLED and callable(value):
                    continue
                self.calls += 1
                try:
                    with guarded():
                        call(**{**known, name: value})
                except OURS as error:
                    if problem := _badly_said(name, error):
                        self.wrong.append(f"{label}({name}={kind}): {problem}")
                except BaseException as error:
                    self.wrong.append(f"{label}({name}={kind}): {type(error).__name__}: {str(error)[:160]}")
                if mend is not None:
                    mend()


@contextlib.contextmanager
def guarded():
    """End a call that would never end."""
    signal.setitimer(signal.ITIMER_PROF, HANGS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def hung(*_):
    raise TimeoutError(f"it still runs after {HANGS:g} s of processor time")


def _badly_said(name, error):
    text = str(error)
    if isinstance(error, DivergedError):
        return ""
    lines = text.split("\n")
    if len(text) > 1000 or not all(line and line.isprintable() for line in lines):
        return f"{len(text)} characters: {text[:160]!r}"
    if len(lines) > (len(error.problems) if isinstance(error, ConfigError) else 1):
        return f"{len(text)} characters: {text[:160]!r}"
    words = NAMED.get(name, (name,))
    return "" if any(word in text for word in (name, *words)) else f"does not name it: {text[:200]}"
