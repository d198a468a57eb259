"""From a source (a name, a path or a dict) to a model, with every problem of the file at once, each with its place."""

import os.path
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import AfterValidator, ValidationError
from pydantic_core import ErrorDetails
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import Config
from vrx_mj.config.kinds import KINDS, function_of, other_kind
from vrx_mj.config.search import catalogue, contained_file, display, find, in_vrx, is_path, near_names, of_format
from vrx_mj.config.tree import (
    PYDANTIC,
    File,
    Loc,
    Place,
    Section,
    choice,
    fault,
    key_path,
    literal,
    locate,
    merge,
    of_python,
    unknown_key,
)
from vrx_mj.config.yaml_text import parse, read_lines
from vrx_mj.errors import ConfigError, Problem, VrxError

_TAG = re.compile(r"<(?:xacro:)?([A-Za-z_][\w.-]*)")


def problems_of(error: ValidationError, section: Section) -> list[Problem]:
    """Everything that pydantic found in a section, in the order of the file."""
    found = [_problem(details, section) for details in error.errors(include_url=False)]
    return sorted(dict.fromkeys(found), key=lambda problem: (problem.file, problem.line or 0, problem.column or 0))


def fault_text(error: ValidationError) -> str:
    """The first thing that pydantic found in data of no YAML file, with its key: `layout.nq: must be at least 0`."""
    details = error.errors(include_url=False, include_context=True)[0]
    key = key_path(tuple(step if isinstance(step, int) else step[:60] for step in _loc(details)))
    return f"{key}: {_message(details)}" if key else _message(details)


def problem_at(section: Section, loc: tuple[str | int, ...], message: str) -> Problem:
    """A problem with the value at `loc`."""
    spot = locate(section, loc)
    return _problem_in(spot.place, spot.path, message)


def _problem_in(place: Place, path: tuple[str | int, ...], message: str) -> Problem:
    """A problem with a key as its file has it: in XML the element that it comes from, and the last key."""
    file, line, column = place
    key, tag = key_path(path), None
    if line and line <= len(file.lines) and not file.name.lower().endswith((".yaml", ".yml")):
        tag = _TAG.match(file.lines[line - 1], (column or 1) - 1)
    if tag:
        last = next((step for step in reversed(path) if isinstance(step, str)), tag[1])
        key = f"<{tag[1]}>" if last == tag[1] else f"<{tag[1]}> / {last}"
    return Problem(file.name, line, column, key, message)


def _loc(details: ErrorDetails) -> Loc:
    """Path of an error; one about the member of a union is at the key that names the member."""
    return (*details["loc"], *details.get("ctx", {}).get("discriminator", "").strip("'").split())


def _problem(details: ErrorDetails, section: Section) -> Problem:
    loc, inside = _loc(details), details.get("ctx", {})
    if "row" in inside:  # in a block of text, or in a list of rows
        loc = (*loc, inside["row"] - 1)
    place, path, owner = locate(section, loc, tagged=True)
    message = _message(details)
    if "row" in inside:
        place = _inside(place, inside["row"], inside["column"])
    if (
        owner is not None
        and (chosen := owner.entries.get(inside.get("selector", "")))
        and chosen.value.file != place.file
    ):
        message += f"; {inside['selector']} is from {chosen.value.file.name}:{chosen.value.line}"
    if details["type"] == "extra_forbidden":
        assert owner is not None, f"{loc} does not lead to a key"
        known = [*(["extends"] if owner is section else []), *details["input"]]  # see Config._from_file
        message = unknown_key(str(loc[-1]), known)
        place = owner.entries[str(loc[-1])].key
    return _problem_in(place, path, message)


def _inside(place: Place, row: int, column: int) -> Place:
    """A row and column of a block of text ('|') as a line and column of its file."""
    lines = place.file.lines[place.line or 0 :]
    header = place.file.lines[place.line - 1] if place.line and lines else ""
    block = re.search(r"\|[-+]?(\d*)[-+]?\s*(#.*)?$", header)
    if not block or row > len(lines):
        return place
    first = next(filter(str.strip, lines), "")
    parent = len(header) - len(re.sub(r"^ *(- +)*", "", header))
    indent = parent + int(block[1]) if block[1] else len(first) - len(first.lstrip(" "))
    return Place(place.file, (place.line or 0) + row, indent + column)


def _message(details: ErrorDetails) -> str:
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    if kind == "literal_error":
        return choice(value, context["expected"].replace(" or ", ", ").replace("'", "").split(", "))
    if kind == "union_tag_invalid":
        return choice(value[context["discriminator"].strip("'")], context["expected_tags"].replace("'", "").split(", "))
    if kind == "union_tag_not_found" and not isinstance(value, Mapping):
        kind = "dict_type"
    if kind not in PYDANTIC:
        return f"{details['msg'][:1].lower()}{details['msg'][1:]}, got {literal(value)}"
    limits = {key: format(limit, ".15g") if isinstance(limit, float) else limit for key, limit in context.items()}
    quotes = "; put it in quotes" if kind == "string_type" and isinstance(value, int | float) else ""
    return PYDANTIC[kind].format(got=literal(value), **limits) + quotes


Source = str | Path | Mapping[str, Any]
_ConfigT = TypeVar("_ConfigT", bound=Config)


@dataclass
class Loading:
    """One file being loaded: the files on the way to it, and what is wrong with files it names."""

    chain: tuple[Path, ...] = ()
    counts: dict[Path, int] = field(default_factory=dict)
    """Single objects in each object file that was checked already; all files of one load share it."""
    count: int = 0
    """Single objects in this file."""
    elsewhere: list[Problem] = field(default_factory=list)

    def check(self, load: Callable[[], object]) -> None:
        """Loads something that the file names. Its own file's problems are kept for the end."""
        try:
            load()
        except ConfigError as error:
            self.elsewhere += [problem for problem in error.problems if problem not in self.elsewhere]
        except VrxError as error:
            raise fault(str(error)) from None


def check(info: ValidationInfo, load: Callable[[], object]) -> None:
    """Loads something that the model at hand names, if the model comes from a file or a dict."""
    if isinstance(info.context, Loading):
        info.context.check(load)


def loads(load: Callable[[Any, Path | None], object], folder: str = "folder") -> AfterValidator:
    """Validator that loads what a field names by `load(name, near)`; the field `folder` has the folder `near`."""

    def load_named(value: object, info: ValidationInfo) -> object:
        check(info, lambda: load(value, info.data.get(folder)))
        return value

    return AfterValidator(load_named)


def file_of(kind: str, source: object) -> Path:
    """The file of a name or path that the user gave: paths start in the current folder."""
    if not isinstance(source, str | Path):
        said = f"expected a name, a path or a mapping, got {literal(source)}"
        raise ConfigError.of(f"<{KINDS[kind]}>", said)
    if not is_path(source):
        return find(kind, str(source))
    return of_format(kind, str(source), path_of(kind, source), Path.cwd())


def path_of(kind: str, source: str | Path) -> Path:
    """The file at a path that the user gave, whatever its format."""
    if os.path.isfile(source):  # noqa: PTH113 - Path.is_file raises an OSError for a name that is too long
        return Path(source)
    reason = "a folder, not a file"
    if not os.path.isdir(source):  # noqa: PTH112
        ours = in_vrx(kind, str(source), catalogue(kind))
        reason = f"no such file; {ours}" if ours else f"no such file{near_names(Path(source))}"
    raise ConfigError.of(str(source), reason)


def referenced_file(kind: str, text: str, folder: Path | None) -> Path:
    """The file, of ours or of others, that another file calls by a name or by a path relative to its own folder."""
    of_others = function_of(kind, text, find=True)
    found: Path | None = of_others(text, folder) if of_others else None
    return found or _own_file(kind, text, folder)


def _own_file(kind: str, text: str, folder: Path | None, skip: Path | None = None) -> Path:
    if not is_path(text):
        return find(kind, text, folder, skip)
    return of_format(kind, text, contained_file(text, folder), folder or Path.cwd())


def document(kind: str, source: Source, name: str = "") -> tuple[Section, str]:
    """The content of a file, of ours or of others, and its name; that of a dict is `name`."""
    if isinstance(source, Mapping):
        return read_source(kind, source), name
    of_others = function_of(kind, source)
    found: tuple[Section, str] | None = of_others(source) if of_others else None
    if found:
        return read_source(kind, found[0]), found[1]
    file = file_of(kind, source)
    try:
        section = read_source(kind, file)
    except ConfigError:
        if kind == "worlds" and (refuse := function_of("series", file)):
            refuse(file, source)
        raise
    return section, file.stem if is_path(source) else str(source)


def read_source(kind: str, source: Path | Mapping[str, object]) -> Section:
    """The keys and values of a YAML file, of a dict or of a section, on top of those of the files that it extends."""
    if not isinstance(source, Path):
        section = source if isinstance(source, Section) else of_python(source, File(f"<{KINDS[kind]}>", None))
        return _extend(kind, section, None, ())
    return _extend(kind, read_file(kind, source), source, (source.resolve(),))


def read_file(kind: str, file: Path) -> Section:
    """The keys and values of a YAML file alone."""
    try:
        stat = file.stat()
    except OSError as error:
        raise ConfigError.of(display(file), f"cannot be read: {error.strerror}") from None
    section = _parse_cached(file.absolute(), display(file), stat.st_mtime_ns, stat.st_size)
    if said := other_kind(kind, section):
        raise ConfigError.of(display(file), said)
    return section


@lru_cache(maxsize=512)
def _parse_cached(file: Path, name: str, _changed: int, _size: int) -> Section:
    """A file's content, until the file changes: a course names the same models many times."""
    return parse(File(name, file.parent, read_lines(file)))


def _extend(kind: str, section: Section, file: Path | None, chain: tuple[Path, ...]) -> Section:
    """The section on top of the one that it extends; that one's name and description are not inherited."""
    if "extends" not in section:
        return section
    try:
        base = _base(kind, section, file, chain)
    except VrxError as error:
        raise ConfigError([problem_at(section, ("extends",), str(error))]) from None
    below = _extend(kind, read_file(kind, base), base, (*chain, base.resolve()))
    own = {key: value for key, value in below.items() if key not in {"name", "description"}}
    over = {key: value for key, value in section.items() if key != "extends"}
    return merge(below.holding(own), section.holding(over))


def _base(kind: str, section: Section, file: Path | None, chain: tuple[Path, ...]) -> Path:
    """The file that a section extends. A file may extend another of its own name, as ours."""
    text = section["extends"]
    if not isinstance(text, str):
        raise VrxError(f"expected a name or a path, got {literal(text)}")
    base = _own_file(kind, text, section.folder, file)
    if base.resolve() in chain:
        names = " > ".join(step.stem for step in (*chain[chain.index(base.resolve()) :], base))
        raise VrxError(f"this file extends itself: {names}")
    return base


def validate(model: type[_ConfigT], section: Section, loading: Loading, *, name: str | None = None) -> _ConfigT:
    """The model of a section; `name` is for a model that has one and whose file gives none."""
    if isinstance(section.model, model):
        return section.model
    if name is not None and "name" not in section:
        section = section.holding({**section, "name": name})
    result, found = None, []
    try:
        result = model.model_validate(section, context=loading)
    except ValidationError as error:
        found = problems_of(error, section)
    found += loading.elsewhere
    if found or result is None:
        raise ConfigError(found)
    return result


def joining(model: type[_ConfigT], what: str, entry: Mapping[str, object]) -> _ConfigT:
    """Something that joins a world later, by its entry as in a file; keys whose value is None are left out.

    Raises:
        ConfigError: a value is wrong or missing.
    """
    given = {key: value for key, value in entry.items() if value is not None}
    return validate(model, of_python(given, File(f"<{what}>", None)), Loading())
