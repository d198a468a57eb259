"""Small xacro files that would grow without end: each is given up in words, or expands to little."""

from pathlib import Path

import pytest

from vrx_mj.errors import ConfigError
from vrx_mj.formats.urdf.expand import expand

HEAD = '<robot name="boat" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
TOO_LARGE = "takes too much memory"
TOO_MUCH = (
    "it takes more than 3 s of processor time",
    "more than 32 MiB",
    "it takes more than 512 MiB of memory",
    TOO_LARGE,
)
"""Limits of which this machine reaches one first; a faster one may reach none."""
TOO_DEEP = "nested too deeply; does something refer to itself?"
CALL = '<xacro:m n="${n + 1}"/>'
START = '<xacro:m n="0"/>'
INSERT = '<xacro:insert_block name="b"/>'
WRAPPED = "<xacro:m><q>" * 20 + "<a/>" + "</q></xacro:m>" * 20
LONG = '<xacro:property name="p" value="${\'x\' * 19000}"/>'


def doubling(count, line):
    return "".join(line.format(n=n, m=n + 1) for n in range(count))


BOMBS = {
    "power": ('<a b="${9**9**9}"/>', TOO_MUCH),
    "text": ("<a b=\"${'a' * 10**10}\"/>", TOO_LARGE),
    "range": ('<a b="${list(range(10**10))}"/>', TOO_LARGE),
    "macros": (
        '<xacro:macro name="m0"><a/></xacro:macro>'
        + "".join(f'<xacro:macro name="m{n + 1}">{f"<xacro:m{n}/>" * 10}</xacro:macro>' for n in range(9))
        + "<xacro:m9/>",
        TOO_MUCH,
    ),
    "macro_tree": (
        f'<xacro:macro name="m" params="n"><xacro:if value="${{n &lt; 40}}">{CALL * 2}</xacro:if></xacro:macro>{START}',
        TOO_MUCH,
    ),
    "macro_of_itself": ('<xacro:macro name="m"><a><xacro:m/></a></xacro:macro><xacro:m/>', TOO_DEEP),
    "macro_clones": (
        f'<xacro:macro name="m"><xacro:if value="0">{"<a/>" * 20000}</xacro:if></xacro:macro>{"<xacro:m/>" * 9000}',
        TOO_MUCH,
    ),
    "blocks": (
        f'<xacro:macro name="m" params="**b">{INSERT * 2}</xacro:macro>{WRAPPED}',
        TOO_MUCH,
    ),
    "properties": (
        '<xacro:property name="p0" value="xxxxxxxx"/>'
        + doubling(60, '<xacro:property name="p{m}" value="${{p{n}}}${{p{n}}}"/>')
        + '<a b="${p60}"/>',
        TOO_MUCH,
    ),
    "arguments": (
        '<xacro:arg name="p0" default="xxxxxxxx"/>'
        + doubling(60, '<xacro:arg name="p{m}" default="$(arg p{n})$(arg p{n})"/>'),
        TOO_MUCH,
    ),
    "chain": (doubling(400, '<xacro:property name="p{n}" value="${{p{m}}}"/>') + '<a b="${p0}"/>', TOO_DEEP),
    "include_itself": ('<xacro:include filename="boat.xacro"/>', TOO_DEEP),
    "include_itself_twice": ('<xacro:include filename="boat.xacro"/>' * 2, TOO_DEEP),
    "deep_xml": ("<a>" * 9000 + "</a>" * 9000, "nested deeper than 60"),
    "wide_xml": ("<a/>" * 60000, "more than 50000 elements"),
    "comments": ("<!-- a -->\n" * 30000 + '<xacro:property name="a" value="1"/>', TOO_MUCH),
    "siblings": ("<a/>" * 20000 + '<xacro:if value="1"><b/></xacro:if>' * 9000, TOO_MUCH),
    "dollars": ("<a>" + "$ " * 9000 + "</a>" + ("<a>" + "$ " * 9000 + "</a>") * 39, None),
    "long_text": ("<a>${1}" + "x" * 30000 + "</a>", None),
    "parameters": (f'<xacro:macro name="m" params="{"a" * 40}:={"a" * 40}\'"/>', TOO_MUCH),
    "quotes": (f'<xacro:macro name="m" params="a:={chr(39) * 60}&quot;"/>', TOO_MUCH),
    "many_parameters": (f'<xacro:macro name="m" params="{" ".join(f"p{n}" for n in range(900))}"/>', None),
    "slices": (
        '<xacro:property name="l" value="${list(range(9000))}"/><a b="${[l[::2][0] for x in l for y in l]}"/>',
        TOO_MUCH,
    ),
    "splits": ("<a b=\"${[('a b ' * 4000).split() for x in range(9000)]}\"/>", TOO_MUCH),
    "searches": (
        f'{LONG}<a b="${{[max(map(p.count, [p, p])) for x in range(9000)]}}"/>',
        None,
    ),
    "digits": (
        '<a b="${[len(list(map(str, [2**4000 for x in range(90)]))) for x in range(9000)]}"/>',
        TOO_MUCH,
    ),
    "output": (f"{LONG}<xacro:macro name='m'><a b='${{p}}'/></xacro:macro>{'<xacro:m/>' * 9000}", TOO_MUCH),
}


pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
SLOW = {"power", "macros", "macro_tree", "macro_clones", "blocks", "properties", "arguments", "comments", "siblings",
        "dollars", "parameters", "quotes", "slices", "splits", "digits", "output", "searches",
        "include_itself_twice"}  # fmt: skip
"""Bombs that the limit of processor time stops, that come near it, or that are as long as another of their kind."""
KINDS = {"power", "macro_tree", "dollars", "slices"}
"""One of each kind: a number, a tree, a text and a list; the others are tried by night."""
BY_NIGHT = SLOW - KINDS


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in BOMBS if name not in BY_NIGHT]
)
def test_bombs_do_not_go_off(name, tmp_path, monkeypatch):
    body, message = BOMBS[name]
    monkeypatch.chdir(tmp_path)
    Path("boat.xacro").write_text(f"{HEAD}{body}</robot>", encoding="utf-8")
    found, said = "", ""
    try:
        found = expand(Path("boat.xacro"))
    except ConfigError as error:
        said = str(error)
    limits = TOO_MUCH if message is TOO_MUCH else (message,)
    assert any(limit in said for limit in limits if limit) or (not said and message in {None, TOO_MUCH})
    assert len(found) < 2_000_000


@pytest.mark.slow
@pytest.mark.nightly
def test_the_others_of_each_kind_do_not_go_off_either(tmp_path, monkeypatch):
    for name in sorted(BY_NIGHT):
        test_bombs_do_not_go_off(name, tmp_path, monkeypatch)


def test_what_is_merely_large_is_expanded(tmp_path):
    file = tmp_path / "boat.xacro"
    file.write_text(f"{HEAD}{'<a>' + 'x' * 19000 + '</a>'}{'<b/>' * 9000}</robot>", encoding="utf-8")
    assert expand(file).count("<b/>") == 9000


@pytest.mark.parametrize("size", [0, 1, 100, 4_000_001])
def test_bytes_of_any_kind_end_in_words(size, tmp_path):
    (tmp_path / "boat.xacro").write_bytes(bytes(range(256)) * (size // 256) + bytes(range(size % 256)))
    with pytest.raises(ConfigError):
        expand(tmp_path / "boat.xacro")
