"""docs/gallery.md is what tools/gallery.py writes, with everything of the catalogue and a picture of each."""

import importlib.util
import sys
from pathlib import Path

import pytest
from PIL import Image

from vrx_mj.config.search import catalogue

REPO = Path(__file__).resolve().parents[3]
DOCS = REPO / "docs"
TEXT = (DOCS / "gallery.md").read_text(encoding="utf-8")
LIMIT = 3_000_000
"""Of all its pictures together [bytes]."""


@pytest.fixture(scope="module")
def gallery():
    spec = importlib.util.spec_from_file_location("gallery", REPO / "tools" / "gallery.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look for it
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.fixture(scope="module")
def sheets(gallery):
    return [gallery.ROBOTS, gallery.DOCKS, gallery.VIEWS, *gallery.object_sheets(), *gallery.competition_sheets()]


def test_the_page_is_what_the_script_writes(gallery):
    assert gallery.page() == TEXT, "run tools/gallery.py"


@pytest.mark.parametrize("kind", ["objects", "docks", "robots"])
def test_everything_of_the_catalogue_is_named(kind):
    missing = [name for name in catalogue(kind) if f"`{name}`" not in TEXT]
    assert not missing, "run tools/gallery.py"


def test_every_stock_world_has_a_map():
    missing = [name for name in catalogue("worlds") if "/" not in name and f"gallery/map_{name}.webp" not in TEXT]
    assert not missing, "run tools/gallery.py"


def test_every_sheet_has_a_tile_for_each_of_its_names(sheets):
    for sheet in sheets:
        columns, width, height = (2, 450, 330) if sheet.title == "Robots" else (3, 300, 225)
        rows = -(-len(sheet.names) // columns)
        with Image.open(DOCS / sheet.file) as picture:
            assert picture.size == (columns * (width + 8) + 8, rows * (height + 56) + 8), f"{sheet.file} is stale"


def test_no_object_is_in_two_sheets(gallery):
    names = [name for sheet in gallery.object_sheets() for name in sheet.names]
    assert sorted(names) == sorted(catalogue("objects"))


def test_the_pictures_are_small():
    assert sum(file.stat().st_size for file in (DOCS / "gallery").iterdir()) <= LIMIT
    assert {file.name for file in (DOCS / "gallery").iterdir()} == {
        part.split(")")[0] for part in TEXT.split("(gallery/")[1:]
    }
