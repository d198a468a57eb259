"""What mkdocs does beyond its plugins: formulas become MathML, and links to files outside `docs/` work.

MathML is drawn by the browser itself, so that the site needs no script and no font for formulas.
"""

import posixpath
import re
import sys
from html import unescape
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.plugins import get_plugin_logger
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

sys.path.insert(0, str(Path(__file__).parent))  # mkdocs loads hooks by their path

from public_names import complaints

log = get_plugin_logger("names")
REPO = Path(__file__).resolve().parents[1]
COPIES = "files"
"""Folder of the site with what pages link to outside `docs/`."""
LINK = re.compile(r"(?<=\]\()(?P<path>(?:\.\./)+[^)#\s]+)")
COMMENT = re.compile(r"^<!-- .*? -->\n", re.M | re.S)
FORMULA = re.compile(r"<(?P<tag>span|div) class=\"arithmatex\">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>", re.S)


def on_config(config: MkDocsConfig) -> None:
    """Warn of public names that nobody described; where the build is strict, it fails.

    There is no page for addresses that are not found: it is shown in place of any page, and does not know the way back
    from there in a site that may lie in any folder.
    """
    config.theme.static_templates.discard("404.html")
    for complaint in complaints():
        log.warning(complaint)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Copy the files of the repository that pages link to."""
    for page in list(files.documentation_pages()):
        for link in LINK.finditer(page.content_string):
            source = _outside(page.src_uri, link["path"])
            if source is not None and files.get_file_from_path(_copy(source)) is None:
                files.append(File.generated(config, _copy(source), abs_src_path=str(REPO / source)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point links at the copies, and leave out the comments, which are for the tests that follow the pages."""

    def copied(link: re.Match[str]) -> str:
        source = _outside(page.file.src_uri, link["path"])
        if source is None:
            return link["path"]
        return posixpath.relpath(_copy(source), posixpath.dirname(page.file.src_uri) or ".")

    return LINK.sub(copied, COMMENT.sub("", markdown))


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Set formulas."""
    return FORMULA.sub(lambda found: _formula(found, page), html)


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Say which language a page is in."""
    chinese = page.file.src_uri.startswith("zh/")
    return output.replace('<html lang="en"', '<html lang="zh"', 1) if chinese else output


def _formula(found: re.Match[str], page: Page) -> str:
    try:
        return str(convert(unescape(found["latex"]).strip(), display="block" if found["tag"] == "div" else "inline"))
    except Exception as error:  # it has no class of errors of its own
        raise PluginError(f"{page.file.src_uri}: formula {found['latex']!r}: {error!r}") from error


def _outside(page: str, link: str) -> str | None:
    """The path in the repository of what a page links to outside `docs/`, if it is there."""
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), link))
    inside = path.startswith(("docs/", "..")) or not (REPO / path).is_file()
    return None if inside else path


def _copy(source: str) -> str:
    """Where a file lies in the site."""
    return f"{COPIES}/{source}"
