"""Contacts of hulls: how deep shapes that touch are in each other."""

import mujoco

from vrx_mj.config.shapes import Shape
from vrx_mj.mjcf.templates import geoms, meshes
from vrx_mj.validation.rows import Comparison, Outcome, case, rows

_SHAPES = Shape(type="cylinder", radius=0.2, length=4.0), Shape(type="box", size=(0.6, 0.4, 0.31))
"""A float and a battery of the WAM-V."""
_COLUMNS = ("x", "y", "z", "a", "b", "c", "d")


@case("mjcf/templates.py", table="contacts")
def contacts() -> Outcome:
    """Contacts of a float with a box.

    A float of the WAM-V and a box of the size of its battery, as in worlds, in 100 attitudes, 10 mm beyond their
    first contact. Contacts are those of the installed MuJoCo; versions 4.0.0 and 4.0.1 differ in contacts of
    cylinders. The prism of 64 sides that represents a cylinder in worlds lacks 0.24 mm.
    """
    spec = mujoco.MjSpec()
    for mesh in meshes(_SHAPES):
        spec.assets[mesh.file] = mesh.content
        spec.add_mesh(name=mesh.name, file=mesh.file, scale=mesh.scale)
    for geom in geoms(_SHAPES):
        body = spec.worldbody.add_body()
        body.add_freejoint()
        kind = getattr(mujoco.mjtGeom, f"mjGEOM_{geom.type.upper()}")
        body.add_geom(type=kind, size=[*geom.size, 0.0, 0.0, 0.0][:3], meshname=geom.mesh or "")
    model, off = spec.compile(), []
    data = mujoco.MjData(model)
    for row in rows("contacts"):
        data.qpos[:7], data.qpos[10:] = [row[column] for column in _COLUMNS], [row[f"box_{axis}"] for axis in "abcd"]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        off.append(abs(row["depth"] + min(float(contact.dist) for contact in data.contact)))
    yield Comparison("greatest difference of depth", "mm", None, 1e3 * max(off))
