"""What `$(...)` in launch files stands for, what is refused, and how much text there may be."""

from pathlib import Path

import pytest

from vrx_mj.errors import VrxError
from vrx_mj.formats.gazebo import launch
from vrx_mj.formats.gazebo.launch import Substitutions

GIVEN = {"x": "3", "name": "boat one"}


class Packages:
    """One package beside VRX's."""

    def package(self, name):
        return Path("/bay/mine") if name == "mine" else None

    def known_packages(self):
        return ["mine"]


def substituted(text):
    return Substitutions(Packages()).substitute(text, GIVEN, Path("/bay/launch"))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("plain", "plain"),
        ("$(arg x)", "3"),
        ("a $(arg x) and $(arg name)!", "a 3 and boat one!"),
        ("$(find mine)/a.world", "/bay/mine/a.world"),
        ("$(optenv HOME none)", "none"),
        ("$(optenv HOME one two)", "one two"),
        ("$(optenv HOME)", ""),
        ("$(anon node)", "node_anonymous"),
        ("$(dirname)/b", "/bay/launch/b"),
        (" $(eval 2 * x + 1) ", "7"),
    ],
)
def test_a_substitution_stands_for(text, found):
    assert substituted(text) == found


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a $(eval 1)", "$(eval ...) must be the whole value, as in roslaunch; give it an <arg> of its own"),
        ("$(arg x", "'$(' is never closed"),
        ("$(arg x) $(arg y", "'$(' is never closed"),
        ("$(dirnam)", "no substitution named 'dirnam'; did you mean 'dirname'?"),
        ("$(x)", "no substitution named 'x'; known: find, arg, dirname, cwd, env, optenv, anon, eval"),
        ("$(arg)", "takes one name, $(arg NAME), got 0"),
        ("$(arg x y)", "takes one name, $(arg NAME), got 2"),
        ("$(optenv)", "takes a name and a default: $(optenv NAME DEFAULT)"),
        ("$(env HOME)", "files cannot read the environment variable 'HOME'; declare an argument and use $(arg HOME)"),
    ],
)
def test_what_is_wrong_is_said(text, message):
    with pytest.raises(VrxError) as caught:
        substituted(text)
    assert str(caught.value) == message


def test_unknown_arguments_and_packages_are_named():
    with pytest.raises(VrxError, match=r"'y'.*; declare it first in an <arg>"):
        substituted("$(arg y)")
    with pytest.raises(VrxError, match=r"'yours'.*add its folder to the package paths, or --missing ignore"):
        substituted("$(find yours)")


def test_texts_and_all_of_them_together_have_an_end(monkeypatch):
    monkeypatch.setattr(launch, "_MAX_TEXT", 6)
    monkeypatch.setattr(launch, "_MAX_TEXTS", 10)
    texts = Substitutions(Packages())
    assert texts.substitute("a" * 6, {}, Path()) == "a" * 6
    with pytest.raises(VrxError, match="text too long: at most 6 characters"):
        texts.substitute("a" * 7, {}, Path())
    assert texts.substitute("b" * 4, {}, Path()) == "b" * 4
    with pytest.raises(VrxError, match="more than 1e-05 MB of text"):
        texts.substitute("c", {}, Path())
