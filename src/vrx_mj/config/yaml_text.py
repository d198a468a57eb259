"""Our YAML: one document of plain data, with the place of every key and value.

Scalars are read as YAML 1.2 does, so `1e-3` is a number, `yes`, `no`, `on` and `off` are text, and neither
`010` nor `1:30` is anything odd. Tags, merge keys and whatever could blow up memory are refused.

Characters that look like the ones YAML wants (full-width forms, curly quotes, foreign letters, odd spaces) are looked
for where they matter: not in comments, and not in the free text of a `description`.
"""

import contextlib
import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from yaml.composer import Composer
from yaml.nodes import MappingNode, Node, ScalarNode

from vrx_mj.config.search import ReadingError, display, read_limited
from vrx_mj.config.tree import MAX_DEPTH, PYYAML, Entry, File, Items, Loc, Place, Section, key_path, literal
from vrx_mj.errors import ConfigError, Problem

_PLAIN = {
    **{chr(0xFEE0 + code): chr(code) for code in range(0x21, 0x7F)},
    **dict(zip("、。︰【】〔〕「」“”„‘’‐‑–—−×", ',.:[][]"""""\'\'-----X', strict=True)),
    "…": "...",
}
"""Plain characters for full-width forms and punctuation."""
_LATIN = dict(zip(
    "АВЕЅІЈКМНОРСТУХаеорсухѕіјΑΒΕΖΗΙΚΜΝΟΡΤΥΧο", "ABESIJKMHOPCTYXaeopcyxsijABEZHIKMNOPTYXo", strict=True
))  # fmt: skip
"""Latin letters for Cyrillic and Greek ones that look like them."""
_UNSEEN = {"Zs": "type a space", "Cf": "remove it"}
"""Advice about spaces and invisible characters, by their category in Unicode."""

_ODD = re.compile(r"[^\x00-\x7f]|\t")
_WORD = re.compile(r"\w+")
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufffe\uffff]")
_QUOTE_OR_COMMENT = re.compile(r"""(?:(?<=[\s\[{,:(])|^)["']|(?:(?<=\s)|^)#""")
_DESCRIPTION = re.compile(r"""^(\s*(?:- +)*)(["']?)description\2\s*:(?=\s|$)""")
_DESCRIPTION_INSIDE = re.compile(r"""(?<=[{,])\s*description\s*:\s*("[^"]*"|'[^']*'|[^,}]*)""")
MAX_BYTES = 4_000_000
"""Longest file that is read [bytes]."""
_MAX_LINES = 200_000
"""Most lines of a file."""
_MAX_ODD = 1000
"""Most odd characters of a file that are counted."""
MAX_NODES = 60_000
"""Most keys and values that are written in a file; reading one takes some 50 us."""
_MAX_VALUES = 200_000
"""Most values in a file, those that aliases repeat counted each time."""
_INT = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL: dict[str, Any] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
    ".nan": float("nan"), ".NaN": float("nan"), ".NAN": float("nan"),
    ".inf": float("inf"), "-.inf": float("-inf"), "+.inf": float("inf"),
}  # fmt: skip
_AT_THE_START = ("found unexpected end of stream", "could not find expected ':'")
"""How PyYAML's errors begin which are best placed where what they are about starts."""
_DISPUTED = re.compile(r"[?%\t\ufeff]|[|>][-+0-9]*#")
"""Texts that libyaml accepts and PyYAML may refuse: some '?', tabs, comments and directives without a space."""
_NUMBERED = ("autopilot",)
"""The section whose keys are numbers: those of channels."""


def find_lookalikes(lines: Sequence[str], name: str = "", *, free_text: bool = True) -> Iterator[Problem]:
    """Look-alikes outside comments and, where the file has such keys (`free_text`), descriptions."""
    indent: int | None = None  # of the `description` key that the line may still belong to
    for row, line in enumerate(lines, 1):
        depth = len(line) - len(line.lstrip(" "))
        if indent is not None and (not line.strip() or depth > indent):
            continue
        code = _without_comment(line)
        start = _DESCRIPTION.match(code) if free_text else None
        indent = len(start[1]) if start else None
        if start:
            code = code[: start.end()]
        elif free_text:
            code = _DESCRIPTION_INSIDE.sub(lambda match: " " * len(match[0]), code)
        yield from (Problem(name, row, column + 1, "", message) for column, message in _in_code(code))


def _without_comment(line: str) -> str:
    """The line up to its comment; a '#' inside quotes begins none."""
    at = 0
    while found := _QUOTE_OR_COMMENT.search(line, at):
        if found[0] == "#":
            return line[: found.start()]
        end = line.find(found[0], found.end())
        if end < 0:
            break
        at = end + 1
    return line


def _in_code(code: str) -> Iterator[tuple[int, str]]:
    if code.isascii() and "\t" not in code:
        return
    mixed = {index for word in _WORD.finditer(code) if _is_mixed(word[0]) for index in range(*word.span())}
    for hit in _ODD.finditer(code):
        if (hit[0] not in _LATIN or hit.start() in mixed) and (advice := _advice(hit[0])):
            yield hit.start(), advice


def _is_mixed(word: str) -> bool:
    """Foreign letters are fine in foreign words, not next to Latin ones nor where all look Latin."""
    letters = [letter for letter in word if letter.isalpha()]
    return any(letter.isascii() for letter in letters) or all(letter in _LATIN for letter in letters)


def _advice(character: str) -> str | None:
    """Advice about a character, by its name in Unicode; None: it may stay."""
    if character == "\t":
        return "tab; use spaces"
    plain = _PLAIN.get(character) or _LATIN.get(character)
    quoted = f"'{plain}'" if plain != "'" else '"\'"'
    do = f"type {quoted}" if plain else _UNSEEN.get(unicodedata.category(character))
    return do and f"{unicodedata.name(character).lower()} U+{ord(character):04X}; {do}"


def read_lines(path: Path) -> tuple[str, ...]:
    """Lines of a UTF-8 file, without BOM and line ends, checked for control characters."""
    name = display(path)
    try:
        data = read_limited(path, MAX_BYTES)
    except ReadingError as error:
        raise ConfigError.of(name, str(error)) from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        start = data.rfind(b"\n", 0, error.start) + 1
        line, column = data.count(b"\n", 0, error.start) + 1, error.start - start + 1
        message = f"byte 0x{data[error.start]:02X} is not UTF-8; save the file as UTF-8"
        raise ConfigError.of(name, message, line=line, column=column) from None
    lines = tuple(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"))
    if len(lines) > _MAX_LINES:
        raise ConfigError.of(name, f"more than {_MAX_LINES} lines")
    _refuse_odd(
        Problem(name, row, hit.start() + 1, "", f"control character U+{ord(hit[0]):04X}; remove it")
        for row, line in enumerate(lines, 1)
        for hit in _CONTROL.finditer(line)
    )
    return lines


class Repeat(NamedTuple):
    """A key that a mapping has twice: its path, and the lines of the earlier and of the later one, which counts."""

    key: str
    first: int
    last: int


def parse(file: File) -> Section:
    """The one mapping that a YAML file holds."""
    return _parse(file, _Builder(file))


def parse_loosely(file: File) -> tuple[Section, list[Repeat]]:
    """Parse YAML as Python programs read it: numbers may be keys, and of equal keys the last one counts."""
    builder = _Builder(file, loose=True)
    return _parse(file, builder), builder.repeats


def _parse(file: File, builder: "_Builder") -> Section:
    _refuse_odd(find_lookalikes(file.lines, file.name))
    if next(filter(str.strip, file.lines), "").lstrip().startswith("<"):
        raise ConfigError.of(file.name, "XML; expected YAML, keys and values", line=1, column=1)
    try:
        node = _compose("\n".join(file.lines))
    except yaml.MarkedYAMLError as error:
        raise ConfigError([_problem_of(file, error)]) from None
    if node is None:
        raise ConfigError.of(file.name, "empty; expected keys and values", line=1, column=1)
    tree = builder.value(node, ())
    if not isinstance(tree, Section):
        builder.problem(node, (), f"expected keys and values, got {literal(tree)}")
    if builder.problems or not isinstance(tree, Section):
        raise ConfigError(builder.problems)
    return tree


def _refuse_odd(found: Iterable[Problem]) -> None:
    if problems := list(islice(found, _MAX_ODD)):
        raise ConfigError(problems)


class _Composer(Composer):
    """PyYAML's composer, kept from deep nesting and from tags."""

    depth = 0
    count = 0

    def compose_node(self, parent: Node | None, index: Any) -> Node | None:
        event = self.peek_event()  # type: ignore[attr-defined]  # of the parser
        tag = getattr(event, "tag", None)
        self.count += 1
        problem = None
        if self.count > MAX_NODES:
            problem = f"more than {MAX_NODES} keys and values"
        elif tag is not None:
            problem = f"{tag.replace('tag:yaml.org,2002:', '!!', 1)}: tags are not allowed"
        elif self.depth > MAX_DEPTH:
            problem = f"nested deeper than {MAX_DEPTH} levels"
        if problem:
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
        self.depth += 1
        node: Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node


class _PythonComposer(_Composer, yaml.SafeLoader):
    """Composes what PyYAML's own parser reads, whose errors `_problem_of` knows."""


if yaml.__with_libyaml__:

    class _LibyamlComposer(_Composer, yaml.CSafeLoader):
        """Composes what libyaml's parser reads, in a tenth of the time."""

        def __init__(self, text: str) -> None:
            Composer.__init__(self)
            yaml.CSafeLoader.__init__(self, text)

        def compose_node(self, parent: Node | None, index: Any) -> Node | None:
            event = self.peek_event()
            if isinstance(event, yaml.ScalarEvent) and not event.value and not event.style:
                raise yaml.YAMLError("libyaml places empty values elsewhere")
            return super().compose_node(parent, index)


def _compose(text: str) -> Node | None:
    """The nodes of a text, which are the same from both parsers wherever libyaml is asked and does not refuse it."""
    if yaml.__with_libyaml__ and not _DISPUTED.search(text):
        with contextlib.suppress(yaml.YAMLError):
            return _LibyamlComposer(text).get_single_node()
    return _PythonComposer(text).get_single_node()


class _Builder:
    """Builds sections and items of YAML nodes, and gathers what is wrong."""

    def __init__(self, file: File, *, loose: bool = False) -> None:
        self.file = file
        self.loose = loose
        self.problems: list[Problem] = []
        self.repeats: list[Repeat] = []
        self.count = 0
        self.open: set[int] = set()

    def problem(self, node: Node, path: Loc, message: str) -> None:
        _, line, column = self.place(node)
        self.problems.append(Problem(self.file.name, line, column, key_path(path), message))

    def place(self, node: Node) -> Place:
        mark = node.start_mark
        return Place(self.file, mark.line + 1, mark.column + 1)

    def value(self, node: Node, path: Loc) -> object:
        self.count += 1
        many, deep = self.count > _MAX_VALUES, len(path) > MAX_DEPTH
        if many or deep:
            limit = f"more than {_MAX_VALUES} values" if many else f"nested deeper than {MAX_DEPTH} levels"
            self.problem(node, path[:deep], f"{limit}, including aliases")
            raise ConfigError(self.problems)
        if isinstance(node, ScalarNode):
            return _scalar(node)
        if id(node) in self.open:
            self.problem(node, path, "this anchor contains itself")
            return None
        self.open.add(id(node))
        found = self.section(node, path) if isinstance(node, MappingNode) else self.items(node, path)
        self.open.discard(id(node))
        return found

    def items(self, node: Node, path: Loc) -> Items:
        values = [self.value(item, (*path, index)) for index, item in enumerate(node.value)]
        return Items.of(values, [self.place(item) for item in node.value])

    def section(self, node: MappingNode, path: Loc) -> Section:
        values: dict[str, Any] = {}
        entries: dict[str, Entry] = {}
        for key_node, value_node in node.value:
            key = self.key(key_node, path)
            if key is None:
                continue
            if key in entries and self.loose:
                first, last = (place.line or 0 for place in (entries[key].key, self.place(key_node)))
                self.repeats.append(Repeat(key_path((*path, key)), first, last))
            elif key in entries:
                self.problem(key_node, (*path, key), f"given twice; first on line {entries[key].key.line}")
                continue
            entries[key] = Entry(self.place(key_node), self.place(value_node))
            values[key] = self.value(value_node, (*path, key))
        return Section(values, self.place(node), entries)

    def key(self, node: Node, path: Loc) -> str | None:
        key = _scalar(node) if isinstance(node, ScalarNode) else None
        if key == "<<" and isinstance(node, ScalarNode) and not node.style:
            self.problem(node, path, "merge keys '<<' are not allowed: write the keys out (a world may use 'extends')")
        elif isinstance(key, str):
            return key
        elif (self.loose or path[-1:] == _NUMBERED) and isinstance(key, int) and not isinstance(key, bool):
            return str(key)
        elif isinstance(node, ScalarNode):
            self.problem(node, path, f"key {node.value or 'nothing'} is not text; put it in quotes")
        else:
            self.problem(node, path, "a key must be a word, not a list or a mapping")
        return None


def _scalar(node: ScalarNode) -> object:
    """The value of a scalar by the rules of YAML 1.2; anything in quotes or in a block is text."""
    text = node.value
    if node.style or (text not in _SPECIAL and not _FLOAT.fullmatch(text)):
        return text
    if text in _SPECIAL:
        return _SPECIAL[text]
    return int(text) if _INT.fullmatch(text) and len(text) <= 300 else float(text)  # a longer one is infinite


def _problem_of(file: File, error: yaml.MarkedYAMLError) -> Problem:
    """PyYAML's error in our words, placed where the cause is rather than where it gave up."""
    problem, mark = str(error.problem), error.problem_mark
    if problem.startswith(_AT_THE_START) and error.context_mark:
        mark = error.context_mark
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    message = next((ours for theirs, ours in PYYAML.items() if problem.startswith(theirs)), problem)
    if problem.startswith("found character"):
        message = f"{problem.split(' ')[2]} cannot start a value; put it in quotes"
    if line <= len(file.lines) and re.fullmatch(r" *X[X ]*", file.lines[line - 1]):
        message = "a dock's row is indented less than its first row; start every row at the same column, "
        message += "or write a list of rows in quotes"
    return Problem(file.name, line, column, "", message)
