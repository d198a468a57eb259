"""docs/cli.md is what tools/cli_page.py writes."""

import itertools
import runpy
from pathlib import Path

from vrx_mj.cli.program import COMMANDS

REPO = Path(__file__).resolve().parents[3]
TOOL = runpy.run_path(str(REPO / "tools" / "cli_page.py"))


def test_the_page_of_the_commands_is_up_to_date():
    assert (REPO / "docs" / "cli.md").read_text(encoding="utf-8") == TOOL["page"](), "run python tools/cli_page.py"


def test_the_page_is_the_same_at_every_width_of_the_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    narrow = TOOL["page"]()
    monkeypatch.setenv("COLUMNS", "300")
    assert TOOL["page"]() == narrow


def test_every_command_has_a_section_with_an_example():
    lines = TOOL["page"]().splitlines()
    assert [name for name in COMMANDS if f"### vrx-mj {name}" not in lines] == []
    commands = [line.lstrip("# ") for line in lines if line.startswith(("### vrx-mj", "#### vrx-mj"))]
    shown = [line for before, line in itertools.pairwise(lines) if before == "```bash"]
    leaves = [name for name in commands if not any(other.startswith(f"{name} ") for other in commands)]
    assert [name for name in leaves if not any(line.startswith(name) for line in shown)] == []
