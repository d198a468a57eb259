"""What a mesh is read as, and each reason for which one is refused, in the process that reads them."""

import numpy as np
import pytest

from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf import mesh_file

POINTS = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)]
FACES = [(1, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4)]


def obj(points=POINTS, faces=FACES):
    rows = ["v {} {} {}".format(*point) for point in points] + ["f {} {} {}".format(*face) for face in faces]
    return "\n".join([*rows, ""])


def dae(unit):
    places, names = " ".join(f"{x} {y} {z}" for x, y, z in POINTS), " ".join(f"{i - 1}" for row in FACES for i in row)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>{unit}<up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="12">{places}</float_array>
<technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v">
<input semantic="POSITION" source="#p"/>
</vertices><triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{names}</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s">
<node id="n"><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def read(tmp_path, text, suffix="obj"):
    file = tmp_path / f"hull.{suffix}"
    file.write_text(text, encoding="utf-8")
    return mesh_file.mesh(str(file), "hull")


def test_a_mesh_has_the_points_that_its_triangles_use(tmp_path):
    found = read(tmp_path, obj([(9, 9, 9), *POINTS], [tuple(i + 1 for i in face) for face in FACES]))
    corners = found.points[found.triangles]
    assert len(found.points) == 4
    np.testing.assert_allclose(corners, np.array(POINTS, float)[np.array(FACES) - 1])


@pytest.mark.parametrize(("unit", "metres"), [("", 1.0), ('<unit name="mm" meter="0.001"/>', 0.001)])
def test_collada_says_its_unit(tmp_path, unit, metres):
    found = read(tmp_path, dae(unit), "dae")
    np.testing.assert_allclose(found.points.max(axis=0), np.array([1, 2, 3]) * metres)


def test_gltf_has_its_y_axis_up(tmp_path):
    import io

    import trimesh

    (tmp_path / "hull.obj").write_text(obj(), encoding="utf-8")
    made = trimesh.load(io.BytesIO(mesh_file.glb(str(tmp_path / "hull.obj"), "hull")), file_type="glb", force="mesh")
    np.testing.assert_allclose(made.bounds, [[0, 0, -2], [1, 3, 0]])


@pytest.mark.parametrize(
    ("text", "suffix", "message"),
    [
        ("v 0 0 0\n", "obj", "mesh hull is empty: it has no triangles"),
        ("solid x", "ply", "mesh hull cannot be read: it is not a PLY file, or is damaged"),
        ("solid x", "stl", "mesh hull is empty: it has no triangles"),
        (obj(POINTS[:3], [(1, 2, 3)]), "obj", "mesh hull has 3 different points; a shape needs at least 4"),
        (obj([*POINTS[:3], (0, 0, "nan")]), "obj", "mesh hull is broken: the coordinates of a point are not finite"),
        (dae('<unit meter="0"/>'), "dae", "mesh hull: expected a number of metres above 0 as its unit, got '0'"),
        (dae('<unit meter="1e6"/>'), "dae", "mesh hull: expected a number of metres above 0 as its unit, got '1e6'"),
        (dae('<unit meter="1-1"/>'), "dae", "mesh hull: expected a number of metres above 0 as its unit, got '1-1'"),
    ],
)
def test_a_mesh_is_refused_with_its_reason(tmp_path, text, suffix, message):
    with pytest.raises(VrxError) as caught:
        read(tmp_path, text, suffix)
    assert str(caught.value) == message


def test_sizes_of_meshes_have_an_end(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_file, "_MOST_TRIANGLES", 4)
    monkeypatch.setattr(mesh_file, "_LARGEST", 3.0)
    assert len(read(tmp_path, obj()).triangles) == 4
    with pytest.raises(VrxError, match=r"mesh hull has 5 triangles; at most 4 are allowed: simplify it"):
        read(tmp_path, obj(faces=[*FACES, FACES[0]]))
    with pytest.raises(VrxError, match=r"mesh hull reaches 3.1 m from its origin; at most 3 m: check its unit"):
        read(tmp_path, obj([*POINTS[:3], (0, 0, -3.1)]))
