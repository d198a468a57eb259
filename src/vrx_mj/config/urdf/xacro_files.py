"""Which files a xacro file may read: those in its own folder, in the folders of packages, and in named folders."""

import glob
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from vrx_mj.config.reading import ReadingError, read_limited
from vrx_mj.config.ros_packages import enclosing_packages, package_above, package_name
from vrx_mj.config.search import display
from vrx_mj.config.urdf.expression_values import ExpressionError
from vrx_mj.errors import UnknownNameError, nearest
from vrx_mj.resources import root

__all__ = ["Files", "own_packages", "read_bytes"]

MAX_BYTES = 4_000_000
"""Longest file that is read."""
MOST_MATCHES = 1000
"""Files that one pattern may match."""
_PATTERN = re.compile(r"[*?\[]")
_WILD_PARTS = 3


def own_packages() -> dict[str, Path]:
    """The packages among our robots: every folder with a `package.xml`, by the name it has there."""
    found = (file.parent for file in sorted((root() / "assets" / "robots").rglob("package.xml")))
    return {name: folder for folder in found if (name := package_name(folder))}


class Files:
    """What one expansion may read.

    A package is first looked for in `packages` and above the file, then in `package_paths` and beside the file, at
    last in `spare`.
    """

    def __init__(
        self,
        file: Path,
        packages: Mapping[str, Path],
        package_paths: Sequence[Path],
        spare: Mapping[str, Path] | None = None,
    ) -> None:
        self.folder = file.absolute().parent
        self.paths = [Path(path).absolute() for path in package_paths]
        self.packages = {
            **enclosing_packages(self.folder),
            **{name: Path(folder).absolute() for name, folder in packages.items()},
        }
        self.spare = {name: Path(folder).absolute() for name, folder in (spare or {}).items()}
        folders = (self.folder, file.resolve().parent, *self.packages.values(), *self.paths, *self.spare.values())
        self.roots = [folder.resolve() for folder in folders]

    def find_package(self, name: str) -> Path:
        """The folder of a package."""
        found = self.packages.get(name) if _is_name(name) else None
        if found is None and _is_name(name):
            found = next((folder for folder in self._candidates(name) if folder.is_dir()), None)
            found = found or self._above(name) or self.spare.get(name)
        if found is None:
            words = str(UnknownNameError("package", name, self._known()))
            raise ExpressionError(f"{words} (or add its folder to the package paths)")
        return found

    def read(self, path: str) -> bytes:
        """A file's bytes, if the file may be read."""
        return read_bytes(self.allowed(path))

    def allowed(self, path: str) -> Path:
        """The path of a file that may be read, links followed."""
        try:
            found = Path(path).resolve()
        except (OSError, ValueError, RuntimeError):
            raise ExpressionError(f"'{path[:200]}' is not a path") from None
        if not any(found.is_relative_to(folder) for folder in self.roots):
            raise ExpressionError(
                f"may not read '{_shown(path)}': it is neither in the folder of the robot file nor in a package; "
                "add its folder to the package paths"
            )
        if not found.is_file():
            raise FileNotFoundError(_missing(path))
        return found

    def matching(self, pattern: str) -> list[str]:
        """The files that a pattern matches, sorted; a path without `*`, `?` and `[` is itself."""
        if not _PATTERN.search(pattern):
            return [pattern]
        parts = Path(pattern).parts
        wild = [index for index, part in enumerate(parts) if _PATTERN.search(part)]
        if len(wild) > _WILD_PARTS or ".." in parts[wild[0] :]:
            raise ExpressionError(
                f"pattern '{_shown(pattern)}': at most {_WILD_PARTS} folders with '*', and no '..' after"
            )
        base = Path(*parts[: wild[0]])
        if not any(base.resolve().is_relative_to(folder) for folder in self.roots):
            raise ExpressionError(
                f"may not look in '{_shown(str(base))}': it is neither in the robot's folder nor in a package"
            )
        found = sorted(glob.glob(pattern))  # noqa: PTH207 - hidden files are left out
        if len(found) > MOST_MATCHES:
            raise ExpressionError(f"pattern '{_shown(pattern)}' matches {len(found)} files; at most {MOST_MATCHES}")
        return found

    def _candidates(self, name: str) -> Iterator[Path]:
        for path in self.paths:
            yield path / name
            if path.name == name or package_name(path) == name:
                yield path
        yield self.folder / name

    def _above(self, name: str) -> Path | None:
        """The folder of that name in which the file lies, which may be read from then on."""
        found = package_above(self.folder, name)
        if found is not None:
            self.roots.append(found.resolve())
        return found

    def _known(self) -> list[str]:
        beside = {folder.name for path in self.paths if path.is_dir() for folder in path.iterdir() if folder.is_dir()}
        return sorted({*self.packages, *beside, *self.spare})


def read_bytes(file: Path) -> bytes:
    """A file's bytes, up to the limit."""
    try:
        return read_limited(file, MAX_BYTES)
    except ReadingError as error:
        raise ExpressionError(str(error)) from None


def _is_name(name: str) -> bool:
    return re.fullmatch(r"\w[\w.-]{0,199}", name) is not None


def _missing(path: str) -> str:
    folder = Path(path).parent
    try:
        names = [entry.name for entry in folder.iterdir()][:1000]
    except (OSError, ValueError):
        return f"no file '{_shown(path)}': no such folder {display(folder)}"
    close = nearest(Path(path).name, names)
    return f"no file '{Path(path).name}' in {display(folder)}" + (f"; did you mean '{close}'?" if close else "")


def _shown(path: str) -> str:
    return display(Path(path))[:200]
