"""What `tests/figures.py` counts, on small sources."""

import ast

from figures import code_lines, cycles, imports, limits, signatures

SOURCE = '''"""A module's
docstring."""

from typing import Any  # a comment beside code

# a comment

LIST = [
    1,

    2,
]
"""Of the list."""


def taken(given: dict[str, Any]) -> None:
    """A function's docstring."""
    text = """two
lines"""


def typed(given: int) -> int:
    return given
'''


def test_code_lines_are_without_blanks_comments_and_docstrings():
    assert code_lines(SOURCE) == 10


def test_a_signature_with_any_somewhere_in_it_counts():
    assert signatures(ast.parse(SOURCE)) == (2, 1)


def test_limits_count_once_by_name_wherever_they_are_used():
    texts = ["MOST_ROWS = 3", "x = min(x, MOST_ROWS) if _LONGEST_NAME else LARGEST"]
    assert limits(texts) == {"MOST_ROWS", "_LONGEST_NAME"}


def test_cycles_are_found_through_deferred_imports_too():
    trees = {
        "p.a": ast.parse("from p import b"),
        "p.b": ast.parse("def f():\n    from p.c import g"),
        "p.c": ast.parse("if TYPE_CHECKING:\n    import p.a"),
        "p.d": ast.parse("import p.a, numpy"),
    }
    graph = imports(trees)
    assert graph == {"p.a": {"p.b"}, "p.b": {"p.c"}, "p.c": {"p.a"}, "p.d": {"p.a"}}
    assert cycles(graph) == [{"p.a", "p.b", "p.c"}]
