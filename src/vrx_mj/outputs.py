"""Files that we write: whole or not at all, inside of the folder that was named, and one line where that cannot be."""

import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from vrx_mj.errors import VrxError

Content = str | bytes | Path
"""Content of a file: a text, bytes, or the file of which it is a copy."""


@contextmanager
def writing(what: str, path: Path, error: type[VrxError] = VrxError) -> Iterator[None]:
    """Turn an OSError of writing a file into a line that names `what` is written, of the class `error`."""
    try:
        yield
    except OSError as problem:
        raise error(f"cannot write {what} '{path}': {problem.strerror or problem}") from None


@contextmanager
def atomic_write(path: Path, what: str, error: type[VrxError] = VrxError) -> Iterator[Path]:
    """Yield a path to write to, whose content takes the place of `path` at the end.

    Until then `path` stays as it was. What is not a plain file, as `/dev/stdout`, is written directly.

    Raises:
        VrxError: it cannot be written; of the class `error`, with `what` it is.
    """
    with writing(what, path, error):
        if path.exists() and not path.is_file():
            yield path
            return
        beside = path.with_name(f".{path.stem[:80]}.{secrets.token_hex(4)}{path.suffix}")
        try:
            yield beside
            _settle(beside, path)
        finally:
            with suppress(OSError):
                beside.unlink(missing_ok=True)


def _settle(written: Path, path: Path) -> None:
    """Put what was written in the place of a file, or of what a link leads to, with its permissions."""
    target = path.resolve()
    if target.exists():
        written.chmod(target.stat().st_mode & 0o7777)
    written.replace(target)


def write_file(path: Path, content: Content, what: str, error: type[VrxError] = VrxError) -> None:
    """Write a file that was asked for by its path; a link is followed, and the folder is not made.

    Raises:
        VrxError: as `atomic_write`.
    """
    with atomic_write(path, what, error) as draft:
        _write_content(content, draft)


def write_files(
    folder: Path, files: Mapping[str, Content], what: str, error: type[VrxError] = VrxError, *,
    replaces: Callable[[str], bool] = lambda _name: True, kind: str = "a file",
) -> None:  # fmt: skip
    """Write files into a folder, which others may have prepared: all are checked before the first is written.

    Args:
        folder: is made if need be; it may be a link.
        files: by their paths in the folder.
        what: they are, for messages.
        error: class of the errors.
        replaces: whether the file that is there by such a path may be replaced.
        kind: of files that may be, for messages.

    Raises:
        VrxError: a path leads out of the folder or through a link, a file is in the way, or cannot be written.
    """
    for name in files:
        check_inside(folder, name, what, error)
        path = folder / name
        with writing(what, path, error):
            if path.exists() and not (path.is_file() and replaces(name)):
                raise error(f"{path} exists and is not {kind}: choose another folder")
    for name, content in files.items():
        with atomic_write(folder / name, what, error) as draft:
            draft.parent.mkdir(parents=True, exist_ok=True)
            _write_content(content, draft)


def check_inside(folder: Path, name: str, what: str, error: type[VrxError] = VrxError) -> None:
    """Refuse a path in a folder that leads out of it, or through a link below it.

    Raises:
        VrxError: it does; of the class `error`.
    """
    place = top = Path(os.path.realpath(folder))
    parts = Path(name).parts
    if not parts or ".." in parts or not (top / name).is_relative_to(top):
        raise error(f"cannot write {what} '{folder / name}': it is not inside of the folder")
    for part in parts:
        place /= part
        if Path(os.path.realpath(place)) != place:
            raise error(f"cannot write {what} '{folder / name}': '{place}' is a link; remove it")


def begins(file: Path, mark: str | bytes) -> bool:
    """Whether a file begins with a text or bytes."""
    raw = mark.encode() if isinstance(mark, str) else mark
    with file.open("rb") as stream:
        return stream.read(len(raw)) == raw


def _write_content(content: Content, file: Path) -> None:
    raw = content.read_bytes() if isinstance(content, Path) else content
    file.write_bytes(raw.encode() if isinstance(raw, str) else raw)
