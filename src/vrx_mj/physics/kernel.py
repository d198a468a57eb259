"""The `kernel` decorator: compiled by numba, cached in a folder that belongs to exactly these sources."""

import contextlib
import hashlib
import importlib.metadata
import os
import platform
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numba

__all__ = ["allocating_kernel", "cache_folder", "cached", "kernel"]

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


def _candidates() -> Iterator[Path]:
    chosen = os.environ.get("VRX_MJ_CACHE")
    if chosen:
        yield Path(chosen)
    with contextlib.suppress(RuntimeError, KeyError):  # no home folder is known
        yield _user_cache(Path.home())
    with contextlib.suppress(OSError):  # there is no usable temporary folder
        shared = Path(tempfile.gettempdir()) / f"vrx_mj-{_user_name()}"
        shared.mkdir(mode=0o700, exist_ok=True)
        if _private(shared):
            yield shared


def _user_cache(home: Path) -> Path:
    """Return the platform's folder for caches of one user."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "vrx_mj"


def _user_name() -> str:
    """Return what keeps users of one temporary folder apart."""
    getuid = getattr(os, "getuid", None)
    return str(getuid()) if getuid else os.environ.get("USERNAME", "user")


def _private(folder: Path) -> bool:
    """Tell whether nobody else can write there: what is kept compiled is run."""
    status, getuid = folder.stat(), getattr(os, "getuid", None)
    return getuid is None or (status.st_uid == getuid() and not status.st_mode & 0o022)


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def cache_folder() -> Path | None:
    """Return the first writable folder for compiled kernels, or None where there is none.

    Tried in order: `VRX_MJ_CACHE`, the user's cache folder, the temporary folder. Each gets a
    subfolder named after `source_hash`, so that several versions live side by side.
    """
    name = source_hash()
    return next((path / name for path in _candidates() if _writable(path / name)), None)


_FOLDER = cache_folder()
_LOCK = threading.Lock()


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
    """Have numba compile a function, and cache it.

    numba fixes the cache's path when a function is decorated, so its global setting is changed
    only for that moment and other users of numba keep theirs. Without the wrapper for calls from C, which
    nothing uses, kernels compile in two thirds of the time.
    """
    cached = _FOLDER is not None
    with _LOCK:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(_FOLDER or "")
        try:
            compiled: F = numba.njit(
                nogil=True, error_model="numpy", no_cfunc_wrapper=True, cache=cached, _nrt=counting
            )(function)
        finally:
            numba.config.CACHE_DIR = before
    return compiled


def cached(compiled: Any) -> bool:
    """Tell whether a kernel need not be compiled: it was in this process, or its cache has an entry."""
    if compiled.signatures:
        return True
    path = compiled.stats.cache_path
    return path is not None and any(Path(path).glob(f"*{compiled.py_func.__name__}-*.nbc"))
