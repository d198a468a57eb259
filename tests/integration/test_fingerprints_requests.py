"""What a served world answers to all that one can ask of it by Gazebo's names: answers, reports and what moved.

`tests/golden/ros/answers.json` has each request and what came of it, numbers to a tenth of a millimetre. After a
change that is meant, write it again with VRX_MJ_WRITE_FINGERPRINTS=1, and read what has changed.
"""

import json
import math
import os
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np

import vrx_mj
from fingerprints import WRITING
from integration.test_fingerprints_worlds import compiled
from ros_scene import run, served
from vrx_mj.ros.messages import new
from vrx_mj.ros.table import make_tables

GOLDEN = Path(__file__).parents[1] / "golden" / "ros" / "answers.json"
BOATS = [{"robot": "wamv", "pose": [6.0 * k, 30.0 * k, 0.0, 0, 0, 0.3 * k], "sensors": "none"} for k in range(2)]
"""Two boats apart from each other."""
CRANE = """<sdf version="1.6"><model name="crane"><link name="base"><inertial><mass>40</mass></inertial>
<collision name="c"><geometry><box><size>2 2 0.6</size></box></geometry></collision></link>
<link name="arm"><pose>0 0 1 0 0 0</pose><inertial><mass>2</mass></inertial></link>
<link name="hook"><pose>0 0 2 0 0 0</pose><inertial><mass>1</mass></inertial></link>
<joint name="swing" type="revolute"><parent>base</parent><child>arm</child><axis><xyz>0 0 1</xyz>
<limit><lower>-1</lower><upper>1</upper></limit><dynamics><damping>0.5</damping></dynamics></axis></joint>
<joint name="lift" type="prismatic"><parent>arm</parent><child>hook</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""
TURNED = {"z": math.sin(0.4), "w": math.cos(0.4)}
PLACE = {"position": {"x": 3.0, "y": -20.0, "z": 0.4}, "orientation": TURNED}
TWIST = {"linear": {"x": 1.0, "y": 0.5}, "angular": {"z": 0.2}}
NAN = {"x": math.nan}


def state(name, frame="", **what):
    return {"model_state": {"model_name": name, "reference_frame": frame, **what}}


def link(name, frame="", **what):
    return {"link_state": {"link_name": name, "reference_frame": frame, **what}}


def wrench(name, frame="", start=0.0, seconds=0.3, **what):
    spans = {"start_time": {"sec": int(start), "nanosec": 0}, "duration": {"sec": 0, "nanosec": int(1e9 * seconds)}}
    return {"body_name": name, "reference_frame": frame, **spans, **what}


PUSH = {"wrench": {"force": {"x": 300.0}, "torque": {"z": 50.0}}, "reference_point": {"y": 0.5}}
HULL, OTHER = "wamv1::wamv1/base_link", "wamv2::wamv2/base_link"
REQUESTS = [
    ("spawn_sdf_model", {"model_name": "crane", "model_xml": CRANE, "initial_pose": PLACE}),
    ("spawn_sdf_model", {"model_name": "crane", "model_xml": CRANE}), ("spawn_sdf_model", {"model_name": "x"}),
    ("spawn_urdf_model", {"model_name": "a", "robot_namespace": "/b/", "model_xml": "<robot/>"}),
    ("spawn_urdf_model", {"robot_namespace": "/b/", "model_xml": "none"}),
    ("get_world_properties", {}), ("get_physics_properties", {}),
    ("set_physics_properties", {}), ("set_physics_properties", {"time_step": 0.5}),
    *(("get_model_properties", {"model_name": name}) for name in ("wamv1", "crane", "nothing")),
    *(("get_joint_properties", {"joint_name": name}) for name in ("crane::swing", "crane::lift", "nothing")),
    *(("get_model_state", {"model_name": name, "relative_entity_name": frame})
      for name, frame in (("wamv1", ""), ("wamv2", "wamv1"), ("wamv1", HULL), ("crane", "world"), ("wamv1", "no"),
                          ("no", ""))),
    *(("get_link_state", {"link_name": name, "reference_frame": frame})
      for name, frame in ((HULL, ""), ("crane::arm", "wamv2"), ("nothing", ""), (HULL, "nothing"))),
    ("set_model_state", state("wamv1", pose=PLACE, twist=TWIST)), ("get_model_state", {"model_name": "wamv1"}),
    ("set_model_state", state("wamv2", "wamv1", pose={"position": {"x": 20.0}}, twist=TWIST)),
    ("get_model_state", {"model_name": "wamv2"}),
    ("get_model_state", {"model_name": "wamv2", "relative_entity_name": "wamv1"}),
    ("set_model_state", state("wamv1", pose={"position": NAN})), ("set_model_state", state("nothing")),
    ("set_model_state", state("wamv1", pose={"orientation": NAN})),
    ("set_model_state", state("wamv1", twist={"linear": NAN})),
    ("set_link_state", link(HULL, pose=PLACE)), ("get_model_state", {"model_name": "wamv1"}),
    ("set_link_state", link("no")),
    ("apply_body_wrench", wrench(HULL, **PUSH)),
    ("apply_body_wrench", wrench(OTHER, HULL, start=0.0, seconds=-1.0, **PUSH)),
    ("apply_body_wrench", wrench("no", **PUSH)), ("apply_body_wrench", wrench(HULL, wrench={"force": NAN})),
    ("apply_joint_effort", {"joint_name": "crane::swing", "effort": 3.0, "duration": {"sec": 1, "nanosec": 0}}),
    ("apply_joint_effort", {"joint_name": "no"}), (None, 0.4),
    ("get_joint_properties", {"joint_name": "crane::swing"}), ("get_model_state", {"model_name": "wamv2"}),
    ("clear_body_wrenches", {"body_name": OTHER}), ("clear_body_wrenches", {"body_name": "no"}),
    ("clear_joint_forces", {"joint_name": "crane::swing"}), ("clear_joint_forces", {"joint_name": "no"}), (None, 0.2),
    ("get_model_state", {"model_name": "wamv2"}),
    ("/vrx_mj/step", {"duration": 0.05}), ("/vrx_mj/step", {"duration": 0.0}), ("/vrx_mj/step", {"duration": -1.0}),
    ("/vrx_mj/step", {"duration": 3600.0}), ("/vrx_mj/step", {"duration": 0.0123}),




    ("pause_physics", {}), ("get_physics_properties", {}), ("unpause_physics", {}), ("reset_world", {}),
    ("get_model_state", {"model_name": "wamv1"}), ("delete_model", {"model_name": "crane_1"}),
    ("reset_simulation", {}), ("get_world_properties", {}), ("get_model_state", {"model_name": "crane"}),
]  # fmt: skip
"""Services, those of `/gazebo/` by their last names, with requests; without a name a time that goes on [s]."""
COMMANDS = [
    ("/wamv1/cmd_vel", {"linear": {"x": 0.4}, "angular": {"z": 0.1}}), ("/wamv1/cmd_vel", {"linear": NAN}),
    ("/wamv1/cmd_vel", {"angular": {"z": math.inf}}), ("/wamv1/cmd_drive", {"left": 0.2, "right": 0.6}),
    ("/wamv1/thrusters/left_thrust_cmd", {"data": 0.7}), ("/wamv1/thrusters/left_thrust_cmd", {"data": math.nan}),
    ("/wamv2/thrusters/right_thrust_angle", {"data": 0.3}), ("/wamv2/thrusters/right_thrust_angle", {"data": 9.0}),
    ("vrx3 /wamv2/thrusters/left/thrust", {"data": 100.0}), ("vrx3 /wamv2/thrusters/left/thrust", {"data": 9e9}),
    ("vrx3 /wamv2/thrusters/left/thrust", {"data": math.inf}), ("vrx3 /wamv1/thrusters/right/pos", {"data": -0.2}),
    ("/swarm/formation", {"data": "circle 5"}),
    ("/swarm/formation", {"data": "off"}), ("/gazebo/set_model_state", {"model_name": "wamv1", "pose": PLACE}),
    ("/gazebo/set_link_state", {"link_name": "no"}), ("/wamv9/cmd_vel", {}),
]  # fmt: skip
"""Topics, VRX 3's by its name, with messages."""


def plain(value):
    """A message as JSON has it, numbers to four decimals."""
    if is_dataclass(value):
        return {one.name: plain(getattr(value, one.name)) for one in fields(value) if not one.name.startswith("__")}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(part) for part in value]
    if isinstance(value, float | np.floating):
        return round(float(value), 4) + 0.0 if math.isfinite(value) else str(value)
    return value.item() if isinstance(value, np.generic) else value


def conversation():
    scene = served(vrx_mj.Simulation(compiled("ocean", fleet={"boats": BOATS}), seed=3))
    for name, request in REQUESTS:
        if name is None:
            run(scene, request)
            continue
        full, answers = name if name.startswith("/") else f"/gazebo/{name}", []
        made = new(f"{scene.server.table.services[full].type}Request", **request)
        scene.inbox.call(full, made, "/test", lambda *answer, answers=answers: answers.append(answer))
        scene.server.receive()
        ((response, why),) = answers
        yield [name, plain(response), why, *scene.told]
        scene.told.clear()
    scene = served(vrx_mj.Simulation(compiled("ocean", fleet={"boats": BOATS}), seed=3))
    both = scene.server._tables | make_tables(scene.server, clock_rate=100.0)
    scene.server._tables = both
    for topic, message in COMMANDS:
        space, _, name = topic.rpartition(" ")
        dialect = space or "vrx"
        kind = both[dialect].inputs[name].type if name in both[dialect].inputs else "std_msgs/Empty"
        scene.inbox.message(name, new(kind, **message), "/test", dialect)
        run(scene, 0.1)
        seen = scene.sim.observe()
        yield [topic, *([plain(one.position), plain(one.velocity)] for one in seen.values()), *scene.told]
        scene.told.clear()
    run(scene, 1.0)
    yield ["a second later", *([plain(one.position), plain(one.velocity)] for one in scene.sim.observe().values())]


def test_answers_are_what_they_were():
    rows = [json.dumps(row, ensure_ascii=False) for row in conversation()]
    if os.environ.get(WRITING):
        GOLDEN.write_text("[\n" + ",\n".join(rows) + "\n]\n", encoding="utf-8")
        return
    kept = json.loads(GOLDEN.read_text(encoding="utf-8"))
    for row, expected in zip(rows, kept, strict=True):
        assert json.loads(row) == expected
