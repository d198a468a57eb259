"""Broken and hostile files of Gazebo and ROS, with the whole message of each; none is run, nor read outside."""

import os
from contextlib import nullcontext
from pathlib import Path

import pytest
import yaml

from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, Problem, VrxError
from vrx_mj.formats.gazebo.importing import import_files
from vrx_mj.formats.gazebo.worlds import gazebo_world
from work import calls_at_most

pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
BROKEN = Path(__file__).parents[3] / "broken" / "gazebo"
CALLS = 4_000_000  # 500 unknown models take 1.1 million
"""Calls of Python's that the worst file may take."""
SCORING = (
    '<plugin filename="libwayfinding_scoring_plugin.so" name="a"><waypoints><waypoint><po'
    "se>-33.7 150.6 0</pose></waypoint></waypoints></plugin>"
)
MESSAGE = (
    '<plugin filename="libPublisherPlugin.so" name="p"><message topic="/vrx/wavefield/parameters">%s</message></plugin>'
)
LINK = (
    '<link name="link"><inertial><mass>5</mass></inertial><collision name="c"><geometry><'
    "sphere><radius>0.3</radius></sphere></geometry></collision></link>"
)
WORLD = '<sdf version="1.6"><world name="bay">%s</world></sdf>'
ERB = "<sdf><model name='dock'>\n<%%\nlayout = %s\n%%>\n</model></sdf>"


def mod(body, name="buoy"):
    """The file of a model."""
    return f'<sdf version="1.6">\n<model name="{name}">\n{body}\n</model>\n</sdf>\n'


WORLDS = {
    "pose_of_a_long_text": (
        "<include><uri>model://surmark46104</uri><pose>" + "1 " * 3000 + "</pose></include>",
        (
            "bay.world:3:41: <pose>: expected 6 numbers x y z roll pitch yaw, got '1 1 1 1 1 1 1 1 1 1 1 1 1 "
            "1 1 1 1 1 1 1… 1 1 1 1 1 1 1 1 1 1'"
        ),
    ),
    "message_too_long": (
        MESSAGE % ('params { key: "a" value {' + "x" * 100000),
        "bay.world:3:51: <message>: message too long: at most 20000 characters",
    ),
    "hole_of_a_long_name": (
        (
            '<include><uri>dock_2022</uri></include>\n<plugin filename="libscan_dock_scoring_plugi'
            'n.so"><targets><target><topic>'
        )
        + "placard1" * 100000
        + "</topic></target></targets></plugin>",
        (
            "bay.world:4:60: <target> / topic: expected the topic of a hole, as in "
            "vrx/dock_2022_placard1_big_hole/contain"
        ),
    ),
    "too_many_elements": (
        "<a/>" * 900000,
        "bay.world:3:199985: <a>: more than 50000 elements and attributes in a file",
    ),
    "too_many_models": (
        "".join(f'<model name="m{i}">{LINK}</model>' for i in range(500)) + "<gravity>0</gravity>",
        "bay.world:3:88391: <gravity>: expected 3 numbers x y z, got '0'",
    ),
    "too_many_unknown_models": (
        "".join(f"<include><uri>m{i}</uri></include>" for i in range(500)) + "<gravity>0</gravity>",
        "bay.world:3:16891: <gravity>: expected 3 numbers x y z, got '0'",
    ),
    "name_of_a_million_letters": (
        "<include><name>" + "x" * 1000000 + "</name><uri>surmark46104</uri><pose>1</pose></include>",
        "bay.world:3:1000046: <pose>: expected 6 numbers x y z roll pitch yaw, got '1'",
    ),
    "attribute_of_a_million_letters": (
        '<model name="' + "x" * 1000000 + '"><pose>1</pose><link name="l"/></model>',
        ("bay.world:3:1000016: <pose>: expected 6 numbers x y z roll pitch yaw, got '1'"),
    ),
}
XACRO = {
    "macros_that_double": (
        "\n".join(f'<xacro:macro name="a{i}"><xacro:a{i + 1}/><xacro:a{i + 1}/></xacro:macro>' for i in range(40))
        + '\n<xacro:macro name="a40"><include/></xacro:macro>\n<xacro:a0/>',
        ("bay.world.xacro: it takes more than 3 s of processor time"),
    ),
}
LAUNCHES = {
    "a_hundred_thousand_boats": (
        '<node type="spawn_model"/>\n' * 100_000,
        "bay.launch:25001:1: <node>: more than 50000 elements and attributes in a file",
    ),
    "a_million_elements": (
        "<a/>" * 900_000,
        "bay.launch:2:199997: <a>: more than 50000 elements and attributes in a file",
    ),
    "arguments_that_double": (
        '<arg name="a0" value="'
        + "x" * 100
        + '"/>'
        + "".join(f'<arg name="a{i + 1}" value="$(arg a{i})$(arg a{i})"/>' for i in range(60)),
        ("bay.launch:2:427: <arg> 'a8': '$(arg a7)$(arg a7)': text too long: at most 20000 characters"),
    ),
    "world_of_a_long_name": (
        ('<include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="world_name" value="')
        + "x" * 5000
        + '"/></include>',
        (
            "bay.launch:2:1: <include>: no file 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxx"
            "xxxxxxxxxxxxxxxxxxxx'"
        ),
    ),
}
TREES = {
    "bytes": (
        {"bay.world": bytes(range(256))},
        "bay.world",
        "bay.world:1:1: is not XML: a stray '<' or '&' (write &lt; &amp;), or no quote or '='",
    ),
    "too_large": (
        {"bay.world": b"<sdf>" + b" " * 4000000 + b"</sdf>"},
        "bay.world",
        "bay.world: is larger than 4 MB, the maximum",
    ),
    "missing_world": ({}, "bay.world", "bay.world: cannot be read: No such file or directory"),
    "missing_sdf": ({}, "bay.sdf", "bay.sdf: cannot be read: No such file or directory"),
    "missing_xacro": ({}, "bay.world.xacro", "bay.world.xacro: cannot be read: No such file or directory"),
    "missing_template": ({}, "bay.sdf.erb", "bay.sdf.erb: cannot be read: No such file or directory"),
    "missing_launch": ({}, "bay.launch", "no launch file named 'bay.launch'; did you mean 'vrx.launch'?"),
    "missing_folder": ({}, "bay", "no file or folder 'bay'"),
    "name_too_long": (
        {},
        "x" * 3000 + ".world",
        (
            "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
            "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
            "xxxxxxx…xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"
            "xxxxxx.world: cannot be read: File name too long"
        ),
    ),
    "name_of_a_launch_too_long": (
        {},
        "x" * 3000 + ".launch",
        (
            "no launch file named 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxxxxxxxxxxxxxxx."
            "launch'; known: demo_thrusterconfigs.launch, dock.launch, gymkhana.launch, marina.launch, naviga"
            "tion_task.launch, ocean_demos.launch, ocean_world.launch, ocean_world_buoys.launch, perception_t"
            "ask.launch, sandisland.launch, scan_and_dock.launch, scan_dock_deliver.launch and 6 more"
        ),
    ),
    "launch_files_that_double": (
        {
            f"a{i}.launch": "<launch>" + f'<include file="$(dirname)/a{i + 1}.launch"/>' * 2 + "</launch>"
            for i in range(18)
        }
        | {"a18.launch": "<launch/>"},
        "a0.launch",
        "a18.launch cannot be read: the files of this command take more than 100,000 notes and elements",
    ),
    "launch_files_too_deep": (
        {f"a{i}.launch": f'<launch><include file="$(dirname)/a{i + 1}.launch"/></launch>' for i in range(30)},
        "a0.launch",
        "a20.launch: launch files are included more than 20 levels deep",
    ),
    "models_too_deep": (
        {f"a{i}/model.sdf": mod(f"<include><uri>model://a{i + 1}</uri></include>", f"a{i}") for i in range(40)}
        | {"a40/model.sdf": mod(LINK), "bay.world": WORLD % "<include><uri>model://a0</uri></include>"},
        "bay.world",
        "a7/model.sdf:3:1: <include> / model: objects are nested more than 8 levels deep",
    ),
    "model_config_of_a_long_name": (
        {
            "bay.world": WORLD % "<include><uri>model://a</uri></include>",
            "a/model.config": "<model>\n<sdf version='²'>" + "x" * 5000 + "</sdf></model>",
        },
        "bay.world",
        (
            "a/model.config:2:1: <sdf>: no file 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxxxxxxxxxxxxxxxx' "
            "in this folder"
        ),
    ),
    "template_of_many_beginnings": (
        {"model.sdf.erb": "layout=[" * 400000},
        "model.sdf.erb",
        ("model.sdf.erb:1: layout: expected `layout = ['X  X', ...]`: only this list of a Ruby template is read"),
    ),
    "template_of_a_long_row": (
        {"model.sdf.erb": ERB % f"['{'X' * 30000}', true]"},
        "model.sdf.erb",
        "model.sdf.erb:3: docks[0].layout[0]: 1 rows of up to 30000 cells; at most 10000 cells",
    ),
    "template_of_many_rows": (
        {"model.sdf.erb": ERB % ("[" + "'X',\n" * 300 + "true]")},
        "model.sdf.erb",
        (
            "model.sdf.erb:3: layout: expected quoted rows, then true or false, got ''X',\\n'X',\\n'X"
            "',\\n'X',\\n'X',\\n'X',\\n'X',\\n'X',…\\n'X',\\n'X',\\n'X',\\ntrue'"
        ),
    ),
}
ARGUMENTS = {
    "argument_that_no_launch_file_declares": (
        {"a.launch": '<launch><arg name="x" default="1"/></launch>'},
        "a.launch",
        {"z": "1"},
        "a.launch: z:=: no argument named 'z'; known: x",
    ),
    "argument_of_an_include_alone": (
        {
            "a.launch": (
                '<launch><include file="$(find gazebo_ros)/launch/empty_world.launch"><arg name="paus'
                'ed" value="true"/></include></launch>'
            )
        },
        "a.launch",
        {"paused": "false"},
        "a.launch: paused:=: no argument named 'paused'; known: none",
    ),
    "argument_of_a_world": (
        {"bay.world": WORLD % ""},
        "bay.world",
        {"x": "1"},
        "bay.world: x:=: no argument named 'x'; known: none",
    ),
    "argument_that_no_xacro_declares": (
        {"bay.world.xacro": '<sdf xmlns:xacro="x"><xacro:arg name="gain" default="1"/><world/></sdf>'},
        "bay.world.xacro",
        {"gian": "1"},
        "bay.world.xacro: gian:=: no argument named 'gian'; did you mean 'gain'?",
    ),
    "argument_of_a_folder": (
        {"bay/bay.world": WORLD % ""},
        "bay",
        {"x": "1"},
        "NAME:=VALUE needs one launch file or xacro, not the folder bay",
    ),
    "argument_of_a_stock_launch": (
        {},
        "vrx.launch",
        {"thruster": "H"},
        (
            "vrx.launch: no argument of vrx.launch named 'thruster'; known: world, gui, verbose, extra_gazebo"
            "_args, namespace, x, y, z, P, R, Y, thrust_config and 12 more"
        ),
    ),
    "pose_of_a_stock_launch_file": (
        {},
        "vrx.launch",
        {"x": "1e400"},
        "vrx.launch: x:= y:= z:= R:= P:= Y:=: must lie between -1e+12 and 1e+12, got 1e400",
    ),
    "world_of_a_stock_launch_file": (
        {},
        "vrx.launch",
        {"world": "nowhere.world"},
        "nowhere.world: cannot be read: No such file or directory",
    ),
    "description_of_a_stock_launch_file": (
        {},
        "vrx.launch",
        {"urdf": "nowhere.urdf"},
        "nowhere.urdf: cannot be read: No such file or directory",
    ),
    "pipe_for_a_description": (
        {"boat.urdf": "|pipe"},
        "vrx.launch",
        {"urdf": "boat.urdf"},
        "boat.urdf: cannot be read: it is a pipe, not a file",
    ),
}
IGNORED = {
    "plugin_unknown": (
        '<plugin filename="libmagic.so" name="m"/>',
        "bay.world:3: <plugin> 'm' ignored: this plugin is not supported",
    ),
    "plugin_without_a_file": ("<plugin/>", "bay.world:3: <plugin> ignored: this plugin is not supported"),
    "model_missing": (
        "<include><uri>model://galleon</uri></include>",
        (
            "bay.world:3: <include> 'model://galleon' ignored: no model named 'galleon'; is its folder on GAZ"
            "EBO_MODEL_PATH?"
        ),
    ),
    "model_almost_known": (
        "<include><uri>model://surmark4610</uri></include>",
        (
            "bay.world:3: <include> 'model://surmark4610' ignored: no model named 'surmark4610'; did you mean"
            " 'surmark46104'?"
        ),
    ),
    "model_of_a_server": (
        "<include><uri>https://fuel.gazebosim.org/1.0/someone/models/galleon</uri></include>",
        (
            "bay.world:3: <include> 'https://fuel.gazebosim.org/1.0/someone/models/galleon' ignored: no model"
            " named 'galleon'; is its folder on GAZEBO_MODEL_PATH?"
        ),
    ),
    "element_unknown": ("<weather/>", "bay.world:3: <weather> ignored: not recognized"),
    "element_known": ('<road name="r"/>', "bay.world:3: <road> 'r' ignored: roads are not drawn"),
    "message_of_another_topic": (
        '<plugin filename="libPublisherPlugin.so"><message topic="/a"/></plugin>',
        "bay.world:3: <plugin> ignored: nothing here subscribes to what it publishes",
    ),
    "light_of_a_lamp": (
        '<light type="point" name="lamp"/>',
        "bay.world:3: <light> 'lamp' ignored: lights are not read: every world has one sun",
    ),
    "second_task": (
        (
            "<spherical_coordinates><latitude_deg>-33.7</latitude_deg><longitude_deg>150.6</longi"
            "tude_deg></spherical_coordinates>\n"
        )
        + SCORING
        + "\n"
        + SCORING,
        "bay.world:5: <plugin> 'a' ignored: only the task of the first scoring plugin is read",
    ),
    "mesh_outside": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh><uri>file:///etc/passwd.stl</uri></mesh></geometry></visual></link></model>"
        ),
        (
            "bay.world:3: <mesh> ignored: 'file:///etc/passwd.stl' is outside the folders that may be read: "
            "the current folder; add its folder with --allow FOLDER or VRX_MJ_PATH"
        ),
    ),
    "mesh_upwards": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh><uri>../../a.stl</uri></mesh></geometry></visual></link></model>"
        ),
        (
            "bay.world:3: <mesh> ignored: '../../a.stl' is outside the folders that may be read: "
            "the current folder; add its folder with --allow FOLDER or VRX_MJ_PATH"
        ),
    ),
    "mesh_missing": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh><uri>a.stl</uri></mesh></geometry></visual></link></model>"
        ),
        "bay.world:3: <mesh> ignored: no file 'a.stl'; looked in the current folder",
    ),
    "mesh_of_a_long_name": (
        ('<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><mesh><uri>')
        + "x" * 5000
        + ".stl</uri></mesh></geometry></visual></link></model>",
        (
            "bay.world:3: <mesh> ignored: no file 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx…xxxxxxxxxxxxxxxx.stl'; "
            "looked in the current folder"
        ),
    ),
    "mesh_without_uri": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><m'
            "esh/></geometry></visual></link></model>"
        ),
        "bay.world:3: <visual> 'v' ignored: the mesh has no <uri>",
    ),
    "shape_unknown": (
        (
            '<model name="wall"><static>true</static><link name="l"><visual name="v"><geometry><h'
            "eightmap/></geometry></visual></link></model>"
        ),
        "bay.world:3: <heightmap> ignored: this shape is not supported",
    ),
    "second_world": (
        '</world><world name="other">',
        "bay.world:3: <world> 'other' ignored: only the first world of a file is read",
    ),
}


def world(body):
    """The file of a world; its content begins on line 3."""
    return f'<sdf version="1.6">\n<world name="bay">\n{body}\n</world>\n</sdf>\n'


def xacro(body):
    """The same as a xacro."""
    return world(body).replace("<sdf ", '<sdf xmlns:xacro="http://ros.org/wiki/xacro" ')


def listed(name):
    """The cases in a file."""
    return yaml.safe_load((BROKEN / f"{name}.yaml").read_text(encoding="utf-8"))


HOSTILE = {*WORLDS, *XACRO, *LAUNCHES, *listed("hostile")}
"""Cases of which the work is counted."""
WORLDS |= {key: (case["body"], case["says"]) for key, case in listed("worlds").items()}
XACRO |= {key: (case["body"], case["says"]) for key, case in listed("xacro").items()}
LAUNCHES |= {key: (case["body"], case["says"]) for key, case in listed("launch").items()}
for name in ("folders", "hostile"):
    TREES |= {key: (case["files"], case["given"], case["says"]) for key, case in listed(name).items()}
CASES = {
    **{key: ({"bay.world": world(body)}, "bay.world", None, said) for key, (body, said) in WORLDS.items()},
    **{key: ({"bay.world.xacro": xacro(body)}, "bay.world.xacro", None, said) for key, (body, said) in XACRO.items()},
    **{key: ({"bay.launch": f"<launch>\n{body}\n</launch>\n"}, "bay.launch", None, said)
       for key, (body, said) in LAUNCHES.items()},
    **{key: (files, target, None, said) for key, (files, target, said) in TREES.items()},
    **ARGUMENTS,
}  # fmt: skip


@pytest.fixture
def home(tmp_path, monkeypatch):
    """The current folder, three below one with a model that nothing may read."""
    outside = tmp_path / "outside"
    outside.mkdir()
    secret = '<sdf version="1.6"><model name="a"><static>true</static><link name="l"/></model></sdf>'
    (outside / "model.sdf").write_text(secret, encoding="utf-8")
    folder = tmp_path / "ws" / "src" / "home"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    return folder


def written(files, home):
    """Write files: text, bytes, a pipe, or a link."""
    for name, content in files.items():
        path = home / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, bytes):
            path.write_bytes(content)
        elif content == "|pipe":
            os.mkfifo(path)
        elif content.startswith("->"):
            path.symlink_to(content[2:].replace("/outside", str(home.parents[2] / "outside")))
        else:
            path.write_text(content, encoding="utf-8")


SLOW = {
    "macros_that_double", "power_tower", "eval_power", "eval_sum", "eval_that_never_ends", "eval_comprehension_bomb",
    "eval_dict_bomb", "launch_files_that_double", "too_many_models", "too_many_unknown_models",
}  # fmt: skip
"""Cases that a limit stops, most of them that of processor time."""


@pytest.mark.parametrize("case", [pytest.param(case, marks=[pytest.mark.slow] * (case in SLOW)) for case in CASES])
def test_a_broken_file_says_what_and_where(case, home, strict):
    files, target, arguments, said = CASES[case]
    written(files, home)
    with calls_at_most(CALLS) if case in HOSTILE else nullcontext(), pytest.raises(VrxError) as caught:
        import_files(Path(target), arguments)
    assert str(caught.value).replace(str(home.parents[2]), "@DIR") == said
    assert not Path("owned").exists()


LARGE = {"too_many_models", "too_many_unknown_models"}
"""Cases about how the work of a reading grows, which is one whoever asks for it."""


@pytest.mark.parametrize("case", [case for case in WORLDS if case not in LARGE][::8])
def test_a_world_that_is_loaded_says_the_same(case, home, strict):
    body, said = WORLDS[case]
    Path("bay.world").write_text(world(body), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_world("bay.world")
    assert str(caught.value) == said


NO_WORLD = {"tag_never_closed", "attribute_twice", "nested_too_deep", "too_many_elements"}
"""Cases that are no XML."""


@pytest.mark.parametrize("case", [case for case in WORLDS if case not in NO_WORLD | LARGE][::3])
def test_a_part_that_cannot_be_read_is_told_and_the_rest_is_kept(case, home):
    body, said = WORLDS[case]
    name = "" if "no frame named" in said else "<name>kept</name>"  # where all names are said
    kept = f"<include><uri>model://surmark46104</uri>{name}<pose>9 9 0 0 0 0</pose></include>"
    Path("bay.world").write_text(world(f"{body}\n{kept}"), encoding="utf-8")
    found = gazebo_world(Path("bay.world"))
    problems = [Problem(*place(note), note.what, note.ours) for note in found.notes if note.fate == "not read"]
    assert "\n".join(map(str, problems)) == said
    assert [9, 9, 0, 0, 0, 0] in [list(one["pose"]) for one in found.section["objects"]]
    load_world("bay.world")


def place(note):
    """File, line and column of a note."""
    return note.place.file.name, note.place.line, note.place.column


@pytest.mark.parametrize("case", IGNORED)
def test_what_is_ignored_is_noted(case, home):
    body, said = IGNORED[case]
    Path("bay.world").write_text(world(body), encoding="utf-8")
    notes = dict.fromkeys(note for note in import_files(Path("bay.world")).notes if note.fate != "imported")
    lines = [f"{note.place.file.name}:{note.place.line}: {note.what} {note.fate}: {note.ours}" for note in notes]
    assert lines == [said]


def test_there_are_enough_broken_files():
    assert len(CASES) >= 200


def test_no_message_speaks_of_python():
    text = "\n".join(said for *_, said in CASES.values())
    for word in ("Traceback", "expat", "object has no attribute", "<class", "NoneType", "Errno"):
        assert word not in text
