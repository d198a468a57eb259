"""Frames and joints: of a tree that has every link of a boat's description, turning as VRX's propellers turn."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import unquote, urlsplit

import mujoco
import numpy as np
import pytest

import vrx_mj
from ros_scene import run, served
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.reader import read_urdf
from vrx_mj.frames import quaternion, rotation_matrix
from vrx_mj.ros.messages import new
from vrx_mj.ros.table.boats import Spin, boat_joints

WATCHED = {"/tf", "/tf_static"}
ROBOTS = [
    *({"robot": "wamv", "thrusters": layout} for layout in "HTX"),
    {"robot": "wamv_stereo"},
    {"robot": "cora"},
    {"robot": "skiff"},
]
INERTIA, DAMPING, FRICTION = 0.008545, 0.05, 0.05
ODD = """
<robot name="odd">
  <link name="hull"/>
  <link name="mast"/>
  <link name="vane"/>
  <joint name="step" type="fixed"><origin xyz="1 0 2" rpy="0 0 1.5707963267948966"/><parent link="hull"/>
    <child link="mast"/></joint>
  <joint name="turn" type="continuous"><origin xyz="0.5 0 0"/><parent link="mast"/><child link="vane"/>
    <axis xyz="0 0 -2"/></joint>
</robot>
"""


@pytest.fixture(scope="module", params=ROBOTS, ids=lambda entry: "-".join(map(str, entry.values())))
def afloat(request):
    """A served boat, its name and its description."""
    world = vrx_mj.compile_world("ocean", fleet={"usv_count": 1, **request.param})
    scene = served(world, wanted=WATCHED)
    run(scene, 0.5)
    (boat,) = scene.sim.boats
    return scene, boat, scene.server.description(boat)


def frames_of(scene):
    """Frames by their child: parent, place and turn."""
    frames = {}
    for topic in WATCHED:
        for frame in scene.network.got[topic][-1].message.transforms:
            assert frame.child_frame_id not in frames, "a frame has one parent"
            place, turn = frame.transform.translation, frame.transform.rotation
            frames[frame.child_frame_id] = (
                frame.header.frame_id,
                np.array([place.x, place.y, place.z]),
                np.array([turn.w, turn.x, turn.y, turn.z]),
            )
    return frames


def in_base(frames, name, base):
    """Place and turn of a frame in that of the boat."""
    place, turn = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    while name != base:
        name, offset, rotation = frames[name]
        carried, around = np.empty(3), np.empty(4)
        mujoco.mju_rotVecQuat(carried, place, rotation)
        mujoco.mju_mulQuat(around, rotation, turn)
        place, turn = offset + carried, around
    return place, turn


def test_every_link_is_where_the_description_has_it(afloat):
    scene, boat, text = afloat
    urdf = read_urdf(text, Path("boat.urdf"))
    frames, sensors = frames_of(scene), {sensor.config.link: sensor for sensor in scene.sim.mounted(boat)}
    for link in urdf.links:
        if link == urdf.root:
            continue
        pose = urdf.places[link]
        if urdf.local(link) in sensors:  # the frame of what it measures, which may be mounted beside the link's
            sensor = sensors[urdf.local(link)]
            pose = (*sensor.mount.position, *sensor.config.pose[3:])
        place, turn = in_base(frames, f"{boat}/{urdf.local(link)}", f"{boat}/base_link")
        assert place == pytest.approx(pose[:3], abs=1e-6), link
        if "propeller" not in link:  # at whatever angle a propeller has
            assert abs(turn @ quaternion(*pose[3:])) == pytest.approx(1.0, abs=1e-6), link


def test_joints_are_the_descriptions_own(afloat):
    scene, boat, text = afloat
    told = scene.server.table.outputs[f"/{boat}/joint_states"].make()
    kinds = {joint.get("name"): joint.get("type") for joint in ET.fromstring(text).findall("joint")}
    assert {kinds[name] for name in told.name} <= {"revolute", "continuous"}
    thrusters = scene.sim.observe()[boat].thrusters
    assert sum("propeller" in name for name in told.name) == len(thrusters)
    assert len(told.name) == len(told.position) == len(told.velocity) == len(told.effort) == len(set(told.name))


def test_a_propeller_turns_with_its_engine_and_the_others_stand(bay):
    scene = served(bay, wanted={"/wamv1/joint_states", "/tf"})
    scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=-0.5), "/test")
    run(scene, 0.9)
    told = scene.network.got["/wamv1/joint_states"][-1].message
    rates = dict(zip(told.name, told.velocity, strict=True))
    assert rates["wamv1/left_engine_propeller_joint"] == pytest.approx(-19.0, abs=0.2)  # (2 * 0.5 - 0.05) / 0.05
    assert rates["wamv1/right_engine_propeller_joint"] == 0.0
    angle = dict(zip(told.name, told.position, strict=True))["wamv1/left_engine_propeller_joint"]
    turn = {frame.child_frame_id: frame for frame in scene.network.got["/tf"][-1].message.transforms}[
        "wamv1/left_propeller_link"
    ].transform.rotation
    assert 2.0 * math.atan2(turn.x, turn.w) % math.tau == pytest.approx(angle % math.tau, abs=1e-9)
    run(scene, 5.0)  # its command has timed out
    told = scene.network.got["/wamv1/joint_states"][-1].message
    assert not told.velocity.any()


def test_looking_at_propellers_changes_nothing(bay):
    def state(wanted):
        scene = served(bay, wanted=wanted)
        scene.inbox.message("/wamv1/thrusters/left_thrust_cmd", new("std_msgs/Float32", data=1.0), "/test")
        run(scene, 0.5)
        return scene.sim.get_state().sha256

    assert state({"/wamv1/joint_states", "/tf"}) == state(set())


def test_a_boat_whose_files_are_gone_keeps_its_sensors_and_vrxs_joints(bay, monkeypatch):
    def gone(*_):
        raise VrxError("no such file")

    scene = served(bay)
    monkeypatch.setattr(scene.server, "description", gone)
    scene.server._offer()
    table = scene.server.table
    left = ["wamv1/left_chasis_engine_joint", "wamv1/left_engine_propeller_joint"]
    assert table.outputs["/wamv1/joint_states"].make().name[:2] == left
    still = {frame.child_frame_id: frame.header.frame_id for frame in table.outputs["/tf_static"].make().transforms}
    assert still["wamv1/gps_wamv_link"] == "wamv1/base_link"
    moving = {frame.child_frame_id: frame.header.frame_id for frame in table.outputs["/tf"].make().transforms}
    assert moving["wamv1/left_propeller_link"] == "wamv1/left_engine_link"


def test_a_frame_of_a_sensors_own_on_base_link_is_where_it_measures(tmp_path):
    robot = tmp_path / "surveyor.yaml"
    robot.write_text(
        "extends: blueboat\nsensors:\n"
        "  - {type: echo_sounder, name: sonar, link: base_link, pose: [0.2, 0, -0.1, 0, 1.5708, 0], frame: sonar}\n"
        "  - {type: camera, name: eye, link: base_link, pose: [0.5, 0, 0.3, 0, 0, 1.5708], frame: eye}\n"
    )
    world = vrx_mj.compile_world("ocean", fleet={"boats": [{"name": "a", "robot": str(robot), "pose": [0] * 6}]})
    scene = served(world, wanted=WATCHED)
    run(scene, 0.1)
    frames = frames_of(scene)
    for name, place, axes in (
        ("a/sonar", (0.2, 0.0, -0.1), ((0, 0, -1), (0, 1, 0), (1, 0, 0))),
        ("a/eye", (0.5, 0.0, 0.3), ((1, 0, 0), (0, 0, -1), (0, 1, 0))),  # x to the right of a view to port, y down
    ):
        parent, position, turn = frames[name]
        assert parent == "a/base_link"
        assert position == pytest.approx(place)
        assert np.ravel(rotation_matrix(turn).T) == pytest.approx(np.ravel(axes), abs=1e-5)


def test_frames_have_the_names_of_the_description():
    """Of `a/b/hull` the namespace of the boat replaces `a` alone, as in `robot_description` and sensors."""
    (root,) = boat_joints('<robot name="r"><link name="a/b/hull"/></robot>', "boat")
    assert (root.parent, root.child) == ("boat/base_link", "boat/b/hull")


def test_another_root_hangs_on_base_link():
    root, mast, vane = boat_joints(ODD, "boat")
    assert (root.parent, root.child, root.moves) == ("boat/base_link", "boat/hull", False)
    assert (mast.joint, mast.parent, mast.child, mast.moves) == ("step", "boat/hull", "boat/mast", False)
    assert (vane.joint, vane.parent, vane.moves) == ("turn", "boat/mast", True)
    assert vane.axis == pytest.approx([0.0, 0.0, -1.0])
    assert vane.place == pytest.approx([1.0, 0.5, 2.0])


@pytest.mark.parametrize(
    "text", ["", "no XML", "<robot", "<robot name='a'/>", ODD.replace('link="vane"', 'link="mast"')]
)
def test_what_is_no_robot_has_no_bones(text):
    assert boat_joints(text, "boat") == ()


def test_meshes_are_named_by_where_they_are(afloat):
    _, _, text = afloat
    names = [mesh.get("filename") for mesh in ET.fromstring(text).iter("mesh")]
    assert names
    assert all(Path(unquote(urlsplit(name).path)).is_file() for name in names if name.startswith("file:///"))
    assert [name for name in names if not name.startswith("file:///")] == []


@pytest.mark.parametrize("command", [0.3, -0.7, 1.0])
@pytest.mark.parametrize("step", [0.01, 0.001])
def test_a_propeller_speeds_up_as_the_closed_form(command, step):
    spin, limit = Spin(), math.copysign((2.0 * abs(command) - FRICTION) / DAMPING, command)
    for count in range(1, round(0.5 / step) + 1):
        spin = spin.after(step, command)
        exact = limit * -math.expm1(-count * step * DAMPING / INERTIA)
        assert abs(spin.rate - exact) <= abs(limit) * step * DAMPING / INERTIA
    assert spin.torque == 2.0 * command


def test_a_propeller_comes_to_rest_and_has_limits():
    spin = Spin()
    for _ in range(1000):
        spin = spin.after(0.01, 9.0)
    assert spin.rate == 100.0
    for _ in range(200):
        spin = spin.after(0.01, 0.1)  # below what VRX turns it at
        assert abs(spin.angle) <= math.pi
    assert (spin.rate, spin.torque) == (0.0, 0.0)
    assert spin.after(0.0, 0.0) == spin
