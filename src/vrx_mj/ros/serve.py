"""A world that is served: it keeps pace with the wall clock, or runs as fast as it can, until somebody ends it.

Chart plotters get a boat's NMEA 0183 sentences by UDP, from a TCP port, and as topics of ROS.
"""

import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol
from urllib.parse import urlsplit

from vrx_mj.drive.session import MAX_LAG, Pacer
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.nmea import PERIOD, RATE, Instruments, Sentence
from vrx_mj.ros.graph import Graph, Server, Wires
from vrx_mj.ros.interface import BOTH, PACKAGES, Delivery, Inbox, Output, RosInterface, Traffic, Transport
from vrx_mj.ros.limits import Counts, Outbox
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.network import (
    Network,
    announced_address,
    is_loopback,
    is_wildcard,
    listening_addresses,
    refusal,
    unreachable,
)
from vrx_mj.ros.ros_server import CLOCK_RATE, Lockstep, Report, RosServer
from vrx_mj.ros.table.boats import Source
from vrx_mj.ros.table.host import BoatOutputs, CmdVel, header
from vrx_mj.runtime.limits import process_memory
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.signals import handle_signals

SENTENCE_TYPE = "nmea_msgs/Sentence"
"""Type of the messages of sentences."""
_MOST_CLIENTS = 64
"""Largest number of clients."""
MOST_SENTENCES = 1000
"""Largest number of sentences that wait for a slow client: the oldest are dropped first."""
_SEND_BUFFER = 1 << 14
"""Approximate size of the send buffer of a connection [bytes]."""
_BROADCAST = "255.255.255.255"
"""Address to which UDP is sent if all networks are listened on."""
_KB, _MB = 1e3, 1e6
"""Units of data rates [bytes]."""
_BUDGET = 0.05
"""Wall time of physics after which incoming messages are handled again [s]."""
_LONGEST_WAIT = 0.02
"""Longest wait until the wall clock is checked again [s of wall time]."""
BURST = 2
"""Largest number of ticks of the clock that follow each other at once, or ..."""
_LATENCY = 0.005
"""... the wall time of these ticks [s], where ticks are shorter than it takes to wake up."""
CATCHING_UP = 1.2
"""Factor of the pace at which lost time is made up."""
_REPORTED_LAG = 0.2
"""Lost wall time above which it is reported [s]."""
STATUS_PERIOD = 1.0
"""Wall time between two lines of status [s]."""
_CMD_VEL_NOTES: Mapping[CmdVel, str] = {
    "thrust": "cmd_vel sets thrust, as VRX's twist2thrust; with --cmd-vel velocity it sets a velocity to hold",
    "velocity": "cmd_vel sets a velocity [m/s, rad/s] to hold; with --cmd-vel thrust it is VRX's twist2thrust",
    "off": "cmd_vel is not subscribed to; with --cmd-vel thrust it is VRX's twist2thrust",
}
"""Effect of velocity commands by mode, for messages."""


def nmea_topics(boat: str) -> tuple[str, str]:
    """Topics of a boat's instruments and of what its AIS receiver hears."""
    return f"/{boat}/nmea_sentence", f"/{boat}/ais/nmea_sentence"


def nmea_outputs(instruments: Instruments, boat: str) -> Iterator[Output]:
    """Topics of a boat's instruments and AIS receiver, a message for each sentence."""
    made = (instruments.sentences, RATE), (instruments.reports, 1.0 / PERIOD)
    for name, (ask, rate) in zip(nmea_topics(boat), made, strict=True):
        yield Output(name, SENTENCE_TYPE, partial(_messages, ask, boat), rate, dialects=BOTH, recorded="nowhere")


def _messages(ask: Callable[[str], Sequence[Sentence]], boat: str) -> list[Message]:
    return [new(SENTENCE_TYPE, header=header(one.time, one.frame or boat), sentence=one.text) for one in ask(boat)]


class Nmea:
    """A `Transport` (see `vrx_mj.ros.interface`) of one boat's sentences, without a thread: no socket of it blocks."""

    def __init__(self, boat: str, *, port: int, host: str = "127.0.0.1") -> None:
        """Serve the sentences of a boat once `start` is called; port 0 is any free one."""
        self._boat, self._host, self.port, self._counts = boat, host, port, Counts()
        self._clients: dict[socket.socket, Outbox[bytes]] = {}
        self._rests: dict[socket.socket, bytes] = {}
        """Rest of the line that each client is being sent."""
        self._opened = contextlib.ExitStack()
        self.subscribed_topics: frozenset[str] = frozenset()
        """All of its topics at any time, since UDP has no subscribers."""

    def start(self) -> Sequence[str]:
        """Open it; returns a line with its address. NetworkError: it cannot be opened, and why."""
        family = socket.AF_INET6 if ":" in self._host else socket.AF_INET
        try:
            self._tcp = self._opened.enter_context(
                socket.create_server((listening_addresses(self._host)[0], self.port), family=family)
            )
            self._udp = self._opened.enter_context(socket.socket(family, socket.SOCK_DGRAM))
        except (OSError, OverflowError) as error:
            raise NetworkError(refusal("NMEA", self._host, self.port, error)) from error
        self._udp.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        for opened in (self._tcp, self._udp):
            opened.setblocking(False)
        here, self.port = self._tcp.getsockname()[:2]
        self._to = _BROADCAST if is_wildcard(self._host) else here
        return [f"NMEA of {self._boat}: TCP port {self.port} of {self._host}, UDP to port {self.port} of {self._to}"]

    def offer(self, table: RosInterface) -> None:
        """Send the sentences of this table from now on."""
        self.subscribed_topics = frozenset(nmea_topics(self._boat)) & table.outputs.keys()

    def publish(self, batch: Sequence[Delivery]) -> None:
        """Send the sentences among these messages."""
        self._accept()
        for sent in batch:
            if sent.output.name in self.subscribed_topics:
                line = f"{sent.message.sentence}\r\n".encode()
                with contextlib.suppress(OSError):  # nobody listens, or there is no network
                    self._counts.sent += self._udp.sendto(line, (self._to, self.port))
                for outbox in self._clients.values():
                    outbox.push(line, len(line))
        for client in list(self._clients):
            self._flush(client)

    def log(self, level: str, text: str) -> None:
        """A line for people, of whom there are none here."""

    @property
    def traffic(self) -> Traffic:
        """Traffic since the start."""
        return Traffic(len(self._clients), self._counts.sent, self._counts.dropped)

    def close(self) -> None:
        """Close every connection."""
        for client in self._clients:
            client.close()
        self._opened.close()

    def _accept(self) -> None:
        """Take new clients. What they send is never read: once the system holds enough of it, they have to wait."""
        with contextlib.suppress(OSError):  # nobody waits
            while len(self._clients) < _MOST_CLIENTS:
                client, _ = self._tcp.accept()
                client.setblocking(False)
                client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
                self._clients[client] = Outbox(self._counts, MOST_SENTENCES, lambda: None)

    def _flush(self, client: socket.socket) -> None:
        """Send a client what its connection takes; one that has gone is forgotten."""
        try:
            while line := self._rests.get(client) or self._clients[client].pop():
                self._rests[client] = line
                sent = client.send(line)
                self._rests[client] = line[sent:]
                self._counts.sent += sent
        except BlockingIOError:  # it does not read
            pass
        except OSError:  # it has gone
            self._clients.pop(client).forget()
            self._rests.pop(client)
            client.close()


class Autopilots(Protocol):
    """Autopilots in lock-step, which advance time by themselves, such as `vrx_mj.autopilot.ArduPilot`."""

    restart: Callable[[], object]
    """Begins time anew, when an autopilot has restarted."""

    def receive(self, timeout: float) -> bool:
        """Wait for frames, so long [s] at most; whether all have asked for one."""

    @property
    def steps(self) -> int:
        """Physics steps to the next answer."""

    def answer(self) -> None:
        """Answer, when time has gone on by these."""


class Meter:
    """Differences since the last line."""

    def __init__(self, server: RosServer, transports: Sequence[Transport], now: float) -> None:
        self._server, self._transports = server, transports
        self._begun = self._then = now, server.sim.time, time.process_time(), 0
        self._stepped = 0.0
        self._read: dict[tuple[str, str], float] = {}
        self.pace = 0.0
        """Simulated seconds per second since the line before."""
        self.load: Mapping[tuple[str, str], float] = {}
        """Share of wall time that each sensor took since the line before."""

    def line(self) -> str:
        """Measure, and report."""
        now, moment, cpu, sent = self._now()
        wall, passed = max(now - self._then[0], 1e-9), max(0.0, moment - self._then[1])
        self.pace = passed / wall
        self._stepped += passed
        spent = dict(self._server.sim.reading_times)
        clients, _, dropped = map(sum, zip(*(transport.traffic for transport in self._transports), strict=True))
        shares = {key: (total - self._read.get(key, 0.0)) / wall for key, total in spent.items()}
        self.load = {key: share for key, share in shares.items() if share > 0.0}
        parts = [
            f"t {moment:.1f} s",
            "paused" if self._server.paused else f"pace {self.pace:.2f}",
            f"CPU {100.0 * (cpu - self._then[2]) / wall:.0f} %",
            f"{process_memory() / _MB:.0f} MB",
            f"{(sent - self._then[3]) / wall / _KB:.0f} KB/s to {clients} clients",
        ]
        if dropped:
            parts.append(f"{dropped} messages dropped")
        if self.load:
            (boat, sensor), share = max(self.load.items(), key=lambda item: item[1])
            parts.append(f"slowest sensor: {sensor} of {boat}, {100.0 * share:.0f} %")
        if self._server.lockstep is not None and self._server.lockstep.missing:
            first, *others = self._server.lockstep.missing
            parts.append(f"waits for {first}{f' and {len(others)} more' if others else ''}")
        self._then, self._read = (now, moment, cpu, sent), spent
        return "  ".join(parts)

    def summary(self) -> str:
        """The whole run."""
        now, moment, cpu, sent = self._now()
        wall = max(now - self._begun[0], 1e-9)
        stepped = self._stepped + max(0.0, moment - self._then[1])
        return (
            f"served {stepped:.1f} s in {wall:.1f} s: pace {stepped / wall:.3f}, CPU "
            f"{100.0 * (cpu - self._begun[2]) / wall:.0f} %, {process_memory() / _MB:.0f} MB, {sent / _MB:.1f} MB sent"
        )

    def _now(self) -> tuple[float, float, float, int]:
        sent = sum(transport.traffic.sent for transport in self._transports)
        return time.perf_counter(), self._server.sim.time, time.process_time(), sent


@dataclass(frozen=True)
class ServeOptions:
    """How a world is to be served."""

    ros1: bool = False
    rosbridge: int | None = None
    """Port of rosbridge."""
    foxglove: int | None = None
    """Port of Foxglove's WebSocket."""
    ros2: bool = False
    nmea: Mapping[str, int] | None = None
    """Ports of sentences, by boat."""
    host: str = "127.0.0.1"
    """Address that is listened on."""
    origins: Sequence[str] = ()
    """Origins of web pages that rosbridge accepts besides those of this machine."""
    rate: float | None = 1.0
    """Simulated seconds per second; None: as fast as it can."""
    duration: float | None = None
    """Simulated time after which it ends [s]."""
    lockstep: Sequence[str] | None = None
    """Topics that time waits for; None: it does not wait."""
    cmd_vel: CmdVel = "thrust"
    truth: bool = False
    localization: Source | None = None
    clock_rate: float = CLOCK_RATE
    paused: bool = False
    """Whether time waits for `/gazebo/unpause_physics`."""
    exit_on_completion: bool = False
    """Whether it ends with the world's task."""

    def __post_init__(self) -> None:
        """CommandError: the rate is not above 0; the boats would be placed twice."""
        if self.rate is not None and not self.rate > 0.0:
            raise CommandError(f"invalid --rate {self.rate:g}: a number above 0 (1 for real time) or max is needed")
        if self.truth and self.localization is not None:
            raise CommandError("--truth and --localization both place the boats in /tf: give one of them")

    @property
    def for_ros(self) -> bool:
        """Whether programs of ROS are served, and not viewers alone."""
        return self.ros1 or self.ros2 or self.rosbridge is not None


def serve(
    sim: Simulation,
    wanted: ServeOptions,
    *,
    report: Report,
    status: Callable[[str], None] = lambda _line: None,
    extra: Sequence[Transport] = (),
    ready: Callable[[Sequence[Transport]], None] = lambda _transports: None,
    over: Callable[[], bool] = lambda: False,
    autopilots: Autopilots | None = None,
) -> None:
    """Serve a simulation until Ctrl-C, SIGTERM, a peer, its duration or its task ends it.

    Args:
        sim: the simulation, at its start; nothing else may touch it meanwhile.
        wanted: on which networks, and how fast.
        report: is given a level (INFO, WARN or ERROR) and a line for people, by this thread.
        status: is given the line of status, once a second.
        extra: transports that are open already, as a bag.
        ready: is called before time begins, when all is offered; what the transports still have to register with a
            master may be under way.
        over: is asked whether this is the end: at every tick of the clock, and again and again between them.
        autopilots: take time on, instead of the clock on the wall.

    Raises:
        NetworkError: a network cannot be opened.
        CommandError: no network is wanted.
        DivergedError: the state became NaN or huge.
    """
    sim.prepare_sensors()  # compiling holds the clock up for seconds: now, and not when somebody subscribes
    network, inbox, ending = Network(), Inbox(), threading.Event()
    try:
        transports = [*_transports(network, inbox, wanted, ending), *extra]
        with _open(transports) as lines, handle_signals(("SIGINT", "SIGTERM"), lambda _: ending.set()):
            announcer = partial(_announce, sim, transports, report)
            server = RosServer(
                sim,
                transports,
                inbox,
                report=announcer,
                cmd_vel=wanted.cmd_vel,
                truth=wanted.truth or not (wanted.for_ros or wanted.localization),  # viewers need some place of boats
                localization=wanted.localization,
                clock_rate=wanted.clock_rate,
                lockstep=None if wanted.lockstep is None else Lockstep(wanted.lockstep),
                further=_sentences(sim, wanted, report),
            )
            server.paused = wanted.paused
            for line in lines:
                report("INFO", line)
            _greet(server, wanted, report)
            try:
                ready(transports)
                _Loop(server, inbox, wanted, transports, over, autopilots).run(ending, status, announcer)
            finally:
                server.close()
    finally:
        network.close()


def _sentences(sim: Simulation, wanted: ServeOptions, report: Report) -> BoatOutputs:
    """The topics of NMEA sentences, if any are wanted; says what boats send."""
    if wanted.nmea is None:
        return lambda _boat: ()
    instruments = Instruments(sim)
    for boat in wanted.nmea:
        report("INFO", instruments.description(boat))
    return partial(nmea_outputs, instruments)


def _announce(sim: Simulation, transports: Sequence[Transport], report: Report, level: str, text: str) -> None:
    """Show a line to people here, to those on the networks, and in the recording."""
    report(level, text)
    sim.event(text, level)
    for transport in transports:
        transport.log(level, text)


class _Loop:
    """Time, and what it waits for."""

    def __init__(
        self,
        server: RosServer,
        inbox: Inbox,
        wanted: ServeOptions,
        transports: Sequence[Transport],
        over: Callable[[], bool],
        autopilots: Autopilots | None = None,
    ) -> None:
        self._server, self._inbox, self._wanted, self._over = server, inbox, wanted, over
        self._autopilots = autopilots
        if autopilots is not None:
            autopilots.restart = server.reset_simulation
        now = time.perf_counter()
        self._pacer = Pacer(server.sim.timestep, wanted.rate or 1.0, now)
        self._free = wanted.rate is None or wanted.lockstep is not None or autopilots is not None
        self._meter = Meter(server, transports, now)
        self._per_second = self._pacer.pace / server.sim.timestep
        server.update_rate = 0.0 if self._free else self._per_second
        self._clock_rate = self._pacer.pace * wanted.clock_rate
        self._burst = max(BURST, _LATENCY * self._clock_rate)
        self._owed, self._allowed = 0.0, self._burst
        """Steps that are due, and ticks that may follow now."""
        self._is_behind = False

    def run(self, ending: threading.Event, status: Callable[[str], None], report: Report) -> None:
        """Serve until `ending` is set or the run is over."""
        server = self._server
        server.announce()
        if not (self._free or server.paused):
            server.tick()  # compiled code is loaded by the first one
        self._pacer.restart(time.perf_counter())
        due = time.perf_counter() + STATUS_PERIOD
        while not (ending.is_set() or self._is_over()):
            server.receive()
            if server.paused:
                self._pacer.restart(time.perf_counter())
                self._owed = 0.0
                self._inbox.wait(_LONGEST_WAIT)
            elif self._autopilots is not None:
                if self._autopilots.receive(_LONGEST_WAIT):
                    server.advance(self._autopilots.steps)
                    self._autopilots.answer()
            elif self._free:
                self._go()
            else:
                self._keep_pace(report)
            if time.perf_counter() > due:
                due = time.perf_counter() + STATUS_PERIOD
                status(self._meter.line())
                server.pace, server.sensor_load = self._meter.pace, self._meter.load
        report("INFO", self._meter.summary())

    def _go(self) -> None:
        begun = time.perf_counter()
        while time.perf_counter() - begun < _BUDGET and not (self._inbox.pending or self._is_over()):
            if not self._server.tick():
                self._inbox.wait(_LONGEST_WAIT)
                return

    def _keep_pace(self, report: Report) -> None:
        begun = time.perf_counter()
        due = self._pacer.due(begun)
        self._owed = min(self._owed + due, MAX_LAG * self._per_second)
        self._allowed = min(self._allowed + CATCHING_UP * due * self._clock_rate / self._per_second, self._burst)
        if self._owed > _REPORTED_LAG * self._per_second and not self._is_behind:
            self._is_behind = True
            way = f"catching up at {CATCHING_UP:g} times the pace; lag beyond {MAX_LAG:g} s is dropped"
            report("WARN", f"{self._owed / self._per_second:.1f} s behind the pace: {way}")
        while (
            self._owed > 0.0 and self._allowed >= 1.0 and time.perf_counter() - begun < _BUDGET and not self._is_over()
        ):
            steps = self._server.tick()
            self._owed -= steps
            self._allowed -= 1.0
            self._pacer.did(steps, time.perf_counter())
        ahead = max((1.0 - self._owed) / self._per_second, (1.0 - self._allowed) / CATCHING_UP / self._clock_rate)
        self._inbox.wait(min(_LONGEST_WAIT, max(0.0, ahead - (time.perf_counter() - begun))))

    def _is_over(self) -> bool:
        wanted, sim = self._wanted, self._server.sim
        if wanted.duration is not None and sim.time >= wanted.duration - 1e-6:
            return True
        return (wanted.exit_on_completion and sim.task_is_over) or self._over()


def _transports(network: Network, inbox: Inbox, wanted: ServeOptions, ending: threading.Event) -> Iterator[Transport]:
    if not (wanted.for_ros or wanted.nmea) and wanted.foxglove is None:
        raise CommandError("no transport: --ros1, --rosbridge, --foxglove, --nmea or --ros2 is needed")
    graph = Graph(network, inbox)
    servers: list[Server] = []
    if wanted.ros1:
        from vrx_mj.ros.ros1 import Ros1

        ros1 = Ros1(graph, host=wanted.host)
        ros1.on_shutdown = lambda _why: ending.set()
        servers.append(ros1)
    if wanted.rosbridge is not None:
        from vrx_mj.ros.rosbridge import Rosbridge

        servers.append(Rosbridge(graph, port=wanted.rosbridge, host=wanted.host, origins=wanted.origins))
    if servers:
        yield Wires(graph, servers)
    if wanted.foxglove is not None:
        from vrx_mj.ros.foxglove import Foxglove

        yield Foxglove(port=wanted.foxglove, host=wanted.host)
    if wanted.ros2:
        from vrx_mj.ros.ros2 import Ros2

        yield Ros2(inbox, host=wanted.host, packages=(*PACKAGES, "nmea_msgs") if wanted.nmea else PACKAGES)
    if wanted.nmea is not None:
        yield from (Nmea(boat, port=port, host=wanted.host) for boat, port in wanted.nmea.items())


@contextlib.contextmanager
def _open(transports: Sequence[Transport]) -> Iterator[list[str]]:
    """Start all transports, or none; yields the lines that they print."""
    with contextlib.ExitStack() as stack:
        lines: list[str] = []
        for transport in transports:
            stack.callback(transport.close)
            lines += transport.start()
        yield lines


def _greet(server: RosServer, wanted: ServeOptions, report: Report) -> None:
    sim, tables = server.sim, server.tables
    boats = ", ".join(sim.boats) if len(sim.boats) <= 8 else f"{sim.boats[0]} ... {sim.boats[-1]}"
    count = f"{len(sim.boats)} {'boat' if len(sim.boats) == 1 else 'boats'}, {boats}" if sim.boats else "no boats"
    report("INFO", f"{sim.world.name}: {count}")
    for dialect, table in tables.items():
        names = " by VRX 3's names" if dialect == "vrx3" else ""
        counts = f"{len(table.outputs)} topics out{names}, {len(table.inputs)} in, {len(table.services)} services"
        report("INFO", f"{counts}; cameras and lidars are rendered only while they have subscribers")
    report("INFO", _CMD_VEL_NOTES[wanted.cmd_vel])
    if wanted.lockstep is not None:
        topics = ", ".join(wanted.lockstep) or "/vrx_mj/step alone"
        report("INFO", f"lockstep: time waits for {topics}")
    for topic in wanted.lockstep or ():
        if not any(topic in table.inputs for table in tables.values()):
            report("WARN", f"lockstep: nothing here subscribes to {topic}, so time does not advance")
    if wanted.paused:
        report("INFO", "paused: start time with rosservice call /gazebo/unpause_physics")
    if not is_loopback(wanted.host) and wanted.for_ros:
        report("WARN", f"listening on {wanted.host}: any machine on that network can drive the boats and end the run")
        _show_addresses(wanted, report)
    if os.environ.get("VRX_DEBUG") == "false":
        report("INFO", "VRX_DEBUG=false: no wind and contact topics")


def _show_addresses(wanted: ServeOptions, report: Report) -> None:
    """Show what to type on other machines, or why they cannot reach this one."""
    if not wanted.ros1 and wanted.rosbridge is None:
        return
    if (why := unreachable(wanted.host, "localhost")) is not None:
        report("WARN", why)
        return
    here = announced_address(wanted.host, "localhost")
    if wanted.ros1:
        uri = f"http://{here}:{urlsplit(os.environ.get('ROS_MASTER_URI', '')).port or 11311}"
        report("INFO", f"on the other machine, in a shell: export ROS_MASTER_URI={uri} ROS_IP=ADDRESS_OF_THAT_MACHINE")
        report("INFO", f"in MATLAB: setenv('ROS_IP', 'ADDRESS_OF_THAT_MACHINE'); rosinit('{uri}')")
    if wanted.rosbridge is not None:
        report("INFO", f"roslibpy: roslibpy.Ros('{here}', {wanted.rosbridge})")
