"""Worlds of Gazebo: each plugin and macro of VRX, and what is noted of their parts."""

import csv
import math
import warnings
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

import vrx_mj
from macro_blocks import BLOCKS
from vrx_mj.config.fleet import load_fleet
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, VrxError, VrxWarning
from vrx_mj.foreign import asking, budget
from vrx_mj.formats.gazebo.worlds import gazebo_world
from vrx_mj.formats.series.worlds import macros

NAMED = {name for name in macros() if "name" in macros()[name].defaults}
BASES = {name for name in macros() if macros()[name].part == "base"}


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch, strict):
    monkeypatch.chdir(tmp_path)


def said(body, version="1.6", file="bay.world"):
    """What the world of a text is in our keys, with its notes."""
    spaces = ' xmlns:xacro="http://ros.org/wiki/xacro"' if "xacro" in file else ""
    text = f'<sdf version="{version}"{spaces}>\n<world name="bay">\n{body}\n</world>\n</sdf>\n'
    Path(file).write_text(text, encoding="utf-8")
    return gazebo_world(Path(file))


def losses(world):
    """Notes of what is not as in Gazebo."""
    return [f"{note.what} {note.fate}: {note.ours}" for note in world.notes if note.fate != "imported"]


@pytest.mark.parametrize("name", macros())
def test_each_macro_of_vrx_makes_its_part(name):
    macro = macros()[name]
    base = "" if name in BASES else "<xacro:sydneyregatta_minus_scene/>"
    blocks = "".join(f"<{key}>{BLOCKS[key]}</{key}>" for key in macro.blocks)
    given = ' name="course"' if name in NAMED else ""
    world = said(f"{base}<xacro:{name}{given}>{blocks}</xacro:{name}>", file="bay.world.xacro")
    assert losses(world) == []
    key = "extends" if macro.part == "base" else macro.part
    assert key in world.section
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        load_world("bay.world.xacro")


def test_values_of_macros_may_be_expressions_and_macros_of_ones_own():
    body = (
        '<xacro:property name="x" value="5"/><xacro:macro name="buoy" params="n">'
        '<xacro:insert_model uri="surmark46104" x="${x * n}"/></xacro:macro>'
        '<xacro:include filename="$(find vrx_gazebo)/worlds/xacros/include_all_xacros.xacro"/>'
        '<xacro:include_all_xacros/><xacro:buoy n="2"/><xacro:buoy n="3"/>'
    )
    objects = said(body, file="bay.world.xacro").section["objects"]
    assert [(one["name"], one["pose"][0]) for one in objects] == [("surmark46104", 10), ("surmark46104_1", 15)]


WAVES = "<wave><model>CWR</model><number>5</number><gain>0.3</gain><period>6</period><direction>0 1</direction></wave>"
WIND = (
    f'<plugin filename="libusv_gazebo_wind_plugin.so">{BLOCKS["wind_objs"]}<wind_direction>90</wind_direction>'
    "<wind_mean_velocity>5</wind_mean_velocity><var_wind_gain_constants>2</var_wind_gain_constants>"
    "<var_wind_time_constants>3</var_wind_time_constants><random_seed>7</random_seed></plugin>"
)
SCENE = (
    "<scene><ambient>0.1 0.2 0.3</ambient><grid>0</grid><sky><time>10</time></sky>"
    "<fog><type>linear</type><start>1</start><end>50</end></fog></scene>"
)
BAY = "<bay><name>bay1</name><symbol>red_circle</symbol><dock_allowed>True</dock_allowed></bay>"
PLUGINS = {
    "sea": (
        f'<model name="w"><plugin filename="libWavefieldModelPlugin.so">{WAVES}</plugin></model>',
        {"model": "cwr", "number": 5, "period": 6.0, "direction": (0.0, 1.0)},
    ),
    "wind": (
        WIND,
        {"direction": 90.0, "mean_velocity": 5.0, "var_gain": 2.0, "var_time": 3.0, "seed": 7,
         "objects": ({"model": "wamv", "coefficients": (0.5, 0.5, 0.33)},)},
    ),
    "scene": (
        SCENE,
        {"sky": {"time": 10.0}, "ambient": (0.1, 0.2, 0.3), "grid": False,
         "fog": {"type": "linear", "start": 1.0, "end": 50.0}},
    ),
    "camera": ('<gui><camera name="c"><pose>1 2 3 0 0 1</pose></camera></gui>', (1, 2, 3, 0, 0, 1)),
    "georeference": (
        "<spherical_coordinates><latitude_deg>44</latitude_deg><longitude_deg>9</longitude_deg></spherical_coordinates>",
        {"latitude": 44.0, "longitude": 9.0, "elevation": 0.0, "heading": 0.0},
    ),
    "physics": ("<gravity>0 0 -1.6</gravity>", {"profile": "vrx", "gravity": 1.6}),
}  # fmt: skip


def call(name, /, **given):
    """A world with one macro: what it is in our keys, and what is not as in Gazebo."""
    macro = macros()[name]
    blocks = "".join(f"<{key}>{BLOCKS[key]}</{key}>" for key in macro.blocks)
    attributes = ({"name": "course"} if name in NAMED else {}) | given
    words = "".join(f' {key}="{value}"' for key, value in attributes.items())
    base = "" if name in BASES else "<xacro:sydneyregatta/>"
    world = said(f"{base}<xacro:{name}{words}>{blocks}</xacro:{name}>", file="bay.world.xacro")
    return world.section, losses(world)


VALUES = ("3", "true", "false", "turtle", "dock_2016", "-33.72")
"""Values that parameters of macros may have: for each of them, one at least is another than its default."""


LONGEST = {"scan_dock_deliver", "dock", "gymkhana"}
"""Macros of the most parameters."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONGEST)) for name in macros()]
)
def test_each_parameter_of_a_macro_changes_the_world_or_is_noted(name):
    alike = {False: call(name)}
    for key, default in macros()[name].defaults.items():
        lit = key.startswith(("lb_", "color_"))
        usual = {"light_buoy_present": "true"} if lit else {}
        if lit not in alike:
            alike[lit] = call(name, **usual)

        def changes(value, key=key, usual=usual, before=alike[lit]):
            try:
                return call(name, **usual | {key: value}) != before
            except ConfigError:
                return False  # a value of another kind

        switch = str(default).lower() in {"true", "false"}
        assert any(map(changes, sorted(VALUES, key=lambda value: switch != (value in {"true", "false"})))), key


SPEED, TO = "/vrx/debug/wind/speed", "/vrx/debug/wind/direction"


@pytest.mark.parametrize(
    ("name", "key", "ours", "note"),
    [
        ("wayfinding", "competition", "vrx", "<task_info_topic> ignored: topics keep VRX's names"),
        ("usv_wind_gazebo", "topic_wind_speed", SPEED, f"<topic_wind_speed> ignored: the topic is always `{SPEED}`"),
        ("usv_wind_gazebo", "topic_wind_direction", TO, f"<topic_wind_direction> ignored: the topic is always `{TO}`"),
    ],
)
def test_parameters_that_name_topics_are_noted(name, key, ours, note):
    assert call(name, **{key: "other"})[1] == [note]
    assert call(name, **{key: ours})[1] == []


@pytest.mark.parametrize("key", PLUGINS)
def test_each_element_is_a_key_of_ours(key):
    body, expected = PLUGINS[key]
    world = said(body)
    assert losses(world) == []
    assert world.section[key] == expected


TASKS = {
    "stationkeeping": "<goal_pose_cart>1 2 0.5</goal_pose_cart><head_error_on>false</head_error_on>",
    "wayfinding": "<waypoints><waypoint><pose>-33.7 150.6 1</pose></waypoint></waypoints>",
    "perception": "<object_sequence><object><name>a</name><pose>1 2 3 0 0 0</pose></object></object_sequence>",
    "navigation": "<gates><gate><left_marker>a</left_marker><right_marker>b</right_marker></gate></gates>",
    "wildlife": "<buoys><buoy><name>turtle::link</name><goal>avoid</goal></buoy></buoys>",
    "acoustic_perception": "<pinger_position>1 2 -3</pinger_position><goal_tolerance>4</goal_tolerance>",
    "acoustic_tracking": "<pinger_depth>3</pinger_depth>",
    "scan_dock": f"<bays>{BAY}</bays>",
}
EXPECTED = {
    "stationkeeping": {"type": "stationkeeping", "goal_cart": (1, 2, 0.5), "heading": False},
    "wayfinding": {"type": "wayfinding", "waypoints": ((-33.7, 150.6, 1),)},
    "perception": {"type": "perception", "objects": ({"name": "a", "pose": (1, 2, 3, 0, 0, 0)},)},
    "navigation": {"type": "navigation_course", "gates": (("a", "b"),), "collision_buffer": 3.0},
    "wildlife": {"type": "wildlife", "animals": ({"name": "turtle", "goal": "avoid"},), "collision_buffer": 3.0},
    "acoustic_perception": {"type": "acoustic_perception", "pinger": (1, 2, -3), "goal_tolerance": 4},
    "acoustic_tracking": {"type": "acoustic_tracking", "pinger": "pinger", "pinger_depth": 3},
    "scan_dock": {"type": "dock", "dock": "robotx_dock_2018",
                  "bays": ({"name": "bay1", "symbol": "red_circle", "dock_allowed": True},)},
}  # fmt: skip
DURATIONS = "<initial_state_duration>5</initial_state_duration><ready_state_duration>10</ready_state_duration>"


@pytest.mark.parametrize("newer", [False, True])
@pytest.mark.parametrize("task", TASKS)
def test_each_scoring_plugin_is_a_task(task, newer):
    stem = "".join(word.capitalize() for word in task.split("_"))
    file = f"lib{stem}ScoringPlugin.so" if newer else f"lib{task}_scoring_plugin.so"
    dock = "<include><uri>model://dock_2018</uri></include>" if task == "scan_dock" else ""
    body = f'{dock}<plugin filename="{file}"><vehicle>cat</vehicle>{DURATIONS}{TASKS[task]}</plugin>'
    world = said(body, "1.9" if newer else "1.6")
    assert losses(world) == []
    assert world.section["task"] == {"boat": "cat", "initial_state_duration": 5.0, **EXPECTED[task]}


@pytest.mark.parametrize("heading", [0.0, 180.0, -37.0])
@pytest.mark.parametrize("task", ["stationkeeping", "wayfinding"])
def test_a_geodetic_goal_keeps_its_yaw_from_x_in_a_turned_world(task, heading):
    """A plugin's yaw is from the world's x axis, that of ours from east."""
    goal = "<pose>-33.7 150.6 1</pose>"
    inner = {"stationkeeping": goal.replace("pose", "goal_pose"), "wayfinding": f"<waypoint>{goal}</waypoint>"}[task]
    earth = (
        f"<latitude_deg>-33.7</latitude_deg><longitude_deg>150.6</longitude_deg><heading_deg>{heading}</heading_deg>"
    )
    body = (
        f"<spherical_coordinates>{earth}</spherical_coordinates>"
        f'<plugin filename="lib{task}_scoring_plugin.so">'
        f"{inner if task == 'stationkeeping' else f'<waypoints>{inner}</waypoints>'}</plugin>"
    )
    written = said(body).section["task"]
    (place,) = written["waypoints"] if task == "wayfinding" else [written["goal"]]
    assert place == pytest.approx((-33.7, 150.6, 1.0 + math.radians(heading)))
    ((_, _, yaw),) = vrx_mj.compile_world("bay.world", fleet="single").parameters.waypoints
    assert yaw == pytest.approx(1.0)


BLOCK = "<bay><name>a</name><symbol>red_cross</symbol></bay>"
CHANNEL = f'<plugin filename="libnavigation_scoring_plugin.so">{TASKS["navigation"]}</plugin>'
OTHERS = {
    "goal_pose": "-33.7 150.6 1", "goal_pose_cart": "7 8 0.5", "head_error_on": "true", "vehicle": "cat",
    "waypoints": "<waypoint><pose>-33.9 150.6 1</pose></waypoint>", "loop_forever": "true", "frame": "buoy",
    "object_sequence": "<object><name>b</name><pose>1 2 3 0 0 0</pose></object>", "enable_color_checker": "true",
    "gates": "<gate><left_marker>c</left_marker><right_marker>d</right_marker></gate>",
    "color_1": "red", "color_2": "green", "color_3": "blue", "bays": BLOCK, "pinger_position": "7 8 -9",
    "targets": "<target><topic>vrx/dock_2022_placard1_big_hole/contain</topic><bonus_points>7</bonus_points></target>",
    "buoys": "<buoy><name>crocodile::link</name><goal>avoid</goal></buoy>", "markers": "<height>7</height>",
    "release_joints": "<joint><name>a</name></joint>", "per_plugin_exit_on_completion": "false", "silent": "true",
}  # fmt: skip
"""What elements of scoring plugins say in the test, but for numbers, names and topics."""
QUIET = {"release_joints", "per_plugin_exit_on_completion", "silent"}
"""Elements that say nothing which could be another way here."""


def elements():
    """Every element of every scoring plugin, as VRX has them."""
    file = Path(__file__).parents[3] / "golden/vrx_names/plugin_elements.csv"
    lines = (line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    for row in csv.DictReader(lines):
        for plugin in SCORED if row["plugin"] == "all" else [row["plugin"]]:
            yield plugin, row["element"]


SCORED = {**TASKS, "gymkhana": "<pinger_position>1 2 0</pinger_position>"}


def scored(plugin, own):
    """A world with a scoring plugin, whose elements are its usual ones and others that take their places."""
    tags = "".join(f"<{name}>{inside}</{name}>" for name, inside in (USUAL[plugin] | own).items())
    dock = "<include><uri>model://dock_2018</uri></include>" if plugin == "scan_dock" else ""
    channel = CHANNEL if plugin == "gymkhana" else ""
    world = said(f'{dock}<plugin filename="lib{plugin}_scoring_plugin.so">{tags}</plugin>{channel}')
    return world.section, losses(world)


def inside(text):
    """The elements of a text by their names."""
    return {one.tag: "".join(map(_text, one)) or one.text or "" for one in ET.fromstring(f"<a>{text}</a>")}


def _text(element):
    return ET.tostring(element, encoding="unicode")


USUAL = {plugin: inside(text) for plugin, text in SCORED.items()}


@pytest.mark.parametrize(("plugin", "element"), list(elements()))
def test_each_element_of_each_scoring_plugin_is_read_or_noted_or_without_loss(plugin, element):
    colors = {key: OTHERS[key] for key in ("color_1", "color_2", "color_3")}
    others = colors if element in colors else {}
    before = scored(plugin, {**others, element: "yellow"} if others else {})
    if element.endswith(("_topic", "_service", "_topic_name", "robot_namespace")):
        assert scored(plugin, {element: "/vrx/other"}) == before
        after = scored(plugin, {element: "/other/name"})
        assert after[1] == [f"<{element}> ignored: topics keep VRX's names"]
    else:
        after = scored(plugin, {**others, element: OTHERS.get(element, "12")})
    assert (after == before) == (element in QUIET)


def test_an_element_that_no_plugin_of_vrx_has_is_noted():
    _, lost = scored("wayfinding", {"runing_state_duration": "60"})
    assert lost == ["<runing_state_duration> ignored: this plugin does not read it"]


def test_durations_that_a_plugin_does_not_give_are_those_of_vrx():
    task = said(f'<plugin filename="libwayfinding_scoring_plugin.so">{TASKS["wayfinding"]}</plugin>').section["task"]
    assert (task["initial_state_duration"], task["ready_state_duration"]) == (30.0, 60.0)


@pytest.mark.parametrize(("angle", "direction"), [(0.0, (1, 0)), (math.pi / 2, (0, 1)), (0.7853982, (0.7071, 0.7071))])
def test_the_sea_of_vrx_3_has_one_angle(angle, direction):
    values = {"direction": angle, "gain": 0.6, "period": 6, "steepness": 0}
    text = "".join(f'params {{ key: "{key}" value {{ type: DOUBLE double_value: {value} }} }}\n'
                   for key, value in values.items())  # fmt: skip
    message = f'<message type="gz.msgs.Param" topic="/vrx/wavefield/parameters" every="2.0">{text}</message>'
    sea = said(f'<plugin filename="libPublisherPlugin.so" name="vrx::P">{message}</plugin>', "1.9").section["sea"]
    assert sea["direction"] == pytest.approx(direction, abs=1e-4)
    assert (sea["gain"], sea["period"], sea["steepness"]) == (0.6, 6, 0)


def test_a_vector_is_a_direction_too():
    value = (
        '<message topic="/wavefield">params { key: "direction" value { vector3d_value { x: 3 y: 4 z: 0 } } }</message>'
    )
    assert said(f'<plugin filename="libPublisherPlugin.so">{value}</plugin>').section["sea"]["direction"] == (3, 4)


def test_a_model_in_the_world_is_an_object():
    shape = '<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>'
    link = f'<link name="l"><inertial><mass>50</mass></inertial>{shape}</link>'
    (raft,) = said(f'<model name="raft"><pose>1 2 0 0 0 0</pose>{link}</model>').section["objects"]
    assert (raft["name"], raft["model"], raft["pose"]) == ("raft", "bay.world#raft", (1, 2, 0, 0, 0, 0))


def test_undeclared_prefixes_of_gazebo_are_declared():
    assert losses(said("<!-- <sdf> --><gui><plugin filename='a'><gz:x/><ignition:y/></plugin></gui>")) == [
        "<gui> ignored: only for Gazebo's GUI"
    ]


@pytest.mark.parametrize(("plugin", "loss"), [
    ('filename="libusv_gazebo_wind_plugin.so"', None),
    ('filename="libUSVWind.so" name="vrx::USVWind"', None),
    ('filename="gz-sim-wind-effects-system" name="gz::sim::systems::WindEffects"',
     "<plugin> 'gz::sim::systems::WindEffects' ignored: <wind> is steady and acts on boats only"),
    ('filename="libwindow_recorder.so" name="recorder"', "<plugin> 'recorder' ignored: this plugin is not supported"),
])  # fmt: skip
def test_only_the_wind_plugins_of_vrx_are_its_wind(plugin, loss):
    world = said(f"<plugin {plugin}><wind_mean_velocity>3</wind_mean_velocity></plugin>")
    assert losses(world) == ([loss] if loss else [])
    assert ("wind" in world.section) == (loss is None)


def test_a_warning_lists_what_is_lost():
    said("".join(f"<road name='r{i}'/>" for i in range(8)))
    with pytest.warns(VrxWarning) as caught:
        load_world("bay.world")
    lines = str(caught[0].message).splitlines()
    assert lines[0] == "bay.world: 8 of 8 parts differ from Gazebo (`vrx-mj import` lists all)"
    assert lines[1] == "  bay.world:3: <road> 'r0' ignored: roads are not drawn"
    assert lines[-1] == "  and 2 more"


BUOY = "<include><uri>model://mb_marker_buoy_red</uri><name>{}</name><pose>{} 0 0 0 0 0</pose></include>"
CRATE = '<model name="{}"><static>true</static><link name="l"/></model>'
FIRST = "bay.world:4:1: {}: a model named 'a' is {} on line 3 already: change one {}"


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (BUOY.format("a", 1) + "\n" + BUOY.format("a", 2), FIRST.format("<include> 'a'", "included", "<name>")),
        (CRATE.format("a") + "\n" + BUOY.format("a", 2), FIRST.format("<include> 'a'", "defined", "<name>")),
        (BUOY.format("a", 2) + "\n" + CRATE.format("a"), FIRST.format("<model> 'a'", "included", "name")),
        (
            "<include><uri>model://sandisland</uri></include>\n"
            + BUOY.format("post_0", 2).replace("mb_marker_buoy_red", "post"),
            FIRST.replace("'a' is {}", "'post_0' is {}").format("<include> 'post_0'", "part of the terrain", "<name>"),
        ),
    ],
)
def test_two_models_of_one_name_are_refused_with_both_lines(body, message):
    with pytest.raises(ConfigError) as error:
        said(body)
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ('<xacro:ocean_waves period="-3"/>', "<ocean_waves> / period: must be above 0, got -3"),
        (
            '<xacro:usv_wind_gazebo mean_vel="-3"><wind_objs/></xacro:usv_wind_gazebo>',
            "<usv_wind_gazebo> / mean_velocity: must be at least 0, got -3",
        ),
        (BUOY.format("a", "1e9"), "<pose>: must be at most 1000000, got 1000000000"),
        ('<xacro:insert_model uri="post" x="1e9"/>', "<insert_model> / pose: must be at most 1000000, got 1000000000"),
        (
            "<scene><fog><type>exp</type><density>-1</density></fog></scene>",
            "<scene> / density: must be at least 0, got -1",
        ),
    ],
)
def test_a_value_out_of_range_names_the_element_of_the_file(body, message):
    said(body, file="bay.world.xacro")
    with pytest.raises(ConfigError) as error:
        load_world("bay.world.xacro")
    assert str(error.value).partition(": ")[2] == message
    assert str(error.value).startswith("bay.world.xacro:3:")


def scoring(kind, body):
    return f'<plugin name="p" filename="lib{kind}_scoring_plugin.so">{body}</plugin>'


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            ('<model name="w"><plugin filename="libWavefieldModelPlugin.so"><wave><number>3.7</number></wave></plugin>'
            "</model>"),
            "<number>: expected a whole number, got '3.7'",
        ),
        (
            WIND.replace("<random_seed>7<", "<random_seed>7.5<"),
            "<random_seed>: expected a whole number, got '7.5'",
        ),
        (
            ('<plugin filename="PublisherPlugin"><message topic="/vrx/wavefield/parameters">'
            'key: "number" value: {int_value: 2.5}</message></plugin>'),
            "<number>: expected a whole number, got '2.5'",
        ),
        (
            scoring("stationkeeping", "<goal_pose_cart>1 2 0</goal_pose_cart><head_error_on>off</head_error_on>"),
            "<head_error_on>: expected true or false, got 'off'",
        ),
        (
            scoring("perception", "<loop_forever>yes</loop_forever>"),
            "<loop_forever>: expected true or false, got 'yes'",
        ),
        (
            '<include><uri>model://dock_2018</uri><pose>0 0 0 0 0 0</pose></include>'
            + scoring("scan_dock", "<bays><bay><name>b</name><dock_allowed>maybe</dock_allowed></bay></bays>"),
            "<dock_allowed>: expected true or false, got 'maybe'",
        ),
        (
            '<include><uri>model://dock_2018</uri><pose degrees="yes">0 0 0 0 0 0</pose></include>',
            "<pose> / degrees: expected true or false, got 'yes'",
        ),
    ],
)  # fmt: skip
def test_whole_numbers_and_switches_that_are_neither_are_refused(body, message):
    with pytest.raises(ConfigError) as error:
        said(body)
    assert str(error.value).split(": ", 1)[1] == message


def test_wind_on_nothing_names_the_line_of_the_file():
    thing = "<wind_obj><name>ghost</name><link_name>l</link_name><coeff_vector>1 1 1</coeff_vector></wind_obj>"
    said(f"<xacro:usv_wind_gazebo><wind_objs>{thing}</wind_objs></xacro:usv_wind_gazebo>", file="bay.world.xacro")
    with pytest.raises(ConfigError) as error:
        load_fleet(None, load_world("bay.world.xacro"))
    assert str(error.value).startswith("bay.world.xacro:3:")
    assert "no boat, object, dock or robot named 'ghost'" in str(error.value)


NEAR = "<include><uri>model://mb_marker_buoy_red</uri><name>{}</name><pose {}>{}</pose></include>"
PIER = f"<pose>10 5 0 0 0 {math.pi / 2}</pose>"


@pytest.mark.parametrize(
    "body",
    [
        NEAR.format("b", 'relative_to="a"', "2 0 1 0 0 0.5") + NEAR.format("a", "", PIER[6:-7]),
        NEAR.format("b", 'frame="pier"', "2 0 1 0 0 0.5") + f'<frame name="pier">{PIER}</frame>',
        NEAR.format("b", 'relative_to="pier"', "2 0 1 0 0 0.5")
        + f'<frame name="pier" attached_to="world">{PIER}</frame>',
        NEAR.format("b", 'relative_to="end"', "1 0 1 0 0 0.5")
        + f'<frame name="pier">{PIER}</frame><frame name="end" attached_to="pier"><pose>1 0 0 0 0 0</pose></frame>',
        NEAR.format("b", 'relative_to="quay::corner"', "1 0 1 0 0 0.5")
        + f'<model name="quay"><static>true</static>{PIER}<link name="corner"><pose>1 0 0 0 0 0</pose></link></model>',
        NEAR.format("b", 'relative_to="a" degrees="true"', f"2 0 1 0 0 {math.degrees(0.5)}")
        + NEAR.format("a", 'relative_to="pier"', "0 0 0 0 0 0")
        + f'<frame name="pier">{PIER}</frame>',
    ],
)
def test_a_pose_relative_to_another_model_or_a_frame_is_in_the_world(body):
    world = said(body)
    (found,) = [one for one in world.section["objects"] if one["name"] == "b"]
    assert list(found["pose"]) == pytest.approx([10, 7, 1, 0, 0, math.pi / 2 + 0.5])
    assert "pose" not in " ".join(losses(world))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            NEAR.format("b", 'relative_to="peer"', "0 0 0 0 0 0") + f'<frame name="pier">{PIER}</frame>',
            "include / pose: no frame named 'peer'; did you mean 'pier'?",
        ),
        (
            NEAR.format("a", 'relative_to="b"', "0 0 0 0 0 0") + NEAR.format("b", 'relative_to="a"', "0 0 0 0 0 0"),
            "include / pose: poses are relative to each other in a loop: 'a' > 'b' > 'a'",
        ),
    ],
)
def test_a_pose_relative_to_nothing_or_to_itself_is_refused(body, message):
    with pytest.raises(ConfigError) as error:
        said(body)
    assert message in {line.partition(": ")[2] for line in str(error.value).splitlines()}


@pytest.mark.parametrize(
    ("tag", "first", "second", "key", "value"),
    [
        ("scene", "<ambient>0.1 0.1 0.1 1</ambient>", "<ambient>0.9 0.9 0.9 1</ambient>", "ambient",
         (0.1, 0.1, 0.1, 1.0)),
        ("gravity", "0 0 -1.6", "0 0 -5", "gravity", 1.6),
        ("gui", "<camera><pose>1 2 3 0 0 0</pose></camera>", "<camera><pose>4 0 0 0 0 0</pose></camera>", None,
         (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)),
        ("spherical_coordinates", "<latitude_deg>44</latitude_deg><longitude_deg>9</longitude_deg>",
         "<latitude_deg>0</latitude_deg><longitude_deg>0</longitude_deg>", "latitude", 44.0),
    ],
)  # fmt: skip
def test_of_two_elements_the_first_counts_as_in_gazebo(tag, first, second, key, value):
    world = said(f"<{tag}>{first}</{tag}>\n<{tag}>{second}</{tag}>")
    assert losses(world) == [f"<{tag}> ignored: only the first <{tag}> is read, on line 3"]
    part = {"gravity": "physics", "gui": "camera", "spherical_coordinates": "georeference"}.get(tag, tag)
    assert (world.section[part] if key is None else world.section[part][key]) == value


@pytest.mark.parametrize("macro", ["scene_macro", "sydneyregatta"])
def test_a_scene_after_that_of_a_macro_counts(macro):
    own = "<scene><ambient>0.9 0.9 0.9 1</ambient></scene>"
    macros = {
        "sydneyregatta": "<xacro:sydneyregatta/>",
        "scene_macro": "<xacro:sydneyregatta_minus_scene/>"
        f"<xacro:scene_macro><fog>{BLOCKS['fog']}</fog><ambient>0.3 0.3 0.3 1</ambient></xacro:scene_macro>",
    }
    world = said(f"{macros[macro]}\n{own}", file="bay.world.xacro")
    assert losses(world) == ["<scene> ignored: only the last <scene> is read, on line 4"]
    assert world.section["scene"]["ambient"] == (0.9, 0.9, 0.9, 1.0)


def test_gravity_of_a_world_of_vrx_3_leaves_its_physics():
    assert said("<gravity>0 0 -9.8</gravity>", version="1.9").section["physics"] == {"profile": "vrx3", "gravity": 9.8}


SWIMS = (
    "<include><name>t</name><uri>model://turtle_buoy</uri><pose>-500 180 0 0 0 0</pose>"
    '<plugin name="f" filename="{file}">{words}<circle><radius>3</radius></circle></plugin></include>'
)
LOOPS = "<loop_forever> ignored: VRX's plugin loops if this tag is present, whatever its value: remove it"


@pytest.mark.parametrize(
    ("file", "words", "loops", "lost"),
    [
        ("libfollow_plugin.so", "", False, []),
        ("libfollow_plugin.so", "<loop_forever/>", True, []),
        ("libfollow_plugin.so", "<loop_forever>true</loop_forever>", True, []),
        ("libfollow_plugin.so", "<loop_forever>0</loop_forever>", True, [LOOPS]),
        ("gz-sim-trajectory-follower-system", "<loop>true</loop>", True, []),
        ("gz-sim-trajectory-follower-system", "<loop>false</loop>", False, []),
    ],
)
def test_a_path_loops_as_its_plugin_says(file, words, loops, lost):
    world = said(SWIMS.format(file=file, words=words))
    (turtle,) = world.section["objects"]
    assert (turtle["path"]["loop"], losses(world)) == (loops, lost)


def test_a_loop_that_is_neither_is_refused():
    with pytest.raises(ConfigError) as error:
        said(SWIMS.format(file="libfollow_plugin.so", words="<loop_forever>maybe</loop_forever>"))
    message = "expected true or false, got 'maybe'"
    assert str(error.value) == f"bay.world:3:131: <loop_forever>: {message}"


def test_models_of_a_world_are_parsed_by_one_question(monkeypatch):
    asked = []
    answer = asking.READER.answer
    monkeypatch.setattr(asking.READER, "answer", lambda job, about: asked.append(about) or answer(job, about))
    monkeypatch.setattr(asking, "_folder", lambda: None)
    asking._answers.clear()
    names = [f"buoy_{number}" for number in range(20)]
    link = '<link name="hull"><collision name="c"><geometry><sphere/></geometry></collision></link>'
    for name in names:
        folder = Path("models", name)
        folder.mkdir(parents=True)
        (folder / "model.config").write_text(f"<model><name>{name}</name><sdf>model.sdf</sdf></model>", "utf-8")
        (folder / "model.sdf").write_text(f'<sdf version="1.6"><model name="{name}">{link}</model></sdf>', "utf-8")
    includes = "".join(f"<include><uri>model://{name}</uri></include>" for name in names)
    assert len(said(includes).section["objects"]) == 20
    assert len(asked) == 3  # of the world, of each model.config and of each model.sdf


def test_too_many_notes_on_a_world_are_refused(monkeypatch):
    monkeypatch.setitem(asking.TOGETHER, asking.NOTES, 20)
    with budget(), pytest.raises(VrxError, match="the files of this command take more than 20 notes and elements"):
        said("<include><uri>model://nothing</uri></include>" * 30)
