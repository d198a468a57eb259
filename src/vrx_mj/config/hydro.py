"""Radiation and diffraction of a hull, in a file that `vrx-mj robot hydro --bem` writes: JSON, numbers in SI units.

Matrices are about `point`, the phase of a wave is that at the origin of the base link, and forces are in axes level
with the water: real and imaginary part of F in Re(F e^(i (k x - omega t))), per metre of a wave's amplitude.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.search import ReadingError, contained, read_limited
from vrx_mj.config.wording import shown
from vrx_mj.errors import VrxError

FORMAT = 1
"""Version of the file."""
MOST_BYTES, MOST_POLES = 20_000_000, 40
"""What a file may hold; a step takes time with each pole."""
FEWEST_ANGLES = 8
LARGEST = 1e12
"""Bound of its numbers."""
DENSITIES, GRAVITIES = (1.0, 1e5), (0.01, 1000.0)
"""Densities [kg/m3] and gravities [m/s2] that it may be for."""
FASTEST = 1e6
"""Bound of the poles [1/s]."""
ODD = 1e-3
"""How far the added mass at infinite frequency may be from symmetric, of its largest."""


@dataclass(frozen=True, eq=False)
class Hydro:
    """Radiation and diffraction of a hull about a point, in axes of the base link."""

    program: str
    """Program that computed it."""
    density: float
    """Density of the water [kg/m3]."""
    gravity: float
    """Gravity [m/s2]."""
    point: FloatArray
    """(3,) point to which it belongs [m]."""
    frequencies: FloatArray
    """(n,) rising angular frequencies [rad/s]."""
    added_mass: FloatArray
    """(n, 6, 6) [kg, kg m, kg m2]."""
    damping: FloatArray
    """(n, 6, 6) [kg/s, kg m/s, kg m2/s]."""
    added_mass_infinite: FloatArray
    """(6, 6) added mass at infinite frequency."""
    poles: FloatArray
    """(k, 2) real and imaginary part of the memory's poles [1/s]."""
    residues: FloatArray
    """(k, 6, 6, 2) their residues, force i per memory of motion j."""
    fit_error: float
    """Misfit of the poles, as a share."""
    diffraction: FloatArray
    """(n, m, 6, 2) force without that of the undisturbed wave's pressure, for waves that travel toward even angles from
    the bow on, counter-clockwise; m is 0 if there is none."""


def read_hydro(path: str, folder: Path | None) -> Hydro:
    """The radiation and diffraction of a file, whose relative path starts in `folder`, or in the current one.

    Raises:
        VrxError: it cannot be read, lacks something, or would let a boat gain energy.
    """
    try:
        data = json.loads(read_limited(contained(path, folder), MOST_BYTES))
    except (ReadingError, ValueError, RecursionError) as error:
        reason = error if isinstance(error, ReadingError) else "not JSON"
        raise VrxError(f"hydro '{path}': {reason}") from None
    try:
        return _checked(data)
    except VrxError as error:
        raise VrxError(f"hydro '{path}': {error}") from None


def _checked(data: Any) -> Hydro:
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise VrxError(f"`format`: {FORMAT} is needed; `vrx-mj robot hydro --bem` writes such files")
    frequencies = _array(data, "frequencies", (None,))
    n, k = len(frequencies), len(_list(data, "poles", MOST_POLES))
    m = _angles(data, n)
    found = Hydro(
        program=str(data.get("program", ""))[:200],
        density=_between(data, "density", *DENSITIES),
        gravity=_between(data, "gravity", *GRAVITIES),
        point=_array(data, "point", (3,)),
        frequencies=frequencies,
        added_mass=_array(data, "added_mass", (n, 6, 6)),
        damping=_array(data, "damping", (n, 6, 6)),
        added_mass_infinite=_array(data, "added_mass_infinite", (6, 6)),
        poles=_array(data, "poles", (k, 2)) if k else np.zeros((0, 2)),
        residues=_array(data, "residues", (k, 6, 6, 2)) if k else np.zeros((0, 6, 6, 2)),
        fit_error=_between(data, "fit_error", 0.0, LARGEST),
        diffraction=_array(data, "diffraction", (n, m, 6, 2)) if m else np.zeros((n, 0, 6, 2)),
    )
    _check(found)
    return found


def _angles(data: dict[str, Any], n: int) -> int:
    """Number of angles of the diffraction."""
    rows = _list(data, "diffraction", n)
    if not rows:
        return 0
    m = len(rows[0]) if isinstance(rows[0], list) else 0
    if len(rows) != n or m < FEWEST_ANGLES:
        needed = f"{n} frequencies of at least {FEWEST_ANGLES} angles"
        raise VrxError(f"`diffraction`: {needed} are needed, got {len(rows)} of {m}")
    return m


def _list(data: dict[str, Any], key: str, most: int) -> list[Any]:
    value = data.get(key, [])
    if not isinstance(value, list) or len(value) > most:
        raise VrxError(f"`{key}`: a list of at most {most} is needed, got {shown(value)}")
    return value


def _between(data: dict[str, Any], key: str, least: float, most: float) -> float:
    value = float(_array(data, key, ()))
    if not least <= value <= most:
        raise VrxError(f"`{key}`: a number from {least:g} to {most:g} is needed, got {value:g}")
    return value


def _array(data: dict[str, Any], key: str, shape: tuple[int | None, ...]) -> FloatArray:
    """Numbers of a shape, in which None is any length from 2 to `most`."""
    if key not in data:
        raise VrxError(f"`{key}` is missing")
    try:
        found = np.array(data[key], np.float64)
    except (ValueError, TypeError, OverflowError):
        raise VrxError(f"`{key}`: {_needed(shape)}, got {shown(data[key])}") from None
    lengths = [size if size is not None else found.shape[0] if found.ndim else 0 for size in shape]
    if found.shape != tuple(lengths) or (None in shape and len(found) < 2):
        raise VrxError(f"`{key}`: {_needed(shape)}, got {found.shape}")
    bad = np.argwhere(~(np.abs(found) <= LARGEST))
    if len(bad):
        place = "".join(f"[{index}]" for index in bad[0])
        raise VrxError(f"`{key}{place}`: a finite number is needed; is a frequency or an angle missing?")
    return found


def _needed(shape: tuple[int | None, ...]) -> str:
    if not shape:
        return "a number is needed"
    return f"numbers of shape ({', '.join('n' if size is None else str(size) for size in shape)}) are needed"


def _check(found: Hydro) -> None:
    """Frequencies rise, the added mass is symmetric, and memories fade."""
    steps = np.diff(found.frequencies, prepend=0.0)
    if not (steps > 0.0).all():
        index = int(np.argmax(steps <= 0.0))
        raise VrxError(f"`frequencies[{index}]`: rising numbers above 0 are needed, got {found.frequencies[index]:g}")
    largest = np.abs(found.added_mass_infinite).max()
    odd = np.abs(found.added_mass_infinite - found.added_mass_infinite.T)
    if odd.max() > ODD * largest:
        i, j = np.unravel_index(odd.argmax(), odd.shape)
        raise VrxError(f"`added_mass_infinite` is not symmetric: [{i}][{j}] and [{j}][{i}] differ by {odd.max():.3g}")
    for index, (real, imaginary) in enumerate(found.poles):
        if real >= 0.0:
            pole = f"{real:g}{imaginary:+g}i"
            raise VrxError(f"`poles[{index}]` is {pole}: its real part has to be below 0, or the memory would grow")
        if max(abs(real), abs(imaginary)) > FASTEST:
            raise VrxError(f"`poles[{index}]` is {max(abs(real), abs(imaginary)):g} in size: at most {FASTEST:g} 1/s")
