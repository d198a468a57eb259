"""What `vrx-mj list robots --verbose` says of commands."""

import os

import pytest

from vrx_mj.cli.files import NEW_KINDS, command_lines, listing
from vrx_mj.cli.options import put_first
from vrx_mj.config.kinds import KINDS
from vrx_mj.config.search import PACKAGE_PATH, catalogue, package_paths
from vrx_mj.config.tasks import TASKS
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.packages import root

SOME = {
    "worlds": {"example_course", "ocean", "sydney_regatta", "sand_island"},
    "fleets": {"trio", "usv_config"},
    "robots": {"wamv"},
    "objects": {"mb_marker_buoy_red", "robotx_light_buoy"},
    "docks": {"dock_2016", "dock_2018", "dock_2022"},
    "tasks": {"wildlife: time minus bonuses, in s; lower is better"},
}


@pytest.mark.parametrize("kind", [*KINDS, "tasks"])
def test_list_shows_what_is_installed(cli, kind):
    said = cli("list", kind)
    assert (said.code, said.err) == (0, "")
    assert set(said.out.split("\n")) >= SOME[kind]


def test_list_without_a_kind_shows_worlds(cli):
    assert cli("list").out == cli("list", "worlds").out


def test_list_shows_ones_own_files_with_their_place(cli, folder, monkeypatch):
    for place in (folder / "fleets", folder / "more" / "fleets"):
        place.mkdir(parents=True)
        (place / f"{place.parent.name[:1]}_fleet.yaml").write_text("usv_count: 1\n", encoding="utf-8")
    monkeypatch.setenv("VRX_MJ_PATH", str(folder / "more"))
    said = cli("list", "fleets")
    assert f"测_fleet  ({folder / 'fleets' / '测_fleet.yaml'})" in said.out
    assert f"m_fleet  ({folder / 'more' / 'fleets' / 'm_fleet.yaml'})" in said.out
    assert "\ntrio\n" in said.out


@pytest.mark.slow
def test_list_says_what_each_is_when_asked(cli, folder):
    place = folder / "robots" / "mine"
    place.mkdir(parents=True)
    (place / "robot.yaml").write_text("description: a boat\n  of ours\nurdf: mine.urdf\n", encoding="utf-8")
    lines = cli("list", "robots", "--verbose").out.splitlines()
    assert "skiff: Skiff, a 2.4 m monohull of 60 kg with one propeller and a rudder" in lines
    assert f"mine: a boat of ours  ({place / 'robot.yaml'})" in lines


def test_list_has_a_line_for_each_type_of_task_and_its_keys_when_asked(cli):
    lines = cli("list", "tasks").out.splitlines()
    assert len({line.partition(": ")[2] for line in lines}) == len(lines)  # no two tasks are described alike
    assert [line.partition(":")[0] for line in lines] == list(TASKS)
    more = cli("list", "tasks", "--verbose").out.splitlines()
    assert set(lines) < set(more)
    assert "  goal_tolerance: Distance in three dimensions at which it counts as reached [m]." in more
    assert more.index("all tasks") < more.index("  boat: The boat that is scored; by default the fleet's first.")


def test_list_puts_worlds_in_folders_under_headings(cli):
    lines = cli("list", "worlds").out.splitlines()
    top, *groups = "\n".join(lines).split("\n\n")
    assert {"ocean", "stationkeeping_task", "wildlife_task"} <= set(top.split())
    headings = [group.splitlines()[0] for group in groups]
    assert headings == sorted(headings, key=lambda heading: heading.partition(":")[0])
    assert {"# vrx2019/phase2: 36", "# vrx2022/practice: 18", "# vrx2023/phase2: 48"} <= set(headings)
    for group in groups:
        heading, *names = group.splitlines()
        folder, _, count = heading.removeprefix("# ").partition(": ")
        assert len(names) == int(count)
        assert {name.rpartition("/")[0] for name in names} == {folder}
    names = [line for line in lines if line and not line.startswith("#")]
    assert sorted(names) == list(catalogue("worlds"))


@pytest.mark.parametrize(
    ("pattern", "names"),
    [
        ("vrx2019/practice/dock?", [f"vrx2019/practice/dock{i}" for i in range(3)]),
        ("vrx2022/*/gymkhana2", ["vrx2022/phase2/gymkhana2", "vrx2022/practice/gymkhana2"]),
        ("ocean", ["ocean"]),
    ],
)
def test_list_shows_only_names_like_a_pattern(cli, pattern, names):
    said = cli("list", "worlds", pattern)
    assert [line for line in said.out.splitlines() if line and not line.startswith("#")] == names


def test_list_of_a_pattern_that_nothing_fits_is_an_error(cli):
    said = cli("list", "fleets", "duo*")
    assert (said.code, said.out, said.err.strip()) == (
        2,
        "",
        "no fleet named 'duo*'; known: none, single, trio, usv_config",
    )


def test_list_shows_a_file_that_cannot_be_read_without_a_description(cli, folder):
    (folder / "fleets").mkdir()
    (folder / "fleets" / "broken.yaml").write_text("description: [\n", encoding="utf-8")
    said = cli("list", "fleets", "--verbose")
    assert (said.code, said.err) == (0, "")
    assert f"broken  ({folder / 'fleets' / 'broken.yaml'})" in said.out.splitlines()


USED_IN = {
    "world": "extends: ./{name}\n",
    "fleet": "spawn: {{pose: [0, 0, 0.1, 0, 0, 0], robot: wamv}}\n",
    "dock": "docks: [{{name: mine, pose: [30, 0, 0, 0, 0, 0], layout: ./{name}}}]\n",
    "object": "objects: [{{name: mine, model: ./{name}, pose: [30, 0, 0, 0, 0, 0]}}]\n",
}


@pytest.mark.parametrize("kind", NEW_KINDS)
def test_new_copies_a_start_file_that_compiles(cli, folder, kind):
    said = cli("new", kind, "mine")
    (file,) = folder.iterdir()
    assert (said.code, said.err) == (0, "")
    assert said.out == f"{file.name}: edit it, then use it by its path\n"
    assert file.read_bytes() == (root() / "assets" / "start" / NEW_KINDS[kind]).read_bytes()
    text = USED_IN[kind].format(name=file.name)
    (folder / "bay.yaml").write_text(text if kind == "world" else f"extends: ocean\n{text}", encoding="utf-8")
    world = compile_world("bay.yaml", fleet=file.name if kind == "fleet" else None)
    assert len(world.boats) == (3 if kind == "fleet" else 1)
    assert kind == "fleet" or '"mine' in world.mjcf or kind == "world"


@pytest.mark.parametrize("name", ["bay", "bay.yaml", "sea.of.trees"])
def test_new_ends_the_name_with_the_suffix_once(cli, folder, name):
    cli("new", "world", name)
    assert [file.name for file in folder.iterdir()] == [name.removesuffix(".yaml") + ".yaml"]


def test_new_overwrites_nothing(cli, folder):
    (folder / "bay.yaml").write_text("mine\n", encoding="utf-8")
    said = cli("new", "world", "bay")
    assert (said.code, said.out) == (2, "")
    assert said.err.strip() == "bay.yaml exists: choose another name, or remove it"
    assert (folder / "bay.yaml").read_text(encoding="utf-8") == "mine\n"


TOLD = {
    "wamv": (
        (
            "vrx, marine: left, right -1 to 1 of full power, which is at most 250 N ahead and 100 N astern, for 1 s; "
            "left_angle, right_angle -1.571 to 1.571 rad"
        ),
        "vrx3: left, right -1000 to 2353.53 N, until the next command; left_angle, right_angle -3.142 to 3.142 rad",
    ),
    "skiff": (
        (
            "vrx, marine: propeller -1 to 1 of full power, which is at most 120 N ahead and 60 N astern, for 1 s; "
            "rudder_angle -0.61 to 0.61 rad"
        ),
        "vrx3: propeller -60 to 120 N, until the next command; rudder_angle -0.61 to 0.61 rad",
    ),
    "cora": (
        ("vrx, marine: left, right -1 to 1 of full power, which is at most 120000 N ahead and 50000 N astern, for 1 s"),
        "vrx3: left, right -50000 to 120000 N, until the next command",
    ),
}


@pytest.mark.parametrize("robot", TOLD)
def test_units_and_limits_follow_the_profile(robot):
    assert tuple(command_lines(robot)) == TOLD[robot]


def test_they_stand_below_the_robot_in_the_verbose_list_alone():
    lines = list(listing("robots", "skiff", verbose=True))
    assert lines[0].startswith("skiff: Skiff, a 2.4 m monohull")
    assert lines[1:] == [f"  {line}" for line in TOLD["skiff"]]
    assert list(listing("robots", "skiff")) == ["skiff"]


def test_a_robot_that_cannot_be_built_is_listed_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setenv("VRX_MJ_PATH", str(tmp_path))
    folder = tmp_path / "assets" / "robots" / "wreck"
    for place in (folder, tmp_path / "robots" / "wreck"):
        place.mkdir(parents=True)
        (place / "robot.yaml").write_text("urdf: nowhere.urdf\ndescription: sunk\n", encoding="utf-8")
    lines = list(listing("robots", "wreck", verbose=True))
    assert len(lines) == 1
    assert lines[0].startswith("wreck: sunk")


# `--package-path`: its folders come before those of the environment


def test_folders_that_are_named_come_before_those_of_the_environment(tmp_path, monkeypatch):
    folders = [tmp_path / name for name in ("one", "two", "inherited")]
    for folder in folders:
        folder.mkdir()
    monkeypatch.setenv(PACKAGE_PATH, str(folders[2]))
    put_first(folders[:2], PACKAGE_PATH, "--package-path")
    assert package_paths() == tuple(folders)
    monkeypatch.setenv(PACKAGE_PATH, "")
    put_first(folders[:1], PACKAGE_PATH, "--package-path")
    assert os.environ[PACKAGE_PATH] == str(folders[0])
    with pytest.raises(VrxError):
        put_first([tmp_path / "none"], PACKAGE_PATH, "--package-path")
