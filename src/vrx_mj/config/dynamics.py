"""Hydrodynamics and engines of a boat: VRX's parameters, or a hull and propellers as a naval architect describes them.

A hull's radiation and diffraction come from a JSON file that `vrx-mj robot hydro --bem` writes, in SI units. Its
matrices are about `point`, the phase of a wave is that at the origin of the base link, and forces are in axes level
with the water: real and imaginary part of F in Re(F e^(i (k x - omega t))), per metre of the wave's amplitude.
"""

import itertools
import json
from functools import lru_cache
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from vrx_mj.config.base import Config, Fault, Faults, InFolder, Only, column_faults, exclusive, faults
from vrx_mj.config.loading import fault_text, loads
from vrx_mj.config.search import ReadingError, contained_file, read_limited
from vrx_mj.config.shapes import Shape
from vrx_mj.config.tree import fault, literal
from vrx_mj.config.values import (
    Coordinate,
    NonNegative,
    NotEmpty,
    Number,
    NumberOf,
    Positive,
    Switch,
    Vec3,
    demand,
    numbers,
)
from vrx_mj.errors import VrxError
from vrx_mj.model import kinds
from vrx_mj.model.boats import MOST_SKEGS, MOST_STRIPS, Command, Hull, Propeller, Thruster, Vessel

FORMAT = 1
"""Version of the file."""
_MOST_BYTES, _MOST_POLES = 20_000_000, 40
"""Bytes and poles of a file, at most; each pole takes time in every step."""
_FEWEST_ANGLES = 8
_FASTEST_POLE = 1e6
"""Largest part of a pole [1/s]."""
_ASYMMETRY = 1e-3
"""Asymmetry that the added mass at infinite frequency may have, as a share of its largest entry."""

_Complex = tuple[kinds.Real, kinds.Real]
"""Real and imaginary part."""
_ComplexRow = tuple[_Complex, _Complex, _Complex, _Complex, _Complex, _Complex]
_ComplexMatrix = tuple[_ComplexRow, _ComplexRow, _ComplexRow, _ComplexRow, _ComplexRow, _ComplexRow]

_DriftRow = tuple[_Complex, _Complex, _Complex, _Complex, _Complex, _Complex, _Complex]
_SERIES = "wageningen_b4_70"
_SERIES_STEP = 2
"""Step between the rows of a series [degrees]: a sixth of its fastest harmonic's period."""
_MAX_STEP = 30.0
"""Largest step between the rows of a four-quadrant table [degrees]."""


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
    point: kinds.Vec3
    """Point to which it belongs [m]."""
    frequencies: Annotated[tuple[kinds.Positive, ...], Field(min_length=2)]
    """n rising angular frequencies [rad/s]."""
    added_mass: tuple[kinds.SixBySix, ...]
    """(n, 6, 6) added mass at each frequency [kg, kg m, kg m2]."""
    damping: tuple[kinds.SixBySix, ...]
    """(n, 6, 6) damping at each frequency [kg/s, kg m/s, kg m2/s]."""
    added_mass_infinite: kinds.SixBySix
    """Added mass at infinite frequency."""
    poles: Annotated[tuple[_Complex, ...], Field(max_length=_MOST_POLES)] = ()
    """k poles of the memory [1/s]."""
    residues: tuple[_ComplexMatrix, ...] = ()
    """(k, 6, 6) residues at the poles: force i per memory of motion j."""
    fit_error: kinds.NonNegative
    """Error of the poles over all frequencies, as a share."""
    displacement: kinds.Positive | None = None
    """Mass that the hull displaces [kg]; none if it is not known."""
    waterline: kinds.Real | None = None
    """Height of the water [m]; none if it is not known."""
    wave_frequencies: tuple[kinds.Positive, ...] = ()
    """n rising angular frequencies of diffraction and drift [rad/s]; by default those above."""
    diffraction: tuple[tuple[_ComplexRow, ...], ...] = ()
    """(n, m, 6) force without that of the undisturbed wave's pressure, for waves that travel toward even angles from
    the bow on, counter-clockwise; none if it is not known."""
    drift_scattered: tuple[tuple[tuple[_DriftRow, _DriftRow, _DriftRow], ...], ...] = ()
    """(n, m, 3, 7) a of the mean surge and sway force and yaw moment by a wave of one metre, Re(sum a_j u_j + sum
    conj(u_i) b_ij u_j), with u_0 = 1 and u_1 to u_6 the motions of `point`; none if it is not known."""
    drift_radiated: tuple[tuple[_ComplexMatrix, _ComplexMatrix, _ComplexMatrix], ...] = ()
    """(n, 3, 6, 6) b of these."""

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if found := [*self._size_faults(), *self._faults()]:
            raise faults(*found)
        return self

    def _size_faults(self) -> Faults:
        n, angles = len(self.frequencies), {len(row) for row in self.diffraction}
        for key, count in {"added_mass": n, "damping": n, "residues": len(self.poles)}.items():
            if (got := len(getattr(self, key))) != count:
                yield (key,), f"{count} are needed, got {got}"
        n = len(self.waves)
        if angles and (len(self.diffraction) != n or len(angles) > 1 or min(angles) < _FEWEST_ANGLES):
            sizes = f"{len(self.diffraction)} of {' and '.join(map(str, sorted(angles)))}"
            yield ("diffraction",), f"{n} frequencies of {_FEWEST_ANGLES} angles or more are needed, got {sizes}"
        elif self.drift_scattered or self.drift_radiated:
            if (own := [len(row) for row in self.drift_scattered]) != [len(row) for row in self.diffraction]:
                sizes = f"{len(own)} of {max(own, default=0)}"
                yield ("drift_scattered",), f"{n} of {max(angles, default=0)} angles are needed, got {sizes}"
            if (got := len(self.drift_radiated)) != n:
                yield ("drift_radiated",), f"{n} are needed, got {got}"

    @property
    def waves(self) -> tuple[float, ...]:
        """Rising angular frequencies of diffraction and drift [rad/s]."""
        return self.wave_frequencies or self.frequencies

    def _faults(self) -> Faults:
        """Frequencies rise, the added mass is symmetric, and memories fade."""
        for key in ("frequencies", "wave_frequencies"):
            yield from column_faults(key, getattr(self, key), "a frequency", " rad/s")
        added = np.array(self.added_mass_infinite)
        odd = np.abs(added - added.T)
        if odd.max() > _ASYMMETRY * np.abs(added).max():
            i, j = np.unravel_index(odd.argmax(), odd.shape)
            yield ("added_mass_infinite",), f"must be symmetric: [{i}][{j}] and [{j}][{i}] differ by {odd.max():.3g}"
        for index, (real, imaginary) in enumerate(self.poles):
            pole, size = f"{real:g}{imaginary:+g}i", max(abs(real), abs(imaginary))
            if real >= 0.0:
                yield ("poles", index), f"its real part must be below 0, or the memory grows; got {pole}"
            elif size > _FASTEST_POLE:
                yield ("poles", index), f"each part must be at most {_FASTEST_POLE:g} 1/s in magnitude, got {pole}"


def read_hydro(path: str, folder: Path | None) -> Hydro:
    """The radiation and diffraction of a file, whose relative path starts in `folder`, or in the current one.

    Raises:
        VrxError: it cannot be read, lacks something, or would let a boat gain energy.
    """
    try:
        return _hydro(read_limited(contained_file(path, folder), _MOST_BYTES))
    except (ReadingError, ValidationError) as error:
        reason = fault_text(error) if isinstance(error, ValidationError) else error
        raise VrxError(f"hydro '{path}': {reason}") from None


@lru_cache(maxsize=8)
def _hydro(content: bytes) -> Hydro:
    """The radiation and diffraction of a file's content, which a boat's build reads again and again."""
    return Hydro.model_validate_json(content)


Six = Annotated[tuple[NonNegative, NonNegative, NonNegative, NonNegative, NonNegative, NonNegative],
                numbers("surge sway heave roll pitch yaw")]  # fmt: skip


class ServoConfig(Config):
    """The servo of an engine, a rudder or a boom."""

    kp: Annotated[float, NumberOf(Thruster, "kp")]
    kd: Annotated[float, NumberOf(Thruster, "kd")]
    effort: Annotated[Positive, NumberOf(Thruster, "effort")]
    velocity: Annotated[Positive, NumberOf(Thruster, "velocity")]


class ThrusterConfig(Config):
    """VRX's usv_gazebo_thrust_plugin: from commands to forces."""

    mapping: Literal["linear", "glf", "newtons"]
    """Meaning of a command: a share of the largest force, that on VRX's generalised logistic curve, or newtons."""
    max_command: Annotated[Positive, NumberOf(Thruster, "max_command")] = 1.0
    """Unit of commands: `glf` divides a command by it, `linear` divides by it twice, as VRX does."""
    max_force_forward: Annotated[float, NumberOf(Thruster, "max_forward")] = 250.0
    max_force_reverse: Annotated[float, NumberOf(Thruster, "max_reverse")] = -100.0
    timeout: Annotated[float, NumberOf(Thruster, "timeout")] = 1.0
    """Time after which a command counts as zero [s]; 0 means never, as in worlds of profile vrx3."""
    max_angle: Annotated[float, NumberOf(Thruster, "max_angle")] = 1.5707963267948966


class ContactConfig(Config):
    """How a hull yields in a contact, like a mass on a spring and a damper."""

    duration: Annotated[float, Field(ge=0.05, le=2)] = 0.3
    """Duration of the contact when a hull hits a wall and rebounds [s]; 0.2 to 0.5 for inflatables."""
    damping_ratio: Annotated[float, Field(ge=0.05, le=0.95)] = 0.5
    """Fraction of critical damping; with 0.5 the hull rebounds with 0.3 of its speed."""


class HullConfig(Config):
    """One float of a boat, lifted at points as in VRX 3's Surface plugin. Each point represents an equal piece."""

    length: Positive
    """Length of the float [m]."""
    radius: Positive
    """Radius of the float [m]."""
    points: Annotated[tuple[Vec3, ...], NotEmpty]
    """Points on the float's keel line, in the base link's axes [m]."""


class HydrodynamicsConfig(Config):
    """VRX's usv_gazebo_dynamics_plugin, or VRX 3's SimpleHydrodynamics and Surface.

    Sixes are in the order surge, sway, heave, roll, pitch, yaw.
    """

    water_level: Annotated[float, NumberOf(Hull, "level")] = 0.0
    """Height of the water for this boat above the sea's mean level [m]. The boat floats higher by this amount."""
    water_density: Annotated[Positive, NumberOf(Hull, "density")] = 997.8
    hull_radius: Positive
    """Radius of each of the two half-cylinders that carry the boat [m]."""
    boat_width: Positive
    """Distance between the axes of the two hulls [m]."""
    boat_length: Positive
    """Length of the hulls [m]."""
    length_n: Annotated[int, Field(ge=1, le=1000)] = 2
    """Stations along each hull."""
    hulls: tuple[HullConfig, ...] = ()
    """Floats that carry the boat, instead of two hulls with evenly spaced stations."""
    added_mass: Annotated[Six, NumberOf(Hull, "added_mass")]
    drag_linear: Annotated[Six, NumberOf(Hull, "drag_linear")]
    drag_quadratic: Annotated[Six, NumberOf(Hull, "drag_quadratic")]


_Point = Annotated[tuple[Command, Number], numbers("command thrust")]


def _of_series(value: object) -> object:
    """The rows of a series by its name; anything else as it is."""
    if value != _SERIES:
        return value
    series = json.loads((Path(__file__).parent / "propellers.json").read_bytes())[_SERIES]["harmonics"]
    angles = np.arange(-180, 181, _SERIES_STEP)
    turns = np.outer(np.radians(angles % 360), np.arange(len(series)))
    a, b, c, d = np.array(series).T
    thrust, torque = (np.cos(turns) @ real + np.sin(turns) @ imaginary for real, imaginary in ((a, b), (c, d)))
    thrust[-1], torque[-1] = thrust[0], torque[0]  # BLAS may round equal rows differently
    return tuple(zip(angles.tolist(), thrust.tolist(), torque.tolist(), strict=True))


_Quadrant = Annotated[tuple[Number, Number, Number], numbers("angle thrust torque")]


class PropellerConfig(Config):
    """A propeller with measured thrust, which replaces the thruster's curve in worlds of profile `marine`."""

    thrust: Annotated[tuple[_Point, ...], NumberOf(Propeller, "thrust"), Field(max_length=1000)]
    """Commands -1..1 and their thrust at rest [N], in rising order, including `[0, 0]`. A command is a fraction of the
    thruster's `max_command`. The table is interpolated linearly; a command beyond the first or last row gives that
    row's thrust."""
    diameter: Annotated[float, NumberOf(Propeller, "diameter"), Field(le=20)]
    """Diameter [m]. The part of the disc in the air gives no thrust and draws no power."""
    vanishing_speed: Annotated[float, Field(ge=0.1), NumberOf(Propeller, "vanishing_speed")] | None = None
    """Speed through the water, along the axis, at which full thrust becomes zero [m/s]; by default it never does."""
    four_quadrant: Annotated[tuple[_Quadrant, ...], Field(max_length=721), BeforeValidator(_of_series)] = ()
    """Coefficients C_T* and C_Q* of thrust and torque over the angle of advance from -180 to 180 [degrees], instead of
    `vanishing_speed`; or `wageningen_b4_70`, for that propeller with a pitch ratio of 1. The tangent of the angle is
    the speed ahead over 0.7 pi n D. The table is interpolated linearly."""
    time_constant: Annotated[float, NumberOf(Propeller, "time_constant")] = 0.0
    """Time constant of thrust at rest after a new command (to 63 %) [s]; by default it follows at once."""
    dead_zone: Annotated[float, NumberOf(Propeller, "dead_zone")] = 0.0
    """Commands of at most this size, ahead or astern, give no thrust."""
    power: Annotated[float, NumberOf(Propeller, "power")] = 0.0
    """Electric power at full thrust at rest [W]; unknown by default. A fraction s of full thrust takes s^1.5 of it."""

    def _faults(self) -> list[Fault]:
        found: list[Fault] = []
        for index, (command, thrust) in enumerate(self.thrust):
            if command * thrust < 0.0 or (command == 0.0 and thrust != 0.0):
                side = "of 0 or more" if command > 0.0 else "of 0 or less" if command else "of 0"
                text = f"a thrust {side} is needed at command {command:g}, got {thrust:g} N"
                found.append((("thrust", index), text))
        found += column_faults("thrust", [command for command, _ in self.thrust], "a command")
        if len(self.thrust) < 2:
            found.append((("thrust",), f"2 rows or more are needed, got {len(self.thrust)}"))
        if not found and 0.0 not in [command for command, _ in self.thrust]:
            found.append((("thrust",), "a row [0, 0] is needed: add it, and rows astern if it can push astern"))
        if not found and not any(thrust for _, thrust in self.thrust):
            found.append((("thrust",), "a thrust other than 0 is needed: all are 0 N"))
        return [*found, *exclusive(self, "vanishing_speed", "four_quadrant"), *self._quadrant_faults()]

    def _quadrant_faults(self) -> Faults:
        """Rows go all around without gaps, and at rest a propeller pushes as it turns and takes torque."""
        angles = [angle for angle, _, _ in self.four_quadrant]
        if found := list(column_faults("four_quadrant", angles, "an angle", ends=(-180.0, 180.0))):
            yield from found
            return
        for index, (before, angle) in enumerate(itertools.pairwise(angles), 1):
            if angle - before > _MAX_STEP:
                text = f"rows at most {_MAX_STEP:g} degrees apart are needed, got {before:g} and {angle:g}"
                yield ("four_quadrant", index), text
        for column, name in enumerate(("C_T*", "C_Q*"), 1) if angles else ():
            values = [row[column] for row in self.four_quadrant]
            ahead, astern, end = float(np.interp(0.0, angles, values)), values[0], values[-1]
            if astern != end:
                yield ("four_quadrant",), f"the same {name} at -180 and 180 is needed, got {astern:g} and {end:g}"
            if not astern < 0.0 < ahead:
                text = f"{name} above 0 at an angle of 0 and below 0 at 180 is needed, got {ahead:g} and {astern:g}"
                yield ("four_quadrant",), text


Row = Annotated[tuple[Number, Number, Number, Number, Number, Number], numbers("surge sway heave roll pitch yaw")]
_OfMatrix = Only("hydrostatics", ("matrix",))


def _six_rows(value: object) -> object:
    """Six numbers as the matrix that has them on its diagonal; six rows as they are."""
    if not isinstance(value, (list, tuple)) or len(value) != 6:
        got = f"{len(value)}" if isinstance(value, (list, tuple)) else literal(value)
        raise fault(f"expected six rows of six numbers, or the six of the diagonal, got {got}")
    if any(isinstance(row, (list, tuple)) for row in value):
        return value
    return tuple(tuple(own if row == column else 0.0 for column in range(6)) for row, own in enumerate(value))


_Matrix = tuple[Row, Row, Row, Row, Row, Row]
_SixBySix = Annotated[_Matrix, BeforeValidator(_six_rows)]
"""Six rows of six numbers, or the six of the diagonal: surge, sway, heave, roll, pitch, yaw."""


def _resists(value: _Matrix) -> _Matrix:
    for index, row in enumerate(value):
        if row[index] < 0.0:
            raise fault(
                f"entry {index + 1}{index + 1} of the diagonal is {row[index]:.4g}, and 0 or more is needed; if the "
                "signs are those of X_u and X_du (SNAME, Fossen), reverse all of them"
            )
    return value


def _floats(value: _Matrix) -> _Matrix:
    if not value[2][2] > 0.0:
        raise fault(f"entry 33 is {value[2][2]:.4g} N/m: above 0 is needed for a boat that floats")
    return value


_Resistance = Annotated[_SixBySix, AfterValidator(_resists)]
_Stiffness = Annotated[_SixBySix, AfterValidator(_floats)]


_ResistancePoint = Annotated[tuple[NonNegative, NonNegative], numbers("speed force")]


def _along(value: object) -> object:
    """One number as the list that is the same from stern to bow."""
    if isinstance(value, (list, tuple)):
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise fault(f"expected a number, or a list of those from stern to bow, got {literal(value)}")
    return (value,)


_Along = Annotated[tuple[NonNegative, ...], Field(max_length=100), NotEmpty, BeforeValidator(_along)]
"""A number, or those at even distances from stern to bow, with straight lines between them."""


class CrossFlowConfig(Config):
    """Cross-flow drag of a hull by strips along it: each has the drag of a cylinder at its own velocity."""

    stern: Coordinate
    """x of its aft end [m]."""
    bow: Coordinate
    """x of its forward end [m]."""
    draft: _Along
    """Draft [m]: one number, or values at even distances from stern to bow."""
    coefficient: _Along
    """Drag coefficient over the lateral area, for all hulls of a boat together: one number, or values from stern to
    bow."""
    strips: Annotated[int, Field(ge=1, le=MOST_STRIPS)] = 20
    """Number of strips of equal length."""
    height: Coordinate | None = None
    """z at which the drag acts [m]; by default half the mean draft below the water at rest."""

    def _faults(self) -> Faults:
        if self.bow <= self.stern:
            yield ("bow",), f"expected a bow ahead of the stern, at {self.stern:g}, got {self.bow:g}"


class SkegConfig(Config):
    """A fixed fin under a hull, or the lift of the hull's own stern: a wing of the MMG standard method."""

    x: Coordinate
    """x of its centre of pressure [m]."""
    z: Coordinate = 0.0
    """z of its centre of pressure [m]."""
    area: Positive
    """Area seen from the side [m2]; for several fins side by side, their total."""
    aspect_ratio: Positive
    """Height over mean length."""


class MarineHullConfig(InFolder):
    """A hull in worlds of profile `marine`. Keys that are not given have the values of `hydrodynamics`.

    Axes are those of the base link: x forward, y left, z up.
    """

    folder_keys: ClassVar = {"folder": "hydro"}

    hydrostatics: Literal["mesh", "matrix"] = "mesh"
    """Hydrostatics from the pressure of still water and waves on closed surfaces (`mesh`), or from the stiffness of a
    published model of coefficients (`matrix`)."""
    shapes: Annotated[tuple[Shape, ...], Field(max_length=100), Only("hydrostatics", ("mesh",))] = ()
    """Closed surfaces of the hull that do not overlap, with 100 to 700 triangles; by default the robot's shapes."""
    point: Annotated[Vec3 | None, NumberOf(Vessel, "point")] = None
    """Point about which the matrices are given [m]; by default the boat's centre of mass."""
    added_mass: Annotated[_Resistance | None, NumberOf(Vessel, "added_mass")] = None
    """Added mass [kg, kg m, kg m2], six rows of six, or the diagonal."""
    munk: Switch = True
    """Whether added mass turns a boat across the stream (the Munk moment)."""
    damping_linear: _Resistance | None = None
    """Linear damping [N s/m, N s, N m s], six rows of six, or the diagonal."""
    damping_quadratic: Annotated[Six | None, NumberOf(Vessel, "damping_quadratic")] = None
    resistance: Annotated[tuple[_ResistancePoint, ...], Field(max_length=1000)] = ()
    """Speeds through the water and the resistance at each [m/s, N], in rising order from `[0, 0]`, instead of damping.
    The table is interpolated linearly and also applies astern. Beyond the last row, resistance is proportional to the
    square of the speed. A Froude number times sqrt(g L), with the length of the waterline L, gives the speed."""
    crossflow: CrossFlowConfig | None = None
    """Cross-flow drag of the hull by strips. With it, quadratic damping of sway and yaw is 0 unless given."""
    skegs: Annotated[tuple[SkegConfig, ...], Field(max_length=MOST_SKEGS)] = ()
    """Fins that keep the boat on course, against the Munk moment."""
    restoring: Annotated[_Stiffness | None, Only("hydrostatics", ("matrix",), required=True)] = None
    """Stiffness at rest for `hydrostatics: matrix` [N/m, N, N m], six rows of six, or the diagonal."""
    displacement: Annotated[Positive | None, NumberOf(Vessel, "displacement"), _OfMatrix] = None
    """Mass at which the water is at `waterline`, for `hydrostatics: matrix` [kg]; by default the boat's."""
    waterline: Annotated[float, NumberOf(Vessel, "waterline"), _OfMatrix] = 0.0
    """Height of the water at rest, for `hydrostatics: matrix` [m]."""
    hydro: Annotated[str, loads(read_hydro)] | None = None
    """File of radiation and diffraction in the folder of this file, as `vrx-mj robot hydro --bem` writes it: added
    mass, memory of the waves that the hull makes, and forces of the waves that it scatters."""
    diffraction: Annotated[Switch, Only("hydro")] = True
    """Whether waves act with the diffraction of `hydro`. Otherwise they act through added mass and memory with the
    water's motion at the centre of buoyancy, which is accurate for waves that are long compared with the hull."""

    def _faults(self) -> Faults:
        if self.hydro and self.added_mass:
            yield ("added_mass",), "not used with hydro, which includes it; remove it"
        if self.resistance:
            yield from self._resistance_faults()

    def _resistance_faults(self) -> Faults:
        """Resistance begins at rest, does not fall, and is the only one in surge."""
        yield from column_faults("resistance", [speed for speed, _ in self.resistance], "a speed", " m/s")
        if len(self.resistance) < 2 or self.resistance[0] != (0.0, 0.0):
            yield ("resistance",), "a first row [0, 0] and another one are needed"
        for index, ((slow, less), (fast, more)) in enumerate(itertools.pairwise(self.resistance), 1):
            if more < less:
                text = f"resistance must not decrease with speed, got {less:g} N at {slow:g} m/s and {more:g} N at "
                yield ("resistance", index), f"{text}{fast:g} m/s"
        linear, quadratic = self.damping_linear, self.damping_quadratic
        given = {"damping_linear": linear and linear[0][0], "damping_quadratic": quadratic and quadratic[0]}
        for key, surge in given.items():
            if surge:
                yield (key,), f"surge must be 0 with `resistance`, got {surge:g}"
