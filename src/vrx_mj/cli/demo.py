"""`vrx-mj demo`: three boats on the example course, recorded and shown."""

import itertools
from pathlib import Path
from typing import Annotated

import typer

from vrx_mj.cli.files import writing
from vrx_mj.cli.screen import program, to_open
from vrx_mj.errors import VrxError
from vrx_mj.packages import shell_word

__all__ = ["demo"]

WORLD, FLEET, THRUST = "example_course", "trio", "left=0.5,right=0.4"
NAME = "vrx-mj-demo"
"""Name of the recording in the current folder, without its suffix and the number that distinguishes later ones."""


def demo(
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The recording; default: a new vrx-mj-demo.rrd here.")
    ] = None,
    duration: Annotated[float, typer.Option(help="Simulated seconds.")] = 45.0,
    open_: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the recording in the viewer, where there is a display.")
    ] = True,
) -> None:
    """Sail three boats into a recording, and open it in the viewer.

    The boats of fleet trio turn on example_course under steady thrust. The recording is a new file: earlier ones are
    kept. Without a display the last line says how to open it. Ctrl-C keeps what has been recorded.

    Example: vrx-mj demo
    """
    from vrx_mj.cli.sailing import sail

    file = _free_name(output)
    typer.echo(f"world {WORLD}, fleet {FLEET}, {duration:g} s, thrust {THRUST}; recording: {file.absolute()}", err=True)
    result = sail(WORLD, FLEET, duration=duration, seed=None, path=file, control=None, thrust=THRUST)
    typer.echo(f"sailed {result.sim_time:g} s in {result.wall_time:.1f} s: {result.real_time_factor:.0f} x real time")
    typer.echo("the same by hand: " + by_hand(file, duration))
    if result.interrupted:
        typer.echo(f"interrupted; {to_open(file)}")
        raise SystemExit(1)
    from vrx_mj.drive.display import has_display

    shown = has_display()
    if not (open_ and shown):
        typer.echo(to_open(file) if shown else f"no display here; {to_open(file)}")
        return
    from vrx_mj.recording import open_viewer

    typer.echo("opening the viewer: close its window or press Ctrl-C to end")
    raise SystemExit(open_viewer(file))


def by_hand(file: Path, duration: float) -> str:
    """The command that makes this recording."""
    words = f"{program()} run {WORLD} --fleet {FLEET} --thrust {THRUST} --duration {duration:g} --record"
    return f"{words} {shell_word(str(file))}"


def _free_name(output: Path | None) -> Path:
    """The file that was asked for, or one in the current folder; never one that exists.

    Raises:
        VrxError: it exists, or cannot be written.
    """
    if output is not None and output.exists():
        raise VrxError(f"{output} exists: choose another name, or remove it")
    names = (Path(f"{NAME}{f'-{number}' if number > 1 else ''}.rrd") for number in itertools.count(1))
    file = output or next(name for name in names if not name.exists())
    with writing("the recording", file):
        file.touch(exist_ok=False)
        file.unlink()
    return file
