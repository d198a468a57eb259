"""What a sensor gives: data with their time and frame; and the place and motion of the sensor."""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.frames import matrix_quaternion, quaternion_product, rotation_matrix

_NO_COVARIANCE = (0.0,) * 9
"""Covariance of a reading without errors."""


@dataclass(frozen=True)
class Mount:
    """A frame on a body."""

    position: FloatArray
    """Position of its origin, (3,) [m], body axes from the body's origin."""
    rotation: FloatArray
    """Rotation (3, 3), frame to body."""
    orientation: FloatArray
    """Rotation as a unit quaternion (w, x, y, z)."""

    @staticmethod
    def of(position: Sequence[float], rotation: Sequence[Sequence[float]]) -> "Mount":
        """The frame at a position [m] with a rotation matrix."""
        turn = np.array(rotation, np.float64)
        return Mount(np.array(position, np.float64), turn, matrix_quaternion(turn))

    def at_base(self) -> "Mount":
        """A frame with the same axes at the body's origin."""
        return Mount(np.zeros(3), self.rotation, self.orientation)


class Place(NamedTuple):
    """Pose and velocity of a frame in the world."""

    position: FloatArray
    """Position of its origin, (3,) [m], ENU."""
    rotation: FloatArray
    """Rotation (3, 3), frame to world."""
    orientation: FloatArray
    """Rotation as a unit quaternion (w, x, y, z)."""
    velocity: FloatArray
    """Velocity of its origin, (3,) [m/s], world axes."""
    spin: FloatArray
    """Angular velocity, (3,) [rad/s], world axes."""


def place_of_mount(pose: FloatArray, velocity: FloatArray, mount: Mount) -> Place:
    """Where a mount is and how it moves on a free body.

    Args:
        pose: (7,) of the body as MuJoCo's free joint has it: position [m] and quaternion (w, x, y, z).
        velocity: (6,) likewise: linear [m/s], of the origin in world axes; angular [rad/s], in body axes.
        mount: the frame on that body.
    """
    attitude = pose[3:] / math.sqrt(pose[3:].dot(pose[3:]))
    turn = rotation_matrix(attitude)
    lever, spin = turn @ mount.position, turn @ velocity[3:]
    return Place(
        pose[:3] + lever,
        turn @ mount.rotation,
        quaternion_product(attitude, mount.orientation),
        velocity[:3] + _cross(spin, lever),
        spin,
    )


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    """Vector product (3,); numpy's own takes 50 times as long."""
    (a, b, c), (x, y, z) = one.tolist(), other.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


@dataclass(frozen=True)
class CameraInfo:
    """Intrinsics of a camera, as in ROS's CameraInfo; the lens has no distortion."""

    width: int
    """Width of the picture [pixels]."""
    height: int
    """Height of the picture [pixels]."""
    K: tuple[float, ...]
    """Intrinsic matrix, (9,) row by row [pixels]."""
    R: tuple[float, ...]
    """Rectification matrix, (9,) row by row: the identity."""
    P: tuple[float, ...]
    """Projection matrix, (12,) row by row [pixels]."""
    D: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Distortion coefficients, (5,), all zero."""
    distortion_model: str = "plumb_bob"
    """Name of the distortion model."""


@dataclass(frozen=True)
class Label:
    """An object that a picture shows."""

    name: str
    """Name of the boat, object, dock or placard; `terrain` for the shore."""
    category: str
    """Category of the object, such as `mb_marker_buoy_red`."""
    category_id: int
    """Number of the category, the same in every world."""
    number: int
    """Value of its pixels in the mask, the same in all pictures of a world with the same boats, objects and docks."""
    box: tuple[int, int, int, int]
    """Smallest box around its visible pixels: column and row of its first corner, width and height [pixels]."""
    area: int
    """Number of its visible pixels."""


@dataclass(frozen=True)
class Labels:
    """Labelled objects in a picture."""

    objects: tuple[Label, ...]
    """Visible objects, in the order of their numbers."""
    mask: npt.NDArray[np.uint16]
    """Number of the object that each pixel shows, (height, width); 0: water, sky, or anything without a label."""


@dataclass(frozen=True)
class Image:
    """A picture of a camera, in the optical frame (z forward, x right, y down)."""

    rgb: ByteArray
    """Pixels, (height, width, 3), red, green and blue from 0 to 255."""
    info: CameraInfo
    """Intrinsics of the camera."""
    labels: Labels | None = None
    """Labels of the picture; None unless the camera has `labels: true`."""

    def jpeg(self, quality: int) -> bytes:
        """The picture as a JPEG file of a `quality` up to 100."""
        from PIL import Image as Pillow

        file = io.BytesIO()
        Pillow.fromarray(self.rgb).save(file, "JPEG", quality=quality)
        return file.getvalue()


@dataclass(frozen=True)
class PointCloud:
    """The valid returns of a 3D lidar, in its own frame (x forward, z up)."""

    points: npt.NDArray[np.float32]
    """Positions of the returns, (n, 3) [m]."""
    intensity: npt.NDArray[np.float32]
    """Intensities of the returns, (n,)."""
    ring: npt.NDArray[np.uint16]
    """Ring of each return, (n,), counted from 0, the lowest."""


@dataclass(frozen=True)
class Scan:
    """One sweep of a planar lidar, as in ROS's LaserScan."""

    ranges: npt.NDArray[np.float32]
    """Ranges, (samples,) [m]; inf without a return."""
    angle_min: float
    """Angle of the first ray [rad], counter-clockwise from x."""
    angle_max: float
    """Angle of the last ray [rad]."""
    angle_increment: float
    """Angle between two rays [rad]."""
    range_min: float
    """Least range [m]."""
    range_max: float
    """Greatest range [m]."""


@dataclass(frozen=True)
class Fix:
    """Position and velocity measured by a GPS receiver, on WGS84."""

    latitude: float
    """Latitude [degrees]."""
    longitude: float
    """Longitude [degrees]."""
    altitude: float
    """Altitude above the ellipsoid [m]."""
    velocity: FloatArray
    """Velocity north, west and up, (3,) [m/s], as in VRX."""
    position_covariance: tuple[float, ...]
    """Covariance of the position, (9,) row by row [m2, ENU]."""


@dataclass(frozen=True)
class Inertia:
    """Measurement of an IMU."""

    orientation: FloatArray
    """Orientation, (4,) quaternion (w, x, y, z), sensor to ENU."""
    angular_velocity: FloatArray
    """Angular velocity, (3,) [rad/s], sensor axes."""
    linear_acceleration: FloatArray
    """Linear acceleration, (3,) [m/s2], sensor axes; at rest 9.8 upward."""
    orientation_covariance: tuple[float, ...] = _NO_COVARIANCE
    """Covariance of the orientation, (9,) row by row [rad2]: roll, pitch and yaw; zeros: no errors."""
    angular_velocity_covariance: tuple[float, ...] = _NO_COVARIANCE
    """Covariance of the angular velocity, (9,) row by row [rad2/s2]."""
    linear_acceleration_covariance: tuple[float, ...] = _NO_COVARIANCE
    """Covariance of the linear acceleration, (9,) row by row [m2/s4]."""


@dataclass(frozen=True)
class Truth:
    """True pose and velocity of a link in the world."""

    position: FloatArray
    """Position, (3,) [m, ENU]."""
    orientation: FloatArray
    """Orientation, (4,) quaternion (w, x, y, z), body to ENU."""
    velocity: FloatArray
    """Linear velocity, (3,) [m/s], world axes, as in VRX."""
    angular_velocity: FloatArray
    """Angular velocity, (3,) [rad/s], world axes."""


@dataclass(frozen=True)
class Sound:
    """Range and bearing of an acoustic beacon, as a receiver measures them."""

    range: float
    """Range [m]; it may be negative near the beacon, as in VRX."""
    bearing: float
    """Bearing [rad], counter-clockwise from the bow."""
    elevation: float
    """Elevation [rad], positive up."""


@dataclass(frozen=True)
class Shooter:
    """State of a ball shooter."""

    shots_left: int
    """Number of balls left."""


@dataclass(frozen=True)
class ApparentWind:
    """Wind past a sensor that moves with its boat, in the plane of the sensor's x and y."""

    speed: float
    """Speed [m/s]."""
    angle: float
    """Direction that it comes from [rad], counter-clockwise from the bow, from -pi to pi."""


@dataclass(frozen=True)
class Heading:
    """Measurement of a GNSS compass."""

    heading: float
    """Heading [rad], counter-clockwise from true east, from -pi to pi; `frames.compass` makes a bearing of it."""
    rate_of_turn: float
    """Rate of turn about the vertical [rad/s], positive to port."""
    heading_variance: float = 0.0
    """Variance of the heading [rad2]; 0: no errors."""
    rate_of_turn_variance: float = 0.0
    """Variance of the rate of turn [rad2/s2]."""


@dataclass(frozen=True)
class Echo:
    """Measurement of an echo sounder, as in ROS's Range."""

    range: float
    """Distance from the transducer along its beam [m]; inf without an echo in the range."""
    range_min: float
    """Least range [m]."""
    range_max: float
    """Greatest range [m]."""
    field_of_view: float
    """Width of the beam [rad]."""


@dataclass(frozen=True)
class Reading:
    """The last measurement of a sensor."""

    name: str
    """Name of the sensor."""
    type: str
    """Type of the sensor, a name of `SENSOR_KINDS`, such as camera or gps."""
    time: float
    """Simulated time of the measurement [s]."""
    sequence: int
    """Number of the measurement, from 0 at time 0."""
    frame: str
    """ROS frame of `data`: the boat's name, a slash, and the sensor's own frame."""
    data: Any
    """The measured values: an Image, PointCloud, Scan, Fix, Inertia, Truth, Sound, Shooter, ApparentWind, Heading or
    Echo."""
    mount: Mount | None = field(default=None, repr=False, compare=False)
    """Pose of the sensor's link on the boat, as in ROS's static transforms: x forward and z up for a camera. It is None
    in a reading that comes from a recording."""
