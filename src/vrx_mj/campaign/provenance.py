"""What a campaign's results depend on: the simulator, the files of the controllers, and those of the user's worlds."""

import shlex
import sys
from contextlib import suppress
from functools import cache
from hashlib import file_digest, sha256
from importlib.machinery import PathFinder
from pathlib import Path

import vrx_mj
from vrx_mj.config.search import find, is_path
from vrx_mj.errors import VrxError
from vrx_mj.resources import root
from vrx_mj.runtime.run import split_name

__all__ = ["code_version", "controller_hash", "controller_hashes", "is_ours", "program_hashes"]

DATA = ("assets", "templates", "fleets")
"""Folders of vrx_mj's data."""


@cache
def code_version() -> str:
    """The version of vrx_mj with a digest of its modules and data: what changes a score without a new one shows too."""
    folder = Path(vrx_mj.__file__).resolve().parent
    digest = sha256(_digest(folder, sorted(folder.rglob("*.py"))).encode())
    for name in DATA:
        files = sorted(file for file in (root() / name).rglob("*") if file.is_file())
        digest.update(_digest(root(), files).encode())
    return f"{vrx_mj.__version__} {digest.hexdigest()[:12]}"


def controller_hashes(controllers: tuple[str, ...]) -> dict[str, str]:
    """The digest of each controller's files; errors are those of `controller_hash`."""
    return {name: controller_hash(name) for name in controllers}


def controller_hash(name: str) -> str:
    """Digest of the files of a controller `module:function`: its module, or all modules of the package that holds it.

    Nothing of it is run. Looked for in the current folder first.

    Raises:
        VrxError: the name is not of that form, or there is no such module.
    """
    module, _ = split_name(name)
    found = _sources(module)
    if found is None:
        raise VrxError(f"no module named '{module}' for the controller '{name}'")
    return _digest(*found)


def program_hashes(lines: tuple[str, ...]) -> dict[str, str]:
    """The digest of each line that starts a program, and of the files that it names, seen from the current folder."""
    return {line: _program_hash(line) for line in lines}


def is_ours(kind: str, name: str) -> bool:
    """Whether a world or fleet (`kind`: worlds, fleets) comes with vrx_mj, so that `code_version` tells of changes."""
    return not is_path(name.partition("#")[0]) and find(kind, name).is_relative_to(root())


def _program_hash(line: str) -> str:
    try:
        words = shlex.split(line)
    except ValueError:  # the shell will say what is wrong with it
        words = line.split()
    digest = sha256(line.encode())
    for file in dict.fromkeys(map(Path, words)):
        with suppress(OSError), file.open("rb") as content:  # most words name no file
            digest.update(b"\0" + str(file).encode() + b"\0" + file_digest(content, "sha256").digest())
    return digest.hexdigest()


def _sources(module: str) -> tuple[Path, list[Path]] | None:
    """A folder and the files in it that a module is made of, without importing it; None where it is not found."""
    top, *inner = module.split(".")
    PathFinder.invalidate_caches()
    spec = PathFinder.find_spec(top, [str(Path.cwd()), *sys.path])
    if spec is None:
        return None
    for place in map(Path, spec.submodule_search_locations or ()):
        if not inner or _within(place, inner):
            return place, sorted(place.rglob("*.py"))
    if inner or spec.origin is None:
        return None
    return Path(spec.origin).parent, [Path(spec.origin)]


def _within(package: Path, inner: list[str]) -> bool:
    """Whether a package's folder has this module, as a file or as a package."""
    place = package.joinpath(*inner)
    return place.is_dir() or place.with_suffix(".py").is_file()


def _digest(folder: Path, files: list[Path]) -> str:
    digest = sha256()
    for file in files:
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()
