"""What a sensor gives: data with the time and the frame that they belong to."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.sensors.places import Mount

__all__ = ["CameraInfo", "Fix", "Image", "Inertia", "PointCloud", "Reading", "Scan", "Shooter", "Sound", "Truth"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class CameraInfo:
    """Intrinsics as ROS's CameraInfo has them; no distortion (plumb_bob, zeros)."""

    width: int
    height: int
    K: tuple[float, ...]
    """(9,) row by row: intrinsic matrix [pixels]."""
    R: tuple[float, ...]
    P: tuple[float, ...]
    """(12,) row by row: projection matrix [pixels]."""
    D: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    distortion_model: str = "plumb_bob"


@dataclass(frozen=True)
class Image:
    """A picture, in the optical frame (z forward, x right, y down)."""

    rgb: npt.NDArray[np.uint8]
    """(height, width, 3)."""
    info: CameraInfo


@dataclass(frozen=True)
class PointCloud:
    """The valid returns of a 3D lidar, in its own frame (x forward, z up)."""

    points: npt.NDArray[np.float32]
    """(n, 3) [m]."""
    intensity: npt.NDArray[np.float32]
    """(n,)."""
    ring: npt.NDArray[np.uint16]
    """(n,): from the lowest ring, 0."""


@dataclass(frozen=True)
class Scan:
    """One turn of a planar lidar, as ROS's LaserScan has it."""

    ranges: npt.NDArray[np.float32]
    """(samples,) [m]; inf where nothing is."""
    angle_min: float
    angle_max: float
    angle_increment: float
    range_min: float
    range_max: float


@dataclass(frozen=True)
class Fix:
    """Where a GPS receiver says it is, on WGS84."""

    latitude: float
    """[degrees]"""
    longitude: float
    """[degrees]"""
    altitude: float
    """[m] above the ellipsoid."""
    velocity: FloatArray
    """(3,) [m/s]: north, west, up, as VRX's."""
    position_covariance: tuple[float, ...]
    """(9,) row by row, ENU [m2]."""


@dataclass(frozen=True)
class Inertia:
    """What an inertial unit measures."""

    orientation: FloatArray
    """(4,) quaternion (w, x, y, z), sensor to ENU."""
    angular_velocity: FloatArray
    """(3,) [rad/s], sensor axes."""
    linear_acceleration: FloatArray
    """(3,) [m/s2], sensor axes: +9.8 up at rest."""


@dataclass(frozen=True)
class Truth:
    """Pose and twist of a link in the world."""

    position: FloatArray
    """(3,) [m], ENU."""
    orientation: FloatArray
    """(4,) quaternion (w, x, y, z), body to ENU."""
    velocity: FloatArray
    """(3,) [m/s], world axes, as VRX's."""
    angular_velocity: FloatArray
    """(3,) [rad/s], world axes."""


@dataclass(frozen=True)
class Sound:
    """An acoustic beacon, as heard."""

    range: float
    """[m]; may be negative near the beacon, as in VRX."""
    bearing: float
    """[rad], counter-clockwise from the bow."""
    elevation: float
    """[rad], positive up."""


@dataclass(frozen=True)
class Shooter:
    """A ball shooter."""

    shots_left: int


@dataclass(frozen=True)
class Reading:
    """What a sensor last measured."""

    name: str
    type: str
    """camera, lidar, gps, imu, p3d, pinger or ball_shooter."""
    time: float
    """When it was measured [s], simulated."""
    sequence: int
    """Number of the measurement, from 0 at time 0."""
    frame: str
    """ROS frame of `data`: the boat's name, a slash, and the sensor's own."""
    data: Any
    """Image, PointCloud, Scan, Fix, Inertia, Truth, Sound or Shooter."""
    mount: Mount | None = field(default=None, repr=False, compare=False)
    """Where the sensor's link is on the boat, as ROS's static transforms tell: of a camera x forward and z up. None in
    what a recording kept."""
