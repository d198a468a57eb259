"""XML of others: read as tinyxml reads it, in the sandboxed process, with the place of each element."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

import vrx_mj
from sdf_boats import catamaran
from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.gazebo.document import read_document
from vrx_mj.formats.urdf.xml_document import decode, markup, parse_robot, table

AMPERSAND = "'&' is read as &amp;; write &amp; instead"
TOLERATED = {
    "ampersand": ("<sdf>\n <uri>a & b&c;</uri></sdf>", "a & b&c;", f"2:9: {AMPERSAND} (2 times)"),
    "attribute": ("<sdf name='a & b'><uri>a</uri></sdf>", "a", f"1:14: {AMPERSAND}"),
    "before": (
        "\n<?xml version='1.0'?>\n<sdf><uri>a</uri></sdf>", "a",
        "1:1: spaces before '<?xml ...?>' are ignored; it must come first",
    ),
    "hyphens": (
        "<sdf><!-- a -- b --->\n<uri>a</uri></sdf>", "a",
        "1:6: '--' in a comment, which XML does not allow, is ignored",
    ),
    "prefix": (
        "<sdf>\n  <uri>a<ros:b c:d='1'/></uri></sdf>", "a",
        "2:9: the prefix 'ros' of a name is not declared; the outermost element needs xmlns:ros (2 times)",
    ),
    "encoding": (
        b"<sdf><uri>m\xfcll</uri></sdf>", "m\ufffdll",
        "1:12: bytes that are invalid in the file's encoding are replaced; save it as UTF-8",
    ),
}  # fmt: skip
"""A file, the text of its <uri>, and what is said."""


@pytest.mark.parametrize("case", TOLERATED)
def test_what_tinyxml_reads_is_read_and_said_once_with_its_place(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text, value, said = TOLERATED[case]
    Path("a.sdf").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.warns(VrxWarning) as caught:
        assert read_document(Path("a.sdf")).text("uri") == value
    assert [str(one.message) for one in caught] == [f"a.sdf:{said}"]


@pytest.mark.parametrize(
    "text",
    ["<a><!-- - & --><![CDATA[ & -- ]]><?b & -- ?>&amp;&#38;&#x26;&lt;</a>", "<a><gz:b/><ignition:c xmlns:d='e'/></a>",
     "\ufeff<?xml version='1.0' encoding='utf-8'?><a/>"],
)  # fmt: skip
def test_what_xml_allows_is_not_spoken_of(text):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table(decode(text.encode(), "a.sdf"), "a.sdf")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "1:1: ends before its outermost element is closed, or is empty"),
        ("<a>\n<b>", "2:4: the file ends before </b>, which ends the <b> of line 2"),
        ("<a>\n <b></c></a>", "2:7: expected </b>, which ends the <b> of line 2"),
        ("<a><!-- <b></a>", "1:4: the file ends before </a>, which ends the <a> of line 1"),
        ("<a b='<'/>", "1:7: is not XML: a stray '<' or '&' (write &lt; &amp;), or no quote or '='"),
        ("<a/>\n<b/>", "2:1: text after the end of the outermost element"),
        ("<!DOCTYPE a><a/>", "1:12: <!DOCTYPE>: document types and entities are not allowed; remove them"),
    ],
)
def test_what_cannot_be_read_is_an_error_with_its_place(text, said):
    with pytest.raises(ConfigError) as refused:
        table(text, "a.sdf")
    assert str(refused.value) == f"a.sdf:{said}"


def test_an_encoding_that_there_is_not_is_an_error():
    for name in ("nonsense", "rot13", "zlib_codec"):
        with pytest.raises(ConfigError, match=r"^a\.sdf:1:1: unknown encoding; save the file as UTF-8$"):
            decode(f"<?xml version='1.0' encoding='{name}'?><a/>".encode(), "a.sdf")


names = st.text("abz", min_size=1, max_size=3)
trees = st.recursive(
    st.builds(lambda tag, text: (tag, {}, text, []), names, st.text(" \nab&<é")),
    lambda inner: st.tuples(
        names, st.dictionaries(names, st.text(" ab&<\"'")), st.text("\n ab&<>"), st.lists(inner, max_size=3)
    ),
    max_leaves=12,
)  # fmt: skip


def made(tree):
    tag, attributes, text, children = tree
    element = etree.Element(tag, attributes)
    element.text = text
    element.extend(map(made, children))
    return element


@given(tree=trees, broken=st.booleans())
def test_a_table_is_what_lxml_reads(tree, broken):
    """A second implementation: of the same text, or of one whose '&' are bare."""
    root = made(tree)
    text = etree.tostring(root, encoding="unicode")
    given_text = (
        text.replace("&amp;", "&") if broken and not any(f"&amp;{one}" in text for one in ("amp;", "lt;")) else text
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        rows = table(given_text, "a.sdf")
    read = etree.fromstring(text)
    order = list(read.iter())
    assert [(row[0], row[4], row[5], row[6]) for row in rows] == [
        (order.index(one.getparent()) if one.getparent() is not None else -1, one.tag, dict(one.attrib),
         "".join(one.xpath("text()")).strip()) for one in order
    ]  # fmt: skip
    assert [row[2] for row in rows] == [one.sourceline for one in order]
    lines = given_text.split("\n")
    if not broken:
        assert all(lines[row[2] - 1][row[3] - 1 :].startswith(f"<{row[4]}") for row in rows)


def test_elements_of_robots_know_line_and_column():
    root = parse_robot("<robot>\n  <link name='a'/><link name='b'/></robot>", "a.urdf")
    assert [(one.place.line, one.place.column) for one in root] == [(2, 3), (2, 19)]
    assert str(markup("<a/>", "b.sdf").place) == "b.sdf:1"


def test_there_is_one_parser_of_files_of_others():
    parsing = re.compile(r"ParserCreate|fromstring\(|parseString|XMLParser|etree\.parse|lxml")
    package = Path(vrx_mj.__file__).parent
    files = [file for name in ("config", "foreign", "formats") for file in package.glob(f"{name}/**/*.py")]
    found = [file.name for file in files if parsing.search(file.read_text(encoding="utf-8"))]
    assert found == ["xml_document.py"]


SAILED = """
import sys, warnings
warnings.simplefilter("ignore")
import vrx_mj
for world, fleet in (("a.world", None), ("a.launch", None), ("ocean", "model.sdf")):
    print(len(vrx_mj.compile_world(world, fleet=fleet).boats))
print(*{name.partition(".")[0] for name in sys.modules} & {"lxml", "xacro", "yourdfpy"})
"""


@pytest.mark.slow
def test_a_world_a_boat_and_a_launch_file_are_parsed_in_another_process(tmp_path):
    """Whether their answers are cached or not, lxml is not in the command's own process."""
    (tmp_path / "model.sdf").write_text(catamaran(), encoding="utf-8")
    (tmp_path / "a.world").write_text("<sdf><world name='a'/></sdf>", encoding="utf-8")
    file, arg = (
        "$(find gazebo_ros)/launch/empty_world.launch",
        f"<arg name='world_name' value='{tmp_path / 'a.world'}'/>",
    )
    launch = f"<launch><include file='{file}'>{arg}</include></launch>"
    (tmp_path / "a.launch").write_text(launch, encoding="utf-8")
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", SAILED], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.stdout.split() == ["0", "0", "1"], done.stderr
