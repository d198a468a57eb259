"""Macros of VRX's worlds: each is known, with each of its parameters and blocks and VRX's defaults."""

import csv
from pathlib import Path

import pytest

from vrx_mj.formats.series.worlds import REQUIRED, macros

LISTED = Path(__file__).parents[3] / "golden/vrx_names/macros.csv"
OTHER = {
    ("scan_dock_deliver", "uri"): "dock_2022",
}
"""Defaults that are others here: VRX's dock has neither a third bay nor holes, and topics have fixed names."""


def listed():
    """Parameters and blocks of each macro of VRX, with their defaults."""
    lines = (line for line in LISTED.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    found = {}
    for row in csv.DictReader(lines):
        parameters = found.setdefault(row["macro"], {})
        if row["parameter"]:
            parameters[row["parameter"]] = row["default"]
    return found


VRX = listed()


def number(text):
    """A default as a number, if it is one, else as a word."""
    try:
        return float(text)
    except ValueError:
        return text


def ours(value):
    return "(required)" if value is REQUIRED else number(str(value).lower() if isinstance(value, bool) else str(value))


def test_every_macro_of_vrx_is_known_and_no_other():
    assert set(macros()) == set(VRX)


@pytest.mark.parametrize("macro", sorted(VRX))
def test_a_macro_has_the_parameters_and_defaults_of_vrx(macro):
    theirs = {key: number(value) for key, value in VRX[macro].items() if not key.startswith("**")}
    theirs |= {key: number(value) for (name, key), value in OTHER.items() if name == macro}
    assert {key: ours(value) for key, value in macros()[macro].defaults.items()} == theirs


@pytest.mark.parametrize("macro", sorted(VRX))
def test_a_macro_has_the_blocks_of_vrx(macro):
    assert {f"**{block}" for block in macros()[macro].blocks} == {key for key in VRX[macro] if key.startswith("**")}
