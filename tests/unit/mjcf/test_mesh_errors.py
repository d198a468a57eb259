"""Meshes that MuJoCo does not take: its words, with the file's name in place of one of ours."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import vrx_mj
from vrx_mj.errors import CompileError, VrxError

HULL = """<robot name="boat"><link name="hull"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1" ixy="0"
ixz="0" iyz="0"/></inertial><{kind}><geometry><mesh filename="{file}" scale="{scale}"/></geometry></{kind}></link>
</robot>"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with meshes, which is the current one."""
    monkeypatch.chdir(tmp_path)
    Path("meshes").mkdir()
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    box.export("meshes/box.stl")
    box.export("meshes/text.stl", file_type="stl_ascii")
    box.vertices[:, 2] = 0.0
    box.export("meshes/flat.stl")
    return tmp_path


def world_with(file, kind="collisions", scale=1.0):
    """A world with an object of one mesh."""
    text = f"static: true\n{kind}:\n  - {{type: mesh, file: {file}, scale: {scale!r}}}\n"
    Path("thing.yaml").write_text(text, encoding="utf-8")
    item = {"name": "thing", "model": "thing.yaml", "pose": [9, 0, 0, 0, 0, 0]}
    return vrx_mj.compile_world({"extends": "ocean", "objects": [item]})


FLAT = (
    "MuJoCo cannot use the mesh meshes/flat.stl: has coplanar vertices, cannot compute convex hull. "
    "Consider using a primitive geom type (plane or thin box) instead"
)
SMALL = "MuJoCo cannot use the mesh meshes/box.stl: mesh surface area is too small"


@pytest.mark.parametrize(
    ("file", "scale", "message"), [("meshes/flat.stl", 1.0, FLAT), ("meshes/box.stl", 1e-9, SMALL)]
)
def test_what_mujoco_says_names_the_file_of_an_object(here, file, scale, message):
    with pytest.raises(CompileError) as caught:
        world_with(file, scale=scale)
    assert str(caught.value) == message


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")  # of a boat without thrusters
def test_what_mujoco_says_names_the_file_of_a_boat_that_joins(here):
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean"))
    Path("boat.urdf").write_text(
        HULL.format(file="meshes/box.stl", kind="collision", scale="1e-9 1e-9 1e-9"), encoding="utf-8"
    )
    with pytest.raises(CompileError) as caught:
        sim.spawn("b", robot="boat.urdf", pose=[9, 0, 0, 0, 0, 0])
    assert str(caught.value) == SMALL


def test_a_flat_mesh_is_seen(here):
    assert "mesh_" in world_with("meshes/flat.stl", kind="visuals").mjcf


def test_a_text_stl_is_handed_on_as_obj(here):
    """MuJoCo reads the binary kind alone."""
    plain, text = (world_with(f"meshes/{name}.stl") for name in ("box", "text"))
    (made,) = set(text.assets) - set(plain.assets)
    assert made.endswith(".obj")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"\0" * 84, "is empty: it has no triangles"),
        (b"\0" * 90, "is empty: it has no triangles"),
    ],
)  # fmt: skip
def test_a_mesh_of_an_object_is_looked_at(here, content, reason):
    Path("meshes/bad.stl").write_bytes(content)
    with pytest.raises(VrxError) as caught:
        world_with("meshes/bad.stl")
    assert str(caught.value) == f"mesh bad.stl {reason}"


def test_a_mesh_that_changed_is_tried_again(here):
    world_with("meshes/box.stl")
    flat = trimesh.load_mesh("meshes/flat.stl", process=False)
    flat.apply_transform(np.diag([2.0, 2.0, 2.0, 1.0]))
    flat.export("meshes/box.stl")
    with pytest.raises(CompileError, match="coplanar"):
        world_with("meshes/box.stl")
