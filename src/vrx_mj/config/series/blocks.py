"""Parameters that hold XML, as they stand in SDF: gates, waypoints, objects and the like."""

import math
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from vrx_mj.config.series.calls import Call
from vrx_mj.config.tree import Place
from vrx_mj.config.urdf.xml_text import parse_pieces
from vrx_mj.config.wording import shown
from vrx_mj.errors import ConfigError, UnknownNameError, VrxWarning

__all__ = ["Block", "Tag", "read_block"]


@dataclass(frozen=True)
class Tag:
    """An element of a block."""

    element: Any
    call: Call
    key: str
    """Name of the parameter that it stands in."""

    @property
    def name(self) -> str:
        """What it is called."""
        return str(self.element.tag)

    def fault(self, message: str) -> ConfigError:
        """An error about it, at the parameter: YAML's quotes do not keep the lines in them."""
        return self.call.fault(self.key, message)

    def only(self, *names: str) -> None:
        """Refuse elements inside of other names."""
        for child in self.element.iterchildren("*"):
            if child.tag not in names:
                where = f"element of <{self.name}>" if self.element.getparent() is not None else "element of this block"
                raise self.fault(str(UnknownNameError(where, str(child.tag), names)))

    def all(self, name: str) -> list["Tag"]:
        """The elements of this name inside."""
        return [Tag(child, self.call, self.key) for child in self.element.iterchildren(name)]

    def text(self, name: str) -> str | None:
        """The text of the one element of this name inside; None where there is none."""
        found = self.all(name)
        if len(found) > 1:
            raise self.fault(f"<{self.name}> has {len(found)} elements <{name}>; one is expected")
        return "".join(found[0].element.itertext()).strip() if found else None

    def required(self, name: str) -> str:
        """The same of an element that must be there, and say something."""
        text = self.text(name)
        if not text:
            raise self.fault(f"<{self.name}> needs a <{name}>")
        return text

    def numbers(self, name: str, labels: str) -> list[float] | None:
        """The numbers in the one element of this name; `labels` names each of them."""
        text = self.text(name)
        return None if text is None else self.read_numbers(text, f"<{name}>", labels.split())

    def read_numbers(self, text: str, where: str, labels: Sequence[str]) -> list[float]:
        """As many numbers as there are labels."""
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != len(labels) or not all(map(math.isfinite, values)):
            form = "a number" if len(labels) == 1 else f"{len(labels)} numbers {' '.join(labels)}"
            raise self.fault(f"{where}: expected {form}, got {shown(text)}")
        return values


@dataclass(frozen=True)
class Block:
    """What a parameter holds: elements, or text alone."""

    root: Tag
    place: Place

    @property
    def stray(self) -> str:
        """Text between the elements, which SDF has no use for."""
        element = self.root.element
        pieces = [element.text or "", *(child.tail or "" for child in element)] if len(element) else []
        return " ".join(" ".join(pieces).split())

    @property
    def text(self) -> str:
        """All text, elements or not."""
        return "".join(self.root.element.itertext()).strip()

    def each(self, name: str) -> Iterator[Tag]:
        """The elements, all of which must be of this name."""
        self.root.only(name)
        found = self.root.all(name)
        if self.text and not found:
            raise self.root.fault(f"expected elements <{name}>, got {shown(self.text)}")
        yield from found


def read_block(call: Call, key: str) -> Block:
    """The XML in a parameter."""
    value = call.parameters[key]
    if value is not None and not isinstance(value, str | int | float):
        raise call.fault(key, f"expected XML in quotes, got {shown(value)}")
    text = "" if value is None else str(value)
    try:
        element = parse_pieces(text, call.place.file.name)
    except ConfigError as error:
        said = re.sub(
            r"the <(\S+)> of line \d+ ends with </pieces>", r"the <\1> does not end", error.problems[0].message
        )
        raise call.fault(key, re.sub(r" of line \d+", "", said)) from None
    block = Block(Tag(element, call, key), call.parameters.entries[key].value)
    if block.stray:
        name, line, _ = block.place.file.name, block.place.line, block.place.column
        told = f"{name}:{line}: {shown(block.stray)} between the elements of {key} is ignored"
        warnings.warn(told, VrxWarning, stacklevel=2)
    return block
