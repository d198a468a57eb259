"""A simulation that keeps pace with the clock while somebody watches and drives.

Only this module touches the simulation. Keys are taken between calls of the compiled loop.
"""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable

from vrx_mj.drive.pilot import Driver, Motion, engines_of
from vrx_mj.errors import CommandError
from vrx_mj.runtime.run import CONTROL_RATE, Controller, obey
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import stride_of

_BUDGET = 0.1
"""Largest wall time of the physics of one frame [s]: time that is owed beyond that is dropped."""

_Clock = Callable[[], float]
"""Wall time [s] from any start."""
PACES = (1.0 / 64.0, 64.0)
"""Slowest and fastest pace, as a multiple of real time."""
MAX_LAG = 1.0
"""Largest lag that is made up for [s of wall time]: after a longer halt, time goes on from where it was."""
_PACE_WINDOW = 1.0
"""Wall time over which the actual pace is measured [s]."""


class Session(Driver):
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
        super().__init__({name: engines_of(sim.world, name) for name in sim.boats}, boat)
        if not (math.isfinite(pace) and pace > 0.0):
            raise CommandError(f"invalid pace {pace:g}: a number above 0 is needed, 1 for real time")
        self.sim, self._world = sim, sim.world
        self.pacer = Pacer(sim.timestep, pace, clock())
        self._controller = controller
        self._clock = clock
        self._slice = stride_of(CONTROL_RATE, sim.timestep)
        self._steps = 0
        self.resets = 0
        """How often time began again."""

    def start(self) -> None:
        """Start the clock now, as opening a screen takes time."""
        self.pacer.restart(self._clock())

    def press(self, key: str) -> None:
        """Take a key; some change the pace."""
        if key in {"+", "=", "-"}:
            self.pacer.change(0.5 if key == "-" else 2.0)
        else:
            super().press(key)

    def pause(self) -> None:
        """Stop time, or let it go on."""
        self.pacer.paused = not self.pacer.paused

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

    def motion(self) -> Motion:
        """How the boat moves that the keys drive."""
        seen, compass = self.sim.observe()[self.pilot.boat], self.sim.world.parameters.compass
        return Motion(seen.speed, compass(seen.heading), compass(seen.course))

    def conditions(self) -> Iterable[tuple[str, str]]:
        """Time and pace."""
        kept = "paused" if self.pacer.paused else f"{self.pacer.real_pace:.2f}"
        return ("time", f"{self.sim.time:.1f} s"), ("pace", f"{kept} of {self.pacer.pace:g}")


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
        elapsed, self._last = min(now - self._last, MAX_LAG), now
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
        while len(self._marks) > 2 and self._marks[1][0] <= now - _PACE_WINDOW:
            self._marks.popleft()

    @property
    def real_pace(self) -> float:
        """The pace of about the last second."""
        (begun, before), (now, done) = self._marks[0], self._marks[-1]
        return (done - before) * self._timestep / (now - begun) if now > begun else 0.0

    def change(self, factor: float) -> None:
        """Multiply the pace, within `PACES`."""
        self.pace = min(max(self.pace * factor, PACES[0]), PACES[1])
