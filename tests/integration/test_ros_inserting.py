"""Objects inserted over the wire of rosbridge into a world that `vrx-mj serve` serves, as a team's script does."""

import re
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

from ros1_served import free_port
from rosbridge_client import Talk

pytestmark = pytest.mark.slow

LIGHT = (
    '<?xml version="1.0"?>\n<sdf version="1.6"><model name="robotx_light_buoy"><pose>0 0 -0.0762 0 0 0</pose>'
    '<link name="base_link"/></model></sdf>'
)
COURSE = '<sdf version="1.4"><world name="default"><include><uri>model://short_navigation_course0</uri></include></world></sdf>'


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder, port = tmp_path_factory.mktemp("served"), free_port()
    command = [sys.executable, "-m", "vrx_mj", "serve", "ocean", "--rosbridge", str(port), "--record", "run.rrd"]
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8"
    ) as one:
        try:
            for line in one.stdout:
                if re.search(rf"ws://\S+:{port}", line):
                    break
            yield SimpleNamespace(url=f"ws://127.0.0.1:{port}", folder=folder, process=one)
        finally:
            one.send_signal(signal.SIGINT)
            one.communicate(timeout=60)


def asked(talk, service, **fields):
    return talk.call(f"/gazebo/{service}", fields)["values"]


def test_a_script_inserts_moves_and_deletes(served):
    with Talk(served) as talk:
        place = {"position": {"x": 40.0, "y": 5.0, "z": 0.3}, "orientation": {"w": 1.0}}
        told = asked(talk, "spawn_sdf_model", model_name="lamp", model_xml=LIGHT, initial_pose=place)
        assert told == {"success": True, "status_message": "lamp joins as the catalogue's robotx_light_buoy"}
        far = {"position": {"x": 120.0, "y": 50.0}}
        assert asked(talk, "spawn_sdf_model", model_name="course", model_xml=COURSE, initial_pose=far)["success"]
        talk.say("subscribe", topic="/gazebo/model_states", type="gazebo_msgs/ModelStates")
        while (message := talk.hear())["op"] != "publish":
            pass
        names = message["msg"]["name"]
        assert {"wamv", "lamp", "course", "course::red_bound_0"} <= {*names}
        talk.say("unsubscribe", topic="/gazebo/model_states")
        moved = {"model_name": "lamp", "pose": {"position": {"x": 44.0, "y": 5.0, "z": 0.2}, "orientation": {"w": 1.0}}}
        assert asked(talk, "set_model_state", model_state=moved)["success"]
        seen = asked(talk, "get_model_state", model_name="lamp")["pose"]["position"]
        assert seen["x"] == pytest.approx(44.0, abs=0.5)
        assert asked(talk, "get_model_state", model_name="course::red_bound_0")["success"]
        gone = asked(talk, "delete_model", model_name="lamp")
        assert gone == {"success": True, "status_message": "lamp leaves"}
        assert asked(talk, "get_world_properties")["model_names"] == ["course", "wamv"]
        why = asked(talk, "spawn_sdf_model", model_name="x", model_xml="hello", initial_pose=place)
        assert why["success"] is False
        assert why["status_message"].startswith("spawn_sdf_model: SDF of x:1:1: is not XML")
