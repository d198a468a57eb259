"""What goes wrong for users of VRX, found and named: each thing once."""

import difflib
import math
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from vrx_mj.errors import first_names, nearest
from vrx_mj.runtime.commands import clipped_commands
from vrx_mj.runtime.hull import Propeller
from vrx_mj.runtime.run import FASTEST_SPIN, is_capsized, spin
from vrx_mj.runtime.simulation import Simulation

if TYPE_CHECKING:  # they need the extra ros1, and `vrx-mj doctor` does not
    from vrx_mj.ros.interface import Command, Input, RosInterface, UnknownTopicPublisher


_CMD_VEL = "/cmd_vel"
"""End of the topics of velocity commands."""
_OUR_PARTS = ("/thrusters/", _CMD_VEL, "/shooters/", "/set_pinger_position", "/shuffle", "/swarm/", "/vrx/")
"""Parts of topics that are meant for the simulation, however different they are from its own."""
_WORLD_TOPICS = ("/vrx/", "/swarm/")
"""First parts of the topics of worlds."""
_MOST_HINTS = 4096
"""Largest number of topics for which hints are kept."""

_LEAST_ALIKE = 0.71
"""Least likeness of a topic that is probably meant: the share of common letters, and the terms below."""
_SAME_WORDS = 0.72
"""Least likeness of a topic that has all words of another."""
_NAMED_BOAT = 0.2
"""Term if the boat's name is the same; less for a similar name."""
_OTHER_BOAT = 0.2
"""Term, subtracted, if the topic is another boat's."""
_OTHER_TYPE = 0.3
"""Term, subtracted, if messages are of another type."""
_MAX_COMPARED = 200
"""Longest topic that is compared [characters]."""
_UNKNOWN_TYPE = "*"
"""Type of a publisher that does not say it."""
_MIN_OVERLAP = 0.05
"""Overlap above which two models are reported [m]."""
_RATE_COMMANDS = 4
"""Number of commands in a row by which their rate is measured."""
_LOOK_RATE = 1.0
"""Rate at which boats are checked [Hz, simulated time]."""
_AGROUND_CHECKS = 2
"""Consecutive checks with contact to land after which a boat is aground."""
_AFLOAT_CHECKS = 10
"""Consecutive checks without contact after which it is afloat again: waves free a boat ashore now and then."""
_THRUST = "_thrust_cmd"
"""End of the topics of thrust commands."""
_ANGLE = "_thrust_angle"
"""End of the topics of angles."""
_TURN_TIME = 1.0
"""Longest time between two messages of one sender, with others' in between, for which senders take turns [s]."""
_MOST_SENDERS = 64
"""Largest number of senders that are watched."""
_SHOWN_BOATS = 8
"""Number of boats that a message names."""


class TopicHints:
    """Hints for publishers of topics without a subscriber; each topic is looked at once for a table."""

    def __init__(self) -> None:
        self._table: RosInterface | None = None
        self._hints: dict[tuple[str, str], str] = {}

    def __call__(self, topic: str, type_name: str, table: "RosInterface", boats: Sequence[str]) -> str:
        """A hint for people; empty for a topic that has nothing to do with the simulation."""
        if self._table is not table or len(self._hints) > _MOST_HINTS:
            self._table, self._hints = table, {}
        key = (topic, type_name)
        if key not in self._hints:
            self._hints[key] = table.elsewhere.get(topic) or _hint(topic, type_name, table.inputs, boats)
        return self._hints[key]


def _hint(topic: str, type_name: str, inputs: "Mapping[str, Input]", boats: Sequence[str]) -> str:
    concerns = any(part in topic for part in _OUR_PARTS)
    if topic.endswith(_CMD_VEL) and not any(name.endswith(_CMD_VEL) for name in inputs):
        return "cmd_vel is off; enable it with --cmd-vel thrust or velocity"
    meant = meant_topic(topic, type_name, inputs, boats)
    if meant is None and concerns:
        tails = (topic.split("/", 2)[-1], topic.rpartition("/")[2])
        same = (f"/{boat}/{tail}" for tail in tails for boat in boats)
        meant = next((name for name in same if name in inputs), None) or nearest(topic, inputs)
    if meant is not None:
        return f"did you mean {meant}?"
    if not concerns or topic.startswith(_WORLD_TOPICS):
        return "this world has no such topic" if concerns else ""
    return f"topics of boats begin with /{boats[0]}/" if boats else "the world has no boat now"


def meant_topic(topic: str, type_name: str, inputs: "Mapping[str, Input]", boats: Collection[str]) -> str | None:
    """The topic among `inputs` that is most likely meant by `topic`; None if none is alike.

    `type_name` is the type of its messages, `*` if that is not known.
    """
    if len(topic) > _MAX_COMPARED:
        return None
    given = topic.strip("/").lower()
    segments, words = given.split("/"), _words(given) - set(boats)
    ends, named = (given, given.partition("/")[2], segments[-1]), {boat for boat in boats if boat in segments}
    best, most = None, _LEAST_ALIKE
    for name, entry in inputs.items():
        boat, _, tail = name[1:].partition("/")
        is_other_type = entry.type != type_name != _UNKNOWN_TYPE
        alike = max(_alike(end, tail) for end in ends)
        if words and words <= _words(tail) and not is_other_type:
            alike = max(alike, _SAME_WORDS)
        if named:
            alike += _NAMED_BOAT if boat in named else -_OTHER_BOAT
        else:
            alike += _NAMED_BOAT * _alike(segments[0], boat)
        alike -= _OTHER_TYPE * is_other_type
        if alike > most + 1e-9:
            best, most = name, alike
    return best


@lru_cache(maxsize=8192)
def _alike(given: str, meant: str) -> float:
    """How alike two texts are, from 0 to 1."""
    return difflib.SequenceMatcher(None, given, meant, autojunk=False).ratio()


@lru_cache(maxsize=8192)
def _words(name: str) -> frozenset[str]:
    return frozenset(name.replace("/", "_").split("_")) - {""}


class Diagnosis:
    """Looks at what comes and at how the boats are, and reports what is odd about it."""

    def __init__(self, sim: Simulation, report: Callable[[str, str], None]) -> None:
        self._sim, self._report = sim, report
        self._reported: set[str] = set()
        self._times: dict[tuple[str, str], deque[float]] = {}
        self._last: dict[str, dict[str, float]] = {}
        """When each sender's last message came, by topic."""
        self._ashore: dict[str, int] = {}
        self._number = -1
        self._hints = TopicHints()
        self.check_overlaps()
        self.check_receivers()
        for line in shared_frames(sim):
            self.once(line, line)

    def check_receivers(self) -> None:
        """Boats came or went: see whether they have receivers that cannot work here."""
        world = self._sim.world
        if world.parameters.georeference is not None:
            return
        owners = [boat for boat in self._sim.boats if any(one.config.type == "gps" for one in self._sim.mounted(boat))]
        if owners:
            of = first_names(owners, _SHOWN_BOATS)
            text = f"the world {world.name} has no georeference: the GPS topics of {of} are not published"
            self.once("georeference", f"{text}; add `georeference` to the world's file")

    def check_overlaps(self) -> None:
        """Report what overlaps, after something was put somewhere."""
        for line in overlaps(self._sim):
            self.once(line.partition(" by ")[0], line)

    def unknown_publisher(self, unknown_publisher: "UnknownTopicPublisher", table: "RosInterface") -> None:
        """Somebody publishes on a topic without subscribers."""
        topic, key = unknown_publisher.topic, f"{unknown_publisher.topic} {unknown_publisher.sender}"
        if topic in table.inputs or key in self._reported:
            return
        hint = self._fixed_thruster(topic) or self._hints(topic, unknown_publisher.type, table, self._sim.boats)
        if hint:
            self.once(key, f"{topic} has a publisher, {unknown_publisher.sender}, but no subscriber: {hint}")

    def _fixed_thruster(self, topic: str) -> str:
        """Hint about a topic of the angle of a thruster that cannot be turned; empty for other topics."""
        boat, _, name = topic.strip("/").partition("/thrusters/")
        own = self._sim.world.parameters.thrusters_of(boat) if boat in self._sim.boats else ()
        fixed = {each.name for each in own if not each.max_angle}
        thruster = name.removesuffix(_ANGLE).removesuffix("/pos")
        return f"{thruster} of {boat} cannot be turned" if name != thruster and thruster in fixed else ""

    def note_command(self, command: "Command") -> None:
        """A message was taken: see whether it comes often enough."""
        if not command.topic.endswith(_THRUST):
            return
        self._check_senders(command)
        key, boat = (command.topic, command.sender), command.topic.split("/")[1]
        if key not in self._times and len(self._times) > 1024:
            return
        times = self._times.setdefault(key, deque(maxlen=_RATE_COMMANDS))
        if times and self._sim.time <= times[-1]:
            return
        times.append(self._sim.time)
        timeout = self._timeout(boat, command.topic.rpartition("/")[2].removesuffix(_THRUST))
        gaps = sorted(later - earlier for earlier, later in zip(times, list(times)[1:], strict=False))
        if len(times) == _RATE_COMMANDS and 0.0 < timeout < gaps[0] * 0.99:
            share = round(100.0 * timeout / gaps[len(gaps) // 2])
            self.once(
                f"{command.topic} slow",
                f"{command.topic} arrives every {gaps[len(gaps) // 2]:.2g} s, but a thrust lasts {timeout:g} s: it is "
                f"on {share} % of the time; publish with -r {2.0 / timeout:g} or more",
            )

    def _check_senders(self, command: "Command") -> None:
        """See whether two senders' messages come in turn."""
        last, now = self._last.setdefault(command.topic, {}), self._sim.time
        before = last.get(command.sender, -math.inf)
        if now - before < _TURN_TIME:
            for other in (other for other, time in last.items() if other != command.sender and time >= before):
                two = f"{command.topic} is published by {command.sender} and {other}"
                self.once(f"{command.topic} shared", f"{two}: each message replaces the other's")
        if len(last) > _MOST_SENDERS:
            last.clear()
        last[command.sender] = now

    def check_commands(self, boat: str, commands: Mapping[str, float]) -> None:
        """See whether commands are beyond what thrusters do, or the boat is held."""
        for name, text in clipped_commands(self._sim.world, boat, commands):
            self.once(f"{boat} {name}", text)
        task = self._sim.task
        if task is not None and task["boat"] == boat and task["state"] == "initial" and any(commands.values()):
            free = f"t = {task['ready_time']:g} s"
            self.once(f"{boat} held", f"{boat} is held by its task until {free}: thrust has no effect until then")

    def check_force(self, boat: str, thruster: Propeller, force: float) -> None:
        """See whether a thruster can give a force [N]."""
        least, most = thruster.max_reverse, thruster.max_forward
        if not least - 1e-6 <= force <= most + 1e-6:
            force_text = f"{thruster.name} of {boat} is {force:.4g} N, outside {least:.4g} to {most:.4g} N"
            self.once(f"{boat} {thruster.name} N", f"{force_text}: it is clamped to this range")

    def look(self) -> None:
        """See whether boats are aground, capsized or spinning, if it is time."""
        number = math.floor(self._sim.time * _LOOK_RATE)
        if number == self._number:
            return
        self._number = number
        seen, ashore = self._sim.observe(), _touching_land(self._sim)
        for boat in self._sim.boats:
            capsized, rate = is_capsized(seen[boat]), spin(seen[boat])
            righted = f"{boat} has capsized; right it with /gazebo/set_model_state"
            self._state(f"{boat} capsized", capsized, righted, f"{boat} is upright again")
            fast = f"{boat} spins at {rate:.3g} rad/s, more than {FASTEST_SPIN:g}: check masses, inertias and floats"
            self._state(f"{boat} spins", rate > FASTEST_SPIN, f"{fast} of its robot", f"{boat} has stopped spinning")
            looks = self._ashore.get(boat, 0)
            looks = self._ashore[boat] = max(looks, 0) + 1 if boat in ashore else min(looks, 0) - 1
            if looks >= _AGROUND_CHECKS or looks <= -_AFLOAT_CHECKS:
                self._state(f"{boat} aground", looks > 0, f"{boat} is aground", f"{boat} is afloat again")

    def _state(self, key: str, holds: bool, text: str, ended: str) -> None:
        """Report something once for as long as it holds, and when it has ended."""
        if holds:
            self.once(key, f"t = {self._sim.time:.1f} s: {text}")
        elif key in self._reported:
            self._reported.discard(key)
            self._report("INFO", f"t = {self._sim.time:.1f} s: {ended}")

    def once(self, key: str, text: str) -> None:
        """Report a line, once for a key."""
        if key not in self._reported and len(self._reported) < 10_000:
            self._reported.add(key)
            self._report("WARN", text)

    def _timeout(self, boat: str, thruster: str) -> float:
        if boat not in self._sim.boats:
            return 0.0
        own = self._sim.world.parameters.thrusters_of(boat)
        return next((each.timeout for each in own if each.name == thruster), 0.0)


def overlaps(sim: Simulation) -> Iterator[str]:
    """Models that overlap now, a line for each pair."""
    found = set()
    for depth, pair in _contacts(sim):
        if depth > _MIN_OVERLAP and pair[0] != pair[1] and {*pair} not in found:
            found.add(frozenset(pair))
            yield f"{pair[0]} and {pair[1]} overlap by {depth:.2f} m: move one of them"


def shared_frames(sim: Simulation) -> Iterator[str]:
    """Frames of sensors that two boats share, a line for each; ground truth is in the world's frame."""
    owners: dict[str, str] = {}
    for boat in sim.boats:
        for sensor in (sensor for sensor in sim.mounted(boat) if sensor.config.type != "p3d"):
            other = owners.setdefault(sensor.frame, boat)
            if other != boat:
                yield (
                    f"the frame {sensor.frame} belongs to {sensor.name} of {boat} and of {other}: their readings "
                    "cannot be distinguished; remove the namespace from the frame's name"
                )


def _touching_land(sim: Simulation) -> set[str]:
    return {owner for depth, pair in _contacts(sim) if depth > 0.0 and "the land" in pair for owner in pair}


def _contacts(sim: Simulation) -> Iterator[tuple[float, list[str]]]:
    """How deep [m] what overlaps or is near, and whose the two shapes are."""
    for contact in sim.data.contact:
        bodies = (str(sim.model.body(int(sim.model.geom_bodyid[geom])).name) for geom in contact.geom)
        owners = ((name.partition("/")[0], name.rpartition("/")[0]) for name in bodies)
        yield -contact.dist, [owner if owner in sim.boats else model or "the land" for owner, model in owners]
