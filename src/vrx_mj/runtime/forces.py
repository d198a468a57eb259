"""Forces on a boat by effect: the loop's own push of its hull, on copies of what that changes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import rotation_matrix
from vrx_mj.physics.drag import added_inertia, added_inertia_of_vessel
from vrx_mj.physics.motion import Motion, Wrench, add, from_origin, motion, rotate, shift, zero_wrench
from vrx_mj.physics.sail import along_blade
from vrx_mj.physics.tables import RUDDER, SAIL, VRX3, Record, Table
from vrx_mj.physics.thrust import thruster_wrench
from vrx_mj.runtime.effects import EFFECTS, Hulls, hull_loads, hull_loads_vrx
from vrx_mj.runtime.loop_arrays import LoopArrays, Run
from vrx_mj.runtime.views import ARRAYS, STATE

_ANGLE_EFFECTS = {RUDDER: "rudder", SAIL: "sail"}
"""Effects of what takes an angle alone, by its mapping; all others are thrust."""
_APPLIED_ARRAYS = ("xfrc_applied", "qfrc_applied")
"""Arrays of MuJoCo's data that the push of a hull writes."""


class Forces(dict[str, FloatArray]):
    """Name of an effect -> (6,): force [N] and torque [N m], world axes, about the boat's centre of mass."""

    def __init__(
        self, outside: Mapping[str, FloatArray], inertial: Mapping[str, FloatArray], center: FloatArray
    ) -> None:
        super().__init__(outside)
        self.center = center
        """Place of the centre of mass (3,) [m], world frame."""
        self.inertial = dict(inertial)
        """Effects of the boat's own acceleration, which act like more mass."""

    @property
    def total(self) -> FloatArray:
        """Sum of all that acts from outside, (6,)."""
        total: FloatArray = np.sum(list(self.values()), axis=0)
        return total


class RunCopy:
    """A copy of a run, whose steps leave the run itself as it is."""

    def __init__(self, arrays: LoopArrays) -> None:
        named = arrays.by_name(np.zeros(3, np.int64), np.zeros((0, 0)))
        changed = [name for name in named if ARRAYS[name].use == STATE or name in _APPLIED_ARRAYS]
        self._own, self._copies = named, {name: named[name].copy() for name in changed}
        self._run = Run(arrays.model, arrays.contact_free, arrays.data).lead_to(named | self._copies)

    def fresh(self) -> tuple[Run, dict[str, npt.NDArray[Any]]]:
        """The copy in the present state, and its arrays that a step changes, by name."""
        for name, copy in self._copies.items():
            copy[...] = self._own[name]
        return self._run, self._copies


def boat_forces(arrays: LoopArrays, run_copy: RunCopy, index: int, time: float) -> Forces:
    """The wrenches that the step from `time` [s] applies to the boat of row `index`."""
    hull = arrays.hulls[index]
    body = motion(arrays.data.qpos, arrays.data.qvel, int(hull["qpos"]), int(hull["dof"]))
    mass, center = _boat_center(arrays, hull, body)
    lever, place = tuple(rotate(body, hull["link_com"]) - center), center + np.array(body[:3])

    def about_center(wrench: Wrench) -> FloatArray:
        return np.array(shift(wrench, lever))

    run, copies = run_copy.fresh()
    loads, step = np.zeros((len(EFFECTS), 6)), arrays.timestep
    (hull_loads_vrx if arrays.vrx_only else hull_loads)(run.table, index, time + step, step, loads)
    kind = Hulls.STATIONS if hull["vessel"] < 0 else Hulls.VESSELS
    acting = {
        effect.name: Wrench(*row) for effect, row in zip(EFFECTS, loads.tolist(), strict=True) if effect.hulls & kind
    }
    bias = acting.pop("added_mass_bias")
    acting |= _thrusts(arrays, hull, body, copies["thruster_state"])
    outside = {
        "gravity": mass * np.array([*arrays.model.opt.gravity, 0.0, 0.0, 0.0]),
        **{name: about_center(wrench) for name, wrench in acting.items()},
        "contact": _contacts(arrays, int(hull["body"]), place),
    }
    return Forces(outside, {"added_mass": about_center(_added_mass(arrays, hull, body, bias))}, place)


def _thrusts(arrays: LoopArrays, hull: Record, body: Motion, states: Table) -> dict[str, Wrench]:
    """Wrenches of the thrusters, and of the rudders and sails if there are any, about `link_com`."""
    wrenches = {"thrust": zero_wrench()}
    start = int(hull["thruster_start"])
    for row in range(start, start + int(hull["thruster_count"])):
        thruster, state = arrays.thrusters[row], states[row]
        name = _ANGLE_EFFECTS.get(int(thruster["mapping"]), "thrust")
        along = along_blade(thruster, state)
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
    return total, np.array(rotate(body, moment / total))


def _added_mass(arrays: LoopArrays, hull: Record, body: Motion, bias: Wrench) -> Wrench:
    """Reaction of the added mass to the acceleration of the last step and, at none, `bias`, about `link_com`."""
    matrix = np.zeros((6, 6))
    if hull["vessel"] >= 0:
        added_inertia_of_vessel(arrays.vessels[hull["vessel"]], body, matrix)
    else:
        added_inertia(hull, body, matrix)
    dof = int(hull["dof"])
    reaction = -(matrix @ arrays.data.qacc[dof : dof + 6])
    wrench = Wrench(*reaction[:3], *np.array(rotate(body, reaction[3:])))
    about_origin = hull["profile"] == VRX3 or hull["vessel"] >= 0
    return add(from_origin(wrench, body, hull["link_com"]) if about_origin else wrench, bias)


def _contacts(arrays: LoopArrays, root: int, center: FloatArray) -> FloatArray:
    """Sum of the contact forces of the last step on the boat's bodies, about `center` [m, world]."""
    total = np.zeros(6)
    model, data = arrays.model, arrays.data
    for number in range(data.ncon):
        contact = data.contact[number]
        roots = [int(model.body_rootid[model.geom_bodyid[geom]]) for geom in contact.geom]
        sign = (roots[1] == root) - (roots[0] == root)
        if sign:
            force, torque = arrays.contact_load(number)
            total += sign * np.concatenate((force, torque + np.cross(contact.pos - center, force)))
    return total
