"""What is told while kernels are compiled."""

import pytest

import vrx_mj.physics.kernel as module
from vrx_mj.physics.kernel import kernel
from vrx_mj.runtime.warmup import compile_notice


def _twice(x):
    return 2.0 * x


@pytest.mark.parametrize("writable", [True, False])
def test_where_nothing_can_be_kept_it_is_said_what_helps(tmp_path, monkeypatch, capsys, writable):
    monkeypatch.setattr(module, "FOLDER", tmp_path if writable else None)
    twice = kernel(_twice)
    with compile_notice(twice, "a kernel", 7):
        assert twice(2.0) == 4.0
    often = (
        "for this machine, once"
        if writable
        else "for this process only, since no cache folder can be used: set VRX_MJ_CACHE to one of your own"
    )
    first, last = capsys.readouterr().err.splitlines()
    assert first == f"vrx_mj: compiling a kernel {often}; it takes about 7 s"
    assert last.strip() == "vrx_mj: compiled 1 kernels"
    with compile_notice(twice):
        twice(3.0)
    assert capsys.readouterr().err == ""


def test_nothing_is_said_where_nothing_is_compiled(tmp_path, monkeypatch, capsys):
    """A picture of a calm sea calls no kernel of the sea's surface, and would announce it for ever."""
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    for _ in range(2):
        with compile_notice(kernel(_twice), "a kernel", 7):
            pass
    assert capsys.readouterr().err == ""
