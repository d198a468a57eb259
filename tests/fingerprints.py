"""Fingerprints of all the numbers that a computation gives, kept in `tests/golden/fingerprints/*.json`.

They say that something has changed, and in which part; tests near the code say what is right. After a change that is
meant, write them again, and say in the commit why they differ:

    VRX_MJ_WRITE_FINGERPRINTS=1 pytest -n0 -m '' tests/integration/test_{fingerprints_*,examples}.py
"""

import json
import os
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

GOLDEN = Path(__file__).parent / "golden" / "fingerprints"
MADE_BY = {" made by": "tests/fingerprints.py"}
WRITING = "VRX_MJ_WRITE_FINGERPRINTS"
ROUNDING = 1e-9
"""Share of a fingerprint that another machine's rounding may change; a run of a second differs by far less."""
FONTS = 1e-6
"""As `ROUNDING`, of places of texts, which versions of FreeType round."""
SMALL = 1e-3
"""Numbers below this count by their size, larger ones by their logarithm: none hides the others."""
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def check(file: str, key: str, *, rounding: float = ROUNDING, **parts: object) -> None:
    """Compare each part of what was computed with the fingerprint that the file has of it."""
    found = {name: fingerprint(part) for name, part in parts.items()}
    path = GOLDEN / f"{file}.json"
    if os.environ.get(WRITING):
        kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else MADE_BY
        before = kept.get(key, {})
        found |= {name: before[name] for name in found if _equal(before.get(name), found[name], rounding)}
        rows = (f"{json.dumps(name)}: {json.dumps(row)}" for name, row in sorted((kept | {key: found}).items()))
        path.parent.mkdir(exist_ok=True)
        path.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8")
        return
    expected = _kept(path).get(key)
    assert expected is not None, f"{path.name} has no fingerprint of {key}: write it with {WRITING}=1 pytest -n0 -m ''"
    changed = [name for name in {**expected, **found} if not _equal(expected.get(name), found.get(name), rounding)]
    assert not changed, f"{key}: other numbers than {path.name} has, of {', '.join(changed)}"


def fingerprint(value: object) -> list[float]:
    """How many numbers there are, the sum of their sizes, and a sum that weighs each by its place."""
    parts = [np.ravel(part).astype(float) for part in _numbers(value)]
    numbers = np.concatenate(parts) if parts else np.zeros(0)
    sizes = np.arcsinh(np.nan_to_num(numbers, nan=-7.0, posinf=1e300, neginf=-1e300) / SMALL)
    weights = np.cos(np.arange(1.0, len(sizes) + 1.0))
    return [len(sizes), *(float(f"{total:.12g}") for total in (np.abs(sizes).sum(), sizes @ weights))]


def numbers_in(text: str) -> list[float]:
    """The numbers in a text; its words may be put better."""
    return [float(found) for found in NUMBER.findall(text)]


LOOKS = ("alpha", "color", "edgecolor", "facecolor", "fontsize", "linestyle", "linewidth", "marker", "markeredgecolor",
         "markeredgewidth", "markersize", "radius", "text", "visible", "xydata", "xy", "zorder")  # fmt: skip
"""Properties of what is drawn that do not depend on the fonts of a machine."""


def drawn(figure: Any) -> Iterator[list[object]]:
    """Kinds and looks of all that a figure of matplotlib has, in its order."""
    for one in figure.findobj():
        yield [type(one).__name__, *(getattr(one, f"get_{name}")() for name in LOOKS if hasattr(one, f"get_{name}"))]


def placed(figure: Any) -> list[object]:
    """Where in its picture all is that a figure has, and how: nodes of its paths, and places of its texts."""
    figure.draw_without_rendering()
    rows = list[object](drawn(figure))
    for one in figure.findobj():
        if hasattr(one, "get_path"):
            rows.append(one.get_transform().transform(one.get_path().vertices))
        elif hasattr(one, "get_paths"):
            rows.append([one.get_transform().transform(path.vertices) for path in one.get_paths()])
        elif hasattr(one, "get_fontweight"):
            place = one.get_transform().transform(one.get_position())
            rows.append([place, one.get_fontweight(), one.get_ha(), one.get_va(), one.get_fontsize()])
    return rows


@cache
def _kept(path: Path) -> dict[str, dict[str, list[float]]]:
    return json.loads(path.read_text(encoding="utf-8"))


def _equal(one: Sequence[float] | None, other: Sequence[float] | None, rounding: float) -> bool:
    """Whether two fingerprints differ by rounding at most."""
    if one is None or other is None or one[0] != other[0]:
        return False
    return bool(np.allclose(one[1:], other[1:], rtol=0.0, atol=rounding * (1.0 + one[1])))


def _numbers(value: object) -> Iterator[np.ndarray]:
    """All numbers of a value, in their order; of a name its checksum, of a text with blanks the numbers in it."""
    if value is None:
        yield np.array([np.nan])
    elif isinstance(value, str) and " " in value:
        yield np.array(numbers_in(value))
    elif isinstance(value, str | bytes):
        yield np.array([zlib.crc32(value.encode() if isinstance(value, str) else value)])
    elif isinstance(value, bool | int | float | np.generic):
        yield np.array([value])
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        yield value
    elif isinstance(value, list | tuple) and all(type(item) in {float, int, bool} for item in value):
        yield np.array(value, float)
    else:
        for part in _parts(value):
            yield from _numbers(part)


def _parts(value: Any) -> Iterable[object]:
    """What a value consists of."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        return [value[name] for name in value.dtype.names]
    if isinstance(value, Mapping):
        return chain.from_iterable(value.items())
    if is_dataclass(value):
        return [getattr(value, own.name) for own in fields(value)]
    return iter(value)
