"""Every operation of the protocol, as raw messages over a websocket."""

import base64
import io
import json
import math

import cbor2
import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed

from bridged import COVARIANCE, PIXELS, image, imu
from rosbridge_client import WAIT, Talk
from vrx_mj.ros import messages

IMU, CAMERA, INFO = "/wamv/sensors/imu/data", "/wamv/sensors/camera/image_raw", "/vrx/task/info"
THRUST = "/wamv/thrusters/left_thrust_cmd"


@pytest.fixture
def other(bridged):
    with Talk(bridged) as made:
        yield made


def test_imu_as_json_has_every_field_and_null_for_nan(bridged, talk):
    talk.say("subscribe", topic=IMU)
    talk.sync()
    assert bridged.wires.subscribed_topics == {IMU}
    bridged.send(IMU, imu(seq=3))
    got = talk.hear()
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    assert got == {
        "op": "publish",
        "topic": IMU,
        "msg": {
            "header": {"seq": 3, "stamp": {"secs": 1, "nsecs": 500_000_000}, "frame_id": "wamv/imu_link"},
            "orientation": zero | {"w": 1.0},
            "orientation_covariance": [None if math.isnan(v) else v for v in COVARIANCE],
            "angular_velocity": zero,
            "angular_velocity_covariance": [0.0] * 9,
            "linear_acceleration": zero,
            "linear_acceleration_covariance": [0.0] * 9,
        },
    }


def test_who_unsubscribes_is_not_made_for(bridged, talk):
    talk.say("subscribe", topic=IMU, id="a")
    talk.say("subscribe", topic=IMU, id="b")
    talk.say("unsubscribe", topic=IMU, id="a")
    talk.sync()
    assert bridged.wires.subscribed_topics == {IMU}
    talk.say("unsubscribe", topic=IMU, id="b")
    talk.sync()
    assert bridged.wires.subscribed_topics == frozenset()
    talk.say("subscribe", topic=IMU, id="a")
    talk.say("subscribe", topic=IMU)
    talk.say("unsubscribe", topic=IMU)
    talk.sync()
    assert bridged.wires.subscribed_topics == frozenset()


def test_who_goes_is_not_made_for(bridged):
    with Talk(bridged) as talk:
        talk.say("subscribe", topic=IMU)
        talk.sync()
        assert bridged.wires.subscribed_topics == {IMU}
    bridged.wait(lambda b: not b.wires.subscribed_topics)


def test_a_message_keeps_the_name_that_the_client_uses(bridged, talk):
    talk.say("subscribe", topic="wind//speed", type="std_msgs/msg/Float64")
    talk.sync()
    bridged.send("/wind/speed", messages.new("std_msgs/Float64", data=2.5))
    assert talk.hear() == {"op": "publish", "topic": "wind//speed", "msg": {"data": 2.5}}


def test_bytes_are_base64_in_json_and_bytes_in_cbor(bridged, talk, other):
    talk.say("subscribe", topic=CAMERA)
    other.say("subscribe", topic=CAMERA, compression="cbor")
    talk.sync(), other.sync()
    bridged.send(CAMERA, image())
    assert base64.b64decode(talk.hear()["msg"]["data"]) == PIXELS.tobytes()
    assert other.hear()["msg"]["data"] == PIXELS.tobytes()


@pytest.mark.parametrize(
    ("kind", "tag", "layout"),
    [
        ("Int8", 72, "i1"),
        ("UInt16", 69, "<u2"),
        ("UInt32", 70, "<u4"),
        ("UInt64", 71, "<u8"),
        ("Int16", 77, "<i2"),
        ("Int32", 78, "<i4"),
        ("Int64", 79, "<i8"),
        ("Float32", 85, "<f4"),
        ("Float64", 86, "<f8"),
    ],
)
def test_arrays_of_numbers_are_typed_arrays_in_cbor(talk, other, kind, tag, layout):
    type_name = f"std_msgs/{kind}MultiArray"
    talk.say("subscribe", topic="/numbers", type=type_name, compression="cbor")
    talk.sync()
    other.say("publish", topic="/numbers", msg={"data": [1, 2, 100]})
    got = talk.hear()["msg"]
    assert got["data"] == cbor2.CBORTag(tag, np.array([1, 2, 100], layout).tobytes())  # RFC 8746, table 1
    assert got["layout"] == {"dim": [], "data_offset": 0}


def test_arrays_of_texts_and_messages_are_lists_in_cbor(talk, other):
    texts, dimensions = ["b", ""], [{"label": "x", "size": 2, "stride": 3}]
    for topic, kind, msg in (
        ("/names", "sensor_msgs/JointState", {"name": texts}),
        ("/numbers", "std_msgs/Int8MultiArray", {"layout": {"dim": dimensions}}),
    ):
        talk.say("subscribe", topic=topic, type=kind, compression="cbor")
        talk.sync()
        other.say("publish", topic=topic, msg=msg)
        got = talk.hear()["msg"]
        assert got["name"] == texts if topic == "/names" else got["layout"]["dim"] == dimensions


def test_cbor_keeps_nan(bridged, talk):
    talk.say("subscribe", topic=IMU, compression="cbor")
    talk.sync()
    bridged.send(IMU, imu())
    tag = talk.hear()["msg"]["orientation_covariance"]
    np.testing.assert_array_equal(np.frombuffer(tag.value, "<f8"), COVARIANCE)


def test_cbor_raw_is_ros1s_own_bytes_at_their_moment(bridged, talk):
    talk.say("subscribe", topic=IMU, compression="cbor-raw")
    talk.sync()
    sent = imu(seq=8)
    bridged.send(IMU, sent, time=12.25)
    assert talk.hear() == {
        "op": "publish",
        "topic": IMU,
        "msg": {"secs": 12, "nsecs": 250_000_000, "bytes": messages.encode(sent, "sensor_msgs/Imu")},
    }


def in_pixels(data):
    with Image.open(io.BytesIO(base64.b64decode(data))) as picture:
        assert picture.mode == "RGB"
        return json.loads(picture.tobytes())  # newlines at the end are white space


def test_png_holds_the_same_json(bridged, talk, other):
    talk.say("subscribe", topic=IMU, compression="png")
    other.say("subscribe", topic=IMU)
    talk.sync(), other.sync()
    bridged.send(IMU, imu())
    got = talk.hear()
    assert got.keys() == {"op", "data"}
    assert in_pixels(got["data"]) == other.hear()


def test_png_comes_in(bridged, talk):
    text = json.dumps({"op": "publish", "topic": THRUST, "msg": {"data": 0.25}}).encode()
    file = io.BytesIO()
    Image.frombytes("RGB", (len(text) // 3 + 1, 1), text.ljust(3 * (len(text) // 3 + 1), b"\n")).save(file, "png")
    bridged.came.clear()
    talk.say("png", data=base64.b64encode(file.getvalue()).decode())
    assert talk.sync() == []
    bridged.wait(lambda b: b.came)
    assert [(topic, message.data) for topic, message in bridged.came] == [(THRUST, 0.25)]


@pytest.mark.parametrize("compression", ["none", "png"])
def test_fragments_go_out(bridged, talk, compression):
    talk.say("subscribe", topic=IMU, fragment_size=100, compression=compression)
    talk.sync()
    bridged.send(IMU, imu())
    first = talk.hear()
    parts = [first] + [talk.hear() for _ in range(first["total"] - 1)]
    assert [part["num"] for part in parts] == list(range(first["total"]))
    assert {part["id"] for part in parts} == {first["id"]}
    assert max(len(part["data"]) for part in parts) == 100
    whole = json.loads("".join(part["data"] for part in parts))
    assert (in_pixels(whole["data"]) if compression == "png" else whole)["msg"]["orientation"]["w"] == 1.0


def test_tiny_fragments_are_made_larger(bridged, talk):
    talk.say("subscribe", topic=CAMERA, fragment_size=1)
    talk.sync()
    bridged.send(CAMERA, image(np.zeros(30_000, np.uint8)))
    total = talk.hear()["total"]
    assert 900 < total <= 1000
    assert [talk.hear()["num"] for _ in range(1, total)] == list(range(1, total))


def test_fragments_come_in_whatever_their_order(bridged, talk):
    text = json.dumps({"op": "publish", "topic": THRUST, "msg": {"data": -0.5}})
    pieces = [text[start : start + 7] for start in range(0, len(text), 7)]
    bridged.came.clear()
    for number in reversed(range(len(pieces))):
        talk.say("fragment", id="x", num=number, total=len(pieces), data=pieces[number])
    assert talk.sync() == []
    bridged.wait(lambda b: b.came)
    assert [(topic, message.data) for topic, message in bridged.came] == [(THRUST, -0.5)]


def test_latched_messages_wait_for_who_comes_late(bridged, talk):
    bridged.send(INFO, messages.new("std_msgs/String", data="first"))
    bridged.send(INFO, messages.new("std_msgs/String", data="running"))
    talk.say("subscribe", topic=INFO)
    assert talk.hear()["msg"] == {"data": "running"}


def test_clients_talk_to_each_other(talk, other):
    talk.say("advertise", topic="/chat", type="std_msgs/String", latch=True)
    talk.say("publish", topic="/chat", msg={"data": "kept"})
    talk.sync()
    other.say("subscribe", topic="/chat")
    assert other.hear()["msg"] == {"data": "kept"}
    talk.say("publish", topic="/chat", msg={"data": "naïve \U0001f6a4"})
    assert other.hear()["msg"] == {"data": "naïve \U0001f6a4"}
    talk.say("unadvertise", topic="/chat")
    talk.sync()
    with_type = other.call("/rosapi/topic_type", {"topic": "chat"})
    assert with_type["values"] == {"type": "std_msgs/String"}  # it is still subscribed
    other.say("unsubscribe", topic="/chat")
    assert other.call("/rosapi/topic_type", {"topic": "chat"})["values"] == {"type": ""}


def test_a_latched_message_for_which_there_is_no_room_is_told_of(talk, monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.rosbridge.server.MOST_INCOMING", 200)
    talk.say("advertise", topic="/chat", type="std_msgs/String", latch=True)
    talk.say("publish", topic="/chat", msg={"data": "short"})
    talk.say("publish", topic="/chat", msg={"data": 300 * "x"})
    (told,) = talk.sync()
    assert told["msg"] == "publish: /chat is latched, but 200 characters are already kept"


def test_a_topic_that_is_advertised_again_still_counts_for_what_it_keeps(talk, monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.rosbridge.server.MOST_INCOMING", 200)
    for topic in ("/chat", "/news"):
        talk.say("advertise", topic=topic, type="std_msgs/String", latch=True)
        talk.say("publish", topic=topic, msg={"data": 150 * "x"})
        talk.say("advertise", topic=topic, type="std_msgs/String", latch=True)
    (refused,) = talk.sync()
    assert refused["msg"] == "publish: /news is latched, but 200 characters are already kept"


def test_commands_are_heard_by_other_clients(bridged, talk, other):
    other.say("subscribe", topic=THRUST)
    other.sync()
    talk.say("publish", topic=THRUST, msg={"data": 1})
    assert other.hear()["msg"] == {"data": 1.0}


def test_an_unknown_publisher_is_reported_once_for_each_advertisement(bridged, talk):
    bridged.unknown_publishers.clear()
    for _ in range(2):
        talk.say("advertise", topic="/wamv/thruster/left", type="std_msgs/Float32")
        talk.say("publish", topic="/wamv/thruster/left", msg={"data": 1.0})
        talk.say("publish", topic="/wamv/thruster/left", msg={"data": 1.0})
        talk.say("unadvertise", topic="/wamv/thruster/left")
        assert talk.sync() == []
        bridged.wait(lambda b: b.unknown_publishers)
        (unknown_publisher,) = bridged.unknown_publishers
        assert unknown_publisher[:2] == ("/wamv/thruster/left", "std_msgs/Float32")
        bridged.unknown_publishers.clear()


def test_a_service_is_called_with_a_mapping_or_a_list(talk):
    good = {"success": True, "status_message": "gone"}
    for args in ({"model_name": "wamv"}, ["wamv"]):
        assert talk.call("/gazebo/delete_model", args) == {
            "op": "service_response",
            "service": "/gazebo/delete_model",
            "values": good,
            "result": True,
            "id": "call",
        }
    assert talk.call("gazebo/reset_world")["values"] == {}
    talk.say("call_service", service="/wamv/fire")
    assert "id" not in talk.hear()


@pytest.mark.parametrize(
    ("service", "args", "why"),
    [
        ("/gazebo/delete_model", {"model_name": "x"}, "no model named 'x'; known: wamv"),
        (
            "/gazebo/delete_model",
            {"model_name": 4},
            "/gazebo/delete_model.model_name: invalid value 4; allowed: a string",
        ),
        (
            "/gazebo/delete_model",
            {"name": "x"},
            "/gazebo/delete_model: gazebo_msgs/DeleteModelRequest has no field 'name'; known: model_name",
        ),
        (
            "/gazebo/delete_model",
            ["a", "b"],
            "/gazebo/delete_model: 2 arguments; gazebo_msgs/DeleteModelRequest has 1 fields",
        ),
        ("/gazebo/delet_model", {}, "no service named '/gazebo/delet_model'; did you mean '/gazebo/delete_model'?"),
        (
            "/gazebo delete",
            {},
            "'/gazebo delete' is not a name: at most 256 letters, digits, '_' and '/', a letter first",
        ),
    ],
)
def test_a_call_that_fails_says_why(talk, service, args, why):
    response = talk.call(service, args)
    assert (response["result"], response["values"]) == (False, why)


def test_a_response_comes_as_it_was_asked_for(talk):
    talk.say("call_service", service="/wamv/fire", id="1", compression="cbor")
    assert cbor2.loads(talk.socket.recv(WAIT))["values"] == {"success": True, "message": "away"}
    talk.say("call_service", service="/wamv/fire", id="1", compression="png")
    assert in_pixels(json.loads(talk.socket.recv(WAIT))["data"])["values"]["message"] == "away"
    talk.say("call_service", service="/wamv/fire", id="1", fragment_size=50)
    assert talk.hear()["op"] == "fragment"


def test_a_call_fails_after_its_timeout(bridged, talk):
    bridged.silent = True
    try:
        response = talk.call("/wamv/fire", timeout=0.05)
    finally:
        bridged.silent = False
    assert (response["result"], response["values"]) == (False, "/wamv/fire: no answer in 0.05 s")


def test_a_client_serves_others(talk, other):
    talk.say("advertise_service", service="lights", type="std_srvs/Trigger")
    talk.sync()
    other.say("call_service", service="/lights", id="7")
    asked = talk.hear()
    assert {key: asked[key] for key in ("op", "service", "args")} == {
        "op": "call_service",
        "service": "lights",
        "args": {},
    }
    talk.say("service_response", service="lights", id=asked["id"], values={"success": True}, result=True)
    assert other.hear() == {
        "op": "service_response",
        "service": "/lights",
        "values": {"success": True, "message": ""},
        "result": True,
        "id": "7",
    }
    other.say("call_service", service="/lights", id="8")
    asked = talk.hear()
    talk.say("service_response", service="lights", id=asked["id"], values="dark", result=False)
    assert other.hear()["values"] == "dark"
    other.say("call_service", service="/lights", id="9")
    asked = talk.hear()
    talk.say("service_response", service="lights", id=asked["id"], values={"message": "dark"}, result=False)
    answered = other.hear()  # as rosbridge_suite 2.1.0, which does not look at `result`
    assert (answered["values"], answered["result"]) == ({"success": False, "message": "dark"}, True)
    assert talk.call("/rosapi/service_type", {"service": "lights"})["values"] == {"type": "std_srvs/Trigger"}
    talk.say("unadvertise_service", service="lights")
    talk.sync()
    assert not other.call("/lights")["result"]


def test_a_client_that_goes_leaves_no_call_waiting(bridged, talk):
    with Talk(bridged) as gone:
        gone.say("advertise_service", service="/lights", type="some_msgs/Unknown")
        gone.sync()
        talk.say("call_service", service="/lights", id="1", args={"any": [1, None]})
        assert gone.hear()["args"] == {"any": [1, None]}
    response = talk.hear()
    assert (response["result"], response["values"]) == (False, "/lights: the client that offers it has disconnected")


def test_parameters_are_set_and_deleted(talk, other):
    assert talk.call("/rosapi/set_param", {"name": "a/b", "value": "[1, 2]"})["values"] == {}
    assert talk.call("/rosapi/set_param", ["a/c", '"x"'])["values"] == {}
    assert json.loads(other.call("rosapi/get_param", {"name": "/a"})["values"]["value"]) == {"b": [1, 2], "c": "x"}
    assert other.call("rosapi/search_param", {"name": "use_sim_time"})["values"] == {"global_name": "/use_sim_time"}
    assert other.call("rosapi/has_param", {"name": "/a/b"})["values"] == {"exists": True}
    other.call("/rosapi/delete_param", {"name": "/a"})
    assert other.call("rosapi/has_param", {"name": "/a/b"})["values"] == {"exists": False}
    assert other.call("rosapi/get_param", {"name": "/a", "default": "5"})["values"] == {"value": "5"}
    response = other.call("/rosapi/delete_param", {"name": "/use_sim_time"})
    assert response["values"] == "/use_sim_time: the parameter belongs to the simulation and cannot be deleted"


def test_status_is_told_from_the_level_that_a_client_wants(talk):
    talk.say("set_level", level="none")
    talk.say("nonsense")
    assert talk.sync() == []
    talk.say("set_level", level="info")
    talk.say("unsubscribe", topic="/never", id="u")
    assert talk.sync() == [
        {"op": "status", "level": "warning", "msg": "unsubscribe: /never is not subscribed", "id": "u"}
    ]


def test_the_simulations_log_goes_to_rosout(bridged, talk):
    talk.say("subscribe", topic="/rosout")
    talk.sync()
    bridged.wires.log("WARN", "aground")
    got = talk.hear()["msg"]
    assert (got["level"], got["name"], got["msg"]) == (4, "/gazebo", "aground")


def test_a_message_larger_than_allowed_ends_the_connection(bridged):
    with Talk(bridged) as talk:
        talk.socket.send("x" * (5 << 20))
        with pytest.raises(ConnectionClosed):
            talk.socket.recv(WAIT)


def test_a_client_may_hold_so_much_and_no_more(bridged, talk, monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.rosbridge.server.MOST_HELD", 4)
    talk.say("advertise", topic="/one", type="std_msgs/String")
    talk.say("subscribe", topic="/two", type="std_msgs/String", id="a")
    talk.say("subscribe", topic="/two", type="std_msgs/String", id="b")
    talk.say("advertise_service", service="/three", type="std_srvs/Empty")
    assert talk.sync() == []
    full = "this client has 4 topics, services and calls; no more are accepted"
    talk.say("subscribe", topic="/two", type="std_msgs/String", id="c")
    talk.say("publish", topic="/four", type="std_msgs/String", msg={})
    talk.say("call_service", service="/three", id="5")
    assert [answer.get("msg", answer.get("values")) for answer in (talk.hear(), talk.hear(), talk.hear())] == [
        f"subscribe: {full}",
        f"publish: {full}",
        f"call_service: {full}",
    ]
    talk.say("unadvertise", topic="/one")
    talk.say("unadvertise_service", service="/three")
    talk.say("unsubscribe", topic="/two")
    assert talk.sync() == []
