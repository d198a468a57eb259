"""The `kernel` decorator: compiled by numba, cached in a folder that belongs to exactly these kernels."""

import functools
import hashlib
import importlib.metadata
import platform
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.registry import CPUDispatcher

from vrx_mj.cache_folder import Choice, chosen_folder
from vrx_mj.physics.kernel_cache import KernelCache, Uncached, say_before_the_first
from vrx_mj.physics.linked_library import LinkedCompiler

_F = TypeVar("_F", bound=Callable[..., object])

_PACKAGES = ("physics", "sensors", "runtime", "recording")
"""The packages whose modules may hold kernels."""
_HOLDS_KERNELS = re.compile(rb"^@(allocating_|expanded_|inlined_)?kernel\b|^@intrinsic\b|= c_function\(", re.MULTILINE)
_TAKEN_OVER = (
    "constants.py", "libmujoco.py", "model/afloat.py", "model/boats.py", "model/kinds.py", "model/tables.py",
    "model/water.py", "physics/kernel.py", "physics/linked_library.py", "physics/panel_mesh.py", "physics/tables.py",
)  # fmt: skip
"""Modules without kernels whose numbers, columns and settings are compiled into them."""


def kernel_modules(root: Path) -> dict[str, bytes]:
    """Return the source of every module under the package's folder that decides what kernels compile to, by path."""
    found = {name: (root / name).read_bytes() for name in _TAKEN_OVER}
    for package in _PACKAGES:
        for path in (root / package).glob("*.py"):
            source = path.read_bytes()
            if _HOLDS_KERNELS.search(source):
                found[f"{package}/{path.name}"] = source
    return found


def source_hash() -> str:
    """Return a digest of all modules with kernels and of the versions that decide what they compile to.

    numba's own cache looks only at the file of the kernel that was called, and so would keep old
    code when a kernel in another file changes.
    """
    digest = hashlib.blake2b(digest_size=10)
    for name, source in sorted(kernel_modules(Path(__file__).resolve().parent.parent).items()):
        digest.update(f"{name}\0".encode() + source + b"\0")
    digest.update(f"{numba.__version__} {_mujoco_version()} {platform.python_version()}".encode())
    return digest.hexdigest()


def _mujoco_version() -> str:
    """Return the installed version's line; `importlib.metadata.version` reads the whole file, in 4 ms."""
    try:
        text = importlib.metadata.distribution("mujoco").read_text("METADATA") or ""
    except importlib.metadata.PackageNotFoundError:
        return "none"
    return next((line for line in text.splitlines() if line.startswith("Version:")), "unknown")


def cache_folder() -> Path | None:
    """Return the first folder for compiled kernels that this user alone can write to, or None without one.

    Tried in order: `VRX_MJ_CACHE`, the user's cache folder, the temporary folder. Each gets a
    subfolder named after `source_hash`, so that several versions live side by side.
    """
    return cache_choice().folder


def cache_choice() -> Choice:
    """Return that folder, and why others are not used."""
    return chosen_folder(source_hash())


_FOLDER, _REFUSED = cache_choice()
_INSTEAD = f"{_FOLDER} is used instead" if _FOLDER else "they are compiled in every process"
say_before_the_first(f"{reason}; {_INSTEAD}" for reason in _REFUSED)


def kernel(function: _F) -> _F:
    """Compile `function` with numba: no fastmath, without the GIL, divisions as in numpy.

    A kernel can neither make an array nor return one but those that it was given: numba then does not count who holds
    an array, which it does in every call of a kernel by a kernel, and which was a tenth of a boat's step.
    """
    return _compile(function, counting=False)


def inlined_kernel(function: _F) -> _F:
    """Compile a kernel that becomes part of its callers: for one that takes many arrays, which a call would copy."""
    return _compile(function, counting=False, inlined=True)


def allocating_kernel(function: _F) -> _F:
    """Compile a kernel that makes arrays."""
    return _compile(function, counting=True)


def expanded_kernel(function: _F) -> _F:
    """Have numba write a function out where kernels call it: it is never compiled by itself, only as a part of them.

    Arguments that are constants there, None above all, decide which of its branches are compiled.
    """
    return _compile(function, counting=True, expanded=True)


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A compiled function that has two forms, each compiled when first needed.

    What Python calls has a wrapper that turns Python's objects into numbers and arrays. What other kernels call has
    none, and so compiles in three quarters of the time: nearly all kernels of a run are of that form alone.
    """

    def __init__(self, py_func: _F, locals: object = None, targetoptions: object = None, **settings: object) -> None:  # noqa: A002
        super().__init__(py_func, locals, targetoptions, **settings)
        self._cache = _cache_of(py_func)

    @functools.cached_property
    def _callee(self) -> CPUDispatcher:
        """The form for other kernels, which a process that finds those in the cache never makes."""
        options = {**self.targetoptions, "no_cpython_wrapper": True}
        callee = CPUDispatcher(self.py_func, self.locals, options, LinkedCompiler)
        callee._cache = _cache_of(self.py_func, ".callee")
        return callee

    def get_call_template(self, args: object, kws: object) -> object:
        """What numba needs to know to compile a call of this kernel in another one."""
        return self._callee.get_call_template(args, kws)

    def get_overload(self, sig: object) -> object:
        """The code that another kernel calls."""
        return self._callee.get_overload(sig)


def _cache_of(function: Callable[..., object], form: str = "") -> KernelCache | Uncached:
    return Uncached() if _FOLDER is None else KernelCache(function, _FOLDER, form)


def _compile(function: _F, *, counting: bool, inlined: bool = False, expanded: bool = False) -> _F:
    """Have numba compile a function, and cache it in our folder and by our rules, whatever numba's own settings are.

    Without the wrapper for calls from C, which nothing uses, kernels compile in two thirds of the time.
    """
    options = {
        "nopython": True,
        "nogil": True,
        "error_model": "numpy",
        "no_cfunc_wrapper": True,
        "_nrt": counting,
        "forceinline": inlined,
        "inline": "always" if expanded else "never",
    }
    compiled: Any = Kernel(function, None, options)
    result: _F = compiled
    return result


def is_cached(compiled: Any) -> bool:
    """Whether a kernel need not be compiled: it was in this process, or its cache has an entry that is whole."""
    return bool(compiled.signatures) or compiled._cache.has_entry()
