"""What goes wrong for users of VRX, found and named: each thing once."""

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from vrx_mj.ros.topic_names import TopicHints
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.thrusters import Thruster
from vrx_mj.runtime.upsets import FASTEST_SPIN, is_capsized, spin

if TYPE_CHECKING:  # they need the extra ros1, and `vrx-mj doctor` does not
    from vrx_mj.ros.inbox import Command, UnknownTopicPublisher
    from vrx_mj.ros.offer import Table

__all__ = ["Diagnosis", "overlaps", "shared_frames"]

DEEP = 0.05
"""How far two models may stand in each other [m]."""
ALIKE = 4
"""So many commands in a row tell how often they come."""
LOOK_RATE = 1.0
"""How often boats are looked at, per simulated second."""
AGROUND = 2
"""So many looks at which a boat touches land, in a row, tell that it is aground."""
AFLOAT = 10
"""And so many at which it does not, that it is no longer: in waves a boat on the shore comes free now and then."""
THRUST = "_thrust_cmd"
SHOWN = 8
"""Names of boats that a message shows, at most."""


class Diagnosis:
    """Looks at what comes and at how the boats are, and tells what is odd about it."""

    def __init__(self, sim: Simulation, tell: Callable[[str, str], None]) -> None:
        self._sim, self._tell = sim, tell
        self._told: set[str] = set()
        self._times: dict[tuple[str, str], deque[float]] = {}
        self._ashore: dict[str, int] = {}
        self._number = -1
        self._hints = TopicHints()
        self.moved()
        self.changed()
        for line in shared_frames(sim):
            self._once(line, line)

    def changed(self) -> None:
        """Boats came or went: see whether they have receivers that cannot work here."""
        world = self._sim.world
        if world.tree["georeference"] is not None:
            return
        owners = [boat for boat in self._sim.boats if any(one.config.type == "gps" for one in self._sim.mounted(boat))]
        if owners:
            of = ", ".join(owners[:SHOWN]) + (f" and {len(owners) - SHOWN} more" if len(owners) > SHOWN else "")
            text = f"the world {world.name} has no georeference: the GPS topics of {of} are not published"
            self._once("georeference", f"{text}; add `georeference` to the world's file")

    def moved(self) -> None:
        """Something was put somewhere: see whether it stands in something else."""
        for line in overlaps(self._sim):
            self._once(line.partition(" by ")[0], line)

    def unknown_publisher(self, unknown_publisher: "UnknownTopicPublisher", table: "Table") -> None:
        """Somebody publishes where nobody listens."""
        topic, key = unknown_publisher.topic, f"{unknown_publisher.topic} {unknown_publisher.sender}"
        if topic in table.inputs or key in self._told:
            return
        hint = self._hints(topic, unknown_publisher.type, table, self._sim.boats)
        if hint:
            self._once(key, f"{topic} has a publisher, {unknown_publisher.sender}, but no subscriber: {hint}")

    def refused(self, command: "Command", why: str) -> None:
        """A message could not be taken."""
        self._once(f"{command.topic} refused {command.sender}", f"{command.topic} from {command.sender}: {why}")

    def taken(self, command: "Command") -> None:
        """A message was taken: see whether it comes often enough."""
        if not command.topic.endswith(THRUST):
            return
        key, boat = (command.topic, command.sender), command.topic.split("/")[1]
        if key not in self._times and len(self._times) > 1024:
            return
        times = self._times.setdefault(key, deque(maxlen=ALIKE))
        if times and self._sim.time <= times[-1]:
            return
        times.append(self._sim.time)
        timeout = self._timeout(boat, command.topic.rpartition("/")[2].removesuffix(THRUST))
        gaps = sorted(later - earlier for earlier, later in zip(times, list(times)[1:], strict=False))
        if len(times) == ALIKE and 0.0 < timeout < gaps[0] * 0.99:
            share = round(100.0 * timeout / gaps[len(gaps) // 2])
            self._once(
                f"{command.topic} slow",
                f"{command.topic} comes every {gaps[len(gaps) // 2]:.2g} s but a thrust lasts {timeout:g} s: thrust is "
                f"on {share} % of the time; use -r {2.0 / timeout:g} or more",
            )

    def commanded(self, boat: str, commands: Mapping[str, float]) -> None:
        """See whether commands are beyond what thrusters do, or the boat is held."""
        rows = {row["name"]: row for row in self._rows(boat)}
        for name, value in commands.items():
            angle = name.endswith("_angle")
            row = rows.get(name.removesuffix("_angle") if angle else name)
            if row is None:
                continue
            least, most = (-row["max_angle"], row["max_angle"]) if angle else _limits(row)
            if not least - 1e-6 <= value <= most + 1e-6:
                self._once(f"{boat} {name}", f"{name} of {boat} is {_clipped(value, least, most, row, angle=angle)}")
        task = self._sim.task
        if task is not None and task["boat"] == boat and task["state"] == "initial" and any(commands.values()):
            free = f"t = {task['ready_time']:g} s"
            self._once(f"{boat} held", f"{boat} is held by its task until {free}: thrust has no effect before")

    def pushed(self, boat: str, thruster: Thruster, force: float) -> None:
        """See whether a thruster can give a force [N]."""
        least, most = -thruster.max_reverse, thruster.max_forward
        if not least - 1e-6 <= force <= most + 1e-6:
            said = f"{thruster.name} of {boat} is {force:.4g} N, beyond {least:.4g} to {most:.4g} N"
            self._once(f"{boat} {thruster.name} N", f"{said}: it is clamped to this range")

    def look(self) -> None:
        """See whether boats are aground, capsized or spinning, if it is time."""
        number = math.floor(self._sim.time * LOOK_RATE)
        if number == self._number:
            return
        self._number = number
        seen, ashore = self._sim.observe(), _touching_land(self._sim)
        for boat in self._sim.boats:
            capsized, rate = is_capsized(seen[boat]), spin(seen[boat])
            self._state(f"{boat} capsized", capsized, f"{boat} has capsized; /gazebo/set_model_state rights it")
            fast = f"{boat} spins at {rate:.3g} rad/s, more than {FASTEST_SPIN:g}: check masses, inertias and floats"
            self._state(f"{boat} spins", rate > FASTEST_SPIN, f"{fast} of its robot")
            self._ashore[boat] = _counted(self._ashore.get(boat, 0), boat in ashore)
            if self._ashore[boat] >= AGROUND:
                self._once(f"{boat} aground", f"t = {self._sim.time:.1f} s: {boat} is aground")
            elif self._ashore[boat] <= -AFLOAT:
                self._told.discard(f"{boat} aground")

    def _state(self, key: str, holds: bool, text: str) -> None:
        """Tell of something once for as long as it holds."""
        if holds:
            self._once(key, f"t = {self._sim.time:.1f} s: {text}")
        else:
            self._told.discard(key)

    def _once(self, key: str, text: str) -> None:
        if key not in self._told and len(self._told) < 10_000:
            self._told.add(key)
            self._tell("WARN", text)

    def _rows(self, boat: str) -> Iterator[Mapping[str, Any]]:
        hull = self._sim.boats.index(boat)
        return (row for row in self._sim.world.tree["thrusters"] if row["hull"] == hull)

    def _timeout(self, boat: str, thruster: str) -> float:
        if boat not in self._sim.boats:
            return 0.0
        return next((row["timeout"] for row in self._rows(boat) if row["name"] == thruster), 0.0)


def _counted(looks: int, holds: bool) -> int:
    """How many looks in a row something held, or, below 0, did not."""
    return max(looks, 0) + 1 if holds else min(looks, 0) - 1


def _limits(row: Mapping[str, Any]) -> tuple[float, float]:
    """Commands of full thrust astern and ahead."""
    if row["max_command"] == 1.0:
        return -1.0, 1.0
    return -abs(row["max_reverse"]), row["max_forward"]


def _clipped(value: float, least: float, most: float, row: Mapping[str, Any], *, angle: bool) -> str:
    if angle:
        return f"{value:.4g} rad: the angle is clamped to {min(max(value, least), most):.4g} rad"
    ahead, astern = row["max_forward"], abs(row["max_reverse"])
    unit = "" if most == 1.0 else " N"
    text = f"{value:.4g}{unit}, beyond {least:g} to {most:g}"
    return f"{text}: the force is limited to {ahead:g} N ahead, {astern:g} N astern"


def overlaps(sim: Simulation) -> Iterator[str]:
    """Models that stand in each other now."""
    model, told = sim.model, set()
    for contact in sim.data.contact:
        pair = [_owner(model, int(geom), sim.boats) for geom in contact.geom]
        if contact.dist < -DEEP and pair[0] != pair[1] and tuple(sorted(pair)) not in told:
            told.add(tuple(sorted(pair)))
            yield f"{pair[0]} and {pair[1]} overlap by {-contact.dist:.2f} m: move one of them"


def shared_frames(sim: Simulation) -> Iterator[str]:
    """Frames of sensors that two boats have; ground truth is in the world's frame, which is nobody's."""
    owners: dict[str, str] = {}
    for boat in sim.boats:
        for sensor in (sensor for sensor in sim.mounted(boat) if sensor.config.type != "p3d"):
            other = owners.setdefault(sensor.frame, boat)
            if other != boat:
                yield (
                    f"the frame {sensor.frame} belongs to {sensor.name} of {boat} and of {other}: their readings "
                    "cannot be distinguished; remove the namespace from the frame's name"
                )


def _owner(model: Any, geom: int, boats: tuple[str, ...]) -> str:
    name = str(model.body(int(model.geom_bodyid[geom])).name)
    owner = name.partition("/")[0]
    return owner if owner in boats else name.rpartition("/")[0] or "the land"


def _touching_land(sim: Simulation) -> set[str]:
    found = set()
    for contact in sim.data.contact:
        pair = {_owner(sim.model, int(geom), sim.boats) for geom in contact.geom}
        if contact.dist < 0.0 and "the land" in pair:
            found |= pair
    return found
