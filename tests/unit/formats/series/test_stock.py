"""A macro makes the world that VRX's stock world of its kind is, and `FILE#k` is the world that `generate` writes."""

import warnings
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from axes_files import WORLDS
from vrx_mj.config.tree import File, of_python
from vrx_mj.config.world import load_world
from vrx_mj.config.yaml_text import parse
from vrx_mj.errors import VrxWarning
from vrx_mj.formats.series.axes import Series, read_series
from vrx_mj.formats.series.worlds import SeriesWorld, series_world, world_text
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.model.world import tree_of

NOWHERE = File("bay.yaml", None)
SAND, LAKE = "sandisland: [null]\n    ocean_waves: [null]", "sydneyregatta: [null]\n    ocean_waves: [{scale: 2.5}]"
WIND = "usv_wind_gazebo: [null]"
MARKERS = "'<markers><scaling>0.2 0.2 2.0</scaling><height>0.5</height></markers>'"


def includes(*things):
    return "".join(f"<include><name>{name}</name><pose>{pose} 0 0 0</pose><uri>model://{model}</uri></include>"
                   for name, model, pose in things)  # fmt: skip


def shown(*things):
    objects = (f"<time>{time}</time><type>{model}</type><name>{name}</name><pose>{pose} 0 0 0</pose>"
               for name, model, time, pose in things)  # fmt: skip
    return "".join(f"<object>{inside}</object>" for inside in objects)


GATES = "".join(f"<gate><left_marker>red_bound_{i}</left_marker><right_marker>green_bound_{i}</right_marker></gate>"
                for i in range(7))  # fmt: skip
POSES = ("21.3109331464 -157.888576027 1.21756", "21.30996 -157.8901 1.0", "21.31 -157.89 1.0")
WAYPOINTS = "".join(f"<waypoint><pose>{pose}</pose></waypoint>" for pose in POSES)
BUOYS = includes(
    ("red_0", "surmark950410", "-200 100 1"),
    ("green_0", "surmark950400", "-200 102 1"),
    ("black_0", "black_totem", "-200 104 1"),
)
SHOWN = shown(
    ("red_0", "surmark950410", 5, "8 0 1"),
    ("green_0", "surmark950400", 5, "8 2 1"),
    ("black_0", "black_totem", 15, "8 -2 1"),
)
ANIMALS = (("crocodile", -552, "avoid"), ("platypus", -512, "circumnavigate_clockwise"),
           ("turtle", -472, "circumnavigate_counterclockwise"))  # fmt: skip
SWIMMERS = includes(*((f"{kind}_buoy", f"{kind}_buoy", f"{x} 170 0") for kind, x, _ in ANIMALS))
GOALS = "".join(f"<buoy><model_name>{kind}_buoy</model_name><link_name>link</link_name><goal>{goal}</goal></buoy>"
                for kind, _, goal in ANIMALS)  # fmt: skip
DELIVER = """x: -554, y: 233, Y: 3.14, light_buoy_present: "'true'", lb_x: -511, lb_y: 218, lb_z: 0.25, lb_Y: 3.14,
      enable_color_checker: true, bay2_symbol: "'blue_circle'", bay3_symbol: "'yellow_rectangle'" """

STOCK = {
    "vrx2019/stationkeeping_task": f"{SAND}\n    {WIND}\n    stationkeeping: [{{/**wp_markers: {MARKERS}}}]",
    "vrx2019/wayfinding_task": f"{SAND}\n    {WIND}\n    wayfinding: [{{/**waypoints: '{WAYPOINTS}'}}]",
    "vrx2019/perception_task": (
        f"{SAND}\n    perception: [{{/**model_includes: '{BUOYS}', /**object_sequence: '{SHOWN}'}}]"
    ),
    "vrx2019/navigation_task": (
        f"{SAND}\n    {WIND}\n    nav_challenge: [{{name: \"'vrx_navigation_course'\", x: 130, y: 100, z: 0, Y: 0,"
        f" /**gates: '{GATES}'}}]"
    ),
    "vrx2019/dock": (
        f"{SAND}\n    {WIND}\n    dock: [{{uri: \"'dock_2018_dynamic'\", x: 130, y: 97, bay2_symbol: \"'red_cross'\","
        " task_name: \"'scan'\"}]"
    ),
    "wildlife_task": (
        f"{LAKE}\n    {WIND}\n    wildlife: [{{/**animal_includes: '{SWIMMERS}', /**animal_buoys: '{GOALS}'}}]"
    ),
    "scan_dock_deliver": f"{LAKE}\n    {WIND}\n    scan_dock_deliver: [{{{DELIVER}}}]",
    "gymkhana": f"{LAKE}\n    {WIND}\n    gymkhana: [{{name: \"'gymkhana'\"}}]",
}
NAMES = {"short_navigation_course_0": "gymkhana_navigation_course", "buoys": "gymkhana_obstacle_course"}
"""The macro names the courses of a gymkhana otherwise than the stock world."""


def comparable(world):
    """What makes a world, its objects in order, goals spelled out, and without what only a launch file says.

    Gates and colours have tests of their own: macros spell out gates, and the dock of 2019 has no colours.
    """
    said = world.model_dump(exclude={"name", "description", "spawn", "folder"})
    task = said["task"]
    task["gates"] = ()
    task["name"] = task["name"] or task["type"]
    task["color_sequence"] = ()
    for animal in task.get("animals", ()):
        animal["goal"] = {f"{kind}_buoy": goal for kind, _, goal in ANIMALS}[animal["name"]]
    for thing in said["objects"]:
        thing["name"] = NAMES.get(thing["name"], thing["name"])
    said["objects"] = sorted(said["objects"], key=lambda thing: thing["name"])
    if "channel" in task:
        task["channel"]["course"] = NAMES.get(task["channel"]["course"], task["channel"]["course"])
    return said


@pytest.mark.parametrize("name", STOCK)
def test_a_macro_makes_the_stock_world(axes, name):
    axes(f"all:\n  steps: 1\n  macros:\n    {STOCK[name]}\n")
    assert comparable(load_world("bay.yaml#0")) == comparable(load_world(name))


def test_gates_are_those_that_the_course_has_by_itself(axes):
    axes(f"all:\n  steps: 1\n  macros:\n    {STOCK['vrx2019/navigation_task']}\n")
    task = load_world("bay.yaml#0").task
    assert task.gates == tuple((f"red_bound_{i}", f"green_bound_{i}") for i in range(7))


def test_light_and_colours_are_those_of_the_stock_world(axes):
    axes(f"all:\n  steps: 1\n  macros:\n    {STOCK['scan_dock_deliver']}\n")
    task, stock = load_world("bay.yaml#0").task, load_world("scan_dock_deliver").task
    assert task.color_sequence == stock.color_sequence == ("blue", "green", "red")


def test_scan_and_dock_has_the_place_of_the_stock_world_and_colours_of_its_own(axes):
    axes("all: {steps: 1, macros: {sandisland: [null], ocean_waves: [null], scan_and_dock: [null]}}")
    found, stock = load_world("bay.yaml#0"), load_world("vrx2019/scan_and_dock")
    assert comparable(found)["objects"] == comparable(stock)["objects"]
    assert found.task.color_sequence == ("red", "green", "blue")
    assert (found.task.light_buoy, found.task.ready_state_duration) == ("robotx_light_buoy", 3.0)


@pytest.mark.parametrize("path", ["circle: {radius: 3.0}", "line: {length: 10.0, direction: -0.35}"])
def test_animals_swim_along_the_paths_of_their_plugins(axes, path):
    shape, _, values = path.partition(": ")
    inside = "".join(f"<{word.split(': ')[0]}>{word.split(': ')[1]}</{word.split(': ')[0]}>"
                     for word in values.strip("{}").split(", "))  # fmt: skip
    plugin = f'<plugin name="swim" filename="libfollow_plugin.so"><loop_forever/><{shape}>{inside}</{shape}></plugin>'
    include = f"<include><name>croc</name><uri>model://crocodile_buoy</uri>{plugin}</include>"
    buoy = "<buoy><link_name>croc::link</link_name><goal>avoid</goal></buoy>"
    axes(f"all: {{steps: 1, macros: {{sydneyregatta: [null], wildlife: [{{/**animal_includes: '{include}',"
         f" /**animal_buoys: '{buoy}'}}]}}}}")  # fmt: skip
    world = load_world("bay.yaml#0")
    found = getattr(world.objects[-1].path, shape)
    assert f"{shape}: {{{', '.join(f'{key}: {value}' for key, value in found.model_dump().items())}}}" == path
    assert world.task.animals[0].name == "croc"


def test_docks_with_fixed_symbols_are_the_floating_dock_of_2018(axes):
    axes("a: {steps: 1, macros: {}, sequence: {0: {insert_model: [{uri: vrx_dock_red_circle__blue_cross}]}}}")
    dock = load_world("bay.yaml#0").objects[0]
    assert (dock.name, dock.model) == ("robotx_dock_2018", "dock_2018_dynamic")
    assert dock.symbols == ("red_circle", "blue_cross")


def test_models_of_gazebo_may_be_inserted_and_are_numbered_by_their_folder(axes, tmp_path, monkeypatch):
    folder = tmp_path / "models" / "my_buoy"
    folder.mkdir(parents=True)
    shape = "<geometry><sphere><radius>0.3</radius></sphere></geometry>"
    link = f'<link name="hull"><collision name="hull">{shape}</collision></link>'
    (folder / "model.config").write_text("<model><name>my_buoy</name><sdf>model.sdf</sdf></model>", encoding="utf-8")
    text = f'<sdf version="1.6"><model name="my_buoy"><static>true</static>{link}</model></sdf>'
    (folder / "model.sdf").write_text(text, encoding="utf-8")
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(folder.parent))
    axes("a: {steps: 1, macros: {insert_model: [{uri: \"'my_buoy'\"}, {uri: \"'my_buoy'\", x: 1}]}}")
    found = [(thing.name, thing.model, thing.pose[0]) for thing in load_world("bay.yaml#0").objects]
    assert found == [("my_buoy", "model://my_buoy", 60.0), ("my_buoy_1", "model://my_buoy", 1.0)]


TEXTS = st.text([*map(chr, range(32, 127)), *"é测船"], max_size=12)
TREES = st.recursive(
    TEXTS
    | st.sampled_from(["on", "no", "~", "null", "1e3", "010", "1:30", "<<", "- a", "a: b", "# a"])
    | st.integers(-(10**20), 10**20)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.booleans(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS.filter(bool), inner, max_size=3),
    max_leaves=12,
)


@given(st.dictionaries(TEXTS.filter(bool), TREES, min_size=1, max_size=4))
def test_what_is_written_is_what_is_read(tree):
    section = of_python(tree, NOWHERE)
    world = SeriesWorld("bay0", 0, {"a": 0}, section, None, False)
    text = world_text(Series(NOWHERE, "bay", section, ()), world)
    assert parse(File("bay0.yaml", None, tuple(text.split("\n")))) == section


@pytest.mark.slow
@pytest.mark.parametrize("name", WORLDS)
def test_every_world_of_the_examples_compiles_and_is_the_one_that_is_written(sample, name):
    file = Path(sample(name))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        series = read_series(file)
        for k in range(WORLDS[name]):
            written = Path(f"{name}{k}.yaml")
            written.write_text(world_text(series, series_world(series, k)), encoding="utf-8")
            direct, second = load_world(f"{file}#{k}"), load_world(str(written))
            assert direct.name == second.name == f"{name}{k}"
            assert direct.model_dump(exclude={"folder"}) == second.model_dump(exclude={"folder"})
            assert tree_of(compile_world(f"{file}#{k}").parameters)["sea"]
