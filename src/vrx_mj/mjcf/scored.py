"""The scored boat of a task: what it may touch, and what holds it until the task is ready.

Contact sensors tell what the base link touches, as in VRX, where engines on hinges do not count. A lock is a weld to a
carrier that may heave, roll and pitch; whoever lets the boat go switches the weld off (VRX's riser and pivot joints).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vrx_mj.frames import Pose
from vrx_mj.mjcf.dock_pieces import dock_entry
from vrx_mj.mjcf.placement import PlacedDock, PlacedObject
from vrx_mj.mjcf.templates import render
from vrx_mj.model.tasks import TaskBase

__all__ = ["Lock", "Touch", "lock_of", "touch_sensor", "touches_of"]

WORLD_BODY = "world"
"""The body of all that stands still without one of its own, as MuJoCo calls it."""


@dataclass(frozen=True)
class Touch:
    """Something that the scored boat may touch: its name among the task's rivals, and its body."""

    name: str
    body: str
    tree: bool = False
    """Whether the bodies that hang on it count, too."""


@dataclass(frozen=True)
class Lock:
    """A boat that is held, with its base link, where its carrier starts, and its yaw [rad]."""

    boat: str
    body: str
    position: tuple[float, float, float]
    yaw: float


def touch_sensor(touch: Touch, scored: str) -> str:
    """The element of the sensor of what the base link `scored` touches."""
    return "\n    " + render("touch.xml.j2", touch=touch, scored=scored)


def touches_of(
    boat: str,
    links: Mapping[str, str],
    objects: Sequence[PlacedObject],
    docks: Sequence[PlacedDock],
    *,
    terrain: bool,
) -> list[Touch]:
    """All that can collide with a boat; `links` are the base links of all boats by their names."""
    return [*_things(objects, docks, terrain=terrain), *(Touch(*item) for item in links.items() if item[0] != boat)]


def _things(objects: Sequence[PlacedObject], docks: Sequence[PlacedDock], *, terrain: bool) -> Iterator[Touch]:
    for item in objects:
        if item.config.collisions:
            yield Touch(item.name, f"{item.name}/{item.config.link}")
    for dock in docks:
        yield Touch(dock.name, dock_entry(dock).bodies[0], tree=True)
    if terrain:
        yield Touch("terrain", WORLD_BODY)


def lock_of(task: TaskBase, links: Mapping[str, str], poses: Mapping[str, Pose]) -> Lock | None:
    """What holds a task's boat; None if nothing does."""
    if not task.locked:
        return None
    pose = poses[task.boat]
    return Lock(task.boat, links[task.boat], pose[:3], pose[5])
