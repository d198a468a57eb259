"""`vrx-mj trial`: its files, its figures and wrong words."""

import json
from pathlib import Path

import pytest

from vrx_mj import trials


def test_a_turning_circle(cli, folder):
    found = cli("trial", "turning", "skiff", "-o", "there")
    assert found.code == 0
    tree = json.loads((folder / "there" / "turning.json").read_text(encoding="utf-8"))
    figures = {name: each["value"] for name, each in tree["figures"].items()}
    assert 1.0 < figures["tactical_diameter"] / figures["steady_radius"] < 2.5
    assert 0.3 < figures["speed_kept"] < 1.0
    assert figures["drift_angle"] > 0.0  # the bow points into the circle
    assert f"advance            {figures['advance']:>9.4g} m" in found.out
    assert (folder / "there" / "turning.svg").read_text(encoding="utf-8").startswith("<svg")
    assert len(tree["track"]["time"]) == len(tree["track"]["helm"])


TRIALS = ("zigzag", "crash-stop", "pull-out", "spiral", "decay")


@pytest.mark.slow
@pytest.mark.parametrize(("trial", "robot"), [*((trial, "skiff") for trial in TRIALS), ("zigzag", "wamv")])
def test_the_others(cli, folder, trial, robot):
    assert cli("trial", trial, robot).code == 0
    tree = json.loads((folder / f"{trial}.json").read_text(encoding="utf-8"))
    assert None not in [each["value"] for each in tree["figures"].values()]


@pytest.mark.slow
@pytest.mark.nightly
def test_the_others_of_a_wam_v(cli, folder, subtests):
    for trial in sorted({*TRIALS} - {"zigzag"}):
        with subtests.test(trial):
            test_the_others(cli, folder, trial, "wamv")


def test_the_help_lists_all_trials():
    page = Path(__file__).parents[3] / "docs" / "cli.md"  # as `--help` has it: test_docs.py
    assert f"One of {', '.join(trials.TRIALS)}." in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("trial circle skiff", "no trial named 'circle'; known: turning, zigzag, crash-stop, pull-out, spiral, decay"),
        ("trial turning skiff --mode roll", "--mode is not for turning, but for decay"),
        ("trial turning skiff --helm 2", "invalid --helm '2': a number above 0, at most 1, is needed"),
        ("trial decay skiff --mode yaw", "invalid mode 'yaw': heave, roll or pitch is needed"),
        ("trial decay skiff --angle 10", "--angle is not for decay, but for zigzag"),
    ],
)  # fmt: skip
def test_wrong_words(cli, folder, words, message):
    found = cli(*words.split())
    assert found.code == 2
    assert message in found.err
    assert list(folder.iterdir()) == []
