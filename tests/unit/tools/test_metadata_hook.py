"""The README as an index of packages shows it: links lead to the repository, or there are none."""

import runpy
from pathlib import Path

import pytest

HOOK = runpy.run_path(str(Path(__file__).parents[3] / "tools" / "metadata_hook.py"))
TEXT = "![a boat](docs/sail.webp) in [Worlds](docs/worlds.md#keys){}"
KEPT = ", [rerun](https://rerun.io), [below](#below)"


@pytest.mark.parametrize(
    ("repository", "shown"),
    [
        (
            "http://a/b",
            "![a boat](http://a/b/raw/c0/docs/sail.webp) in [Worlds](http://a/b/blob/c0/docs/worlds.md#keys)",
        ),
        ("", " in Worlds"),
    ],
)
def test_links_to_files_lead_to_the_repository(repository, shown):
    assert HOOK["linked"](TEXT.format(KEPT), repository, "c0") == shown + KEPT


def test_what_a_pkg_info_gives_stays(monkeypatch):
    monkeypatch.setenv("GITHUB_SERVER_URL", "https://example.org")
    monkeypatch.setenv("GITHUB_REPOSITORY", "a/b")
    given = {"readme": {"text": "x"}, "urls": {"Source": "y"}}
    hook = HOOK["Metadata"](str(Path(__file__).parents[3]), {})
    metadata = dict(given)
    hook.update(metadata)
    assert metadata == given
    metadata = {}
    hook.update(metadata)
    assert metadata["urls"]["Issues"] == "https://example.org/a/b/issues"
