"""What `tests/figures.py` counts, on small sources, and the bounds of the whole."""

import ast
from pathlib import Path

import pytest
import yaml

from figures import code, cycles, figures, imports, limits, signatures

BOUNDS = yaml.safe_load((Path(__file__).parent / "figures.yaml").read_text(encoding="utf-8"))
LOOSE = 1.01
"""How far a bound may be above its figure."""

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


def test_code_is_without_blanks_comments_and_docstrings():
    assert code(SOURCE) == (10, 42)


def test_a_string_with_expressions_is_one_token_in_any_python():
    assert code("x = f'{a} and {b:{width}}' + 'c'\n") == (1, 5)


@pytest.mark.slow
def test_the_sources_weigh_no_more_than_they_may():
    found = figures()
    assert found.keys() == BOUNDS.keys()
    above = {name: (value, BOUNDS[name]) for name, value in found.items() if value > BOUNDS[name]}
    assert above == {}, "make it smaller, or raise the bound in tests/figures.yaml in a commit that says why"
    loose = {name: (value, BOUNDS[name]) for name, value in found.items() if BOUNDS[name] > LOOSE * value}
    assert loose == {}, "lower the bounds in tests/figures.yaml"


def test_a_signature_with_any_somewhere_in_it_counts():
    assert signatures(ast.parse(SOURCE)) == (2, 1)


def test_limits_count_where_they_get_their_values_by_all_their_names():
    text = "from there import MOST_ROWS\n_MAX_DEPTH: int = 3\nMAX_X2, _SHOWN = 4, MOST_ROWS\nLARGEST = MOST_HZ = 6"
    assert sorted(limits(ast.parse(text))) == ["LARGEST", "MAX_X2", "MOST_HZ", "_MAX_DEPTH"]


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
