"""What is around a hull in a step: the wind, the water, and the hull's motion through it, which all effects share."""

from typing import NamedTuple

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.current import current_velocity
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.kinematics import Orbital, Turning, orbital_motion, orbital_turning, reach_of
from vrx_mj.physics.motion import Motion, Vector, Wrench, relative_motion, rotate
from vrx_mj.physics.tables import Record, Table, Waves
from vrx_mj.physics.wave_box import heading_of


class WaterMotion(NamedTuple):
    """Motion of the undisturbed water at a point of a hull."""

    stream: Vector
    """The current [m/s], world axes."""
    orbital: Orbital
    """The waves' motion of the water there."""
    turning: Turning
    """The waves' turning of the water over the hull's waterplane."""


class Conditions(NamedTuple):
    """Surroundings and motion of a hull in a step."""

    waves: Waves
    """The waves, in columns or as `tables.WAVE`."""
    windage: Table | None
    """`tables.WINDAGE`; None in a run where no hull has any."""
    air: tuple[float, float]
    """Wind at the hull [m/s], world axes."""
    water: WaterMotion
    """Motion of the water at `hull.link_com`, or at `vessel.buoyancy`; at rest in VRX's profiles."""
    body: Motion
    """Motion of the link over ground."""
    through: Motion
    """Motion of the link through the water, which current and waves move and waves turn."""
    through_level: Motion
    """Motion of the link through water that moves but stays level."""
    pressure: Wrench
    """Pressure of the undisturbed water on a hull of `tables.VESSEL`: world axes, about `hull.link_com`."""
    wet: float
    """Share of the water's other forces that is left of such a hull when it leaves the water; 1 for others."""
    time: float
    """Time [s] at the end of the step."""
    dt: float
    """Length of the step [s]."""


@kernel
def water_motion(
    hull: Record, point: FloatArray, body: Motion, waves: Waves, sea: Record, current: Table, state: Table,
    layers: Table, time: float,
) -> WaterMotion:  # fmt: skip
    """Return the motion of the water by current and waves at a point (3,) [m] of a hull, body axes."""
    lever = rotate(body, point[0], point[1], point[2])
    x, y, z = body.x + lever[0], body.y + lever[1], body.z + lever[2]
    east, north = current_velocity(current, state, layers, sea.level - z, time)
    orbital = orbital_motion(waves, sea, x, y, z, time)
    turning = orbital_turning(waves, sea, reach_of(hull, heading_of(body)), x, y, z, time)
    return WaterMotion((east, north, 0.0), orbital, turning)


@kernel
def still_water() -> WaterMotion:
    """Return the motion of water at rest."""
    return WaterMotion((0.0, 0.0, 0.0), Orbital(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), Turning(0.0, 0.0, 0.0, 0.0))


@kernel
def motion_through(water: WaterMotion, body: Motion) -> Motion:
    """Return a motion through water that moves so but stays level."""
    stream, orbital = water.stream, water.orbital
    return relative_motion(body, (stream[0] + orbital.u, stream[1] + orbital.v, stream[2] + orbital.w))
