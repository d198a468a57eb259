"""Columns of the loop's tables are the numbers of a world's dataclasses, and tables hold their rows."""

import ast
import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from vrx_mj.model import tables
from vrx_mj.model.boats import Hull, Memory, Propeller
from vrx_mj.model.kinds import Flag, Index, Positive, ProfileCode, Text, Vec2
from vrx_mj.model.tables import FLOAT, HULL, MEMORY, PROPELLER, SAIL_CURVE, WAVE, WAYPOINT, form, table_of
from vrx_mj.model.things import Float, PathPoint
from vrx_mj.model.water import Wave
from vrx_mj.physics import tables as codes

WAVES = [Wave(amplitude=0.1, wavenumber=0.2, frequency=1.4, direction=way, steepness=0.0, orbital=0.14)
         for way in ((1.0, 0.0), (0.0, 1.0))]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "type_", "shape"),
    [
        (Positive, np.float64, ()),
        (Positive | None, np.float64, ()),
        (Vec2, np.float64, (2,)),
        (tuple[Vec2, Vec2, Vec2], np.float64, (3, 2)),
        (Index, np.int64, ()),
        (Flag, np.int64, ()),
        (ProfileCode, np.int64, ()),
    ],
)
def test_a_number_has_a_column_of_its_type_and_shape(kind, type_, shape):
    assert form(kind) == (type_, shape)


@pytest.mark.parametrize("kind", [Text, Text | None, tuple[Vec2, ...], Hull, Hull | None, tuple[Text, Text]])
def test_what_is_no_number_or_of_any_length_has_no_column(kind):
    assert form(kind) is None


@pytest.mark.parametrize(
    ("table", "kind", "lacking"),
    [
        (HULL, Hull, {"joint", "windage", "inertia"}),
        (FLOAT, Float, set()),
        (MEMORY, Memory, set()),
        (PROPELLER, Propeller, {"thrust", "four_quadrant"}),
        (WAYPOINT, PathPoint, set()),
    ],
)
def test_a_table_has_a_column_for_every_field_that_is_a_number(table, kind, lacking):
    """A number that is added to a dataclass reaches the kernels without a second list."""
    assert {own.name for own in fields(kind)} - set(table.names) == lacking


def test_parts_of_a_point_of_a_curve_are_columns():
    assert SAIL_CURVE.names == ("angle", "lift", "drag")


def test_physics_declares_no_columns():
    source = Path(codes.__file__).read_text(encoding="utf-8")
    assert "dtype" not in source
    assert not any(isinstance(node, ast.Constant) and node.value in HULL.names for node in ast.walk(ast.parse(source)))


def test_a_table_holds_its_rows():
    waves = table_of(WAVE, WAVES, phase=[0.0, 1.0])
    assert waves.shape == (2,)
    assert waves["amplitude"].tolist() == [0.1, 0.1]
    assert waves["direction"].tolist() == [[1.0, 0.0], [0.0, 1.0]]
    assert waves["phase"].tolist() == [0.0, 1.0]


def test_a_table_may_be_empty():
    assert table_of(tables.SEA, [], depth=[1.0]).shape == (0,)


def test_a_column_that_no_row_has_is_named():
    with pytest.raises(AttributeError, match="'phase'"):
        table_of(WAVE, WAVES)


@pytest.mark.parametrize("phase", [0.0, [0.0], [[0.0], [1.0]]])
def test_a_column_has_a_value_for_each_row(phase):
    message = f"phase has shape {np.shape(phase)}, not (2,)"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        table_of(WAVE, WAVES, phase=phase)
