import json
import math
import warnings

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import ConfigError, StateError, VrxWarning
from vrx_mj.frames import angles, compose, quaternion, rotation
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.model.world import tree_of

PAIR = {"usv_count": 2, "positions": [{"x": 0, "y": 0}, {"x": 10.123456789, "y": -7.5, "Y": 30}]}
WINDY = {
    "sea": {"scale": 2.5},
    "wind": {
        "mean_velocity": 5,
        "objects": [{"model": "wamv2", "coefficients": [1, 2, 3]}, {"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}],
    },
    "objects": [{"name": "red", "model": "mb_marker_buoy_red", "pose": [5, 5, 0, 0, 0, 0.5]}],
}
ANGLE = st.floats(-1.5, 1.5)
POSE = st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-9, 9), ANGLE, ANGLE, st.floats(-3, 3))


@pytest.fixture(scope="module")
def course():
    return compile_world("example_course", fleet="trio")


def test_the_same_input_gives_the_same_text_and_parameters(course):
    again = compile_world("example_course", fleet="trio")
    assert again.mjcf == course.mjcf
    assert again.sha256 == course.sha256


def test_a_saved_world_comes_back_whole(course, tmp_path):
    for target in (tmp_path / "folder", tmp_path / "mine.xml"):
        course.save(target)
        back = World.load(target)
        assert (back.mjcf, tree_of(back.parameters), back.assets) == (
            course.mjcf,
            tree_of(course.parameters),
            course.assets,
        )


def test_plain_mujoco_opens_the_saved_file_from_anywhere(course, tmp_path, monkeypatch):
    scene = course.save(tmp_path / "测试 boats")
    monkeypatch.chdir(tmp_path)
    model = mujoco.MjModel.from_xml_path(str(scene))
    assert model.body("wamv3/base_link").id > 0
    assert model.opt.timestep == 0.01


def test_the_file_says_that_the_sea_is_ours(course):
    text = {item.name: item.data for item in mujoco.MjSpec.from_string(course.mjcf).texts}
    assert "vrx_mj.Simulation.load" in text["vrx_mj/about"]
    assert json.loads(text["vrx_mj/sea"].replace("'", '"'))["model"] == "pms"
    assert "Water, wind and thrust come from vrx_mj's loop alone (vrx-mj run, vrx-mj view)" in course.mjcf


def test_boats_of_one_kind_share_their_meshes(course):
    one = compile_world("example_course", fleet={"usv_count": 1, "positions": [{"x": -520, "y": 190}]})
    count = [mujoco.MjModel.from_xml_string(w.mjcf, dict(w.assets)).nmesh for w in (one, course)]
    assert count[0] == count[1]


def test_positions_keep_all_their_digits():
    world = compile_world({}, fleet=PAIR)
    model = mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets))
    assert model.body("wamv2/base_link").pos == pytest.approx([10.123456789, -7.5, 0.1], abs=1e-12)


def test_wind_finds_a_boat_by_its_name_before_its_kind():
    hulls = tree_of(compile_world(WINDY, fleet=PAIR).parameters)["hulls"]
    assert [hull["wind"] for hull in hulls] == [[0.5, 0.5, 0.33], [1, 2, 3]]


def test_an_object_s_row_is_that_of_its_file():
    row = tree_of(compile_world(WINDY, fleet=PAIR).parameters)["floats"][0]
    assert (row["mass"], row["com"], row["linear_drag"], row["angular_drag"]) == (20, [0, 0, -2], 25, 2)
    assert row["body"] == "red/link"


def test_waves_of_no_height_are_left_out():
    waves = tree_of(compile_world(WINDY, fleet=PAIR).parameters)["sea"]["waves"]
    assert len(waves) == 2  # the longest of three has 1e-11 m at VRX's scale 2.5
    assert tree_of(compile_world({"sea": {"model": "none"}}).parameters)["sea"]["waves"] == []


def test_what_mujoco_cannot_draw_is_one_warning():
    scene = {"fog": {"type": "exp", "density": 0.1}, "grid": True}
    with pytest.warns(VrxWarning) as caught:
        compile_world({"scene": scene})
    (warning,) = caught
    assert str(warning.message) == (
        "world world: MuJoCo cannot draw fog type exp (drawn linear, from where it hides 5 % to where it hides 95 %), "
        "grid"
    )


def test_linear_fog_and_light_reach_the_model():
    scene = {"ambient": [0.3, 0.2, 0.1], "fog": {"type": "linear", "color": [0.7, 0.7, 0.7], "start": 5, "end": 60}}
    world = compile_world({"scene": scene})
    model = mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets))
    assert model.vis.headlight.ambient == pytest.approx([0.3, 0.2, 0.1])
    extent = model.stat.extent
    assert [model.vis.map.fogstart * extent, model.vis.map.fogend * extent] == pytest.approx([5, 60], rel=1e-6)
    assert tree_of(world.parameters)["scene"]["fog"] is True


def test_shipped_worlds_compile_without_a_word():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compile_world("example_course", fleet="trio")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no saved world at {folder}: scene.xml and scene.json are needed in {folder}"),
        ("{", "{folder}/scene.json is damaged: "),
        ('{"format": 99}', "{folder}/scene.json has format 99; this version reads 3 and 4"),
    ],
)
def test_a_folder_without_a_world_is_refused(tmp_path, content, message):
    if content is not None:
        (tmp_path / "scene.xml").write_text("<mujoco/>", encoding="utf-8")
        (tmp_path / "scene.json").write_text(content, encoding="utf-8")
    with pytest.raises(StateError) as caught:
        World.load(tmp_path)
    assert str(caught.value).replace("\\", "/").startswith(message.format(folder=tmp_path.as_posix()))


def matrix(pose):
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = rotation(*pose[3:]), pose[:3]
    return whole


@given(outer=POSE, inner=POSE)
def test_poses_compose_as_matrices_do(outer, inner):
    assert matrix(compose(outer, inner)) == pytest.approx(matrix(outer) @ matrix(inner), abs=1e-9)


@given(roll=ANGLE, pitch=ANGLE, yaw=st.floats(-3, 3))
def test_angles_and_quaternions_are_those_of_the_matrix(roll, pitch, yaw):
    turn = rotation(roll, pitch, yaw)
    assert angles(turn) == pytest.approx((roll, pitch, yaw), abs=1e-9)
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.array(quaternion(roll, pitch, yaw)))
    assert flat.reshape(3, 3) == pytest.approx(np.array(turn), abs=1e-12)


def test_angles_at_the_pole_still_make_the_matrix():
    turn = rotation(0.3, math.pi / 2, 1.0)
    assert np.array(rotation(*angles(turn))) == pytest.approx(np.array(turn), abs=1e-9)


def test_a_boat_that_drag_would_blow_up_is_warned_of(tmp_path):
    urdf = '<robot name="tub"><link name="base_link"><inertial><mass value="50"/>{}</inertial>{}</link></robot>'
    inertia = '<inertia ixx="9" iyy="9" izz="9" ixy="0" ixz="0" iyz="0"/>'
    (tmp_path / "tub.urdf").write_text(
        urdf.format(inertia, '<collision><geometry><box size="2 1 1"/></geometry></collision>'), encoding="utf-8"
    )
    water = "boat_length: 2, boat_width: 1, hull_radius: 0.3, added_mass: [0, 0, 0, 0, 0, 0]"
    drag = "drag_linear: [10, 10, 10, 10, 10, 9000], drag_quadratic: [0, 0, 0, 0, 0, 0]"
    (tmp_path / "tub.yaml").write_text(f"hydrodynamics: {{{water}, {drag}}}\n", encoding="utf-8")
    (tmp_path / "fleet.yaml").write_text("robot: tub.urdf\n", encoding="utf-8")
    with pytest.warns(VrxWarning) as caught:
        compile_world({}, fleet=tmp_path / "fleet.yaml")
    assert (
        "robot tub.urdf: its linear drag removes 10 times its velocity in a step of 0.01 s; beyond 2 it diverges: "
        "check `drag_linear`, or use a shorter timestep"
    ) in [str(warning.message) for warning in caught]


@pytest.mark.parametrize(
    ("fleet", "place"),
    [("boats:\n  - {pose: [0, 0, 0.1, 0, 0, 0], name: b, sensors: [sonar]}\n", "fleet.yaml:2:5: boats[0]: boat b"),
     ("usv_count: 1\nsensors: [sonar]\n", "fleet.yaml:1:1: boat wamv1")],
)  # fmt: skip
def test_a_sensor_that_a_boat_lacks_is_told_with_its_place(tmp_path, monkeypatch, fleet, place):
    (tmp_path / "fleet.yaml").write_text(fleet, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError) as caught:
        compile_world("ocean", fleet="fleet.yaml")
    head, _, known = str(caught.value).partition("; ")
    assert head == f"{place}: no sensor or suite named 'sonar'"
    assert known.startswith("known: front_left_camera, ")
