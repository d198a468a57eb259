"""The hull of a boat as a naval architect gives it, for worlds of profile `marine`."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, field_validator

from vrx_mj.config.base import Config, Fault, Folder, Only, fault
from vrx_mj.config.dynamics import Six
from vrx_mj.config.hydro import read_hydro
from vrx_mj.config.loading import loads
from vrx_mj.config.shapes import Shape
from vrx_mj.config.values import Coordinate, NonNegative, NotEmpty, Number, Positive, Switch, Vec3, numbers
from vrx_mj.config.wording import shown

MOST_STRIPS = 200
"""Strips that a hull may have."""
MOST_SKEGS = 10
"""Skegs that a hull may have."""

Row = Annotated[tuple[Number, Number, Number, Number, Number, Number], numbers("surge sway heave roll pitch yaw")]
OfMatrix = Only("hydrostatics", ("matrix",))


def _six_rows(value: object) -> object:
    """Six numbers as the matrix that has them on its diagonal; six rows as they are."""
    if not isinstance(value, (list, tuple)) or len(value) != 6:
        got = f"{len(value)}" if isinstance(value, (list, tuple)) else shown(value)
        raise fault(f"expected six rows of six numbers, or the six of the diagonal, got {got}")
    if any(isinstance(row, (list, tuple)) for row in value):
        return value
    return tuple(tuple(own if row == column else 0.0 for column in range(6)) for row, own in enumerate(value))


Matrix = tuple[Row, Row, Row, Row, Row, Row]
SixBySix = Annotated[Matrix, BeforeValidator(_six_rows)]
"""Six rows of six numbers, or the six of the diagonal: surge, sway, heave, roll, pitch, yaw."""


def _along(value: object) -> object:
    """One number as the list that is the same from stern to bow."""
    if isinstance(value, (list, tuple)):
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise fault(f"expected a number, or a list of those from stern to bow, got {shown(value)}")
    return (value,)


Along = Annotated[tuple[NonNegative, ...], Field(max_length=100), NotEmpty, BeforeValidator(_along)]
"""A number, or those at even distances from stern to bow, with straight lines between them."""


class CrossFlowConfig(Config):
    """Drag of the flow across a hull, by strips along it: that of a cylinder for each strip's own velocity."""

    stern: Coordinate
    """x of its end astern [m]."""
    bow: Coordinate
    """x of its end ahead [m]."""
    draft: Along
    """Draft [m]: one number, or those at even distances from stern to bow."""
    coefficient: Along
    """Drag coefficient over the lateral area, of all hulls of a boat together: one number, or those from stern to
    bow."""
    strips: Annotated[int, Field(ge=1, le=MOST_STRIPS)] = 20
    """Number of strips of equal length."""
    height: Coordinate | None = None
    """z at which the drag acts [m]; by default half the mean draft below the water at rest."""

    def _faults(self) -> Iterator[Fault]:
        if self.bow <= self.stern:
            yield ("bow",), f"expected a bow ahead of the stern, at {self.stern:g}, got {self.bow:g}"


class SkegConfig(Config):
    """A fixed fin under a hull, or the lift of the hull's own stern: a wing of the MMG standard method."""

    x: Coordinate
    """x of its centre of pressure [m]."""
    z: Coordinate = 0.0
    """z of its centre of pressure [m]."""
    area: Positive
    """Area seen from the side [m2]; that of several side by side together."""
    aspect_ratio: Positive
    """Height over mean length."""


class MarineHullConfig(Config):
    """A hull in worlds of profile `marine`, instead of `hydrodynamics`, from which comes what is not given here.

    Axes are those of the base link: x forward, y left, z up.
    """

    folder_keys: ClassVar = {"folder": "hydro"}

    folder: Folder = None
    hydrostatics: Literal["mesh", "matrix"] = "mesh"
    """Pressure of still water and waves on closed surfaces; or the stiffness of a published model of coefficients."""
    shapes: Annotated[tuple[Shape, ...], Field(max_length=100), Only("hydrostatics", ("mesh",))] = ()
    """Closed surfaces of the hull that do not overlap, of 100 to 700 triangles; by default the robot's own shapes."""
    point: Vec3 | None = None
    """Point to which the matrices belong [m]; by default the boat's centre of mass."""
    added_mass: SixBySix | None = None
    """Added mass [kg, kg m, kg m2], six rows of six, or the diagonal."""
    munk: Switch = True
    """Whether added mass turns a boat across the stream: Munk's moment."""
    damping_linear: SixBySix | None = None
    """Linear damping [N s/m, N s, N m s], six rows of six, or the diagonal."""
    damping_quadratic: Six | None = None
    """Quadratic damping [N s2/m2, N m s2]."""
    crossflow: CrossFlowConfig | None = None
    """Drag of the flow across the hull by strips; with it, quadratic damping of sway and yaw is 0 unless given."""
    skegs: Annotated[tuple[SkegConfig, ...], Field(max_length=MOST_SKEGS)] = ()
    """Fins that keep the boat on its course, against Munk's moment."""
    restoring: Annotated[SixBySix | None, Only("hydrostatics", ("matrix",), required=True)] = None
    """Stiffness at rest, of `hydrostatics: matrix` [N/m, N, N m], six rows of six, or the diagonal."""
    displacement: Annotated[Positive | None, OfMatrix] = None
    """Mass at which the water is at `waterline`, of `hydrostatics: matrix` [kg]; by default the boat's."""
    waterline: Annotated[Number, OfMatrix] = 0.0
    """Height of the water at rest, of `hydrostatics: matrix` [m]."""
    hydro: Annotated[str, loads(read_hydro)] | None = None
    """File of radiation and diffraction that `vrx-mj robot hydro --bem` writes, beside this one: added mass, memory of
    the waves that the hull makes, forces of those that it scatters."""
    diffraction: Annotated[Switch, Only("hydro")] = True
    """Whether waves act with the diffraction of `hydro`; or, without, with the added mass and memory of the water's
    motion at the centre of buoyancy, which is right for waves that are long against the hull."""

    @field_validator("added_mass", "damping_linear")
    @classmethod
    def _has_no_negative_diagonal(cls, value: Matrix | None) -> Matrix | None:
        for index, row in enumerate(value or ()):
            if row[index] < 0.0:
                place = f"{index + 1}{index + 1}"
                raise fault(
                    f"entry {place} of the diagonal is {row[index]:.4g}, and 0 or more is needed; with the signs of "
                    "X_u and X_du (SNAME, Fossen) turn all"
                )
        return value

    @field_validator("restoring")
    @classmethod
    def _floats(cls, value: Matrix | None) -> Matrix | None:
        if value and not value[2][2] > 0.0:
            raise fault(f"entry 33 is {value[2][2]:.4g} N/m: above 0 is needed for a boat that floats")
        return value

    def _faults(self) -> Iterator[Fault]:
        if self.hydro and self.added_mass:
            yield ("added_mass",), "not used with hydro, which has that; remove it"
