"""Mutants at random places of the source: operators flipped, constants changed, terms and guards dropped.

Left alone is what is known to change nothing that a program does: annotations, docstrings and texts with values in
them; decorators, and keyword arguments in `WITHOUT_EFFECT`, which are about speed or guard against mistakes of ours, as
`assert` does; imports for type checkers. A comparison on the border of which no number lies, a limit that is one larger
or a cache that is never emptied are drawn, though no test may see them: the generator cannot know.
"""

import ast
import copy
import itertools
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from mutants.catalogue import ROOT, Mutant

SOURCES = ROOT / "src" / "vrx_mj"
COMPARISONS = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
WITHOUT_EFFECT = {"strict", "frozen", "slots", "kw_only", "eq", "repr", "cache", "nogil"}
"""Keyword arguments whose values no test can see, or that only guard against mistakes of ours."""
LEFT_ALONE = (ast.JoinedStr, ast.Assert, ast.Import, ast.ImportFrom)


@dataclass(frozen=True)
class Edit:
    """A node, and the text that stands in its place."""

    kind: str
    node: ast.expr | ast.stmt
    new: str


def draw(count: int, seed: int, only: Sequence[str] = ()) -> list[Mutant]:
    """Mutants at different places, of all packages or some; equal for the same seed and source."""
    rng = random.Random(seed)
    files = [file for entry in only or ["."] for file in _sources(SOURCES / entry)]
    texts = {file: file.read_text(encoding="utf-8") for file in files}
    nodes = [(file, node) for file, text in texts.items() for node in mutable(ast.parse(text))]
    rng.shuffle(nodes)
    places = ((file, edits) for file, node in nodes if (edits := list(edits_of(node))))
    return [_mutant(file, texts[file], rng.choice(edits)) for file, edits in itertools.islice(places, count)]


def all_of(file: Path) -> Iterator[Mutant]:
    """All that can be drawn of a source."""
    text = file.read_text(encoding="utf-8")
    return (_mutant(file, text, edit) for node in mutable(ast.parse(text)) for edit in edits_of(node))


def _sources(entry: Path) -> list[Path]:
    return sorted(entry.rglob("*.py")) if entry.is_dir() else [entry.with_suffix(".py")]


def _mutant(file: Path, text: str, edit: Edit) -> Mutant:
    """The edit as a text that occurs once: the lines of its node, and as many of those around as that takes."""
    starts = [0]
    for line in text.split("\n"):
        starts.append(starts[-1] + len(line) + 1)
    node, name = edit.node, file.relative_to(SOURCES).as_posix()
    begin, end = (
        starts[row - 1] + len(text[starts[row - 1] : starts[row]].encode()[:column].decode())
        for row, column in ((node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0))
    )
    below = ((starts[node.lineno - 1], at) for at in starts[node.end_lineno or 0 :])
    above = ((at, len(text)) for at in reversed(starts[: node.lineno]))
    first, last = next(span for span in (*below, *above) if text.count(text[slice(*span)]) == 1)
    new = text[first:begin] + edit.new + text[end:last]
    label = f"{node.lineno}: {' '.join(text[begin:end].split())} -> {edit.new}"
    return Mutant(label, name, edit.kind, text[first:last], new)


def mutable(node: ast.AST) -> Iterator[ast.AST]:
    """A node and those below it, without annotations, decorators, docstrings and what tests cannot see."""
    if isinstance(node, LEFT_ALONE) or (isinstance(node, ast.keyword) and node.arg in WITHOUT_EFFECT):
        return
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    yield node
    for name, value in ast.iter_fields(node):
        if name not in {"annotation", "returns", "decorator_list"}:
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from mutable(child)


def edits_of(node: ast.AST) -> Iterator[Edit]:
    """What may be made of a node."""
    match node:
        case ast.Compare(ops=[op]) if type(op) in COMPARISONS:
            yield _with_fields("comparison", node, ops=[COMPARISONS[type(op)]()])
        case ast.BinOp(op=op) if type(op) in ARITHMETIC:
            yield _with_fields("sign", node, op=ARITHMETIC[type(op)]())
            yield Edit("dropped term", node, f"({ast.unparse(node.left)})")
        case ast.BoolOp(op=op, values=values):
            yield _with_fields("comparison", node, op=ast.Or() if isinstance(op, ast.And) else ast.And())
            yield from (_with_fields("dropped term", node, values=kept) for kept in (values[1:], values[:-1]))
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            yield Edit("sign", node, f"({ast.unparse(operand)})")
        case ast.Constant(value=bool(value)):
            yield Edit("wrong value", node, str(not value))
        case ast.Constant(value=int(value) | float(value)):
            yield Edit("constant", node, f"({value} + 1)" if isinstance(value, int) or not value else f"(2 * {value})")
        case ast.Call(func=ast.Name(id="min" | "max"), args=[first, _], keywords=[]):
            yield Edit("removed guard", node, f"({ast.unparse(first)})")
        case ast.If(test=test, orelse=[]):
            yield Edit("removed guard", test, "False")
        case ast.Expr(value=ast.Call()) | ast.AugAssign():
            yield Edit("dropped term", node, "pass")


def _with_fields(kind: str, node: ast.expr, **fields: object) -> Edit:
    """The node with some other fields."""
    new = copy.copy(node)
    vars(new).update(fields)
    return Edit(kind, node, f"({ast.unparse(new)})")
