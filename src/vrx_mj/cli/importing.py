"""`vrx-mj import`: files of Gazebo and VRX as files of ours."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrx_mj.cli.options import Arguments, Folder, Strict, named_values, reads_files
from vrx_mj.errors import CommandError
from vrx_mj.outputs import Content, begins, write_files

if TYPE_CHECKING:
    from vrx_mj.formats.gazebo.importing import Imported


@reads_files
def import_(
    source: Annotated[Path, typer.Argument(help="A world, launch file, boat or model, or a folder of them.")],
    output: Folder,
    arguments: Arguments = None,
    strict: Strict = False,
) -> None:
    """Write files of Gazebo and VRX as files of ours. The file import.md has a table of what became of each part.

    It reads .world, .world.xacro, .sdf, .launch, .urdf, .xacro, model folders and the docks' .sdf.erb, and runs none of
    them. Commands take worlds of Gazebo as they are, too: vrx-mj run my_course.world

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
        raise CommandError("--strict: there are parts that are not read")


def _write(made: "Imported", folder: Path) -> None:
    """Write everything, over the files of an earlier import but over no others."""
    from vrx_mj.formats.gazebo.importing import HEAD, TABLE, TITLE

    def is_ours(name: str) -> bool:
        if name.endswith(".yaml"):
            return begins(folder / name, HEAD)
        return (folder / TABLE).is_file() and begins(folder / TABLE, TITLE)

    files: dict[str, Content] = {**made.texts, TABLE: made.table(), **made.copies}
    write_files(folder, files, "the import", replaces=is_ours, kind="of an import")
