"""Kinds of what a referee's state holds, by which a saved one is checked."""

from typing import Annotated

from pydantic import Field

__all__ = ["Count", "Place"]

Count = Annotated[int, Field(ge=0, le=1 << 53)]
"""A number of things."""
Place = Annotated[list[float], Field(min_length=3, max_length=3)]
"""x, y, z [m]."""
