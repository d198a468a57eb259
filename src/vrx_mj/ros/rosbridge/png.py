"""JSON in the pixels of a PNG, which is how rosbridge compresses it."""

import base64
import io
import math
import warnings

from PIL import Image

from vrx_mj.errors import CommandError

__all__ = ["from_png", "png"]

EFFORT = 1
"""zlib's level: a loop that serves everybody has no time for more."""


def png(text: bytes) -> str:
    """The text as RGB pixels filled up with newlines, in base64."""
    width = max(1, math.isqrt(len(text) // 3))
    height = max(1, math.ceil(len(text) / (3 * width)))
    image = Image.frombytes("RGB", (width, height), text.ljust(3 * width * height, b"\n"))
    file = io.BytesIO()
    image.save(file, "png", compress_level=EFFORT)
    return base64.b64encode(file.getvalue()).decode("ascii")


def from_png(data: str, largest: int) -> str:
    """The text in a PNG of at most so many bytes of pixels.

    Raises:
        CommandError: it is no such thing.
    """
    try:
        raw = base64.b64decode(data, validate=True)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with Image.open(io.BytesIO(raw), formats=("png",)) as image:
                if 3 * image.width * image.height > largest:
                    raise CommandError(f"a png of {image.width} x {image.height}: at most {largest // 3} pixels")
                return image.convert("RGB").tobytes().decode("utf-8").strip("\n")
    except CommandError:
        raise
    except Exception as error:  # Pillow raises what each of its parts does
        raise CommandError("data is not a base64 PNG that holds text") from error
