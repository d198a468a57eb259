"""Parts of a compiled world besides boats and water: objects, docks, signs, the shore, and where on Earth it is."""

from collections.abc import Mapping
from dataclasses import field
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.config.values import Latitude, Longitude
from vrx_mj.frames import Geodetic
from vrx_mj.model.kinds import LEFT_OUT, Degrees, NonNegative, Pose, Positive, Real, Share, Text, Vec3, record

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
    links: tuple[Text, ...] = field(default=(), metadata=LEFT_OUT)
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
    """Height above the ellipsoid [m]."""
    heading: Degrees
    """Direction of the world's x axis [degrees], counter-clockwise from east."""


@record
class Scene:
    """Options of renderers and viewers that MJCF cannot hold."""

    fog: bool
    """Whether there is fog."""
    grid: bool
    """Whether the file asks for a grid."""
