"""Gazebo's services: places and velocities relative to other models, and in whose axes they are."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ros_scene import call as service
from ros_scene import served
from trees import partial
from vrx_mj.frames import quaternion, rotation
from vrx_mj.ros.messages import new
from vrx_mj.ros.table.boats import twist_commands
from vrx_mj.ros.table.gazebo import gazebo_services
from vrx_mj.ros.table.host import Placed

NORTH = quaternion(0.0, 0.0, math.pi / 2)
LEVEL = (1.0, 0.0, 0.0, 0.0)


def placed(position=(0, 0, 0), turn=LEVEL, velocity=(0, 0, 0), spin=(0, 0, 0)):
    return Placed(*(np.array(values, float) for values in (position, turn, velocity, spin)))


class Host:
    """A boat `a` and models that a test gives; notes where the boat is put."""

    def __init__(self, **models):
        self.bodies = SimpleNamespace(
            model=models.__getitem__,
            named_model=str,
            frame=lambda name: None if name in {"", "world"} else models[name],
        )
        self.sim = SimpleNamespace(time=2.0, boats=("a",), set_boat=self.put)
        self.reset_world = self.reset_simulation = self.moved = lambda: None

    def put(self, name, *, pose, velocity):
        self.pose, self.velocity = np.array(pose), np.array(velocity)


def call(host, name, **fields):
    service = next(one for one in gazebo_services(host) if one.name == f"/gazebo/{name}")
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
WHOLE = "get_model_state: the model 'short_navigation_course_0' has no place of its own: give one of its models, "


def test_models_in_models_are_found_by_gazebos_names_and_by_ours(course):
    """And what is made of models alone says which."""
    scene = served(course)

    def got(name, kind, **fields):
        return service(scene, f"/gazebo/{name}", f"gazebo_msgs/{kind}", **fields)

    own = PART.replace("::", "/")
    ours, theirs = (got("get_model_state", "GetModelState", model_name=name).pose.position for name in (own, PART))
    assert xyz(ours) == xyz(theirs) == [*scene.sim.observe_object(own).position]
    assert xyz(got("get_link_state", "GetLinkState", link_name=f"{PART}::link").link_state.pose.position) == xyz(ours)
    beside = got("get_model_state", "GetModelState", model_name="wamv", relative_entity_name=PART)
    assert math.hypot(*xyz(beside.pose.position)) > 5.0
    whole = {"model_name": "short_navigation_course_0"}
    refused = got("get_model_state", "GetModelState", **whole)
    assert not refused.success
    assert refused.status_message == f"{WHOLE}short_navigation_course_0::red_bound_0 and 5 more"
    properties = got("get_model_properties", "GetModelProperties", **whole)
    assert (len(properties.body_names), properties.is_static) == (6, False)
    assert "red_bound_1::link" in properties.body_names
    state = {"model_name": PART, "pose": {"position": {"x": -470.0, "y": 190.0, "z": 0.0}}}
    got("set_model_state", "SetModelState", model_state=state)
    assert scene.sim.observe_object(own).position[0] == pytest.approx(-470.0)
    wrong = got("get_model_state", "GetModelState", model_name="wamv", relative_entity_name="wamv::nose")
    assert wrong.status_message.startswith("get_model_state: no link named 'wamv::nose'; known: ")
