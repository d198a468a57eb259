"""docs/vrx.md names all that a user of VRX sets or types, each in a row of its own: lists of VRX's, and our tables."""

import csv
import re
from pathlib import Path

import pytest

from vrx_mj.formats.gazebo.launched import STOCK_LAUNCHES
from vrx_mj.formats.series.worlds import macros

REPO = Path(__file__).parents[3]
PAGE = (REPO / "docs/vrx.md").read_text(encoding="utf-8")


def listed(file):
    with (REPO / "tests/golden/vrx_names" / file).open(encoding="utf-8") as text:
        return list(csv.DictReader(line for line in text if not line.startswith("#")))


def rows(title):
    """Cells of the rows of the tables in a section of the page."""
    text = PAGE.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
    assert text, f"no section '{title}'"
    lines = (line for line in text.splitlines() if line.startswith("| "))
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


def code(cell):
    """The texts in code font of a cell."""
    return re.findall(r"`([^`\n]+)`", cell)


def words(cell):
    """The words in code font of a cell; of an argument its name."""
    return {word.rstrip(":,").partition(":=")[0] for text in code(cell) for word in text.split()}


def first(*titles):
    """The words in code font in the first column of the tables of some sections."""
    return set().union(*(words(row[0]) for title in titles for row in rows(title)))


def test_every_argument_of_a_launch_file_is_in_a_first_column():
    given = first("Launch arguments", "Commands")
    assert [row["name"] for row in listed("launch_arguments.csv") if row["name"] not in given] == []


@pytest.mark.parametrize(("kind", "titles"), [
    ("environment", ["Environment variables"]),
    ("command", ["Commands", "Launch arguments", "Topics, services and tools of ROS", "Files"]),
])  # fmt: skip
def test_every_variable_and_command_is_in_a_first_column(kind, titles):
    given = {name.partition("=")[0] for name in first(*titles)}
    names = [row["name"] for row in listed("others.csv") if row["kind"] == kind]
    assert [name for name in names if not set(name.split()) <= given] == []


def test_there_are_no_other_kinds():
    assert {row["kind"] for row in listed("others.csv")} == {"environment", "command"}


def test_every_argument_of_the_stock_launch_files_is_in_a_first_column_and_in_the_list():
    ours = {argument for launch in STOCK_LAUNCHES.values() for argument in launch.arguments}
    assert ours - first("Launch arguments") == set()
    assert ours - {row["name"] for row in listed("launch_arguments.csv")} == set()


def test_every_launch_file_with_a_world_is_in_a_first_column():
    assert set(STOCK_LAUNCHES) - first("Launch arguments") == set()


@pytest.mark.parametrize("macro", sorted(macros()))
def test_every_macro_has_a_row_with_its_parameters_and_blocks(macro):
    (row,) = [row for row in rows("World macros") if macro in words(row[0])]
    assert set(macros()[macro].defaults) - words(row[2]) == set()
    assert set(macros()[macro].blocks) - words(row[2]) - words(row[0]) == set()
