"""The pages on ROS: every command that they show is executed, and both languages show the same.

A page is followed as a reader does, with a terminal and ROS's tools; page_blocks.py reads it. A block with
`vrx-mj serve` is the page's server until the next one.
"""

import collections
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Self

import pytest
import yaml

import vrx_mj
from needs import ROS1_TOOLS, needs
from page_blocks import Block, blocks, pieces
from ros1_served import environment, free_port
from ros_scene import served
from vrx_mj.ros.diagnosis import _touching_land
from vrx_mj.ros.packages import write_packages
from vrx_mj.sensors.canvas import BACKENDS, problem_of

REPO = Path(__file__).resolve().parents[2]
SERVED = "cmd_vel sets "
"""In a line that a server prints when it listens."""
ADDRESSES = {"192.168.1.20": "127.0.0.2", "192.168.1.30": "127.0.0.1"}
"""Those that pages have for the machine that serves and for another one, and two that every Linux has."""
REPLY_TIMEOUT, COMMAND_TIMEOUT = 30.0, 120.0
"""Wall time for what should come at once, and for what compiles first [s]."""
WHERE = """
import sys
import rospy
from gazebo_msgs.srv import GetModelState
get = rospy.ServiceProxy("/gazebo/get_model_state", GetModelState, persistent=True)
for line in sys.stdin:
    place = get(line.strip(), "").pose.position
    print(place.x, place.y, flush=True)
"""


def masked(text: str) -> str:
    """A text without what differs from run to run: hosts, ports, numbers of processes, shares of time."""
    return re.sub(r"localhost|127\.0\.0\.\d|\d{4,}|\d+(?= %)", "N", text)


class Reader:
    """Somebody with a terminal, Debian's ROS 1 tools and vrx-mj, in a folder that is empty at first."""

    def __init__(self, folder: Path, *, pictures: bool) -> None:
        self._folder, self._pictures = folder / "work", pictures
        self._folder.mkdir()
        (self._folder / "examples").symlink_to(REPO / "examples")
        self._port, self._bridge = free_port(), free_port()
        self._variables = _variables(folder, self._port)
        self._state, self._messages = folder / "state.sh", folder / "messages"
        self._state.write_text("", encoding="utf-8")
        write_packages(self._messages)
        self._server: Running | None = None
        self._where: subprocess.Popen[str] | None = None
        self._beside: list[Running] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end_section()
        self._forget()
        if self._server is not None:
            self._server.stop()

    def follow(self, block: Block) -> bool:
        """Do what the page says, and check what it says about that; whether a command was run."""
        name = block.note("file")
        if name is not None:
            path = self._folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(self._here(block.text), encoding="utf-8")
        if block.kind == "text":
            self._shown(block)
        skipped = block.note("not run") is not None or (block.note("needs") == "pictures" and not self._pictures)
        if block.kind != "bash" or skipped:
            return False
        text = self._here(block.text)
        if re.search(r"^vrx-mj serve ", text, re.M):
            self._serve(text, block)
        else:
            self._run(text, block)
        return True

    def _shown(self, block: Block) -> None:
        """Wait until the server has printed all lines of a block of text."""
        assert self._server is not None
        for line in block.text.splitlines():
            said = masked(self._here(line))
            self._until(lambda said=said: said in masked(self._said()), self._server, REPLY_TIMEOUT, said)

    def end_section(self) -> None:
        """Ctrl-C in the other terminals."""
        for running in self._beside:
            running.stop()
        self._beside.clear()

    def end_server(self) -> None:
        """Ctrl-C in the server's terminal, which must end it well."""
        self._forget()
        if self._server is not None:
            said = self._server.stop()
            assert self._server.code == 0, said
            assert re.search(r"served [\d.]+ s in", said), said
            self._server = None

    def _serve(self, text: str, block: Block) -> None:
        self.end_server()
        self._server = Running(self._script(text), self._variables, self._folder)
        self._until(lambda: SERVED in self._said(), self._server, COMMAND_TIMEOUT, block.place)
        self._check(block, self._server, {}, 0, REPLY_TIMEOUT)

    def _run(self, text: str, block: Block) -> None:
        boats = {value.split()[0]: self._place(value.split()[0]) for key, value in block.notes if key == "moves"}
        heard, least = len(self._said()), block.note("Ctrl-C")
        if least is not None or block.note("beside") is not None:
            running = Running(self._script(text), self._variables, self._folder)
            self._beside.append(running)
            self._check(block, running, boats, heard, REPLY_TIMEOUT)
            if least is not None:
                time.sleep(float((least or "0").split()[0]))
                self._beside.remove(running)
                running.stop()
            return
        keep = f'code=$?\n{{ export -p; echo "cd \\"$PWD\\""; }} > {self._state}\nexit $code\n'
        running = Running(f"set -e\n{self._script(text)}\n{keep}", self._variables, self._folder)
        code = running.wait(COMMAND_TIMEOUT)
        assert code == 0, f"{block.place}: exit code {code}\n{text}\n{running.said}"
        self._check(block, running, boats, heard, 5.0)

    def _check(
        self, block: Block, running: "Running", boats: dict[str, tuple[float, float]], heard: int, seconds: float
    ) -> None:
        for key, said in block.notes:
            what, value = f"{block.place}: {key}: {said}", self._here(said)
            if key == "expect":
                met = lambda value=value: re.search(value, running.said, re.M | re.S)  # noqa: E731
            elif key == "server says":
                met = lambda value=value: re.search(value, self._said()[heard:])  # noqa: E731
            elif key == "writes":
                met = (self._folder / value).exists
            elif key == "moves":
                boat, metres = value.split()
                met = lambda boat=boat, metres=metres: self._gone(boats[boat], boat) > float(metres)  # noqa: E731
            else:
                continue
            self._until(met, running, seconds, what)

    def _until(self, condition, running: "Running", seconds: float, what: str) -> None:
        end = time.monotonic() + seconds
        while not condition():
            told = f"{what}\n{running.said}\nserver:\n{self._said()}"
            assert time.monotonic() < end, f"not within {seconds:g} s: {told}"
            assert running.code in {0, None}, f"exit code {running.code}: {told}"
            time.sleep(0.05)

    def _script(self, text: str) -> str:
        return f"source {self._state}\n{text}"

    def _here(self, text: str) -> str:
        """With ports that are free, and addresses that are ours."""
        escaped = {re.escape(written): re.escape(meant) for written, meant in ADDRESSES.items()}
        ports = {"11311": str(self._port), "9090": str(self._bridge)}
        for written, meant in {**ADDRESSES, **escaped, **ports}.items():
            text = text.replace(written, meant)
        return text

    def _said(self) -> str:
        return "" if self._server is None else self._server.said

    def _gone(self, start: tuple[float, float], boat: str) -> float:
        x, y = self._place(boat)
        return float(((x - start[0]) ** 2 + (y - start[1]) ** 2) ** 0.5)

    def _place(self, boat: str) -> tuple[float, float]:
        if self._where is None:
            path = self._messages / "python"
            self._where = subprocess.Popen(
                ["/bin/bash", "-c", f"source {self._state}; PYTHONPATH={path} exec /usr/bin/python3 -c '{WHERE}'"],
                env=self._variables,
                cwd=self._folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                encoding="utf-8",
            )
        assert self._where.stdin is not None
        assert self._where.stdout is not None
        self._where.stdin.write(f"{boat}\n")
        self._where.stdin.flush()
        x, y = self._where.stdout.readline().split()
        return float(x), float(y)

    def _forget(self) -> None:
        if self._where is not None:
            self._where.kill()
            self._where.communicate()
            self._where = None


class Running:
    """A script of the shell in the background; what it prints goes to a file."""

    def __init__(self, script: str, variables: dict[str, str], folder: Path) -> None:
        self._log = folder.parent / f"said_{time.monotonic_ns()}.txt"
        with self._log.open("w", encoding="utf-8") as log:
            self._process = subprocess.Popen(
                ["/bin/bash", "-c", script],
                env=variables,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def said(self) -> str:
        """All that it has printed."""
        return self._log.read_text(encoding="utf-8", errors="replace")

    @property
    def code(self) -> int | None:
        """Its exit code; None while it runs."""
        return self._process.poll()

    def wait(self, seconds: float) -> int:
        """Its exit code."""
        try:
            return self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self._send(signal.SIGKILL)
            self._process.wait()
            raise AssertionError(f"not done within {seconds:g} s:\n{self.said}") from None

    def stop(self) -> str:
        """Ctrl-C; all that it printed."""
        self._send(signal.SIGINT)
        end = time.monotonic() + REPLY_TIMEOUT
        while self._is_there() and time.monotonic() < end:  # `rosbag` ends before the program that writes the bag does
            time.sleep(0.05)
        self._send(signal.SIGKILL)  # what is left
        self._process.wait()
        return self.said

    def _is_there(self) -> bool:
        """Whether it, or a program that it started, is still running."""
        self._process.poll()
        try:
            os.killpg(self._process.pid, 0)
        except ProcessLookupError:
            return False
        return True

    def _send(self, number: int) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, number)


def _variables(folder: Path, port: int) -> dict[str, str]:
    """The environment of a user of ROS, with `vrx-mj` and its `python` as they are under test."""
    programs = folder / "bin"
    programs.mkdir()
    for name, words in (("vrx-mj", "-m vrx_mj"), ("python", "")):
        path = f'PYTHONPATH="{REPO / "src"}${{PYTHONPATH:+:$PYTHONPATH}}"'
        program = programs / name
        program.write_text(f'#!/bin/sh\n{path} exec {shlex.quote(sys.executable)} {words} "$@"\n', encoding="utf-8")
        program.chmod(0o755)
    mine = environment(port, folder)
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    kept = {name: os.environ[name] for name in ("NUMBA_CACHE_DIR", "MUJOCO_GL", "VRX_MJ_CACHE") if name in os.environ}
    return {**mine, **kept, "XDG_CACHE_HOME": cache, "PATH": f"{programs}:{mine['PATH']}", "COLUMNS": "160"}


DOCS = REPO / "docs"
PAGES = ("tutorial_one_boat.md", "tutorial_many_boats.md", "ros.md")
NOT_RUN = {
    "what the test runs in is installed": 1,
    "needs a keyboard; tests/integration/test_ros_teleop.py drives it": 1,
    "needs a display and rqt": 1,
    "needs a display and RViz": 1,
    "it changes the machine; .ci/run does it": 1,
}
"""All reasons for which a command is not run here, and how many commands have each."""


@pytest.mark.slow
@needs(ROS1_TOOLS)
@pytest.mark.parametrize(
    "name", [pytest.param(page, marks=[pytest.mark.nightly] * ("tutorial" in page)) for page in PAGES]
)
def test_every_command_of_a_page_does_what_the_page_says(name, tmp_path):
    with Reader(tmp_path, pictures=any(problem_of(backend) is None for backend in BACKENDS)) as reader:
        for piece in pieces(DOCS / name):
            if isinstance(piece, str):
                reader.end_section()
            else:
                reader.follow(piece)
        reader.end_section()
        reader.end_server()


def test_what_is_not_run_is_little_and_has_a_reason():
    notes = [note for name in PAGES for block in blocks(DOCS / name) for note in block.notes]
    reasons = [reason for key, reason in notes if key == "not run"]
    assert dict(collections.Counter(reasons)) == NOT_RUN
    assert all((REPO / path).exists() for reason in reasons for path in re.findall(r"tests/\S+\.py", reason))
    assert len([key for key, _ in notes if key in {"expect", "moves", "server says"}]) > 60


@pytest.mark.parametrize("name", PAGES)
def test_both_languages_show_the_same_blocks(name):
    english, chinese = (
        [(block.kind, block.text) for block in blocks(path)] for path in (DOCS / name, DOCS / "zh" / name)
    )
    assert chinese == english


@pytest.mark.slow
def test_the_boats_of_the_tutorials_world_drift_free_of_the_land(tmp_path, monkeypatch):
    """Nobody drives them while the page is read: the wind blows off the shore."""
    files = {block.note("file"): block.text for block in blocks(DOCS / "tutorial_one_boat.md") if block.note("file")}
    (tmp_path / "my_lake.yaml").write_text(files["my_lake.yaml"], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    boats = [{**boat, "sensors": "none"} for boat in yaml.safe_load(files["my_fleet.yaml"])["boats"]]
    fleet = {"boats": [{key: boat[key] for key in ("name", "pose", "sensors")} for boat in boats]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world("my_lake.yaml", fleet=fleet))
    touched = set()
    for _ in range(600):
        sim.step(duration=0.1)
        touched |= _touching_land(sim)
    assert touched == set()
    assert all(boat.position[1] > 165.0 for boat in sim.observe().values())  # they began at 162 m


def named(page):
    """Patterns of the topics and services in the first cells of a page's tables; what has no slash is a sibling."""
    for row in re.findall(r"^\| (?:< )?`(/[^|]*)", page.read_text("utf-8"), re.MULTILINE):
        first, *others = re.findall(r"`([^`]+)`", f"`{row}")
        names = [
            first,
            *(other if other.startswith("/") else f"{first.rpartition('/')[0]}/{other}" for other in others),
        ]
        for name in names:
            yield re.sub(r"BOAT|NAME|PLACARD|LIGHT_BUOY", "[^/]+", name)


def test_the_reference_names_every_topic_and_service():
    two = {"usv_count": 2, "layout": "line", "origin": "spawn", "sensors": "none"}
    offered = set()
    for world, fleet in (("example_course", None), ("stationkeeping_task", two), ("wayfinding_task", None)):
        table = served(vrx_mj.compile_world(world, fleet=fleet)).network.table
        offered |= {*table.outputs, *table.inputs, *table.services}
    assert len(offered) > 60
    for page in (DOCS / "ros.md", DOCS / "zh" / "ros.md"):
        known = [re.compile(pattern) for pattern in named(page)]
        assert sorted(name for name in offered if not any(pattern.fullmatch(name) for pattern in known)) == []
