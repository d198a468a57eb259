"""Names in expressions: properties, modules and their members, keys of mappings, methods."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from vrx_mj.config.urdf.xacro_functions import EVERYWHERE, GLOBALS, METHODS
from vrx_mj.config.urdf.xacro_limits import ExpressionError, Function, Module, kind_of
from vrx_mj.errors import UnknownNameError, nearest

__all__ = ["Method", "Names", "absent", "check_name", "described", "member", "unknown"]

_FUNCTIONS = [name for name, value in {**GLOBALS, **EVERYWHERE}.items() if isinstance(value, Function)]


class Method(NamedTuple):
    """A method, its owner still to come."""

    call: Callable[..., Any]


class Names:
    """Where an expression's names are looked up: xacro's tables, and which of its types have dotted names."""

    def __init__(
        self,
        table: Mapping[str, Any],
        own: Callable[[], Iterable[str]] = tuple,
        spaces: tuple[type[Any], ...] = (),
        dotted: tuple[type[Any], ...] = (),
    ) -> None:
        self.table = table
        self.own = own
        """Names that the file defines."""
        self.spaces = spaces
        self.dotted = dotted

    def find(self, name: str, kind: str) -> Any:
        """The value of a name."""
        check_name(name)
        try:
            return self.table[name]
        except KeyError:
            pass
        if name in EVERYWHERE:
            return EVERYWHERE[name]
        raise unknown(kind, name, self.own(), GLOBALS) if kind == "property" else unknown(kind, name, _FUNCTIONS)


def unknown(kind: str, name: str, own: Iterable[str], more: Iterable[str] = ()) -> ExpressionError:
    """What to say about a name that nothing has; `more` may be meant, but is not listed."""
    names = sorted(own)
    close = nearest(name, [*names, *more])
    return ExpressionError(str(UnknownNameError(kind, name, [close] if close else names)))


def check_name(name: str) -> None:
    """Refuse the names by which Python reaches inside of things."""
    if name.startswith("__"):
        raise ExpressionError(f"names that begin with '__' are not allowed: {name}")


def member(owner: Any, name: str, names: Names) -> Any:
    """What stands after a dot: a value, or a Method that has yet to be called with its owner."""
    check_name(name)
    if isinstance(owner, Module):
        if name not in owner.members:
            raise unknown(f"member of {owner.name}", name, owner.members)
        return owner.members[name]
    if isinstance(owner, names.spaces):
        return _in_space(owner, name)
    methods = next((found for kind, found in METHODS.items() if isinstance(owner, kind)), {})
    if name in methods:
        return Method(methods[name])
    if isinstance(owner, names.dotted):
        if dict.__contains__(owner, name) and not hasattr(dict, name):
            return owner[name]
        raise ExpressionError(absent(owner, name))
    raise ExpressionError(f"'.{name}': {described(owner)} has no such member in a robot file")


def _in_space(space: Any, name: str) -> Any:
    try:
        return space[name]
    except KeyError:
        raise unknown("property", name, (key for key in dict.keys(space) if key.isidentifier())) from None


def absent(owner: Any, index: Any) -> str:
    """What to say about an item that is not there."""
    if isinstance(owner, dict):
        return str(UnknownNameError("key", str(index), [str(key) for key in dict.keys(owner)]))
    return f"item {index} of {len(owner)}: {kind_of(owner)} counts from 0"


def described(value: Any) -> str:
    """What a message calls a value."""
    return f"'{value.name}'" if isinstance(value, Function | Module) else kind_of(value)
