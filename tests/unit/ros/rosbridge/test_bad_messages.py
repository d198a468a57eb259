"""What clients get wrong: told with the field, the value and what is allowed, and nothing else happens."""

import base64
import io
import json

import numpy as np
import pytest
from PIL import Image

from vrx_mj.ros import messages

THRUST, TWIST, IMU = "/wamv/thrusters/left_thrust_cmd", "/wamv/cmd_vel", "/wamv/sensors/imu/data"


TRUE_NUMBER = "/n.data: invalid value True; allowed: "


@pytest.mark.parametrize(
    ("type_name", "message", "why"),
    [
        ("Float32", {"data": "fast"}, "/n.data: invalid value 'fast'; allowed: float32, a number"),
        ("Float32", {"data": True}, f"{TRUE_NUMBER}float32, a number"),
        ("Float32", {"data": 1e39}, "/n.data: invalid value 1e+39; allowed: float32, a number of at most 3.402823e+38"),
        ("Float64", {"speed": 1}, "/n: std_msgs/Float64 has no field 'speed'; known: data"),
        ("Float64", [1.0], "/n: invalid value [1.0]; allowed: an object with the fields of std_msgs/Float64"),
        ("UInt8", {"data": 256}, "/n.data: invalid value 256; allowed: uint8, a whole number from 0 to 255"),
        ("Int8", {"data": 1.5}, "/n.data: invalid value 1.5; allowed: int8, a whole number from -128 to 127"),
        ("Int8", {"data": True}, f"{TRUE_NUMBER}int8, a whole number from -128 to 127"),
        ("Bool", {"data": 1}, "/n.data: invalid value 1; allowed: true or false"),
        ("String", {"data": None}, "/n.data: invalid value None; allowed: a string"),
        (
            "String",
            {"data": "\ud800"},
            "/n.data: invalid value \"'\\\\ud800'\"; allowed: a string of whole characters",
        ),
        ("Time", {"data": 1.5}, "/n.data: invalid value 1.5; allowed: a time, {secs, nsecs}"),
        ("Time", {"data": {"secs": -1}}, "/n.data.secs: invalid value -1; allowed: a time of 0 or more"),
        ("Time", {"data": {"s": 1}}, "/n.data: a time has no field 's'; known: secs, nsecs"),
        (
            "UInt8MultiArray",
            {"data": "%"},
            "/n.data: invalid value '%'; allowed: base64 or a list of numbers (Only base64 data is allowed)",
        ),
        (
            "UInt8MultiArray",
            {"data": [1, 256]},
            "/n.data[1]: invalid value 256; allowed: uint8, a whole number from 0 to 255",
        ),
        ("Float64MultiArray", {"data": [1, "x"]}, "/n.data[1]: invalid value 'x'; allowed: float64, a number"),
        ("Float64MultiArray", {"data": 1}, "/n.data: invalid value 1; allowed: a list of float64"),
        (
            "Float64MultiArray",
            {"layout": {"dim": [{"size": -1}]}},
            "/n.layout.dim[0].size: invalid value -1; allowed: uint32, a whole number from 0 to 4294967295",
        ),
        (
            "String",
            {"data": ["x" * 99] * 99},
            "/n.data: invalid value ['xxxxxxxxxxxxxxxxxxxxxxxxxxx...xxxxxxxxxxxxxxxxxxxxxxxxxxxx...; allowed: a string",
        ),
    ],
)
def test_a_wrong_field_is_named(talk, type_name, message, why):
    talk.say("advertise", topic="/n", type=f"std_msgs/{type_name}")
    assert talk.complaint("publish", topic="/n", msg=message) == why


def test_an_array_of_fixed_length_has_that_length(talk):
    talk.say("advertise", topic="/i", type="sensor_msgs/Imu")
    why = talk.complaint("publish", topic="/i", msg={"orientation_covariance": [0.0] * 8})
    assert why == "/i.orientation_covariance: 8 values; float64[9] has 9"


def test_what_is_right_is_taken_as_it_is_meant(bridged, talk):
    bridged.came.clear()
    talk.say("publish", topic=TWIST, msg={"linear": {"x": 1, "y": None}})
    talk.say("publish", topic=THRUST, msg={"data": 5}, latch=True)
    talk.say("publish", topic=THRUST)
    assert talk.sync() == []
    bridged.wait(lambda b: len(b.came) == 3)
    (_, twist), (_, five), (_, nothing) = bridged.came
    assert (twist.linear.x, twist.linear.z, twist.angular.x) == (1.0, 0.0, 0.0)
    assert twist.linear.y != twist.linear.y  # null is NaN, which the table refuses or takes
    assert (five.data, type(five.data), nothing.data) == (5.0, float, 0.0)


@pytest.mark.parametrize(
    ("kind", "data", "same"),
    [
        ("Float64", [0, 0.5, -3], [0.0, 0.5, -3.0]),
        ("Float64", [0, None], [0.0, None]),
        ("Float32", [1, 1e38], [1.0, float(np.float32(1e38))]),
        ("Float64", [], []),
        ("UInt64", [0, 2**64 - 1], [0, 2**64 - 1]),
        ("Int64", [-(2**63), 2.0], [-(2**63), 2]),
        ("Int16", [1.0, -5], [1, -5]),
        ("UInt8", [1, 255], "Af8="),
        ("UInt8", "Af8=", "Af8="),
        ("Byte", [1, 255], [1, 255]),
    ],
)
def test_arrays_come_back_as_they_went(talk, kind, data, same):
    talk.say("subscribe", topic="/back", type=f"std_msgs/{kind}MultiArray")
    talk.say("publish", topic="/back", msg={"data": data})
    assert talk.hear()["msg"]["data"] == same


@pytest.mark.parametrize(("kind", "data"), [("Float32", [0.0, 1e39]), ("Float64", [0, 10**400]), ("Bool", [True])])
def test_arrays_with_a_wrong_number_are_refused(talk, kind, data):
    type_name = f"std_msgs/{kind}MultiArray"
    why = talk.complaint("publish", topic="/wrong", type=type_name, msg={"data": data})
    assert why.startswith("/wrong.data[1]: " if kind != "Bool" else f"no message type named '{type_name}'")


def test_headers_without_a_stamp_get_the_present_moment(talk):
    talk.say("subscribe", topic="/p", type="geometry_msgs/PoseStamped")
    now = talk.call("/rosapi/get_time")["values"]["time"]
    talk.say("publish", topic="/p", msg={"pose": {"position": {"x": 2}}})
    assert talk.hear()["msg"]["header"] == {"seq": 0, "stamp": now, "frame_id": ""}
    talk.say("publish", topic="/p", msg={"header": {"stamp": {"sec": 3, "nanosec": 4}, "frame_id": "map"}})
    assert talk.hear()["msg"]["header"] == {"seq": 0, "stamp": {"secs": 3, "nsecs": 4}, "frame_id": "map"}
    talk.say("publish", topic="/p", msg={"header": {"stamp": "now"}})
    assert talk.hear()["msg"]["header"]["stamp"] == now


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (
            {"op": "publish", "topic": "/new", "msg": {}},
            "publish: the type of topic /new is not known; advertise it first",
        ),
        ({"op": "publish", "msg": {}}, "publish: topic is missing"),
        ({"op": "publish", "topic": 3}, "publish: topic 3 is not a string"),
        (
            {"op": "advertise", "topic": "/n", "type": "std_msgs/Flot32"},
            "no message type named 'std_msgs/Flot32'; did you mean 'std_msgs/Float32'?",
        ),
        (
            {"op": "advertise", "topic": THRUST, "type": "std_msgs/Float64"},
            f"topic {THRUST} is a std_msgs/Float32, not a std_msgs/Float64",
        ),
        ({"op": "unadvertise", "topic": "/n"}, "unadvertise: /n is not advertised by this client"),
        ({"op": "subscribe", "topic": "/new"}, "subscribe: the type of topic /new is not known yet; give it as type"),
        (
            {"op": "subscribe", "topic": IMU, "type": "std_msgs/String"},
            f"topic {IMU} is a sensor_msgs/Imu, not a std_msgs/String",
        ),
        (
            {"op": "subscribe", "topic": IMU, "throttle_rate": -1},
            "subscribe: invalid throttle_rate -1; allowed: a number from 0 to 1e+09",
        ),
        (
            {"op": "subscribe", "topic": IMU, "compression": "zip"},
            "subscribe: invalid compression 'zip'; allowed: none, png, cbor, cbor-raw",
        ),
        (
            {"op": "subscribe", "topic": "/a b"},
            "'/a b' is not a name: at most 256 letters, digits, '_' and '/', a letter first",
        ),
        ({"op": "subscribe", "topic": "a" * 300}, "subscribe: topic has 300 characters; at most 256"),
        ({"op": "set_level", "level": "all"}, "set_level: invalid level 'all'; allowed: none, error, warning, info"),
        ({"op": "auth", "mac": "x"}, "auth: this server has no authentication; leave it out"),
        ({"op": "subscrib"}, "no operation named 'subscrib'; did you mean 'subscribe'?"),
        ({"op": 3}, "a message must be a JSON object with a string 'op', got {'op': 3}"),
        ([], "a message must be a JSON object with a string 'op', got []"),
        (
            {"op": "service_response", "id": "call_service:/x:1"},
            "service_response: no call 'call_service:/x:1' is waiting for this client's answer",
        ),
        (
            {"op": "advertise_service", "service": "/wamv/fire", "type": "std_srvs/Trigger"},
            "service /wamv/fire: it is already offered by the simulation",
        ),
        ({"op": "unadvertise_service", "service": "/wamv/fire"}, "service /wamv/fire: this client does not offer it"),
        (
            {"op": "fragment", "id": "f", "num": 2, "total": 2, "data": ""},
            "fragment: invalid num '2'; allowed: a whole number from 0 to 1",
        ),
        (
            {"op": "fragment", "id": "f", "num": 0, "total": 1, "data": "{}"},
            "a message must be a JSON object with a string 'op', got {}",
        ),
        ({"op": "png", "data": "AAAA"}, "data is not a base64 PNG that holds text"),
    ],
)
def test_a_wrong_operation_is_refused(talk, message, why):
    talk.socket.send(json.dumps(message))
    (status,) = talk.sync()
    assert (status["op"], status["level"]) == ("status", "error")
    assert status["msg"] == why


def test_status_carries_the_id_of_the_operation(talk):
    talk.say("publish", topic="/new", id="publish:/new:1")
    assert talk.sync()[0]["id"] == "publish:/new:1"


def test_names_of_types_that_are_not_known_are_not_kept(talk):
    kept = [function for function in vars(messages).values() if hasattr(function, "cache_info")]
    sizes = []
    for names in (range(1), range(1, 21)):  # the first also loads what every answer needs
        for number in names:
            talk.say("advertise", topic="/n", type=f"std_msgs/New{number}")
            talk.say("advertise_service", service="/mine", type=f"std_srvs/New{number}")
            talk.say("call_service", service="/mine")
        talk.sync()
        sizes.append(sum(function.cache_info().currsize for function in kept))
    assert sizes[0] == sizes[1]


def test_a_png_larger_than_allowed_is_not_unpacked(talk):
    file = io.BytesIO()
    Image.new("RGB", (3000, 1000)).save(file, "png")
    why = talk.complaint("png", data=base64.b64encode(file.getvalue()).decode())
    assert why == "a png of 3000 x 1000: at most 1398101 pixels"


def test_fragments_of_fragments_go_so_deep_only(talk):
    message = {"op": "auth"}
    for _ in range(4):
        message = {"op": "fragment", "id": "f", "num": 0, "total": 1, "data": json.dumps(message)}
    talk.socket.send(json.dumps(message))
    assert [status["msg"] for status in talk.sync()] == ["fragment: nested operations are more than 2 deep"]


def test_fragments_that_never_end_are_thrown_away(talk):
    megabyte = "x" * (1 << 20)
    for number in range(5):
        talk.say("fragment", id=str(number), num=0, total=2, data=megabyte)
    assert [status["msg"] for status in talk.sync()] == [
        "fragment: more than 4194304 characters of incomplete messages"
    ]


def test_deep_json_and_what_is_none_is_refused(talk):
    for data, start in [
        ("[" * 100_000, "a message is not JSON: "),
        ("{", "a message is not JSON: "),
        (b"\xa1", "a message is no"),
    ]:
        talk.socket.send(data)
        (status,) = talk.sync()
        assert status["msg"].startswith(start)
        assert len(status["msg"]) < 300
