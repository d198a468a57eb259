"""Templates of pages: static files that need no network, in folders of `templates`."""

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from vrx_mj.resources import root

_SHARED = "campaign"
"""Folder of the style that all pages have."""


def page_environment(folder: str) -> Environment:
    """The templates of a folder of `templates`, which escape whatever they are given."""
    folders = [root() / "templates" / name for name in dict.fromkeys((folder, _SHARED))]
    return Environment(
        loader=FileSystemLoader(folders, encoding="utf-8"),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
