"""Worlds of free bodies alone, which rows of a batch step without MuJoCo while nothing can touch anything."""

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.physics.drag import has_added_moment
from vrx_mj.physics.free_body import FREE_BODY, free_body_row
from vrx_mj.physics.tables import Record, Table
from vrx_mj.runtime.loop_arrays import LoopArrays


def check_free(arrays: LoopArrays, name: str) -> None:
    """Check that all that moves in a world are single free bodies.

    Raises:
        CommandError: something is held by joints or to something else.
    """
    model = arrays.contact_free
    driven = model.body_gravcomp.any() or model.opt.density or model.opt.viscosity or model.dof_damping.any()
    known = 6 * (len(arrays.hulls) + len(arrays.floats))
    why = None
    if hinged := int((arrays.thrusters["dof"] >= 0).sum()):
        why = f"{hinged} engines of world {name} turn on hinges; give the fleet `engines: fixed`"
    elif len(arrays.blocks):
        why = f"world {name} has a floating dock; make it `dynamic: false`"
    elif len(arrays.links) or (model.jnt_type != mujoco.mjtJoint.mjJNT_FREE).any():
        why = f"things in world {name} have joints; leave them out"
    elif known != model.nv or driven or not arrays.broadphase["unconstrained"].all():
        why = f"MuJoCo holds, drives or pushes something in world {name}; leave it out"
    if why:
        raise CommandError(f'engine free: {why}, or use engine="mujoco"')


def free_bodies(arrays: LoopArrays, model: mujoco.MjModel, hulls: Table, vessels: Table) -> Table:
    """Everything that moves as a row of FREE_BODY: hulls, then what floats.

    Args:
        arrays: the world's; MuJoCo's addresses are from there.
        model: with the masses.
        hulls: with the added masses.
        vessels: with those of hulls that have a model.
    """
    data = mujoco.MjData(model)
    data.qpos.reshape(-1, 7)[:, 3:] = 1.0, 0.0, 0.0, 0.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_makeM(model, data)
    whole = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, whole)
    gravity, rows = -float(model.opt.gravity[2]), []
    for number, item in enumerate([*hulls, *arrays.floats]):
        body, dof, row = int(item["body"]), int(item["dof"]), number - len(hulls)
        rigid = whole[dof : dof + 6, dof : dof + 6]
        added = _added(item, vessels) if row < 0 else np.zeros((6, 6))
        columns = {"body": body, "qpos": item["qpos"], "dof": dof, "float": max(row, -1)}
        weight, pushed = gravity * rigid[0, 0], model.body_ipos[body]
        rows.append(free_body_row(rigid, added, weight=weight, pushed=pushed, **columns))
    return np.concatenate([np.zeros(0, FREE_BODY), *rows])


def _added(hull: Record, vessels: Table) -> FloatArray:
    """What water adds to the mass of a hull, (6, 6), with the moment -c x A a of VRX's."""
    if hull["vessel"] >= 0:
        return np.array(vessels[hull["vessel"]]["added_mass"])
    added = np.diag(hull["added_mass"])
    if has_added_moment(hull):
        added[3:, :3] = np.cross(hull["link_com"], added[:3, :3], axisb=0, axisc=0)
    return added
