"""A simulation that keeps pace with the clock while somebody watches and drives.

Only this module touches the simulation. Screens and keyboards give names of keys, which are taken between calls of
the compiled loop, and are shown what came of it.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterable
from typing import Protocol

from vrx_mj.drive.pilot import Pilot, engines_of
from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.recording.viewer import Server
from vrx_mj.runtime.run import CONTROL_RATE, Controller, obey
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import stride_of

_FRAME = 1.0 / 30.0
"""Wall time of a frame [s], where the machine draws that fast."""
_BUDGET = 0.1
"""Wall time [s] that the physics of one frame may take: what is owed beyond that is forgotten."""

_Clock = Callable[[], float]
"""Wall time [s] from any start."""


class Console(Protocol):
    """Where keys come from, and what came of them is shown."""

    def pressed(self) -> Iterable[str]:
        """The names of the keys pressed since the last call."""

    def show(self, session: Session) -> None:
        """Show the present moment."""


class Screen(Console, Protocol):
    """Where the simulation is watched."""

    @property
    def server(self) -> Server | None:
        """What serves it to a browser; None for a window."""

    def is_open(self) -> bool:
        """False once it was closed."""

    def restart(self) -> None:
        """Take note that time begins again."""

    def close(self) -> None:
        """Take it away."""


class Session:
    """The simulation, its pilot and its pace."""

    def __init__(
        self,
        sim: Simulation,
        *,
        boat: str | None = None,
        pace: float = 1.0,
        controller: Controller | None = None,
        clock: _Clock = time.perf_counter,
    ) -> None:
        """Make a session.

        Args:
            sim: the simulation.
            boat: the boat that the keys drive first; the first one by default.
            pace: simulated seconds per second.
            controller: what steers the boats that no key has driven; called 10 times a simulated second.
            clock: wall time [s].

        Raises:
            UnknownNameError: no boat has that name.
            CommandError: the pace is not a positive number.
        """
        if boat is not None and boat not in sim.boats:
            raise UnknownNameError("boat", boat, sim.boats)
        if not (math.isfinite(pace) and pace > 0.0):
            raise CommandError(f"invalid pace {pace:g}: a number above 0 is needed, 1 for real time")
        self.sim, self._world = sim, sim.world
        self.pacer = Pacer(sim.timestep, pace, clock())
        self.pilot = Pilot({name: engines_of(sim.world, name) for name in sim.boats}, boat or sim.boats[0])
        self._controller = controller
        self._clock = clock
        self._slice = stride_of(CONTROL_RATE, sim.timestep)
        self._steps = 0
        self.resets = 0
        """How often time began again."""

    def start(self) -> None:
        """Let time begin now: opening a screen takes some."""
        self.pacer.restart(self._clock())

    def press(self, key: str) -> None:
        """Take a key."""
        if key == "p":
            self.pacer.paused = not self.pacer.paused
        elif key in {"+", "=", "-"}:
            self.pacer.change(0.5 if key == "-" else 2.0)
        elif key == "backspace":
            self.reset()
        else:
            self.pilot.press(key)

    def reset(self) -> None:
        """Start again with the same seed; all boats are let go. CommandError: those were others at the start."""
        self.sim.reset(self.sim.seed)
        self._check_boats()
        self.pilot.reset()
        self._steps = 0
        self.resets += 1
        self.pacer.restart(self._clock())

    def advance(self) -> None:
        """Make the steps that are due now, as far as the frame's budget goes.

        Raises:
            CommandError: the controller spawned or removed a boat.
        """
        begun = self._clock()
        due, done = self.pacer.due(begun), 0
        while done < due:
            done += self._step(due - done)
            if self._clock() - begun > _BUDGET:
                break
        self.pacer.did(done, self._clock())

    def _step(self, most: int) -> int:
        """Command, then advance at most to the controller's next call; the steps made."""
        into = self._steps % self._slice
        if into == 0 and self._controller is not None:
            obey(self.sim, self._controller(self.sim.observe(), self.sim.time))
            self._check_boats()
        self.sim.command_all(self.pilot.commands())
        steps = min(most, self._slice - into)
        self.sim.advance(steps)
        self._steps += steps
        return steps

    def _check_boats(self) -> None:
        """Screens have models of the world with which they were opened, and keys drive its boats."""
        if self.sim.world is not self._world:
            shown, now = ", ".join(self._world.boats), ", ".join(self.sim.boats)
            raise CommandError(f"the boats changed from {shown} to {now}: a view needs the boats with which it began")

    def status(self) -> tuple[tuple[str, str], ...]:
        """What a screen writes beside the picture: names and values."""
        pilot, pacer, seen = self.pilot, self.pacer, self.sim.observe()[self.pilot.boat]
        wheel, compass = pilot.wheel, self.sim.world.parameters.compass
        kept = "paused" if pacer.paused else f"{pacer.kept:.2f}"
        return (
            ("boat", pilot.boat),
            ("time", f"{self.sim.time:.1f} s"),
            ("pace", f"{kept} of {pacer.pace:g}"),
            ("power", f"{wheel.power:+.2f}"),
            ("turn", f"{wheel.turn:+.2f}"),
            ("angle", f"{math.degrees(wheel.angle):+.0f} deg"),
            ("speed", f"{seen.speed:.2f} m/s"),
            ("heading", f"{compass(seen.heading):.0f} deg compass"),
            ("course", f"{compass(seen.course):.0f} deg compass"),
        )


def watch(
    session: Session,
    screen: Screen,
    consoles: Iterable[Console] = (),
    *,
    sleep: Callable[[float], None] = time.sleep,
    clock: _Clock = time.perf_counter,
) -> None:
    """Run until the screen is closed. Ctrl-C ends it too, as an exception; the caller closes the screen."""
    sources = (screen, *consoles)
    while screen.is_open():
        begun, resets = clock(), session.resets
        for source in sources:
            for key in source.pressed():
                session.press(key)
        if session.resets != resets:
            screen.restart()
        session.advance()
        for source in sources:
            source.show(session)
        sleep(max(0.001, _FRAME - (clock() - begun)))


PACES = (1.0 / 64.0, 64.0)
"""Slowest and fastest pace, as a multiple of real time."""
LONGEST = 1.0
"""Wall time [s] that is made up for, at most: after a longer halt, time goes on from where it was."""
_WINDOW = 1.0
"""Wall time [s] over which the pace that is really kept is measured."""


class Pacer:
    """Turns wall time into physics steps."""

    def __init__(self, timestep: float, pace: float, now: float) -> None:
        self._timestep = timestep
        self.pace = pace
        """Simulated seconds asked for per second."""
        self.paused = False
        self.restart(now)

    def restart(self, now: float) -> None:
        """Begin again at wall time `now` [s]: nothing is owed, nothing is measured."""
        self._last, self._owed, self._done = now, 0.0, 0
        self._marks: deque[tuple[float, int]] = deque([(now, 0)])

    def due(self, now: float) -> int:
        """Physics steps that are due at wall time `now` [s]."""
        elapsed, self._last = min(now - self._last, LONGEST), now
        if self.paused:
            self._owed = 0.0
            return 0
        self._owed += elapsed * self.pace / self._timestep
        steps = int(self._owed + 1e-9)
        self._owed -= steps
        return steps

    def did(self, steps: int, now: float) -> None:
        """Note that so many steps were made by wall time `now` [s]."""
        self._done += steps
        self._marks.append((now, self._done))
        while len(self._marks) > 2 and self._marks[1][0] <= now - _WINDOW:
            self._marks.popleft()

    @property
    def kept(self) -> float:
        """The pace of about the last second."""
        (begun, before), (now, done) = self._marks[0], self._marks[-1]
        return (done - before) * self._timestep / (now - begun) if now > begun else 0.0

    def change(self, factor: float) -> None:
        """Multiply the pace, within `PACES`."""
        self.pace = min(max(self.pace * factor, PACES[0]), PACES[1])
