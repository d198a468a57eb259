"""The `kernel` decorator: compiled by numba, cached in a folder that belongs to exactly these sources."""

import hashlib
import importlib.metadata
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

from vrx_mj.physics.kernel_cache import KernelCache, Uncached, say_before_the_first
from vrx_mj.physics.kernel_folder import Choice, chosen_folder

__all__ = ["allocating_kernel", "cache_choice", "cache_folder", "cached", "kernel"]

F = TypeVar("F", bound=Callable[..., Any])

_PACKAGES = ("physics", "sensors", "runtime")
"""The packages whose modules hold kernels. A kernel may call kernels of other files, so all count."""


def source_hash() -> str:
    """Return a digest of all kernel sources and of the versions that decide what they compile to.

    numba's own cache looks only at the file of the kernel that was called, and so would keep old
    code when a kernel in another file changes.
    """
    digest = hashlib.blake2b(digest_size=10)
    root = Path(__file__).resolve().parent.parent
    for package in _PACKAGES:
        for path in sorted((root / package).glob("*.py")):
            digest.update(f"{package}/{path.name}\0".encode() + path.read_bytes() + b"\0")
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
    """Return the first folder for compiled kernels that this user alone can write to, or None where there is none.

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


def kernel(function: F) -> F:
    """Compile `function` with numba: no fastmath, without the GIL, divisions as in numpy.

    A kernel can neither make an array nor return one but those that it was given: numba then does not count who holds
    an array, which it does in every call of a kernel by a kernel, and which was a tenth of a boat's step.
    """
    return _compiled(function, counting=False)


def allocating_kernel(function: F) -> F:
    """Compile a kernel that makes arrays."""
    return _compiled(function, counting=True)


def _compiled(function: F, *, counting: bool) -> F:
    """Have numba compile a function, and cache it in our folder and by our rules, whatever numba's own settings are.

    Without the wrapper for calls from C, which nothing uses, kernels compile in two thirds of the time.
    """
    compiled: Any = numba.njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True, _nrt=counting)(function)
    compiled._cache = Uncached() if _FOLDER is None else KernelCache(function, _FOLDER)
    result: F = compiled
    return result


def cached(compiled: Any) -> bool:
    """Tell whether a kernel need not be compiled: it was in this process, or its cache has an entry that is whole."""
    return bool(compiled.signatures) or compiled._cache.has_entry()
