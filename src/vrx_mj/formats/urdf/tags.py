"""What each element and attribute of SDF 1.4 to 1.12 and of URDF is here, by `tags.json`, and what is lost of a file.

The table has a section for each element of SDF that is described by itself, and `robot` for URDF. By the path of an
element, or of an attribute after '@', it has a fate and words: `read` and as what, `lost` and why, or `harmless`. A
third text is the value of which nothing is lost. Fates may differ between `boat`, `object` and `world`. Lost without
words is what is lost with something around it; read without words is what only holds others.
"""

import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

from vrx_mj.errors import nearest, shown
from vrx_mj.formats.urdf.elements import truth
from vrx_mj.formats.urdf.model import Loss
from vrx_mj.formats.urdf.xml_document import Markup

_TEXT = (Path(__file__).parent / "tags.json").read_bytes()  # the process without rights may read no file later
_Side = Literal["boat", "object", "world"]
_SIDES = get_args(_Side)


class Entry(NamedTuple):
    """Fate of an element or attribute."""

    fate: Literal["read", "lost", "harmless"]
    words: str
    """Its name here, or the reason why it is lost."""
    usual: str | None = None
    """Value of which nothing is lost; None: something is of every value."""


@cache
def sections() -> Mapping[str, Mapping[str, Mapping[str, Any]]]:
    """What each path of each section is, by side."""
    return {
        name: {
            path: {
                side: Entry(*(row[side] if isinstance(row, dict) else row))
                for side in (row if isinstance(row, dict) else _SIDES)
            }
            for path, row in rows.items()
        }
        for name, rows in json.loads(_TEXT).items()
    }


def section_below(section: str, path: str) -> tuple[str, str]:
    """The section in which children of an element are, and what their paths begin with."""
    nested = path in _holders(section)
    tag = path.rpartition("/")[2]
    return (tag, "") if tag in sections() and not nested else (section, f"{path}/")


@cache
def _holders(section: str) -> frozenset[str]:
    return frozenset(path.rpartition("/")[0] for path in sections()[section])


def losses(root: Markup, section: str, side: _Side) -> list[Loss]:
    """What is lost of an element and of all in it, each kind once."""
    found: dict[tuple[str, str], list[Loss]] = {}
    for key, loss in _losses_in(root, section, "", side):
        found.setdefault(key, []).append(loss)
    return [
        one._replace(what=f"{one.what} and {len(more)} more") if more else one for one, *more in found.values()
    ]  # fmt: skip


def _losses_in(element: Any, section: str, base: str, side: _Side) -> Iterator[tuple[tuple[str, str], Loss]]:
    """The losses of an element whose attributes and children are in a section, by their kind."""
    rows = sections()[section]
    for name, value in element.attrib.items():
        why = _why(rows, f"{base}@{name}", value, side)
        if why:
            yield (section, f"{base}@{name}"), Loss(element.place, f"{name} of <{element.tag}>", why)
    for child in element if section != "plugin" else ():
        path = f"{base}{child.tag}"
        if section == "include" and child.tag == "model":  # put there by who included it
            yield from _losses_in(child, "model", "", side)
            continue
        why = _why(rows, path, child.text or "", side)
        if why:
            name = child.get("name")
            yield (section, path), Loss(child.place, f"<{child.tag}>{f' {shown(name)}' if name else ''}", why)
        elif not (side == "world" and child.tag == "model"):
            yield from _losses_in(child, *section_below(section, path), side)


def _why(rows: Mapping[str, Mapping[str, Entry]], path: str, value: str, side: _Side) -> str:
    """Reason why something is lost; empty if nothing is."""
    row = rows.get(path)
    if row is None:
        base, _, name = path.rpartition("/")
        known = (one.rpartition("/")[2] for one in rows if one.rpartition("/")[0] == base)
        close = nearest(name, [one for one in known if one.startswith("@") == name.startswith("@")])
        return "unknown here" + (f"; did you mean '{close.removeprefix('@')}'?" if close else "")
    tag = row[side]
    return "" if tag.fate != "lost" or (tag.usual is not None and _equal(value, tag.usual)) else tag.words


def _equal(value: str, usual: str) -> bool:
    """Whether a value says what the usual one does; an empty one always does."""
    words = value.split()
    if not words or words == usual.split() or truth(value) == truth(usual) is not None:
        return True
    try:
        return [float(word) for word in words] == [float(word) for word in usual.split()]
    except ValueError:
        return False
