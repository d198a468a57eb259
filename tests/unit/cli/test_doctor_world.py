"""`vrx-mj doctor WORLD`: the classic mistakes, each with what to do."""

import json
import os
import socket
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from ros1_served import Served, free_port, small_table
from vrx_mj import Simulation, compile_world
from vrx_mj.cli import doctor
from vrx_mj.cli.doctor import Row
from vrx_mj.packages import install_extra
from vrx_mj.ros.diagnosis import shared_frames

HERE = "http://127.0.0.1:11311"
UNSET = "unset ROS_IP, or set it to an address of this machine: 'hostname -I' lists them"


@pytest.fixture
def quiet(monkeypatch):
    """Without the rows of the machine, and on a free port in place of the usual master's."""
    monkeypatch.setattr(doctor, "examine", list)
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{free_port()}")
    for name in ("ROS_IP", "ROS_HOSTNAME"):
        monkeypatch.delenv(name, raising=False)


def rows_of(world, fleet=None):
    rows, _ = doctor.world_rows(str(world), fleet)
    return [(row.what, row.found, row.works, row.advice) for row in rows]


def test_a_world_and_a_fleet_without_mistakes(cli, quiet):
    Path("pair.yaml").write_text("usv_count: 2\nlayout: line\nspacing: 12\n", encoding="utf-8")
    said = cli("doctor", "ocean", "--fleet", "pair.yaml", "--json", "d.json")
    assert said.code == 0, said.out
    assert said.out.endswith("ocean with pair.yaml: no errors found\n")
    rows = {row["what"]: (row["found"], row["works"]) for row in json.loads(Path("d.json").read_text(encoding="utf-8"))}
    assert rows["world"] == ("ocean, 2 boats: wamv1, wamv2", "yes")
    assert rows["boats on land"] == rows["overlaps"] == ("none", "yes")
    assert rows["sensor frames"] == ("each is of one boat", "yes")
    assert rows["command topics"] == ("no publisher", "not needed")
    assert {"extra ros1", "extra rosbridge", "ROS master", "ROS_IP", "port 9090 (rosbridge)"} <= rows.keys()


def test_one_that_does_not_compile_fails_with_its_error(cli, quiet):
    Path("bad.yaml").write_text("extends: ocean\nsea: {gian: 1.0}\n", encoding="utf-8")
    said = cli("doctor", "bad.yaml")
    assert said.code == 1
    assert "world: bad.yaml" in said.out
    assert "did you mean 'gain'?" in said.out
    assert said.out.endswith("bad.yaml: see above\n")


def test_a_fleet_without_a_world_is_refused(cli):
    said = cli("doctor", "--fleet", "trio")
    assert (said.code, said.err) == (2, "--fleet trio needs a world: vrx-mj doctor WORLD --fleet trio\n")


def test_a_boat_on_land_is_told(tmp_path):
    world = tmp_path / "inland.yaml"
    world.write_text("extends: sydney_regatta\nspawn: {pose: [-300, 100, 3, 0, 0, 0]}\n", encoding="utf-8")
    (row,) = [row for row in rows_of(world) if row[0] == "boats on land"]
    place = "(-300, 100), 32.8 m inside the shore"
    assert row == ("boats on land", f"wamv starts on land, at {place}", "no", "give it another pose, or --nudge")


def test_models_that_overlap_are_told(tmp_path):
    world = tmp_path / "crash.yaml"
    world.write_text(
        "extends: ocean\nobjects:\n"
        "  - {name: one, model: robotx_light_buoy, pose: [9, 0, 0.25, 0, 0, 0]}\n"
        "  - {name: two, model: robotx_light_buoy, pose: [9.4, 0, 0.25, 0, 0, 0]}\n",
        encoding="utf-8",
    )
    (row,) = [row for row in rows_of(world) if row[0] == "overlaps"]
    assert row == ("overlaps", "one and two overlap by 0.40 m", "no", "move one of them")


def test_frames_that_two_boats_share_are_told():
    fake = SimpleNamespace(
        boats=("wamv1", "wamv2"),
        mounted=lambda _boat: [
            SimpleNamespace(frame="cam_link", name="cam", config=SimpleNamespace(type="camera")),
            SimpleNamespace(frame="map", name="truth", config=SimpleNamespace(type="p3d")),
        ],
    )
    (row,) = doctor._problems("sensor frames", shared_frames(fake), "none")
    assert row == Row(
        "sensor frames",
        "the frame cam_link belongs to cam of wamv2 and of wamv1: their readings cannot be distinguished",
        "no",
        "remove the namespace from the frame's name",
    )
    assert not doctor.sound([row])
    assert doctor.sound([Row("port 9090 (rosbridge)", "held", "no", "stop it")])


def test_publishers_of_commands_without_a_boat_are_told():
    sim = Simulation(compile_world("ocean", fleet={"usv_count": 2, "layout": "line", "spacing": 12}))
    lost = [("/wamv/thrusters/left_thrust_cmd", ["/rostopic_1"]), ("/clock", ["/gazebo"]), ("/chatter", ["/talker"])]
    heard = [("/wamv2/cmd_vel", ["/pilot"])]
    meant = "did you mean /wamv1/thrusters/left_thrust_cmd?"
    advice = f"/wamv/thrusters/left_thrust_cmd has a publisher, /rostopic_1, but no subscriber: {meant}"
    assert doctor.command_row(sim, lost + heard) == Row(
        "command topics", "1 published without a subscriber", "no", advice
    )
    assert doctor.command_row(sim, heard) == Row("command topics", "1 have a publisher", "yes")
    assert doctor.command_row(sim, lost[1:]) == Row("command topics", "no publisher", "not needed")


def test_a_master_that_answers_tells_who_publishes():
    port = free_port()
    with Served(port, small_table("wamv")) as served:
        row, publishers = doctor.master_row(served.uri)
    assert row == Row("ROS master", f"answers at {served.uri}", "yes")
    assert dict(publishers)["/wamv/imu"] == ["/gazebo"]
    row, publishers = doctor.master_row(served.uri)
    advice = "vrx-mj serve --ros1 starts one"
    assert (row, publishers) == (Row("ROS master", f"none at {served.uri}", "not needed", advice), ())


def test_what_is_no_master_is_told():
    row, _ = doctor.master_row("robot:11311")
    advice = "ROS_MASTER_URI: invalid URI 'robot:11311': http://host:port is needed"
    assert row == Row("ROS master", "robot:11311", "no", advice)
    with socket.create_server(("127.0.0.1", 0)) as server:
        uri = f"http://127.0.0.1:{server.getsockname()[1]}"
        row, _ = doctor.master_row(uri, timeout=0.05)
    assert row == Row("ROS master", f"no ROS master at {uri}: no answer", "no", "correct ROS_MASTER_URI, or unset it")


@pytest.mark.parametrize(
    ("environment", "uri", "row"),
    [
        ({}, HERE, Row("ROS_IP", "not set", "not needed")),
        ({"ROS_IP": "127.0.0.1"}, HERE, Row("ROS_IP", "127.0.0.1", "yes")),
        ({"ROS_IP": "192.0.2.7"}, HERE, Row("ROS_IP", "192.0.2.7: no address of this machine", "no", UNSET)),
        (
            {"ROS_IP": "127.0.0.1", "ROS_HOSTNAME": "localhost"}, HERE,
            Row("ROS_HOSTNAME", "localhost, which goes before ROS_IP", "yes"),
        ),
        (
            {"ROS_HOSTNAME": "nowhere.invalid"}, HERE,
            Row("ROS_HOSTNAME", "nowhere.invalid: the name has no known address", "no",
                "unset ROS_HOSTNAME, or set ROS_IP instead"),
        ),
        (
            {"ROS_IP": "127.0.0.1"}, "http://192.0.2.9:11311",
            Row("ROS_IP", "127.0.0.1, but the master is on 192.0.2.9", "no",
                "nodes on other machines cannot reach it: set ROS_IP to this machine's address towards 192.0.2.9"),
        ),
    ],
)  # fmt: skip
def test_the_address_that_nodes_are_told(environment, uri, row):
    assert doctor.address_row(environment, uri) == row


def test_ports():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        held = doctor.port_row("rosbridge", port, who=lambda _: "process 7 (x); to stop it: kill 7")
        joined = doctor.port_row("ROS master", port, serves=True, who=lambda _: None)
    name = f"port {port} (rosbridge)"
    advice = f"stop it, or use --rosbridge {port + 1}"
    assert held == Row(name, "held by process 7 (x); to stop it: kill 7", "no", advice)
    assert joined.found == "the master that answers: a process that cannot be found"
    assert doctor.port_row("rosbridge", port) == Row(name, "free", "yes")


@pytest.mark.skipif(os.name != "posix", reason="elsewhere such a port is free without being asked for")
def test_a_port_whose_last_connection_has_just_ended_is_free():
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as client:
        port = server.getsockname()[1]
        server.accept()[0].close()  # the end that closes first keeps the port for a minute
        assert client.recv(1) == b""
    assert doctor.port_row("rosbridge", port).found == "free"


def test_every_extra_for_users_has_a_row():
    text = Path(__file__).parents[3].joinpath("pyproject.toml").read_text(encoding="utf-8")
    assert set(doctor.EXTRAS) == set(tomllib.loads(text)["project"]["optional-dependencies"]) - {"docs", "test"}


def test_extras(monkeypatch):
    there = {"rosbags", "lz4", "cbor2"}
    monkeypatch.setattr("importlib.util.find_spec", lambda module: module in there or None)
    assert doctor.extra_row("ros1") == Row("extra ros1", "installed", "yes")
    assert doctor.extra_row("rosbridge") == Row(
        "extra rosbridge", "without websockets", "not needed", install_extra("rosbridge")
    )
