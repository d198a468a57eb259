"""What only kernels call: without machine code of its own, kept, taken into callers, and as good as any other."""

import math

import pytest

import vrx_mj.physics.kernel as module
from vrx_mj.physics.kernel import allocating_kernel


def _root(x):
    if x < 0:
        raise ValueError("no root of", x)
    print("root of", x)
    return math.sqrt(x)


def _caller(inner):
    def outer(x):
        return 2.0 * inner(x)

    return outer


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """An empty cache."""
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    return tmp_path


def callee(compiled):
    """The form that other kernels call."""
    return compiled._callee


def machine_code(compiled):
    (result,) = compiled.overloads.values()
    return result.library._get_compiled_object()


def as_it_is_in_python(outer, capsys):
    """Whether a kernel around `_root` returns, prints and raises what Python would."""
    assert outer(9.0) == 6.0
    assert capsys.readouterr().out == "root of 9.0\n"
    with pytest.raises(ValueError, match="no root of") as raised:
        outer(-4.0)
    return raised.value.args == ("no root of", -4.0)


def test_it_works_when_compiled_and_when_taken_from_the_cache_into_another_caller(capsys):
    first = allocating_kernel(_root)
    assert as_it_is_in_python(allocating_kernel(_caller(first)), capsys)
    assert callee(first).stats.cache_misses

    loaded = allocating_kernel(_root)
    assert as_it_is_in_python(allocating_kernel(_caller(loaded)), capsys)
    assert callee(loaded).stats.cache_hits
    assert not callee(loaded).stats.cache_misses


def test_it_has_no_machine_code_of_its_own(capsys):
    inner = allocating_kernel(_root)
    outer = allocating_kernel(_caller(inner))
    assert outer(9.0) == 2.0 * inner(9.0)
    assert capsys.readouterr().out == "root of 9.0\n" * 2
    assert 3 * len(machine_code(callee(inner))) < len(machine_code(inner)) < len(machine_code(outer))
