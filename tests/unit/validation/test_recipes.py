"""Tables of references that need no other program, computed again by their recipes."""

import importlib.util

import numpy as np
import pytest

from vrx_mj.validation import case

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("recipe", "table", "near"), [("otter", "otter_turn", 1e-8), ("contacts", "contacts", 1e-6)])
def test_a_table_is_that_of_its_recipe(recipe, table, near):
    """Contacts are a search at random, within 1e-6 m."""
    spec = importlib.util.spec_from_file_location(recipe, case.folder() / f"make_{recipe}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    stored = [list(row.values()) for row in case.rows(table)]
    assert np.array([*module.rows()]) == pytest.approx(np.array(stored), rel=1e-8, abs=near)
