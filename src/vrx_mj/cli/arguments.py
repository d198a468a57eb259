"""Words of a command line, made into values: light, where typer would load pydantic, and with our own messages."""

from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_origin

from vrx_mj.errors import CommandError, UnknownNameError

__all__ = ["DEFAULT_PORT", "DEFAULT_WEB_PORT", "convert_lightly", "with_default_port"]

DEFAULT_PORT = "9090"
"""Port of rosbridge."""
DEFAULT_WEB_PORT = "8090"
"""Port of teleop's page."""
PORTS = {"--rosbridge": DEFAULT_PORT, "--web": DEFAULT_WEB_PORT}
"""Options whose port may be left out."""


def with_default_port(arguments: Sequence[str]) -> list[str]:
    """The words of a command line, with a port after --rosbridge and --web where it is left out, but for a campaign."""
    if "campaign" in arguments[:1]:
        return list(arguments)
    words = []
    for index, word in enumerate(arguments):
        bare = word in PORTS and not "".join(arguments[index + 1 : index + 2]).isdecimal()
        words.append(f"{word}={PORTS[word]}" if bare else word)
    return words


def convert_lightly(parameter: Any) -> None:
    """Have a parameter's words converted here, where this typer lets them and the type is a plain one."""
    if getattr(parameter, "_runtime_param", False) is None:
        annotation = parameter.type_descriptor.annotation
        kind = get_args(annotation)[0] if get_origin(annotation) is list else annotation
        if isinstance(kind, type) and issubclass(kind, (*NUMBERS, str, bool, Path, Enum)):
            parameter._runtime_param = Conversion(kind)


NUMBERS = {int: "a whole number", float: "a number"}


class Conversion:
    """Makes the words that were given to one parameter into values of a type."""

    def __init__(self, kind: type) -> None:
        self.kind = kind

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """The value or values.

        Raises:
            CommandError: a word is not of this type, or outside of the parameter's range.
        """
        if param.multiple or param.nargs == -1:
            return tuple(self._one(each, param) for each in value or ())
        return None if value is None else self._one(value, param)

    def _one(self, word: Any, param: Any) -> Any:
        if isinstance(word, self.kind):
            return word
        named = param.opts[0] if param.param_type_name == "option" else param.name.upper()
        try:
            value = self.kind(word)
        except ValueError:
            if issubclass(self.kind, Enum):
                raise UnknownNameError(f"value of {named}", word, [str(each.value) for each in self.kind]) from None
            raise CommandError(f"invalid {named} '{word}': {NUMBERS[self.kind]} is needed") from None
        if param.min is not None and value < param.min:
            raise CommandError(f"invalid {named} '{word}': at least {param.min:g} is needed")
        return value
