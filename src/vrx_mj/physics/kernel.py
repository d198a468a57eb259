"""The `kernel` decorator: functions compiled by numba, and a cache of compiled code that survives damage.

The folder of the cache belongs to the content of exactly these kernels.

numba optimises every function that a kernel calls and makes machine code of it, and does both once more in each
caller, which holds a copy. Nobody runs the machine code of what only other kernels call, so `LinkedCompiler` leaves it
out. A run's kernels compile in five sixths of the time, and are as fast.

Cache entries are pickles around machine code: to load one is to run it. A digest in front of each file shows damage,
such as half a file after a crash, before anything is read from it; what is damaged is dropped and compiled anew. The
digest does not protect from users who can write to the folder, so the folder has to be this user's alone, and so do
the folders above it and those of symbolic links. On Windows the user's own folders are private already, and nothing is
checked.
"""

import functools
import hashlib
import importlib.metadata
import inspect
import itertools
import os
import pickle
import platform
import re
import secrets
import shutil
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

import numba
from llvmlite import binding
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
    _CacheLocator,
    _SourceFileBackedLocatorMixin,
)
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys

from vrx_mj.cache_folder import Choice, chosen_folder

_ENVIRONMENT = "_ZN08NumbaEnv"
"""How names of numba's environments begin: pointers to objects of Python that a function may use, set after loading."""
_PACKAGE = Path(__file__).parents[1]
_DIGEST = 32
"""Length of the digest in front of a file [bytes]."""
_F = TypeVar("_F", bound=Callable[..., object])
_PACKAGES = ("physics", "sensors", "runtime", "recording")
"""The packages whose modules may hold kernels."""
_HOLDS_KERNELS = re.compile(rb"^@(allocating_|expanded_|inlined_)?kernel\b|^@intrinsic\b|= c_function\(", re.MULTILINE)
_TAKEN_OVER = (
    "constants.py", "libmujoco.py", "model/things.py", "model/boats.py", "model/kinds.py", "model/tables.py",
    "model/water.py", "physics/kernel.py", "physics/tables.py",
)  # fmt: skip
"""Modules without kernels whose numbers, columns and settings are compiled into them."""


class LinkedCompiler(Compiler):  # type: ignore[misc]
    """numba's compiler, for functions that are only called by other compiled functions."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a function of Python."""
        self.state.library = _LinkedLibrary(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class _LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]
    """A function's code for linking; the process gets its environments alone, which numba sets by their address."""

    _final_module: Any

    def _optimize_final_module(self) -> None:
        """Leave it to the callers, which optimise what they have taken in."""

    def _finalize_final_module(self) -> None:
        whole = self._final_module
        names = [variable.name for variable in whole.global_variables if variable.name.startswith(_ENVIRONMENT)]
        environments = "\n".join(f"@{name} = common global ptr null" for name in names)
        self._final_module = binding.parse_assembly(f'target triple = "{whole.triple}"\n{environments}')
        self._final_module.name = whole.name
        super()._finalize_final_module()
        self._final_module = whole


def _name_apart() -> None:
    """Make the names that numba gives to compiled code differ from those of every other process.

    A name is that of the function, the types of its arguments and a number, which numba counts from 1 in each process.
    Different functions with equal names, such as the operators of `lanes`, are one to the linker, which meets code of
    several processes in the cache.
    """
    FunctionIdentity._unique_ids = itertools.count(secrets.randbits(62))


_name_apart()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_name_apart)


_waiting: list[str] = []
_said: set[str] = set()


def say_before_the_first(lines: Iterable[str]) -> None:
    """Have lines written to stderr when the first kernel is looked up: importing is silent."""
    _waiting.extend(lines)


def _say_waiting() -> None:
    while _waiting:
        sys.stderr.write(f"vrx_mj: {_waiting.pop(0)}\n")


def _say_once(kind: str, line: str) -> None:
    """Write a line to stderr, one of a kind for a process."""
    if kind not in _said:
        _said.add(kind)
        sys.stderr.write(f"vrx_mj: {line}\n")


def _say_damaged(path: Path, why: str) -> None:
    _say_once("damaged", f"compiled kernels in {path.parent} are damaged and are compiled again ({path.name}: {why})")


class KernelFiles(IndexDataCacheFile):  # type: ignore[misc]
    """The index of a kernel and the data of its signatures, each a file with a digest in front.

    What is damaged counts as missing, and is removed. Data is named after its key, and written before the index: two
    processes that write at once, or one that dies meanwhile, leave nothing that is taken for something else.
    """

    def save(self, key: object, data: object) -> None:
        """Save what was compiled for a key; OSError if it cannot be written."""
        overloads = self._load_index()
        name = hashlib.blake2b(repr(key).encode(), digest_size=6).hexdigest()
        overloads[key] = self._index_name.removesuffix("nbi") + f"{name}.nbc"
        self._write(overloads[key], self._dump(data))
        self._write(self._index_name, self._dump((self._source_stamp, overloads)))

    def has_entry(self) -> bool:
        """Whether there is an index and data of any signature, both whole."""
        if self._read(self._index_name) is None:
            return False
        data = Path(self._cache_path).glob(f"{self._index_name.removesuffix('nbi')}*.nbc")
        return any(self._read(path.name) is not None for path in data)

    def _load_index(self) -> Any:
        content = self._read(self._index_name)
        if content is None:
            return {}
        stamp, overloads = pickle.loads(content)  # noqa: S301  (ours alone: see above)
        return overloads if stamp == self._source_stamp else {}

    def _load_data(self, name: str) -> object:
        content = self._read(name)
        return None if content is None else pickle.loads(content)  # noqa: S301

    def _write(self, name: str, content: bytes) -> None:
        with self._open_for_write(self._data_path(name)) as file:
            file.write(_digest(name, content))
            file.write(content)

    def _read(self, name: str) -> memoryview | None:
        """What a file holds behind its digest; None without a whole file."""
        path = Path(self._data_path(name))
        try:
            whole = memoryview(path.read_bytes())
        except FileNotFoundError:
            return None
        except OSError as error:
            why = error.strerror or type(error).__name__
        else:
            if whole[:_DIGEST] == _digest(name, whole[_DIGEST:]):
                return whole[_DIGEST:]
            why = "its digest is another"
        _say_damaged(path, why)
        _remove(path)
        return None


def _digest(name: str, content: bytes | memoryview) -> bytes:
    digest = hashlib.blake2b(name.encode() + b"\0", digest_size=_DIGEST)
    digest.update(content)
    return digest.digest()


def _remove(path: Path) -> None:
    """Remove what is in the place of a file, if that is allowed."""
    try:
        path.unlink()
    except OSError:  # a folder
        shutil.rmtree(path, ignore_errors=True)


class _Locator(_SourceFileBackedLocatorMixin, _CacheLocator):  # type: ignore[misc]
    """A subfolder for each package: the folder belongs to the content of our kernels, wherever they are installed."""

    def __init__(self, function: Callable[..., object], source: str, folder: Path) -> None:
        self._py_file, self._lineno = source, function.__code__.co_firstlineno
        self._is_ours = Path(source).is_relative_to(_PACKAGE)
        self._path = str(
            folder / (Path(source).parent.name if self._is_ours else self.get_suitable_cache_subpath(source))
        )

    def get_source_stamp(self) -> object:
        """What tells a changed source; None for ours, of which the folder's name is a digest."""
        return None if self._is_ours else super().get_source_stamp()

    def get_cache_path(self) -> str:
        """Path of that subfolder."""
        return self._path


class _Entries(CompileResultCacheImpl):  # type: ignore[misc]
    """Turns what was compiled into plain data and back."""

    def __init__(self, function: Callable[..., object], folder: Path, form: str) -> None:
        source = inspect.getfile(function)
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Locator(function, source, folder)
        name = f"{Path(source).stem}.{function.__qualname__}{form}"
        self._filename_base = self.get_filename_base(name, sys.abiflags)


class KernelCache(FunctionCache):  # type: ignore[misc]
    """The cache of one kernel in a folder; nothing that goes wrong with it stops a run."""

    def __init__(self, function: Callable[..., object], folder: Path, form: str = "") -> None:
        """`form` is a suffix that distinguishes what one function is compiled to."""
        self._name, self._py_func = repr(function), function
        self._impl = _Entries(function, folder, form)
        self._cache_path = self._impl.locator.get_cache_path()
        self._cache_file = KernelFiles(
            self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp()
        )
        self.enable()

    def has_entry(self) -> bool:
        """Whether something is there to be loaded."""
        _say_waiting()
        return self._cache_file.has_entry()

    def load_overload(self, sig: object, target_context: object) -> object:
        """What was compiled for a signature; None if nothing can be used.

        Machine code needs numba's allocator alone. numba's own cache loads here all that compiling needs, in 0.45 s; a
        kernel that must be compiled loads it then.
        """
        _say_waiting()
        try:
            rtsys.initialize(target_context)
            return self._load_overload(sig, target_context)
        except Exception as error:  # whole, but not for us: whatever pickle and LLVM may raise
            _say_damaged(Path(self._cache_file._index_path), f"{type(error).__name__}: {error}")
            return None

    def save_overload(self, sig: object, data: object) -> None:
        """Keep what was compiled for a signature, if the disk takes it.

        The folder's name is a digest of the sources as they were when this process began: code of a module that is
        edited since is not kept there.
        """
        try:
            if source_stamps() == _STAMPS:
                super().save_overload(sig, data)
        except OSError as error:
            why = error.strerror or type(error).__name__
            _say_once("unsaved", f"compiled kernels cannot be kept in {self._cache_path}: {why}")


class Uncached(NullCache):  # type: ignore[misc]
    """The cache of a kernel without a folder."""

    def has_entry(self) -> bool:
        """Never."""
        _say_waiting()
        return False

    def load_overload(self, sig: object, target_context: object) -> None:
        """Nothing, ever."""
        _say_waiting()


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


def source_stamps() -> list[int]:
    """Return the times [ns] at which modules were last written that may decide what kernels compile to."""
    root = Path(__file__).resolve().parent.parent
    paths = itertools.chain((root / name for name in _TAKEN_OVER), *((root / own).glob("*.py") for own in _PACKAGES))
    return sorted(path.stat().st_mtime_ns for path in paths)


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


_STAMPS = source_stamps()
FOLDER, _REFUSED = cache_choice()
"""Folder of compiled kernels, named after the sources that this process has loaded."""
_INSTEAD = f"{FOLDER} is used instead" if FOLDER else "they are compiled in every process"
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
    """Decorator: numba expands the function where kernels call it, and never compiles it by itself.

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
    return Uncached() if FOLDER is None else KernelCache(function, FOLDER, form)


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
