"""Where this machine is, as others see it, and which addresses are its own."""

import os
import socket
import struct
from collections.abc import Sequence

from vrx_mj.ros.access import Names, host_of, is_loopback

__all__ = [
    "addresses",
    "announced",
    "bound",
    "interface_addresses",
    "is_local",
    "is_wildcard",
    "own_names",
    "unreachable",
]

NOWHERE = "192.0.2.1"
"""An address of nobody (RFC 5737): asked for the way to the world; nothing is sent there."""
GET_FLAGS, GET_ADDRESS = 0x8913, 0x8915
"""SIOCGIFFLAGS and SIOCGIFADDR of Linux (netdevice(7))."""
UP, RUNNING = 0x1, 0x40
"""IFF_UP, and IFF_RUNNING: a cable or a radio is connected."""
VIRTUAL = ("docker", "br-", "veth", "virbr", "lxc", "cni")
"""Beginnings of the names of interfaces to containers and virtual machines on this machine."""


def is_wildcard(host: str) -> bool:
    """Whether to listen at such a host is to listen everywhere."""
    return host in {"", "0.0.0.0", "::", "*"}


def bound(host: str) -> list[str]:
    """Addresses to listen at: programs on this machine reach it in any case."""
    if is_wildcard(host):
        return ["0.0.0.0"]
    own = "127.0.0.1" if host == "localhost" else host
    return [own] if is_loopback(own) else [own, "127.0.0.1"]


def announced(host: str, master: str) -> str:
    """The address announced to other nodes: ROS_HOSTNAME or ROS_IP, or the host, or that towards the master.

    Without a route to the master it is that of an interface that is up, and 127.0.0.1 if there is none.
    """
    told = os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP")
    if told:
        return told
    if not is_wildcard(host):
        return bound(host)[0]
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
    here = announced(host, master)
    found = addresses(here)
    if not found or not all(map(is_loopback, found)):
        return None
    name = next((name for name in ("ROS_HOSTNAME", "ROS_IP") if os.environ.get(name)), None)
    if name is not None:
        advice = f"set {name} to this machine's address, or unset it"
        return f"other machines cannot reach {here}, the address set by {name}: {advice}"
    if is_wildcard(host):
        return "no address of this machine was found for other machines to reach: set ROS_IP or --host to one"
    return f"other machines cannot reach {here}, the address of --host {host}: set ROS_IP to this machine's address"


def interface_addresses() -> Sequence[str]:
    """IPv4 addresses of interfaces that are up, but for loopback.

    Those that are connected come first, those to containers and virtual machines on this machine last.
    """
    try:
        names = [name for _, name in socket.if_nameindex()]
        found = [(name.startswith(VIRTUAL), *one) for name in names if (one := _interface(name)) is not None]
    except (ImportError, OSError):  # not Linux
        found = [(False, False, one) for one in addresses(socket.gethostname())]
    return [one for *_, one in sorted(found, key=lambda row: row[:2]) if not is_loopback(one)]


def _interface(name: str) -> tuple[bool, str] | None:
    """Whether an interface is without connection, and its IPv4 address; None if it has none or is down."""
    from fcntl import ioctl

    request = struct.pack("256s", name.encode()[:15])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            flags = struct.unpack_from("H", ioctl(probe, GET_FLAGS, request), 16)[0]
            answer = ioctl(probe, GET_ADDRESS, request)
        except OSError:
            return None
    return (not flags & RUNNING, socket.inet_ntoa(answer[20:24])) if flags & UP else None


def own_names(host: str, master_uri: str) -> Names:
    """How others may call this machine: as it listens, as nodes are told, and as the URI of the master has it."""
    master = host_of(master_uri.partition("://")[2].partition("/")[0])
    said = [os.environ.get(name, "") for name in ("ROS_HOSTNAME", "ROS_IP")]
    return Names([*said, master, *([] if is_wildcard(host) else [host])])


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
