"""Which HTTP requests are calls of programs."""

import pytest

from vrx_mj.ros.network import Names
from vrx_mj.ros.ros1.xmlrpc import RequestError, checked_size

POST = ["POST", "/RPC2", "HTTP/1.1"]
HERE = {"host": "127.0.0.1:11311", "content-length": "46"}
PAGE = "a web page may not call ROS, but a browser sent"
TYPE = "invalid Content-Type '{}': text/xml is needed"
RPC = "this is XML-RPC:"
NEEDED = "an address or name of this machine is needed; to give it another one, set ROS_HOSTNAME or ROS_IP"


def size(words=POST, names=(), reached="127.0.0.1", **fields):
    written = {name.replace("_", "-"): value for name, value in fields.items()}
    own = Names(names)
    return checked_size(words, HERE | written, lambda host: own.has(host, reached))


@pytest.mark.parametrize(
    "fields",
    [
        {"content_type": "text/xml", "user_agent": "Python-xmlrpc/3.11", "accept_encoding": "gzip"},  # rospy
        {"content_type": "text/xml", "user_agent": "XMLRPC++ 0.7", "host": "localhost:11311"},  # roscpp 1.15.15
        {"content_type": "text/xml", "user_agent": "Apache XML RPC 3.1.3 (Sun HTTP Transport)"},  # MATLAB, rosjava
        {"user_agent": "Jakarta Commons-HttpClient/3.1", "content_type": "text/xml; charset=UTF-8"},
        {},  # rosrust, roslibrust
        {"content_type": "TEXT/XML"},
    ],
)
def test_what_clients_of_ros_send_is_taken(fields):
    assert size(**fields) == 46
    assert size(["POST", "/", "HTTP/1.0"], **fields) == 46


@pytest.mark.parametrize("name", ["simbox", "SIMBOX:11311", "10.0.0.5", "10.0.0.5:80", "localhost", "[::1]:11311"])
def test_this_machines_names_are_taken(name):
    assert size(host=name, reached="10.0.0.5", names=("simbox",)) == 46


@pytest.mark.parametrize(
    ("words", "fields", "status", "why"),
    [
        (POST, {"origin": "http://evil.example"}, "403", f"{PAGE} origin: {{}}"),
        (POST, {"origin": "null"}, "403", f"{PAGE} origin: {{}}"),
        (POST, {"origin": "http://127.0.0.1:11311"}, "403", f"{PAGE} origin: {{}}"),
        (POST, {"sec_fetch_site": "same-origin"}, "403", f"{PAGE} sec-fetch-site: {{}}"),
        (POST, {"content_type": "text/plain"}, "415", TYPE),
        (POST, {"content_type": "multipart/form-data; boundary=text/xml"}, "415", TYPE),
        (POST, {"content_type": "text/xml2"}, "415", TYPE),
        (POST, {"content_type": ""}, "415", TYPE),
        (POST, {"host": "evil.example:11311"}, "421", f"invalid Host '{{}}': {NEEDED}"),
        (POST, {"host": "10.0.0.5"}, "421", f"invalid Host '{{}}': {NEEDED}"),
        (POST, {"host": ""}, "421", f"invalid Host '{{}}': {NEEDED}"),
        (["OPTIONS", "/", "HTTP/1.1"], {"origin": "null"}, "405", f"{RPC} 'OPTIONS / HTTP/1.1' is not a POST"),
        (["GET", "/", "HTTP/1.1"], {}, "405", "this is XML-RPC: 'GET / HTTP/1.1' is not a POST"),
        (["post", "/", "HTTP/1.1"], {}, "405", "this is XML-RPC: 'post / HTTP/1.1' is not a POST"),
        (["POST", "/", "HTTP/2"], {}, "400", "this is XML-RPC: 'POST / HTTP/2' is not HTTP/1.0 or 1.1"),
    ],
)  # fmt: skip
def test_what_pages_and_others_send_is_refused(words, fields, status, why):
    with pytest.raises(RequestError) as caught:
        size(words, **fields)
    assert caught.value.status.startswith(f"{status} ")
    assert str(caught.value) == why.format(next(iter(fields.values()), ""))


def test_a_request_without_a_length_is_refused():
    with pytest.raises(RequestError) as caught:
        checked_size(POST, {}, lambda host: False)  # a program of HTTP/1.0 may leave the host out
    assert (caught.value.status, str(caught.value)) == ("411 Length Required", "a request needs a Content-Length")
