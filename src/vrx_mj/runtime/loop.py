"""The compiled loop: the equation of motion of everything that floats.

For each physics step it reads `qpos` and `qvel`, adds up the wrench of every hull and of every floating object,
writes `xfrc_applied`, and has MuJoCo step. As in VRX the clock is advanced first: forces belong to the pose and
velocity that the last step left, and to the time at which this one ends.
"""

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.drag import added_inertia
from vrx_mj.physics.flotation import (
    add_flotation_drag,
    flotation,
    flotation_of_step,
    water_at_elements,
    water_rise,
)
from vrx_mj.physics.follow import follow
from vrx_mj.physics.hydrostatics import hydrostatics
from vrx_mj.physics.kernel import allocating_kernel, kernel
from vrx_mj.physics.motion import Motion, Wrench, add, carry, motion, zero_wrench
from vrx_mj.physics.profiles import bias_on_hull, drag_on_hull, wind_on_float, wind_on_hull
from vrx_mj.physics.raft import block_load, moor, raft_drag
from vrx_mj.physics.rudder import rudder_force
from vrx_mj.physics.tables import RUDDER, VRX3, Record, Table
from vrx_mj.physics.thrust import (
    effective_command,
    engine_wrench,
    servo_step,
    servo_torque,
    steering_target,
    thrust_force,
    thruster_wrench,
)
from vrx_mj.physics.waves import surface_height
from vrx_mj.physics.wind import gust_step, wind_velocity
from vrx_mj.runtime import engine
from vrx_mj.runtime.moments import capture
from vrx_mj.runtime.proximity import apart, touch_begins
from vrx_mj.runtime.without_refcount import without_refcount

__all__ = ["HUGE", "advance"]

HUGE = 1e7
"""A state beyond this [m, m/s, rad/s] has diverged."""

_STRIDE, _COUNTDOWN, _FILLED = 0, 1, 2

mj_fwd_kinematics, mj_make_m, mj_factor_m = engine.mj_fwd_kinematics, engine.mj_make_m, engine.mj_factor_m
mj_collision, mj_make_constraint, mj_island = engine.mj_collision, engine.mj_make_constraint, engine.mj_island
mj_project_constraint, mj_transmission = engine.mj_project_constraint, engine.mj_transmission
mj_sensor_pos, mj_sensor_vel, mj_sensor_acc = engine.mj_sensor_pos, engine.mj_sensor_vel, engine.mj_sensor_acc
mj_fwd_velocity, mj_fwd_actuation = engine.mj_fwd_velocity, engine.mj_fwd_actuation
mj_fwd_acceleration, mj_fwd_constraint = engine.mj_fwd_acceleration, engine.mj_fwd_constraint
mj_euler, mj_kinematics = engine.mj_euler, engine.mj_kinematics

Address = int


# fmt: off
@allocating_kernel
def advance(
    model: Address, quiet: Address, data: Address, qpos: FloatArray, qvel: FloatArray, xfrc_applied: FloatArray,
    qfrc_applied: FloatArray, qfrc_constraint: FloatArray, inertia: FloatArray, inertia_row: IntArray, sea: Table,
    waves: Table, wind: Table, wind_state: Table, hulls: Table, stations: Table, thrusters: Table,
    thruster_state: Table, floats: Table, elements: Table, float_state: Table, element_state: Table, followers: Table,
    waypoints: Table, follower_state: Table, blocks: Table, block_state: Table, raft_work: Table, moorings: Table,
    movers: Table, obstacles: Table, look: Table, clocks: Table, moments: FloatArray, marks: FloatArray,
    contacts: FloatArray, touches: FloatArray, sampling: IntArray, samples: FloatArray, time: float, dt: float,
    steps: int,
) -> int:
    """Advance `steps` physics steps of `dt` [s] from simulated `time` [s].

    `quiet` is the model without shapes, which steps while nothing can touch anything. Returns the number of steps
    done: fewer when the sample buffer is full or a touch has begun, -1 when the state has diverged.
    """
    (qpos, qvel, xfrc_applied, qfrc_applied, qfrc_constraint, inertia, inertia_row, sea, waves, wind, wind_state, hulls,
     stations, thrusters, thruster_state, floats, elements, float_state, element_state, followers, waypoints,
     follower_state, blocks, block_state, raft_work, moorings, movers, obstacles, look, clocks, moments, marks,
     contacts, touches, sampling, samples) = without_refcount((qpos, qvel, xfrc_applied, qfrc_applied, qfrc_constraint,
     inertia, inertia_row, sea, waves, wind, wind_state, hulls, stations, thrusters, thruster_state, floats, elements,
     float_state, element_state, followers, waypoints, follower_state, blocks, block_state, raft_work, moorings, movers,
     obstacles, look, clocks, moments, marks, contacts, touches, sampling, samples))
    added, damping, done, quiet_before, touched = np.empty((6, 6)), np.empty((floats.size, 3)), 0, False, False
    while done < steps and not touched and not full(sampling, samples) and not diverged(qpos, qvel):
        sample(qpos, qvel, marks, wind_state, thruster_state, sampling, samples, time)
        capture(clocks, moments, qpos, qvel, marks, time)
        time += dt
        gust_step(wind[0], wind_state[0], dt)
        air = wind_velocity(wind[0], wind_state[0])
        push_hulls(hulls, stations, thrusters, thruster_state, waves, sea[0], air,
                   qpos, qvel, xfrc_applied, qfrc_applied, time, dt)
        push_floats(floats, elements, float_state, element_state, followers, waypoints, follower_state,
                    waves, sea[0], air, qpos, qvel, xfrc_applied, damping, time, dt)
        push_docks(blocks, block_state, raft_work, moorings, elements, element_state, waves, sea[0], air,
                   qpos, qvel, xfrc_applied, time, dt)
        alone = apart(movers, obstacles, qpos, look[0])
        idle = alone and quiet_before and look[0].unbound != 0  # the step before found nothing, nor would this one
        move(quiet if alone else model, data, qpos, qvel, inertia, inertia_row, hulls, added, floats, damping, blocks,
             raft_work, idle)
        quiet_before = alone
        note_touches(contacts, touches, time - dt)
        touched = touch_begins(look[0], alone, hulls, qfrc_constraint)
        done += 1
    mj_kinematics(model, data)
    return -1 if diverged(qpos, qvel) else done
# fmt: on


@kernel
def push_hulls(
    hulls: Table, stations: Table, thrusters: Table, thruster_state: Table,
    waves: Table, sea: Record, air: tuple[float, float],
    qpos: FloatArray, qvel: FloatArray, xfrc_applied: FloatArray, qfrc_applied: FloatArray, time: float, dt: float,
) -> None:  # fmt: skip
    """Let water, wind and their thrusters push all hulls."""
    for i in range(hulls.size):
        hull = hulls[i]
        body = motion(qpos, qvel, hull.qpos, hull.dof)
        wrench = load_on_hull(hull, stations, waves, sea, air, body, time)
        push = thrust(hull, body, thrusters, thruster_state, qpos, qvel, xfrc_applied, qfrc_applied, time, dt)
        apply(xfrc_applied, hull.body, carry(add(wrench, push), body, hull.link_com, hull.body_com))


@kernel
def load_on_hull(
    hull: Record, stations: Table, waves: Table, sea: Record, air: tuple[float, float], body: Motion, time: float
) -> Wrench:
    """Wrench of water and wind on a hull, about `link_com`; with `thrust` all that acts on it from outside."""
    wrench = hydrostatics(hull, stations, waves, sea, body, time)
    wrench = add(wrench, drag_on_hull(hull, body))
    wrench = add(wrench, bias_on_hull(hull, body))
    return add(wrench, wind_on_hull(hull, body, air))


@kernel
def move(
    model: Address, data: Address,
    qpos: FloatArray, qvel: FloatArray, inertia: FloatArray, inertia_row: IntArray, hulls: Table, added: FloatArray,
    floats: Table, damping: FloatArray, blocks: Table, raft_work: Table, idle: bool,
) -> None:  # fmt: skip
    """`mj_step`, stage by stage, with the hulls' added mass and the floats' and docks' drag put into the inertia.

    Its checks are left out: they write warnings to a file, and `diverged` tells more. So are, while they are `idle`,
    the stages about constraints, actuators and sensors, an eighth of a boat's step.
    """
    mj_fwd_kinematics(model, data)
    mj_make_m(model, data)
    for i in range(hulls.size):
        hull = hulls[i]
        added_inertia(hull, motion(qpos, qvel, hull.qpos, hull.dof), added)
        add_to_inertia(inertia, inertia_row, hull.dof, added)
    for i in range(floats.size):
        add_flotation_drag(inertia, inertia_row, floats[i].dof, damping[i])
    raft_drag(blocks, raft_work, inertia, inertia_row)
    mj_factor_m(model, data)
    if not idle:
        mj_collision(model, data)
        mj_make_constraint(model, data)
        mj_island(model, data)
        mj_project_constraint(model, data)
        mj_transmission(model, data)
        mj_sensor_pos(model, data)
    mj_fwd_velocity(model, data)
    if not idle:
        mj_sensor_vel(model, data)
        mj_fwd_actuation(model, data)
    mj_fwd_acceleration(model, data)
    mj_fwd_constraint(model, data)
    if not idle:
        mj_sensor_acc(model, data)
    mj_euler(model, data)


@kernel
def thrust(
    hull: Record, body: Motion, thrusters: Table, state: Table,
    qpos: FloatArray, qvel: FloatArray, xfrc_applied: FloatArray, qfrc_applied: FloatArray, time: float, dt: float,
) -> Wrench:  # fmt: skip
    """Steer the hull's engines and rudders and push with them; returns the wrench on the hull about `link_com`.

    A hinged engine is pushed itself, and steered through its joint; the hull feels it through the hinge.
    """
    wrench = zero_wrench()
    for k in range(hull.thruster_start, hull.thruster_start + hull.thruster_count):
        thruster, own = thrusters[k], state[k]
        target = steering_target(thruster, own.angle_target)
        if thruster.dof >= 0:
            own.angle, own.rate = qpos[thruster.qpos], qvel[thruster.dof]
            qfrc_applied[thruster.dof] = servo_torque(thruster, own.angle, own.rate, target, dt)
        elif own.angle != target or own.rate != 0.0:
            own.angle, own.rate = servo_step(thruster, own.angle, own.rate, target, dt)
        update_force(thruster, own, state, body, time)
        if thruster.dof >= 0:
            apply(xfrc_applied, thruster.body, engine_wrench(thruster, body, own.thrust, own.angle))
        else:
            wrench = add(wrench, thruster_wrench(thruster, hull, body, own.thrust, own.angle))
    return wrench


@kernel
def update_force(thruster: Record, own: Record, state: Table, body: Motion, time: float) -> None:
    """Bring a thruster's or rudder's force [N] up to date; a propeller's comes before its rudder's."""
    if thruster.mapping == RUDDER:
        race = state[thruster.race].thrust if thruster.race >= 0 else 0.0
        own.thrust = rudder_force(thruster, body, own.angle, race)
        return
    command = effective_command(own, time)
    if command != own.applied or own.fresh == 0:
        own.applied, own.thrust, own.fresh = command, thruster.gain * thrust_force(thruster, command), 1


@kernel
def push_floats(
    floats: Table, elements: Table, float_state: Table, element_state: Table,
    followers: Table, waypoints: Table, follower_state: Table,
    waves: Table, sea: Record, air: tuple[float, float],
    qpos: FloatArray, qvel: FloatArray, xfrc_applied: FloatArray, damping: FloatArray, time: float, dt: float,
) -> None:  # fmt: skip
    """Let water, wind and their own strength push all floating objects."""
    for i in range(floats.size):
        wrench = floating(
            floats[i], elements, float_state[i], element_state, followers, waypoints, follower_state,
            waves, sea, air, qpos, qvel, damping[i], time, dt,
        )  # fmt: skip
        apply(xfrc_applied, floats[i].body, wrench)


@kernel
def push_docks(
    blocks: Table, block_state: Table, raft_work: Table, moorings: Table, elements: Table, element_state: Table,
    waves: Table, sea: Record, air: tuple[float, float],
    qpos: FloatArray, qvel: FloatArray, xfrc_applied: FloatArray, time: float, dt: float,
) -> None:  # fmt: skip
    """Let water and wind push the blocks of floating docks, and their moorings pull."""
    for i in range(blocks.size):
        wrench = block_load(
            i, blocks, raft_work, elements, element_state, block_state, waves, sea, air, qpos, qvel, time, dt
        )
        apply(xfrc_applied, blocks[i].body, wrench)
    for i in range(moorings.size):
        line = moorings[i]
        apply_more(xfrc_applied, blocks[line.block].body, moor(line, blocks, raft_work, dt))


@kernel
def floating(
    item: Record, elements: Table, state: Record, water: Table,
    followers: Table, waypoints: Table, follower_state: Table,
    waves: Table, sea: Record, air: tuple[float, float],
    qpos: FloatArray, qvel: FloatArray, damping: FloatArray, time: float, dt: float,
) -> Wrench:  # fmt: skip
    """Wrench of water, wind and its own strength on what floats, about its centre of mass; none on what is held."""
    if state.held != 0:
        damping[:] = 0.0
        return zero_wrench()
    body = motion(qpos, qvel, item.qpos, item.dof)
    load = wind_on_float(item, body, air)
    if item.follower >= 0:
        load = add(load, follow(followers[item.follower], waypoints, follower_state[item.follower], item.com, body))
    if item.profile == VRX3:
        water_at_elements(item, elements, water, body, waves, sea, time, dt)
        found = flotation(item, elements, water, body, 0.0, 0.0, dt, load)
    else:
        height = surface_height(waves, sea, body.x, body.y, time)
        rise = water_rise(state, height, dt)
        found = flotation(item, elements, None, body, height, rise, dt, load)
    return add(load, flotation_of_step(item, body, found, dt, damping))


@kernel
def apply(xfrc_applied: FloatArray, body: int, wrench: Wrench) -> None:
    """Write a wrench about a body's centre of mass into its row of `xfrc_applied`."""
    row = xfrc_applied[body]
    row[0], row[1], row[2] = wrench.fx, wrench.fy, wrench.fz
    row[3], row[4], row[5] = wrench.tx, wrench.ty, wrench.tz


@kernel
def apply_more(xfrc_applied: FloatArray, body: int, wrench: Wrench) -> None:
    """Add a wrench about a body's centre of mass to its row of `xfrc_applied`."""
    row = xfrc_applied[body]
    for k in range(6):
        row[k] += wrench[k]


@kernel
def add_to_inertia(inertia: FloatArray, inertia_row: IntArray, dof: int, added: FloatArray) -> None:
    """Add a symmetric (6, 6) to the block of a free joint at `dof` in MuJoCo's sparse lower inertia.

    A row holds its ancestors' columns in order, and a free joint at the root has none but its own.
    """
    for i in range(6):
        start = inertia_row[dof + i]
        for j in range(i + 1):
            inertia[start + j] += added[i, j]


@kernel
def note_touches(contacts: FloatArray, touches: FloatArray, time: float) -> None:
    """Keep in `touches` the time [s] of the last contact that each of MuJoCo's contact sensors found."""
    for i in range(touches.size):
        if contacts[i] > 0.0:
            touches[i] = time


@kernel
def diverged(qpos: FloatArray, qvel: FloatArray) -> bool:
    """Tell whether any coordinate or velocity is NaN or beyond `HUGE`."""
    fine = True
    for value in qpos:
        fine &= abs(value) < HUGE
    for value in qvel:
        fine &= abs(value) < HUGE
    return not fine


@kernel
def full(sampling: IntArray, samples: FloatArray) -> bool:
    """Tell whether there is no room for another row."""
    return bool(sampling[_STRIDE] > 0 and sampling[_FILLED] == samples.shape[0])


@kernel
def sample(
    qpos: FloatArray, qvel: FloatArray, marks: FloatArray, wind_state: Table, thruster_state: Table,
    sampling: IntArray, samples: FloatArray, time: float,
) -> None:  # fmt: skip
    """Copy a row [time, wind speed, thrusts, steering angles, qpos, qvel, marks] if one is due.

    Of the marks it has the last, as many as there is room for: those of lights and placards.
    """
    if sampling[_STRIDE] == 0:
        return
    if sampling[_COUNTDOWN] > 0:
        sampling[_COUNTDOWN] -= 1
        return
    sampling[_COUNTDOWN] = sampling[_STRIDE] - 1
    row = samples[sampling[_FILLED]]
    sampling[_FILLED] += 1
    row[0], row[1] = time, wind_state[0].speed
    count = thruster_state.size
    for k in range(count):
        row[2 + k], row[2 + count + k] = thruster_state[k].thrust, thruster_state[k].angle
    start = 2 + 2 * count
    for k in range(qpos.size):
        row[start + k] = qpos[k]
    for k in range(qvel.size):
        row[start + qpos.size + k] = qvel[k]
    end = start + qpos.size + qvel.size
    for k in range(row.size - end):
        row[end + k] = marks[marks.size - row.size + end + k]
