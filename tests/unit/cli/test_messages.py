"""What a user reads who typed something wrong: the whole message, and exit code 2."""

import pytest

from vrx_mj.cli.program import COMMANDS
from vrx_mj.config.search import catalogue
from vrx_mj.formats.gazebo.document import STRICT

WORLDS = (
    "known: base/vrx2023, buoyancy_plugin_demo, example_course, gymkhana, marina, my_course, no_gravity, ocean, "
    f"ocean_buoys, ocean_docks, ocean_wamv, perception_task and {len(catalogue('worlds')) - 12} more; "
    "vrx-mj list worlds shows all"
)
FORM = "is not name=number, as in left=0.5,right=0.5"

MESSAGES = {
    "runn ocean": "no command named 'runn'; did you mean 'run'?",
    "sail ocean": (
        f"no command named 'sail'; known: {', '.join([*COMMANDS][:12])} and {len(COMMANDS) - 12} more; "
        "vrx-mj --help explains them"
    ),
    "robot chek": "no command of vrx-mj robot named 'chek'; did you mean 'check'?",
    "--verison": "no option of vrx-mj named '--verison'; did you mean '--version'?",
    "run": (
        "vrx-mj run needs WORLD; for example: "
        "vrx-mj run example_course --fleet trio --duration 60 --seed 7 --record run.rrd"
    ),
    "compile ocean": (
        "vrx-mj compile needs --output; for example: vrx-mj compile example_course --fleet trio -o course/scene.xml"
    ),
    "new world": "vrx-mj new needs NAME; for example: vrx-mj new world my_bay",
    "new world a b": "vrx-mj new: got unexpected extra argument(s) (b); vrx-mj new --help shows what it takes",
    "list --x": "no option of vrx-mj list named '--x'; known: --help, --verbose",
    "run ocean --duration": (
        "vrx-mj run: option '--duration' requires an argument; vrx-mj run --help shows what it takes"
    ),
    "run ocean --duration soon": "invalid --duration 'soon': a number is needed",
    "run ocean --seed 1.5": "invalid --seed '1.5': a whole number is needed",
    "run ocean --durashun 3": "no option of vrx-mj run named '--durashun'; did you mean '--duration'?",
    "campaign a:b --worlds ocean -o x --jobs 0": "invalid --jobs '0': at least 1 is needed",
    "serve ocean --cmd-vel speed": "no value of --cmd-vel named 'speed'; known: thrust, velocity, off",
    "run oceon": "no world named 'oceon'; did you mean 'ocean'?",
    "run qqqq": f"no world named 'qqqq'; {WORLDS}",
    "run none.yaml": "none.yaml: no such file",
    "run ocean --fleet trioo": "no fleet named 'trioo'; did you mean 'trio'?",
    "run ocean --fleet none.yaml": "none.yaml: no such file",
    "run ocean --duration 0": "invalid duration 0 s: at least one timestep, 0.01 s, is needed",
    "run ocean --duration -1": "invalid duration -1 s: at least one timestep, 0.01 s, is needed",
    "run ocean --duration nan": "invalid duration nan s: at least one timestep, 0.01 s, is needed",
    "run ocean --duration 0.123": (
        "invalid duration 0.123 s: a multiple of the timestep 0.01 s is needed, such as 0.12 or 0.13 s"
    ),
    "run ocean --thrust foo": f"invalid --thrust 'foo': 'foo' {FORM}",
    "run ocean --thrust left=1,right": f"invalid --thrust 'left=1,right': 'right' {FORM}",
    "run ocean --thrust left=1,": f"invalid --thrust 'left=1,': '' {FORM}",
    "run ocean --thrust =1": f"invalid --thrust '=1': '=1' {FORM}",
    "run ocean --thrust left=1,left=2": "invalid --thrust 'left=1,left=2': 'left' occurs twice",
    "run ocean --thrust left=fast": f"invalid --thrust 'left=fast': 'left=fast' {FORM}",
    "run ocean --thrust left=nan": "invalid command nan for left of wamv: a finite number is needed",
    "run ocean --thrust lef=1": "no thruster of wamv named 'lef'; did you mean 'left'?",
    "run ocean --thrust left=1 --control a:b": "--control and --thrust both command the boats: give one of them",
    "run ocean --control nope": "invalid controller 'nope': module:function is needed, as in my_boat:controller",
    "run ocean --control nope:f": "no module named 'nope' for the controller 'nope:f'",
    "run ocean --control json:nope": (
        "no controller in the module json named 'nope'; known: JSONDecodeError, JSONDecoder, JSONEncoder, "
        "detect_encoding, dump, dumps, load, loads"
    ),
    "run ocean --duration 1 --record no/run.rrd": "cannot write the recording 'no/run.rrd': No such file or directory",
    "run ocean --summary .": "cannot write the summary '.': Is a directory",
    "run ocean --record .": "cannot write the recording '.': Is a directory",
    "run ocean --record run.bag": (
        "invalid --record 'run.bag': a name that ends in .rrd is needed; --bag FILE writes a bag"
    ),
    "run ocean --record run.mp4": "invalid --record 'run.mp4': a name that ends in .rrd is needed",
    "run ocean --package-path nowhere": "invalid --package-path 'nowhere': not a folder",
    "robot check": "nothing to check: give --components FILE, --thrusters FILE or both",
    "robot parts camera": "no type of part named 'camera'; did you mean 'wamv_camera'?",
    "ros message": "no command of vrx-mj ros named 'message'; did you mean 'messages'?",
    "worlds generate none.yaml -o out": "none.yaml: no such file",
    "doctor --fleet trio": "--fleet trio needs a world: vrx-mj doctor WORLD --fleet trio",
    "serve ocean --rosbridge --allow-origin app.foxglove.dev": (
        "invalid --allow-origin 'app.foxglove.dev': SCHEME://HOST or SCHEME://HOST:PORT is needed, as in "
        "https://app.foxglove.dev; or null, file://, or * for all"
    ),
    "serve ocean --rate fast": ("invalid --rate 'fast': a number above 0 is needed, 1 for real time, or max"),
    "teleop --url foo": "invalid --url 'foo': ws://HOST:PORT is needed, as in ws://127.0.0.1:9090",
    "run ocean --fleet zzz": "no fleet named 'zzz'; known: none, single, trio, usv_config",
    "run ocean --summary no/s.json": "cannot write the summary 'no/s.json': No such file or directory",
    "replay no.rrd": "no recording 'no.rrd'",
    "replay no.rrd --video run.mp4": "no recording 'no.rrd'",
    "replay no.rrd --video a.mp4 --coco data": "--video and --coco cannot be combined: give one of them",
    "run ocean --follow wamv": "--follow wamv needs --record FILE.rrd",
    "run ocean --duration 1 --record run.rrd --follow x": "no boat named 'x'; known: wamv",
    "compare no.rrd no.rrd": "no recording 'no.rrd'",
    "list nothing": "no kind of file named 'nothing'; known: worlds, fleets, docks, objects, robots, tasks",
    "list world": "no kind of file named 'world'; did you mean 'worlds'?",
    "new worl bay": "no start file named 'worl'; did you mean 'world'?",
    "new world no/bay": "cannot write the start file 'no/bay.yaml': No such file or directory",
    "map ocean -o map.xyz": "invalid file name 'map.xyz' for a map: it must end in .png, .pdf, .svg",
}


@pytest.mark.parametrize("words", MESSAGES)
def test_wrong_input_is_one_message_and_exit_code_2(cli, words):
    said = cli(*words.split())
    assert said.err.replace("\\", "/").strip() == MESSAGES[words]
    assert (said.code, said.out) == (2, "")


@pytest.mark.filterwarnings("always::vrx_mj.errors.VrxWarning")
def test_a_warning_is_told_once(cli, folder):
    (folder / "low.yaml").write_text("lidar:\n  - {name: low, z: 1.3}\n", encoding="utf-8")
    boats = "boats: [{name: a, pose: [0, 0, 0, 0, 0, 0], components: low.yaml}]\n"
    (folder / "one.yaml").write_text(boats, encoding="utf-8")
    said = cli("run", "ocean", "--fleet", "one.yaml", "--duration", 0.1)
    assert said.err.count("low.yaml:2:20: lidar[0].z: at 1.3 m its post is -0.0465 m long") == 1


@pytest.mark.parametrize(
    ("words", "what"), [("map ocean -o file/map.png", "map"), ("compile ocean -o file/x", "world")]
)
def test_a_place_below_a_file_cannot_be_written(cli, folder, words, what):
    (folder / "file").write_bytes(b"")
    said = cli(*words.split())
    assert said.err.replace("\\", "/").startswith(f"cannot write the {what} '{words.split()[-1]}")
    assert (said.code, said.err.count("\n")) == (2, 1)


def test_an_empty_name_is_refused(cli, folder):
    assert cli("new", "world", "").err.strip() == "the new world needs a name, as in vrx-mj new world my_world"
    assert list(folder.iterdir()) == []


def test_broken_yaml_names_the_file_the_line_and_the_key(cli, folder):
    (folder / "海.yaml").write_text("description: x\nsea: {gian: 1.0}\n", encoding="utf-8")
    said = cli("run", "海.yaml")
    assert said.err.strip() == "海.yaml:2:7: sea.gian: unknown key 'gian'; did you mean 'gain'?"
    assert said.code == 2


LOST = """<launch>
  <include file="$(find vrx_gazebo)/launch/vrx.launch"/>
  <include file="$(find driver)/launch/sensor.launch"/>
</launch>
"""


@pytest.mark.parametrize("words", ["run team.launch --duration 0.1", "compile team.launch -o out"])
def test_strict_makes_warnings_an_error(cli, folder, monkeypatch, words):
    monkeypatch.setenv("VRX_MJ_MISSING", "")
    (folder / "team.launch").write_text(LOST, encoding="utf-8")
    assert "or --missing ignore)" in cli(*words.split()).err
    said = cli(*words.split(), "--missing", "ignore", "--strict")
    assert said.err.splitlines() == [
        "team.launch: 1 of 2 parts differ from Gazebo (`vrx-mj import` lists all)",
        "  team.launch:3: <include> sensor.launch not read: no package named 'driver'",
    ]
    assert (said.code, said.out, STRICT.get()) == (2, "", False)


def test_strict_makes_parts_that_are_not_read_an_error_of_an_import(cli, folder, monkeypatch):
    monkeypatch.setenv("VRX_MJ_MISSING", "ignore")
    (folder / "team.launch").write_text(LOST, encoding="utf-8")
    assert cli("import", "team.launch", "-o", "out").code == 0
    said = cli("import", "team.launch", "-o", "out", "--strict")
    assert (said.code, said.err.strip()) == (2, "--strict: some parts are not read")
    assert "| not read | no package named 'driver' |" in (folder / "out/import.md").read_text(encoding="utf-8")
