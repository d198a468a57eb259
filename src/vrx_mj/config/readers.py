"""Readers of other people's files, by suffix. `vrx_mj.formats` lists them; this package knows none of them.

A file of ours is YAML, or a name without a suffix: for those nothing is asked and nothing imported.
"""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from vrx_mj.config.tree import Section

FORMATS = "vrx_mj.formats"
"""The package whose READERS are used."""
DOCUMENTS = {"worlds", "fleets", "objects", "robots"}
"""Kinds of which there are files of ours."""
OURS = (".yaml", ".yml")


@dataclass(frozen=True)
class Reader:
    """What turns files of others into documents of ours; functions are named as `module:name` below the package."""

    kind: str
    """What is read: `worlds`, `fleets`, `objects`, `robots`, `series`, `parts` or `meshes`."""
    marks: tuple[str, ...]
    """How a path ends before a '#', or begins; '#' is any path with one, '/' any with one."""
    read: str = ""
    """Function of the path that gives its document: keys and values, and a name; None: it is no such file after all."""
    find: str = ""
    """Function of the path and the folder in which it starts that gives the file; None as above."""

    def claims(self, text: str) -> bool:
        """Whether a path, in lower case, is one of its files."""
        path, _, _ = text.partition("#")
        within = {one for one in "#/" if one in text}
        return any(path.endswith(one) or text.startswith(one) or one in within for one in self.marks)


def read_others(kind: str, source: object) -> tuple[Section, str] | None:
    """The document of a file that is not ours; None: it is, or a name."""
    read = function_of(kind, source)
    found: tuple[Section, str] | None = read(source) if read else None
    return found


def file_of_others(kind: str, text: object, near: Path | None) -> Path | None:
    """The file that is not ours at a path from the folder `near` on; None: it is, or a name."""
    find = function_of(kind, text, find=True)
    found: Path | None = find(text, near) if find else None
    return found


def function_of(kind: str, source: object, *, find: bool = False) -> Callable[..., Any] | None:
    """The function that reads, or finds, files of this kind with the suffix of a path; None without one."""
    if not isinstance(source, str | Path):
        return None
    text = str(source).lower()
    if kind in DOCUMENTS and (text.endswith(OURS) or not any(mark in text for mark in "./#")):
        return None
    own = (reader for reader in _readers() if reader.kind == kind and reader.claims(text))
    name = next(filter(None, (reader.find if find else reader.read for reader in own)), None)
    return None if name is None else _loaded(name)


@functools.cache
def _readers() -> Sequence[Reader]:
    readers: Sequence[Reader] = import_module(FORMATS).READERS
    return readers


@functools.cache
def _loaded(function: str) -> Callable[..., Any]:
    module, _, name = function.partition(":")
    loaded: Callable[..., Any] = getattr(import_module(f"{FORMATS}.{module}"), name)
    return loaded
