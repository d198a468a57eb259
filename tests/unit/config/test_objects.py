"""Objects, docks and robots: what their files say, and the names along the search path."""

import os
import pickle

import pytest

from vrx_mj.config.docks import load_dock
from vrx_mj.config.objects import load_object
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import ALLOW, catalogue, contained_file, find
from vrx_mj.config.shapes import Shape
from vrx_mj.config.world import load_world
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxError, VrxWarning
from vrx_mj.packages import root


@pytest.mark.usefixtures("here")
def test_an_object_knows_its_kind():
    assert [load_object(name).kind for name in ("ball", "post", "pair")] == [
        "floating",
        "static",
        "composite",
    ]


@pytest.mark.usefixtures("here")
def test_an_object_may_extend_another(here):
    (here / "red.yaml").write_text(
        "extends: ball\nmass: 1\nvisuals: [{type: box, size: [1, 2, 3], color: red}]\n", "utf-8"
    )
    thing = load_object("red")
    assert (thing.mass, thing.visuals[0].size, thing.collisions[0].radius) == (1.0, (1.0, 2.0, 3.0), 0.2)
    assert thing.description == ""


@pytest.mark.usefixtures("here")
def test_an_object_that_sinks_gives_one_warning(here):
    (here / "lead.yaml").write_text("extends: ball\nmass: 50\n", "utf-8")
    with pytest.warns(VrxWarning) as caught:
        load_world({"objects": [{"name": "a", "model": "lead"}, {"name": "b", "model": "lead"}]})
    assert [str(item.message) for item in caught] == [
        "lead.yaml: sinks: mass 50 kg; its buoyancy displaces at most 33.5103 kg"
    ]


@pytest.mark.usefixtures("here")
def test_a_changed_file_is_read_again(here):
    for mass in (1, 20):
        (here / "mine.yaml").write_text(f"extends: ball\nmass: {mass}\n", "utf-8")
        assert load_object("mine").mass == mass


@pytest.mark.usefixtures("here")
def test_courses_in_courses_cannot_blow_up(here):
    (here / "c0.yaml").write_text("objects: [{name: a, model: ball}]\n", "utf-8")
    for level in range(1, 6):
        parts = "".join(f"  - {{name: p{i}, model: c{level - 1}}}\n" for i in range(10))
        (here / f"c{level}.yaml").write_text(f"objects:\n{parts}", "utf-8")
    load_object("c4")
    with pytest.raises(ConfigError) as caught:
        load_object("c5")
    assert str(caught.value) == "c5.yaml:3:23: objects[1].model: more than 10000 objects, including those in objects"


def test_one_scale_is_for_all_three_axes():
    assert Shape(type="mesh", file="a.stl", scale=2).scale == (2.0, 2.0, 2.0)


def test_meshes_stay_inside_through_links(here):
    (here.parent / "secret.obj").write_text("", "utf-8")
    try:
        (here / "link.obj").symlink_to(here.parent / "secret.obj")
    except OSError:
        pytest.skip("no symbolic links here")
    with pytest.raises(VrxError) as caught:
        contained_file("link.obj", here)
    assert str(caught.value) == f"path 'link.obj' leaves the folder of the file that names it; {ALLOW}"


def test_a_mesh_may_be_in_a_folder_of_any_name(here):
    (here / "网格").mkdir()
    (here / "网格" / "浮标.stl").write_bytes(b"")
    (here / "a.yaml").write_text("static: true\nvisuals: [{type: mesh, file: 网格/浮标.stl}]\n", "utf-8")
    assert load_object("a.yaml", here).visuals[0].folder == here


def test_a_drawing_is_a_top_view():
    assert load_dock("X  X\n\n XX  \n\n") == ((0, 0), (0, 3), (2, 1), (2, 2))


def test_a_dock_is_found_by_name_and_by_path(here):
    (here / "d.txt").write_bytes(b"\xef\xbb\xbfX X\r\nXXX\r\n")
    assert load_dock("bay") == load_dock("X  X\nXXXX")
    assert load_dock("./d.txt", here) == load_dock("X X\nXXX")


def test_a_drawing_from_python_says_row_and_column():
    with pytest.raises(ConfigError) as caught:
        load_dock("XX\nXY\n")
    assert str(caught.value) == "<dock>:2:2: row 2, column 2: 'Y' in a dock; use only X and space"


def test_a_robot_is_found_in_its_folder(here):
    robot = load_robot("wamv")
    assert list(robot.layouts) == ["H", "T"]
    assert robot.description_file.name == "wamv.urdf"


def test_names_are_found_along_the_search_path(here, ours, tmp_path, monkeypatch):
    first, second = tmp_path / "first", tmp_path / "second"
    for folder, place in ((first, "docks"), (second, "assets/docks"), (second, "docks/deep")):
        (folder / place).mkdir(parents=True)
    (first / "docks" / "mine.txt").write_text("X\n", "utf-8")
    (second / "assets" / "docks" / "mine.txt").write_text("XX\n", "utf-8")
    (second / "docks" / "deep" / "down.txt").write_text("XXX\n", "utf-8")
    monkeypatch.setenv("VRX_MJ_PATH", os.pathsep.join(map(str, (first, second))))
    assert catalogue("docks") == {
        "bay": ours / "assets/docks/bay.txt",
        "deep/down": second / "docks/deep/down.txt",
        "mine": first / "docks/mine.txt",
    }
    assert load_dock("mine") == load_dock("X")
    assert load_dock("deep/down") == load_dock("XXX")


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("name", ["", "a/../ball", "c:ball", "a\\b", "a\0b", "x" * 300])
def test_odd_names_are_only_unknown(name):
    with pytest.raises(UnknownNameError):
        find("objects", name)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("path", "message"),
    [
        (".", "'.' is a folder, not an object model: name a file in it"),
        ("..", "'..' is a folder, not an object model: name a file in it"),
        ("../ball", "no such file: '../ball'"),
        ("/ball", "no such file: '/ball'"),
    ],
)
def test_paths_that_are_no_models(path, message):
    with pytest.raises(VrxError) as error:
        find("objects", path)
    assert str(error.value) == message


def test_errors_survive_pickling():
    for error in (UnknownNameError("boat", "a", ["b"]), ConfigError([Problem("f", 1, 2, "k", "m")])):
        copy = pickle.loads(pickle.dumps(error))
        assert (type(copy), str(copy)) == (type(error), str(error))


@pytest.mark.parametrize(("known", "hint"), [((), "known: none"), (("port", "bow"), "known: port, bow")])
def test_an_unknown_name_lists_what_is_known(known, hint):
    assert str(UnknownNameError("thruster", "left", known)) == f"no thruster named 'left'; {hint}"


def test_long_lists_of_names_are_cut():
    error = UnknownNameError("world", "zzz", [f"w{i:02}" for i in range(30)])
    assert str(error).endswith("w11 and 18 more")


def test_the_start_files_of_an_object_and_a_dock_load():
    start = root() / "assets" / "start"
    assert load_object("object.yaml", start).kind == "floating"
    assert load_dock("dock.txt", start) == load_dock("X     X\nX     X\nXXXXXXX")


def test_a_world_uses_files_of_the_users_own(here):
    (here / "my_buoy.yaml").write_text("extends: ball\n", "utf-8")
    (here / "my_dock.txt").write_text("XX\n", "utf-8")
    world = load_world(
        {
            "objects": [{"name": "a", "model": "./my_buoy.yaml"}],
            "docks": [{"name": "b", "layout": "./my_dock.txt"}],
        }
    )
    assert load_object(world.objects[0].model, world.objects[0].folder).mass == 2.0


def test_parts_of_a_course_of_ours_are_those_of_the_current_folder_once_it_has_some(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ours = load_object("obstacle_course").objects[0]
    assert ours.config is load_object(ours.model)  # which is checked once
    (tmp_path / f"{ours.model}.yaml").write_text("static: true\n", encoding="utf-8")
    assert [ours.config.static, load_object("obstacle_course").objects[0].config.static] == [False, True]
