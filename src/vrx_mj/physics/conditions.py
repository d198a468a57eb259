"""What is around a hull in a step: the wind, the water, and the hull's motion through it, which all effects share."""

from typing import NamedTuple

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.current import current_velocity
from vrx_mj.physics.kernel import expanded_kernel, kernel
from vrx_mj.physics.kinematics import Orbital, Turning, orbital_motion, orbital_turning, reach_of
from vrx_mj.physics.motion import Motion, Vector, Wrench, place_of, plus, relative_motion, zero_vector
from vrx_mj.physics.tables import Record, Table, Views, Waves
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


@expanded_kernel
def water_motion(hull: Record, point: FloatArray, body: Motion, waves: Waves, a: Views, time: float) -> WaterMotion:
    """Return the motion of the water by current and waves at a point (3,) [m] of a hull, body axes."""
    sea = a.sea[0]
    x, y, z = place_of(body, point)
    east, north = current_velocity(a.current, a.current_state, a.layers, sea.level - z, time)
    orbital = orbital_motion(waves, sea, x, y, z, time)
    turning = orbital_turning(waves, sea, reach_of(hull, heading_of(body)), x, y, z, time)
    return WaterMotion((east, north, 0.0), orbital, turning)


@kernel
def still_water() -> WaterMotion:
    """Return the motion of water at rest."""
    return WaterMotion(zero_vector(), Orbital(*zero_vector(), *zero_vector()), Turning(0.0, *zero_vector()))


@kernel
def motion_through(water: WaterMotion, body: Motion) -> Motion:
    """Return a motion through water that moves so but stays level."""
    return relative_motion(body, plus(water.stream, water.orbital[:3]))
