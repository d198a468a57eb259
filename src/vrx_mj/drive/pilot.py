"""Keys to commands of engines, whatever a boat's layout; and keys and status lines in a terminal."""

from __future__ import annotations

import errno
import math
import os
import re
import select
import shutil
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import mul
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self, TextIO, TypeVar

from vrx_mj.errors import UnknownNameError
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import RUDDER
from vrx_mj.runtime.timing import Pause
from vrx_mj.unix import termios, tty

if TYPE_CHECKING:
    from vrx_mj.mjcf.world import World


_KEY_STEP = 0.1
"""Power and turn of one press of an arrow key."""
_VRX_SPEED, _VRX_TURN, _VRX_ANGLE = 0.5, 1.0, 0.1
"""Power, turn, and the step of the angle [rad] with which VRX's keys start."""
_TEN_PERCENT = 1.1, 0.9
"""VRX's factors of 10 % more and 10 % less."""

_TWISTS = {
    "i": (1, 0), ",": (-1, 0), "j": (0, 1), "l": (0, -1),
    "u": (1, 1), "o": (1, -1), "m": (-1, -1), ".": (-1, 1),
}  # fmt: skip
"""teleop_twist_keyboard: signs of power and turn."""
_NUDGES = {"up": (_KEY_STEP, 0.0), "down": (-_KEY_STEP, 0.0), "left": (0.0, _KEY_STEP), "right": (0.0, -_KEY_STEP)}
"""Changes of power and turn by the arrow keys."""
_SCALES = {
    "q": ("speed", "turn", _TEN_PERCENT[0]), "z": ("speed", "turn", _TEN_PERCENT[1]),
    "w": ("speed", "speed", _TEN_PERCENT[0]), "x": ("speed", "speed", _TEN_PERCENT[1]),
    "e": ("turn", "turn", _TEN_PERCENT[0]), "c": ("turn", "turn", _TEN_PERCENT[1]),
    "r": ("angle", "angle", _TEN_PERCENT[0]), "v": ("angle", "angle", _TEN_PERCENT[1]),
}  # fmt: skip
"""Sizes that a key changes, and the factor, as in VRX."""
_FRAME_TIME = 1.0 / 30.0
"""Wall time of a frame [s], where the machine draws that fast."""
_MIN_FORWARD_SHARE = 0.2
"""Engines whose thrust points forward by less than this share are not driven: VRX's lateral one."""
_MIN_ARM = 0.1
"""Arm of the engines' thrusts about the centre of mass below which a boat is steered by turning its engines [m]."""
_FULL_RUDDER = 0.5
"""Angle [rad] of a full turn where engines are turned to steer."""
_STATUS_PERIOD = 0.2
"""Wall time between two renewals of the status [s]."""
_END_LINE, _END_SCREEN = "\x1b[K", "\x1b[J"
"""Erase to the end of the line, and of the screen (ECMA-48)."""
HELP = (
    ("drive", "arrow keys: more or less power, turn left or right; space or k: stop"),
    ("as in VRX", "i j l , u o m .  power and turn at once; h ;  engine angle"),
    ("steps", "q z  power and turn, w x  power, e c  turn, r v  angle: 10 % more, 10 % less"),
    ("boat", "1 ... 9: that boat, n (in a terminal also Tab): the next boat"),
    ("time", "p: pause, + -: twice or half the pace, backspace: reset"),
)
"""Help about the keys."""
KEYS = frozenset("ijl,uom.kh;qzwxecrvnp+=-0123456789") | {"up", "down", "left", "right", "space", "backspace", "tab"}
"""Keys that do something here."""
_WINDOW_KEYS = {
    32: "space", 258: "tab", 259: "backspace", 262: "right", 263: "left", 264: "down", 265: "up", 333: "-", 334: "+",
}  # fmt: skip
"""GLFW's numbers of keys that give no character; the others are numbered by ASCII, letters by capitals."""
_DIGIT_PAD = 320
"""GLFW's number of the zero of the number pad."""
_TERMINAL_KEYS = {
    "\x1b[A": "up", "\x1b[B": "down", "\x1b[C": "right", "\x1b[D": "left",
    "\x1bOA": "up", "\x1bOB": "down", "\x1bOC": "right", "\x1bOD": "left",
    " ": "space", "\t": "tab", "\x7f": "backspace", "\b": "backspace",
}  # fmt: skip
"""Names of keys by the characters that terminals send (ECMA-48, and VT100's application mode)."""
_SEQUENCE = re.compile(r"\x1b\[[0-?]*[ -/]*[@-~]|\x1bO.|.", re.DOTALL)
"""A control sequence or a character of a terminal's input."""


class Pilot:
    """Drives one boat at a time by keys; boats that were driven once keep their last commands."""

    def __init__(self, engines: Mapping[str, Sequence[Engine]], boat: str) -> None:
        self._engines = engines
        self.boat = boat
        """The boat that the keys drive now."""
        self.sizes = {"speed": _VRX_SPEED, "turn": _VRX_TURN, "angle": _VRX_ANGLE}
        """Sizes of the commands of VRX's keys."""
        self.wheels: dict[str, Wheel] = {}
        """Power, turn and angle of the boats that keys have driven."""

    @property
    def wheel(self) -> Wheel:
        """Power, turn and angle of the chosen boat."""
        return self.wheels.get(self.boat, Wheel())

    def change_boats(self, engines: Mapping[str, Sequence[Engine]]) -> None:
        """Boats came or went: keys go on with the one that they drove, or with the first; `boat` is "" without any."""
        self._engines = engines
        self.wheels = {boat: wheel for boat, wheel in self.wheels.items() if boat in engines}
        if self.boat not in engines:
            self.boat = next(iter(engines), "")

    def press(self, key: str) -> bool:
        """Take a key; False if it means nothing here."""
        if not self._engines:
            return False
        wheel = self._wheel_after(key)
        if wheel is not None:
            self.wheels[self.boat] = wheel
            return True
        return self._resize(key) or self._choose_boat(key)

    def commands(self) -> dict[str, dict[str, float]]:
        """Commands of all boats that keys have driven; the others are left alone."""
        return {boat: engine_commands(self._engines[boat], wheel) for boat, wheel in self.wheels.items()}

    def reset(self) -> None:
        """Forget the wheels of all boats, so that they get no commands."""
        self.wheels.clear()

    def _wheel_after(self, key: str) -> Wheel | None:
        """The wheel after a key that turns it."""
        wheel = self.wheel
        if key in _NUDGES:
            power, turn = _NUDGES[key]
            return replace(wheel, power=_share(wheel.power + power), turn=_share(wheel.turn + turn))
        if key in _TWISTS:
            power, turn = _TWISTS[key]
            return replace(wheel, power=power * self.sizes["speed"], turn=turn * self.sizes["turn"])
        if key in {"h", ";"}:
            step = self.sizes["angle"] * (1 if key == ";" else -1)
            limit = max((engine.max_angle for engine in self._engines[self.boat]), default=0.0)
            return replace(wheel, angle=min(max(wheel.angle + step, -limit), limit))
        return replace(wheel, power=0.0, turn=0.0) if key in {"space", "k"} else None

    def _resize(self, key: str) -> bool:
        if key not in _SCALES:
            return False
        *names, factor = _SCALES[key]
        for name in set(names):
            self.sizes[str(name)] *= float(factor)
        return True

    def _choose_boat(self, key: str) -> bool:
        boats = list(self._engines)
        if key in {"tab", "n"}:
            self.boat = boats[(boats.index(self.boat) + 1) % len(boats)]
        elif key.isdecimal() and 1 <= int(key) <= len(boats):
            self.boat = boats[int(key) - 1]
        else:
            return False
        return True


class Motion(NamedTuple):
    """How a boat moves over ground."""

    speed: float
    """Speed over ground [m/s]."""
    heading: float
    """Heading of the bow [compass degrees]."""
    course: float
    """Direction of travel [compass degrees]."""


class Driver(ABC):
    """Takes keys and drives boats: those of a simulation of this process, or of one that is served elsewhere."""

    keeps_velocity = False
    """Whether power and turn are a velocity [m/s] and a turning rate [rad/s] to keep, instead of shares of thrust."""

    def __init__(self, engines: Mapping[str, Sequence[Engine]], boat: str | None) -> None:
        """Drive boats with these engines, beginning with `boat` or the first; UnknownNameError: no such boat."""
        if boat is not None and boat not in engines:
            raise UnknownNameError("boat", boat, engines)
        self.pilot = Pilot(engines, boat or next(iter(engines), ""))

    def press(self, key: str) -> None:
        """Take a key."""
        if key == "p":
            self.pause()
        elif key == "backspace":
            self.reset()
        else:
            self.pilot.press(key)

    def status(self) -> Sequence[tuple[str, str]]:
        """Names and values for the person who drives."""
        wheel, motion = self.pilot.wheel, self.motion()
        power, turn = (" m/s", " rad/s") if self.keeps_velocity else ("", "")
        rows = [
            ("boat", self.pilot.boat or "none"),
            ("power", f"{wheel.power:+.2f}{power}"),
            ("turn", f"{wheel.turn:+.2f}{turn}"),
        ]
        if not self.keeps_velocity:
            rows.append(("angle", f"{math.degrees(wheel.angle):+.0f} deg"))
        if motion is not None:
            rows.append(("speed", f"{motion.speed:.2f} m/s"))
            rows += [(name, f"{getattr(motion, name):.0f} deg compass") for name in ("heading", "course")]
        return (*rows, *self.conditions())

    @abstractmethod
    def pause(self) -> None:
        """Stop time, or let it go on."""

    @abstractmethod
    def reset(self) -> None:
        """Put everything back where it started, and let go of all boats."""

    @abstractmethod
    def advance(self) -> None:
        """Command the boats, and go on to the present moment."""

    @abstractmethod
    def motion(self) -> Motion | None:
        """How the boat moves that the keys drive; None while that is not known."""

    @abstractmethod
    def conditions(self) -> Iterable[tuple[str, str]]:
        """Names and values of what is the same for all boats, such as time."""


_Driver_contra = TypeVar("_Driver_contra", bound=Driver, contravariant=True)


class Console(Protocol[_Driver_contra]):
    """A source of keys, and a place where the result is shown."""

    def pressed_keys(self) -> Iterable[str]:
        """The names of the keys pressed since the last call."""

    def show(self, driver: _Driver_contra, /) -> None:
        """Show the present moment."""


def drive(
    driver: _Driver_contra,
    consoles: Sequence[Console[_Driver_contra]],
    is_open: Callable[[], bool] = lambda: True,
    *,
    sleep: Callable[[float], None] = time.sleep,
    clock: Callable[[], float] = time.perf_counter,
) -> None:
    """Take keys, advance and show, until `is_open` says no. Ctrl-C ends it too, as an exception."""
    while is_open():
        begun = clock()
        for console in consoles:
            for key in console.pressed_keys():
                driver.press(key)
        driver.advance()
        for console in consoles:
            console.show(driver)
        sleep(max(0.001, _FRAME_TIME - (clock() - begun)))


def _share(value: float) -> float:
    """A share within [-1, 1], rounded after adding tenths."""
    return round(_within(value, 1.0), 6)


@dataclass(frozen=True)
class Wheel:
    """Power, turn and steering angle that the keys command of one boat."""

    power: float = 0.0
    """Forward, as a share of full power."""
    turn: float = 0.0
    """Counter-clockwise, as a share of the largest difference between the sides."""
    angle: float = 0.0
    """Steering angle of the engines [rad], counter-clockwise."""


@dataclass(frozen=True)
class Engine:
    """One thruster or rudder that the keys drive."""

    name: str
    forward: float
    """Share of its thrust that points forward; 0 for a rudder."""
    arm: float
    """Arm of its thrust about the centre of mass [m]; positive turns counter-clockwise."""
    aft: bool
    """Whether it is behind the centre of mass."""
    max_angle: float
    """Largest steering angle [rad]."""
    rudder: bool = False
    """Whether it has no propeller."""
    ahead: float = 1.0
    """Command of full power ahead: 1, or a force [N] where commands are newtons."""
    astern: float = 1.0
    """Command of full power astern, above 0: 1, or a force [N] where commands are newtons."""


def engines_of(world: World, boat: str) -> tuple[Engine, ...]:
    """The thrusters and rudders of a boat that the keys drive."""
    centre = world.parameters.hulls[world.boats.index(boat)].body_com
    rows = (
        thruster
        for thruster in world.parameters.thrusters_of(boat)
        if thruster.mapping == RUDDER or not thruster.is_blade
    )
    engines = (_engine(thruster, centre) for thruster in rows)
    return tuple(engine for engine in engines if engine.rudder or abs(engine.forward) > _MIN_FORWARD_SHARE)


def _engine(row: Thruster, centre: Sequence[float]) -> Engine:
    x, y = row.position[0] - centre[0], row.position[1]  # hulls are alike on both sides, cargo is not
    forward, left, _ = (sum(map(mul, line, row.direction)) for line in row.rotation)
    if row.mapping == RUDDER:
        return Engine(row.name, 0.0, 0.0, x < 0.0, row.max_angle, rudder=True)
    astern, ahead = row.command_limits
    return Engine(row.name, forward, x * left - y * forward, x < 0.0, row.max_angle, False, ahead, -astern)


def engine_commands(engines: Sequence[Engine], wheel: Wheel) -> dict[str, float]:
    """Commands of the engines: thrusts in [-1, 1], or in newtons, and their `_angle` in rad.

    Thrusts turn the boat where they have an arm: for two engines side by side, left is power minus turn and right
    is power plus turn, as in VRX's twist2thrust. Else the engines turn to steer. A rudder always does.
    """
    reach = max((abs(engine.arm) for engine in engines), default=0.0)
    commands: dict[str, float] = {}
    for engine in engines:
        by_angle = engine.rudder or reach <= _MIN_ARM
        if not engine.rudder:
            turn = 0.0 if by_angle else wheel.turn * engine.arm / reach
            share = _within(math.copysign(1.0, engine.forward) * wheel.power + turn, 1.0)
            commands[engine.name] = share * (engine.ahead if share > 0.0 else engine.astern)
        if engine.max_angle > 0.0:
            steer = (-_FULL_RUDDER if engine.aft else _FULL_RUDDER) * wheel.turn if by_angle else 0.0
            commands[f"{engine.name}_angle"] = _within(steer + wheel.angle, engine.max_angle)
    return commands


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit) + 0.0


class Terminal:
    """The terminal of this process, in a `with` statement; without a terminal, no key ever comes.

    Ctrl-C works as ever: only echo and the wait for whole lines are switched off.
    """

    def __init__(
        self, stdin: TextIO | None = None, stderr: TextIO | None = None, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._stdin = sys.stdin if stdin is None else stdin
        self._stderr = sys.stderr if stderr is None else stderr
        self._clock, self._pause, self._lines = clock, Pause(), 0
        self._before: Any = None

    @property
    def reads(self) -> bool:
        """Whether keys come from here."""
        return self._before is not None

    def pressed_keys(self) -> Iterator[str]:
        """The names of the keys pressed since the last call."""
        if not self.reads:
            return iter(())
        descriptor, sent = self._stdin.fileno(), b""
        while select.select([descriptor], [], [], 0.0)[0]:
            part = os.read(descriptor, 1024)
            if not part:  # the terminal is gone
                self._restore()
                break
            sent += part
        return terminal_keys(sent.decode("utf-8", "replace"))

    def show(self, driver: Driver) -> None:
        """Renew the status, where somebody sees it: the cursor stays on its first line."""
        now = self._clock()
        if not self._pause.is_over(now) or not self._stderr.isatty():
            return
        lines = status_lines(driver.status(), _columns(self._stderr))
        self._lines = len(lines)
        self._pause.begin(now, _STATUS_PERIOD)
        back = f"\x1b[{len(lines) - 1}A" if len(lines) > 1 else ""
        text = f"{_END_LINE}\n".join(lines)
        self._stderr.write(f"\r{text}{_END_SCREEN}{back}")
        self._stderr.flush()

    def write_line(self, text: str) -> None:
        """Write a line above that of the status."""
        before = f"\r{_END_SCREEN}" if self._lines and self._stderr.isatty() else ""
        self._stderr.write(f"{before}{text}\n")
        self._stderr.flush()
        self._pause.end()

    def __enter__(self) -> Self:
        if _foreground(self._stdin):
            self._before = termios.tcgetattr(self._stdin)
            tty.setcbreak(self._stdin, termios.TCSANOW)
        return self

    def __exit__(self, *_error: object) -> None:
        self._restore()
        self._stderr.write("\n" * self._lines)

    def _restore(self) -> None:
        if self._before is not None:
            termios.tcsetattr(self._stdin, termios.TCSADRAIN, self._before)
            self._before = None


def status_lines(status: Sequence[tuple[str, str]], width: int) -> list[str]:
    """The status in lines that fit a terminal's width [columns]; every name stays with its value."""
    lines: list[str] = []
    for name, value in status:
        item = f"{name} {value}"[: max(0, width - 1)]
        if lines and len(lines[-1]) + 2 + len(item) < width:
            lines[-1] += f"  {item}"
        else:
            lines.append(item)
    return lines


def _columns(stream: TextIO) -> int:
    """Width of the terminal that a stream writes to."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or shutil.get_terminal_size().columns
    except (OSError, ValueError):
        return shutil.get_terminal_size().columns


def _foreground(stream: TextIO | None) -> bool:
    """Whether `stream` is a terminal whose keys this process may read: a job in the background would be stopped.

    roslaunch starts its nodes in sessions of their own, with its terminal: none of them is stopped.
    """
    try:
        if stream is None or not stream.isatty() or not hasattr(os, "tcgetpgrp"):
            return False
        return os.tcgetpgrp(stream.fileno()) == os.getpgrp()
    except ValueError:  # closed, or no file at all
        return False
    except OSError as error:
        return error.errno == errno.ENOTTY  # the terminal of another session


def window_key(code: int) -> str | None:
    """The name of a key of MuJoCo's window by GLFW's number; None for keys without one."""
    if code in _WINDOW_KEYS:
        return _WINDOW_KEYS[code]
    if _DIGIT_PAD <= code < _DIGIT_PAD + 10:
        return str(code - _DIGIT_PAD)
    return chr(code).lower() if ord("!") <= code <= ord("~") else None


def terminal_keys(sent: str) -> Iterator[str]:
    """The names of the keys in what a terminal sent; sequences without a name are left out."""
    for match in _SEQUENCE.finditer(sent):
        key = match.group()
        name = _TERMINAL_KEYS.get(key, key.lower())
        if name in KEYS:
            yield name
