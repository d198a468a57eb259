"""`vrx-mj import`: files of Gazebo and VRX as files of ours.

`vrx-mj worlds`: many worlds from one file.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrx_mj.bar import Bar
from vrx_mj.cli.options import Arguments, Folder, Strict, named_values, reads_files
from vrx_mj.errors import CommandError, VrxError, shorten
from vrx_mj.outputs import Content, begins, write_files

if TYPE_CHECKING:
    from vrx_mj.formats.gazebo.importing import Imported
    from vrx_mj.formats.series.worlds import SeriesWorld


@reads_files
def import_(
    source: Annotated[Path, typer.Argument(help="A world, launch file, boat or model, or a folder of them.")],
    output: Folder,
    arguments: Arguments = None,
    strict: Strict = False,
) -> None:
    """Convert files of Gazebo and VRX to ours. The file import.md lists what became of each part.

    It reads .world, .world.xacro, .sdf, .launch, .urdf, .xacro, model folders and the docks' .sdf.erb, and runs none of
    them. Other commands take Gazebo's worlds without conversion: vrx-mj run my_course.world

    Example: vrx-mj import my_course.world.xacro -o my_course
    """
    from vrx_mj.formats.gazebo.importing import FATES, TABLE, import_files

    made = import_files(source, named_values(arguments))
    _write(made, output)
    counts = ", ".join(f"{made.count(fate)} {fate}" for fate in FATES)
    typer.echo(f"{counts}: {output / TABLE}")
    for message in made.failed:
        typer.echo(f"not read: {message}", err=True)
    for world, fleet in made.sails[:3]:
        paths = [str(output / name if name in made.texts else name) for name in (world, fleet) if name]
        words = [f'"{path}"' if " " in path else path for path in paths]  # in any shell
        typer.echo(f"to sail: vrx-mj run {' --fleet '.join(words)}")
    if strict and (made.failed or made.count("not read")):
        raise CommandError("--strict: some parts are not read")


def _write(made: "Imported", folder: Path) -> None:
    """Write everything, over the files of an earlier import but over no others."""
    from vrx_mj.formats.gazebo.importing import HEAD, TABLE, TITLE

    def is_ours(name: str) -> bool:
        if name.endswith(".yaml"):
            return begins(folder / name, HEAD)
        return (folder / TABLE).is_file() and begins(folder / TABLE, TITLE)

    files: dict[str, Content] = {**made.texts, TABLE: made.table(), **made.copies}
    write_files(folder, files, "the import", replaces=is_ours, kind="of an import")


app = typer.Typer(rich_markup_mode=None)
_SIDES = "config"
"""The folder inside of the output for the files beside worlds."""


@app.command()
def generate(
    file: Annotated[str, typer.Argument(help="Path of an axes file (YAML).")],
    output: Folder,
) -> None:
    """Write the worlds of an axes file, and print the steps of each. If one is invalid, none is written.

    run, map and campaign also take FILE#k: world k of the series, counted from 0, without writing it.

    Example: vrx-mj worlds generate wind_and_waves.yaml -o my_worlds
    """
    from vrx_mj.config.kinds import wrong_kind
    from vrx_mj.config.loading import file_of
    from vrx_mj.config.world import load_world
    from vrx_mj.formats.series.axes import read_series
    from vrx_mj.formats.series.worlds import HEAD, series_world, side_text, world_text

    if other := wrong_kind(Path(file), "an axes file"):
        raise VrxError(f"'{shorten(file)}' is {other}")
    series = read_series(file_of("worlds", file))
    made = [series_world(series, number) for number in range(series.count)]
    texts: dict[str, str] = {}
    with Bar("checking", len(made), "worlds") as bar:
        for number, world in enumerate(made, 1):
            load_world(world.section)
            texts[f"{world.name}.yaml"] = world_text(series, world)
            if world.side is not None:
                texts[f"{_SIDES}/{world.name}.yaml"] = side_text(series, world)
            bar.update(number)
    write_files(
        output, texts, "the world", replaces=lambda name: begins(output / name, HEAD), kind="a world of a series"
    )
    for line in table(made):
        typer.echo(line)
    first = output / f"{made[0].name}.yaml"
    typer.echo(f"{len(made)} world{'s' * (len(made) > 1)} in {output}; to sail the first: vrx-mj run {first}")


def table(made: Sequence["SeriesWorld"]) -> Iterator[str]:
    """A line for each world: its name and the step of each axis."""
    rows = [("world", *made[0].coordinate)]
    rows += [(world.name, *map(str, world.coordinate.values())) for world in made]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for name, *steps in rows:
        cells = (step.rjust(width) for step, width in zip(steps, widths[1:], strict=True))
        yield "  ".join([name.ljust(widths[0]), *cells])
