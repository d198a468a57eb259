"""`vrx-mj score`, and the task's lines of a run."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrx_mj.cli.screen import score_line

if TYPE_CHECKING:
    from vrx_mj.recording.rescoring import Scored

__all__ = ["score"]


def score(
    recording: Annotated[Path, typer.Argument(help="A recording (.rrd) of a world with a task.")],
    events: Annotated[bool, typer.Option("--events", help="Print the referee's messages too.")] = False,
) -> None:
    """Score a recording again, with the task's own rules. The score equals that of the run.

    Example: vrx-mj score run.rrd
    """
    from vrx_mj.recording.rescoring import rescore

    scored = rescore(recording)
    for time, text, level in scored.events if events else ():
        typer.echo(f"{time:8.2f} s  {level:5}  {text}")
    typer.echo(_result(scored))


def _result(scored: "Scored") -> str:
    from vrx_mj.tasks.registry import TASK_KINDS

    referee, status = scored.referee, scored.status
    meaning = TASK_KINDS[referee.type]
    return score_line(
        referee.name, status.phase, status.score, meaning.unit, meaning.better, status.collisions, status.timed_out
    )
