"""MuJoCo's C functions, callable by name from compiled kernels.

They are those of the library that the `mujoco` package loaded. They take addresses (`model._address`,
`data._address`, `array.ctypes.data`), release the GIL inside a kernel, and cache.
"""

import ctypes
import os
import sys
import threading
from pathlib import Path

import llvmlite.binding
import mujoco
from numba import types

_LIBRARY = {"win32": "mujoco.dll", "darwin": "libmujoco*.dylib"}.get(sys.platform, "libmujoco.so*")


def library() -> Path:
    """Path of the MuJoCo library that the installed `mujoco` package carries."""
    folder = Path(mujoco.__file__).parent
    found = sorted(folder.glob(_LIBRARY))
    assert found, f"no {_LIBRARY} in {folder}"
    return found[0]


llvmlite.binding.load_library_permanently(str(library()))


class _LogConfig(ctypes.Structure):
    """MuJoCo's `mjLogConfig`."""

    _fields_ = (
        ("logto_console", ctypes.c_bool),
        ("logto_file", ctypes.c_bool),
        ("logfile", ctypes.c_char * 1024),
        ("topics", ctypes.c_int),
    )


def _write_no_log() -> None:
    """Keep MuJoCo from writing its warnings to `MUJOCO_LOG.TXT` in the current folder too; on stderr they stay.

    It holds for the whole process, unless somebody has chosen another file.
    """
    functions = ctypes.CDLL(str(library()))
    functions.mju_getLogConfig.restype = _LogConfig
    functions.mju_setLogConfig.argtypes = (_LogConfig,)
    config = functions.mju_getLogConfig()
    if config.logfile == b"MUJOCO_LOG.TXT":
        config.logto_file = False
        functions.mju_setLogConfig(config)


_write_no_log()


def c_function(name: str, result: types.Type, *arguments: types.Type) -> types.ExternalFunction:
    """A function of MuJoCo's, from numba's types of its result and of its arguments; an address is a `uintp`."""
    return types.ExternalFunction(name, result(*arguments))


class _WithoutTimers:
    """Context that keeps MuJoCo from reading the clock around every stage of a step: a fifth of the step of one boat.

    It does so for `MjData.timer`, which stays as it is meanwhile, in other threads too. The clock is a callback,
    `mjcb_time`: one for the whole process, set by the package `mujoco`.
    """

    def __init__(self) -> None:
        self._cell = ctypes.c_void_p.in_dll(ctypes.CDLL(str(library())), "mjcb_time")
        self._taken: int | None = None
        self._inside = 0
        self._start()
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._start)

    def _start(self) -> None:
        self._lock = threading.Lock()  # another thread may have held the old one when the process was forked

    def __enter__(self) -> None:
        with self._lock:
            self._inside += 1
            if self._cell.value is not None:
                self._taken, self._cell.value = self._cell.value, None

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0 and self._cell.value is None:
                self._cell.value = self._taken


without_timers = _WithoutTimers()
