"""`spawn_model`: options as gazebo_ros has them, and what it asks of a served world."""

import math
import socket
import threading
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest

from ros1_served import Served, free_port, small_table
from vrx_mj.cli.nodes import NODES, spawn_model
from vrx_mj.errors import CommandError, NetworkError, UnknownNameError, VrxError
from vrx_mj.ros.interface import Service
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros1.tcpros import Client

URDF = '<robot name="cat"><link name="cat/base_link"/></robot>'
HERE = Path()


@pytest.fixture
def asked():
    return []


@pytest.fixture
def served(asked, monkeypatch):
    """A master with the services of Gazebo, whose requests are kept."""
    table = small_table("wamv")

    def answering(name, kind, **fields):
        def answer(request):
            asked.append((name, request))
            if getattr(request, "model_name", "") == "dog":
                return {"success": False, "status_message": "no dogs"}
            return fields

        table.services[f"/gazebo/{name}"] = Service(f"/gazebo/{name}", kind, answer)

    done = {"success": True, "status_message": "cat joins"}
    answering("spawn_urdf_model", "gazebo_msgs/SpawnModel", **done)
    answering("spawn_sdf_model", "gazebo_msgs/SpawnModel", **done)
    answering("get_model_state", "gazebo_msgs/GetModelState", success=True)
    answering("unpause_physics", "std_srvs/Empty")
    table.parameters["/fleet/robot_description"] = URDF
    with Served(free_port(), table) as one:
        monkeypatch.setenv("ROS_MASTER_URI", one.uri)
        yield one


def test_a_parameter_of_the_namespace_joins_where_the_options_say(served, asked, monkeypatch, capsys):
    monkeypatch.setenv("ROS_NAMESPACE", "/fleet")
    words = "-urdf -param robot_description -model cat -x -532 -y 1.62e2 -z .1 -R 0 -P 0 -Y 1.5707963267948966"
    assert spawn_model([*words.split(), "-reference_frame", "dock", "-wait", "dock", "-unpause"], HERE) == []
    assert [name for name, _ in asked] == ["get_model_state", "spawn_urdf_model", "unpause_physics"]
    request = asked[1][1]
    assert (request.model_name, request.model_xml, request.robot_namespace) == ("cat", URDF, "")
    assert request.reference_frame == "dock"
    position, turn = request.initial_pose.position, request.initial_pose.orientation
    assert (position.x, position.y, position.z) == (-532.0, 162.0, 0.1)
    assert (turn.x, turn.y) == (0.0, 0.0)
    assert (turn.w, turn.z) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))
    assert capsys.readouterr().err == "cat joins\n"


def test_a_file_of_sdf_goes_to_its_service(served, asked, tmp_path):
    (tmp_path / "model.sdf").write_text("<sdf><model name='buoy'/></sdf>", encoding="utf-8")
    assert spawn_model(["-sdf", "-file", "model.sdf", "-model", "buoy_1", "-x", "3"], tmp_path) == []
    ((name, request),) = asked
    assert (name, request.model_name, request.initial_pose.position.x) == ("spawn_sdf_model", "buoy_1", 3.0)


def test_a_model_of_the_database_is_included_by_its_name(served, asked):
    assert spawn_model(["-sdf", "-database", "red&buoy", "-model", "buoy_2"], HERE) == []
    ((name, request),) = asked
    assert name == "spawn_sdf_model"
    assert request.model_xml == "<sdf><world><include><uri>model://red&amp;buoy</uri></include></world></sdf>"


def test_the_namespace_of_the_links_is_the_name(served, asked, capsys):
    assert spawn_model(["-urdf", "-param", "/fleet/robot_description", "-model", "wamv", "-J", "a", "1"], HERE) == []
    assert asked[0][1].model_name == "cat"
    assert capsys.readouterr().err == (
        "-J a 1 is ignored: joints start at 0\n"
        "-model wamv: the model is called cat here, as its topics are\n"
        "cat joins\n"
    )


def test_the_namespace_of_the_options_is_the_name(served, asked):
    words = "-urdf -param /fleet/robot_description -model wamv -robot_namespace /defender_a"
    assert spawn_model(words.split(), HERE) == []
    assert (asked[0][1].model_name, asked[0][1].robot_namespace) == ("defender_a", "/defender_a")


def test_a_boat_of_a_xacro_joins_as_vrx_spawns_it_without_services(served, asked, tmp_path):
    (tmp_path / "cat.urdf.xacro").write_text(URDF, encoding="utf-8")
    words = "-x 1 -y 2 -z 0.1 -R 0 -P 0 -Y 3 --urdf cat.urdf.xacro --model wamv"
    assert NODES["spawn_wamv.bash"](words.split(), tmp_path) == []
    assert asked[0][1].model_name == "cat"
    assert '<link name="cat/base_link"/>' in asked[0][1].model_xml


def test_what_the_world_refuses_is_an_error(served, tmp_path):
    (tmp_path / "dog.urdf").write_text("<robot/>", encoding="utf-8")
    with pytest.raises(CommandError) as caught:
        spawn_model(["-urdf", "-file", "dog.urdf", "-model", "dog"], tmp_path)
    assert str(caught.value) == "dog cannot join: no dogs"


WRONG = {
    "-urdf -param a": "spawn_model needs -model NAME",
    "-urdf -model a": "spawn_model needs one of -file, -param, -stdin and -database, got none",
    "-urdf -model a -file b -param c": "spawn_model needs one of -file, -param, -stdin and -database, got file, param",
    "-urdf -model": "-model needs a value",
    "-model a -database b": "-database names an SDF model: also give -sdf",
    "-urdf -model a -file none.urdf": "none.urdf: cannot be read: No such file or directory",
    "-urdf -model a -param /none": "no parameter /none at the master {uri}",
    "-urdf -model a -param /fleet/robot_description -x east": "-x -y -z -R -P -Y: expected a number, got 'east'",
    "-urdf -model a -param /fleet/robot_description -x nan": "-x -y -z -R -P -Y: must be finite, got 'nan'",
}


@pytest.mark.parametrize("line", WRONG)
def test_wrong_options_are_errors(served, line):
    with pytest.raises(VrxError) as caught:
        spawn_model(line.split(), HERE)
    assert str(caught.value) == WRONG[line].format(uri=served.uri)


def test_an_unknown_option_is_an_error():
    with pytest.raises(UnknownNameError, match=r"no option of spawn_model named '-modle'; did you mean '-model'\?"):
        spawn_model(["-modle", "a"], HERE)


def test_without_a_master_the_address_is_named(monkeypatch):
    port = free_port()
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
    with pytest.raises(NetworkError) as caught:
        spawn_model(["-urdf", "-model", "a", "-param", "b"], HERE)
    assert str(caught.value).startswith(f"no answer from a ROS master at http://127.0.0.1:{port}: [Errno 111] Connect")


def test_a_client_names_what_is_missing_and_what_is_refused(served):
    client = Client("one")
    with pytest.raises(NetworkError) as caught:
        client.wait("/nowhere", 0.1)
    assert str(caught.value) == f"no service /nowhere within 0.1 s at the master {served.uri}"
    with pytest.raises(NetworkError, match="no service /nowhere at the master"):
        client.call("/nowhere", "std_srvs/Empty", new("std_srvs/EmptyRequest"))
    with pytest.raises(CommandError) as refused:
        client.call("/failing", "std_srvs/Trigger", new("std_srvs/TriggerRequest"))
    assert str(refused.value) == "/failing: no boat is named wamv9"
    with pytest.raises(CommandError, match="/trigger is of type std_srvs/Trigger, not std_srvs/Empty"):
        client.call("/trigger", "std_srvs/Empty", new("std_srvs/EmptyRequest"))


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (b"\xff\xff\xff\x7f", r"a frame of 2147483647 bytes, where at most 262144 are allowed"),
        (b"\x10\x00\x00\x00abc", r"the service /nonsense at .*: the connection ended after 3 of 16 bytes"),
        (b"\x05\x00\x00\x00abcde", r"a header's field has 1684234849 bytes where 1 are left"),
    ],
)
def test_a_service_that_answers_nonsense_is_an_error(served, answer, message):
    with socket.create_server(("127.0.0.1", 0)) as server:
        uri = f"rosrpc://127.0.0.1:{server.getsockname()[1]}"
        with ServerProxy(served.uri) as master:
            master.registerService("/nonsense", "/nonsense", uri, served.uri)

        def speak():
            line, _ = server.accept()
            with line:
                line.recv(4096)
                line.sendall(answer)

        thread = threading.Thread(target=speak)
        thread.start()
        with pytest.raises((CommandError, NetworkError), match=message):
            Client("one").call("/nonsense", "std_srvs/Empty", new("std_srvs/EmptyRequest"))
        thread.join()
