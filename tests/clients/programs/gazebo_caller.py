"""Calls Gazebo's services as a test rig does: puts the boat somewhere, pushes it, measures, asks for what there is."""

import math
import sys

import rospy
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import (
    ApplyBodyWrench,
    ApplyBodyWrenchRequest,
    DeleteModel,
    GetLinkState,
    GetModelState,
    GetPhysicsProperties,
    GetWorldProperties,
    SetModelState,
    SetPhysicsProperties,
    SpawnModel,
)
from geometry_msgs.msg import Pose
from std_srvs.srv import Empty

KINDS = {
    "get_model_state": GetModelState, "set_model_state": SetModelState, "get_link_state": GetLinkState,
    "apply_body_wrench": ApplyBodyWrench, "get_physics_properties": GetPhysicsProperties,
    "set_physics_properties": SetPhysicsProperties, "get_world_properties": GetWorldProperties,
    "spawn_sdf_model": SpawnModel, "delete_model": DeleteModel, "pause_physics": Empty, "unpause_physics": Empty,
}  # fmt: skip
BUOY = "<sdf version='1.6'><world name='x'><include><uri>model://mb_marker_buoy_red</uri></include></world></sdf>"
FORCE, SECONDS = 200.0, 2.0

rospy.init_node("gazebo_caller")
for name in KINDS:
    rospy.wait_for_service(f"/gazebo/{name}")
call = {name: rospy.ServiceProxy(f"/gazebo/{name}", kind) for name, kind in KINDS.items()}
print("ready", flush=True)


def check(answer):
    """The answer of a service, which must have done what it was asked."""
    if not answer.success:
        sys.exit(f"refused: {answer.status_message}")
    return answer


def place():
    """Where the boat is, and its velocity."""
    state = check(call["get_model_state"]("wamv", ""))
    return state.pose.position, state.twist.linear


state = ModelState(model_name="wamv")
state.pose.position.x, state.pose.position.y, state.pose.position.z = -532.0, 165.0, 0.0
state.pose.orientation.w = 1.0
check(call["set_model_state"](state))
at, _ = place()
print("placed", math.hypot(at.x + 532.0, at.y - 165.0), flush=True)
push = ApplyBodyWrenchRequest(body_name="wamv::wamv/base_link", duration=rospy.Duration(SECONDS))
push.wrench.force.y = FORCE
check(call["apply_body_wrench"](push))
rospy.sleep(SECONDS)
print("pushed to", place()[1].y, flush=True)
physics = call["get_physics_properties"]()
check(call["set_physics_properties"](physics.time_step, physics.max_update_rate, physics.gravity, physics.ode_config))
check(call["spawn_sdf_model"]("mark", BUOY, "", Pose(position=state.pose.position), "world"))
print("models", *call["get_world_properties"]().model_names, flush=True)
check(call["get_link_state"]("wamv::wamv/base_link", ""))
check(call["delete_model"]("mark"))
call["pause_physics"]()
call["unpause_physics"]()
begun = rospy.Time.now()
rospy.sleep(0.5)
print("time went on by", (rospy.Time.now() - begun).to_sec(), flush=True)
rospy.spin()
