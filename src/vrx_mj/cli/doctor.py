"""`vrx-mj doctor`: what is installed, what of it works, the common errors in a world, and what to do about them.

Each check takes what it looks at as arguments, and makes one row. Nothing is believed that can be tried.
"""

import contextlib
import importlib
import importlib.metadata
import importlib.util
import os
import platform
import re
import shutil
import socket
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rich.text import Text
from typer import echo

from vrx_mj.cli import EXTRAS, PACKAGES, missing_modules
from vrx_mj.cli.screen import print_table, show
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import VrxError, first_names
from vrx_mj.packages import install_command, install_extra
from vrx_mj.runtime.limits import core_share, free_memory, processor

if TYPE_CHECKING:
    from vrx_mj.draw.display import Attempt
    from vrx_mj.runtime.simulation import Simulation

_Works = Literal["yes", "no", "not needed"]

_MODULES = {
    "mujoco": "mujoco", "numba": "numba", "numpy": "numpy", "rerun-sdk": "rerun", "pydantic": "pydantic",
    "lxml": "lxml", "trimesh": "trimesh",
}  # fmt: skip
"""Packages that are shown, and the modules they bring."""
_OLDEST_PYTHON = (3, 11)
_DRAWS = {"egl": "cameras, by GPU or CPU (egl)", "osmesa": "cameras, by CPU (osmesa)", "glfw": "window (glfw)"}
"""MuJoCo's ways to draw, as MUJOCO_GL names them."""
_FOR_WINDOWS = "libgl1 libgl1-mesa-dri"
"""What Debian and Ubuntu call the packages that a window needs."""
_GB = 1e9
_MASTER, _MASTER_PORT, _ROSBRIDGE_PORT = "http://localhost:11311", 11311, 9090
_LOOPBACK = "127.0.0.1"
_MASTER_TIMEOUT = 3.0
"""Wall time that a master may take to answer [s]."""
_SHOWN_BOATS = 8
"""Number of boats that are named."""
_HALF = 0.25
"""Half the edge of a square in the middle of a boat that must not be on land [m]."""
_WORLD, _OVERLAPS, _FRAMES, _LAND, _COMMANDS = "world", "overlaps", "sensor frames", "boats on land", "command topics"


@dataclass(frozen=True)
class Row:
    """One thing that was looked at."""

    what: str
    found: str
    works: _Works = "yes"
    advice: str = ""
    core: bool = False
    """Whether nothing runs without it."""


def healthy(rows: list[Row]) -> bool:
    """Whether what the core needs works."""
    return not any(row.core and row.works == "no" for row in rows)


def examine() -> list[Row]:
    """Look at everything, in a few seconds."""
    with ThreadPoolExecutor() as pool:
        drawn = pool.submit(_tried_drawing_rows)
        viewer = pool.submit(viewer_row)
        rows = [version_row(), python_row(sys.version_info[:3]), machine_row()]
        rows += [package_row(name, module) for name, module in _MODULES.items()]
        rows += list(physics_rows())
        rows += [kernel_row(*_kernels())]
        rows += [display_row(os.environ, sys.platform), *drawn.result(), viewer.result()]
    rows += [ros_row(os.environ), ardupilot_row(shutil.which), *search_rows(os.environ), pythonpath_row(os.environ)]
    disk, memory = shutil.disk_usage(Path.cwd()).free, free_memory()
    return [
        *rows,
        room_row("free disk", disk, 0.5 * _GB, "recordings need at least 0.5 GB: make room, or record elsewhere"),
        room_row("free memory", memory, _GB, "at least 1 GB is needed: end other programs, or raise the limit"),
        cores_row(core_share()),
    ]


def print_rows(rows: list[Row]) -> None:
    """The rows as a table, then what to do."""
    styles = {"yes": "green", "no": "red", "not needed": "dim"}
    texts = [(row.what, row.found, Text(row.works, style=styles[row.works])) for row in rows]
    print_table("vrx-mj doctor", ("what", "found", "works"), (), texts)
    for row in rows:
        if row.advice:
            echo(f"{row.what}: {row.advice}")
    if healthy(rows):
        echo("Everything that vrx_mj needs works.")
    else:
        show("vrx_mj cannot run here: see the rows marked no.", "red", result=True)


def as_json(rows: list[Row]) -> list[dict[str, object]]:
    """The rows as plain data."""
    return [asdict(row) for row in rows]


# Versions


def version_row() -> Row:
    """Our own version, and where it is."""
    import vrx_mj

    return Row("vrx_mj", f"{vrx_mj.__version__} in {Path(vrx_mj.__file__).parent}", core=True)


def python_row(version: tuple[int, ...]) -> Row:
    """The Python interpreter, its version and its place."""
    shown = ".".join(map(str, version))
    if version >= _OLDEST_PYTHON and sys.maxsize > 2**32:
        return Row("python", f"{shown} in {sys.prefix}", core=True)
    return Row("python", shown, "no", "Python 3.11 or newer, 64 bit, is needed: see docs/install.md", core=True)


def physics_rows() -> Iterator[Row]:
    """Versions on which equal runs depend: that of our physics, and MuJoCo's core, which pip updates by itself."""
    with contextlib.suppress(ImportError):  # the package has a row of its own
        import mujoco

        yield Row("equal runs", f"physics version {PHYSICS_VERSION}, core of MuJoCo {mujoco.mj_versionString()}")


def machine_row() -> Row:
    """Processor and system."""
    return Row("machine", f"{processor() or platform.machine()}; {platform.platform()}")


def package_row(
    name: str,
    module: str,
    *,
    load: Callable[[str], object] = importlib.import_module,
    version: Callable[[str], str] = importlib.metadata.version,
) -> Row:
    """A package: its version, whether it is one that we take, and whether it can be imported."""
    wanted = requirement(name)
    repair = install_command(wanted)
    try:
        found = version(name)
    except importlib.metadata.PackageNotFoundError:
        return Row(name, "not installed", "no", repair, core=True)
    if not is_allowed(found, wanted):
        return Row(name, f"{found}, but {wanted} is needed", "no", repair, core=True)
    try:
        load(module)
    except Exception as error:
        line = str(error).partition("\n")[0]
        return Row(name, f"{found}, import fails: {line}", "no", f"{repair} --force-reinstall", core=True)
    return Row(name, found, core=True)


def requirement(name: str) -> str:
    """The requirement on a package, as in "mujoco>=4.0,<5"; its name alone where that is not known."""
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        for line in importlib.metadata.requires("vrx-mj") or ():
            if re.match(rf"{re.escape(name)}(?![\w.-])", line):
                return line.partition(";")[0].strip()
    return name


def is_allowed(version: str, wanted: str) -> bool:
    """Whether a version is inside bounds such as ">=4.0,<5"."""
    here = _numbers(version)
    lower = all(here >= _numbers(bound) for bound in re.findall(r">=\s*([\d.]+)", wanted))
    return lower and all(here < _numbers(bound) for bound in re.findall(r"<\s*([\d.]+)", wanted))


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:3])


def kernel_row(folder: Path | None, compiled: bool, refused: Sequence[str] = ()) -> Row:
    """The folder of compiled physics, and those that are not safe enough for it."""
    private = " ".join(f"{reason}: keep it to yourself (chmod go-w), or set VRX_MJ_CACHE." for reason in refused)
    found, advice = str(folder), ""
    if folder is None:
        found = "no folder can be used"
        advice = "set VRX_MJ_CACHE to a folder of your own, or every run starts with 20 s of compiling"
    elif not compiled:
        found, advice = f"not yet in {folder}", "the first run compiles it, in about 20 s"
    return Row("compiled physics", found, "yes" if folder else "no", private or advice)


def _kernels() -> tuple[Path | None, bool, tuple[str, ...]]:
    try:
        from vrx_mj.physics.kernel import cache_choice, is_cached
        from vrx_mj.runtime.loop import advance_vrx
    except Exception:  # a package is missing, which has a row of its own
        return None, False, ()
    folder, refused = cache_choice()
    return folder, is_cached(advance_vrx), refused


# Pictures


def display_row(environment: Mapping[str, str], system: str) -> Row:
    """Whether there is a screen to open a window on."""
    if not system.startswith("linux"):
        return Row("display", "of the system")
    shown = [f"{name}={environment[name]}" for name in ("DISPLAY", "WAYLAND_DISPLAY") if environment.get(name)]
    if shown:
        return Row("display", ", ".join(shown))
    return Row("display", "none", "not needed", "vrx-mj view opens in a browser instead")


def drawing_rows(attempts: Mapping[str, "Attempt"], *, has_display: bool) -> Iterator[Row]:
    """The ways that drew a picture; cameras need one of two."""
    from vrx_mj.sensors.canvas import BACKENDS

    cameras = any(attempt.works for name, attempt in attempts.items() if name != "glfw")
    for name, attempt in attempts.items():
        needed = has_display if name == "glfw" else not cameras
        if attempt.works:
            yield Row(_DRAWS[name], attempt.detail)
        elif needed:
            yield Row(_DRAWS[name], attempt.detail, "no", f"sudo apt-get install {BACKENDS.get(name, _FOR_WINDOWS)}")
        else:
            yield Row(_DRAWS[name], "no display" if name == "glfw" else attempt.detail, "not needed")


def _tried_drawing_rows() -> list[Row]:
    from vrx_mj.draw.display import has_display, try_backend

    names = _DRAWS if sys.platform.startswith("linux") else ("glfw",)
    with ThreadPoolExecutor() as pool:
        tried = dict(zip(names, pool.map(try_backend, names), strict=True))
    return list(drawing_rows(tried, has_display=has_display()))


def viewer_row(
    find: Callable[[], Path] | None = None, version: Callable[[str], str] = importlib.metadata.version
) -> Row:
    """The viewer of rerun: there, running, and of the version of its package."""
    what, again = "rerun viewer", f"{install_command(requirement('rerun-sdk'))} --force-reinstall"
    try:
        from vrx_mj.recording.parts import viewer_binary, viewer_environment

        path, wanted = (find or viewer_binary)(), version("rerun-sdk")
        output = subprocess.run(
            [path, "--version"], capture_output=True, timeout=10, check=True, encoding="utf-8", env=viewer_environment()
        ).stdout
    except Exception as error:
        line = str(error).partition("\n")[0]
        return Row(what, line, "no", f"{again}; recordings are written without it")
    found = (re.findall(r"\d+\.\d+\.\d+\S*", output) or ["?"])[0]
    if found != wanted:
        return Row(what, f"{found}, but the package is {wanted}", "no", again)
    return Row(what, f"{found}, {path}")


# Surroundings


def ros_row(environment: Mapping[str, str], find: Callable[[str], object] = importlib.util.find_spec) -> Row:
    """ROS, which nothing here needs."""
    distro = environment.get("ROS_DISTRO")
    modules = [name for name in ("rospy", "rclpy") if find(name) is not None]
    if distro is None and not modules:
        return Row("ROS", "none", "not needed")
    found = f"{distro or 'not sourced'}, {' and '.join(modules) or 'without rospy and rclpy for this Python'}"
    return Row("ROS", found, "yes" if modules else "not needed")


def ardupilot_row(find: Callable[[str], str | None]) -> Row:
    """The programs with which ArduPilot is started."""
    found = [path for name in ("ardurover", "sim_vehicle.py") if (path := find(name))]
    if not found:
        return Row("ArduPilot", "not on PATH", "not needed", "docs/ardupilot.md says how to get it")
    return Row("ArduPilot", ", ".join(found))


def search_rows(environment: Mapping[str, str]) -> Iterator[Row]:
    """Folders in which the user's own files are looked for."""
    for name in ("VRX_MJ_PATH", "VRX_MJ_PACKAGE_PATH"):
        text = environment.get(name, "")
        missing = [entry for entry in text.split(os.pathsep) if entry and not Path(entry).is_dir()]
        if missing:
            yield Row(name, text, "no", f"no folder {', '.join(missing)}: remove it")
        else:
            yield Row(name, text or "not set", "yes" if text else "not needed")


def pythonpath_row(environment: Mapping[str, str]) -> Row:
    """PYTHONPATH, and packages of ours in it, which may be too old or for another Python."""
    entries = [entry for entry in environment.get("PYTHONPATH", "").split(os.pathsep) if entry]
    files = ((name, Path(entry) / name) for entry in entries for name in sorted(PACKAGES))
    there = [f"{name} in {file.parent}" for name, file in files if file.is_dir() or file.with_suffix(".py").is_file()]
    if there:
        advice = "vrx-mj uses the installed packages first; for your own scripts, unset PYTHONPATH"
        return Row("PYTHONPATH", ", ".join(there), "yes", advice)
    return Row("PYTHONPATH", os.pathsep.join(entries) or "not set", "yes" if entries else "not needed")


def room_row(what: str, free: float, least: float, advice: str) -> Row:
    """Room [bytes] that is free, and how much should be."""
    enough = free >= least
    return Row(what, f"{free / _GB:.1f} GB", "yes" if enough else "no", "" if enough else advice)


def cores_row(cores: tuple[int, float]) -> Row:
    """Cores that this process may run on, and the container's share of them."""
    count, share = cores
    limit = f", limited to {share:g} at a time" if share < count else ""
    return Row("cores", f"{count}{limit}")


Publishers = Sequence[tuple[str, Sequence[str]]]
"""Topics on a master, each with the nodes that publish it."""


def examine_world(world: str, fleet: str | None) -> list[Row]:
    """Look at a world and a fleet, at the ROS master that answers, and at the ports."""
    rows, sim = world_rows(world, fleet)
    environment = os.environ
    rows += map(extra_row, EXTRAS)
    if not missing_modules("ros1"):
        uri = environment.get("ROS_MASTER_URI") or _MASTER
        master, publishers = master_row(uri)
        rows += [master, address_row(environment, uri)]
        if sim is not None:
            rows.append(command_row(sim, publishers))
    answers = [row.found for row in rows if row.what == "ROS master" and row.works == "yes"]
    is_master = bool(answers) and answers[0].rstrip("/").endswith(f":{_MASTER_PORT}")
    return [
        *rows,
        port_row("ROS master", _MASTER_PORT, serves=is_master),
        port_row("rosbridge", _ROSBRIDGE_PORT),
    ]


def sound(rows: Sequence[Row]) -> bool:
    """Whether the world and its fleet have none of the problems that were looked for."""
    return not any(row.works == "no" and row.what in {_WORLD, _OVERLAPS, _FRAMES, _LAND, _COMMANDS} for row in rows)


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
        return [Row(_WORLD, "does not compile", "no", str(error))], None
    boats = f"{len(sim.boats)} {'boat' if len(sim.boats) == 1 else 'boats'}: {first_names(sim.boats, _SHOWN_BOATS)}"
    rows = [Row(_WORLD, f"{sim.world.name}, {boats}")]
    rows += [Row("warning", str(each.message)) for each in caught]
    rows += _problems(_LAND, _on_land(sim), "none")
    rows += _problems(_OVERLAPS, overlaps(sim), "none")
    rows += _problems(_FRAMES, shared_frames(sim), "each is of one boat")
    return rows, sim


def _problems(what: str, lines: Iterator[str], none: str) -> list[Row]:
    """A row for every problem, what to do after the last colon or semicolon; or one row where all is well."""
    rows = []
    for line in lines:
        cut = max(line.rfind(": "), line.rfind("; "))
        rows.append(Row(what, line[:cut], "no", line[cut + 2 :]))
    return rows or [Row(what, none)]


def _on_land(sim: "Simulation") -> Iterator[str]:
    from vrx_mj.mjcf.afloat import depth_in_land

    shore = sim.world.parameters.shoreline
    if not shore:
        return
    import numpy as np

    square = _HALF * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    seen = sim.observe()
    for boat in sim.boats:
        x, y, z = (float(value) for value in seen[boat].position)
        depth = depth_in_land(square, (x, y, z, 0.0, 0.0, 0.0), shore)
        if depth > 0.0:
            place = f"({x:g}, {y:g}), {depth:.1f} m inside the shore"
            yield f"{boat} starts on land, at {place}: give it another pose, or --nudge"


# ROS


def extra_row(name: str) -> Row:
    """An extra of ours, by the modules that it brings."""
    if missing := missing_modules(name):
        return Row(f"extra {name}", f"without {', '.join(missing)}", "not needed", install_extra(name))
    return Row(f"extra {name}", "installed")


def master_row(uri: str, timeout: float = _MASTER_TIMEOUT) -> tuple[Row, Publishers]:
    """Whether a ROS master answers at a URI within so long [s], and who publishes there."""
    import asyncio
    from xmlrpc.client import Fault

    from vrx_mj.ros.network import is_local
    from vrx_mj.ros.ros1.xmlrpc import CALL_ERRORS, Proxy, address

    async def system_state() -> Any:
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
        publishers = [(str(topic), [str(node) for node in nodes]) for topic, nodes in asyncio.run(system_state())[0]]
    except ConnectionRefusedError:
        if is_local(host):
            return Row(what, f"none at {uri}", "not needed", "vrx-mj serve --ros1 starts one"), ()
        return Row(what, f"none at {uri}", "no", "start roscore there, or unset ROS_MASTER_URI"), ()
    except (*CALL_ERRORS, Fault, TypeError, ValueError) as error:
        why = str(error) or "no answer"
        return Row(what, f"no ROS master at {uri}: {why}", "no", "correct ROS_MASTER_URI, or unset it"), ()
    return Row(what, f"answers at {uri}"), publishers


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
        return Row(_COMMANDS, f"{len(messages)} published without a subscriber", "no", "; ".join(messages))
    return Row(_COMMANDS, f"{heard} have a publisher" if heard else "no publisher", "yes" if heard else "not needed")


def address_row(environment: Mapping[str, str], uri: str) -> Row:
    """Whether the address that other nodes get is one of this machine, and can be reached by those they ask."""
    from vrx_mj.ros.network import addresses, is_local, is_loopback
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
        host = _LOOPBACK
    if all(map(is_loopback, addresses(host_name))) and not is_local(host):
        advice = f"nodes on other machines cannot reach it: set {name} to this machine's address towards {host}"
        return Row(name, f"{shown}, but the master is on {host}", "no", advice)
    return Row(name, shown)


def port_row(what: str, port: int, *, serves: bool = False, who: Callable[[int], str | None] | None = None) -> Row:
    """Whether a port on loopback is free, or held by a master that is joined."""
    from vrx_mj.ros.network import who_listens

    name = f"port {port} ({what})"
    with socket.socket() as probe:
        if os.name == "posix":
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # who has just ended does not count
        try:
            probe.bind((_LOOPBACK, port))
        except OSError:
            pass
        else:
            return Row(name, "free")
    holder = (who or who_listens)(port) or "a process that cannot be found"
    if serves:
        return Row(name, f"the master that answers: {holder}")
    other = "another ROS_MASTER_URI" if port == _MASTER_PORT else f"--{what} {port + 1}"
    return Row(name, f"held by {holder}", "no", f"stop it, or use {other}")
