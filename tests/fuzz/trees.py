"""Mutation of trees of mappings, lists and values, as YAML and JSON have them."""

import copy
import random
from collections.abc import Iterator
from typing import Any

from fuzz import junk, raw

Place = tuple[Any, Any]
"""A container and the key or index in it."""


def places(tree: Any) -> Iterator[Place]:
    """Every place of a tree, but its root."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
        for key, inner in items:
            yield node, key
            waiting.append(inner)


def mutated(tree: Any, chance: random.Random, *, most: int = 4) -> Any:
    """A copy with one to `most` changes."""
    tree = {"": copy.deepcopy(tree)}
    for _ in range(raw.few(chance, most)):
        found = list(places(tree))
        if found:
            change(chance.choice(_levels(found, chance)), found, chance)
    return tree.get("")


def _levels(found: list[Place], chance: random.Random) -> list[Place]:
    """In half of the draws the places of one key name, so that rare ones come as often as those of long lists."""
    if chance.random() < 0.5:
        return found
    names: dict[Any, list[Place]] = {}
    for place in found:
        names.setdefault(place[1] if isinstance(place[1], str) else "#", []).append(place)
    return names[chance.choice(list(names))]


def change(place: Place, found: list[Place], chance: random.Random) -> None:
    """Make one change at a place."""
    node, key = place
    draw = chance.random()
    if draw < 0.35:
        old = node[key]
        is_number = isinstance(old, int | float) and not isinstance(old, bool)
        node[key] = junk.changed_number(old, chance) if is_number and chance.random() < 0.4 else junk.value(chance)
    elif draw < 0.5 and isinstance(node[key], int | float):
        node[key] = junk.number(chance)
    elif draw < 0.6:
        del node[key]
    elif draw < 0.7 and isinstance(node, list):
        node[key:key] = [copy.deepcopy(node[key])] * chance.choice([1, 1, 2, 50])
    elif draw < 0.8 and isinstance(node, dict):
        other = chance.choice(found)[1] if chance.random() < 0.7 else chance.choice(junk.TEXTS)
        node[other] = node.pop(key)
    elif draw < 0.92:
        node[key] = _small_copy(chance.choice(found))
    else:
        node[key] = [node[key]] if chance.random() < 0.5 else {"a": node[key]}


def _small_copy(place: Place) -> Any:
    """A copy of what is there, unless it is large."""
    inner = place[0][place[1]]
    return copy.deepcopy(inner) if sum(1 for _ in places(inner)) < 2000 else None
