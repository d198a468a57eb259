"""The model of a boat's hull in profile `marine`: its mesh, and its matrices about the link's origin."""

import warnings
from functools import lru_cache
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.dynamics import CrossFlowConfig, MarineHullConfig, SkegConfig
from vrx_mj.config.hydro import read_hydro
from vrx_mj.config.solids import enclosed_volume, solid
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.derive import hull_corners
from vrx_mj.mjcf.flotation import flotation, lift_fault
from vrx_mj.mjcf.hull_checks import check_mass, check_rest
from vrx_mj.mjcf.masses import boat_mass, push_center
from vrx_mj.mjcf.panels import panels_of
from vrx_mj.mjcf.radiation import about_origin, diffraction_of, memory_of, nested_tuples
from vrx_mj.mjcf.surfaces import checked_surface
from vrx_mj.model.boats import MOST_TRIANGLES, Strip, Vessel
from vrx_mj.model.kinds import Six
from vrx_mj.physics.tables import MATRIX, MESH
from vrx_mj.physics.thrust import normal_slope
from vrx_mj.rigid_bodies import MassProperties


@lru_cache(maxsize=32)
def vessel_of(boat: Boat, density: float) -> Vessel | None:
    """The hull of a kind of boat, in water of a density [kg/m3].

    What its file does not give is that of its `hydrodynamics`.

    Raises:
        VrxError: it does not float, its mesh has too many triangles, or its mass with the added one is not positive.
    """
    config, water = boat.hull, boat.hydrodynamics
    if config is None:
        return None
    assert water is not None, f"{boat.name} has no hydrodynamics"
    body, pushed = boat_mass(boat), push_center(boat)
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
    level, carried = _stiffness(config, body, point) if matrix else _mesh(boat, config, point, density)
    found = Vessel(
        added_mass=nested_tuples(added),
        munk=1 if config.munk else 0,
        damping=nested_tuples(at_origin(config.damping_linear, water.drag_linear)),
        damping_quadratic=_quadratic(config, water.drag_quadratic),
        strips=(*_strips(config.crossflow, level, density), *(_skeg(each, density) for each in config.skegs)),
        memory=memory_of(hydro, density) if hydro else (),
        diffraction=diffraction_of(hydro, density) if hydro and config.diffraction else None,
        **carried,
    )
    check_rest(boat.name, found, body, density, boat.warnings)
    return found


def _quadratic(config: MarineHullConfig, derived: Six) -> Six:
    """Quadratic damping; strips take the place of what a hull would else have in sway and yaw."""
    if config.damping_quadratic or not config.crossflow:
        return config.damping_quadratic or derived
    surge, _, heave, roll, pitch, _ = derived
    return surge, 0.0, heave, roll, pitch, 0.0


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


def _stiffness(config: MarineHullConfig, body: MassProperties, point: FloatArray) -> tuple[float, dict[str, Any]]:
    """The height of the water at rest [m], and what a vessel has of a published model's restoring forces."""
    stiff = np.array(config.restoring)
    return config.waterline, {
        "hydrostatics": MATRIX,
        "restoring": nested_tuples(about_origin(stiff, point)),
        "displacement": config.displacement or body.mass,
        "spread": (max(stiff[4, 4] / stiff[2, 2], 0.0), max(stiff[3, 3] / stiff[2, 2], 0.0)),
        "waterline": config.waterline,
        "buoyancy": nested_tuples(point),
        "point": nested_tuples(point),
    }


def _mesh(boat: Boat, config: MarineHullConfig, point: FloatArray, density: float) -> tuple[float, dict[str, Any]]:
    """The height of the water at rest [m], and what a vessel has of a mesh, which carries the boat."""
    body = boat_mass(boat)
    corners = _surface(boat, config, body.mass / density)
    whole = enclosed_volume(corners) if len(corners) else 0.0
    more = " and that all of the hull is in it, or the mass of the links"
    if fault := lift_fault(whole, density, body.mass, more, "`scale: [0.001, 0.001, 0.001]`"):
        raise VrxError(f"robot {boat.name} {fault}")
    rest = flotation(corners, body.mass / density)
    points, triangles = panels_of(corners)
    return rest.level, {
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
            "are enough, and every step looks at all: simplify the mesh"
        )
    try:
        notes = (*notes, *checked_surface(corners, names, starts))
    except VrxError as error:
        raise VrxError(f"robot {boat.name}: {error}") from None
    for note in notes:
        warnings.warn(f"robot {boat.name}: {note}", VrxWarning, stacklevel=2)
    return corners
