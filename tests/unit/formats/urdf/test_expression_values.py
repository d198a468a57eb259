"""No expression makes a value larger than an expression may hold, not even on the way to another."""

from contextlib import suppress

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from peak_memory import peak_memory
from vrx_mj.errors import ConfigError
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.formats.urdf.expression_values import (
    EVERYWHERE,
    GLOBALS,
    LONGEST_TEXT,
    METHODS,
    Budget,
    ExpressionError,
    Function,
    formatted,
)
from vrx_mj.formats.urdf.expressions import Names, evaluate

MOST = 12_000_000
"""Bytes: some values of the largest size, 20,000 texts of one character or 20,000 characters of 4 bytes."""
LARGE = {
    "text": "\U00010000" * 19_000,
    "listed": list(range(19_000)),
    "nested": [[0] * 90] * 90,
    "texts": ["\U00010000" * 1000] * 100,
    "mapping": dict.fromkeys(range(9000), "x"),
    "keys": dict.fromkeys([tuple(range(9000)), tuple(range(1, 9000))]),
    "number": 2**4000,
    "count": 19_000,
    "one": "x",
}


def value(text):
    return evaluate(text, Names({**GLOBALS, **LARGE}), Budget())


def refusal(text):
    """Why an expression is refused, having taken little memory."""
    found = []

    def refused():
        with pytest.raises(ExpressionError) as caught:
            value(text)
        found.append(str(caught.value))

    assert peak_memory(refused) < MOST
    return found[0]


WIDE = "a width is at most 300"
LONG = "a text of more than 20000 characters is too long"
MANY = "a list or mapping of more than 20000 values is too large"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("'%0000000000000000003000000000d' % 1", f"'%0000000000000000003': {WIDE}"),
        ("'%(x)900000000d' % dict(x=1)", f"'%(x)900000000d': {WIDE}"),
        ("'%.0000000900000000f' % 1.5", f"'%.0000000900000000f': {WIDE}"),
        ("'%-+ #0900000000x' % 1", f"'%-+ #0900000000x': {WIDE}"),
        ("'%.*f' % (900000000, 1.5)", f"'%.*f': {WIDE}"),
        ("'%" + "9" * 4400 + "d' % 1", f"'%{'9' * 19}': {WIDE}"),
        ("'%(x)s' * 2000 % dict(x=text)", LONG),
        ("'%(x)a' * 1000 % dict(x=text)", LONG),
        ("'%s' % listed", LONG),
        ("prod([text], start=10 ** 5)", "prod: the product is not a number, or too large"),
        ("map(one.ljust, [count] * 15000)", MANY),
        ("sorted([count] * 9000, key=one.ljust)", MANY),
        ("list(filter(one.ljust, [count] * 9000))", MANY),
        ("[one * 19000 for i in listed]", MANY),
        ("{i: one * 19000 for i in listed}", MANY),
        ("[" + "one * 19000, " * 300 + "]", MANY),
        ("sum(keys, ())", "sum: expected numbers, got lists"),
        ("sum([], listed)", "sum: expected numbers, got lists"),
        ("gcd(text, text)", "gcd: does not work with text and text"),
    ],
)  # fmt: skip
def test_what_would_be_large_is_refused_before_it_is_made(text, message):
    assert refusal(text) == message


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            "".join(f"<xacro:property name='p{n}' lazy_eval='false' value=\"${{'x' * 19000}}\"/>" for n in range(3000)),
            "4 MB of text",
        ),
        ("<xacro:property name='p' value=\"${'x' * 19000}\"/><a b=\"" + "${p}" * 4900 + '"/>', "4 MB of text"),
        ('<xacro:arg name="p" default="' + "x" * 19000 + '"/><a b="' + "$(arg p)" * 2000 + '"/>', "4 MB of text"),
        ("<xacro:property name='p' value=\"${'%0000000003000000000d' % 1}\"/><a b=\"${p}\"/>", WIDE),
        ("<a b=\"$(eval '%(x)900000000d' % dict(x=1))\"/>", "is not an expression"),
    ],
)
def test_texts_of_a_file_have_a_limit_altogether(body, message, tmp_path):
    """Uses and all, the texts that expressions make are as long as a long robot."""
    file = tmp_path / "boat.xacro"
    file.write_text(f'<robot name="b" xmlns:xacro="http://www.ros.org/wiki/xacro">{body}</robot>', encoding="utf-8")

    def refused():
        with pytest.raises(ConfigError, match=message):
            expand(file, packages={})

    assert peak_memory(refused) < 5 * MOST


NAMED = sorted(name for name, value in {**GLOBALS, **EVERYWHERE}.items() if isinstance(value, Function))
METHOD_NAMES = sorted({name for methods in METHODS.values() for name in methods})
SIGNS = ["+", "-", "*", "/", "//", "%", "**", "<<", "|", "&", "^"]
LEAVES = st.sampled_from([*LARGE, "9 ** 900", "1e308", "-1", "300", "'%'", "'%(x)'", "'s'", "'d'", "*listed"])
EXPRESSIONS = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, st.sampled_from(SIGNS), inner),
        st.builds("{}({}, {})".format, st.sampled_from(NAMED), inner, inner),
        st.builds("{}({})".format, st.sampled_from(NAMED), inner),
        st.builds("map({}, {})".format, st.sampled_from(NAMED), inner),
        st.builds("map({}.{}, {})".format, inner, st.sampled_from(METHOD_NAMES), inner),
        st.builds("{}.{}({}, {})".format, inner, st.sampled_from(METHOD_NAMES), inner, inner),
        st.builds("{}.{}({})".format, inner, st.sampled_from(METHOD_NAMES), inner),
        st.builds("[{} for i in {}]".format, inner, inner),
        st.builds("[{}, {}]".format, inner, inner),
        st.builds("dict(x={})".format, inner),
        st.builds("{}[::{}]".format, inner, inner),
    ),
    max_leaves=5,
)


@settings(max_examples=30, deadline=None)
@given(text=EXPRESSIONS)
@example(text="'%(x)s' * 2000 % dict(x=texts)")
@example(text="map(text.center, listed)")
@example(text="map(range, listed)")
@example(text="zip(listed, listed, listed, listed, listed, listed)")
def test_no_expression_of_large_values_takes_much_memory(text):
    def worked_out():
        with suppress(ExpressionError):
            value(text)

    assert peak_memory(worked_out) < MOST, text


PATTERNS = st.lists(
    st.one_of(
        st.sampled_from(["", "a", "%%", " b "]),
        st.builds(
            "%{}{}{}{}{}".format,
            st.text("-+ #0", max_size=3),
            st.sampled_from(["", "0", "7", "012"]),
            st.sampled_from(["", ".", ".0", ".3", ".003"]),
            st.sampled_from(["", "h", "l", "L"]),
            st.sampled_from("diouxXeEfFgGcrsay"),
        ),
    ),
    max_size=4,
).map("".join)
VALUES = st.one_of(
    st.integers(-9, 999),
    st.floats(),
    st.text("a%\U00010000", max_size=3),
    st.none(),
    st.lists(st.integers(), max_size=2),
)


REFUSED = object()


def outcome(call):
    """A result, or REFUSED: which of several mistakes is told is nobody's concern."""
    try:
        return call()
    except (TypeError, ValueError, OverflowError, KeyError):
        return REFUSED


@given(pattern=PATTERNS, values=st.one_of(VALUES, st.lists(VALUES, max_size=4).map(tuple)))
@example(pattern="%c", values=-1)
@example(pattern="%d%y", values=0)
@example(pattern="%", values=1)
@example(pattern="", values=())
def test_formatting_is_pythons(pattern, values):
    assert outcome(lambda: formatted(pattern, values, Budget())) == outcome(lambda: pattern % values)


@given(name=st.text("ab._ ", max_size=3), number=st.integers())
def test_formatting_by_names_is_pythons(name, number):
    assert formatted(f"<%({name})08.3f|%({name})s>", {name: number}, Budget()) == f"<%({name})08.3f|%({name})s>" % {
        name: number
    }


def test_the_longest_text_is_made():
    assert len(value(f"'%s' % ('x' * {LONGEST_TEXT})")) == LONGEST_TEXT
