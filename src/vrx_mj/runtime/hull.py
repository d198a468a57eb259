"""What a boat's hull is, as a controller's author knows it: mass, drag, size and rudders."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np

from vrx_mj.physics.rudder import race_speed
from vrx_mj.physics.tables import RUDDER, Record
from vrx_mj.physics.thrust import force_point
from vrx_mj.runtime.loop_arrays import LoopArrays

__all__ = ["Hull", "Rudder", "hull_of"]

Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Rudder:
    """A blade that turns in the water; the command `NAME_angle` is its angle [rad], positive counter-clockwise."""

    name: str
    """Name of the rudder."""
    position: tuple[float, float, float]
    """Where its force acts [m], body frame."""
    max_angle: float
    """Largest angle either way [rad]."""
    pressure: float
    """Its force to port per square of the water's speed and sine of the angle [N s2/m2]."""
    race_share: float
    """Share of the blade in the race of a propeller, 0 to 1."""
    race_inertia: float
    """Density of the water times area of that propeller's disc [kg/m]."""

    def force_slope(self, speed: float, thrust: float) -> float:
        """Its force to port per radian of a small angle [N/rad], at a speed ahead [m/s] and a thrust [N]."""
        raced = race_speed(speed, thrust, 1.0, self.race_inertia) if self.race_share > 0.0 else 0.0
        return self.pressure * (self.race_share * raced * raced + (1.0 - self.race_share) * speed * speed)


@dataclass(frozen=True)
class Hull:
    """Figures of a boat; drag is linear and quadratic in surge, sway, heave, roll, pitch and yaw, body axes."""

    mass: float
    """Mass of the boat with what it carries [kg]."""
    inertia: float
    """Moment of inertia about the vertical through the centre of mass [kg m2]."""
    centre: tuple[float, float, float]
    """Centre of mass [m], body frame."""
    added_mass: Six
    """Added mass [kg] and added inertia [kg m2]."""
    drag_linear: Six
    """Linear drag [N s/m] and [N m s]."""
    drag_quadratic: Six
    """Quadratic drag [N s2/m2] and [N m s2]."""
    length: float
    """Length of the floats [m]."""
    rudders: Mapping[str, Rudder] = field(default_factory=dict)
    """Rudders by name."""


def hull_of(rig: LoopArrays, row: Record, names: Mapping[str, int]) -> Hull:
    """The figures of the hull in a row of the rig's table; `names` are the rows of its thrusters and rudders."""
    mass, inertia, centre = _masses(rig.model, int(row["body"]))
    stations = rig.stations[row["station_start"] : row["station_start"] + row["station_count"]]
    along, half = stations["position"][:, 0], 0.5 * stations["length"]
    return Hull(
        mass,
        inertia,
        centre,
        _six(row, "added_mass"),
        _six(row, "drag_linear"),
        _six(row, "drag_quadratic"),
        float((along + half).max() - (along - half).min()),
        {name: _rudder(name, rig.thrusters[k]) for name, k in names.items() if rig.thrusters["mapping"][k] == RUDDER},
    )


def _six(row: Record, name: str) -> Six:
    surge, sway, heave, roll, pitch, yaw = (float(value) for value in row[name])
    return surge, sway, heave, roll, pitch, yaw


def _masses(model: mujoco.MjModel, root: int) -> tuple[float, float, tuple[float, float, float]]:
    """Mass [kg], moment of inertia about the vertical [kg m2] and centre of mass [m] of a boat with its joints at 0.

    What hangs on joints, as engines do, is taken with the axes of its own frame along those of the boat.
    """
    parts = np.flatnonzero(model.body_rootid == root).tolist()
    mass = model.body_mass[parts]
    places, moments = np.zeros((len(parts), 3)), np.zeros(len(parts))
    origin = {root: np.zeros(3)}
    for number, body in enumerate(parts):
        if body != root:
            origin[body] = origin[int(model.body_parentid[body])] + model.body_pos[body]
        places[number] = origin[body] + model.body_ipos[body]
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[body])
        moments[number] = np.square(turn.reshape(3, 3)[2]) @ model.body_inertia[body]
    centre = mass @ places / mass.sum()
    arms = np.square(places - centre)[:, :2].sum(axis=1)
    x, y, z = (float(value) for value in centre)
    return float(mass.sum()), float((moments + mass * arms).sum()), (x, y, z)


def _rudder(name: str, row: Record) -> Rudder:
    x, y, z = force_point(row, 0.0)
    pressure = 0.5 * float(row["density"] * row["area"] * row["slope"])
    share = float(row["race_share"]) if row["race"] >= 0 else 0.0
    inertia = float(row["density"] * row["race_area"])
    return Rudder(name, (float(x), float(y), float(z)), float(row["max_angle"]), pressure, share, inertia)
