"""MuJoCo's C functions, callable by name from compiled kernels.

They are those of the library that the `mujoco` package loaded. They take addresses (`model._address`,
`data._address`, `array.ctypes.data`), release the GIL inside a kernel, and cache.
"""

import sys
from pathlib import Path
from typing import Any

import llvmlite.binding
import mujoco
from numba import types

__all__ = ["c_function", "library"]

_LIBRARY = {"win32": "mujoco.dll", "darwin": "libmujoco*.dylib"}.get(sys.platform, "libmujoco.so*")


def library() -> Path:
    """Path of the MuJoCo library that the installed `mujoco` package carries."""
    folder = Path(mujoco.__file__).parent
    found = sorted(folder.glob(_LIBRARY))
    assert found, f"no {_LIBRARY} in {folder}"
    return found[0]


llvmlite.binding.load_library_permanently(str(library()))


def c_function(name: str, result: Any, *arguments: Any) -> types.ExternalFunction:
    """A function of MuJoCo's, from numba's types of its result and of its arguments; an address is a `uintp`."""
    return types.ExternalFunction(name, result(*arguments))
