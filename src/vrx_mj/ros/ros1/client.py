"""Calls to a ROS 1 graph from a program that is not a node: the master's parameters, and services."""

import asyncio
import contextlib
import os
import time
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.messages import Message
from vrx_mj.ros.ros1.subscription import call_service
from vrx_mj.ros.ros1.xmlrpc import BROKEN, Proxy

_MASTER = "http://localhost:11311"
_PAUSE = 0.2
"""Wall time between two questions for a service [s]."""


class Client:
    """A caller of a master's graph, with a name and a namespace."""

    def __init__(self, name: str, uri: str | None = None, namespace: str | None = None) -> None:
        self.uri = uri or os.environ.get("ROS_MASTER_URI") or _MASTER
        given = os.environ.get("ROS_NAMESPACE", "") if namespace is None else namespace
        self.namespace = f"/{given.strip('/')}/" if given.strip("/") else "/"
        self.name = f"{self.namespace}{name}"

    def parameter(self, name: str) -> object:
        """A parameter, whose name is relative to the namespace unless it begins with a slash.

        Raises:
            NetworkError: the master cannot be asked.
            CommandError: it has no such parameter.
        """
        full = name if name.startswith("/") else f"{self.namespace}{name}"
        value = self._ask("getParam", full)
        if value is None:
            raise CommandError(f"no parameter {full} at the master {self.uri}")
        return value

    def wait(self, service: str, seconds: float) -> None:
        """Wait until a service is there; NetworkError: it is not, so long [s]."""
        end = time.monotonic() + seconds
        while not self._api(service):
            if time.monotonic() > end:
                raise NetworkError(f"no service {service} within {seconds:g} s at the master {self.uri}")
            time.sleep(_PAUSE)

    def call(self, service: str, type_name: str, request: Message) -> Message:
        """Call a service, and return its response.

        Raises:
            NetworkError: it is not there, or the connection fails.
            CommandError: it answers with an error.
        """
        api = self._api(service)
        if not api:
            raise NetworkError(f"no service {service} at the master {self.uri}")

        def make(found: str) -> Message:
            if found != type_name:
                raise CommandError(f"{service} is of type {found}, not {type_name}")
            return request

        try:
            return asyncio.run(call_service(api, self.name, service, make))[1]
        except (OSError, EOFError) as error:
            raise NetworkError(f"the service {service} at {api}: {error}") from None

    def _api(self, service: str) -> str:
        """The address of a service; empty without one."""
        return str(self._ask("lookupService", service) or "")

    def _ask(self, method: str, value: str) -> object:
        """The value that the master answers; None where it has none."""

        async def ask() -> object:
            with contextlib.closing(Proxy(self.uri)) as proxy:
                return await proxy.call(method, self.name, value)

        try:
            answer: Any = asyncio.run(ask())
            code, _, result = answer
        except (*BROKEN, Fault, ValueError, TypeError) as error:
            raise NetworkError(f"no answer of a ROS master at {self.uri}: {error}") from None
        return result if code == 1 else None
