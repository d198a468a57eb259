"""Expressions against Python's own `eval`, and what they refuse."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.formats.urdf.expression_values import GLOBALS, MATH, Budget, ExpressionError, Module, python_module
from vrx_mj.formats.urdf.expressions import Names, evaluate

PROPERTIES = {"width": 2.4, "posts": [1, 2, 3], "name": "wamv", "mass": {"hull": 90, "deck": 30}, "on": True}
MODULES = {"math": Module("math", MATH), "python": python_module()}
BUILTIN = {name: getattr(__builtins__, name, None) or __builtins__[name] for name in (
    "abs", "all", "any", "bool", "dict", "divmod", "enumerate", "filter", "float", "int", "len", "list", "map", "max",
    "min", "ord", "range", "repr", "reversed", "round", "sorted", "str", "sum", "tuple", "zip",
)}  # fmt: skip


def value(text, **more):
    """What our evaluator makes of an expression."""
    table = {**GLOBALS, **MODULES, **PROPERTIES, **more}
    return evaluate(text, Names(table, lambda: {**PROPERTIES, **more}), Budget())


def pythons(text):
    """What Python makes of it."""
    names = {name: thing for name, thing in vars(math).items() if not name.startswith("_")}
    return eval(text, {**BUILTIN, **names, **PROPERTIES, "math": math})  # noqa: S307 - texts of this file


def refusal(text, **more):
    """Why it is refused."""
    with pytest.raises(ExpressionError) as caught:
        value(text, **more)
    return str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "1 + 2 * 3 - 4 / 5 // 1 % 7", "2 ** 10", "-width", "+1", "~5", "not on", "1 << 4 | 3 & 1 ^ 2 >> 1",
        "width / 2 if on else 0", "on and width", "not on or 'a'", "1 < width <= 3 != 4", "2 in posts",
        "5 not in posts", "None is None", "'wa' in name", "posts[0]", "posts[-1]", "posts[1:]", "posts[::-1]",
        "name[1:3]", "mass['hull']", "[x * 2 for x in posts]", "[x for x in posts if x > 1]",
        "[(x, y) for x in posts for y in 'ab']", "sum(x for x in posts)", "{k: v for k, v in mass.items()}",
        "[a + b for a, (b, c) in [(1, (2, 3))]]", "radians(15)", "degrees(pi / 2)",
        "sin(0.3) + cos(0.2) * tan(0.1)", "atan2(1, 2)", "sqrt(2)", "hypot(3, 4)", "math.pi", "math.floor(2.7)",
        "fabs(-3)", "min(3, 1, 2)", "max(posts)", "min(posts, key=abs)", "min([], default=4)", "abs(-2)",
        "round(2.567, 2)", "round(2.5)", "len(posts)", "int('12')", "float('1e-3')", "str(1.50)", "bool('')",
        "list('abc')", "dict(a=1, b=[2])", "tuple(posts)", "list(range(3))", "range(2, 8)[2]", "sorted([3, 1, 2])",
        "sorted(['bb', 'a'], key=len, reverse=True)", "sum(posts)", "sum(posts, 10)", "list(zip(posts, 'abc'))",
        "any([0, 1])", "all([])", "list(map(float, '1 2.5'.split()))", "list(filter(bool, [0, 1, '']))",
        "list(enumerate('ab'))", "list(reversed(posts))", "divmod(7, 2)", "ord('a')", "repr('a')", "max(*posts)",
        "[*posts, 4]", "(1,)", "()", "[]", "'a' + \"b\"", "'ab' * 3", "[0] * 3", "'%.2f m' % width",
        "'%s-%03d' % (name, 7)", "name.upper()", "' a '.strip()", "'a,b'.split(',')", "'-'.join(['a', 'b'])",
        "name.replace('w', 'W')", "name.startswith('wa')", "'7'.zfill(3)", "'a'.center(5, '*')", "name.find('m')",
        "mass.get('keel', 0)", "list(mass.keys())", "sorted(mass.values())", "posts.index(2)", "posts.count(9)",
        "1_000", "0x10", "1e3", "'\\t'", "factorial(5)", "comb(5, 2)", "prod([2, 3.5])", "lcm(4, 6)", "gcd(12, 18)",
        "inf", "tau", "0.1 + 0.2", "True + True",
    ],
)  # fmt: skip
def test_an_expression_is_worth_what_python_says(text):
    ours, theirs = value(text), pythons(text)
    assert (ours, type(ours)) == (theirs, type(theirs))


NUMBERS = st.one_of(st.integers(-1000, 1000), st.floats(-1e3, 1e3, allow_nan=False).map(lambda x: round(x, 3)))
TREES = st.recursive(
    NUMBERS.map(lambda number: f"({number})"),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "//", "%", "<", "==", ">="]), inner).map(
            lambda parts: f"({' '.join(parts)})"
        ),
        st.tuples(inner, inner, inner).map(lambda parts: "({} if {} else {})".format(*parts)),
        inner.map(lambda part: f"abs(-{part})"),
        st.lists(inner, min_size=1, max_size=3).map(lambda parts: f"max([{', '.join(parts)}])"),
    ),
    max_leaves=12,
)


@given(text=TREES)
def test_arithmetic_is_pythons(text):
    try:
        theirs = pythons(text)
    except (ZeroDivisionError, OverflowError):
        with pytest.raises(ExpressionError):
            value(text)
        return
    assert repr(value(text)) == repr(theirs)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("widht", "no property named 'widht'; did you mean 'width'?"),
        ("beam", "no property named 'beam'; known: mass, name, on, posts, width"),
        ("Pi", "no property named 'Pi'; did you mean 'pi'?"),
        ("radian(3)", "no function named 'radian'; did you mean 'radians'?"),
        ("math.sine(3)", "no member of math named 'sine'; did you mean 'sin'?"),
        ("width(3)", "'width' is not a function"),
        ("width + name", "'+' does not work with a number and text"),
        ("-name", "'-' does not work with text"),
        ("1 / 0", "division by zero"),
        ("2.0 ** 5000", "'**': the result is too large"),
        ("(-8) ** 0.5", "gives a complex number, which a robot file cannot hold"),
        ("sqrt(-1)", "sqrt: not defined for this value"),
        ("exp(1000)", "exp: the result is too large"),
        ("float('1.2m')", "float: '1.2m' is not a number"),
        ("int('1.2')", "int: '1.2' is not a whole number"),
        ("sum(3)", "sum: does not work with a number"),
        ("len(3)", "len: does not work with a number"),
        ("radians('a')", "radians: does not work with text"),
        ("min(1, 'a')", "min: does not work with a number and text"),
        ("map(radians, 3)", "map: does not work with 'radians' and a number"),
        ("radians(1, 2)", "radians: math.radians() takes exactly one argument (2 given)"),
        ("posts[3]", "item 3 of 3: a list counts from 0"),
        ("mass['keel']", "no key named 'keel'; known: hull, deck"),
        ("posts['a']", "'posts['a']': text cannot be an index here"),
        ("width[0]", "'width[0]': takes an item of a number"),
        ("[a for a, b in posts]", "expected 2 values for '(a, b)', got 1"),
        ("[x for x in width]", "'width' is a number, not a list"),
        ("{[]: 1}", "a list or mapping cannot be a key"),
        ("", "is empty"),
        ("1 +", "is not an expression"),
        ("a = 1", "is not an expression"),
        ("(1 + 2", "is not an expression: '(' was never closed"),
        ("{'a'", "is not an expression: '{' was never closed; an expression ends at the first '}'"),
        ("radians", "'radians' is a function; call it: radians(...)"),
        ("[radians]", "'radians' is a function; call it: radians(...)"),
        ("math", "'math' is not a value; write math.NAME"),
        ("lambda: 1", "user-defined functions (lambda): not allowed in a robot file"),
        ("(x := 1)", "assignments (:=): not allowed in a robot file"),
        ("f'{name.__class__}'", "f-strings: not allowed in a robot file"),
        ("{1, 2}", "sets: not allowed in a robot file"),
        ("{x for x in posts}", "sets: not allowed in a robot file"),
        ("dict(**mass)", "'**': not allowed in a robot file"),
        ("{**mass}", "'**': not allowed in a robot file"),
        ("1 @ 2", "'@': not allowed in a robot file"),
        ("b'a'", "b'a': not allowed in a robot file"),
        ("2j", "2j: not allowed in a robot file"),
        ("...", "...: not allowed in a robot file"),
        ("'{0.__class__}'.format(1)", "'.format': text has no such member in a robot file"),
        ("name.format_map(mass)", "'.format_map': text has no such member in a robot file"),
        ("posts.append(4)", "'.append': a list has no such member in a robot file"),
        ("mass.pop('hull')", "'.pop': a mapping has no such member in a robot file"),
        ("'\\x00'", "text has character U+0000, which a robot file cannot hold"),
        ("'a' * 10 ** 9", "repeats a text to more than 20000 items"),
        ("10 ** 9 * [0]", "repeats a list to more than 20000 items"),
        ("9 ** 9 ** 9", "9 to the power 387420489 is too large"),
        ("1 << 10 ** 9", "'<<' by 1000000000: too large"),
        ("2 ** 4000 * 2 ** 4000", "a whole number of more than 4096 bits is too large"),
        ("range(10 ** 30)", "a list or mapping of more than 20000 values is too large"),
        ("[x for x in range(9999) for y in range(9999)]", "a list or mapping of more than 20000 values is too large"),
        ("factorial(10 ** 6)", "factorial: expected at most 500"),
        ("comb(10 ** 6, 5 * 10 ** 5)", "comb: expected at most 500"),
        ("prod([2 ** 4000] * 9)", "prod: the product is not a number, or too large"),
        ("lcm(*[2 ** 4000 + x for x in range(9)])", "lcm: the result is too large"),
        ("round(5, -10 ** 9)", "round to -1000000000 digits: at most 300"),
        ("'%9999999d' % 1", "'%9999999d': a width is at most 300"),
        ("'%*d' % (10 ** 9, 1)", "'%*d': a width is at most 300"),
        ("'a'.ljust(10 ** 9)", "repeats a text to more than 20000 items"),
        ("('a' * 9000).replace('a', 'bbbb')", "repeats a text to more than 20000 items"),
        ("('a' * 9000).join(list('abcd'))", "repeats a text to more than 20000 items"),
        ("sum([posts, posts], [])", "sum: expected numbers, got lists"),
        ("1 + " * 2000 + "1", "an expression of more than 5000 characters is too long"),
        (
            "[[x for x in range(5000)] for y in range(5000)]",
            "a list or mapping of more than 20000 values is too large",
        ),
    ],
)  # fmt: skip
def test_what_is_refused_and_why(text, message):
    assert refusal(text) == message


def test_lists_that_share_their_items_are_as_large_as_they_print():
    shared = [list(range(100))] * 100
    assert value("len(shared)", shared=shared) == 100
    assert refusal("str(shared)", shared=shared) == "a text of more than 20000 characters is too long"
    assert refusal("[shared, shared]", shared=shared) == "a list or mapping of more than 20000 values is too large"


def test_a_list_that_holds_itself_is_refused():
    endless = []
    endless.append(endless)
    assert refusal("endless", endless=endless) == "lists are nested deeper than 20 levels"


def test_nesting_ends_in_words():
    assert refusal("-" * 4000 + "1") in {
        "is not an expression, or nested too deeply",
        "nested too deeply: does something refer to itself?",
    }


def test_loop_variables_end_with_the_loop():
    assert refusal("[[x for x in posts], x]").startswith("no property named 'x'")
    assert value("[width for width in posts] + [width]") == [1, 2, 3, 2.4]


def test_a_budget_is_spent_and_ends():
    budget = Budget(1000)
    names = Names(GLOBALS)
    evaluate("1 + 1", names, budget)
    assert 0 < budget.left < 1000
    with pytest.raises(ExpressionError, match=r"^takes too much work to expand"):
        evaluate("sum([x for x in range(1000)])", names, budget)


@pytest.mark.parametrize(
    "text", ["1 < 2 < 3", "3 < 2 < 5", "1 < 5 > 3 < 4", "2 > 1 > 3", "1 == 1 != 2 >= 2", "0 < 0 < 1"]
)
def test_comparisons_in_a_chain_all_have_to_hold(text):
    assert value(text) is pythons(text)


def test_the_rest_of_a_chain_is_not_worked_out_once_one_fails():
    assert value("2 < 1 < 1 / 0") is False
