"""Worlds of a series as the text of world files."""

import re
from typing import Any

import yaml

from vrx_mj.config.series.axes import Series
from vrx_mj.config.series.worlds import SeriesWorld
from vrx_mj.config.tree import Items, Section

__all__ = ["HEAD", "side_text", "world_text"]

HEAD = "# World "
"""How the text of a world of a series begins."""
WIDTH = 120
STALE = """# VRX's wind acts on the link base_link, which boats no longer have; here it acts on the boat
# (`physics: {quirks: [wind_stale_link]}` for VRX's).
"""
SHORT = 100
"""Characters of what is still written on one line."""
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_/-]*")
_WORDS = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"}


def world_text(series: Series, world: SeriesWorld) -> str:
    """The file of a world: YAML under a comment that says where it is from, with VRX's line of the coordinate."""
    return _head(series, world) + (STALE if world.stale else "") + _dumped(_plain(world.section))


def side_text(series: Series, world: SeriesWorld) -> str:
    """The file beside a world."""
    return _head(series, world) + _dumped(_plain(world.side))


def _head(series: Series, world: SeriesWorld) -> str:
    source = series.file.name.rpartition("/")[2]
    coordinate = _dumped(world.coordinate, flow=True, width=10_000_000)
    return f"{HEAD}{world.number} of {source}, made by vrx-mj worlds generate.\n# COORDINATE: {coordinate}"


class _Inline(dict[str, Any]):
    """A mapping on one line."""


class _Dumper(yaml.SafeDumper):
    """PyYAML's, which quotes whatever YAML 1.1 or 1.2 could take for something else than text."""

    def ignore_aliases(self, data: Any) -> bool:
        """Whether to write a thing anew where it comes again: always."""
        return True


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    plain = _PLAIN.fullmatch(value) and value.lower() not in _WORDS
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=None if plain else '"')


def _inline(dumper: yaml.SafeDumper, value: _Inline) -> yaml.MappingNode:
    return dumper.represent_mapping("tag:yaml.org,2002:map", value.items(), flow_style=True)


_Dumper.add_representer(str, _text)
_Dumper.add_representer(_Inline, _inline)


def _dumped(tree: Any, *, flow: bool | None = None, width: int = WIDTH) -> str:
    return yaml.dump(tree, Dumper=_Dumper, default_flow_style=flow, sort_keys=False, width=width, allow_unicode=True)


def _plain(value: Any, *, inside: bool = False) -> Any:
    """Dicts and lists of sections and items; short mappings inside of others on one line."""
    if isinstance(value, Section):
        content = {key: _plain(item, inside=True) for key, item in value.items()}
        return _Inline(content) if inside and len(str(content)) < SHORT else content
    if isinstance(value, Items):
        return [_plain(item, inside=True) for item in value]
    return value
