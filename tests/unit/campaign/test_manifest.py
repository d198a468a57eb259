import json
from dataclasses import replace

import pytest

from campaigns import failed, scored
from vrx_mj.campaign.manifest import _option_text, begin, read_campaign
from vrx_mj.campaign.plan import Cell, Plan, Serving
from vrx_mj.campaign.results import ResultStore, write_json
from vrx_mj.errors import CommandError, RecordError
from vrx_mj.mjcf.compile import compile_world

PLAN = Plan(("boat:f",), ("hold", "bay"), (0, 1), duration=10.0)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "boat.py").write_text("def f(obs, t): ...\n", encoding="utf-8")
    (tmp_path / "ship.py").write_text("def f(obs, t): ...\n", encoding="utf-8")
    return tmp_path / "results"


def message(folder, plan):
    with pytest.raises(CommandError) as raised:
        begin(folder, plan)
    return str(raised.value)


def another(folder, *lines):
    return "\n".join(
        [
            f"the campaign in '{folder}' is a different one:",
            *(f"  {line}" for line in lines),
            "give another folder with -o, or --restart to run all of it again",
        ]
    )


def store(folder, *results):
    with ResultStore(folder, writes=True) as database:
        database.add(*results)


def test_missing_and_failed_cells_are_left(folder):
    assert begin(folder, PLAN).remaining == PLAN.cells
    store(folder, scored("boat:f", "hold", 0, 1.0), failed("boat:f", "hold", 1))
    again = begin(folder, PLAN)
    assert again.remaining == PLAN.cells[1:]
    assert read_campaign(folder) == again


def test_a_campaign_that_goes_on_began_when_it_did(folder):
    file, began = begin(folder, PLAN).folder / "campaign.json", "2020-01-01T00:00:00+00:00"
    write_json(file, {**json.loads(file.read_text(encoding="utf-8")), "began": began})
    assert (begin(folder, PLAN).manifest.began, read_campaign(folder).manifest.began) == (began, began)
    assert begin(folder, PLAN, restart=True).manifest.began > began


def test_more_of_the_same_may_be_added(folder):
    begin(folder, PLAN)
    store(folder, scored("boat:f", "hold", 0, 1.0))
    wider = Plan(("boat:f", "ship:f"), ("bay", "hold", "open"), (0, 1, 2), duration=10.0)
    assert set(wider.cells) - set(begin(folder, wider).remaining) == {Cell("boat:f", "hold", 0)}


def test_another_plan_is_noticed(folder):
    begin(folder, PLAN)
    other = Plan(("ship:f",), ("bay",), (1, 2), fleet="trio", record=True)
    assert message(folder, other) == another(
        folder,
        "it also has the controllers boat:f",
        "it also has the worlds hold",
        "it also has the seeds 0",
        "its --fleet was not given, now trio",
        "its --duration was 10.0, now not given",
        "its --record was off, now on",
    )


def test_a_changed_controller_or_program_is_noticed(folder, monkeypatch):
    before = begin(folder, PLAN).manifest.code
    (folder.parent / "boat.py").write_text("def f(obs, t): return None\n", encoding="utf-8")
    monkeypatch.setattr("vrx_mj.campaign.manifest.code_version", lambda: "9.9 new")
    assert message(folder, PLAN) == another(
        folder, f"it was run by vrx_mj {before}, now 9.9 new", "the controller boat:f has changed since"
    )


def test_programs_are_not_mixed_with_others_or_served_otherwise(folder):
    first = Plan(("run boat.py",), ("hold",), (0,), serving=Serving(2.0, ("/a", "/b"), rosbridge=True))
    assert read_campaign(begin(folder, first).folder).manifest.plan == first
    served = "its trials were run by --exec --rate 2 --lockstep /a,/b --rosbridge, now by "
    assert message(folder, replace(first, serving=Serving(None, ()))) == another(
        folder, f"{served}--exec --rate max --lockstep step"
    )
    controllers = replace(first, controllers=("boat:f",), serving=None)
    assert message(folder, controllers) == another(
        folder, "it also has the controllers run boat.py", f"{served}controllers"
    )


def test_a_program_has_changed_with_a_file_that_its_line_names(folder):
    plan = Plan(("python3 'boat.py' --fast", "echo 'unclosed", "x" * 5000), ("hold",), (0,), serving=Serving())
    begin(folder, plan)
    (folder.parent / "boat.py").write_text("def f(obs, t): return None\n", encoding="utf-8")
    assert message(folder, plan) == another(folder, "the program python3 'boat.py' --fast has changed since")


def test_a_changed_world_or_fleet_of_ones_own_is_noticed(folder):
    world, fleet = folder.parent / "bay.yaml", folder.parent / "pair.yaml"
    world.write_text("sea: {gain: 0.0}\n", encoding="utf-8")
    fleet.write_text("robot: skiff\nboats:\n  - {name: a, pose: [0, 0, 0.1, 0, 0, 0]}\n", encoding="utf-8")
    plan = Plan(("boat:f",), ("bay.yaml", "ocean"), (0,), fleet="pair.yaml")
    begin(folder, plan)
    for cell in plan.cells:
        sha256 = compile_world(cell.world, fleet=plan.fleet, seed=cell.seed).sha256
        store(folder, replace(scored(*vars(cell).values(), 1.0), world_sha256=sha256))
    assert not begin(folder, plan).remaining
    world.write_text("sea: {gain: 0.3}\n", encoding="utf-8")
    told = "the world bay.yaml, or the fleet pair.yaml, has changed since"
    assert message(folder, plan) == another(folder, told)
    fleet.write_text("robot: skiff\nboats:\n  - {name: b, pose: [0, 0, 0.1, 0, 0, 0]}\n", encoding="utf-8")
    assert message(folder, plan) == another(folder, told, told.replace("bay.yaml", "ocean"))


def test_restart_forgets_the_campaign_and_nothing_else(folder):
    begin(folder, PLAN)
    store(folder, scored("boat:f", "hold", 0, 1.0))
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    assert begin(folder, Plan(("ship:f",), ("hold",), (0,)), restart=True).remaining == (Cell("ship:f", "hold", 0),)
    assert sorted(file.name for file in folder.iterdir()) == ["campaign.json", "notes.txt"]


def test_a_folder_of_other_things_is_left_alone(folder):
    folder.mkdir()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    text = f"the folder '{folder}' is not empty and holds no campaign: give another folder with -o"
    assert message(folder, PLAN) == text
    with pytest.raises(CommandError):
        begin(folder, PLAN, restart=True)


def test_what_is_no_campaign_cannot_be_read(folder):
    with pytest.raises(RecordError) as raised:
        read_campaign(folder)
    assert str(raised.value) == f"no campaign in '{folder}': it has no campaign.json"
    write_json(folder / "campaign.json", {"format": 1})
    with pytest.raises(RecordError, match=r"campaign\.json is damaged: 'controllers'$"):
        read_campaign(folder)


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "not given"), ((), "not given"), (("a", "b"), "a b"), (True, "on"), (False, "off"), (4.5, "4.5")],
)
def test_an_option_that_changed_is_told_as_it_was_given(value, text):
    assert _option_text(value) == text
