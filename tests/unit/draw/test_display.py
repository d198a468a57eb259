"""Whether pictures can be drawn: what is said of each way, without drawing."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from vrx_mj.draw import display
from vrx_mj.draw.display import Attempt, has_display, no_window, try_backend


@pytest.fixture
def answers(monkeypatch):
    """What the processes that draw answer, and what they were started with."""
    calls = []

    def run(command, **options):
        calls.append((command, options))
        if isinstance(run.answer, Exception):
            raise run.answer
        return SimpleNamespace(**run.answer)

    monkeypatch.setattr(display.subprocess, "run", run)

    def answer(stdout="", stderr="", returncode=0, error=None):
        run.answer = error or {"stdout": stdout, "stderr": stderr, "returncode": returncode}
        return calls

    return answer


@pytest.mark.parametrize(
    ("said", "attempt"),
    [
        ({"stdout": "noise\nDREW llvmpipe (x)\n"}, Attempt(True, "llvmpipe (x)")),
        ({"stdout": "DREW llvmpipe\n", "returncode": 1}, Attempt(False, "no answer")),
        ({"stdout": "BLANK llvmpipe\n", "stderr": "noise"}, Attempt(False, "the picture stays blank")),
        ({"stderr": "Traceback\nImportError: no\n", "returncode": 1}, Attempt(False, "ImportError: no")),
        (
            {"stderr": "AttributeError: 'NoneType' object has no attribute 'x'", "returncode": 1},
            Attempt(False, "its library of OpenGL is not installed"),
        ),
        ({"error": OSError("no memory\nat all")}, Attempt(False, "no memory")),
    ],
)
def test_what_a_process_answers_is_told(answers, said, attempt):
    answers(**said)
    assert try_backend("egl", {}) == attempt


def test_each_way_is_tried_in_a_process_of_its_own_for_20_s(answers):
    calls = answers(stdout="DREW x")
    for backend, platform in (("egl", "egl"), ("osmesa", "osmesa"), ("glfw", None)):
        try_backend(backend, {"A": "b"})
        command, options = calls[-1]
        named = {"PYOPENGL_PLATFORM": platform} if platform else {}
        assert options["env"] == {"A": "b", "MUJOCO_GL": backend, **named}
        assert command[0] == sys.executable
        assert options["timeout"] == 20.0
    answers(error=subprocess.TimeoutExpired(["python"], 20.0))
    assert "timed out after 20.0 seconds" in try_backend("egl", {}).detail


@pytest.mark.parametrize(
    ("variables", "platform", "there"),
    [
        ({}, "linux", False),
        ({"DISPLAY": ":0"}, "linux", True),
        ({"DISPLAY": "", "WAYLAND_DISPLAY": "w"}, "linux", True),
        ({"DISPLAY": ""}, "linux2", False),
        ({}, "win32", True),
    ],
)
def test_a_display_is_named_on_linux_and_there_elsewhere(variables, platform, there):
    assert has_display(variables, platform) is there


def test_why_no_window_can_be_opened(answers, monkeypatch):
    assert no_window({}, "linux") == "no display: neither DISPLAY nor WAYLAND_DISPLAY is set"
    answers(stdout="DREW x")
    assert no_window({"DISPLAY": ":0"}, "linux") is None
    answers(stdout="BLANK x")
    assert no_window({"DISPLAY": ":0"}, "linux") == "the display cannot draw: the picture stays blank"
    monkeypatch.setattr(display, "_has_main_thread", lambda: False)
    assert no_window({}, "darwin") == "on macOS MuJoCo's window needs mjpython: mjpython -m vrx_mj view ..."
    assert no_window({}, "darwin", mujoco=False) == "the display cannot draw: the picture stays blank"
    monkeypatch.setattr(display, "_has_main_thread", lambda: True)
    answers(stdout="DREW x")
    assert no_window({}, "darwin") is None
