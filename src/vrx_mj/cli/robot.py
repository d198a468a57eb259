"""`vrx-mj robot`: from thruster and component files to a boat."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrx_mj.cli import robot_checks
from vrx_mj.cli.files import writing
from vrx_mj.errors import CommandError, VrxWarning

if TYPE_CHECKING:
    from vrx_mj.config.parts.files import PartsFile

__all__ = ["app", "build"]

app = typer.Typer(
    name="robot",
    help="Build and check boats from VRX's thruster and component files.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)


@app.command()
def build(
    output: Annotated[Path, typer.Option("--output", "-o", help="The URDF to write.")],
    thrusters: Annotated[Path | None, typer.Option(help="Thruster file (YAML); default: VRX's example.")] = None,
    components: Annotated[Path | None, typer.Option(help="Component file (YAML); default: VRX's example.")] = None,
    sensor_yaml: robot_checks.SensorYaml = None,
    layout: Annotated[str | None, typer.Option(help="H, T or X, instead of a thruster file.")] = None,
    namespace: Annotated[str, typer.Option(help="Prefix of links, joints, frames and topics.")] = "wamv",
    locked: Annotated[
        bool, typer.Option("--locked", help="Fix the position: the boat only heaves, rolls and pitches.")
    ] = False,
    mjcf: Annotated[
        Path | None, typer.Option(help="Write MJCF too, with its meshes in the folder assets beside it.")
    ] = None,
) -> None:
    """Build the URDF of a boat from thruster and component files, as VRX's generate_wamv.launch does.

    An empty file gives a boat without thrusters or components. One that breaks the rules is built too, with a warning.

    Example: vrx-mj robot build --thrusters thruster_config.yaml --components component_config.yaml -o my_wamv.urdf
    """
    from vrx_mj.config.parts.generate import wamv_urdf

    engines, parts = _files(thrusters, components, sensor_yaml, layout)
    arguments = {} if layout is None else {"thruster_config": layout}
    urdf = wamv_urdf(thrusters=engines, components=parts, namespace=namespace, locked=locked, arguments=arguments)
    with writing("the URDF", output):
        output.absolute().parent.mkdir(parents=True, exist_ok=True)
        output.write_text(urdf, encoding="utf-8", newline="\n")
    engines_of = f"layout {layout}" if engines is None else engines.path
    typer.echo(f"{output}: {namespace}, built from {engines_of} and {parts.path}")
    if mjcf is not None:
        _write_mjcf(urdf, output, mjcf, namespace)
    _judge(parts, engines)


def _files(
    thrusters: Path | None, components: Path | None, sensors: Path | None, layout: str | None
) -> tuple["PartsFile | None", "PartsFile"]:
    """The two files, read; no thruster file where there is a layout."""
    from vrx_mj.config.parts.generate import example_file
    from vrx_mj.config.parts.read import load_parts

    if thrusters is not None and layout is not None:
        raise CommandError("--thrusters and --layout both define the engines: give one of them")
    parts = load_parts(robot_checks.one_of(components, sensors) or example_file("components"), "components")
    if layout is not None:
        return None, parts
    return load_parts(thrusters or example_file("thrusters"), "thrusters"), parts


def _judge(components: "PartsFile", thrusters: "PartsFile | None") -> None:
    """Warn once if the boat is not legal in the competition."""
    from vrx_mj.config.parts.compliance import judge

    reasons = judge(components, thrusters).reasons
    if reasons:
        more = f", and {len(reasons) - 1} more" if len(reasons) > 1 else ""
        message = f"not compliant with VRX's rules: {reasons[0]}{more}; vrx-mj robot check lists all"
        warnings.warn(message, VrxWarning, stacklevel=2)


def _write_mjcf(urdf: str, file: Path, output: Path, namespace: str) -> None:
    from vrx_mj.config.boats import assembled
    from vrx_mj.config.robots import RobotConfig
    from vrx_mj.config.urdf.gazebo import read_gazebo
    from vrx_mj.config.urdf.reader import read_urdf
    from vrx_mj.config.urdf.xacro_files import own_packages
    from vrx_mj.mjcf.robot_files import save_robot

    robot = read_urdf(urdf, file, packages=own_packages())
    boat = assembled(robot, read_gazebo(robot), RobotConfig(urdf="wamv.urdf"))
    if boat.warnings:
        warnings.warn("; ".join(boat.warnings), VrxWarning, stacklevel=2)
    with writing("the MJCF", output):
        output.absolute().parent.mkdir(parents=True, exist_ok=True)
        save_robot(boat, output, name=namespace)
    typer.echo(f"{output}: opens in MuJoCo, without water and thrust; to sail the boat, name it in a fleet file")


robot_checks.register(app)
