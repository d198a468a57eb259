"""Fields of objects that a world has somewhere in a square, drawn from a seed."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import Config, Coordinate, Folder, Name, NonNegative, NotEmpty, Positive, Seed, numbers
from vrx_mj.config.loading import check
from vrx_mj.config.objects import load_object
from vrx_mj.errors import VrxError

__all__ = ["FieldConfig", "FieldKind"]

MOST = 1000
"""Objects of a kind in a field."""


class FieldKind(Config):
    """Equal objects of a field."""

    folder: Folder = None
    model: str
    """A name from `objects`, or the path of a YAML file relative to this one."""
    count: Annotated[int, Field(ge=1, le=MOST)]
    """Number of these objects."""
    name: Name | None = None
    """What their names start with, before a number; by default the model's."""

    @property
    def stem(self) -> str:
        """What their names start with."""
        return self.name or Path(self.model).stem

    @field_validator("model")
    @classmethod
    def _is_single(cls, value: str, info: ValidationInfo) -> str:
        check(info, lambda: _must_be_single(value, info.data.get("folder")))
        return value


class FieldConfig(Config):
    """Objects in a square, not too near each other, boats at their start, other objects, docks and the shore."""

    name: Name
    """Name of the field."""
    objects: Annotated[tuple[FieldKind, ...], NotEmpty]
    """Kinds of objects in the field, and how many of each."""
    size: Positive = 40.0
    """Edge of the square [m], along the world's axes."""
    center: Annotated[tuple[Coordinate, Coordinate], numbers("x y")] = (0.0, 0.0)
    """Centre of the square in the world [m]."""
    min_distance: NonNegative = 5.0
    """Least distance between the objects' origins, and from them to the origins of other things, to docks and to the
    shore [m]."""
    seed: Seed | None = None
    """Seed of the places; by default that of the world's file, so that other runs of one world have the same field."""


def _must_be_single(model: str, near: Path | None) -> None:
    if load_object(model, near).kind == "composite":
        raise VrxError(f"'{model}' is made of other objects; a field is made of single ones")
