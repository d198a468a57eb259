"""Sensors in Gazebo's tags of a URDF: tables of their tags, and what reads them."""

import json
import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

from vrx_mj.config.base import Config
from vrx_mj.config.sensors import SensorConfig
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.urdf.elements import FIELDS, Findings, Node, Rows, Tag, Values, own_name, unused_name
from vrx_mj.formats.urdf.model import Gazebo, Loss, Urdf, chain
from vrx_mj.frames import IDENTITY, ZERO, Pose

_HARD_CODED = ("wamv/", "cora/")
"""Prefixes that VRX's files write whatever the boat's namespace is."""
_USUAL_RATE = 100.0
"""Rate [Hz] of a sensor that Gazebo would read at every step."""

_GENERATION = re.compile(r"^(ignition-gazebo|gz-sim)\d*-")
_STEPS = {"ball_shooter_plugin": 0.001, "BallShooterPlugin": 0.004}
"""Duration [s] of a physics step, for which VRX's launchers push a ball, by plugin."""
_OFFSETS = "rpyOffsets", "xyzOffsets", "rpyOffset", "xyzOffset"
_LABELLED = ("boundingbox_camera", "segmentation_camera")
"""Types of a camera that says what it sees."""
LINK, TOPIC = "bodyName|robot_base_frame", "topicName|topic|odom_topic|cameraName"
FRAME = "frameId|frameName|frame_id|odom_frame|projectile/frame"
"""Tags that all sensor plugins have."""
SENSOR_RATE = Tag("update_rate", 0.0, "Hz", low=0)
PLUGIN_RATE: Mapping[str, Any] = {"path": "updateRateHZ|updateRate"}
_CONFIGS: Mapping[str, type[Config]] = {
    config.model_fields["type"].default: config for config in get_args(get_args(SensorConfig)[0])
}
"""Configurations of sensors by their type."""
TABLES: Mapping[str, Any] = json.loads((Path(__file__).parent / "plugins.json").read_bytes())


def plugin_kind(node: Node) -> str:
    """A plugin's library, without `lib` and `.so`, the same for both names of the newer Gazebo."""
    return library(node.attribute("filename") or "")


def library(filename: str) -> str:
    """The kind of plugin that a `filename` means."""
    name = filename.rpartition("/")[2].removesuffix(".so").removeprefix("lib")
    return _GENERATION.sub("gz-sim-", name)


@dataclass(kw_only=True)
class Scope(Gazebo):
    """One robot whose tags are read, and what was found so far."""

    urdf: Urdf
    findings: Findings

    def warn(self, node: Node, message: str) -> None:
        """Warn that something in the file is not simulated."""
        self.warnings.append(Loss(node.place, node.path, message))

    def warn_plugin(self, plugin: Node) -> None:
        """Warn that a plugin is not simulated."""
        self.warn(plugin, f"the plugin {plugin.attribute('filename') or 'without a filename'} is not simulated")

    def check(self, node: Node | None, rows: Iterable[tuple[Tag, str]]) -> None:
        """Warn once for each message of tags that do not have their defaults; `{}` is the tag's name."""
        if node:
            for message in dict.fromkeys(
                words.format(tag.path) for tag, words in rows if node.value_of(tag) != tag.default
            ):
                self.warn(node, message)

    def link(self, node: Node, tag: str) -> str:
        """The link that a child names, as the file calls it; empty if it names none, or one that is not there."""
        if not node.text(tag):
            node.fault("required, but missing", tag.partition("|")[0])
        return self._reference(node, tag, "link", self.urdf.links)

    def joint(self, node: Node, tag: str) -> str | None:
        """The joint that a child names; None if it names none."""
        return self._reference(node, tag, "joint", self.urdf.joints) or None

    def _reference(self, node: Node, tag: str, kind: str, known: Collection[str]) -> str:
        name, child = node.text(tag), node.child(tag)
        found = self.find(name, known)
        if child and name and not found:
            child.fault(str(UnknownNameError(kind, name, known)))
        return found

    def find(self, name: str, known: Collection[str]) -> str:
        """The link or joint of this name; empty without one.

        It may be in the robot's namespace, where VRX hard-codes another, or the only one in a model in the model.
        """
        nested = [one for one in known if one.endswith(f"::{name}")] if name else []
        renamed = f"{self.urdf.namespace}/{self.local(name, hard_coded=True)}"
        names = (name, f"{self.urdf.namespace}/{name}", renamed, *(nested if len(nested) == 1 else ()))
        return next((one for one in names if one in known), "")

    def pose(self, link: str, node: Node | None = None) -> Pose:
        """Pose of a link, or of a sensor with a `<pose>` in it, in the root link's frame [m, rad]."""
        return chain(
            self.urdf.places.get(link, IDENTITY), node.value_of(Tag("pose", IDENTITY, "m, rad")) if node else IDENTITY
        )

    def local(self, name: str, *, hard_coded: bool = False) -> str:
        """A frame's or link's name without slash in front and namespace, nor one that VRX hard-codes."""
        name = self.urdf.local(name.lstrip("/"))
        for prefix in _HARD_CODED if hard_coded else ():
            name = name.removeprefix(prefix)
        return name

    def stem(self, topic: str, ends: Iterable[str], instead: str) -> str:
        """A topic without the namespace and without the last part that all of its kind have."""
        topic = self.local("/".join(filter(None, topic.split("/"))))
        last = next((end for end in ends if topic.endswith(f"/{end}")), "")
        return (topic.removesuffix(f"/{last}") if last else topic) or instead

    def name(self, node: Node, link: str, own: str) -> str:
        """Name of a sensor: that of its link, or its own name without one and on the root link."""
        wanted = self.local(link).removesuffix("_link") if link and link != self.urdf.root else own
        taken = {sensor.name for sensor in self.sensors}
        wanted = next((name for name in (wanted, own) if name and name not in taken), own or wanted or "sensor")
        found = unused_name(wanted := own_name(wanted, 60), taken)
        if found != wanted:
            self.warn(node, f"duplicate name '{wanted}'; this sensor is renamed to '{found}'")
        return found

    def rate(self, node: Node, tag: Tag) -> float:
        """Readings per second; without a rate, or with 0, Gazebo would read at every step."""
        child = node.child(tag.path)
        rate: float = node.value_of(tag)
        if rate == 0:
            name = child.tag if child else tag.path.rpartition("|")[2]
            self.warn(node, f"has no {name}; {_USUAL_RATE:g} Hz is used, not every step")
        return rate or _USUAL_RATE


_Ignored = tuple[tuple[Tag, str], ...]
"""Tags that are not simulated, and what is said of them."""
LENS: _Ignored = tuple(
    (Tag(f"distortion{key}"), "lens distortion is not simulated") for key in ("K1", "K2", "K3", "T1", "T2")
)
OFFSETS: _Ignored = tuple((Tag(tag, ZERO, "m, rad"), "{} is ignored") for tag in _OFFSETS)


@dataclass(frozen=True)
class Kind:
    """A kind of sensor, as far as kinds differ in what all sensors have: a row of `plugins.json`."""

    name: str
    of: Sequence[str]
    """Plugins that are such a sensor, or types of a `<sensor>`."""
    type: str
    topic: str
    """Topic where the file gives none; `{}` is the sensor's own name."""
    fields: str = ""
    """Table of `FIELDS` with what else is read."""
    ends: Sequence[str] = ()
    """Last parts of topics that are left out."""
    own: str = ""
    """The sensor's own name; empty: as its topic ends."""
    frame: str = ""
    """Frame of its readings where the file gives none; empty: the link."""
    rate: Mapping[str, Any] | None = field(default_factory=lambda: PLUGIN_RATE)
    """Differences of the tag of the rate from that of a `<sensor>`; None without a rate."""
    links: Sequence[str] = ()
    """Links that it is on where the file names none, by its own name and its frame; without any it has to name one."""
    by_link: bool = True
    """Whether it is called as its link is."""
    ignored: Sequence[str] = ()
    """Tags of `OFFSETS` that it has."""
    prefixes: Mapping[str, str] = field(default_factory=dict)
    """Beginnings of Hector's tags, by the sensor's field."""
    plugins: Sequence[str] = ()
    """Plugins in a `<sensor>` that publish its readings."""
    scans: Sequence[str] = ()
    """Plugins that publish a planar scan."""


INSTRUMENTS, SENSORS = (
    {of: Kind(name, **row) for name, row in TABLES[key].items() for of in row["of"]}
    for key in ("instruments", "sensors")
)
"""Plugins that are sensors, and Gazebo's own sensors by their type."""


def _fields(node: Node | None, rows: Rows) -> Values:
    return node.fields(rows) if node else {name: tag.default for name, tag in rows.items()}


def _hector(node: Node, *_: object) -> Values:
    found: Values = {}
    for key, prefix in INSTRUMENTS[plugin_kind(node)].prefixes.items():
        found[key] = {}
        for name, tag in FIELDS["hector"].items():
            path = f"{prefix}{tag.path}" if prefix else f"{tag.path[0].lower()}{tag.path[1:]}"
            several = len(node.text(path).split()) > 1
            value = node.value_of(Tag(path, (tag.default,) * 3 if several else tag.default))
            found[key][name] = value if several else (value,) * 3
    return found


def _plain_imu(node: Node, *_: object) -> Values:
    """Gazebo's own ROS plugin has one noise for everything."""
    noise = {"noise": (node.value_of(FIELDS["noise"]["noise"]),) * 3}
    return {"acceleration": noise, "angular_velocity": noise}


def _shooter(node: Node, _: Node | None, scope: Scope, link: str) -> Values:
    found = node.fields(FIELDS["shooter"])
    if any(found["muzzle"][3:]):
        scope.warn(node, "the angles of the projectile's pose are ignored")
    impulse, muzzle = found["impulse"] * _STEPS[plugin_kind(node)], found["muzzle"][:3]
    return found | {"impulse": impulse, "muzzle": muzzle, "frame": scope.local(link)}


def read_instrument(node: Node, scope: Scope) -> None:
    """A plugin that is a sensor."""
    kind = INSTRUMENTS[plugin_kind(node)]
    instead = kind.topic.format(kind.own or (node.attribute("name") or "").removeprefix("p3d_plugin_"))
    topic = scope.stem(node.text(TOPIC), kind.ends, instead)
    own, link = kind.own or topic.rpartition("/")[2], ""
    frame = scope.local(node.text(FRAME, kind.frame), hard_coded=bool(kind.links))
    if kind.links and not node.text(LINK):
        names = [name.format(own=own, frame=frame, root=scope.urdf.root) for name in kind.links]
        link = next(filter(None, (scope.find(name, scope.urdf.links) for name in names)), "")
        if not link and kind.rate is None:
            scope.warn(node, f"no link named '{names[0]}' to launch from: the root link is used")
        link = link or scope.urdf.root
    link = link or scope.link(node, LINK)
    scope.check(node, [(tag, words) for tag, words in OFFSETS if tag.path in kind.ignored])
    _add(node, None, kind, scope, link, frame, topic, scope.name(node, link if kind.by_link else "", own))


def _add(
    node: Node, plugin: Node | None, kind: Kind, scope: Scope, link: str, frame: str, topic: str, name: str
) -> None:  # fmt: skip
    """Keep a sensor, if its values are valid."""
    own = node.tag == "sensor"
    rate = SENSOR_RATE if own or kind.rate is None else replace(SENSOR_RATE, **kind.rate)
    read = _READERS.get(kind.name)
    values = {
        "type": kind.type,
        "name": name,
        "link": scope.local(link),
        "frame": scope.local(frame or link),
        "pose": scope.pose(link, node if own else None),
        "topic": topic,
        **({"rate": scope.rate(node, rate)} if own or kind.rate else {}),
        **(read(node, plugin, scope, link) if read else node.fields(FIELDS[kind.fields])),
    }
    sensor: Any = None if node.findings.problems else node.config_of(_CONFIGS[kind.type], values)
    if sensor is not None:
        scope.sensors.append(sensor)


def _camera(node: Node, plugin: Node | None, scope: Scope, link: str) -> Values:
    camera = node.child("camera")
    if camera is None:
        node.fault("required, but missing", "camera")
        return {}
    scope.check(plugin, LENS)
    optical = next((end for end in (f"{link}_optical", f"{link}_optical_frame") if end in scope.urdf.links), link)
    frame = plugin.text("frameName", optical) if plugin else optical
    gz_sim = {"info": "vrx3"} if plugin is None else {}
    found = camera.fields(FIELDS["camera"]) | _fields(plugin, FIELDS["camera_plugin"]) | gz_sim
    labels = found["labels"] or node.attribute("type") in _LABELLED
    return found | {"noise": _noise(camera.child("noise"), scope), "frame": scope.local(frame), "labels": labels}


def _lidar(node: Node, plugin: Node | None, scope: Scope, _: str) -> Values:
    ray = node.child("ray|lidar")
    if ray is None or ray.child("scan/horizontal") is None:
        node.fault("required, but missing", "ray / scan / horizontal")
        return {}
    found, reach = ray.fields(FIELDS["lidar"]) | _fields(plugin, FIELDS["lidar_plugin"]), ray.child("range")
    rings, low, high = found["rings"], found["lowest"], found["highest"]
    scan = plugin_kind(plugin) in SENSORS["lidar"].scans if plugin else rings == 1
    if scan and rings > 1:
        scope.warn(node, f"a scan has one ring: the other {rings - 1} are ignored")
    near, far = max(found["near"], found["nearest"]), min(found["far"], found["farthest"])
    if reach and near >= far:
        reach.fault(f"invalid range from {near:g} m to {far:g} m: the nearest return must be below the farthest")
    return {
        "output": "scan" if scan else "points",
        "rings": 1 if scan else rings,
        "samples": max(round(found["samples"] * found["density"]), 1),
        "azimuth": (found["first"], found["last"]),
        "elevation": (0.0, 0.0) if scan else (low, high) if rings > 1 else ((low + high) / 2,) * 2,
        "range": (near, far),
        "resolution": found["resolution"] if scan else 0.0,
        "noise": math.hypot(_noise(ray.child("noise"), scope), found["more_noise"]),
        "sea_returns": found["sea_returns"],
    }


def _gps(node: Node, _: Node | None, scope: Scope, __: str) -> Values:
    """SDF gives its receiver, `navsat` or `gps`, horizontal and vertical noise."""
    found: Values = {}
    for key in ("position", "velocity"):
        body = node.child(f"navsat/{key}_sensing|gps/{key}_sensing")
        across, up = (_noise(body and body.child(way, "noise"), scope) for way in ("horizontal", "vertical"))
        found[key] = {"noise": (across, across, up)}
    return found


def _imu(node: Node, _: Node | None, scope: Scope, __: str) -> Values:
    tags = {"acceleration": "linear_acceleration", "angular_velocity": "angular_velocity"}
    return {key: _errors(node, tag, scope) for key, tag in tags.items()}


def _errors(node: Node, tag: str, scope: Scope) -> Values:
    """SDF's noise of three axes.

    Its bias is drawn once, with a deviation d, and its dynamic bias wanders with a stationary deviation of
    s sqrt(tau / 2). Both are one drift here, with the sum of their variances and the dynamic bias's wander, s.

    Reference: gz-sensors, GaussianNoiseModel.cc: b' = -b / tau + s w.
    """
    axes = [node.child("imu", tag, axis, "noise") for axis in "xyz"]
    rows = [_fields(axis, FIELDS["bias"]) for axis in axes]
    drifts = [row["spread"] ** 2 + 0.5 * row["deviation"] ** 2 * row["time"] for row in rows]
    return {
        "offset": tuple(row["offset"] for row in rows),
        "drift": tuple(math.sqrt(variance) for variance in drifts),
        "drift_frequency": tuple(
            0.5 * row["deviation"] ** 2 / variance if variance else 0.0
            for row, variance in zip(rows, drifts, strict=True)
        ),
        "noise": tuple(_noise(axis, scope) for axis in axes),
    }


def _noise(node: Node | None, scope: Scope) -> float:
    """Standard deviation of a `<noise>`."""
    if node is None or "none" in {node.text("type"), node.attribute("type")}:
        return 0.0
    return node.value("stddev", 0.0, low=0)


_READERS: Mapping[str, Callable[[Node, Node | None, Scope, str], Values]] = {
    "hector_gps": _hector,
    "hector_imu": _hector,
    "plain_imu": _plain_imu,
    "ball_shooter": _shooter,
    "camera": _camera,
    "lidar": _lidar,
    "gps": _gps,
    "imu": _imu,
}
"""Readers of what single kinds have, from a sensor's element, the plugin in it, and the link that it is on."""


def read_sensor(node: Node, link: str, scope: Scope, *, alone: bool = True) -> None:
    """A `<sensor>` on a link, which is as the file calls it; its plugin, if it has one, gives topic and frame.

    It is called as its link if it is `alone` there of its type.
    """
    kind = SENSORS.get(node.attribute("type") or "")
    if kind is None:
        if node.attribute("type") not in TABLES["quiet_sensors"]:
            scope.warn(node, f"sensors of type '{node.attribute('type') or ''}' are not simulated")
        return
    plugin = next((one for one in node.children("plugin") if plugin_kind(one) in kind.plugins), None)
    for one in node.children("plugin"):
        if plugin is None or one.element is not plugin.element:
            scope.warn_plugin(one)
    own = scope.local((node.attribute("name") or "").removesuffix("_sensor"))
    name = scope.name(node, link if alone else "", own)
    topic, frame = (plugin.text(TOPIC), plugin.text(FRAME)) if plugin else ("", node.text("frame_id"))
    topic = scope.stem(topic or node.text("topic"), kind.ends, kind.topic.format(own or name))
    _add(node, plugin, kind, scope, link, frame, topic, name)
