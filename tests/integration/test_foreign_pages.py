"""Pages that a real browser shows, of this machine and of others, before ROS 1 and rosbridge."""

import contextlib
import functools
import http.server
import json
import re
import signal
import threading
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy, dumps

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from bridged import Bridged
from browser import browsing
from needs import CHROMIUM, needs
from ros1_peer import ME, dial, frame, frame_of, stream_of
from ros1_served import LEFT, Served, free_port, small_table
from vrx_command import start

pytestmark = [pytest.mark.slow, needs(CHROMIUM)]

FOREIGN = "evil.example"
"""A name that the browser is told to be this machine's address, as its owner could have the world believe."""
NOBODY = "http://127.0.0.1:1/"
READY = "document.readyState == 'complete' && document.body?.innerText == 'ready'"
RESOLVER = f"--host-resolver-rules=MAP {FOREIGN} 127.0.0.1"
LOCAL_LEFT = "/wamv/thrusters/left_thrust_cmd"

SCRIPT = """
const seen = (promise) => promise.then(() => "answered", (error) => "refused");
const plain = (url, body) => seen(fetch(url, {method: "POST", mode: "no-cors", body}));
const typed = (url, body) => seen(fetch(url, {method: "POST", headers: {"Content-Type": "text/xml"}, body}));
const bare = (url, body) => seen(fetch(url, {method: "POST", mode: "no-cors", body: new Blob([body])}));
const beacon = (url, body) => Promise.resolve(navigator.sendBeacon(url, body));
function form(url, body) {  // a form of text/plain sends NAME=VALUE
  const [name, ...rest] = body.split("=");
  return new Promise((done) => {
    const frame = Object.assign(document.createElement("iframe"), {name: `f${Math.random()}`});
    document.body.append(frame);
    const made = Object.assign(document.createElement("form"),
                               {action: url, method: "post", enctype: "text/plain", target: frame.name});
    made.append(Object.assign(document.createElement("input"), {type: "hidden", name, value: rest.join("=")}));
    document.body.append(made);
    frame.onload = () => done("loaded");
    made.submit();
  });
}
async function attack(calls) {
  const answers = [];
  for (const way of [plain, form, bare, typed, beacon])
    for (const [url, body] of calls) answers.push(await way(url, body));
  return answers;
}
function drive(url, operations) {  // whether a websocket opened, and what was said was sent
  return new Promise((done) => {
    const socket = new WebSocket(url);
    socket.onopen = () => { for (const one of operations) socket.send(JSON.stringify(one)); };
    socket.onmessage = () => { done("open"); socket.close(); };
    socket.onclose = () => done("closed");
  });
}
function inSandbox(url, operations) {  // the same from a frame whose origin is opaque
  return new Promise((done) => {
    window.onmessage = (event) => done(event.data);
    const frame = document.createElement("iframe");
    frame.sandbox = "allow-scripts";
    frame.srcdoc = `<script>${drive}; drive(${JSON.stringify(url)}, ${JSON.stringify(operations)})` +
                   `.then((what) => parent.postMessage(what, "*"))<\\/script>`;
    document.body.append(frame);
  });
}
"""
PAGE = f"<!DOCTYPE html><meta charset=utf-8><title>page</title><body><script>{SCRIPT}</script>ready"


class Answering(http.server.BaseHTTPRequestHandler):
    """The page, by whatever name it is asked for."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.end_headers()
        self.wfile.write(PAGE.encode())

    def log_message(self, *_):
        pass


@contextlib.contextmanager
def site():
    """The port at which the page is served, on all of this machine's loopback addresses."""
    with http.server.ThreadingHTTPServer(("0.0.0.0", 0), Answering) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(scope="module")
def port():
    with site() as one:
        yield one


@pytest.fixture(params=[FOREIGN, "127.0.0.1", "127.0.0.2", "localhost"])
def host(request):
    return request.param


@pytest.fixture
def page(tmp_path, port, host):
    with browsing(tmp_path / "profile", f"http://{host}:{port}/", RESOLVER) as one:
        one.wait(READY)
        yield one


def reached(host):
    """By which name a page of a host calls what listens on 127.0.0.1."""
    return "127.0.0.1" if host == "127.0.0.2" else host


def calls(api, node):
    """What a page would have a master and a node do."""
    master = [
        ("setParam", ("/evil", "/hacked", 1)),
        ("registerPublisher", ("/evil", LEFT, "std_msgs/Float32", NOBODY)),
        ("registerSubscriber", ("/evil", "/course", "std_msgs/String", NOBODY)),
        ("registerPublisher", ("/gazebo", "/evil", "std_msgs/String", NOBODY)),
    ]
    own = [("publisherUpdate", ("/master", LEFT, [NOBODY])), ("shutdown", ("/evil", "over"))]
    return [[api, dumps(values, method)] for method, values in master] + [
        [node, dumps(values, method)] for method, values in own
    ]


def test_no_page_of_whatever_host_reaches_ros_1(page, host, caplog):
    with Served(free_port(), small_table("wamv")) as served:
        with ServerProxy(served.uri) as master:
            node = master.lookupNode(ME, "/gazebo")[2]
        urls = [f"http://{reached(host)}:{urlsplit(uri).port}/" for uri in (served.uri, node)]
        asked = f"attack({json.dumps(calls(*urls))})"
        answers = page.look(asked)
        stream = stream_of(served.uri, "/course")
        page.look(f"plain('http://{reached(host)}:{stream[1]}/', 'x'.repeat(1000))")
        assert len(answers) == 30
        with ServerProxy(served.uri) as master:
            assert not master.hasParam(ME, "/hacked")[2]
            state = json.dumps(master.getSystemState(ME)[2])
            assert "evil" not in state
            assert "/gazebo" in state
        assert not served.ended.is_set()
        assert not served.ros._node.subscriptions[LEFT].sources
        connection, _ = dial(stream, topic="/course")
        with connection:
            assert frame_of(connection) == frame(b"gate 3")
    refused = [message for message in caplog.messages if "refused a request" in message]
    assert refused, caplog.messages


OPERATIONS = [
    {"op": "publish", "topic": LOCAL_LEFT, "type": "std_msgs/Float32", "msg": {"data": 0.5}},
    {"op": "call_service", "service": "/rosapi/get_time", "id": "time"},
]


def driven(page, bridged, host, how="drive"):
    """What a page gets of a rosbridge, and the commands that came."""
    url = f"ws://{host}:{bridged.bridge.port}"
    what = page.look(f"{how}({json.dumps(url)}, {json.dumps(OPERATIONS)})")
    if what == "open":
        bridged.wait(lambda one: one.came)
    return what, [message.data for _, message in bridged.came]


def test_only_pages_of_this_machine_drive_by_rosbridge(page, host, port, caplog):
    with Bridged() as bridged:
        expected = ("closed", []) if host == FOREIGN else ("open", [0.5])
        assert driven(page, bridged, "127.0.0.1") == expected
        assert driven(page, bridged, reached(host))[0] == expected[0]
    with Bridged() as bridged:
        assert driven(page, bridged, "127.0.0.1", "inSandbox") == ("closed", [])
    told = [message.partition(": ")[2] for message in caplog.messages if "--allow-origin" in message]
    refused = ["null"] if host != FOREIGN else [f"http://{FOREIGN}:{port}", "null"]
    line = "127.0.0.1: pages of {0} may not connect; to allow them: --allow-origin {0}"
    assert told == [line.format(origin) for origin in refused]


def test_a_page_whose_origin_is_allowed_drives_by_rosbridge(tmp_path, port):
    browse = functools.partial(browsing, tmp_path / "profile", f"http://{FOREIGN}:{port}/", RESOLVER)
    with Bridged(origins=(f"http://{FOREIGN}:{port}",)) as bridged, browse() as page:
        page.wait(READY)
        assert driven(page, bridged, "127.0.0.1") == ("open", [0.5])
        assert driven(page, bridged, FOREIGN)[0] == "closed"  # a name that leads here, and is none of this machine's


def test_serve_tells_how_to_allow_a_page_and_serves_one_that_is_allowed(tmp_path, port):
    allowed = f"http://{FOREIGN}:{port}"
    words = ("serve", "ocean", "--rosbridge", "0", "--allow-origin", allowed, "--allow-origin", "https://example.com")
    process = start(*words, cwd=tmp_path)
    try:
        url = next(match.group() for line in process.stderr if (match := re.search(r"ws://\S+", line)))
        next(line for line in process.stderr if "topics out" in line)
        time_of = json.dumps(OPERATIONS[1:])
        with browsing(tmp_path / "profile", f"{allowed}/", RESOLVER) as page:
            page.wait(READY)
            assert page.look(f"drive({url!r}, {time_of})") == "open"
            assert page.look(f"inSandbox({url!r}, {time_of})") == "closed"
        for _ in range(3):
            with pytest.raises(InvalidStatus), connect(url, origin="http://dock.example"):
                pass
    finally:
        process.send_signal(signal.SIGINT)
        said = process.stderr.read()
        process.stdout.close()
        process.stderr.close()
        assert process.wait(60.0) == 0
    assert said.count("may not connect; to allow them: --allow-origin http://dock.example") == 1, said
