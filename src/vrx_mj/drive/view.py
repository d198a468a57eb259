"""Watch a running simulation and drive its boats: in MuJoCo's window, or in a browser where there is no display."""

import contextlib
from collections.abc import Callable, Iterator
from typing import Protocol

from vrx_mj.draw.display import no_window
from vrx_mj.drive.pilot import HELP, Console, Terminal, drive
from vrx_mj.drive.session import Session
from vrx_mj.recording.viewer import Server, where_to_look
from vrx_mj.runtime.run import Controller
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.signals import ended_by_signals


class Screen(Console[Session], Protocol):
    """A screen on which the simulation is watched."""

    @property
    def server(self) -> Server | None:
        """Server for a browser; None for a window."""

    def is_open(self) -> bool:
        """Whether it is still there."""

    def close(self) -> None:
        """Take it away."""


def view(
    sim: Simulation,
    *,
    boat: str | None = None,
    pace: float = 1.0,
    controller: Controller | None = None,
    browser: bool = False,
    write: Callable[[str], None] = print,
) -> None:
    """Watch and drive until the window is closed, or Ctrl-C.

    Args:
        sim: the simulation.
        boat: the boat that the keys drive first; the first one by default.
        pace: simulated seconds per second.
        controller: what steers the boats that no key has driven.
        browser: use the browser even where there is a display.
        write: is called with lines for the person who watches.

    Raises:
        UnknownNameError: no boat has that name.
        CommandError: the pace is not a positive number, or boats came or went.
        RecordError: the browser's viewer does not start.
    """
    session = Session(sim, boat=boat, pace=pace, controller=controller)
    reason = "--browser" if browser else no_window()
    with ended_by_signals(), Terminal() as terminal, contextlib.suppress(KeyboardInterrupt):
        screen = _open(sim, reason, keys=terminal.reads)
        try:
            for line in _introduction(screen, reason or "", keys=terminal.reads):
                write(line)
            session.start()
            drive(session, [screen, terminal], screen.is_open)
        finally:
            screen.close()
    write(f"stopped at {sim.time:.1f} s of simulated time")


def _open(sim: Simulation, reason: str | None, *, keys: bool) -> Screen:
    """The window, or for a reason the browser; `keys`: whether any are read for it."""
    if reason is None:
        from vrx_mj.drive.window import Window

        return Window(sim)
    from vrx_mj.drive.browser import Browser

    return Browser(sim, keys=keys)


def _introduction(screen: Screen, reason: str, *, keys: bool) -> Iterator[str]:
    """Lines to write before it begins; `keys`: whether they are read from the terminal."""
    if screen.server is not None:
        yield from where_to_look(screen.server, reason)
    if keys or screen.server is None:
        yield from (f"  {name:<10} {text}" for name, text in HELP)
    else:
        yield "No keys are read, since standard input is not a terminal; --thrust or --control steer the boats."
    yield "Press Ctrl-C to stop." if screen.server is not None else "Close the window or press Ctrl-C to stop."
