"""The model of a boat's hull in profile `marine`: its mesh, its matrices, and its file's radiation and diffraction.

Everything is about the link's origin, and the file's numbers are scaled to the density of the water. A hull whose
lift, inertia or small motions about its rest are impossible is refused.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.config.dynamics import CrossFlowConfig, Hydro, MarineHullConfig, SkegConfig, read_hydro
from vrx_mj.config.shapes import enclosed_volume, solid
from vrx_mj.errors import VrxError, warn
from vrx_mj.mjcf.boats import Boat, boat_mass, push_center
from vrx_mj.mjcf.drift import HullInWaves, coriolis, cross_matrix, with_drift
from vrx_mj.mjcf.flotation import Flotation, faces_of, flotation, hull_corners, lift_fault
from vrx_mj.mjcf.surfaces import checked_surface, panels_of
from vrx_mj.model.boats import MOST_TRIANGLES, Diffraction, Memory, Strip, Vessel
from vrx_mj.model.kinds import MOTIONS, Six
from vrx_mj.model.tables import nested_tuples
from vrx_mj.model.water import Sea
from vrx_mj.physics.tables import MATRIX, MESH
from vrx_mj.physics.thrust import normal_slope
from vrx_mj.rigid_bodies import MassProperties

_FILE_TOLERANCE = 0.2
"""Share of the displacement, and of the draft, by which a hull's position may differ from that of its file."""
_MIN_FREQUENCIES = 48
"""Least number of frequencies of a hull's table of waves; the next multiple of those in its file is taken."""
_MIN_RESIDUE = 1e-9
"""Share of the largest residue [SI] below which all of a motion's at a pole are left out."""
_GRAVITY, _EARTH = 9.81, 0.01
"""Gravity at rest and in small waves [m/s2], and the share by which that of worlds that take it may differ."""
_MAX_RATE = 1000.0
"""Fastest motion about rest [rad/s]: that of a boat with a draft of 0.01 mm."""
_DECAY_TIMES = math.log(20.0)
"""Time constants after which an oscillation has decayed to 5 %."""
_MAX_GROWTH = 1e-3
"""Rate [1/s] up to which a motion that grows may be rounding."""
_MOST_LOST = 0.05
"""Share of a sea's energy beyond the last frequency of a hull's file above which there is a warning."""
_MAX_SHORT_SHARE = 0.1
"""Share of a sea's energy in waves shorter than a hull without a file above which there is a warning."""
_MAX_TRANSIENT = 60.0
"""Time [s] for a transient to decay to 5 %, in a sea without a ramp, above which there is a warning."""
_MAX_ENERGY_GAIN = 0.01
"""Share of its energy that a motion gains in a minute through the time step above which there is a warning."""
_MAX_FROUDE = 0.4
"""Froude number up to which boats are carried by their displacement (Faltinsen, 2005, 1.1)."""
_VERTICAL = np.ix_((2, 3, 4), (2, 3, 4))
"""Rows and columns of heave, roll and pitch in a (6, 6) matrix."""


def about_origin(matrix: FloatArray, point: Sequence[float] | FloatArray) -> FloatArray:
    """A (6, 6) matrix of forces over motions of a point [m], as one of those of the origin.

    The point moves with v_p = v + w x p, and its force has the torque p x f about the origin: T' M T.
    """
    transform = _transform(point)
    return transform.T @ matrix @ transform


def _transform(point: Sequence[float] | FloatArray) -> FloatArray:
    """The (6, 6) that takes motions of the origin to those of a point."""
    transform = np.eye(6)
    transform[:3, 3:] = -cross_matrix(np.asarray(point))
    return transform


def memory_of(hydro: Hydro, density: float) -> tuple[Memory, ...]:
    """The memory of a hull in water of a density [kg/m3]: for each pole, that of each motion that makes waves."""
    share, rows = density / hydro.density, list[Memory]()
    residues = np.array(hydro.residues)
    least = _MIN_RESIDUE * float(np.abs(residues).max(initial=0.0))
    for pole, residue in zip(hydro.poles, residues, strict=True):
        a, b = (share * about_origin(residue[..., part], hydro.point) for part in (0, 1))
        rows += [
            Memory(
                motion=motion, pole=pole, residue=nested_tuples(of_real), residue_imaginary=nested_tuples(of_imaginary)
            )
            for motion, (of_real, of_imaginary) in enumerate(zip(a.T, b.T, strict=True))
            if max(np.abs(of_real).max(), np.abs(of_imaginary).max()) > least
        ]
    return tuple(rows)


def diffraction_of(hydro: Hydro, density: float) -> Diffraction | None:
    """Diffraction of a hull in water of a density [kg/m3], at even frequencies from 0, where it vanishes.

    They are about `_MIN_FREQUENCIES`, on cubic splines through the file's, between which the loop goes straight.
    """
    if not hydro.diffraction:
        return None
    from scipy.interpolate import CubicSpline

    diffraction = np.array(hydro.diffraction)
    n, angles = diffraction.shape[:2]
    at_origin = np.einsum("ji,nmjc->nmci", _transform(hydro.point), diffraction).reshape(n, -1)
    frequencies = np.concatenate(([0.0], hydro.waves))
    forces = np.concatenate((np.zeros((1, at_origin.shape[1])), at_origin)) * density / hydro.density
    count = n * max(round(_MIN_FREQUENCIES / n), 1)
    even = np.linspace(0.0, frequencies[-1], count + 1)
    smooth = CubicSpline(frequencies, forces)(even)
    return Diffraction(step=float(even[1]), forces=nested_tuples(smooth.reshape(count + 1, angles, 12)))


def check_mass(name: str, added: FloatArray, body: MassProperties, key: str) -> None:
    """Refuse added mass (6, 6) about the origin that is not symmetric, or not positive definite with the boat's own.

    Raises:
        VrxError: the boat would push itself.
    """
    odd = np.abs(added - added.T)
    if odd.max() > 1e-6 * np.abs(added).max():
        row, column = (int(value) + 1 for value in np.unravel_index(odd.argmax(), odd.shape))
        raise VrxError(
            f"robot {name}: hull.{key} is not symmetric: A{row}{column} is {added[row - 1, column - 1]:.4g}, "
            f"A{column}{row} is {added[column - 1, row - 1]:.4g}; in an ideal fluid it is"
        )
    values, vectors = np.linalg.eigh(_inertia(body) + added)
    if values[0] <= 0.0:
        motion = MOTIONS.names[int(np.abs(vectors[:, 0]).argmax())]
        raise VrxError(
            f"robot {name}: the mass of hull.{key} and the boat is not positive definite: its smallest eigenvalue is "
            f"{values[0]:.4g}, mostly of {motion}; check signs and sizes off the diagonal, and `point`"
        )


def _inertia(body: MassProperties) -> FloatArray:
    """The boat's own inertia (6, 6) about the link's origin."""
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, 3:] = body.mass * np.eye(3), body.inertia
    return about_origin(rigid, body.center)


def check_rest(boat: Boat, vessel: Vessel, density: float, gravity: float, rest: Flotation | None) -> None:
    """Warn of a hull that capsizes or lies oddly, unless its warnings say so; refuse one that its waves swing up.

    Raises:
        VrxError: small motions about its rest grow by its memory, or are too fast for any step.
    """
    name, body = boat.name, boat_mass(boat)
    stiffness, notes = _stiffness_at_rest(vessel, body, density * gravity, rest)
    for note in notes:
        if not any(note in other for other in boat.warnings):
            warn(f"robot {name}: {note}", 2)
    rates = _rates(_inertia(body) + np.array(vessel.added_mass), stiffness, vessel)
    fastest = float(np.abs(rates).max())
    if fastest > _MAX_RATE:
        raise VrxError(
            f"robot {name}: its fastest motion about equilibrium is {fastest:.3g} rad/s, which needs steps of "
            f"{0.2 / fastest:.1g} s; check the units of its hull, and the mass and inertia of its links"
        )
    worst = rates[rates.real.argmax()]
    if worst.real > _MAX_GROWTH:
        swing = f", with a period of {2.0 * math.pi / abs(worst.imag):.3g} s" if abs(worst.imag) > 1e-6 else ""
        text = f"robot {name} is unstable: a small motion about equilibrium grows at {worst.real:.3g} 1/s{swing}"
        if vessel.memory:
            raise VrxError(f"{text}; its wave memory adds energy: check the poles and residues of `hydro`")
        warn(f"{text}; check the entries of `damping_linear`", 2)


def warn_if_uncovered(name: str, vessel: Vessel | None, sea: Sea) -> None:
    """Warn of a sea of which more than `_MOST_LOST` is beyond the frequencies of a hull's diffraction.

    Its directions are all around the hull, and it begins at 0: nothing else is outside.
    """
    if vessel is None or vessel.diffraction is None:
        return
    last = vessel.diffraction.step * (len(vessel.diffraction.forces) - 1)
    energies = [(wave.frequency >= last, wave.amplitude**2) for wave in sea.waves]
    whole = math.fsum(energy for _, energy in energies)
    beyond = math.fsum(energy for outside, energy in energies if outside)
    if beyond > _MOST_LOST * whole:
        warn(
            f"robot {name}: {100.0 * beyond / whole:.3g} % of the sea's energy is in waves beyond {last:.3g} rad/s, "
            f"the last frequency of its `hydro`, shorter than {2.0 * math.pi / last:.3g} s: they are not scattered; "
            "compute it to higher frequencies, with more `--panels`",
            4,
        )


def warn_if_rough(boat: Boat, vessel: Vessel | None, sea: Sea, timestep: float) -> None:
    """Warn once of waves shorter than a hull without a file, a long transient, and a step that adds energy."""
    if vessel is None:
        return
    notes, body = [], boat_mass(boat)
    whole = math.fsum(wave.amplitude**2 for wave in sea.waves)
    short = math.fsum(wave.amplitude**2 for wave in sea.waves if wave.wavenumber * vessel.length > 2.0 * math.pi)
    if not vessel.diffraction and short > _MAX_SHORT_SHARE * whole:
        notes.append(
            f"{100.0 * short / whole:.3g} % of the sea's energy is in waves shorter than its waterline of "
            f"{vessel.length:.3g} m, to which it responds too much: give it `hydro`, by `vrx-mj robot hydro --bem`"
        )
    corners = faces_of(vessel) if vessel.hydrostatics == MESH else None
    rest = None if corners is None else flotation(corners, body.mass / sea.density)
    gravity = _gravity_of(sea.gravity)
    stiffness, _ = _stiffness_at_rest(vessel, body, sea.density * gravity, rest)
    rates = _rates(_inertia(body) + np.array(vessel.added_mass), stiffness, vessel)
    slowest = float(-rates.real[np.abs(rates.imag) > _MAX_GROWTH].max(initial=-math.inf))
    if whole > 0.0 and sea.tau <= 0.0 and slowest * _MAX_TRANSIENT < _DECAY_TIMES:
        fades = f"fades to 5 % in {_DECAY_TIMES / slowest:.3g} s" if slowest > _MAX_GROWTH else "does not fade"
        notes.append(f"a sea that is there from the start makes it swing, which {fades}: give the sea a `ramp`")
    speed = _MAX_FROUDE * math.sqrt(gravity * vessel.length)
    growth, gain = (0.0, 0.0) if vessel.memory else _growth(vessel, body, stiffness, speed, timestep)
    at_speed = f"at {speed:.3g} m/s, a Froude number of {_MAX_FROUDE:g}"
    if growth > _MAX_GROWTH:
        notes.append(
            f"{at_speed}, a small heave, roll or pitch grows at {growth:.3g} 1/s, as Munk's moment is larger than what "
            "rights it: if fins hold it, `munk: false` leaves that moment out"
        )
    elif gain > _MAX_ENERGY_GAIN:
        grows = f"{100.0 * gain:.3g} %" if gain < 10.0 else "over 1,000 %"
        notes.append(
            f"{at_speed}, steps of {timestep:g} s add {grows} a minute to the energy of heave, roll or pitch, before "
            "damping: increase its damping, or use a shorter `timestep`"
        )
    if notes:
        warn(f"robot {boat.name}: {'; '.join(notes)}", 4)


def _growth(
    vessel: Vessel, body: MassProperties, stiffness: FloatArray, speed: float, timestep: float
) -> tuple[float, float]:
    """Rate [1/s] at which heave, roll and pitch grow at a speed ahead [m/s], and what the length of the step adds.

    That is a share of its energy in a minute, by the loop's scheme of v' = v + dt a(v, s), s' = s + dt v', less what
    the differential equations gain.
    """
    added, damping = np.array(vessel.added_mass), np.array(vessel.damping)
    tilted = np.zeros((6, 6))
    tilted[2, 4] = speed  # of the water along the hull's z, by its trim
    moving = coriolis(added, np.array([speed, 0.0, 0.0]), munk=bool(vessel.munk)) - damping
    mass, by_pose, by_velocity = (
        about_origin(matrix, -body.center)[_VERTICAL]
        for matrix in (_inertia(body) + added, moving @ tilted - stiffness, moving)
    )
    pose, velocity = np.linalg.solve(mass, by_pose), np.linalg.solve(mass, by_velocity)
    one, none = np.eye(3), np.zeros((3, 3))
    exact = np.linalg.eigvals(np.block([[none, one], [pose, velocity]])).real.max()
    after = np.hstack([timestep * pose, one + timestep * velocity])
    stepped = np.abs(np.linalg.eigvals(np.vstack([np.hstack([one, none]) + timestep * after, after]))).max()
    growth = max(float(exact), 0.0)
    return growth, math.expm1(min(120.0 * (math.log(stepped) / timestep - growth), 100.0))


def _stiffness_at_rest(
    vessel: Vessel, body: MassProperties, weight: float, rest: Flotation | None
) -> tuple[FloatArray, list[str]]:
    """Stiffness (6, 6) about the origin without what capsizes it, and remarks about how it lies.

    `weight` is that of the water [N/m3].
    """
    if rest is None:
        restoring = about_origin(np.array(vessel.restoring), -np.array(vessel.point))
        notes = [
            f"hull.restoring of {MOTIONS.names[index]} is {restoring[index, index]:.4g} N m: it capsizes"
            for index in (3, 4)
            if restoring[index, index] < 0.0
        ]
        values, vectors = np.linalg.eigh(0.5 * (restoring + restoring.T))
        return about_origin((vectors * np.maximum(values, 0.0)) @ vectors.T, np.array(vessel.point)), notes
    trim, heel = (weight * rest.volume * max(height, 0.0) for height in rest.metacentric_heights(body.center))
    own = np.diag([0.0, 0.0, weight * rest.area, heel, trim, 0.0])
    return about_origin(own, np.array([rest.middle, rest.center[1], body.center[2]])), rest.remarks(body.center)


def _rates(inertia: FloatArray, stiffness: FloatArray, vessel: Vessel) -> npt.NDArray[np.complex128]:
    """Complex rates [1/s] of small motions about the rest: of M a + D v + sum of Re(r x) + C s = 0, x' = p x + v."""
    count = len(vessel.memory)
    system = np.zeros((12 + 2 * count, 12 + 2 * count))
    force = np.zeros((6, 12 + 2 * count))
    force[:, :6], force[:, 6:12] = -stiffness, -np.array(vessel.damping)
    for index, memory in enumerate(vessel.memory):
        row, (real, imaginary) = 12 + 2 * index, memory.pole
        system[row : row + 2, row : row + 2] = [[real, -imaginary], [imaginary, real]]
        system[row, 6 + memory.motion] = 1.0
        force[:, row], force[:, row + 1] = -np.array(memory.residue), np.array(memory.residue_imaginary)
    system[:6, 6:12] = np.eye(6)
    system[6:12] = np.linalg.solve(inertia, force)
    return np.linalg.eigvals(system).astype(np.complex128)


def _gravity_of(world: float) -> float:
    """Gravity [m/s2] of a world's hulls at rest: one for all worlds like the Earth, and for those of next to none."""
    return _GRAVITY if world < _EARTH * _GRAVITY or abs(world / _GRAVITY - 1.0) <= _EARTH else world


@lru_cache(maxsize=64)
def vessel_of(boat: Boat, density: float, gravity: float, *, in_waves: bool) -> Vessel | None:
    """The hull of a kind of boat, in water of a density [kg/m3] under a world's gravity [m/s2].

    What its file does not give is that of its `hydrodynamics`. What its forces lack in waves is found if it is
    `in_waves`.

    Raises:
        VrxError: it does not float, its mesh has too many triangles, or its mass with the added one is not positive.
    """
    config, water = boat.hull, boat.hydrodynamics
    if config is None:
        return None
    assert water is not None, f"{boat.name} has no hydrodynamics"
    body, pushed, gravity = boat_mass(boat), push_center(boat), _gravity_of(gravity)
    point = body.center if config.point is None else np.array(config.point)

    def at_origin(own: object, derived: tuple[float, ...]) -> FloatArray:
        return about_origin(np.array(own), point) if own else about_origin(np.diag(derived), pushed)

    hydro = read_hydro(config.hydro, config.folder) if config.hydro else None
    if hydro:
        added = about_origin(np.array(hydro.added_mass_infinite), hydro.point) * density / hydro.density
    else:
        added = at_origin(config.added_mass, water.added_mass)
    check_mass(boat.name, added, body, "hydro" if hydro else "added_mass")
    matrix = config.hydrostatics == "matrix"
    rest, carried = (None, _stiffness(config, body, point)) if matrix else _mesh(boat, config, point, density)
    level = rest.level if rest else config.waterline
    if hydro:
        _check_fit(boat.name, hydro, body.mass * hydro.density / density, level, carried.get("vertices", ()))
    found = Vessel(
        added_mass=nested_tuples(added),
        munk=1 if config.munk else 0,
        damping=nested_tuples(at_origin(config.damping_linear, _without_surge(config, water.drag_linear))),
        damping_quadratic=_quadratic(config, water.drag_quadratic),
        resistance=config.resistance,
        strips=(*_strips(config.crossflow, level, density), *(_skeg(each, density) for each in config.skegs)),
        memory=memory_of(hydro, density) if hydro else (),
        diffraction=diffraction_of(hydro, density) if hydro and config.diffraction else None,
        **carried,
    )
    check_rest(boat, found, density, gravity, rest)
    if not in_waves or found.length <= 0.0:
        return found
    stiffness, _ = _stiffness_at_rest(found, body, density * gravity, rest)
    hull = HullInWaves(found, _inertia(body), stiffness, level, density, hydro.gravity if hydro else gravity)
    return with_drift(hull, hydro, _transform(hydro.point if hydro else point))


def _check_fit(name: str, hydro: Hydro, mass: float, level: float, points: Sequence[Sequence[float]]) -> None:
    """Refuse radiation of a hull that lies otherwise than one of a mass [kg] in its water, which is at a level [m]."""
    if hydro.displacement is not None and abs(mass - hydro.displacement) > _FILE_TOLERANCE * hydro.displacement:
        raise VrxError(
            f"robot {name}: hull.hydro is for a hull that displaces {hydro.displacement:.4g} kg, but the boat has "
            f"{mass:.4g} kg: more than {_FILE_TOLERANCE:.0%} apart; compute it again with `--mass {mass:.4g}`"
        )
    draft = level - min((point[2] for point in points), default=-math.inf)
    if hydro.waterline is not None and abs(level - hydro.waterline) > _FILE_TOLERANCE * draft:
        raise VrxError(
            f"robot {name}: hull.hydro is for a hull with the water at z = {hydro.waterline:.4g} m, but the boat's "
            f"is at {level:.4g} m, with a draft of {draft:.4g} m: compute it again, with the mesh in the axes of the "
            "base link"
        )


def _quadratic(config: MarineHullConfig, derived: Six) -> Six:
    """Quadratic damping; strips take the place of what a hull would else have in sway and yaw."""
    if config.damping_quadratic:
        return config.damping_quadratic
    surge, sway, heave, roll, pitch, yaw = _without_surge(config, derived)
    return (surge, 0.0, heave, roll, pitch, 0.0) if config.crossflow else (surge, sway, heave, roll, pitch, yaw)


def _without_surge(config: MarineHullConfig, derived: Six) -> Six:
    """Damping of a hull's `hydrodynamics`, whose part in surge a `resistance` replaces."""
    return (0.0, *derived[1:]) if config.resistance else derived


def _skeg(config: SkegConfig, density: float) -> Strip:
    lift = 0.5 * density * config.area * normal_slope(config.aspect_ratio)
    return Strip(x=config.x, z=config.z, drag=0.0, lift=lift)


def _strips(config: CrossFlowConfig | None, level: float, density: float) -> tuple[Strip, ...]:
    """Strips along a hull that floats with the water at a `level` [m], by the middle of each."""
    if config is None:
        return ()
    length = (config.bow - config.stern) / config.strips
    share = (np.arange(config.strips) + 0.5) / config.strips
    draft, coefficient = (np.interp(share, np.linspace(0.0, 1.0, len(values)), values)
                          for values in (config.draft, config.coefficient))  # fmt: skip
    z = level - 0.5 * float(draft.mean()) if config.height is None else config.height
    drag = 0.5 * density * length * draft * coefficient
    middles = config.stern + share * (config.bow - config.stern)
    return tuple(Strip(x=x, z=z, drag=k) for x, k in zip(middles.tolist(), drag.tolist(), strict=True))


def _stiffness(config: MarineHullConfig, body: MassProperties, point: FloatArray) -> dict[str, Any]:
    """Fields of a vessel from a published model's restoring forces."""
    stiff = np.array(config.restoring)
    return {
        "hydrostatics": MATRIX,
        "restoring": nested_tuples(about_origin(stiff, point)),
        "displacement": config.displacement or body.mass,
        "spread": (max(stiff[4, 4] / stiff[2, 2], 0.0), max(stiff[3, 3] / stiff[2, 2], 0.0)),
        "waterline": config.waterline,
        "buoyancy": nested_tuples(point),
        "point": nested_tuples(point),
    }


def _mesh(boat: Boat, config: MarineHullConfig, point: FloatArray, density: float) -> tuple[Flotation, dict[str, Any]]:
    """The flotation at rest, and what a vessel has of a mesh, which carries the boat."""
    body = boat_mass(boat)
    corners = _surface(boat, config, body.mass / density)
    whole = enclosed_volume(corners) if len(corners) else 0.0
    more = " and that all of the hull is in it, or the mass of the links"
    if fault := lift_fault(whole, density, body.mass, more, "`scale: [0.001, 0.001, 0.001]`"):
        raise VrxError(f"robot {boat.name} {fault}")
    rest = flotation(corners, body.mass / density)
    points, triangles = panels_of(corners)
    if len(triangles) > MOST_TRIANGLES // 2:
        slow = f"its hull is divided into {len(triangles):,} triangles, and every step visits each"
        faster = "a mesh whose long round parts have fewer sides is faster"
        warn(f"robot {boat.name}: {slow}; {faster}", 2)
    return rest, {
        "hydrostatics": MESH,
        "vertices": nested_tuples(points),
        "triangles": nested_tuples(triangles),
        "displacement": body.mass,
        "buoyancy": nested_tuples(rest.center),
        "spread": (float(rest.spread[0]) / rest.area, float(rest.spread[1]) / rest.area),
        "point": nested_tuples(point),
    }


def _surface(boat: Boat, config: MarineHullConfig, volume: float) -> FloatArray:
    """Closed triangles (n, 3, 3) of the hull in the base link [m]; `volume` is what it displaces [m3].

    Raises:
        VrxError: it has too many, or parts of it are inside out.
    """
    names, starts = [], []
    if not config.shapes:
        corners, notes = hull_corners(boat, volume)
    else:
        found = [(shape, solid(shape)) for shape in config.shapes]
        notes = tuple(note for _, item in found for note in item.notes)
        pieces = [item.at(shape.pose) for shape, item in found]
        names = [f"shapes[{index}]" for index in range(len(pieces))]
        starts = [0, *np.cumsum([len(piece) for piece in pieces[:-1]]).tolist()]
        corners = np.concatenate(pieces)
    if len(corners) > MOST_TRIANGLES:
        raise VrxError(
            f"robot {boat.name}: its hull has {len(corners):,} triangles, more than {MOST_TRIANGLES:,}; 100 to 700 "
            "are enough, and every step visits each: simplify the mesh"
        )
    try:
        notes = (*notes, *checked_surface(corners, names, starts))
    except VrxError as error:
        raise VrxError(f"robot {boat.name}: {error}") from None
    for note in notes:
        warn(f"robot {boat.name}: {note}", 2)
    return corners
