"""Shapes that collide, are seen, or displace water."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, field_validator, model_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import Color, Config, Folder, Name, Pose, Positive, fault, faults, numbers
from vrx_mj.config.loading import check
from vrx_mj.config.search import contained
from vrx_mj.config.wording import one_of

__all__ = ["MESH_SUFFIXES", "Shape", "Visual"]

MESH_SUFFIXES = (".obj", ".stl", ".dae", ".ply", ".glb")

KEYS = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "ellipsoid": ("size",),
    "mesh": ("file",),
}
"""What each type of shape must have; `scale` goes with a mesh too, but has a default."""


def _not_zero(value: float) -> float:
    if value == 0:
        raise fault("must not be 0")
    return value


Size = Annotated[tuple[Positive, Positive, Positive], numbers("x y z")]

Factor = Annotated[float, AfterValidator(_not_zero)]
Scale = Annotated[tuple[Factor, Factor, Factor], numbers("x y z")]


def _three(value: object) -> object:
    return (value,) * 3 if isinstance(value, int | float) and not isinstance(value, bool) else value


class Shape(Config):
    """A primitive or a mesh, centred on its pose; cylinders and capsules lie along their z axis."""

    folder: Folder = None
    name: Name | None = None
    """Name of the shape, for what refers to it."""
    type: Literal["box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"]
    """Kind of shape."""
    size: Size | None = None
    """Full edge lengths of a box, full axes of an ellipsoid [m]."""
    radius: Positive | None = None
    """Radius [m]."""
    length: Positive | None = None
    """Length along z [m]; a capsule's without its two caps."""
    file: str | None = None
    """A mesh (.obj, .stl, .dae, .ply or .glb), relative to the folder of the file that names it."""
    scale: Annotated[Scale, BeforeValidator(_three)] = (1.0, 1.0, 1.0)
    """Factors of a mesh along x, y and z; a negative one mirrors it. A file may give one number for all three."""
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Pose in the link's frame [m, rad]."""

    @field_validator("file")
    @classmethod
    def _is_a_mesh(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is not None and not value.lower().endswith(MESH_SUFFIXES):
            raise fault(f"expected a mesh that ends in {one_of(MESH_SUFFIXES)}, got '{value}'")
        if value is not None:
            check(info, lambda: contained(value, info.data.get("folder")))
        return value

    @model_validator(mode="after")
    def _exactly_its_keys(self) -> Self:
        needed = KEYS[self.type]
        allowed = (*needed, "scale") if self.type == "mesh" else needed
        given = {key for key in ("size", "radius", "length", "file", "scale") if key in self.model_fields_set}
        lacking = [((key,), f"required for a {self.type}") for key in needed if getattr(self, key) is None]
        takes = f"allowed: {', '.join((*allowed, 'pose'))}"
        excess = [
            ((key,), f"not allowed for a {self.type}; {takes}")
            for key in ("size", "radius", "length", "file", "scale")
            if key in given and key not in allowed
        ]
        if lacking or excess:
            raise faults(*lacking, *excess)
        return self


class Visual(Shape):
    """A shape that is seen."""

    color: Color = (0.5, 0.5, 0.5, 1.0)
    """Colour of the shape."""
