"""Models of Gazebo as objects: masses and inertias by closed form, poses in degrees, shapes, composites, docks."""

import math
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.config.loading import Loading, validate
from vrx_mj.config.objects import ObjectConfig
from vrx_mj.config.search import kind_name
from vrx_mj.errors import ConfigError
from vrx_mj.formats.gazebo.document import Report, read_document
from vrx_mj.formats.gazebo.sdf_models import pose_of, safe_name
from vrx_mj.formats.gazebo.sdf_objects import model_of_text, model_section
from vrx_mj.frames import compose, rotation

HERE = (0.0,) * 6
SPHERE = '<collision name="c"><geometry><sphere><radius>1</radius></sphere></geometry></collision>'


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def words(values):
    """Numbers as a file has them."""
    return " ".join(map(repr, values))


def link(mass, inertia, pose=HERE, inner=HERE, name="link", content=""):
    """A link with an inertial of its own pose; the inertia is ixx iyy izz ixy ixz iyz."""
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    tensor = "".join(f"<{key}>{value!r}</{key}>" for key, value in zip(keys, inertia, strict=True))
    inertial = f"<inertial><pose>{words(inner)}</pose><mass>{mass!r}</mass><inertia>{tensor}</inertia></inertial>"
    return f'<link name="{name}"><pose>{words(pose)}</pose>{inertial}{content}</link>'


def read(body, file="buoy.sdf", name="buoy"):
    """The object of a model, and its notes."""
    path = Path(file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<sdf version="1.6"><model name="{name}">{body}</model></sdf>', encoding="utf-8")
    report = Report()
    return model_section(path, report), report.notes


def tensor(inertia):
    """A symmetric matrix of ixx iyy izz ixy ixz iyz."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


poses = st.tuples(*[st.floats(-3, 3)] * 6)
parts = st.tuples(
    st.floats(0.1, 20),
    st.tuples(*[st.floats(1.5, 2)] * 3, *[st.floats(-0.1, 0.1)] * 3),
    poses,
    poses,
)


@given(parts=st.lists(parts, min_size=1, max_size=4))
def test_links_are_one_body_by_parallel_axes(parts, tmp_path_factory):
    file = tmp_path_factory.mktemp("model") / "buoy.sdf"
    found, _ = read("".join(link(*part, name=f"l{i}") for i, part in enumerate(parts)) + FLOAT, file)
    mass = sum(part[0] for part in parts)
    places = [compose(part[2], part[3]) for part in parts]
    center = sum(part[0] * np.array(place[:3]) for part, place in zip(parts, places, strict=True)) / mass
    whole = np.zeros((3, 3))
    for part, place in zip(parts, places, strict=True):
        turn, arm = np.array(rotation(*place[3:])), np.array(place[:3]) - center
        cross = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        whole += turn @ tensor(part[1]) @ turn.T - part[0] * cross @ cross
    assert found["mass"] == pytest.approx(mass)
    assert list(found["center_of_mass"]) == pytest.approx(list(center), abs=1e-9)
    assert tensor((*found["inertia"], 0.0, 0.0, 0.0)[:6]) == pytest.approx(whole, abs=1e-7)


FLOAT = (
    '<plugin filename="libbuoyancy_gazebo_plugin.so"><linear_drag>25</linear_drag><angular_drag>2</angular_drag>'
    "<buoyancy><link_name>l0</link_name><geometry><sphere><radius>3</radius></sphere></geometry></buoyancy></plugin>"
)


def test_two_balls_on_a_rod():
    ball = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    ends = [link(2.0, ball, (x, 0.0, 0.0, 0.0, 0.0, 0.0), name=f"l{i}") for i, x in enumerate((-3.0, 3.0))]
    found, _ = read("".join(ends) + FLOAT)
    assert (found["mass"], list(found["center_of_mass"])) == (4.0, [0, 0, 0])
    assert list(found["inertia"]) == [2.0, 2.0 + 4 * 9, 2.0 + 4 * 9]  # m r2 of both ends


def test_a_turned_link_turns_its_inertia_and_its_shapes():
    turned = (0.0, 0.0, 0.0, 0.0, 0.0, math.pi / 2)
    found, _ = read(link(5.0, (1.0, 2.0, 2.5, 0.0, 0.0, 0.0), turned, name="l0", content=SPHERE) + FLOAT)
    assert list(found["inertia"]) == pytest.approx([2.0, 1.0, 2.5])
    assert list(found["collisions"][0]["pose"]) == pytest.approx(turned)


def test_products_of_inertia_are_kept():
    found, notes = read(link(5.0, (1.0, 1.0, 1.0, 0.2, 0.0, 0.0), name="l0") + FLOAT)
    assert list(found["inertia"]) == [1.0, 1.0, 1.0, 0.2, 0.0, 0.0]
    assert [note.fate for note in notes] == ["imported"]


def test_a_negative_moment_of_rounding_is_the_least_there_is():
    found, _ = read(link(5.0, (1.0, 1.0, -3.5e-8, 0.0, 0.0, 0.0), name="l0") + FLOAT)
    assert list(found["inertia"]) == pytest.approx([1.0, 1.0, 1e-9])
    validate(ObjectConfig, found, Loading())


def test_a_negative_moment_of_rounding_refuses_no_light_model():
    found, _ = read(link(0.01, (-3.5e-8, 2e-6, 2e-6, 0.0, 0.0, 0.0), name="l0") + FLOAT)
    assert min(found["inertia"]) == pytest.approx(1e-9)
    validate(ObjectConfig, found, Loading())


def test_a_link_without_inertial_has_one_kilogram():
    found, _ = read('<link name="l0"/>' + FLOAT)
    assert (found["mass"], list(found["inertia"])) == (1.0, [1.0, 1.0, 1.0])


def test_what_has_no_buoyancy_plugin_floats_on_its_shapes_or_stands():
    light, notes = read(link(100.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), content=SPHERE))
    assert [one["type"] for one in light["buoyancy"]["elements"]] == ["sphere"]
    assert notes[-1].ours == "it has no buoyancy plugin: its collision shapes displace water"
    heavy, notes = read(link(5000.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), content=SPHERE))
    assert heavy["static"] is True
    assert notes[-1].ours == "it has no buoyancy plugin it would sink (5000 kg, 4.19 m3), so it is `static: true`"


def test_models_in_models_are_part_of_the_body():
    inner = link(1.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), name="l1")
    deep = f'<model name="b"><pose>0 2 0 0 0 0</pose>{inner}</model>'
    outer = f'<model name="a"><pose>4 0 0 0 0 0</pose>{deep}</model>'
    found, _ = read(link(1.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), name="l0") + outer + FLOAT)
    assert (found["mass"], list(found["center_of_mass"])) == (2.0, [2.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("shape", "keys"),
    [
        ("<box><size>1 2 3</size></box>", {"type": "box", "size": (1.0, 2.0, 3.0)}),
        ("<sphere><radius>2</radius></sphere>", {"type": "sphere", "radius": 2.0}),
        (
            "<cylinder><radius>2</radius><length>3</length></cylinder>",
            {"type": "cylinder", "radius": 2.0, "length": 3.0},
        ),
        ("<capsule><radius>2</radius><length>3</length></capsule>", {"type": "capsule", "radius": 2.0, "length": 3.0}),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", {"type": "ellipsoid", "size": (2.0, 4.0, 6.0)}),
    ],
)
def test_shapes(shape, keys):
    body = f'<static>true</static><link name="l"><visual name="v"><geometry>{shape}</geometry></visual></link>'
    assert dict(read(body)[0]["visuals"][0]) == keys


@pytest.mark.parametrize(
    ("material", "color"),
    [
        ("<diffuse>0.1 0.2 0.3</diffuse>", (0.1, 0.2, 0.3, 1.0)),
        ("<ambient>0.1 0.2 0.3 0.4</ambient>", (0.1, 0.2, 0.3, 0.4)),
        ("<script><name>Gazebo/Red</name></script>", (1, 0, 0, 1)),
        ("<script><name>Other/Paint</name></script>", None),
    ],
)
def test_colors(material, color):
    visual = f'<visual name="v"><geometry><box/></geometry><material>{material}</material></visual>'
    found, _ = read(f'<static>true</static><link name="l">{visual}</link>')
    assert found["visuals"][0].get("color") == color


@pytest.mark.parametrize(
    "uri", ["meshes/a.stl", "model://wall/meshes/a.stl", "file://meshes/a.stl", "file://wall/meshes/a.stl"]
)
def test_meshes_of_the_folder_of_the_model(uri):
    Path("wall/meshes").mkdir(parents=True)
    Path("wall/meshes/a.stl").write_bytes(b"")
    mesh = f"<mesh><uri>{uri}</uri><scale>1 2 3</scale></mesh>"
    visual = f'<visual name="v"><geometry>{mesh}</geometry></visual>'
    found, _ = read(f'<static>true</static><link name="l">{visual}</link>', "wall/model.sdf", "wall")
    assert dict(found["visuals"][0]) == {"type": "mesh", "file": "meshes/a.stl", "scale": (1.0, 2.0, 3.0)}


def mesh_model(uri):
    """A model with a mesh, in a package of a search path."""
    mesh = f'<visual name="v"><geometry><mesh><uri>{uri}</uri></mesh></geometry></visual>'
    return f'<static>true</static><link name="l">{mesh}</link>'


@pytest.fixture
def ports(tmp_path, monkeypatch):
    """A package with a model and meshes beside it, another model on the path, and a mesh that nothing may read."""
    files = ("ports/meshes/a.stl", "ports/models/wall/b.stl", "shelf/crate/meshes/a.stl", "secret/a.stl", "a.stl")
    for name in files:
        (tmp_path / "ws" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "ws" / name).write_bytes(b"")
    (tmp_path / "ws/ports/package.xml").write_text("<package><name>ports</name></package>", encoding="utf-8")
    (tmp_path / "ws/shelf/crate/model.sdf").write_text("<sdf/>", encoding="utf-8")
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(tmp_path / "ws/shelf"))
    monkeypatch.chdir(tmp_path / "ws")
    return tmp_path / "ws"


@pytest.mark.parametrize(
    ("uri", "file"),
    [
        ("model://crate/meshes/a.stl", "shelf/crate/meshes/a.stl"),
        ("file://crate/meshes/a.stl", "shelf/crate/meshes/a.stl"),
        ("package://ports/meshes/a.stl", "ports/meshes/a.stl"),
        ("../../meshes/a.stl", "ports/meshes/a.stl"),
        ("file://../../meshes/a.stl", "ports/meshes/a.stl"),
        ("file://@/ports/meshes/a.stl", "ports/meshes/a.stl"),
        ("@/shelf/crate/meshes/a.stl", "shelf/crate/meshes/a.stl"),
        ("../wall/b.stl", "ports/models/wall/b.stl"),
    ],
)
def test_meshes_elsewhere_in_the_package_and_along_the_paths(uri, file, ports):
    found, notes = read(mesh_model(uri.replace("@", str(ports))), "ports/models/wall/model.sdf", "wall")
    (shape,) = found["visuals"]
    assert (shape.folder / shape["file"]).resolve() == (ports / file).resolve()
    assert not notes


@pytest.mark.parametrize(
    "uri",
    [
        "../../../a.stl",
        "../../../secret/a.stl",
        "model://secret/a.stl",
        "model://../secret/a.stl",
        "model://crate/../../secret/a.stl",
        "model://crate/../../../../../../../../etc/passwd.stl",
        "package://ports/../secret/a.stl",
        "package://secret/a.stl",
        "file://secret/a.stl",
        "file://linked/a.stl",
        "file://crate/linked.stl",
        "file://crate/../../secret/a.stl",
        "file://wall/../../../secret/a.stl",
        "file://no_such_model/a.stl",
        "file:///etc/passwd.stl",
        "/etc/passwd.stl",
        "https://example.org/a.stl",
        "model://crate/meshes/../../../secret/a.stl",
        "model://crate/linked.stl",
        "model://linked/a.stl",
        "%2e%2e/../../secret/a.stl",
        "..\\..\\a.stl",
        "model:///a.stl",
        "model://" + "../" * 2000 + "a.stl",
        "file://\x7f/../a.stl",
    ],
)
def test_no_mesh_outside_of_package_and_paths_is_read(uri, ports):
    (ports / "shelf/crate/linked.stl").symlink_to(ports / "secret/a.stl")
    (ports / "shelf/linked").symlink_to(ports / "secret")
    found, notes = read(mesh_model(uri), "ports/models/wall/model.sdf", "wall")
    assert not found["visuals"]
    assert [one.fate for one in notes] == ["ignored"]


def test_angles_may_be_in_degrees():
    body = '<static>true</static><link name="l"><pose degrees="true">1 2 3 0 0 90</pose>' + SPHERE + "</link>"
    assert list(read(body)[0]["collisions"][0]["pose"]) == pytest.approx([1, 2, 3, 0, 0, math.pi / 2])


@pytest.mark.parametrize("static", ["", "<static>1</static>"])
def test_a_model_of_one_link_keeps_its_name(static):
    """Users ask ROS for `buoy::pontoon`, as in Gazebo."""
    found, _ = read(static + link(1.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), name="pontoon", content=SPHERE))
    assert found["link"] == "pontoon"


SHORT = "poses of three to five numbers; as in Gazebo classic, their angles are 0 (newer Gazebo refuses the file)"


@pytest.mark.parametrize("text", ["1 2 3", "1 2 3 0.5", "1 2 3 0 1.57"])
def test_a_short_pose_is_a_place_without_angles(text):
    """`operator>>` of ignition::math reads no angle unless it finds all three; sdformat 6 and 9 go on."""
    found, notes = read(f'<static>1</static><link name="l"><pose>{text}</pose>{SPHERE}</link>')
    assert list(found["collisions"][0]["pose"]) == [1, 2, 3, 0, 0, 0]
    assert [(one.what, one.fate, one.ours) for one in notes] == [
        ("<model> 'buoy'", "approximated", f"{SHORT}: '{text}' on line 1")
    ]
    model = f"<model name='own'><pose>{text}</pose><static>1</static><link name='l'/></model>"
    whole = model_of_text(f"<sdf>{model}</sdf>", Path("models"))
    assert (whole.pose, whole.notes) == ((1, 2, 3, 0, 0, 0), (f"<pose> '{text}' approximated: {SHORT}",))


@pytest.mark.parametrize(("text", "message"), [
    ("1 2", "expected 6 numbers x y z roll pitch yaw, got '1 2'"), ("1 2 3 4 x", "expected a number, got 'x'"),
    ("1 2 3 4 5 6 7", "expected 6 numbers x y z roll pitch yaw, got '1 2 3 4 5 6 7'"),
])  # fmt: skip
def test_a_pose_of_letters_or_without_a_place_is_refused(text, message):
    with pytest.raises(ConfigError) as refused:
        read(f'<static>1</static><link name="l"><pose>{text}</pose>{SPHERE}</link>')
    assert str(refused.value) == f"buoy.sdf:1: link 'l' / pose: {message}"


BODY = link(1.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), name="a", content=SPHERE)
STILL = '<static>1</static><link name="l"><visual name="v">{}</visual></link>'
JOINT = '<link name="b">{}</link><joint name="j" type="{}"><parent>a</parent><child>b</child></joint>'
LIFT = (
    '<plugin filename="libbuoyancy_gazebo_plugin.so"><buoyancy name="x"><link_name>a</link_name>{}</buoyancy></plugin>'
)


@pytest.mark.parametrize(
    ("body", "what", "why"),
    [
        (BODY + JOINT.format("", "gearbox"), "<joint> 'j'", "gearboxes are not simulated: each joint moves on its own"),
        (STILL.format("<geometry><mesh><uri>buoy.txt</uri></mesh></geometry>"),
         "<mesh>", "no such mesh: 'buoy.txt'"),
        (STILL.format("<geometry/>"), "<visual> 'v'", "<geometry> is empty"),
        (f"{BODY}{LIFT.format('<geometry><mesh/></geometry>')}",
         "<buoyancy> 'x'", "<mesh> shapes are not supported"),
        (f"{BODY}{LIFT.format('')}", "<buoyancy> 'x'", "it has no <geometry>"),
    ],
)  # fmt: skip
def test_what_we_have_not_is_ignored_with_a_note(body, what, why):
    note = read(body)[1][0]
    assert (note.what, note.fate, note.ours) == (what, "ignored", why)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("<include><uri>model://galleon</uri></include>" * 2,
         "buoy.sdf:1:20: <model> 'buoy': none of its models is known: galleon"),
        (BODY + JOINT.format("<inertial><mass>0</mass></inertial>", "revolute"),
         "buoy.sdf:1: link 'b': needs a mass, because it moves"),
        (f"{BODY}<include><uri>model://broken</uri></include>",
         "broken/model.sdf:1:6: the file ends before </sdf>, which ends the <sdf> of line 1"),
    ],
)  # fmt: skip
def test_a_model_that_cannot_be_one_of_ours_is_refused(body, message):
    Path("broken").mkdir()
    Path("broken/model.sdf").write_text("<sdf>", encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        read(body)
    assert str(refused.value) == message


def test_a_composite_names_its_parts():
    Path("float").mkdir()
    read(link(1.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), content=SPHERE), "float/model.sdf", "float")
    includes = "".join(
        f"<include><uri>model://{model}</uri>{name}<pose>{x} 0 0 0 0 0</pose></include>"
        for x, (model, name) in enumerate(
            (("float", ""), ("float", ""), ("surmark46104", "<name>can</name>"), ("galleon", ""))
        )
    )
    found, notes = read(includes, "course/model.sdf", "course")
    assert [(one["name"], one["model"], one["pose"][0]) for one in found["objects"]] == [
        ("float", "model://float", 0),
        ("float_1", "model://float", 1),
        ("can", "surmark46104", 2),
    ]
    assert [(note.what, note.fate) for note in notes][-1] == ("<include> 'model://galleon'", "ignored")


def test_parts_of_a_model_whose_name_ends_in_a_digit_are_numbered():
    Path("dock2").mkdir()
    read(link(1.0, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0), content=SPHERE), "dock2/model.sdf", "dock2")
    found, _ = read("<include><uri>model://dock2</uri></include>" * 3, "course/model.sdf", "course")
    assert [one["name"] for one in found["objects"]] == ["dock2", "dock2_1", "dock2_2"]


def test_a_layout_in_a_comment_of_a_template_is_none():
    Path("dock").mkdir()
    text = "<%\n# layout = ['X']\nx = 1  # layout = ['X']\nlayout = ['X X', 'XXX']\n%>\n"
    Path("dock/model.sdf.erb").write_text(text, encoding="utf-8")
    (dock,) = model_section(Path("dock/model.sdf.erb"))["docks"]
    assert list(dock["layout"]) == ["X X", "XXX"]


@pytest.mark.parametrize("count", [200, 201])
def test_a_template_has_at_most_200_rows(count):
    Path("dock").mkdir()
    rows = ", ".join(["'X'"] * count)
    Path("dock/model.sdf.erb").write_text(f"<%\nlayout = [{rows}]\n%>\n", encoding="utf-8")
    with nullcontext() if count == 200 else pytest.raises(ConfigError, match="expected quoted rows"):
        assert len(model_section(Path("dock/model.sdf.erb"))["docks"][0]["layout"]) == count


@pytest.mark.parametrize(("last", "dynamic"), [("true", None), ("false", True), (None, None)])
def test_a_template_of_a_dock_is_its_drawing(last, dynamic):
    rows = ["'X  X',  # the arms", '"XXXX"', *([last] if last else [])]
    text = "<sdf><model name='my_dock'>\n<%\nlayout = [\n" + ",\n".join(rows) + "\n]\n%>\n</model></sdf>"
    Path("dock").mkdir()
    Path("dock/model.sdf.erb").write_text(text.replace("arms,", "arms"), encoding="utf-8")
    found = model_section(Path("dock/model.sdf.erb"))
    assert found["description"] == "my_dock, a dock of Gazebo"
    (dock,) = found["docks"]
    assert (list(dock["layout"]), dock.get("dynamic")) == (["X  X", "XXXX"], dynamic)


@given(st.text(max_size=100))
def test_every_name_is_made_one_of_ours(text):
    name = safe_name(text)
    assert 1 <= len(name) <= 64
    assert set(name) <= set("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-")
    assert name[0] not in ".-"
    assert safe_name(name) == name


def test_no_pose_is_the_origin():
    Path("a.sdf").write_text("<sdf><model><pose/></model></sdf>", encoding="utf-8")
    assert pose_of(read_document(Path("a.sdf")).child("model")).value == [0.0] * 6


@pytest.mark.parametrize(("model", "kind"), [
    ("surmark46104", "surmark46104"),
    ("./objects/my_buoy.yaml", "my_buoy"),
    ("model://my_buoy", "my_buoy"),
    ("./my_buoy/model.sdf", "my_buoy"),
    ("my_dock/model.sdf.erb", "my_dock"),
    ("bay.world.xacro#box", "box"),
])  # fmt: skip
def test_a_kind_is_called_by_its_name_however_it_is_given(model, kind):
    assert kind_name(model) == kind


FRAMED = """<sdf version="1.9"><model name="m"><static>true</static>
  <frame name="mast"><pose>1 2 3 0 0 1.5707963267948966</pose></frame>
  <frame name="top" attached_to="mast"><pose>0 0 4 0 0 0</pose></frame>
  <link name="hull"><pose>5 0 0 0 0 0</pose>
    <collision name="c"><pose relative_to="top">1 0 0 0 0 0</pose>
      <geometry><box><size>1 1 1</size></box></geometry></collision></link>
  <link name="lamp"><pose relative_to="{lamp}">2 0 0 0 0 0</pose>
    <collision name="c"><geometry><box><size>2 1 1</size></box></geometry></collision></link>
  <model name="inner"><pose relative_to="lamp">0 0 1 0 0 0</pose>
    <link name="l"><collision name="c"><geometry><box><size>3 1 1</size></box></geometry></collision></link></model>
</model></sdf>"""


def framed(tmp_path, lamp):
    file = tmp_path / "m.sdf"
    file.write_text(FRAMED.format(lamp=lamp), encoding="utf-8")
    return model_section(file)


def test_poses_relative_to_frames_are_where_the_frames_are(tmp_path):
    """A quarter turn about z at (1, 2, 3): x of the frame is y of the model."""
    places = [shape["pose"] for shape in framed(tmp_path, "top")["collisions"]]
    expected = [(1, 3, 7), (1, 4, 7), (1, 4, 8)]
    assert [tuple(place[:3]) for place in places] == [pytest.approx(xyz) for xyz in expected]
    assert [place[5] for place in places] == pytest.approx([math.pi / 2] * 3)


@pytest.mark.parametrize(
    ("lamp", "message"),
    [
        ("tpo", "no frame named 'tpo'; known: hull, lamp, mast, top, inner, inner::l"),
        ("inner", "poses are relative to each other in a loop: 'lamp' > 'inner' > 'lamp'"),
    ],
)
def test_poses_relative_to_nothing_or_to_themselves_are_refused(tmp_path, lamp, message):
    with pytest.raises(ConfigError) as raised:
        framed(tmp_path, lamp)
    assert str(raised.value).splitlines()[0].endswith(f"m.sdf:7: link 'lamp' / pose: {message}")


@pytest.mark.parametrize("name", ["text", "models", "own", "model"])
def test_a_text_is_its_own_model_whatever_its_name(name):
    """The folders that texts are written to are no models that they could name."""
    text = f'<sdf version="1.6"><model name="{name}"><link name="link">{SPHERE}</link></model></sdf>'
    for number in range(2):
        found = model_of_text(text, Path("models"))
        assert (number, found.title, found.model) == (
            number,
            f"the SDF's own {name}",
            Path(f"models/own/{name}/model.sdf"),
        )
    assert [file for file in Path().rglob("*") if file.is_file()] == [found.model]
    with pytest.raises(ConfigError, match=f"no model '{name}' in"):
        model_of_text(f"<sdf><include><uri>model://{name}</uri></include></sdf>", Path("models"))
