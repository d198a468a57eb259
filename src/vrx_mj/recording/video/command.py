"""`vrx-mj replay --video`: from the words of the command line to a video."""

from __future__ import annotations

import re
from pathlib import Path

from vrx_mj.bar import Bar
from vrx_mj.errors import VideoError
from vrx_mj.recording.video.filming import Shot, write_video

__all__ = ["draw_video", "parse_size"]


def draw_video(recording: Path, video: Path, shot: Shot) -> str:
    """Draw a recording into a video, and show how far it is; returns a line about it. Errors: `write_video`."""
    with Bar("drawing", 0.0, "pictures") as bar:
        count = write_video(recording, video, shot, progress=lambda done, total: bar.update(done, total=total))
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
