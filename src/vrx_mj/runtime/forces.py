"""What acts on a boat, effect by effect: the kernels of the loop, called once to look at them."""

from collections.abc import Mapping

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import rotation_matrix
from vrx_mj.physics.added_mass import added_inertia_of_vessel
from vrx_mj.physics.current import current_step
from vrx_mj.physics.drag import added_inertia
from vrx_mj.physics.motion import Motion, Wrench, add, from_origin, motion, shift, zero_wrench
from vrx_mj.physics.propeller import update_propeller
from vrx_mj.physics.tables import MARINE, RUDDER, SAIL, VRX3, Record, Table
from vrx_mj.physics.thrust import servo_step, thruster_wrench
from vrx_mj.physics.vessel import vessel_loads, vessel_work, wave_loads
from vrx_mj.physics.wind import air_velocity, wind_at_hull, wind_on_hull, wind_step
from vrx_mj.runtime.loop import angle_target, hull_loads, motion_through_water, update_force, water_at_vessel
from vrx_mj.runtime.loop_arrays import LoopArrays

_NAMES = {RUDDER: "rudder", SAIL: "sail"}
"""Effects of what takes an angle alone, by its mapping; all others are thrust."""


class Forces(dict[str, FloatArray]):
    """Name of an effect -> (6,): force [N] and torque [N m], world axes, about the boat's centre of mass."""

    def __init__(self, outside: Mapping[str, FloatArray], inertial: Mapping[str, FloatArray]) -> None:
        super().__init__(outside)
        self.inertial = dict(inertial)
        """Effects of the boat's own acceleration, which act like more mass."""

    @property
    def total(self) -> FloatArray:
        """(6,): the sum of all that acts from outside."""
        total: FloatArray = np.sum(list(self.values()), axis=0)
        return total


def boat_forces(arrays: LoopArrays, index: int, time: float) -> Forces:
    """The wrenches that the step from `time` [s] applies to the boat of row `index`."""
    hull, body = arrays.hulls[index], motion(arrays.data.qpos, arrays.data.qvel, *_address(arrays, index))
    then = time + arrays.timestep
    mass, center = _boat_center(arrays, hull, body)
    lever = tuple(_turned(body, hull["link_com"]) - center)

    def about_center(wrench: Wrench) -> FloatArray:
        return np.array(shift(wrench, lever))

    gusts, turned = arrays.wind_state.copy(), arrays.air_state.copy()
    wind_step(arrays.wind[0], gusts[0], arrays.gust_bands, arrays.air, turned, arrays.timestep)
    air = air_velocity(arrays.wind[0], gusts[0], turned)
    stream = arrays.current_state.copy()
    if len(stream):
        current_step(arrays.current, stream, arrays.timestep)
    loads = _loads(arrays, hull, body, air, stream, then)
    outside = {
        "gravity": mass * np.array([*arrays.model.opt.gravity, 0.0, 0.0, 0.0]),
        **{name: about_center(wrench) for name, wrench in loads.items() if name != "added_mass_bias"},
        **{name: about_center(wrench) for name, wrench in _thrusts(arrays, hull, body, air, stream, then).items()},
        "contact": _contacts(arrays, int(hull["body"]), center + np.array(body[:3])),
    }
    return Forces(outside, {"added_mass": about_center(_added_mass(arrays, hull, body, loads["added_mass_bias"]))})


def _loads(
    arrays: LoopArrays, hull: Record, body: Motion, air: tuple[float, float], stream: Table, time: float
) -> dict[str, Wrench]:
    """What water and wind do to a boat, about `link_com`; `stream` is the current's state."""
    here, weather = wind_at_hull(hull, arrays.air, air), (arrays.waves, arrays.sea[0])
    if hull["profile"] != MARINE:
        return hull_loads(hull, arrays.stations, arrays.windage, *weather, here, body, body, time)._asdict()
    moving = (*weather, arrays.current, stream, arrays.layers, time)
    if hull["vessel"] < 0:
        through = motion_through_water(hull, body, *moving)
        return hull_loads(hull, arrays.stations, arrays.windage, *weather, here, body, through, time)._asdict()
    vessel, meshes = arrays.vessels[hull["vessel"]], arrays.meshes
    work = vessel_work(meshes, *weather)
    afloat = water_at_vessel(hull, vessel, body, *moving)
    loads = vessel_loads(hull, vessel, meshes, arrays.strips, *weather, afloat, body, time, work)
    made = wave_loads(
        hull, vessel, arrays.memory, arrays.memory_state.copy(), arrays.diffraction, *weather, afloat, body,
        loads.wet, time, arrays.timestep,
    )  # fmt: skip
    pushed = loads._asdict()
    del pushed["wet"]
    return {**pushed, **made._asdict(), "wind": wind_on_hull(hull, arrays.windage, body, here)}


def _address(arrays: LoopArrays, index: int) -> tuple[int, int]:
    return int(arrays.hulls["qpos"][index]), int(arrays.hulls["dof"][index])


def _turned(body: Motion, vector: npt.ArrayLike) -> FloatArray:
    matrix = np.array(body[3:12]).reshape(3, 3)
    turned: FloatArray = matrix @ np.asarray(vector)
    return turned


def _thrusts(
    arrays: LoopArrays, hull: Record, body: Motion, air: tuple[float, float], stream: Table, time: float
) -> dict[str, Wrench]:
    """What the thrusters do, and the rudders and sails if there are any, about `link_com`."""
    wrenches = {"thrust": zero_wrench()}
    states, propellers = arrays.thruster_state.copy(), arrays.propeller_state.copy()
    start = int(hull["thruster_start"])
    for row in range(start, start + int(hull["thruster_count"])):
        thruster, state = arrays.thrusters[row], states[row]
        if thruster["dof"] < 0:
            target = angle_target(thruster, state, body, arrays.air, air)
            state["angle"], state["rate"] = servo_step(thruster, state["angle"], state["rate"], target, arrays.timestep)
        else:
            state["angle"] = arrays.data.qpos[thruster["qpos"]]
        if thruster["measured"] >= 0:
            update_propeller(
                hull, thruster, state, arrays.propellers, arrays.propeller_points, propellers, arrays.waves,
                arrays.sea[0], arrays.current, stream, arrays.layers, body, time, arrays.timestep,
            )  # fmt: skip
        else:
            update_force(hull, thruster, state, states, arrays.sail_curves, body, arrays.air, air, time)
        name = _NAMES.get(int(thruster["mapping"]), "thrust")
        along = state["applied"] if name == "sail" else 0.0
        push = thruster_wrench(thruster, hull, body, state["thrust"], state["angle"], along)
        wrenches[name] = add(wrenches.get(name, zero_wrench()), push)
    return wrenches


def _boat_center(arrays: LoopArrays, hull: Record, body: Motion) -> tuple[float, FloatArray]:
    """Mass [kg] of the whole boat, and the way [m] from its link's origin to its centre of mass, world axes."""
    mass = float(arrays.model.body_mass[hull["body"]])
    moment = mass * np.asarray(hull["body_com"])
    total = mass
    start = int(hull["thruster_start"])
    for row in range(start, start + int(hull["thruster_count"])):
        thruster = arrays.thrusters[row]
        if thruster["dof"] >= 0:
            engine = float(arrays.model.body_mass[thruster["body"]])
            half = 0.5 * float(arrays.data.qpos[thruster["qpos"]])
            turn = thruster["rotation"] @ rotation_matrix((np.cos(half), 0.0, 0.0, np.sin(half)))
            moment = moment + engine * (thruster["position"] + turn @ thruster["body_com"])
            total += engine
    return total, _turned(body, moment / total)


def _added_mass(arrays: LoopArrays, hull: Record, body: Motion, bias: Wrench) -> Wrench:
    """Reaction of the added mass to the acceleration of the last step, about `link_com`."""
    matrix = np.zeros((6, 6))
    if hull["vessel"] >= 0:
        added_inertia_of_vessel(arrays.vessels[hull["vessel"]], body, matrix)
    else:
        added_inertia(hull, body, matrix)
    dof = int(hull["dof"])
    reaction = -(matrix @ arrays.data.qacc[dof : dof + 6])
    wrench = Wrench(*(reaction[:3] + np.array(bias[:3])), *_turned(body, reaction[3:]))
    about_origin = hull["profile"] == VRX3 or hull["vessel"] >= 0
    return from_origin(wrench, body, hull["link_com"]) if about_origin else wrench


def _contacts(arrays: LoopArrays, root: int, center: FloatArray) -> FloatArray:
    """Sum of the contact forces of the last step on the boat's bodies, about `center` [m, world]."""
    total = np.zeros(6)
    model, data = arrays.model, arrays.data
    local = np.zeros(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        roots = [int(model.body_rootid[model.geom_bodyid[geom]]) for geom in contact.geom]
        sign = (roots[1] == root) - (roots[0] == root)
        if sign:
            mujoco.mj_contactForce(model, data, number, local)
            frame = contact.frame.reshape(3, 3)
            force, torque = frame.T @ local[:3], frame.T @ local[3:]
            total += sign * np.concatenate((force, torque + np.cross(contact.pos - center, force)))
    return total
