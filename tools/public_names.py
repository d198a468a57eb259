"""The public API as the sources have it, and what of it nobody has described: for the site and for tests/test_docs.py.

Sources are parsed, not imported, so that the site needs none of the extras.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

REPO = Path(__file__).resolve().parents[1]
SOURCES = REPO / "src"
REFERENCE = REPO / "docs" / "reference"
MODULES = (
    "vrx_mj",
    "vrx_mj.control",
    "vrx_mj.rl",
    "vrx_mj.recording",
)
"""Modules whose `__all__` is the public API."""
MADE_HERE = ("vrx_mj.runtime.", "vrx_mj.sensors.")
"""Packages whose classes users meet, but do not make."""
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Public:
    """A public name, where it is defined, and its definition."""

    path: str
    """Where users import it from, as `vrx_mj.Simulation`."""
    module: str
    node: ast.ClassDef | Function


def complaints() -> list[str]:
    """Public names that the reference lacks, and what in it has no description."""
    pages = "\n".join(page.read_text(encoding="utf-8") for page in sorted(REFERENCE.glob("*.md")))
    described = [each for name in re.findall(r"^::: (\S+)$", pages, re.M) for each in _described(name)]
    there = {(each.module, each.node.name) for each in described}
    missing = [each.path for each in public_names() if (each.module, each.node.name) not in there]
    arguments = (REFERENCE / "arguments.md").read_text(encoding="utf-8")
    common = {name for cell in re.findall(r"^\| (`.*?`) \|", arguments, re.M) for name in re.findall(r"`(\w+)`", cell)}
    lacking = [name for each in described for name in _undescribed(each.path, each.module, each.node, "", common)]
    return [
        *(f"{name} is public, and no page of docs/reference has it" for name in missing),
        *(f"{name} has no description" for name in dict.fromkeys(lacking)),
    ]


def public_names() -> list[Public]:
    """Everything that users import, once for each module that exports it."""
    found = [_resolved(module, name, f"{module}.{name}") for module in MODULES for name in _exported(module)]
    return found + _described("vrx_mj.errors")


def _described(path: str) -> list[Public]:
    """What a directive of a page describes: one name, or all that a module exports."""
    if _tree(path) is None:
        return [_resolved(*path.rpartition(".")[::2], path)]
    return [_resolved(path, name, f"{path}.{name}") for name in _exported(path)]


def _undescribed(path: str, module: str, node: ast.AST, above: str, common: set[str]) -> Iterator[str]:
    """A name without a docstring, its members that have none, and parameters that no docstring mentions."""
    assert isinstance(node, ast.ClassDef | Function)
    said = ast.get_docstring(node) or ""
    constructor = node.name == "__init__"
    if not said and not constructor:  # a class describes its constructor
        yield path
    if isinstance(node, ast.ClassDef):
        yield from _members(path, module, node, common)
        return
    for argument in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]:
        if argument.arg not in {"self", "cls", *common} and not _mentioned(argument.arg, f"{above} {said}"):
            yield f"{path}({argument.arg})"


def _members(path: str, module: str, node: ast.ClassDef, common: set[str]) -> Iterator[str]:
    """Public methods, properties and annotated attributes of a class, and those of the bases that are ours."""
    said = ast.get_docstring(node) or ""
    for base in node.bases:
        found = _found(module, base.id) if isinstance(base, ast.Name) else None
        if found is not None and isinstance(found[1], ast.ClassDef):
            yield from _members(path, *found, common)
    for member, after in zip(node.body, [*node.body[1:], None], strict=True):
        if isinstance(member, Function) and (not member.name.startswith("_") or _constructs(path, member)):
            yield from _undescribed(f"{path}.{member.name}", module, member, said, common)
        elif isinstance(member, ast.AnnAssign) and isinstance(member.target, ast.Name):
            described = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            if not member.target.id.startswith("_") and not described:
                yield f"{path}.{member.target.id}"


def _constructs(path: str, member: Function) -> bool:
    """Whether it is the constructor of something that users make, not the package alone."""
    return member.name == "__init__" and not path.startswith(MADE_HERE)


def _mentioned(name: str, words: str) -> bool:
    return re.search(rf"\b{re.escape(name)}\b", words) is not None


@cache
def _tree(module: str) -> ast.Module | None:
    stem = SOURCES.joinpath(*module.split("."))
    file = next((file for file in (stem / "__init__.py", stem.with_suffix(".py")) if file.is_file()), None)
    return ast.parse(file.read_text(encoding="utf-8")) if file else None


def _exported(module: str) -> list[str]:
    """A package's `__all__`, or the classes of a module."""
    tree = _tree(module)
    assert tree is not None, module
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return list(ast.literal_eval(node.value))
    return [node.name for node in tree.body if isinstance(node, ast.ClassDef)]


def _resolved(module: str, name: str, path: str) -> Public:
    found = _found(module, name)
    if found is None:
        raise LookupError(f"{path} is not defined in {SOURCES}")
    return Public(path, *found)


def _found(module: str, name: str) -> tuple[str, ast.ClassDef | Function] | None:
    """Module and definition of a name that a module defines or imports."""
    tree = _tree(module)
    for node in ast.walk(tree) if tree else ():
        if isinstance(node, ast.ClassDef | Function) and node.name == name and node in tree.body:
            return module, node
        if isinstance(node, ast.ImportFrom) and node.module and any((a.asname or a.name) == name for a in node.names):
            original = next(a.name for a in node.names if (a.asname or a.name) == name)
            return _found(node.module, original)
    return None


if __name__ == "__main__":
    raise SystemExit("\n".join(complaints()))
