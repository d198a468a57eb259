"""The documentation: what its first pages tell works, its written pages are up to date, and the site builds."""

import ast
import contextlib
import os
import re
import runpy
import shlex
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

from needs import MKDOCS, needs
from page_blocks import Block, blocks, missing
from vrx_mj.cli import main
from vrx_mj.config.search import find
from vrx_mj.formats.gazebo.launched import LAUNCHED
from vrx_mj.formats.series.worlds import macros

REPO = Path(__file__).resolve().parents[1]
DOCS = REPO / "docs"
TOOLS = REPO / "tools"
WORKED = ("first_run", "first_world", "first_fleet", "first_controller", "first_policy", "learning", "numbers")
"""Pages of which every block is run."""
MARKS = {"first_policy": [pytest.mark.slow, pytest.mark.nightly]}
EVERYDAY = {"fleets", "series"}
FOLLOWED = {"tutorial_one_boat", "tutorial_many_boats"}
"""Pages that tests/integration/test_ros_tutorials.py follows."""
COMMAND = re.compile(r"^(vrx-mj|python) (.*)$", re.M)


def tool(name, monkeypatch):
    """What a script of `tools` defines."""
    monkeypatch.syspath_prepend(TOOLS)
    return runpy.run_path(str(TOOLS / f"{name}.py"))


def quicker(block: Block) -> str:
    """A block's text, with what its page says that a test replaces."""
    text = block.text
    for key, value in block.notes:
        if key == "tested with":
            long, short = value.split(" -> ")
            assert text.count(long) == 1, f"{block.place}: {long} does not stand there once"
            text = text.replace(long, short)
    return text


def typed(block: Block, monkeypatch) -> None:
    """The commands of a block, run by this process."""
    for program, words in COMMAND.findall(quicker(block)):
        monkeypatch.setattr(sys, "argv", [program, *shlex.split(words, comments=True)])
        with contextlib.suppress(SystemExit):
            if program == "vrx-mj":
                main()
            elif Path(sys.argv[1]).is_file():  # one that the page has made
                runpy.run_path(sys.argv[1], run_name="__main__")


def executed(block: Block, _monkeypatch) -> None:
    """A block of Python, run as a program; of an error that ends it as its page says, the text is printed."""
    script = Path("block.py").resolve()  # for processes that it starts
    script.write_text(quicker(block), encoding="utf-8")
    wrong = contextlib.nullcontext() if block.note("raises") is None else pytest.raises(Exception, match=r"\w")
    with wrong as raised:
        runpy.run_path(str(script), run_name="__main__")
    print(raised.value if raised else "", end="")


RUN = {"bash": typed, "python": executed}


def checked(block: Block, said: str) -> None:
    """What the page says that a block prints and writes."""
    for key, value in block.notes:
        if key == "expect":
            assert re.search(value, said, re.M | re.S), f"{block.place}: no {value} in\n{said}"
        elif key == "writes":
            assert Path(value).is_file(), f"{block.place} did not write {value}"


def pages_with_outputs():
    """Pages, by name, that show what something prints; test_chinese_pages.py compares those in Chinese with them."""
    pages = (page for page in DOCS.rglob("*.md") if page.parent.name not in {"formats", "zh"})
    return {page.stem for page in pages if "\n```text\n" in page.read_text(encoding="utf-8")}


def prepared(block: Block) -> None:
    """The file that a block is, or that it changes."""
    if (name := block.note("file")) is not None:
        Path(name).write_text(block.text, encoding="utf-8")
    if (change := block.note("with")) is not None:
        name, _, change = change.partition(": ")
        old, new = change.split(" -> ")
        text = Path(name).read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{block.place}: {old} does not stand in {name} once"
        Path(name).write_text(text.replace(old, new), encoding="utf-8")


def runs(block: Block, after: Block, page: str) -> bool:
    """Whether a test runs a block: all of the pages that are worked through, and what prints the next block."""
    shown = after.kind == "text" and after.note("printed by") is None
    return block.kind in RUN and block.note("not run") is None and (page in WORKED or shown)


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=() if page in EVERYDAY else MARKS.get(page, pytest.mark.slow))
        for page in sorted({*WORKED} | pages_with_outputs() - FOLLOWED)
    ],
)
def test_what_a_page_shows_works_and_prints_what_is_written(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    found, said = blocks(next(DOCS.rglob(f"{page}.md"))), ""
    for block, after in zip(found, [*found[1:], found[-1]], strict=True):
        prepared(block)
        if runs(block, after, page):
            RUN[block.kind](block, monkeypatch)
            said = capsys.readouterr().out
            checked(block, said)
        elif block.kind == "text":
            if (command := block.note("printed by")) is not None:
                typed(replace(block, text=command), monkeypatch)
                said = "".join(capsys.readouterr())
            assert missing(block, said) == [], f"{block.place}: these lines are not in\n{said}"
    sys.modules.pop("steer", None)


def test_every_block_of_a_page_has_a_kind():
    for page in DOCS.rglob("*.md"):
        fences = re.findall(r"^ *```(.*)$", page.read_text(encoding="utf-8"), re.M)
        assert "" not in fences[::2], page.name


def test_the_pages_of_file_formats_are_those_of_the_models(monkeypatch):
    for name, text in tool("format_pages", monkeypatch)["pages"]().items():
        committed = (DOCS / "formats" / name).read_text(encoding="utf-8")
        assert committed == text, f"docs/formats/{name} is out of date: python tools/format_pages.py"


def test_every_public_name_is_described_and_in_the_reference(monkeypatch):
    assert tool("public_names", monkeypatch)["complaints"]() == []


@pytest.mark.parametrize(
    ("source", "lacks"),
    [
        ("class Boat:\n    name: str\n", ["x.Boat", "x.Boat.name"]),
        ("class Boat:\n    '''A boat.'''\n    def go(self, way): ...\n", ["x.Boat.go", "x.Boat.go(way)"]),
        ("class Boat:\n    '''A boat.'''\n    def go(self, way):\n        '''Go a `way` [m].'''\n", []),
        ("def boat(name, seed):\n    '''A boat.'''\n", ["x.boat(name)"]),
        ("class Boat:\n    '''A boat.'''\n    _name: str\n    size: int\n    '''Length [m].'''\n", []),
    ],
)
def test_a_name_without_a_description_is_found(source, lacks, monkeypatch):
    names = tool("public_names", monkeypatch)
    node = ast.parse(source).body[0]
    assert list(names["_undescribed"](f"x.{node.name}", "x", node, "", {"seed"})) == lacks


def test_the_site_leaves_no_page_out():
    lines = (REPO / "mkdocs.yml").read_text(encoding="utf-8").splitlines()
    listed = {name for line in lines for name in re.findall(r"^ *- .*?([\w/]+\.md)$", line)}
    assert listed == {page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")}


class SitePage(HTMLParser):
    """Anchors, links and the texts of chapter headings of a page of the site."""

    def __init__(self, file):
        super().__init__()
        self.anchors, self.links, self.headings, self._inside = set(), [], [], False
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.anchors |= {found["id"]} if "id" in found else set()
        self.links += [found[key] for key in ("href", "src") if found.get(key)]
        if tag in {"h1", "h2", "h3"}:
            self.headings.append("")
            self._inside = True

    def handle_endtag(self, tag):
        self._inside = self._inside and tag not in {"h1", "h2", "h3"}

    def handle_data(self, data):
        if self._inside:
            self.headings[-1] += data.strip()


def dead_links(pages):
    """Page and target of links that lead nowhere in the site; one to the root of a server has no file."""
    for file, page in pages.items():
        for link in page.links:
            path, _, anchor = unquote(link).partition("#")
            if not re.match(r"[a-z]+:", path):
                target = Path(os.path.normpath(file.parent / path)) if path else file
                if not target.is_file() or (anchor and target in pages and anchor not in pages[target].anchors):
                    yield file.name, link


@pytest.mark.slow
@pytest.mark.nightly
@needs(MKDOCS)
def test_the_site_builds_and_loads_nothing_from_elsewhere(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    variables = {**os.environ, "TMPDIR": str(tmp_path)}  # the dictionary of Chinese is cached there
    done = subprocess.run(command, cwd=REPO, env=variables, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    pages = sorted((tmp_path / "site").rglob("*.html"))
    loaded = re.compile(r"<(?:script|img|iframe)[^>]* src=\"(https?://[^\"]+)|<link[^>]* href=\"(https?://[^\"]+)")
    assert len(pages) > 40
    assert {page.name: found for page in pages if (found := loaded.findall(page.read_text(encoding="utf-8")))} == {}
    read = {page: SitePage(page) for page in pages}
    assert list(dead_links(read)) == []
    assert {page.name: text for page in pages for text, n in Counter(read[page].headings).items() if n > 1} == {}


def test_the_worlds_that_vrx_users_are_pointed_to_exist():
    text = (DOCS / "vrx.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\|[^|]*\| (`vrx-mj serve .*)\|$", text, re.M)
    names = {
        word
        for cell in cells
        for word in re.findall(r"`(?:vrx-mj serve )?([a-z][\w/]*)(?: --ros2| --fleet bare.yaml)?`", cell)
    }
    assert len(names) > 10
    for name in names:
        assert find("worlds", name).is_file()


def test_the_page_for_vrx_users_has_every_macro_and_launch_file():
    """A launch file stands in a row with the world that the program answers it with."""
    text = (DOCS / "vrx.md").read_text(encoding="utf-8")
    assert [name for name in macros() if f"`{name.removesuffix('_minus_scene')}`" not in text] == []
    rows = [line for line in text.splitlines() if line.startswith("|")]
    for stem, world in LAUNCHED.items():
        launches = [row for row in rows if re.search(rf"`{stem}\.launch(\.py)?`", row)]
        names = {world, f"{world.partition('/')[0]}/..."} if "/" in world else {world, "the same names"}
        assert any(name in row for row in launches for name in names), stem
