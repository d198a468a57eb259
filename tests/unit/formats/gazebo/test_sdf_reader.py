"""SDF is read by one reader: what a boat, an object and a world's model have in common, and what holds them."""

import math
import warnings
from pathlib import Path

import pytest

from sdf_boats import link as boat_link
from sdf_boats import spinning, thruster
from vrx_mj.errors import VrxWarning
from vrx_mj.formats.gazebo.document import Report
from vrx_mj.formats.gazebo.models import model_element
from vrx_mj.formats.gazebo.sdf_boats import is_boat, read_boat
from vrx_mj.formats.gazebo.sdf_links import read_sdf_joint
from vrx_mj.formats.gazebo.sdf_models import Model
from vrx_mj.formats.gazebo.sdf_objects import model_section
from vrx_mj.formats.gazebo.worlds import gazebo_world
from vrx_mj.formats.urdf.model import relative

BOX = '<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>'
MASS = "<inertial><mass>10</mass><inertia><ixx>2</ixx><iyy>2</iyy><izz>2</izz></inertia></inertial>"
LINK = f'<link name="l">{MASS}{BOX}</link>'
CONE = f'<link name="l">{MASS}<collision name="c"><geometry><cone/></geometry></collision></link>'
TURNED = ' rotation_format="quat_xyzw"'
QUARTER = math.pi / 2


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def write(name, body, attributes=""):
    """A folder of a model."""
    Path(name).mkdir()
    text = f'<sdf version="1.9"><model name="{name}"{attributes}>{body}</model></sdf>'
    Path(name, "model.sdf").write_text(text, encoding="utf-8")
    return Path(name, "model.sdf")


def world(body):
    Path("bay.sdf").write_text(f'<sdf version="1.9"><world name="bay">{body}</world></sdf>', encoding="utf-8")
    return gazebo_world(Path("bay.sdf"))


def fixed(parent, child, kind="fixed", more=""):
    ends = f"<parent>{parent}</parent><child>{child}</child>"
    return f'<joint name="{parent}_{child}" type="{kind}">{ends}{more}</joint>'


LOCKED = "<axis><xyz>0 0 1</xyz><limit><lower>0</lower><upper>0</upper></limit></axis>"


@pytest.mark.parametrize(
    "joints",
    [
        fixed("world", "l"),
        fixed("l", "world"),
        fixed("world", "__model__"),
        fixed("world", "l", "revolute", LOCKED),
        '<link name="cap"/>' + fixed("l", "cap") + fixed("world", "l"),
        '<link name="cap"/>' + fixed("l", "cap") + fixed("world", "cap"),
        '<link name="cap"/>' + fixed("world", "cap") + fixed("cap", "l"),
    ],
)
def test_what_a_joint_fixes_to_the_world_stays(joints):
    found = model_section(write("pile", LINK + joints))
    assert found["static"] is True
    assert "links" not in found


def test_a_boat_that_a_joint_or_a_flag_holds_is_an_object():
    parts = boat_link("base_link", 20, (1, 2, 2)) + boat_link("screw", 1, (1, 1, 1))
    parts += spinning("drive", "base_link", "screw") + thruster("drive", 50)
    free, flag, held = (write(name, parts + more) for name, more in (
        ("free", ""), ("flag", "<static>1</static>"), ("held", fixed("world", "base_link"))))  # fmt: skip
    assert [is_boat(model_element(file).model) for file in (free, flag, held)] == [True, False, False]
    boats = world("".join(f"<include><uri>model://{name}</uri></include>" for name in ("free", "flag", "held"))).fleet
    assert [boat["name"] for boat in boats["boats"]] == ["free"]
    still = world("<include><uri>model://free</uri><static>true</static></include>")
    assert (still.fleet, [str(one["model"]) for one in still.section["objects"]]) == ("none", ["bay.sdf#free"])
    assert model_section(Path("bay.sdf#free"))["static"] is True


def test_an_inertia_may_be_that_of_the_shapes_of_an_object():
    """A box of 1 m3: m = rho V, I = m (b2 + c2) / 12."""
    body = f'<link name="l"><inertial auto="true"><density>600</density></inertial>{BOX}</link>'
    found = model_section(write("crate", body))
    assert found["mass"] == pytest.approx(600.0)
    assert list(found["inertia"]) == pytest.approx([100.0] * 3)
    assert list(found["center_of_mass"]) == pytest.approx([0.0] * 3, abs=1e-12)


def test_poses_may_be_quaternions_everywhere():
    half = f"{math.sqrt(0.5)!r}"
    body = f'<static>1</static><link name="l"><pose{TURNED}>1 0 0 0 0 {half} {half}</pose>{BOX}</link>'
    write("wall", body)
    pose = f"<pose{TURNED}>10 0 0 0 0 {half} {half}</pose>"
    (thing,) = world(f"<include><uri>model://wall</uri>{pose}</include>").section["objects"]
    assert list(thing["pose"]) == pytest.approx([10, 0, 0, 0, 0, QUARTER])
    (shape,) = model_section(Path("wall/model.sdf"))["collisions"]
    assert list(shape["pose"]) == pytest.approx([1, 0, 0, 0, 0, QUARTER])


def test_an_object_may_include_models_merge_them_and_hang_them_on_joints():
    write("wing", f'<link name="tip"><pose>0 1 0 0 0 0</pose>{MASS}{BOX}</link>')
    include = "<include{}><uri>model://wing</uri><name>w</name><pose>0 3 0 0 0 0</pose></include>"
    one = model_section(write("one", LINK + include.format("") + fixed("l", "w::tip")))
    assert (one["mass"], list(one["center_of_mass"])) == (20.0, [0, 2, 0])
    whole = model_section(write("whole", LINK + include.format("") + fixed("__model__", "w")))
    assert (whole["mass"], list(whole["center_of_mass"])) == (20.0, [0, 2, 0])
    merged = model_section(write("two", LINK + include.format(' merge="1"') + fixed("l", "tip", "revolute")))
    (tip,) = merged["links"]
    assert (tip["name"], list(tip["pose"]), merged["mass"]) == ("tip", [0, 4, 0, 0, 0, 0], 10.0)


MAST = f'{LINK}<frame name="top"><pose>0 0 5 0 0 {QUARTER!r}</pose></frame>'


@pytest.mark.parametrize(
    "body",
    [
        "<include><uri>model://mast</uri><pose>1 2 5 0 0 0</pose><placement_frame>top</placement_frame></include>",
        f'<model name="mast" placement_frame="top"><pose>1 2 5 0 0 0</pose>{MAST}</model>',
    ],
)
def test_a_placement_frame_is_where_the_pose_says(body):
    """The frame is turned by a quarter in its model, so the model is turned back by it, and 5 m lower."""
    write("mast", MAST)
    (thing,) = world(body).section["objects"]
    assert list(thing["pose"]) == pytest.approx([1, 2, 0, 0, 0, -QUARTER], abs=1e-12)


def test_a_placement_frame_in_a_model_is_where_the_pose_says():
    write("mast", MAST)
    place = "<pose>1 2 5 0 0 0</pose><placement_frame>top</placement_frame>"
    include = f"<include><uri>model://mast</uri><name>m</name>{place}</include>"
    found = model_section(write("ship", LINK + include + fixed("l", "m::l", "ball")))
    assert list(found["links"][0]["pose"]) == pytest.approx([1, 2, 0, 0, 0, -QUARTER], abs=1e-12)


def test_the_pose_in_a_models_own_file_counts_where_an_include_gives_none():
    write("buoy", f"<pose>1 2 3 0 0 0</pose>{LINK}")
    one, other = world(
        "<include><uri>model://buoy</uri></include>"
        "<include><uri>model://buoy</uri><name>b</name><pose>4 0 0 0 0 0</pose></include>"
    ).section["objects"]
    assert (list(one["pose"])[:3], list(other["pose"])[:3]) == ([1, 2, 3], [4, 0, 0])


def test_what_is_lost_of_a_model_is_told_however_it_comes_into_a_world():
    write("lossy", CONE)
    write("course", "<include><uri>model://lossy</uri></include>")
    bodies = (
        f'<model name="m">{CONE}</model>',
        *(f"<include><uri>model://{n}</uri></include>" for n in ("lossy", "course")),
    )
    for body in bodies:
        assert "this shape is not supported" in {note.ours for note in world(body).notes}, body


def test_a_model_of_nothing_but_a_plugin_is_told():
    found = world('<model name="det"><plugin name="p" filename="libx.so"/></model>')
    assert [(note.what, note.fate) for note in found.notes] == [("<model> 'det'", "ignored")]


def test_a_boat_lies_where_its_root_link_lies_and_is_upright_as_its_model():
    """A hull whose link stands on end in a model that lies: the boat's axes are the model's."""
    hull = boat_link("hull", 20, (1, 2, 3), BOX, pose=f"1 0 0 0 {QUARTER!r} 0")
    parts = hull + boat_link("screw", 1, (1, 1, 1)) + spinning("drive", "hull", "screw") + thruster("drive", 50)
    file = write("ship", parts)
    pose = f"<pose>5 0 0 0 0 {QUARTER!r}</pose>"
    (boat,) = world(f"<include><uri>model://ship</uri>{pose}</include>").fleet["boats"]
    assert list(boat["pose"]) == pytest.approx([5, 1, 0, 0, 0, QUARTER])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        urdf = read_boat(file)
    assert urdf.links["hull"].collisions[0].pose == pytest.approx([0, 0, 0, 0, QUARTER, 0])
    assert urdf.places["screw"] == pytest.approx([-1, 0, 0, 0, 0, 0], abs=1e-12)


def test_two_sensors_of_a_kind_on_one_link_keep_their_names():
    imus = "".join(
        f'<sensor name="{name}" type="imu"><update_rate>20</update_rate></sensor>' for name in ("fore", "aft")
    )
    parts = boat_link("hull", 20, (1, 2, 2)) + boat_link("pod", 1, (1, 1, 1), imus) + fixed("hull", "pod")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        urdf = read_boat(write("ship", parts))
    assert [sensor.name for sensor in urdf.gazebo.sensors] == ["fore", "aft"]


def test_what_is_odd_in_an_object_is_noted_as_it_is_warned_of_in_a_boat():
    report = Report()
    visual = '<visual name="v"/>'
    model_section(write("buoy", f'<link name="l">{MASS}{BOX}{visual}</link>'), report)
    assert "visuals without a geometry; they are ignored: l" in {note.ours for note in report.notes}


def test_frames_placement_and_merging_are_as_in_libsdformat():
    """Golden: places in the hull's frame, and the axis of the joint, by libsdformat in Drake 1.51.1."""
    top = '<frame name="top"><pose relative_to="l">0 0 5 0.3 0 1</pose></frame>'
    write("mast", f'<pose>7 7 7 0.1 0 0</pose>{top}<link name="l"><pose>0 1 0 0.2 0 0</pose>{MASS}</link>')
    body = (
        f'<link name="hull"><pose>0 0 1 0 0.2 0</pose>{MASS}</link>'
        '<frame name="deck" attached_to="hull"><pose>1 0 0 0 0 0.5</pose></frame>'
        '<include><uri>model://mast</uri><name>a</name><pose relative_to="deck">1 2 3 0.1 0.2 0.3</pose>'
        "<placement_frame>top</placement_frame></include><include><uri>model://mast</uri><name>b</name></include>"
        '<include merge="true"><uri>model://mast</uri><name>c</name><pose relative_to="a::top">0 0 1 0 0 0</pose>'
        "</include>"
    )
    axis = '<pose>0 0.1 0 0.3 0 0</pose><axis><xyz expressed_in="deck">1 0.5 0</xyz></axis>'
    model = Model(model_element(write("ship", body + fixed("__model__", "l", "revolute", axis))))
    assert not model.findings.problems
    hull = model.frames.pose("hull")
    places = {name: relative(hull, model.frames.pose(name))[:3] for name in model.links}
    assert places == {
        "hull": (0.0, 0.0, 0.0),
        "a::l": pytest.approx((0.953039, 0.84414, -1.802652), abs=1e-6),
        "b::l": pytest.approx((5.648616, 7.995004, 7.368928), abs=1e-6),
        "l": pytest.approx((0.428116, 3.014295, 4.073014), abs=1e-6),
    }
    (joint,) = model.joints
    assert read_sdf_joint(model, *joint).axes[0].xyz == pytest.approx((0.96697248, 0.24514057, 0.06978767), abs=1e-8)


def test_a_model_without_links_is_told_and_left_out():
    found = world('<model name="buoy"/>')
    assert [(note.what, note.fate, note.ours) for note in found.notes] == [
        ("<model> 'buoy'", "ignored", "the model has no links")
    ]
    assert "objects" not in found.section
