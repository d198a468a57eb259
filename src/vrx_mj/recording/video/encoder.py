"""Pictures to a file: MP4 by PyAV, WebP and GIF by pillow."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vrx_mj.arrays import ByteArray
from vrx_mj.errors import VideoError
from vrx_mj.packages import install_command

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["ENCODERS", "encoder_of"]

Pictures = Iterator[ByteArray]
Encoder = Callable[[Path, Pictures, int, Fraction], None]
"""Writes a file of pictures (height, width, 3), so many of them, so many per second."""

CRF = "21"
"""Quality of MP4: less is better; below 18 no difference is visible."""
WEBP_QUALITY, WEBP_EFFORT = 72, 4
COLORS = 128
"""Of a GIF."""


def encoder_of(path: Path) -> Encoder:
    """What writes a file, by its suffix.

    Raises:
        VideoError: there is no such kind of video, or what writes it is not installed.
    """
    if path.suffix.lower() not in ENCODERS:
        raise VideoError(f"invalid video '{path}': a name that ends in {', '.join(ENCODERS)} is needed")
    encoder = ENCODERS[path.suffix.lower()]
    if encoder is write_mp4:
        try:
            import av  # noqa: F401
        except ImportError:
            raise VideoError(
                f"'{path}' needs the encoder of MP4, which is not installed; write a .webp, or run: "
                f"{install_command('vrx-mj[video]')}"
            ) from None
    return encoder


def write_mp4(path: Path, pictures: Pictures, count: int, rate: Fraction) -> None:
    """H.264 in an MP4 that plays everywhere and from its first bytes."""
    import av

    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream: Any = container.add_stream("libx264", rate=rate, options={"crf": CRF, "preset": "veryfast"})
        stream.pix_fmt = "yuv420p"
        for number, picture in enumerate(pictures):
            if number == 0:
                stream.height, stream.width = picture.shape[:2]
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")))
        container.mux(stream.encode())


def write_webp(path: Path, pictures: Pictures, count: int, rate: Fraction) -> None:
    """An animated WebP that loops."""
    reel = reel_of(pictures, count)
    stops = [round(1000 * number / rate) for number in range(count + 1)]
    durations = [end - begin for begin, end in pairwise(stops)]
    reel.save(  # every picture whole: differences between lossy pictures leave ghosts on moving water
        path, format="WEBP", save_all=True, duration=durations, loop=0, quality=WEBP_QUALITY, method=WEBP_EFFORT,
        kmin=0, kmax=1,
    )  # fmt: skip


def write_gif(path: Path, pictures: Pictures, count: int, rate: Fraction) -> None:
    """A GIF that loops; its clock counts hundredths of a second."""
    from PIL.Image import Dither, fromarray

    def reduced() -> Iterator[Image]:
        for picture in pictures:
            yield fromarray(picture).quantize(COLORS, dither=Dither.NONE)

    frames = reduced()
    first = next(frames)
    duration = 10 * max(2, round(100 / rate))
    first.save(path, format="GIF", save_all=True, append_images=frames, duration=duration, loop=0)


def reel_of(pictures: Iterable[ByteArray], count: int) -> Image:
    """An image of `count` frames which are made when they are asked for, in turn: pillow takes lists, of GB."""
    from PIL.Image import Image, fromarray

    class Reel(Image):
        n_frames = count

        def __init__(self) -> None:
            super().__init__()
            self._frames, self._number = iter(pictures), -1
            self.seek(0)

        def tell(self) -> int:
            return self._number

        def seek(self, frame: int) -> None:
            if frame == self._number + 1:
                shown = fromarray(next(self._frames))
                self._number, self.im = frame, shown.im
                self._mode, self._size = shown.mode, shown.size

    return Reel()


ENCODERS: dict[str, Encoder] = {".mp4": write_mp4, ".webp": write_webp, ".gif": write_gif}
"""By suffix."""
