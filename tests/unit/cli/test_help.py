import re
import shlex
import subprocess
import sys

import pytest
from typer.main import get_command

from vrx_command import environment
from vrx_mj.cli.app import app


def commands(group, before=""):
    """Every command by its words, those of groups too."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, f"{before}{name} ")
        else:
            yield f"{before}{name}", command


COMMANDS = dict(commands(get_command(app)))
HEAVY = {"jinja2", "matplotlib", "mujoco", "numba", "numpy", "pyarrow", "rerun", "scipy", "trimesh", "yaml"}
HELP = """
import sys
sys.argv = ["vrx-mj", *sys.argv[1:]]
from vrx_mj.cli import main
try:
    main()
except SystemExit:
    print("LOADED", *{name.split(".")[0] for name in sys.modules})
"""


def example(name):
    return re.search(r"Example: (vrx-mj .*)", COMMANDS[name].help or "")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_an_example(cli, name):
    said = cli(*name.split(), "--help")
    assert said.code == 0
    assert example(name).group(1) in " ".join(said.out.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_the_example_is_what_the_command_takes(name):
    words = shlex.split(example(name).group(1))
    named = ["vrx-mj", *name.split()]
    assert words[: len(named)] == named
    COMMANDS[name].make_context(name, words[len(named) :])


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_explained(name):
    assert [parameter.name for parameter in COMMANDS[name].params if not getattr(parameter, "help", None)] == []


def test_no_words_show_the_help_too(cli):
    said = cli()
    assert all(f" {name.split()[0]} " in said.out for name in COMMANDS)


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"]])
def test_help_loads_nothing_heavy(words):
    done = subprocess.run(
        [sys.executable, "-c", HELP, *words], capture_output=True, encoding="utf-8", check=True, env=environment()
    )
    assert "Usage" in done.stdout
    assert set(done.stdout.rpartition("LOADED")[2].split()) & HEAVY == set()
