"""Kinds of files, readers of other people's files, and the profiles of physics.

A file's kind follows from its name and its beginning; messages about wrong files name the command that takes it.
Readers are found by suffix. `vrx_mj.formats` lists them, and this package knows none of them: a file of ours is YAML,
or a name without a suffix, for which nothing is asked and nothing imported.
"""

import contextlib
import json
import os.path
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Literal, NamedTuple

from vrx_mj.config.tree import Section, merge, of_python, one_of
from vrx_mj.constants import STANDARD_GRAVITY

_HEAD = 4000
"""Bytes of a file that are looked into."""
_TABLES = json.loads((Path(__file__).parent / "kinds.json").read_bytes())
_OURS = _TABLES["ours"]
KINDS, NEEDS, USES = (
    {kind: str(row[key]) for kind, row in _OURS.items() if key in row} for key in ("name", "needs", "use")
)
"""Kinds of files: what a message calls one, if it has a name; what it is, for who gives another; and its use."""
MARKS: Mapping[str, set[str]] = {kind: set(row["marks"]) for kind, row in _OURS.items() if "marks" in row}
"""Keys of files of one kind alone."""
_AXIS = {"steps", "macros"}
"""Keys of every part of a file of axes."""
_FORMATS = "vrx_mj.formats"
"""The package whose READERS are used."""
_OUR_ENDS = (".yaml", ".yml", ".txt")
_DEFAULTS: Mapping[str, Mapping[str, Any]] = {
    "vrx3": {"physics": {"timestep": 0.004}, "sea": {"scale": 1.1}},
    "marine": {"physics": {"gravity": STANDARD_GRAVITY, "at_base_link": ()}},
}
"""Defaults of a world by profile; VRX 3's sea is Wavefield.cc's."""


class FileKind(NamedTuple):
    """Kind of file, as messages describe it."""

    name: str
    """Name of the kind in messages."""
    use: str = ""
    """What to do with such a file instead; FILE is its path."""


FORMATS = {end: FileKind(*words) for end, words in _TABLES["formats"].items()}
"""Kinds of files by the end of their name, the longest first."""
_ROOTS = {tag.encode(): FileKind(*words) for tag, words in _TABLES["roots"].items()}
"""Kinds of XML files by their first tag."""
_FOLDER = FileKind("a folder", "name a file in it")


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
        return "axes of a series of worlds; pass one of them as WORLD by its number: axes.yaml#0"
    if given & MARKS.get(kind, given):
        return None
    found = next(((name, key) for name, marks in MARKS.items() for key in sorted(given & marks)), None)
    return f"it has the key '{found[1]}', of {USES[found[0]]}" if found else None


@dataclass(frozen=True)
class Reader:
    """Reader of files of others as documents of ours; functions are named as `module:name` below the package.

    The function of kind `names` gives the message about a name of VRX's instead.
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
    return resolve_name(f"{_FORMATS}.{name}") if name else None


def needs(kind: str) -> str:
    """Description of files of a kind, for a message about another file; formats are those of its readers."""
    readers: Sequence[Reader] = resolve_name(f"{_FORMATS}:READERS")
    ends = [mark for reader in readers if reader.kind == kind for mark in reader.marks if mark.rfind(".") == 0]
    return NEEDS[kind].replace("ENDS", one_of(ends)) if ends else NEEDS[kind]


def _is_ours(source: str | Path) -> bool:
    """Whether a source is a YAML file, a drawing, or a name."""
    text = str(source).lower()
    return text.endswith(_OUR_ENDS) or not any(mark in text for mark in "./#")


Profile = Literal["vrx", "vrx3", "marine"]
"""VRX classic (Gazebo 11, ROS 1), VRX 3 (gz-sim, ROS 2), the one of 2023, and water that streams."""

CLASSIC: Profile = "vrx"
NEWER: Profile = "vrx3"
MARINE: Profile = "marine"
DEFAULT: Profile = MARINE
"""Profile of a world that names none."""


def on_its_profile(world: Section) -> Section:
    """A world's file on top of its profile's defaults."""
    physics = world.get("physics")
    profile = physics.get("profile", DEFAULT) if isinstance(physics, Mapping) else DEFAULT
    own = _DEFAULTS.get(profile, {}) if isinstance(profile, str) else {}
    given = {key: value for key, value in world.items() if value is not None or key not in own}
    return merge(of_python(own, world.place.file), world.holding(given))
