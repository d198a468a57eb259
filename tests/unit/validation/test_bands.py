"""The bands of the report: one file, whose rows have kinds, and which its own history does not show to be widened."""

import csv
import subprocess

import pytest

from vrx_mj.packages import root
from vrx_mj.validation.case import EVIDENCE, Band, bands
from vrx_mj.validation.report import CASES

FILE = "assets/validation/bands.csv"


def test_each_row_of_the_file_has_a_case_a_kind_and_a_band():
    assert {case for case, _ in bands()} == {each.name for each in CASES}
    assert {band.evidence for band in bands().values()} == set(EVIDENCE)
    for band in bands().values():
        low, high = band.limits(None if " to " in band.width else 1.0)
        assert low <= high
        assert bool(band.known) == bool(band.why)


def read(text):
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {(row["case"], row["quantity"]): Band(row["evidence"], row["band"]) for row in rows}


def widened(before, after):
    """Rows of both whose band is wider in the later one, or of another form."""

    def is_wider(old, new):
        if old.width.endswith("%") != new.width.endswith("%") or (" to " in old.width) != (" to " in new.width):
            return True
        reference = None if " to " in old.width else 1.0
        (low, high), (new_low, new_high) = old.limits(reference), new.limits(reference)
        return new_low < low or new_high > high

    return [key for key, old in before.items() if key in after and is_wider(old, after[key])]


HEAD = "case,quantity,evidence,band\n"


@pytest.mark.parametrize(
    ("old", "new", "is_wider"),
    [
        ("1 %", "1 %", False),
        ("1 %", "0.5 %", False),
        ("1 %", "1.5 %", True),
        ("0.05", "0.06", True),
        ("1 %", "0.001", True),  # not comparable: to be said
        ("0 to 1", "0 to 0.5", False),
        ("1 to 2", "0.9 to 2", True),
        ("0", "0", False),
        ("0", "1e-09", True),
    ],
)
def test_a_wider_band_is_found(old, new, is_wider):
    before, after = (read(f"{HEAD}a,force,measured,{width}\n") for width in (old, new))
    assert widened(before, after) == [("a", "force")] * is_wider


def git(*arguments):
    return subprocess.run(("git", *arguments), cwd=root(), capture_output=True, text=True, check=True).stdout


def test_no_band_was_ever_widened():
    """A commit that has to widen one says `Band widened: CASE: QUANTITY` in its message, and why."""
    if not (root() / ".git").exists():
        pytest.skip("no history here")
    commits = git("log", "--reverse", "--format=%H", "--", FILE).split()
    states = [read(git("show", f"{commit}:{FILE}")) for commit in commits]
    states.append(read((root() / FILE).read_text("utf-8")))
    messages = [git("log", "-1", "--format=%B", commit) for commit in commits[1:]] + [""]
    for before, after, message in zip(states, states[1:], messages, strict=False):
        unsaid = [f"{case}: {quantity}" for case, quantity in widened(before, after)]
        assert [each for each in unsaid if f"Band widened: {each}" not in message] == []
