"""XML-RPC over HTTP: values as bytes within bounds, what a request must be, and the calling end."""

import asyncio
import contextlib
import re
import socket
import xmlrpc.client
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn
from urllib.parse import urlsplit
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.network import host_of

_MAX_DEPTH = 128
"""Largest number of elements within each other: some forty levels of lists or structures."""
_MOST_ELEMENTS = 400_000
"""Largest number of elements."""
_READ_SIZE = 1 << 15
"""Bytes that are read before others get their turn."""
LARGEST_HEAD = 1 << 14
"""Largest head of a request or of an answer [bytes]."""
_LARGEST_BODY = 1 << 24
"""Largest body of a call or an answer [bytes]: descriptions of robots have some MB."""
LARGEST_REPLY = 1 << 16
"""Largest answer of a node to a call from here [bytes]."""
DEFAULT_MASTER = "http://localhost:11311"
"""Address of roscore on this machine."""
ANSWER_TIMEOUT = 5.0
"""Longest wall time that an answer may take [s]."""
CALL_ERRORS = (OSError, EOFError, TimeoutError, CommandError)
"""Errors of a call that cannot reach the other end, or gets no proper answer."""
_HOST = re.compile(r"[A-Za-z0-9_:%-][A-Za-z0-9_.:%-]{0,252}\Z")
"""A host's name or address."""
_BROWSER_FIELDS = ("origin", "sec-fetch-", "access-control-request-")
"""Prefixes of header fields that only browsers add."""
_CONTENT_TYPE = "text/xml"
"""Content type of XML-RPC."""


class _Unmarshaller(xmlrpc.client.Unmarshaller):
    """Python's, with bounds."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = self._elements = 0

    def start(self, tag: str, attrs: Mapping[str, str]) -> None:
        self._depth += 1
        self._elements += 1
        if self._depth > _MAX_DEPTH or self._elements > _MOST_ELEMENTS:
            raise CommandError(f"more than {_MAX_DEPTH} nested elements, or {_MOST_ELEMENTS} in all")
        super().start(tag, dict(attrs))

    def end(self, tag: str) -> None:
        self._depth -= 1
        super().end(tag)


async def read(body: bytes | bytearray) -> tuple[tuple[object, ...], str | None]:
    """Values and method of a call; of an answer its value and None.

    Raises:
        CommandError: it is not XML-RPC, or beyond the bounds.
        Fault: it is the answer of a call that failed.
    """
    target = _Unmarshaller()
    parser: Any = xmlrpc.client.ExpatParser(target)
    parser._parser.StartDoctypeDeclHandler = _refuse
    try:
        for at in range(0, len(body), _READ_SIZE):
            parser.feed(body[at : at + _READ_SIZE])
            if at:
                await asyncio.sleep(0)
        parser.close()
        return target.close(), target.getmethodname()
    except (CommandError, Fault):
        raise
    except Exception as error:  # Python's raises whatever its conversions raise
        raise CommandError(f"not XML-RPC: {type(error).__name__} {error}"[:200]) from None


def answer_bytes(value: object) -> bytes:
    """An answer; one that cannot be written is a fault."""
    marshalled: Any = (value,)
    try:
        return xmlrpc.client.dumps(marshalled, methodresponse=True).encode("utf-8", "xmlcharrefreplace")
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        return fault_bytes(f"the answer cannot be written: {error}")


def fault_bytes(text: str) -> bytes:
    """An answer that reports a failure."""
    return xmlrpc.client.dumps(Fault(1, text)).encode("utf-8", "xmlcharrefreplace")


def _refuse(*_: object) -> NoReturn:
    raise CommandError("a document type is not allowed in XML-RPC")


async def read_head(reader: asyncio.StreamReader, first: bytes = b"") -> tuple[list[str], dict[str, str]]:
    """First line, in words, and fields by lower-case name; `first` is what was read of it already.

    Raises:
        EOFError: the body has ended.
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


def _body_size(fields: Mapping[str, str], most: int = _LARGEST_BODY) -> int | None:
    """Bytes of the body; None where the length is not given.

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

    def __init__(self, uri: str, largest: int = _LARGEST_BODY) -> None:
        """`largest`: bytes that an answer may have."""
        self.uri, self._largest = uri, largest
        self._lock = asyncio.Lock()
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def call(self, method: str, *values: object, timeout: float = ANSWER_TIMEOUT) -> object:
        """Answer of the other end.

        Raises:
            OSError, EOFError, TimeoutError: it does not.
            CommandError: no XML-RPC, or no URI.
            Fault: the call failed there.
        """
        marshalled: Any = values
        request = xmlrpc.client.dumps(marshalled, method).encode("utf-8", "xmlcharrefreplace")
        async with self._lock, asyncio.timeout(timeout):
            kept = self._streams is not None
            try:
                return await self._exchange(request)
            except (OSError, EOFError):
                self.close()
                if not kept:
                    raise
            return await self._exchange(request)  # the other end had closed it while it was idle

    async def ros(self, method: str, *values: object, timeout: float = ANSWER_TIMEOUT) -> object:
        """The value of an answer as ROS has it, of code, text and value; CommandError where the code is a failure's."""
        answer = await self.call(method, *values, timeout=timeout)
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

    async def _exchange(self, request: bytes) -> object:
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
            size = _body_size(fields, self._largest)
            body = await (reader.readexactly(size) if size is not None else _all(reader, self._largest))
            keep = size is not None and words[0] == "HTTP/1.1" and fields.get("connection", "").lower() != "close"
        finally:
            if not keep:
                self.close()
        values, _ = await read(body)
        return values[0]


async def ask(uri: str, method: str, *values: object, timeout: float = ANSWER_TIMEOUT) -> object:
    """The value that a master or a node answers to a single call; errors are those of `Proxy.ros`."""
    with contextlib.closing(Proxy(uri, LARGEST_REPLY)) as proxy:
        return await proxy.ros(method, *values, timeout=timeout)


async def _all(reader: asyncio.StreamReader, most: int) -> bytes:
    """All bytes up to the end of the stream, at most so many."""
    body = bytearray()
    while part := await reader.read(1 << 16):
        body += part
        if len(body) > most:
            raise CommandError(f"an answer of more than {most} bytes")
    return bytes(body)


class RequestError(CommandError):
    """Why a request is refused, with HTTP's status."""

    def __init__(self, status: str, why: str) -> None:
        self.status = status
        super().__init__(why)

    def __reduce__(self) -> tuple[type["RequestError"], tuple[str, str]]:
        return type(self), (self.status, str(self))


def checked_size(words: Sequence[str], fields: Mapping[str, str], is_ours: Callable[[str], bool]) -> int:
    """Bytes of a request's body; `is_ours` returns whether a host in lower case is this machine.

    Raises:
        RequestError: it is not a call, or a web page sent it.
        CommandError: its body is sent in a way that is not read here, or too large.
    """
    if len(words) != 3 or words[2] not in {"HTTP/1.0", "HTTP/1.1"}:
        raise RequestError("400 Bad Request", f"this is XML-RPC: '{' '.join(words)[:60]}' is not HTTP/1.0 or 1.1")
    if words[0] != "POST":
        raise RequestError("405 Method Not Allowed", f"this is XML-RPC: '{' '.join(words)[:60]}' is not a POST")
    for name, value in fields.items():
        if name.startswith(_BROWSER_FIELDS):
            text = f"a web page may not call ROS, but a browser sent {name}: {ascii(value)[1:100]}"
            raise RequestError("403 Forbidden", text.removesuffix("'"))
    if "host" in fields and not is_ours(host_of(fields["host"])):
        text = "an address or name of this machine is needed; to give it another one, set ROS_HOSTNAME or ROS_IP"
        raise RequestError("421 Misdirected Request", f"invalid Host {ascii(fields['host'])[:100]}: {text}")
    kind = fields.get("content-type", _CONTENT_TYPE)
    if kind.partition(";")[0].strip().lower() != _CONTENT_TYPE:
        raise RequestError(
            "415 Unsupported Media Type", f"invalid Content-Type {ascii(kind)[:100]}: {_CONTENT_TYPE} is needed"
        )
    size = _body_size(dict(fields))
    if size is None:
        raise RequestError("411 Length Required", "a request needs a Content-Length")
    return size
