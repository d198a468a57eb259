"""Which topic somebody means who publishes on one that has no subscriber: the nearest of those that have one here.

Names are compared segment by segment. A segment may be misspelt, missing or too many, and the namespace may be that of
no boat; each costs something, and the cheapest topic is meant if it costs little enough.
"""

from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from itertools import accumulate
from typing import TYPE_CHECKING

from vrx_mj.errors import nearest

if TYPE_CHECKING:  # it needs the extra ros1, and `vrx-mj doctor` does not
    from vrx_mj.ros.offer import Input, Table

__all__ = ["TopicHints", "meant_topic"]

KNOWN = ("/thrusters/", "/cmd_vel", "/shooters/", "/set_pinger_position", "/shuffle", "/swarm/", "/vrx/")
"""What a topic has in it that is meant for the simulation, however far from its topics it is."""
MOST_HINTS = 4096

MOST = 0.9
"""A topic that costs more is not meant."""
SEGMENT = 0.4
"""Cost of a segment that is missing or too many."""
NAMESPACE = 0.4
"""Cost of a namespace that no boat has, at most."""
OTHER_BOAT = 0.6
"""Cost of the namespace of another boat."""
WORDS = 0.2
"""Cost of the same words in another order."""
SOME_WORDS = 0.4
"""Cost of some of the words, if the types agree or are not known."""
NEVER = 2.0
UNLIKE = 0.5
"""Segments that differ by a larger share of their letters do not mean the same."""
OTHER_TYPE = 0.3
"""Cost of another type of message."""
LONGEST = 200
"""Characters of a topic that is compared."""
MOST_SEGMENTS = 8
UNKNOWN_TYPE = "*"


class TopicHints:
    """What those may mean who publish without a subscriber; each topic is looked at once for a table."""

    def __init__(self) -> None:
        self._table: Table | None = None
        self._hints: dict[tuple[str, str], str] = {}

    def __call__(self, topic: str, type_name: str, table: "Table", boats: Sequence[str]) -> str:
        """A hint for people; empty for a topic that has nothing to do with the simulation."""
        if self._table is not table or len(self._hints) > MOST_HINTS:
            self._table, self._hints = table, {}
        key = (topic, type_name)
        if key not in self._hints:
            self._hints[key] = _hint(topic, type_name, table.inputs, boats)
        return self._hints[key]


def _hint(topic: str, type_name: str, inputs: "Mapping[str, Input]", boats: Sequence[str]) -> str:
    concerns = any(part in topic for part in KNOWN)
    meant = meant_topic(topic, type_name, inputs, boats)
    if meant is None and concerns:
        tails = (topic.split("/", 2)[-1], topic.rpartition("/")[2])
        same = (f"/{boat}/{tail}" for tail in tails for boat in boats)
        meant = next((name for name in same if name in inputs), None) or nearest(topic, inputs)
    if meant is not None:
        return f"did you mean {meant}?"
    begin = f"topics of boats begin with /{boats[0]}/" if boats else "there is no boat now"
    return begin if concerns else ""


def meant_topic(topic: str, type_name: str, inputs: "Mapping[str, Input]", boats: Collection[str]) -> str | None:
    """The topic among `inputs` that is most likely meant by `topic`; None if none is near.

    `type_name` is the type of its messages, `*` if that is not known.
    """
    segments = _segments(topic)
    if len(topic) > LONGEST or not 0 < len(segments) <= MOST_SEGMENTS:
        return None
    best, least, owners = None, MOST, frozenset(boats)
    ends = {end for end in {name.rpartition("/")[2] for name in inputs} if _is_near(segments, end)}
    for name, entry in inputs.items():
        if name.rpartition("/")[2] not in ends:
            continue
        known = type_name != UNKNOWN_TYPE
        typed = OTHER_TYPE if known and entry.type != type_name else 0.0
        cost = typed + _distance(segments, _segments(name), owners, exact=typed > 0.0)
        if cost < least - 1e-9 or (best is None and cost <= least):
            best, least = name, cost
    return best


def _is_near(said: tuple[str, ...], end: str) -> bool:
    """Whether some segment may be the last one of a topic."""
    return any(_unlike(segment, end, False) <= MOST for segment in said)


@lru_cache(maxsize=8192)
def _segments(topic: str) -> tuple[str, ...]:
    return tuple(filter(None, topic.split("/")))


def _distance(said: tuple[str, ...], meant: tuple[str, ...], boats: Collection[str], *, exact: bool) -> float:
    """The least cost to make one name of the other; the last segment, which says what a topic is, is never missing."""
    missing = [SEGMENT] * (len(meant) - 1) + [NEVER]
    row = list(accumulate(missing, initial=0.0))
    for i, segment in enumerate(said):
        above, row = row, [SEGMENT * (i + 1)]
        for j, other in enumerate(meant):
            space = other in boats and j == 0
            swapped = _namespace(segment, other, boats) if space else _unlike(segment, other, exact)
            row.append(min(above[j] + swapped, above[j + 1] + SEGMENT, row[j] + missing[j]))
    return row[-1]


def _namespace(said: str, boat: str, boats: Collection[str]) -> float:
    if said == boat:
        return 0.0
    return OTHER_BOAT if said in boats else min(_edits(said.lower(), boat.lower()), NAMESPACE)


@lru_cache(maxsize=8192)
def _unlike(said: str, meant: str, exact: bool) -> float:
    """The cost of one segment for another; `exact` takes no segment that has only some of the words."""
    if said == meant:
        return 0.0
    low, high = said.lower(), meant.lower()
    words, all_words = sorted(filter(None, low.split("_"))), sorted(high.split("_"))
    share = _edits(low, high)
    if words == all_words:
        return min(WORDS, share)
    some = SOME_WORDS if words and set(words) < set(all_words) and not exact else NEVER
    return min(share if share <= UNLIKE else NEVER, some)


@lru_cache(maxsize=8192)
def _edits(one: str, other: str) -> float:
    """Levenshtein's distance as a share of the longer of the two."""
    row = list(range(len(other) + 1))
    for i, a in enumerate(one):
        above, row = row, [i + 1]
        for j, b in enumerate(other):
            row.append(min(above[j] + (a != b), above[j + 1] + 1, row[j] + 1))
    return row[-1] / max(len(one), len(other), 1)
