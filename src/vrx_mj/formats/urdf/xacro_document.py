"""XML and YAML of a xacro file, read with places and limits, and the expanded document written out."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.dom import expatbuilder, minidom
from xml.parsers import expat
from xml.sax.saxutils import escape

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode

from vrx_mj.config.tree import File, Place
from vrx_mj.formats.urdf.expression_values import LONGEST_TEXT, Budget, ExpressionError, measure

DEEPEST = 60
"""Levels of elements in elements."""
MOST_NODES = 50_000
"""Elements and attributes in a file."""
LONGEST_OUTPUT = 16_000_000
"""Characters of a result."""

_NAME = re.compile(r"[A-Za-z_\u00c0-\ufffd][-.\w\u00b7]*(:[A-Za-z_\u00c0-\ufffd][-.\w\u00b7]*)?")
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

_QUOTE = {'"': "&quot;"}


Child = minidom.Element | minidom.ProcessingInstruction | minidom.Comment | minidom.Text
"""What an element may hold."""


class FileError(ExpressionError):
    """Something wrong at a known place of a file."""

    def __init__(self, place: Place, key: str, message: str) -> None:
        super().__init__(message)
        self.place = place
        self.key = key


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


def parent_of(node: minidom.Node) -> minidom.Element:
    """The element that a node is in: an element of xacro is never the outermost one."""
    assert isinstance(node.parentNode, minidom.Element), "the outermost element"
    return node.parentNode


def children(node: minidom.Node) -> Iterator[Any]:
    """Every node below this one, in no particular order."""
    waiting = list(node.childNodes)
    while waiting:
        found = waiting.pop()
        yield found
        waiting.extend(found.childNodes)


def parse_document(data: bytes, name: str, folder: Path, budget: Budget) -> minidom.Document:
    """A document whose elements know their places, and whose texts with a '$' are `Located`."""
    budget.spend(len(data) // 4)
    text = data.decode("utf-8", errors="replace")
    builder = _Builder(File(name, folder, tuple(text.split("\n"))), budget)
    try:
        document: minidom.Document = builder.parseString(data)
    except expat.ExpatError as error:
        place = Place(builder.file, max(error.lineno, 1), error.offset + 1)
        raise FileError(place, "", _worded(expat.ErrorString(error.code), builder)) from None
    except (ValueError, LookupError):
        raise FileError(Place(builder.file, 1, 1), "", _WORDS["unknown encoding"]) from None
    for node in children(document):
        _locate(node)
    return document


def written(document: minidom.Document) -> str:
    """The document as text, checked to be XML."""
    for node in children(document):
        if node.nodeType == node.ELEMENT_NODE:
            _check_names(node)
    sink = _Sink()
    sink.write('<?xml version="1.0" ?>\n')
    for node in document.childNodes:
        _write(node, "", sink)
    return "".join(sink.parts)


def _write(node: Any, indent: str, sink: "_Sink") -> None:
    """Write a node, and an element's children below it, further in."""
    if node.nodeType != node.ELEMENT_NODE:
        node.writexml(sink, indent, "  ", "\n")
        return
    given = "".join(f' {name}="{escape(value, _QUOTE)}"' for name, value in sorted(node.attributes.items()))
    children = node.childNodes
    if len(children) == 1 and children[0].nodeType == node.TEXT_NODE:
        sink.write(f"{indent}<{node.tagName}{given}>{escape(children[0].data, _QUOTE)}</{node.tagName}>\n")
    elif children:
        sink.write(f"{indent}<{node.tagName}{given}>\n")
        for child in children:
            if child.nodeType != node.TEXT_NODE or child.data.strip():
                _write(child, indent + "  ", sink)
        sink.write(f"{indent}</{node.tagName}>\n")
    else:
        sink.write(f"{indent}<{node.tagName}{given}/>\n")


class _Copied:
    """Gives a copied element its original's place, and counts the copies."""

    def __init__(self, budget: Budget) -> None:
        self.budget = budget

    def handle(self, operation: int, key: str, data: Place, source: Any, copy: Any) -> None:
        self.budget.spend(20 + 10 * len(source.attributes) + 5 * len(source.childNodes))
        copy.setUserData(key, data, self)


class _Builder(expatbuilder.ExpatBuilderNS):
    """The standard builder; it notes places, and refuses document types with their entities."""

    def __init__(self, file: File, budget: Budget) -> None:
        self.file = file
        self.copied = _Copied(budget)
        self.open: list[tuple[str, int]] = []
        self.nodes = 0
        super().__init__()

    def here(self) -> Place:
        parser = self.getParser()
        return Place(self.file, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

    def start_doctype_decl_handler(self, name: str, *_: object) -> None:
        message = "document types and entities are not allowed; delete them"
        raise FileError(self.here(), "<!DOCTYPE>", message)

    def start_element_handler(self, name: str, attributes: list[str]) -> None:
        tag = ":".join(name.split(" ")[1:][::-1]) or name  # expat writes "URI LOCAL PREFIX"
        self.nodes += 1 + len(attributes) // 2
        if len(self.open) >= DEEPEST:
            raise FileError(self.here(), f"<{tag}>", f"elements are nested deeper than {DEEPEST} levels")
        if self.nodes > MOST_NODES:
            raise FileError(self.here(), f"<{tag}>", f"more than {MOST_NODES} elements and attributes in a file")
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


def _locate(node: Any) -> None:
    if node.nodeType == node.ELEMENT_NODE:
        for attribute in list(node.attributes.values()):
            if "$" in attribute.value:
                attribute.value = Located.at(attribute.value, node)
    elif node.nodeType in {node.TEXT_NODE, node.COMMENT_NODE} and "$" in node.data and place_of(node.parentNode):
        node.data = Located.at(node.data, node.parentNode)


def _check_names(element: Any) -> None:
    names = [element.tagName, *element.attributes.keys()]
    for name in names:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise FileError(
                place_of(element), f"<{element.tagName}>", f"'{name}' is not a valid name for an element or attribute"
            )
    for attribute in element.attributes.values():
        if not isinstance(attribute.value, str):
            attribute.value = str(attribute.value)


class _Sink:
    """Gathers a text of bounded length."""

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.room = LONGEST_OUTPUT

    def write(self, part: str) -> None:
        self.room -= len(part)
        if self.room < 0:
            raise ExpressionError(f"expands to more than {LONGEST_OUTPUT / 1e6:g} MB")
        self.parts.append(part)


DEEPEST_YAML = 20
"""Levels of nesting."""
_WORK_PER_BYTE = 12
_UNITS = {
    "!radians": 1.0, "!degrees": 0.017453292519943295, "!meters": 1.0, "!millimeters": 0.001, "!foot": 0.3048,
    "!inches": 0.0254,
}  # fmt: skip

_YAML_WORDS = (
    ("mapping values are not allowed", "a ':' too many, or wrong indentation; quote text with ': '"),
    ("could not find expected ':'", "expected ':' after the key"),
    ("expected <block end>", "wrong indentation, or a missing ':', '-' or quote"),
    ("expected ',' or", "expected ',' or a closing bracket"),
    ("found unexpected end of stream", "a quote is never closed"),
    ("expected the node content", "expected a value"),
    ("found undefined alias", "no anchor of this name"),
    ("but found another document", "a second document; a file holds one"),
    ("sequence entries are not allowed here", "a list's '-' starts on a line of its own"),
)


def load_plain(data: bytes, name: str, folder: Path, number: Callable[[str], Any], budget: Budget) -> object:
    """What a YAML file holds; `number` works out the text of a value with a unit."""
    budget.spend(_WORK_PER_BYTE * len(data))
    text = data.decode("utf-8-sig", errors="replace")
    file = File(name, folder, tuple(text.split("\n")))
    try:
        loader = _Loader(text, file, number)
        try:
            found = loader.get_single_data()
        finally:
            loader.dispose()
        measure(found, budget)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(file, mark.line + 1, mark.column + 1) if mark else Place(file, 1, 1)
        raise FileError(place, "", _yaml_worded(str(error.problem or error.context))) from None
    except FileError:
        raise
    except (ExpressionError, yaml.YAMLError, ValueError, RecursionError) as error:
        raise FileError(Place(file, 1, 1), "", f"invalid YAML: {str(error).splitlines()[0]}") from None
    return found


def _yaml_worded(said: str) -> str:
    """PyYAML's complaint in our words."""
    return next((ours for theirs, ours in _YAML_WORDS if said.startswith(theirs)), said)


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, kept from deep nesting, from tags but xacro's units, and from merge keys."""

    def __init__(self, text: str, file: File, number: Callable[[str], Any]) -> None:
        super().__init__(text)
        self.file = file
        self.number = number
        self.depth = 0

    def compose_node(self, parent: Node | None, index: int) -> Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        tag = getattr(event, "tag", None)
        if tag is not None and tag not in _UNITS:
            shown = str(tag).replace("tag:yaml.org,2002:", "!!", 1)
            raise yaml.MarkedYAMLError(
                problem=f"{shown}: only tags of units are allowed", problem_mark=event.start_mark
            )
        if len(getattr(event, "value", "")) > LONGEST_TEXT:
            problem = f"a text of more than {LONGEST_TEXT} characters is too long"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
        if self.depth > DEEPEST_YAML:
            raise yaml.MarkedYAMLError(
                problem=f"nested deeper than {DEEPEST_YAML} levels", problem_mark=event.start_mark
            )
        self.depth += 1
        node: Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def flatten_mapping(self, node: MappingNode) -> None:
        for key, _ in node.value:
            if key.tag == "tag:yaml.org,2002:merge":
                raise yaml.MarkedYAMLError(problem="merge keys (<<) are not allowed", problem_mark=key.start_mark)

    def with_unit(self, node: Node) -> float:
        """A number in radians or metres."""
        place = Place(self.file, node.start_mark.line + 1, node.start_mark.column + 1)
        if not isinstance(node, ScalarNode):
            raise FileError(place, "", f"{node.tag}: expected a number")
        try:
            return float(self.number(node.value)) * _UNITS[node.tag]
        except (ExpressionError, TypeError, ValueError, OverflowError) as error:
            words = str(error) if isinstance(error, ExpressionError) else "expected a number"
            raise FileError(place, "", f"{node.tag} {node.value[:60]}: {words}") from None


for _tag in _UNITS:
    _Loader.add_constructor(_tag, _Loader.with_unit)
