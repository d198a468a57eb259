"""What light buoys and placards can show, in VRX's order (light_buoy_plugin.cc, placard_plugin.cc)."""

from itertools import product
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator

from vrx_mj.config.base import Config, Name, NotEmpty, fault
from vrx_mj.config.wording import shown

__all__ = ["LIGHT_COLORS", "LIGHT_PATTERNS", "OFF", "RGB", "SHAPES", "SYMBOLS", "ColorName", "LightConfig", "Symbol"]

ColorName = Literal["red", "green", "blue", "yellow"]
LIGHT_COLORS: tuple[str, ...] = get_args(ColorName)
OFF: Literal["off"] = "off"
SHAPES = ("circle", "cross", "triangle", "rectangle")
RGB = {"red": (1.0, 0.0, 0.0), "green": (0.0, 1.0, 0.0), "blue": (0.0, 0.0, 1.0), "yellow": (1.0, 1.0, 0.0),
       OFF: (0.0, 0.0, 0.0)}  # fmt: skip
"""Of lights and symbols, 0 to 1."""
LIGHT_PATTERNS = tuple((i, j, k) for i, j, k in product(LIGHT_COLORS, repeat=3) if j not in {i, k})
"""The 36 patterns that shuffling goes through: no colour twice in a row."""
SYMBOLS = tuple(f"{color}_{shape}" for color, shape in product(("blue", "green", "red", "yellow"), SHAPES))
"""The 16 symbols that shuffling goes through; a placard shows the first unless it is told otherwise."""


def _off(value: Any) -> Any:
    """A file's `off` reads as false."""
    return OFF if value is False else value


def _three(value: Any) -> Any:
    if not isinstance(value, tuple | list) or len(value) != 3:
        raise fault(f"expected three of red, green, blue, yellow and off, got {shown(value)}")
    return tuple(value)


def _symbol(value: str) -> str:
    if value not in SYMBOLS:
        colors, shapes = ", ".join(LIGHT_COLORS), ", ".join(SHAPES)
        raise fault(f"expected a symbol COLOUR_SHAPE of {colors} and {shapes}, got {shown(value)}")
    return value


Symbol = Annotated[str, BeforeValidator(_symbol)]
"""What a placard shows, as `red_circle`."""
LightColor = Annotated[Literal["red", "green", "blue", "yellow", "off"], BeforeValidator(_off)]
Pattern = Annotated[tuple[LightColor, LightColor, LightColor], BeforeValidator(_three)]


class LightConfig(Config):
    """Panels that light up together: a second each of three colours, then two seconds dark, and again."""

    panels: Annotated[tuple[Name, ...], NotEmpty]
    """Names of the visuals that are the panels."""
    pattern: Pattern = (OFF, OFF, OFF)
    """The colours until a task or a user gives others."""
