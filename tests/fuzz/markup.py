"""Mutation of XML: attributes and elements set, renamed, moved, doubled and dropped."""

import copy
import random
from typing import Any

from lxml import etree

from fuzz import junk, raw

EXPRESSIONS = (
    "${1/0}", "${'a' * 10**9}", "${[x for x in (1).__class__]}", "${2 ** 10 ** 8}", "$(find wamv)", "$(arg x)",
    "$(env HOME)", "${load_yaml('../bait/secret.yaml')}", "${'%09999999d' % 1}", "${pi / 2}", "${-1e308 * 10}",
    "${float('nan')}", "${len(range(9 ** 9))}", "${'{:>999999999}'.format(1)}", "${xacro.load_yaml('x')}",
    "${dict(a=1)['b']}", "${" + "(" * 300 + "1" + ")" * 300 + "}", "${", "$$(", "${}", "${radians('x')}",
    "${max([])}", "${sorted([1, 'a'])}", "${int('9' * 5000)}", "${str(10 ** 5000)}", "${'x'.join(['y'] * 10 ** 7)}",
    "$(eval 1)",
)  # fmt: skip


def mutated(text: bytes, chance: random.Random, *, most: int = 4) -> bytes:
    """A document with one to `most` changes to its tree, and now and then to its bytes as well."""
    if chance.random() < 0.15:
        return raw.mutated(text, chance)
    if chance.random() < 0.05:
        return raw.mutated_lines(text.decode("utf-8", "replace"), chance).encode("utf-8", "replace")
    root = etree.fromstring(text, etree.XMLParser(huge_tree=True))
    for _ in range(raw.few(chance, most)):
        _change(root, chance)
    done = etree.tostring(root)
    return raw.mutated(done, chance) if chance.random() < 0.1 else bytes(done)


def _change(root: Any, chance: random.Random) -> None:
    nodes = [node for node in root.iter("*") if node is not root] or [root]
    node, other = _drawn(nodes, chance), chance.choice(nodes)
    draw = chance.random()
    if draw < 0.45 and node.attrib:
        _set(node, chance.choice(sorted(node.attrib)), chance)
    elif draw < 0.52:
        node.text = _legal(junk.value(chance), chance)
    elif draw < 0.57 and node.attrib:
        del node.attrib[chance.choice(sorted(node.attrib))]
    elif draw < 0.64 and other.attrib:
        _set(node, chance.choice(sorted(other.attrib)), chance)
    elif draw < 0.70:
        node.tag = other.tag
    elif draw < 0.78 and node.getparent() is not None:
        node.getparent().remove(node)
    elif draw < 0.88 and node.getparent() is not None:
        for _ in range(chance.choice([1, 1, 1, 20])):
            node.addnext(copy.deepcopy(node))
    elif node is not other and node not in list(other.iterancestors()) and sum(1 for _ in node.iter()) < 500:
        other.append(copy.deepcopy(node))


def _drawn(nodes: list[Any], chance: random.Random) -> Any:
    """In half of the draws a node of a random tag, so that rare ones come often."""
    if chance.random() < 0.5:
        return chance.choice(nodes)
    tags = sorted({str(node.tag) for node in nodes})
    tag = chance.choice(tags)
    return chance.choice([node for node in nodes if node.tag == tag])


def _set(node: Any, name: str, chance: random.Random) -> None:
    old = node.get(name, "")
    words = old.split()
    if words and chance.random() < 0.4:
        words[chance.randrange(len(words))] = _legal(junk.number(chance), chance)
        node.set(name, " ".join(words))
    else:
        node.set(name, _legal(junk.value(chance), chance))


def _legal(value: Any, chance: random.Random) -> str:
    """A value as text that XML can hold."""
    if chance.random() < 0.15:
        return chance.choice(EXPRESSIONS)
    text = value if isinstance(value, str) else _number(value)
    return "".join(letter for letter in text if letter >= " " or letter in "\t\n")


def _number(value: Any) -> str:
    try:
        return str(value)
    except ValueError:  # too many digits
        return "1" + "0" * 400
