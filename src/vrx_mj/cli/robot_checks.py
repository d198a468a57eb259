"""`vrx-mj robot check` and `vrx-mj robot parts`: whether a boat is legal, and what it may have."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrx_mj.cli.files import writing
from vrx_mj.errors import CommandError, UnknownNameError, VrxError

if TYPE_CHECKING:
    from rich.table import Table

    from vrx_mj.config.parts.boxes import Point
    from vrx_mj.config.parts.catalogue import Parameter, PartType
    from vrx_mj.config.parts.compliance import PartVerdict, Verdict
    from vrx_mj.config.parts.rules import Rules

__all__ = ["SensorYaml", "check", "one_of", "parts", "register"]

SensorYaml = Annotated[Path | None, typer.Option(help="The name of --components in VRX until 1.5.")]
RuleSet = Annotated[str, typer.Option(help="Rule set: classic, jazzy or 2019.")]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(check)
    app.command()(parts)


def check(
    components: Annotated[Path | None, typer.Option(help="Component file (YAML).")] = None,
    thrusters: Annotated[Path | None, typer.Option(help="Thruster file (YAML).")] = None,
    sensor_yaml: SensorYaml = None,
    rules: RuleSet = "classic",
    picture: Annotated[Path | None, typer.Option(help="Draw the boxes and parts (.png, .pdf or .svg).")] = None,
) -> None:
    """Check every part of a boat against the rules. The exit code is 1 if the boat is not compliant.

    Example: vrx-mj robot check --components component_config.yaml --thrusters thruster_config.yaml --picture boat.png
    """
    from vrx_mj.config.parts.compliance import judge
    from vrx_mj.config.parts.read import load_parts

    components = one_of(components, sensor_yaml)
    if components is None and thrusters is None:
        raise VrxError("nothing to check: give --components FILE, --thrusters FILE or both")
    verdict = judge(
        load_parts(components, "components") if components else None,
        load_parts(thrusters, "thrusters") if thrusters else None,
        rules,
    )
    print_verdict(verdict)
    if picture is not None:
        from vrx_mj.draw.compliance_picture import draw_verdict

        with writing("the picture", picture):
            draw_verdict(verdict, picture)
        typer.echo(f"picture: {picture}")
    if not verdict.compliant:
        raise SystemExit(1)


def one_of(components: Path | None, sensor_yaml: Path | None) -> Path | None:
    """The component file, by whichever of its two names it is given."""
    if components is not None and sensor_yaml is not None:
        raise CommandError("--components and --sensor-yaml are two names of one option: give one of them")
    return components or sensor_yaml


def parts(
    type_: Annotated[str | None, typer.Argument(metavar="TYPE", help="One type of part; default: all.")] = None,
    rules: RuleSet = "classic",
) -> None:
    """List the types of parts that files may have, with their parameters, defaults, units and limits.

    Example: vrx-mj robot parts wamv_camera
    """
    from rich.console import Console

    from vrx_mj.config.parts.catalogue import TYPES
    from vrx_mj.config.parts.rules import load_rules

    if type_ is not None and type_ not in TYPES:
        raise UnknownNameError("type of part", type_, TYPES)
    book, out = load_rules(rules), Console()
    for name in [type_] if type_ else TYPES:
        out.print(_type_table(TYPES[name], book), "")
        for line in _limits(TYPES[name], book):
            out.print(line, markup=False, highlight=False, soft_wrap=True)
        out.print()


def print_verdict(verdict: "Verdict") -> None:
    """The table of parts, what they come to, and what VRX's own generator would say."""
    from rich.console import Console

    out = Console()
    if verdict.parts:
        out.print(_verdict_table(verdict))
    for line in _conclusion(verdict):
        out.print(line, markup=False, highlight=False, soft_wrap=True)


def _verdict_table(verdict: "Verdict") -> "Table":
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(f"rules of {verdict.rules.description}"))
    table.add_column("part", no_wrap=True)
    table.add_column("name", overflow="fold")
    table.add_column(Text("x y z [m]"))
    table.add_column("verdict", overflow="fold")
    for part in verdict.parts:
        row = (part.instance.type, part.name, _point(part.point) if part.point else "", "\n".join(_says(part)))
        table.add_row(*(Text(cell, style="" if part.compliant else "red") for cell in row))
    return table


def _says(part: "PartVerdict") -> Iterator[str]:
    """The verdict on a part; for one outside every box, where it may go."""
    if part.compliant:
        yield f"pass: in {part.box.name}" if part.box else "pass"
    for breach in part.breaches:
        yield breach.message
        if breach.rule == "place" and part.legal:
            yield f"nearest legal place: {_point(part.legal.point)} in {part.legal.box.name}"
        elif breach.rule == "place":
            yield "no box has room for it"


def _conclusion(verdict: "Verdict") -> Iterator[str]:
    bad, count = sum(not part.compliant for part in verdict.parts), len(verdict.parts)
    if verdict.compliant:
        yield f"compliant: all parts pass ({count})" if count else "compliant: no parts"
    else:
        yield f"not compliant: {bad} of {count} parts break a rule"
        yield "it can be built and sailed all the same"
    yield from _about_generator(verdict)


def _about_generator(verdict: "Verdict") -> Iterator[str]:
    """What VRX itself would say, and why that may differ."""
    result = verdict.generator
    if result.stops:
        yield "VRX's own generator would stop without a result, at:"
        yield from (f"  {stop}" for stop in result.stops)
        return
    banner = "compliant" if result.passes else "not compliant"
    logs = "it logs errors on the way, which fails the boat in a competition" if result.errors else "it logs no error"
    yield f"VRX's own generator, which judges each file by its last part, would say {banner}; {logs}"


def _type_table(part: "PartType", book: "Rules") -> "Table":
    from rich.table import Table
    from rich.text import Text

    rules = book.of(part.kind).types.get(part.name)
    table = Table(title=Text(f"{part.name}: {part.meaning}"), title_justify="left")
    for name in ("parameter", "default", "unit", "permitted", "meaning"):
        table.add_column(Text(name))
    for each in part.parameters:
        permitted = "yes" if rules and each.name in rules.parameters else "no"
        table.add_row(*map(Text, (each.name, _default(each), each.unit, permitted, _meaning(each))))
    return table


def _default(parameter: "Parameter") -> str:
    value = parameter.default
    if value is None:
        return "required"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else value


def _meaning(parameter: "Parameter") -> str:
    return f"{parameter.meaning} (VRX {parameter.release} only)" if parameter.release else parameter.meaning


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


def _point(point: "Point") -> str:
    return " ".join(f"{x + 0.0:.10g}" for x in point)
