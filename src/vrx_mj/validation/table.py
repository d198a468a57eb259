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

CASES: tuple[Case, ...] = (
    *waves.CASES, *seas.CASES, *hydrostatics.CASES, *hulls.CASES, *pressures.CASES, *resolution.CASES,
    *otter.CASES, *wamv.CASES, *heron.CASES, *propellers.CASES, *spheres.CASES, *diffraction.CASES, *currents.CASES,
    *winds.CASES, *moorings.CASES, *drifting.CASES, *runs.CASES, *vrx.CASES,
)  # fmt: skip
"""All of them."""


def chosen(only: tuple[str, ...] = (), *, quick: bool = False) -> tuple[Case, ...]:
    """The cases of these names, or all; those of `--quick` if asked for.

    Raises:
        UnknownNameError: no case has a name.
    """
    known = [case.name for case in CASES]
    for name in only:
        if name not in known:
            raise UnknownNameError("case", name, known)
    return tuple(case for case in CASES if (case.name in only if only else case.quick or not quick))
