"""Everything that acts on a hull: the effects of water and wind, listed once, and its thrusters, rudders and sails.

The compiled loop sums the list, and `Simulation.forces` shows it entry by entry. It is composed when this module is
imported: of functions that numba writes out where the loop calls them, so the list costs nothing in a step.
"""

import enum
import functools
from collections.abc import Callable, Iterable
from itertools import groupby
from typing import NamedTuple

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.conditions import Conditions, current_step, motion_through, still_water, water_motion
from vrx_mj.physics.drag import bias_on_hull, drag_on_hull
from vrx_mj.physics.drift import drift_on_vessel
from vrx_mj.physics.hydrostatics import hydrostatics
from vrx_mj.physics.kernel import allocating_kernel, expanded_kernel, inlined_kernel, kernel
from vrx_mj.physics.kinematics import turned_with
from vrx_mj.physics.motion import Motion, Wrench, add, carry, motion, zero_wrench
from vrx_mj.physics.sail import along_blade, boom_target, sail_force, wind_on_sail
from vrx_mj.physics.tables import MARINE, RUDDER, SAIL, Record, Table, Waves
from vrx_mj.physics.thrust import (
    effective_command,
    engine_wrench,
    rudder_force,
    rudder_force_at_sea,
    servo_step,
    servo_torque,
    steering_target,
    thrust_force,
    thruster_wrench,
    update_propeller,
)
from vrx_mj.physics.vessel import (
    HullMeshes,
    VesselWork,
    Work,
    bias_on_vessel,
    diffraction_on_vessel,
    drag_on_vessel,
    pressure_on_vessel,
    radiation_on_vessel,
    vessel_work,
    wet_share,
)
from vrx_mj.physics.wind import air_velocity, wind_at_hull, wind_on_hull, wind_step
from vrx_mj.runtime.views import Views, views

Air = tuple[float, float]
_Rows = FloatArray | None
_Load = Callable[[Record, Conditions, Views], Wrench]
_Sum = Callable[[Record, Conditions, Views, _Rows], Wrench]


class Hulls(enum.Flag):
    """Kinds of hulls."""

    STATIONS = enum.auto()
    """Hulls that float on stations, `tables.STATION`: all of VRX's profiles, and those of `marine` without a model."""
    VESSELS = enum.auto()
    """Hulls with a model of their own, a row of `tables.VESSEL`."""
    ALL = STATIONS | VESSELS


class Effect(NamedTuple):
    """Something that water or wind does to hulls."""

    name: str
    """Key in `Simulation.forces`."""
    hulls: Hulls
    """The hulls on which it acts."""
    load: _Load
    """Its wrench in world axes about `hull.link_com`, as an expression of kernels."""
    group: int = 0
    """Effects of a group are added up before groups are."""


EFFECTS = (
    Effect(
        "hydrostatics",
        Hulls.STATIONS,
        lambda hull, now, a: hydrostatics(hull, a.stations, now.waves, a.sea[0], now.body, now.time, a.own_waves),
    ),
    Effect("hydrostatics", Hulls.VESSELS, lambda hull, now, a: now.pressure),
    Effect("drag", Hulls.STATIONS, lambda hull, now, a: drag_on_hull(hull, now.through)),
    Effect(
        "drag",
        Hulls.VESSELS,
        lambda hull, now, a: drag_on_vessel(hull, a.vessels[hull.vessel], a.strips, a.resistances, now),
    ),
    Effect("added_mass_bias", Hulls.STATIONS, lambda hull, now, a: bias_on_hull(hull, now.through)),
    Effect("added_mass_bias", Hulls.VESSELS, lambda hull, now, a: bias_on_vessel(hull, a.vessels[hull.vessel], now)),
    Effect("wind", Hulls.ALL, lambda hull, now, a: wind_on_hull(hull, now.windage, now.body, now.air)),
    Effect(
        "radiation",
        Hulls.VESSELS,
        lambda hull, now, a: radiation_on_vessel(hull, a.vessels[hull.vessel], a.memory, a.memory_state, now),
        group=1,
    ),
    Effect(
        "diffraction",
        Hulls.VESSELS,
        lambda hull, now, a: diffraction_on_vessel(hull, a.vessels[hull.vessel], a.diffraction, a.sea[0], now),
        group=1,
    ),
    Effect(
        "drift",
        Hulls.VESSELS,
        lambda hull, now, a: drift_on_vessel(hull, a.vessels[hull.vessel], a.drift, a.drift_state, a.sea[0], now),
        group=1,
    ),
)
"""All effects, in the order in which they are added up. What is known of the hull and around it is `now`; `a` are all
arrays of the run, with a row of `tables.HULL` in `hull`."""


def _one(row: int, load: _Load) -> _Sum:
    """The load of an effect, which also goes into its row if rows are wanted."""
    load = expanded_kernel(load)

    @expanded_kernel
    def one(hull: Record, now: Conditions, a: Views, out: _Rows) -> Wrench:
        wrench = load(hull, now, a)
        if out is not None:
            for k in range(6):
                out[row, k] = wrench[k]
        return wrench

    return one


def _both(first: _Sum, second: _Sum) -> _Sum:
    """The sum of two loads."""

    @expanded_kernel
    def both(hull: Record, now: Conditions, a: Views, out: _Rows) -> Wrench:
        return add(first(hull, now, a, out), second(hull, now, a, out))

    return both


def _sum(loads: Iterable[_Sum]) -> _Sum:
    return functools.reduce(_both, loads)


def _sum_on(hulls: Hulls) -> _Sum:
    """The sum of all effects on a kind of hull."""
    own = [(row, effect) for row, effect in enumerate(EFFECTS) if effect.hulls & hulls]
    groups = groupby(own, key=lambda item: item[1].group)
    return _sum([_sum([_one(row, effect.load) for row, effect in group]) for _, group in groups])


_loads_on_stations = _sum_on(Hulls.STATIONS)
_loads_on_vessel = _sum_on(Hulls.VESSELS)


@expanded_kernel
def weather_step(a: Views, work: Work, dt: float) -> Air:
    """Advance wind and current by `dt` [s], and return the wind [m/s]."""
    wind_step(a.wind[0], a.wind_state[0], a.gust_bands, a.air, a.air_state, dt)
    if work is not None:
        current_step(a.current, a.current_state, dt)
    return air_velocity(a.wind[0], a.wind_state[0], a.air_state)


@inlined_kernel
def push_hull(index: int, a: Views, work: Work, waves: Waves, air: Air, time: float, dt: float, out: _Rows) -> None:
    """Push a hull by water, wind and its thrusters; `out` are rows for the wrenches of `EFFECTS`, if wanted."""
    hull = a.hulls[index]
    body = motion(a.qpos, a.qvel, hull.qpos, hull.dof)
    here = air if work is None else wind_at_hull(hull, a.air, air)
    if work is not None and hull.vessel >= 0:
        load = _loads_on_vessel(hull, _around_vessel(hull, body, a, work, here, time, dt), a, out)
    else:
        load = _loads_on_stations(hull, _around_stations(hull, body, a, work, waves, here, time, dt), a, out)
    push = _thrust(hull, body, a, work, air, time, dt)
    apply_wrench(a.xfrc_applied, hull.body, carry(add(load, push), body, hull.link_com, hull.body_com))


@expanded_kernel
def _around_stations(
    hull: Record, body: Motion, a: Views, work: Work, waves: Waves, air: Air, time: float, dt: float
) -> Conditions:
    """Surroundings of a hull on stations; the water of VRX's profiles is at rest."""
    water, through, level = still_water(), body, body
    if work is not None and hull.profile == MARINE:
        water = water_motion(hull, hull.link_com, body, waves, a, time, dt, True)
        level = motion_through(water, body)
        through = turned_with(level, water.turning, hull.link_com)
    windage = None if work is None else a.windage
    return Conditions(waves, windage, air, water, body, through, level, zero_wrench(), 1.0, time, dt)


@expanded_kernel
def _around_vessel(
    hull: Record, body: Motion, a: Views, work: VesselWork, air: Air, time: float, dt: float
) -> Conditions:
    """Surroundings of a hull with a model of its own."""
    vessel = a.vessels[hull.vessel]
    turns = vessel.diffraction_frequencies == 0
    water = water_motion(hull, vessel.buoyancy, body, work.columns, a, time, dt, turns)
    level = motion_through(water, body)
    through = turned_with(level, water.turning, vessel.buoyancy)
    pressure = pressure_on_vessel(hull, vessel, hull_meshes(a), a.waves, a.sea[0], body, time, work, a.own_waves)
    wet = wet_share(vessel, a.sea[0], pressure)
    return Conditions(work.columns, a.windage, air, water, body, through, level, pressure, wet, time, dt)


@expanded_kernel
def hull_meshes(a: Views) -> HullMeshes:
    """Return the meshes of all vessels."""
    return HullMeshes(a.parts, a.points, a.shares, a.pairs, a.corner_shares)


@allocating_kernel
def hull_loads(runs: Table, index: int, time: float, dt: float, out: FloatArray) -> None:
    """Push the hull of a row in a run's next step, to `time` [s], and write the wrenches of `EFFECTS` into `out`.

    The run's state goes on as in the step: it is one of copies, of which `runs` has the only row.
    """
    a = views(runs[0])
    work = vessel_work(hull_meshes(a), a.waves, a.sea[0], a.own_waves)
    push_hull(index, a, work, work.columns, weather_step(a, work, dt), time, dt, out)


@allocating_kernel
def hull_loads_vrx(runs: Table, index: int, time: float, dt: float, out: FloatArray) -> None:
    """`hull_loads` for the worlds of `advance_vrx`."""
    a = views(runs[0])
    push_hull(index, a, None, a.waves, weather_step(a, None, dt), time, dt, out)


@inlined_kernel
def _thrust(hull: Record, body: Motion, a: Views, work: Work, air: Air, time: float, dt: float) -> Wrench:
    """Steer the hull's engines, rudders and sails and push with them; returns the wrench on the hull about `link_com`.

    A hinged engine is pushed itself, and steered through its joint; the hull feels it through the hinge.
    """
    wrench = zero_wrench()
    for k in range(hull.thruster_start, hull.thruster_start + hull.thruster_count):
        thruster, own = a.thrusters[k], a.thruster_state[k]
        target = _angle_target(thruster, own, body, a.air, air)
        if thruster.dof >= 0:
            own.angle, own.rate = a.qpos[thruster.qpos], a.qvel[thruster.dof]
            a.qfrc_applied[thruster.dof] = servo_torque(thruster, own.angle, own.rate, target, dt)
        elif own.angle != target or own.rate != 0.0:
            own.angle, own.rate = servo_step(thruster, own.angle, own.rate, target, dt)
        if work is not None and thruster.measured >= 0:
            update_propeller(hull, thruster, own, a, work.columns, body, time, dt)
        elif work is not None and thruster.mapping == RUDDER and hull.profile == MARINE:
            race = a.thruster_state[thruster.race].thrust if thruster.race >= 0 else 0.0
            own.thrust = rudder_force_at_sea(hull, thruster, own.angle, race, a, work.columns, body, time, dt)
        else:
            _update_force(hull, thruster, own, a.thruster_state, a.sail_curves, body, a.air, air, time)
        along = along_blade(thruster, own)
        if thruster.dof >= 0:
            apply_wrench(a.xfrc_applied, thruster.body, engine_wrench(thruster, body, own.thrust, own.angle, along))
        else:
            wrench = add(wrench, thruster_wrench(thruster, hull, body, own.thrust, own.angle, along))
    return wrench


@kernel
def _angle_target(thruster: Record, own: Record, body: Motion, profile: Table, air: Air) -> float:
    """Return the angle [rad] to which an engine, a rudder or a boom turns; `profile` is the wind's, over height."""
    if thruster.mapping == SAIL:
        flow = wind_on_sail(thruster, profile, air, body, own.angle)
        return boom_target(thruster, flow, own.angle, own.angle_target)
    return steering_target(thruster, own.angle_target)


@kernel
def _update_force(
    hull: Record, thruster: Record, own: Record, state: Table, curves: Table, body: Motion, profile: Table, air: Air,
    time: float,
) -> None:  # fmt: skip
    """Bring the force [N] of a thruster, rudder or sail up to date; a propeller's comes before its rudder's.

    A propeller at rest pushes nothing, but in VRX's own profiles, where its curve may.
    """
    if thruster.mapping == RUDDER:
        race = state[thruster.race].thrust if thruster.race >= 0 else 0.0
        own.thrust = rudder_force(thruster, body, own.angle, race)
        return
    if thruster.mapping == SAIL:
        flow = wind_on_sail(thruster, profile, air, body, own.angle)
        own.applied, own.thrust = sail_force(thruster, curves, flow, own.angle)
        return
    command = effective_command(own, time)
    if command != own.applied or own.fresh == 0:
        at_rest = hull.profile == MARINE and command == 0.0
        force = 0.0 if at_rest else thruster.gain * thrust_force(thruster, command)
        own.applied, own.thrust, own.fresh = command, force, 1


@kernel
def apply_wrench(xfrc_applied: FloatArray, body: int, wrench: Wrench) -> None:
    """Write a wrench about a body's centre of mass into its row of `xfrc_applied`."""
    row = xfrc_applied[body]
    row[0], row[1], row[2] = wrench.fx, wrench.fy, wrench.fz
    row[3], row[4], row[5] = wrench.tx, wrench.ty, wrench.tz
