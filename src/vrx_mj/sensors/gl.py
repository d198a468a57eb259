"""OpenGL without a screen: which way of getting it works on this machine, and a context of it.

MuJoCo settles this when it is imported, from `MUJOCO_GL`; without that variable it takes GLFW, which needs a
screen. Here it is settled when the first picture is drawn: `MUJOCO_GL` is obeyed, and without it EGL, then OSMesa
are tried. Neither touches a screen, and each may be used from any thread, one at a time.
"""

import ctypes
import functools
import importlib
import os
import sys
from collections.abc import Callable
from typing import Any

from vrx_mj.errors import RenderError

__all__ = ["BACKENDS", "check_process", "choose_backend", "is_forked", "new_context", "problem_of"]

BACKENDS = ("egl", "osmesa")
"""Ways to draw without a screen on Linux, in the order in which they are tried."""
DEBIAN = {
    "egl": "libegl1 libgl1-mesa-dri libopengl0",
    "osmesa": "libosmesa6 libopengl0",
    "glfw": "libgl1 libgl1-mesa-dri",
}
"""What MuJoCo's ways to draw need, as Debian and Ubuntu call it; glfw draws on a screen."""
OFF = ("disable", "disabled", "off", "false", "0")
"""Values of `MUJOCO_GL` that forbid drawing."""
AUTOMATIC = ("", "enable", "enabled", "on", "true", "1")
"""Values of `MUJOCO_GL` that leave the choice to the program."""

_EGL_PLATFORM_DEVICE = 0x313F


def new_context(width: int, height: int) -> Any:
    """A fresh OpenGL context of the backend that `choose_backend` names.

    Raises:
        RenderError: there is none, with what to install; or as `check_process` tells.
    """
    check_process()
    backend = choose_backend()
    try:
        module = "mujoco.rendering.classic.gl_context" if backend == "mujoco" else f"mujoco.{backend}"
        return importlib.import_module(module).GLContext(width, height)
    except (ImportError, RuntimeError, AttributeError, OSError) as error:
        raise RenderError(_advice({backend: str(error)})) from error


def check_process() -> None:
    """See that OpenGL works in this process: its locks and threads do not live on in a forked one, and it would hang.

    Raises:
        RenderError: the process was forked from one that had drawn.
    """
    if is_forked():
        raise RenderError(
            "this process was forked from one that had drawn pictures, so it cannot draw: "
            "start it with 'spawn' or 'forkserver', or draw only in processes that were forked before"
        )


def is_forked() -> bool:
    """Whether the process was forked from one that had drawn."""
    return _drawing_process() != os.getpid()


@functools.cache
def _drawing_process() -> int:
    """The first process that asked."""
    return os.getpid()


@functools.cache
def choose_backend() -> str:
    """`egl`, `osmesa`, or `mujoco` for what MuJoCo has chosen itself: on other systems, or by `MUJOCO_GL=glfw`.

    It is settled once for a process, because PyOpenGL can be imported for one of them only.

    Raises:
        RenderError: none works, with what to install.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wanted in OFF:
        raise RenderError(f"MUJOCO_GL={wanted} forbids drawing; unset it, or set it to egl or osmesa")
    if sys.platform != "linux" or wanted not in (*BACKENDS, *AUTOMATIC):
        return "mujoco"
    problems: dict[str, str] = {}
    for backend in (wanted,) if wanted in BACKENDS else BACKENDS:
        problem = problem_of(backend)
        if problem is None:
            return backend
        problems[backend] = problem
    if wanted not in BACKENDS and os.environ.get("DISPLAY"):
        return "mujoco"
    raise RenderError(_advice(problems))


def problem_of(backend: str) -> str | None:
    """Why `egl` or `osmesa` cannot draw here, or None if it can."""
    platform = os.environ.get("PYOPENGL_PLATFORM", "").lower()
    if platform and platform != backend:
        return f"PYOPENGL_PLATFORM={platform} prevents it"
    probes: dict[str, Callable[[], str | None]] = {"egl": _egl_problem, "osmesa": _osmesa_problem}
    try:
        return probes[backend]()
    except OSError as error:
        return str(error)


def _egl_problem() -> str | None:
    """Whether some device gives a display, asked of the library itself: PyOpenGL could not be taken back."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    names = (b"eglQueryDevicesEXT", b"eglGetPlatformDisplayEXT")
    query, display_of = (egl.eglGetProcAddress(name) for name in names)
    if not (query and display_of):
        return "libEGL does not support drawing without a screen"
    devices, number = (ctypes.c_void_p * 16)(), ctypes.c_int()
    ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(query)(
        16, ctypes.addressof(devices), ctypes.addressof(number)
    )
    open_display = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)(display_of)
    egl.eglInitialize.argtypes = [ctypes.c_void_p] * 3
    for device in devices[: number.value]:
        display = open_display(_EGL_PLATFORM_DEVICE, device, None)
        if display and egl.eglInitialize(display, None, None):
            return None
    return "libEGL finds no device, neither a graphics card nor Mesa's software"


def _osmesa_problem() -> str | None:
    names = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
    errors = []
    for name in names:
        try:
            ctypes.CDLL(name)
        except OSError as error:
            errors.append(str(error))
        else:
            return None
    return errors[0]


def _advice(problems: dict[str, str]) -> str:
    found = "".join(f"\n  {backend}: {problem}" for backend, problem in problems.items())
    lines = "".join(f"\n  sudo apt-get install -y {DEBIAN[name]}    # then MUJOCO_GL={name}" for name in BACKENDS)
    return (
        f"cannot draw pictures without a screen:{found}\nInstall one of these; it is found automatically, "
        f"or selected by the variable MUJOCO_GL:{lines}"
    )
