"""Calls of services: the simulation's, those that clients offer to each other, and rosapi's."""

import asyncio
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from vrx_mj.errors import CommandError, UnknownNameError, VrxError
from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.messages import Message
from vrx_mj.ros.network import Network
from vrx_mj.ros.offer import Table
from vrx_mj.ros.rosbridge.kinds import known_types, ros1_name
from vrx_mj.ros.rosbridge.protocol import Options
from vrx_mj.ros.rosbridge.reading import request, taken
from vrx_mj.ros.rosbridge.writing import plain

__all__ = ["LONGEST_CALL", "Caller", "Offered", "Services"]

LONGEST_CALL = 600.0
"""Wall time after which a call has failed, unless it says otherwise, and at most [s]."""
MOST_CALLS = 256
"""Calls of one client that wait, at most."""
MOST_OFFERED = 256
"""Services that one client offers, at most."""


class Caller(Protocol):
    """A client, as far as services are concerned."""

    number: int
    sender: str
    """For people."""

    def send(self, message: dict[str, Any], options: Options = ...) -> None:
        """Send it an operation."""


@dataclass(frozen=True)
class Offered:
    """A service that a client offers."""

    type: str
    name: str
    """As that client writes it."""
    client: Caller


@dataclass(eq=False)
class Pending:
    """A call that waits for its answer."""

    caller: Caller
    identity: str | None
    name: str
    """The service, as the caller writes it."""
    type: str
    options: Options
    server: Caller | None
    """The client that answers; None: the simulation."""
    timer: asyncio.TimerHandle | None = None


class Services:
    """All services, and the calls that wait."""

    def __init__(self, network: Network, inbox: Inbox) -> None:
        self.table = Table()
        self.offered: dict[str, Offered] = {}
        self.built_in: dict[str, tuple[str, Callable[[Any], dict[str, Any]]]] = {}
        """rosapi's: type and answer of each, by name."""
        self._network = network
        self._inbox = inbox
        self._calls: dict[str, Pending] = {}
        self._numbers = itertools.count(1)

    def all(self) -> dict[str, str]:
        """Every service's type, by name."""
        types = {name: type_name for name, (type_name, _) in self.built_in.items()}
        types |= {name: offered.type for name, offered in self.offered.items()}
        types |= {name: ros1_name(service.type) for name, service in self.table.services.items()}
        return dict(sorted(types.items()))

    def advertise(self, name: str, offered: Offered) -> None:
        """Have a client offer a service; CommandError: there is one, or it offers too many."""
        holder = self.offered.get(name)
        if name in self.table.services or name in self.built_in or (holder and holder.client is not offered.client):
            raise CommandError(f"service {name}: it is already offered by {self.host(name)}")
        if sum(other.client is offered.client for other in self.offered.values()) >= MOST_OFFERED:
            raise CommandError(f"service {name}: a client may offer {MOST_OFFERED} services; no more are accepted")
        self.offered[name] = offered

    def unadvertise(self, name: str, client: Caller) -> None:
        """End a client's service; CommandError: it offers none of this name."""
        if name not in self.offered or self.offered[name].client is not client:
            raise CommandError(f"service {name}: this client does not offer it")
        del self.offered[name]

    def host(self, name: str) -> str:
        """Who offers a service, for people."""
        return self.offered[name].client.sender if name in self.offered else "the simulation"

    def call(
        self, name: str, written: str, caller: Caller, arguments: Any, now: float, identity: str | None,
        options: Options, timeout: float,
    ) -> None:  # fmt: skip
        """Call a service at a moment [s]; the answer goes to the caller. A VrxError: it cannot be called, and why."""
        if name in self.built_in:
            respond(caller, written, identity, options, self.built_in[name][1](arguments), True)
            return
        types = self.all()
        if name not in types:
            raise UnknownNameError("service", name, types)
        if sum(call.caller is caller for call in self._calls.values()) >= MOST_CALLS:
            raise CommandError(f"{name}: {MOST_CALLS} calls of this client wait for answers; no more are accepted")
        offered = self.offered.get(name)
        asked = self._asked(arguments, types[name], now, name)
        call = Pending(caller, identity, written, types[name], options, offered.client if offered else None)
        key = f"call_service:{name}:{next(self._numbers)}"
        self._calls[key] = call
        longest = min(timeout or LONGEST_CALL, LONGEST_CALL)
        call.timer = asyncio.get_running_loop().call_later(longest, self._late, key, longest)
        if offered is not None:
            offered.client.send({"op": "call_service", "id": key, "service": offered.name, "args": asked})
        else:
            self._inbox.call(name, asked, caller.sender, self._answer(key))

    def respond(self, key: str, server: Caller, values: Any, result: bool, now: float) -> None:
        """A client's answer to a call; CommandError: no call of this id waits for it, or it is no such response."""
        call = self._calls.get(key)
        if call is None or call.server is not server:
            raise CommandError(f"service_response: no call {key[:80]!r} waits for this client's answer")
        try:
            if result and f"{call.type}Response" in known_types():
                type_name = f"{call.type}Response"
                values = plain(taken({} if values is None else values, type_name, now, call.name), type_name)
        except VrxError as error:
            self._finish(key, f"the response of the service's client is wrong: {error}", False)
            raise
        self._finish(key, values if result or values is not None else "the service failed", result)

    def forget(self, client: Caller) -> None:
        """A client has gone, and what it offered and called with it."""
        self.offered = {name: offered for name, offered in self.offered.items() if offered.client is not client}
        for key, call in list(self._calls.items()):
            if call.caller is client:
                self._take(key)
            elif call.server is client:
                self._finish(key, f"{call.name}: the client that offers it has disconnected", False)

    def _asked(self, arguments: Any, type_name: str, now: float, name: str) -> Any:
        """The request: a message, but of a client's service what JSON holds."""
        known = f"{type_name}Request"
        if name not in self.offered:
            return request(arguments, known, now, name)
        if known not in known_types():
            return {} if arguments is None else arguments
        return plain(request(arguments, known, now, name), known)

    def _answer(self, key: str) -> Callable[[Message | None, str], None]:
        """What the simulation's thread calls."""
        return lambda response, why: self._network.soon(self._answered, key, response, why)

    def _answered(self, key: str, response: Message | None, why: str) -> None:
        if key in self._calls:
            failed = response is None
            values = why if failed else plain(response, f"{self._calls[key].type}Response")
            self._finish(key, values, not failed)

    def _late(self, key: str, seconds: float) -> None:
        self._finish(key, f"{self._calls[key].name}: no answer in {seconds:g} s", False)

    def _finish(self, key: str, values: Any, result: bool) -> None:
        call = self._take(key)
        respond(call.caller, call.name, call.identity, call.options, values, result)

    def _take(self, key: str) -> Pending:
        call = self._calls.pop(key)
        if call.timer is not None:
            call.timer.cancel()
        return call


def respond(caller: Caller, name: str, identity: str | None, options: Options, values: Any, result: bool) -> None:
    """Send the answer to a call."""
    message = {"op": "service_response", "service": name, "values": values, "result": result}
    caller.send(message if identity is None else message | {"id": identity}, options)
