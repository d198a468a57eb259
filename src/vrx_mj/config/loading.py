"""From a source (a name, a path or a dict) to a model, with every problem of the file at once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import Config, fault
from vrx_mj.config.foreign import other_kind, vrx_world
from vrx_mj.config.report import problem_at, problems_of
from vrx_mj.config.search import KINDS, XML_SUFFIXES, catalogue, contained, display, find, is_path, refuse_foreign
from vrx_mj.config.tree import File, Section, merged, of_python
from vrx_mj.config.wording import shown
from vrx_mj.config.yaml_text import parse, read_lines
from vrx_mj.errors import ConfigError, Problem, VrxError

__all__ = ["Loading", "Source", "check", "file_of", "read_source", "referenced", "validated"]

Source = str | Path | Mapping[str, Any]
ConfigT = TypeVar("ConfigT", bound=Config)


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


def file_of(kind: str, source: str | Path) -> Path:
    """The file of a name or path that the user gave: paths start in the current folder."""
    if not isinstance(source, str | Path):
        raise ConfigError([_no_source(kind, source)])
    if not is_path(source):
        return find(kind, str(source))
    file = Path(source)
    ours = vrx_world(str(source), catalogue(kind)) if kind == "worlds" else None
    reason = f"no such file; {ours}" if ours else "no such file"
    try:
        if file.is_file():
            return _of_format(kind, str(source), file, Path.cwd())
        reason = "a folder, not a file" if file.is_dir() else reason
    except (OSError, ValueError):
        pass
    raise ConfigError([Problem(str(source), None, None, "", reason)])


def _no_source(kind: str, given: object) -> Problem:
    expected = f"expected a name, a path or a mapping, got {shown(given)}"
    return Problem(f"<{KINDS[kind]}>", None, None, "", expected)


def referenced(kind: str, text: str, folder: Path | None, skip: Path | None = None) -> Path:
    """The file that another file calls by a name or by a path relative to its own folder."""
    if not is_path(text):
        return find(kind, text, folder, skip)
    return _of_format(kind, text, contained(text, folder), folder or Path.cwd())


def _of_format(kind: str, text: str, file: Path, folder: Path) -> Path:
    """The file, unless it is XML where YAML or a drawing is needed."""
    if kind != "robots" and file.name.lower().endswith(XML_SUFFIXES):
        refuse_foreign(kind, text, folder, catalogue(kind))
    return file


def read_source(kind: str, source: Path | Mapping[str, Any]) -> Section:
    """The keys and values of a YAML file, of a dict or of a section, on top of those of the files that it extends."""
    if isinstance(source, Path):
        section = _read(source)
        if said := other_kind(kind, section):
            raise ConfigError([Problem(display(source), None, None, "", said)])
        return _extended(kind, section, source, (source.resolve(),))
    if isinstance(source, Section):
        return _extended(kind, source, None, ())
    file = File(f"<{KINDS[kind]}>", None)
    try:
        section = of_python(source, file)
    except RecursionError:
        raise ConfigError([Problem(file.name, None, None, "", "nested too deeply, or inside itself")]) from None
    return _extended(kind, section, None, ())


def _read(file: Path) -> Section:
    try:
        stat = file.stat()
    except OSError as error:
        raise ConfigError([Problem(display(file), None, None, "", f"cannot be read: {error.strerror}")]) from None
    return _parsed(file.absolute(), display(file), stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=512)
def _parsed(file: Path, name: str, _changed: int, _size: int) -> Section:
    """A file's content, until the file changes: a course names the same models many times."""
    return parse(File(name, file.parent, read_lines(file)))


def _extended(kind: str, section: Section, file: Path | None, chain: tuple[Path, ...]) -> Section:
    """The section on top of the one that it extends; that one's name and description are not inherited."""
    if "extends" not in section:
        return section
    try:
        base = _base(kind, section, file, chain)
    except VrxError as error:
        raise ConfigError([problem_at(section, ("extends",), str(error))]) from None
    below = _extended(kind, _read(base), base, (*chain, base.resolve()))
    own = {key: value for key, value in below.items() if key not in {"name", "description"}}
    over = {key: value for key, value in section.items() if key != "extends"}
    return merged(Section(own, below.place, below.entries), Section(over, section.place, section.entries))


def _base(kind: str, section: Section, file: Path | None, chain: tuple[Path, ...]) -> Path:
    """The file that a section extends. A file may extend another of its own name, as ours."""
    text = section["extends"]
    if not isinstance(text, str):
        raise VrxError(f"expected a name or a path, got {shown(text)}")
    base = referenced(kind, text, section.folder, file)
    if base.resolve() in chain:
        names = " > ".join(step.stem for step in (*chain[chain.index(base.resolve()) :], base))
        raise VrxError(f"this file extends itself: {names}")
    return base


def validated(model: type[ConfigT], section: Section, loading: Loading, *, name: str | None = None) -> ConfigT:
    """The model of a section; `name` is for a model that has one and whose file gives none."""
    if name is not None and "name" not in section:
        section = Section({**section, "name": name}, section.place, section.entries)
    result, found = None, []
    try:
        result = model.model_validate(section, context=loading)
    except ValidationError as error:
        found = problems_of(error, model, section)
    found += loading.elsewhere
    if found or result is None:
        raise ConfigError(found)
    return result
