"""XML of others, for which this is the one parser: it is as tolerant as tinyxml, with which Gazebo and urdfdom read.

What XML does not allow and tinyxml reads is one warning for each kind of it, with the place of the first. It works in
the sandboxed process: `read_bytes`, for texts that are handed to it, is for any other.
"""

import codecs
import json
import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET
from xml.parsers import expat

from vrx_mj.config.search import ReadingError, display, read_limited
from vrx_mj.errors import ConfigError, warn
from vrx_mj.formats.urdf.model import Place

MAX_BYTES = 4_000_000
"""Longest file that is read."""
_MAX_DEPTH = 60
"""Largest depth of elements in elements."""
_MOST_NODES = 50_000
"""Elements and attributes in a file."""

WORDING: Mapping[str, Mapping[str, str]] = json.loads((Path(__file__).parent / "wording.json").read_bytes())
"""Words for errors of expat, by its own, for what tinyxml reads and XML does not allow, and for suspicious robots."""
_PREFIXES = {"xml", "xmlns", "gz", "ignition"}
"""Prefixes that need not be declared: files of Gazebo do not."""
_ENCODING = re.compile(rb"""(?:\xef\xbb\xbf)?\s*<\?xml[^>]{0,100}?encoding\s*=\s*["']([\w.:-]{1,40})["']""")
_DECLARATION = re.compile(r"(\s*)<\?xml\s[^>]*\?>")
_TOKEN = re.compile(
    r"(?P<hyphens><!--.*?(?:-->|\Z))|<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z)"
    r"|(?P<ampersand>&)(?!(?:lt|gt|amp|quot|apos|#[0-9]{1,7}|#x[0-9a-fA-F]{1,6});)", re.DOTALL,
)  # fmt: skip
_HYPHENS = re.compile(r"-(?=-|\Z)")


class Markup(ET.Element):
    """An element that knows its place."""

    def __init__(self, tag: str, place: Place, attributes: dict[str, str]) -> None:
        super().__init__(tag, attributes)
        self.place = place


_Row = tuple[int, int, int, int, str, dict[str, str], str]
"""Row of the element around it (-1: none), number of its file, line, column, tag, attributes, and its own text without
blanks around it."""
Table = tuple[_Row, ...]
"""The elements of a file, in its order."""


def file_error(file: Path | str, message: str, key: str = "") -> ConfigError:
    """The error about a file, or one without a path that messages call so, as a whole."""
    return ConfigError.of(display(file) if isinstance(file, Path) else file, message, key=key)


def has_xacro(text: str) -> bool:
    """Whether a description has anything that xacro would expand."""
    return any(mark in text for mark in ("<xacro:", "${", "$("))


def read_bytes(file: Path) -> bytes:
    """Bytes of a file, up to the limit. Raises ConfigError."""
    try:
        return read_limited(file, MAX_BYTES)
    except ReadingError as error:
        raise file_error(file, str(error)) from None


def read_text(file: Path) -> str:
    """Text of a file, up to the limit. Raises ConfigError."""
    return decode(read_bytes(file), display(file))


def decode(data: bytes, name: str) -> str:
    """The text of a file, in the encoding that it says; what is wrong in it is U+FFFD. Raises ConfigError."""
    marked = "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else None
    said = _ENCODING.match(data)
    try:
        text = data.decode(marked or (said[1].decode() if said else "utf-8"), errors="replace")
        return text.removeprefix("\ufeff").replace("\r\n", "\n")
    except (LookupError, ValueError):
        raise _fault(Place(name, 1, 1), "", "unknown encoding; save the file as UTF-8") from None


def table(text: str, name: str) -> Table:
    """Table of the elements of an XML text, which messages call `name`. Raises ConfigError."""
    return table_of(markup(text, name))


def markup(text: str, name: str) -> Markup:
    """The root element of an XML text, without comments. Raises ConfigError."""

    def target(here: Callable[[], Place]) -> ET.TreeBuilder:
        return ET.TreeBuilder(element_factory=lambda tag, attributes: Markup(tag, here(), attributes))

    root: Markup = parse_xml(text, name, target).close()
    return root


def parse_robot(text: str, name: str) -> Markup:
    """The `<robot>` element of a URDF's text; messages call it by a name. Raises ConfigError."""
    root = markup(text, name)
    if root.tag != "robot":
        hint = {"sdf": "; SDF is not read, only URDF", "mujoco": "; MJCF is not read as a robot, only URDF"}
        raise _fault(root.place, "", f"expected a <robot>, got a <{root.tag}>{hint.get(root.tag, '')}")
    element: Any
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            message = f"<{element.tag}> in a URDF: rename the file to .xacro, so that it is expanded first"
            raise _fault(element.place, "", message)
    return root


def table_of(root: Any) -> Table:
    """A tree of elements as a table."""
    rows: list[_Row] = []
    waiting = [(-1, root)]
    while waiting:
        around, element = waiting.pop()
        waiting += [(len(rows), child) for child in reversed(element)]
        text = "".join([element.text or "", *(child.tail or "" for child in element)]).strip()
        line, column = element.place.line or 1, element.place.column or 1
        rows.append((around, 0, line, column, element.tag, dict(element.attrib), text))
    return tuple(rows)


def parse_xml(text: str, name: str, target: Callable[[Callable[[], Place]], Any], *, strict: bool = False) -> Any:
    """Hand a text to the target that is made, which can ask for the place of the element that begins.

    Document types, and with them entities, are refused.

    Args:
        text: the text.
        name: what messages call it.
        target: makes the target.
        strict: whether what XML does not allow is an error, as xacro has it.

    Raises:
        ConfigError: it cannot be read.

    Warns:
        VrxWarning: once for each kind of thing that XML does not allow.
    """
    odd = _Oddities()
    parser = _Parser(name, None if strict else odd, target)
    try:
        parser.expat.Parse((text if strict else _repair(text, name, odd)).encode("utf-8", "replace"), True)
    except expat.ExpatError as error:
        place = Place(name, max(error.lineno, 1), error.offset + 1)
        raise _fault(place, "", parser.message(expat.ErrorString(error.code))) from None
    odd.warn()
    return parser.target


class _Oddities(dict[str, tuple[str, Place, int]]):
    """Faults in XML that are tolerated: for each kind the words, the first place and the count."""

    def add(self, kind: str, place: Callable[[], Place], words: str = "") -> None:
        """Add one; its words and place count if it is the first."""
        first, where, count = self.get(kind) or (words or WORDING["tolerated"][kind], place(), 0)
        self[kind] = first, where, count + 1

    def warn(self) -> None:
        """Warn of each kind."""
        for words, place, count in self.values():
            more = f" ({count} times)" if count > 1 else ""
            warn(f"{place}:{place.column}: {words}{more}", 3)


def _repair(text: str, name: str, odd: _Oddities) -> str:
    """A text as XML allows it; lines stay where they are, and columns but behind an '&'."""

    def place(start: int) -> Place:
        return Place(name, text.count("\n", 0, start) + 1, start - text.rfind("\n", 0, start))

    def repair(found: re.Match[str]) -> str:
        comment = found["hyphens"]
        if found["ampersand"]:
            odd.add("ampersand", partial(place, found.start()))
            return "&amp;"
        if comment and comment.endswith("-->") and _HYPHENS.search(comment, 4, len(comment) - 3):
            odd.add("hyphens", partial(place, found.start()))
            return f"<!--{_HYPHENS.sub('=', comment[4:-3])}-->"
        return found[0]

    if "\ufffd" in text:
        odd.add("encoding", partial(place, text.index("\ufffd")))
    if (declaration := _DECLARATION.match(text)) is None:
        return _TOKEN.sub(repair, text)
    if declaration[1]:
        odd.add("before", partial(place, 0))
    return _TOKEN.sub(repair, re.sub(r"[^\n]", " ", declaration[0]) + text[declaration.end() :])


def _fault(place: Place, key: str, message: str) -> ConfigError:
    return ConfigError.of(place.file, message, key=key, line=place.line, column=place.column)


class _Parser:
    """Expat, which knows places and hands pieces to a target, comments and bounds of literal text if it takes them.

    Names with a prefix are taken as they are.
    """

    def __init__(self, name: str, odd: _Oddities | None, make: Callable[[Callable[[], Place]], Any]) -> None:
        self.name, self.odd = name, odd
        self.open: list[tuple[str, int]] = []
        self.nodes = 0
        self.declared = set(_PREFIXES)
        self.expat = expat.ParserCreate("utf-8")
        self.target = make(self.here)
        self.expat.buffer_text = True
        self.expat.StartElementHandler, self.expat.EndElementHandler = self.start, self.end
        self.expat.CharacterDataHandler = self.target.data
        self.expat.StartDoctypeDeclHandler = self.refuse
        self.expat.CommentHandler = getattr(self.target, "comment", None)
        self.expat.StartCdataSectionHandler = getattr(self.target, "start_literal", None)
        self.expat.EndCdataSectionHandler = getattr(self.target, "end_literal", None)

    def here(self) -> Place:
        """The place of what is being read."""
        return Place(self.name, self.expat.CurrentLineNumber, self.expat.CurrentColumnNumber + 1)

    def refuse(self, *_: object) -> None:
        raise _fault(self.here(), "<!DOCTYPE>", "document types and entities are not allowed; remove them")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.nodes += 1 + len(attributes)
        if len(self.open) >= _MAX_DEPTH:
            raise _fault(self.here(), f"<{tag}>", f"elements are nested deeper than {_MAX_DEPTH} levels")
        if self.nodes > _MOST_NODES:
            raise _fault(self.here(), f"<{tag}>", f"more than {_MOST_NODES} elements and attributes in a file")
        self.declared |= {key[6:] for key in attributes if key.startswith("xmlns:")}
        for prefix in (one.partition(":")[0] for one in (tag, *attributes) if ":" in one):
            if prefix not in self.declared:
                self.take_undeclared(prefix)
        self.open.append((tag, self.expat.CurrentLineNumber))
        self.target.start(tag, attributes)

    def take_undeclared(self, prefix: str) -> None:
        self.declared.add(prefix)
        words = f"the prefix '{prefix}' of a name is not declared; the outermost element needs xmlns:{prefix}"
        if self.odd is None:
            raise _fault(self.here(), "", words)
        self.odd.add("prefix", self.here, words)

    def end(self, tag: str) -> None:
        self.open.pop()
        self.target.end(tag)

    def message(self, said: str) -> str:
        """Message for an error of the parser."""
        tag, line = self.open[-1] if self.open else ("", 0)
        if said == "mismatched tag":
            return f"expected </{tag}>, which ends the <{tag}> of line {line}"
        if said in {"no element found", "unclosed token"} and tag:
            return f"the file ends before </{tag}>, which ends the <{tag}> of line {line}"
        return WORDING["expat"].get(said, said)
