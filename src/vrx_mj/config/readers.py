"""Readers of other people's files, by suffix. `vrx_mj.formats` lists them; this package knows none of them.

A file of ours is YAML, or a name without a suffix: for those nothing is asked and nothing imported.
"""

import os.path
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from vrx_mj.config.kinds import KINDS

_FORMATS = "vrx_mj.formats"
"""The package whose READERS are used."""
_OUR_ENDS = (".yaml", ".yml", ".txt")


@dataclass(frozen=True)
class Reader:
    """What turns files of others into documents of ours; functions are named as `module:name` below the package.

    That of `names` gives the message about a name of VRX's instead.
    """

    kind: str
    """Kind of file: `sources`, `worlds`, `names`, `fleets`, `objects`, `robots`, `series`, `parts` or `meshes`."""
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


def opener(world: object, arguments: Mapping[str, str]) -> Callable[..., Any] | None:
    """The function of a world, a fleet and arguments that gives what others' files open; None: world and fleet stay."""
    ours = not isinstance(world, str | Path) or (
        _is_ours(world) and not os.path.isdir(world)  # noqa: PTH112 - Path.is_dir raises an OSError for a long name
    )
    return None if ours and not arguments else function_of("sources", "")


def function_of(kind: str, source: object, *, find: bool = False) -> Callable[..., Any] | None:
    """The function that reads, or finds, files of this kind with the suffix of a path; None without one."""
    if not isinstance(source, str | Path) or (kind in KINDS and _is_ours(source)):
        return None
    readers: Sequence[Reader] = resolve_name(f"{_FORMATS}:READERS")
    own = (reader for reader in readers if reader.kind == kind and reader.claims(str(source).lower()))
    name = next(filter(None, (reader.find if find else reader.read for reader in own)), None)
    function: Callable[..., Any] | None = resolve_name(f"{_FORMATS}.{name}") if name else None
    return function


def _is_ours(source: str | Path) -> bool:
    """Whether a source is a YAML file, a drawing, or a name."""
    text = str(source).lower()
    return text.endswith(_OUR_ENDS) or not any(mark in text for mark in "./#")
