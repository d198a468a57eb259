"""`vrx-mj replay --video`: from the words of the command line to a video."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from vrx_mj.adapters.video.filming import Shot, write_video
from vrx_mj.errors import VideoError

__all__ = ["draw_video", "parse_size"]


def draw_video(recording: Path, video: Path, shot: Shot) -> str:
    """Draw a recording into a video with a bar in the terminal; returns a line about it. Errors: `write_video`."""
    with _bar() as tick:
        count = write_video(recording, video, shot, progress=tick)
    return f"video: {video}, {count} pictures, {video.stat().st_size / 1e6:.1f} MB"


def parse_size(text: str | None) -> tuple[int, int] | None:
    """Width and height from `1280x720`.

    Raises:
        VideoError: it is not of that form.
    """
    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", text.strip())
    if found is None:
        raise VideoError(f"invalid size '{text}': width and height in pixels are needed, as in 1280x720")
    return int(found[1]), int(found[2])


@contextmanager
def _bar() -> Iterator[Callable[[int, int], None]]:
    """A bar with the time left, in a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (
        TextColumn("drawing"),
        BarColumn(),
        TextColumn("{task.completed} of {task.total}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as shown:
        bar = shown.add_task("drawing", total=None)
        yield lambda done, total: shown.update(bar, completed=done, total=total)
