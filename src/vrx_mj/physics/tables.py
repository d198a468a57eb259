"""The parameter and state tables that kernels read: one numpy record per wave, hull, float and so on.

A kernel takes a row (`table[i]`) and reads its fields by name. SI units. "Body axes" are forward,
left, up, fixed to the link; "world axes" are east, north, up. `qpos` and `dof` are the addresses of a
free joint (or, for an engine, of its hinge) in MuJoCo's `qpos` and `qvel`; `body` is a body's number.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

Table = npt.NDArray[np.void]
Waves = Table | npt.NDArray[np.float64]
"""`WAVE`, or `wave_columns` of it. numba knows which, and leaves out what is for the other."""
Record = Any
"""One row of a `Table`."""

BOX, SPHERE, CYLINDER = 0, 1, 2
"""Values of `ELEMENT.shape`."""

LINEAR: Final = 0
GLF: Final = 1
RUDDER: Final = 2
NEWTONS: Final = 3
SAIL: Final = 4
"""Values of `THRUSTER.mapping`: a share of the largest force, the generalised logistic function of one, no propeller
but a rudder, the force itself, or no propeller but a sail."""
BLADES: Final = (RUDDER, SAIL)
"""Those of what takes an angle alone."""

VRX: Final = 0
VRX3: Final = 1
MARINE: Final = 2
"""Values of `HULL.profile` and `FLOAT.profile`: whose list of effects acts, VRX classic's, VRX 3's, or our own."""

MESH: Final = 0
MATRIX: Final = 1
"""Values of `VESSEL.hydrostatics`: pressure on a mesh, or a stiffness."""

_i, _u, _f = np.int64, np.uint64, np.float64
_vector = (_f, (3,))
_matrix = (_f, (6, 6))

WAVE = np.dtype(
    [
        ("amplitude", _f),  # [m]
        ("wavenumber", _f),  # [rad/m]
        ("frequency", _f),  # angular [rad/s]
        ("direction", _f, (2,)),  # unit vector, travels toward, world axes
        ("phase", _f),  # at the origin at time 0 [rad]: 0 in VRX's seas, unless a batch varies it
        ("steepness", _f),  # share of the trochoid's horizontal motion, 0..1; heights ignore it
        ("orbital", _f),  # amplitude of the water's horizontal velocity at the mean level [m/s]
    ],
    align=True,
)

SEA = np.dtype(
    [
        ("tau", _f),  # time constant of the start-up ramp [s]; <= 0: no ramp
        ("level", _f),  # mean surface height [m], world
        ("depth", _f),  # of the water under the mean surface [m]; infinite: deep
        ("gravity", _f),  # of the waves and of their pressure [m/s2]
        ("density", _f),  # of the water [kg/m3]
        ("moving", _i),  # 1: what floats feels how the water moves, as in profile marine
    ],
    align=True,
)

CURRENT = np.dtype(
    [
        ("mean", _f, (2,)),  # at the surface, east and north [m/s]
        ("tide_major", _f, (2,)),  # of the tide's ellipse, east and north [m/s]
        ("tide_minor", _f, (2,)),
        ("tide_frequency", _f),  # angular [rad/s]
        ("tide_phase", _f),  # at time 0 [rad]
        ("gain", _f),  # standard deviation of the random part, of each component [m/s]
        ("time_constant", _f),  # of the random part [s]
        ("key", _u),  # of its stream of random numbers
    ],
    align=True,
)

LAYER = np.dtype(
    [
        ("depth", _f),  # under the mean surface [m]
        ("share", _f),  # of the current at the surface
    ],
    align=True,
)

HULL = np.dtype(
    [
        ("body", _i),
        ("qpos", _i),
        ("dof", _i),
        ("profile", _i),  # VRX, VRX3 or MARINE
        ("station_start", _i),  # its stations are consecutive rows
        ("station_count", _i),
        ("density", _f),  # of the water [kg/m3]
        ("gravity", _f),  # for displaced water only [m/s2]: 9.815 in VRX classic, the world's in VRX 3
        ("level", _f),  # height of the mean surface above the sea's own level [m]
        ("added_mass", _f, (6,)),  # surge, sway, heave [kg], roll, pitch, yaw [kg m2], body axes
        ("drag_linear", _f, (6,)),  # [N s/m] x 3, [N m s] x 3, body axes
        ("drag_quadratic", _f, (6,)),  # [N s2/m2] x 3, [N m s2] x 3, body axes
        ("link_com", *_vector),  # CoM of VRX's base link [m], body axes: where plugin forces act
        ("body_com", *_vector),  # CoM of the MuJoCo body [m], body axes
        ("mass", _f),  # of the MuJoCo body [kg]
        ("wind", *_vector),  # coefficients: x, y [N s2/m2], turning [N m s2/m2]
        ("windage_start", _i),  # rows of its coefficients over the angle of the wind, consecutive
        ("windage_count", _i),  # 0: it has those of `wind`
        ("windage_height", _f),  # of the point where the wind acts, over the link's origin [m]
        ("windage_offset", _f),  # of that point ahead of the link's origin [m]
        ("spread", _f, (2,)),  # second moments of its waterplane over the area, along and across [m2]
        ("vessel", _i),  # row of VESSEL; -1: stations carry it, and it has the added mass and drag above
        ("memory_start", _i),  # its rows of MEMORY_STATE are consecutive, as many as its vessel has of MEMORY
        ("thruster_start", _i),  # its thrusters are consecutive rows
        ("thruster_count", _i),
    ],
    align=True,
)

PART = np.dtype(
    [
        ("center", *_vector),  # of its box [m], body axes
        ("start", _i),  # its points are consecutive; they are counted from the vessel's first
        ("size", _i),
    ],
    align=True,
)
"""A part of a vessel's mesh: `panel_mesh.Part`."""

VESSEL = np.dtype(
    [
        ("hydrostatics", _i),  # MESH or MATRIX
        ("point_start", _i),  # the points of its mesh are consecutive
        ("point_count", _i),
        ("pair_start", _i),  # its pairs of triangles are, too; they count the points from the mesh's first
        ("pair_count", _i),
        ("part_start", _i),  # the parts of its mesh are consecutive
        ("part_count", _i),
        ("half", *_vector),  # half sides of the box of a part [m]
        ("wave_rows", _i),  # nodes of that box for the waves, across and over the depth
        ("wave_levels", _i),
        ("added_mass", *_matrix),  # the following about the link's origin, body axes; [kg, kg m, kg m2]
        ("munk", _i),  # 1: with Munk's moment
        ("damping", *_matrix),  # [N s/m, N s, N m s]
        ("damping_quadratic", _f, (6,)),  # [N s2/m2, N m s2]
        ("point", *_vector),  # to which the quadratic damping belongs [m], body axes
        ("restoring", *_matrix),  # [N/m, N, N m]
        ("displacement", _f),  # mass of the water that it displaces at rest [kg]
        ("waterline", _f),  # [m]
        ("buoyancy", *_vector),  # centre of buoyancy at rest, or where a matrix carries that mass [m], body axes
        ("strip_start", _i),  # its strips are consecutive
        ("strip_count", _i),
        ("memory_start", _i),  # its rows of MEMORY are consecutive
        ("memory_count", _i),
        ("diffraction_start", _i),  # the rows of its diffraction are consecutive, by frequency, then by angle
        ("diffraction_frequencies", _i),  # 0: it has none, and feels the water's acceleration with its added mass
        ("diffraction_angles", _i),
        ("diffraction_step", _f),  # between its frequencies [rad/s]
    ],
    align=True,
)

STRIP = np.dtype(
    [
        ("x", _f),  # of its middle, body axes [m]
        ("z", _f),  # where its drag acts [m]
        ("drag", _f),  # rho / 2 C_d T dx [N s2/m2]
        ("lift", _f),  # rho / 2 A f of a skeg [N s2/m2]
    ],
    align=True,
)

MEMORY = np.dtype(
    [
        ("motion", _i),  # of the six velocities, which one it remembers
        ("pole", _f, (2,)),  # real, below 0, and imaginary part [1/s]
        ("residue", _f, (6,)),  # real part of the force on the hull per memory [N/m, N, N m], body axes
        ("residue_imaginary", _f, (6,)),
    ],
    align=True,
)

WINDAGE = np.dtype(
    [
        ("angle", _f),  # off the bow, from which the apparent wind comes [rad], 0 to pi
        ("surge", _f),  # force ahead [N s2/m2]
        ("sway", _f),  # force to lee [N s2/m2]
        ("roll", _f),  # heeling torque besides that of the force at its height [N m s2/m2]
        ("yaw", _f),  # torque that turns the bow to lee [N m s2/m2]
    ],
    align=True,
)

STATION = np.dtype(
    [
        ("position", *_vector),  # on the keel line of a float [m], body axes from the link origin
        ("radius", _f),  # of the float [m]
        ("length", _f),  # of its piece of the float [m]
    ],
    align=True,
)

THRUSTER = np.dtype(
    [
        ("hull", _i),  # row of HULL
        ("body", _i),  # the engine's body; the hull's own when it has no hinge
        ("qpos", _i),  # of the hinge; -1: none
        ("dof", _i),  # of the hinge; -1: none
        ("position", *_vector),  # of the engine's hinge [m], hull axes from the link origin
        ("rotation", _f, (3, 3)),  # engine at zero steering to hull axes; it turns about its z
        ("propeller", *_vector),  # where the force acts [m], engine axes from the hinge
        ("direction", *_vector),  # of the force, unit vector, engine axes
        ("body_com", *_vector),  # CoM of `body` [m], that body's axes
        ("mapping", _i),  # LINEAR, GLF, NEWTONS, RUDDER or SAIL
        ("max_command", _f),
        ("max_forward", _f),  # [N]
        ("max_reverse", _f),  # [N], at most 0
        ("gain", _f),  # factor of its force: 1, unless a batch varies it
        ("timeout", _f),  # a command holds this long [s]; <= 0: for ever
        ("max_angle", _f),  # largest steering target [rad]
        ("kp", _f),  # servo stiffness [N m/rad]
        ("kd", _f),  # servo damping [N m s/rad]
        ("effort", _f),  # largest servo torque [N m]
        ("velocity", _f),  # the servo pushes up to this rate [rad/s]
        ("inertia", _f),  # of all that turns about the hinge [kg m2]
        ("area", _f),  # of a rudder's blade or a sail [m2]
        ("slope", _f),  # of a rudder's normal force over the sine of its angle of attack
        ("density", _f),  # of the water at a rudder, or of the air at a sail [kg/m3]
        ("race", _i),  # row of the thruster in whose race a rudder is; -1: none
        ("race_area", _f),  # of that propeller's disc [m2]
        ("race_share", _f),  # share of the blade that the race covers
        ("measured", _i),  # row of PROPELLER, and of its state; -1: `mapping` gives the force
        ("curve_start", _i),  # a sail's rows of SAIL_CURVE are consecutive, by rising angle
        ("curve_count", _i),
        ("sheeted", _i),  # 1: a sheet lets the boom of a sail to lee by its angle; 0: it goes to that
    ],
    align=True,
)

SAIL_CURVE = np.dtype(
    [
        ("angle", _f),  # between the apparent wind and the chord [rad], 0..pi
        ("lift", _f),  # coefficient
        ("drag", _f),  # coefficient
    ],
    align=True,
)

PROPELLER = np.dtype(
    [
        ("dead_zone", _f),  # commands up to this size give exactly 0 N
        ("time_constant", _f),  # of the thrust [s]; <= 0: no lag
        ("vanishing_speed", _f),  # through the water, at which full thrust vanishes [m/s]; infinite: never
        ("diameter", _f),  # [m]
        ("full_ahead", _f),  # largest thrust at rest [N]
        ("full_astern", _f),  # [N], at most 0
        ("power", _f),  # electric, at full thrust at rest [W]
        ("point_start", _i),  # its rows of PROPELLER_POINT are consecutive, by rising command
        ("point_count", _i),
    ],
    align=True,
)

PROPELLER_POINT = np.dtype(
    [
        ("command", _f),  # -1..1
        ("thrust", _f),  # at rest [N]
    ],
    align=True,
)

FLOAT = np.dtype(
    [
        ("body", _i),
        ("qpos", _i),
        ("dof", _i),
        ("mass", _f),  # [kg]
        ("com", *_vector),  # [m], body axes from the link origin
        ("inertia", _f, (6,)),  # xx, yy, zz, xy, xz, yz [kg m2] about the CoM, body axes
        ("density", _f),  # of the water [kg/m3]
        ("gravity", _f),  # the world's: 9.8 m/s2 in VRX
        ("level", _f),  # height of the mean surface above the sea's own level [m]
        ("linear_drag", _f),  # per displaced mass [1/s]
        ("angular_drag", _f),  # per displaced mass and squared size [1/s]
        ("profile", _i),  # VRX or VRX3
        ("element_start", _i),  # its elements are consecutive rows
        ("element_count", _i),
        ("wind", *_vector),  # coefficients: x, y [N s2/m2], turning [N m s2/m2]
        ("follower", _i),  # row of FOLLOWER that drives it; -1: it drifts
    ],
    align=True,
)

ELEMENT = np.dtype(
    [
        ("shape", _i),  # BOX, SPHERE or CYLINDER (axis z)
        ("size", *_vector),  # [m] box: edges; sphere: radius, 0, 0; cylinder: radius, length, 0
        ("position", *_vector),  # of the centre [m], body axes from the link origin
        ("rotation", _f, (3, 3)),  # element to body axes
        ("volume", _f),  # of the whole shape, a true cylinder's for a cylinder [m3]
        ("mean_dimension", _f),  # mean of the extents along x, y, z [m]; cylinder: (2 r + l) / 2
    ],
    align=True,
)

BLOCK = np.dtype(
    [
        ("body", _i),
        ("parent", _i),  # row of the block that it hangs on, which comes before; -1: it is a root, on a free joint
        ("qpos", _i),  # of its hinge, or of the free joint
        ("dof", _i),
        ("depth", _i),  # hinges between it and its root
        ("position", *_vector),  # of its frame in the frame of the one it hangs on [m]
        ("anchor", *_vector),  # of the hinge [m], body axes from the frame
        ("axis", *_vector),  # of the hinge, unit vector, body axes
        ("offset", *_vector),  # of its middle, the link's origin and centre of mass [m], body axes from the frame
        ("mass", _f),  # [kg]
        ("density", _f),  # the following are as those of a FLOAT
        ("gravity", _f),
        ("level", _f),
        ("linear_drag", _f),
        ("angular_drag", _f),
        ("element_start", _i),
        ("element_count", _i),
        ("wind", *_vector),
    ],
    align=True,
)

MOORING = np.dtype(
    [
        ("block", _i),  # row of the block that it holds
        ("point", *_vector),  # where it holds it [m], body axes from the block's frame
        ("anchor", _f, (2,)),  # where that is at rest [m], world
        ("stiffness", _f),  # [N/m]
        ("damping", _f),  # [N s/m]
    ],
    align=True,
)

ROPE = np.dtype(
    [
        ("float", _i),  # row of FLOAT that it holds
        ("anchor", _f, (2,)),  # [m], world
        ("length", _f),  # on the horizontal plane, up to which it is slack [m]
        ("stiffness", _f),  # [N/m]
        ("damping", _f),  # [N s/m]
    ],
    align=True,
)

FOLLOWER = np.dtype(
    [
        ("force", _f),  # along the body's x [N]
        ("torque", _f),  # about the body's z [N m]
        ("tolerance", _f),  # bearing beyond which it turns [rad]
        ("reach", _f),  # distance at which a waypoint is reached [m]
        ("turns_first", _i),  # 1: pushes only within the tolerance, and measures distances on the water
        ("loop", _i),  # 1: from the last waypoint it goes on to the first
        ("waypoint_start", _i),  # its waypoints are consecutive rows
        ("waypoint_count", _i),
    ],
    align=True,
)

WAYPOINT = np.dtype(
    [
        ("position", _f, (2,)),  # [m], world
    ],
    align=True,
)

WIND = np.dtype(
    [
        ("direction", _f, (2,)),  # unit vector, blows toward, world axes
        ("mean", _f),  # [m/s]
        ("gain", _f),  # standard deviation of the gusts [m/s]
        ("time_constant", _f),  # of the gusts [s]
        ("first_step", _f),  # the gusts' own length of the first step [s]; 0: that of all others
        ("key", _u),  # of the stream of random numbers
    ],
    align=True,
)

AIR = np.dtype(
    [
        ("height", _f),  # above the water, at which the wind has its speed [m]
        ("exponent", _f),  # of its power law over height; 0: the same at all heights
        ("roughness", _f),  # length of its logarithmic profile [m]; 0: it has the power law
        ("turning", _f),  # rate of its direction [rad/s]
        ("spread", _f),  # standard deviation of its direction [rad]
        ("time_constant", _f),  # of its direction [s]
        ("key", _u),  # of its stream of random numbers
    ],
    align=True,
)

GUST_BAND = np.dtype(
    [
        ("frequency", _f),  # angular [rad/s]
        ("phase", _f),  # at time 0 [rad]
    ],
    align=True,
)

MEMORY_STATE = np.dtype(
    [
        ("real", _f),  # [m], [rad]
        ("imaginary", _f),
    ],
    align=True,
)

THRUSTER_STATE = np.dtype(
    [
        ("command", _f),
        ("expires", _f),  # time up to which the command holds [s]
        ("angle_target", _f),  # [rad]
        ("angle", _f),  # steering angle [rad]
        ("rate", _f),  # [rad/s]
        ("thrust", _f),  # applied in the last step [N]
        ("applied", _f),  # the command that `thrust` belongs to; of a sail, the force along its chord [N]
        ("fresh", _i),  # 0 until `thrust` has been computed once
    ],
    align=True,
)

PROPELLER_STATE = np.dtype(
    [
        ("thrust", _f),  # at rest, after the lag [N]
        ("energy", _f),  # electric, drawn so far [J]
    ],
    align=True,
)

FLOAT_STATE = np.dtype(
    [
        ("height", _f),  # `surface_height` at the link origin in the step before [m]; VRX starts with `FLOAT.level`
        ("held", _i),  # 1: it is kept where it is, out of the water's reach
    ],
    align=True,
)

FOLLOWER_STATE = np.dtype(
    [
        ("target", _i),  # which of its waypoints it is bound for, from 0
    ],
    align=True,
)

ELEMENT_STATE = np.dtype(
    [
        ("height", _f),  # `surface_height` at the element in the step before [m]; 0 where the link's counts
        ("rise", _f),  # vertical velocity of the water there [m/s]; 0 where the link's counts
    ],
    align=True,
)

CURRENT_STATE = np.dtype(
    [
        ("east", _f),  # random part [m/s]
        ("north", _f),
        ("counter", _u),  # steps so far
    ],
    align=True,
)

AIR_STATE = np.dtype(
    [
        ("deviation", _f),  # random part of the direction [rad]
        ("angle", _f),  # by which the wind blows off `WIND.direction` [rad], counter-clockwise
        ("counter", _u),  # steps so far
    ],
    align=True,
)

WIND_STATE = np.dtype(
    [
        ("gust", _f),  # deviation from the mean speed [m/s]
        ("speed", _f),  # mean + gust [m/s]; may be negative
        ("counter", _u),  # random numbers drawn so far
    ],
    align=True,
)


_VARIED: Mapping[str, float] = {"phase": 0.0, "gain": 1.0}
"""Columns that compiled worlds do not have, with what they are unless a batch varies them."""


def table(dtype: np.dtype[np.void], rows: Sequence[Mapping[str, object]]) -> Table:
    """Return a table of `rows`, each of which has exactly the fields of `dtype`, or all but those `_VARIED`."""
    names = set(dtype.names or ())
    filled = np.zeros(len(rows), dtype)
    rows = [{name: value for name, value in _VARIED.items() if name in names} | dict(row) for row in rows]
    for index, row in enumerate(rows):
        if row.keys() != names:
            missing, unknown = sorted(names - row.keys()), sorted(row.keys() - names)
            raise ValueError(f"row {index}: missing fields {missing}, unknown fields {unknown}")
    for name in names if rows else ():
        shape = dtype[name].shape
        try:
            column = np.array([row[name] for row in rows])
        except ValueError:  # rows of different shapes
            column = np.zeros(0)
        if column.shape != (len(rows), *shape):
            _refuse(name, shape, rows)
        filled[name] = column
    return filled


def _columns_of(dtype: np.dtype[np.void], record: object) -> dict[str, object]:
    """Return the attributes of a record that have a column in `dtype`, by their names: a row for `table`."""
    return {name: getattr(record, name) for name in dtype.names or ()}


def _refuse(name: str, shape: tuple[int, ...], rows: Sequence[Mapping[str, Any]]) -> None:
    index, value = next((index, row[name]) for index, row in enumerate(rows) if np.shape(row[name]) != shape)
    raise ValueError(f"row {index}: {name} has shape {np.shape(value)}, not {shape}")
