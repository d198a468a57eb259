"""Arguments at the ends of what they may be, and what is said of others."""

import math
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from vrx_mj.arguments import (
    as_flag,
    as_int,
    as_number,
    as_numbers,
    as_path,
    as_seed,
    as_text,
    check_kind,
    check_name,
)
from vrx_mj.errors import CommandError, RecordError, UnknownNameError, VrxError


def refusal(function, *arguments):
    with pytest.raises(VrxError) as refused:
        function(*arguments)
    return str(refused.value)


def test_whole_numbers():
    assert [as_int("n", value, -2, 3) for value in (-2, 3, np.int8(1), True)] == [-2, 3, 1, 1]
    assert as_int("n", 10**30) == 10**30
    for value in (-3, 4):
        assert refusal(as_int, "n", value, -2, 3) == f"invalid n {value}: a whole number from -2 to 3 is needed"
    assert refusal(as_int, "n", 0, 1) == "invalid n 0: a whole number of 1 or more is needed"
    assert (
        refusal(as_int, "n", 10**9, 0, 123456789)
        == "invalid n 1000000000: a whole number from 0 to 123456789 is needed"
    )
    for value in (1.0, "1", None):
        assert refusal(as_int, "n", value) == f"invalid n {value!r}: a whole number is needed"


def test_seeds():
    assert [as_seed(0), as_seed(2**63 - 1)] == [0, 2**63 - 1]
    for value in (-1, 2**63):
        assert refusal(as_seed, value) == f"invalid seed {value}: a whole number from 0 to 2^63 - 1 is needed"


@pytest.mark.parametrize(
    ("given", "value"), [(1.5, 1.5), (2, 2.0), (np.float32(0.5), 0.5), (np.array(3.0), 3.0), (Decimal("0.25"), 0.25)]
)
def test_numbers(given, value):
    assert as_number(given) == value
    assert type(as_number(given)) is float


@pytest.mark.parametrize(
    "given", ["1", b"1", bytearray(b"1"), 1j, np.array([1.0]), np.ma.array(1.0), None, [], 10**400]
)
def test_what_is_no_number_is_nan(given):
    assert math.isnan(as_number(given))


def test_flags():
    assert [as_flag("f", value) for value in (True, False, 1, 0.0, np.True_)] == [True, False, True, False, True]
    for value in (2, -1, 0.5, "yes", None):
        assert refusal(as_flag, "f", value) == f"invalid f {value!r}: True or False is needed"


def test_several_numbers():
    assert as_numbers("p", [1, 2.0, np.float32(3.0)], 3, 10.0) == (1.0, 2.0, 3.0)
    assert as_numbers("p", (value for value in range(6)), 6, 10.0) == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
    for given in ([1, 2], [1, 2, 3, 4], [1, 2, 10.0], [1, 2, -10.0], [1, 2, math.nan], np.array(1.0), 3):
        assert refusal(as_numbers, "p", given, 3, 10.0).endswith(": three numbers below 10 are needed")
    assert refusal(as_numbers, "p", "abc", 3, 10.0) == "invalid p 'abc': three numbers below 10 are needed"
    assert refusal(as_numbers, "p", [], 6, 1e6) == "invalid p []: six numbers below 1e+06 are needed"


def test_paths(tmp_path):
    assert as_path("path", str(tmp_path)) == tmp_path
    assert as_path("path", tmp_path / "none") == tmp_path / "none"
    assert as_path("path", "a" * 255) == Path("a" * 255)
    assert refusal(as_path, "path", "a" * 256).endswith(": the name is too long")
    for given in (b"a", "a\0b", "\ud800", 3, None):
        assert refusal(as_path, "path", given).endswith(": a path is needed")
    with pytest.raises(RecordError):
        as_path("path", None, RecordError)


def test_texts_kinds_and_names():
    assert as_text("t", "héé") == "héé"
    for given in ("\ud800", b"a", 3):
        assert refusal(as_text, "t", given).endswith(": text is needed")
    check_kind("f", 1, int, "a number")
    assert refusal(check_kind, "f", "1", int, "a number") == "f takes a number, not '1'"
    with pytest.raises(CommandError):
        check_kind("f", "1", int, "a number")
    check_name("boat", "a", ["a", "b"])
    for given in ("c", None, 1):
        with pytest.raises(UnknownNameError):
            check_name("boat", given, ["a", "b"])
