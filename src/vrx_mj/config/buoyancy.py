"""What a link displaces, and its drag in water."""

import math
from typing import Annotated, Literal

from vrx_mj.config.base import Config
from vrx_mj.config.shapes import Shape
from vrx_mj.config.values import NonNegative, NotEmpty, Number, Positive
from vrx_mj.constants import WATER_DENSITY


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
    """VRX's buoyancy_gazebo_plugin: what an object displaces, and its drag in water."""

    fluid_density: Positive = WATER_DENSITY
    """Density of the water [kg/m3]."""
    fluid_level: Number = 0.0
    """Mean water level [m]."""
    linear_drag: NonNegative
    """Drag of each element over the link's mass and linear velocity [1/s], scaled by the share of it under water."""
    angular_drag: NonNegative
    """Drag torque of each element over mass, mean extent squared and angular velocity [1/s], scaled likewise."""
    elements: Annotated[tuple[BuoyancyElement, ...], NotEmpty]
    """Shapes that displace water; the whole volume of each counts."""
