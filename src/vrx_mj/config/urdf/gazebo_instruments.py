"""Gazebo's plugins that are sensors: satellite, inertial, odometry, the receiver of the beacon, the ball shooter."""

from collections.abc import Mapping
from typing import Any

from vrx_mj.config.sensors import BallShooterConfig, GpsConfig, ImuConfig, P3dConfig, PingerConfig
from vrx_mj.config.urdf.elements import Node
from vrx_mj.config.urdf.gazebo_scope import ZERO, Scope, plugin_kind

__all__ = ["INSTRUMENTS"]

HOUR = 1 / 3600
"""Reciprocal of the drift's time constant [1/s] that Hector's plugins take by default: sensor_model.h."""
STEPS = {"ball_shooter_plugin": 0.001, "BallShooterPlugin": 0.004}
"""Duration [s] of a physics step, for which VRX's launchers push a ball, by plugin."""
SHOT_FORCE = 250.0
"""Force [N] of a launcher that says nothing."""

Values = dict[str, Any]


def _gps(node: Node, scope: Scope) -> None:
    values = _on_link(node, scope, "gps", "sensors/gps/gps", "fix")
    position, velocity = _hector(node, ""), _hector(node, "velocity")
    scope.add(node, GpsConfig, values | {"position": position, "velocity": velocity})


def _imu(node: Node, scope: Scope) -> None:
    values = _on_link(node, scope, "imu", "sensors/imu/imu", "data")
    if any(node.values("rpyOffsets", "roll pitch yaw", (0.0, 0.0, 0.0))):
        scope.warn(node, "rpyOffsets is ignored")
    errors = {"acceleration": _hector(node, "accel"), "angular_velocity": _hector(node, "rate")}
    scope.add(node, ImuConfig, values | errors | {"heading": _hector(node, "yaw"), "tilt": _hector(node, "tilt")})


def _plain_imu(node: Node, scope: Scope) -> None:
    """Gazebo's own ROS plugin, with one noise for everything."""
    values = _on_link(node, scope, "imu", "sensors/imu/imu", "data")
    noise = {"noise": (node.value("gaussianNoise", 0.0, low=0),) * 3}
    scope.add(node, ImuConfig, values | {"acceleration": noise, "angular_velocity": noise})


def _on_link(node: Node, scope: Scope, own: str, stem: str, end: str) -> Values:
    """What the sensors of a link have in common."""
    link = scope.link(node, "bodyName")
    if not link:
        return {}
    frame = node.text("frameId") or node.text("frameName") or link
    return {
        "name": scope.name(node, link, own),
        "link": scope.local(link),
        "frame": scope.local(frame),
        "pose": scope.pose(link),
        "topic": scope.stem(node.text("topicName"), end, instead=stem),
        "rate": scope.rate(node, "updateRateHZ" if node.child("updateRateHZ") else "updateRate"),
    }


def _hector(node: Node, prefix: str) -> Mapping[str, tuple[float, ...]]:
    """The error model of Hector's plugins: tags such as accelGaussianNoise, each of one number or three."""
    keys = {
        "offset": ("Offset", 0.0),
        "drift": ("Drift", 0.0),
        "drift_frequency": ("DriftFrequency", HOUR),
        "noise": ("GaussianNoise", 0.0),
    }
    return {key: _three(node, _tag(prefix, word), default) for key, (word, default) in keys.items()}


def _tag(prefix: str, word: str) -> str:
    return f"{prefix}{word}" if prefix else f"{word[0].lower()}{word[1:]}"


def _three(node: Node, tag: str, default: float) -> tuple[float, ...]:
    if len(node.text(tag).split()) <= 1:
        return (node.value(tag, default),) * 3
    return node.values(tag, "x y z", (default,) * 3)


def _p3d(node: Node, scope: Scope) -> None:
    link, topic = scope.link(node, "bodyName"), node.text("topicName")
    for tag in ("xyzOffset", "rpyOffset", "xyzOffsets", "rpyOffsets"):
        if any(node.values(tag, "x y z", (0.0, 0.0, 0.0))):
            scope.warn(node, f"{tag} is ignored")
    own = topic.rpartition("/")[2] or (node.attribute("name") or "").removeprefix("p3d_plugin_")
    values = {
        "name": scope.name(node, "", own),
        "link": scope.local(link),
        "frame": scope.local(node.text("frameName", "map")),
        "pose": scope.pose(link),
        "topic": scope.stem(topic, instead=f"sensors/position/{own}"),
        "rate": scope.rate(node, "updateRate"),
        "noise": node.value("gaussianNoise", 0.0, low=0),
    }
    scope.add(node, P3dConfig, values)


def _odometry(node: Node, scope: Scope) -> None:
    """The newer Gazebo's odometry; VRX passes it on under a fixed name."""
    link = scope.link(node, "robot_base_frame") if node.text("robot_base_frame") else scope.urdf.root
    own = "ground_truth_odometry"
    values = {
        "name": scope.name(node, "", own),
        "link": scope.local(link),
        "frame": scope.local(node.text("odom_frame", "odom")),
        "pose": scope.pose(link),
        "topic": scope.stem(node.text("odom_topic"), instead=f"sensors/position/{own}"),
        "rate": scope.rate(node, "odom_publish_frequency", 50.0),
        "noise": node.value("gaussian_noise", 0.0, low=0),
    }
    scope.add(node, P3dConfig, values)


def _pinger(node: Node, scope: Scope) -> None:
    """A receiver, which the plugin does not tie to a link: it is on the one that its topic is named after."""
    topic = node.text("topicName") or node.text("topic")
    stem = scope.stem(topic, "range_bearing", instead="sensors/pingers/pinger")
    own = stem.rpartition("/")[2]
    frame = scope.local(node.text("frameId") or node.text("frame_id") or "pinger", hard_coded=True)
    link = _first_link(scope, own, f"{own}_link", frame)
    values = {
        "name": scope.name(node, link or "", own),
        "link": scope.local(link or scope.urdf.root),
        "frame": frame,
        "pose": scope.pose(link) if link else ZERO,
        "topic": stem,
        "rate": scope.rate(node, "updateRate" if node.child("updateRate") else "update_rate", 1.0),
        "range_noise": _stddev(node, "rangeNoise", "range_noise"),
        "bearing_noise": _stddev(node, "bearingNoise", "bearing_noise"),
        "elevation_noise": _stddev(node, "elevationNoise", "elevation_noise"),
    }
    scope.add(node, PingerConfig, values)


def _stddev(node: Node, *tags: str) -> float:
    noise = next(filter(None, (node.child(tag, "noise") for tag in tags)), None)
    return noise.value("stddev", 0.0, low=0) if noise else 0.0


def _shooter(node: Node, scope: Scope) -> None:
    """A launcher: by its topic's name, because VRX's files give every one the frame of the boat `wamv`."""
    projectile = node.child("projectile")
    stem = scope.stem(node.text("topic"), "fire", instead="shooters/ball_shooter")
    own = stem.rpartition("/")[2]
    frame = scope.local(projectile.text("frame") if projectile else "", hard_coded=True)
    link = _first_link(scope, f"{own}_launcher_link", frame)
    if link is None:
        scope.warn(node, f"no link named '{own}_launcher_link' to launch from; the root link is used")
    muzzle = projectile.values("pose", "x y z roll pitch yaw", ZERO) if projectile else ZERO
    if any(muzzle[3:]):
        scope.warn(node, "the angles of the projectile's pose are ignored")
    values = {
        "name": scope.name(node, "", own),
        "link": scope.local(link or scope.urdf.root),
        "frame": scope.local(link or scope.urdf.root),
        "pose": scope.pose(link or scope.urdf.root),
        "topic": stem,
        "shots": round(node.value("num_shots", 1000.0, low=0, high=1000)),
        "impulse": node.value("shot_force", SHOT_FORCE, low=0) * STEPS[plugin_kind(node)],
        "muzzle": muzzle[:3],
    }
    scope.add(node, BallShooterConfig, values)


def _first_link(scope: Scope, *names: str) -> str | None:
    """The first of these links that the robot has, with or without the namespace."""
    prefix = f"{scope.urdf.namespace}/" if scope.urdf.namespace else ""
    return next((f"{start}{name}" for name in names for start in (prefix, "")
                 if f"{start}{name}" in scope.urdf.links), None)  # fmt: skip


INSTRUMENTS = {
    "hector_gazebo_ros_gps": _gps,
    "hector_gazebo_ros_imu": _imu,
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
