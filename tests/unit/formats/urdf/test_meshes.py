"""Mesh files: formats, units, colours, limits, and what MuJoCo makes of them."""

import re
import struct
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from vrx_mj.config.shapes import MESH_SUFFIXES, Shape
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.reader import MeshFiles, check_mesh, obj_text, read_mesh, with_file_uris
from vrx_mj.mjcf.templates import mesh as compiled

SIDES = (1.0, 2.0, 3.0)


@pytest.fixture
def wedge():
    """A box with one corner cut off, away from the origin: no symmetry hides a wrong axis."""
    part = trimesh.creation.box(SIDES)
    part.vertices[part.vertices.sum(axis=1).argmax()] *= 0.5
    part.apply_translation((4, 5, 6))
    return part


def collada(parts, unit="", up="Y_UP"):
    """A Collada file of these meshes, with a unit and an up axis."""
    text = trimesh.exchange.dae.export_collada(parts)
    text = text.decode() if isinstance(text, bytes) else text
    return text.replace("<asset>", f"<asset>{unit}", 1).replace("Y_UP", up)


def volume(mesh):
    """Signed volume inside the triangles [m3], by the divergence theorem."""
    a, b, c = (mesh.points[mesh.triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_every_format_gives_the_same_body(wedge, tmp_path, suffix):
    file = tmp_path / f"wedge{suffix}"
    wedge.export(file)
    mesh = check_mesh(file, collides=True)
    assert volume(mesh) == pytest.approx(wedge.volume, rel=1e-6)  # STL is single precision
    assert mesh.points.min(axis=0) == pytest.approx(wedge.bounds[0], abs=1e-6)
    assert mesh.points.max(axis=0) == pytest.approx(wedge.bounds[1], abs=1e-6)


def test_colladas_unit_counts_and_its_up_axis_does_not(wedge, tmp_path):
    """Gazebo's loader scales and does not turn: VRX's Y-up post arm is drawn with its own axes."""
    file = tmp_path / "wedge.dae"
    for up in ("X_UP", "Y_UP", "Z_UP"):
        file.write_text(collada([wedge], '<unit name="centimetre" meter="0.01"/>', up), encoding="utf-8")
        mesh = read_mesh(file)
        assert mesh.points.max(axis=0) == pytest.approx(wedge.bounds[1] / 100, abs=1e-6)
        assert volume(mesh) == pytest.approx(wedge.volume / 1e6, rel=1e-5)


def test_the_colour_of_most_of_the_surface_is_taken(wedge, tmp_path):
    small = trimesh.creation.box((0.1, 0.1, 0.1))
    wedge.visual.face_colors, small.visual.face_colors = [255, 0, 51, 255], [0, 255, 0, 255]
    file = tmp_path / "two.dae"
    file.write_text(collada([small, wedge]), encoding="utf-8")
    mesh = read_mesh(file)
    assert mesh.color == pytest.approx((1.0, 0.0, 0.2, 1.0), abs=0.005)
    assert volume(mesh) == pytest.approx(wedge.volume + 0.001, rel=1e-5)


def test_a_collada_mesh_with_a_broken_material_has_its_shape(wedge, tmp_path):
    """As ANYmal's foot: its material refers to an effect that the file does not have."""
    wedge.visual.face_colors = [255, 0, 51, 255]
    text = collada([wedge])
    for effect in set(re.findall(r'<instance_effect url="(#[^"]+)"', text)):
        text = text.replace(f'url="{effect}"', 'url="#missing"')
    (tmp_path / "foot.dae").write_text(text, encoding="utf-8")
    mesh = read_mesh(tmp_path / "foot.dae")
    assert volume(mesh) == pytest.approx(wedge.volume, rel=1e-5)


def test_a_mesh_without_colours_has_none(wedge, tmp_path):
    wedge.export(tmp_path / "wedge.stl")
    assert read_mesh(tmp_path / "wedge.stl").color is None


@pytest.mark.parametrize("scale", [(2.0, 2.0, 2.0), (1.0, -1.0, 1.0), (-1.0, -2.0, 0.5)])
def test_a_scaled_or_mirrored_body_keeps_its_outside(wedge, tmp_path, scale):
    wedge.export(tmp_path / "wedge.obj")
    mesh = read_mesh(tmp_path / "wedge.obj", scale)
    assert volume(mesh) == pytest.approx(wedge.volume * abs(np.prod(scale)), rel=1e-6)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (0.5, -1.0, 2.0)])
def test_mujoco_compiles_every_format(wedge, tmp_path, suffix, scale):
    wedge.export(tmp_path / f"wedge{suffix}")
    made = compiled(Shape(folder=tmp_path, type="mesh", file=f"wedge{suffix}", scale=scale))
    scaled = " ".join(map(str, made.scale))
    text = f"""<mujoco><asset><mesh name="m" file="{made.file}" scale="{scaled}" inertia="convex"/></asset>
    <worldbody><body><freejoint/><geom type="mesh" mesh="m" density="1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text, {made.file: made.content})
    expected = wedge.convex_hull
    assert model.body_mass[1] == pytest.approx(expected.volume * abs(np.prod(scale)), rel=1e-5)
    assert model.body_ipos[1] == pytest.approx(expected.center_mass * scale, abs=1e-5)


def test_what_mujoco_reads_itself_is_not_touched(wedge, tmp_path):
    wedge.export(tmp_path / "wedge.stl")
    made = compiled(Shape(folder=tmp_path, type="mesh", file="wedge.stl"))
    assert made.content == (tmp_path / "wedge.stl").read_bytes()
    assert made.file.endswith(".stl")


def test_obj_text_reads_back(wedge, tmp_path):
    wedge.export(tmp_path / "wedge.ply")
    first = read_mesh(tmp_path / "wedge.ply")
    (tmp_path / "again.obj").write_text(obj_text(first), encoding="utf-8")
    again = read_mesh(tmp_path / "again.obj")
    assert (again.triangles == first.triangles).all()
    assert again.points == pytest.approx(first.points, rel=1e-7)


def refusal(file, **kinds):
    with pytest.raises(VrxError) as caught:
        check_mesh(file, **kinds)
    return str(caught.value)


def test_too_many_triangles_are_refused(tmp_path):
    trimesh.creation.icosphere(subdivisions=7).export(tmp_path / "ball.stl")
    assert refusal(tmp_path / "ball.stl") == (
        "mesh ball.stl has 327,680 triangles; at most 200,000 are allowed: simplify it, for example with Blender's "
        "Decimate"
    )


def test_too_large_a_file_is_refused_unread(tmp_path):
    with (tmp_path / "huge.stl").open("wb") as stream:
        stream.truncate(50_000_001)
    assert refusal(tmp_path / "huge.stl") == "mesh huge.stl is larger than 50 MB, the maximum"


def test_a_mesh_in_millimetres_called_metres_is_refused(wedge, tmp_path):
    wedge.apply_scale(100_000)
    wedge.export(tmp_path / "wedge.obj")
    assert refusal(tmp_path / "wedge.obj") == (
        "mesh wedge.obj reaches 7.5e+05 m from its origin; at most 100000 m: check its unit"
    )


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.stl", b"", "mesh a.stl is empty: it has no triangles"),
        ("a.stl", b"\0" * 80 + struct.pack("<I", 2**31), "mesh a.stl is empty: it has no triangles"),
        ("a.ply", b"ply\nformat nothing\n", "mesh a.ply cannot be read: it is not a PLY file, or is damaged"),
        ("a.glb", b"glTF", "mesh a.glb cannot be read: it is not a GLB file, or is damaged"),
        ("a.glb", b"glTF" + b"\xff" * 40, "mesh a.glb cannot be read: it is not a GLB file, or is damaged"),
        ("a.dae", b"<COLLADA/>", "mesh a.dae cannot be read: it is not a DAE file, or is damaged"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", "mesh a.obj is empty: it has no triangles"),
    ],
)  # fmt: skip
def test_damaged_files_are_refused(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    assert refusal(tmp_path / name) == message


@pytest.mark.parametrize("seed", range(30))
def test_no_bytes_end_in_anything_but_a_mesh_or_a_message(wedge, tmp_path, seed):
    """Files with bytes changed at random."""
    random = np.random.default_rng(seed)
    suffix = MESH_SUFFIXES[seed % len(MESH_SUFFIXES)]
    file = tmp_path / f"wedge{suffix}"
    wedge.export(file)
    content = np.frombuffer(file.read_bytes(), dtype=np.uint8).copy()
    content[random.integers(0, len(content), 20)] = random.integers(0, 256, 20)
    file.write_bytes(content.tobytes())
    with suppress(VrxError):
        assert np.isfinite(check_mesh(file, collides=True).points).all()


PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
property uchar red
property uchar green
property uchar blue
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1 200 0 0
3 0 1 3 200 0 0
3 0 3 2 200 0 0
3 1 2 {last} 200 0 0
"""


@pytest.mark.parametrize("last", [4, 8355840, -1])
def test_a_triangle_of_a_coloured_part_refers_to_its_own_points(tmp_path, last):
    file = tmp_path / "a.ply"
    file.write_text(PLY.format(last=3), encoding="utf-8")
    assert read_mesh(file).color == (200 / 255, 0.0, 0.0, 1.0)
    file.write_text(PLY.format(last=last), encoding="utf-8")
    assert refusal(file) == "mesh a.ply is broken: a triangle refers to a missing point"


def test_a_triangle_does_not_refer_to_the_points_of_another_part(wedge, tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=1)
    scene = trimesh.Scene([wedge, ball])
    file = tmp_path / "a.glb"
    file.write_bytes(scene.export(file_type="glb"))
    assert len(read_mesh(file).triangles) == len(wedge.faces) + len(ball.faces)
    data = file.read_bytes()
    for shape in (wedge, ball):
        faces, last = shape.faces, shape.faces.max()
        old, new = (np.asarray(each, "<u4").tobytes() for each in (faces, np.where(faces == last, last + 1, faces)))
        assert old in data
        file.write_bytes(data.replace(old, new, 1))
        assert refusal(file) == "mesh a.glb is broken: a triangle refers to a missing point"


def test_a_missing_file_is_told(tmp_path):
    assert refusal(Path(tmp_path) / "no.obj") == "mesh no.obj cannot be read: No such file or directory"


NORMALS = """
from pathlib import Path
from vrx_mj.formats.urdf.reader import read_mesh
corners = "vertex 0 0 0\\nvertex 1 0 {0}\\nvertex 0 1 0\\n"
text = "solid a\\n" + "".join("facet normal x y z\\n" + corners.format(n) for n in range(4)) + "endsolid a\\n"
Path("a.stl").write_text(text, encoding="utf-8")
print(len(read_mesh(Path("a.stl")).triangles))
"""


@pytest.mark.slow
def test_the_library_writes_nothing_to_the_terminal(tmp_path):
    """Of normals that are no numbers it would write a traceback, and read the rest."""
    command = [sys.executable, "-c", NORMALS]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, encoding="utf-8", check=True)
    assert (done.stdout, done.stderr) == ("4\n", "")


# Meshes in a description that is read elsewhere


@pytest.fixture
def files(tmp_path):
    for name in ("boat/meshes/hull & deck.obj", "vrx/wamv/meshes/arch.dae", "secret.obj"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    return MeshFiles(tmp_path / "boat", {}, [tmp_path / "vrx"])


@pytest.mark.parametrize(
    ("written", "there"),
    [
        ('<mesh filename="meshes/hull &amp; deck.obj"/>', "boat/meshes/hull%20%26%20deck.obj"),
        ("<mesh scale='1 1 1' filename='package://wamv/meshes/arch.dae'/>", "vrx/wamv/meshes/arch.dae"),
        ('<mesh\n  filename = "meshes/../meshes/hull%20&amp;%20deck.obj" />', "boat/meshes/hull%20%26%20deck.obj"),
    ],
)
def test_a_mesh_that_is_found_is_named_by_where_it_is(files, tmp_path, written, there):
    text = f"<geometry>{written}</geometry>"
    told = with_file_uris(text, files)
    assert f'"{tmp_path.as_uri()}/{there}"' in told
    assert with_file_uris(told, files) == told


@pytest.mark.parametrize(
    "name", ["meshes/none.obj", "../secret.obj", "package://none/a.obj", "https://example.org/a.obj", "C:\\a.obj", ""]
)
def test_other_meshes_stay_as_they_are(files, name):
    text = f'<robot><mesh filename="{name}"/><texture filename="meshes/hull &amp; deck.obj"/></robot>'
    assert with_file_uris(text, files) == text
