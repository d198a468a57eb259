"""What a xacro or launch file may reach: files in its own folder, in packages and in named folders."""

import os.path
import re
from collections.abc import Iterable, Iterator, Mapping, MutableMapping, Sequence
from pathlib import Path

from vrx_mj.config.search import (
    ALLOW,
    allowed_folders,
    display,
    enclosing_packages,
    is_built_in,
    is_inside,
    near_names,
    package_above,
    package_name,
    packages_named,
    workspace_packages,
)
from vrx_mj.errors import VrxError, shortened
from vrx_mj.resources import root

OUTSIDE = f"it is neither in the folder of the first file nor in a package; {ALLOW}"
"""Reason why a file may not be read."""


def own_packages() -> dict[str, Path]:
    """The packages among our robots: every folder with a `package.xml`, by the name it has there."""
    found = (file.parent for file in sorted((root() / "assets" / "robots").rglob("package.xml")))
    return {name: folder for folder in found if (name := package_name(folder))}


class Files:
    """What a file may reach.

    A package is first looked for in `packages` and above the file, then in `package_paths` and beside the file, then
    in the workspace of the file, at last in `spare`.
    """

    def __init__(
        self,
        file: Path,
        packages: MutableMapping[str, Path],
        package_paths: Iterable[Path],
        spare: Mapping[str, Path] | None = None,
    ) -> None:
        self.folder, self.target = file.absolute().parent, file.resolve().parent
        self.packages, self.around = packages, enclosing_packages(self.folder)
        self.order: Sequence[Mapping[str, Path]] = (self.packages, self.around)
        self.paths = [Path(path).absolute() for path in package_paths]
        self.spare = spare or {}

    @property
    def bases(self) -> list[Path]:
        """Folders below which may be read."""
        known = (folder for packages in (*self.order, self.spare) for folder in packages.values())
        return [self.folder, self.target, *known, *self.paths, *allowed_folders()]

    def near(self, name: str) -> list[Path]:
        """The package of this name that the file lies in, and that in its workspace."""
        return [
            found for found in (package_above(self.folder, name), workspace_packages(self.folder).get(name)) if found
        ]

    def package_folders(self, name: str) -> Iterator[Path]:
        """Folders that may be the package of this name."""
        return packages_named(name, self.folder, self.order, self.paths)

    def package(self, name: str) -> Path | None:
        """The folder of a package, which may be read from then on; None: there is none of this name."""
        if not re.fullmatch(r"\w[\w.-]{0,199}", name):
            return None
        folder = next((each for each in self.package_folders(name) if each.is_dir() and not is_built_in(each)), None)
        if folder in self.near(name):
            self.packages[name] = folder
        return folder or self.spare.get(name)

    def readable_file(self, path: str) -> Path:
        """The path of a file that may be read, links followed."""
        try:
            found = Path(path).resolve()
        except (OSError, ValueError, RuntimeError):
            raise VrxError(f"'{path[:200]}' is not a path") from None
        shown = shortened(display(Path(path)))
        if not is_inside(found, *self.bases):
            raise VrxError(f"may not read '{shown}': {OUTSIDE}")
        if os.path.isfile(found):  # noqa: PTH113 - Path.is_file raises an OSError for a name that is too long
            return found
        there = os.path.lexists(path)
        raise VrxError(f"'{shown}' is not a file" if there else f"no file '{shown}'{near_names(Path(path))}")

    def known_packages(self) -> list[str]:
        """Names of packages that can be found."""
        beside = {folder.name for path in self.paths if path.is_dir() for folder in path.iterdir() if folder.is_dir()}
        return sorted({*self.packages, *self.around, *beside, *workspace_packages(self.folder), *self.spare})
