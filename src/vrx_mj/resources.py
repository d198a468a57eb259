"""Where the package's own assets, templates and fleets are."""

from functools import cache
from pathlib import Path


@cache
def root() -> Path:
    """The folder that holds `assets`, `templates` and `fleets`.

    The package's own folder when it was installed from a wheel, the repository in an editable install.
    """
    package = Path(__file__).resolve().parent
    return package if (package / "assets").is_dir() else package.parents[1]
