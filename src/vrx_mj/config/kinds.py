"""Kinds of files, by name and beginning, and the commands that take them: for messages about wrong files."""

import contextlib
import json
import os.path
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

_HEAD = 4000
"""Bytes of a file that are looked into."""


class FileKind(NamedTuple):
    """What a file is."""

    name: str
    """What a message calls it."""
    use: str = ""
    """What takes it; FILE is its path."""


_TABLES = json.loads((Path(__file__).parent / "kinds.json").read_bytes())
FORMATS = {end: FileKind(*words) for end, words in _TABLES["formats"].items()}
"""Kinds of files by the end of their name, the longest first."""
_ROOTS = {tag.encode(): FileKind(*words) for tag, words in _TABLES["roots"].items()}
"""Kinds of XML files by their first tag."""
_FOLDER = FileKind("a folder", "name a file in it")

_OURS = _TABLES["ours"]
KINDS, NEEDS, USES = (
    {kind: str(row[key]) for kind, row in _OURS.items() if key in row} for key in ("name", "needs", "use")
)
"""Kinds of files: what a message calls one, if it has a name; what it is, for who gives another; and its use."""
MARKS: Mapping[str, set[str]] = {kind: set(row["marks"]) for kind, row in _OURS.items() if "marks" in row}
"""Keys of files of one kind alone."""
_AXIS = {"steps", "macros"}
"""Keys of every part of a file of axes."""


def kind_of(file: Path) -> FileKind | None:
    """The kind of a file that is no YAML and no plain text; None if it is not known, or nothing is there."""
    if os.path.isdir(file):  # noqa: PTH112 - Path.is_dir raises an OSError for a name that is too long
        return _FOLDER
    if not os.path.isfile(file):  # noqa: PTH113
        return None
    name = file.name.lower()
    found = next((kind for end, kind in FORMATS.items() if name.endswith(end)), None)
    if found is None or found.name == "XML":
        with contextlib.suppress(OSError), file.open("rb") as stream:
            head = stream.read(_HEAD)
            found = next((kind for tag, kind in _ROOTS.items() if tag in head), found)
    return found


def wrong_kind(file: Path, wanted: str) -> str | None:
    """The message about a file that is no YAML and no plain text, where that is wanted; None: it may be."""
    found = kind_of(file)
    use = found.use.replace("FILE", file.name) if found else ""
    return f"{found.name}, not {wanted}{f': {use}' if use else ''}" if found else None


def other_kind(kind: str, section: Mapping[str, object]) -> str | None:
    """The message about the content of a file of another kind; None: it may be of this kind."""
    given = set(section)
    if given and all(isinstance(axis, Mapping) and set(axis) >= _AXIS for axis in section.values()):
        return "axes of a series of worlds, one of which commands take as WORLD, with its number: axes.yaml#0"
    if given & MARKS.get(kind, given):
        return None
    found = next(((name, key) for name, marks in MARKS.items() for key in sorted(given & marks)), None)
    return f"the file of {USES[found[0]]}: it has the key '{found[1]}'" if found else None
