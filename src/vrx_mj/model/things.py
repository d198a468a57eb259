"""Parts of a compiled world besides boats and water: floating and fixed objects, docks, signs, shore, georeference."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.frames import Geodetic
from vrx_mj.model.kinds import (
    Count,
    Degrees,
    Flag,
    Index,
    Latitude,
    Longitude,
    Matrix,
    NonNegative,
    Pose,
    Positive,
    ProfileCode,
    Real,
    Row,
    RowOf,
    Share,
    Six,
    Text,
    UnitVector,
    Vec2,
    Vec3,
    WindForce,
    left_out,
    record,
)


@record
class Float:
    """A floating object, a free body; or a link of an object that has joints."""

    body: Text
    """Name of the MJCF's body."""
    mass: Positive
    """Mass [kg]."""
    com: Vec3
    """Centre of mass [m], body axes from the link's origin."""
    inertia: Six
    """xx, yy, zz, xy, xz, yz [kg m2] about the centre of mass, body axes."""
    density: NonNegative
    """Density of the water [kg/m3]."""
    gravity: NonNegative
    """Gravity [m/s2]."""
    level: Real
    """Height of the mean water surface for this body above the sea's level [m]."""
    linear_drag: NonNegative
    """Drag over mass and velocity [1/s]."""
    angular_drag: NonNegative
    """Drag torque over mass, squared size and angular velocity [1/s]."""
    profile: ProfileCode
    """Whose list of effects acts: 0 for VRX classic's, 1 for VRX 3's."""
    wind: WindForce
    """Wind coefficients along x and y, and about z [N s2/m2, N m s2/m2]."""
    element_start: Annotated[Row, RowOf("elements", owned=True)]
    """First of its elements."""
    element_count: Count
    """Number of its elements."""
    follower: Annotated[Index, RowOf("followers", owned=True)] = left_out(default=-1)
    """Row of the follower that drives it along a path, or -1."""


@record
class Element:
    """A shape that displaces water."""

    shape: Annotated[int, Field(ge=0, le=2)]
    """0: box; 1: sphere; 2: cylinder with axis z."""
    size: tuple[NonNegative, NonNegative, NonNegative]
    """Edges [m] of a box; radius, 0, 0 of a sphere; radius, length, 0 of a cylinder."""
    position: Vec3
    """Place of the centre [m], body axes from the link's origin."""
    rotation: Matrix
    """Its axes in body axes."""
    volume: NonNegative
    """Volume of the whole shape [m3]."""
    mean_dimension: NonNegative
    """Mean of the extents along x, y, z [m]."""


@record
class Block:
    """A block of a floating dock, a root or on a hinge of one that comes before."""

    body: Text
    """Name of the MJCF's body."""
    parent: Annotated[Index, RowOf("blocks")]
    """Row of the block that it hangs on, or -1 for a root."""
    depth: Annotated[int, Field(ge=0, le=10_000)]
    """Number of hinges between it and its root."""
    position: Vec3
    """Place of its frame in that of the one it hangs on [m]."""
    anchor: Vec3
    """Place of the hinge [m], body axes."""
    axis: UnitVector
    """Axis of the hinge, unit vector, body axes."""
    offset: Vec3
    """Place of its middle [m], body axes."""
    mass: Positive
    """Mass [kg]."""
    density: NonNegative
    """Density of the water [kg/m3]."""
    gravity: NonNegative
    """Gravity [m/s2]."""
    level: Real
    """Height of the mean water surface for this body above the sea's level [m]."""
    linear_drag: NonNegative
    """Drag over mass and velocity [1/s]."""
    angular_drag: NonNegative
    """Drag torque over mass, squared size and angular velocity [1/s]."""
    element_start: Annotated[Row, RowOf("elements", owned=True)]
    """First of its elements."""
    element_count: Count
    """Number of its elements."""
    wind: WindForce
    """Wind coefficients along x and y, and about z [N s2/m2, N m s2/m2]."""


@record
class Mooring:
    """A line that holds a block."""

    block: Annotated[Row, RowOf("blocks")]
    """Row of the block."""
    point: Vec3
    """Point of the block that the line holds [m], body axes."""
    anchor: Vec2
    """Place of that point at rest, x and y [m]."""
    stiffness: NonNegative
    """Stiffness of one line [N/m]."""
    damping: NonNegative
    """Damping of one line [N s/m]."""


@record
class Rope:
    """A line that holds a floating object."""

    float: Annotated[Row, RowOf("floats")]
    """Row of the floating object."""
    anchor: Vec2
    """Place of the anchor, x and y [m]."""
    length: NonNegative
    """Horizontal distance up to which it is slack [m]."""
    stiffness: NonNegative
    """Stiffness [N/m]."""
    damping: NonNegative
    """Damping [N s/m]."""


@record
class Follower:
    """Controller that drives a floating object along a path."""

    force: NonNegative
    """Force that propels it along its x axis [N]."""
    torque: NonNegative
    """Torque that turns it toward its waypoint [N m]."""
    tolerance: NonNegative
    """Bearing beyond which it turns [rad]."""
    reach: NonNegative
    """Distance at which a waypoint is reached [m]."""
    turns_first: Flag
    """1: it pushes only within the tolerance."""
    loop: Flag
    """1: from the last waypoint it goes on to the first."""
    waypoint_start: Annotated[Row, RowOf("path_points", owned=True)]
    """First of its waypoints."""
    waypoint_count: Annotated[int, Field(ge=1, le=1_000_000)]
    """Number of its waypoints."""


@record
class PathPoint:
    """A waypoint of a follower."""

    position: Vec2
    """Place, x and y [m]."""


Ring = Annotated[tuple[tuple[Real, Real], ...], Field(min_length=3, max_length=100_000)]
"""Corners [x, y] of a shoreline [m], not closed, the land on the left."""


@record
class Object:
    """An object, as others than the loop see it."""

    name: Text
    """Name of the object."""
    model: Text
    """Its model in the catalogue."""
    kind: Literal["static", "floating"]
    """Whether it moves."""
    body: Text
    """Name of the MJCF's body."""
    pose: Pose
    """Pose at the start [m, rad]."""
    links: tuple[Text, ...] = left_out(default=())
    """Names of the MJCF's bodies that hang on that one by joints, each after the one that it hangs on."""


@record
class Dock:
    """A dock, as others than the loop see it."""

    name: Text
    """Name of the dock."""
    pose: Pose
    """Pose at the start [m, rad]."""
    cells: Annotated[tuple[tuple[int, int], ...], Field(min_length=1, max_length=100_000)]
    """Row and column of each block in its drawing."""
    block: Positive
    """Edge of a block [m]."""
    dynamic: bool
    """Whether it floats."""
    bodies: Annotated[tuple[Text, ...], Field(min_length=1)]
    """Names of the MJCF's bodies that move on their own, the root first."""
    placards: tuple[Text, ...]
    """Names of the bodies of its placards."""


@record
class Light:
    """A light buoy's panels."""

    name: Text
    """Name of the object."""
    body: Text
    """Name of the MJCF's body."""
    geoms: tuple[Text, ...]
    """Names of the geoms that are the panels."""
    pattern: tuple[Text, Text, Text]
    """The colours at the start."""


@record
class Placard:
    """A sign on a dock that shows one of several symbols."""

    name: Text
    """Name of the placard."""
    body: Text
    """Name of the MJCF's body."""
    geoms: Mapping[Text, tuple[Text, ...]]
    """Names of the geoms of each shape."""
    symbol: Text
    """The symbol at the start, as `red_circle`."""


@record
class Marker:
    """A cylinder that only pictures show."""

    position: Vec3
    """Place of its middle [m]."""
    axis: Vec3
    """Axis, unit vector."""
    radius: NonNegative
    """Radius [m]."""
    length: NonNegative
    """Length [m]."""
    color: tuple[Share, Share, Share, Share]
    """Red, green, blue and alpha."""


@record
class Georeference(Geodetic):
    """Geodetic position (WGS84) of the world's origin."""

    latitude: Latitude
    """Latitude [degrees]."""
    longitude: Longitude
    """Longitude [degrees]."""
    elevation: Real
    """Height of the origin above the ellipsoid [m]."""
    heading: Degrees
    """Direction of the world's x axis [degrees], counter-clockwise from east."""


@record
class Scene:
    """Options of renderers and viewers that MJCF cannot hold."""

    fog: bool
    """Whether there is fog."""
    grid: bool
    """Whether the file asks for a grid."""
