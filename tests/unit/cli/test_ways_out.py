"""Ways out of the command line and what a command hands on: codes, lines, and arguments of what does the work."""

import json
import math
import os
import sys
from contextlib import nullcontext
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer

from vrx_mj import cli as package
from vrx_mj.cli import bench, bench_fleet, checks, commands, doctor, nodes, program, robot
from vrx_mj.cli.options import above_zero, named_values, put_first
from vrx_mj.errors import CommandError, DivergedError, VrxError


def raising(error):
    def main(*_, **__):
        raise error

    return SimpleNamespace(main=main)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (VrxError("no water"), 2, "no water\n"),
        (DivergedError("a became NaN"), 1, "a became NaN\n"),
        (
            OSError(28, "No space left on device", "run.rrd"),
            1,
            "a file 'run.rrd' cannot be used: No space left on device\n",
        ),
        (OSError("odd"), 1, "a file cannot be used: odd\n"),
        (KeyboardInterrupt(), 130, ""),
        (typer.Abort(), 130, ""),
    ],
)
def test_an_error_is_a_line_and_a_code(capsys, error, code, words):
    assert program._code(raising(error), ["run"]) == code
    assert capsys.readouterr().err == words


@pytest.mark.parametrize(("given", "code"), [(None, 0), (3, 3), ("text", 0)])
def test_the_code_is_that_of_the_command(given, code):
    assert program._code(SimpleNamespace(main=lambda *_, **__: given), ["run"]) == code


def test_a_reader_that_has_gone_ends_it_quietly(monkeypatch, capsys):
    moved = []
    monkeypatch.setattr(os, "dup2", lambda one, other: moved.append(other))
    assert program._code(raising(BrokenPipeError()), ["run"]) == 1
    assert (moved, capsys.readouterr().err) == ([1], "")


def test_a_package_that_is_missing_has_no_version(monkeypatch, capsys):
    def version(name):
        if name == "mujoco":
            raise PackageNotFoundError
        return "1.2"

    monkeypatch.setattr("importlib.metadata.version", version)
    with pytest.raises(typer.Exit):
        program._print_version(True)
    assert "(mujoco not installed, numba 1.2, Python" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (ImportError("numba"), None), (ImportError("numba"), 130)]
)
def test_ctrl_c_while_packages_load_ends_it_as_ctrl_c(monkeypatch, error, code):
    """A package that it hits may raise another error in its place."""

    def start():
        if code == 130 and isinstance(error, ImportError):
            raise error from KeyboardInterrupt()
        raise error

    monkeypatch.setattr(program, "main", start)
    monkeypatch.setattr(package, "installed_first", lambda: None)
    monkeypatch.setattr(package.gc, "set_threshold", lambda _count: None)
    monkeypatch.setattr(package, "shadowed_package", lambda _error: None)
    with pytest.raises(ImportError if code is None else SystemExit) as ended:
        package.main()
    assert getattr(ended.value, "code", None) == code


def test_a_package_in_the_way_is_a_line_and_a_folder_that_is_gone_another(monkeypatch, capsys):
    def gone():
        raise FileNotFoundError(2, "No such file or directory")

    monkeypatch.setattr(program, "main", raising(ImportError("numba")).main)
    monkeypatch.setattr(package, "installed_first", lambda: None)
    monkeypatch.setattr(package.gc, "set_threshold", lambda _count: None)
    monkeypatch.setattr(package, "shadowed_package", lambda _error: "numba is in the way")
    for line in (
        "numba is in the way",
        "the current folder cannot be used: No such file or directory; change to another",
    ):
        with pytest.raises(SystemExit) as ended:
            package.main()
        assert (ended.value.code, capsys.readouterr().err) == (2, f"{line}\n")
        monkeypatch.setattr(package.Path, "cwd", gone)


@pytest.mark.parametrize(("value", "limit"), [(0.0, ""), (-1.0, ""), (math.nan, ""), (1.1e9, ", at most 1e+09,")])
def test_numbers_of_options_are_above_0_and_not_too_large(value, limit):
    option = SimpleNamespace(opts=["--mass"])
    check = above_zero()
    assert [check(option, good) for good in (None, 1e9, 1e-9)] == [None, 1e9, 1e-9]
    with pytest.raises(CommandError) as caught:
        check(option, value)
    assert str(caught.value) == f"invalid --mass '{value:g}': a number above 0{limit} is needed"


def test_arguments_are_names_and_values():
    assert named_values(["x:=-520", "y:=a:=b", "z:="]) == {"x": "-520", "y": "a:=b", "z": ""}
    assert named_values(None) == {}
    for word in ("x", "1x:=2", ":=2"):
        with pytest.raises(CommandError) as caught:
            named_values([word])
        assert str(caught.value) == f"invalid argument '{word}': NAME:=VALUE is needed, as in x:=-520"


def test_folders_of_options_come_before_those_of_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("SOME_PATH", "/last")
    put_first([tmp_path, tmp_path], "SOME_PATH", "--allow")
    assert os.environ["SOME_PATH"] == os.pathsep.join((str(tmp_path), str(tmp_path), "/last"))
    monkeypatch.delenv("SOME_PATH")
    put_first([], "SOME_PATH", "--allow")
    assert "SOME_PATH" not in os.environ
    put_first([tmp_path], "SOME_PATH", "--allow")
    assert os.environ["SOME_PATH"] == str(tmp_path)
    with pytest.raises(VrxError, match=r"^invalid --allow '/nowhere': not a folder$"):
        put_first([Path("/nowhere")], "SOME_PATH", "--allow")


def test_the_bench_measures_what_it_is_asked_for(cli, monkeypatch, folder):
    printed = []
    monkeypatch.setattr(bench_fleet, "fleet_table", lambda: ["fleets"])
    monkeypatch.setattr(bench_fleet, "print_fleet_table", printed.append)
    monkeypatch.setattr(bench, "measure", lambda: ["all"])
    monkeypatch.setattr(bench, "recording_rows", lambda: ["recordings"])
    monkeypatch.setattr(bench, "print_rows", printed.append)
    for words in ((), ("--recordings", "--json", "rows.json"), ("--fleet-table",)):
        assert cli("bench", *words).code == 0
    assert printed == [["all"], ["recordings"], ["fleets"]]
    assert (folder / "rows.json").read_text(encoding="utf-8") == '[\n "recordings"\n]\n'


def test_a_world_is_viewed_as_the_words_say(cli, monkeypatch):
    given, world = [], SimpleNamespace(parameters=None)
    monkeypatch.setattr(commands, "compile_source", lambda *own, **how: given.append((*own, how)) or world)
    monkeypatch.setattr("vrx_mj.cli.sailing.steering", lambda *own: given.append(own) or (lambda sim: ("steers", sim)))
    monkeypatch.setattr("vrx_mj.runtime.simulation.Simulation", lambda world: "simulation")
    monkeypatch.setattr("vrx_mj.drive.view.view", lambda sim, **how: given.append((sim, how)))
    plain = {"boat": None, "pace": 1.0, "controller": ("steers", "simulation"), "browser": False, "write": typer.echo}
    assert cli("view", "bay").code == 0
    assert given == [
        (None, None), ("bay", None, {"fleet": None, "seed": None, "nudge": False}), ("simulation", plain)
    ]  # fmt: skip
    given.clear()
    words = (
        "--fleet",
        "trio",
        "--boat",
        "b",
        "--pace",
        "2",
        "--seed",
        "3",
        "--thrust",
        "left=1",
        "--browser",
        "--nudge",
    )
    assert cli("view", "bay", *words).code == 0
    assert given == [
        (None, "left=1"), ("bay", None, {"fleet": "trio", "seed": 3, "nudge": True}),
        ("simulation", plain | {"boat": "b", "pace": 2.0, "browser": True}),
    ]  # fmt: skip


def test_a_recording_is_opened_drawn_or_written_as_a_data_set(cli, monkeypatch, folder):
    given = []
    (folder / "run.rrd").touch()
    monkeypatch.setattr("vrx_mj.recording.write_coco", lambda *own, **how: given.append((*own, how)) or 7)
    monkeypatch.setattr("vrx_mj.recording.open_viewer", lambda *own, **how: given.append((*own, how)) or 5)
    monkeypatch.setattr("vrx_mj.recording.video.draw_video", lambda *own: given.append(own) or "drawn")
    said = cli("replay", "run.rrd", "--coco", "set", "--boat", "b", "--from", "1", "--to", "4")
    assert (said.code, said.out) == (0, "data set: set, 7 pictures, annotations.json\n")
    assert given.pop() == (Path("run.rrd"), Path("set"), {"boat": "b", "begin": 1.0, "end": 4.0})
    assert cli("replay", "run.rrd", "--boat", "b").code == 5
    assert given.pop() == (Path("run.rrd"), {"follow": "b", "write": typer.echo})
    assert cli("replay", "run.rrd", "--video", "run.mp4").out == "drawn\n"
    recording, file, shot = given.pop()
    assert (recording, file) == (Path("run.rrd"), Path("run.mp4"))
    plain = {"view": "both", "boat": None, "fps": None, "speed": 1.0, "begin": None, "end": None}
    assert {name: getattr(shot, name) for name in plain} == plain
    words = ("--view", "above", "--size", "640x480", "--fps", "5", "--speed", "3", "--from", "1", "--to", "2")
    cli("replay", "run.rrd", "--video", "run.mp4", *words)
    shot = given.pop()[2]
    changed = {"view": "above", "size": (640, 480), "fps": 5.0, "speed": 3.0, "begin": 1.0, "end": 2.0}
    assert {name: getattr(shot, name) for name in changed} == changed
    assert cli("replay", "none.rrd").code == 2
    said = cli("replay", "run.rrd", "--video", "a.mp4", "--coco", "b")
    assert (said.code, said.err) == (2, "--video and --coco cannot be combined: give one of them\n")


@pytest.mark.parametrize("equal", [True, False])
def test_recordings_that_differ_end_with_one(cli, monkeypatch, equal):
    class Result:
        def __init__(self):
            self.equal = equal

        def __str__(self):
            return "they differ" if not equal else "equal"

    monkeypatch.setattr("vrx_mj.recording.compare", lambda *_: Result())
    said = cli("compare", "a.rrd", "b.rrd")
    assert (said.code, said.out) == ((0, "equal\n") if equal else (1, "they differ\n"))


@pytest.mark.parametrize(
    ("change", "line", "warning"),
    [
        (0.02, "up to 2.0% of a force", None),
        (0.021, "up to 2.1% of a force", "more than the requested 2.0%, and finer panels are too many"),
        (None, "unknown: too many panels", "the error is unknown, and finer panels are too many"),
    ],
)
def test_radiation_of_a_hull_says_how_good_it_is(monkeypatch, tmp_path, capsys, change, line, warning):
    given, shown = [], []

    class Bar:
        def __init__(self, *own):
            shown.append(own)

        def __enter__(self):
            return SimpleNamespace(update=shown.append)

        def __exit__(self, *_):
            pass

    def hydro_of_hull(*own, progress, **how):
        given.append((*own, how))
        progress(3, 40)
        return {
            "mesh_error": change,
            "frequencies": [1.0, 12.34],
            "program": "Capytaine",
            "poles": [1, 2],
            "fit_error": 0.004,
        }

    monkeypatch.setattr(robot, "Bar", Bar)
    monkeypatch.setattr("vrx_mj.adapters.hydro.hydro_of_hull", hydro_of_hull)
    sheet = SimpleNamespace(waterline=0.3, center_of_mass=(0, 0, 1), density=1000.0, gravity=9.8, mass=50.0)
    file = tmp_path / "hydro.json"
    with pytest.warns(Warning, match=warning) if warning else nullcontext():
        robot._write_bem(file, "corners", sheet, 40, 150, 0.02)
    how = {"density": 1000.0, "gravity": 9.8, "frequencies": 40, "panels": 150, "tolerance": 0.02}
    assert given == [("corners", 0.3, (0, 0, 1), how)]
    assert shown == [("frequencies", 40), 3]
    table = json.loads(file.read_text(encoding="utf-8"))
    assert (table["displacement"], table["waterline"]) == (50.0, 0.3)
    assert capsys.readouterr().out.splitlines() == [
        f"{file}: Capytaine, to 12.3 rad/s", "  memory of 2 poles: 0.4% off the computed radiation",
        f"  change by halving the panels: {line}",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "message"),
    [("1,2", "x,y,z [m] are needed, as 0,0,0.15"), ("a,b,c", "x,y,z [m] are needed, as 0,0,0.15"),
     ("0,0,1e9", "numbers are needed"), ("0,nan,0", "numbers are needed"), ("-1e9,0,0", "numbers are needed")],
)  # fmt: skip
def test_a_centre_is_three_numbers(words, message):
    assert robot.coordinates("1, -2,0.5") == (1.0, -2.0, 0.5)
    with pytest.raises(CommandError) as caught:
        robot.coordinates(words)
    assert str(caught.value) == f"invalid --center '{words}': {message}"


def part(*breaches, **own):
    found = [SimpleNamespace(rule=rule, message=message) for rule, message in breaches]
    return SimpleNamespace(
        **{"compliant": not found, "box": None, "legal": None, "warning": "", "breaches": found} | own
    )


@pytest.mark.parametrize(
    ("judged", "lines"),
    [
        (part(), ["pass"]),
        (part(box=SimpleNamespace(name="aft"), warning="odd"), ["pass: in aft", "warning: odd"]),
        (part(("place", "out")), ["out", "no box has room for it"]),
        (part(("count", "two"), ("name", "odd")), ["two", "odd"]),
    ],
)
def test_the_verdict_on_a_part_is_lines(judged, lines):
    assert list(robot._verdict_lines(judged)) == lines


def test_nodes_run_commands_in_the_folder_of_roslaunch_and_end_with_the_first_that_fails(monkeypatch, tmp_path):
    ran, codes = [], {"a": 0, "b": 3, "robot": 1, "c": None}

    def run_command():
        ran.append((sys.argv[1:], Path.cwd()))
        raise SystemExit(codes[sys.argv[1]])

    monkeypatch.setattr(program, "main", run_command)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "home").mkdir()
    monkeypatch.setenv("VRX_MJ_FOLDER", str(tmp_path / "home"))
    lines = [["a", "1"], ["robot", "check"], ["c"], ["b"], ["a", "never"]]
    monkeypatch.setitem(nodes.NODES, "all", lambda words, folder: ran.append((words, folder)) or lines)
    monkeypatch.setattr(sys, "argv", ["nodes", "all", "x:=1", "__name:=all", "__log:=here"])
    with pytest.raises(SystemExit) as ended:
        nodes.main()
    assert ended.value.code == 3
    assert ran == [(["x:=1"], tmp_path / "home"), *((line, tmp_path / "home") for line in lines[:4])]


def test_a_node_that_is_wrong_ends_with_two(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VRX_MJ_FOLDER", str(tmp_path / "gone"))
    monkeypatch.setattr(sys, "argv", ["nodes", "xacro"])
    with pytest.raises(SystemExit) as ended:
        nodes.main()
    assert (ended.value.code, Path.cwd()) == (2, tmp_path)
    assert capsys.readouterr().err == "xacro needs one file, got 0: xacro FILE NAME:=VALUE\n"


def test_a_model_is_waited_for_five_minutes(monkeypatch):
    clock, asked = [0.0], []

    def call(name, kind, request):
        asked.append((name, kind, request.model_name))
        return SimpleNamespace(success=len(asked) == 4)

    def nap(seconds):
        clock[0] += seconds

    monkeypatch.setattr(nodes, "time", SimpleNamespace(monotonic=lambda: clock[0], sleep=nap))
    nodes._wait_for(SimpleNamespace(call=call), "/gazebo", "dog")
    assert asked == [("/gazebo/get_model_state", "gazebo_msgs/GetModelState", "dog")] * 4
    assert clock[0] == pytest.approx(0.6)
    with pytest.raises(VrxError, match=r"^the model 'dog' of -wait did not appear within 300 s$"):
        nodes._wait_for(SimpleNamespace(call=call), "/gazebo", "dog")
    assert 300.6 < clock[0] < 301.1


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (("decay", {"mode": "roll", "amount": 10.0, "power": None}), {"mode": "roll", "amount": math.radians(10.0)}),
        (("decay", {"mode": "heave", "amount": 0.1}), {"mode": "heave", "amount": 0.1}),
        (("decay", {"amount": 10.0}), {"amount": math.radians(10.0)}),
    ],
)
def test_amounts_of_a_decay_are_degrees_but_for_heave(given, found):
    assert checks._arguments(*given) == found


def test_an_option_of_another_trial_is_refused_with_those_it_is_for():
    with pytest.raises(CommandError) as caught:
        checks._arguments("decay", {"angle": 20.0})
    assert str(caught.value).startswith("--angle is not for decay, but for ")


@pytest.mark.filterwarnings("always::vrx_mj.VrxWarning")
def test_a_trial_prints_its_figures_and_remarks(cli, monkeypatch, folder):
    figure = SimpleNamespace(value=12345.678, unit="m", meaning="how far")
    none = SimpleNamespace(value=math.nan, unit="", meaning="not known")
    done = SimpleNamespace(figures={"advance": figure, "a": none}, remarks=["it is slow"])
    monkeypatch.setattr("vrx_mj.trials.SimulatedVessel", lambda *given: given)
    monkeypatch.setattr("vrx_mj.trials.TRIALS", {"turning": lambda _vessel, **_how: done})
    monkeypatch.setattr("vrx_mj.mjcf.compile.compile_world", lambda *_, **__: None)
    monkeypatch.setattr("vrx_mj.runtime.simulation.Simulation", lambda _world: SimpleNamespace(boats=("a",)))
    monkeypatch.setattr(checks, "_json", lambda *_: "{}")
    monkeypatch.setattr(checks, "_svg", lambda *_: "<svg/>")
    said = cli("trial", "turning", "skiff", "-o", "there")
    assert (said.code, said.err) == (0, "warning: turning: it is slow\n")
    assert said.out.splitlines() == [
        "advance  1.235e+04 m      how far",
        "a                -        not known",
        "there/turning.json, there/turning.svg",
    ]
    assert (folder / "there" / "turning.svg").read_text(encoding="utf-8") == "<svg/>"


@pytest.mark.parametrize(
    ("error", "lines"),
    [("no water", ["a failed: no water"]), ("", ["outside: a: drift is 2 m, the band is 0.5 to 1.5"])],
)
def test_faults_of_the_validation_are_lines(error, lines):
    rows = [
        SimpleNamespace(inside=False, state="outside", quantity="drift", ours=2.0, unit="m", low=0.5, high=1.5),
        SimpleNamespace(inside=True, state="inside"),
    ]
    assert checks._faults(SimpleNamespace(error=error, rows=rows, case=SimpleNamespace(name="a"))) == lines


def test_commands_with_commands_show_their_help_alone(cli):
    said, asked = cli("robot"), cli("robot", "--help")
    assert (said.code, said.out, said.err) == (0, asked.out, "")
    assert "Commands:" in said.out


@pytest.mark.parametrize(
    ("came", "code", "ended"), [([], 0, 0), ([], 130, 130), ([15], 130, 143), ([15], 0, 0), ([2], 2, 2)]
)
def test_a_command_that_a_signal_ends_has_its_code(monkeypatch, came, code, ended):
    froze = []
    monkeypatch.setattr(program, "ended_by_signals", lambda: nullcontext(came))
    monkeypatch.setattr(program, "_code", lambda _command, words: froze.append(words) or code)
    monkeypatch.setattr(program.gc, "freeze", lambda: froze.append("freeze"))
    monkeypatch.setattr(program.warnings, "showwarning", None)
    monkeypatch.setattr(sys, "argv", ["vrx-mj", "serve", "bay", "--rosbridge"])
    with pytest.raises(SystemExit) as end:
        program.main()
    assert (end.value.code, froze) == (ended, [["serve", "bay", "--rosbridge=9090"], "freeze"])


def test_programs_of_ardupilot_are_found_or_not_needed():
    none = doctor.ardupilot_row(lambda _name: None)
    assert (none.found, none.works) == ("not on PATH", "not needed")
    both = doctor.ardupilot_row(lambda name: f"/bin/{name}")
    assert (both.found, both.works) == ("/bin/ardurover, /bin/sim_vehicle.py", "yes")
    assert doctor.ardupilot_row(lambda name: "/a" if name == "ardurover" else None).found == "/a"


@pytest.mark.parametrize("node", ["pinger_visualization.py", "key2thrust_angle.py"])
def test_nodes_that_serve_does_wait_for_the_end(monkeypatch, capsys, node):
    waits = []
    monkeypatch.setattr(nodes, "await_end", lambda: waits.append("end"))
    assert nodes.NODES[node]([], Path()) == []
    said = "nothing to do: vrx-mj serve shows the beacon, and vrx-mj teleop sets thrust and angles\n"
    assert (waits, capsys.readouterr().err) == (["end"], said)


class Served:
    """A client of a served world that answers everything, and has parameters."""

    def __init__(self, _name):
        self.asked = asked
        self.parameters = {"robot_description": "<robot name='cat'/>", "requested": "a.yaml", "world_target": "out"}

    def parameter(self, name):
        return self.parameters[name]

    def wait(self, service, patience):
        asked.append((service, patience))

    def call(self, service, kind, request):
        asked.append((service, kind, getattr(request, "model_name", None)))
        return SimpleNamespace(success=True, status_message=f"{service.rpartition('/')[2]} done")


asked = []


def test_a_bound_model_is_deleted_at_the_end(monkeypatch, capsys):
    asked.clear()
    monkeypatch.setattr("vrx_mj.ros.ros1.tcpros.Client", Served)
    monkeypatch.setattr(nodes, "await_end", lambda: asked.append("end"))
    place = ["-wait", "dog", "-J", "a", "1", "-gazebo_namespace", "/sea/"]
    words = ["-urdf", "-param", "robot_description", "-model", "cat", "-b", "-unpause", *place]
    assert nodes.spawn_model(words, Path()) == []
    assert asked == [
        ("/sea/spawn_urdf_model", 300.0), ("/sea/get_model_state", "gazebo_msgs/GetModelState", "dog"),
        ("/sea/spawn_urdf_model", "gazebo_msgs/SpawnModel", "cat"),
        ("/sea/unpause_physics", "std_srvs/Empty", None), "end",
        ("/sea/delete_model", "gazebo_msgs/DeleteModel", "cat"),
    ]  # fmt: skip
    said = capsys.readouterr().err
    assert said.splitlines() == [
        "-J a 1 is ignored: joints start at 0", "spawn_urdf_model done", "delete_model done"
    ]  # fmt: skip


def test_generators_without_arguments_take_parameters(monkeypatch):
    monkeypatch.setattr("vrx_mj.ros.ros1.tcpros.Client", Served)
    assert nodes.NODES["generate_worlds.py"]([], Path("/home")) == [
        ["worlds", "generate", "/home/a.yaml", "-o", "/home/out"]
    ]
