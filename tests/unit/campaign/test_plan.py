import pytest

from vrx_mj.campaign.plan import Cell, Plan, choose_worlds, folder_name, parse_seeds
from vrx_mj.errors import CommandError, UnknownNameError


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        ("5", (5,)),
        ("0..3", (0, 1, 2, 3)),
        ("0,3,7", (0, 3, 7)),
        ("7, 0..2 ,1", (7, 0, 1, 2)),
        ("4..4", (4,)),
    ],
)
def test_seeds(text, seeds):
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "--seeds '': '' is not a seed: whole numbers from 0 are needed, as in 0..9 or 0,3,7"),
        ("0-9", "--seeds '0-9': '0-9' is not a seed: whole numbers from 0 are needed, as in 0..9 or 0,3,7"),
        ("-1", "--seeds '-1': '-1' is not a seed: whole numbers from 0 are needed, as in 0..9 or 0,3,7"),
        ("9..0", "--seeds '9..0': the range 9..0 is empty; write the smaller number first"),
        ("0..999999", "--seeds '0..999999': 1000000 seeds; at most 100000 are allowed"),
    ],
)
def test_what_is_no_seed(text, message):
    with pytest.raises(CommandError) as raised:
        parse_seeds(text)
    assert str(raised.value) == message


@pytest.fixture
def worlds(tmp_path, monkeypatch):
    """Worlds of the current folder alone: names `mine/a1`, `mine/a2`, `mine/sub/b1`, and a file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("vrx_mj.config.search.root", lambda: tmp_path / "nowhere")
    monkeypatch.delenv("VRX_MJ_PATH", raising=False)
    for name in ("mine/a1", "mine/a2", "mine/sub/b1"):
        file = tmp_path / "worlds" / f"{name}.yaml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("extends: ocean\n", encoding="utf-8")
    (tmp_path / "one.yaml").write_text("extends: ocean\n", encoding="utf-8")


@pytest.mark.parametrize(
    ("patterns", "chosen"),
    [
        (["mine/*"], ("mine/a1", "mine/a2", "mine/sub/b1")),
        (["mine/a?", "*1"], ("mine/a1", "mine/a2", "mine/sub/b1")),
        (["mine/sub/b1", "mine/[!b]2"], ("mine/sub/b1", "mine/a2")),
        (["one.yaml", "one.yaml#3"], ("one.yaml", "one.yaml#3")),
        (["worlds/mine/*.yaml"], ("worlds/mine/a1.yaml", "worlds/mine/a2.yaml")),
        (["worlds/**/?1.yaml#2"], ("worlds/mine/a1.yaml#2", "worlds/mine/sub/b1.yaml#2")),
    ],
)
def test_worlds_by_name_pattern_and_path(worlds, patterns, chosen):
    assert choose_worlds(patterns) == chosen


def test_a_pattern_that_matches_nothing(worlds):
    with pytest.raises(CommandError) as raised:
        choose_worlds(["vrx2022/*"])
    assert str(raised.value) == "--worlds 'vrx2022/*' matches none of 3 worlds; folders of worlds: mine/*"


def test_a_pattern_of_files_that_matches_nothing(worlds):
    with pytest.raises(CommandError, match=r"^--worlds 'seas/\*\.yaml': no file 'seas/\*\.yaml'$"):
        choose_worlds(["seas/*.yaml"])


def test_worlds_that_are_not_there(worlds):
    with pytest.raises(UnknownNameError, match=r"^no world named 'mine/a3'; did you mean 'mine/a2'\?$"):
        choose_worlds(["mine/a3"])
    with pytest.raises(CommandError, match=r"^--worlds 'two\.yaml#1': no file 'two\.yaml'$"):
        choose_worlds(["two.yaml#1"])


def test_cells_go_world_by_world():
    plan = Plan(("a:f", "b:f"), ("w", "v"), (0, 1))
    assert len(plan.cells) == 8
    assert plan.cells[:3] == (Cell("a:f", "w", 0), Cell("b:f", "w", 0), Cell("a:f", "w", 1))


NAMES = [
    "vrx2022/gymkhana",
    "vrx2022.gymkhana",
    "vrx2022_gymkhana",
    "Vrx2022/gymkhana",
    "测试/世界",
    "世界/测试",
    "a" * 90,
]
NAMES += ["a" * 91, "../up.yaml", "up.yaml", "up.yaml#1", "a.b:c", "a.b:d", "con/aux:x y", " "]


def test_no_two_names_share_a_folder_on_any_system():
    folders = [folder_name(name) for name in NAMES]
    assert len({folder.casefold() for folder in folders}) == len(NAMES)
    assert all(set(folder) <= set("abcdefghijklmnopqrstuvwxyzV0123456789_-.") for folder in folders)
    assert all(folder[0] != "." and len(folder) <= 80 for folder in folders)


def test_names_stay_readable():
    cell = Cell("my_boat:Skipper", "vrx2022/phase2/wayfinding2", 7)
    assert cell.folder == "cells/my_boat.Skipper/vrx2022.phase2.wayfinding2/seed_7"
