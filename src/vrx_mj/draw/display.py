"""Whether pictures can be drawn here: each way is tried, in a process of its own, since a failure may end it."""

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass

_ATTEMPT_TIMEOUT = 20.0
"""Longest that an attempt may take [s]."""

_DRAW = """
import mujoco
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><light pos="0 0 3"/><geom size="1" rgba="1 0 0 1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 48, 48)
renderer.update_scene(data)
picture = renderer.render()
from OpenGL import GL
name = GL.glGetString(GL.GL_RENDERER)
renderer.close()
print("DREW" if picture[24, 24, 0] > 20 else "BLANK", name.decode() if name else "")
"""
"""Draws a red ball; the last line is whether it is seen, and on what."""


@dataclass(frozen=True)
class Attempt:
    """How drawing went."""

    works: bool
    detail: str
    """The renderer's name, or why nothing was drawn."""


def try_backend(backend: str, environment: Mapping[str, str] | None = None) -> Attempt:
    """Draw a picture with one of MuJoCo's ways."""
    variables = {**(os.environ if environment is None else environment), "MUJOCO_GL": backend}
    if backend != "glfw":
        variables["PYOPENGL_PLATFORM"] = backend
    command = [sys.executable, "-W", "ignore", "-c", _DRAW]
    try:
        done = subprocess.run(
            command, env=variables, capture_output=True, timeout=_ATTEMPT_TIMEOUT, check=False, encoding="utf-8",
            errors="replace", stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        return Attempt(False, str(error).partition("\n")[0])
    outcome, _, name = _last_line(done.stdout).partition(" ")
    if done.returncode == 0 and outcome == "DREW":
        return Attempt(True, name)
    why = "the picture stays blank" if outcome == "BLANK" else _last_line(done.stderr) or "no answer"
    missing = why.startswith("AttributeError: 'NoneType'")  # what PyOpenGL makes of a library that it does not find
    return Attempt(False, "its library of OpenGL is not installed" if missing else why)


def has_display(environment: Mapping[str, str] | None = None, platform: str = sys.platform) -> bool:
    """Whether there is a display for windows: on Linux the environment names it, elsewhere there always is one."""
    variables = os.environ if environment is None else environment
    named = variables.get("DISPLAY") or variables.get("WAYLAND_DISPLAY")
    return bool(named) or not platform.startswith("linux")


def no_window(
    environment: Mapping[str, str] | None = None, platform: str = sys.platform, *, mujoco: bool = True
) -> str | None:
    """Why MuJoCo's window, or that of another program, cannot be opened here; None where it can.

    Args:
        environment: variables; those of this process by default.
        platform: as `sys.platform`.
        mujoco: whether it is MuJoCo's, for which macOS wants the main thread.
    """
    variables = os.environ if environment is None else environment
    if platform == "darwin" and mujoco and not _has_main_thread():
        return "on macOS MuJoCo's window needs mjpython: mjpython -m vrx_mj view ..."
    if not has_display(variables, platform):
        return "no display: neither DISPLAY nor WAYLAND_DISPLAY is set"
    attempt = try_backend("glfw", variables)
    return None if attempt.works else f"the display cannot draw: {attempt.detail}"


def _has_main_thread() -> bool:
    from mujoco import viewer

    return getattr(viewer, "_MJPYTHON", None) is not None


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1].strip() if lines else ""
