"""The cases of the report, in its order."""

from vrx_mj.errors import UnknownNameError
from vrx_mj.validation.cases import (
    currents,
    diffraction,
    drifting,
    heron,
    hulls,
    hydrostatics,
    moorings,
    otter,
    pressures,
    propellers,
    resolution,
    runs,
    seas,
    spheres,
    vrx,
    wamv,
    waves,
    winds,
)
from vrx_mj.validation.rows import Case

_SUBJECTS = (
    waves, seas, hydrostatics, hulls, pressures, resolution, otter, wamv, heron, propellers, spheres, diffraction,
    currents, winds, moorings, drifting, runs, vrx,
)  # fmt: skip
CASES = tuple(each for subject in _SUBJECTS for each in vars(subject).values() if isinstance(each, Case))
"""All of them."""


def select_cases(only: tuple[str, ...] = (), *, quick: bool = False) -> tuple[Case, ...]:
    """The cases of these names, or all; those of `--quick` if asked for.

    Raises:
        UnknownNameError: no case has a name.
    """
    known = [case.name for case in CASES]
    for name in only:
        if name not in known:
            raise UnknownNameError("case", name, known)
    return tuple(case for case in CASES if (case.name in only if only else case.quick or not quick))
