"""Driving by keys: what they ask for goes out ten times a second, and a line tells what comes of it."""

import contextlib
import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from vrx_mj.drive.helm.engines import Engine, Wheel, engine_commands
from vrx_mj.drive.helm.keys import HELP
from vrx_mj.drive.helm.pilot import Pilot
from vrx_mj.drive.helm.terminal import Terminal
from vrx_mj.errors import CommandError, NetworkError, UnknownNameError
from vrx_mj.ros.teleop.client import Bridge
from vrx_mj.ros.teleop.scene import TWIST, WORLD, Scene
from vrx_mj.signals import ended_by_signals

__all__ = ["Helmsman", "drive", "topics"]

Say = Callable[[str], None]
PERIOD = 0.1
"""Wall time between two commands of a boat [s]: VRX forgets them after a second."""
LOOK = 0.03
"""Wall time between two looks at the keys [s]."""
RETRY = 1.0
"""Wall time between two tries to connect again [s]."""
GREETING = 5.0
"""Wall time in which a world tells of itself [s]."""
REST = Wheel()
ANGLE = "_angle"
TIME = ("time", "p: pause or resume; backspace: reset")


def drive(url: str, *, boat: str | None = None) -> None:
    """Drive by the keys of this process's terminal, until Ctrl-C.

    Args:
        url: of the rosbridge.
        boat: which one first; the first one by default.

    Raises:
        NetworkError: nothing answers at the URL, or what does is not `vrx-mj serve`.
        UnknownNameError: no boat has that name.
        CommandError: there is no terminal.
    """
    with ended_by_signals(), Terminal() as terminal, contextlib.suppress(KeyboardInterrupt):
        if not terminal.reads:
            raise CommandError(
                "no keys can be read, since standard input is not a terminal; --web serves a page to drive from"
            )
        helmsman = Helmsman(url, boat, say=terminal.say)
        try:
            for name, text in (*(row for row in HELP if row[0] != TIME[0]), TIME):
                terminal.say(f"  {name:<10} {text}")
            terminal.say("Ctrl-C stops the boats that you drove and quits.")
            while True:
                helmsman.turn(terminal.pressed())
                terminal.show(helmsman)
        finally:
            helmsman.close()


class Helmsman:
    """Takes keys and drives, over a connection that may be lost and come again."""

    def __init__(self, url: str, boat: str | None, *, say: Say, clock: Callable[[], float] = time.monotonic) -> None:
        """Connect, and wait for the world to tell of itself; errors are those of `drive`."""
        self._url, self._say, self._clock = url, say, clock
        self._bridge = Bridge(url)
        self._scene = Scene(self._bridge, clock)
        self._told: dict[str, Wheel] = {}
        self._due = self._retry = -math.inf
        try:
            self._greet()
            boats = self._scene.boats or ()
            if boat is not None and boat not in boats:
                raise UnknownNameError("boat", boat, boats)
        except BaseException:
            self._bridge.close()
            raise
        self.pilot = Pilot({}, "")
        self._meet()
        self.pilot.boat = boat or self.pilot.boat
        say(f"connected to {self._scene.name} at {url}: {', '.join(boats) or 'no boats'}")
        if self._scene.keeps_velocity:
            say("cmd_vel sets a velocity to hold: power is in m/s and turn in rad/s")

    def turn(self, keys: Sequence[str] | Any) -> None:
        """Take keys, send what is due, and listen for a moment."""
        pressed = [key for key in keys if self._press(key)]
        if not self._bridge.is_open:
            self._reconnect()
            return
        self._scene.follow()
        if pressed or self._clock() >= self._due:
            self._due = self._clock() + PERIOD
            self._send()
        self._bridge.listen(LOOK)
        self._meet()
        self._note_loss()

    def status(self) -> tuple[tuple[str, str], ...]:
        """Names and values of the line."""
        if not self._bridge.is_open:
            return (("not connected to", self._url),)
        scene, wheel = self._scene, self.pilot.wheel
        units = (" m/s", " rad/s") if scene.keeps_velocity else ("", "")
        rows = [
            ("boat", self.pilot.boat or "none"),
            ("power", f"{wheel.power:+.2f}{units[0]}"),
            ("turn", f"{wheel.turn:+.2f}{units[1]}"),
        ]
        if not scene.keeps_velocity:
            rows.append(("angle", f"{math.degrees(wheel.angle):+.0f} deg"))
        motion = scene.motions.get(self.pilot.boat)
        if motion is not None:
            rows += [("speed", f"{motion.speed:.2f} m/s"), ("heading", f"{round(math.degrees(motion.heading))} deg")]
        if scene.wind_speed is not None and scene.wind_direction is not None:
            rows.append(("wind", f"{scene.wind_speed:.1f} m/s to {scene.wind_direction:.0f} deg"))
        if scene.time is not None:
            rows.append(("time", f"{scene.time:.1f} s{', paused' if scene.is_paused else ''}"))
        return tuple(rows)

    def close(self) -> None:
        """Stop the boats that were driven, and end the connection."""
        for boat, wheel in self._told.items():
            if wheel != REST:
                self._command(boat, REST)
        self._bridge.close()

    def _press(self, key: str) -> bool:
        if not self._bridge.is_open:
            return False
        if key == "p":
            pause = not self._scene.is_paused
            self._call("pause_physics" if pause else "unpause_physics")
            self._scene.note_pause(paused=pause)
        elif key == "backspace":
            for boat in self.pilot.wheels:
                self._command(boat, REST)
            self.pilot.reset()
            self._told.clear()
            self._call("reset_world", "the simulation is reset")
        else:
            return self.pilot.press(key)
        return False

    def _call(self, name: str, done: str = "") -> None:
        def take(answer: Any, well: bool) -> None:
            text = done if well else f"/gazebo/{name} was refused: {answer}"
            if text:
                self._say(text)

        self._bridge.call(f"/gazebo/{name}", {}, take)

    def _send(self) -> None:
        """What is asked for, as long as it is; and once that nothing is asked for any more."""
        for boat, wheel in self.pilot.wheels.items():
            if wheel != REST or self._told.get(boat) != REST:
                self._command(boat, wheel)
                self._told[boat] = wheel

    def _command(self, boat: str, wheel: Wheel) -> None:
        if self._scene.keeps_velocity:
            twist = {"linear": {"x": wheel.power, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": wheel.turn}}
            self._bridge.publish(f"/{boat}/cmd_vel", TWIST, twist)
            return
        for topic, value in topics(boat, self._scene.engines.get(boat, ()), wheel).items():
            self._bridge.publish(topic, "std_msgs/Float32", {"data": value})

    def _meet(self) -> None:
        """Boats may have come or gone."""
        before = self.pilot.boat
        self.pilot.meet(self._scene.engines)
        self._told = {boat: wheel for boat, wheel in self._told.items() if boat in self.pilot.wheels}
        if before and before != self.pilot.boat:
            self._say(f"{before} was removed; the keys drive {self.pilot.boat or 'no boat'} now")

    def _greet(self) -> None:
        until = self._clock() + GREETING
        while not self._scene.is_known:
            self._scene.follow()
            self._bridge.listen(LOOK)
            if self._clock() > until or not self._bridge.is_open:
                raise NetworkError(
                    f"the server at {self._url} is not `vrx-mj serve`: it has no {WORLD} or no boats' topics"
                )

    def _note_loss(self) -> None:
        if not self._bridge.is_open:
            self._say(f"the connection to {self._url} is lost: trying again")

    def _reconnect(self) -> None:
        """Try, if it is time; keys have to be pressed anew afterwards."""
        time.sleep(LOOK)
        if self._clock() < self._retry:
            return
        self._retry = self._clock() + RETRY
        try:
            self._bridge = Bridge(self._url)
        except NetworkError:
            return
        self.pilot.reset()
        self._told.clear()
        self._scene = Scene(self._bridge, self._clock)
        try:
            self._greet()
        except NetworkError:
            self._bridge.close()
            return
        self._say(f"connected again, to {self._scene.name}")
        self._meet()


def topics(boat: str, engines: Sequence[Engine], wheel: Wheel) -> Mapping[str, float]:
    """Values of a boat's topics of thrusters that do what is asked."""
    commands = engine_commands(engines, wheel)
    return {
        f"/{boat}/thrusters/{name.removesuffix(ANGLE)}_thrust_{'angle' if name.endswith(ANGLE) else 'cmd'}": value
        for name, value in commands.items()
    }
