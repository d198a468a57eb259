"""XML-RPC over HTTP/1.0 and 1.1: what is common to both ends, and the calling end."""

import asyncio
import contextlib
import re
import socket
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlsplit

from vrx_mj.errors import CommandError
from vrx_mj.ros.ros1.xmlrpc import call_bytes, read

__all__ = ["BROKEN", "LARGEST_BODY", "LARGEST_REPLY", "Proxy", "address", "body_size", "read_head"]

LARGEST_HEAD = 1 << 14
LARGEST_BODY = 1 << 24
"""Bytes of a call or an answer, at most: descriptions of robots have some MB."""
LARGEST_REPLY = 1 << 16
"""Bytes of what a node answers to what it is asked here, at most."""
PATIENCE = 5.0
"""Wall time that an answer may take [s]."""
BROKEN = (OSError, EOFError, TimeoutError, CommandError)
"""What a call raises if the other end cannot be reached, or gives no proper answer."""

_HOST = re.compile(r"[A-Za-z0-9_:%-][A-Za-z0-9_.:%-]{0,252}\Z")


async def read_head(reader: asyncio.StreamReader, first: bytes = b"") -> tuple[list[str], dict[str, str]]:
    """First line, in words, and fields by lower-case name; `first` is what was read of it already.

    Raises:
        EOFError: there is none any more.
        CommandError: it is invalid.
    """
    try:
        raw = first + await reader.readuntil(b"\r\n\r\n")
    except asyncio.LimitOverrunError:
        raise CommandError(f"an HTTP head of more than {LARGEST_HEAD} bytes") from None
    lines = raw.decode("latin-1").split("\r\n")
    fields: dict[str, str] = {}
    for line in filter(None, lines[1:]):
        name, colon, value = line.partition(":")
        if not colon or fields.get(name.lower(), value.strip()) != value.strip():
            raise CommandError("an HTTP field without ':', or twice with different values")
        fields[name.lower()] = value.strip()
    words = lines[0].split(" ", 2)
    if len(words) < 2:
        raise CommandError("not HTTP")
    return words, fields


def body_size(fields: Mapping[str, str], most: int = LARGEST_BODY) -> int | None:
    """Bytes of the body; None where it is not said.

    Raises:
        CommandError: it is sent in a way that is not read here, or too large.
    """
    if "transfer-encoding" in fields or fields.get("content-encoding", "identity") != "identity":
        raise CommandError("only plain bodies in one piece are supported")
    text = fields.get("content-length")
    if text is None:
        return None
    if not (text.isascii() and text.isdigit() and len(text) < 12 and int(text) <= most):
        raise CommandError(f"invalid Content-Length {text[:20]!r}: a whole number of at most {most} is needed")
    return int(text)


def address(uri: str, scheme: str = "http") -> tuple[str, int]:
    """Host and port of a URI.

    Raises:
        CommandError: it has none.
    """
    try:
        parts = urlsplit(uri)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    host = parts.hostname or ""
    if parts.scheme != scheme or not port or not _HOST.match(host) or any(len(one) > 63 for one in host.split(".")):
        raise CommandError(f"invalid URI {uri[:100]!r}: {scheme}://host:port is needed")
    return host, port


class Proxy:
    """Calls to one XML-RPC server, one at a time, over a connection that is kept."""

    def __init__(self, uri: str, largest: int = LARGEST_BODY) -> None:
        """`largest`: bytes that an answer may have."""
        self.uri, self._largest = uri, largest
        self._lock = asyncio.Lock()
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def call(self, method: str, *values: Any, patience: float = PATIENCE) -> Any:
        """What the other end answers.

        Raises:
            OSError, EOFError, TimeoutError: it does not.
            CommandError: no XML-RPC, or no URI.
            Fault: it says so.
        """
        request = call_bytes(method, values)
        async with self._lock, asyncio.timeout(patience):
            kept = self._streams is not None
            try:
                return await self._exchange(request)
            except (OSError, EOFError):
                self.close()
                if not kept:
                    raise
            return await self._exchange(request)  # the other end had closed it while it was idle

    async def ros(self, method: str, *values: Any, patience: float = PATIENCE) -> Any:
        """The value of an answer as ROS has it, of code, text and value; CommandError where the code is no success."""
        answer = await self.call(method, *values, patience=patience)
        if not isinstance(answer, list) or len(answer) != 3 or not isinstance(answer[0], int):
            raise CommandError(f"{self.uri} does not answer {method} as ROS does")
        if answer[0] != 1:
            raise CommandError(f"{method}: {answer[1]}")
        return answer[2]

    def close(self) -> None:
        """Close the connection; another call opens it again."""
        if self._streams is not None:
            with contextlib.suppress(RuntimeError):
                self._streams[1].transport.abort()
            self._streams = None

    async def _exchange(self, request: bytes) -> Any:
        host, port = address(self.uri)
        if self._streams is None:
            self._streams = await asyncio.open_connection(host, port, limit=LARGEST_HEAD, family=socket.AF_INET)
        reader, writer = self._streams
        keep = False
        try:
            head = (
                f"POST /RPC2 HTTP/1.1\r\nHost: {host}:{port}\r\nUser-Agent: vrx_mj\r\n"
                f"Content-Type: text/xml\r\nContent-Length: {len(request)}\r\n\r\n"
            )
            writer.write(head.encode("latin-1", "replace") + request)
            words, fields = await read_head(reader)
            if not words[0].startswith("HTTP/") or words[1] != "200":
                raise CommandError(f"{self.uri} answers '{' '.join(words)[:60]}' instead of XML-RPC")
            size = body_size(fields, self._largest)
            body = await (reader.readexactly(size) if size is not None else _all(reader, self._largest))
            keep = size is not None and words[0] == "HTTP/1.1" and fields.get("connection", "").lower() != "close"
        finally:
            if not keep:
                self.close()
        values, _ = await read(body)
        return values[0]


async def _all(reader: asyncio.StreamReader, most: int) -> bytes:
    """Up to the end of the stream."""
    body = bytearray()
    while part := await reader.read(1 << 16):
        body += part
        if len(body) > most:
            raise CommandError(f"an answer of more than {most} bytes")
    return bytes(body)
