"""`vrx-mj doctor`: what is here, what of it works, and what to do about the rest.

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
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rich.console import Console
from rich.table import Table
from rich.text import Text

from vrx_mj.cli.environment import PACKAGES
from vrx_mj.packages import install_command
from vrx_mj.runtime.limits import core_share, free_memory

if TYPE_CHECKING:
    from vrx_mj.drive.display import Attempt

__all__ = ["Row", "as_json", "examine", "healthy", "print_rows"]

Works = Literal["yes", "no", "not needed"]

MODULES = {
    "mujoco": "mujoco", "numba": "numba", "numpy": "numpy", "rerun-sdk": "rerun", "pydantic": "pydantic",
    "lxml": "lxml", "trimesh": "trimesh",
}  # fmt: skip
"""Packages that are shown, and the modules they bring."""
OLDEST_PYTHON = (3, 11)
DRAWS = {"egl": "cameras, by GPU or CPU (egl)", "osmesa": "cameras, by CPU (osmesa)", "glfw": "window (glfw)"}
GB = 1e9
LEAST_DISK, LEAST_MEMORY = 0.5 * GB, 1.0 * GB
"""What runs and recordings want to find free [bytes]."""


@dataclass(frozen=True)
class Row:
    """One thing that was looked at."""

    what: str
    found: str
    works: Works
    advice: str = ""
    core: bool = False
    """Whether nothing runs without it."""


def healthy(rows: list[Row]) -> bool:
    """Whether what the core needs works."""
    return not any(row.core and row.works == "no" for row in rows)


def examine() -> list[Row]:
    """Look at everything, in a few seconds."""
    with ThreadPoolExecutor() as pool:
        attempts = pool.submit(_attempts)
        viewer = pool.submit(viewer_row)
        rows = [version_row(), python_row(sys.version_info[:3]), machine_row()]
        rows += [package_row(name, module) for name, module in MODULES.items()]
        rows += [kernel_row(*_kernels())]
        rows += [display_row(os.environ, sys.platform), *drawing_rows(attempts.result()), viewer.result()]
    rows += [ros_row(os.environ), *search_rows(os.environ), pythonpath_row(os.environ)]
    return [*rows, disk_row(shutil.disk_usage(Path.cwd()).free), memory_row(free_memory()), cores_row(core_share())]


def print_rows(rows: list[Row]) -> None:
    """The rows as a table, then what to do."""
    table = Table(title="vrx-mj doctor")
    for name in ("what", "found", "works"):
        table.add_column(name, overflow="fold")
    for row in rows:
        style = {"yes": "green", "no": "red", "not needed": "dim"}[row.works]
        table.add_row(row.what, Text(row.found), Text(row.works, style=style))
    out = Console()
    out.print(table)
    for row in rows:
        if row.advice:
            out.print(f"{row.what}: {row.advice}", markup=False, highlight=False, soft_wrap=True)
    out.print(
        "What vrx_mj needs works." if healthy(rows) else "vrx_mj cannot run here: see the rows marked no.", style="bold"
    )


def as_json(rows: list[Row]) -> list[dict[str, object]]:
    """The rows as plain data."""
    return [asdict(row) for row in rows]


# Versions


def version_row() -> Row:
    """Our own version, and where it is."""
    import vrx_mj

    return Row("vrx_mj", f"{vrx_mj.__version__} in {Path(vrx_mj.__file__).parent}", "yes", core=True)


def python_row(version: tuple[int, ...]) -> Row:
    """The interpreter."""
    shown = ".".join(map(str, version))
    if version >= OLDEST_PYTHON and sys.maxsize > 2**32:
        return Row("python", f"{shown} in {sys.prefix}", "yes", core=True)
    return Row("python", shown, "no", "Python 3.11 or newer, 64 bit, is needed: see docs/install.md", core=True)


def machine_row() -> Row:
    """Processor and system."""
    name = platform.processor() or platform.machine()
    with contextlib.suppress(OSError):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        name = next(iter(re.findall(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)), name)
    return Row("machine", f"{name}; {platform.platform()}", "yes")


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
    if not allowed(found, wanted):
        return Row(name, f"{found}, but {wanted} is needed", "no", repair, core=True)
    try:
        load(module)
    except Exception as error:
        line = str(error).partition("\n")[0]
        return Row(name, f"{found}, import fails: {line}", "no", f"{repair} --force-reinstall", core=True)
    return Row(name, found, "yes", core=True)


def requirement(name: str) -> str:
    """What we ask of a package, as in "mujoco>=4.0,<5"; its name alone where that is not known."""
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        for line in importlib.metadata.requires("vrx-mj") or ():
            if re.match(rf"{re.escape(name)}(?![\w.-])", line):
                return line.partition(";")[0].strip()
    return name


def allowed(version: str, wanted: str) -> bool:
    """Whether a version is inside bounds such as ">=4.0,<5"."""
    here = _numbers(version)
    lower = all(here >= _numbers(bound) for bound in re.findall(r">=\s*([\d.]+)", wanted))
    return lower and all(here < _numbers(bound) for bound in re.findall(r"<\s*([\d.]+)", wanted))


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:3])


def kernel_row(folder: Path | None, compiled: bool, refused: Sequence[str] = ()) -> Row:
    """Where compiled physics is kept, and which folders are not safe enough for it."""
    private = " ".join(f"{reason}: keep it to yourself (chmod go-w), or set VRX_MJ_CACHE." for reason in refused)
    if folder is None:
        advice = "set VRX_MJ_CACHE to a folder of your own, or every run starts with 20 s of compiling"
        return Row("compiled physics", "no folder can be used", "no", private or advice)
    if not compiled:
        first = "the first run compiles it, in about 20 s"
        return Row("compiled physics", f"not yet in {folder}", "yes", private or first)
    return Row("compiled physics", str(folder), "yes", private)


def _kernels() -> tuple[Path | None, bool, tuple[str, ...]]:
    try:
        from vrx_mj.physics.kernel import cache_choice, cached
        from vrx_mj.runtime.loop import advance
    except Exception:  # a package is missing, which has a row of its own
        return None, False, ()
    folder, refused = cache_choice()
    return folder, cached(advance), refused


# Pictures


def display_row(environment: Mapping[str, str], system: str) -> Row:
    """Whether there is a screen to open a window on."""
    if not system.startswith("linux"):
        return Row("display", "of the system", "yes")
    shown = [f"{name}={environment[name]}" for name in ("DISPLAY", "WAYLAND_DISPLAY") if environment.get(name)]
    if shown:
        return Row("display", ", ".join(shown), "yes")
    return Row("display", "none", "not needed", "vrx-mj view opens in a browser instead")


def drawing_rows(attempts: Mapping[str, "Attempt"]) -> Iterator[Row]:
    """What drew a picture; cameras want one way of two."""
    from vrx_mj.sensors.canvas import DEBIAN

    cameras = any(attempts[name].works for name in ("egl", "osmesa") if name in attempts)
    screen = attempts.get("display")
    for name, attempt in attempts.items():
        if name == "display":
            continue
        if attempt.works:
            yield Row(DRAWS[name], attempt.detail, "yes")
        elif name == "glfw" and screen is not None and not screen.works:
            yield Row(DRAWS[name], "no display", "not needed")
        else:
            needed = name == "glfw" or not cameras
            yield Row(
                DRAWS[name],
                attempt.detail,
                "no" if needed else "not needed",
                f"sudo apt-get install {DEBIAN[name]}" if needed else "",
            )


def _attempts() -> dict[str, "Attempt"]:
    from vrx_mj.drive.display import BACKENDS, Attempt, has_display, try_backend

    linux = sys.platform.startswith("linux")
    names = BACKENDS if linux else ("glfw",)
    with ThreadPoolExecutor() as pool:
        tried = dict(zip(names, pool.map(try_backend, names), strict=True))
    return {"display": Attempt(has_display(), ""), **tried}


def viewer_row(
    find: Callable[[], Path] | None = None, version: Callable[[str], str] = importlib.metadata.version
) -> Row:
    """The viewer of rerun: there, running, and of the version of its package."""
    what, again = "rerun viewer", f"{install_command(requirement('rerun-sdk'))} --force-reinstall"
    try:
        path, wanted = (find or _viewer)(), version("rerun-sdk")
        output = subprocess.run(
            [path, "--version"], capture_output=True, timeout=10, check=True, encoding="utf-8"
        ).stdout
    except Exception as error:
        line = str(error).partition("\n")[0]
        return Row(what, line, "no", f"{again}; recordings are written without it")
    found = (re.findall(r"\d+\.\d+\.\d+\S*", output) or ["?"])[0]
    if found != wanted:
        return Row(what, f"{found}, but the package is {wanted}", "no", again)
    return Row(what, f"{found}, {path}", "yes")


def _viewer() -> Path:
    from vrx_mj.recording.writer import viewer_binary

    return viewer_binary()


# Surroundings


def ros_row(environment: Mapping[str, str], find: Callable[[str], object] = importlib.util.find_spec) -> Row:
    """ROS, which nothing here needs."""
    distro = environment.get("ROS_DISTRO")
    modules = [name for name in ("rospy", "rclpy") if find(name) is not None]
    if distro is None and not modules:
        return Row("ROS", "none", "not needed")
    found = f"{distro or 'not sourced'}, {' and '.join(modules) or 'without rospy and rclpy for this Python'}"
    return Row("ROS", found, "yes" if modules else "not needed")


def search_rows(environment: Mapping[str, str]) -> Iterator[Row]:
    """Where files of the user's own are looked for."""
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
    there = [
        f"{name} in {entry}"
        for entry in entries
        for name in sorted(PACKAGES)
        if (Path(entry) / name).is_dir() or (Path(entry) / f"{name}.py").is_file()
    ]
    if there:
        advice = "vrx-mj uses the installed packages first; for your own scripts, unset PYTHONPATH"
        return Row("PYTHONPATH", ", ".join(there), "yes", advice)
    return Row("PYTHONPATH", os.pathsep.join(entries) or "not set", "yes" if entries else "not needed")


def disk_row(free: float) -> Row:
    """Disk [bytes] that is free here."""
    enough = free >= LEAST_DISK
    advice = "" if enough else f"recordings need at least {LEAST_DISK / GB:g} GB: make room, or record elsewhere"
    return Row("free disk", f"{free / GB:.1f} GB here", "yes" if enough else "no", advice)


def memory_row(free: float | None) -> Row:
    """Memory [bytes] that is free, the container's limit taken into account."""
    if free is None:
        return Row("free memory", "not known", "yes")
    enough = free >= LEAST_MEMORY
    advice = "" if enough else f"at least {LEAST_MEMORY / GB:g} GB is needed: end other programs, or raise the limit"
    return Row("free memory", f"{free / GB:.1f} GB", "yes" if enough else "no", advice)


def cores_row(cores: tuple[int, float]) -> Row:
    """Cores that this process may run on, and the container's share of them."""
    count, share = cores
    limit = f", limited to {share:g} at a time" if share < count else ""
    return Row("cores", f"{count}{limit}", "yes")
