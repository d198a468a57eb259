"""A robot as a model for MuJoCo's viewer, in which a control of each joint is its value."""

import math

import mujoco

from vrx_mj.formats.urdf.links import ENDLESS
from vrx_mj.formats.urdf.model import ZERO, Joint, Urdf
from vrx_mj.frames import quaternion
from vrx_mj.mjcf.templates import geoms, meshes

_MOVING = ("revolute", "continuous", "prismatic")
"""Types of joints that move here."""
_GREY = (0.6, 0.6, 0.6, 1.0)
"""Colour of a shape that collides, drawn where a link has none that is seen."""


def jointed_model(robot: Urdf) -> mujoco.MjModel:
    """The model of a robot with its joints at rest; links without visuals show what collides.

    Raises:
        CompileError: MuJoCo cannot use a mesh.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.modelname = robot.name
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (0.5,) * 3, (0.5,) * 3
    sky = spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=384)
    sky.builtin, sky.rgb1, sky.rgb2 = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, (0.8, 0.85, 0.9), (0.4, 0.45, 0.5)
    shapes = {name: link.visuals or link.collisions for name, link in robot.links.items()}
    for mesh in meshes(shape for seen in shapes.values() for shape in seen):
        spec.assets[mesh.file] = mesh.content
        inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.add_mesh(name=mesh.name, file=mesh.file, scale=mesh.scale, inertia=inertia)
    bodies: dict[str, mujoco.MjsBody] = {}
    for link in robot.below(robot.root):
        joint = robot.above.get(link)
        outer, pose = (bodies[joint.parent], joint.pose) if joint else (spec.worldbody, ZERO)
        body = outer.add_body(name=link, pos=pose[:3], quat=quaternion(*pose[3:]), mass=1.0, inertia=(1.0, 1.0, 1.0))
        body.explicitinertial = True
        bodies[link] = body
        if joint and joint.type in _MOVING and not joint.is_locked:
            own = robot.local(joint.name)
            _add_joint(spec, body, joint, joint.name if own in robot.joints else own)
        for geom in geoms(shapes[link]):
            seen = body.add_geom(pos=geom.pos, quat=quaternion(*geom.euler), rgba=geom.rgba or _GREY)
            seen.type = getattr(mujoco.mjtGeom, f"mjGEOM_{geom.type.upper()}")
            seen.size[: len(geom.size)] = geom.size
            seen.meshname = geom.mesh or ""
            seen.contype = seen.conaffinity = 0
    return spec.compile()


def _add_joint(spec: mujoco.MjSpec, body: mujoco.MjsBody, joint: Joint, label: str) -> None:
    """A joint, and the control that is its slider; one without limits has half a turn, or a metre, either way."""
    limits, turns = joint.limits, joint.type != "prismatic"
    bounded = joint.type != "continuous" and limits is not None and max(-limits.lower, limits.upper) < ENDLESS
    low, high = (limits.lower, limits.upper) if limits and bounded else (-math.pi, math.pi) if turns else (-1.0, 1.0)
    kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
    body.add_joint(name=joint.name, type=kind, axis=joint.axis, ref=joint.rest)
    slider = spec.add_actuator(name=label, target=joint.name, ctrllimited=True, ctrlrange=(low, high))
    slider.trntype = mujoco.mjtTrn.mjTRN_JOINT
