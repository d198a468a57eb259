"""Models of Gazebo as robots: where everything is, what pushes, what is said, and what broken files give."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from sdf_boats import BOATS, fossen, link, sdf, spinning, thruster
from vrx_mj.autopilot.board import Channel
from vrx_mj.config.robots import load_robot
from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.formats.gazebo.document import read_document
from vrx_mj.formats.gazebo.opening import robot_fleet
from vrx_mj.formats.gazebo.sdf_boats import is_boat, read_boat
from vrx_mj.formats.urdf.reader import read_urdf
from vrx_mj.frames import compose, quaternion, rotation
from work import calls_at_most

BROKEN = yaml.safe_load((Path(__file__).parents[3] / "broken" / "gazebo" / "boats.yaml").read_text(encoding="utf-8"))
PARTS = {
    "HULL": (
        '<link name="base_link"><inertial><mass>20</mass></inertial><collision name="c"><geometry><box>'
        "<size>1 1 1</size></box></geometry></collision></link>"
    ),
    "SCREW": '<link name="screw"><inertial><mass>1</mass></inertial></link>',
    "DRIVE": '<joint name="drive" type="continuous"><parent>base_link</parent><child>screw</child></joint>',
    "THRUSTER": (
        '<plugin filename="gz-sim-thruster-system" name="t"><joint_name>drive</joint_name></plugin>'
    ),
}  # fmt: skip
CALLS = 2_000_000
"""Calls of Python's that the worst file may take."""
HULL = link("base_link", 20, (1, 2, 2)).replace("\n", "")
poses = st.tuples(*[st.floats(-2, 2)] * 6)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    (tmp_path / "boat").mkdir()
    (tmp_path.parent / "secret.stl").write_text("solid", encoding="utf-8")
    monkeypatch.chdir(tmp_path / "boat")


def boat(*parts, version="1.9"):
    """The robot of a model."""
    Path("model.sdf").write_text(sdf("boat", *parts, version=version), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        return read_boat(Path("model.sdf"))


def words(values):
    return " ".join(map(repr, values))


def matrix(pose):
    """A pose as a homogeneous matrix."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation(*pose[3:]), pose[:3]
    return made


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_boat_says_what_and_where(case):
    text = BROKEN[case]["body"]
    for name, part in PARTS.items():
        text = text.replace(name, part)
    text = f'<sdf version="1.9">\n<model name="boat">\n{text}\n</model></sdf>\n'
    Path("model.sdf").write_text(text, encoding="utf-8")
    with calls_at_most(CALLS), pytest.raises(VrxError) as caught:
        read_boat(Path("model.sdf"))
    assert str(caught.value) == BROKEN[case]["says"]


def test_all_that_is_wrong_is_said_at_once():
    bad = '<link name="base_link"><inertial><mass>x</mass></inertial></link>'
    with pytest.raises(VrxError) as caught:
        boat(bad, spinning("drive", "base_link", "scrw"), '<link name="a"><pose>1</pose></link>')
    assert str(caught.value).splitlines() == [
        "model.sdf:3: link 'base_link' / inertial / mass: expected a number, got 'x'",
        "model.sdf:4: joint 'drive' / child: no link named 'scrw'; known: base_link, a",
        "model.sdf:5: link 'a' / pose: expected 6 numbers x y z roll pitch yaw, got '1'",
    ]  # fmt: skip


@given(hull=poses, frame=poses, child=poses, joint=poses, shape=poses)
def test_everything_is_where_the_file_has_it_whatever_it_is_relative_to(hull, frame, child, joint, shape):
    """Against products of homogeneous matrices; angles near the poles of Euler's lose half of the digits."""
    collision = (
        f'<collision name="c"><pose>{words(shape)}</pose><geometry><sphere><radius>1</radius></sphere></geometry>'
        "</collision>"
    )
    made = boat(
        link("base_link", 20, (1, 2, 2), pose=words(hull)),
        f'<frame name="mark" attached_to="base_link"><pose>{words(frame)}</pose></frame>',
        link("arm", 1, (1, 1, 1), collision, words(child), ' relative_to="mark"'),
        f'<joint name="j" type="revolute"><pose>{words(joint)}</pose><parent>base_link</parent><child>arm</child>'
        '<axis><xyz expressed_in="__model__">0 0 1</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis>'
        "</joint>",
    )
    root, above = matrix((*hull[:3], 0.0, 0.0, 0.0)), matrix(hull) @ matrix(frame) @ matrix(child)
    arm = root @ matrix(made.places["arm"])
    assert arm == pytest.approx(above @ matrix(joint), abs=1e-6)
    assert arm @ matrix(made.links["arm"].collisions[0].pose) == pytest.approx(above @ matrix(shape), abs=1e-6)
    assert arm @ matrix(made.links["arm"].inertial.pose) == pytest.approx(above, abs=1e-6)
    assert arm[:3, :3] @ made.joints["j"].axis == pytest.approx([0, 0, 1], abs=1e-6)


def test_the_axis_of_a_joint_is_in_the_frame_that_its_version_of_sdf_has():
    """Up to 1.4 that of the model, then the joint's; a flag says otherwise up to 1.6, then `expressed_in`."""
    turned = link("screw", 1, (1, 1, 1), pose="0 0 0 0 0 1.5707963267948966")
    flag = "<use_parent_model_frame>1</use_parent_model_frame></axis>"
    own, model = (1.0, 0.0, 0.0), pytest.approx((0.0, -1.0, 0.0))
    for version, expected, more in (("1.4", model, "</axis>"), ("1.5", own, "</axis>"), ("1.6", model, flag),
                                    ("1.9", own, "</axis>"), ("1.9", own, flag), ("1.11", own, "</axis>")):  # fmt: skip
        joint = spinning("drive", "base_link", "screw").replace("</axis>", more)
        assert boat(HULL, turned, joint, version=version).joints["drive"].axis == expected, version
    joint = spinning("drive", "base_link", "screw", attributes=' expressed_in="__model__"')
    assert boat(HULL, turned, joint).joints["drive"].axis == model


@given(turn=st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_a_quaternion_is_the_same_as_its_angles(turn):
    w, x, y, z = quaternion(*turn)
    pose = words((1.0, 2.0, 3.0, 2 * x, 2 * y, 2 * z, 2 * w))  # of any length
    made = boat(HULL, link("screw", 1, (1, 1, 1), pose=pose, attributes=' rotation_format="quat_xyzw"'),
                spinning("drive", "base_link", "screw"))  # fmt: skip
    assert made.joints["drive"].pose == pytest.approx((1.0, 2.0, 3.0, *turn), abs=1e-9)


def test_limits_of_joints():
    """Those of 1e16 or inf are none; a joint that cannot move is one of VRX's ways to hold a link."""
    kinds = {}
    limits = {
        "free": "<lower>-1e16</lower><upper>inf</upper><effort>50</effort>",
        "held": "<lower>0</lower><upper>0</upper>",
        "half": "<lower>-1</lower>",
    }
    for name, limit in limits.items():
        joint = (
            '<joint name="j" type="revolute"><parent>base_link</parent><child>screw</child>'
            f"<axis><limit>{limit}</limit></axis></joint>"
        )
        found = boat(HULL, link("screw", 1, (1, 1, 1)), joint).joints["j"]
        kinds[name] = found.type, found.is_locked, found.limits.lower, found.limits.upper, found.limits.effort
    assert kinds == {
        "free": ("continuous", False, -1e12, 1e12, 50),
        "held": ("revolute", True, 0, 0, 0),
        "half": ("revolute", False, -1, 1e12, 0),
    }


def test_the_thrust_is_along_the_axis_of_its_joint():
    (port, starboard) = boat(*BOATS["skiff"]().splitlines()[2:-2]).gazebo.thrusters
    assert (port.name, starboard.name) == ("motor_port", "motor_stbd")
    assert port.axis == (0.0, 0.0, -1.0)


def water(more, name="base_link"):
    plugin = (
        f'<plugin filename="ignition-gazebo-hydrodynamics-system" name="h"><link_name>{name}</link_name>{more}</plugin>'
    )
    return boat(HULL, plugin).gazebo


@pytest.mark.parametrize("names", [("xUabsU", "nRabsR"), ("xUU", "nRR")])
def test_coefficients_by_their_newer_and_older_names(names):
    """Resisting coefficients are negative by Fossen; what is not given along an axis is not known."""
    found = water(f"<xDotU>-4</xDotU><xU>-5</xU><{names[0]}>-6</{names[0]}><{names[1]}>-7</{names[1]}>")
    assert found.water == {
        "added_mass": (4.0, None, None, None, None, None),
        "drag_linear": (5.0, None, None, None, None, 0.0),
        "drag_quadratic": (6.0, None, None, None, None, 7.0),
    }
    assert found.warnings == []


def test_what_is_not_done_of_hydrodynamics_is_said():
    found = water("<xU>5</xU><yR>-3</yR><xVabsR>2</xVabsR><zP>0</zP><default_current>1 0 0</default_current>"
                  "<disable_added_mass>1</disable_added_mass><water_density>1025</water_density>")  # fmt: skip
    assert found.water["added_mass"] == (0.0,) * 6
    assert found.water["water_density"] == 1025.0
    begin = "model.sdf:4: plugin 'h': "
    assert [*map(str, found.warnings)] == [
        f"{begin}positive coefficients drive the boat in gz-sim; they are read as negative: xU",
        f"{begin}coefficients off the diagonal are ignored: yR, xVabsR",
        f"{begin}default_current is ignored: set currents in the world",
    ]


@given(factor=st.floats(-200, 200), offset=st.floats(-1, 0), most=st.floats(1, 500))
def test_channels_of_ardupilot_say_how_hard_a_thruster_pushes(factor, offset, most):
    """multiplier (offset + share), of which the share is 0 at the least pulse and 1 at the greatest."""
    control = (
        f'<control channel="1"><jointName>drive</jointName><multiplier>{factor!r}</multiplier>'
        f"<offset>{offset!r}</offset><type>COMMAND</type></control>"
    )
    pilot = f'<plugin filename="ArduPilotPlugin" name="a">{control}</plugin>'
    made = boat(HULL, PARTS["SCREW"], PARTS["DRIVE"], thruster("drive", repr(most)), pilot)
    (found,) = made.gazebo.thrusters
    low, high = sorted((factor * offset, factor * (offset + 1.0)))
    assert found.drive.max_force_forward == pytest.approx(max(min(high, most), 0.0))
    assert found.drive.max_force_reverse == pytest.approx(min(max(low, -most), 0.0))


def test_a_channel_limits_the_angle_of_what_steers():
    text = BOATS["outboard"]()
    control = (
        '<control channel="0"><jointName>steer</jointName><multiplier>0.5</multiplier><offset>-0.5</offset>'
        '<type>POSITION</type></control><control channel="1"><jointName>wheel</jointName></control>'
    )
    wheel = link("wheel", 1, (1, 1, 1)) + spinning("wheel", "base_link", "wheel")
    pilot = f'{wheel}\n<plugin filename="libArduPilotPlugin.so" name="a">{control}</plugin>\n</model>'
    found = boat(*text.replace("</model>", pilot).splitlines()[2:-2]).gazebo
    assert found.thrusters[0].drive.max_angle == 0.25
    assert str(found.warnings[-1]).endswith("control: the joint 'wheel' is ignored: no thruster is mounted on it")


@pytest.mark.parametrize(("factor", "offset"), [(70.0, -0.5), (-70.0, -0.5), (40.0, -0.25), (40.0, 0.0)])
def test_a_channel_gives_the_force_that_the_plugin_gives(factor, offset):
    """As the plugin: force = multiplier x (offset + share of the pulse)."""
    control = (
        f'<control channel="4"><jointName>drive</jointName><multiplier>{factor}</multiplier><offset>{offset}</offset>'
        "<servo_min>1100</servo_min><servo_max>1900</servo_max><type>COMMAND</type></control>"
    )
    pilot = f'<plugin filename="ArduPilotPlugin" name="a">{control}</plugin>'
    found = boat(HULL, PARTS["SCREW"], PARTS["DRIVE"], thruster("drive", "1000"), pilot).gazebo
    (entry,), (drive,) = found.autopilot.values(), [one.drive for one in found.thrusters]
    assert (list(found.autopilot), entry.thruster) == (["5"], found.thrusters[0].name)
    channel = Channel("drive", drive.max_force_reverse, drive.max_force_forward, entry.trim, entry.span)
    for pulse in (1100, 1200, 1500, 1720, 1900):
        assert channel.value(pulse) == pytest.approx(factor * (offset + (pulse - 1100) / 800))


def test_a_model_in_a_boat_is_part_of_it_and_errors_in_it_are_of_its_file():
    Path("../mast").mkdir()
    mast = (
        '<sdf version="1.9">\n<model name="mast">\n<link name="pole">\n<pose>0 0 1 0 0 0</pose>\n'
        '<sensor name="imu" type="imu"><update_rate>20</update_rate></sensor>\n</link>\n</model></sdf>'
    )
    Path("../mast/model.sdf").write_text(mast, encoding="utf-8")
    include = "<include><uri>model://mast</uri><name>aft</name><pose>-1 0 0 0 0 0</pose></include>"
    hold = '<joint name="h" type="fixed"><parent>base_link</parent><child>aft::pole</child></joint>'
    made = boat(HULL, include, hold)
    assert list(made.links) == ["base_link", "aft::pole"]
    assert made.places["aft::pole"] == (-1.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    (sensor,) = made.gazebo.sensors
    assert sensor.pose == (-1.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    merged = boat(HULL, include.replace("<include", '<include merge="true"'), hold.replace("aft::", ""))
    assert merged.places["pole"] == (-1.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    Path("../mast/model.sdf").write_text(mast.replace(">20<", ">often<"), encoding="utf-8")
    with pytest.raises(VrxError) as caught:
        boat(HULL, include, hold)
    place = (Path.cwd().parent / "mast" / "model.sdf").as_posix()
    assert str(caught.value) == (
        f"{place}:5: link 'aft::pole' / sensor 'imu' / update_rate: expected a number, got 'often'"
    )


def test_a_model_that_includes_itself_many_times_is_soon_refused():
    """Each is in the other twice: two to the power of eight, if nobody counted."""
    for one, other in (("boat", "b"), ("b", "boat")):
        Path(f"../{one}").mkdir(exist_ok=True)
        includes = "".join(f"<include><uri>model://{other}</uri><name>{n}</name></include>" for n in "xy")
        Path(f"../{one}/model.sdf").write_text(sdf(one, HULL, includes), encoding="utf-8")
    with calls_at_most(CALLS), pytest.raises(VrxError, match=r"deeper than 8 levels|more than 100 models in one"):
        read_boat(Path("model.sdf"))


def test_a_model_that_is_a_link_out_of_its_folder_is_not_read(tmp_path):
    outside = tmp_path.parent / f"{tmp_path.name}_outside"
    outside.mkdir()
    (outside / "model.sdf").write_text(sdf("mast", HULL), encoding="utf-8")
    Path(tmp_path / "boat" / "mast").symlink_to(outside)
    with pytest.raises(VrxError, match="a symbolic link out of"):
        boat(HULL, "<include><uri>model://mast</uri></include>")


def test_what_a_boat_has_and_is_not_simulated_is_said():
    extra = '<plugin filename="gz-sim-lift-drag-system" name="fin"/>'
    world = '<joint name="moor" type="fixed"><parent>world</parent><child>base_link</child></joint>'
    Path("model.sdf").write_text(sdf("boat", HULL.replace("0 0 0 0", "0 1 0 0", 1), "<static>1</static>",
                                     extra, world, '<link name="bare"/>', spinning("b", "base_link", "bare"),
                                     "<include><uri>model://cow</uri></include>"), encoding="utf-8")  # fmt: skip
    with pytest.warns(VrxWarning) as said:
        made = read_boat(Path("model.sdf"))
    assert [str(one.message) for one in said] == [
        "model.sdf: links without <inertial>; SDF gives each 1 kg and moments of inertia of 1 kg m2: bare"
    ]
    assert tuple(map(str, (*made.remarks, *made.gazebo.warnings))) == (
        "model.sdf:4: <static>: gravity and buoyancy act on everything",
        "model.sdf:9: include: no model named 'cow' beside the file, nor on the model path",
        "model.sdf:6: joint 'moor': the boat floats freely: a joint to the world is ignored",
        "model.sdf:3: link 'base_link': the boat's frame is that of its root link, which is at 0 1 0 in the model",
        "model.sdf:5: plugin 'fin': the plugin gz-sim-lift-drag-system is not simulated",
    )


@pytest.mark.parametrize("name", BOATS)
def test_a_boat_written_as_a_urdf_is_read_as_the_same(name):
    Path("model.sdf").write_text(BOATS[name](), encoding="utf-8")
    assert is_boat(read_document(Path("model.sdf")))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        one = read_boat(Path("model.sdf"))
        other = read_urdf(one.text, Path("boat.urdf"))
    for kind in ("links", "joints"):
        for key, ours in getattr(one, kind).items():
            theirs = getattr(other, kind)[key]
            assert [ours.__dict__[part] for part in ours.__dict__ if part != "place"] == [
                theirs.__dict__[part] for part in theirs.__dict__ if part != "place"
            ], key
    assert one.gazebo.sensors == other.gazebo.sensors


def test_a_thing_without_a_thruster_is_no_boat():
    Path("model.sdf").write_text(sdf("buoy", HULL, fossen()), encoding="utf-8")
    assert not is_boat(read_document(Path("model.sdf")))


def test_a_joint_of_another_kind_is_held():
    """A universal joint has two axes; its link stays where it is."""
    joint = '<joint name="u" type="universal"><parent>base_link</parent><child>screw</child></joint>'
    made = boat(HULL, link("screw", 1, (1, 1, 1), pose="0 1 0 0 0 0"), joint)
    assert made.joints["u"].type == "universal"
    assert compose(made.joints["u"].pose, (0.0,) * 6) == (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    assert math.dist(made.places["screw"][:3], (0, 1, 0)) == 0.0


@given(size=st.tuples(*[st.floats(0.2, 2)] * 3), place=poses, density=st.floats(10, 2000))
def test_the_inertia_of_a_full_box_is_that_of_the_box(size, place, density):
    """Closed form: m / 12 (b^2 + c^2), turned and moved with the box."""
    shape = (
        f'<collision name="c"><pose>{words(place)}</pose><density>{density!r}</density><geometry><box>'
        f"<size>{words(size)}</size></box></geometry></collision>"
    )
    made = boat(f'<link name="base_link"><inertial auto="true"/>{shape}</link>', version="1.11").links["base_link"]
    mass, turn = density * math.prod(size), np.array(rotation(*place[3:]))
    moments = np.diag([mass / 12 * (sum(edge**2 for edge in size) - edge**2) for edge in size])
    assert made.inertial.mass == pytest.approx(mass)
    assert made.inertial.pose == pytest.approx((*place[:3], 0.0, 0.0, 0.0), abs=1e-9)
    found = [(turn @ moments @ turn.T)[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    assert made.inertial.tensor == pytest.approx(found, abs=1e-6 * mass)


R, L, A, B, C = 0.7, 1.6, 0.3, 0.5, 0.9
BALL, TUBE = 4 / 3 * math.pi * R**3, math.pi * R**2 * L
AROUND = BALL * (2 * R**2 / 5 + 3 * R * L / 8 + L**2 / 4) + TUBE * (R**2 / 4 + L**2 / 12)
EDGES = "".join(f"v {x} {y} {z}\n" for x in (-A, A) for y in (-B, B) for z in (-C, C))
FACES = "".join(f"f {face}\n" for face in ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"))


@pytest.mark.parametrize(("geometry", "volume", "moments"), [
    (f"<sphere><radius>{R}</radius></sphere>", BALL, [BALL * 2 / 5 * R**2] * 3),
    (f"<cylinder><radius>{R}</radius><length>{L}</length></cylinder>", TUBE,
     [TUBE * (R**2 / 4 + L**2 / 12)] * 2 + [TUBE * R**2 / 2]),
    (f"<capsule><radius>{R}</radius><length>{L}</length></capsule>", BALL + TUBE,
     [AROUND, AROUND, BALL * 2 / 5 * R**2 + TUBE * R**2 / 2]),
    (f"<ellipsoid><radii>{A} {B} {C}</radii></ellipsoid>", (ball := 4 / 3 * math.pi * A * B * C),
     [ball / 5 * (B**2 + C**2), ball / 5 * (A**2 + C**2), ball / 5 * (A**2 + B**2)]),
    ("<mesh><uri>box.obj</uri></mesh>", (box := 8 * A * B * C),
     [box / 3 * (B**2 + C**2), box / 3 * (A**2 + C**2), box / 3 * (A**2 + B**2)]),
])  # fmt: skip
def test_the_inertia_of_full_shapes_is_that_of_textbooks(geometry, volume, moments):
    """Each twice, 2 m apart along y and turned by 90 degrees about z: parallel axes."""
    Path("box.obj").write_text(EDGES + FACES, encoding="utf-8")
    shapes = "".join(
        f'<collision name="c{y}"><pose>0 {y} 0 0 0 {math.pi / 2}</pose><geometry>{geometry}</geometry></collision>'
        for y in (-1, 1)
    )
    text = f'<link name="base_link"><inertial auto="true"><density>10</density></inertial>{shapes}</link>'
    found = boat(text, version="1.11").links["base_link"].inertial
    xx, yy, zz = moments
    assert found.mass == pytest.approx(20 * volume, rel=1e-9)
    away = 20 * volume  # times the square of 1 m
    wanted = (20 * yy + away, 20 * xx, 20 * zz + away, 0, 0, 0)
    assert found.tensor == pytest.approx(wanted, rel=1e-9, abs=1e-9 * away)


@pytest.mark.parametrize(
    ("name", "ours"), [("-x", "_x"), (".hidden", "_hidden"), ("a b/c", "a_b_c"), ("x-1.5", "x-1.5")]
)
def test_names_of_shapes_become_ours(name, ours):
    """mbzirc's worlds call walls -x and -y."""
    shape = f'<collision name="{name}"><geometry><box><size>1 1 1</size></box></geometry></collision>'
    made = boat(link("base_link", 5, (1, 1, 1), content=shape))
    assert [one.name for one in made.links["base_link"].collisions] == [ours]


def test_a_folder_of_a_model_is_a_robot():
    Path("model.sdf").write_text(BOATS["raft"](), encoding="utf-8")
    assert load_robot("./boat", Path("..")).is_sdf
    assert load_robot("model://boat", Path("..")).description_file.name == "model.sdf"
    Path("../bay.sdf").write_text(f'<sdf><world name="bay">{BOATS["raft"]()[19:-8]}</world></sdf>', encoding="utf-8")
    assert load_robot("./bay.sdf#raft", Path("..")).description_file.name == "bay.sdf#raft"
    Path("../other").mkdir()
    with pytest.raises(
        VrxError, match=r"^path '\.\./boat' leaves the folder of the file that names it; add its folder with"
    ):
        load_robot("../boat", Path("../other"))


@pytest.mark.parametrize("start", ["<world name='bay'>", ""])
def test_a_fleet_of_a_file_of_several_models_says_which_it_takes(start):
    pier = '<model name="pier"><static>true</static><link name="l"/></model>'
    end = "</world>" if start else ""
    Path("two.sdf").write_text(f'<sdf version="1.6">{start}{pier}{BOATS["raft"]()[19:-8]}{end}</sdf>', encoding="utf-8")
    said = "the boat is its model 'raft'; for another, --fleet FILE#NAME with NAME one of pier"
    with pytest.warns(VrxWarning, match=said):
        assert robot_fleet("two.sdf")["robot"] == "two.sdf#raft"
    assert robot_fleet("two.sdf#pier")["robot"] == "two.sdf#pier"
