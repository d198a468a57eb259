"""Links on joints: how they move and what drag adds to the inertia, against MuJoCo's own velocities and Jacobians."""

import mujoco
import numpy as np
import pytest

from vrx_mj.physics.afloat import add_link_drag, link_motion
from vrx_mj.physics.motion import rotate

INERTIAL = '<inertial pos="0.1 0 0.2" mass="2" diaginertia="1 2 2.5"/>'
FLOATING = f"""
<mujoco><option jacobian="sparse"/><worldbody>
  <body name="root" pos="1 2 3"><freejoint align="false"/>{INERTIAL}
    <body name="arm" pos="0.3 -0.2 0.1" euler="10 20 30"><joint axis="1 2 3" pos="0 0.1 0"/>{INERTIAL}
      <body name="hand" pos="0 0 0.7"><joint axis="1 0 0"/><joint axis="0 1 0"/>{INERTIAL}</body>
      <body name="rail" pos="0 0.4 0"><joint type="slide" axis="0 1 1"/>{INERTIAL}</body>
    </body>
    <body name="ball" pos="-1 0 0"><joint type="ball" pos="0 0 0.2"/>{INERTIAL}</body>
  </body>
  <body name="post"><body name="boom" pos="0 0 2"><joint axis="0 1 0"/>{INERTIAL}</body></body>
</worldbody></mujoco>"""
LINKS = ("root", "arm", "hand", "rail", "ball", "boom")
DAMPING = np.array([3.0, 5.0, 0.7])


@pytest.fixture(scope="module")
def moving():
    """A model of all kinds of joints, and its data in a pose and a motion without any symmetry."""
    model = mujoco.MjModel.from_xml_string(FLOATING)
    data = mujoco.MjData(model)
    noise = np.random.default_rng(4)
    data.qpos[:] += noise.normal(size=model.nq)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    ball = int(model.joint(model.body("ball").jntadr[0]).qposadr[0])
    data.qpos[ball : ball + 4] /= np.linalg.norm(data.qpos[ball : ball + 4])
    data.qvel[:] = noise.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    return model, data


def tree(model, data, name):
    """Arguments of the kernels about a link: where it is, its last degree of freedom, and what MuJoCo knows of it."""
    body = model.body(name)
    dof = int(body.dofadr[0] + body.dofnum[0]) - 1
    return body.id, dof, data.subtree_com[body.rootid[0]]


@pytest.mark.parametrize("name", LINKS)
def test_a_link_moves_as_mujoco_says(moving, name):
    model, data = moving
    body, dof, center = tree(model, data, name)
    found = link_motion(data.xpos[body], data.xmat[body], dof, model.dof_parentid, data.cdof, center, data.qvel)
    expected = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, expected, 1)
    assert found[:3] == pytest.approx(data.xpos[body])
    assert rotate(found, (1.0, 2.0, 3.0)) == pytest.approx(data.xmat[body].reshape(3, 3) @ (1.0, 2.0, 3.0))
    assert found[12:] == pytest.approx([*expected[3:], *expected[:3]])


@pytest.mark.parametrize("name", LINKS)
def test_drag_is_taken_up_in_all_joints_that_carry_the_link(moving, name):
    """J^T diag(k, k, kz, kappa, kappa, kappa) J with the Jacobians of MuJoCo at the link's origin."""
    model, data = moving
    body, dof, center = tree(model, data, name)
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacBody(model, data, linear, angular, body)
    k, kz, kappa = DAMPING
    expected = linear.T @ np.diag([k, k, kz]) @ linear + kappa * angular.T @ angular
    before, after = np.zeros((model.nv, model.nv)), np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, before)
    add_link_drag(data.M, model.M_rowadr, data.xpos[body], dof, model.dof_parentid, data.cdof, center, DAMPING)
    mujoco.mj_fullM(model, data, after)
    assert after - before == pytest.approx(expected, abs=1e-12)
