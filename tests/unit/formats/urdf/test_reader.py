"""URDF text: links, joints, shapes, the tree, and every broken file's whole message."""

import io
import math
import random
import re
import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.formats.urdf.model import Limits, chain
from vrx_mj.formats.urdf.reader import MeshFiles, read_urdf
from vrx_mj.frames import inverse

TESTS = Path(__file__).parents[3]
BROKEN = TESTS / "broken" / "urdf"
GOLDEN = TESTS / "golden" / "urdf" / "wamv.urdf"
CASES = sorted(file.name for file in BROKEN.glob("*.urdf"))

INERTIAL = '<inertial><mass value="10"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
BOX = '<visual><geometry><box size="1 2 3"/></geometry>{}</visual>'
angles = st.floats(-3.1, 3.1)
poses = st.tuples(*[st.floats(-50, 50)] * 3, *[angles] * 3)


@pytest.fixture(scope="module")
def wamv():
    return read_urdf(GOLDEN.read_text(encoding="utf-8"), GOLDEN)


def read(*parts, folder=Path(), **kinds):
    return read_urdf(f'<robot name="boat">{"".join(parts)}</robot>', folder / "boat.urdf", **kinds)


def link(name="hull", inner=INERTIAL):
    return f'<link name="{name}">{inner}</link>'


def joint(parent, child, kind="fixed", inner=""):
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{parent}_{child}" type="{kind}">{ends}{inner}</joint>'


def matrix(pose):
    """The 4x4 matrix of a pose, in NumPy."""
    roll, pitch, yaw = pose[3:]
    x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    z = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    full = np.eye(4)
    full[:3, :3], full[:3, 3] = z @ y @ x, pose[:3]
    return full


@pytest.mark.parametrize("name", CASES, ids=[name.removesuffix(".urdf") for name in CASES])
def test_a_broken_file_says_what_and_where(name, monkeypatch):
    monkeypatch.chdir(BROKEN)
    expected = Path(name).with_suffix(".expected").read_text(encoding="utf-8")
    with pytest.raises(VrxError) as caught:
        read_urdf(Path(name).read_text(encoding="utf-8"), Path(name))
    assert str(caught.value) == expected.rstrip("\n")


def test_there_are_enough_broken_files():
    assert len(CASES) >= 50


def test_no_message_speaks_of_parsers():
    text = "\n".join(file.read_text(encoding="utf-8") for file in BROKEN.glob("*.expected"))
    assert not re.search(r"lxml|libxml|Traceback|pydantic|trimesh|NoneType|Error:|XML_|None", text)


def test_a_file_of_vrx_reads_without_a_warning(wamv):
    assert (wamv.name, wamv.root, wamv.namespace) == ("WAM-V", "wamv/base_link", "wamv")
    assert len(wamv.joints) == len(wamv.links) - 1
    assert wamv.local("wamv/gps_wamv_link") == "gps_wamv_link"


def test_masses_add_up_to_the_wamv_with_these_sensors(wamv):
    camera, lidar = 0.3 + 0.1 + 0.9 * 0.1765, 1.0 + 0.1 + 0.9 * 0.4535
    parts = 180 + 2 * 23.5 + 2 * (15 + 0.5) + camera + lidar + 1.0 + 0.1 + 2 * 0.5  # VRX's masses
    assert sum(part.inertial.mass for part in wamv.links.values() if part.inertial) == pytest.approx(parts, abs=1e-12)


def test_values_are_as_in_the_file(wamv):
    battery = wamv.links["wamv/left_battery_link"]
    assert battery.inertial.pose == (0, 0, 0.15, 0, 0, 0)
    assert battery.inertial.tensor == (0.5015291666666667, 0.8931958333333333, 1.0183333333333333, 0, 0, 0)
    assert (battery.collisions[0].name, battery.collisions[0].size) == ("left_battery_collision", (0.6, 0.4, 0.31))
    floating = wamv.links["wamv/dummy_link"].collisions[0]
    assert (floating.type, floating.length, floating.radius) == ("cylinder", 4, 0.2)
    assert floating.pose == (-0.4, 1.03, 0.2, 0, 1.57, 0)
    engine = wamv.joints["wamv/left_chasis_engine_joint"]
    assert (engine.type, engine.axis, engine.is_locked) == ("revolute", (0, 0, 1), False)
    assert engine.limits == Limits(-math.pi, math.pi, 10, 10)
    assert wamv.joints["wamv/gps_wamv_joint"].is_locked


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("wamv/left_propeller_link", (-2.651932, 1.027135, -0.191134, 0, 0, 0)),
        ("wamv/front_left_camera_link", (0.75, 0.1, 1.5, 0, math.radians(15), 0)),
        ("wamv/lidar_wamv_link", (0.7, 0, 1.8, 0, math.radians(8), 0)),
        ("wamv/imu_wamv_link", (0.3, -0.2, 1.3, 0, 0, 0)),
    ],
)
def test_links_are_where_vrx_puts_them(wamv, name, place):
    assert wamv.places[name] == pytest.approx(place, abs=1e-12)


def test_links_are_where_yourdfpy_finds_them(wamv):
    """A second implementation of the tree, the masses and the inertias."""
    import yourdfpy

    other = yourdfpy.URDF.load(io.BytesIO(GOLDEN.read_bytes()), load_meshes=False)
    assert other.base_link == wamv.root
    for name, part in wamv.links.items():
        assert matrix(wamv.places[name]) == pytest.approx(other.get_transform(name, wamv.root), abs=1e-12)
        theirs = other.link_map[name]
        assert len(part.collisions) == len(theirs.collisions)
        if part.inertial is not None:
            xx, yy, zz, xy, xz, yz = part.inertial.tensor
            assert part.inertial.mass == theirs.inertial.mass
            assert theirs.inertial.inertia == pytest.approx(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


@given(first=poses, second=poses, third=poses)
def test_chained_poses_are_products_of_matrices(first, second, third):
    product = matrix(first) @ matrix(second) @ matrix(third)
    assert matrix(chain(first, second, third)) == pytest.approx(product, abs=1e-9)  # angles near the gimbal


@given(pose=poses)
def test_a_pose_and_its_inverse_cancel(pose):
    assert matrix(chain(pose, inverse(pose))) == pytest.approx(np.eye(4), abs=1e-9)


@pytest.mark.parametrize("yaw", [-1.0, 0.0, 2.5])
def test_poses_that_look_straight_up_survive(yaw):
    pose = (1, 2, 3, 0, math.pi / 2, yaw)
    assert matrix(chain(pose)) == pytest.approx(matrix(pose), abs=1e-12)


def test_meshes_of_vrx_have_stand_ins_in_their_place(wamv):
    files = [visual.file for visual in wamv.links["wamv/dummy_link"].visuals]
    assert files == ["meshes/hulls.obj", "meshes/trim.obj", "meshes/arches.obj", "meshes/deck.obj"]
    for part in wamv.links.values():
        for visual in part.visuals:  # ours are drawn in the link's frame, wherever VRX draws its own
            if visual.type == "mesh":
                assert (visual.folder / visual.file).is_file()
                assert matrix(visual.pose) == pytest.approx(np.eye(4), abs=1e-12)


def test_gazebo_colours_win(wamv):
    assert wamv.links["wamv/front_left_camera_post_link"].visuals[0].color == (0, 0, 0, 1)
    grey = '<gazebo reference="hull"><material>Gazebo/DarkGrey</material></gazebo>'
    own = '<material name="red"><color rgba="1 0 0 1"/></material>'
    assert read(link(inner=INERTIAL + BOX.format(own)), grey).links["hull"].visuals[0].color == (0.175,) * 3 + (1,)


def test_colours_go_by_name():
    red = '<material name="red"><color rgba="1 0 0 0.5"/></material>'
    urdf = read(red, link(inner=INERTIAL + BOX.format('<material name="red"/>') + BOX.format("")))
    assert [visual.color for visual in urdf.links["hull"].visuals] == [(1, 0, 0, 0.5), (0.5, 0.5, 0.5, 1)]


def test_a_post_of_negative_length_is_left_out():
    shape = '<{0}><geometry><cylinder length="-0.0235" radius="0.0076"/></geometry></{0}>'
    mass = '<inertial><mass value="-0.02115"/><inertia ixx="-1e-6" iyy="-1e-6" izz="-6e-7"/></inertial>'
    posts = [link(f"{side}_post_link", shape.format("visual") + shape.format("collision") + mass) for side in "ab"]
    with pytest.warns(VrxWarning) as caught:
        urdf = read(link(), *posts, joint("hull", "a_post_link"), joint("hull", "b_post_link"))
    assert [str(warning.message) for warning in caught] == [
        (
            "boat.urdf: posts of sensors that end below the deck: VRX gives them a negative length, so they have "
            "no mass and no shape: a_post_link, b_post_link"
        )
    ]
    post = urdf.links["a_post_link"]
    assert (post.inertial, post.visuals, post.collisions) == (None, (), ())


def test_a_light_part_may_have_an_impossible_inertia():
    part = '<inertial><mass value="0.05"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-3"/></inertial>'
    with pytest.warns(VrxWarning) as caught:
        read(link(), link("imu", part), joint("hull", "imu"))
    assert [str(warning.message) for warning in caught] == [
        (
            "boat.urdf: impossible moments of inertia, negative or above the sum of the other two; they are used "
            "as given: imu"
        )
    ]


def inertial(mass, *moments):
    moments = " ".join(f'i{axis}{axis}="{moment}"' for axis, moment in zip("xyz", moments, strict=True))
    return f'<inertial><mass value="{mass}"/><inertia {moments}/></inertial>'


@pytest.mark.parametrize(
    ("moments", "said"), [((-2.4e-35, 0, 2.4e-35), 0), ((-3.5e-8, 1e-6, 1e-6), 1), ((1e-7, 1e-7, 3e-7), 1)]
)
def test_moments_that_are_off_by_rounding_refuse_no_robot(moments, said):
    """Of a heavy link, as iCub has it; a light one, as TIAGo's antennas, may have any."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        urdf = read(link(), link("head", inertial(2.5, *moments)), joint("hull", "head"))
    assert urdf.links["head"].inertial.tensor[:3] == moments
    assert [str(warning.message).partition(": ")[2][:30] for warning in caught] == [
        "impossible moments of inertia,"
    ] * said


def test_a_light_part_may_have_a_negative_moment():
    with pytest.warns(VrxWarning, match="impossible moments of inertia, negative or above the"):
        urdf = read(link(), link("antenna", inertial(1e-6, -3.5e-8, 3.5e-8, 9.1e-8)), joint("hull", "antenna"))
    assert urdf.links["antenna"].inertial.tensor[0] == -3.5e-8


def test_a_light_part_with_a_large_impossible_moment_refuses_the_robot():
    with pytest.raises(VrxError, match="link 'screw' / inertial / inertia: impossible moments of inertia"):
        read(link(), link("screw", inertial(0.05, 1, 1, 200)), joint("hull", "screw"))


@given(mass=st.floats(1e-3, 1e3), size=st.floats(1e-3, 10), share=st.floats(1e-3, 1))
def test_a_moment_below_0_by_more_than_a_millimetre_and_rounding_is_impossible(mass, size, share):
    moments = mass * size**2, mass * size**2, -share * mass * size**2 - 2e-6 * mass - 1e-7
    with pytest.raises(VrxError, match="impossible moments of inertia: about the principal axes they are -"):
        read(link(inner=inertial(mass, *moments)))


def test_limits_of_1e16_are_none():
    """As Gazebo writes them, and iris_description has them: a hinge turns freely, a slide as far as numbers go."""
    limit = '<limit lower="-1e16" upper="1e16" effort="1e18" velocity="3"/>'
    found = {
        kind: read(link(), link("arm", ""), joint("hull", "arm", kind, limit)).joints["hull_arm"]
        for kind in ("revolute", "prismatic", "continuous")
    }
    assert [joint.type for joint in found.values()] == ["continuous", "prismatic", "continuous"]
    assert {joint.limits for joint in found.values()} == {Limits(-1e12, 1e12, 1e12, 3)}


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (
            [link("frame", '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0"/></inertial>')],
            "links with mass 0; they are treated as links without mass: frame",
        ),
        ([link("frame", "<visual/>")], "visuals without a geometry; they are ignored: frame"),
        (
            [link("frame", '<visual><geometry><mesh filename="package://a/b.dae"/></geometry></visual>')],
            "meshes not found in the folders that may be read; they are not drawn: package://a/b.dae",
        ),
        (
            [link("frame", '<visual><geometry><mesh filename="ftp://a.org/b.dae"/></geometry></visual>')],
            (
                "meshes that cannot be read; they are not drawn: no downloads: expected a path, package://, model:// "
                "or file://, got 'ftp://a.org/b.dae'"
            ),
        ),
        (
            [link("frame"), '<gazebo reference="frame"><sensor type="imu"><pose>1 0 2 0 0</pose></sensor></gazebo>'],
            (
                "poses of three to five numbers; as in Gazebo classic, their angles are 0 (newer Gazebo refuses the "
                "file): '1 0 2 0 0' on line 1"
            ),
        ),
    ],
)  # fmt: skip
def test_what_is_odd_is_said_once(parts, message):
    with pytest.warns(VrxWarning) as caught:
        read(link(), *parts, joint("hull", "frame"))
    assert [str(warning.message) for warning in caught] == [f"boat.urdf: {message}"]


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("many.stl", b"\0" * 80 + (200_001).to_bytes(4, "little") + b"\0" * 50 * 200_001, (
            "mesh many.stl has 200,001 triangles; at most 200,000 are allowed: simplify it, for example with Blender's "
            "Decimate")),
        ("empty.obj", b"", "mesh empty.obj is empty: it has no triangles"),
        ("a.gltf", b"{}", "expected a mesh that ends in .obj, .stl, .dae, .ply or .glb, got 'a.gltf'"),
    ],
)  # fmt: skip
def test_a_mesh_that_is_only_looked_at_is_left_out_and_one_that_is_touched_refused(name, content, reason, tmp_path):
    (tmp_path / name).write_bytes(content)
    shape = f'<geometry><mesh filename="{name}"/></geometry>'
    with pytest.warns(VrxWarning) as caught:
        urdf = read(link(inner=f"{INERTIAL}{f'<visual>{shape}</visual>' * 2}"), folder=tmp_path)
    assert urdf.links["hull"].visuals == ()
    assert [str(warning.message).partition(": ")[2] for warning in caught] == [
        f"meshes that cannot be read; they are not drawn: {reason}"
    ]
    with pytest.raises(VrxError, match="collision"):
        read(link(inner=f"{INERTIAL}<collision>{shape}</collision>"), folder=tmp_path)


def test_what_is_lost_and_what_is_unknown_is_a_remark():
    mimic = '<mimic joint="other"/>'
    urdf = read(link(), link("arm", '<colision size="1"/>'), joint("hull", "arm", "continuous", mimic))
    assert [remark[1:] for remark in urdf.remarks] == [
        ("<colision>", "not recognized; did you mean 'collision'?"),
        ("<mimic>", "mimic joints are not simulated"),
    ]


def test_namespaces_that_xacro_left_are_no_remark():
    """ROS Melodic's xacro writes them on the robot and on what it copies."""
    names = ' xmlns:xacro="http://ros.org/wiki/xacro"'
    text = f'<robot name="b"{names}>{link()}<gazebo><plugin{names} name="p" filename="libx.so"/></gazebo></robot>'
    assert read_urdf(text, Path("b.urdf")).remarks == ()


def test_what_is_missing_has_urdfs_defaults():
    urdf = read(link(), link("arm", ""), joint("hull", "arm", "continuous"))
    arm = urdf.joints["hull_arm"]
    assert (arm.pose, arm.axis, arm.limits) == ((0, 0, 0, 0, 0, 0), (1, 0, 0), None)
    assert (urdf.namespace, urdf.local("arm"), urdf.links["hull"].place.line) == ("", "arm", 1)


def test_an_axis_has_length_one():
    axis = '<axis xyz="0 3 4"/>'
    urdf = read(link(), link("arm", ""), joint("hull", "arm", "continuous", axis))
    assert urdf.joints["hull_arm"].axis == pytest.approx((0, 0.6, 0.8))


def test_a_declared_encoding_and_a_byte_order_mark_are_no_obstacle():
    text = f'\ufeff<?xml version="1.0" encoding="ISO-8859-1"?>\n<robot name="b">{link("船")}</robot>'
    assert read_urdf(text, Path("b.urdf")).root == "船"


def test_only_the_hull_of_cora_has_the_namespace():
    parts = link("cora/base_link", ""), link("cora/dummy_link"), link("left_engine_link")
    urdf = read(*parts, joint("cora/base_link", "cora/dummy_link"), joint("cora/base_link", "left_engine_link"))
    assert (urdf.namespace, urdf.local("left_engine_link")) == ("cora", "left_engine_link")


def collision(name):
    return link(inner=f'{INERTIAL}<collision><geometry><mesh filename="{name}"/></geometry></collision>')


@pytest.fixture
def packages(tmp_path):
    """A URDF's folder, a package found by its folder's name, and one by its package.xml; each with a mesh."""
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    for place in ("boat/meshes", "packages/my_boat/meshes", "elsewhere/meshes", "secret"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "hull part.obj").write_text(corners, encoding="utf-8")
    (tmp_path / "elsewhere" / "package.xml").write_text("<package><name>other</name></package>", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("name", "folder", "path"),
    [
        ("meshes/hull part.obj", "boat", "meshes/hull part.obj"),
        ("file://meshes/hull%20part.obj", "boat", "meshes/hull part.obj"),
        ("file://{}/boat/meshes/hull part.obj", "boat", "meshes/hull part.obj"),
        ("{}/elsewhere/meshes/hull part.obj", "elsewhere", "meshes/hull part.obj"),
        ("package://my_boat/meshes/hull part.obj", "packages", "my_boat/meshes/hull part.obj"),
        ("model://my_boat/meshes/hull part.obj", "packages", "my_boat/meshes/hull part.obj"),
        ("package://other/meshes/hull part.obj", "elsewhere", "meshes/hull part.obj"),
        ("package://named/hull part.obj", "elsewhere/meshes", "hull part.obj"),
        ("package://boat/meshes/hull part.obj", "boat", "meshes/hull part.obj"),
        ("package://my_boat/meshes/../meshes/hull part.obj", "packages", "my_boat/meshes/hull part.obj"),
    ],
)
def test_meshes_are_found(packages, name, folder, path):
    urdf = read(
        collision(name.format(packages.as_posix())),
        folder=packages / "boat",
        files=MeshFiles(
            packages / "boat",
            {"named": packages / "elsewhere" / "meshes"},
            [packages / "packages", packages / "elsewhere"],
        ),
    )
    shape = urdf.links["hull"].collisions[0]
    assert (shape.folder / shape.file).samefile(packages / folder / path)
    assert not Path(shape.file).is_absolute()


@pytest.mark.parametrize(
    "name",
    [
        "../secret/hull part.obj",
        "meshes/../../secret/hull part.obj",
        "file://{}/secret/hull part.obj",
        "package://my_boat/../../secret/hull part.obj",
        "package://../secret/hull part.obj",
        "meshes/link.obj",
        "linked/hull part.obj",
    ],
)
def test_nothing_outside_the_folders_is_read(packages, name):
    (packages / "boat" / "meshes" / "link.obj").symlink_to(packages / "secret" / "hull part.obj")
    (packages / "boat" / "linked").symlink_to(packages / "secret", target_is_directory=True)
    with pytest.raises(VrxError, match=r"is outside the folders that may be read|no package named"):
        read(
            collision(name.format(packages.as_posix())),
            folder=packages / "boat",
            files=MeshFiles(packages / "boat", {}, [packages / "packages"]),
        )


def test_a_mirrored_mesh_keeps_its_scale(packages):
    text = collision("meshes/hull part.obj").replace("<mesh", '<mesh scale="1 -1 0.5"')
    assert read(text, folder=packages / "boat").links["hull"].collisions[0].scale == (1, -1, 0.5)


# A URDF of VRX changed at random: it is read, or refused with a message


VALUES = ["", "nan", "-1", "0", "1e400", "abc", "1 2", "-inf", "99999999999", "wamv/", "../x", "é", "a" * 300, "-0"]


@pytest.mark.parametrize("seed", range(80))
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_no_change_to_a_file_ends_in_anything_but_a_boat_or_a_message(seed):
    """VRX's file with elements taken out, moved and renamed, and values that are none."""
    choose = random.Random(seed)
    root = etree.fromstring(GOLDEN.read_bytes())
    for _ in range(choose.choice((1, 1, 2, 5))):
        nodes = [node for node in root.iter("*") if node is not root]
        node, other = choose.choice(nodes), choose.choice(nodes)
        change = choose.randrange(5)
        if change == 0:
            node.getparent().remove(node)
        elif change == 1 and node.attrib:
            node.set(choose.choice(sorted(node.attrib)), choose.choice(VALUES))
        elif change == 2:
            node.text = choose.choice(VALUES)
        elif change == 3:
            node.tag = other.tag
        elif node is not other and node not in other.iterancestors():
            other.append(node)
    with suppress(VrxError):
        read_urdf(etree.tostring(root, encoding="unicode"), GOLDEN)
