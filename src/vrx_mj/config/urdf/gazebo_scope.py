"""What all readers of Gazebo's tags share: the robot, its names without the namespace, and what is not done."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.config.base import Config
from vrx_mj.config.urdf.elements import Findings, Node
from vrx_mj.config.urdf.model import Pose, Urdf
from vrx_mj.config.urdf.poses import chained, link_pose
from vrx_mj.errors import UnknownNameError

__all__ = ["Scope", "plugin_kind"]

ZERO: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
HARD_CODED = ("wamv/", "cora/")
"""Prefixes that VRX's files write whatever the boat's namespace is."""
USUAL_RATE = 100.0
"""Rate [Hz] of a sensor that Gazebo would read at every step."""

_ODD_CHARACTER = re.compile(r"[^A-Za-z0-9_.-]")
_GENERATION = re.compile(r"^(ignition-gazebo|gz-sim)\d*-")


def plugin_kind(node: Node) -> str:
    """A plugin's library, without `lib` and `.so`, the same for both names of the newer Gazebo."""
    name = (node.attribute("filename") or "").rpartition("/")[2].removesuffix(".so").removeprefix("lib")
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
        for known in (name, f"{self.urdf.namespace}/{name}", self._renamed(name)):
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
        for known in (name, f"{self.urdf.namespace}/{name}", self._renamed(name)):
            if known in self.urdf.joints:
                return known
        if child and name:
            child.fault(str(UnknownNameError("joint", name, self.urdf.joints)))
        return None

    def pose(self, link: str, node: Node | None = None) -> Pose:
        """Of a link, or of a sensor with a `<pose>` in it, in the root link's frame [m, rad]."""
        inside = node.values("pose", "x y z roll pitch yaw", ZERO) if node else ZERO
        return chained(link_pose(self.urdf, link), inside)  # type: ignore[arg-type]

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
        wanted = self.local(link).removesuffix("_link") if link and link != self.urdf.root else own
        taken = {sensor.name for sensor in self.sensors}
        wanted = next((name for name in (wanted, own) if name and name not in taken), own or wanted or "sensor")
        wanted = _ODD_CHARACTER.sub("_", wanted)[:60]
        if wanted not in taken:
            return wanted
        number = next(number for number in range(2, 10_000) if f"{wanted}_{number}" not in taken)
        self.warn(node, f"duplicate name '{wanted}'; this sensor is renamed to '{wanted}_{number}'")
        return f"{wanted}_{number}"

    def rate(self, node: Node, tag: str, default: float = 0.0) -> float:
        """Readings per second; where the file says nothing or 0, Gazebo would read at every step."""
        rate = node.value(tag, default, low=0)
        if rate == 0:
            self.warn(node, f"has no {tag}; it is read at {USUAL_RATE:g} Hz, not at every step")
        return rate or USUAL_RATE

    def add(self, node: Node, model: type[Config], values: Mapping[str, Any]) -> None:
        """Keeps a sensor, if its values are such as there are."""
        if not node.findings.problems:
            sensor = node.configured(model, values)
            if sensor is not None:
                self.sensors.append(sensor)

    def _renamed(self, name: str) -> str:
        """The name with the robot's namespace in place of one that VRX hard-codes."""
        return f"{self.urdf.namespace}/{self.local(name, hard_coded=True)}"
