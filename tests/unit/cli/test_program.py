"""What the program shows of itself: the overview, its commands in groups, versions; and what it loads for that."""

import re
import subprocess
import sys
from importlib.metadata import version

import pytest

import vrx_mj
from vrx_command import environment
from vrx_mj.cli.program import COMMANDS, FIRST, PANELS, description, load_command

HEAVY = {
    "jinja2", "matplotlib", "mujoco", "numba", "numpy", "pyarrow", "pydantic", "rerun", "rich", "scipy", "trimesh",
    "yaml",
}  # fmt: skip
CALL = """
import sys
sys.argv = ["vrx-mj", *sys.argv[1:]]
from vrx_mj.cli import main
try:
    main()
except SystemExit:
    print("LOADED", *{name.split(".")[0] for name in sys.modules})
"""


def panels_of(page):
    """The names under each heading of a help page."""
    found, heading = {}, ""
    for line in page.splitlines():
        if re.match(r"\S.*:$", line):
            heading = line[:-1]
        elif name := re.match(r"  ([a-z-]+)  +\S", line):
            found.setdefault(heading, []).append(name.group(1))
    return found


def test_without_arguments_six_commands_are_shown_with_an_example_each(cli):
    said = cli()
    lines = [line.strip() for line in said.out.splitlines() if line.startswith("  vrx-mj")]
    assert (said.code, said.err, len(FIRST)) == (0, "", 6)
    assert [line.split()[1] for line in lines] == list(FIRST)
    assert "vrx-mj --help lists all" in said.out


@pytest.mark.parametrize("name", FIRST)
def test_the_first_examples_are_what_the_commands_take(name):
    words = FIRST[name].split()
    assert words[:2] == ["vrx-mj", name]
    load_command(name).make_context(name, words[2:])


def test_every_command_is_in_one_group_of_the_help(cli):
    found = panels_of(cli("--help").out)
    titles = {title: f"{title} ({note})" for title, note in PANELS.items()}
    expected = {titles[title]: [n for n, entry in COMMANDS.items() if entry.panel == title] for title in PANELS}
    assert {heading: names for heading, names in found.items() if heading != "Options"} == expected
    assert sorted(name for names in expected.values() for name in names) == sorted(COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_summary_is_the_first_sentence_of_the_help(name):
    assert description(load_command(name).help)[0].startswith(COMMANDS[name].summary)


def test_the_versions_are_shown(cli):
    said = cli("--version")
    mujoco, numba = version("mujoco"), version("numba")
    python = ".".join(map(str, sys.version_info[:3]))
    assert said.out == f"vrx-mj {vrx_mj.__version__} (mujoco {mujoco}, numba {numba}, Python {python})\n"
    assert (said.code, said.err) == (0, "")


@pytest.mark.parametrize("words", [[], ["--help"], ["--version"], ["run", "--help"], ["robot", "--help"], ["list"]])
def test_what_is_asked_often_loads_nothing_heavy(words):
    done = subprocess.run(
        [sys.executable, "-c", CALL, *words], capture_output=True, encoding="utf-8", check=True, env=environment()
    )
    assert "vrx-mj" in done.stdout or "ocean" in done.stdout
    assert set(done.stdout.rpartition("LOADED")[2].split()) & HEAVY == set()


@pytest.mark.parametrize(
    ("words", "driven"),
    [
        ([], ("ws://127.0.0.1:9090", None)),
        (["--url", "wss://shore:1", "--boat", "wamv2"], ("wss://shore:1", "wamv2")),
    ],
)
def test_teleop_drives_the_boat_of_the_address(cli, monkeypatch, words, driven):
    pytest.importorskip("websockets")
    calls = []
    monkeypatch.setattr("vrx_mj.ros.teleop.driving.drive_served_world", lambda url, *, boat: calls.append((url, boat)))
    assert cli("teleop", *words).code == 0
    assert calls == [driven]
