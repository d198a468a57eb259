"""Rows for the compiled loop's tables, as plain data with names where the tables have ids."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from vrx_mj.config.objects import BuoyancyElement
from vrx_mj.config.profiles import CLASSIC
from vrx_mj.config.world import PhysicsConfig, SeaConfig, WindConfig
from vrx_mj.constants import HULL_GRAVITY
from vrx_mj.frames import rotation
from vrx_mj.mjcf.placement import PlacedObject
from vrx_mj.mjcf.wind import NO_WIND, wind_coefficients
from vrx_mj.model.water import Sea, Wave
from vrx_mj.physics.tables import VRX, VRX3
from vrx_mj.physics.waves import cwr_components, pms_components

Row = dict[str, Any]
NIL_AMPLITUDE = 1e-9
"""Waves lower than this [m] are left out: with VRX's scale 2.5 the longest one has 1e-11 m."""
SHAPES = {"box": 0, "sphere": 1, "cylinder": 2}
PROFILES = {"vrx": VRX, "vrx3": VRX3}
"""Codes of the profiles in the runtime's tables."""
DENSITY = 997.0
"""In profile vrx3, of the water that an object displaces which does not say [kg/m3]. VRX 3's PolyhedraBuoyancyDrag.cc.
"""


SEA_FIELDS = sorted(SeaConfig.model_fields.keys() & {field.name for field in dataclasses.fields(Sea)})
"""Fields of a sea that a world file gives and a compiled world takes over as they are."""


def sea_parameters(sea: SeaConfig) -> Sea:
    """Wave components and start-up ramp; `model: none` is a sea without components."""
    shape = (sea.number, sea.scale, sea.angle, sea.steepness)
    waves: Sequence[Row] = ()
    if sea.model == "pms":
        waves = pms_components(*shape, gain=sea.gain, period=sea.period, direction=sea.direction)
    elif sea.model == "cwr":
        waves = cwr_components(*shape, amplitude=sea.amplitude, period=sea.period, direction=sea.direction)
    afloat = [wave for wave in waves if wave["amplitude"] > NIL_AMPLITUDE]
    height = 4.0 * math.sqrt(math.fsum(wave["amplitude"] ** 2 for wave in afloat) / 2.0)
    same: Row = {name: getattr(sea, name) for name in SEA_FIELDS}
    return Sea(**same, level=0.0, waves=tuple(Wave(**wave) for wave in afloat), significant_height=height)


def hull_physics(physics: PhysicsConfig) -> Row:
    """What the world's physics says of a hull: VRX 3's water weighs what the world's gravity makes it weigh."""
    gravity = HULL_GRAVITY if physics.profile == CLASSIC else physics.gravity
    return {"profile": PROFILES[physics.profile], "gravity": gravity}


def float_row(item: PlacedObject, wind: WindConfig | None, physics: PhysicsConfig) -> tuple[Row, list[Row]]:
    """The row of a floating object and those of its buoyancy elements."""
    config = item.config
    buoyancy = config.buoyancy
    assert buoyancy is not None, f"{item.model} does not float"
    assert config.inertia is not None, f"{item.model} has no inertia"
    ixx, iyy, izz = config.inertia
    silent = "fluid_density" not in buoyancy.model_fields_set
    row = {
        "body": f"{item.name}/{config.link}",
        "mass": config.mass,
        "com": list(config.center_of_mass),
        "inertia": [ixx, iyy, izz, 0.0, 0.0, 0.0],
        "density": DENSITY if physics.profile == "vrx3" and silent else buoyancy.fluid_density,
        "gravity": physics.gravity,
        "level": buoyancy.fluid_level,
        "linear_drag": buoyancy.linear_drag,
        "angular_drag": buoyancy.angular_drag,
        "profile": PROFILES[physics.profile],
        "wind": list(wind_coefficients(wind, item.name, item.model) or NO_WIND),
    }
    return row, [element_row(element) for element in buoyancy.elements]


def element_row(element: BuoyancyElement) -> Row:
    """A buoyancy element: dimensions, pose in the link, full volume [m3] and VRX's mean dimension [m]."""
    size, volume, mean = _measures(element)
    return {
        "shape": SHAPES[element.type],
        "size": size,
        "position": list(element.pose[:3]),
        "rotation": [list(row) for row in rotation(*element.pose[3:])],
        "volume": volume,
        "mean_dimension": mean,
    }


def _measures(element: BuoyancyElement) -> tuple[list[float], float, float]:
    if element.type == "box":
        assert element.size is not None
        a, b, c = element.size
        return [a, b, c], a * b * c, (a + b + c) / 3.0
    assert element.radius is not None
    r = element.radius
    if element.type == "sphere":
        return [r, 0.0, 0.0], 4.0 / 3.0 * math.pi * r**3, 2.0 * r
    assert element.length is not None
    return [r, element.length, 0.0], math.pi * r * r * element.length, (2.0 * r + element.length) / 2.0
