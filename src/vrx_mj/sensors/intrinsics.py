"""A pinhole camera's numbers: those that VRX's cameras publish, and the frustum that OpenGL draws."""

import math

from vrx_mj.config.sensors import CameraConfig
from vrx_mj.sensors.readings import CameraInfo

__all__ = ["focal_length", "half_heights", "intrinsics"]


def focal_length(config: CameraConfig) -> float:
    """Focal length [pixels], equal along both axes."""
    return config.width / (2.0 * math.tan(config.horizontal_fov / 2.0))


def intrinsics(config: CameraConfig) -> CameraInfo:
    """What the camera says of itself, as gazebo_ros's camera plugin computes it.

    Its principal point is (width + 1) / 2, (height + 1) / 2, which counts pixels from 1: with rows and columns from 0
    the axis of view passes through ((width - 1) / 2, (height - 1) / 2), which `info: centered` gives. P[3] is -f times
    the plugin's `hackBaseline`, on left and right cameras alike.
    """
    f = focal_length(config)
    first = 0.0 if config.info == "centered" else 1.0  # number of the first row and column
    cx, cy = first + (config.width - 1) / 2.0, first + (config.height - 1) / 2.0
    return CameraInfo(
        width=config.width,
        height=config.height,
        K=(f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0),
        R=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        P=(f, 0.0, cx, -f * config.baseline, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0),
    )


def half_heights(config: CameraConfig) -> tuple[float, float]:
    """Half the width and half the height of the view at distance 1."""
    half = math.tan(config.horizontal_fov / 2.0)
    return half, half * config.height / config.width
