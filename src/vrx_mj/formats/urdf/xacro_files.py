"""What a xacro or launch file may reach: files in its own folder, in packages and in named folders."""

import os.path
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from vrx_mj.config.search import (
    ALLOW,
    allowed_folders,
    display,
    enclosing_packages,
    is_built_in,
    near_names,
    package_above,
    package_name,
    packages_named,
    workspace_packages,
)
from vrx_mj.errors import VrxError
from vrx_mj.resources import root

OUTSIDE = f"it is neither in the folder of the first file nor in a package; {ALLOW}"
"""Why a file may not be read."""


def own_packages() -> dict[str, Path]:
    """The packages among our robots: every folder with a `package.xml`, by the name it has there."""
    found = (file.parent for file in sorted((root() / "assets" / "robots").rglob("package.xml")))
    return {name: folder for folder in found if (name := package_name(folder))}


class Files:
    """What one expansion may read.

    A package is first looked for in `packages` and above the file, then in `package_paths` and beside the file, then
    in the workspace of the file, at last in `spare`.
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
        known = (*self.packages.values(), *self.paths, *self.spare.values(), *allowed_folders())
        self.roots = [folder.resolve() for folder in (self.folder, file.resolve().parent, *known)]

    def package(self, name: str) -> Path | None:
        """The folder of a package, which may be read from then on; None: there is none of this name."""
        if not re.fullmatch(r"\w[\w.-]{0,199}", name):
            return None
        found = packages_named(name, self.folder, (self.packages,), self.paths)
        folder = next((each for each in found if each.is_dir() and not is_built_in(each)), None)
        if folder and folder in {package_above(self.folder, name), workspace_packages(self.folder).get(name)}:
            self.packages[name] = folder
            self.roots.append(folder.resolve())
        return folder or self.spare.get(name)

    def allowed(self, path: str) -> Path:
        """The path of a file that may be read, links followed."""
        try:
            found = Path(path).resolve()
        except (OSError, ValueError, RuntimeError):
            raise VrxError(f"'{path[:200]}' is not a path") from None
        shown = display(Path(path))[:200]
        if not any(found.is_relative_to(folder) for folder in self.roots):
            raise VrxError(f"may not read '{shown}': {OUTSIDE}")
        if os.path.isfile(found):  # noqa: PTH113 - Path.is_file raises an OSError for a name that is too long
            return found
        there = os.path.lexists(path)
        raise VrxError(f"'{shown}' is not a file" if there else f"no file '{shown}'{near_names(Path(path))}")

    def known(self) -> list[str]:
        """Names of packages that can be found."""
        beside = {folder.name for path in self.paths if path.is_dir() for folder in path.iterdir() if folder.is_dir()}
        return sorted({*self.packages, *beside, *workspace_packages(self.folder), *self.spare})
