"""A trial that a program sails: the world served to it alone, on a ROS master or to ArduPilot's SITL."""

from __future__ import annotations

import contextlib
import math
import os
import socket
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vrx_mj.arrays import FloatArray
from vrx_mj.autopilot import MAVLINK_PORT, PORT, PORT_STEP, ArduPilot, ports_of
from vrx_mj.campaign.plan import Cell, Serving
from vrx_mj.campaign.program import MAX_ENDING_TIME, Program, signal_name
from vrx_mj.campaign.results import Stopwatch, Tracks
from vrx_mj.constants import EARLY
from vrx_mj.errors import NetworkError, VrxError
from vrx_mj.runtime.run import CONTROL_RATE, Summary, planned_duration, summarize
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import Schedule

if TYPE_CHECKING:
    from vrx_mj.ros.interface import Transport

_LOOPBACK = "127.0.0.1"
PORTS = range(21311, 29311)
"""Ports of masters and rosbridges: below those that systems assign by themselves."""
_SITL_INSTANCES = range(1, 250)
"""Numbers of SITLs, by which their ports are 10 apart."""


def sail_by_program(
    cell: Cell,
    serving: Serving,
    sim: Simulation,
    folder: Path,
    duration: float | None,
    wall: float,
    tracks: Tracks,
    stopwatch: Stopwatch,
) -> Summary:
    """Sail a world by the program that the cell names, until the task is over or for a duration [s].

    The process must be the trial's own: its environment becomes that of the program.

    Args:
        cell: the program, the world and the seed.
        serving: how the world is served.
        sim: the world, at its start.
        folder: of the trial; ROS's home and logs go there.
        duration: simulated time [s]; None: until the task is over.
        wall: time [s] that it may take from the start of the program on.
        tracks: take where boats are.
        stopwatch: takes how far it is.

    Raises:
        VrxError: the program failed, or is not finished in time; whatever `serve` raises.
    """
    begun = time.perf_counter()
    os.environ.update(VRX_MJ_WORLD=cell.world, VRX_MJ_SEED=str(cell.seed), VRX_MJ_FOLDER=str(folder.resolve()))
    pilot = _Pilot(cell.controller, sim, duration, wall, tracks, stopwatch)
    try:
        if serving.ardupilot:
            _serve_sitl(sim, serving, pilot)
        else:
            _serve_ros(sim, serving, folder, pilot)
    finally:
        pilot.end()
    steps = round(sim.time / sim.timestep)
    return summarize(sim, steps, time.perf_counter() - begun, pilot.way, interrupted=not pilot.finished)


def _serve_ros(sim: Simulation, serving: Serving, folder: Path, pilot: _Pilot) -> None:
    from vrx_mj.ros.ros1 import Ros1
    from vrx_mj.ros.serve import ServeOptions, serve

    def start(transports: Sequence[Transport]) -> None:
        for transport in transports:
            if isinstance(transport, Ros1):
                transport.settle()  # the master knows every topic
        pilot.start()

    with claimed_port() as master, claimed_port() as bridge:
        rosbridge = bridge if serving.rosbridge else None
        os.environ.pop("ROS_HOSTNAME", None)  # it would go before ROS_IP
        os.environ.update(surroundings(folder, master, rosbridge))
        wanted = ServeOptions(ros1=True, rosbridge=rosbridge, rate=serving.rate, lockstep=serving.lockstep)
        serve(sim, wanted, report=_write_line, status=pilot.note, ready=start, over=pilot.is_over)


def _serve_sitl(sim: Simulation, serving: Serving, pilot: _Pilot) -> None:
    with _autopilots(sim, serving.rate) as autopilots:
        for number, (boat, words) in enumerate(autopilots.arguments.items()):
            _, port = autopilots.addresses[boat]
            mavlink = f"tcp:{_LOOPBACK}:{port - PORT + MAVLINK_PORT}"
            suffix = f"_{number}" if number else ""
            os.environ.update({f"VRX_MJ_ARDUPILOT{suffix}": words, f"VRX_MJ_MAVLINK{suffix}": mavlink})
        pilot.start()
        autopilots.run(over=pilot.is_over)


def _autopilots(sim: Simulation, rate: float | None) -> ArduPilot:
    """Listener for the SITLs of all boats, at ports whose SITLs' MAVLink ports are free too."""
    for instance in _SITL_INSTANCES:
        ports = ports_of(sim, str(PORT + PORT_STEP * instance))
        with contextlib.suppress(NetworkError), contextlib.ExitStack() as probes:
            autopilots = ArduPilot(sim, ports, rate=rate, report=_write_line)
            try:
                for port in ports.values():
                    probes.enter_context(socket.socket()).bind((_LOOPBACK, port - PORT + MAVLINK_PORT))
            except OSError:
                autopilots.close()
                continue
            return autopilots
    raise NetworkError(f"no ports are free for ArduPilot's SITL of instances up to {_SITL_INSTANCES[-1]}")


def surroundings(folder: Path, master: int, rosbridge: int | None) -> dict[str, str]:
    """Environment variables of ROS for a trial's program, whose master and rosbridge are at these ports."""
    home = folder.resolve() / "ros"
    (home / "log").mkdir(parents=True, exist_ok=True)
    found = {
        "ROS_MASTER_URI": f"http://{_LOOPBACK}:{master}",
        "ROS_IP": _LOOPBACK,
        "ROS_HOME": str(home),
        "ROS_LOG_DIR": str(home / "log"),
    }
    if rosbridge is not None:
        found["VRX_MJ_ROSBRIDGE_PORT"] = str(rosbridge)
        found["VRX_MJ_ROSBRIDGE_URL"] = f"ws://{_LOOPBACK}:{rosbridge}"
    return found


@contextlib.contextmanager
def claimed_port() -> Iterator[int]:
    """A free TCP port on loopback that no other trial takes meanwhile: the UDP port of that number is held."""
    for port in PORTS:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as claim:
            try:
                claim.bind((_LOOPBACK, port))
                with socket.socket() as probe:
                    probe.bind((_LOOPBACK, port))
            except OSError:
                continue
            yield port
            return
    raise NetworkError(f"no port of {PORTS.start} to {PORTS.stop - 1} is free on {_LOOPBACK}")


class _Pilot:
    """The program, from when the world is served until the trial is over."""

    def __init__(
        self, line: str, sim: Simulation, duration: float | None, wall: float, tracks: Tracks, stopwatch: Stopwatch
    ) -> None:
        self._line, self._sim, self._tracks, self._stopwatch = line, sim, tracks, stopwatch
        self._to_task, self._last = (
            duration is None,
            sim.time + (planned_duration(sim) if duration is None else duration),
        )
        self._wall, self._deadline = wall, math.inf
        self._program: Program | None = None
        self._status, self._schedule = "", Schedule()
        self._places: dict[str, FloatArray] = {}
        self.way: dict[str, float] = dict.fromkeys(sim.boats, 0.0)
        """Way of every boat over ground [m], sampled at the control rate."""
        self.finished = False

    def start(self) -> None:
        """Start it; from now on the trial's time runs."""
        self._stopwatch.allow(self._wall + MAX_ENDING_TIME)
        self._deadline = time.monotonic() + self._wall
        self._program = Program(self._line, os.environ, sys.stdout.buffer)
        self._stopwatch.lead(self._program.group)

    def note(self, status: str) -> None:
        """Keep the latest line of status."""
        self._status = status

    def is_over(self) -> bool:
        """Whether the trial is, and then the program is ended.

        Raises:
            VrxError: the program failed, or the trial has taken too long.
        """
        sim, program = self._sim, self._program
        assert program is not None
        self._stopwatch.reach(sim.time)
        self._track()
        if sim.time >= self._last - EARLY or (self._to_task and sim.task_is_over):
            self.finished = True
            self.end()
            return True
        code = program.code
        if code:
            self.end()
            raise VrxError(f"the program {_end_text(code)}; {_last_lines(program.last_lines)}")
        if time.monotonic() > self._deadline:
            self.end()
            state = f" ({self._status})" if self._status else ""
            raise VrxError(
                f"not finished after {self._wall:g} s of wall time{state}; {_last_lines(program.last_lines)}"
            )
        return False

    def end(self) -> None:
        """End the program, if it runs."""
        if self._program is not None:
            self._program.end()
            self._stopwatch.lead(0)

    def _track(self) -> None:
        if not self._schedule.take("way", CONTROL_RATE, self._sim.time):
            return
        seen = self._sim.observe()
        for boat in self._sim.boats:
            place = seen[boat].position
            before = self._places.get(boat, place)
            self.way[boat] = self.way.get(boat, 0.0) + math.dist(place[:2], before[:2])
            self._places[boat] = place
            self._tracks.add(boat, place)


def _end_text(code: int) -> str:
    """An exit code in words."""
    if code > 0:
        return f"ended with exit code {code}"
    return f"was ended by {signal_name(-code)}"


def _last_lines(lines: str) -> str:
    return f"its last lines: {lines}" if lines else "it printed nothing"


def _write_line(level: str, text: str) -> None:
    sys.stdout.write(f"[{level}] {text}\n")
