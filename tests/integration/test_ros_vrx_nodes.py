"""VRX's own nodes by their names, as `vrx-mj ros packages` writes them: what they publish for what comes."""

import shutil
import subprocess
from dataclasses import replace

import pytest

from axes_files import SAMPLES, WORLDS
from needs import ROS1_TOOLS, needs
from ros1_served import Served, environment, free_port, running, small_table, tools, until
from vrx_mj.frames import quaternion
from vrx_mj.ros.interface import Delivery, Input, Output
from vrx_mj.ros.messages import new
from vrx_mj.ros.packages import write_launch_packages, write_packages

pytestmark = [pytest.mark.slow, needs(ROS1_TOOLS)]

TWIST, FLOAT, VECTOR, STATES = (
    "geometry_msgs/Twist", "std_msgs/Float32", "geometry_msgs/Vector3", "gazebo_msgs/ModelStates",
)  # fmt: skip
LEFT, RIGHT = "/wamv/thrusters/left_thrust_cmd", "/wamv/thrusters/right_thrust_cmd"
PINGER = "/wamv/sensors/pingers/pinger/set_pinger_position"
ANGLES = (0.3, -0.2, 2.0)


def turned(roll, pitch, yaw):
    w, x, y, z = quaternion(roll, pitch, yaw)
    return {"w": w, "x": x, "y": y, "z": z}


SENT = {
    "/wamv/twist": new(TWIST, linear={"x": 0.75}, angular={"z": 0.25}),
    "/imu": new("sensor_msgs/Imu", orientation=turned(*ANGLES)),
    "/pose": new("geometry_msgs/Pose", orientation=turned(*ANGLES)),
    "/odometry": new("nav_msgs/Odometry", pose={"pose": {"orientation": turned(*ANGLES)}}),
    "/poses": new("geometry_msgs/PoseArray", poses=[new("geometry_msgs/Pose"),
                                                    new("geometry_msgs/Pose", orientation=turned(*ANGLES))]),
    "/gazebo/model_states": new(STATES, name=["buoy", "wamv"], twist=[new(TWIST), new(TWIST)], pose=[
        new("geometry_msgs/Pose"), new("geometry_msgs/Pose", orientation=turned(*ANGLES)),
    ]),
}  # fmt: skip
TYPES = {
    "/wamv/twist": TWIST, "/imu": "sensor_msgs/Imu", "/pose": "geometry_msgs/Pose", "/odometry": "nav_msgs/Odometry",
    "/poses": "geometry_msgs/PoseArray", "/gazebo/model_states": STATES,
}  # fmt: skip
HEARD = {LEFT: FLOAT, RIGHT: FLOAT, PINGER: VECTOR, "/rpy": VECTOR, "/wamv_rpy": VECTOR}


def table():
    """What the nodes listen to, each the same all the time, and what they publish."""
    plain = small_table()
    outputs = {name: Output(name, kind, lambda: None) for name, kind in TYPES.items()}
    inputs = {name: Input(name, kind, lambda _: None) for name, kind in HEARD.items()}
    return replace(plain, outputs={**plain.outputs, **outputs}, inputs=inputs)


class Telling(Served):
    """It publishes what somebody listens to."""

    def _batch(self, t):
        return [
            Delivery(self.table.outputs[name], SENT[name], t) for name in self.wires.subscribed_topics if name in SENT
        ]

    def heard(self, topic):
        """The first message that has come on a topic."""
        came = []

        def is_there():
            came.extend(one.message for one in self.commands if one.topic == topic)
            return came

        until(is_there, topic, 30.0)
        return came[0]


@pytest.fixture
def served():
    with Telling(free_port(), table()) as one:
        yield one


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("packages")
    write_launch_packages(folder)
    return folder


def node(packages, name, *words):
    return [str(packages / "vrx_gazebo/nodes" / name), *words]


@pytest.mark.parametrize(("option", "left", "right"), [([], 0.75, 0.25), (["--keyboard"], 0.5, 1.0)])
def test_twist2thrust_has_both_modes_of_vrx(served, packages, tmp_path, option, left, right):
    names = ["cmd_vel:=/wamv/twist", f"left_cmd:={LEFT}", f"right_cmd:={RIGHT}"]
    with running(node(packages, "twist2thrust.py", *option, *names), served.port, tmp_path):
        assert (served.heard(LEFT).data, served.heard(RIGHT).data) == (left, right)
        assert "/ball_shooter" not in tools("rosservice list", served.port, tmp_path).split()  # the simulation's


def test_twist2thrust_in_a_namespace_offers_the_ball_shooter_there(served, packages, tmp_path):
    write_packages(tmp_path / "messages")
    command = ["/usr/bin/env", f"PYTHONPATH={tmp_path}/messages/python", *node(packages, "twist2thrust.py")]
    with running([*command, "__ns:=/wamv"], served.port, tmp_path):
        services = lambda: tools("rosservice list", served.port, tmp_path).split()  # noqa: E731
        until(lambda: "/wamv/ball_shooter" in services(), "the service", 30.0)


QUATERNIONS = {
    "/pose": [],
    "/imu": ["_input_msg_type:=Imu"],
    "/odometry": ["_input_msg_type:=Odometry"],
    "/poses": ["_pose_index:=1"],
    "/gazebo/model_states": ["_model_name:=wamv"],
}
"""Options of `quat2rpy.py` for each topic."""


def test_quat2rpy_gives_the_angles_of_a_quaternion(packages, tmp_path, subtests):
    write_packages(tmp_path / "messages")
    for topic, option in QUATERNIONS.items():
        words = [f"in_topic:={topic}", "out_topic:=/rpy", *option]
        command = ["/usr/bin/env", f"PYTHONPATH={tmp_path}/messages/python", *node(packages, "quat2rpy.py", *words)]
        with subtests.test(topic), Telling(free_port(), table()) as served:
            with running(command, served.port, tmp_path):
                rpy = served.heard("/rpy")
            assert (rpy.x, rpy.y, rpy.z) == pytest.approx(ANGLES)


def test_quat2rpy_names_the_types_that_it_takes(served, packages, tmp_path):
    done = subprocess.run(
        node(packages, "quat2rpy.py", "_input_msg_type:=Point"), env=environment(served.port, tmp_path), cwd=tmp_path,
        capture_output=True, encoding="utf-8", timeout=60.0, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "invalid input_msg_type 'Point'; allowed: Pose, Imu, Odometry\n" in done.stderr


@pytest.mark.parametrize(
    ("launch", "topic", "place"),
    [("pinger", PINGER, (-483.0, 295.5, 0.0)), ("quat2rpy", "/wamv_rpy", ANGLES)],
)
def test_launch_files_start_them(served, packages, tmp_path, launch, topic, place):
    write_packages(tmp_path / "messages")
    ready = f"PYTHONPATH={tmp_path}/messages/python ROS_PACKAGE_PATH={packages}"
    with running(["/bin/bash", "-c", f"{ready} exec roslaunch vrx_gazebo {launch}.launch"], served.port, tmp_path):
        came = served.heard(topic)
    assert (came.x, came.y, came.z) == pytest.approx(place)


def test_generate_worlds_takes_its_files_from_parameters(served, packages, tmp_path):
    """As a copy of VRX's launch file sets them."""
    shutil.copy(SAMPLES / "scan_and_dock_shallow.yaml", tmp_path / "axes.yaml")
    (tmp_path / "mine.launch").write_text(
        f'<launch><param name="requested" value="{tmp_path}/axes.yaml"/>'
        f'<param name="world_target" value="{tmp_path}/worlds"/>'
        '<node name="world_gen" pkg="vrx_gazebo" type="generate_worlds.py" required="true" output="screen"/></launch>',
        encoding="utf-8",
    )
    said = tools(f"ROS_PACKAGE_PATH={packages} roslaunch mine.launch", served.port, tmp_path)
    assert len([*(tmp_path / "worlds").glob("*[0-9].yaml")]) == WORLDS["scan_and_dock_shallow"], said


def test_generate_wamv_takes_its_files_from_parameters(served, packages, tmp_path):
    """As a copy of VRX's launch file sets them, in a namespace; a part that breaks a rule is no failure, as there."""
    engine = 'engine:\n  - prefix: left\n    position: "-5 1.03 0.32"\n    orientation: "0 0 0"\n'
    (tmp_path / "engines.yaml").write_text(engine, encoding="utf-8")
    (tmp_path / "none.yaml").write_text("", encoding="utf-8")
    files = {"thruster_yaml": "engines.yaml", "component_yaml": "none.yaml", "wamv_target": "boat.urdf"}
    set_ = "".join(f'<param name="{name}" value="{tmp_path}/{file}"/>' for name, file in files.items())
    node = '<node name="wamv_generator" pkg="vrx_gazebo" type="generate_wamv.py" required="true" output="screen"/>'
    (tmp_path / "mine.launch").write_text(
        f'<launch><group ns="wamv_config">{set_}<param name="wamv_locked" value="true"/>{node}</group></launch>',
        encoding="utf-8",
    )
    said = tools(f"ROS_PACKAGE_PATH={packages} roslaunch mine.launch 2>&1", served.port, tmp_path)
    assert "process has finished cleanly" in said
    assert "1 of 1 parts break a rule" in said
    assert 'name="left_propeller_link"' in (tmp_path / "boat.urdf").read_text(encoding="utf-8").replace("wamv/", "")
