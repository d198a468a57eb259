"""From VRX's thruster and component files to a URDF of the WAM-V, over the macros in `assets/robots/wamv`.

The way is that of VRX's `generate_wamv.launch`: each file becomes a piece of xacro with one macro call for each of
its parts, and `wamv_gazebo.urdf.xacro` is expanded with these pieces. Unlike there, the boat has any namespace.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.sax.saxutils import quoteattr

from vrx_mj.config.wording import shown
from vrx_mj.errors import UnknownNameError, VrxError
from vrx_mj.formats.parts.catalogue import Kind, PartsFile
from vrx_mj.formats.urdf.expand import expand
from vrx_mj.resources import root

LAYOUTS = ("H", "T", "X")
"""Thruster layouts that need no file."""

FLAGS = (
    "vrx_sensors_enabled",
    "camera_enabled",
    "gps_enabled",
    "imu_enabled",
    "lidar_enabled",
    "ground_truth_enabled",
    "pinger_enabled",
    "ball_shooter_enabled",
)
"""Arguments that add sensors where there is no component file."""

CHOICES = {"sensor_errors": ("none", "standalone", "rtk"), "camera_info": ("vrx", "centered")}
"""Arguments that are not VRX's, and their values."""

ARGUMENTS = (
    "thruster_config",
    *FLAGS,
    "thruster_namespace",
    "camera_namespace",
    "sensor_namespace",
    "pinger_namespace",
    "shooter_namespace",
    *CHOICES,
)
"""Arguments of VRX's `wamv_gazebo.urdf.xacro` that are free to set; the others are parameters of `wamv_urdf`."""

_NAMESPACE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}", re.ASCII)

_THRUSTERS = """\
<?xml version="1.0"?>
<robot xmlns:xacro="http://ros.org/wiki/xacro" name="wam-v-thrusters">
  <xacro:include filename="$(find wamv_description)/urdf/thrusters/engine.xacro"/>
{calls}
  <gazebo>
    <plugin name="wamv_gazebo_thrust" filename="libusv_gazebo_thrust_plugin.so">
      <cmdTimeout>1.0</cmdTimeout>
      <robotNamespace>${{namespace}}</robotNamespace>
      <xacro:include filename="$(find wamv_gazebo)/urdf/thruster_layouts/wamv_gazebo_thruster_config.xacro"/>
{configs}
    </plugin>
  </gazebo>
</robot>
"""

_COMPONENTS = """\
<?xml version="1.0"?>
<robot xmlns:xacro="http://ros.org/wiki/xacro" name="wam-v-components">
  <xacro:macro name="yaml_components">
{calls}
  </xacro:macro>
</robot>
"""


def example_file(kind: Kind) -> Path:
    """VRX's example of a thruster or component file, which is what a boat has that names no file."""
    return _folder() / "config" / f"{kind.removesuffix('s')}_config.yaml"


def xacro_text(parts: PartsFile) -> str:
    """The xacro file of a thruster or component file: one macro call for each part, in the order of the file.

    It holds for any namespace.
    """
    if parts.kind == "components":
        return _COMPONENTS.format(calls="\n".join(f"    {call}" for call in _calls(parts)))
    names = (instance.name for instance in parts.instances)
    configs = (_call("wamv_gazebo_thruster_config", {"name": name}) for name in names)
    return _THRUSTERS.format(
        calls="\n".join(f"  {call}" for call in _calls(parts)),
        configs="\n".join(f"      {config}" for config in configs),
    )


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
        arguments: any of `ARGUMENTS`, as texts.
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
    main = file or _folder() / "wamv_gazebo" / "urdf" / "wamv_gazebo.urdf.xacro"
    with TemporaryDirectory(prefix="vrx_mj_") as name:
        folder = Path(name).resolve()
        for parts in filter(None, (thrusters, components)):
            given |= _file_arguments(parts, folder)
        return str(expand(main, arguments=given, package_paths=(folder, *package_paths)))  # whose file goes


def _folder() -> Path:
    return root() / "assets" / "robots" / "wamv"


def _check(arguments: Mapping[str, str], namespace: str) -> None:
    for name in arguments:
        if name not in ARGUMENTS:
            raise UnknownNameError("argument of the WAM-V", name, ARGUMENTS)
    for name in set(FLAGS) & arguments.keys():
        if arguments[name] not in {"true", "false"}:
            raise VrxError(f"argument {name}: expected true or false, got {shown(arguments[name])}")
    for name, values in CHOICES.items():
        if arguments.get(name, values[0]) not in values:
            raise VrxError(f"argument {name}: expected {' or '.join(values)}, got {shown(arguments[name])}")
    layout = arguments.get("thruster_config", "H")
    if layout not in LAYOUTS:
        raise UnknownNameError("thruster layout", layout, LAYOUTS)
    if not _NAMESPACE.fullmatch(namespace):
        allowed = "up to 64 letters A-Z, digits, '_', '-' or '.'"
        raise VrxError(f"namespace {shown(namespace)}: expected {allowed}")


def _file_arguments(parts: PartsFile, folder: Path) -> dict[str, str]:
    """The arguments that name a file's xacro, which is written into `folder`."""
    kind = parts.kind.removesuffix("s")
    file = folder / f"{parts.kind}.xacro"
    file.write_text(xacro_text(parts), encoding="utf-8")
    return {f"yaml_{kind}_generation": "true", f"{kind}_xacro_file": file.as_posix()}


def _calls(parts: PartsFile) -> Iterator[str]:
    for instance in parts.instances:
        yield _call(instance.type, instance.parameters)


def _call(macro: str, parameters: Mapping[str, object]) -> str:
    """A macro call; values are written as texts, so that expressions in them reach xacro."""
    given = "".join(f" {key}={quoteattr(str(value))}" for key, value in parameters.items())
    return f"<xacro:{macro}{given}/>"
