"""What a user reads who typed something wrong: the whole message, and exit code 2."""

import pytest

from vrx_mj.config.search import catalogue

WORLDS = (
    "known: base/vrx2023, buoyancy_plugin_demo, example_course, gymkhana, marina, my_course, no_gravity, ocean, "
    f"ocean_buoys, ocean_docks, ocean_wamv, perception_task and {len(catalogue('worlds')) - 12} more"
)
FORM = "is no name=number, as in left=0.5,right=0.5"

MESSAGES = {
    "run oceon": "no world named 'oceon'; did you mean 'ocean'?",
    "run qqqq": f"no world named 'qqqq'; {WORLDS}",
    "run none.yaml": "none.yaml: no such file",
    "run ocean --fleet trioo": "no fleet named 'trioo'; did you mean 'trio'?",
    "run ocean --fleet none.yaml": "none.yaml: no such file",
    "run ocean --duration 0": "a duration of 0 s: at least one timestep, 0.01 s, is needed",
    "run ocean --duration -1": "a duration of -1 s: at least one timestep, 0.01 s, is needed",
    "run ocean --duration nan": "a duration of nan s: at least one timestep, 0.01 s, is needed",
    "run ocean --duration 0.123": (
        "a duration of 0.123 s is no multiple of the timestep 0.01 s; near it are 0.12 and 0.13 s"
    ),
    "run ocean --thrust foo": f"--thrust 'foo': 'foo' {FORM}",
    "run ocean --thrust left=1,right": f"--thrust 'left=1,right': 'right' {FORM}",
    "run ocean --thrust left=1,": f"--thrust 'left=1,': '' {FORM}",
    "run ocean --thrust =1": f"--thrust '=1': '=1' {FORM}",
    "run ocean --thrust left=1,left=2": "--thrust 'left=1,left=2': 'left' is there twice",
    "run ocean --thrust left=fast": f"--thrust 'left=fast': 'left=fast' {FORM}",
    "run ocean --thrust left=nan": "the command left of wamv is nan: a finite number is needed",
    "run ocean --thrust lef=1": "no thruster of wamv named 'lef'; did you mean 'left'?",
    "run ocean --thrust left=1 --control a:b": "--control and --thrust both command the boats: give one of them",
    "run ocean --control nope": "'nope' names no controller: write module:function, as in my_boat:controller",
    "run ocean --control nope:f": "no module named 'nope' for the controller 'nope:f'",
    "run ocean --control json:nope": "the module 'json' has nothing named 'nope'",
    "run ocean --duration 1 --record no/run.rrd": "cannot write the recording 'no/run.rrd': No such file or directory",
    "run ocean --summary no/s.json": "cannot write the summary 'no/s.json': No such file or directory",
    "replay no.rrd": "no recording 'no.rrd'",
    "replay no.rrd --video run.mp4": "no recording 'no.rrd'",
    "run ocean --follow wamv": "--follow wamv says whom the recording's camera follows: give --record FILE.rrd too",
    "run ocean --duration 1 --record run.rrd --follow x": "no boat named 'x'; known: wamv",
    "compare no.rrd no.rrd": "no recording 'no.rrd'",
    "list nothing": "no kind of file named 'nothing'; known: worlds, fleets, docks, objects, robots, tasks",
    "list world": "no kind of file named 'world'; did you mean 'worlds'?",
    "new worl bay": "no start file named 'worl'; did you mean 'world'?",
    "new world no/bay": "cannot write the start file 'no/bay.yaml': No such file or directory",
    "map ocean -o map.xyz": "a map cannot be written as 'map.xyz'; its name ends in .png, .pdf, .svg",
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
    assert said.err.replace("\\", "/").startswith(f"cannot write the {what} '{words.split()[-1]}': ")
    assert (said.code, said.err.count("\n")) == (2, 1)


def test_an_empty_name_is_refused(cli, folder):
    assert cli("new", "world", "").err.strip() == "the new world needs a name, as in vrx-mj new world my_world"
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    "words", ["sail ocean", "run", "run ocean --duration soon", "compile ocean", "new world", "list --x"]
)
def test_words_that_no_command_takes_are_explained_with_exit_code_2(cli, words):
    said = cli(*words.split())
    assert said.code == 2
    assert "Usage: vrx-mj" in said.err
    assert "Error" in said.err


def test_broken_yaml_names_the_file_the_line_and_the_key(cli, folder):
    (folder / "海.yaml").write_text("description: x\nsea: {gian: 1.0}\n", encoding="utf-8")
    said = cli("run", "海.yaml")
    assert said.err.strip() == "海.yaml:2:7: sea.gian: unknown key 'gian'; did you mean 'gain'?"
    assert said.code == 2
