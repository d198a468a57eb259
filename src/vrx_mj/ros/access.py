"""Who asks: by which names this machine is called, and of which site a web page is."""

import ipaddress
import re
import socket
import threading
import urllib.parse
from collections.abc import Iterable, Sequence

from vrx_mj.errors import CommandError

__all__ = ["ANY", "Names", "Origins", "checked_origins", "host_of", "is_address", "is_loopback"]

ANY = "*"
"""Stands for every origin."""
NULL = "null"
"""The origin of a page that has none: a frame in a sandbox of any site, or, in Firefox, a file."""
DEFAULT_PORTS = {"http": ":80", "https": ":443"}
_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://(\[[0-9a-f:.]+\]|[a-z0-9_.-]*)(:[0-9]{1,5})?")


def host_of(field: str) -> str:
    """The host of a `Host` field, in lower case and without port and brackets; empty where it is none."""
    try:
        parts = urllib.parse.urlsplit(f"//{field.strip()}")
        parts.port  # noqa: B018 -- raises where it is none
    except ValueError:
        return ""
    plain = parts.netloc == field.strip() and "@" not in field
    return (parts.hostname or "").removesuffix(".") if plain else ""


def is_address(host: str) -> bool:
    """Whether a host is written as an address, which no name server can have lead elsewhere."""
    return _address(host) is not None


def is_loopback(host: str) -> bool:
    """Whether a host is this machine's loopback: an address of it, `localhost`, or a name below that (RFC 6761)."""
    address = _address(host)
    if address is not None:
        return address.is_loopback
    return host == "localhost" or host.endswith(".localhost")


class Names:
    """How others call this machine: by the address that they reach, its host name, and what it is configured to be.

    A page whose owner has a name lead to this machine (DNS rebinding) reaches it by that name, which is none of these.
    """

    def __init__(self, given: Iterable[str] = ()) -> None:
        """`given`: names and addresses that it is configured to have."""
        own = socket.gethostname().lower()
        self._known = {own, f"{own}.local", *(name.lower().removesuffix(".") for name in given if name)}
        threading.Thread(target=self._learn, daemon=True).start()  # a name server may take its time

    def has(self, host: str, reached: str) -> bool:
        """Whether `host`, as `host_of` gives it, is this machine, for one who reached it at an address."""
        if is_loopback(host) or host in self._known:
            return True
        address = _address(host)
        return address is not None and address == _address(reached)

    def _learn(self) -> None:
        self._known = self._known | {socket.getfqdn().lower()}


class Origins:
    """Sites whose pages may connect: those of this machine, those of the machine that serves, and those allowed.

    Browsers send the `Origin` of the page that opens a websocket, and no page can change it; programs send none. `null`
    is refused: it is what every site's frames in a sandbox send, so that to take it would be to take all. Pages from a
    disk are `file://`, but `null` in Firefox: serve them from this machine, or allow `null`.
    """

    def __init__(self, allowed: Iterable[str] = ()) -> None:
        """`allowed`: what `checked_origins` gives."""
        self._allowed = frozenset(allowed)

    def welcome(self, origin: str, host: str) -> bool:
        """Whether a page of `origin` may connect that reached this machine by `host`, as `host_of` gives it."""
        if ANY in self._allowed or _normal(origin) in self._allowed:
            return True
        if _ORIGIN.fullmatch(_normal(origin)) is None:
            return False
        scheme, _, rest = _normal(origin).partition("://")
        page = host_of(rest)
        return scheme == "file" or is_loopback(page) or (page == host and page != "")


def checked_origins(words: Sequence[str]) -> tuple[str, ...]:
    """Origins as `Origins` takes them.

    Raises:
        CommandError: one is invalid.
    """
    origins = tuple(_normal(word.removesuffix("/")) for word in words)
    for word, origin in zip(words, origins, strict=True):
        is_origin = _ORIGIN.fullmatch(origin) is not None and host_of(origin.partition("://")[2])
        if origin not in {ANY, NULL} and not is_origin:
            raise CommandError(
                f"invalid --allow-origin '{word[:200]}': SCHEME://HOST or SCHEME://HOST:PORT is needed, as in "
                "https://app.foxglove.dev; or null, or * for all"
            )
    return origins


def _normal(origin: str) -> str:
    """An origin in lower case, without its scheme's own port, as browsers send it."""
    lower = origin.lower()
    return lower.removesuffix(DEFAULT_PORTS.get(lower.partition("://")[0], ""))


def _address(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """The address that a host is, an IPv4 address within IPv6 as the former."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return None
    return getattr(address, "ipv4_mapped", None) or address
