"""The size and the shape of the sources: `python tests/figures.py`, from any folder; `tests/figures.yaml` bounds them.

Code lines have no blank lines, comments, docstrings and `__all__`; tokens are names, operators and literals of these.
String-key reads are those of a compiled world's parameters as a tree. Import cycles count imports within functions and
for type checking too. Lines of other files are those that are not blank.
"""

import ast
import io
import re
import tokenize
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

REPO = Path(__file__).resolve().parents[1]
SOURCE = REPO / "src" / "vrx_mj"
OTHERS: Mapping[str, tuple[str, ...]] = {
    "lines of scripts and templates": (".js", ".css", ".html", ".j2"),
    "lines of tables": (".json", ".yaml", ".csv"),
}
"""Files of src and assets that are no Python, by the names of their figures."""
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
"""Tokens that make no code line."""
LIMIT = re.compile(r"_?(MAX|MOST|LARGEST|LONGEST|DEEPEST)(_[A-Z0-9_]+)?")
"""Names of constants that bound what comes from outside, or what a computation or a controller does."""
TREE_READ = re.compile(r"(?i)world\.(parameters(\[|\.get\()|tree\b)")


def code(text: str) -> tuple[int, int]:
    """How many lines hold code, and how many tokens: of a string with expressions in it one, in any Python."""
    docs, lines, tokens, depth = set(_uncounted_lines(ast.parse(text))), set(), 0, 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in LAYOUT and token.start[0] not in docs:
            lines.update(range(token.start[0], token.end[0] + 1))
            depth -= tokenize.tok_name[token.type].endswith("STRING_END")
            tokens += depth == 0 and not tokenize.tok_name[token.type].endswith("STRING_END")
            depth += tokenize.tok_name[token.type].endswith("STRING_START")
    return len(lines), tokens


def code_lines(text: str) -> int:
    """How many lines hold code."""
    return code(text)[0]


def _uncounted_lines(tree: ast.AST) -> Iterator[int]:
    """Lines of docstrings and of `__all__`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            yield from range(node.lineno, (node.end_lineno or node.lineno) + 1)
        body = getattr(node, "body", None)
        for part in body if isinstance(body, list) else ():
            if (
                isinstance(part, ast.Expr)
                and isinstance(part.value, ast.Constant)
                and isinstance(part.value.value, str)
            ):
                yield from range(part.lineno, (part.end_lineno or part.lineno) + 1)


def limits(tree: ast.AST) -> list[str]:
    """Names of the constants of a module that bound something, each where it gets its value."""
    names = (node for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
    return [node.id for node in names if LIMIT.fullmatch(node.id)]


def signatures(tree: ast.AST) -> tuple[int, int]:
    """How many functions there are, and how many of them have `Any` in an annotation of their signature."""
    functions = [node for node in ast.walk(tree) if isinstance(node, FUNCTIONS)]
    return len(functions), sum(_takes_any(node) for node in functions)


def _takes_any(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    given = node.args
    arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    notes = [argument.annotation for argument in arguments if argument and argument.annotation]
    notes += [node.returns] if node.returns else []
    return any(isinstance(part, ast.Name) and part.id == "Any" for note in notes for part in ast.walk(note))


def module_name(path: Path) -> str:
    """A file's name as an import has it."""
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(trees: Mapping[str, ast.AST]) -> dict[str, set[str]]:
    """Modules of the package that each module imports, anywhere in it; `trees` by the modules' names."""
    found: dict[str, set[str]] = {name: set() for name in trees}
    for name, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                found[name] |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                whole = {f"{node.module}.{alias.name}" for alias in node.names}
                found[name] |= {each if each in trees else node.module for each in whole}
    return {name: {each for each in names if each in trees and each != name} for name, names in found.items()}


def cycles(graph: Mapping[str, set[str]]) -> list[set[str]]:
    """Groups of modules that import each other, however indirectly."""
    reached = {name: _reached(graph, name) for name in graph}
    groups = {frozenset({other for other in reached[name] if name in reached[other]}) for name in graph}
    return [set(group) for group in groups if group]


def _filled_lines(file: Path) -> int:
    return sum(bool(line.strip()) for line in file.read_text(encoding="utf-8").splitlines())


def _reached(graph: Mapping[str, set[str]], start: str) -> set[str]:
    found: set[str] = set()
    waiting = [start]
    while waiting:
        new = graph[waiting.pop()] - found
        found |= new
        waiting += new
    return found


def figures() -> dict[str, float]:
    """All figures, by their names."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(SOURCE.rglob("*.py"))}
    trees = {module_name(path): ast.parse(text) for path, text in texts.items()}
    graph = imports(trees)
    functions, loose = (sum(column) for column in zip(*map(signatures, trees.values()), strict=True))
    importers = Counter(name for names in graph.values() for name in names)
    rings = cycles({name: names - {"vrx_mj"} for name, names in graph.items() if name != "vrx_mj"})
    lines, tokens = (sum(column) for column in zip(*map(code, texts.values()), strict=True))
    others = [file for folder in (SOURCE, REPO / "assets") for file in folder.rglob("*") if file.is_file()]
    return {
        "code lines": lines,
        "tokens": tokens,
        **{
            name: sum(map(_filled_lines, (each for each in others if each.suffix in ends)))
            for name, ends in OTHERS.items()
        },
        "modules": len(texts),
        "modules imported by exactly one other": sum(count == 1 for count in importers.values()),
        "limit constants": sum(len(limits(tree)) for tree in trees.values()),
        "string-key reads of the world": sum(len(TREE_READ.findall(text)) for text in texts.values()),
        "signatures with Any, in a hundred": round(100.0 * loose / functions, 1),
        "import cycles": len(rings),
    }


if __name__ == "__main__":
    for name, value in figures().items():
        print(f"{name}: {value}")
