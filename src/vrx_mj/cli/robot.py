"""`vrx-mj robot`: from thruster and component files to a boat."""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option, Typer, echo

from vrx_mj.arguments import check_name
from vrx_mj.bar import Bar
from vrx_mj.cli.options import MAX_NUMBER, Scale, above_zero, named_values, reads_files
from vrx_mj.cli.screen import print_table
from vrx_mj.errors import CommandError, VrxError, quote, warn
from vrx_mj.outputs import atomic_write, write_file, writing

if TYPE_CHECKING:
    from vrx_mj.arrays import FloatArray
    from vrx_mj.formats.parts.compliance import PartVerdict, Rules, Verdict
    from vrx_mj.formats.parts.read import Parameter, PartType
    from vrx_mj.frames import Vector
    from vrx_mj.mjcf.flotation import HullSheet

app = Typer(rich_markup_mode=None)
_Thrusters = Annotated[Path | None, Option(help="Thruster file (YAML).")]
_Components = Annotated[
    Path | None,
    Option("--components", "--sensor-yaml", help="Component file (YAML), --sensor-yaml in VRX until 1.5."),
]
_RuleSet = Annotated[str, Option(help="Rule set: classic, jazzy or 2019.")]


@app.command()
def build(
    output: Annotated[Path, Option("--output", "-o", help="The URDF to write.")],
    thrusters: _Thrusters = None,
    components: _Components = None,
    layout: Annotated[str | None, Option(help="H, T or X, instead of a thruster file.")] = None,
    namespace: Annotated[str, Option(help="Prefix of links, joints, frames and topics.")] = "wamv",
    locked: Annotated[
        bool, Option("--locked", help="Fix the position: the boat only heaves, rolls and pitches.")
    ] = False,
    mjcf: Annotated[Path | None, Option(help="Write MJCF too, with its meshes in the folder assets beside it.")] = None,
) -> None:
    """Build the URDF of a boat from thruster and component files, as VRX's generate_wamv.launch does.

    Without a file, VRX's example is used; an empty file gives a boat without thrusters or components. A boat that
    breaks the rules is built, with a warning.

    Example: vrx-mj robot build --thrusters thruster_config.yaml --components component_config.yaml -o my_wamv.urdf
    """
    from vrx_mj.formats.parts.compliance import judge
    from vrx_mj.formats.parts.read import example_file, load_parts, wamv_urdf

    if thrusters is not None and layout is not None:
        raise CommandError("--thrusters and --layout both define the engines: give one of them")
    parts = load_parts(components or example_file("components"), "components")
    engines = None if layout else load_parts(thrusters or example_file("thrusters"), "thrusters")
    arguments = {} if layout is None else {"thruster_config": layout}
    urdf = wamv_urdf(thrusters=engines, components=parts, namespace=namespace, locked=locked, arguments=arguments)
    with atomic_write(output, "the URDF") as draft:
        output.absolute().parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(urdf, encoding="utf-8", newline="\n")
    engines_of = f"layout {layout}" if engines is None else engines.path
    echo(f"{output}: {namespace}, built from {engines_of} and {parts.path}")
    if mjcf is not None:
        _write_mjcf(urdf, output, mjcf, namespace)
    if reasons := judge(parts, engines).reasons:
        more = f", and {len(reasons) - 1} more" if len(reasons) > 1 else ""
        message = f"not compliant with VRX's rules: {reasons[0]}{more}; vrx-mj robot check lists all"
        warn(message)


def _write_mjcf(urdf: str, file: Path, output: Path, namespace: str) -> None:
    from vrx_mj.config.robots import RobotConfig
    from vrx_mj.formats.urdf.expand import own_packages
    from vrx_mj.formats.urdf.reader import MeshFiles, read_urdf
    from vrx_mj.mjcf.boats import assemble_boat
    from vrx_mj.mjcf.robots import save_robot

    robot = read_urdf(urdf, file, MeshFiles(file.absolute().parent, own_packages()))
    boat = assemble_boat(robot, RobotConfig(urdf="wamv.urdf"))
    if boat.warnings:
        warn("; ".join(boat.warnings), 2)
    save_robot(boat, output, name=namespace)
    echo(f"{output}: opens in MuJoCo, without water and thrust; to sail the boat, name it in a fleet file")


@app.command()
def check(
    components: _Components = None,
    thrusters: _Thrusters = None,
    rules: _RuleSet = "classic",
    picture: Annotated[Path | None, Option(help="Draw the boxes and parts (.png, .pdf or .svg).")] = None,
) -> None:
    """Check every part of a boat against the rules. The exit code is 1 if the boat is not compliant.

    Example: vrx-mj robot check --components component_config.yaml --thrusters thruster_config.yaml --picture boat.png
    """
    from vrx_mj.formats.parts.compliance import judge
    from vrx_mj.formats.parts.read import load_parts

    if components is None and thrusters is None:
        raise VrxError("nothing to check: give --components FILE, --thrusters FILE or both")
    verdict = judge(
        load_parts(components, "components") if components else None,
        load_parts(thrusters, "thrusters") if thrusters else None,
        rules,
    )
    print_verdict(verdict)
    if picture is not None:
        from vrx_mj.draw.boat_pictures import draw_verdict

        with writing("the picture", picture):
            draw_verdict(verdict, picture)
        echo(f"picture: {picture}")
    if not verdict.compliant:
        raise SystemExit(1)


@app.command()
def parts(
    type_: Annotated[str | None, Argument(metavar="TYPE", help="One type of part; default: all.")] = None,
    rules: _RuleSet = "classic",
) -> None:
    """List the types of parts that files may have, with their parameters, defaults, units and limits.

    Example: vrx-mj robot parts wamv_camera
    """
    from vrx_mj.formats.parts.compliance import load_rules
    from vrx_mj.formats.parts.read import part_types

    types = part_types()
    if type_ is not None:
        check_name("type of part", type_, types)
    book = load_rules(rules)
    for name in [type_] if type_ else types:
        _print_type(types[name], book)
        for line in ("", *_limits(types[name], book), ""):
            echo(line)


@app.command()
@reads_files
def show(
    robot: Annotated[str, Argument(help="A URDF, xacro or SDF, the folder of one, or the name of a robot.")],
    arguments: Annotated[
        list[str] | None, Argument(metavar="[NAME:=VALUE]...", help="Arguments of the robot's xacro.")
    ] = None,
    record: Annotated[
        Path | None,
        Option(help="Write a recording for rerun (.rrd) instead; without a display: NAME_joints.rrd."),
    ] = None,
) -> None:
    """Show a robot in MuJoCo's viewer, its joints as sliders under 'Control' on the right.

    Any robot works, not only a boat: there is no gravity or contact, and the root link is fixed. Sliders need a
    display: without one, a recording is written in which each joint in turn moves to both limits.

    Example: vrx-mj robot show wamv
    """
    from vrx_mj.config.fleet import Order
    from vrx_mj.draw.display import no_window
    from vrx_mj.drive.window import show_joints
    from vrx_mj.mjcf.build import robot_of
    from vrx_mj.mjcf.robots import jointed_model

    found = robot_of(Order(robot=robot, arguments=tuple(named_values(arguments).items())))
    model = jointed_model(found)
    echo(f"{found.name}: {len(found.links)} links, {model.njnt} of {len(found.joints)} joints move")
    reason = None if record else no_window()
    if record is None and reason is None:
        show_joints(model)
        return
    from vrx_mj.recording.encoding import save_joints

    file = record or Path(f"{Path(robot).name.partition('.')[0] or 'robot'}_joints.rrd")
    save_joints(model, found.name, file)
    echo(f"no sliders, as the viewer cannot open: {reason}" if reason else "no sliders: they need the viewer")
    echo(f"{file}: each joint moves in turn; open it with: rerun {file}")


@app.command()
def hydro(
    mesh: Annotated[Path, Argument(help="Closed mesh of the hull [m]: x forward, y left, z up.")],
    mass: Annotated[float, Option(help="Mass of the boat [kg].", callback=above_zero())],
    center: Annotated[str, Option(help="Centre of mass in the mesh's axes: x,y,z [m].")] = "0,0,0",
    density: Annotated[float, Option(help="Density of the water [kg/m3].", callback=above_zero())] = 1025.0,
    scale: Scale = 1.0,
    output: Annotated[Path | None, Option("--output", "-o", help="Write the sheet as JSON too.")] = None,
    bem: Annotated[
        Path | None,
        Option(
            metavar="FILE", help="Write added mass, radiation and diffraction by Capytaine, for `hull: {hydro: FILE}`."
        ),
    ] = None,
    frequencies: Annotated[int, Option(min=10, max=500, help="Number of frequencies of --bem.")] = 40,
    panels: Annotated[int, Option(min=50, max=2000, help="Number of wet panels of --bem, before any is halved.")] = 150,
    tolerance: Annotated[
        float,
        Option(min=0.001, max=1, help="Halve the panels of --bem until forces change by at most this share."),
    ] = 0.02,
) -> None:
    """Print the hydrostatics of a hull: displacement, centres, metacentric heights, righting arms to 180 degrees.

    The boat floats upright and without trim. With --bem the mesh's axes are those of the robot's base link.

    Example: vrx-mj robot hydro hull.stl --mass 180 --center 0,0,0.15
    """
    import numpy as np

    from vrx_mj.mjcf.flotation import flotation_at, hull_sheet

    corners = read_hull(mesh, scale)
    sheet = hull_sheet(corners, mass, coordinates(center), density)
    for note in flotation_at(corners, sheet.waterline).remarks(np.array(sheet.center_of_mass), "--center"):
        warn(f"mesh {mesh.name}: {note}")
    for line in _sheet_lines(sheet):
        echo(line)
    if output is not None:
        write_file(output, json.dumps(asdict(sheet), indent=1) + "\n", "the sheet")
    if bem is not None:
        _write_bem(bem, corners, sheet, frequencies, panels, tolerance)


def read_hull(mesh: Path, scale: float) -> "FloatArray":
    """Closed triangles (n, 3, 3) of a mesh [m], warned of what was mended and of surfaces that pass through themselves.

    Raises:
        VrxError: it cannot be read, or parts of it are inside out.
    """
    from vrx_mj.config.shapes import solid_of_mesh
    from vrx_mj.formats.urdf.reader import read_mesh
    from vrx_mj.mjcf.surfaces import checked_surface

    data = read_mesh(mesh, (scale, scale, scale))
    whole = solid_of_mesh(mesh.name, data.points, data.triangles)
    try:
        notes = [*whole.notes, *(f"mesh {mesh.name}: {note}" for note in checked_surface(whole.corners))]
    except VrxError as error:
        raise VrxError(f"mesh {mesh.name}: {error}") from None
    for note in notes:
        warn(note)
    return whole.corners


def _write_bem(
    file: Path, corners: "FloatArray", sheet: "HullSheet", frequencies: int, panels: int, tolerance: float
) -> None:
    """Write the radiation and diffraction of a hull, about its centre of mass."""
    from vrx_mj.adapters.hydro import hydro_of_hull

    with Bar("frequencies", frequencies) as bar:
        table = hydro_of_hull(
            corners, sheet.waterline, sheet.center_of_mass, density=sheet.density, gravity=sheet.gravity,
            frequencies=frequencies, panels=panels, tolerance=tolerance, progress=lambda done, _: bar.update(done),
        )  # fmt: skip
    table |= {"displacement": sheet.mass, "waterline": sheet.waterline}
    write_file(file, json.dumps(table) + "\n", "radiation and diffraction")
    change, last = table["mesh_error"], table["frequencies"][-1]
    echo(f"{file}: {table['program']}, to {last:.3g} rad/s")
    echo(f"  memory of {len(table['poles'])} poles: {table['fit_error']:.1%} off the computed radiation")
    halved = "unknown: too many panels" if change is None else f"up to {change:.1%} of a force"
    echo(f"  change by halving the panels: {halved}")
    if change is None or change > tolerance:
        limit = f"more than the requested {tolerance:.1%}" if change else "the error is unknown"
        warn(f"{file}: {limit}, and finer panels are too many: simplify the mesh", 2)


def coordinates(text: str) -> tuple[float, float, float]:
    """The three numbers of --center [m]."""
    try:
        x, y, z = (float(word) for word in text.split(","))
    except ValueError:
        raise CommandError(f"invalid --center {quote(text)}: x,y,z [m] are needed, as 0,0,0.15") from None
    if not all(abs(value) < MAX_NUMBER for value in (x, y, z)):
        raise CommandError(f"invalid --center {quote(text)}: numbers are needed")
    return x, y, z


def _m(value: float) -> str:
    """A length [m] with four digits, and no sign before 0."""
    return f"{round(value, 4) + 0.0:.4f}"


def _sheet_lines(sheet: "HullSheet") -> Iterator[str]:
    """The sheet as text."""
    (gm_t, gm_l), (bm_t, bm_l), (c33, c44, c55) = sheet.gm, sheet.bm, sheet.stiffness
    x, y, z = sheet.center_of_buoyancy
    rows = (
        ("displacement", f"{sheet.mass:.4g} kg, {sheet.volume:.4g} m3 at {sheet.density:g} kg/m3"),
        ("draft", f"{sheet.draft:.4f} m; the water is at z = {sheet.waterline:.4f} m of the mesh"),
        ("centre of buoyancy", f"x {_m(x)}, y {_m(y)}, z {_m(z)} m; KB {_m(sheet.kb)} m, KG {_m(sheet.kg)} m"),
        ("waterplane", f"{sheet.waterplane_area:.4f} m2, its middle at x {_m(sheet.center_of_flotation)} m"),
        ("metacentric radius", f"BM {bm_t:.4f} m, longitudinal {bm_l:.4f} m"),
        ("metacentric height", f"GM {gm_t:.4f} m, longitudinal {gm_l:.4f} m"),
        ("stiffness", f"C33 {c33:.5g} N/m, C44 {c44:.5g} N m/rad, C55 {c55:.5g} N m/rad"),
        ("sinkage", f"{sheet.tonnes_per_centimetre:.4g} t for each cm"),
    )
    width = max(len(name) for name, _ in rows)
    yield from (f"{name:<{width}}  {text}" for name, text in rows)
    yield "righting arms GZ [m] by heel [deg]:"
    arms = [f"{heel:3.0f}: {_m(arm):>7}" for heel, arm in sheet.righting_arms]
    yield from ("  " + "   ".join(arms[start : start + 6]) for start in range(0, len(arms), 6))


def print_verdict(verdict: "Verdict") -> None:
    """Print the table of parts, what they come to, and the result of VRX's own generator."""
    from rich.text import Text

    rows = []
    for part in verdict.parts:
        row = (part.instance.type, part.name, _point(part.point) if part.point else "", "\n".join(_verdict_lines(part)))
        rows.append([Text(cell, style="" if part.compliant else "red") for cell in row])
    if rows:
        print_table(f"rules of {verdict.rules.description}", ("part", "name", "x y z [m]", "verdict"), (), rows)
    for line in _conclusion(verdict):
        echo(line)


def _verdict_lines(part: "PartVerdict") -> Iterator[str]:
    """The verdict on a part, where one outside every box may go, and what ROS makes of its name."""
    if part.compliant:
        yield f"pass: in {part.box.name}" if part.box else "pass"
    for breach in part.breaches:
        yield breach.message
        if breach.rule == "place" and part.legal:
            yield f"nearest legal place: {_point(part.legal.point)} in {part.legal.box.name}"
        elif breach.rule == "place":
            yield "no box has room for it"
    if part.warning:
        yield f"warning: {part.warning}"


def _conclusion(verdict: "Verdict") -> Iterator[str]:
    bad, count = sum(not part.compliant for part in verdict.parts), len(verdict.parts)
    if verdict.compliant:
        yield f"compliant: all parts pass ({count})" if count else "compliant: no parts"
    else:
        yield f"not compliant: {bad} of {count} parts break a rule"
        yield "it can still be built and sailed"
    yield from _about_generator(verdict)


def _about_generator(verdict: "Verdict") -> Iterator[str]:
    """The result of VRX's own generator, and why it may differ."""
    result = verdict.generator
    if result.stops:
        yield "VRX's own generator would stop without a result, at:"
        yield from (f"  {stop}" for stop in result.stops)
        return
    banner = "compliant" if result.passes else "not compliant"
    logs = "it logs errors on the way, which fails the boat in a competition" if result.errors else "it logs no error"
    yield f"VRX's own generator, which judges each file by its last part, would say {banner}; {logs}"


def _print_type(part: "PartType", book: "Rules") -> None:
    rules = book.of(part.kind).types.get(part.name)
    permitted = {each.name: "yes" if rules and each.name in rules.parameters else "no" for each in part.parameters}
    rows = [
        (one.name, _default(one), one.unit, permitted[one.name],
         one.meaning + f" (VRX {one.release} only)" * bool(one.release))
        for one in part.parameters
    ]  # fmt: skip
    heads = ("parameter", "default", "unit", "permitted", "meaning")
    print_table(f"{part.name}: {part.meaning}", heads, (), rows)


def _default(parameter: "Parameter") -> str:
    value = parameter.default
    if value is None:
        return "required"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else value


def _limits(part: "PartType", book: "Rules") -> Iterator[str]:
    """How many, and where."""
    rules, own = book.of(part.kind), book.of(part.kind).types.get(part.name)
    yield f"at most {own.most} by the rules of {book.description}" if own else f"not in the rules of {book.description}"
    if part.kind == "components" and part.parameter("z") is None:
        return
    for box in rules.boxes:
        ranges = ", ".join(
            f"{axis} {low:g} to {high:g}" for axis, low, high in zip("xyz", box.low, box.high, strict=True)
        )
        room = "any number" if box.capacity is None else f"{box.capacity} part{'s'[: box.capacity != 1]}"
        yield f"  in {box.name}: {ranges} m; {room}"


def _point(point: "Vector") -> str:
    return " ".join(f"{x + 0.0:.10g}" for x in point)
