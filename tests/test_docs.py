"""The documentation: what its first pages tell works, its written pages are up to date, and the site builds."""

import ast
import contextlib
import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from needs import MKDOCS, needs
from page_blocks import Block, blocks
from vrx_mj.cli import main
from vrx_mj.config.search import LAUNCHED, find
from vrx_mj.config.series.macros import MACROS

REPO = Path(__file__).resolve().parents[1]
DOCS = REPO / "docs"
TOOLS = REPO / "tools"
WORKED = ("start/first_run", "start/first_world", "start/first_fleet", "start/first_controller", "start/first_policy",
          "learning")  # fmt: skip
"""Pages whose blocks are programs of their own."""
EVERYDAY = {"start/first_run", "start/first_world"}
COMMAND = re.compile(r"^vrx-mj (.*)$", re.M)


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


def typed(text: str, monkeypatch) -> None:
    """The commands of a block, run by this process."""
    for command in COMMAND.findall(text):
        monkeypatch.setattr(sys, "argv", ["vrx-mj", *shlex.split(command, comments=True)])
        with contextlib.suppress(SystemExit):
            main()


def executed(text: str, _monkeypatch) -> None:
    """A block of Python, run as a program."""
    script = Path("block.py").resolve()  # for processes that it starts
    script.write_text(text, encoding="utf-8")
    runpy.run_path(str(script), run_name="__main__")


RUN = {"bash": typed, "python": executed}


def checked(block: Block, said: str) -> None:
    """What the page says that a block prints and writes."""
    for key, value in block.notes:
        if key == "expect":
            assert re.search(value, said, re.M | re.S), f"{block.place}: no {value} in\n{said}"
        elif key == "writes":
            assert Path(value).is_file(), f"{block.place} did not write {value}"


@pytest.mark.parametrize("page", [pytest.param(p, marks=() if p in EVERYDAY else pytest.mark.slow) for p in WORKED])
def test_what_a_page_shows_works_as_written(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    for block in blocks(DOCS / f"{page}.md"):
        if (file := block.note("file")) is not None:
            Path(file).write_text(block.text, encoding="utf-8")
        if block.note("not run") is None and block.kind in RUN:
            RUN[block.kind](quicker(block), monkeypatch)
            checked(block, capsys.readouterr().out)
    sys.modules.pop("steer", None)


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


@pytest.mark.slow
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
    assert [name for name in MACROS if f"`{name.removesuffix('_minus_scene')}`" not in text] == []
    rows = [line for line in text.splitlines() if line.startswith("|")]
    for stem, world in LAUNCHED.items():
        launches = [row for row in rows if re.search(rf"`{stem}\.launch(\.py)?`", row)]
        names = {world, f"{world.partition('/')[0]}/..."} if "/" in world else {world, "the same names"}
        assert any(name in row for row in launches for name in names), stem
