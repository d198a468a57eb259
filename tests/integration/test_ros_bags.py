"""`vrx-mj run --bag` and `vrx-mj convert`: two ways from a run to the same messages."""

import dataclasses
import json
import re
import shutil
import subprocess
from dataclasses import astuple

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from typer.testing import CliRunner

from integration.sailing import GUSTY, ROUGH
from integration.sensing import SYDNEY
from needs import ROSBAG, needs
from ros1_served import Served, free_port, small_table, tools
from vrx_mj.cli.program import app
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.recording import read_record, record
from vrx_mj.ros.bags import bag_run
from vrx_mj.ros.convert import Moment, _outputs_of, convert
from vrx_mj.ros.messages import encode
from vrx_mj.ros.packages import write_packages
from vrx_mj.ros.table.boats import command_topic
from vrx_mj.runtime.run import run
from vrx_mj.runtime.simulation import Simulation

BAY = {
    "name": "bay",
    "physics": {"profile": "vrx"},
    "georeference": SYDNEY,
    "sea": ROUGH,
    "wind": GUSTY,
    "objects": [{"name": "buoy", "model": "mb_marker_buoy_red", "pose": [30.0, 10.0, 0.0, 0.0, 0.0, 0.0]}],
    "task": {
        "type": "wayfinding",
        "waypoints": [[-33.7241, 150.6798, 0.3]],
        "initial_state_duration": 0.5,
        "ready_state_duration": 0.5,
    },
}
SECONDS = 2.13
SENSED = ("gps/gps/fix", "gps/gps/fix_velocity", "imu/imu/data", "pingers/pinger/range_bearing")
COMMANDS = {"wamv": {"left": 0.6, "right": -0.4, "left_angle": 0.3, "lateral": 0.2}}


def steer(_seen, time):
    return COMMANDS if time > 0.5 else None


@pytest.fixture(scope="module")
def world():
    return compile_world({**BAY, "spawn": {"sensors": "vrx"}})


@pytest.fixture(scope="module")
def sailed(tmp_path_factory, world):
    """A run with a recording and a bag, what it ended in without either, and the recording as a bag."""
    folder = tmp_path_factory.mktemp("sailed")
    alone = run(Simulation(world), SECONDS, controller=steer).state_sha256
    sim = Simulation(world)
    sensors = [f"wamv:{name}" for name in ("gps_wamv", "imu_wamv", "pinger")]
    with (
        record(sim, folder / "run.rrd", sea=False, sensors=sensors),
        bag_run(sim, folder / "run.bag", steer) as (advance, controller),
    ):
        summary = run(sim, SECONDS, controller=controller, advance=advance)
    count = convert(folder / "run.rrd", folder / "converted.bag")
    return folder, alone, summary.state_sha256, count


def read(path):
    """Messages by topic and time [ns]; the last of a moment."""
    with AnyReader([path]) as reader:
        found = {}
        for connection, time, raw in reader.messages():
            found.setdefault(connection.topic, {})[time] = reader.deserialize(raw, connection.msgtype)
    return found


@pytest.fixture(scope="module")
def bags(sailed):
    return read(sailed[0] / "run.bag"), read(sailed[0] / "converted.bag")


def test_a_bag_does_not_change_the_motion(sailed):
    _, alone, with_bag, _ = sailed
    assert with_bag == alone


def test_a_bag_has_what_a_served_simulation_tells_and_what_was_commanded(bags):
    live, _ = bags
    sensors = {f"/wamv/sensors/{tail}" for tail in (*SENSED, "pingers/pinger/marker/ground_truth")}
    commands = {command_topic("wamv", name) for name in COMMANDS["wamv"]}
    expected = {
        "/clock", "/tf", "/tf_static", "/gazebo/model_states", "/gazebo/link_states", "/gazebo/performance_metrics",
        "/vrx/debug/wind/speed", "/vrx/debug/wind/direction", "/vrx/task/info", "/wamv/joint_states",
        *sensors, *commands,
    }  # fmt: skip
    assert expected <= set(live)
    assert not [topic for topic in live if topic.endswith(("image_raw", "compressed", "/points"))]
    assert len(live["/clock"]) == len(live["/gazebo/model_states"]) == 1 + 100 * SECONDS
    assert {message.data for message in live["/wamv/thrusters/left_thrust_cmd"].values()} == {np.float32(0.6)}


def test_a_bag_tells_where_boats_were_to_the_last_bit(sailed, bags):
    live, _ = bags
    track = read_record(sailed[0] / "run.rrd").boats["wamv"]
    times = [round(time * 1e9) for time in read_record(sailed[0] / "run.rrd").time]
    states = live["/gazebo/model_states"]
    common = [(i, states[time]) for i, time in enumerate(times) if time in states]
    assert len(common) >= 20 * SECONDS - 1
    for i, message in common:
        place = message.pose[message.name.index("wamv")].position
        assert (place.x, place.y, place.z) == tuple(track.position[i])


@pytest.mark.parametrize(
    "topic",
    [
        "/clock", "/tf", "/gazebo/model_states", "/gazebo/link_states", "/wamv/joint_states", "/vrx/debug/wind/speed",
        "/vrx/debug/wind/direction", "/vrx/task/info", *(f"/wamv/sensors/{tail}" for tail in SENSED),
    ],
)  # fmt: skip
def test_a_recording_gives_the_messages_that_the_run_gave(bags, topic):
    live, converted = bags
    common = sorted(live[topic].keys() & converted[topic].keys())
    assert len(common) >= {"/vrx/task/info": 2, "/wamv/sensors/pingers/pinger/range_bearing": 2}.get(topic, 20)
    kind = live[topic][common[0]].__msgtype__
    for time in common:
        assert encode(bladeless(converted[topic][time]), kind) == encode(bladeless(live[topic][time]), kind), time


def test_a_moment_of_a_recording_observes_the_boats_of_its_row(sailed):
    recorded = read_record(sailed[0] / "run.rrd")
    moment, track = Moment(recorded, recorded.companies[0]), recorded.boats["wamv"]
    for i in (10, 30):
        moment.show(recorded.rows[i][moment.columns])
        seen = moment.observe()["wamv"]
        assert (seen.position == track.position[i]).all()
        assert (seen.quaternion == track.quaternion[i]).all()
        assert seen.velocity == pytest.approx(track.velocity[i], abs=1e-12)
        assert seen.angular_velocity == pytest.approx(track.angular_velocity[i], abs=1e-12)


def test_from_its_first_row_on_a_recordings_sea_is_that_of_the_runs_seed(tmp_path):
    world = compile_world({**BAY, "sea": {"model": "jonswap", "sea_state": 2}})
    sim, of_world = Simulation(world, seed=7), Simulation(world)
    with record(sim, tmp_path / "run.rrd", sea=False):
        sim.step(duration=0.1)
    recorded = read_record(tmp_path / "run.rrd")
    moment = _outputs_of(recorded, recorded.companies[0]).moment
    there = 3.0, 4.0, 5.0
    assert moment.sea.height(*there) == sim.sea.height(*there) != of_world.sea.height(*there)


def bladeless(message):
    """A message without the angles of propellers, which a recording's rows are too far apart to tell."""
    if message.__msgtype__ == "tf2_msgs/msg/TFMessage":
        frames = [frame for frame in message.transforms if not frame.child_frame_id.endswith("propeller_link")]
        return dataclasses.replace(message, transforms=frames)
    if message.__msgtype__ == "sensor_msgs/msg/JointState":
        kept = [i for i, name in enumerate(message.name) if not name.endswith("propeller_joint")]
        rows = {field: np.take(getattr(message, field), kept) for field in ("position", "velocity", "effort")}
        return dataclasses.replace(message, name=[message.name[i] for i in kept], **rows)
    return message


def test_a_recording_gives_odometry_of_a_boat_without_such_a_sensor(bags):
    live, converted = bags
    odometry = converted["/wamv/sensors/position/p3d_wamv"]
    assert len(odometry) == pytest.approx(10 * SECONDS, abs=1)
    for time, message in odometry.items():
        if time in live["/gazebo/model_states"]:
            states = live["/gazebo/model_states"][time]
            wamv = states.name.index("wamv")
            assert astuple(message.pose.pose) == astuple(states.pose[wamv])
            assert astuple(message.twist.twist) == astuple(states.twist[wamv])
    assert (message.header.frame_id, message.child_frame_id) == ("map", "wamv/base_link")


def test_a_recordings_commands_are_those_that_were_given(bags):
    """The command is read off a table of the thrust, which tells it to a thousandth; engines turn at their own pace."""
    _, converted = bags
    late = {name: [m.data for t, m in converted[command_topic("wamv", name)].items() if t > 1e9] for name in
            ("left", "right", "lateral", "left_angle")}  # fmt: skip
    assert late["left"] == pytest.approx([0.6] * len(late["left"]), abs=1e-3)
    assert late["right"] == pytest.approx([-0.4] * len(late["right"]), abs=1e-3)
    assert late["lateral"] == pytest.approx([0.2] * len(late["lateral"]), abs=1e-3)
    assert max(late["left_angle"]) <= 0.3 + 1e-6
    early = [message.data for time, message in converted["/wamv/thrusters/left_thrust_cmd"].items() if time < 5e8]
    assert early == pytest.approx([0.0] * len(early), abs=1e-3)


@pytest.mark.slow
@needs(ROSBAG)
@pytest.mark.parametrize("name", ["run.bag", "converted.bag"])
def test_rosbag_tells_what_is_in_them(sailed, name):
    done = subprocess.run(
        ["/usr/bin/rosbag", "info", sailed[0] / name], env={"PATH": "/usr/bin"}, capture_output=True, encoding="utf-8",
        timeout=60, check=True,
    )  # fmt: skip
    assert re.search(r"vrx_gazebo/Task +\[8b3267cadc02a4d8846adeb79baa09a1\]", done.stdout)
    assert re.search(r"/gazebo/model_states +\d+ msgs +: gazebo_msgs/ModelStates", done.stdout)


@pytest.mark.slow
@needs(ROSBAG)
@pytest.mark.parametrize("name", ["run.bag", "converted.bag"])
def test_rosbag_checks_indexes_filters_and_plays_them(sailed, tmp_path, name):
    """`check` compares comments of definitions too, so that bags have those of the ROS that is installed."""
    shutil.copy(sailed[0] / name, tmp_path / "run.bag")
    write_packages(tmp_path / "messages")
    paths = f"export PYTHONPATH={tmp_path}/messages/python ROS_PACKAGE_PATH={tmp_path}/messages/share\n"
    port = free_port()
    checked = tools(f"{paths} rosbag check run.bag", port, tmp_path)
    assert checked == "Bag file does not need any migrations.\n"
    filtered = "rosbag filter run.bag some.bag \"topic == '/clock'\" && rosbag info -y -k messages some.bag"
    count = int(tools(f"{paths} rosbag info -y -k messages run.bag", port, tmp_path))
    assert 0 < int(tools(f"{paths} {filtered}", port, tmp_path).split()[-1]) < count
    indexed = tools(f"{paths} rosbag reindex -q run.bag && rosbag info -y -k messages run.bag", port, tmp_path)
    assert int(indexed) == count
    with Served(port, small_table()):
        played = tools(f"{paths} rosbag play -q -r 10 run.bag; echo $?", port, tmp_path)
    assert played.endswith("Done.\n0\n"), played
    assert not re.search("warn|error", played, re.I), played


def test_boats_that_come_and_go_are_in_a_converted_bag_while_they_are_there(tmp_path, world):
    sim = Simulation(world)
    with record(sim, tmp_path / "run.rrd", sea=False):
        sim.advance(50)
        sim.spawn("guest", pose=(-520.0, 180.0, 0.1, 0.0, 0.0, 1.0))
        sim.advance(50)
        sim.remove("guest")
        sim.advance(50)
    convert(tmp_path / "run.rrd", tmp_path / "out_dir")
    found = read(tmp_path / "out_dir")
    assert len({str(near) for message in found["/tf_static"].values() for near in message.transforms[:1]}) == 1
    named = {time: list(message.name) for time, message in found["/gazebo/model_states"].items()}
    assert {time for time, names in named.items() if "guest" in names} == {t for t in named if 5e8 <= t < 1e9 - 1}
    assert set(found["/guest/joint_states"]) == {t for t in named if 5e8 <= t < 1e9 - 1}
    assert all("wamv" in names for names in named.values())


def test_a_gymkhana_is_converted_without_its_contacts_which_no_recording_holds(tmp_path):
    sim = Simulation(compile_world("gymkhana"))
    with record(sim, tmp_path / "run.rrd", sea=False):
        run(sim, 0.5)
    assert convert(tmp_path / "run.rrd", tmp_path / "run.bag") > 0
    topics = set(read(tmp_path / "run.bag"))
    assert "/vrx/gymkhana_channel/task/info" in topics
    assert not [topic for topic in topics if topic.endswith("/debug/contact")]


def test_the_command_line_writes_and_converts(tmp_path):
    (tmp_path / "bay.yaml").write_text(json.dumps({**BAY, "spawn": {"sensors": "none"}}), encoding="utf-8")
    command = ["run", str(tmp_path / "bay.yaml"), "--duration", "0.3", "--thrust", "left=0.5,right=0.5"]
    files = ["--bag", str(tmp_path / "run.mcap"), "--record", str(tmp_path / "run.rrd")]
    done = CliRunner().invoke(app, [*command, *files])
    assert done.exit_code == 0, done.output
    assert f"bag: {tmp_path / 'run.mcap'} (" in done.stdout
    assert len(read(tmp_path / "run.mcap")["/clock"]) == 31
    done = CliRunner().invoke(app, ["convert", str(tmp_path / "run.rrd"), str(tmp_path / "again.mcap")])
    assert done.exit_code == 0, done.output
    again = read(tmp_path / "again.mcap")
    count = sum(len(messages) for topic, messages in again.items() if topic != "/rosout")
    assert done.stdout == f"{tmp_path / 'again.mcap'}: {count} messages\n"


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (["run", "example_course", "--topic", "/x"], "--topic /x needs --bag FILE"),
        (["convert", "{}/no.rrd", "{}/out.bag"], "no recording '{}/no.rrd'"),
    ],
)  # fmt: skip
def test_wrong_words_are_told(tmp_path, command, told):
    done = CliRunner().invoke(app, [word.format(tmp_path) for word in command])
    assert str(done.exception) == told.format(tmp_path)
    assert not list(tmp_path.iterdir())


def test_an_exception_completes_the_bag(tmp_path, world):
    sim = Simulation(world)

    def sail():
        with bag_run(sim, tmp_path / "run.bag") as (advance, _):
            advance(25)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sail()
    assert len(read(tmp_path / "run.bag")["/clock"]) == 26
