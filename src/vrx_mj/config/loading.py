"""From a source (a name, a path or a dict) to a model, with every problem of the file at once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from vrx_mj.config.base import Config, fault
from vrx_mj.config.report import problems_of
from vrx_mj.config.search import KINDS, contained, display, find, is_path
from vrx_mj.config.tree import File, Place, Section, locate, of_python
from vrx_mj.config.yaml_text import parse, read_lines
from vrx_mj.errors import ConfigError, Problem, VrxError

__all__ = ["Loading", "Source", "file_of", "read_section", "referenced", "validated"]

Source = str | Path | Mapping[str, Any]
ConfigT = TypeVar("ConfigT", bound=Config)


@dataclass
class Loading:
    """One file being loaded: the files on the way to it, and what is wrong with files it names."""

    chain: tuple[Path, ...] = ()
    elsewhere: list[Problem] = field(default_factory=list)

    def check(self, load: Callable[[], object]) -> None:
        """Loads something that the file names. Its own file's problems are kept for the end."""
        try:
            load()
        except ConfigError as error:
            self.elsewhere += [problem for problem in error.problems if problem not in self.elsewhere]
        except VrxError as error:
            raise fault(str(error)) from None


def file_of(kind: str, source: str | Path) -> Path:
    """The file of a name or path that the user gave: paths start in the current folder."""
    if not is_path(source):
        return find(kind, str(source))
    file = Path(source)
    try:
        if file.is_file():
            return file
        reason = "a folder, not a file" if file.is_dir() else "no such file"
    except (OSError, ValueError):
        reason = "no such file"
    raise ConfigError([Problem(str(source), None, None, "", reason)])


def referenced(kind: str, text: str, folder: Path | None, skip: Path | None = None) -> Path:
    """The file that another file calls by a name or by a path relative to its own folder."""
    return contained(text, folder) if is_path(text) else find(kind, text, folder, skip)


def read_section(kind: str, source: Path | Mapping[str, Any]) -> Section:
    """The keys and values of a YAML file or of a dict."""
    if isinstance(source, Path):
        return parse(File(display(source), source.parent.absolute(), read_lines(source)))
    file = File(f"<{KINDS[kind]}>", None)
    try:
        section = of_python(source, file)
    except RecursionError:
        raise ConfigError([Problem(file.name, None, None, "", "nested too deeply, or inside itself")]) from None
    assert isinstance(section, Section), f"{kind} source is a {type(source).__name__}"
    return section


def validated(model: type[ConfigT], section: Section, loading: Loading, **extra: Any) -> ConfigT:
    """The model of a section; `extra` are values of fields that no file writes."""
    result, found = None, []
    for key, value in extra.items():
        if key not in section:
            place = Place(section.place.file)
            section = Section({**section, key: value}, section.place, section.entries)
    try:
        result = model.model_validate(section, context=loading)
    except ValidationError as error:
        found = problems_of(error, model, section)
    found += loading.elsewhere
    if found or result is None:
        raise ConfigError(found)
    return result
