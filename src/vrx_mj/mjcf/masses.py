"""Mass, centre of mass and inertia of a boat, and of what it is made of."""

from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CompileError
from vrx_mj.mjcf.boats import AssembledThruster, Boat, Part
from vrx_mj.rigid_bodies import MassProperties, joined, posed, rigid

Engines = Literal["fixed", "hinged"]
"""Whether engines are part of the hull's body, or bodies of their own that turn about z."""


def axis_inertia(part: MassProperties) -> float:
    """Inertia [kg m2] of the part about the z axis of its frame."""
    x, y, _ = part.center
    return float(part.inertia[2, 2] + part.mass * (x * x + y * y))


_LEAST = 1e-12
"""Mass [kg] and moment of inertia [kg m2] below which MuJoCo takes no body; its own limits are 1e-15 and 1e-14."""
LIGHTEST = 1e-6
"""Least inertia [kg m2] that a servo is given to turn: a URDF may leave its engine's out."""
NOTHING = rigid(LIGHTEST, (0.0, 0.0, 0.0), (LIGHTEST,) * 3)
"""Mass and inertia [kg, kg m2] of a turning body whose links have none: MuJoCo needs some."""


def push_center(boat: Boat) -> FloatArray:
    """(3,): where water and wind push the hull [m], in its base link."""
    if boat.pushed is not None:
        return np.array(boat.pushed)
    lumped = list(_masses(part for part in boat.parts if part.lumped))
    return joined(lumped).center if lumped else boat_mass(boat).center


def turning_mass(thruster: AssembledThruster) -> MassProperties | None:
    """An engine with its propeller, in the frame of the hinge it steers on; None if it weighs nothing."""
    parts = list(_masses(thruster.parts))
    return joined(parts) if parts else None


def boat_mass(boat: Boat) -> MassProperties:
    """The whole boat with everything at zero, in its base link.

    Raises:
        CompileError: nothing of it has a mass, or no body has its mass and moments of inertia.
    """
    turning = [
        posed(mass, thruster.pose) for thruster in boat.thrusters if (mass := turning_mass(thruster)) is not None
    ]
    parts = [*_masses(boat.parts), *turning]
    if not parts:
        raise CompileError(f"robot {boat.name}: no link has a mass of {_LEAST:g} kg or more")
    return check_moments(joined(parts), f"robot {boat.name}")


def body_mass(boat: Boat, engines: Engines) -> MassProperties:
    """Mass properties of the MuJoCo body of the base link; errors are those of `boat_mass`, also about engines."""
    if engines == "fixed":
        return boat_mass(boat)
    for thruster in boat.thrusters:
        check_moments(turning_mass(thruster) or NOTHING, f"robot {boat.name}: what turns with '{thruster.name}'")
    parts = list(_masses(boat.parts))
    if not parts:
        raise CompileError(f"robot {boat.name}: only its engines have a mass; build it with engines: fixed")
    return check_moments(joined(parts), f"robot {boat.name} without its engines")


def check_moments(body: MassProperties, name: str) -> MassProperties:
    """Refuse a body that MuJoCo does not take, and return any other.

    Raises:
        CompileError: a principal moment of inertia is too small.
    """
    moments = np.linalg.eigvalsh(body.inertia).tolist()
    if moments[0] < _LEAST:
        words = ", ".join(f"{moment:.3g}" for moment in moments)
        raise CompileError(f"{name} has moments of inertia of {words} kg m2; each must be at least {_LEAST:g}")
    return body


def _masses(parts: Iterable[Part]) -> Iterator[MassProperties]:
    for part in parts:
        if part.inertial is not None and part.inertial.mass >= _LEAST:
            own = posed(rigid(part.inertial.mass, (0.0, 0.0, 0.0), part.inertial.tensor), part.inertial.pose)
            yield posed(own, part.pose)
