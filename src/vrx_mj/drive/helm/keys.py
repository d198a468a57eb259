"""Keys by one set of names, whether they come from MuJoCo's window or from a terminal.

A name is the character that the key gives without shift, or a word: `up`, `space`, `backspace`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

__all__ = ["HELP", "OURS", "terminal_keys", "window_key"]

HELP = (
    ("drive", "arrow keys: more or less power, turn left or right; space or k: stop"),
    ("as in VRX", "i j l , u o m .  power and turn at once; h ;  engine angle"),
    ("steps", "q z  power and turn, w x  power, e c  turn, r v  angle: 10 % more, 10 % less"),
    ("boat", "1 ... 9: that boat, n (in a terminal also Tab): the next boat"),
    ("time", "p: pause, + -: twice or half the pace, backspace: reset"),
)
"""What the keys do, for people."""

OURS = frozenset("ijl,uom.kh;qzwxecrvnp+=-0123456789") | {"up", "down", "left", "right", "space", "backspace", "tab"}
"""Keys that do something here."""

_WINDOW = {
    32: "space", 258: "tab", 259: "backspace", 262: "right", 263: "left", 264: "down", 265: "up", 333: "-", 334: "+",
}  # fmt: skip
"""GLFW's numbers of keys that give no character; the others are numbered by ASCII, letters by capitals."""
_DIGIT_PAD = 320
"""GLFW's number of the zero of the number pad."""

_TERMINAL = {
    "\x1b[A": "up", "\x1b[B": "down", "\x1b[C": "right", "\x1b[D": "left",
    "\x1bOA": "up", "\x1bOB": "down", "\x1bOC": "right", "\x1bOD": "left",
    " ": "space", "\t": "tab", "\x7f": "backspace", "\b": "backspace",
}  # fmt: skip
"""What terminals send (ECMA-48, and VT100's application mode)."""
_SENT = re.compile(r"\x1b\[[0-?]*[ -/]*[@-~]|\x1bO.|.", re.DOTALL)


def window_key(code: int) -> str | None:
    """The name of a key of MuJoCo's window by GLFW's number; None for keys without one."""
    if code in _WINDOW:
        return _WINDOW[code]
    if _DIGIT_PAD <= code < _DIGIT_PAD + 10:
        return str(code - _DIGIT_PAD)
    return chr(code).lower() if ord("!") <= code <= ord("~") else None


def terminal_keys(sent: str) -> Iterator[str]:
    """The names of the keys in what a terminal sent; sequences without a name are left out."""
    for match in _SENT.finditer(sent):
        key = match.group()
        name = _TERMINAL.get(key, key.lower())
        if name in OURS:
            yield name
