"""Sets of rules for what a boat may carry, and where: `assets/robots/wamv/compliance/*.yaml`."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from vrx_mj.config.base import Config
from vrx_mj.config.loading import Loading, validated
from vrx_mj.config.parts.boxes import Box
from vrx_mj.config.parts.catalogue import Release
from vrx_mj.config.parts.files import Kind
from vrx_mj.config.search import display
from vrx_mj.config.tree import File
from vrx_mj.config.yaml_text import parse, read_lines
from vrx_mj.errors import UnknownNameError
from vrx_mj.resources import root

__all__ = ["KindRules", "Rules", "TypeRules", "load_rules", "rule_sets"]


class TypeRules(Config):
    """What the rules say about a type of part."""

    most: Annotated[int, Field(ge=0)]
    """Most parts of this type."""
    parameters: tuple[str, ...]
    """Those that a file may give."""


class KindRules(Config):
    """The rules for a kind of file."""

    boxes: tuple[Box, ...]
    """In the order in which they are tried."""
    types: dict[str, TypeRules]
    """Types that a file may have."""


class Rules(Config):
    """A set of rules."""

    description: str
    """Whose rules they are."""
    release: Release
    """Whose macros they go with."""
    empty_passes: bool
    """Whether VRX's own generator lets an empty file pass."""
    components: KindRules
    thrusters: KindRules

    def of(self, kind: Kind) -> KindRules:
        """The rules for a kind of file."""
        return self.components if kind == "components" else self.thrusters


def rule_sets() -> dict[str, Path]:
    """The file of each set of rules, by name: `classic`, `jazzy`, `2019`."""
    folder = root() / "assets" / "robots" / "wamv" / "compliance"
    return {file.stem: file for file in sorted(folder.glob("*.yaml"), reverse=True)}


def load_rules(name: str) -> Rules:
    """The set of rules of this name.

    Raises:
        UnknownNameError: there is no such set.
    """
    known = rule_sets()
    if name not in known:
        raise UnknownNameError("set of rules", name, known)
    file = known[name]
    return validated(Rules, parse(File(display(file), file.parent, read_lines(file))), Loading())
