"""Calls to a ROS 1 graph from a program that is no node: parameters of the master, and services."""

import os
import socket
import struct
import time
from typing import Any
from urllib.parse import urlsplit
from xmlrpc.client import Error, ServerProxy

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.messages import Message, decode, encode, service_md5sum
from vrx_mj.ros.ros1.connection import LARGEST_CALL, LARGEST_HEADER, decode_header, encode_header, framed

_MASTER = "http://localhost:11311"
_OPENING = 10.0
"""Wall time that a connection may take [s]."""
_LONGEST_CALL = 120.0
"""Wall time that a service may take [s]."""
_PAUSE = 0.2
"""Wall time between two looks for a service [s]."""


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
        code, _, value = self._ask("getParam", full)
        if code != 1:
            raise CommandError(f"no parameter {full} at the master {self.uri}")
        return value

    def wait(self, service: str, seconds: float) -> None:
        """Wait until a service is there. NetworkError: it does not come."""
        end = time.monotonic() + seconds
        while not self._api(service):
            if time.monotonic() > end:
                raise NetworkError(f"the service {service} did not come within {seconds:g} s at the master {self.uri}")
            time.sleep(_PAUSE)

    def call(self, service: str, kind: str, request: Message) -> Message:
        """Call a service, and return its response.

        Raises:
            NetworkError: it is not there, or the connection fails.
            CommandError: it answers with an error.
        """
        api = self._api(service)
        if not api:
            raise NetworkError(f"no service {service} at the master {self.uri}")
        place = urlsplit(api)
        try:
            with socket.create_connection((place.hostname, place.port), _OPENING) as line:
                line.settimeout(_LONGEST_CALL)
                fields = {"service": service, "md5sum": service_md5sum(kind), "callerid": self.name, "type": kind}
                line.sendall(encode_header(fields))
                answer = decode_header(_frame(line, LARGEST_HEADER))
                if "error" in answer:
                    raise CommandError(f"{service}: {answer['error']}")
                line.sendall(framed(encode(request, f"{kind}Request")))
                done, body = _read(line, 1), _frame(line, LARGEST_CALL)
        except OSError as error:
            raise NetworkError(f"the service {service} at {api}: {error}") from None
        if done != b"\x01":
            raise CommandError(f"{service}: {body.decode('utf-8', 'replace')}")
        return decode(body, f"{kind}Response")

    def _api(self, service: str) -> str:
        """The address of a service; empty without one."""
        code, _, api = self._ask("lookupService", service)
        return str(api) if code == 1 else ""

    def _ask(self, method: str, value: str) -> tuple[int, str, Any]:
        """The master's answer: a code that is 1 if it went well, a line, and the value."""
        try:
            with ServerProxy(self.uri) as master:
                code, line, result = getattr(master, method)(self.name, value)
        except (OSError, Error, ValueError, TypeError) as error:
            raise NetworkError(f"no answer of a ROS master at {self.uri}: {error}") from None
        return int(code), str(line), result


def _frame(line: socket.socket, largest: int) -> bytes:
    """What follows a length of four bytes. NetworkError: it is too long, or the other side ends first."""
    (size,) = struct.unpack("<I", _read(line, 4))
    if size > largest:
        raise NetworkError(f"an answer of {size} bytes is announced; at most {largest} are taken")
    return _read(line, size)


def _read(line: socket.socket, size: int) -> bytes:
    """Exactly so many bytes."""
    parts, left = [], size
    while left:
        part = line.recv(min(left, 1 << 16))
        if not part:
            raise NetworkError(f"the other side closed the connection; {left} of {size} bytes are missing")
        parts.append(part)
        left -= len(part)
    return b"".join(parts)
