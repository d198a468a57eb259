"""Pages of the documentation: both languages show the same blocks, and the physics page names what exists."""

import re
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[3]
DOCS = REPO / "docs"
PHYSICS = (DOCS / "physics.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```\w*\n.*?^```$", re.M | re.S)


def text(page):
    return (DOCS / page).read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["fleets.md", "spawning.md", "matlab.md"])
def test_both_languages_show_the_same_blocks(page):
    assert BLOCK.findall(text(f"zh/{page}")) == BLOCK.findall(text(page))


def test_every_module_of_physics_on_the_page_exists():
    named = set(re.findall(r"`(\w+\.py)`", PHYSICS))
    assert {name for name in named if not (REPO / "src/vrx_mj/physics" / name).exists()} == set()
    for path in re.findall(r"`(src/vrx_mj/\S+\.py)`", PHYSICS):
        assert (REPO / path).exists()


@pytest.mark.parametrize(
    ("module", "names"),
    [
        (module, re.findall(r"`(\w+)`", names))
        for module, names in re.findall(r"^`(\w+\.py)`: ((?:`\w+`(?:, )?)+)", PHYSICS, re.M)
    ],
)
def test_every_kernel_on_the_page_is_in_its_module(module, names):
    code = (REPO / "src/vrx_mj/physics" / module).read_text(encoding="utf-8")
    assert [name for name in names if f"def {name}(" not in code] == []


def test_every_kernel_module_is_on_the_page():
    effects = {"drag", "flotation", "hydrostatics", "noise", "raft", "thrust", "volumes", "waves", "wind"}
    assert {name for name in effects if f"`{name}.py`" not in PHYSICS} == set()


def test_formulas_need_no_backslash_before_punctuation():
    """GitHub takes such a backslash away before it sets a formula, and a bar ends a table's cell."""
    formulas = re.findall(r"\$\$(.+?)\$\$|\$([^$\n]+)\$", PHYSICS, re.S)
    assert len(formulas) > 100
    assert [formula for pair in formulas for formula in pair if re.search(r"\\[^\w\s]|\|", formula)] == []
