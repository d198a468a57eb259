"""How text becomes keys and values: YAML 1.2 scalars, look-alikes, places, and never a foreign exception."""

import contextlib
import math
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from peak_memory import peak_memory
from vrx_mj.config import yaml_text
from vrx_mj.config.tree import File, Section, locate
from vrx_mj.config.world import load_world
from vrx_mj.config.yaml_text import find_lookalikes, parse, read_lines
from vrx_mj.errors import ConfigError, VrxError


def section(text):
    return parse(File("t.yaml", None, tuple(text.split("\n"))))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("1E3", 1000.0),
        ("-.5", -0.5),
        ("5.", 5.0),
        ("+7", 7),
        ("010", 10),
        ("0o17", "0o17"),
        ("1_000", "1_000"),
        ("1:30", "1:30"),
        ("2022-08-17", "2022-08-17"),
        ("yes", "yes"),
        ("off", "off"),
        ("true", True),
        ("null", None),
        ("~", None),
        ("", None),
        ("'5'", "5"),
        ("=", "="),
    ],
)
def test_scalars_read_as_yaml_1_2(text, value):
    read = section(f"key: {text}")["key"]
    assert (read, type(read)) == (value, type(value))


def nodes(compose, text):
    """What is made of a text, with all places: nested tuples, or the error and where.

    A node that an alias repeats is its number after the first time: files full of aliases stand for millions of nodes.
    """
    numbers = {}

    def plain(node):
        if id(node) in numbers:
            return numbers[id(node)]
        numbers[id(node)] = len(numbers)
        inside = node.value if isinstance(node, yaml.ScalarNode) else [
            [plain(part) for part in (item if isinstance(item, tuple) else (item,))] for item in node.value
        ]  # fmt: skip
        return node.id, node.start_mark.line, node.start_mark.column, getattr(node, "style", None) or None, inside

    try:
        node = compose(text)
    except yaml.MarkedYAMLError as error:
        return str(error)
    except yaml.reader.ReaderError as error:
        return error.position
    return None if node is None else plain(node)


def by_pyyaml(text):
    return yaml_text._PythonComposer(text).get_single_node()


ROOT = Path(__file__).parents[3]
FRAGMENTS = (
    *" \n:-,[]{}#&*!|>'\"%@`?~<=.aX1_\t\ufeff\u2028é船😀", "\n  ", "\n- ", ": ", "- ", "? ", "&a ", "*a", "<<: ",
    "...", "---\n", "\n...\n", "%YAML 1.2\n---\n", "|\n", "|2\n", ">-\n", "|+\n", "\\n", "\\x41", "!!str ", "a: b",
    "[a: b]", "{a, b: }", "{a", "? [a]\n: b", "\n  a: 1\n  b: [2, 3]", "\n  - {c: 'd'}\n  - e",
)  # fmt: skip


@pytest.mark.parametrize("folder", ["assets", "fleets", "tests/broken"])
def test_files_have_the_same_nodes_and_places_from_both_parsers(folder):
    files = sorted((ROOT / folder).rglob("*.yaml"))[::3]  # PyYAML takes a second for all
    texts = [file.read_text(encoding="utf-8", errors="replace") for file in files]
    assert texts
    for text in texts:
        assert nodes(yaml_text._compose, text) == nodes(by_pyyaml, text)


@given(text=st.lists(st.sampled_from(FRAGMENTS), max_size=12).map("".join))
@example(text="---")
@example(text="{a: }")
@example(text="[a? ]")
@example(text="|#")
@example(text="a: b\t")
@example(text="%YAML 1.2#\n---\na: b")
def test_any_text_has_the_same_nodes_places_and_errors_from_both_parsers(text):
    assert nodes(yaml_text._compose, text) == nodes(by_pyyaml, text)


def test_where_libyaml_is_missing_files_read_the_same(monkeypatch):
    with_it = section("a: [1, {b: c}]\nd: |\n  e")
    monkeypatch.setattr(yaml, "__with_libyaml__", False)
    assert section("a: [1, {b: c}]\nd: |\n  e") == with_it


def test_not_a_number_stays_one_until_a_model_refuses_it():
    assert math.isnan(section("key: .nan")["key"])


def test_yes_and_no_can_be_keys():
    assert section("yes: 1\nno: 2\ny: 3") == {"yes": 1, "no": 2, "y": 3}


def test_every_value_knows_its_line_and_column():
    root = section("sea:\n  gain: 1\nobjects:\n  - {name: a}\n  - name: b\n    pose: [0, 1]\n")
    places = [locate(root, loc)[0] for loc in (("sea", "gain"), ("objects", 0, "name"), ("objects", 1, "pose", 1))]
    assert [(place.line, place.column) for place in places] == [(2, 9), (4, 12), (6, 15)]


def test_an_alias_repeats_its_anchor():
    assert section("a: &x [1, 2]\nb: *x") == {"a": (1, 2), "b": (1, 2)}


def test_aliases_nest_no_deeper_than_lists():
    text = "a0: &a0 [1]\n" + "\n".join(f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, 900))
    with pytest.raises(ConfigError, match=r"^t.yaml:1:10: a39: nested deeper than 40 levels, including aliases$"):
        section(text)


@pytest.mark.parametrize("data", [b"\xef\xbb\xbfsea:\r\n  gain: 0.2\r\n", b"sea:\r  gain: 0.2", b"sea: {gain: 0.2}"])
def test_byte_order_mark_and_line_ends_do_not_matter(data, tmp_path):
    file = tmp_path / "测试 boats.yaml"
    file.write_bytes(data)
    assert parse(File("t", None, read_lines(file))) == {"sea": {"gain": 0.2}}


@pytest.mark.parametrize(
    "text",
    [
        "description: 你好，世界：“可以”",
        "description: |\n  全角：可以\n\n  这里，也可以\nseed: 1",
        "objects:\n  - description: 浮标：红\n    name: a",
        "a: {description: 红，蓝, b: 1}",
        "a: {description: '红，蓝：', b: 1}",
        "# 注释：\nseed: 1  # 全角，冒号：",
        "file: 网格/浮标.obj",
        "file: мой/дом.obj",
        "a: don't  # это комментарий：",
    ],
)
def test_free_text_comments_and_foreign_words_may_hold_anything(text):
    assert not list(find_lookalikes(text.split("\n")))


@pytest.mark.parametrize(
    ("text", "column"),
    [("a: 'x # y'，", 11), ("name： 1", 5), ('a: "b" ； c', 8), ("description： x", 12), ("a: сор", 4)],
)
def test_lookalikes_are_found_at_their_column(text, column):
    assert next(find_lookalikes([text])).column == column


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.one_of(st.binary(max_size=300), st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace"))))
@example(data=b"? " * 200)
@example(data=b"- " * 2000)
@example(data=b"{" * 2000)
@example(data=b"!!float 1")
@example(data=b"%YAML 1.9\n---\na: 1")
@example(data=b"a: !<x> 1")
@example(data=b"\x00")
@example(data=b'a: "\\ud800"')
@example(data=b'"\\xff": 1')
@example(data=b"seed: " + b"1" * 5000)
def test_any_bytes_give_a_world_or_a_vrx_error(data, tmp_path):
    file = tmp_path / "world.yaml"
    file.write_bytes(data)
    with contextlib.suppress(VrxError):
        load_world(file)


WORDS = st.sampled_from([
    *("sea", "wind", "scene", "objects", "docks", "name", "model", "layout", "pose", "extends", "X"),
    *("positions", "fog", "sky", "clouds", "spawn", "robot", "task", "goal", "description"),
    *("[", "]", "{", "}", ":", "-", ",", "|", ">", "&", "*", "!", "?", "#", "'", '"', "@", "：", "，"),
    *("1", "0.5", "1e9", ".nan", "true", "null", "~", "\n", "\n  "),
])  # fmt: skip


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(words=st.lists(WORDS, max_size=40))
def test_any_words_give_a_world_or_a_vrx_error(words, tmp_path):
    file = tmp_path / "world.yaml"
    file.write_text(" ".join(words), encoding="utf-8")
    with contextlib.suppress(VrxError):
        load_world(file)


PLAIN = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=6), st.dictionaries(st.text(max_size=8), inner, max_size=4)),
    max_leaves=12,
)
KEYS = st.sampled_from(
    [
        "sea",
        "wind",
        "scene",
        "objects",
        "docks",
        "spawn",
        "task",
        "georeference",
        "camera",
        "seed",
        "extends",
        "terrain",
    ]
)


@given(source=st.dictionaries(KEYS, PLAIN, max_size=4))
def test_any_dict_gives_a_world_or_a_vrx_error(source):
    with contextlib.suppress(VrxError):
        load_world(source)


def test_a_section_knows_the_folder_of_its_file():
    assert section("a: {b: 1}")["a"].folder is None
    assert isinstance(section("a: {b: 1}")["a"], Section)
    assert parse(File("t", Path("x"), ("a: {}",)))["a"].folder == Path("x")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("objects: [" + "a," * 900_000 + "]", "t:1:1205: more than 600 keys and values"),
        ("".join(f"k{n}: 1\n" for n in range(100_000)), "t:300:7: more than 600 keys and values"),
        ("#\n" * 200_000, "t.yaml: more than 200000 lines"),
    ],
)
def test_what_would_take_long_to_read_is_given_up(tmp_path, monkeypatch, text, problem):
    """PyYAML takes 80 s and 2.5 GB for 4 MB of the first."""
    monkeypatch.setattr(yaml_text, "MAX_NODES", 600)
    monkeypatch.chdir(tmp_path)
    Path("t.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        parse(File("t", None, read_lines(Path("t.yaml"))))
    assert str(caught.value) == problem


@pytest.mark.parametrize("odd", ["\u200b", "\x01"])
def test_odd_characters_are_counted_up_to_a_thousand(tmp_path, odd):
    file = tmp_path / "t.yaml"
    file.write_text(odd * 300_000, encoding="utf-8")
    found = []

    def refused():
        with pytest.raises(ConfigError) as caught:
            parse(File("t", None, read_lines(file)))
        found.append(str(caught.value).splitlines()[-1])

    assert peak_memory(refused) < 20_000_000
    assert found == ["and 960 more problems"]
