"""Small mesh files that would grow without end, or name others: a mesh or one line, in bounded memory and time."""

import json
import struct
import zipfile
from contextlib import suppress
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from peak_memory import peak_memory
from vrx_mj.errors import VrxError
from vrx_mj.foreign import ReaderError, ask
from vrx_mj.formats.urdf import reader
from vrx_mj.formats.urdf.reader import MeshData, read_mesh

BIG = 900_000_000
SHAPE = {"attributes": {"POSITION": 0}}
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
CORNERS = np.array([0, 1, 2, 0, 1, 3, 0, 2, 3, 1, 2, 3], dtype="<u4")
DATA = POINTS.tobytes() + CORNERS.tobytes()
TREE = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48}],
    "buffers": [{"byteLength": 96}],
}
"""A tetrahedron."""


def glb(tree, data=DATA):
    text = json.dumps(tree).encode() if isinstance(tree, dict) else tree
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def changed(*path, to):
    """The tetrahedron's file with one value replaced, or a new one."""
    tree = json.loads(json.dumps(TREE))
    node = tree
    for step in path[:-1]:
        node = node[step]
    if isinstance(node, list) and path[-1] == len(node):
        node.append(to)
    else:
        node[path[-1]] = to
    return glb(tree)


def dae(geometry="", scene="", head="<?xml version='1.0'?>"):
    return (
        f"{head}<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset/>{geometry}"
        f"<library_visual_scenes><visual_scene id='s'>{scene}</visual_scene></library_visual_scenes>"
        "<scene><instance_visual_scene url='#s'/></scene></COLLADA>"
    ).encode()


def ply(*lines, body=b"", kind="binary_little_endian"):
    return ("\n".join(["ply", f"format {kind} 1.0", *lines, "end_header"]) + "\n").encode() + body


TETRAHEDRON = (
    "<library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' count='12'>0 0 0 1 0 0 0 1 0 0 0 1"
    "</float_array><technique_common><accessor source='#a' count='4' stride='3'><param name='X' type='float'/>"
    "<param name='Y' type='float'/><param name='Z' type='float'/></accessor></technique_common></source>"
    "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices><triangles count='{count}'>"
    "<input semantic='VERTEX' source='#v' offset='0'/><p>{corners}</p></triangles></mesh></geometry>"
    "</library_geometries>"
)
ONE = TETRAHEDRON.format(count=4, corners="0 1 2 0 1 3 0 2 3 1 2 3")
MANY = TETRAHEDRON.format(count=4, corners="0 1 2 0 1 3 0 2 3 1 2 3 " * 25_000)
DRAWN = "<instance_geometry url='#g'/>"
TWICE = "".join(
    "<node id='n{0}'><instance_node url='#n{1}'/><instance_node url='#n{1}'/></node>".format(n, n + 1)
    for n in range(30)
) + f"<node id='n30'>{DRAWN}</node>"  # fmt: skip
XYZ = ("property float x", "property float y", "property float z")
FACE = "property list uchar int vertex_indices"
ZIPPED = BytesIO()
with zipfile.ZipFile(ZIPPED, "w", zipfile.ZIP_DEFLATED) as archive:
    archive.writestr("a.dae", b" " * 30_000_000 + dae(ONE, f"<node>{DRAWN}</node>"))

PARTS = "parts, those that are repeated counted each time; at most 1,000 are allowed: export it as one mesh"
TRIANGLES = "triangles; at most 200,000 are allowed: simplify it, for example with Blender's Decimate"
DAMAGED = "cannot be read: it is not a {} file, or is damaged"
COUNT = "its accessor 0 says 900,000,000 items of 12 bytes, which take 10,800,000,000 bytes; there are 48"
BOMBS = {
    "count.glb": changed("accessors", 0, "count", to=BIG),
    "no_data.glb": changed("accessors", 0, to={"componentType": 5126, "count": BIG, "type": "VEC3"}),
    "sparse.glb": changed("accessors", 0, "sparse", to={"count": BIG}),
    "stride.glb": changed("bufferViews", 0, "byteStride", to=1),
    "negative.glb": changed("accessors", 0, "count", to=-1),
    "view.glb": changed("bufferViews", 0, "byteLength", to=BIG),
    "cycle.glb": changed("nodes", to=[{"children": [1]}, {"children": [0], "mesh": 0}]),
    "twice.glb": changed("nodes", to=[{"children": [n + 1, n + 1]} for n in range(30)] + [{"mesh": 0}]),
    "deep.glb": changed("nodes", to=[{"children": [n + 1]} for n in range(999)] + [{"mesh": 0}]),
    "nodes.glb": changed("nodes", to=[{"children": list(range(1, 1502))}] + [{"mesh": 0}] * 1501),
    "primitives.glb": changed("meshes", 0, "primitives", to=[SHAPE] * 2000),
    "items.glb": changed("nodes", to=[{}] * 20_001),
    "draco.glb": changed("extensionsRequired", to=["KHR_draco_mesh_compression"]),
    "meshopt.glb": changed("extensionsRequired", to=["EXT_meshopt_compression"]),
    "outside.glb": changed("buffers", 0, "uri", to="../../etc/passwd"),
    "deep_json.glb": glb(b"[" * 100_000),
    "json.glb": glb(b'{"a": "' + b"x" * 8_000_000 + b'"}'),
    "chunk.glb": glb(TREE)[:-96],
    "count.stl": b"\0" * 80 + struct.pack("<I", BIG) + b"\0" * 100,
    "many.stl": b"\0" * 80 + struct.pack("<I", 300_000) + b"\0" * 15_000_000,
    "text.stl": b"solid a\n" + b"vertex 0 0 0\n" * 900_000 + b"endsolid a",
    "solids.stl": b"solid a\nendsolid a\n" * 1001,
    "bytes.stl": b"solid \xff\xfe" + b"\xff" * 900_000,
    "faces.obj": b"v 0 0 0\n" * 4 + b"f 1 2 3\n" * 200_001,
    "corners.obj": b"v 0 0 0\n" * 4 + b"f " + b"1 " * 300_000,
    "continued.obj": b"v 0 0 0\n" * 4 + b"f " + b"1 2 3 \\\n" * 100_000,
    "points.obj": b"v 0 0 0\n" * 600_002,
    "materials.obj": b"".join(b"usemtl %d\nf 1 2 3\n" % n for n in range(1001)),
    "bytes.obj": b"v 0 0 0\n\xe9" * 90_000,
    "count.ply": ply(f"element vertex {BIG}", *XYZ),
    "short.ply": ply("element vertex 500000", *XYZ, body=b"\0" * 120),
    "faces.ply": ply("element vertex 4", *XYZ, f"element face {BIG}", FACE),
    "other.ply": ply("element vertex 4", *XYZ, f"element fin {BIG}", "property uchar a", body=b"\0" * 48),
    "nothing.ply": ply(f"element fin {BIG}"),
    "lines.ply": ply("element vertex 4", *XYZ, kind="ascii", body=b"\n" * 3_000_000),
    "odd_lines.ply": ply("element vertex 4", *XYZ, kind="ascii", body="\u2028".encode() * 900_000),
    "digits.ply": ply(f"element vertex {'9' * 5000}", *XYZ),
    "negative.ply": ply("element vertex -5", *XYZ),
    "head.ply": b"ply\nformat ascii 1.0\n" + b"comment\n" * 9000 + b"end_header\n",
    "cycle.dae": dae(ONE, "<node id='a'><instance_node url='#b'/></node><node id='b'><instance_node url='#a'/></node>"),
    "deep.dae": dae(ONE, "<node>" * 100 + DRAWN + "</node>" * 100),
    "twice.dae": dae(ONE, TWICE),
    "places.dae": dae(ONE, f"<node>{DRAWN * 1001}</node>"),
    "repeated.dae": dae(MANY, f"<node>{DRAWN * 3}</node>"),
    "one_id.dae": dae(
        MANY.replace("</library_geometries>", "<geometry id='g'/></library_geometries>"), f"<node>{DRAWN * 3}</node>"
    ),
    "laughs.dae": dae(ONE, head="<!DOCTYPE a [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;'>]>"),
    "utf16.dae": dae(head="<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]>").decode().encode("utf-16"),
    "utf7.dae": b"<?xml version='1.0' encoding='UTF-7'?>+ADw-+ACE-DOCTYPE a+AD4-",
    "tags.dae": dae(ONE, "<node/>" * 200_000),
    "attributes.dae": dae(ONE, "<node " + " ".join(f"a{n}=''" for n in range(200_000)) + "/>"),
    "zip.dae": ZIPPED.getvalue(),
}


SLOW = {"lines.ply", "odd_lines.ply", "tags.dae", "text.stl"}
"""Bombs of millions of lines and tags."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in BOMBS])
def test_bombs_do_not_go_off(name, tmp_path):
    """Each is a mesh, or one line, whatever it says of itself; what it may take is the reader's to hold."""
    (tmp_path / name).write_bytes(BOMBS[name])
    said = []

    def read():
        try:
            assert len(read_mesh(tmp_path / name).triangles) <= 200_000
        except VrxError as error:
            said.append(str(error))

    assert peak_memory(read) < 60_000_000 + 4 * len(BOMBS[name])
    assert all(line.startswith(f"mesh {name} ") and "\n" not in line for line in said)


@pytest.mark.parametrize("name", ["count.glb", "many.stl", "faces.obj", "count.ply", "repeated.dae", "chunk.glb"])
def test_what_is_too_large_or_lacks_data_is_refused(name, tmp_path):
    (tmp_path / name).write_bytes(BOMBS[name])
    with pytest.raises(VrxError):
        read_mesh(tmp_path / name)


NAMED = {
    "a.glb": changed("buffers", 0, "uri", to="secret.bin"),
    "a.obj": b"mtllib secret.mtl\nusemtl secret\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n",
    "a.dae": dae(ONE, f"<node>{DRAWN}</node>", "<!DOCTYPE COLLADA [<!ENTITY a SYSTEM 'secret.xml'>]>").replace(
        b"0 0 0 1 0 0", b"&a; 0 0 1 0 0"),
}  # fmt: skip
"""Meshes that name a file beside them, in which there would be a number or a colour."""


@pytest.mark.parametrize("name", NAMED)
def test_a_mesh_that_names_another_file_cannot_read_it(name, tmp_path):
    texts = {"secret.bin": DATA, "secret.mtl": b"newmtl secret\nKd 1 0 0\n", "secret.xml": b"0"}
    for file, content in {name: NAMED[name], **texts}.items():
        (tmp_path / file).write_bytes(content)
    try:
        found = read_mesh(tmp_path / name)
    except VrxError:
        assert name != "a.obj"
    else:
        assert name == "a.obj"
        assert found.color is None


@pytest.mark.parametrize("secret", ["secret.stl", "../secret.stl", "/etc/passwd"])
def test_the_reader_reads_the_mesh_alone(secret, tmp_path):
    (tmp_path / "inside").mkdir()
    for folder in (tmp_path, tmp_path / "inside"):
        (folder / "secret.stl").write_bytes(b"solid")
    with pytest.raises(ReaderError, match="not allowed to read"):
        ask("formats.urdf.mesh_file:mesh", tmp_path / "inside" / secret, "a", returns=MeshData, about="it",
            reads=[tmp_path / "inside" / "a.stl"], cached=False)  # fmt: skip


def test_what_the_bombs_are_made_from_is_read(tmp_path):
    for name, content in {"a.glb": glb(TREE), "a.dae": dae(ONE, f"<node>{DRAWN}</node>")}.items():
        (tmp_path / name).write_bytes(content)
        mesh = read_mesh(tmp_path / name)
        assert len(mesh.triangles) == 4
        assert mesh.points.max(axis=0).tolist() == [1, 1, 1]


def test_a_mesh_in_two_places_is_there_twice(tmp_path):
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}]
    (tmp_path / "a.glb").write_bytes(changed("nodes", to=nodes))
    placed = "<node><translate>{}</translate><instance_node url='#n'/></node>"
    shapes = f"{ONE}<library_nodes><node id='n'>{DRAWN}</node></library_nodes>"
    (tmp_path / "a.dae").write_bytes(dae(shapes, placed.format("0 0 0") + placed.format("5 0 0")))
    for name in ("a.glb", "a.dae"):
        mesh = read_mesh(tmp_path / name)
        assert len(mesh.triangles) == 8
        assert mesh.points.max(axis=0).tolist() == [6, 1, 1]


def test_pictures_are_not_opened(tmp_path):
    """A small picture may say that it has a billion pixels; the colour is that of the material."""
    buffer = BytesIO()
    pytest.importorskip("PIL.Image").new("RGB", (8, 8), (0, 255, 0)).save(buffer, "PNG")
    picture, tree = buffer.getvalue(), json.loads(json.dumps(TREE))
    tree["images"] = [{"uri": "../secret.png"}, {"bufferView": 2, "mimeType": "image/png"}]
    tree["bufferViews"].append({"buffer": 0, "byteOffset": 96, "byteLength": len(picture)})
    tree["buffers"][0]["byteLength"] += len(picture)
    tree["textures"] = [{"source": 1}]
    shading = {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 0, 0, 1]}
    tree["materials"] = [{"pbrMetallicRoughness": shading, "normalTexture": {"index": 0}}]
    tree["meshes"][0]["primitives"][0]["material"] = 0
    (tmp_path / "a.glb").write_bytes(glb(tree, DATA + picture))
    assert read_mesh(tmp_path / "a.glb").color == (1, 0, 0, 1)


def test_what_is_no_mesh_is_left_out(tmp_path):
    """Skins, animations, unread accessors, and extensions that only change how a shape looks."""
    tree = json.loads(json.dumps(TREE)) | {
        "extensionsRequired": ["KHR_materials_unlit"], "cameras": [{}], "skins": [{}], "animations": [{}],
        "extras": {"a": 1},
    }  # fmt: skip
    tree["accessors"].insert(0, {"componentType": 5126, "count": 9, "type": "MAT4", "sparse": {}})
    tree["meshes"][0]["primitives"] = [{"attributes": {"POSITION": 1, "JOINTS_0": 0}, "indices": 2}]
    (tmp_path / "a.glb").write_bytes(glb(tree))
    assert len(read_mesh(tmp_path / "a.glb").triangles) == 4


@pytest.mark.parametrize("suffix", ["gltf", "3mf", "zip", "off", "STEP", "dae.gz", "xyz"])
def test_only_the_kinds_that_are_known_reach_the_library(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(reader, "ask", lambda *_, **__: pytest.fail("it does"))
    (tmp_path / f"a.{suffix}").write_bytes(b"OFF\n")
    with pytest.raises(VrxError) as caught:
        read_mesh(tmp_path / f"a.{suffix}")
    assert str(caught.value) == f"expected a mesh that ends in .obj, .stl, .dae, .ply or .glb, got 'a.{suffix}'"


JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 2**40) | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=4,
)
PLACES = [(part,) for part in TREE] + [
    (part, 0, key) for part, items in TREE.items() if isinstance(items, list) for key in items[0]
]  # fmt: skip


@pytest.mark.slow
@given(place=st.sampled_from(PLACES), value=JSON)
def test_no_json_ends_in_anything_but_a_mesh_or_a_message(tmp_path_factory, place, value):
    file = tmp_path_factory.mktemp("glb") / "a.glb"
    file.write_bytes(changed(*place, to=value))
    with suppress(VrxError):
        read_mesh(file)
