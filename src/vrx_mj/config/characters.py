"""Characters that look like the ones YAML wants: full-width forms, curly quotes, foreign letters, odd spaces.

They are looked for where they matter: not in comments, and not in the free text of a `description`.
"""

import heapq
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

__all__ = ["Odd", "find_controls", "find_lookalikes"]


class Odd(NamedTuple):
    """A character that should not be there. Line and column count from 1."""

    line: int
    column: int
    message: str


PUNCTUATION = {
    "!": "exclamation mark", '"': "quotation mark", "#": "hash sign", "%": "percent sign", "&": "ampersand",
    "'": "apostrophe", "(": "parenthesis", ")": "parenthesis", "*": "asterisk", "+": "plus sign",
    ",": "comma", "-": "hyphen", ".": "full stop", "/": "slash", ":": "colon", ";": "semicolon",
    "<": "less-than sign",
    "=": "equals sign", ">": "greater-than sign", "?": "question mark", "@": "at sign", "[": "bracket",
    "\\": "backslash", "]": "bracket", "_": "underscore", "{": "brace", "|": "bar", "}": "brace",
    "~": "tilde",
}  # fmt: skip

WIDE = {
    chr(code + 0xFEE0): (f"full-width {PUNCTUATION.get(chr(code), chr(code))}", chr(code))
    for code in range(0x21, 0x7F)
    if chr(code) not in "$^`"
}
LIKE = {
    "、": ("ideographic comma", ","),
    "。": ("ideographic full stop", "."),
    "︰": ("vertical colon", ":"),
    "【": ("Chinese bracket", "["),
    "】": ("Chinese bracket", "]"),
    "〔": ("Chinese bracket", "["),
    "〕": ("Chinese bracket", "]"),
    "「": ("corner quote", '"'),
    "」": ("corner quote", '"'),
    "“": ("curly quote", '"'),
    "”": ("curly quote", '"'),
    "„": ("low quote", '"'),
    "‘": ("curly quote", "'"),
    "’": ("curly quote", "'"),
    "‐": ("hyphen", "-"),
    "‑": ("non-breaking hyphen", "-"),
    "–": ("dash", "-"),
    "—": ("long dash", "-"),
    "−": ("minus sign", "-"),
    "×": ("multiplication sign", "X"),
    "…": ("ellipsis", "..."),
}
SPACES = {chr(code): "wide or narrow space" for code in range(0x2000, 0x200B)} | {
    "\u00a0": "non-breaking space",
    "\u202f": "narrow non-breaking space",
    "\u205f": "mathematical space",
    "\u3000": "ideographic space",
    "\t": "tab",
}
_MARKS = (0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
INVISIBLE = {chr(code): "invisible character" for code in _MARKS} | {
    "\u00ad": "soft hyphen",
    "\u200b": "zero-width space",
    "\u200c": "zero-width character",
    "\u200d": "zero-width character",
    "\u2060": "zero-width character",
    "\ufeff": "byte-order mark",
}  # fmt: skip
_CYRILLIC = dict(zip("АВЕЅІЈКМНОРСТУХаеорсухѕіј", "ABESIJKMHOPCTYXaeopcyxsij", strict=True))
_GREEK = dict(zip("ΑΒΕΖΗΙΚΜΝΟΡΤΥΧο", "ABEZHIKMNOPTYXo", strict=True))
LETTERS = {odd: ("Cyrillic letter", plain) for odd, plain in _CYRILLIC.items()} | {
    odd: ("Greek letter", plain) for odd, plain in _GREEK.items()
}

_SINGLE = re.compile(f"[{re.escape(''.join([*WIDE, *LIKE, *SPACES, *INVISIBLE]))}]")
_WORD = re.compile(r"\w+")
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufffe\uffff]")
_QUOTE_OR_COMMENT = re.compile(r"""(?:(?<=[\s\[{,:(])|^)["']|(?:(?<=\s)|^)#""")
_DESCRIPTION = re.compile(r"""^(\s*(?:- +)*)(["']?)description\2\s*:(?=\s|$)""")
_DESCRIPTION_INSIDE = re.compile(r"""(?<=[{,])\s*description\s*:\s*("[^"]*"|'[^']*'|[^,}]*)""")


def find_controls(lines: Sequence[str]) -> Iterator[Odd]:
    """Control characters and odd line separators, which no text file needs anywhere."""
    for row, line in enumerate(lines, 1):
        for hit in _CONTROL.finditer(line):
            yield Odd(row, hit.start() + 1, f"control character U+{ord(hit[0]):04X}; delete it")


def find_lookalikes(lines: Sequence[str], *, free_text: bool = True) -> Iterator[Odd]:
    """Look-alikes outside comments and, where the file has such keys (`free_text`), descriptions."""
    indent: int | None = None  # of the `description` key that the line may still belong to
    for row, line in enumerate(lines, 1):
        depth = len(line) - len(line.lstrip(" "))
        if indent is not None and (not line.strip() or depth > indent):
            continue
        code = _without_comment(line)
        start = _DESCRIPTION.match(code) if free_text else None
        indent = len(start[1]) if start else None
        code = code[: start.end()] if start else _DESCRIPTION_INSIDE.sub(_blank, code) if free_text else code
        yield from (Odd(row, column + 1, message) for column, message in _in_code(code))


def _blank(match: re.Match[str]) -> str:
    return " " * len(match[0])


def _without_comment(line: str) -> str:
    """The line up to its comment; a '#' inside quotes is none."""
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
    single = ((hit.start(), _advice(hit[0])) for hit in _SINGLE.finditer(code))
    letters = (
        (word.start() + index, _advice(letter))
        for word in _WORD.finditer(code)
        if _mixed(word[0])
        for index, letter in enumerate(word[0])
        if letter in LETTERS
    )
    yield from heapq.merge(single, letters)


def _mixed(word: str) -> bool:
    """Foreign letters are fine in foreign words, not next to Latin ones nor where all look Latin."""
    letters = [letter for letter in word if letter.isalpha()]
    return any(letter.isascii() for letter in letters) or all(letter in LETTERS for letter in letters)


def _advice(character: str) -> str:
    code = f"U+{ord(character):04X}"
    if character == "\t":
        return "tab; type spaces"
    if character in SPACES:
        return f"{SPACES[character]} {code}; type a space"
    if character in INVISIBLE:
        return f"{INVISIBLE[character]} {code}; delete it"
    name, plain = WIDE.get(character) or LIKE.get(character) or LETTERS[character]
    return f"{name} {code}; type " + (f"'{plain}'" if plain != "'" else '"\'"')
