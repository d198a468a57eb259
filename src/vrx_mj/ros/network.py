"""The thread in which networks live, what they report, which process holds a port, and who may connect."""

import asyncio
import concurrent.futures
import contextlib
import errno
import ipaddress
import logging
import os
import re
import shlex
import socket
import threading
import time
import urllib.parse
from collections.abc import Callable, Coroutine, Iterable, Sequence
from typing import Any, TypeVar

import psutil

from vrx_mj.errors import LONGEST_LINE, CommandError, shorten

_Result = TypeVar("_Result")
_CLOSE_TIMEOUT = 2.0
"""Wall time that a task which still runs has to end [s]."""
_SHOWN = 120
"""Largest number of characters of a command that is shown."""
_MOST_NOTICES = 1000
"""Largest number of different notices that are remembered; after that no new ones are written."""
_ANY_ORIGIN = "*"
"""Stands for every origin."""
_NULL, _FILE = "null", "file://"
"""Origins of pages that have none: a frame in a sandbox of any site, or a file, in Firefox and in others."""
_DEFAULT_PORTS = {"http": ":80", "https": ":443"}
"""Ports that an origin may leave out."""
_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://(\[[0-9a-f:.]+\]|[a-z0-9_.-]*)(:[0-9]{1,5})?")
"""An origin as browsers send it."""
NOWHERE = "192.0.2.1"
"""An unused address (RFC 5737) by which the route to the world is found; nothing is sent there."""
_VIRTUAL_PREFIXES = ("docker", "br-", "bridge", "veth", "vEthernet", "virbr", "lxc", "cni")
"""Beginnings of the names of interfaces to containers and virtual machines on this machine."""


class Network:
    """An event loop in a daemon thread."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="vrx_mj network", daemon=True)
        self._thread.start()

    def call(self, work: Coroutine[object, None, _Result], timeout: float) -> _Result:
        """Run a coroutine there, and wait for its result; TimeoutError after so long [s]. Not from the loop itself."""
        future = asyncio.run_coroutine_threadsafe(work, self.loop)
        try:
            return future.result(timeout)
        except concurrent.futures.TimeoutError:
            future.cancel()
            raise

    def soon(self, function: Callable[..., object], *arguments: object) -> None:
        """Call a function in the network's thread; once that is closed, nothing happens."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(function, *arguments)

    def close(self) -> None:
        """End all that runs there, and the thread."""
        if not self._thread.is_alive():
            return
        with contextlib.suppress(TimeoutError, concurrent.futures.TimeoutError):
            self.call(end_tasks(), _CLOSE_TIMEOUT)
        self.soon(self.loop.stop)
        self._thread.join(_CLOSE_TIMEOUT)

    def _run(self) -> None:
        self.loop.run_forever()
        self.loop.close()


def begin_task(work: Coroutine[object, None, None], tasks: set[asyncio.Task[None]]) -> None:
    """Begin work as a task, which is one of the `tasks` until it has ended."""
    task: asyncio.Task[None] = asyncio.create_task(work)
    tasks.add(task)
    task.add_done_callback(tasks.discard)


async def end_tasks(tasks: Iterable[asyncio.Task[None]] | None = None) -> None:
    """Cancel tasks, all by default, but not the one that asks, and wait until they have ended."""
    others = {*(asyncio.all_tasks() if tasks is None else tasks)} - {asyncio.current_task()}
    for task in others:
        task.cancel()
    await asyncio.gather(*others, return_exceptions=True)


def who_listens(port: int) -> str | None:
    """Process that listens on a TCP port, since when, and how to stop it; None where none does or can be found."""
    try:
        found = [one.pid for one in psutil.net_connections("tcp") if _listens(one, port)]
    except psutil.AccessDenied:  # macOS shows the connections of one's own processes alone, one by one
        every = psutil.process_iter(["net_connections"])
        found = [each.pid for each in every if any(_listens(one, port) for one in each.info["net_connections"] or ())]
    if not found:
        return None
    pid = next(filter(None, found), None)
    return "a process of another user; 'sudo ss -ltnp' shows it" if pid is None else shown_process(pid)


def refusal(what: str, host: str, port: int, error: Exception) -> str:
    """Why a TCP port cannot be listened on."""
    if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
        return f"{what}: port {port} of {host} is taken by {who_listens(port) or 'an unknown program'}"
    reason = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
    return f"{what}: port {port} of {host} cannot be opened: {reason or 'it timed out'}"


def _listens(connection: Any, port: int) -> bool:
    return bool(connection.status == psutil.CONN_LISTEN and connection.laddr.port == port)


def shown_process(pid: int) -> str:
    """A process of this machine, since when it runs, and how to stop it."""
    stop = f"to stop it: kill {pid}"
    try:
        known = psutil.Process(pid).as_dict(["cmdline", "create_time"])
    except (psutil.Error, ValueError):  # `pid` may be any number that another node gave
        return f"process {pid} (already ended); {stop}"
    text = shlex.join(known["cmdline"] or ())
    line = "".join(character if character.isprintable() else "?" for character in text)
    shown = line if len(line) <= _SHOWN else f"{line[: _SHOWN - 3]}..."
    started = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(known["create_time"]))
    return f"process {pid} ({shown}), since {started}; {stop}"


_logger = logging.getLogger("vrx_mj.ros")


class Notices:
    """Lines for Python's log `vrx_mj.ros` and for a listener."""

    def __init__(self) -> None:
        self.listener: Callable[[str, str], None] | None = None
        """Takes the level, `INFO`, `WARN` or `ERROR`, and the text."""
        self._written: set[tuple[str, str]] = set()

    def write(self, level: str, kind: str, who: str, text: str) -> None:
        """Write a line, unless one of this kind about the same peer was written."""
        if (kind, who) in self._written or len(self._written) >= _MOST_NOTICES:
            return
        self._written.add((kind, who))
        line = shorten(text, LONGEST_LINE)  # parts of it come from unknown publishers
        _logger.log(logging.getLevelNamesMapping()[level], "%s", line)
        if self.listener is not None:
            self.listener(level, line)

    def forget(self, kind: str, who: str) -> None:
        """Forget a line of this kind, so that it is written again."""
        self._written.discard((kind, who))


def host_of(field: str) -> str:
    """The host of a `Host` field, in lower case and without port and brackets; empty for anything else."""
    try:
        parts = urllib.parse.urlsplit(f"//{field.strip()}")
        parts.port  # noqa: B018 -- raises for an invalid one
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

    A page whose owner has a name lead to this machine (DNS rebinding) reaches it by that name, not by one of these.
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
    is refused: it is what every site's frames in a sandbox send, so that to take it would be to take all. So is
    `file://`, any page that was saved to a disk or came by mail: serve it from this machine, or allow it (`null` in
    Firefox).
    """

    def __init__(self, allowed: Iterable[str] = ()) -> None:
        """`allowed`: what `checked_origins` gives."""
        self._allowed = frozenset(allowed)

    def welcome(self, origin: str, host: str) -> bool:
        """Whether a page of `origin` may connect that reached this machine by `host`, as `host_of` gives it."""
        if _ANY_ORIGIN in self._allowed or _normal(origin) in self._allowed:
            return True
        if _ORIGIN.fullmatch(_normal(origin)) is None:
            return False
        scheme, _, rest = _normal(origin).partition("://")
        page = host_of(rest)
        return scheme != "file" and (is_loopback(page) or (page == host and page != ""))


def checked_origins(words: Sequence[str]) -> tuple[str, ...]:
    """Origins as `Origins` takes them.

    Raises:
        CommandError: one is invalid.
    """
    origins = tuple(_normal(word if word == _FILE else word.removesuffix("/")) for word in words)
    for word, origin in zip(words, origins, strict=True):
        is_origin = _ORIGIN.fullmatch(origin) is not None and host_of(origin.partition("://")[2])
        if origin not in {_ANY_ORIGIN, _NULL, _FILE} and not is_origin:
            raise CommandError(
                f"invalid --allow-origin '{word[:200]}': SCHEME://HOST or SCHEME://HOST:PORT is needed, as in "
                "https://app.foxglove.dev; or null, file://, or * for all"
            )
    return origins


def _normal(origin: str) -> str:
    """An origin in lower case, without its scheme's own port, as browsers send it."""
    lower = origin.lower()
    return lower.removesuffix(_DEFAULT_PORTS.get(lower.partition("://")[0], ""))


def _address(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """The address that a host is, an IPv4 address within IPv6 as the former."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return None
    return getattr(address, "ipv4_mapped", None) or address


def is_wildcard(host: str) -> bool:
    """Whether to listen at such a host is to listen everywhere."""
    return host in {"", "0.0.0.0", "::", "*"}


def listening_addresses(host: str) -> list[str]:
    """Addresses to listen at: programs on this machine reach it in any case."""
    if is_wildcard(host):
        return ["0.0.0.0"]
    own = "127.0.0.1" if host == "localhost" else host
    return [own] if is_loopback(own) else [own, "127.0.0.1"]


def announced_address(host: str, master: str) -> str:
    """The address announced to other nodes: ROS_HOSTNAME or ROS_IP, or the host, or that towards the master.

    Without a route to the master it is that of an interface that is up, or else 127.0.0.1.
    """
    given = os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP")
    if given:
        return given
    if not is_wildcard(host):
        return listening_addresses(host)[0]
    targets = addresses(master)
    target = next((one for one in targets if not is_loopback(one)), NOWHERE)
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((target, 9))
            return str(probe.getsockname()[0])
    except OSError:  # no route
        return next(iter(interface_addresses()), "127.0.0.1")


def unreachable(host: str, master: str) -> str | None:
    """Why other machines cannot reach the announced address, and what to do; None if they may.

    None, too, for a host that is loopback: no other machine is meant.
    """
    if not is_wildcard(host) and is_loopback(host):
        return None
    here = announced_address(host, master)
    found = addresses(here)
    if not found or not all(map(is_loopback, found)):
        return None
    name = next((name for name in ("ROS_HOSTNAME", "ROS_IP") if os.environ.get(name)), None)
    if name is not None:
        advice = f"set {name} to this machine's address, or unset it"
        return f"other machines cannot reach {here}, the address set by {name}: {advice}"
    if is_wildcard(host):
        return "no address of this machine that others can reach was found: set ROS_IP or --host"
    return f"other machines cannot reach {here}, the address of --host {host}: set ROS_IP to this machine's address"


def interface_addresses() -> Sequence[str]:
    """IPv4 addresses of interfaces that are up, but for loopback.

    Those that are connected come first, those to containers and virtual machines on this machine last.
    """
    states = psutil.net_if_stats()
    found = [
        (name.startswith(_VIRTUAL_PREFIXES), not states[name].isup, one.address)
        for name, entries in psutil.net_if_addrs().items()
        for one in entries
        if one.family == socket.AF_INET and name in states and (states[name].isup or "up" in states[name].flags)
    ]
    return [one for *_, one in sorted(found, key=lambda row: row[:2]) if not is_loopback(one)]


def own_names(host: str, master_uri: str) -> Names:
    """This machine's names for others: where it listens, what it announces to nodes, and the master URI's host."""
    master = host_of(master_uri.partition("://")[2].partition("/")[0])
    announced_names = [os.environ.get(name, "") for name in ("ROS_HOSTNAME", "ROS_IP")]
    return Names([*announced_names, master, *([] if is_wildcard(host) else [host])])


def addresses(host: str) -> list[str]:
    """IPv4 addresses of a host; none if its name is unknown."""
    try:
        return sorted({str(entry[4][0]) for entry in socket.getaddrinfo(host, None, socket.AF_INET)})
    except (OSError, UnicodeError):
        return []


def is_local(host: str) -> bool:
    """Whether a host's address is one of this machine."""
    if is_loopback(host):
        return True
    for one in addresses(host):
        try:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind((one, 0))
        except OSError:
            continue
        return True
    return False
