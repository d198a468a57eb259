"""Names and values of any length: messages show them cut, and are short enough to read."""

import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import vrx_mj
from vrx_mj.config.docks import load_dock
from vrx_mj.config.objects import load_object
from vrx_mj.config.world import load_world
from vrx_mj.errors import (
    LONGEST_NAME,
    ChoiceError,
    CompileError,
    ConfigError,
    Problem,
    StateError,
    UnknownNameError,
    VrxError,
    VrxWarning,
    shorten,
)
from vrx_mj.formats.parts.read import load_parts
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.formats.urdf.reader import read_mesh, read_urdf

MOST = 2000
"""Characters of a message about one mistake."""
LONG = "n" * 50_000
ODD = "\x1b[31m\n" * 9000
WORLD = "ocean"


pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")


def length_of_refusal(call):
    """Of the longest line, and of the whole message."""
    with pytest.raises(VrxError) as caught:
        call()
    return max(map(len, str(caught.value).splitlines())), len(str(caught.value))


def written(name, text):
    Path(name).write_text(text, encoding="utf-8")
    return Path(name)


HERE = "pose: [0, 0, 0, 0, 0, 0]"
TWIN = f"  - {{name: {LONG}, model: surmark46104, {HERE}}}\n"
MACRO = f'<xacro:macro name="m" params="{LONG[:9000]} b"/><xacro:m/>'


def read_text(path):
    return read_urdf(path.read_text(encoding="utf-8"), path)


XACRO = '<robot name="boat" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
LINK = '<link name="hull"><collision><geometry>{}</geometry></collision></link>'
FILES = {
    "world key": ("a.yaml", f"{LONG}: 1", load_world),
    "world value": ("a.yaml", f"sea: {{model: {LONG}}}", load_world),
    "world base": ("a.yaml", f"extends: {LONG}", load_world),
    "world path": ("a.yaml", f"extends: {LONG}.yaml", load_world),
    "world object": ("a.yaml", f"extends: ocean\nobjects: [{{name: a, model: {LONG}, {HERE}}}]", load_world),
    "world two names": ("a.yaml", "extends: ocean\nobjects:\n" + TWIN * 2, load_world),
    "world tag": ("a.yaml", f"a: !{LONG} 1", load_world),
    "world alias": ("a.yaml", f"a: *{LONG}", load_world),
    "world terrain": ("a.yaml", f"terrain: {LONG}", load_world),
    "fleet": ("a.yaml", f"boats: [{{name: '{LONG}', robot: '{LONG}'}}]",
              lambda path: vrx_mj.compile_world(WORLD, fleet=path)),
    "fleet layout": ("a.yaml", f"usv_count: 3\nlayout: {LONG}", lambda path: vrx_mj.compile_world(WORLD, fleet=path)),
    "object mesh": ("a.yaml", f"visuals: [{{type: mesh, file: {LONG}.stl}}]", lambda path: load_object(str(path))),
    "object suffix": ("a.yaml", f"visuals: [{{type: mesh, file: {LONG}}}]", lambda path: load_object(str(path))),
    "dock": ("a.txt", LONG, lambda path: load_dock(str(path))),
    "component": ("a.yaml", f"{LONG}: []", lambda path: load_parts(path, "components")),
    "component value": ("a.yaml", f"wamv_camera: [{{name: {LONG}, x: '${{{LONG}}}'}}]",
                        lambda path: load_parts(path, "components")),
    "thruster": ("a.yaml", f"engine: [{{prefix: left, {LONG}: 1}}]", lambda path: load_parts(path, "thrusters")),
    "xacro property": ("a.xacro", XACRO.format(f'<a b="${{{LONG[:4000]}}}"/>'), expand),
    "xacro macro": ("a.xacro", XACRO.format(f"<xacro:{LONG}/>"), expand),
    "xacro parameters": ("a.xacro", XACRO.format(MACRO), expand),
    "xacro include": ("a.xacro", XACRO.format(f'<xacro:include filename="{LONG}"/>'), expand),
    "xacro package": ("a.xacro", XACRO.format(f'<a b="$(find {LONG[:9000]})"/>'), expand),
    "xacro argument": ("a.xacro", XACRO.format(f'<a b="$(arg {LONG[:9000]})"/>'), expand),
    "xacro tag": ("a.xacro", f"<robot><{LONG}></robot>", expand),
    "xacro said": ("a.xacro", XACRO.format(f"${{xacro.fatal('{LONG[:4000]}')}}"), expand),
    "urdf tag": ("a.urdf", f"<robot><{LONG}></robot>", read_text),
    "urdf root": ("a.urdf", f"<{LONG}/>", read_text),
    "urdf link": ("a.urdf", f'<robot name="a"><link name="{LONG}"/><link name="{LONG}"/></robot>', read_text),
    "urdf mesh": ("a.urdf", f'<robot name="a">{LINK.format(f"<mesh filename={LONG!r}/>")}</robot>', read_text),
    "urdf value": ("a.urdf", f'<robot name="a">{LINK.format(f"<sphere radius={LONG!r}/>")}</robot>', read_text),
    "urdf joint": ("a.urdf", f'<robot name="a"><joint name="{LONG}" type="{LONG}"/></robot>', read_text),
    "mesh": ("a.ply", f"ply\nformat ascii 1.0\nelement {LONG[:9000]} x\nend_header\n", read_mesh),
    "unit": ("a.dae", f"<COLLADA><unit meter='{'9' * 50_000}'/></COLLADA>", read_mesh),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_what_a_file_says_is_cut(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file, text, read = FILES[name]
    longest, whole = length_of_refusal(lambda: read(written(file, text)))
    assert longest < MOST
    assert whole < 2 * MOST


NAMES = {
    "world": vrx_mj.compile_world,
    "world path": lambda name: vrx_mj.compile_world(f"{name}.yaml"),
    "world mapping": lambda name: vrx_mj.compile_world({name: name}),
    "fleet": lambda name: vrx_mj.compile_world(WORLD, fleet=name),
    "dock": load_dock,
    "object": load_object,
    "many": lambda name: load_object(name * 20),
}


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("name", [LONG, ODD, "a/" * 9000, "ü" * 9000])
def test_what_a_call_is_given_is_cut(kind, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert max(length_of_refusal(lambda: NAMES[kind](name))) < 2 * MOST


@pytest.mark.parametrize("number", [1, 40, 4000])
def test_many_mistakes_of_any_length_are_listed_shortly(number):
    error = ConfigError([Problem(LONG, 3, 9, LONG, LONG)] * number)
    lines = str(error).splitlines()
    assert len(lines) <= 41
    assert max(map(len, lines)) < MOST
    assert len(str(pickle.loads(pickle.dumps(error)))) == len(str(error))


@pytest.mark.parametrize("kind", [VrxError, CompileError, StateError, VrxWarning])
def test_no_message_has_a_line_too_long_to_read(kind):
    assert str(kind("short")) == "short"
    assert str(kind("")) == ""
    message = str(kind(f"first\nno {LONG} here\nlast"))
    assert message.splitlines()[::2] == ["first", "last"]
    assert len(message) < MOST
    assert message.splitlines()[1].startswith("no nnn")
    assert message.splitlines()[1].endswith("nnn here")


def test_a_name_among_names_is_cut():
    error = UnknownNameError("boat", LONG, [f"{n}{LONG}" for n in range(20)])
    assert str(error).startswith(f"no boat named '{'n' * 53}…{'n' * 26}'; known: 0{'n' * 52}…{'n' * 26}, 1")
    assert len(str(error)) < MOST
    assert error.name == LONG
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


@given(text=st.text(max_size=200), most=st.integers(4, 100))
def test_a_shortened_text_is_one_line_of_what_it_was(text, most):
    shown = shorten(text, most)
    assert shown.isprintable()
    assert len(shown) <= 10 * most  # a control character takes up to ten: \U0010ffff
    if len(text) <= most and text.isprintable():
        assert shown == text
    if len(text) > most and text.isprintable():
        head, _, tail = shown.partition("…")
        assert len(shown) == most
        assert text.startswith(head)
        assert text.endswith(tail.rpartition("…")[2])


def test_a_long_choice_does_not_move_what_is_said_of_the_others():
    _, _, line = ChoiceError("here", "worlds", {LONG: "one", "b.world": "another"}).text("run").splitlines()
    assert line == f"  {'vrx-mj run b.world':<{LONGEST_NAME}}  # another"
