"""From a recording to a video: its pictures, what is written into them, and the files."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from importlib.metadata import distribution
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vrx_mj.arguments import check_name
from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.bar import Bar
from vrx_mj.draw.style import Rgb, boat_colors
from vrx_mj.errors import VideoError
from vrx_mj.model.boats import boat_label
from vrx_mj.outputs import atomic_write
from vrx_mj.packages import install_extra
from vrx_mj.recording.antialiasing import blend, write_yuv
from vrx_mj.recording.reader import Record, read_record
from vrx_mj.recording.video.stage import BEHIND, Above, Chase, Eye, Footage, Instant, Stage, view_of
from vrx_mj.sensors.view import View
from vrx_mj.tasks.referee import TaskStatus, score_text

if TYPE_CHECKING:
    from PIL import ImageFont

VIEWS = ("both", "chase", "above")
"""Views of a video; both: behind a boat, with the view from above in a corner."""
_MAX_SIDE = 4096
"""Largest side of a picture [pixels]."""
_INSET, _INSET_EDGE = 0.34, 0.02
"""Width of the view from above in the corner, and its distance from the edges, of the picture's width."""
_INSET_RATE = 4
"""Views in the corner per second, each for several pictures: a boat moves a pixel or two between them."""
_DETAIL = 3.5
"""Pixels of a boat that is followed in which its outermost point stands for all that face one way."""
_EVENT_TIME = 4.0
"""Time for which an event is shown in the picture [s, of the video]."""
_MOST_EVENTS = 3
"""Largest number of events shown at once."""
_MIN_RATE, _MAX_RATE = 0.001, 1000.0
"""Least and largest number of pictures per second, and of simulated seconds per second."""
_FRAME_COLOR = (235, 245, 255)
_FONT = "DejaVuSans.ttf"
"""The font that matplotlib carries."""
_TEXT_SHARE, _NAME_SHARE = 0.034, 0.026
"""Heights of letters of texts and of names, as shares of the picture's height."""
_MIN_LETTER = 9
"""Least height of letters [pixels]."""
_PANEL = (8, 22, 34, 150)
_WHITE: Rgb = (255, 255, 255)
_TAG_HEIGHT = 2.3
"""Height of a name over its boat's origin [m]."""
_NAME_RANGE = 250.0
"""Distance up to which boats are named [m]."""
PHASES = 4
"""Number of steps per pixel in which names move sideways."""
_X264 = {
    "qp": "26", "preset": "superfast", "threads": "1",
    "x264-params": "subme=0:partitions=none:8x8dct=0:bframes=0:weightp=0:psy=0:scenecut=0:rc-lookahead=0",
}  # fmt: skip
"""Encoding of MP4: less `qp` is better; it, the parameters and one thread save two thirds of the time."""
_WEBP_QUALITY, _WEBP_EFFORT = 72, 4
_GIF_COLORS = 128
"""Number of colours of a GIF."""


@dataclass(frozen=True)
class Shot:
    """How a recording is filmed."""

    view: str = "both"
    """One of `VIEWS`."""
    boat: str | None = None
    """The boat that is followed; None: the one that the task scores, or the first."""
    size: tuple[int, int] | None = None
    """Width and height [pixels]; None: by the kind of file."""
    fps: float | None = None
    """Pictures per second; None: by the kind of file."""
    speed: float = 1.0
    """Simulated seconds per second of the video."""
    begin: float | None = None
    """First simulated time [s]; None: that of the recording."""
    end: float | None = None
    """Last simulated time [s]; None: that of the recording."""
    captions: bool = True
    """Whether time, score, names and events are written into the pictures."""


def write_video(
    source: str | Path | Record,
    path: str | Path,
    shot: Shot | None = None,
    *,
    eye: Callable[[float], Eye] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Draw a recording into a video, without a display; returns the number of its pictures.

    The same recording gives the same pictures on the same machine.

    Args:
        source: a recording, or its file.
        path: the video: `.mp4`, `.webp` or `.gif`.
        shot: how it is filmed.
        eye: a camera of your own instead of that of `shot.view`: where it is at a simulated time [s].
        progress: called after every picture with the number of those that are drawn, and of all.

    Raises:
        VideoError: the file or how it is filmed is invalid, or its encoder is not installed.
        UnknownNameError: unknown boat.
        RecordError: the file is not a recording, or has no motion.
        RenderError: nothing can draw here; the message names what to install.
    """
    target = Path(path)
    encoder, size, fps = encoder_of(target)
    recorded = (source if isinstance(source, Record) else read_record(source)).without_divergence()
    recorded.warn_of_physics()
    film = Film(recorded, shot or Shot(), size=size, fps=fps, eye=eye)
    with atomic_write(target, "the video", VideoError) as draft, closing(film):  # where it fails, an older one stays
        draft.open("wb").close()  # not where a folder is
        encoder(draft, film.pictures(progress), len(film.times), film.rate)
    return len(film.times)


class Film:
    """The pictures of a recording. `close` it when they are drawn."""

    def __init__(
        self,
        recorded: Record,
        shot: Shot,
        *,
        size: tuple[int, int],
        fps: float,
        eye: Callable[[float], Eye] | None = None,
    ) -> None:
        """Plan what is drawn; `size` and `fps` are those of a shot that leaves them open."""
        self._footage, self._shot = Footage(recorded), shot
        check_name("view", shot.view, VIEWS)
        self.size = width, height = shot.size or size
        if any(side < 16 or side > _MAX_SIDE or side % 2 for side in self.size):
            wanted = f"two even numbers of pixels from 16 to {_MAX_SIDE} are needed"
            raise VideoError(f"invalid size {width}x{height}: {wanted}")
        rate = _positive("fps", fps if shot.fps is None else shot.fps)
        self.rate = Fraction(rate).limit_denominator(round(1.0 / _MIN_RATE))
        self.times = self._times(_positive("speed", shot.speed))
        """Simulated time of every picture [s]."""
        boat, found = _boat_to_follow(recorded, shot.boat), {name: self._footage.path(name) for name in recorded.boats}
        if not len(found[boat]):
            raise VideoError(f"invalid boat '{boat}': it is in no row of the recording")
        paths = {name: path for name, path in found.items() if len(path)}
        sets = [boat_set.world.parameters.boats for boat_set in recorded.companies]
        self._labels = [{boat.name: boat_label(boat.name, boat.robot) for boat in boats} for boats in sets]
        self._paths, self._colors = paths, boat_colors(recorded.boats, list(chain.from_iterable(sets)))
        self._cell = 0.0 if eye else _DETAIL * BEHIND / view_of(Eye(np.zeros(3), np.eye(3)), *self.size).focal_length
        self._boat, self._chase = boat, Chase(paths[boat], self._footage.level)
        above = Above(list(paths.values()), self._footage.level, width / height)
        eyes = {"chase": self._chase.eye, "above": above.eye}
        self._eyes = [eye] if eye else [at for view, at in eyes.items() if shot.view in (view, "both")]
        self._stages: dict[int, Stage] = {}
        self._inset: tuple[float, ByteArray] | None = None

    def pictures(self, progress: Callable[[int, int], None] | None = None) -> Iterator[ByteArray]:
        """Every picture (height, width, 3), drawn when it is asked for."""
        for number, time in enumerate(self.times, 1):
            picture = self.picture(time)
            if progress is not None:
                progress(number, len(self.times))
            yield picture

    def picture(self, time: float) -> ByteArray:
        """The picture of a simulated time [s]."""
        shown = self._view_picture(time, self._eyes[0], self.size)
        if len(self._eyes) > 1:
            set_in(shown, self._inset_at(time))
        if self._shot.captions:
            self._write(shown, time)
        return shown

    def close(self) -> None:
        """Free the drawing context."""
        while self._stages:
            self._stages.popitem()[1].close()

    def _inset_at(self, time: float) -> ByteArray:
        """The view from above in a thin frame: that of the last time at which it is drawn."""
        step = max(1, round(self.rate / _INSET_RATE)) * self._shot.speed / float(self.rate)
        begin = self.times[0] + math.floor((time - self.times[0]) / step + 1e-6) * step
        if self._inset is None or self._inset[0] != begin:
            width, height = self.size
            small = 2 * round(_INSET * width / 2.0), 2 * round(_INSET * height / 2.0)  # even numbers
            seen = self._view_picture(begin, self._eyes[1], small)
            line = max(1, round(height / 360))
            framed = np.full(np.add(seen.shape, (2 * line, 2 * line, 0)), _FRAME_COLOR, np.uint8)
            framed[line:-line, line:-line] = seen
            self._inset = begin, framed
        return self._inset[1]

    def _view_picture(self, time: float, eye_at: Callable[[float], Eye], size: tuple[int, int]) -> ByteArray:
        """Picture from an eye at a time [s], with the boats' names."""
        moment = self._footage.at(time)
        stage, eye = self._stage_of(moment.boat_set), eye_at(time)
        shown = stage.draw(moment, eye, size)
        if self._shot.captions:
            self._name_boats(shown, view_of(eye, *size), moment)
        return shown

    def _name_boats(self, picture: ByteArray, view: View, moment: Instant) -> None:
        """Write the labels of boats over them, if they are in view and no farther than `_NAME_RANGE`."""
        height, width = picture.shape[:2]
        size = max(_MIN_LETTER, round(height * _NAME_SHARE))
        for name, place in self._footage.places(moment).items():
            spot = project(view, np.add(place, (0.0, 0.0, _TAG_HEIGHT)), width, height)
            if spot is not None and spot[2] < _NAME_RANGE:
                column, phase = divmod(round(PHASES * spot[0]), PHASES)
                tile = name_tile(self._labels[moment.boat_set][name], self._colors[name], size, phase)
                lay(picture, tile, column - tile.shape[1] // 2, round(spot[1]) - len(tile) + 2)

    def _stage_of(self, boat_set: int) -> Stage:
        """The world of the boats that sail together, with a context for the largest picture."""
        if boat_set not in self._stages:
            self.close()
            boats, seed = self._footage.recorded.companies[boat_set], self._footage.recorded.properties.get("seed")
            stage = Stage(boats, self._paths, self.size, seed if isinstance(seed, int) else 0, self._cell)
            self._stages[boat_set] = stage
            self._chase.radius = stage.radii.get(self._boat, self._chase.radius)
        return self._stages[boat_set]

    def _write(self, shown: ByteArray, time: float) -> None:
        """Time, task and score, and what has just happened."""
        world, status = str(self._footage.recorded.properties.get("world")), self._footage.status_at(time)
        lines = [clock_line(world, time, self._shot.speed)]
        _write_lines(shown, lines if status is None else [*lines, *task_lines(*status)])
        since = time - _EVENT_TIME * self._shot.speed
        events = [event for event in self._footage.recorded.events if since < event.time <= time and event.time > 0.0]
        _write_lines(shown, [f"{event.time:.1f} s  {event.text}" for event in events[-_MOST_EVENTS:]], bottom=True)

    def _times(self, speed: float) -> tuple[float, ...]:
        """Simulated times of the pictures [s]."""
        shot, footage = self._shot, self._footage
        begin = footage.start if shot.begin is None else shot.begin
        end = footage.end if shot.end is None else shot.end
        if not footage.start - 1e-9 <= begin < end + 1e-9 or end > footage.end + 1e-9:
            raise VideoError(
                f"invalid span {begin:g} s to {end:g} s: the recording goes from {footage.start:g} to {footage.end:g} s"
            )
        step = speed / float(self.rate)
        return tuple(begin + number * step for number in range(math.floor((end - begin) / step + 1e-6) + 1))


def _boat_to_follow(recorded: Record, boat: str | None) -> str:
    """The boat that is followed: the given one, or that which the task scores, or the first.

    Raises:
        UnknownNameError: unknown boat.
        VideoError: the recording has no boat.
    """
    boats = recorded.boats
    if not boats:
        raise VideoError(f"'{recorded.path}' has no boat to follow")
    if boat is not None:
        check_name("boat", boat, boats)
    task = recorded.parameters.task
    scored = task.boat if task else ""
    return boat or (scored if scored in boats else next(iter(boats)))


def _positive(name: str, value: float) -> float:
    """A number that pictures can be counted by."""
    if not _MIN_RATE <= value <= _MAX_RATE:
        raise VideoError(f"invalid {name} {value:g}: a number from {_MIN_RATE:g} to {_MAX_RATE:g} is needed")
    return value


def set_in(picture: ByteArray, inset: ByteArray) -> None:
    """Set a small picture into the upper right corner of a large one, as far as it is inside."""
    edge = round(_INSET_EDGE * picture.shape[1])
    place = picture[edge : edge + len(inset), max(picture.shape[1] - edge - inset.shape[1], 0) :][:, : inset.shape[1]]
    place[:] = inset[: len(place), : place.shape[1]]


def lay(picture: ByteArray, tile: ByteArray, column: int, row: int) -> None:
    """Lay a tile (height, width, 4) of colours and opacities over a picture, its upper left corner at a pixel."""
    above, before = max(-row, 0), max(-column, 0)
    place = picture[row + above : max(row + len(tile), 0), column + before : max(column + tile.shape[1], 0)]
    blend(place, tile[above : above + len(place), before : before + place.shape[1]])


def clock_line(world: str, time: float, speed: float) -> str:
    """The world and the time, and how much faster than real it goes."""
    faster = "" if speed == 1.0 else f"  ×{speed:g}"
    return f"{world}  {time:.1f} s{faster}"


def task_lines(task: str, status: TaskStatus, unit: str) -> tuple[str, str]:
    """Phase and time left, score in a unit, and collisions of a task."""
    left = f", {status.remaining:.0f} s left" if status.phase == "running" else ""
    return (
        f"{task}: {status.phase}{left}",
        f"{score_text(status.phase, status.score, unit)}, collisions {status.collisions}",
    )


def project(view: View, place: FloatArray, width: int, height: int) -> tuple[float, float, float] | None:
    """Column and row [pixels] of a place (3,) [m] in a picture of a view, and its distance [m]; None: behind it."""
    ahead, left, up = (float(value) for value in (place - view.position) @ view.rotation)
    if ahead <= view.near:
        return None
    column = width / 2.0 - view.focal_length * left / ahead
    row = height / 2.0 - view.focal_length * up / ahead
    return column, row, ahead


def _write_lines(picture: ByteArray, lines: Sequence[str], *, bottom: bool = False) -> None:
    """Write lines on a dark panel in the upper left corner of a picture, or in the lower one."""
    if lines:
        size = max(_MIN_LETTER, round(len(picture) * _TEXT_SHARE))
        panel, edge = _panel(tuple(lines), size), size // 2
        lay(picture, panel, edge, len(picture) - edge - len(panel) if bottom else edge)


@lru_cache(maxsize=8)
def _panel(lines: tuple[str, ...], size: int) -> ByteArray:
    """Lines (height, width, 4) in letters of a height [pixels]; several pictures show the same."""
    from PIL import Image, ImageDraw

    font, edge, step = _font_of(size), size // 2, round(1.35 * size)
    width = math.ceil(max(font.getlength(line) for line in lines)) + 2 * edge
    panel = Image.new("RGBA", (width, len(lines) * step + edge), (*_PANEL[:3], 0))
    draw = ImageDraw.Draw(panel)
    draw.rounded_rectangle((0, 0, panel.width - 1, panel.height - 1), radius=edge, fill=_PANEL)
    for number, line in enumerate(lines):
        draw.text((edge, edge // 2 + number * step), line, font=font, fill=(*_WHITE, 255))
    return np.asarray(panel)


@lru_cache(maxsize=1024)
def name_tile(text: str, color: Rgb, size: int, phase: int) -> ByteArray:
    """A name (height, width, 4) with a dark rim, over the middle of its last row but one; `phase` moves it right."""
    from PIL import Image, ImageDraw

    font = _font_of(size)
    middle = math.ceil(font.getlength(text) / 2.0) + 2
    tile, foot = Image.new("RGBA", (2 * middle, 2 * size), (*_PANEL[:3], 0)), (middle + phase / PHASES, 2 * size - 2)
    ImageDraw.Draw(tile).text(
        foot, text, font=font, fill=(*color, 255), anchor="mb", stroke_width=1, stroke_fill=(*_PANEL[:3], 255)
    )
    return np.asarray(tile)


@cache
def _font_of(size: int) -> ImageFont.FreeTypeFont:
    """Letters of a height [pixels]."""
    from PIL import ImageFont

    font = distribution("matplotlib").locate_file(f"matplotlib/mpl-data/fonts/ttf/{_FONT}")  # its import takes longer
    return ImageFont.truetype(str(font), size)


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


ByteArrays = Iterator[ByteArray]
_Encoder = Callable[[Path, ByteArrays, int, Fraction], None]
"""Writes a file of pictures (height, width, 3), so many of them, so many per second."""


def encoder_of(path: Path) -> tuple[_Encoder, tuple[int, int], float]:
    """Encoder of a file by its suffix, and its default width and height [pixels] and pictures per second.

    Raises:
        VideoError: unknown suffix, or its encoder is not installed.
    """
    if path.suffix.lower() not in _ENCODERS:
        raise VideoError(f"invalid video '{path}': a name that ends in {', '.join(_ENCODERS)} is needed")
    kind = _ENCODERS[path.suffix.lower()]
    if kind[0] is _write_mp4 and find_spec("av") is None:
        raise VideoError(
            f"'{path}' needs the encoder of MP4, which is not installed; write a .webp, or {install_extra('video')}"
        )
    return kind


def _write_mp4(path: Path, pictures: ByteArrays, count: int, rate: Fraction) -> None:
    """H.264 in an MP4 that plays everywhere and from its first bytes."""
    import av

    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream: Any = container.add_stream("libx264", rate=rate, options=_X264)
        stream.pix_fmt = "yuv420p"
        for number, picture in enumerate(pictures):
            if number == 0:
                stream.height, stream.width = picture.shape[:2]
            planes = np.empty((3 * stream.height // 2, stream.width), np.uint8)
            write_yuv(picture, planes)
            container.mux(stream.encode(av.VideoFrame.from_numpy_buffer(planes, format="yuv420p")))
        container.mux(stream.encode())


def _write_webp(path: Path, pictures: ByteArrays, count: int, rate: Fraction) -> None:
    """An animated WebP that loops."""
    from PIL.Image import fromarray

    frames = map(fromarray, pictures)
    reel: Any = next(frames)

    def seek(number: int) -> None:
        if number:
            reel.im = next(frames).im

    reel.n_frames, reel.seek, reel.tell = count, seek, lambda: 0  # frames are made in turn: pillow takes lists, of GB
    durations = np.diff([round(1000 * number / rate) for number in range(count + 1)]).tolist()
    reel.save(  # every picture whole: differences between lossy pictures leave ghosts on moving water
        path, format="WEBP", save_all=True, duration=durations, loop=0, quality=_WEBP_QUALITY, method=_WEBP_EFFORT,
        kmin=0, kmax=1,
    )  # fmt: skip


def _write_gif(path: Path, pictures: ByteArrays, count: int, rate: Fraction) -> None:
    """A GIF that loops; its clock counts hundredths of a second."""
    from PIL.Image import Dither, fromarray

    frames = (fromarray(picture).quantize(_GIF_COLORS, dither=Dither.NONE) for picture in pictures)
    first = next(frames)
    duration = 10 * max(2, round(100 / rate))
    first.save(path, format="GIF", save_all=True, append_images=frames, duration=duration, loop=0)


_ENCODERS: dict[str, tuple[_Encoder, tuple[int, int], float]] = {
    ".mp4": (_write_mp4, (1280, 720), 25.0),
    ".webp": (_write_webp, (800, 450), 12.5),
    ".gif": (_write_gif, (640, 360), 12.5),
}
"""Encoder, width and height [pixels] and pictures per second, by suffix."""
