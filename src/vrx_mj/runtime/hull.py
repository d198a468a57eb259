"""What a boat is, as a controller's author knows it: its hull, its rudders, and its thrusters with their commands."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.frames import Vector
from vrx_mj.model.tables import PROPELLER, PROPELLER_POINT, RESISTANCE, THRUSTER
from vrx_mj.physics.drag import resistance_at
from vrx_mj.physics.tables import BLADES, LINEAR, NEWTONS, RUDDER, Record, Table
from vrx_mj.physics.thrust import advance_thrust, force_point, measured_thrust, quadrant_loads, race_speed, thrust_force
from vrx_mj.runtime.loop_arrays import LoopArrays

_Six = tuple[float, float, float, float, float, float]
_SAMPLES = 401
"""Number of commands at which the mapping is tabulated."""
_MAPPING_FIELDS = ("mapping", "max_command", "max_forward", "max_reverse")
"""Fields of a thruster's row that its mapping depends on."""


@dataclass(frozen=True)
class Rudder:
    """A blade that turns in the water; the command `NAME_angle` is its angle [rad], positive counter-clockwise."""

    name: str
    """Name of the rudder."""
    position: Vector
    """Point at which its force acts [m], body frame."""
    max_angle: float
    """Largest angle either way [rad]."""
    pressure: float
    """Its force to port per square of the water's speed and sine of the angle [N s2/m2]."""
    race_share: float
    """Share of the blade in the race of a propeller, 0 to 1."""
    race_inertia: float
    """Density of the water times area of that propeller's disc [kg/m]."""

    def force_slope(self, speed: float, thrust: float) -> float:
        """Force of the rudder to port per radian of a small angle [N/rad], at a speed ahead [m/s] and a thrust [N]."""
        raced = race_speed(speed, thrust, 1.0, self.race_inertia) if self.race_share > 0.0 else 0.0
        return self.pressure * (self.race_share * raced * raced + (1.0 - self.race_share) * speed * speed)


@dataclass(frozen=True)
class Hull:
    """Figures of a boat; drag is linear and quadratic in surge, sway, heave, roll, pitch and yaw, body axes.

    In profile `marine` they are those of its `hull`, including cross-flow drag.
    """

    mass: float
    """Mass of the boat with what it carries [kg]."""
    inertia: float
    """Moment of inertia about the vertical through the centre of mass [kg m2]."""
    centre: Vector
    """Centre of mass [m], body frame."""
    added_mass: _Six
    """Added mass [kg] and added inertia [kg m2]."""
    drag_linear: _Six
    """Linear drag [N s/m] and [N m s]."""
    drag_quadratic: _Six
    """Quadratic drag [N s2/m2] and [N m s2]."""
    length: float
    """Length of the floats [m]."""
    rudders: Mapping[str, Rudder] = field(default_factory=dict)
    """Rudders by name."""
    resistance: tuple[tuple[float, float], ...] = ()
    """Speeds ahead and the resistance there [m/s, N], beside the drag in surge; empty where none was measured."""

    def resistance_at(self, speed: float) -> float:
        """Force [N] of `resistance` against the motion at a speed ahead [m/s], negative astern."""
        return float(resistance_at(np.array([*self.resistance], RESISTANCE), speed)) if self.resistance else 0.0


def hull_of(arrays: LoopArrays, row: Record, names: Mapping[str, int]) -> Hull:
    """The figures of the hull in a row of the arrays' table; `names` are the rows of its thrusters and rudders."""
    mass, inertia, centre = _masses(arrays.model, int(row["body"]))
    stations = arrays.stations[row["station_start"] : row["station_start"] + row["station_count"]]
    along, half = stations["position"][:, 0], 0.5 * stations["length"]
    added, linear, quadratic, resistance = row["added_mass"], row["drag_linear"], row["drag_quadratic"], ()
    if row["vessel"] >= 0:
        vessel = arrays.vessels[row["vessel"]]
        added, linear = np.diag(vessel["added_mass"]), np.diag(vessel["damping"])
        strips = arrays.strips[vessel["strip_start"] :][: vessel["strip_count"]]
        sway, yaw = strips["drag"].sum(), (strips["drag"] * np.abs(strips["x"]) ** 3).sum()
        quadratic = vessel["damping_quadratic"] + (0.0, sway, 0.0, 0.0, 0.0, yaw)
        resistance = tuple(arrays.resistances[vessel["resistance_start"] :][: vessel["resistance_count"]].tolist())
    return Hull(
        mass,
        inertia,
        centre,
        _six(added),
        _six(linear),
        _six(quadratic),
        float((along + half).max() - (along - half).min()),
        {
            name: _rudder(name, arrays.thrusters[k])
            for name, k in names.items()
            if arrays.thrusters["mapping"][k] == RUDDER and arrays.thrusters["max_angle"][k] > 0.0
        },
        resistance,
    )


def _six(values: FloatArray) -> _Six:
    surge, sway, heave, roll, pitch, yaw = (float(value) for value in values)
    return surge, sway, heave, roll, pitch, yaw


def _masses(model: mujoco.MjModel, root: int) -> tuple[float, float, Vector]:
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


_Mapping = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class Propeller:
    """A propeller that pushes along a line; the command `NAME_angle` turns that about the vertical."""

    name: str
    """Name of the thruster."""
    position: Vector
    """Where it pushes at zero steering [m], body frame."""
    direction: Vector
    """Direction of a positive force at zero steering, unit vector, body frame."""
    max_angle: float
    """Largest steering angle either way [rad]; 0: fixed."""
    max_forward: float
    """Largest force ahead [N]."""
    max_reverse: float
    """Largest force astern [N], at most 0, as `max_force_reverse` in files."""
    in_newtons: bool
    """Whether a command is the force itself [N]; else it is a share of full power."""
    _commands: FloatArray = field(repr=False, compare=False)
    _forces: FloatArray = field(repr=False, compare=False)
    _water: tuple[Record, Table, float] | None = field(default=None, repr=False, compare=False)
    """Rows of what was measured of it, and the density of the water [kg/m3]; None: speed takes none of its force."""
    _linear: tuple[float, float] | None = field(default=None, repr=False, compare=False)
    """Newtons of a unit of the command astern and ahead, where a force is so many; None: where it is a curve."""

    @property
    def max_command(self) -> float:
        """The command of the largest force ahead: 1, or that force [N] in a profile with commands in newtons."""
        return float(self._commands[-1])

    def command(self, force: float) -> float:
        """The command that gives a force [N], or the nearest that it can give; 0 for 0."""
        if force == 0.0:
            return 0.0
        if self._linear is not None:
            held = min(max(force, self.max_reverse), self.max_forward)
            return held / self._linear[held > 0.0] if held else 0.0
        return float(np.interp(force, self._forces, self._commands))

    def thrust_at(self, speed: float, force: float) -> float:
        """Thrust [N] that is left of a `force` at rest [N] at a `speed` through the water along its direction [m/s]."""
        if self._water is None:
            return force
        own, quadrants, density = self._water
        if own["quadrant_count"]:
            return float(quadrant_loads(own, quadrants, density, force, speed)[0])
        return float(advance_thrust(own, force, speed))


def thrusters(arrays: LoopArrays, rows: dict[str, int]) -> dict[str, Propeller]:
    """A boat's propellers by name; `rows` are those of its thrusters, rudders and sails in the arrays' table."""
    return {
        name: _thruster(name, arrays, row)
        for name, row in rows.items()
        if arrays.thrusters["mapping"][row] not in BLADES
    }


def energy_of(arrays: LoopArrays, boat: str, index: int, states: Table) -> FloatArray:
    """Electric energy that the propellers of a boat, the hull of row `index`, have drawn since the reset, (...) [J].

    `states` are the propellers' states of one run or several, (..., propellers).

    Raises:
        CommandError: the power of none of its propellers is known.
    """
    hull = arrays.hulls[index]
    own = arrays.thrusters["measured"][hull["thruster_start"] :][: hull["thruster_count"]]
    measured = own[own >= 0]
    if not arrays.propellers["power"][measured].any():
        raise CommandError(
            f"no energy for {boat}: none of its thrusters has a `power`; set it in the robot's `propellers`, "
            "which only profile marine uses"
        )
    energy: FloatArray = states["energy"][..., measured].sum(axis=-1)
    return energy


def _thruster(name: str, arrays: LoopArrays, number: int) -> Propeller:
    row, water, linear = arrays.thrusters[number], None, None
    if row["measured"] < 0:
        astern, ahead = (side * float(row[limit]) for side, limit in ((-1.0, "max_reverse"), (1.0, "max_forward")))
        square = float(row["max_command"]) ** 2
        linear = {LINEAR: (astern / square, ahead / square), NEWTONS: (1.0, 1.0)}.get(int(row["mapping"]))
        commands, forces, rising = _mapping_table(**{field: row[field].item() for field in _MAPPING_FIELDS})
    else:
        own = arrays.propellers[row["measured"]]
        if own["quadrant_count"] or own["vanishing_speed"] < np.inf:
            water = own.copy(), arrays.quadrants, float(arrays.sea[0]["density"])
        points = arrays.propeller_points[own["point_start"] :][: own["point_count"]]
        commands, forces, rising = _measured_table(
            float(row["max_command"]), float(own["dead_zone"]), tuple(points.tolist())
        )
    toward = row["rotation"] @ row["direction"]
    x, y, z = (float(value) for value in force_point(row, 0.0))
    return Propeller(
        name,
        (x, y, z),
        (float(toward[0]), float(toward[1]), float(toward[2])),
        float(row["max_angle"]),
        float(forces[-1]),
        float(forces[0]),
        bool(row["mapping"] == NEWTONS),
        commands,
        rising,
        water,
        linear,
    )


@lru_cache(maxsize=64)
def _mapping_table(**drive: float) -> _Mapping:
    """Commands, the forces [N] that they give, and the same forces with a slope where they do not change."""
    row = np.zeros(1, THRUSTER)[0]
    for name, value in drive.items():
        row[name] = value
    commands = np.linspace(-drive["max_command"], drive["max_command"], _SAMPLES)
    return _with_slope(commands, [thrust_force(row, float(command)) for command in commands])


@lru_cache(maxsize=64)
def _measured_table(max_command: float, dead_zone: float, curve: tuple[tuple[float, float], ...]) -> _Mapping:
    """`_mapping_table` of a propeller with these commands and thrusts."""
    own, points = np.zeros(1, PROPELLER)[0], np.array([*curve], PROPELLER_POINT)
    own["dead_zone"] = dead_zone
    shares = np.linspace(-1.0, 1.0, _SAMPLES)
    return _with_slope(max_command * shares, [measured_thrust(own, points, float(share)) for share in shares])


def _with_slope(commands: FloatArray, given: Sequence[float]) -> _Mapping:
    forces: FloatArray = np.maximum.accumulate(given)
    rising = forces + 1e-9 * np.arange(_SAMPLES)  # where the force does not change, the smallest command
    for array in (commands, forces, rising):
        array.setflags(write=False)  # all thrusters of a kind have the same
    return commands, forces, rising
