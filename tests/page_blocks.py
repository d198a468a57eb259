"""Blocks of a page of the documentation in order, and what its comments say of them.

Comments stand before their block. `file: NAME`: save it so. `not run: REASON`. `needs: pictures`: only where cameras
can be drawn. `expect: REGEX` in what it prints, `server says: REGEX` in what the server prints meanwhile, `moves: BOAT
METRES`: how far the boat gets from where it was, `writes: FILE`. `Ctrl-C`: it goes on until all that has come, `Ctrl-C:
N s`: and so long after that; `beside`: until the next heading. `tested with: TEXT -> TEXT`: what a test replaces to be
quicker. A block of text is what the block before it prints, or the error that it `raises`, without some of the lines;
`printed by: COMMAND`: what a command prints, `with: FILE: TEXT -> TEXT`: after a change of a file.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PIECE = re.compile(
    r"^<!-- (?P<note>.*?) -->$|^(?P<heading>#+ [^\n]*)$|^```(?P<kind>\w+)\n(?P<text>.*?)^```$", re.M | re.S
)
NOTE = re.compile(
    r"(file|not run|needs|expect|server says|moves|writes|Ctrl-C|beside|raises|tested with|printed by|with)(?:: (.*))?",
    re.S,
)


@dataclass(frozen=True)
class Block:
    """A fenced block, and what is said about it."""

    kind: str
    text: str
    place: str
    notes: tuple[tuple[str, str], ...]

    def note(self, key: str) -> str | None:
        """What it says under a key, '' if no more than that; None: nothing."""
        return dict(self.notes).get(key)


def pieces(page: Path) -> Iterator[Block | str]:
    """The blocks and headings of a page, in order."""
    text = page.read_text(encoding="utf-8")
    notes: list[tuple[str, str]] = []
    for piece in PIECE.finditer(text):
        if piece["heading"]:
            yield piece["heading"]
        elif piece["kind"]:
            line = text.count("\n", 0, piece.start()) + 1
            yield Block(piece["kind"], piece["text"], f"{page.name}:{line}", tuple(notes))
            notes = []
        else:
            said = NOTE.fullmatch(piece["note"])
            assert said, f"{page.name}: a comment that says nothing: {piece['note']}"
            notes.append((said[1], said[2] or ""))
    assert not notes, f"{page.name}: comments without a block: {notes}"


def missing(block: Block, said: str) -> list[str]:
    """Lines of a block that are not among the lines of an output in this order; `...` stands for any."""
    printed = (line.rstrip() for line in said.splitlines())
    return [line for line in block.text.splitlines() if line != "..." and line.rstrip() not in printed]


def blocks(page: Path) -> list[Block]:
    """The blocks of a page, in order."""
    return [piece for piece in pieces(page) if isinstance(piece, Block)]
