"""Boats of a compiled world: what the loop reads of them, and what others do."""

import math
from collections.abc import Mapping
from pathlib import PurePath
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.model.kinds import (
    TIED,
    Angle,
    Coefficient,
    Count,
    Description,
    Flag,
    Index,
    Matrix,
    Name,
    NonNegative,
    NonPositive,
    Parts,
    Pose,
    Positive,
    ProfileCode,
    Real,
    Row,
    RowOf,
    Share,
    Six,
    SixBySix,
    Text,
    UnitVector,
    Unless,
    Vec3,
    WindForce,
    left_out,
    record,
)
from vrx_mj.physics.tables import BLADES, MESH, NEWTONS

MOST_TRIANGLES = 5000
"""Largest number of triangles of a hull's mesh."""
MOST_STRIPS = 200
"""Strips that a hull may have."""
MOST_SKEGS = 10
"""Skegs that a hull may have."""
AisClass = Literal["A", "B"]
"""Class of a transponder of AIS."""


_WindPoint = Annotated[tuple[Angle, Real, Real, Real], Parts("angle", "surge", "sway", "yaw")]
_Blendermann = Annotated[
    tuple[Positive, Positive, Positive, NonNegative, Positive],
    Parts("cd_t", "cd_l_ahead", "cd_l_astern", "delta", "kappa"),
]
MJCF_FIELDS = ("mass", "body_com", "inertia")
"""Fields of a hull that its MJCF's body has too."""


@record
class Windage:
    """Windage of a hull: areas and coefficients; angles are those off the bow from which the wind comes."""

    frontal_area: Positive
    """Area above the water, seen from ahead [m2]."""
    lateral_area: Positive
    """Area above the water, seen from the side [m2]."""
    length: Positive
    """Length overall [m]."""
    height: NonNegative
    """Height of the lateral area's centre over the link's origin [m]."""
    offset: Real
    """Distance of the lateral area's centre ahead of the link's origin [m]."""
    coefficients: WindForce | None = None
    """Coefficients of -cos, sin and sin 2 of the angle [1]."""
    curve: Annotated[tuple[_WindPoint, ...], Field(max_length=1000)] = ()
    """Angles, and coefficients of surge, sway and yaw there [rad, 1, 1, 1]."""
    vessel: _Blendermann | None = None
    """Blendermann's parameters: CD_t, CD_l,AF from ahead and from astern, delta and kappa [1]."""


@record
class Strip:
    """A piece of a hull's lateral area, or a skeg, in body axes."""

    x: Real
    """Position of a strip's middle, ahead of the link's origin [m]."""
    z: Real
    """Height at which the force of a strip acts [m]."""
    drag: NonNegative
    """Force of a strip over the square of its transverse velocity through the water [N s2/m2]."""
    lift: NonNegative = left_out(default=0.0)
    """Force of a strip over the product of its speed and its transverse velocity through the water [N s2/m2]."""


@record
class Memory:
    """A damped oscillation of the waves that a hull makes by one of its motions: about the link's origin, body axes."""

    motion: Annotated[int, Field(ge=0, le=5)]
    """The motion: 0 to 5 for surge, sway, heave, roll, pitch, yaw."""
    pole: Annotated[tuple[Annotated[float, Field(lt=0.0, ge=-1e6)], Coefficient], Parts("real", "imaginary")]
    """Pole, real part below 0 and imaginary part [1/s]."""
    residue: Six
    """Real part of the force against the hull per memory [N/m, N, N m]."""
    residue_imaginary: Six
    """Imaginary part of the force against the hull per memory [N/m, N, N m]."""


Forces = tuple[Real, Real, Real, Real, Real, Real, Real, Real, Real, Real, Real, Real]


@record
class Diffraction:
    """Forces of the waves that a hull scatters, about the link's origin, in body axes."""

    step: Positive
    """Step between frequencies, of which the first is 0 [rad/s]."""
    forces: Annotated[tuple[Annotated[tuple[Forces, ...], Field(max_length=360)], ...], Field(max_length=1001), TIED]
    """Forces by frequency and by angle toward which waves travel, even over the circle from the bow on.

    Real parts, then imaginary ones, per metre of amplitude [N/m, N]."""


DriftRow = tuple[Real, Real, Real, Real, Real, Real, Real, Real, Real, Real, Real, Real, Real, Real, Real]


@record
class Drift:
    """Mean drift force of waves that the other forces on a hull do not contain, in the hull's heading.

    It is a polynomial of the hull's slow velocity through the water, times angular frequency over gravity.
    """

    step: Positive
    """Step between frequencies, of which the first is 0 [rad/s]."""
    forces: Annotated[tuple[Annotated[tuple[DriftRow, ...], Field(max_length=360)], ...], Field(max_length=1001), TIED]
    """Surge and sway force and yaw moment by frequency and by angle toward which waves travel, even over the circle
    from the bow on, per metre squared of amplitude [N/m2, N/m]: at rest, then coefficients of the velocity ahead, of
    its square, of that to the left, and of its square."""


ResistancePoint = Annotated[tuple[NonNegative, NonNegative], Parts("speed", "force")]


@record
class Vessel:
    """The model of a hull in profile `marine`; matrices are about the link's origin, body axes."""

    hydrostatics: Flag
    """`physics.tables.MESH` or `MATRIX`."""
    added_mass: SixBySix
    """Added mass [kg, kg m, kg m2]."""
    munk: Flag
    """1: with Munk's moment."""
    damping: SixBySix
    """Linear damping [N s/m, N s, N m s]."""
    damping_quadratic: Six
    """Quadratic damping [N s2/m2, N m s2]."""
    point: Vec3
    """Point whose velocity the quadratic damping acts on [m]."""
    vertices: Annotated[tuple[Vec3, ...], Field(max_length=MOST_TRIANGLES), TIED] = ()
    """Points of the mesh [m]."""
    triangles: Annotated[tuple[tuple[Row, Row, Row], ...], Field(max_length=MOST_TRIANGLES)] = ()
    """Its triangles, counter-clockwise from outside."""
    restoring: Annotated[SixBySix, Unless("is_mesh")] = ((0.0,) * 6,) * 6
    """Stiffness at rest [N/m, N, N m]."""
    displacement: NonNegative = 0.0
    """Mass of the water that the hull displaces at rest [kg]; with a matrix, it floats at `waterline` then."""
    waterline: Annotated[Real, Unless("is_mesh")] = 0.0
    """Height of the water at rest above the link's origin, with a matrix [m]."""
    buoyancy: Vec3
    """Centre of buoyancy at rest, where the water's motion is evaluated [m]; with a matrix, where the weight is
    carried."""
    spread: Annotated[tuple[NonNegative, NonNegative], Parts("along", "across")]
    """Second moments of the waterplane over its area, about its centre, along and across the hull [m2]."""
    strips: Annotated[tuple[Strip, ...], Field(max_length=MOST_STRIPS + MOST_SKEGS)] = left_out(default=())
    """Lateral area by strips, on which the flow across the hull acts, and skegs."""
    resistance: Annotated[tuple[ResistancePoint, ...], Field(max_length=1000)] = left_out(default=())
    """Rising speeds through the water along x of `point`, and resistance there [m/s, N]."""
    memory: Annotated[tuple[Memory, ...], Field(max_length=500)] = left_out(default=())
    """Memory of the waves that it makes."""
    diffraction: Diffraction | None = left_out(default=None)
    """Forces of the waves that it scatters; None: it feels the water's motion with its added mass and memory."""
    drift: Drift | None = left_out(default=None)
    """What its other forces lack of the mean force of waves, in a sea that has any."""

    @property
    def length(self) -> float:
        """Length of a rectangle with the waterplane's second moment along the hull [m]."""
        return math.sqrt(12.0 * self.spread[0])

    @property
    def is_mesh(self) -> bool:
        """Whether pressure on a mesh carries it, not a stiffness."""
        return self.hydrostatics == MESH


@record
class Inertia:
    """Moments and products of inertia about the centre of mass, body axes."""

    xx: Positive
    """Moment of inertia about x [kg m2]."""
    yy: Positive
    """Moment of inertia about y [kg m2]."""
    zz: Positive
    """Moment of inertia about z [kg m2]."""
    xy: Real
    """Product of inertia of x and y, negative for mass at x y > 0 [kg m2]."""
    xz: Real
    """Product of inertia of x and z [kg m2]."""
    yz: Real
    """Product of inertia of y and z [kg m2]."""


@record
class Hull:
    """The hull of a boat, a free body; vectors are in body axes."""

    body: Text
    """Name of the MJCF's body."""
    joint: Text
    """Name of its free joint."""
    density: Annotated[NonNegative, Unless("vessel")]
    """Density of the water [kg/m3]."""
    level: Real
    """Height of the mean water surface for this body above the sea's level [m]."""
    added_mass: Annotated[Six, Unless("vessel")]
    """Added mass and added inertia [kg, kg m2]."""
    drag_linear: Annotated[Six, Unless("vessel")]
    """Linear drag [N s/m, N m s]."""
    drag_quadratic: Annotated[Six, Unless("vessel")]
    """Quadratic drag [N s2/m2, N m s2]."""
    link_com: Vec3
    """Centre of mass of VRX's base link [m]."""
    body_com: Vec3
    """Centre of mass of the MJCF's body [m]."""
    mass: Positive
    """Mass of the MJCF's body [kg]."""
    wind: Annotated[WindForce, Unless("windage")]
    """Wind coefficients along x and y, and about z [N s2/m2, N m s2/m2]."""
    thruster_count: Count
    """Number of its thrusters."""
    profile: ProfileCode
    """Whose list of effects acts: 0 for VRX classic's, 1 for VRX 3's."""
    gravity: Annotated[NonNegative, Unless("vessel")]
    """Gravity that acts on displaced water [m/s2]."""
    station_start: Annotated[Row, RowOf("stations", owned=True)]
    """First of its stations."""
    station_count: Count
    """Number of its stations."""
    thruster_start: Annotated[Row, RowOf("thrusters", owned=True)]
    """First of its thrusters."""
    windage: Windage | None = left_out(default=None)
    """Windage, instead of wind coefficients."""
    vessel: Vessel | None = left_out(default=None)
    """Its model in profile `marine`, instead of stations, added mass and drag."""
    inertia: Inertia | None = left_out(default=None)
    """Moments of inertia of the MJCF's body; None: saved by a version that did not list them."""


@record
class Station:
    """A piece of a hull's float at which the water lifts it."""

    position: Vec3
    """Position of a station on the keel line [m], body axes from the link's origin."""
    radius: NonNegative
    """Radius of the float [m]."""
    length: NonNegative
    """Length of float that a station represents [m]."""


Command = Annotated[float, Field(ge=-1.0, le=1.0)]
"""Share of the largest command, astern below 0."""
ThrustPoint = Annotated[tuple[Command, Real], Parts("command", "thrust")]


QuadrantPoint = Annotated[tuple[Angle, Real, Real], Parts("angle", "thrust", "torque")]


@record
class Propeller:
    """A propeller whose thrust was measured, in profile `marine`."""

    thrust: Annotated[tuple[ThrustPoint, ...], Field(min_length=2, max_length=1000)]
    """Rising commands and their thrust at rest [1, N]."""
    diameter: Positive
    """Diameter [m]."""
    vanishing_speed: Positive | None
    """Speed through the water at which full thrust vanishes [m/s]; None: it never does."""
    time_constant: NonNegative
    """Time constant of thrust at rest [s]."""
    dead_zone: Annotated[float, Field(ge=0.0, lt=1.0)]
    """Largest size of a command that gives no thrust [1]."""
    power: NonNegative
    """Electric power at full thrust at rest [W]."""
    four_quadrant: Annotated[tuple[QuadrantPoint, ...], Field(max_length=721), TIED] = left_out(default=())
    """Rising angles of advance all around, and coefficients C_T* and C_Q* there [degrees, 1, 1]."""

    @property
    def full_ahead(self) -> float:
        """Largest thrust ahead [N]."""
        return max(0.0, *(thrust for _, thrust in self.thrust))

    @property
    def full_astern(self) -> float:
        """Largest thrust astern [N], at most 0."""
        return min(0.0, *(thrust for _, thrust in self.thrust))


SailPoint = Annotated[tuple[Annotated[float, Field(ge=0.0, le=math.pi)], Real, Real], Parts("angle", "lift", "drag")]


@record
class Sail:
    """Aerodynamics of a sail."""

    curve: Annotated[tuple[SailPoint, ...], Field(min_length=2)]
    """Rising angles between the apparent wind and the chord, and coefficients of lift and drag there [rad, 1, 1]."""
    sheet: bool
    """Whether a sheet lets the boom to lee by the angle of the command; else it goes to that angle."""


@record
class Thruster:
    """An engine and its propeller, a rudder or a sail; `position` and `rotation` are those of its hinge in the hull."""

    name: Text
    """Name of its command."""
    hull: Annotated[Row, RowOf("hulls")]
    """Its hull."""
    body: Text
    """Name of the MJCF's body that it pushes."""
    joint: Text | None
    """Name of its hinge; None if it is fixed to the hull."""
    position: Annotated[Vec3, TIED]
    """Place of the hinge [m], hull axes."""
    rotation: Matrix
    """Axes of the engine at zero steering in hull axes."""
    propeller: Vec3
    """Point of application of the force [m], engine axes from the hinge."""
    direction: UnitVector
    """Direction of the force, unit vector, engine axes."""
    body_com: Annotated[Vec3, TIED]
    """Centre of mass of `body` [m], that body's axes."""
    inertia: Annotated[Positive, TIED]
    """Inertia about the hinge [kg m2]."""
    mapping: Annotated[int, Field(ge=0, le=4)]
    """From command to force: linear, generalised logistic, rudder, newtons, or sail."""
    max_command: Annotated[Real, Unless("is_blade")]
    """Maximum command [1]; with commands in newtons in [N]."""
    max_forward: Annotated[NonNegative, Unless("is_blade", "measured")]
    """Maximum force ahead [N]."""
    max_reverse: Annotated[NonPositive, Unless("is_blade", "measured")]
    """Maximum force astern [N], at most 0."""
    timeout: Real
    """Time for which a command holds [s]; without limit unless above 0."""
    max_angle: NonNegative
    """Maximum steering angle to either side [rad]."""
    kp: NonNegative
    """Stiffness of the servo [N m/rad]."""
    kd: NonNegative
    """Damping of the servo [N m s/rad]."""
    effort: NonNegative
    """Maximum torque of the servo [N m]."""
    velocity: NonNegative
    """Maximum rate of the servo [rad/s]."""
    area: Annotated[NonNegative, Unless("is_propeller")]
    """Area of a rudder's blade or a sail [m2]."""
    slope: Annotated[NonNegative, Unless("is_propeller", "sail")]
    """Slope of a rudder's normal force over the sine of its angle of attack [1]."""
    density: Annotated[NonNegative, Unless("is_propeller")]
    """Density of the water at a rudder, or of the air at a sail [kg/m3]."""
    race: Annotated[Index, RowOf("thrusters")]
    """Thruster in whose race a rudder is, or -1."""
    race_area: Annotated[NonNegative, Unless("has_no_race")]
    """Disc area of the propeller whose race a rudder is in [m2]."""
    race_share: Annotated[Share, Unless("has_no_race")]
    """Fraction of the blade in the race [1]."""
    measured: Propeller | None = left_out(default=None)
    """Its propeller in profile `marine`, instead of `mapping`."""
    sail: Sail | None = left_out(default=None)
    """Its sail, where `mapping` is that of one."""

    @property
    def is_blade(self) -> bool:
        """Whether it is a rudder or a sail, which takes an angle alone."""
        return self.mapping in BLADES

    @property
    def is_propeller(self) -> bool:
        """Whether it pushes by itself."""
        return not self.is_blade

    @property
    def has_no_race(self) -> bool:
        """Whether no propeller's race reaches it."""
        return self.race < 0

    @property
    def in_newtons(self) -> bool:
        """Whether a command is the force itself [N]; else it is a share of full power."""
        return self.mapping == NEWTONS

    @property
    def command_limits(self) -> tuple[float, float]:
        """Commands of full thrust astern, at most 0, and ahead: forces [N] or shares."""
        if self.in_newtons:
            return self.max_reverse, self.max_forward
        return -self.max_command, self.max_command


@record
class AutopilotChannel:
    """Mapping of an autopilot's channel to a command."""

    number: Annotated[int, Field(ge=1, le=32)]
    """Number of the channel."""
    command: Text
    """Name of the command."""
    trim: Real | None = None
    """Pulse that commands nothing [us]; None: that of its kind."""
    span: tuple[Real, Real] | None = None
    """Differences of the shortest and the longest pulse from the trim [us]; None: those of its kind."""
    dead_band: NonNegative = 0.0
    """Largest difference from the trim at which a pulse still commands nothing [us]."""


_VoltagePoint = Annotated[tuple[Share, Positive], Parts("charge", "voltage")]


@record
class Battery:
    """Battery of a boat's propellers."""

    capacity: Positive
    """Charge [A h]."""
    voltage: Annotated[tuple[_VoltagePoint, ...], Field(min_length=2, max_length=100)]
    """Remaining fractions of the charge, from 0 to 1, with the voltage at rest [1, V]."""
    resistance: NonNegative
    """Internal resistance [ohm]."""


@record
class Boat:
    """A boat as its fleet has it."""

    name: Name
    """Name of the boat."""
    robot: Text
    """Kind of boat: a name, or the path that the fleet gives."""
    arguments: Mapping[Text, Text] = left_out(default_factory=dict)
    """Arguments of its xacro."""
    description: Description = left_out(default="")
    """URDF of the boat, whose namespace may be another's; empty if it is made of the package's own files alone."""
    thrusters: Text | None
    """Layout of its thrusters: a name, or the path that the fleet gives."""
    components: Text | None
    """Component file that the fleet gives."""
    sensors: tuple[Text, ...] | None
    """Suites or sensors that the fleet gives."""
    engines: Literal["fixed", "hinged"]
    """Whether the engines are bodies on hinges."""
    color: tuple[Share, Share, Share, Share] | None
    """Red, green, blue and alpha of the hull."""
    controller: Text | None = None
    """Controller that the fleet names, as `module:function`."""
    pose: Pose
    """Pose at the start [m, rad]."""
    life: Count = left_out(default=0)
    """Number of boats of that name before it."""
    autopilot: Annotated[tuple[AutopilotChannel, ...], Field(max_length=32)] = left_out(default=())
    """Channels of its autopilot; empty: as usual."""
    battery: Battery | None = left_out(default=None)
    """Its battery."""
    ais: AisClass | None = left_out(default=None)
    """Class of its AIS transponder; None: by its length."""


def boat_label(name: str, robot: str) -> str:
    """A boat's name in tables and pictures, with the kind of boat where the name says another: `wamv (skiff)`."""
    path = PurePath(robot)
    kind = path.parent.name if path.name == "robot.yaml" else path.stem
    return f"{name} ({kind})" if kind and name.startswith("wamv") and "wamv" not in kind else name


@record
class WindCoefficients:
    """Wind coefficients of a boat or an object."""

    model: Text
    """Name of a boat, an object, a kind of robot or a model of objects."""
    link: Text | None = None
    """VRX's link_name: for an object with joints, the link on which the wind acts; by default its own link."""
    coefficients: tuple[Coefficient, Coefficient, Coefficient]
    """Coefficients of the force along x and y and of the torque about z [N s2/m2, N m s2/m2]."""


@record
class Spawn:
    """Defaults of boats that join later."""

    robot: Text = "wamv"
    """Kind of boat."""
    arguments: Mapping[Text, Text] = left_out(default_factory=dict)
    """Arguments of its xacro."""
    thrusters: Text = "T"
    """Layout of its thrusters."""
    sensors: tuple[Text, ...] | None = None
    """Suites or sensors; None: what the robot carries."""
    wind: tuple[WindCoefficients, ...] | None = None
    """Wind coefficients by name, before those of its robot; (): the wind pushes nothing."""
    quirks: tuple[Literal["wind_stale_link"], ...] = ()
    """Defects of VRX's worlds that are kept."""
