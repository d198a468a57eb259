"""Shapes that collide, are seen, or displace water, and what a link displaces."""

import math
from typing import Annotated, Literal

from pydantic import BeforeValidator

from vrx_mj.config.base import Config, InFolder, Only
from vrx_mj.config.loading import loads
from vrx_mj.config.search import contained_file
from vrx_mj.config.values import Color, Name, NotEmpty, Number, NumberOf, Pose, Positive, demand, numbers
from vrx_mj.config.wording import one_of
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.model.things import Float

MESH_SUFFIXES = (".obj", ".stl", ".dae", ".ply", ".glb")


Size = Annotated[tuple[Positive, Positive, Positive], numbers("x y z")]

Factor = Annotated[Number, demand(bool, "must not be 0")]
_Scale = Annotated[tuple[Factor, Factor, Factor], numbers("x y z")]


def _three(value: object) -> object:
    return (value,) * 3 if isinstance(value, int | float) and not isinstance(value, bool) else value


def _is_mesh(file: str) -> bool:
    return file.lower().endswith(MESH_SUFFIXES)


_ENDS = one_of(MESH_SUFFIXES)
_Mesh = Annotated[str, demand(_is_mesh, f"expected a mesh that ends in {_ENDS}, got {{}}"), loads(contained_file)]


class Shape(InFolder):
    """A primitive or a mesh, centred on its pose. Cylinders and capsules are aligned with their z axis."""

    name: Name | None = None
    """Name of the shape, for references to it."""
    type: Literal["box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"]
    """Kind of shape."""
    size: Annotated[Size | None, Only("type", ("box", "ellipsoid"), required=True)] = None
    """Full edge lengths of a box, full axes of an ellipsoid [m]."""
    radius: Annotated[Positive | None, Only("type", ("sphere", "cylinder", "capsule"), required=True)] = None
    """Radius [m]."""
    length: Annotated[Positive | None, Only("type", ("cylinder", "capsule"), required=True)] = None
    """Length along z [m]; for a capsule without its two caps."""
    file: Annotated[_Mesh | None, Only("type", ("mesh",), required=True)] = None
    """A mesh (.obj, .stl, .dae, .ply or .glb), relative to the folder of the file that names it."""
    scale: Annotated[_Scale, BeforeValidator(_three), Only("type", ("mesh",))] = (1.0, 1.0, 1.0)
    """Scale of a mesh along x, y and z. A negative factor mirrors it. A file may give one number for all three."""
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Pose in the link's frame [m, rad]."""


class Visual(Shape):
    """A visible shape."""

    color: Color = (0.5, 0.5, 0.5, 1.0)
    """Colour of the shape."""


class BuoyancyElement(Shape):
    """A shape that displaces water."""

    type: Literal["box", "sphere", "cylinder"]
    """Kind of shape."""

    @property
    def volume(self) -> float:
        """Volume [m3]."""
        if self.type == "box":
            return math.prod(self.size or ())
        radius, length = self.radius or 0.0, self.length or 0.0
        return 4 / 3 * math.pi * radius**3 if self.type == "sphere" else math.pi * radius**2 * length


class BuoyancyConfig(Config):
    """Displacement and drag of an object in water, as in VRX's buoyancy_gazebo_plugin."""

    fluid_density: Annotated[Positive, NumberOf(Float, "density")] = WATER_DENSITY
    fluid_level: Annotated[float, NumberOf(Float, "level")] = 0.0
    linear_drag: Annotated[float, NumberOf(Float, "linear_drag")]
    """Drag of each element over the link's mass and linear velocity [1/s], scaled by its submerged fraction."""
    angular_drag: Annotated[float, NumberOf(Float, "angular_drag")]
    """Drag torque of each element over mass, mean extent squared and angular velocity [1/s], scaled by its submerged
    fraction."""
    elements: Annotated[tuple[BuoyancyElement, ...], NotEmpty]
    """Shapes that displace water. The whole volume of each counts, even if shapes overlap."""
