"""Finding the master, or being it."""

import uuid
from collections.abc import Sequence
from dataclasses import dataclass

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.access import Names, is_loopback
from vrx_mj.ros.ros1.address import addresses, announced, bound, is_local
from vrx_mj.ros.ros1.connection_limit import ConnectionLimit
from vrx_mj.ros.ros1.http import BROKEN, LARGEST_REPLY, Proxy, address
from vrx_mj.ros.ros1.http_server import HttpServer
from vrx_mj.ros.ros1.link import FarLink, Link, NearLink
from vrx_mj.ros.ros1.master import Master
from vrx_mj.ros.ros1.notices import Notices
from vrx_mj.ros.ros1.processes import listener, shown_process
from vrx_mj.ros.ros1.xmlrpc import Fault

__all__ = ["Graph", "is_ours", "open_graph"]

PATIENCE = 3.0
"""Wall time that a master may take to answer [s]."""
PARAMETERS = {"/rosdistro": "noetic\n", "/rosversion": "1.16.0\n"}
"""What roscore sets, and tools read."""


@dataclass
class Graph:
    """The master that we are on."""

    host: str
    link: Link
    names: Names
    """Of this machine."""
    master: Master | None = None
    """If it is our own."""
    server: HttpServer | None = None

    async def close(self) -> None:
        """Leave it, and end it if it is our own."""
        self.link.close()
        if self.master is not None:
            await self.master.close()
        if self.server is not None:
            await self.server.close()


async def open_graph(
    uri: str, host: str, node: str, connection_limit: ConnectionLimit, notices: Notices, names: Names
) -> Graph:  # fmt: skip
    """Find the master at a URI; be it if there is none, and the URI is on this machine.

    Raises:
        NetworkError: there is no master and cannot be one, something else answers there, or a node of our name is
            alive on it.
    """
    try:
        where, port = address(uri)
    except CommandError as error:
        raise NetworkError(f"ROS_MASTER_URI: {error}") from None
    proxy = Proxy(uri, LARGEST_REPLY)
    try:
        await proxy.ros("hasParam", node, "/rosdistro", patience=PATIENCE)  # a node would not know what that is
    except ConnectionRefusedError:
        master, hosts = _own(uri, where, port, host, node)
        server = HttpServer("master", master.answer, connection_limit, notices, names)
        await _listen(server, hosts, where, port)
        master.start()
        return Graph(where, NearLink(master), names, master, server)
    except OSError as error:
        raise NetworkError(f"no ROS master at {uri}: {str(error) or 'no answer'}{_who(where, port)}") from None
    except (*BROKEN, Fault) as error:
        raise NetworkError(f"the server at {uri} is not a ROS master: {error}{_who(where, port)}") from None
    finally:
        proxy.close()
    await _refuse_second(uri, node)
    return Graph(where, FarLink(uri), names)


def is_ours(host: str, listening: Sequence[str]) -> bool:
    """Whether one who is told a host gets to where we listen."""
    targets = addresses(host)
    return not targets or listening == ["0.0.0.0"] or any(target in listening for target in targets)


def _own(uri: str, where: str, port: int, host: str, node: str) -> tuple[Master, list[str]]:
    """A master of our own, and the addresses at which it is to listen."""
    if not is_local(where):
        raise NetworkError(
            f"no ROS master answers at {uri}, and {where} is another machine: start roscore there, or unset "
            "ROS_MASTER_URI to start a master here"
        )
    hosts = bound(host)
    if hosts != ["0.0.0.0"]:  # a machine's own name is 127.0.1.1 where Debian has put it into /etc/hosts
        hosts += [one for one in addresses(where) if is_loopback(one) and one not in hosts]
    if not is_ours(where, hosts):
        raise NetworkError(
            f"no ROS master answers at {uri}, and this server listens at {', '.join(hosts)} only: "
            f"give --host {where} or --host 0.0.0.0"
        )
    known = f"http://{where if not is_loopback(where) and where != 'localhost' else announced(host, where)}:{port}/"
    master = Master(known, node)
    for name, value in {**PARAMETERS, "/run_id": str(uuid.uuid4())}.items():
        master.parameters.set(name, value)
    return master, hosts


async def _listen(server: HttpServer, hosts: Sequence[str], where: str, port: int) -> None:
    try:
        await server.start(hosts, port)
    except OSError as error:
        await server.close()
        raise NetworkError(f"ROS 1: cannot open port {port} for the master: {error}{_who(where, port)}") from None


async def _refuse_second(uri: str, node: str) -> None:
    """A node of our name that is alive is not to be taken over."""
    proxy = Proxy(uri, LARGEST_REPLY)
    try:
        api = await proxy.ros("lookupNode", node, node, patience=PATIENCE)
    except (*BROKEN, Fault):
        return  # there is none
    finally:
        proxy.close()
    other = Proxy(str(api), LARGEST_REPLY)
    try:
        pid = await other.ros("getPid", node, patience=PATIENCE)
        where, _ = address(str(api))
    except (*BROKEN, Fault):
        return  # it has died, and its registration has stayed
    finally:
        other.close()
    about = shown_process(pid) if is_local(where) and isinstance(pid, int) else f"pid {pid} on {where}"
    raise NetworkError(f"a simulation is already served there: node {node}, {about}, or with: rosnode kill {node}")


def _who(where: str, port: int) -> str:
    """Which process is in the way, as far as it can be told."""
    pid = listener(port) if is_local(where) else None
    return "" if pid is None else f"; port {port} is held by {shown_process(pid)}"
