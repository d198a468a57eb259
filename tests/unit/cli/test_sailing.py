"""`vrx-mj run`: what its words hand on, and how a recording is closed."""

import sys
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from vrx_mj.cli import sailing
from vrx_mj.cli.options import compile_source
from vrx_mj.errors import CommandError


@pytest.fixture
def did(monkeypatch):
    """What is done to a recording, in order."""
    log = []

    @contextmanager
    def noted(*given, **named):
        log.append(("open", *given, named))
        yield
        log.append(f"closed {given[0]}")

    monkeypatch.setattr("vrx_mj.recording.record", noted)
    monkeypatch.setattr(sailing, "waiting", noted)
    monkeypatch.setattr(sailing, "_lean_pyarrow", lambda: log.append("lean"))
    return log


@pytest.mark.parametrize("pandas", [False, True])
def test_closing_a_recording_is_shown_until_it_is_closed(did, pandas):
    with sailing.recording("sim", Path("run.rrd"), "all", follow="a", pandas=pandas):
        did.append("sails")
    lean = [] if pandas else ["lean"]
    assert did == [
        ("open", "sim", Path("run.rrd"), {"sensors": "all", "follow": "a"}), "sails",
        ("open", "closing the recording", {}), *lean, "closed sim", "closed closing the recording",
    ]  # fmt: skip


def test_without_a_file_nothing_is_recorded(did):
    with sailing.recording("sim", None, ()):
        did.append("sails")
    assert did == ["sails"]


def test_pandas_is_not_found_while_pyarrow_looks_for_it(monkeypatch):
    before, pools = sys.meta_path[:], []

    def array(values):
        assert values == [0]
        with pytest.raises(ModuleNotFoundError) as caught:
            sys.meta_path[0].find_spec("pandas", None)
        assert caught.value.name == "pandas"
        assert sys.meta_path[0].find_spec("csv", None) is None
        raise RuntimeError

    arrow = SimpleNamespace(array=array, set_memory_pool=pools.append, system_memory_pool=lambda: "system")
    monkeypatch.setitem(sys.modules, "pyarrow", arrow)
    monkeypatch.setattr(sailing, "release_memory", lambda: pools.append("released"))
    with pytest.raises(RuntimeError):
        sailing._lean_pyarrow()
    assert (sys.meta_path, pools) == (before, ["released", "system"])


@pytest.mark.parametrize(
    ("words", "opened", "rest"),
    [
        (None, "bay", {}),
        (["x:=1", "y:=2"], "bay", {"x": "1", "y": "2"}),
        (["a.LAUNCH", "x:=1"], "bay/a.LAUNCH", {"x": "1"}),
        (["a.launch:=1.launch"], "bay", None),
        (["file:=a.launch"], "bay", {"file": "a.launch"}),
    ],
)
def test_a_world_may_be_a_file_of_a_folder_with_arguments(monkeypatch, words, opened, rest):
    given = []
    monkeypatch.setattr("vrx_mj.mjcf.compile.compile_world", lambda *own, **how: given.append((*own, how)) or "world")
    monkeypatch.setattr("vrx_mj.formats.gazebo.opening.file_in", lambda folder, file: f"{folder}/{file}")
    if rest is None:
        with pytest.raises(CommandError, match=r"^invalid argument 'a\.launch:=1\.launch'"):
            compile_source("bay", words)
        return
    assert compile_source("bay", words, fleet="two", seed=3, nudge=True) == "world"
    assert given == [(opened, {"fleet": "two", "seed": 3, "nudge": True, "arguments": rest})]


def test_controllers_are_the_words_or_the_fleets_own(monkeypatch):
    made, sim = [], SimpleNamespace(seed=4)
    for name in ("steady", "load_controller", "fleet_controller"):
        monkeypatch.setattr(sailing, name, lambda *given, name=name: made.append((name, *given)) or name)
    monkeypatch.setattr(sys, "path", ["/lib"])
    monkeypatch.setattr(sailing, "names_controllers", lambda _sim: False)
    assert sailing.steering(None, None)(sim) is None
    assert sys.path == ["/lib"]
    assert sailing.steering(None, "left=1")(sim) == "steady"
    monkeypatch.setattr(sailing, "names_controllers", lambda _sim: True)
    assert sailing.steering(None, None)(sim) == "fleet_controller"
    assert sys.path == [str(Path.cwd()), "/lib"]
    assert sailing.steering("a:f", None)(sim) == "load_controller"
    assert made == [("steady", sim, {"left": 1.0}), ("fleet_controller", sim), ("load_controller", "a:f", 4, sim)]
    with pytest.raises(CommandError, match=r"^--control and --thrust both command the boats: give one of them$"):
        sailing.steering("a:f", "left=1")


def test_a_run_is_recorded_shown_and_steered_as_asked(monkeypatch):
    log = []
    sim = SimpleNamespace(steps_in=log.append, advance="advance")

    @contextmanager
    def noted(*given, **named):
        log.append((*given, named))
        yield "tick"

    monkeypatch.setattr(sailing, "check_interrupts", lambda: log.append("interrupts"))
    monkeypatch.setattr(sailing, "planned_duration", lambda _sim: 60.0)
    for name in ("recording", "terminal_bar"):
        monkeypatch.setattr(sailing, name, noted)
    monkeypatch.setattr(sailing, "run", lambda *given, **how: (*given, how))
    handed = {"controller": "control", "progress": "tick", "advance": "advance"}
    assert sailing.sail(sim, "control", None, record="run.rrd", sensors="all", follow="a", own_code=True) == (
        sim, None, handed
    )  # fmt: skip
    assert log == ["interrupts", 60.0, (sim, "run.rrd", "all", {"follow": "a", "pandas": True}), (sim, 60.0, {})]
    log.clear()
    assert sailing.sail(sim, None, 5.0, own_code=True)[1:] == (5.0, handed | {"controller": None})
    assert log == ["interrupts", 5.0, (sim, None, (), {"follow": None, "pandas": False}), (sim, 5.0, {})]
