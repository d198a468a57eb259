"""numba's cache of compiled functions, made to bear damage: an entry that is not whole is dropped and compiled anew.

Entries are pickles around machine code: to load one is to run it. A digest in front of each file shows damage, such as
half a file after a crash, before anything is read from it. It does not protect from users who can write to the folder,
which is why the folder has to be this user's alone: who can write to a folder above it can put another in its
place, so all of them count, and the folders that symbolic links lie in. On Windows the user's own folders are private
already, and nothing is checked.
"""

import hashlib
import inspect
import pickle
import shutil
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
    _CacheLocator,
    _SourceFileBackedLocatorMixin,
)
from numba.core.runtime import rtsys

_PACKAGE = Path(__file__).parents[1]
_DIGEST = 32
"""Length of the digest in front of a file [bytes]."""

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
        """Keep what was compiled for a signature, if the disk takes it."""
        try:
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
