"""Values that are out of place nearly everywhere."""

import random
from typing import Any

BAIT = "bait"
"""Folder beside that of the input; nothing in it may be opened."""
NUMBERS = (
    0, -1, 1, 2, 3, 7, 255, 65_536, 1_000_000, -(2**31), 2**31 - 1, 2**31, 2**32, 2**53 + 1, 2**63, -(2**63) - 1,
    10**30, 10**400, 0.5, -0.0, 1e-9, -1e-9, 5e-324, 1e9, -1e9, 1e30, 1e150, 1e308, -1e308, float("nan"),
    float("inf"), float("-inf"), 0.1, 90, 180, 3.141592653589793,
)  # fmt: skip
TEXTS = (
    "", " ", "a", "0", "-1", "nan", "inf", "1e999", "true", "null", "~", "none", "x y", "a/b", "a\nb", "\t", "\0",
    "\x7f", "é", "船", "\u202e", "\ud7ff", "\ufeff", "'", '"', "<", "&amp;", "]]>", "%s", "{}", "{{ 7 * 7 }}",
    "{% for %}", "${1/0}", "$(find x)", "$(env HOME)", "${[1]*10**9}", ".", "..", "/", "\\", "C:\\x", "/etc/passwd",
    "../bait/secret.obj", "../bait/secret.yaml", "../../../../etc/passwd", "file:///etc/passwd",
    "package://../../etc/passwd", "http://127.0.0.1:1/x", "a" * 300, "b" * 70_000, "wamv", "wamv1", "__class__",
    "ocean", "X X\nXXX", "mb_marker_buoy_red", "world", "1 2 3", "0 0 0 0 0 0",
)  # fmt: skip


def number(chance: random.Random) -> Any:
    """A number, often extreme."""
    return chance.choice(NUMBERS) if chance.random() < 0.8 else chance.uniform(-1000, 1000)


def value(chance: random.Random) -> Any:
    """A value of any kind."""
    draw = chance.random()
    if draw < 0.4:
        return number(chance)
    if draw < 0.7:
        return chance.choice(TEXTS)
    return chance.choice([
        None, True, False, [], {}, [[]], [None], {"": None}, {"name": 1}, [0] * 6, ["a", "b"], [1e308] * 3,
        {"x": {"y": {}}}, [[0, 0]], [{}], [0] * 1000, deep(chance.choice([5, 50, 150]), chance), list(range(4)),
    ])  # fmt: skip


def changed_number(old: float, chance: random.Random) -> Any:
    """A number near another one, or of its size."""
    try:
        return chance.choice(
            [old + 1, old - 1, -old, old * 2, old * 1000, old / 1000, old + 0.5, old * 1e30, int(old), old * 10]
        )
    except (OverflowError, ValueError):
        return 0


def deep(levels: int, chance: random.Random) -> Any:
    """Lists or mappings inside each other."""
    tree: Any = 0
    nested = chance.random() < 0.5
    for _ in range(levels):
        tree = [tree] if nested else {"a": tree}
    return tree


def shown_number(chance: random.Random) -> str:
    """A number as text, sometimes none."""
    drawn = number(chance)
    if chance.random() < 0.1:
        return chance.choice(("", "x", "1/2/3", "1//1", "0x10", "1e", "--1"))
    return f"{drawn:.9g}" if isinstance(drawn, float) else str(drawn) if abs(drawn) < 10**40 else "9" * 400
