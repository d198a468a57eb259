"""`vrx-mj doctor WORLD`: the common errors in a world and its fleet, and what hinders serving it to ROS."""

import importlib.util
import os
import socket
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vrx_mj.cli.doctor import Row
from vrx_mj.errors import VrxError
from vrx_mj.packages import install_command

if TYPE_CHECKING:
    from vrx_mj.runtime.simulation import Simulation

__all__ = [
    "Publishers",
    "address_row",
    "command_row",
    "examine_world",
    "extra_row",
    "master_row",
    "port_row",
    "sound",
    "world_rows",
]

EXTRAS = {
    "ros1": ("rosbags", "lz4"), "rosbridge": ("rosbags", "websockets", "cbor2"),
    "rl": ("gymnasium", "pettingzoo"), "ray": ("ray",), "notebook": ("ipykernel", "rerun_notebook"),
    "video": ("av",),
}  # fmt: skip
"""Modules that each extra brings."""
MASTER, MASTER_PORT, ROSBRIDGE_PORT = "http://localhost:11311", 11311, 9090
LOOPBACK = "127.0.0.1"
MASTER_TIMEOUT = 3.0
"""Wall time that a master may take to answer [s]."""
SHOWN = 8
"""Names of boats that are shown, at most."""
HALF = 0.25
"""Half the edge of a square in the middle of a boat that must not be on land [m]."""
Publishers = Sequence[tuple[str, Sequence[str]]]
"""Topics on a master, each with the nodes that publish it."""
WORLD, OVERLAPS, FRAMES, LAND, COMMANDS = "world", "overlaps", "sensor frames", "boats on land", "command topics"


def examine_world(world: str, fleet: str | None) -> list[Row]:
    """Look at a world and a fleet, at the ROS master that answers, and at the ports."""
    rows, sim = world_rows(world, fleet)
    environment = os.environ
    rows += [extra_row(name, modules) for name, modules in EXTRAS.items()]
    if all(map(importlib.util.find_spec, EXTRAS["ros1"])):
        uri = environment.get("ROS_MASTER_URI") or MASTER
        master, publishers = master_row(uri)
        rows += [master, address_row(environment, uri)]
        if sim is not None:
            rows.append(command_row(sim, publishers))
    return [*rows, port_row("ROS master", MASTER_PORT, serves=_is_master(rows)), port_row("rosbridge", ROSBRIDGE_PORT)]


def sound(rows: Sequence[Row]) -> bool:
    """Whether the world and its fleet have none of the problems that were looked for."""
    return not any(row.works == "no" and row.what in {WORLD, OVERLAPS, FRAMES, LAND, COMMANDS} for row in rows)


# The world


def world_rows(world: str, fleet: str | None) -> "tuple[list[Row], Simulation | None]":
    """Compile it and see how the boats are placed and named; the simulation, if there can be one."""
    from vrx_mj.mjcf.compile import compile_world
    from vrx_mj.ros.diagnosis import overlaps, shared_frames
    from vrx_mj.runtime.simulation import Simulation

    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            sim = Simulation(compile_world(world, fleet=fleet))
    except VrxError as error:
        return [Row(WORLD, "does not compile", "no", str(error))], None
    more = f" and {len(sim.boats) - SHOWN} more" if len(sim.boats) > SHOWN else ""
    boats = f"{len(sim.boats)} {'boat' if len(sim.boats) == 1 else 'boats'}: {', '.join(sim.boats[:SHOWN])}{more}"
    rows = [Row(WORLD, f"{sim.world.name}, {boats}", "yes")]
    rows += [Row("warning", str(each.message), "yes") for each in caught]
    rows += _problems(LAND, _on_land(sim), "none")
    rows += _problems(OVERLAPS, overlaps(sim), "none")
    rows += _problems(FRAMES, shared_frames(sim), "each is of one boat")
    return rows, sim


def _problems(what: str, lines: Iterator[str], none: str) -> list[Row]:
    """A row for every problem, what to do after the last colon or semicolon; or one row where all is well."""
    rows = []
    for line in lines:
        cut = max(line.rfind(": "), line.rfind("; "))
        rows.append(Row(what, line[:cut], "no", line[cut + 2 :]))
    return rows or [Row(what, none, "yes")]


def _on_land(sim: "Simulation") -> Iterator[str]:
    from vrx_mj.mjcf.afloat import depth_in_land

    shore = sim.world.parameters.shoreline
    if not shore:
        return
    import numpy as np

    square = HALF * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    seen = sim.observe()
    for boat in sim.boats:
        x, y, z = (float(value) for value in seen[boat].position)
        depth = depth_in_land(square, (x, y, z, 0.0, 0.0, 0.0), shore)
        if depth > 0.0:
            place = f"({x:g}, {y:g}), {depth:.1f} m inside the shore"
            yield f"{boat} starts on land, at {place}: give it another pose, or --nudge"


# ROS


def extra_row(name: str, modules: Sequence[str], find: Callable[[str], object] = importlib.util.find_spec) -> Row:
    """An extra of ours, by the modules that it brings."""
    missing = [module for module in modules if find(module) is None]
    what = f"extra {name}"
    if not missing:
        return Row(what, "installed", "yes")
    return Row(what, f"without {', '.join(missing)}", "not needed", install_command(f"vrx-mj[{name}]"))


def master_row(uri: str, timeout: float = MASTER_TIMEOUT) -> tuple[Row, Publishers]:
    """Whether a ROS master answers at a URI within so long [s], and who publishes there."""
    import asyncio

    from vrx_mj.ros.access import is_local
    from vrx_mj.ros.ros1.xmlrpc import BROKEN, Fault, Proxy, address

    async def asked() -> Any:
        proxy = Proxy(uri)
        try:
            return await proxy.ros("getSystemState", "/vrx_mj_doctor", timeout=timeout)
        finally:
            proxy.close()

    what = "ROS master"
    try:
        host, _ = address(uri)
    except VrxError as error:
        return Row(what, uri, "no", f"ROS_MASTER_URI: {error}"), ()
    try:
        publishers = [(str(topic), [str(node) for node in nodes]) for topic, nodes in asyncio.run(asked())[0]]
    except ConnectionRefusedError:
        if is_local(host):
            return Row(what, f"none at {uri}", "not needed", "vrx-mj serve --ros1 starts one"), ()
        return Row(what, f"none at {uri}", "no", "start roscore there, or unset ROS_MASTER_URI"), ()
    except (*BROKEN, Fault, TypeError, ValueError) as error:
        why = str(error) or "no answer"
        return Row(what, f"no ROS master at {uri}: {why}", "no", "correct ROS_MASTER_URI, or unset it"), ()
    return Row(what, f"answers at {uri}", "yes"), publishers


def command_row(sim: "Simulation", publishers: Publishers) -> Row:
    """Whether somebody publishes commands for boats that are not in this world."""
    from vrx_mj.ros.interface import Inbox, UnknownTopicPublisher
    from vrx_mj.ros.ros_server import RosServer

    messages: list[str] = []
    server = RosServer(sim, [], Inbox(), report=lambda _level, text: messages.append(text))
    try:
        messages.clear()  # those about the world have rows of their own
        for topic, nodes in publishers:
            if topic not in server.table.outputs:
                for node in nodes:
                    server.diagnosis.unknown_publisher(UnknownTopicPublisher(topic, "*", node), server.table)
        heard = sum(topic in server.table.inputs for topic, _ in publishers)
    finally:
        server.close()
    if messages:
        return Row(COMMANDS, f"{len(messages)} published without a subscriber", "no", "; ".join(messages))
    return Row(COMMANDS, f"{heard} have a publisher" if heard else "no publisher", "yes" if heard else "not needed")


def address_row(environment: Mapping[str, str], uri: str) -> Row:
    """Whether the address that other nodes get is one of this machine, and can be reached by those they ask."""
    from vrx_mj.ros.access import addresses, is_local, is_loopback
    from vrx_mj.ros.ros1.xmlrpc import address

    name = next((name for name in ("ROS_HOSTNAME", "ROS_IP") if environment.get(name)), None)
    if name is None:
        return Row("ROS_IP", "not set", "not needed")
    host_name = environment[name]
    shown = (
        f"{host_name}, which goes before ROS_IP" if name == "ROS_HOSTNAME" and environment.get("ROS_IP") else host_name
    )
    if not addresses(host_name):
        return Row(name, f"{shown}: the name has no known address", "no", f"unset {name}, or set ROS_IP instead")
    if not is_local(host_name):
        advice = f"unset {name}, or set it to an address of this machine: 'hostname -I' lists them"
        return Row(name, f"{shown}: no address of this machine", "no", advice)
    try:
        host, _ = address(uri)
    except VrxError:
        host = LOOPBACK
    if all(map(is_loopback, addresses(host_name))) and not is_local(host):
        advice = f"nodes on other machines cannot reach it: set {name} to this machine's address towards {host}"
        return Row(name, f"{shown}, but the master is on {host}", "no", advice)
    return Row(name, shown, "yes")


def port_row(what: str, port: int, *, serves: bool = False, who: Callable[[int], str | None] | None = None) -> Row:
    """Whether a port on loopback is free, or held by a master that is joined."""
    from vrx_mj.ros.network import who_listens

    name = f"port {port} ({what})"
    with socket.socket() as probe:
        if os.name == "posix":
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # who has just ended does not count
        try:
            probe.bind((LOOPBACK, port))
        except OSError:
            pass
        else:
            return Row(name, "free", "yes")
    holder = (who or who_listens)(port) or "a process that cannot be found"
    if serves:
        return Row(name, f"the master that answers: {holder}", "yes")
    other = "another ROS_MASTER_URI" if port == MASTER_PORT else f"--{what} {port + 1}"
    return Row(name, f"held by {holder}", "no", f"stop it, or use {other}")


def _is_master(rows: Sequence[Row]) -> bool:
    """Whether the master that answers is at the usual port."""
    found = [row.found for row in rows if row.what == "ROS master" and row.works == "yes"]
    return bool(found) and found[0].rstrip("/").endswith(f":{MASTER_PORT}")
