"""The tree of parameters, whom a change concerns, and names."""

from xmlrpc.client import Binary

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import CommandError
from vrx_mj.ros.parameters import MOST_BYTES, Parameters, is_legal, is_type, resolve, updates

KEYS = st.lists(st.sampled_from("abc"), min_size=1, max_size=4).map(lambda parts: "/" + "/".join(parts))
VALUES = st.recursive(
    st.one_of(st.integers(-9, 9), st.text("xy", max_size=3), st.lists(st.integers(0, 1), max_size=2)),
    lambda inner: st.dictionaries(st.sampled_from("abc"), inner, max_size=2),
    max_leaves=4,
)


@pytest.fixture
def tree():
    parameters = Parameters()
    parameters.set("/", {"robot": {"arm": 1}, "pr2": {"robot": {"base": 2}, "list": [1, 2]}})
    return parameters


def test_values_and_trees_are_got_set_and_deleted(tree):
    assert tree.get("/pr2/robot") == {"base": 2}
    assert tree.get("/pr2/list/") == [1, 2]
    tree.set("/pr2/list/deep", "x")  # what is no namespace becomes one
    assert tree.get("/pr2") == {"robot": {"base": 2}, "list": {"deep": "x"}}
    assert tree.names() == ["/robot/arm", "/pr2/robot/base", "/pr2/list/deep"]
    tree.delete("/pr2/robot")
    assert not tree.has("/pr2/robot/base")
    for key in ("/none", "/pr2/robot", "/robot/arm/deeper", "/"):
        with pytest.raises(KeyError):
            tree.delete(key)


def test_a_search_goes_upwards_and_looks_at_the_first_part(tree):
    assert tree.search("/pr2/foo", "robot") == "/pr2/robot"
    assert tree.search("/pr2/foo", "robot/arm") == "/pr2/robot/arm"  # though there is none: as rosmaster has it
    assert tree.search("/foo/bar", "robot/arm") == "/robot/arm"
    assert tree.search("/pr2", "/robot") == "/robot"
    assert tree.search("/pr2", "none") is None


def test_bytes_count_as_text_does():
    one = Parameters()
    with pytest.raises(CommandError) as caught:
        one.set("/a", [Binary(b"x" * MOST_BYTES)])
    assert str(caught.value) == f"more than {MOST_BYTES} bytes of parameters"


@given(st.lists(st.tuples(KEYS, VALUES), max_size=8), KEYS)
def test_what_was_counted_is_what_is_there(pairs, gone):
    parameters, again = Parameters(), Parameters()
    for key, value in pairs:
        parameters.set(key, value)
    if parameters.has(gone):
        parameters.delete(gone)
    again.set("/", parameters.tree)
    assert parameters._bytes == again._bytes


def test_too_deep_too_much_and_no_root(tree):
    for key, value in (("/" + "a/" * 33, 1), ("/", 5)):
        with pytest.raises(CommandError) as caught:
            tree.set(key, value)
        assert str(caught.value) == f"cannot set {key}: the root must be a dictionary, with names of at most 32 levels"
    with pytest.raises(CommandError) as caught:
        tree.set("/big", "x" * MOST_BYTES)
    assert str(caught.value) == f"more than {MOST_BYTES} bytes of parameters"


@pytest.mark.parametrize(
    ("subscribed", "key", "value", "told"),
    [
        ("/a", "/a", 1, ("/a/", 1)),
        ("/a", "/a/b", 1, ("/a/b/", 1)),
        ("/", "/a", 1, ("/a/", 1)),
        ("/a/b", "/a", {"b": {"c": 2}}, ("/a/b/", {"c": 2})),
        ("/a/b", "/a", {"c": 2}, ("/a/b/", {})),
        ("/a/b", "/a", {}, ("/a/b/", {})),
        ("/a/b", "/a", 7, ("/a/b/", {})),
        ("/a/b", "/a/bc", 1, None),
        ("/a/b", "/c", {"b": 1}, None),
    ],
)
def test_a_change_concerns_those_above_it_and_those_in_it(subscribed, key, value, told):
    found = [(one.key, one.value) for one in updates([subscribed], key, value)]
    assert found == ([] if told is None else [told])


def test_names_are_resolved_as_a_node_means_them():
    assert resolve("/x//y/", "/ns/node") == "/x/y"
    assert resolve("x/y", "/ns/node") == "/ns/x/y"
    assert resolve("~x", "/ns/node") == "/ns/node/x"
    assert resolve("x", "node") == "/x"
    assert [is_legal(name) for name in ("/a1/_b", "~x", "1a", "", "a b", "a\n", 5, "a" * 1025)] == [True] * 2 + [
        False
    ] * 6
    assert [is_type(name) for name in ("*", "std_msgs/Int8", "Int8", "a/b/c", None)] == [True] * 2 + [False] * 3
