"""docs/vrx.md names everything that a user of VRX sets or types: lists of VRX's own names, and our tables."""

import csv
import re
from pathlib import Path

import pytest

from vrx_mj.config.gazebo.stock import STOCK_LAUNCHES
from vrx_mj.config.series.macros import MACROS

REPO = Path(__file__).parents[3]
PAGE = (REPO / "docs/vrx.md").read_text(encoding="utf-8")
CODE = " ".join(re.findall(r"`([^`\n]+)`", PAGE))
WORDS = set(re.findall(r"[\w.\-]+", CODE))


def names(file):
    with (REPO / "tests/golden/vrx_names" / file).open(encoding="utf-8") as text:
        return [row["name"] for row in csv.DictReader(line for line in text if not line.startswith("#"))]


def section(title):
    """The code of a section of the page."""
    text = PAGE.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
    return " ".join(re.findall(r"`([^`\n]+)`", text))


def test_every_argument_of_a_launch_file_is_in_its_section():
    """As `NAME:=`, or, of those with a table or a line of commands of their own, by name."""
    given = set(re.findall(r"(\w+)(?::=|(?=`|$|\s|,))", section("Launch arguments") + " " + section("Commands")))
    assert [name for name in names("launch_arguments.csv") if name not in given] == []


def test_every_variable_and_command_is_on_the_page():
    assert [name for name in names("others.csv") if name not in CODE] == []


def test_every_argument_of_the_stock_launch_files_is_on_the_page_and_in_the_list():
    listed = set(names("launch_arguments.csv"))
    ours = {argument for launch in STOCK_LAUNCHES.values() for argument in launch.arguments}
    assert ours - WORDS == set()
    assert {name for name in ours if not name.endswith("_enabled")} - listed == set()


@pytest.mark.parametrize("macro", sorted(MACROS))
def test_every_macro_and_its_parameters_are_on_the_page(macro):
    assert macro in WORDS
    assert [name for name in MACROS[macro].defaults if name not in WORDS] == []
