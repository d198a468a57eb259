"""numba's cache of compiled functions, made to bear damage: an entry that is not whole is dropped and compiled anew.

Entries are pickles around machine code: to load one is to run it. A digest in front of each file shows damage, such as
half a file after a crash, before anything is read from it. It does not protect from users who can write to the folder,
which is why the folder has to be this user's alone: who can write to a folder above it can put another in its
place, so all of them count, and the folders that symbolic links lie in. On Windows the user's own folders are private
already, and nothing is checked.
"""

import contextlib
import hashlib
import inspect
import os
import pickle
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
    _CacheLocator,
    _SourceFileBackedLocatorMixin,
)
from numba.core.runtime import rtsys

DIGEST = 32
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
        self._save_data(overloads[key], data)
        self._save_index(overloads)

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

    def _save_index(self, overloads: object) -> None:
        self._write(self._index_name, self._dump((self._source_stamp, overloads)))

    def _load_data(self, name: str) -> object:
        content = self._read(name)
        return None if content is None else pickle.loads(content)  # noqa: S301

    def _save_data(self, name: str, data: object) -> None:
        self._write(name, self._dump(data))

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
            if whole[:DIGEST] == _digest(name, whole[DIGEST:]):
                return whole[DIGEST:]
            why = "its digest is another"
        _say_damaged(path, why)
        _remove(path)
        return None


def _digest(name: str, content: bytes | memoryview) -> bytes:
    digest = hashlib.blake2b(name.encode() + b"\0", digest_size=DIGEST)
    digest.update(content)
    return digest.digest()


def _remove(path: Path) -> None:
    """Remove what is in the place of a file, if that is allowed."""
    try:
        path.unlink()
    except OSError:  # a folder
        shutil.rmtree(path, ignore_errors=True)


class _Locator(_SourceFileBackedLocatorMixin, _CacheLocator):  # type: ignore[misc]
    """A subfolder of our folder for each package."""

    def __init__(self, function: Callable[..., object], source: str, folder: Path) -> None:
        self._py_file, self._lineno = source, function.__code__.co_firstlineno
        self._path = str(folder / self.get_suitable_cache_subpath(source))

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


LOOSE = stat.S_IWGRP | stat.S_IWOTH
LINKS = 40
"""Symbolic links on one path, as many as Linux follows."""


class Choice(NamedTuple):
    """A folder for compiled kernels."""

    folder: Path | None
    """The folder, if any."""
    refused: tuple[str, ...]
    """Why the candidates before it are not used, a sentence for each."""


class _Candidate(NamedTuple):
    """A folder that may be used."""

    path: Path
    asked: bool = False
    """Whether the user has named it."""
    ours: bool = False
    """Whether it is for us alone, inside a folder of the user's."""


def chosen_folder(name: str) -> Choice:
    """The first candidate in which a folder `name` can be written by this user alone; it is made.

    Tried in order: `VRX_MJ_CACHE`, the user's cache folder, the temporary folder.
    """
    refused: list[str] = []
    for candidate in _candidates():
        folder = candidate.path / name
        if candidate.ours:
            _make_private(candidate.path, name)
        reason = insecure(folder)
        if reason is None and not _writable(folder):
            reason = "it cannot be written" if candidate.asked else ""
        reason = insecure(folder) if reason is None else reason
        if reason is None:
            return Choice(folder, tuple(refused))
        if reason:
            refused.append(f"no compiled kernels are read from {candidate.path} or kept there: {reason}")
    return Choice(None, tuple(refused))


def insecure(folder: Path) -> str | None:
    """Why somebody else could put files into a folder, or the folder into the place of another; None: nobody could.

    Trusted are this user, root, and the owner of the root folder, who in a container may have another number.
    """
    getuid = getattr(os, "getuid", None)
    if getuid is None:
        return None
    try:
        trusted, last = {0, getuid(), Path(folder.absolute().anchor).stat().st_uid}, Path(os.path.realpath(folder))
        for step in _steps(folder.absolute()):
            mode, owner = step.lstat().st_mode, step.lstat().st_uid
            if owner not in trusted:
                return f"{step} belongs to another user"
            apart = mode & stat.S_ISVTX and step != last  # in /tmp each keeps what it made
            if mode & LOOSE and not (stat.S_ISLNK(mode) or apart):
                return f"others can write to {step}"
    except OSError:  # from here on there is nothing yet
        return None
    return None


def _steps(path: Path) -> Iterator[Path]:
    """All folders and symbolic links that are passed on the way along an absolute path, from the root on."""
    here, left, links = Path(path.anchor), list(path.parts[:0:-1]), 0
    yield here
    while left:
        step = here / left.pop()
        yield step
        if step.name == "..":
            here = here.parent
        elif step.is_symlink() and links < LINKS:
            target, links = step.readlink(), links + 1
            left += target.parts[:0:-1] if target.is_absolute() else target.parts[::-1]
            here = Path(target.anchor) if target.is_absolute() else here
        else:
            here = step


def _candidates() -> Iterator[_Candidate]:
    asked = os.environ.get("VRX_MJ_CACHE")
    if asked:
        with contextlib.suppress(OSError):  # the current folder is gone
            yield _Candidate(Path(asked).absolute(), asked=True)
    with contextlib.suppress(RuntimeError, KeyError):  # no home folder is known
        yield _Candidate(_user_cache(Path.home()), ours=True)
    with contextlib.suppress(OSError):  # there is no usable temporary folder
        yield _Candidate(Path(tempfile.gettempdir()) / f"vrx_mj-{_user_name()}")


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


def _make_private(path: Path, name: str) -> None:
    """Take the right to write from others, where a folder of ours was made under a umask of 002.

    What they may have put there under `name` meanwhile is removed.
    """
    getuid = getattr(os, "getuid", None)
    with contextlib.suppress(OSError):
        status = path.lstat()
        if getuid and stat.S_ISDIR(status.st_mode) and status.st_uid == getuid() and status.st_mode & LOOSE:
            path.chmod(stat.S_IMODE(status.st_mode) & ~LOOSE)
            shutil.rmtree(path / name, ignore_errors=True)


def _writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made, with those above it, for this user alone."""
    try:
        for missing in [*reversed(folder.parents), folder]:
            with contextlib.suppress(FileExistsError):
                missing.mkdir(mode=0o700)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
