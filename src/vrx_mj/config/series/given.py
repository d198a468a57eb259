"""Parameters of a call: looked up by name, with the macro's default, as numbers, texts, switches or XML."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from vrx_mj.config.series.blocks import Block, read_block
from vrx_mj.config.series.calls import BLOCK, Call
from vrx_mj.config.tree import Entry, Items, Place, Section
from vrx_mj.config.wording import shown
from vrx_mj.errors import UnknownNameError

__all__ = ["REQUIRED", "At", "Given", "located"]

REQUIRED = object()
"""In place of a default: the parameter must be given."""
SWITCHES = {"true": True, "1": True, "yes": True, "on": True, "false": False, "0": False, "no": False, "off": False}
LONGEST = 40
"""Characters of a number."""


class At(NamedTuple):
    """A value and where it is said."""

    value: Any
    place: Place


class Given:
    """What a call says, and what its macro says otherwise."""

    def __init__(self, call: Call, defaults: Mapping[str, Any], blocks: Sequence[str]) -> None:
        self.call = call
        self.defaults = defaults
        known = [*defaults, *(BLOCK + name for name in blocks)]
        for key in call.parameters:
            if key not in known:
                raise call.fault(key, str(UnknownNameError(f"parameter of {call.macro}", key, known)))
        for key, value in defaults.items():
            if value is REQUIRED and key not in call.parameters:
                raise call.fault(None, f"{call.macro} needs the parameter '{key}'")

    def number(self, name: str) -> At:
        """A parameter that is a number."""
        value = self._said(name)
        found = _number(value)
        if found is None:
            raise self.call.fault(name, f"expected a number, got {shown(value)}")
        return self._at(name, found)

    def whole(self, name: str) -> At:
        """A parameter that is a whole number; an empty text is 0."""
        value = self._said(name)
        found = 0 if value in ("", None) else _number(value)
        if found is None or found != found // 1:
            raise self.call.fault(name, f"expected a whole number, got {shown(value)}")
        return self._at(name, int(found))

    def numbers(self, names: str) -> list[At]:
        """Several numbers; `names` has blanks between them."""
        return [self.number(name) for name in names.split()]

    def text(self, name: str) -> At:
        """A parameter that is text."""
        value = self._said(name)
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self.call.fault(name, f"expected text, got {shown(value)}")
        return self._at(name, str(value).strip())

    def switch(self, name: str) -> At:
        """A parameter that is true or false."""
        value = self._said(name)
        found = value if isinstance(value, bool) else SWITCHES.get(str(value).strip().lower())
        if found is None:
            raise self.call.fault(name, f"expected true or false, got {shown(value)}")
        return self._at(name, found)

    def block(self, name: str) -> Block | None:
        """A parameter that is XML; None where the call does not give it."""
        key = BLOCK + name
        if key not in self.call.parameters:
            return None
        return read_block(self.call, key)

    def _said(self, name: str) -> Any:
        return self.call.parameters.get(name, self.defaults[name])

    def _at(self, name: str, value: Any) -> At:
        entry = self.call.parameters.entries.get(name)
        return At(value, entry.value if entry else self.call.place)


def located(value: Any, place: Place) -> Any:
    """Dicts and lists as sections and items that stand at `place`, but for what an `At` puts elsewhere."""
    if isinstance(value, At):
        return located(value.value, value.place)
    if isinstance(value, dict):
        entries = {key: Entry(_place(item, place), _place(item, place)) for key, item in value.items()}
        return Section({key: located(item, place) for key, item in value.items()}, place, entries)
    if isinstance(value, list):
        return Items.of((located(item, place) for item in value), (_place(item, place) for item in value))
    return value


def _place(value: Any, place: Place) -> Place:
    return value.place if isinstance(value, At) else place


def _number(value: Any) -> float | int | None:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    if not isinstance(value, str) or len(value) > LONGEST:
        return None
    try:
        return float(value)
    except ValueError:
        return None
