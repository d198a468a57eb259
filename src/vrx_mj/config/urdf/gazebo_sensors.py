"""Gazebo's `<sensor>` elements: cameras, lidars, and the satellite receivers and inertial units of newer Gazebo."""

import math

from vrx_mj.config.sensors import CameraConfig, GpsConfig, ImuConfig, LidarConfig
from vrx_mj.config.urdf.elements import Node
from vrx_mj.config.urdf.gazebo_scope import Scope, plugin_kind

__all__ = ["QUIET_SENSORS", "SENSORS", "read_sensor"]

QUIET_SENSORS = ("contact", "force_torque")
"""What VRX measures for its scores, or for nothing; contacts are found without them."""

SCANS = ("gazebo_ros_laser", "gazebo_ros_gpu_laser", "gazebo_ros_head_hokuyo")
POINTS = ("gazebo_ros_velodyne_laser", "gazebo_ros_velodyne_gpu_laser", "gazebo_ros_block_laser")
DISTORTION = ("distortionK1", "distortionK2", "distortionK3", "distortionT1", "distortionT2")
FOV, WIDTH, HEIGHT, NEAR, FAR = 1.047, 320.0, 240.0, 0.1, 100.0
"""SDF's values for what a camera leaves out."""


def read_sensor(node: Node, link: str, scope: Scope) -> None:
    """A `<sensor>` on a link, which is as the file calls it."""
    kind = node.attribute("type") or ""
    if kind in SENSORS:
        SENSORS[kind](node, link, scope)
    elif kind not in QUIET_SENSORS:
        scope.warn(node, f"sensors of type '{kind}' are not simulated")


def _camera(node: Node, link: str, scope: Scope) -> None:
    camera, plugin = node.child("camera"), _plugin(node, scope, "gazebo_ros_camera")
    if camera is None:
        node.fault("required, but missing", "camera")
        return
    if plugin and any(plugin.value(tag, 0.0) for tag in DISTORTION):
        scope.warn(plugin, "lens distortion is not simulated")
    image, clip = camera.child("image"), camera.child("clip")
    name = scope.name(node, link, _own(node, scope))
    frame = plugin.text("frameName") if plugin else ""
    optical = next((end for end in (f"{link}_optical", f"{link}_optical_frame") if end in scope.urdf.links), link)
    values = {
        "name": name,
        "link": scope.local(link),
        "frame": scope.local(frame or optical),
        "pose": scope.pose(link, node),
        "topic": scope.stem(plugin.text("cameraName") if plugin else node.text("topic"), "image_raw",
                            instead=f"sensors/cameras/{_own(node, scope) or name}"),
        "rate": scope.rate(node, "update_rate"),
        "width": _whole(image, "width", WIDTH),
        "height": _whole(image, "height", HEIGHT),
        "horizontal_fov": camera.value("horizontal_fov", FOV, above=0),
        "near": clip.value("near", NEAR, above=0) if clip else NEAR,
        "far": clip.value("far", FAR, above=0) if clip else FAR,
        "noise": _noise(camera.child("noise"), scope),
        "baseline": plugin.value("hackBaseline", 0.0) if plugin else 0.0,
        "info": (plugin.text("info") if plugin else "") or "vrx",
    }  # fmt: skip
    scope.add(node, CameraConfig, values)


def _lidar(node: Node, link: str, scope: Scope) -> None:
    ray, plugin = node.child("ray") or node.child("lidar"), _plugin(node, scope, *SCANS, *POINTS)
    across = ray.child("scan", "horizontal") if ray else None
    if ray is None or across is None:
        node.fault("required, but missing", "ray / scan / horizontal")
        return
    up, reach = ray.child("scan", "vertical"), ray.child("range")
    rings = _whole(up, "samples", 1.0)
    scan = plugin_kind(plugin) in SCANS if plugin else rings == 1
    if scan and rings > 1:
        scope.warn(node, f"a scan has one ring; the other {rings - 1} are ignored")
    name = scope.name(node, link, _own(node, scope))
    values = {
        "name": name,
        "link": scope.local(link),
        "frame": scope.local((plugin.text("frameName") if plugin else "") or link),
        "pose": scope.pose(link, node),
        "topic": scope.stem(plugin.text("topicName") if plugin else node.text("topic"), "points", "scan",
                            instead=f"sensors/lidars/{_own(node, scope) or name}"),
        "output": "scan" if scan else "points",
        "rate": scope.rate(node, "update_rate"),
        "rings": 1 if scan else rings,
        "samples": max(round(across.value("samples", 640.0, low=1) * across.value("resolution", 1.0, above=0)), 1),
        "azimuth": (across.value("min_angle", 0.0), across.value("max_angle", 0.0)),
        "elevation": _elevation(up) if up and not scan else (0.0, 0.0),
        "range": _range(reach, plugin),
        "resolution": reach.value("resolution", 0.0, low=0) if reach and scan else 0.0,
        "noise": math.hypot(_noise(ray.child("noise"), scope), plugin.value("gaussianNoise", 0.0) if plugin else 0.0),
        "sea_returns": plugin.flag("sea_returns", False) if plugin else False,
    }  # fmt: skip
    scope.add(node, LidarConfig, values)


def _elevation(up: Node) -> tuple[float, float]:
    """Lowest and highest ring [rad]; a single one looks along the middle."""
    low, high = up.value("min_angle", 0.0), up.value("max_angle", 0.0)
    return (low, high) if _whole(up, "samples", 1.0) > 1 else ((low + high) / 2, (low + high) / 2)


def _range(reach: Node | None, plugin: Node | None) -> tuple[float, float]:
    """Nearest and farthest return [m]: of the sensor, narrowed by its plugin."""
    near, far = (reach.value("min", 0.0, low=0), reach.value("max", 100.0, above=0)) if reach else (0.0, 100.0)
    if plugin:
        near, far = max(near, plugin.value("min_range", near)), min(far, plugin.value("max_range", far))
    if reach and near >= far:
        reach.fault(f"invalid range from {near:g} m to {far:g} m: the nearest return must be below the farthest")
    return near, far


def _gps(node: Node, link: str, scope: Scope) -> None:
    """Gazebo's own receiver, `navsat` or `gps`; SDF gives it horizontal and vertical noise."""
    plugin = _plugin(node, scope, "gazebo_ros_gps_sensor")
    body = node.child("navsat") or node.child("gps")
    values = {
        "name": scope.name(node, link, _own(node, scope)),
        "link": scope.local(link),
        "frame": scope.local(link),
        "pose": scope.pose(link, node),
        "topic": scope.stem(node.text("topic"), "fix", "navsat", instead="sensors/gps/gps"),
        "rate": scope.rate(node, "update_rate"),
        "position": {"noise": _sensing(body, "position_sensing", scope)},
        "velocity": {"noise": _sensing(body, "velocity_sensing", scope)},
    }
    del plugin
    scope.add(node, GpsConfig, values)


def _sensing(body: Node | None, tag: str, scope: Scope) -> tuple[float, float, float]:
    sensing = body.child(tag) if body else None
    across, up = (_noise(sensing.child(way, "noise") if sensing else None, scope) for way in ("horizontal", "vertical"))
    return (across, across, up)


def _imu(node: Node, link: str, scope: Scope) -> None:
    """Gazebo's own inertial unit, with or without the ROS plugin."""
    plugin = _plugin(node, scope, "gazebo_ros_imu_sensor")
    imu = node.child("imu")
    values = {
        "name": scope.name(node, link, _own(node, scope)),
        "link": scope.local(link),
        "frame": scope.local((plugin.text("frameName") if plugin else "") or link),
        "pose": scope.pose(link, node),
        "topic": scope.stem(plugin.text("topicName") if plugin else node.text("topic"), "data", "imu",
                            instead="sensors/imu/imu"),
        "rate": scope.rate(node, "update_rate"),
        "acceleration": _errors(imu, "linear_acceleration", scope),
        "angular_velocity": _errors(imu, "angular_velocity", scope),
    }  # fmt: skip
    scope.add(node, ImuConfig, values)


def _errors(imu: Node | None, tag: str, scope: Scope) -> dict[str, tuple[float, ...]]:
    """SDF's noise of three axes; its dynamic bias wanders with a stationary deviation of s sqrt(tau / 2).

    Reference: gz-sensors, GaussianNoiseModel.cc: b' = -b / tau + s w.
    """
    axes = [imu.child(tag, axis, "noise") if imu else None for axis in "xyz"]
    offset, drift, frequency, noise = [], [], [], []
    for axis in axes:
        time = axis.value("dynamic_bias_correlation_time", 0.0, low=0) if axis else 0.0
        offset.append(axis.value("bias_mean", 0.0) if axis else 0.0)
        drift.append(axis.value("dynamic_bias_stddev", 0.0, low=0) * math.sqrt(time / 2) if axis else 0.0)
        frequency.append(1 / time if time > 0 else 0.0)
        noise.append(_noise(axis, scope))
    if any(axis and axis.value("bias_stddev", 0.0) for axis in axes) and imu:
        scope.warn(imu, f"the bias of its {tag} is bias_mean; it is not drawn anew for each run")
    return {"offset": tuple(offset), "drift": tuple(drift), "drift_frequency": tuple(frequency), "noise": tuple(noise)}


def _noise(node: Node | None, scope: Scope) -> float:
    """Standard deviation of a `<noise>`."""
    if node is None or "none" in {node.text("type"), node.attribute("type")}:
        return 0.0
    if node.value("mean", 0.0):
        scope.warn(node, "a mean other than 0 is ignored")
    return node.value("stddev", 0.0, low=0)


def _plugin(node: Node, scope: Scope, *kinds: str) -> Node | None:
    """The plugin that publishes a sensor's readings, if it is one of these; others are not simulated."""
    found = None
    for plugin in node.children("plugin"):
        if plugin_kind(plugin) in kinds and found is None:
            found = plugin
        else:
            scope.warn(plugin, f"the plugin {plugin.attribute('filename') or 'without a filename'} is not simulated")
    return found


def _own(node: Node, scope: Scope) -> str:
    """A sensor's own name, without the namespace and what VRX adds to it."""
    return scope.local((node.attribute("name") or "").removesuffix("_sensor"))


def _whole(node: Node | None, tag: str, default: float) -> int:
    """A count, which xacro may write as 1875.0."""
    return round(node.value(tag, default, low=1)) if node else round(default)


SENSORS = {
    "camera": _camera,
    "ray": _lidar,
    "gpu_ray": _lidar,
    "lidar": _lidar,
    "gpu_lidar": _lidar,
    "gps": _gps,
    "navsat": _gps,
    "imu": _imu,
}
"""Readers by the type of sensor."""
