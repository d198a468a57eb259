"""Capytaine's numbers that are stored for the report, computed again by their recipes."""

import importlib.util

import numpy as np
import pytest

from needs import CAPYTAINE, needs
from vrx_mj.validation import case

pytestmark = [needs(CAPYTAINE), pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


def recipe(name):
    """The script that made a table."""
    spec = importlib.util.spec_from_file_location(name, case.folder() / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_hydrostatics():
    made = recipe("make_hydrostatics")
    columns = ("volume", "x", "y", "z", "area")
    for row in case.rows("hydrostatics"):
        found = made.row(row["mesh"], float(row["heel"]), float(row["trim"]))
        assert found == pytest.approx([float(row[column]) for column in columns], rel=1e-6, abs=1e-9)


def test_diffraction():
    """Within 1e-4 of the largest force, and of the largest moment: other processors sum in another order."""
    stored, found = case.rows("diffraction"), recipe("make_diffraction").rows()
    assert [row[:4] for row in found] == [
        [int(row["heading"]), int(row["toward"]), row["kind"], row["motion"]] for row in stored
    ]
    theirs = np.array([(float(row["real"]), float(row["imaginary"])) for row in stored]).reshape(-1, 2, 3, 2)
    again = np.array([(float(row[4]), float(row[5])) for row in found]).reshape(-1, 2, 3, 2)
    for half in range(2):
        assert again[:, half] == pytest.approx(theirs[:, half], abs=1e-4 * np.abs(theirs[:, half]).max())
