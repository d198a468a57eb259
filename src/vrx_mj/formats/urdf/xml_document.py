"""An XML file of others as a document (minidom) whose elements and texts know their places."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.dom import expatbuilder, minidom
from xml.parsers import expat

from vrx_mj.config.search import ReadingError, display, read_limited
from vrx_mj.config.tree import File, Place
from vrx_mj.errors import ConfigError, Problem

MAX_BYTES = 4_000_000
"""Longest file that is read."""
DEEPEST = 60
"""Levels of elements in elements."""
MOST_NODES = 50_000
"""Elements and attributes in a file."""

_WORDS = {
    "no element found": "ends before its outermost element does, or is empty",
    "unclosed token": "a tag, comment or quote is never closed",
    "not well-formed (invalid token)": "is not XML: a stray '<' or '&' (write &lt; &amp;), or no quote or '='",
    "junk after document element": "text after the end of the outermost element",
    "duplicate attribute": "an attribute is given twice",
    "syntax error": "is not XML, which begins with '<'",
    "undefined entity": "no such &name; here; XML knows &lt; &gt; &amp; &quot; and &apos;",
    "XML or text declaration not at start of entity": "'<?xml ...?>' must be the very first thing in the file",
    "unknown encoding": "unknown encoding; save the file as UTF-8",
    "encoding specified in XML declaration is incorrect": "is not in the encoding its first line names; use UTF-8",
}


class Located(str):
    """Text of a file that has something to expand, with the element it is in."""

    __slots__ = ("place", "tag")

    place: Place
    tag: str

    @classmethod
    def at(cls, text: str, element: minidom.Element) -> "Located":
        """The text of an element's attribute, or in the element."""
        located = cls(text)
        located.place, located.tag = place_of(element), element.tagName
        return located


def place_of(element: Any) -> Place:
    """The place of an element, or of what it was copied from."""
    place: Place = element.getUserData("place")
    return place


def elements(node: minidom.Node) -> Iterator[Any]:
    """The elements below a node, in the order of the file."""
    waiting = list(reversed(node.childNodes))
    while waiting:
        found = waiting.pop()
        if found.nodeType == found.ELEMENT_NODE:
            yield found
            waiting.extend(reversed(found.childNodes))


def read_bytes(file: Path) -> bytes:
    """A file's bytes, up to the limit. Raises ConfigError."""
    try:
        return read_limited(file, MAX_BYTES)
    except ReadingError as error:
        raise ConfigError([Problem(display(file), None, None, "", str(error))]) from None


def parse_document(data: bytes, name: str, folder: Path) -> minidom.Document:
    """A document whose elements know their places, and whose texts with a '$' are `Located`. Raises ConfigError."""
    text = data.decode("utf-8", errors="replace")
    builder = _Builder(File(name, folder, tuple(text.split("\n"))))
    try:
        document: minidom.Document = builder.parseString(data)
    except expat.ExpatError as error:
        place = Place(builder.file, max(error.lineno, 1), error.offset + 1)
        raise _fault(place, "", _worded(expat.ErrorString(error.code), builder)) from None
    except (ValueError, LookupError):
        raise _fault(Place(builder.file, 1, 1), "", _WORDS["unknown encoding"]) from None
    for element in elements(document):
        _locate(element)
    return document


def _fault(place: Place, key: str, message: str) -> ConfigError:
    return ConfigError([Problem(place.file.name, place.line, place.column, key, message)])


class Copied:
    """Gives a copied element its original's place."""

    def handle(self, operation: int, key: str, data: Place, source: Any, copy: Any) -> None:
        """Called by minidom."""
        copy.setUserData(key, data, self)


class _Builder(expatbuilder.ExpatBuilderNS):
    """The standard builder; it notes places, and refuses document types with their entities."""

    def __init__(self, file: File) -> None:
        self.file = file
        self.copied = Copied()
        self.open: list[tuple[str, int]] = []
        self.nodes = 0
        super().__init__()

    def here(self) -> Place:
        parser = self.getParser()
        return Place(self.file, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

    def start_doctype_decl_handler(self, name: str, *_: object) -> None:
        raise _fault(self.here(), "<!DOCTYPE>", "document types and entities are not allowed; delete them")

    def start_element_handler(self, name: str, attributes: list[str]) -> None:
        tag = ":".join(name.split(" ")[1:][::-1]) or name  # expat writes "URI LOCAL PREFIX"
        self.nodes += 1 + len(attributes) // 2
        if len(self.open) >= DEEPEST:
            raise _fault(self.here(), f"<{tag}>", f"elements are nested deeper than {DEEPEST} levels")
        if self.nodes > MOST_NODES:
            raise _fault(self.here(), f"<{tag}>", f"more than {MOST_NODES} elements and attributes in a file")
        super().start_element_handler(name, attributes)
        self.curNode.setUserData("place", self.here(), self.copied)
        self.open.append((tag, self.here().line or 1))

    def end_element_handler(self, name: str) -> None:
        self.open.pop()
        super().end_element_handler(name)


def _worded(said: str, builder: _Builder) -> str:
    """What the parser complains of, in our words."""
    if said == "mismatched tag":
        tag, line = builder.open[-1]
        return f"expected </{tag}>, which ends the <{tag}> of line {line}"
    if said == "unbound prefix":
        return "the prefix of a name here, as in 'xacro:if', is not declared; the outermost element needs xmlns:xacro"
    if said in {"no element found", "unclosed token"} and builder.open:
        tag, line = builder.open[-1]
        return f"the file ends before </{tag}>, which ends the <{tag}> of line {line}"
    return _WORDS.get(said, said)


def _locate(element: Any) -> None:
    for attribute in list(element.attributes.values()):
        if "$" in attribute.value:
            attribute.value = Located.at(attribute.value, element)
    for child in element.childNodes:
        if child.nodeType in {child.TEXT_NODE, child.COMMENT_NODE} and "$" in child.data:
            child.data = Located.at(child.data, element)
