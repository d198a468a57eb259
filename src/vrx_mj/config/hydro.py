"""Radiation and diffraction of a hull, in a file that `vrx-mj robot hydro --bem` writes: JSON, numbers in SI units.

Matrices are about `point`, the phase of a wave is that at the origin of the base link, and forces are in axes level
with the water: real and imaginary part of F in Re(F e^(i (k x - omega t))), per metre of a wave's amplitude.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from vrx_mj.config.base import Fault, column_faults, faults
from vrx_mj.config.loading import fault_text
from vrx_mj.config.search import ReadingError, contained_file, read_limited
from vrx_mj.config.values import demand
from vrx_mj.errors import VrxError

FORMAT = 1
"""Version of the file."""
_MOST_BYTES, _MOST_POLES = 20_000_000, 40
"""Bytes and poles of a file, at most; each pole takes time in every step."""
_FEWEST_ANGLES = 8
_LARGEST = 1e12
"""Largest number that a file may hold."""
_FASTEST_POLE = 1e6
"""Largest part of a pole [1/s]."""
_ASYMMETRY = 1e-3
"""Asymmetry that the added mass at infinite frequency may have, as a share of its largest entry."""

_Number = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST)]
_Complex = tuple[_Number, _Number]
"""Real and imaginary part."""
_HydroRow = tuple[_Number, _Number, _Number, _Number, _Number, _Number]
_HydroMatrix = tuple[_HydroRow, _HydroRow, _HydroRow, _HydroRow, _HydroRow, _HydroRow]
_ComplexRow = tuple[_Complex, _Complex, _Complex, _Complex, _Complex, _Complex]
_ComplexMatrix = tuple[_ComplexRow, _ComplexRow, _ComplexRow, _ComplexRow, _ComplexRow, _ComplexRow]


class Hydro(BaseModel):
    """Radiation and diffraction of a hull about a point, in axes of the base link. Other keys of a file are ignored."""

    model_config = ConfigDict(frozen=True, strict=True, allow_inf_nan=False, defer_build=True)

    format: Annotated[
        int, demand(FORMAT.__eq__, f"must be {FORMAT}, got {{}}; `vrx-mj robot hydro --bem` writes such files")
    ]
    """Version of the file."""
    program: str = ""
    """Program that computed it."""
    density: Annotated[float, Field(ge=1.0, le=1e5)]
    """Density of the water [kg/m3]."""
    gravity: Annotated[float, Field(ge=0.01, le=1000.0)]
    """Gravity [m/s2]."""
    point: tuple[_Number, _Number, _Number]
    """Point to which it belongs [m]."""
    frequencies: Annotated[tuple[Annotated[_Number, Field(gt=0.0)], ...], Field(min_length=2)]
    """n rising angular frequencies [rad/s]."""
    added_mass: tuple[_HydroMatrix, ...]
    """(n, 6, 6) [kg, kg m, kg m2]."""
    damping: tuple[_HydroMatrix, ...]
    """(n, 6, 6) [kg/s, kg m/s, kg m2/s]."""
    added_mass_infinite: _HydroMatrix
    """Added mass at infinite frequency."""
    poles: Annotated[tuple[_Complex, ...], Field(max_length=_MOST_POLES)] = ()
    """k poles of the memory [1/s]."""
    residues: tuple[_ComplexMatrix, ...] = ()
    """(k, 6, 6) their residues, force i per memory of motion j."""
    fit_error: Annotated[float, Field(ge=0.0, le=_LARGEST)]
    """Error of the poles over all frequencies, as a share."""
    diffraction: tuple[tuple[_ComplexRow, ...], ...] = ()
    """(n, m, 6) force without that of the undisturbed wave's pressure, for waves that travel toward even angles from
    the bow on, counter-clockwise; none if it is not known."""

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if found := [*self._size_faults(), *self._faults()]:
            raise faults(*found)
        return self

    def _size_faults(self) -> Iterator[Fault]:
        n, angles = len(self.frequencies), {len(row) for row in self.diffraction}
        for key, count in {"added_mass": n, "damping": n, "residues": len(self.poles)}.items():
            if (got := len(getattr(self, key))) != count:
                yield (key,), f"{count} are needed, got {got}"
        if angles and (len(self.diffraction) != n or len(angles) > 1 or min(angles) < _FEWEST_ANGLES):
            sizes = f"{len(self.diffraction)} of {' and '.join(map(str, sorted(angles)))}"
            yield ("diffraction",), f"{n} frequencies of {_FEWEST_ANGLES} angles or more are needed, got {sizes}"

    def _faults(self) -> Iterator[Fault]:
        """Frequencies rise, the added mass is symmetric, and memories fade."""
        yield from column_faults("frequencies", self.frequencies, "a frequency", " rad/s")
        added = np.array(self.added_mass_infinite)
        odd = np.abs(added - added.T)
        if odd.max() > _ASYMMETRY * np.abs(added).max():
            i, j = np.unravel_index(odd.argmax(), odd.shape)
            yield ("added_mass_infinite",), f"must be symmetric: [{i}][{j}] and [{j}][{i}] differ by {odd.max():.3g}"
        for index, (real, imaginary) in enumerate(self.poles):
            pole, size = f"{real:g}{imaginary:+g}i", max(abs(real), abs(imaginary))
            if real >= 0.0:
                yield ("poles", index), f"its real part has to be below 0, or the memory would grow, got {pole}"
            elif size > _FASTEST_POLE:
                yield ("poles", index), f"its parts must be at most {_FASTEST_POLE:g} 1/s in size, got {pole}"


def read_hydro(path: str, folder: Path | None) -> Hydro:
    """The radiation and diffraction of a file, whose relative path starts in `folder`, or in the current one.

    Raises:
        VrxError: it cannot be read, lacks something, or would let a boat gain energy.
    """
    try:
        return Hydro.model_validate_json(read_limited(contained_file(path, folder), _MOST_BYTES))
    except (ReadingError, ValidationError) as error:
        reason = fault_text(error) if isinstance(error, ValidationError) else error
        raise VrxError(f"hydro '{path}': {reason}") from None
