"""The pages in Chinese have what their English ones have: blocks, tables, headings, and links between the two."""

import re
from pathlib import Path

import pytest

from page_blocks import blocks

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAIRS = sorted(page.name for page in (DOCS / "zh").glob("*.md") if (DOCS / page.name).is_file())
OWN = {"start.md"}
"""Pages in Chinese alone: the first steps, which are six pages in English."""


def lines(page):
    """The lines of a page outside of blocks."""
    text = re.sub(r"^( *)```.*?^\1```$", "", (DOCS / page).read_text(encoding="utf-8"), flags=re.M | re.S)
    return text.splitlines()


def headings(page):
    return [len(found[1]) for line in lines(page) if (found := re.match(r"(#+) ", line))]


def rows(page):
    """Rows of tables: what is code in the first column, such as names of keys and topics, and the number of columns."""
    found = [line for line in lines(page) if line.startswith("|")]
    return [(sorted(re.findall(r"`[^`]+`", line.split("|")[1])), line.count(" |")) for line in found]


def test_the_pages_are_these():
    assert {page.name for page in (DOCS / "zh").glob("*.md")} == {*PAIRS, *OWN}
    assert {"fleets.md", "install.md", "spawning.md"} <= set(PAIRS)


@pytest.mark.parametrize("page", PAIRS)
def test_a_page_in_chinese_has_the_blocks_of_the_english_one(page):
    one, other = ([(block.kind, block.text) for block in blocks(DOCS / path)] for path in (page, f"zh/{page}"))
    assert other == one


@pytest.mark.parametrize("page", PAIRS)
def test_a_page_in_chinese_has_the_headings_and_tables_of_the_english_one(page):
    assert headings(f"zh/{page}") == headings(page)
    assert rows(f"zh/{page}") == rows(page)


@pytest.mark.parametrize("page", PAIRS)
def test_the_two_pages_link_to_each_other(page):
    one, other = lines(page), lines(f"zh/{page}")
    title, chinese = one[0].removeprefix("# "), other[0].removeprefix("# ")
    assert f"English: [{title}](../{page})" in other
    assert f"中文版：[{chinese}](zh/{page})" in "\n".join(one)
