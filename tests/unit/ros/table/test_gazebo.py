"""Gazebo's services: places and velocities relative to other models, and in whose axes they are."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import vrx_mj
from ros_scene import call as service
from ros_scene import run, served
from sdf_boats import BOATS
from trees import partial
from vrx_mj.errors import VrxWarning
from vrx_mj.frames import quaternion, rotation
from vrx_mj.ros.interface import Service
from vrx_mj.ros.messages import duration, new
from vrx_mj.ros.table.boats import twist_commands
from vrx_mj.ros.table.gazebo import gazebo_topics
from vrx_mj.ros.table.host import Bodies, FrameState

NORTH = quaternion(0.0, 0.0, math.pi / 2)
LEVEL = (1.0, 0.0, 0.0, 0.0)


def placed(position=(0, 0, 0), turn=LEVEL, velocity=(0, 0, 0), spin=(0, 0, 0)):
    return FrameState(*(np.array(values, float) for values in (position, turn, velocity, spin)))


class Host:
    """A boat `a` and models that a test gives; notes where the boat is put."""

    def __init__(self, **models):
        self.bodies = SimpleNamespace(
            model=models.__getitem__,
            parts=lambda name: [name],
            frame=lambda name: None if name in {"", "world"} else models[name],
        )
        self.sim = SimpleNamespace(time=2.0, boats=("a",), set_boat=self.put)
        self.reset_world = self.reset_simulation = self.note_move = lambda: None

    def put(self, name, *, pose, velocity):
        self.pose, self.velocity = np.array(pose), np.array(velocity)


def call(host, name, **fields):
    service = next(one for one in gazebo_topics(host) if isinstance(one, Service) and one.name == f"/gazebo/{name}")
    answer = service.answer(new(f"{service.type}Request", **fields))
    assert answer.success, answer.status_message
    return answer


def xyz(vector):
    return [vector.x, vector.y, vector.z]


def asked(host, relative=""):
    answer = call(host, "get_model_state", model_name="a", relative_entity_name=relative)
    return answer.pose, answer.twist


def test_a_model_s_state_is_in_the_world_s_axes():
    pose, twist = asked(Host(a=placed((1, 2, 3), NORTH, (0.5, 0, 0), (0, 0, 0.1))))
    assert xyz(pose.position) == [1, 2, 3]
    assert (pose.orientation.w, pose.orientation.z) == pytest.approx((NORTH[0], NORTH[3]))
    assert xyz(twist.linear) == [0.5, 0, 0]
    assert xyz(twist.angular) == [0, 0, 0.1]


def test_what_turns_with_another_model_is_at_rest_beside_it():
    """Both turn at 0.2 rad/s about a model that drifts: 10 m ahead of its bow, which points north."""
    base = placed((5, 5, 0), NORTH, (0.3, -0.1, 0), (0, 0, 0.2))
    along = placed((5, 15, 0), NORTH, (0.3 - 0.2 * 10, -0.1, 0), (0, 0, 0.2))
    pose, twist = asked(Host(a=along, base=base), "base")
    assert xyz(pose.position) == pytest.approx([10, 0, 0], abs=1e-9)
    assert abs(pose.orientation.w) == pytest.approx(1.0)
    assert xyz(twist.linear) == pytest.approx([0, 0, 0], abs=1e-9)
    assert xyz(twist.angular) == pytest.approx([0, 0, 0], abs=1e-9)


def test_a_velocity_over_ground_becomes_that_of_the_boat_s_own_axes():
    host = Host(a=placed())
    turn = quaternion(0.0, 0.0, math.pi / 2)
    state = {
        "model_name": "a",
        "pose": {"position": {"x": 1.0}, "orientation": {"w": turn[0], "z": turn[3]}},
        "twist": {"linear": {"x": 1.0, "y": 2.0}, "angular": {"x": 0.5}},
    }
    call(host, "set_model_state", model_state=state)
    assert host.pose == pytest.approx([1, 0, 0, 0, 0, math.pi / 2])
    assert host.velocity == pytest.approx([2, -1, 0, 0, -0.5, 0], abs=1e-9)


def test_a_place_relative_to_another_model_turns_with_it():
    base = placed((5, 5, 0), NORTH, (9, 9, 9))
    host = Host(a=placed(), base=base)
    state = {"model_name": "a", "reference_frame": "base", "twist": {"linear": {"x": 1.0}}}
    state["pose"] = {"position": {"x": 2.0, "y": 1.0}, "orientation": {"w": 1.0}}
    call(host, "set_model_state", model_state=state)
    assert host.pose == pytest.approx([4, 7, 0, 0, 0, math.pi / 2])
    velocity = np.array(rotation(*host.pose[3:])) @ host.velocity[:3]
    assert velocity == pytest.approx([0, 1, 0], abs=1e-9)  # ahead of the base, over ground


@pytest.mark.parametrize("names", [("left", "right"), ("left_rear", "right_rear")])
def test_a_twist_turns_to_port_by_more_to_starboard(names):
    """VRX's twist2thrust."""
    world = SimpleNamespace(parameters=partial({"boats": [{"name": "a"}], "thrusters": []}))
    host = SimpleNamespace(sim=SimpleNamespace(command_names=lambda _boat: names, world=world))
    left, right = names
    assert twist_commands(host, "a", 0.5, 0.2) == pytest.approx({left: 0.3, right: 0.7})


PART = "short_navigation_course_0::red_bound_1"
WHOLE = {"model_name": "short_navigation_course_0"}


def got(scene, name, kind, **fields):
    return service(scene, f"/gazebo/{name}", f"gazebo_msgs/{kind}", **fields)


def test_models_in_models_are_found_by_gazebos_names_and_by_ours(course):
    """And what is made of models alone is where the first of them is."""
    scene = served(course)
    own = PART.replace("::", "/")
    ours, theirs = (
        got(scene, "get_model_state", "GetModelState", model_name=name).pose.position for name in (own, PART)
    )
    assert xyz(ours) == xyz(theirs) == [*scene.sim.observe_object(own).position]
    link = got(scene, "get_link_state", "GetLinkState", link_name=f"{PART}::link").link_state
    assert xyz(link.pose.position) == xyz(ours)
    beside = got(scene, "get_model_state", "GetModelState", model_name="wamv", relative_entity_name=PART)
    assert math.hypot(*xyz(beside.pose.position)) > 5.0
    whole = got(scene, "get_model_state", "GetModelState", **WHOLE)
    first = scene.sim.observe_object("short_navigation_course_0/red_bound_0")
    assert xyz(whole.pose.position) == [*first.position]
    properties = got(scene, "get_model_properties", "GetModelProperties", **WHOLE)
    assert (len(properties.body_names), properties.is_static) == (6, False)
    assert "red_bound_1::link" in properties.body_names
    state = {"model_name": PART, "pose": {"position": {"x": -470.0, "y": 190.0, "z": 0.0}}}
    got(scene, "set_model_state", "SetModelState", model_state=state)
    assert scene.sim.observe_object(own).position[0] == pytest.approx(-470.0)
    wrong = got(scene, "get_model_state", "GetModelState", model_name="wamv", relative_entity_name="wamv::nose")
    assert wrong.status_message.startswith("get_model_state: no link named 'wamv::nose'; known: ")


def test_models_and_links_are_listed_by_gazebos_names(course):
    scene = served(course)
    models, links = (
        next(one for one in gazebo_topics(scene.server) if one.name == f"/gazebo/{name}").make().name
        for name in ("model_states", "link_states")
    )
    assert {"wamv", "buoys", "short_navigation_course_0", PART, "robotx_dock_2022", "robotx_light_buoy"} <= {*models}
    assert models.index("short_navigation_course_0") < models.index(PART)
    assert len(set(models)) == len(models)
    assert not [name for name in models if "/" in name]
    assert {f"{PART}::link", "buoys::mb_round_buoy_black_0::link", "wamv::wamv/base_link"} <= {*links}
    listed = got(scene, "get_world_properties", "GetWorldProperties").model_names
    assert {"wamv", "buoys", "short_navigation_course_0", "robotx_dock_2022"} <= {*listed}
    assert not [name for name in listed if "::" in name]


def test_a_course_is_moved_as_a_whole(course):
    scene = served(course)
    names = [
        item.name for item in scene.sim.world.parameters.objects if item.name.startswith("short_navigation_course_0/")
    ]
    before = [scene.sim.observe_object(name).position for name in names]
    now = got(scene, "get_model_state", "GetModelState", **WHOLE).pose
    got(scene, "set_model_state", "SetModelState", model_state={**WHOLE, "pose": now})
    after = [scene.sim.observe_object(name).position for name in names]
    assert np.allclose(after, before, atol=1e-9)
    w, z = now.orientation.w, now.orientation.z
    turned = {"w": (w - z) / math.sqrt(2.0), "z": (w + z) / math.sqrt(2.0)}  # by a quarter to port
    pose = {"position": {"x": -470.0, "y": 200.0, "z": 0.2}, "orientation": turned}
    moved = got(scene, "set_model_state", "SetModelState", model_state={**WHOLE, "pose": pose})
    assert moved.success, moved.status_message
    for was, name in zip(after, names, strict=True):
        x, y, _ = was - after[0]
        assert scene.sim.observe_object(name).position[:2] == pytest.approx([-470.0 - y, 200.0 + x], abs=1e-6)


BOX = (
    '<sdf version="1.6"><model name="crate"><pose>0 0 0.5 0 0 0</pose><link name="link"><inertial><mass>200</mass>'
    '</inertial><collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision></link></model></sdf>'
)
LIGHT = '<sdf version="1.6"><model name="robotx_light_buoy"><link name="base_link"/></model></sdf>'
DATABASE = '<sdf version="1.4">\n<world name="default"><include>\n<uri>model://{}</uri></include></world></sdf>'
"""What `spawn_model -database NAME` sends."""


def inserted(scene, name, text, x=-500.0, y=235.0, z=0.2, **more):
    place = {"position": {"x": x, "y": y, "z": z}, "orientation": {"w": 1.0}}
    return got(scene, "spawn_sdf_model", "SpawnModel", model_name=name, model_xml=text, initial_pose=place, **more)


@pytest.mark.parametrize(
    ("text", "message", "z"),
    [
        (LIGHT, "guest joins as the catalogue's robotx_light_buoy", 0.2),
        (DATABASE.format("mb_marker_buoy_red"), "guest joins as the catalogue's mb_marker_buoy_red", 0.2),
        (DATABASE.format("dock_2018"), "guest joins as the catalogue's dock_2018", None),
        (
            BOX,
            (
                "guest joins as the SDF's own crate; <model> 'crate' approximated: it has no buoyancy plugin: its "
                "collision shapes displace water"
            ),
            0.7,
        ),
    ],
    ids=["light buoy", "by its name", "dock", "its own"],
)
def test_an_sdf_model_joins_is_seen_everywhere_and_leaves(course, text, message, z):
    scene = served(course)
    before = list(scene.server.bodies.models)
    told = inserted(scene, "guest", text, robot_namespace="/", reference_frame="world")
    assert (told.success, told.status_message) == (True, message)
    assert "guest" in scene.server.bodies.models
    seen = got(scene, "get_model_state", "GetModelState", model_name="guest")
    assert seen.pose.position.x == pytest.approx(-500.0)
    assert z is None or seen.pose.position.z == pytest.approx(z)
    assert [name for name in scene.server.bodies.links if name.startswith("guest::")]
    assert "guest" in got(scene, "get_world_properties", "GetWorldProperties").model_names
    run(scene, 0.2)
    service(scene, "/gazebo/reset_simulation", "std_srvs/Empty")
    assert "guest" in scene.server.bodies.models
    assert got(scene, "delete_model", "DeleteModel", model_name="guest").success
    assert list(scene.server.bodies.models) == before
    service(scene, "/gazebo/reset_simulation", "std_srvs/Empty")
    assert list(scene.server.bodies.models) == before


def test_a_model_with_thrusters_joins_as_a_boat_with_its_topics(course):
    scene = served(course)
    with pytest.warns(VrxWarning, match="sensors of type 'custom' are not simulated"):
        told = inserted(scene, "cat", BOATS["catamaran"](), z=0.1)
    assert told.success, told.status_message
    assert "cat" in scene.sim.boats
    assert [name for name in scene.network.table.inputs if name.startswith("/cat/thrusters/")]
    run(scene, 0.2)
    with pytest.warns(VrxWarning):
        service(scene, "/gazebo/reset_simulation", "std_srvs/Empty")
    assert "cat" in scene.sim.boats
    assert got(scene, "delete_model", "DeleteModel", model_name="cat").success


def test_a_place_beside_another_model_is_a_place_of_an_insert(course):
    scene = served(course)
    boat = scene.sim.observe()["wamv"]
    place = {"position": {"x": 20.0}, "orientation": {"w": 1.0}}
    told = got(scene, "spawn_sdf_model", "SpawnModel", model_name="mark", model_xml=LIGHT, initial_pose=place,
               reference_frame="wamv")  # fmt: skip
    assert told.success, told.status_message
    assert np.hypot(*(scene.sim.observe_object("mark").position - boat.position)[:2]) == pytest.approx(20.0, abs=0.1)


def test_what_was_removed_from_the_world_may_come_again_under_its_name(course):
    """And a reset of the simulation keeps the one that came."""
    scene = served(course)
    assert got(scene, "delete_model", "DeleteModel", model_name="crocodile_buoy").success
    assert inserted(scene, "crocodile_buoy", LIGHT).success
    service(scene, "/gazebo/reset_simulation", "std_srvs/Empty")
    assert scene.sim.observe_object("crocodile_buoy").position[0] == pytest.approx(-500.0)
    assert "crocodile_buoy" in scene.sim.lights


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("x", "hello", "SDF of x:1:1: is not XML, which begins with '<'"),
        ("x", "<robot/>", "SDF of x:1:1: <robot>: expected <sdf> with a <model> or an <include>"),
        ("x", '<sdf><light name="l"/></sdf>', "SDF of x:1:1: <sdf>: expected <sdf> with a <model> or an <include>"),
        ("x", "<sdf><include><uri>model://nope</uri></include></sdf>",
         ("SDF of x:1:6: <include> 'model://nope' / uri: no model 'nope' in `vrx-mj list objects`, nor on "
         "GAZEBO_MODEL_PATH or GZ_SIM_RESOURCE_PATH")),
        ("x", "<sdf><include><uri>model://../../etc</uri></include></sdf>",
         ("SDF of x:1:6: <include> 'model://../../etc' / uri: expected a model name, as model://NAME, got "
         "'model://../../etc'")),
        ("x", "<sdf><include><uri>file:///etc</uri></include></sdf>",
         ("SDF of x:1:6: <include> 'file:///etc' / uri: expected a model name, as model://NAME, got "
         "'file:///etc'")),
        ("x", '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><sdf><model name="&b;"/></sdf>',
         "SDF of x:1:13: <!DOCTYPE>: document types and entities are not allowed; remove them"),
        ("a b", LIGHT, "<object>: name: expected a name of up to 64 letters A-Z, digits, '_', '-' or '.', got 'a b'"),
        ("wamv", LIGHT, "invalid object name 'wamv': a boat of world example_course has this name"),
        ("x", " " * ((1 << 24) + 1), "x: the SDF has 16777217 characters; at most 16777216 are allowed"),
    ],
    ids=["text", "urdf", "light", "unknown", "out of the path", "file", "entity", "name", "taken", "long"],
)  # fmt: skip
def test_an_sdf_that_cannot_join_is_refused_in_words(course, name, text, message):
    scene = served(course)
    told = inserted(scene, name, text)
    assert (told.success, told.status_message) == (False, f"spawn_sdf_model: {message}")


def test_a_model_on_the_path_has_its_meshes_and_no_other_file_is_read(course, tmp_path, monkeypatch):
    folder = tmp_path / "shared" / "crate"
    folder.mkdir(parents=True)
    mesh = (
        '<visual name="v"><geometry><mesh><uri>model://{}/box.obj</uri></mesh></geometry></visual></link></model></sdf>'
    )
    text = BOX.replace("</link></model></sdf>", mesh.format("crate"))
    (folder / "box.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n")
    (folder / "model.sdf").write_text(text)
    (tmp_path / "here" / "near").mkdir(parents=True)
    (tmp_path / "here" / "near" / "model.sdf").write_text(text)
    monkeypatch.chdir(tmp_path / "here")
    scene = served(course)
    assert "no file 'model://crate/box.obj'" in inserted(scene, "alone", text).status_message
    assert not inserted(scene, "x", DATABASE.format("near")).success
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(tmp_path / "shared"))
    assert inserted(scene, "whole", text, x=-490.0).status_message == "whole joins as model://crate"
    assert inserted(scene, "named", DATABASE.format("crate"), x=-480.0).status_message == "named joins as model://crate"
    other = text.replace("200", "250")
    assert inserted(scene, "other", other, x=-470.0).status_message.startswith("other joins as the SDF's own crate; ")


def jointed(name, kind, child, axes="<axis><xyz>1 0 0</xyz></axis>"):
    return f'<joint name="{name}" type="{kind}"><parent>deck</parent><child>{child}</child>{axes}</joint>'


def piece(name, pose):
    shape = '<collision name="c"><geometry><box><size>1 1 0.5</size></box></geometry></collision>'
    return f'<link name="{name}"><pose>{pose}</pose><inertial><mass>60</mass></inertial>{shape}</link>'


LIMITED = (
    "<axis><xyz>1 0 0</xyz><limit><lower>-1</lower><upper>1</upper></limit>"
    "<dynamics><damping>4</damping></dynamics></axis>"
)
BARGE = "".join(
    (
        '<sdf version="1.6"><model name="barge">',
        piece("deck", "0 0 0 0 0 0"),
        piece("port", "0 1.5 0 0 0 0"),
        piece("bow", "1.5 0 0 0 0 0"),
        piece("ramp", "0 -1.5 0 0 0 0"),
        jointed("left", "revolute", "port", LIMITED),
        jointed("ahead", "universal", "bow", "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>1 0 0</xyz></axis2>"),
        jointed("slide", "prismatic", "ramp", LIMITED),
        "</model></sdf>",
    )
)


def test_links_and_joints_of_a_model_are_seen_and_moved(course):
    """Spawned from a text: its links are in `link_states`, its joints in `get_joint_properties`."""
    scene = served(course)
    inserted(scene, "barge", BARGE)
    run(scene, 1.0)
    listed = got(scene, "get_model_properties", "GetModelProperties", model_name="barge")
    assert list(listed.body_names) == ["deck", "port", "bow", "ramp"]
    assert list(listed.joint_names) == ["left", "ahead", "slide"]
    kinds = {
        name: got(scene, "get_joint_properties", "GetJointProperties", joint_name=name) for name in listed.joint_names
    }
    assert {name: (one.type, len(one.position)) for name, one in kinds.items()} == {
        "left": (0, 1),
        "ahead": (5, 2),
        "slide": (2, 1),
    }
    assert list(kinds["left"].damping) == [4.0]
    states = next(one for one in gazebo_topics(scene.server) if one.name == "/gazebo/link_states").make()
    port = states.pose[list(states.name).index("barge::port")]
    link = got(scene, "get_link_state", "GetLinkState", link_name="barge::port").link_state
    assert xyz(link.pose.position) == xyz(port.position)
    beside = got(scene, "get_link_state", "GetLinkState", link_name="barge::port", reference_frame="barge::deck")
    angle = kinds["left"].position[0]  # about the origin of the child, where the joint is
    assert xyz(beside.link_state.pose.position) == pytest.approx([0, 1.5, 0], abs=1e-9)
    assert beside.link_state.pose.orientation.x == pytest.approx(math.sin(angle / 2), abs=1e-9)
    wrong = got(scene, "get_joint_properties", "GetJointProperties", joint_name="right")
    assert wrong.status_message.startswith("get_joint_properties: no joint named 'right'; known: ")
    state = {"model_name": "barge", "pose": {"position": {"x": -490.0, "y": 240.0}}}
    moved = got(scene, "set_model_state", "SetModelState", model_state=state)
    assert moved.success, moved.status_message
    after = got(scene, "get_joint_properties", "GetJointProperties", joint_name="barge::left")
    assert (after.position[0], after.rate[0]) == (pytest.approx(angle, abs=1e-3), pytest.approx(0.0, abs=0.05))
    place = got(scene, "get_link_state", "GetLinkState", link_name="barge::port").link_state.pose.position
    assert xyz(place)[:2] == pytest.approx([-490.0, 241.5], abs=0.02)
    link = {"link_name": "barge::port", "pose": {"position": {"x": 0.0}}}
    refused = got(scene, "set_link_state", "SetLinkState", link_state=link)
    assert not refused.success


def test_the_physics_are_told_and_stay_as_they_are(course):
    scene = served(course)
    scene.server.update_rate = 200.0
    own = got(scene, "get_physics_properties", "GetPhysicsProperties")
    assert (own.success, own.time_step, own.max_update_rate, own.pause) == (True, 0.01, 200.0, False)
    assert xyz(own.gravity) == pytest.approx([0.0, 0.0, -9.8])
    same = {name: getattr(own, name) for name in ("time_step", "max_update_rate", "gravity", "ode_config")}
    assert got(scene, "set_physics_properties", "SetPhysicsProperties", **same).success
    stays = "cannot be changed"
    for name, value, why in (
        ("time_step", 0.001, f"time_step {stays}: 0.01, got 0.001"),
        ("time_step", math.nan, f"time_step {stays}: 0.01, got nan"),
        ("gravity", {"z": -1.6}, f"gravity {stays}"),
        ("ode_config", {"sor_pgs_iters": 50}, f"ode_config {stays}"),
    ):
        answer = got(scene, "set_physics_properties", "SetPhysicsProperties", **same | {name: value})
        assert (answer.success, answer.status_message) == (False, f"set_physics_properties: {why}")


WRENCH = "gazebo_msgs/ApplyBodyWrench"


def wrench(scene, **fields):
    body = {"body_name": "wamv::wamv/base_link", "duration": duration(1.0)}
    return service(scene, "/gazebo/apply_body_wrench", WRENCH, **body | fields)


def shoved(course, **fields):
    """How a boat moves [m/s, rad/s], 0.2 s after it was pushed, beside one that was not."""
    scenes = served(course), served(course)
    for scene in scenes:
        scene.sim.set_boat("wamv", pose=(-532, 162, 0.1, 0, 0, math.pi / 2))
    assert wrench(scenes[0], **fields).success
    for scene in scenes:
        run(scene, 0.2)
    one, other = (Bodies(scene.sim).model("wamv") for scene in scenes)
    return one.velocity - other.velocity, one.spin - other.spin


def test_a_wrench_pushes_in_the_axes_of_its_frame(course):
    force = {"force": {"x": 100.0}}
    world, straight = shoved(course, wrench=force)
    own, _ = shoved(course, wrench=force, reference_frame="wamv::wamv/base_link")
    half, _ = shoved(course, wrench=force, duration=duration(0.1))
    assert world[0] > 10.0 * abs(world[1]) > 0.0  # the bow points north: x is across
    assert own[1] > 10.0 * abs(own[0])
    assert half[0] == pytest.approx(0.5 * world[0], rel=0.1)  # drag
    _, turn = shoved(course, wrench={"torque": {"z": 100.0}})
    _, lever = shoved(course, wrench=force, reference_point={"y": -1.0})
    assert lever[2] - straight[2] == pytest.approx(turn[2], rel=1e-3)


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"body_name": "wamv::base_link"}, "no link named 'wamv::base_link'; did you mean 'wamv::wamv/base_link'?"),
        ({"reference_frame": "ship"}, "no model named 'ship'; "),
        ({"wrench": {"force": {"x": math.nan}}}, "invalid wrench.force [nan, 0.0, 0.0]: finite numbers are needed"),
        ({"wrench": {"force": {"z": 1e300}}}, "the force would accelerate wamv::wamv/base_link by "),
        ({"body_name": "post_0::link", "wrench": {"force": {"z": 1.0}}}, "post_0::link cannot move"),
    ],
)
def test_a_wrench_that_cannot_be_applied_is_refused_in_words(course, fields, why):
    scene = served(course)
    answer = wrench(scene, **fields)
    assert not answer.success
    assert answer.status_message.startswith(f"apply_body_wrench: {why}")
    run(scene, 0.1)


def test_a_wrench_ends_when_it_is_cleared_time_begins_anew_or_its_boat_leaves(course):
    scene = served(course)
    for _ in range(2):
        assert wrench(scene, wrench={"force": {"x": 100.0}}, duration=duration(-1.0)).success
        service(scene, "/gazebo/clear_body_wrenches", "gazebo_msgs/BodyRequest", body_name="wamv::wamv/base_link")
        run(scene, 0.1)
    assert wrench(scene, wrench={"force": {"x": 100.0}}, duration=duration(-1.0)).success
    still = served(course)
    for one in (scene, still):
        service(one, "/gazebo/reset_simulation", "std_srvs/Empty")
        run(one, 0.1)
    assert scene.sim.get_state().sha256 == still.sim.get_state().sha256
    assert wrench(scene, wrench={"force": {"x": 100.0}}, duration=duration(-1.0)).success
    assert service(scene, "/gazebo/delete_model", "gazebo_msgs/DeleteModel", model_name="wamv").success
    assert scene.told[-2:] == ["the force on wamv::wamv/base_link ends: it left", "wamv leaves"]
    run(scene, 0.1)


def test_what_holds_a_boat_is_neither_a_link_nor_a_joint():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("stationkeeping_task"))
    assert any(str(sim.model.body(body).name) == "carrier/wamv" for body in range(sim.model.nbody))
    bodies = Bodies(sim)
    assert "wamv::wamv/base_link" in bodies.links
    assert not [name for name in (*bodies.models, *bodies.links, *bodies.joints) if "carrier" in name]


def test_an_effort_turns_a_joint(course):
    scene = served(course)
    inserted(scene, "barge", BARGE)
    joint = {"joint_name": "barge::left", "effort": 80.0, "duration": duration(2.0)}
    before = got(scene, "get_joint_properties", "GetJointProperties", joint_name="barge::left").position[0]
    assert got(scene, "apply_joint_effort", "ApplyJointEffort", **joint).success
    run(scene, 2.0)
    after = got(scene, "get_joint_properties", "GetJointProperties", joint_name="barge::left").position[0]
    assert after > before + 0.05
    wrong = got(scene, "apply_joint_effort", "ApplyJointEffort", **joint | {"effort": math.inf})
    assert wrong.status_message == "apply_joint_effort: invalid force on barge::left: finite numbers are needed"


def test_model_states_have_the_boat_after_the_worlds_models_and_a_ball_once_it_is_fired(course):
    scene = served(course)
    states, links = (next(one.make for one in gazebo_topics(scene.server) if one.name.endswith(end))
                     for end in ("/model_states", "/link_states"))  # fmt: skip
    assert states().name[-1] == "wamv"
    assert not [name for name in (*states().name, *links().name) if "ball_shooter" in name]
    assert service(scene, "/ball_shooter", "vrx_gazebo/BallShooter", shoot=True).success
    run(scene, 0.1)
    assert "wamv::ball_shooter" in states().name
    assert "wamv::wamv/ball_shooter/link" in links().name
