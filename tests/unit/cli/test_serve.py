"""`vrx-mj serve`, `ros`, `convert` and `teleop`, without networks: what the words ask for, and what is printed."""

import logging
import signal
import sys
from contextlib import contextmanager, nullcontext
from importlib import util
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import pytest

from vrx_mj.cli import ros, sailing
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros import serve


class Terminal(StringIO):
    """Text that goes to a terminal, or to none."""

    def __init__(self, watched=True):
        super().__init__()
        self.isatty = lambda: watched


@pytest.fixture
def served(monkeypatch, cli):
    """Run `vrx-mj serve`; what is served, in the order of calls."""
    did = []
    sim = SimpleNamespace(boats=("a", "b"), task_is_over=False)
    monkeypatch.setattr(ros, "compile_source", lambda *given, **how: did.append(("compile", given, how)) or "world")
    monkeypatch.setattr("vrx_mj.runtime.simulation.Simulation", lambda world: did.append(world) or sim)
    monkeypatch.setattr(serve, "serve", lambda *given, **how: did.append((*given, how)))
    monkeypatch.setattr("vrx_mj.ros.ros2.load_rclpy", lambda: did.append("rclpy"))
    monkeypatch.setattr(ros, "check_installed", lambda *extras: did.append(extras))
    monkeypatch.setattr(sailing, "recording", lambda *given: did.append(given) or nullcontext())
    before = logging.getLogger("vrx_mj").handlers[:]

    def run(*words):
        did.clear()
        said = cli("serve", "bay", *words)
        return did[:], said

    yield run
    logging.getLogger("vrx_mj").handlers[:] = before


def wanted_of(did):
    """What was asked for, without callbacks."""
    (sim, wanted, _), = (entry for entry in did if isinstance(entry, tuple) and hasattr(entry[0], "boats") and
                         len(entry) == 3 and hasattr(entry[1], "ros1"))  # fmt: skip
    assert sim.boats == ("a", "b")
    return {name: getattr(wanted, name) for name in wanted.__dataclass_fields__}


PLAIN = {
    "ros1": True, "rosbridge": 9090, "foxglove": None, "ros2": False, "host": "127.0.0.1", "lockstep": None,
    "cmd_vel": "thrust", "truth": False, "localization": None, "rate": 1.0, "clock_rate": 100.0, "duration": None,
    "paused": False, "exit_on_completion": False, "origins": (), "nmea": None,
}  # fmt: skip


def test_by_default_ros_1_and_rosbridge_are_served(served):
    did, said = served()
    assert said.code == 0
    assert did[0] == ("rosbridge", "ros1")
    assert did[1:3] == [("compile", ("bay", None), {"fleet": None, "seed": None, "nudge": False}), "world"]
    assert did[3][1:] == (None, ())
    found = wanted_of(did)
    assert {name: found[name] for name in PLAIN} == PLAIN
    assert did[-1][2]["autopilots"] is None
    assert logging.getLogger("vrx_mj").handlers


@pytest.mark.parametrize(
    ("words", "changes"),
    [
        (("--ros1",), {"rosbridge": None}),
        (("--rosbridge",), {"ros1": False}),
        (("--foxglove", "0"), {"ros1": False, "rosbridge": None, "foxglove": 0}),
        (("--ros2", "--rate", "max"), {"ros1": False, "rosbridge": None, "ros2": True, "rate": None}),
        (("--foxglove", "--truth"), {"ros1": False, "rosbridge": None, "foxglove": 8765, "truth": True}),
        (("--nmea", "b:7"), {"ros1": False, "rosbridge": None, "nmea": {"b": 7}}),
        (("--nmea",), {"ros1": False, "rosbridge": None, "nmea": {"a": 10110}}),
        (
            ("--host", "0.0.0.0", "--lockstep", "x,y", "--clock", "50", "--cmd-vel", "off", "--localization", "truth",
             "--paused", "--duration", "3", "--exit-on-completion"),
            {"host": "0.0.0.0", "lockstep": ("x", "y"), "clock_rate": 50.0, "cmd_vel": "off",
             "localization": "truth", "paused": True, "duration": 3.0, "exit_on_completion": True},
        ),
    ],
)  # fmt: skip
def test_words_say_what_is_served(served, words, changes):
    did, said = served(*words)
    assert said.code == 0
    found = wanted_of(did)
    assert {name: found[name] for name in PLAIN} == PLAIN | changes
    assert ("rclpy" in did) == ("--ros2" in words)


def test_what_is_missing_is_asked_for_before_the_world_is_compiled(served):
    did, _ = served(
        "--foxglove", "--nmea", "--rosbridge", "--record", "run.rrd", "--fleet", "two", "--seed", "4", "--nudge"
    )
    assert did[0] == ("rosbridge", "foxglove", "nmea", "ros1")
    assert did[1] == ("compile", ("bay", None), {"fleet": "two", "seed": 4, "nudge": True})
    assert did[3][1:] == (Path("run.rrd"), ())


@pytest.mark.parametrize(("words", "over"), [((), False), (("--exit-on-completion",), True)])
def test_autopilots_alone_need_no_ros(served, monkeypatch, words, over):
    ran = []

    @contextmanager
    def listening(sim, ports, host, rate):
        def run(duration, over):
            sim.task_is_over = True
            ran.append((duration, over()))
            sim.task_is_over = False
            signal.raise_signal(signal.SIGTERM)
            ran.append(over())

        ran.append((ports, host, rate))
        yield SimpleNamespace(run=run)

    monkeypatch.setattr(ros, "_ardupilot", listening)
    did, said = served("--ardupilot", "a:7", "--rate", "2", "--duration", "5", *words)
    assert said.code == 0
    assert ran == [("a:7", "127.0.0.1", 2.0), (5.0, over), True]
    assert did[0][0] == "compile"
    did, _ = served("--ardupilot", "--rosbridge")
    assert did[-1][2]["autopilots"] is not None


def test_ports_of_plotters_that_are_none_are_refused(served):
    _, said = served("--nmea=a:b")
    assert said.code == 2
    assert "invalid --nmea 'a:b': [BOAT:]PORT,... of boats is needed, as in wamv:10110" in said.err


def test_autopilots_say_how_to_start_them(monkeypatch, capsys):
    pilot = SimpleNamespace(descriptions=lambda: ["one", "two"])
    given = []
    monkeypatch.setattr("vrx_mj.autopilot.ArduPilot", lambda *own, **how: given.append((*own, how)) or pilot)
    sim = SimpleNamespace(boats=("a", "b"))
    assert ros._ardupilot(sim, "9002", "here", 2.0) is pilot
    assert given == [(sim, {"a": 9002, "b": 9012}, {"host": "here", "rate": 2.0, "report": ros._log_line})]
    assert capsys.readouterr().err == "one\ntwo\n"


@pytest.mark.parametrize("text", ["0", "-1", "inf", "nan", "fast", ""])
def test_a_rate_that_is_none_is_refused(text):
    with pytest.raises(CommandError) as caught:
        ros.parse_rate(text)
    assert str(caught.value) == f"invalid --rate '{text}': a number above 0 is needed, 1 for real time, or max"


def test_missing_packages_are_named_with_what_installs_them(monkeypatch):
    monkeypatch.setattr(ros, "missing_modules", lambda extra: {"a": [], "b": ["x", "y"]}[extra])
    monkeypatch.setattr(ros, "install_extra", lambda extra: f"install {extra}")
    ros.check_installed("a")
    with pytest.raises(NetworkError, match=r"^not installed: x, y; install b$"):
        ros.check_installed("a", "b")


@pytest.mark.parametrize("watched", [True, False])
def test_lines_of_the_log_stand_above_the_status_where_somebody_looks(monkeypatch, watched):
    screen = Terminal(watched)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("COLUMNS", "30")
    monkeypatch.setattr(sys, "stderr", screen)
    ros._log_line("INFO", "begun")
    ros._log_line("WARN", "slow")
    ros._Log().emit(logging.LogRecord("vrx_mj", logging.WARNING, "", 0, "late by %d s", (3,), None))
    ros._Log().emit(logging.LogRecord("vrx_mj", logging.ERROR, "", 0, "gone", (), None))
    ros._status()("x" * 99)
    monkeypatch.setenv("COLUMNS", "9")
    ros._status()("y" * 99)
    if watched:
        yellow = [f"\r\x1b[K\x1b[33m{text}\x1b[0m\n" for text in ("slow", "late by 3 s")]
        lines = ["\r\x1b[Kbegun\n", *yellow, "\r\x1b[K\x1b[31mgone\x1b[0m\n"]
        assert screen.getvalue() == "".join(lines) + f"\r\x1b[K{'x' * 29}\r\x1b[K{'y' * 20}"
    else:
        assert screen.getvalue() == "begun\nslow\nlate by 3 s\ngone\n"


def test_packages_of_messages_are_listed_and_only_lines_for_the_shell_go_to_stdout(cli, monkeypatch):
    written = SimpleNamespace(
        packages=["gazebo_msgs", "usv_msgs"], left_out={"uuid_msgs": "/opt/ros"}, missing=["std_msgs"],
        exports=["export A=1", "export B=2"],
    )  # fmt: skip
    monkeypatch.setattr("vrx_mj.ros.packages.write_packages", lambda _output: written)
    said = cli("ros", "messages", "-o", "made")
    assert (said.code, said.out) == (0, "export A=1\nexport B=2\n")
    head = ["left out: uuid_msgs, which is in /opt/ros", "std_msgs is missing: apt-get install python3-std-msgs"]
    tail = "paste into every shell, or into ~/.bashrc:"
    assert said.err.splitlines() == ["made: gazebo_msgs, usv_msgs", *head, tail]
    written.packages, written.left_out, written.missing = [], {}, []
    assert cli("ros", "messages", "-o", "made").err.splitlines() == ["made: nothing", tail]


def test_packages_of_launch_files_are_listed_with_the_line_for_the_shell(cli, monkeypatch, folder):
    given = []
    names = ("vrx_gazebo", "vrx_2019")
    monkeypatch.setattr("vrx_mj.ros.packages.write_launch_packages", lambda *own: given.append(own) or names)
    said = cli("ros", "packages", "-o", "my made")
    assert said.out == f"export ROS_PACKAGE_PATH='{folder / 'my made'}'${{ROS_PACKAGE_PATH:+:$ROS_PACKAGE_PATH}}\n"
    assert said.err.splitlines() == [
        "my made: vrx_gazebo, vrx_2019", "paste into every shell, or into ~/.bashrc:"
    ]  # fmt: skip
    cli("ros", "packages", "-o", "made", "--over", ".")
    assert given == [(Path("my made"), None), (Path("made"), Path())]


@pytest.mark.parametrize("target", ["out.bag", "out.MCAP", "out"])
def test_a_recording_becomes_a_bag(cli, monkeypatch, target):
    shown = []

    class Bar:
        def __init__(self, *given):
            shown.append(given)

        def __enter__(self):
            return SimpleNamespace(update=lambda *given, **how: shown.append((*given, how)))

        def __exit__(self, *_):
            pass

    def convert(recording, file, progress):
        progress(2.0, 8.0)
        shown.append((recording, file))
        return 12

    monkeypatch.setattr(ros, "Bar", Bar)
    monkeypatch.setattr("vrx_mj.ros.convert.convert", convert)
    said = cli("convert", "run.rrd", target)
    assert (said.code, said.out) == (0, f"{target}: 12 messages\n")
    assert shown == [("converting", 0.0, "s"), (2.0, {"total": 8.0}), (Path("run.rrd"), Path(target))]


def test_a_recording_becomes_a_table_or_tracks(cli, monkeypatch):
    given = []
    monkeypatch.setattr("vrx_mj.recording.exports.write_table", lambda *own: given.append(own) or 7)
    assert cli("convert", "run.rrd", "out.CSV").out == "out.CSV: 7 rows\n"
    assert cli("convert", "run.rrd", "out.gpx", "--table", "wind").code == 0
    assert given == [(Path("run.rrd"), Path("out.CSV"), "motion"), (Path("run.rrd"), Path("out.gpx"), "wind")]
    said = cli("convert", "run.rrd", "out.png")
    kinds = ".bag, .mcap, .csv, .parquet, .gpx, .geojson, or a folder without a suffix (rosbag2)"
    assert (said.code, said.err) == (2, f"invalid target 'out.png'; allowed: {kinds}\n")


def test_keys_drive_a_served_world(cli, monkeypatch):
    given = []
    monkeypatch.setattr("vrx_mj.ros.teleop.driving.drive_served_world", lambda *own, **how: given.append((*own, how)))
    assert cli("teleop").code == cli("teleop", "--boat", "b", "--url", "ws://x:1").code == 0
    assert given == [("ws://127.0.0.1:9090", {"boat": None}), ("ws://x:1", {"boat": "b"})]
    said = cli("teleop", "--url", "x:1")
    assert said.err == "invalid --url 'x:1': ws://HOST:PORT is needed, as in ws://127.0.0.1:9090\n"
    monkeypatch.setattr(util, "find_spec", lambda *_: None)
    assert cli("teleop").err.startswith("vrx-mj teleop needs websockets")


@pytest.mark.parametrize(("url", "port", "answers"), [("ws://x:7", 7, True), ("ws://x", 80, False)])
def test_a_page_to_drive_from_says_where_it_is(cli, monkeypatch, url, port, answers):
    class Server:
        server_address, page = ("127.0.0.1", 8090), "http://127.0.0.1:8090"

        def __init__(self, *given):
            served.append(given)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            served.append("closed")

        def serve_forever(self, poll_interval):
            served.append(poll_interval)
            raise KeyboardInterrupt

    served = []
    monkeypatch.setattr("vrx_mj.ros.teleop.web.PageServer", Server)
    monkeypatch.setattr("vrx_mj.ros.teleop.web.reaches", lambda _url: answers)
    said = cli("teleop", "--web", "--url", url, "--boat", "b")
    assert (said.code, served) == (0, [(8090, url, "b"), 0.2, "closed"])
    assert said.out.splitlines() == [
        "Open http://127.0.0.1:8090",
        f"It drives the world at {url}, and is for this machine only. Ctrl-C stops.",
        f"From another machine, first: ssh -L 8090:127.0.0.1:8090 -L {port}:127.0.0.1:{port} this-machine",
    ]
    nothing = f"nothing answers at {url} yet; start a world there: vrx-mj serve WORLD --rosbridge\n"
    assert said.err == ("" if answers else nothing)
