"""A client of a rosbridge: topics both ways, and services, by one thread that comes by now and then."""

import contextlib
import itertools
import json
import time
from collections.abc import Callable, Mapping
from typing import Any

from websockets.exceptions import ConnectionClosed, InvalidURI, WebSocketException
from websockets.sync.client import ClientConnection, connect

from vrx_mj.errors import NetworkError

__all__ = ["Bridge"]

Values = Mapping[str, Any]
MOST_INCOMING = 32 << 20
"""Bytes of a message, at most: a world with a long shore takes some 100 kB."""
MOST_WAITING = 64
"""Calls whose answers are waited for, at most."""
OPENING = 5.0
"""Wall time that a connection may take [s]."""


class Bridge:
    """A connection. Once it is lost, `is_open` is False, what is sent is dropped, and a new one is to be made."""

    def __init__(self, url: str) -> None:
        """Connect.

        Raises:
            NetworkError: nothing answers there, or something else than a rosbridge.
        """
        self.url = url
        self._stack = contextlib.ExitStack()
        self._socket = _connected(url, self._stack)
        self._open = True
        self._listeners: dict[str, Callable[[Values], None]] = {}
        self._calls: dict[str, Callable[[Any, bool], None]] = {}
        self._advertised: set[str] = set()
        self._numbers = itertools.count()

    @property
    def is_open(self) -> bool:
        """Whether the connection stands."""
        return self._open

    def subscribe(self, topic: str, kind: str, take: Callable[[Values], None], *, period: float = 0.0) -> None:
        """Have `take` called with the topic's messages, one every `period` [s] of wall time at most."""
        self._listeners[topic] = take
        throttle = round(1000.0 * period)
        self._send({"op": "subscribe", "topic": topic, "type": kind, "throttle_rate": throttle, "queue_length": 1})

    def publish(self, topic: str, kind: str, message: Values) -> None:
        """Send a message."""
        if topic not in self._advertised:
            self._advertised.add(topic)
            self._send({"op": "advertise", "topic": topic, "type": kind})
        self._send({"op": "publish", "topic": topic, "msg": message})

    def call(self, service: str, arguments: Values, take: Callable[[Any, bool], None]) -> None:
        """Call a service; `take` gets the response and True, or what went wrong and False."""
        if len(self._calls) >= MOST_WAITING:
            take(f"{service}: {MOST_WAITING} calls are already waiting", False)
            return
        identity = f"call:{next(self._numbers)}"
        self._calls[identity] = take
        self._send({"op": "call_service", "id": identity, "service": service, "args": arguments})

    def listen(self, seconds: float) -> None:
        """Give what comes within that time to those who wait for it."""
        until = time.monotonic() + seconds
        try:
            while True:
                self._take(self._socket.recv(timeout=max(0.0, until - time.monotonic())))
        except TimeoutError:
            return
        except ConnectionClosed:
            self._open = False

    def close(self) -> None:
        """End the connection, after all that was sent."""
        self._open = False
        self._stack.close()

    def _send(self, operation: Values) -> None:
        try:
            self._socket.send(json.dumps(operation))
        except ConnectionClosed:
            self._open = False

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


def _connected(url: str, stack: contextlib.ExitStack) -> ClientConnection:
    """A connection, which the stack ends."""
    try:
        return stack.enter_context(
            connect(url, max_size=MOST_INCOMING, compression=None, open_timeout=OPENING, proxy=None)
        )
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
