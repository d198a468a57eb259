"""Files that we write: whole or not at all, and one line where that cannot be done."""

import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from vrx_mj.errors import VrxError

__all__ = ["written"]


@contextmanager
def written(path: Path, what: str, error: type[VrxError] = VrxError) -> Iterator[Path]:
    """Around the writing of a file: the path to write to, whose content takes the place of `path` at the end.

    Until then `path` stays as it was. What is not a plain file, as `/dev/stdout`, is written directly.

    Raises:
        VrxError: it cannot be written; of the class `error`, with `what` it is.
    """
    direct = path.exists() and not path.is_file()
    beside = path if direct else path.with_name(f".{path.stem[:80]}.{secrets.token_hex(4)}{path.suffix}")
    try:
        yield beside
        if not direct:
            _settle(beside, path)
    except OSError as problem:
        raise error(f"cannot write {what} '{path}': {problem.strerror or problem}") from None
    finally:
        if not direct:
            with suppress(OSError):
                beside.unlink(missing_ok=True)


def _settle(written: Path, path: Path) -> None:
    """Have what was written take the place of a file, or of what a link leads to, with its permissions."""
    target = path.resolve()
    if target.exists():
        written.chmod(target.stat().st_mode & 0o7777)
    written.replace(target)
