"""Where this machine is, as others see it, and which addresses are its own."""

import os
import socket

from vrx_mj.adapters.ros.access import Names, host_of, is_loopback

__all__ = ["addresses", "announced", "bound", "is_local", "is_wildcard", "own_names"]

NOWHERE = "192.0.2.1"
"""An address of nobody (RFC 5737): asked for the way to the world; nothing is sent there."""


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
    """The address that other nodes are told: ROS_HOSTNAME or ROS_IP, or the host, or that towards the master."""
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
    except OSError:
        return "127.0.0.1"


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
