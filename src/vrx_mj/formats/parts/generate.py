"""The URDF of a WAM-V from VRX's thruster and component files, by the macros in `assets/robots/wamv`.

The way is that of VRX's `generate_wamv.launch`: each file becomes a piece of xacro with one macro call for each of
its parts, and `wamv_gazebo.urdf.xacro` is expanded with these pieces. Unlike there, the boat has any namespace.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.sax.saxutils import quoteattr

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from vrx_mj.config.tree import choice, literal
from vrx_mj.errors import UnknownNameError, VrxError
from vrx_mj.formats.parts.read import Kind, PartsFile
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.resources import root

_FOLDER = root() / "assets" / "robots" / "wamv"
_MAIN = _FOLDER / "wamv_gazebo" / "urdf" / "wamv_gazebo.urdf.xacro"
LAYOUTS = ("H", "T", "X")
"""Thruster layouts that need no file."""

_CHOICES = {"sensor_errors": ("none", "standalone", "rtk"), "camera_info": ("vrx", "centered")}
"""Arguments that are not VRX's, and their values."""

_ARGUMENT = re.compile(r'<xacro:arg name="(\w+)" default="([^"]*)"/>')
_OTHERS = re.compile(r"namespace|locked|yaml_\w+_generation|\w+_xacro_file")
"""Arguments that are parameters of `wamv_urdf`."""
_SWITCHED = ("true", "false")
_NAMESPACE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}", re.ASCII)


@cache
def arguments_of_wamv() -> Mapping[str, str]:
    """Arguments of our `wamv_gazebo.urdf.xacro` that are free to set, with their defaults."""
    found = _ARGUMENT.findall(_MAIN.read_text(encoding="utf-8"))
    return {name: default for name, default in found if not _OTHERS.fullmatch(name)}


def example_file(kind: Kind) -> Path:
    """VRX's example of a thruster or component file, which is what a boat has that names no file."""
    return _FOLDER / "config" / f"{kind.removesuffix('s')}_config.yaml"


def xacro_text(parts: PartsFile) -> str:
    """The xacro file of a thruster or component file: one macro call for each part, in the order of the file.

    It holds for any namespace. Values are written as texts, so that expressions in them reach xacro.
    """
    loader = FileSystemLoader(root() / "templates")
    environment = Environment(loader=loader, trim_blocks=True, undefined=StrictUndefined, keep_trailing_newline=True)
    template = environment.get_template("wamv_parts.xacro.j2")
    return template.render(kind=parts.kind, parts=parts.instances, quoted=lambda value: quoteattr(str(value)))


def wamv_urdf(
    *,
    thrusters: PartsFile | None = None,
    components: PartsFile | None = None,
    namespace: str = "wamv",
    locked: bool = False,
    arguments: Mapping[str, str] | None = None,
    file: Path | None = None,
    package_paths: Sequence[Path] = (),
) -> str:
    """The URDF of a WAM-V.

    Args:
        thrusters: its engines; without a file, those of the argument `thruster_config` (H).
        components: its sensors, and with them the two cpu cases; without a file, those that flags add (none).
        namespace: prefix of links, joints, frames and topics.
        locked: whether it is held where it is, free to heave, roll and pitch only.
        arguments: any of `arguments_of_wamv`, as texts.
        file: a `wamv_gazebo.urdf.xacro` in place of ours; it may have arguments of its own.
        package_paths: where its packages are.

    Raises:
        UnknownNameError: an argument or the layout is unknown.
        VrxError: the namespace is not a name.
        ConfigError: what the files ask for cannot be expanded.
    """
    given = {**(arguments or {})}
    _check(given if file is None else {}, namespace)
    given |= {"namespace": namespace, "locked": str(locked).lower()}
    with TemporaryDirectory(prefix="vrx_mj_") as name:
        folder = Path(name).resolve()
        for parts in filter(None, (thrusters, components)):
            kind, written = parts.kind.removesuffix("s"), folder / f"{parts.kind}.xacro"
            written.write_text(xacro_text(parts), encoding="utf-8")
            given |= {f"yaml_{kind}_generation": "true", f"{kind}_xacro_file": written.as_posix()}
        made = expand(file or _MAIN, arguments=given, package_paths=(folder, *package_paths))
    return str(made)  # without places in files that have gone


def _check(arguments: Mapping[str, str], namespace: str) -> None:
    known = arguments_of_wamv()
    for name, value in arguments.items():
        if name not in known:
            raise UnknownNameError("argument of the WAM-V", name, known)
        switched = _SWITCHED if known[name] in _SWITCHED else (value,)
        if value not in (values := _CHOICES.get(name, switched)):
            raise VrxError(f"argument {name}: {choice(value, values)}")
    layout = arguments.get("thruster_config", "H")
    if layout not in LAYOUTS:
        raise UnknownNameError("thruster layout", layout, LAYOUTS)
    if not _NAMESPACE.fullmatch(namespace):
        allowed = "up to 64 letters A-Z, digits, '_', '-' or '.'"
        raise VrxError(f"namespace {literal(namespace)}: expected {allowed}")
