"""YAML that a xacro file loads: plain data, xacro's units, and no tag that would make Python do anything."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode

from vrx_mj.config.tree import File, Place
from vrx_mj.config.urdf.expression_values import LONGEST_TEXT, Budget, ExpressionError, measure
from vrx_mj.config.urdf.xacro_document import FileError

__all__ = ["load_plain"]

DEEPEST = 20
"""Levels of nesting."""
_WORK_PER_BYTE = 12
_UNITS = {
    "!radians": 1.0, "!degrees": 0.017453292519943295, "!meters": 1.0, "!millimeters": 0.001, "!foot": 0.3048,
    "!inches": 0.0254,
}  # fmt: skip

_WORDS = (
    ("mapping values are not allowed", "a ':' too many, or wrong indentation; quote text with ': '"),
    ("could not find expected ':'", "expected ':' after the key"),
    ("expected <block end>", "wrong indentation, or a missing ':', '-' or quote"),
    ("expected ',' or", "expected ',' or a closing bracket"),
    ("found unexpected end of stream", "a quote is never closed"),
    ("expected the node content", "expected a value"),
    ("found undefined alias", "no anchor of this name"),
    ("but found another document", "a second document; a file holds one"),
    ("sequence entries are not allowed here", "a list's '-' starts on a line of its own"),
)


def load_plain(data: bytes, name: str, folder: Path, number: Callable[[str], Any], budget: Budget) -> Any:
    """What a YAML file holds; `number` works out the text of a value with a unit."""
    budget.spend(_WORK_PER_BYTE * len(data))
    text = data.decode("utf-8-sig", errors="replace")
    file = File(name, folder, tuple(text.split("\n")))
    try:
        loader = _Loader(text, file, number)
        try:
            found = loader.get_single_data()
        finally:
            loader.dispose()
        measure(found, budget)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(file, mark.line + 1, mark.column + 1) if mark else Place(file, 1, 1)
        raise FileError(place, "", _worded(str(error.problem or error.context))) from None
    except FileError:
        raise
    except (ExpressionError, yaml.YAMLError, ValueError, RecursionError) as error:
        raise FileError(Place(file, 1, 1), "", f"invalid YAML: {str(error).splitlines()[0]}") from None
    return found


def _worded(said: str) -> str:
    """PyYAML's complaint in our words."""
    return next((ours for theirs, ours in _WORDS if said.startswith(theirs)), said)


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, kept from deep nesting, from tags but xacro's units, and from merge keys."""

    def __init__(self, text: str, file: File, number: Callable[[str], Any]) -> None:
        super().__init__(text)
        self.file = file
        self.number = number
        self.depth = 0

    def compose_node(self, parent: Node | None, index: Any) -> Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        tag = getattr(event, "tag", None)
        if tag is not None and tag not in _UNITS:
            shown = str(tag).replace("tag:yaml.org,2002:", "!!", 1)
            raise yaml.MarkedYAMLError(
                problem=f"{shown}: only tags of units are allowed", problem_mark=event.start_mark
            )
        if len(getattr(event, "value", "")) > LONGEST_TEXT:
            problem = f"a text of more than {LONGEST_TEXT} characters is too long"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)
        if self.depth > DEEPEST:
            raise yaml.MarkedYAMLError(problem=f"nested deeper than {DEEPEST} levels", problem_mark=event.start_mark)
        self.depth += 1
        node: Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def flatten_mapping(self, node: MappingNode) -> None:
        for key, _ in node.value:
            if key.tag == "tag:yaml.org,2002:merge":
                raise yaml.MarkedYAMLError(problem="merge keys (<<) are not allowed", problem_mark=key.start_mark)

    def with_unit(self, node: Node) -> float:
        """A number in radians or metres."""
        place = Place(self.file, node.start_mark.line + 1, node.start_mark.column + 1)
        if not isinstance(node, ScalarNode):
            raise FileError(place, "", f"{node.tag}: expected a number")
        try:
            return float(self.number(node.value)) * _UNITS[node.tag]
        except (ExpressionError, TypeError, ValueError, OverflowError) as error:
            words = str(error) if isinstance(error, ExpressionError) else "expected a number"
            raise FileError(place, "", f"{node.tag} {node.value[:60]}: {words}") from None


for _tag in _UNITS:
    _Loader.add_constructor(_tag, _Loader.with_unit)
