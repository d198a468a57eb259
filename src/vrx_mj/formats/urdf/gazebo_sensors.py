"""Sensors in Gazebo's tags of a URDF."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.config.base import Config
from vrx_mj.config.sensors import (
    BallShooterConfig,
    CameraConfig,
    GpsConfig,
    ImuConfig,
    LidarConfig,
    P3dConfig,
    PingerConfig,
)
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.urdf.elements import Findings, Node
from vrx_mj.formats.urdf.model import ZERO, Urdf, chained
from vrx_mj.frames import Pose

HARD_CODED = ("wamv/", "cora/")
"""Prefixes that VRX's files write whatever the boat's namespace is."""
USUAL_RATE = 100.0
"""Rate [Hz] of a sensor that Gazebo would read at every step."""

_ODD_CHARACTER = re.compile(r"[^A-Za-z0-9_.-]")
_GENERATION = re.compile(r"^(ignition-gazebo|gz-sim)\d*-")


def plugin_kind(node: Node) -> str:
    """A plugin's library, without `lib` and `.so`, the same for both names of the newer Gazebo."""
    return library(node.attribute("filename") or "")


def library(filename: str) -> str:
    """The kind of plugin that a `filename` means."""
    name = filename.rpartition("/")[2].removesuffix(".so").removeprefix("lib")
    return _GENERATION.sub("gz-sim-", name)


@dataclass
class Scope:
    """One robot whose tags are read, and what was found so far."""

    urdf: Urdf
    findings: Findings
    warnings: list[str] = field(default_factory=list)
    sensors: list[Any] = field(default_factory=list)

    def warn(self, node: Node, message: str) -> None:
        """Notes that something the file asks for is not done."""
        self.warnings.append(f"{node.place}: {node.path}: {message}")

    def link(self, node: Node, tag: str) -> str:
        """The link that a child names, as the file calls it; empty if it names none, or one that is not there."""
        name, child = node.text(tag), node.child(tag)
        for known in (name, f"{self.urdf.namespace}/{name}", self._renamed(name), _nested(name, self.urdf.links)):
            if known in self.urdf.links:
                return known
        if child and name:
            child.fault(str(UnknownNameError("link", name, self.urdf.links)))
        else:
            node.fault("required, but missing", tag)
        return ""

    def joint(self, node: Node, tag: str) -> str | None:
        """The joint that a child names; None if it names none."""
        name, child = node.text(tag), node.child(tag)
        for known in (name, f"{self.urdf.namespace}/{name}", self._renamed(name), _nested(name, self.urdf.joints)):
            if known in self.urdf.joints:
                return known
        if child and name:
            child.fault(str(UnknownNameError("joint", name, self.urdf.joints)))
        return None

    def pose(self, link: str, node: Node | None = None) -> Pose:
        """Of a link, or of a sensor with a `<pose>` in it, in the root link's frame [m, rad]."""
        inside = node.values("pose", "x y z roll pitch yaw", ZERO) if node else ZERO
        return chained(self.urdf.places.get(link, ZERO), inside)  # type: ignore[arg-type]

    def local(self, name: str, *, hard_coded: bool = False) -> str:
        """A frame's or link's name without slash in front and namespace, nor one that VRX hard-codes."""
        name = self.urdf.local(name.lstrip("/"))
        for prefix in HARD_CODED if hard_coded else ():
            name = name.removeprefix(prefix)
        return name

    def stem(self, topic: str, *ends: str, instead: str) -> str:
        """A topic without the namespace and without the last part that all of its kind have."""
        topic = self.local("/".join(filter(None, topic.split("/"))))
        last = next((end for end in ends if topic.endswith(f"/{end}")), "")
        return (topic.removesuffix(f"/{last}") if last else topic) or instead

    def name(self, node: Node, link: str, own: str = "") -> str:
        """What a sensor is called: as its link, or by its own name on the root link and on a link with several."""
        kinds = [one.get("type") for one in node.element.itersiblings("sensor", preceding=True)]
        kinds += [one.get("type") for one in node.element.itersiblings("sensor")]
        alone = node.attribute("type") not in kinds
        wanted = self.local(link).removesuffix("_link") if link and link != self.urdf.root and alone else own
        taken = {sensor.name for sensor in self.sensors}
        wanted = next((name for name in (wanted, own) if name and name not in taken), own or wanted or "sensor")
        wanted = _ODD_CHARACTER.sub("_", wanted)[:60]
        if wanted not in taken:
            return wanted
        number = next(number for number in range(2, 10_000) if f"{wanted}_{number}" not in taken)
        self.warn(node, f"duplicate name '{wanted}'; this sensor is renamed to '{wanted}_{number}'")
        return f"{wanted}_{number}"

    def rate(self, node: Node, tag: str, default: float = 0.0) -> float:
        """Readings per second; without a rate, or with 0, Gazebo would read at every step."""
        rate = node.value(tag, default, low=0)
        if rate == 0:
            self.warn(node, f"has no {tag}; it is read at {USUAL_RATE:g} Hz, not at every step")
        return rate or USUAL_RATE

    def add(self, node: Node, model: type[Config], values: Mapping[str, object]) -> None:
        """Keeps a sensor, if its values are such as there are."""
        if not node.findings.problems:
            sensor = node.configured(model, {"type": model.model_fields["type"].default, **values})
            if sensor is not None:
                self.sensors.append(sensor)

    def _renamed(self, name: str) -> str:
        """The name with the robot's namespace in place of one that VRX hard-codes."""
        return f"{self.urdf.namespace}/{self.local(name, hard_coded=True)}"


def _nested(name: str, known: Iterable[str]) -> str:
    """The one link or joint of this name in a model in the model; empty without one, or with several."""
    found = [one for one in known if one.endswith(f"::{name}")] if name else []
    return found[0] if len(found) == 1 else ""


HOUR = 1 / 3600
"""Reciprocal of the drift's time constant [1/s] that Hector's plugins take by default: sensor_model.h."""
STEPS = {"ball_shooter_plugin": 0.001, "BallShooterPlugin": 0.004}
"""Duration [s] of a physics step, for which VRX's launchers push a ball, by plugin."""
Values = dict[str, Any]
Rows = Mapping[str, tuple[str, float, dict[str, float]]]
"""Of a sensor's fields: the tag, below others with slashes, its default, and what is allowed."""
POSITIVE, NOT_NEGATIVE, COUNT = {"above": 0.0}, {"low": 0.0}, {"low": 1.0}
NOISE: Rows = {"noise": ("gaussianNoise", 0.0, NOT_NEGATIVE)}
ODOMETRY: Rows = {"noise": ("gaussian_noise", 0.0, NOT_NEGATIVE)}
CAMERA: Rows = {
    "width": ("image/width", 320.0, COUNT),
    "height": ("image/height", 240.0, COUNT),
    "horizontal_fov": ("horizontal_fov", 1.047, POSITIVE),
    "near": ("clip/near", 0.1, POSITIVE),
    "far": ("clip/far", 100.0, POSITIVE),
}
"""SDF's values for what a camera leaves out."""
SHOTS: Rows = {
    "shots": ("num_shots", 1000.0, {"low": 0.0, "high": 1000.0}),
    "impulse": ("shot_force", 250.0, NOT_NEGATIVE),
}
HECTOR = {
    "offset": ("Offset", 0.0),
    "drift": ("Drift", 0.0),
    "drift_frequency": ("DriftFrequency", HOUR),
    "noise": ("GaussianNoise", 0.0),
}
"""The error model of Hector's plugins: tags such as accelGaussianNoise, each of one number or three."""
HECTORS = {
    "gps": {"position": "", "velocity": "velocity"},
    "imu": {"acceleration": "accel", "angular_velocity": "rate", "heading": "yaw", "tilt": "tilt"},
}
"""What Hector's tags begin with, by the sensor and its field."""
IGNORED = {
    "imu": ("rpyOffsets",),
    "p3d": ("xyzOffset", "rpyOffset", "xyzOffsets", "rpyOffsets"),
}
"""Tags of three numbers that are not simulated."""
PINGER = {"range_noise": "rangeNoise", "bearing_noise": "bearingNoise", "elevation_noise": "elevationNoise"}
"""Tags of a receiver's noise in VRX classic; newer VRX calls them as we do."""


def _fields(node: Node, rows: Rows) -> Values:
    """The values of rows in an element."""
    found: Values = {}
    for field_name, (path, default, limits) in rows.items():
        *outer, tag = path.split("/")
        holder = node.child(*outer)
        found[field_name] = holder.value(tag, default, **limits) if holder else default
    return found


def _mounted(
    node: Node, scope: Scope, link: str | None, name: str, frame: str, topic: tuple[str, ...], instead: str,
    rate: tuple[str, float] | None, *, posed: bool = False,
) -> Values:  # fmt: skip
    """What all sensors have in common; `topic` comes with the ends that are left out, `rate` with its default."""
    return {
        "name": name,
        "link": scope.local(link or scope.urdf.root),
        "frame": scope.local(frame),
        "pose": scope.pose(link or "", node if posed else None),
        "topic": scope.stem(*topic, instead=instead),
        **({"rate": scope.rate(node, *rate)} if rate else {}),
    }


def _ignored(node: Node, scope: Scope, kind: str) -> None:
    for tag in IGNORED.get(kind, ()):
        if any(node.values(tag, "x y z", (0.0, 0.0, 0.0))):
            scope.warn(node, f"{tag} is ignored")


def _on_link(node: Node, scope: Scope, own: str, end: str) -> Values:
    """What the sensors of a link have in common."""
    link = scope.link(node, "bodyName")
    if not link:
        return {}
    frame = node.text("frameId") or node.text("frameName") or link
    tag = "updateRateHZ" if node.child("updateRateHZ") else "updateRate"
    topic, name = (node.text("topicName"), end), scope.name(node, link, own)
    return _mounted(node, scope, link, name, frame, topic, f"sensors/{own}/{own}", (tag, 0.0))


def _gps_plugin(node: Node, scope: Scope) -> None:
    values = _on_link(node, scope, "gps", "fix")
    scope.add(node, GpsConfig, values | {key: _hector(node, prefix) for key, prefix in HECTORS["gps"].items()})


def _imu_plugin(node: Node, scope: Scope) -> None:
    values = _on_link(node, scope, "imu", "data")
    _ignored(node, scope, "imu")
    scope.add(node, ImuConfig, values | {key: _hector(node, prefix) for key, prefix in HECTORS["imu"].items()})


def _plain_imu(node: Node, scope: Scope) -> None:
    """Gazebo's own ROS plugin, with one noise for everything."""
    values = _on_link(node, scope, "imu", "data")
    noise = {"noise": (_fields(node, NOISE)["noise"],) * 3}
    scope.add(node, ImuConfig, values | {"acceleration": noise, "angular_velocity": noise})


def _hector(node: Node, prefix: str) -> Mapping[str, tuple[float, ...]]:
    found = {}
    for key, (word, default) in HECTOR.items():
        tag = f"{prefix}{word}" if prefix else f"{word[0].lower()}{word[1:]}"
        several = len(node.text(tag).split()) > 1
        found[key] = node.values(tag, "x y z", (default,) * 3) if several else (node.value(tag, default),) * 3
    return found


def _p3d(node: Node, scope: Scope) -> None:
    link, topic = scope.link(node, "bodyName"), node.text("topicName")
    _ignored(node, scope, "p3d")
    own = topic.rpartition("/")[2] or (node.attribute("name") or "").removeprefix("p3d_plugin_")
    frame, name, instead = node.text("frameName", "map"), scope.name(node, "", own), f"sensors/position/{own}"
    values = _mounted(node, scope, link, name, frame, (topic,), instead, ("updateRate", 0.0))
    scope.add(node, P3dConfig, values | _fields(node, NOISE))


def _odometry(node: Node, scope: Scope) -> None:
    """The newer Gazebo's odometry; VRX passes it on under a fixed name."""
    link = scope.link(node, "robot_base_frame") if node.text("robot_base_frame") else scope.urdf.root
    own = "ground_truth_odometry"
    frame, topic, rate = node.text("odom_frame", "odom"), (node.text("odom_topic"),), ("odom_publish_frequency", 50.0)
    values = _mounted(node, scope, link, scope.name(node, "", own), frame, topic, f"sensors/position/{own}", rate)
    scope.add(node, P3dConfig, values | _fields(node, ODOMETRY))


def _pinger(node: Node, scope: Scope) -> None:
    """A receiver, which the plugin does not tie to a link: it is on the one that its topic is named after."""
    topic = node.text("topicName") or node.text("topic"), "range_bearing"
    own = scope.stem(*topic, instead="sensors/pingers/pinger").rpartition("/")[2]
    frame = scope.local(node.text("frameId") or node.text("frame_id") or "pinger", hard_coded=True)
    link, tag = (
        _first_link(scope, own, f"{own}_link", frame),
        "updateRate" if node.child("updateRate") else "update_rate",
    )
    name = scope.name(node, link or "", own)
    values = _mounted(node, scope, link, name, frame, topic, "sensors/pingers/pinger", (tag, 1.0))
    noises = {key: node.child(tag, "noise") or node.child(key, "noise") for key, tag in PINGER.items()}
    deviations = {key: noise.value("stddev", 0.0, low=0) if noise else 0.0 for key, noise in noises.items()}
    scope.add(node, PingerConfig, values | deviations)


def _shooter(node: Node, scope: Scope) -> None:
    """A launcher: by its topic's name, because VRX's files give every one the frame of the boat `wamv`."""
    projectile, topic = node.child("projectile"), (node.text("topic"), "fire")
    own = scope.stem(*topic, instead="shooters/ball_shooter").rpartition("/")[2]
    frame = scope.local(projectile.text("frame") if projectile else "", hard_coded=True)
    link = _first_link(scope, f"{own}_launcher_link", frame)
    if link is None:
        scope.warn(node, f"no link named '{own}_launcher_link' to launch from; the root link is used")
    muzzle = projectile.values("pose", "x y z roll pitch yaw", ZERO) if projectile else ZERO
    if any(muzzle[3:]):
        scope.warn(node, "the angles of the projectile's pose are ignored")
    found, link = _fields(node, SHOTS), link or scope.urdf.root
    values = _mounted(node, scope, link, scope.name(node, "", own), link, topic, "shooters/ball_shooter", None)
    shots, impulse = round(found["shots"]), found["impulse"] * STEPS[plugin_kind(node)]
    scope.add(node, BallShooterConfig, values | {"shots": shots, "impulse": impulse, "muzzle": muzzle[:3]})


def _first_link(scope: Scope, *names: str) -> str | None:
    """The first of these links that the robot has, with or without the namespace."""
    prefix = f"{scope.urdf.namespace}/" if scope.urdf.namespace else ""
    return next((f"{start}{name}" for name in names for start in (prefix, "")
                 if f"{start}{name}" in scope.urdf.links), None)  # fmt: skip


INSTRUMENTS = {
    "hector_gazebo_ros_gps": _gps_plugin,
    "hector_gazebo_ros_imu": _imu_plugin,
    "gazebo_ros_imu": _plain_imu,
    "gazebo_ros_p3d": _p3d,
    "gz-sim-odometry-publisher-system": _odometry,
    "usv_gazebo_acoustic_pinger_plugin": _pinger,
    "usv_gazebo_pinger_plugin": _pinger,
    "acoustic_pinger_plugin": _pinger,
    "AcousticPingerPlugin": _pinger,
    "ball_shooter_plugin": _shooter,
    "BallShooterPlugin": _shooter,
}
"""Readers by the kind of plugin."""


QUIET_SENSORS = ("contact", "force_torque")
"""What VRX measures for its scores, or for nothing; contacts are found without them."""

SCANS = ("gazebo_ros_laser", "gazebo_ros_gpu_laser", "gazebo_ros_head_hokuyo")
POINTS = ("gazebo_ros_velodyne_laser", "gazebo_ros_velodyne_gpu_laser", "gazebo_ros_block_laser")
DISTORTION = ("distortionK1", "distortionK2", "distortionK3", "distortionT1", "distortionT2")


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
    frame = plugin.text("frameName") if plugin else ""
    optical = next((end for end in (f"{link}_optical", f"{link}_optical_frame") if end in scope.urdf.links), link)
    topic = plugin.text("cameraName") if plugin else node.text("topic")
    values = _of_sensor(node, scope, link, frame or optical, (topic, "image_raw"), "cameras") | _fields(camera, CAMERA)
    values |= {
        "width": round(values["width"]),
        "height": round(values["height"]),
        "noise": _noise(camera.child("noise"), scope),
        "baseline": plugin.value("hackBaseline", 0.0) if plugin else 0.0,
        "info": (plugin.text("info") if plugin else "") or "vrx",
    }
    scope.add(node, CameraConfig, values)


def _of_sensor(
    node: Node, scope: Scope, link: str, frame: str, topic: tuple[str, ...], kind: str, own: str = ""
) -> Values:  # fmt: skip
    """What all `<sensor>`s have in common."""
    name = scope.name(node, link, _own(node, scope))
    instead = f"sensors/{kind}/{own or _own(node, scope) or name}"
    return _mounted(node, scope, link, name, frame, topic, instead, ("update_rate", 0.0), posed=True)


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
    topic = plugin.text("topicName") if plugin else node.text("topic")
    frame = (plugin.text("frameName") if plugin else "") or link
    values = _of_sensor(node, scope, link, frame, (topic, "points", "scan"), "lidars") | {
        "output": "scan" if scan else "points",
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
    _plugin(node, scope, "gazebo_ros_gps_sensor")
    body = node.child("navsat") or node.child("gps")
    topic = node.text("topic"), "fix", "navsat"
    values = _of_sensor(node, scope, link, link, topic, "gps", "gps") | {
        "position": {"noise": _sensing(body, "position_sensing", scope)},
        "velocity": {"noise": _sensing(body, "velocity_sensing", scope)},
    }
    scope.add(node, GpsConfig, values)


def _sensing(body: Node | None, tag: str, scope: Scope) -> tuple[float, float, float]:
    sensing = body.child(tag) if body else None
    across, up = (_noise(sensing.child(way, "noise") if sensing else None, scope) for way in ("horizontal", "vertical"))
    return (across, across, up)


def _imu(node: Node, link: str, scope: Scope) -> None:
    """Gazebo's own inertial unit, with or without the ROS plugin."""
    plugin = _plugin(node, scope, "gazebo_ros_imu_sensor")
    imu = node.child("imu")
    topic = plugin.text("topicName") if plugin else node.text("topic")
    frame = (plugin.text("frameName") if plugin else "") or link
    values = _of_sensor(node, scope, link, frame, (topic, "data", "imu"), "imu", "imu") | {
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
    "rgbd_camera": _camera,
    "gps": _gps,
    "navsat": _gps,
    "imu": _imu,
}
"""Readers by the type of sensor."""
