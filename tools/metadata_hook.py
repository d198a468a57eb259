"""What hatchling asks for when it builds: addresses of the project, and the README as an index of packages shows it.

A workflow of GitHub that builds a release says which repository it is for. The package then has its addresses, and the
README's links and pictures lead there. Other builds name no address: their README has no links to files of the
repository.
"""

import os
import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^]]*)\]\((?![a-z]+:|#)(?P<path>[^)\s]+)\)")


class Metadata(MetadataHookInterface):
    """The fields that pyproject.toml calls dynamic."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add what a PKG-INFO, as sdists have it, does not give already."""
        server, name = (os.environ.get(f"GITHUB_{key}", "") for key in ("SERVER_URL", "REPOSITORY"))
        repository = f"{server}/{name}" if server and name else ""
        if "readme" not in metadata:
            text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
            text = linked(text, repository, os.environ.get("GITHUB_SHA", "HEAD"))
            metadata["readme"] = {"content-type": "text/markdown", "text": text}
        if "urls" not in metadata:
            metadata["urls"] = urls(repository) if repository else {}


def urls(repository: str) -> dict[str, str]:
    """Addresses by label, as https://packaging.python.org has them."""
    files = f"{repository}/blob/HEAD"
    return {
        "Source": repository,
        "Documentation": f"{files}/docs/index.md",
        "Changelog": f"{files}/CHANGELOG.md",
        "Issues": f"{repository}/issues",
    }


def linked(text: str, repository: str, commit: str) -> str:
    """A text with links to files of the repository at a commit; without a repository their texts, and no pictures."""

    def target(link: re.Match[str]) -> str:
        if not repository:
            return "" if link["picture"] else link["text"]
        kind = "raw" if link["picture"] else "blob"
        return f"{link['picture']}[{link['text']}]({repository}/{kind}/{commit}/{link['path']})"

    return LINK.sub(target, text)
