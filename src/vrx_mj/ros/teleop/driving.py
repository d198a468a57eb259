"""Driving by keys over a rosbridge: the connection, what is known of the world, and what goes out."""

import contextlib
import itertools
import json
import math
import re
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from websockets.exceptions import ConnectionClosed, InvalidURI, WebSocketException
from websockets.sync.client import ClientConnection, connect

from vrx_mj.drive.pilot import HELP, Driver, Engine, Motion, Terminal, Wheel, drive, engine_commands
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.frames import compass, heading
from vrx_mj.ros.parameters import command_topic
from vrx_mj.runtime.timing import Pause
from vrx_mj.signals import ended_by_signals

_Values = Mapping[str, Any]
_MOST_INCOMING = 32 << 20
"""Largest message [bytes]: a world with a long shore takes some 100 kB."""
_MOST_WAITING = 64
"""Largest number of calls that wait for an answer."""
_OPEN_TIMEOUT = 5.0
"""Longest wall time of opening a connection [s]."""
_WORLD = "/vrx_mj/world"
"""Topic of the world's description."""
_TWIST = "geometry_msgs/Twist"
"""Type of velocity commands."""
_COMMAND_TOPIC = re.compile(r"/(.+)/cmd_vel")
"""Topic of a boat's velocity commands."""
_SEEN_PERIOD = 0.2
"""Wall time between two checks of where boats are [s]."""
_ASKED_PERIOD = 1.0
"""Wall time between two requests for the list of boats [s]."""
_PAUSE_TIME = 0.6
"""Wall time without `/clock` after which time counts as paused [s]."""
_SETTLING_TIME = 1.0
"""Wall time after which the clock shows a pause, or its end [s]."""
_COMMAND_PERIOD = 0.1
"""Wall time between two commands of a boat [s]: VRX forgets them after a second."""
_KEY_PERIOD = 0.03
"""Wall time between two checks of the keys [s]."""
RETRY_PERIOD = 1.0
"""Wall time between two attempts to connect again [s]."""
GREETING_TIMEOUT = 5.0
"""Wall time in which a world's chart must arrive [s]."""
_REST = Wheel()
"""Wheel at rest."""
_TIME_HELP = ("time", "p: pause or resume; backspace: reset")
"""Help about the keys of time."""


class Bridge:
    """A connection. Once it is lost, what is sent is dropped, and a new one is to be made."""

    def __init__(self, url: str) -> None:
        """Connect.

        Raises:
            NetworkError: nothing answers there, or something else than a rosbridge.
        """
        self.url = url
        self._stack = contextlib.ExitStack()
        self._socket = self._stack.enter_context(_connection(url))
        self.is_open = True
        """Whether the connection stands."""
        self._listeners: dict[str, Callable[[_Values], None]] = {}
        self._calls: dict[str, Callable[[Any, bool], None]] = {}
        self._advertised: set[str] = set()
        self._numbers = itertools.count()

    def subscribe(self, topic: str, kind: str, take: Callable[[_Values], None], *, period: float = 0.0) -> None:
        """Call `take` with the topic's messages, one every `period` [s] of wall time at most."""
        self._listeners[topic] = take
        throttle = round(1000.0 * period)
        self._send({"op": "subscribe", "topic": topic, "type": kind, "throttle_rate": throttle, "queue_length": 1})

    def publish(self, topic: str, kind: str, message: _Values, *, last: bool) -> None:
        """Send a message; with the `last` one the topic is left to others."""
        if topic not in self._advertised:
            self._advertised.add(topic)
            self._send({"op": "advertise", "topic": topic, "type": kind})
        self._send({"op": "publish", "topic": topic, "msg": message})
        if last:
            self._advertised.remove(topic)
            self._send({"op": "unadvertise", "topic": topic})

    def call(self, service: str, arguments: _Values, take: Callable[[Any, bool], None]) -> None:
        """Call a service; `take` gets the response and True, or what went wrong and False."""
        if len(self._calls) >= _MOST_WAITING:
            take(f"{service}: {_MOST_WAITING} calls are already waiting", False)
            return
        identity = f"call:{next(self._numbers)}"
        self._calls[identity] = take
        self._send({"op": "call_service", "id": identity, "service": service, "args": arguments})

    def listen(self, seconds: float) -> bool:
        """Give what comes within that time to those who wait for it; whether the connection still stands."""
        until = time.monotonic() + seconds
        try:
            while True:
                self._take(self._socket.recv(timeout=max(0.0, until - time.monotonic())))
        except TimeoutError:
            pass
        except ConnectionClosed:
            self.is_open = False
        return self.is_open

    def close(self) -> None:
        """End the connection, after all that was sent."""
        self.is_open = False
        self._stack.close()

    def _send(self, operation: _Values) -> None:
        try:
            self._socket.send(json.dumps(operation))
        except ConnectionClosed:
            self.is_open = False

    def _take(self, text: str | bytes) -> None:
        try:
            came = json.loads(text)
        except ValueError:
            return  # no rosbridge sends this to who did not ask for CBOR
        if not isinstance(came, dict):
            return
        if came.get("op") == "publish" and came.get("topic") in self._listeners:
            self._listeners[came["topic"]](came["msg"])
        elif came.get("op") == "service_response":
            take = self._calls.pop(str(came.get("id")), None)
            if take is not None:
                take(came.get("values"), came.get("result") is True)


def _connection(url: str) -> ClientConnection:
    """A connection to a rosbridge."""
    try:
        return connect(url, max_size=_MOST_INCOMING, compression=None, open_timeout=_OPEN_TIMEOUT, proxy=None)
    except (InvalidURI, ValueError):
        raise NetworkError(
            f"invalid rosbridge address '{url}': ws://HOST:PORT is needed, as in ws://127.0.0.1:9090"
        ) from None
    except (OSError, TimeoutError) as error:
        reason = "it timed out" if isinstance(error, TimeoutError) else str(error.strerror or error)
        raise NetworkError(
            f"no rosbridge answers at {url} ({reason}); start a world there: vrx-mj serve WORLD --rosbridge"
        ) from None
    except WebSocketException as error:
        raise NetworkError(f"the server at {url} is not a rosbridge: {error}") from None


_Clock = Callable[[], float]


class Scene:
    """Filled by the messages of one connection."""

    def __init__(self, bridge: Bridge, clock: _Clock = time.monotonic) -> None:
        self.name = ""
        self.x_from_east = 0.0
        """Direction of the world's x axis [rad], counter-clockwise from east."""
        self.keeps_velocity = False
        """Whether `cmd_vel` commands a velocity that is kept, instead of thrust."""
        self.boats: tuple[str, ...] | None = None
        """None until they are known."""
        self.motions: Mapping[str, Motion] = {}
        self.wind_speed: float | None = None
        self.wind_direction: float | None = None
        """Where it blows to [degrees], counter-clockwise from true east."""
        self.time: float | None = None
        """Simulated [s]."""
        self._engines: dict[str, tuple[Engine, ...]] | None = None
        self._bridge, self._clock = bridge, clock
        self._ticked, self._asked = clock(), -math.inf
        self._meant, self._asked_pause = False, -math.inf
        for topic, kind, take, period in (
            (_WORLD, "std_msgs/String", self._world, 0.0),
            ("/clock", "rosgraph_msgs/Clock", self._tick, _SEEN_PERIOD),
            ("/gazebo/model_states", "gazebo_msgs/ModelStates", self._see, _SEEN_PERIOD),
            ("/vrx/debug/wind/speed", "std_msgs/Float64", partial(self._note_wind, "wind_speed"), _SEEN_PERIOD),
            ("/vrx/debug/wind/direction", "std_msgs/Float64", partial(self._note_wind, "wind_direction"), _SEEN_PERIOD),
        ):
            bridge.subscribe(topic, kind, take, period=period)

    @property
    def is_known(self) -> bool:
        """Whether the world's chart has come, and which boats it has."""
        return self.boats is not None and self._engines is not None

    @property
    def is_paused(self) -> bool:
        """Whether time is paused."""
        now = self._clock()
        return self._meant if now - self._asked_pause < _SETTLING_TIME else now - self._ticked > _PAUSE_TIME

    def note_pause(self, *, paused: bool) -> None:
        """Time was stopped, or goes on: clocks from before may still be on their way."""
        self._meant, self._asked_pause = paused, self._clock()

    @property
    def engines(self) -> dict[str, Sequence[Engine]]:
        """Engines that the keys drive, by boat; none yet for a boat that has just come."""
        known = self._engines or {}
        return {boat: known.get(boat, ()) for boat in self.boats or ()}

    def follow(self) -> None:
        """Ask which boats there are, if it is time; a world that is paused answers too."""
        if self._clock() - self._asked > _ASKED_PERIOD:
            self._asked = self._clock()
            self._bridge.call("/rosapi/topics_for_type", {"type": _TWIST}, self._count)

    def _count(self, answer: Any, well: bool) -> None:
        if well:
            found = [_COMMAND_TOPIC.fullmatch(topic) for topic in answer["topics"]]
            self.boats = tuple(sorted((match.group(1) for match in found if match), key=_by_number))

    def _world(self, message: _Values) -> None:
        chart = json.loads(message["data"])
        self.name, self.keeps_velocity = chart["name"], chart["cmd_vel"] == "velocity"
        self.x_from_east = chart["x_from_east"]
        if self._engines is None:
            self.boats = None  # those of a world that had not offered its topics yet
        self._engines = {
            boat: tuple(Engine(**engine) for engine in row["engines"]) for boat, row in chart["boats"].items()
        }
        self._asked = -math.inf  # boats may have come or gone

    def _tick(self, message: _Values) -> None:
        self.time, self._ticked = message["clock"]["secs"] + 1e-9 * message["clock"]["nsecs"], self._clock()

    def _see(self, message: _Values) -> None:
        rows = zip(message["name"], message["pose"], message["twist"], strict=True)
        self.motions = {name: self._motion(pose["orientation"], twist["linear"]) for name, pose, twist in rows}

    def _motion(self, turn: Mapping[str, float], velocity: Mapping[str, float]) -> Motion:
        yaw = heading(*(turn[axis] for axis in "wxyz"))
        course = math.atan2(velocity["y"], velocity["x"])
        speed = math.hypot(velocity["x"], velocity["y"])
        return Motion(speed, compass(yaw + self.x_from_east), compass(course + self.x_from_east))

    def _note_wind(self, name: str, message: _Values) -> None:
        setattr(self, name, message["data"])


def _by_number(name: str) -> tuple[str, int]:
    """wamv2 before wamv10."""
    stem = name.rstrip("0123456789")
    return stem, int(name[len(stem) :] or 0)


_Say = Callable[[str], None]


def drive_served_world(url: str, *, boat: str | None = None) -> None:
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
            raise CommandError("cannot read keys: standard input is not a terminal; use --web to drive from a page")
        driver = RosbridgeDriver(url, boat, say=terminal.write_line)
        try:
            for name, text in (*(row for row in HELP if row[0] != _TIME_HELP[0]), _TIME_HELP):
                terminal.write_line(f"  {name:<10} {text}")
            terminal.write_line("Ctrl-C stops the boats that you drove and quits.")
            drive(driver, [terminal])
        finally:
            driver.close()


class RosbridgeDriver(Driver):
    """Takes keys and drives, over a connection that may be lost and come again."""

    def __init__(self, url: str, boat: str | None, *, say: _Say, clock: Callable[[], float] = time.monotonic) -> None:
        """Connect, and wait for the world's chart; errors are those of `drive_served_world`."""
        self._url, self._say, self._clock = url, say, clock
        self._bridge = Bridge(url)
        self._scene = Scene(self._bridge, clock)
        self._sent: dict[str, Wheel] = {}
        self._pause, self._retry = Pause(), -math.inf
        try:
            self._greet()
            super().__init__(self._scene.engines, boat)
        except BaseException:
            self._bridge.close()
            raise
        self._meet()
        say(f"connected to {self._scene.name} at {url}: {', '.join(self._scene.engines) or 'no boats'}")
        if self.keeps_velocity:
            say("cmd_vel sets a velocity to hold: power is in m/s and turn in rad/s")

    def advance(self) -> None:
        """Send what is due, and listen for a moment."""
        if not self._bridge.is_open:
            self._reconnect()
            return
        self._scene.follow()
        if self._pause.is_over(self._clock()):
            self._pause.begin(self._clock(), _COMMAND_PERIOD)
            self._send()
        is_open = self._bridge.listen(_KEY_PERIOD)
        self._meet()
        if not is_open:
            self._say(f"lost the connection to {self._url}: trying again")

    def motion(self) -> Motion | None:
        """How the boat moves that the keys drive."""
        return self._scene.motions.get(self.pilot.boat)

    def conditions(self) -> Iterable[tuple[str, str]]:
        """Wind and time, where they are known."""
        scene = self._scene
        if scene.wind_speed is not None and scene.wind_direction is not None:
            toward = compass(math.radians(scene.wind_direction))
            yield "wind", f"{scene.wind_speed:.1f} m/s to {toward:.0f} deg compass"
        if scene.time is not None:
            yield "time", f"{scene.time:.1f} s{', paused' if scene.is_paused else ''}"

    def status(self) -> Sequence[tuple[str, str]]:
        """Names and values for the person who drives."""
        return super().status() if self._bridge.is_open else (("not connected to", self._url),)

    def close(self) -> None:
        """Stop the boats that were driven, and end the connection."""
        for boat, wheel in self._sent.items():
            if wheel != _REST:
                self._command(boat, _REST)
        self._bridge.close()

    def press(self, key: str) -> None:
        """Take a key, while there is a connection; what it changes is sent at once."""
        if self._bridge.is_open:
            super().press(key)
            self._pause.end()

    def pause(self) -> None:
        """Stop time, or let it go on."""
        pause = not self._scene.is_paused
        self._call("pause_physics" if pause else "unpause_physics")
        self._scene.note_pause(paused=pause)

    def reset(self) -> None:
        """Stop the boats that were driven, and put everything back where it started."""
        for boat in self.pilot.wheels:
            self._command(boat, _REST)
        self.pilot.reset()
        self._sent.clear()
        self._call("reset_world", "the simulation is reset")

    def _call(self, name: str, done: str = "") -> None:
        def take(answer: object, well: bool) -> None:
            text = done if well else f"/gazebo/{name} was refused: {answer}"
            if text:
                self._say(text)

        self._bridge.call(f"/gazebo/{name}", {}, take)

    def _send(self) -> None:
        """Send the command while keys ask for one, and once that they no longer do."""
        for boat, wheel in self.pilot.wheels.items():
            if wheel != _REST or self._sent.get(boat) != _REST:
                self._command(boat, wheel)
                self._sent[boat] = wheel

    def _command(self, boat: str, wheel: Wheel) -> None:
        if self.keeps_velocity:
            twist = {"linear": {"x": wheel.power, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": wheel.turn}}
            self._bridge.publish(f"/{boat}/cmd_vel", _TWIST, twist, last=wheel == _REST)
            return
        for name, value in engine_commands(self._scene.engines.get(boat, ()), wheel).items():
            self._bridge.publish(command_topic(boat, name), "std_msgs/Float32", {"data": value}, last=wheel == _REST)

    def _meet(self) -> None:
        """Boats may have come or gone."""
        before, self.keeps_velocity = self.pilot.boat, self._scene.keeps_velocity
        self.pilot.change_boats(self._scene.engines)
        self._sent = {boat: wheel for boat, wheel in self._sent.items() if boat in self.pilot.wheels}
        if before and before != self.pilot.boat:
            self._say(f"{before} was removed; the keys drive {self.pilot.boat or 'no boat'} now")

    def _greet(self) -> None:
        until = self._clock() + GREETING_TIMEOUT
        while not self._scene.is_known:
            self._scene.follow()
            self._bridge.listen(_KEY_PERIOD)
            if self._clock() > until or not self._bridge.is_open:
                raise NetworkError(
                    f"the server at {self._url} is not `vrx-mj serve`: it has no {_WORLD} or no boats' topics"
                )

    def _reconnect(self) -> None:
        """Try, if it is time; keys have to be pressed anew afterwards."""
        time.sleep(_KEY_PERIOD)
        if self._clock() < self._retry:
            return
        self._retry = self._clock() + RETRY_PERIOD
        try:
            self._bridge = Bridge(self._url)
        except NetworkError:
            return
        self.pilot.reset()
        self._sent.clear()
        self._scene = Scene(self._bridge, self._clock)
        try:
            self._greet()
        except NetworkError:
            self._bridge.close()
            return
        self._say(f"connected again, to {self._scene.name}")
        self._meet()
