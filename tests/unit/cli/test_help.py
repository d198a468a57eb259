import re
import shlex

import pytest

from vrx_mj.cli.program import COMMANDS as PROGRAM
from vrx_mj.cli.program import load_command


def commands(members, before=""):
    """Every command by its words, those of groups too."""
    for name, command in members.items():
        if hasattr(command, "commands"):
            yield from commands(command.commands, f"{before}{name} ")
        else:
            yield f"{before}{name}", command


COMMANDS = dict(commands({name: load_command(name) for name in PROGRAM}))


def example(name):
    return re.search(r"Example: (vrx-mj .*)", COMMANDS[name].help or "")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_an_example(cli, name):
    said = cli(*name.split(), "--help")
    assert said.code == 0
    assert example(name).group(1) in " ".join(said.out.split())


def test_the_example_is_what_the_command_takes():
    for name, command in COMMANDS.items():
        words = shlex.split(example(name).group(1))
        named = ["vrx-mj", *name.split()]
        assert words[: len(named)] == named
        command.make_context(name, words[len(named) :])


def test_every_option_is_explained():
    every = [(name, parameter) for name, command in COMMANDS.items() for parameter in command.params]
    assert [(name, parameter.name) for name, parameter in every if not getattr(parameter, "help", None)] == []
