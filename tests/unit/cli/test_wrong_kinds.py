"""Files of every kind that people have, given to every command that reads a file."""

import re
import zipfile

import pytest

XACRO = 'xmlns:xacro="http://ros.org/wiki/xacro"'
AXES = "waves: {steps: 2, macros: {usv_wind_gazebo: [{mean_vel: 'n'}]}}\n"
FILES = {
    "bay.world": '<sdf version="1.6"><world name="bay"/></sdf>',
    "bay.sdf": '<sdf version="1.9"><world name="bay"/></sdf>',
    "bay.world.xacro": f'<sdf version="1.6" {XACRO}><world name="bay"/></sdf>',
    "start.launch": '<launch><node name="a" pkg="b" type="c"/></launch>',
    "start.launch.py": "import launch\n",
    "boat.urdf": '<robot name="boat"><link name="base_link"/></robot>',
    "boat.urdf.xacro": f'<robot name="boat" {XACRO}><link name="base_link"/></robot>',
    "model.sdf": '<sdf version="1.6"><model name="m"><link name="l"/></model></sdf>',
    "model.config": "<model><name>m</name></model>",
    "model.sdf.erb": "<% a = 1 %>",
    "world.yaml": "sea: {model: none}\n",
    "fleet.yaml": "usv_count: 1\npositions: [{x: -532, y: 162}]\n",
    "robot.yaml": "urdf: boat.urdf\nhydrodynamics: {}\n",
    "object.yaml": "mass: 3\nbuoyancy: 1\n",
    "thrusters.yaml": "engine:\n- {prefix: left}\n",
    "components.yaml": "wamv_gps:\n- {name: gps}\n",
    "axes.yaml": AXES,
    "case.yaml": "source: a tank\nworld: ocean\nsignals: {x: {tolerance: 1}}\n",
    "dock.txt": "X X\nXXX\n",
    "notes.txt": "two boats\n",
    "cut.rrd": "no record",
    "run.bag": "#ROSBAG V2.0\n",
    "run.db3": "SQLite format 3\0",
    "run.mcap": "\x89MCAP0\r\n",
    "scene.xml": "<mujoco/>",
    "scene.mjcf": "<mujoco/>",
    "hull.obj": "v 0 0 0\n",
    "hull.stl": "solid\nendsolid\n",
    "hull.dae": "<COLLADA/>",
    "log.csv": "t,x\n0,1\n",
    "empty.yaml": "",
    "list.yaml": "- a\n",
    "binary.yaml": "\0\1\2",
    "noise.bin": "\0\1\2",
    "empty": "",
}
"""Name and content, in Latin-1."""
OTHERS = ["boats.zip", "nothing", "meshes"]
"""An archive, an empty folder, and one of meshes."""
COMMANDS = {
    "WORLD": ("compile FILE -o out", {"bay.world", "bay.sdf", "bay.world.xacro", "world.yaml"}),
    "--fleet": ("compile example_course --fleet FILE -o out", {"fleet.yaml"}),
    "run": ("run FILE --duration 0.1", {"bay.world", "bay.sdf", "bay.world.xacro", "world.yaml"}),
    "trial": ("trial turning FILE -o out", set()),
    "build": ("robot build --components FILE -o boat2.urdf", {"components.yaml", "empty.yaml", "empty"}),
    "map": ("map FILE -o map.png", {"bay.world", "bay.sdf", "bay.world.xacro", "world.yaml"}),
    "import": (
        "import FILE -o out",
        {"bay.world", "bay.sdf", "bay.world.xacro", "start.launch", "model.sdf", "boat.urdf", "boat.urdf.xacro"},
    ),
    "replay": ("replay FILE", set()),
    "score": ("score FILE", set()),
    "compare": ("compare FILE cut.rrd", set()),
    "convert": ("convert FILE out.bag", set()),
    "axes": ("worlds generate FILE -o out", {"axes.yaml"}),
    "thrusters": ("robot check --thrusters FILE", {"empty.yaml", "empty"}),
    "components": ("robot check --components FILE", {"components.yaml", "empty.yaml", "empty"}),
    "case": ("validate --case FILE --data log.csv", set()),
    "hull": ("robot hydro FILE --mass 180 --center 0,0,0.15", set()),
}
"""A command line, and the files that it takes."""
MODELS = {"--fleet": {"model.sdf"}, "trial": {"model.sdf"}}
"""Models that are read as boats, with the messages of boats."""
QUOTED = re.compile(r"RRF2|FourCC|RRD|Errno|Traceback|Exception|UnicodeDecode|trimesh|pydantic")
"""Words of libraries, which no message has."""
SAILED = "vrx-mj run bay.world sails it, vrx-mj import bay.world -o FOLDER converts it to YAML"
SERIES = "axes.yaml: axes of a series of worlds; pass one of them as WORLD by its number: axes.yaml#0"
WHOLE = [
    ("replay", "bay.world", f"'bay.world' is a Gazebo world (SDF), not a recording: {SAILED}"),
    ("compare", "hull.stl", "'hull.stl' is a mesh, not a recording: name it in a robot or an object"),
    (
        "score",
        "world.yaml",
        "'world.yaml' is not a recording of vrx_mj: it does not begin as rerun's files do",
    ),
    ("replay", "cut.rrd", "'cut.rrd' is not a recording of vrx_mj: it does not begin as rerun's files do"),
    ("replay", "nothing", "'nothing' is a folder, not a recording: name a file in it"),
    ("score", "meshes", "'meshes' is a folder, not a recording: name a file in it"),
    (
        "case",
        "fleet.yaml",
        "fleet.yaml: it has the key 'positions', of a fleet; pass it with --fleet",
    ),
    ("case", "axes.yaml", SERIES),
    (
        "WORLD",
        "case.yaml",
        "case.yaml: it has the key 'signals', of a case; pass it to vrx-mj validate with --case",
    ),
    (
        "score",
        "boats.zip",
        "'boats.zip' is an archive, not a recording: unpack it, and pass the folder to vrx-mj run",
    ),
    ("--fleet", "axes.yaml", SERIES),
    ("components", "axes.yaml", SERIES),
    (
        "--fleet",
        "bay.world",
        "bay.world:1:1: <sdf>: this is a world without a <model>: pass it as WORLD",
    ),
    (
        "WORLD",
        "notes.txt",
        (
            "'notes.txt' is a file that does not end in .yaml, not a world: a world is a YAML file; vrx-mj "
            "import converts Gazebo's, and VRX's come with vrx_mj (vrx-mj list worlds)"
        ),
    ),
    ("axes", "bay.world", f"'bay.world' is a Gazebo world (SDF), not an axes file: {SAILED}"),
    ("case", "bay.world", f"bay.world: a Gazebo world (SDF), not a case: {SAILED}"),
    (
        "import",
        "scene.xml",
        (
            "'scene.xml' is MuJoCo's MJCF, not a file to import, which ends in .world, .world.xacro, .launch, .sdf, "
            ".sdf.erb, .urdf, .urdf.xacro; or a folder: python -m mujoco.viewer --mjcf=scene.xml shows it"
        ),
    ),
]


@pytest.fixture
def tried(cli, folder):
    """Calls a command with a file of each kind."""
    for name, text in FILES.items():
        (folder / name).write_bytes(text.encode("latin-1"))
    with zipfile.ZipFile(folder / "boats.zip", "w") as archive:
        archive.writestr("fleet.yaml", "")
    (folder / "nothing").mkdir()
    (folder / "meshes").mkdir()
    (folder / "meshes" / "hull.obj").write_text("v 0 0 0\n", encoding="utf-8")
    return lambda line, name: cli(*(name if word == "FILE" else word for word in line.split()))


@pytest.mark.filterwarnings("ignore:.*this world has no boats")
@pytest.mark.parametrize("command", COMMANDS)
def test_wrong_kind_of_file_is_an_error_of_one_file_in_plain_words(tried, command):
    line, taken = COMMANDS[command]
    for name in sorted({*FILES, *OTHERS} - MODELS.get(command, set())):
        ended = tried(line, name)
        if name in taken:
            assert ended.code == 0, (name, ended.err)
            continue
        assert ended.code == 2, (name, ended)
        assert name.removesuffix(".yaml") in ended.err, (name, ended.err)
        assert not QUOTED.search(ended.err), (name, ended.err)


@pytest.mark.parametrize(("command", "name", "message"), WHOLE)
def test_message_about_a_wrong_kind_of_file(tried, command, name, message):
    assert tried(COMMANDS[command][0], name).err.strip().splitlines()[-1] == message
