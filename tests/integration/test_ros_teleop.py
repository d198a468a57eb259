"""`vrx-mj teleop` before a world that `vrx-mj serve` serves, as a person uses it: in a terminal, and in a browser."""

import contextlib
import json
import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridged import Bridged
from browser import browsing
from needs import CHROMIUM, require
from vrx_command import environment, start
from vrx_mj.drive.pilot import KEYS, Engine, Pilot, Wheel, engine_commands
from vrx_mj.ros.teleop.driving import Bridge
from vrx_mj.ros.teleop.web import PageServer

FLEET = "{usv_count: 2, layout: line, spacing: 30, sensors: none}\n"
SECONDS = 60.0
OWN = "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); os.execv(sys.executable, sys.argv[1:])"
"""Makes the terminal that it is started in its own, as a shell's is."""


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """URL of a served world with two boats, and a client that sees it."""
    folder = tmp_path_factory.mktemp("served")
    (folder / "two.yaml").write_text(FLEET, encoding="utf-8")
    process = start("serve", "ocean", "--fleet", "two.yaml", "--rosbridge", "0", cwd=folder)
    said = threading.Thread(target=lambda: None)
    try:
        url = next(match.group() for line in process.stderr if (match := re.search(r"ws://\S+", line)))
        next(line for line in process.stderr if "topics out" in line)
        said = threading.Thread(target=process.stderr.read)  # or its pipe fills
        said.start()
        with contextlib.closing(Bridge(url)) as bridge:
            yield SimpleNamespace(url=url, bridge=bridge)
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(SECONDS) == 0
        said.join(SECONDS)
        process.stdout.close()
        process.stderr.close()


def asked(world, service, **arguments):
    """A service's response."""
    came = []
    world.bridge.call(service, arguments, lambda values, well: came.append((values, well)))
    until = time.monotonic() + SECONDS
    while not came:
        assert time.monotonic() < until
        world.bridge.listen(0.02)
    assert came[0][1], came
    return came[0][0]


def place(world, boat):
    position = asked(world, "/gazebo/get_model_state", model_name=boat)["pose"]["position"]
    return position["x"], position["y"]


def away(world, boat, start):
    x, y = place(world, boat)
    return ((x - start[0]) ** 2 + (y - start[1]) ** 2) ** 0.5


def reached(condition):
    until = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < until, "it took too long"
        time.sleep(0.02)


def overheard(world, boat, what="thrust_cmd"):
    """What comes from now on for a boat's left engine."""
    heard = []
    topic = f"/{boat}/thrusters/left_{what}"
    world.bridge.subscribe(topic, "std_msgs/Float32", lambda message: heard.append(message["data"]))
    return heard


def boats(world):
    topics = asked(world, "/rosapi/topics_for_type", type="geometry_msgs/Twist")["topics"]
    return {topic.split("/")[1] for topic in topics if topic != "/cmd_vel"}  # which is that of the only boat


class Terminal:
    """`vrx-mj teleop` in a terminal of its own; `seen` is what it wrote."""

    def __init__(self, *words):
        import termios

        self._read = termios.tcgetattr
        self.ours, self.theirs = pty.openpty()
        self.before = self._read(self.theirs)
        self.seen = ""
        self.process = subprocess.Popen(
            [sys.executable, "-c", OWN, sys.executable, "-m", "vrx_mj", "teleop", *words],
            stdin=self.theirs, stdout=self.theirs, stderr=self.theirs, start_new_session=True,
            env=environment(COLUMNS=160),
        )  # fmt: skip
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    def _listen(self):
        with contextlib.suppress(OSError):
            while part := os.read(self.ours, 4096):
                self.seen += part.decode()

    def type(self, keys):
        os.write(self.ours, keys.encode())

    @property
    def is_restored(self):
        return self._read(self.theirs) == self.before

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(SECONDS)
        os.close(self.theirs)
        self._thread.join(SECONDS)
        os.close(self.ours)


@pytest.mark.slow
def test_a_terminal_drives_pauses_and_is_left_as_it_was(world):
    begun = place(world, "wamv2")
    with contextlib.closing(Terminal("--url", world.url, "--boat", "wamv2")) as terminal:
        reached(lambda: "boat wamv2" in terminal.seen)
        assert not terminal.is_restored
        assert "connected to ocean" in terminal.seen
        assert re.search(r"power \+0\.00  turn \+0\.00  angle \+0 deg", terminal.seen)
        terminal.type("i")
        reached(lambda: away(world, "wamv2", begun) > 0.5)
        moving = r"power \+0\.50 .* speed \d\.\d\d m/s  heading \d+ deg compass  course \d+ deg compass"
        reached(lambda: re.search(moving, terminal.seen))
        terminal.type("p")
        reached(lambda: "paused" in terminal.seen)
        terminal.type("p")
        heard = []
        world.bridge.subscribe(
            "/wamv2/thrusters/left_thrust_cmd", "std_msgs/Float32", lambda m: heard.append(m["data"])
        )
        reached(lambda: world.bridge.listen(0.02) and 0.5 in heard)
        terminal.type("\x03")
        assert terminal.process.wait(SECONDS) == 0
        assert terminal.is_restored
        reached(lambda: world.bridge.listen(0.02) and heard[-1] == 0.0)
    assert "Traceback" not in terminal.seen


@pytest.mark.slow
def test_no_such_boat_ends_with_what_is_known(world):
    with contextlib.closing(Terminal("--url", world.url, "--boat", "titanic")) as terminal:
        assert terminal.process.wait(SECONDS) == 2
        assert terminal.is_restored
        reached(lambda: "no boat named 'titanic'; known: wamv1, wamv2" in terminal.seen)


@contextlib.contextmanager
def serving(url):
    """The page's server, for the rosbridge of that URL."""
    with PageServer(0, url) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join(SECONDS)


@pytest.fixture(scope="module")
def page(world, tmp_path_factory):
    require(CHROMIUM)
    with serving(world.url) as server, browsing(tmp_path_factory.mktemp("profile"), server.page) as made:
        made.size(1280, 800)
        made.wait("document.querySelector('#boat')?.textContent === 'wamv1'")
        yield made
        assert made.said == []  # no error, and nothing that the policy refused


def number(page, selector):
    return f"parseFloat(document.querySelector('{selector}').textContent.replace('−', '-'))"


@pytest.mark.slow
def test_the_joystick_drives_until_it_is_let_go(world, page):
    begun = place(world, "wamv1")
    x, y = page.middle("#stick")
    page.mouse("mousePressed", x, y)
    page.mouse("mouseMoved", x, y - 80)
    reached(lambda: away(world, "wamv1", begun) > 0.5)
    assert page.wait(f"{number(page, '#power')} === 1")
    assert page.wait(f"{number(page, '#speed')} > 0.1")
    page.mouse("mouseReleased", x, y - 80)
    assert page.wait(f"{number(page, '#power')} === 0")


@pytest.mark.slow
def test_the_slider_and_the_keys_drive_too(world, page):
    heard = overheard(world, "wamv1")
    page.key(",", ",")
    reached(lambda: world.bridge.listen(0.02) and -0.5 in heard)
    knob = "new DOMMatrix(getComputedStyle(document.querySelector('#knob')).transform).m42"
    assert page.wait(f"{knob} > 10")  # astern is down, whoever asked for it
    page.key("k", "k")
    assert page.wait(f"Math.abs({knob}) < 1")
    reached(lambda: world.bridge.listen(0.02) and heard[-1] == 0.0)
    page.look("document.querySelector('#angle').focus()")
    page.key("ArrowRight")
    turned = overheard(world, "wamv1", "thrust_angle")
    reached(lambda: world.bridge.listen(0.02) and pytest.approx(0.0175, abs=1e-3) in turned)  # a degree
    page.key("ArrowLeft")
    reached(lambda: world.bridge.listen(0.02) and turned[-1] == 0.0)


@pytest.mark.slow
def test_pause_stops_the_clock_and_boats_may_come_and_go_meanwhile(world, page):
    page.click("#pause")
    page.wait("document.querySelector('#pause').textContent === 'Resume'")
    stood = asked(world, "/gazebo/get_world_properties")["sim_time"]
    page.click("#add")
    page.wait("document.querySelector('#boat').textContent === 'wamv3'")
    assert boats(world) == {"wamv1", "wamv2", "wamv3"}
    (x1, y1), (x3, y3) = place(world, "wamv1"), place(world, "wamv3")
    assert 6.0 < ((x1 - x3) ** 2 + (y1 - y3) ** 2) ** 0.5 < 20.0
    assert asked(world, "/gazebo/get_world_properties")["sim_time"] == stood
    page.click("#pause")
    page.wait("document.querySelector('#pause').textContent === 'Pause'")
    reached(lambda: asked(world, "/gazebo/get_world_properties")["sim_time"] > stood)
    x, y = page.middle("#stick")
    page.mouse("mousePressed", x, y)
    page.mouse("mouseMoved", x, y - 80)
    reached(lambda: away(world, "wamv3", (x3, y3)) > 0.3)  # its engines are known as well
    page.mouse("mouseReleased", x, y - 80)
    page.click("#remove")
    page.wait("document.querySelector('#remove').textContent === 'Really remove wamv3?'")
    page.click("#remove")
    page.wait("document.querySelectorAll('#boats button').length === 2")
    assert boats(world) == {"wamv1", "wamv2"}


ENGINES = st.lists(
    st.builds(
        Engine,
        st.sampled_from("abc"),
        st.floats(-1.0, 1.0),
        st.floats(-3.0, 3.0),
        st.booleans(),
        st.sampled_from([0.0, 0.4, 1.6]),
        st.booleans(),
        st.floats(0.5, 9.0),
        st.floats(0.5, 9.0),
    ),
    max_size=4,
    unique_by=lambda engine: engine.name,
)
WHEELS = st.builds(Wheel, st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-2.0, 2.0))


@given(engines=ENGINES, wheel=WHEELS)
@pytest.mark.slow
def test_the_page_drives_engines_as_the_terminal_does(page, engines, wheel):
    given = json.dumps([[vars(engine) for engine in engines], vars(wheel)])
    told = page.look(f"import('/helm.js').then((h) => h.engineCommands(...{given}))")
    assert told == pytest.approx(engine_commands(engines, wheel), abs=1e-12)


@pytest.mark.slow
def test_the_pages_keys_ask_for_what_the_terminals_do(page):
    engines = {boat: [Engine("left", 1.0, -1.0, True, 1.5)] for boat in ("a", "b")}
    keys = sorted(KEYS - {"tab"}) * 3
    pilot = Pilot(engines, "a")
    for key in keys:
        pilot.press(key)
    rows = {boat: [vars(engine) for engine in one] for boat, one in engines.items()}
    script = f"""import('/helm.js').then((h) => {{
        const pilot = new h.Pilot();
        pilot.meet({json.dumps(rows)});
        for (const key of {json.dumps(keys)}) pilot.press(key);
        return [pilot.boat, pilot.sizes, pilot.wheels];
    }})"""
    boat, sizes, wheels = page.look(script)
    assert (boat, sizes) == (pilot.boat, pytest.approx(pilot.sizes))
    assert wheels == {boat: pytest.approx(vars(wheel)) for boat, wheel in pilot.wheels.items()}


RENAMED = {
    '<link name="wamv/base_link"/>': '<link name="b2/base_link"/>',
    "<topicName>/wamv/sensors</topicName>": "<topicName>/b2/sensors</topicName>",
    "<robotNamespace>wamv</robotNamespace>": "<robotNamespace>b2</robotNamespace>",
    '<mesh filename="package://wamv/hulls.obj"/>': '<mesh filename="package://wamv/hulls.obj"/>',
    '<mesh filename="/home/me/wamv/hulls.obj"/>': '<mesh filename="/home/me/wamv/hulls.obj"/>',
    '<link name="wamv_hulls"/>': '<link name="wamv_hulls"/>',
}


@pytest.mark.slow
def test_a_urdf_is_renamed_but_for_its_files(page):
    script = f"import('/helm.js').then((h) => {json.dumps(list(RENAMED))}.map((text) => h.renamed(text, 'wamv', 'b2')))"
    assert page.look(script) == list(RENAMED.values())


@pytest.mark.parametrize(("width", "dark"), [(390, True), (1600, False)])
@pytest.mark.slow
def test_nothing_is_wider_than_the_screen_and_colours_follow_it(page, width, dark):
    page.size(width, 844, dark=dark)
    assert page.look("document.documentElement.scrollWidth <= innerWidth")
    shade = page.look("getComputedStyle(document.querySelector('header')).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", shade)[:3])) < 200) == dark
    box = page.look("(({width, height}) => [width, height])(document.querySelector('#map').getBoundingClientRect())")
    assert min(box) > 250


@pytest.mark.slow
def test_a_service_that_refuses_is_told_in_words(world, page):
    page.size(1280, 800)
    asked(world, "/rosapi/set_param", name="/wamv1/robot_description", value='"no boat"')
    page.look("document.querySelectorAll('#boats button')[0].click()")
    page.click("#add")
    page.wait("document.querySelector('#notices .bad') !== null")
    told = page.look("document.querySelector('#notices .bad').textContent")
    assert told == "spawn_urdf_model: wamv3: invalid URDF: a <robot> element is needed"
    page.wait("!document.querySelector('#add').disabled")


@pytest.mark.slow
def test_the_last_boat_may_go_and_one_like_it_come(world, page):
    for boat in ("wamv1", "wamv2"):
        page.wait(f"document.querySelector('#boat').textContent === '{boat}'")
        page.click("#remove")
        page.click("#remove")
        page.wait(f"![...document.querySelectorAll('#boats button')].some((row) => row.dataset.boat === '{boat}')")
    assert boats(world) == set()
    page.wait("document.querySelector('#boat').textContent === 'No boat'")
    page.click("#add")
    page.wait("document.querySelector('#boat').textContent === 'wamv2'")
    assert boats(world) == {"wamv2"}


@pytest.mark.slow
def test_the_policy_lets_the_page_talk_to_nobody_else(page):
    for url in ("http://127.0.0.1:9/", "ws://127.0.0.1:9/", "https://example.org/"):
        how = f"new WebSocket('{url}')" if url.startswith("ws") else f"await fetch('{url}')"
        page.look(f"(async () => {{ try {{ {how} }} catch {{ }} }})()")
        page.wait("true")
        assert "Content Security Policy" in page.said.pop()["entry"]["text"]


@pytest.mark.slow
def test_a_connection_that_is_not_there_is_told_until_it_is(page):
    with Bridged() as gone:
        url = gone.url
    with serving(url) as server:
        page("Page.navigate", url=server.page)
        page.wait("document.querySelector('#banner')?.hidden === false")
        told = page.look("document.querySelector('#banner').textContent")
        assert told == f"No rosbridge answers at {url}. Start a world: vrx-mj serve WORLD --rosbridge. Trying again…"
        assert page.look("['pause', 'reset', 'add', 'remove'].every((id) => document.getElementById(id).disabled)")
        with Bridged(gone.bridge.port):
            page.wait("document.querySelector('#banner').hidden")
