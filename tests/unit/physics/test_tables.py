"""Tables are filled completely or not at all."""

import re

import numpy as np
import pytest

from vrx_mj.physics.tables import SEA, WAVE, table

WAVE_ROW = {"amplitude": 0.1, "wavenumber": 0.2, "frequency": 1.4, "direction": (1.0, 0.0), "steepness": 0.0,
            "orbital": 0.14}  # fmt: skip


def test_a_table_holds_its_rows():
    waves = table(WAVE, [WAVE_ROW, WAVE_ROW | {"direction": (0.0, 1.0)}])
    assert waves.shape == (2,)
    assert waves["amplitude"].tolist() == [0.1, 0.1]
    assert waves["direction"].tolist() == [[1.0, 0.0], [0.0, 1.0]]


def test_a_table_may_be_empty():
    assert table(SEA, []).shape == (0,)


def test_a_missing_field_and_an_unknown_one_are_named():
    message = "row 1: missing fields ['tau'], unknown fields ['swell']"
    water = {"level": 0.0, "depth": 5.0, "gravity": 9.8, "density": 1000.0, "moving": 0}
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        table(SEA, [{"tau": 2.0} | water, {"swell": 3.0} | water])


def test_a_number_does_not_fill_a_vector():
    with pytest.raises(ValueError, match=r"^row 0: direction has shape \(\), not \(2,\)$"):
        table(WAVE, [WAVE_ROW | {"direction": 1.0}])


def test_a_vector_does_not_fill_a_number():
    with pytest.raises(ValueError, match=r"^row 0: amplitude has shape \(1,\), not \(\)$"):
        table(WAVE, [WAVE_ROW | {"amplitude": np.array([0.1])}])
