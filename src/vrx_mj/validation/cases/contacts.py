"""Contacts of hulls: how deep shapes that touch are in each other."""

from collections.abc import Iterator

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from vrx_mj.arrays import FloatArray
from vrx_mj.config.shapes import Shape
from vrx_mj.mjcf.templates import geoms, meshes
from vrx_mj.validation.rows import Comparison, Outcome, case

_RADIUS, _HALF, _BOX = 0.2, 2.0, (0.3, 0.2, 0.155)
"""Of a float and of a battery of the WAM-V: radius, half length and half edges [m]."""
_MOVED = 0.01
"""How far the float is moved on after its first contact [m]."""
_POSES = 100


@case("mjcf/templates.py")
def contacts() -> Outcome:
    """Contacts of a float with a box.

    A float of the WAM-V and a box of the size of its battery, in 100 attitudes: the float comes nearer along a straight
    line until it touches, and is moved on by 10 mm. Contacts are those of the MuJoCo that is installed; its versions
    4.0.0 and 4.0.1 make different ones of cylinders.

    Reference: the least distance by which the convex bodies, a cylinder and a box, must be moved apart: the least sum
    of their support functions in a direction, by search over all directions (Cameron and Culley, 1986). The prism of 64
    sides that a cylinder is in worlds lacks 0.24 mm.
    """
    model = _two(
        Shape(type="cylinder", radius=_RADIUS, length=2.0 * _HALF), Shape(type="box", size=tuple(2.0 * np.array(_BOX)))
    )
    off = max(abs(ours - exact) for ours, exact in _depths(model))
    yield Comparison("greatest difference of depth", "mm", None, 1e3 * off)


def _two(*shapes: Shape) -> mujoco.MjModel:
    """Two bodies of a shape each, as worlds have them."""
    spec = mujoco.MjSpec()
    for mesh in meshes(shapes):
        spec.assets[mesh.file] = mesh.content
        spec.add_mesh(name=mesh.name, file=mesh.file, scale=mesh.scale)
    for geom in geoms(shapes):
        body = spec.worldbody.add_body()
        body.add_freejoint()
        kind = getattr(mujoco.mjtGeom, f"mjGEOM_{geom.type.upper()}")
        body.add_geom(type=kind, size=[*geom.size, 0.0, 0.0, 0.0][:3], meshname=geom.mesh or "")
    return spec.compile()


def _depths(model: mujoco.MjModel) -> Iterator[tuple[float, float]]:
    """Depth [m] of the deepest contact, and that of the bodies, in each attitude."""
    data, random = mujoco.MjData(model), np.random.default_rng(7)
    for _ in range(_POSES):
        turns = Rotation.random(2, random)
        data.qpos[:] = 0.0
        data.qpos[3:7], data.qpos[10:14] = turns.as_quat(scalar_first=True)
        toward = random.normal(size=3)
        toward /= np.linalg.norm(toward)
        near, far = 0.0, 6.0
        while far - near > 1e-8:
            middle = 0.5 * (near + far)
            near, far = (middle, far) if _contacts(model, data, middle * toward) else (near, middle)
        place = (near - _MOVED) * toward
        _contacts(model, data, place)
        yield -min(float(contact.dist) for contact in data.contact), _exact_depth(place, turns[0], turns[1], random)


def _exact_depth(place: FloatArray, cylinder: Rotation, box: Rotation, random: np.random.Generator) -> float:
    """The least distance [m] that parts a cylinder at a place from a box at the origin."""

    def overlap(directions: FloatArray) -> FloatArray:
        n = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
        a, b = cylinder.inv().apply(n), box.inv().apply(n)
        ends = _RADIUS * np.hypot(a[..., 0], a[..., 1]) + _HALF * np.abs(a[..., 2]) + np.abs(b) @ np.array(_BOX)
        return np.asarray(ends + n @ place)

    tried = random.normal(size=(20_000, 3))
    for width in np.geomspace(0.1, 1e-5, 20):  # around the best ones, ever nearer
        tried /= np.linalg.norm(tried, axis=1, keepdims=True)
        best = tried[np.argsort(overlap(tried))[:20]]
        tried = np.concatenate([best, *(best + width * random.normal(size=(20, 20, 3)))])
    return float(overlap(tried).min())


def _contacts(model: mujoco.MjModel, data: mujoco.MjData, place: FloatArray) -> int:
    """How many contacts there are with the first body at a place [m]."""
    data.qpos[:3] = place
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    return int(data.ncon)
