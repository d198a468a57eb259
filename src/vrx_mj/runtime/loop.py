"""The compiled loop: the equation of motion of everything that floats.

For each physics step it reads `qpos` and `qvel`, adds up the wrench of every hull and of every floating object,
writes `xfrc_applied`, and has MuJoCo step. As in VRX the clock is advanced first: forces belong to the pose and
velocity that the last step left, and to the time at which this one ends. The scheme is a leapfrog, whose velocities are
those of half a step before, and so are those of the water beside them (`kinematics.half_step_back`).
"""

import numpy as np
from numba import types

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.libmujoco import c_function
from vrx_mj.physics.afloat import add_link_drag, flotation_in_waves, link_motion, rope_pull
from vrx_mj.physics.conditions import current_velocity
from vrx_mj.physics.drag import added_inertia, added_inertia_of_vessel, added_moment, has_added_moment
from vrx_mj.physics.flotation import (
    Flotation,
    add_flotation_drag,
    flotation,
    flotation_of_step,
    follow,
    water_at_elements,
    water_rise,
)
from vrx_mj.physics.free_body import step_free_bodies
from vrx_mj.physics.kernel import allocating_kernel, expanded_kernel, inlined_kernel, kernel
from vrx_mj.physics.kinematics import half_step_back, orbital_motion
from vrx_mj.physics.motion import Motion, Wrench, add, motion, zero_wrench
from vrx_mj.physics.raft import block_load, moor, raft_drag
from vrx_mj.physics.tables import MARINE, VRX3, Record, Table, Waves
from vrx_mj.physics.vessel import Work, vessel_work
from vrx_mj.physics.waves import row_waves, surface_height, wave_columns
from vrx_mj.physics.wind import wind_on_float
from vrx_mj.runtime.effects import Air, apply_wrench, hull_meshes, push_hull, weather_step
from vrx_mj.runtime.proximity import contact_free, touch_begins
from vrx_mj.runtime.timing import latch
from vrx_mj.runtime.views import Views, row_views, views

MAX_STATE = 1e7
"""A state beyond this [m, m/s, rad/s] has diverged."""

_MAX_PASSES, _MOMENT_TOLERANCE = 20, 1e-9
"""Largest number of passes in the search for moments of added mass, and the change [N m] with which it ends."""

STRIDE, COUNTDOWN, FILLED = 0, 1, 2
"""Columns of the sampling table: steps per row, steps until the next row, rows in the buffer."""


def _stage(name: str) -> types.ExternalFunction:
    """A stage of MuJoCo's step, a function of the addresses of a model and its data."""
    return c_function(name, types.void, types.uintp, types.uintp)


_mj_kinematics = _stage("mj_kinematics")
_mj_fwd_kinematics = _stage("mj_fwdKinematics")
_mj_make_m = _stage("mj_makeM")
_mj_collision = _stage("mj_collision")
_mj_make_constraint = _stage("mj_makeConstraint")
_mj_island = _stage("mj_island")
_mj_project_constraint = _stage("mj_projectConstraint")
_mj_transmission = _stage("mj_transmission")
_mj_factor_m = _stage("mj_factorM")
_mj_sensor_pos = _stage("mj_sensorPos")
_mj_sensor_vel = _stage("mj_sensorVel")
_mj_sensor_acc = _stage("mj_sensorAcc")
_mj_fwd_velocity = _stage("mj_fwdVelocity")
_mj_fwd_actuation = _stage("mj_fwdActuation")
_mj_fwd_acceleration = _stage("mj_fwdAcceleration")
_mj_fwd_constraint = _stage("mj_fwdConstraint")
_mj_euler = _stage("mj_Euler")

_Address = int


@allocating_kernel
def advance(runs: Table, row: int, time: float, dt: float, steps: int) -> int:
    """Advance the run of a row of `runs`, a table of `RUN`, by `steps` physics steps of `dt` [s] from `time` [s].

    While nothing can touch anything the model without collision shapes steps, or the run's free bodies by themselves.
    Returns the number of steps done: fewer when the sample buffer is full, a touch has begun, or something is near and
    the run has no data of MuJoCo's; -1 when the state has diverged.
    """
    a = row_views(runs[row])
    work = vessel_work(hull_meshes(a), a.waves, a.sea[0], a.own_waves)
    return _advance(runs[row], a, time, dt, steps, work, work.columns)


@allocating_kernel
def advance_vrx(runs: Table, row: int, time: float, dt: float, steps: int) -> int:
    """`advance` for worlds of VRX's profiles without links, compiled without all that only others need."""
    a, own = views(runs[row]), row_views(runs[row])
    return _advance(runs[row], a, time, dt, steps, None, row_waves(a.waves, own.own_waves))


@allocating_kernel
def advance_vrx_sea(runs: Table, row: int, time: float, dt: float, steps: int) -> int:
    """`advance_vrx` in a sea of many waves, several of which a processor takes at a time: with the same bits."""
    a, own = views(runs[row]), row_views(runs[row])
    return _advance(runs[row], a, time, dt, steps, None, wave_columns(a.waves, a.sea[0], 4, own.own_waves))


LOOPS = advance, advance_vrx, advance_vrx_sea
"""The loops, by the number in `LoopArrays.loop`."""


@expanded_kernel
def _advance(run: Record, a: Views, time: float, dt: float, steps: int, work: Work, waves: Waves) -> int:
    """`advance`. Where `work` is None, numba leaves out the branches that need it."""
    flags = a.broadphase[0]
    added, damping = np.empty((6, 6)), np.empty((a.floats.size + a.links.size, 3))
    done, free_before, touched = 0, False, False
    turning = _any_turns_by_added_mass(a.hulls)
    while done < steps and not touched and not _full(a.sampling, a.samples) and not _has_diverged(a.qpos, a.qvel):
        free = contact_free(a.movers, a.obstacles, a.qpos, flags)
        if not free and run.data == 0:
            break
        _sample(a, time)
        latch(a.clocks, a.latched, a.qpos, a.qvel, a.device_state, time)
        time += dt
        air = _push_free(a, work, waves, damping, time, dt)
        if work is not None and a.links.size > 0:
            _mj_fwd_kinematics(run.contact_free, run.data)
            _push_links(a, work, waves, air, damping, time, dt)
        _push_docks(a, work, waves, air, time, dt)
        idle = free and free_before and flags.unconstrained != 0  # the step before found nothing, nor would this one
        if free and a.free_bodies.size > 0:
            step_free_bodies(a.free_bodies, a.solve_work, a.float_state, damping, a.qpos, a.qvel, a.xfrc_applied, dt)
        else:
            _move(run.contact_free if free else run.model, run.data, a, work, added, damping, turning, idle)
        free_before = free
        _note_touches(a.sensordata, a.touches, time - dt)
        touched = touch_begins(flags, free, a.hulls, a.qfrc_constraint)
        done += 1
    if run.data != 0:
        _mj_kinematics(run.model, run.data)
    return -1 if _has_diverged(a.qpos, a.qvel) else done


@kernel
def advance_free(runs: Table, row: int, time: float, dt: float, steps: int, damping: FloatArray, work: Work) -> int:
    """`advance` for runs of free bodies without sensors while nothing is near: no line of it is MuJoCo's.

    `damping` is memory, (floats, 3), and `work` that of `vessel_work`; None is for the worlds of `advance_vrx`.
    """
    a = row_views(runs[row])
    if work is None:
        return _advance_free(a, time, dt, steps, damping, None, a.waves)
    return _advance_free(a, time, dt, steps, damping, work, work.columns)


@expanded_kernel
def _advance_free(a: Views, time: float, dt: float, steps: int, damping: FloatArray, work: Work, waves: Waves) -> int:
    """`advance_free`, the loop that a graphics processor compiles."""
    done = 0
    while done < steps and not _has_diverged(a.qpos, a.qvel):
        if not contact_free(a.movers, a.obstacles, a.qpos, a.broadphase[0]):
            break
        time += dt
        _push_free(a, work, waves, damping, time, dt)
        step_free_bodies(a.free_bodies, a.solve_work, a.float_state, damping, a.qpos, a.qvel, a.xfrc_applied, dt)
        done += 1
    return -1 if _has_diverged(a.qpos, a.qvel) else done


@expanded_kernel
def _push_free(a: Views, work: Work, waves: Waves, damping: FloatArray, time: float, dt: float) -> Air:
    """Push hulls and floats by weather, water and thrusters in the step to `time` [s]; returns the wind [m/s]."""
    air = weather_step(a, work, dt)
    for i in range(a.hulls.size):
        push_hull(i, a, work, waves, air, time, dt, None)
    _push_floats(a, work, waves, air, damping, time, dt)
    return air


@inlined_kernel
def _move(
    model: _Address, data: _Address, a: Views, work: Work, added: FloatArray, damping: FloatArray,
    turning: bool, idle: bool,
) -> None:  # fmt: skip
    """`mj_step`, stage by stage, with the hulls' added mass and the floats' and docks' drag put into the inertia.

    Its checks are left out: they write warnings to a file, and `_has_diverged` finds more. So are, while `idle`,
    the stages about constraints, actuators and sensors, an eighth of a boat's step.
    """
    _mj_fwd_kinematics(model, data)
    _mj_make_m(model, data)
    for i in range(a.hulls.size):
        hull = a.hulls[i]
        _inertia_of_water(hull, motion(a.qpos, a.qvel, hull.qpos, hull.dof), a, work, added)
        _add_to_inertia(a.inertia, a.inertia_row, hull.dof, added)
    for i in range(a.floats.size):
        add_flotation_drag(a.inertia, a.inertia_row, a.floats[i].dof, damping[i])
    if work is not None:
        for i in range(a.links.size):
            body = a.links[i].body
            center, own = a.subtree_com[a.body_root[body]], damping[a.floats.size + i]
            add_link_drag(a.inertia, a.inertia_row, a.xpos[body], a.links[i].dof, a.dof_parent, a.cdof, center, own)
    raft_drag(a.blocks, a.raft_work, a.inertia, a.inertia_row)
    _mj_factor_m(model, data)
    if not idle:
        _mj_collision(model, data)
        _mj_make_constraint(model, data)
        _mj_island(model, data)
        _mj_project_constraint(model, data)
        _mj_transmission(model, data)
        _mj_sensor_pos(model, data)
    _mj_fwd_velocity(model, data)
    if not idle:
        _mj_sensor_vel(model, data)
        _mj_fwd_actuation(model, data)
    _mj_fwd_acceleration(model, data)
    if turning:
        _turn_by_added_mass(model, data, a.hulls, a.qpos, a.qvel, a.qacc_smooth, a.xfrc_applied)
    _mj_fwd_constraint(model, data)
    if not idle:
        _mj_sensor_acc(model, data)
    _mj_euler(model, data)


@expanded_kernel
def _inertia_of_water(hull: Record, body: Motion, a: Views, work: Work, added: FloatArray) -> None:
    """Write a hull's added mass into `added`, (6, 6)."""
    if work is not None and hull.vessel >= 0:
        added_inertia_of_vessel(a.vessels[hull.vessel], body, added)
        return
    added_inertia(hull, body, added)


@kernel
def _any_turns_by_added_mass(hulls: Table) -> bool:
    """Whether any hull has an `added_moment`."""
    found = False
    for i in range(hulls.size):
        found = found or has_added_moment(hulls[i])
    return found


@allocating_kernel
def _turn_by_added_mass(
    model: _Address, data: _Address, hulls: Table, qpos: FloatArray, qvel: FloatArray, qacc_smooth: FloatArray,
    xfrc_applied: FloatArray,
) -> None:  # fmt: skip
    """Turn hulls by their `added_moment`, at the accelerations that they have with it.

    These are found by substitution: each pass leaves the share c^2 A / I of the error, a few hundredths for a boat.
    A hull whose moment is settled keeps it, however long others take: it moves as if it were alone.
    """
    moments = np.zeros((hulls.size, 3))
    for _ in range(_MAX_PASSES):
        moving = False
        for i in range(hulls.size):
            hull, dof = hulls[i], hulls[i].dof
            if has_added_moment(hull):
                acceleration = qacc_smooth[dof], qacc_smooth[dof + 1], qacc_smooth[dof + 2]
                x, y, z = added_moment(hull, motion(qpos, qvel, hull.qpos, dof), acceleration)
                more = Wrench(0.0, 0.0, 0.0, x - moments[i, 0], y - moments[i, 1], z - moments[i, 2])
                if max(abs(more.tx), abs(more.ty), abs(more.tz)) >= _MOMENT_TOLERANCE:
                    _apply_more(xfrc_applied, hull.body, more)
                    moments[i, 0], moments[i, 1], moments[i, 2] = x, y, z
                    moving = True
        if not moving:
            return
        _mj_fwd_acceleration(model, data)


@inlined_kernel
def _push_floats(a: Views, work: Work, waves: Waves, air: Air, damping: FloatArray, time: float, dt: float) -> None:
    """Push all floating objects by water, wind and their own strength."""
    for i in range(a.floats.size):
        apply_wrench(a.xfrc_applied, a.floats[i].body, _floating(i, a, work, waves, air, damping[i], time, dt))
    if work is not None:
        for i in range(a.ropes.size):
            rope = a.ropes[i]
            item = a.floats[rope.float]
            pull = rope_pull(rope, item, motion(a.qpos, a.qvel, item.qpos, item.dof), dt, damping[rope.float])
            _apply_more(a.xfrc_applied, item.body, pull)


@inlined_kernel
def _push_links(a: Views, work: Work, waves: Waves, air: Air, damping: FloatArray, time: float, dt: float) -> None:
    """Push the links of objects that have joints by water and wind; a row of `damping` after those of the floats."""
    for i in range(a.links.size):
        item, own = a.links[i], damping[a.floats.size + i]
        center = a.subtree_com[a.body_root[item.body]]
        body = link_motion(a.xpos[item.body], a.xmat[item.body], item.dof, a.dof_parent, a.cdof, center, a.qvel)
        load = wind_on_float(item, body, air)
        found = _flotation_of(item, a.link_state[i], body, a, work, waves, load, time, dt, 0.0)
        own[0], own[1], own[2] = dt * found.sums.k, dt * found.sums.kz, dt * found.sums.kappa
        if item.qpos >= 0:  # what the float of the same body does is already there
            _apply_more(a.xfrc_applied, item.body, add(load, found.wrench))
        else:
            apply_wrench(a.xfrc_applied, item.body, add(load, found.wrench))


@inlined_kernel
def _push_docks(a: Views, work: Work, waves: Waves, air: Air, time: float, dt: float) -> None:
    """Push the blocks of floating docks by water and wind, and pull them by their moorings."""
    stream = None if work is None else current_velocity(a.current, a.current_state, a.layers, 0.0, time)
    for i in range(a.blocks.size):
        apply_wrench(a.xfrc_applied, a.blocks[i].body, block_load(i, a, waves, stream, air, time, dt))
    for i in range(a.moorings.size):
        line = a.moorings[i]
        _apply_more(a.xfrc_applied, a.blocks[line.block].body, moor(line, a.blocks, a.raft_work, dt))


@expanded_kernel
def _floating(
    index: int, a: Views, work: Work, waves: Waves, air: Air, damping: FloatArray, time: float, dt: float
) -> Wrench:
    """Wrench of water, wind and its own strength on what floats, about its centre of mass; zero on what is held."""
    item, state = a.floats[index], a.float_state[index]
    if state.held != 0:
        damping[:] = 0.0
        return zero_wrench()
    body = motion(a.qpos, a.qvel, item.qpos, item.dof)
    load = wind_on_float(item, body, air)
    if item.follower >= 0:
        follower = a.followers[item.follower]
        load = add(load, follow(follower, a.waypoints, a.follower_state[item.follower], item.com, body))
    found = _flotation_of(item, state, body, a, work, waves, load, time, dt, dt)
    return add(load, flotation_of_step(item, body, found, dt, damping))


@expanded_kernel
def _flotation_of(
    item: Record, state: Record, body: Motion, a: Views, work: Work, waves: Waves, load: Wrench,
    time: float, dt: float, ahead: float,
) -> Flotation:  # fmt: skip
    """Buoyancy and drag of what floats, `ahead` [s] from now as a free body; `load` is all else on it but weight."""
    if work is not None and item.profile == MARINE:
        height = surface_height(waves, a.sea[0], body.x, body.y, time)
        east, north = current_velocity(a.current, a.current_state, a.layers, a.sea[0].level - body.z, time)
        past = half_step_back(body, (0.0, 0.0, 0.0), -dt)
        water = orbital_motion(waves, a.sea[0], body.x, body.y, body.z, time, past=past)
        return flotation_in_waves(item, a.elements, body, height, (east, north, 0.0), water, ahead, load)
    if item.profile == VRX3:
        water_at_elements(item, a.elements, a.element_state, body, waves, a.sea[0], time, dt, a.own_waves)
        return flotation(item, a.elements, a.element_state, body, 0.0, 0.0, ahead, load)
    height = surface_height(waves, a.sea[0], body.x, body.y, time, a.own_waves)
    rise = water_rise(state, height, dt)
    return flotation(item, a.elements, None, body, height, rise, ahead, load)


@kernel
def _apply_more(xfrc_applied: FloatArray, body: int, wrench: Wrench) -> None:
    """Add a wrench about a body's centre of mass to its row of `xfrc_applied`."""
    row = xfrc_applied[body]
    for k in range(6):
        row[k] += wrench[k]


@kernel
def _add_to_inertia(inertia: FloatArray, inertia_row: IntArray, dof: int, added: FloatArray) -> None:
    """Add a symmetric (6, 6) to the block of a free joint at `dof` in MuJoCo's sparse lower inertia.

    A row holds its ancestors' columns in order, and a free joint at the root has none but its own.
    """
    for i in range(6):
        start = inertia_row[dof + i]
        for j in range(i + 1):
            inertia[start + j] += added[i, j]


@kernel
def _note_touches(sensordata: FloatArray, touches: FloatArray, time: float) -> None:
    """Keep in `touches` the time [s] of the last contact that each of MuJoCo's contact sensors found."""
    for i in range(touches.size):
        if sensordata[i] > 0.0:
            touches[i] = time


@kernel
def _has_diverged(qpos: FloatArray, qvel: FloatArray) -> bool:
    """Whether any coordinate or velocity is NaN or beyond `MAX_STATE`."""
    fine = True
    for value in qpos:
        fine &= abs(value) < MAX_STATE
    for value in qvel:
        fine &= abs(value) < MAX_STATE
    return not fine


@kernel
def _full(sampling: IntArray, samples: FloatArray) -> bool:
    """Whether the buffer is full."""
    return bool(sampling[STRIDE] > 0 and sampling[FILLED] == samples.shape[0])


@inlined_kernel
def _sample(a: Views, time: float) -> None:
    """Copy a row [time, wind speed, thrusts, steering angles, qpos, qvel, device state, wind angle] if one is due.

    Of the device state it has the last numbers, as many as there is room for: those of lights and placards.
    """
    sampling = a.sampling
    if sampling[STRIDE] == 0:
        return
    if sampling[COUNTDOWN] > 0:
        sampling[COUNTDOWN] -= 1
        return
    sampling[COUNTDOWN] = sampling[STRIDE] - 1
    row = a.samples[sampling[FILLED]]
    sampling[FILLED] += 1
    row[0], row[1] = time, a.wind_state[0].speed
    count = a.thruster_state.size
    for k in range(count):
        row[2 + k], row[2 + count + k] = a.thruster_state[k].thrust, a.thruster_state[k].angle
    start = 2 + 2 * count
    for k in range(a.qpos.size):
        row[start + k] = a.qpos[k]
    for k in range(a.qvel.size):
        row[start + a.qpos.size + k] = a.qvel[k]
    end = start + a.qpos.size + a.qvel.size
    marks = row.size - end - a.air_state.size
    for k in range(marks):
        row[end + k] = a.device_state[a.device_state.size - marks + k]
    for k in range(a.air_state.size):
        row[end + marks + k] = a.air_state[k].angle
