"""ArduPilot's SITL as the autopilot of boats, over its JSON interface.

Each frame of the autopilot advances the simulation by the length of the frame and no further. While the autopilot
thinks, the simulation waits, so the same frames give the same run to the bit.

Source: libraries/SITL/examples/JSON/readme.md of ArduPilot. A packet is little-endian: a magic number (16 bits) that
says how many channels there are, the rate of frames [Hz] (16 bits), the number of the frame (32 bits), and the width of
each channel's pulse [us] (16 bits each). An answer is one JSON object between two newlines.
"""

import contextlib
import errno
import json
import math
import os
import selectors
import socket
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

from vrx_mj.arguments import check_name, parse_ports
from vrx_mj.autopilot.board import MAX_PULSE, MIN_PULSE, Board, Channels, channels_of, is_servo_pulse
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.packages import root
from vrx_mj.runtime.simulation import Simulation

FORMATS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""Packets of 16 and of 32 channels, by their magic numbers."""
MAX_SIZE = 256
"""Number of bytes of a packet that are read: more than any packet has."""
PORT, MAVLINK_PORT, PORT_STEP = 9002, 5760, 10
"""UDP port that a SITL sends to and TCP port of its MAVLink, and how much each further `--instance` adds."""
TIMEOUT = 5.0
"""Wall time [s] without a packet after which an autopilot counts as gone: another may take its place."""
_SETTLING_FRAMES = 3
"""Consecutive frames with an unsuitable rate before a warning: SITL starts at 1200 Hz and adopts the rate of the
answers."""
_LONGEST_WAIT = 0.02
"""Longest wall time to wait before others have their turn [s]."""


class Servos(NamedTuple):
    """Commands of an autopilot in one frame."""

    rate: int
    """Frames per simulated second [Hz]: time goes on by 1 / rate."""
    number: int
    """Number of the frame since the autopilot started."""
    pulses: tuple[int, ...]
    """Widths of the pulses of channels 1, 2, ... [us]; 0: the channel has no output."""


def servos_of(packet: bytes) -> Servos | None:
    """The servo outputs in a packet; None if it is no packet of ArduPilot."""
    form = FORMATS.get(int.from_bytes(packet[:2], "little"))
    if form is None or form.size != len(packet):
        return None
    _, rate, count, *pulses = form.unpack(packet)
    return Servos(rate, count, tuple(pulses))


def answer(state: dict[str, Any]) -> bytes:
    """The line that ArduPilot reads: `timestamp` [s], `imu`, `position`, `velocity`, `quaternion` and what is optional.

    ArduPilot looks for the first place of a key in the line, and two characters after it for the value: no key may
    stand before another that it begins with, and no blank before a list.
    """
    return f"\n{json.dumps(state, allow_nan=False, separators=(',', ':'))}\n".encode()


_Address = tuple[str, int]
_Report = Callable[[str, str], None]
"""Takes a level, INFO or WARN, and a line for people."""


@dataclass(eq=False)
class _Link:
    """A boat, the socket on which its autopilot is heard, and the frame that time has to go on for."""

    boat: str
    socket: socket.socket
    channels: Channels
    board: Board
    peer: _Address | None = None
    """Where the autopilot sends from."""
    count: int | None = None
    """Number of its last frame."""
    due: int | None = None
    """Physics step at which the last frame is answered; None while the next one is waited for."""
    unsuited: int = 0
    """Frames on end whose rate does not suit the physics."""
    last: bytes = b""
    """The last answer, for a frame that comes again."""
    heard: float = field(default_factory=time.monotonic)
    """When, by the clock on the wall [s]."""
    said: set[str] = field(default_factory=set)
    """What was reported already, by keys."""

    def drop_repeats(self) -> None:
        """Drop repeats of the frame that is about to be answered: each would be answered too, ahead of the next one."""
        with contextlib.suppress(OSError):
            while True:
                packet, peer = self.socket.recvfrom(MAX_SIZE, socket.MSG_PEEK)
                servos = servos_of(packet)
                if peer != self.peer or servos is None or servos.number != self.count:
                    return
                self.socket.recv(MAX_SIZE)

    def send(self) -> None:
        """Send the last answer, if there is one; an autopilot that misses it asks again."""
        if self.last and self.peer is not None:
            with contextlib.suppress(OSError):
                self.socket.sendto(self.last, self.peer)


class ArduPilot:
    """SITLs of ArduPilot (`--model JSON:ADDRESS`) that sail boats of a simulation in lock-step.

    Time goes on when all boats that have an autopilot have a frame; boats without one are steered by who holds the
    simulation. Use it in a `with` statement, which closes its sockets.

        with ArduPilot(sim) as autopilots:
            while sim.time < 60.0:
                autopilots.step()
    """

    def __init__(
        self,
        sim: Simulation,
        ports: Mapping[str, int] | None = None,
        *,
        host: str = "127.0.0.1",
        rate: float | None = 1.0,
        report: _Report = lambda _level, _text: None,
    ) -> None:
        """Listen for the autopilots.

        Args:
            sim: the simulation, whose time only this may take on.
            ports: UDP port by boat; None: all boats, the first at 9002 and each further one 10 above.
            host: address to listen on; 0.0.0.0: all networks.
            rate: simulated seconds per second, which SITL keeps; None: as fast as both compute.
            report: is given lines for people.

        Raises:
            UnknownNameError: no boat has a name of `ports`.
            CommandError: which channels command a boat is not clear; two boats have one port; the rate is not above 0.
            NetworkError: a port cannot be listened on.
        """
        self._sim, self._rate, self._report = sim, rate, report
        self.restart: Callable[[], object] = lambda: sim.reset(sim.seed)
        """Begins time anew, when an autopilot has restarted."""
        self._selector = selectors.DefaultSelector()
        self._links: list[_Link] = []
        if rate is not None and not 0.0 < rate < math.inf:
            raise CommandError(f"invalid --rate {rate:g}: a number above 0 (1 for real time) or max is needed")
        given = ports_of(sim) if ports is None else ports
        if len(set(given.values()) - {0}) < sum(map(bool, given.values())):
            raise CommandError(f"invalid ports {dict(given)}: each boat needs one of its own")
        try:
            for boat, port in given.items():
                check_name("boat", boat, sim.boats)
                channels, board = channels_of(sim.world, boat), Board(sim, boat)
                self._links.append(_Link(boat, _listening(host, port), channels, board))
                self._selector.register(self._links[-1].socket, selectors.EVENT_READ, self._links[-1])
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the sockets."""
        for link in self._links:
            link.socket.close()
        self._selector.close()

    @property
    def addresses(self) -> dict[str, _Address]:
        """Where each boat's autopilot is listened for; a port of 0 has become a free one."""
        return {link.boat: link.socket.getsockname() for link in self._links}

    @property
    def arguments(self) -> dict[str, str]:
        """Arguments of each boat's SITL, `ardurover`."""
        earth = self._sim.world.parameters.georeference
        home = f" --home {earth.latitude:.7f},{earth.longitude:.7f},{earth.elevation:g},0" if earth else ""
        speed = "" if self._rate in {None, 1.0} else f" --speedup {self._rate:g}"
        found = {}
        for boat, (host, port) in self.addresses.items():
            instance, rest = divmod(port - PORT, PORT_STEP)
            own = f"--sim-port-out {port}" if rest or instance < 0 else f"--instance {instance}"
            found[boat] = f"{own} --model JSON:{host}{home}{speed} --defaults {self._parameters(boat)}"
        return found

    def descriptions(self) -> Iterator[str]:
        """Lines that say how to start the SITL of each boat, and what its channels command."""
        for link in self._links:
            channels = ", ".join(f"{number} {channel.command}" for number, channel in sorted(link.channels.items()))
            yield f"{link.boat}: channels {channels}; waiting for ardurover {self.arguments[link.boat]}"

    def _parameters(self, boat: str) -> str:
        """The file of ArduPilot's parameters for a boat, if its kind is one of ours that has one."""
        robot = next(each.robot for each in self._sim.world.parameters.boats if each.name == boat)
        file = root() / "assets" / "robots" / robot / "ardurover.parm"
        return str(file) if "/" not in robot and file.is_file() else "PARAMETERS"

    @property
    def waiting(self) -> tuple[str, ...]:
        """Boats whose autopilots have not asked for the next frame: time waits for them."""
        return tuple(link.boat for link in self._links if link.due is None)

    def step(self, timeout: float | None = None) -> bool:
        """Take time on to the next answer of an autopilot, and answer it; whether that was possible.

        Args:
            timeout: wall time [s] for which packets are waited for; None: until all have asked.
        """
        while not self.receive(_LONGEST_WAIT if timeout is None else timeout) and timeout is None:
            pass
        steps = self.steps
        if steps:
            self._sim.advance(steps)
            self.answer()
        return steps > 0

    def run(self, *, duration: float | None = None, over: Callable[[], bool] = lambda: False) -> None:
        """Sail on until the simulated time is `duration` [s], or until it is `over`, which is asked again and again."""
        while not over() and (duration is None or self._sim.time < duration - 0.5 * self._sim.timestep):
            self.step(_LONGEST_WAIT)

    def receive(self, timeout: float) -> bool:
        """Take packets, for which is waited at most so long [s]; whether all autopilots have asked for a frame."""
        if self._links and not self.waiting:
            return True
        for key, _ in self._selector.select(timeout):
            self._read(key.data)
        self._say_silent()
        return bool(self._links) and not self.waiting

    @property
    def steps(self) -> int:
        """Physics steps to the next answer; 0 while an autopilot has not asked."""
        dues = [link.due for link in self._links]
        return 0 if None in dues or not dues else min(due for due in dues if due is not None) - self._now

    def answer(self) -> None:
        """Answer the frames for which time has gone on far enough."""
        for link in self._links:
            if link.due is not None and link.due <= self._now:
                link.drop_repeats()
                free = {"no_time_sync": 1} if self._rate is None and not link.unsuited else {}
                link.due, link.last = None, answer(link.board.measure() | free)
                link.send()

    @property
    def _now(self) -> int:
        return round(self._sim.time / self._sim.timestep)

    def _read(self, link: _Link) -> None:
        """Take packets of a boat until there is a frame, or none is left."""
        while link.due is None:
            try:
                packet, peer = link.socket.recvfrom(MAX_SIZE)
            except OSError:  # none is left, or the peer of an answer is gone
                return
            servos = servos_of(packet)
            if servos is None:
                self._say(
                    link, "foreign", f"a packet of {len(packet)} bytes from {_address_text(peer)} is not ArduPilot's"
                )
            elif self._is_of_peer(link, peer):
                link.heard = time.monotonic()
                link.said.discard("silent")
                self._take(link, servos)

    def _is_of_peer(self, link: _Link, peer: _Address) -> bool:
        """Whether a packet is of the autopilot that sails a boat, which is the first, until it is gone."""
        if link.peer == peer:
            return True
        if link.peer is not None and time.monotonic() - link.heard < TIMEOUT:
            self._say(
                link,
                "second",
                f"packets from {_address_text(peer)} are ignored: the autopilot is {_address_text(link.peer)}",
            )
            return False
        link.peer = peer
        self._report("INFO", f"{link.boat}: autopilot connected from {_address_text(peer)}")
        return True

    def _take(self, link: _Link, servos: Servos) -> None:
        """Take a frame: a new one is answered when its time has come, an old one again, an earlier one starts anew."""
        if servos.number == link.count:
            link.send()
            return
        if link.count is not None and servos.number < link.count:
            self._begin_anew(link)
        elif link.count is not None and servos.number > link.count + 1:
            lost = servos.number - link.count - 1
            self._say(link, "lost", f"{lost} frames lost before frame {servos.number}; time advances by one frame")
        link.count, link.due = servos.number, self._now + self._frame_steps(link, servos.rate)
        self._command(link, servos.pulses)

    def _frame_steps(self, link: _Link, rate: int) -> int:
        """Physics steps of a frame: as many as come next to its length, one at least."""
        per_second = 1.0 / self._sim.timestep
        steps = max(1, round(per_second / rate)) if rate else 1
        link.unsuited = 0 if abs(steps * rate - per_second) < 1e-6 * per_second else link.unsuited + 1
        if link.unsuited == _SETTLING_FRAMES:
            rates = [f"{per_second / n:g}" for n in range(1, 101) if per_second / n == round(per_second / n)]
            self._say(
                link,
                "rate",
                f"its autopilot expects {rate} frames per second but gets {per_second / steps:g}: set SIM_RATE_HZ to "
                f"{', '.join(rates[:4])}, or `physics: timestep` of the world",
            )
        return steps

    def _begin_anew(self, link: _Link) -> None:
        """The autopilot has restarted: the run does too, if it can."""
        try:
            self.restart()
        except CommandError as error:
            self._report("WARN", f"{link.boat}: its autopilot restarted; the simulation continues: {error}")
            return
        self._report("INFO", f"{link.boat}: its autopilot restarted; the simulation restarts too")
        for other in self._links:
            other.board.restart()
            if other is not link and other.due is not None:
                other.due = self._now + 1  # its frame is answered at once; it asks again with its own length

    def _command(self, link: _Link, pulses: tuple[int, ...]) -> None:
        commands = {}
        for number, channel in link.channels.items():
            pulse = pulses[number - 1] if number <= len(pulses) else 0
            if not is_servo_pulse(pulse):
                what = f"pulses from {MIN_PULSE} to {MAX_PULSE} us are needed; it is taken as no pulse"
                self._say(link, f"pulse {number}", f"channel {number} has {pulse} us: {what}")
                pulse = 0
            commands[channel.command] = channel.value(pulse)
        self._sim.command_all({link.boat: commands})

    def _say_silent(self) -> None:
        now = time.monotonic()
        for link in self._links:
            if link.due is None and link.peer is not None and now - link.heard > TIMEOUT:
                self._say(link, "silent", f"no frame from its autopilot for {TIMEOUT:g} s: the simulation waits")

    def _say(self, link: _Link, key: str, text: str) -> None:
        """Report a line about a boat, once for a key."""
        if key not in link.said:
            link.said.add(key)
            self._report("WARN", f"{link.boat}: {text}")


def ports_of(sim: Simulation, text: str = "") -> dict[str, int]:
    """Ports by boat, of `BOAT:PORT,BOAT:PORT`, or of all boats from a first `PORT` on as `sim_vehicle.py -I` counts.

    Raises:
        CommandError: the text is neither.
    """
    if not text or text.isdecimal():
        return {boat: int(text or PORT) + PORT_STEP * number for number, boat in enumerate(sim.boats)}
    return parse_ports("--ardupilot", text, "BOAT:PORT,... or a PORT is needed, as in wamv:9002")


def _listening(host: str, port: int) -> socket.socket:
    """A UDP socket that does not block. NetworkError: it cannot listen there."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        listening.bind((host, port))
    except (OSError, OverflowError) as error:
        listening.close()
        code = error.errno if isinstance(error, OSError) else errno.EINVAL
        raise NetworkError(f"cannot listen for ArduPilot on {host}:{port}: {os.strerror(code or 0)}") from None
    listening.setblocking(False)
    return listening


def _address_text(address: _Address) -> str:
    return f"{address[0]}:{address[1]}"
